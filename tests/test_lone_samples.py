"""A sample alone in its thread, as on a GPU: its kernels give what those of rows of samples give."""

import numpy as np
import pytest
from combination_cases import rules_of

import warpdyn as wd
from warpdyn.campaigns.integration import model
from warpdyn.engine.kernels import build, queues
from warpdyn.engine.kernels.parts import collapse_groups
from warpdyn.engine.kernels.plan import Plan

DRIFT = ("drift",)
# Collapses take a branch of their own in a kernel that a sample leaves; parts that see forces keep it in the loop.
CASES = [
    ("elastic", 1, DRIFT, False, "rk4"),
    ("bouc_wen", 2, DRIFT, False, "rk4"),
    ("bilinear", 2, DRIFT, False, "stoermer"),
    ("bilinear", 2, DRIFT, True, "stoermer"),
    ("bilinear", 2, ("drift", "time_of_peak"), True, "rk4"),
    ("bilinear", 2, ("acceleration", "drift", "energy"), True, "rk4"),
    ("bouc_wen", 2, ("acceleration", "drift", "energy"), False, "stoermer"),  # its memory follows the drift
]


def make_scene(law, storeys, recorders, collapses, *, is_undivided):
    """Return storeys under motions of several lengths, two of which end before the run does, and of several steps."""
    random = np.random.default_rng(3)
    motions = [
        wd.GroundMotion(3.0 * random.normal(size=size), step, f"{size} of {step} s")
        for size, step in ((150, 0.01), (400, 0.01), (240, 0.01) if is_undivided else (60, 0.04))
    ]
    stiffness = 1e5 * (2 * np.pi / 0.3) ** 2
    of_law = {
        "elastic": {},
        "bilinear": {"yield_force": 0.01 * stiffness, "hardening_ratio": 0.05},
        "bouc_wen": {"yield_force": 0.01 * stiffness, "hardening_ratio": 0.05},
    }
    building = wd.ShearBuilding(
        [1e5] * storeys, [stiffness] * storeys, 3.0, law=law, damping="rayleigh", damping_ratio=0.05, **of_law[law]
    )
    stripes = wd.Stripes(motions, [0.2, 0.8, 2.5], wd.PeakGroundAcceleration())
    limit = 0.02 if collapses else None
    return wd.Scene(building, stripes, tail=0.5, recorders=recorders, collapse_drift_ratio=limit)


@pytest.mark.parametrize("kernel", ["undivided", "interpolated", "divided"])
@pytest.mark.parametrize(("law", "storeys", "recorders", "collapses", "method"), CASES)
def test_alone_in_its_thread_a_sample_gives_what_it_gives_in_a_row(
    law, storeys, recorders, collapses, method, kernel, monkeypatch
):
    scene = make_scene(law, storeys, recorders, collapses, is_undivided=kernel == "undivided")
    if kernel == "divided":
        monkeypatch.setattr(model, "MOST_VALUES", 1)  # no motion is interpolated before the launch
    terms = {"structures": 1, "method": method, "step": 0.01, "dtype": "float64", "device": "cpu"}
    rows = wd.simulate(scene, **terms)
    launched = set()
    load = queues.load_kernel
    monkeypatch.setattr(queues, "load_kernel", lambda plan, device: launched.add(plan) or load(plan, device))
    monkeypatch.setattr(model, "fitted", lambda plan, is_gpu: build.fitted(plan, is_gpu=True))
    alone = wd.simulate(scene, **terms)
    assert {(plan.lanes, plan.undivided) for plan in launched} == {(1, True), (1, kernel != "divided")}
    assert set(np.unique(rows["status"])) == ({0, 1} if collapses else {0})
    for name in rows.data_vars:
        if rows[name].dtype.kind == "f":
            # Sums in another order: some 1e-16 a step, which yielding storeys multiply little in a few seconds.
            largest = float(abs(rows[name]).max())
            np.testing.assert_allclose(alone[name], rows[name], rtol=1e-9, atol=1e-10 * largest, err_msg=name)
        else:
            np.testing.assert_array_equal(alone[name], rows[name], err_msg=name)


@pytest.mark.fast
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("storeys", [1, 2, 5, 8, 9, 20])
def test_collapses_are_looked_for_in_groups_only_in_kernels_that_hold_the_step(storeys, dtype):
    # On a GPU, kernels whose threads share a sample lost their collapses when they had the groups.
    plan = Plan(
        "chain", storeys, rules_of("takeda"), "rayleigh", "base_acceleration", DRIFT, "stoermer", dtype, collapses=True
    )
    fitted = build.undivided(build.fitted(plan, is_gpu=True))
    assert collapse_groups.wanted(fitted) == (fitted.sections == 1 and storeys <= collapse_groups.MOST_STOREYS)
    assert not collapse_groups.wanted(build.fitted(plan, is_gpu=False))
