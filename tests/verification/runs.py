"""Runs of warpdyn for the verification problems: one structure, double precision, on the CPU."""

from __future__ import annotations

import numpy as np
import xarray as xr

import warpdyn as wd
from warpdyn.foundations.core.plausibility import CHECKS

STEP_OF_MOTIONS = 0.01  # s, of the motions of problems on lumped structures
AS_GIVEN = wd.meant_as_given(*CHECKS)  # problems of textbooks have units such as kips and inches


@AS_GIVEN
def history(structure, load, step: float, method: str = "rk4", **scene) -> xr.Dataset:
    """Return the run of one structure with its whole history.

    Args:
        structure: A ShearBuilding or LinearSystem.
        load: Its excitation.
        step: Step of the integration [s].
        method: Integration method.
        **scene: Further arguments of Scene; no recorders and no free vibration after a motion by default.
    """
    options = {"recorders": (), "tail": None if isinstance(load, wd.FreeVibration | wd.HarmonicForce) else 0.0} | scene
    run = wd.simulate(
        wd.Scene(structure, load, **options),
        method=method,
        step=step,
        dtype="float64",
        histories=wd.Histories(),
        device="cpu",
    )
    assert run["status"].item() == 0
    return run


def motion(values: np.ndarray, step: float = STEP_OF_MOTIONS) -> wd.GroundMotion:
    """Return a ground motion."""
    return wd.GroundMotion(values, step, "motion")


def pair(x: np.ndarray, y: np.ndarray) -> wd.PairOfMotions:
    """Return a pair of motions."""
    return wd.PairOfMotions(motion(x), motion(y))


def states(run, name: str, places: list[str]) -> np.ndarray:
    """Return a variable of a history at springs or degrees of freedom by their names, shape [time, place]."""
    values = run[name].isel(history=0)
    return values.sel({values.dims[1]: places}).values


def frequencies(structure: wd.LumpedStructure) -> np.ndarray:
    """Return circular frequencies [rad/s]."""
    return structure.modal()["circular_frequency"].values


def at(run: xr.Dataset, name: str, times, dof: int = 0) -> np.ndarray:
    """Return a variable of a history at some times, which are steps of the run, shape [time]."""
    rows = np.round(np.asarray(times) / float(run["time"][1] - run["time"][0])).astype(int)
    np.testing.assert_allclose(run["time"].values[rows], times, rtol=1e-9, atol=1e-9)
    return run[name].values[0, rows, dof]


def curve(run: xr.Dataset, name: str = "displacement", dof: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return times and a variable of a history."""
    return run["time"].values, run[name].values[0, :, dof]


@AS_GIVEN
def storey(mass: float, stiffness: float, **parameters) -> wd.ShearBuilding:
    """Return one storey of 3 m."""
    return wd.ShearBuilding(mass, stiffness, 3.0, **parameters)


@AS_GIVEN
def loop(building: wd.ShearBuilding, drift: np.ndarray) -> np.ndarray:
    """Return the storey forces of a one-storey building along drifts."""
    return wd.storey_hysteresis(building, drift)["storey_force"].values[:, 0]
