"""Scenes of the study growth: along each axis, one size of a run changes."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY

INTERVAL = 0.005  # interval between the values of the motions, and integration step [s]
REPETITIONS = 3  # number of timed runs
LONG = 2.0  # a run whose kernels take longer than this is not repeated [s]; the first run may compile kernels
STEPS = 500  # number of steps of a motion, except along the axis of steps
STOREYS = 5  # number of storeys, except along the axis of storeys


@dataclass(frozen=True)
class Size:
    """One point of an axis: numbers of samples, storeys, steps and motions."""

    samples: int
    storeys: int
    steps: int
    motions: int

    @property
    def storey_steps(self) -> int:
        """Number of samples times storeys times steps; the time of a kernel should be proportional to it."""
        return self.samples * self.storeys * self.steps


def axes(samples: int) -> dict[str, list[Size]]:
    """Return the points of each axis, as a mapping from the name of the axis.

    Args:
        samples: Largest number of samples on the axis of samples. The points of the other axes have as many storey
            steps as a sixteenth of these samples.
    """
    shared = max(samples // 16, 256)

    def fitting(storeys: int, steps: int) -> int:
        return max(256, shared * STOREYS * STEPS // (storeys * steps))

    powers = range(8, max(samples.bit_length(), 10))
    lengths = [100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000]
    counts = [1, 3, 10, 30, 100, 300, 1000, 3000, 10_000]
    return {
        "samples": [Size(2**k, STOREYS, STEPS, 1) for k in powers],
        "storeys": [
            Size(fitting(n, STEPS), n, STEPS, 1) for n in (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 16, 17, 20, 24, 30, 40, 60)
        ],
        "steps": [Size(fitting(STOREYS, n), STOREYS, n, 1) for n in lengths],
        "motions": [Size(max(shared // n, 1) * n, STOREYS, STEPS, n) for n in counts if n <= max(shared, 1)],
    }


def build_scene(size: Size) -> wd.Scene:
    """Return yielding buildings with scattered stiffness under white noise with a peak acceleration of 0.4 g."""
    building = wd.ShearBuilding(
        mass=[2.0e5] * size.storeys,
        stiffness=[2.0e8] * size.storeys,
        height=[3.0] * size.storeys,
        law="bilinear",
        yield_force=2.0e6,
        hardening_ratio=0.05,
        damping="rayleigh",
        damping_ratio=0.05,
    )
    random = np.random.default_rng(7)
    values = random.normal(size=(size.motions, size.steps)).astype(np.float32)
    values *= 0.4 * STANDARD_GRAVITY / np.abs(values).max(axis=1, keepdims=True)
    motions = [wd.GroundMotion(row, INTERVAL, f"noise {i}") for i, row in enumerate(values)]
    scatter: Mapping[str, wd.RandomFactor] = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1))}
    return wd.Scene(building, wd.Cloud(motions), scatter=scatter, recorders=("drift",), tail=0.0)


def measure(size: Size, device: str | None) -> dict[str, float]:
    """Return the shortest wall time of `simulate` and the shortest time in its kernels [s], without compilation."""
    scene = build_scene(size)

    def run(structures: int) -> tuple[float, float]:
        begun = time.perf_counter()
        result = wd.simulate(
            scene, structures=structures, seed=1, method="rk4", step=INTERVAL, device=device, keep_inputs=False
        )
        return time.perf_counter() - begun, result.attrs["seconds_in_kernels"]

    run(1)  # compiles the kernels
    found = [run(size.samples // size.motions)]
    while len(found) < REPETITIONS and found[-1][1] < LONG:
        found.append(run(size.samples // size.motions))
    whole, kernels = np.min(found, axis=0)
    return {"simulate": float(whole), "kernels": float(kernels)}


def steps_of_cost(sizes: np.ndarray, costs: np.ndarray) -> Iterator[tuple[float, float, float]]:
    """Yield each pair of neighbouring sizes, with the ratio of the cost at the larger to the cost at the smaller."""
    for i in range(len(sizes) - 1):
        yield sizes[i], sizes[i + 1], costs[i + 1] / costs[i]


def exponent(sizes: np.ndarray, seconds: np.ndarray) -> float:
    """Return the slope of ln(time) over ln(size), fitted to the upper half of the sizes."""
    upper = slice(len(sizes) // 2, None)
    return float(np.polyfit(np.log(sizes[upper]), np.log(seconds[upper]), 1)[0])
