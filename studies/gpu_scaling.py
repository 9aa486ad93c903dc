"""Speed of runs on one, two, four and eight GPUs of one machine.

    python studies/gpu_scaling.py --out results
    python studies/gpu_scaling.py --out results --samples 262144 --buildings 20000 --repeats 1

The study measures three runs on each number of GPUs: five-storey buildings with their peak drifts, the same buildings
with counts of damage states only, and the city of studies/metropolis.py. It writes gpu_scaling.csv with the times of
`simulate`, of the kernels on the busiest GPU, and of the host, and gpu_scaling.png. Results on several GPUs must have
the same bits as on one; the study stops if they do not.
"""

from __future__ import annotations

import csv
import gc
import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from metropolis import PAIRS, build_region
from parts.benchmark.machine import available_devices, gpus
from parts.command_line import parser_of, save_figures
from tqdm import tqdm

import warpdyn as wd

COUNTS = (1, 2, 4, 8)  # numbers of GPUs
MOTIONS = 16  # base motions of the five-storey buildings, white noise
STEPS = 2000  # of a base motion
LIMITS = {"slight": 0.003, "moderate": 0.006, "extensive": 0.02, "complete": 0.05}  # storey drift ratios
COLUMNS = ("run", "gpus", "histories", "steps", "wall", "kernels", "sampling", "integrating", "gpu", "source")
LABELS = {
    "drifts": "five storeys, peak drifts of each sample",
    "counts": "five storeys, counts of damage states",
    "city": "city, statistics of buildings and events",
}


def storeys_scene() -> wd.Scene:
    """Return five bilinear storeys with a random stiffness under white noise: most of the work is in the kernel."""
    rng = np.random.default_rng(0)
    motions = [wd.GroundMotion(rng.normal(size=STEPS), 0.01, f"noise {k}") for k in range(MOTIONS)]
    building = wd.ShearBuilding(
        [2e5] * 5,
        [3e8] * 5,
        [3.2] * 5,
        law="bilinear",
        yield_force=2e6,
        hardening_ratio=0.03,
        damping="rayleigh",
        damping_ratio=0.05,
    )
    stiffness = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    return wd.Scene(building, wd.Cloud(motions), stiffness, recorders=("drift",), tail=0.0)


def build_runs(samples: int, buildings: int, seed: int) -> dict[str, tuple[int, Callable[[list[str]], xr.Dataset]]]:
    """Return the number of histories of each run, and the function that makes the run on a list of devices."""
    scene = storeys_scene()
    common: dict[str, Any] = {"structures": max(1, samples // MOTIONS), "method": "rk4", "step": 0.01, "seed": seed}
    region = build_region(buildings, seed)
    counts = wd.DamageCounts(LIMITS)
    return {
        "drifts": (samples, lambda device: wd.simulate(scene, device=device, **common)),
        "counts": (samples, lambda device: wd.simulate(scene, device=device, statistics=counts, **common)),
        "city": (
            region.stock.portfolio.buildings * 2 * PAIRS,
            lambda device: wd.simulate(region.scene, device=device, seed=seed, statistics=region.statistics),
        ),
    }


def measure(simulate: Callable[[list[str]], xr.Dataset], devices: list[str], repeats: int) -> tuple[dict, str]:
    """Return the times [s] of the fastest repetition, and a digest of all numbers of the result.

    "kernels" is the time of the busiest GPU, "sampling" and "integrating" are times of the host: for drawing samples,
    and for launching kernels and waiting for them.
    """
    best: dict[str, float] = {}
    for _ in range(repeats + 1):  # the first loads the kernels
        gc.collect()
        started = time.perf_counter()
        run = simulate(devices)
        wall = time.perf_counter() - started
        if not best or wall < best["wall"]:
            parts = {name: float(run.attrs[f"seconds_{name}"]) for name in ("in_kernels", "sampling", "integrating")}
            best = {"wall": wall, "kernels": parts.pop("in_kernels"), **parts}
    digest = hashlib.sha256()
    for name in sorted(run.data_vars):
        digest.update(np.ascontiguousarray(run[name].values).tobytes() if run[name].dtype != object else b"")
    return best, digest.hexdigest()


def draw(rows: list[dict[str, Any]]) -> Figure:
    """Draw how many times as fast each run is on several GPUs as on one, with the ideal line."""
    figure, panels = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained", sharey=True)
    for name, label in LABELS.items():
        found = [row for row in rows if row["run"] == name]
        counts = [int(row["gpus"]) for row in found]
        for panel, part in zip(panels, ("wall", "kernels"), strict=True):
            panel.plot(counts, [float(found[0][part]) / float(row[part]) for row in found], "o-", label=label)
    most = max(int(row["gpus"]) for row in rows)
    for panel, title in zip(panels, ("simulate, from call to dataset", "kernels of the busiest GPU"), strict=True):
        panel.plot([1, most], [1, most], ":", color="0.4", label="number of GPUs")
        panel.set(xlabel="GPUs", title=title, xticks=[count for count in COUNTS if count <= most])
        panel.grid(alpha=0.3)
    panels[0].set_ylabel("times as fast as on one GPU")
    panels[0].legend(fontsize=8)
    return figure


def main() -> None:
    """Run the study from the command line: measure, print, write gpu_scaling.csv and draw gpu_scaling.png."""
    parser = parser_of(__doc__)
    parser.add_argument("--samples", type=int, default=2**23, help="five-storey buildings [%(default)s]")
    parser.add_argument("--buildings", type=int, default=1_840_000, help="buildings of the city [%(default)s]")
    parser.add_argument("--repeats", type=int, default=3, help="repetitions; the fastest counts [%(default)s]")
    parser.add_argument("--seed", type=int, default=0, help="seed of every random draw [%(default)s]")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    target = arguments.out / "gpu_scaling.csv"
    here = [device for device in available_devices() if device != "cpu"]
    if not here:
        raise SystemExit("this study needs at least one GPU; warpdyn finds none (see docs/tutorials/gpu.md)")
    counts = [count for count in COUNTS if count <= len(here)]
    rows: list[dict[str, Any]] = []
    for name, (histories, simulate) in build_runs(arguments.samples, arguments.buildings, arguments.seed).items():
        first = ""
        for count in tqdm(counts, desc=name, unit="count", disable=None):
            times, digest = measure(simulate, here[:count], arguments.repeats)
            first = first or digest
            if digest != first:
                raise SystemExit(f"{name}: the results on {count} GPUs differ from those on one")
            steps = STEPS if name != "city" else ""
            row = {"run": name, "gpus": count, "histories": histories, "steps": steps, **times, "gpu": gpus(here[:1])}
            rows.append(row | {"source": f"warpdyn {wd.__version__}"})
            spoken = ", ".join(f"{part} {seconds:.3f} s" for part, seconds in times.items())
            print(f"{name} on {count} GPUs, {histories:,} histories: {spoken}", flush=True)
    write(rows, target)
    save_figures({"gpu_scaling": draw(rows)}, arguments.out)
    print(f"equal bits on {', '.join(map(str, counts))} GPUs; wrote {target} and gpu_scaling.png")


def write(rows: list[dict[str, Any]], target: Path) -> None:
    """Write the measurements to a CSV file."""
    with target.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        writer.writeheader()
        writer.writerows(
            {name: f"{value:.4g}" if isinstance(value, float) else value for name, value in row.items()} for row in rows
        )


if __name__ == "__main__":
    main()
