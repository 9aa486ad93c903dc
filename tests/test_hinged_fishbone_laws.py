"""Hinges after Ibarra, Medina and Krawinkler: rules without branches against the general rules of the law."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import warp as wp
from hinge_cases import motion, reference_model, steel
from test_frame_storeys import largest_error, run_both

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of
from warpdyn.campaigns.running.pushover import spring_and_coefficients
from warpdyn.engine.kernels.auxiliary.storey_path import storey_path_kernel
from warpdyn.engine.kernels.kernel_cache import loaded
from warpdyn.engine.laws.ibarra_medina_krawinkler.branchless_rules import variant

pytestmark = pytest.mark.meant_as_given(
    "no_damping", "damping_ratio", "first_period", "strongest_motion", "peak_ground_acceleration"
)
MOTIONS = [motion("pulse_2", 5), motion("LOS270", 4), motion("pulse_1", 6), motion("pulse_2", 3)]
# An energy capacity that no history spends: the law has the general rules, but deteriorates by less than 1e-9.
NEGLIGIBLE = {"post_capping_deterioration_drift": 1e9}


def scene_of(plastic: float, post_capping: float, **more: float) -> wd.Scene:
    """Return frames whose hinges cap after a share of the plastic rotation of the reference model."""

    def hinge(strength: float, to_capping: float, after: float) -> dict:
        return steel(strength, plastic * to_capping, post_capping * after) | more

    return wd.Scene(reference_model(hinge, drift_capacity=0.12), wd.Cloud(MOTIONS), recorders=("spring",))


@pytest.mark.parametrize(
    ("plastic", "post_capping", "changes"),
    [
        (1.0, 1.0, {}),
        (0.6, 0.1, {"ultimate_drift": 0.1}),  # residual moments, and unloading from them
        (0.6, 0.1, {"residual_force_ratio": 0.0, "ultimate_drift": 0.15}),  # loss of strength
        (0.05, 1.0, {"ultimate_drift": 0.0}),  # hardening lines that are too steep where the moment changes its sign
    ],
)
def test_fast_rules_equal_the_general_law(plastic, post_capping, changes):
    fast, general = (scene_of(plastic, post_capping, **changes, **more) for more in ({}, NEGLIGIBLE))
    laws = [str(dynamics_of(scene).law) for scene in (fast, general)]
    assert laws == ["ibarra_medina_krawinkler_capped", "ibarra_medina_krawinkler_branchless"]
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.005, "dtype": "float64", "on_unstable": "flag"}
    found, due = (wd.simulate(scene, **settings) for scene in (fast, general))
    np.testing.assert_array_equal(found["status"].values, due["status"].values)
    # Where a residual moment is lost at the ultimate rotation, the moment jumps, and the step may have no solution.
    assert (found["status"].values <= 1).sum() >= 3
    for name in ("peak_spring_deformation", "peak_spring_force"):
        np.testing.assert_allclose(found[name].values, due[name].values, rtol=1e-5, atol=1e-9)


def test_the_kernel_of_lines_equals_the_kernel_of_any_fishbone(monkeypatch):
    settings = {"method": "leapfrog", "step": 0.005, "dtype": "float64", "on_unstable": "flag"}
    scene = scene_of(0.6, 0.1, residual_force_ratio=0.0, ultimate_drift=0.15)
    expected, found = run_both(scene, monkeypatch, **settings)
    monkeypatch.undo()
    np.testing.assert_array_equal(found["status"].values, expected["status"].values)
    assert set(found["status"].values) == {0, 1}  # some collapse
    for name in ("peak_spring_deformation", "peak_spring_force"):
        # Moments balance to 1e-9 of the largest one in each step; softening hinges multiply such differences.
        assert largest_error(expected, found, name) < 1e-6, name
    # The bits of a sample do not depend on the other samples of a thread.
    alone = wd.simulate(replace(scene, excitation=wd.Cloud(MOTIONS[2:3])), device="cpu", **settings)
    for name in ("peak_spring_deformation", "peak_spring_force"):
        np.testing.assert_array_equal(alone[name].values[0], found[name].values[2])


def test_fast_rules_equal_the_general_law_for_random_hinges():
    # Just within the limit at which no hardening line of the nominal hinges can be too steep; those of many drawn
    # hinges are: 0.08 ultimate_drift <= 0.7 plastic_drift_to_capping, with half-beams of 0.0025 rad.
    scatter = {"plastic_drift_to_capping": wd.RandomFactor(wd.Lognormal(1.0, 0.5), per="spring")}
    motions = wd.Cloud([motion("pulse_2", 2), motion("LOS270", 3), motion("pulse_2", 1.5), motion("pulse_1", 4)])
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.005, "dtype": "float64", "on_unstable": "flag"}
    runs = []
    for more in ({}, NEGLIGIBLE):
        structure = scene_of(0.1, 1.0, ultimate_drift=0.021, **more).structure
        scene = wd.Scene(structure, motions, scatter, recorders=("spring", "residual"))
        runs.append(wd.simulate(scene, structures=8, seed=2, **settings))
    found, due = runs
    np.testing.assert_array_equal(found["status"].values, due["status"].values)
    assert (found["status"].values <= 1).sum() >= 24
    for name in ("peak_spring_deformation", "peak_spring_force", "residual_deformation"):
        np.testing.assert_allclose(found[name].values, due[name].values, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("name", ["strength_deterioration_drift", "unloading_deterioration_drift"])
def test_hinges_that_may_deteriorate_have_the_deteriorating_law(name):
    scatter = {name: wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring")}
    scene = wd.Scene(reference_model(), wd.Cloud(MOTIONS), scatter)
    assert str(dynamics_of(scene).law) == "ibarra_medina_krawinkler_branchless"
    assert str(dynamics_of(scene_of(1.0, 1.0, **{name: 1.0})).law) == "ibarra_medina_krawinkler_branchless"


def test_rules_without_branches_equal_the_general_rules():
    """Random hinges along random rotations: moments, and tangents in the last step."""
    random, hinges = np.random.default_rng(5), 60
    yields = np.full(hinges, 1e-3)  # rad

    def between(low: float, high: float) -> np.ndarray:
        return random.uniform(low, high, hinges)

    law = wd.laws.IbarraMedinaKrawinklerBilinear(
        yield_force=1.0,
        plastic_drift_to_capping=yields * between(1, 30),
        post_capping_drift=yields * between(2, 100),
        capping_force_ratio=between(1, 1.3),
        residual_force_ratio=between(0, 0.6) * (random.random(hinges) < 0.8),
        ultimate_drift=yields * between(10, 150) * (random.random(hinges) < 0.5),
        strength_deterioration_drift=yields * between(20, 1000) * (random.random(hinges) < 0.8),
        post_capping_deterioration_drift=yields * between(20, 1000) * (random.random(hinges) < 0.8),
        unloading_deterioration_drift=yields * between(20, 1000) * (random.random(hinges) < 0.8),
        deterioration_rate=between(0.3, 1.0),
    )
    building = wd.ShearBuilding(np.ones(hinges), 1 / yields, 3.0, law=law)
    general, coefficients = spring_and_coefficients(building)
    assert str(general) == "ibarra_medina_krawinkler_bilinear"
    turns = np.cumsum(random.normal(size=(400, hinges)) * yields * between(1, 15), axis=0)
    path = np.concatenate([np.linspace(a, b, 25)[1:] for a, b in pairwise([np.zeros(hinges), *turns])])
    found = []
    for rules in (general, variant(general)):
        forces = np.full(path.shape, np.nan)
        arrays = [wp.array(np.ascontiguousarray(each), device="cpu") for each in (coefficients, path)]
        results = [wp.array(forces, device="cpu"), wp.full(path.shape, np.nan, dtype=wp.float64, device="cpu")]
        wp.launch(loaded(storey_path_kernel(rules, "float64")), hinges, inputs=arrays, outputs=results, device="cpu")
        found.append(results[0].numpy())
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-9)
    assert (np.abs(found[0][-1]) < 1e-9).any()  # hinges that have lost their strength
    assert (np.abs(found[0][-1]) > 0.2).any()


def test_rotation_counts_until_the_strength_is_lost():
    # Without a residual moment, half-beams of storeys 1 to 4 lose their strength at the end of the falling line.
    scene = scene_of(0.6, 0.1, residual_force_ratio=0.0, ultimate_drift=0.0)
    result = wd.simulate(scene, device="cpu", method="leapfrog", step=0.005, histories=wd.Histories([1]))
    rotations = np.abs(result["spring_deformation"].isel(history=0).values[:, 10:]).max(axis=0)
    peaks = result["peak_spring_deformation"].values[1, 10:]
    end_of_line = 0.025 * 0.6 + 0.16 * 0.1  # plastic rotations up to capping and beyond it [rad]
    failed = rotations > 1.1 * end_of_line
    assert failed.any()
    assert not failed.all()
    np.testing.assert_allclose(peaks[~failed], rotations[~failed], rtol=0.03)
    assert (rotations[failed] > 1.1 * peaks[failed]).all()
    np.testing.assert_allclose(peaks[failed], end_of_line, rtol=0.05)
