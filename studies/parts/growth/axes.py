"""The scenes of the study growth: each axis varies one size of a run and keeps the others."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY

INTERVAL = 0.005  # s, between the values of the motions, and the step
REPETITIONS = 3
LONG = 2.0  # s, beyond which a run is not repeated
STEPS = 500  # of each motion, but along the axis of steps
STOREYS = 5  # but along the axis of storeys


@dataclass(frozen=True)
class Size:
    """One point of an axis: how many of each there are."""

    samples: int
    storeys: int
    steps: int
    motions: int

    @property
    def storey_steps(self) -> int:
        """Steps of all samples times storeys, to which a kernel's time should be in proportion."""
        return self.samples * self.storeys * self.steps


def axes(samples: int) -> dict[str, list[Size]]:
    """Return the points of each axis.

    Args:
        samples: The most samples of the axis of samples; the other axes take the storey steps of a sixteenth of them.
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
    """Return yielding buildings of scattered stiffness under filtered noise of one peak acceleration."""
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
    """Return the least wall time of `simulate` and the least time in its kernels [s], with kernels compiled."""
    scene = build_scene(size)

    def run(structures: int) -> tuple[float, float]:
        begun = time.perf_counter()
        result = wd.simulate(
            scene, structures=structures, seed=1, method="rk4", step=INTERVAL, device=device, keep_inputs=False
        )
        return time.perf_counter() - begun, result.attrs["seconds_in_kernels"]

    run(1)  # compiles
    found = [run(size.samples // size.motions)]
    while len(found) < REPETITIONS and found[-1][0] < LONG:
        found.append(run(size.samples // size.motions))
    whole, kernels = np.min(found, axis=0)
    return {"simulate": float(whole), "kernels": float(kernels)}


def steps_of_cost(sizes: np.ndarray, costs: np.ndarray) -> Iterator[tuple[float, float, float]]:
    """Yield each pair of neighbouring sizes with the cost of the larger over that of the smaller."""
    for i in range(len(sizes) - 1):
        yield sizes[i], sizes[i + 1], costs[i + 1] / costs[i]


def exponent(sizes: np.ndarray, seconds: np.ndarray) -> float:
    """Return the slope of log time over log size through the upper half of the sizes."""
    upper = slice(len(sizes) // 2, None)
    return float(np.polyfit(np.log(sizes[upper]), np.log(seconds[upper]), 1)[0])
