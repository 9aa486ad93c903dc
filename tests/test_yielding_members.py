"""Frames with bilinear hinges whose storeys are divided among threads of a GPU (`yielding_members.py`)."""

from dataclasses import replace

import numpy as np
import pytest
from emulated_gpu.cases import BILINEAR, LOADS, PEAKS, PLASTIC, RECORDERS, grid, shaken
from test_fishbone_joint_springs import plans_of
from test_frame_storeys import GPUS, IMK, largest_error

import warpdyn as wd
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.bilinear_hinges import yielding_members
from warpdyn.engine.kernels.hinges.frame_storeys import has_yielding_members


def plan_of(scene, monkeypatch, *, is_gpu):
    """Return the plan of a run, fitted to a GPU or a CPU."""
    plans = plans_of(monkeypatch)
    wd.simulate(scene, method="leapfrog", device="cpu", step=0.01)
    return build.fitted(plans[0], is_gpu)


@pytest.mark.parametrize(
    ("law", "recorders", "is_gpu", "expected"),
    [
        (BILINEAR, RECORDERS, True, True),
        (PLASTIC, RECORDERS, True, True),
        (BILINEAR, RECORDERS, False, False),
        (IMK, RECORDERS, True, False),
    ],
)
def test_a_gpu_finds_branches_of_bilinear_hinges_in_each_solution(law, recorders, is_gpu, expected, monkeypatch):
    plan = plan_of(shaken(grid(law, 2, 1).structure, recorders=recorders), monkeypatch, is_gpu=is_gpu)
    assert plan.frame_storeys is not None
    assert has_yielding_members(plan) == expected
    text = build.composed(plan).text
    assert ("yield_reach" in text, "line_slope" in text) == (expected, not expected)


def test_a_frame_with_more_hinges_in_a_storey_than_bits_has_lines(monkeypatch):
    plan = plan_of(grid(BILINEAR, 2, 8), monkeypatch, is_gpu=True)
    assert replace(plan, sections=2).line_of_thread.hinges == 34
    assert not has_yielding_members(plan)


@pytest.mark.parametrize("device", GPUS)
@pytest.mark.parametrize(
    ("law", "storeys", "bays", "method", "most_together", "more"),
    [
        (BILINEAR, 2, 1, "leapfrog", 8, {}),
        (BILINEAR, 3, 2, "leapfrog", 8, LOADS),
        (BILINEAR, 5, 3, "stoermer", 8, LOADS),
        (BILINEAR, 3, 2, "leapfrog", 0, LOADS),  # one hinge after the other
        (PLASTIC, 3, 2, "leapfrog", 8, LOADS),
        (PLASTIC, 3, 2, "leapfrog", 0, {}),
        (BILINEAR, 11, 2, "leapfrog", 8, {"hinge_stiffness": 1e12}),  # hinges that are rigid until they yield
    ],
)
def test_branches_of_hinges_give_the_results_of_a_cpu(
    law, storeys, bays, method, most_together, more, device, new_kernels, monkeypatch
):
    monkeypatch.setattr(yielding_members, "MOST_TOGETHER", most_together)
    scene = grid(law, storeys, bays, **more)
    settings = {"method": method, "step": 0.0025, "dtype": "float64"}
    expected, found = (wd.simulate(scene, device=each, **settings) for each in ("cpu", device))
    np.testing.assert_array_equal(found["status"], expected["status"])
    assert expected["status"].values[-1] == 1  # collapsed
    np.testing.assert_allclose(found["time_of_collapse"], expected["time_of_collapse"], rtol=1e-7)
    for name in PEAKS:
        # The largest error of a moment is 1e-9 of the largest moment, in each step.
        assert largest_error(expected, found, name) < 1e-6, name
    single = wd.simulate(scene, device=device, **settings | {"dtype": "float32"})
    for name in PEAKS:
        # In float32 it is 5e-5, and drifts are integrated from rounded values. The error of a rotation is a share of
        # the largest one, because some hinges hardly turn.
        due, seen = (each[name].isel(sample=slice(2)).values for each in (expected, single))
        assert np.abs(seen - due).max() < 2e-3 * np.abs(due).max(), name


@pytest.mark.parametrize("device", GPUS)
def test_a_frame_without_a_solution_is_reported(device, new_kernels, monkeypatch):
    monkeypatch.setattr(yielding_members, "MOST_SOLUTIONS", 1)
    settings = {"device": device, "method": "leapfrog", "step": 0.0025, "dtype": "float64", "on_unstable": "flag"}
    result = wd.simulate(grid(BILINEAR), **settings)
    assert result["status"].values[0] == 0  # remains elastic
    lost = result["status"].values == 4
    assert lost[1:].all()
    assert (result["spring_without_equilibrium"].values[lost] >= 0).all()
