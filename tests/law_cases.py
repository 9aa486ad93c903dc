"""Reference results of storey laws that warpdyn did not compute: loops, and SDOF systems under a pulse.

The folder law_cases holds the numbers: exact solutions for each segment, ODE solvers, or OpenSees 3.7.1 in short steps.
"""

from __future__ import annotations

import functools
import itertools
import json
from typing import Any

import numpy as np
import xarray as xr
from conftest import ROOT

import warpdyn as wd

SAMPLING = 0.005  # s, of the pulse


@functools.cache
def cases(name: str) -> dict[str, dict[str, Any]]:
    """Return the cases of a file in tests/law_cases by their ids."""
    found = json.loads((ROOT / "tests" / "law_cases" / f"{name}.json").read_text(encoding="utf-8"))
    return {case["id"]: case for case in found["cases"]}


def material_of(case: dict[str, Any]) -> list[float]:
    """Return the numbers of the first OpenSees material of a case, without its name."""
    return case["opensees"][0][1:]


def path_of(case: dict[str, Any], steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return drifts through all turning points of a loop, and the indices at which the case has forces.

    Args:
        case: A case of loops.json.
        steps: Steps between turning points; the fractions of the case must fall on steps.
    """
    turns = np.array([0.0, *case["turning_points"]])
    along = np.arange(1, steps + 1) / steps
    drift = np.concatenate([a + (b - a) * along for a, b in itertools.pairwise(turns)])
    at = np.round(np.array(case["fractions_of_segment"]) * steps).astype(int)
    np.testing.assert_allclose(at / steps, case["fractions_of_segment"], rtol=1e-12)
    segments = np.arange(len(case["turning_points"]))[:, None]
    return drift, segments * steps + at - 1


def loop_error(case: dict[str, Any], storey: wd.ShearBuilding, steps: int) -> float:
    """Return the largest difference of a storey's forces to those of a loop, over the largest force of the loop."""
    drift, at = path_of(case, steps)
    found = wd.storey_hysteresis(storey, drift)["storey_force"].values[:, 0][at]
    expected = np.array(case["force"])
    return float(np.abs(found - expected).max() / np.abs(expected).max())


def run_pulse(case: dict[str, Any], stiffness: float, refined: int = 10, **parameters: Any) -> xr.Dataset:
    """Return the whole history of the SDOF system of a case of dynamic.json.

    Args:
        case: The case.
        stiffness: Initial stiffness of the storey [N/m].
        refined: Samples of the history for each sample of the pulse.
        **parameters: Law, devices and their parameters.
    """
    building = wd.ShearBuilding(
        case["mass"], stiffness, 3.0,
        damping="storey", damping_coefficient=case["damping_coefficient"], **parameters,
    )  # fmt: skip
    coarse = np.arange(0, case["duration"] + SAMPLING / 2, SAMPLING)
    time = np.arange(refined * (coarse.size - 1) + 1) * SAMPLING / refined
    pulse = case["A"] * np.sin(2 * np.pi * coarse / case["Tp"]) * np.exp(-case["b"] * coarse)
    motion = wd.GroundMotion(np.interp(time, coarse, pulse), SAMPLING / refined)
    scene = wd.Scene(building, motion, tail=0.0, recorders=("drift",))
    run = wd.simulate(
        scene, method="rk4", step=SAMPLING / refined, dtype="float64", histories=wd.Histories(), device="cpu"
    )
    assert run["status"].item() == 0
    return run


def pulse_error(case: dict[str, Any], run: xr.Dataset) -> float:
    """Return the largest error of the two peaks of displacement and of the last displacement, over the largest peak."""
    u = run["displacement"].values[0, :, 0]
    last = u[round(case["duration"] / (run["time"].values[1] - run["time"].values[0]))]
    found = np.array([u.max(), u.min(), last])
    expected = np.array([case[name] for name in ("largest_displacement", "least_displacement", "displacement_at_end")])
    return float(np.abs(found - expected).max() / np.abs(expected).max())
