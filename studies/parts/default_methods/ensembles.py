"""Ensembles of shear buildings for each storey law, with errors and times of methods on them."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
from peers.storey_laws import LAWS

import warpdyn as wd
from parts.accuracy_speed.scenes import strong_part
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.integration.stability_guard import guard, integrate_guarded
from warpdyn.engine.kernels.auxiliary.frequencies import circular_frequencies
from warpdyn.engine.kernels.queues import seconds_in_kernels
from warpdyn.engine.methods.defaults import HIGHEST_LIGHT_MODE, LIGHT_RATIO, LIGHT_RAYLEIGH
from warpdyn.foundations.core.output_variables import DIVERGED
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.records import far_field

YIELD_DRIFT, FLOOR_MASS, HEIGHT, TAIL = 0.015, 2.0e5, 3.0, 1.0  # m, kg, m, s
FINER = 16  # steps of the float64 reference per default step
TAPERED = "tapered"  # the stiffness decreases linearly from the first storey to two thirds of it in the last one
PARABOLIC = "parabolic"  # the stiffness decreases like the shear under equal floor forces, to a fifth at the top
DAMPING_RATIO = 0.05
LIGHT_MODES = (1, HIGHEST_LIGHT_MODE)  # damped modes of light Rayleigh damping, for three storeys or more
SCATTER = {
    "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
    "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.1)),
}


@cache
def records() -> tuple[wd.GroundMotion, ...]:
    """Return the strong parts of the far-field records, which have steps of 5, 10 and 20 ms."""
    return tuple(strong_part(motion) for motion in far_field())


def build_scene(
    law: str,
    storeys: int,
    period: float,
    motions: list[wd.GroundMotion],
    levels: tuple[float, ...],
    recorders: tuple[str, ...] | None = ("drift",),
    shape: str = TAPERED,
    damping: str = "rayleigh",
) -> wd.Scene:
    """Return the scene of buildings with one storey law under records scaled to stripes.

    Args:
        law: Name of the storey law, a key of `peers.storey_laws.LAWS`.
        storeys: Number of storeys.
        period: First period [s].
        motions: The records.
        levels: Spectral accelerations at the first period, divided by the value at which the building yields.
        recorders: Argument `recorders` of `Scene`.
        shape: Decrease of the stiffness over the height: TAPERED or PARABOLIC.
        damping: Damping of `ShearBuilding`, with the ratio DAMPING_RATIO in the first mode. "storey": dampers in the
            lower half of the storeys. "light_rayleigh": Rayleigh damping with the ratio LIGHT_RATIO in LIGHT_MODES.
    """
    below, mass = np.arange(storeys) / max(storeys - 1, 1), np.full(storeys, FLOOR_MASS)
    relative = 1.5 - 0.5 * below if shape == TAPERED else 1.0 - 0.8 * below**2
    first = circular_frequencies(mass[None], relative[None])[0, 0]
    stiffness = relative * (2 * np.pi / period / first) ** 2
    own = {} if law == "elastic" else {"yield_force": stiffness * YIELD_DRIFT, **LAWS[law].parameters(YIELD_DRIFT)}
    if damping == "storey":
        dampers = np.arange(storeys) < (storeys + 1) // 2
        own["damping_coefficient"] = 2 * DAMPING_RATIO * period / (2 * np.pi) * stiffness * dampers
    elif damping == LIGHT_RAYLEIGH:
        damping = "rayleigh"
        own["damping_ratio"] = LIGHT_RATIO
        if storeys >= LIGHT_MODES[1]:
            own["damping_modes"] = LIGHT_MODES
    elif damping != "none":
        own["damping_ratio"] = DAMPING_RATIO
    building = wd.ShearBuilding(mass, stiffness, HEIGHT, law=law, damping=damping, **own)
    yielding = 1.25 * stiffness[0] * YIELD_DRIFT / mass.sum() / STANDARD_GRAVITY  # g; 1.25: effect of higher modes
    measure = wd.SpectralAcceleration(building.fundamental_period)
    design = wd.Stripes(list(motions), [yielding * level for level in levels], measure)
    return wd.Scene(building, design, scatter=SCATTER, recorders=recorders, tail=TAIL)


@dataclass
class Case:
    """An ensemble with its default numbers of steps, and its reference solution.

    Args:
        scene: The scene.
        structures: Number of structures.
        device: Device on which the ensemble runs, such as "cpu".
        seed: Seed of every random draw.
        finer: Number of steps of the reference per default step.
        known: Drawn structures, which `prepare` keeps for later runs.
    """

    scene: wd.Scene
    structures: int
    device: str
    seed: int = 1
    finer: int = FINER
    known: dict = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        self.substeps = self._prepared("rk4", "float32")[0].schedule.substeps.copy()

    @cached_property
    def reference(self) -> dict[str, np.ndarray]:
        """Outputs of the reference solution: exact or RK4, in float64, at the finer step."""
        method = "exact" if self.scene.structure.law == "elastic" else "rk4"
        run = self.run(method, self.finer, "float64")
        return integrate_guarded(run, np.arange(run.sample.size))

    def _prepared(self, method: str, dtype: str) -> tuple:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            terms = {"seed": self.seed, "device": self.device, "threads": 1, "known": self.known}
            return prepare(self.scene, structures=self.structures, method=method, dtype=dtype, **terms)

    def run(self, method: str, steps: float, dtype: str = "float32") -> Ensemble:
        """Return the ensemble with `steps` steps per default step of RK4, and more if stability requires them."""
        run, vibration = self._prepared(method, dtype)
        finer = np.maximum(1, np.ceil(steps * self.substeps - 1e-9).astype(np.int64))
        run.schedule = run.restepped(np.arange(run.sample.size), finer)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            guard(run, vibration, "substep")
        return run

    def errors(self, run: Ensemble) -> np.ndarray:
        """Return the largest error of the peak storey drifts of each sample, shape [sample].

        The error is divided by the largest peak drift of the sample. It is infinite if the sample failed.
        """
        found = integrate_guarded(run, np.arange(run.sample.size))
        own, true = (each["peak_storey_drift"].astype(np.float64) for each in (found, self.reference))
        error = np.abs(own - true).max(axis=0) / np.abs(true).max(axis=0)
        return np.where(np.isfinite(error) & (found["status"] < DIVERGED), error, np.inf)


def seconds_of(run: Ensemble) -> float:
    """Return the time of an integration [s]: processor time on a CPU, time in kernels on a GPU."""
    part = run.select(np.arange(run.sample.size))
    part.pack()
    rows = part.model.blank_outputs(part.sample.size)
    part.queue.begin()
    started = time.process_time()
    part.start(rows)
    part.finish(rows)
    return time.process_time() - started if run.queue.device == "cpu" else seconds_in_kernels([part.queue])
