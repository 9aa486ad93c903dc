"""Times of a new process that runs the fragility study: imports, first and second run.

Usage, in the folder `studies`: python -m parts.benchmark.start DEVICE

The program imports warpdyn, runs one structure of the study studies/p695_fragility.py twice, and prints the time of
each [s] as JSON.
"""

import json
import sys
import time

begun = time.perf_counter()

from p695_fragility import build_scene  # noqa: E402 (the import is timed)

import warpdyn as wd  # noqa: E402

imported = time.perf_counter()
scene = build_scene()
seconds = {"importing": imported - begun}
for name in ("first_run", "second_run"):
    started = time.perf_counter()
    wd.simulate(scene, device=sys.argv[1])
    seconds[name] = time.perf_counter() - started
print(json.dumps(seconds))
