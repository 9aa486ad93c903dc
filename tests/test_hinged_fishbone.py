"""Fish-bone frames with hinges against OpenSeesPy, and histories of a program that agrees with it within 1e-5."""

from __future__ import annotations

import functools
import importlib.util

import numpy as np
import pytest
import xarray as xr
from hinge_cases import A0, A1, HEIGHTS, HISTORIES, NAMES, motion, reference_model
from opensees_frames import build, rest_under_gravity, shaken

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given(
    "no_damping", "damping_ratio", "first_period", "strongest_motion", "peak_ground_acceleration"
)


@functools.cache
def run(**settings) -> xr.Dataset:
    motions = [motion(*name) for name in NAMES]
    scene = wd.Scene(reference_model(), wd.Cloud(motions), recorders=("spring", "acceleration"))
    return wd.simulate(scene, device="cpu", histories=wd.Histories(range(len(NAMES))), **settings)


def mean_of_end(result: xr.Dataset, sample: int) -> np.ndarray:
    """Return the mean drift ratios of the last 5 s."""
    end = 30.0 if NAMES[sample][0] == "LOS270" else 20.0
    history = result["spring_deformation"].isel(history=sample).sel(time=slice(end - 5, end))
    return history.values[:, :10].mean(axis=0) / HEIGHTS


def drift_ratios(result: xr.Dataset, sample: int) -> np.ndarray:
    return result["peak_spring_deformation"].isel(sample=sample).values[:10] / HEIGHTS


@pytest.mark.parametrize("sample", range(len(NAMES)), ids=[f"{name} {level}" for name, level in NAMES])
def test_history_at_a_converged_step(sample):
    result = run(method="rk4", step=0.0025, dtype="float64")
    drifts, accelerations, residual, rotation, moment = HISTORIES[NAMES[sample]]
    assert result["status"].values[sample] == 0
    np.testing.assert_allclose(drift_ratios(result, sample), drifts, rtol=1e-3)
    np.testing.assert_allclose(mean_of_end(result, sample), residual, rtol=0, atol=1e-3 * max(drifts))
    found = result.isel(sample=sample)
    np.testing.assert_allclose(found["peak_acceleration"].values, accelerations, rtol=0.01)
    hinge, value = rotation
    assert found["peak_spring_deformation"].sel(spring=hinge).item() == pytest.approx(value, rel=2e-3)
    hinge, value = moment
    assert found["peak_spring_force"].sel(spring=hinge).item() == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("sample", range(len(NAMES)), ids=[f"{name} {level}" for name, level in NAMES])
def test_history_at_the_default_step(sample):
    result = run()
    assert result["status"].values[sample] == 0
    drifts, _, residual, *_ = HISTORIES[NAMES[sample]]
    np.testing.assert_allclose(drift_ratios(result, sample), drifts, rtol=0.01)
    np.testing.assert_allclose(mean_of_end(result, sample), residual, rtol=0, atol=0.01 * max(drifts))


@pytest.mark.skipif(importlib.util.find_spec("openseespy") is None, reason="openseespy is missing")
def test_history_is_that_of_opensees():
    """Four seconds with yielding hinges; OpenSees: Newmark's average acceleration, damping of all modes."""
    case, step, duration = ("pulse_1", 6), 0.0025, 4.0
    structure = reference_model()
    model = build(structure.frame, structure.hinges, p_delta=True)
    squared = np.array(model.ops.eigen("-fullGenLapack", 10))
    frequency = np.sqrt(squared)
    model.ops.modalDampingQ(*(0.5 * (A0 / frequency + A1 * frequency)).tolist())
    rest_under_gravity(model.ops)
    names = list(structure.hinge_names)
    drifts, moments = [], []
    for _ in shaken(model.ops, motion(*case), step, round(duration / step)):
        floors = [model.ops.nodeDisp(model.nodes[f"J{storey}"], 1) for storey in range(1, 11)]
        drifts.append(np.diff(floors, prepend=0.0))
        moments.append([model.ops.eleResponse(model.hinges[name], "force")[5] for name in names])
    model.ops.wipe()
    found = run(method="rk4", step=step, dtype="float64").isel(history=NAMES.index(case))
    time = found["time"].values
    shown = (time > 0) & (time <= duration + 1e-9)
    places = np.rint(time[shown] / step).astype(int) - 1
    # The tolerances allow for the error of Newmark's method, which is of second order in the step.
    own = found["spring_deformation"].values[shown][:, :10]
    np.testing.assert_allclose(own, np.array(drifts)[places], rtol=0, atol=1e-3 * np.abs(drifts).max())
    own = -found["spring_force"].sel(spring=names).values[shown]  # OpenSees' moments are positive anticlockwise
    np.testing.assert_allclose(own, np.array(moments)[places], rtol=0, atol=2e-3 * np.abs(moments).max())
