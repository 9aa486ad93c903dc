"""Case that all peers (compared programs) integrate: shear chains under one base motion; and timing of runs."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

# Bouc-Wen law of all storeys: F = k (a d + (1 - a) dy z), dy dz/dt = v - (|v| z + v |z|) / 2.
HARDENING_RATIO, YIELD_DRIFT = 0.05, 0.01  # a [1] and dy [m]
HEIGHT = 3.0  # height of all storeys [m]

# After a warm-up there are at least LEAST_RUNS runs, until they have taken TIMED_FOR seconds. The clock of a GPU needs
# about 0.2 s of work to speed up.
LEAST_RUNS, TIMED_FOR = 2, 0.3


class Missing(Exception):
    """Error: a package or compiler that a peer (compared program) needs is not installed."""


@dataclass(frozen=True, eq=False)
class Case:
    """An ensemble of shear chains under one base motion, with the settings of the integration.

    Args:
        law: Name of the storey law, a key of `peers.storey_laws.LAWS`; most peers support only "elastic" and
            "bouc_wen".
        dtype: Number type, "float32" or "float64".
        device: Device of the integration, "cpu" or "cuda:0".
        step: Integration step [s].
        acceleration: Base acceleration at every step [m/s2], shape [step + 1]; it is linear between these values.
        stiffness: Storey stiffness [N/m], shape [structure, storey], from the ground up.
        damping_coefficient: Viscous damping coefficient of the storeys [N s/m], shape [structure, storey].
        mass: Floor mass [kg], shape [structure, storey].
        structure: Index of the structure of each sample, shape [sample].
        scale: Factor on the base acceleration of each sample [1], shape [sample].
        recorders: "drift" for peak storey drifts, or "all" for the default recorders of warpdyn, which few peers
            support.
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
        """Number of storeys of each structure."""
        return self.stiffness.shape[1]

    @property
    def samples(self) -> int:
        """Number of samples of the ensemble."""
        return self.structure.size

    @property
    def steps(self) -> int:
        """Number of integration steps of each sample."""
        return self.acceleration.size - 1

    def arrays(self) -> tuple[np.ndarray, ...]:
        """Return stiffness, damping coefficient, inverse mass [sample, storey], scale and acceleration in `dtype`."""
        by_sample = (values[self.structure] for values in (self.stiffness, self.damping_coefficient, 1 / self.mass))
        return tuple(np.ascontiguousarray(v, self.dtype) for v in (*by_sample, self.scale, self.acceleration))

    def write(self, path: Path) -> None:
        """Write the case to an npz file."""
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})

    @classmethod
    def read(cls, path: Path) -> Case:
        """Read the case in an npz file that `write` wrote."""
        with np.load(path) as file:
            return cls(**{name: values if values.ndim else values.item() for name, values in file.items()})


@dataclass(frozen=True, eq=False)
class Measured:
    """Result of a peer (compared program) for one case.

    Args:
        seconds: Shortest time of several integrations of all samples [s].
        peak_storey_drift: Largest absolute storey drift at any step [m], shape [sample, storey].
        note: Remark on the measurement.
    """

    seconds: float
    peak_storey_drift: np.ndarray
    note: str = ""


def least_seconds(run: Callable[[], object]) -> float:
    """Run a function several times after a warm-up, and return the shortest time [s].

    Args:
        run: Function that runs the integration and waits until it is complete. If it returns a float, this is its time
            [s]; otherwise the clock counts.
    """
    seconds: list[float] = []
    while len(seconds) < LEAST_RUNS or sum(seconds) < TIMED_FOR:
        started = time.perf_counter()
        told = run()
        clock = time.perf_counter() - started
        seconds.append(told if isinstance(told, float) else clock)  # other results of a run are not times
    return min(seconds)
