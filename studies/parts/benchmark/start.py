"""Time of a process of the main job before its kernels run: python -m parts.benchmark.start DEVICE, in studies.

Imports warpdyn, runs one structure of the main job twice, and prints the seconds of each as JSON.
"""

import json
import sys
import time

begun = time.perf_counter()

from p695_fragility import build_scene  # noqa: E402 (what is imported is timed)

import warpdyn as wd  # noqa: E402

imported = time.perf_counter()
scene = build_scene()
seconds = {"importing": imported - begun}
for name in ("first_run", "second_run"):
    started = time.perf_counter()
    wd.simulate(scene, device=sys.argv[1])
    seconds[name] = time.perf_counter() - started
print(json.dumps(seconds))
