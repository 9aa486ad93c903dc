"""How the fingerprints' scenes call warpdyn: what a public renaming changes is spelt here once, and nowhere else.

A scene of fingerprints is a function without arguments, registered by name, that returns a dataset, text, numbers, or
a mapping of names to these.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import xarray as xr

import warpdyn as wd

SCENES: dict[str, Callable[[], object]] = {}
# Names that a dataset of today has under another name than one of `take`: new name -> old name. They are applied to
# the names of variables and coordinates, and to text in them, such as the names of demands.
RENAMED: dict[str, str] = {
    "samples_per_history": "samples_a_history",
    "motion_index": "record",
    "archetype_index": "archetype",
    "archetype": "archetype_name",
}
ADDED = ("motion", "earlier_history")  # coordinates that a dataset has had since the first `take`
USED = {"device": "cpu"}  # what all runs are run on
STEP = 0.02  # of all motions [s]
DAMPED = {"damping": "rayleigh", "damping_ratio": 0.05}
YIELDING = {"law": "bilinear", "yield_force": 1500.0, "hardening_ratio": 0.05}


def fingerprint(name: str, *arguments: object, **keywords: object) -> Callable:
    """Return a decorator that registers a function, with these arguments, as a scene of fingerprints."""

    def register(function: Callable) -> Callable:
        if name in SCENES:
            raise ValueError(f"two scenes are called {name!r}")
        SCENES[name] = lambda: function(*arguments, **keywords)
        return function

    return register


# What has a name that may change.


def make_scene(
    structure: object, excitation: object, recorders: tuple[str, ...] | None = None, **rest: object
) -> wd.Scene:
    return wd.Scene(structure, excitation, recorders=recorders, **rest)


def run(
    scene: wd.Scene,
    structures: int = 1,
    *,
    checked_share: float | None = None,
    target_error: float | None = None,
    dtype: str | None = "float64",
    threads: int | None = 1,
    **settings: object,
) -> xr.Dataset:
    return wd.simulate(
        scene,
        structures=structures,
        checked_share=checked_share,
        target_error=target_error,
        dtype=dtype,
        threads=threads,
        device=USED["device"],
        **settings,
    )


def run_portfolio(
    portfolio: wd.Portfolio,
    excitation: object,
    *,
    recorders: tuple[str, ...] | None = None,
    checked_share: float | None = None,
    dtype: str | None = "float64",
    **settings: object,
) -> xr.Dataset:
    of_scene = {key: settings.pop(key) for key in ("collapse_drift_ratio", "tail", "title") if key in settings}
    scene = wd.Scene(portfolio, excitation, recorders=recorders, **of_scene)
    run = {"checked_share": checked_share, "dtype": dtype, "threads": 1, "device": USED["device"]}
    return wd.simulate(scene, **run, **settings)


def make_plan(scene: wd.Scene, error: float, structures: int = 1, **settings: object) -> wd.MethodChoice:
    return wd.plan(scene, error, structures=structures, threads=1, device=USED["device"], **settings)


def spectra(motions: list[wd.GroundMotion], periods: object, damping_ratios: object) -> xr.Dataset:
    return wd.response_spectra(motions, periods, damping_ratios, device=USED["device"], threads=1)


def factor(distribution: object, **rest: object) -> object:
    return wd.RandomFactor(distribution, **rest)


def value(distribution: object, **rest: object) -> object:
    return wd.RandomValue(distribution, **rest)


def listed(values: object) -> object:
    return wd.GivenValues(values)


def individual(motions: list[wd.GroundMotion], **rest: object) -> object:
    return wd.OneMotionPerStructure(motions, **rest)


def sequence(**events: object) -> object:
    return wd.EventSequence(events)


def archetype(building: wd.ShearBuilding, count: int | None = None, *rest: object) -> object:
    return wd.Archetype(building, count, *rest)


def histories(*samples: int, every: int = 1) -> object:
    return wd.Histories(samples, every)


def part_of_event(dataset: xr.Dataset, name: str) -> xr.Dataset:
    return wd.select_event(dataset, name)


def part_of_archetype(dataset: xr.Dataset, name: str) -> xr.Dataset:
    return wd.select_archetype(dataset, name)


def part_of_storeys(dataset: xr.Dataset, first: int, last: int) -> xr.Dataset:
    return wd.select_storeys(dataset, first, last)


# What scenes have in common.


def wave(seed: int, amplitude: float = 4.0, intervals: int = 70) -> np.ndarray:
    """Return a burst of six frequencies [m/s2], rounded so that it is the same everywhere."""
    random = np.random.default_rng(seed)
    frequency, phase = random.uniform(0.8, 6.0, (6, 1)), random.uniform(0.0, 2 * np.pi, (6, 1))
    time = STEP * np.arange(intervals + 1)
    burst = np.sin(np.pi * time / time[-1]) ** 2 * np.sin(2 * np.pi * frequency * time + phase).sum(axis=0)
    return np.round(amplitude * burst / np.abs(burst).max(), 3)


def motion(seed: int, amplitude: float = 4.0, intervals: int = 70) -> wd.GroundMotion:
    return wd.GroundMotion(wave(seed, amplitude, intervals), STEP, f"burst {seed}")


def stripes(*levels: float, seeds: tuple[int, ...] = (1, 2)) -> wd.Stripes:
    return wd.Stripes([motion(seed) for seed in seeds], levels, wd.PeakGroundAcceleration())


def chain(storeys: int = 2, **changes: object) -> wd.ShearBuilding:
    """Return a damped building of storeys that yield at some 4 mm; its first period is 0.5 s at two storeys."""
    given = (
        {"mass": np.full(storeys, 1e3), "stiffness": 4e5 * np.linspace(1.0, 0.8, storeys), "height": 3.0}
        | YIELDING
        | DAMPED
    )
    given = {name: values for name, values in (given | changes).items() if values is not None}
    return wd.ShearBuilding(**given)


def elastic(storeys: int = 2, **changes: object) -> wd.ShearBuilding:
    return chain(storeys, **({"law": "elastic", "yield_force": None, "hardening_ratio": None} | changes))


def dense(dofs: int = 3) -> wd.LinearSystem:
    """Return a linear system of full matrices, whose damping couples its modes."""
    stiffness = 4e5 * (2 * np.eye(dofs) - np.eye(dofs, k=1) - np.eye(dofs, k=-1))
    mass = 1e3 * np.eye(dofs) + 100.0 * (np.eye(dofs, k=1) + np.eye(dofs, k=-1))
    return wd.LinearSystem(mass, 2e-3 * stiffness + np.diag(300.0 * np.arange(1, dofs + 1)), stiffness)


def spread(*names: str, dispersion: float = 0.2) -> dict[str, object]:
    """Return scatter of parameters of storeys."""
    return {name: factor(wd.Lognormal(1.0, dispersion), per="storey") for name in names}


@contextlib.contextmanager
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as path:
        yield Path(path)


def outcome(call: Callable[[], object]) -> object:
    """Return what a call returns, or the kind of the error it raises."""
    try:
        return call()
    except (ValueError, TypeError, RuntimeError) as error:
        return type(error).__name__
