"""The case that all peers measure: an ensemble of shear chains under one base motion; and how a time is taken."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

# The Bouc-Wen law of all storeys: F = k (a d + (1 - a) dy z), dy dz/dt = v - (|v| z + v |z|) / 2.
HARDENING_RATIO, YIELD_DRIFT = 0.05, 0.01  # 1 and m
HEIGHT = 3.0  # m, of all storeys

# After a warm-up, runs are repeated until they have taken this long [s]: a GPU's clock needs about 0.2 s to speed up.
LEAST_RUNS, TIMED_FOR = 2, 0.3


class Missing(Exception):
    """A requirement of a peer is not installed."""


@dataclass(frozen=True, eq=False)
class Case:
    """An ensemble and the terms it is integrated on.

    Args:
        law: A row of `peers.storey_laws.LAWS`; most peers have only "elastic" and "bouc_wen".
        dtype: "float32" or "float64".
        device: "cpu" or "cuda:0".
        step: Integration step [s].
        acceleration: Base acceleration at every step [m/s2], shape [step + 1]; linear in between.
        stiffness: Storey stiffness [N/m], shape [structure, storey], from the ground up.
        damping_coefficient: Viscous damping coefficient of the storeys [N s/m], shape [structure, storey].
        mass: Floor mass [kg], shape [structure, storey].
        structure: Which structure each sample has, shape [sample].
        scale: Factor on the base acceleration, shape [sample].
        recorders: "drift" (peak storey drifts), or "all" (the default recorders of warpdyn; only in few peers).
    """

    law: str
    dtype: str
    device: str
    step: float
    acceleration: np.ndarray
    stiffness: np.ndarray
    damping_coefficient: np.ndarray
    mass: np.ndarray
    structure: np.ndarray
    scale: np.ndarray
    recorders: str = "drift"

    @property
    def storeys(self) -> int:
        """Storeys of each structure."""
        return self.stiffness.shape[1]

    @property
    def samples(self) -> int:
        """Samples of the ensemble."""
        return self.structure.size

    @property
    def steps(self) -> int:
        """Integration steps of each sample."""
        return self.acceleration.size - 1

    def arrays(self) -> tuple[np.ndarray, ...]:
        """Return stiffness, damping coefficient and inverse mass, [sample, storey], scale and acceleration in dtype."""
        by_sample = (values[self.structure] for values in (self.stiffness, self.damping_coefficient, 1 / self.mass))
        return tuple(np.ascontiguousarray(v, self.dtype) for v in (*by_sample, self.scale, self.acceleration))

    def write(self, path: Path) -> None:
        """Write the case to an npz file."""
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})

    @classmethod
    def read(cls, path: Path) -> Case:
        """Return the case of an npz file."""
        with np.load(path) as file:
            return cls(**{name: values if values.ndim else values.item() for name, values in file.items()})


@dataclass(frozen=True, eq=False)
class Measured:
    """Result of a peer.

    Args:
        seconds: Time of the integration of all samples [s], the least of several runs.
        peak_storey_drift: Largest absolute storey drift at any step [m], shape [sample, storey].
        note: Remark on the result.
    """

    seconds: float
    peak_storey_drift: np.ndarray
    note: str = ""


def least_seconds(run: Callable[[], object]) -> float:
    """Return the shortest time [s] of several runs after a warm-up.

    Args:
        run: Runs it, waits until it is done, and returns its time [s], a float, if it knows better than the clock.
    """
    seconds: list[float] = []
    while len(seconds) < LEAST_RUNS or sum(seconds) < TIMED_FOR:
        started = time.perf_counter()
        told = run()
        clock = time.perf_counter() - started
        seconds.append(told if isinstance(told, float) else clock)  # other results of a run are not times
    return min(seconds)
