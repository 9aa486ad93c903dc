"""Flexural-shear buildings: the reference case, closed forms, an independent integration, and invalid input."""

from __future__ import annotations

import numpy as np
import pytest
from lumped_cases import pulse
from scipy.integrate import solve_ivp

import warpdyn as wd

pytestmark = [
    pytest.mark.meant_as_given(
        "no_damping", "gravity_load_over_weight", "damping_ratio", "first_period", "strongest_motion"
    )
]
SETTINGS = {"dtype": "float64", "device": "cpu"}
BENDING, SHEAR = 2.39250923e11, 1.06333744e9


def run_of(building, motion, step=0.0005, **changed):
    return wd.simulate(wd.Scene(building, motion), step=step, **SETTINGS, **changed)


@pytest.mark.parametrize("by_period", [False, True])
def test_a_tower_has_the_reference_frequencies_and_response(by_period):
    # L03: the period of the stick with these stiffnesses is 1 / 0.4818632 s, because its top floor has its full mass.
    properties = {"bending_stiffness": BENDING, "shear_stiffness": SHEAR}
    if by_period:
        properties = {"period": 1 / 0.4818632, "alpha0": 4.0}
    tower = wd.FlexuralShearBuilding([400e3] * 20, 3.0, **properties, damping="modal", damping_ratio=0.03)
    hertz = 1 / tower.modal()["period"].values[:5]
    np.testing.assert_allclose(hertz, [0.4818632, 1.765076, 3.996459, 7.333397, 11.79809], rtol=4e-7)
    assert tower.stick.bending_stiffness[0] == pytest.approx(BENDING, rel=1e-6)
    run = run_of(tower, pulse(2.0, 1.2, 0.4, 12.0))
    assert run["peak_displacement"].sel(dof="u20").item() == pytest.approx(0.3196972, rel=3e-6)
    assert run["peak_acceleration"].sel(dof="u10").item() == pytest.approx(1.710967, rel=5e-5)
    assert run["peak_output"].sel(output="base shear").item() == pytest.approx(9321352, rel=5e-5)
    drifts = run["peak_output"].sel(output=[f"drift {storey}" for storey in range(1, 21)])
    assert drifts.max().item() / 3.0 == pytest.approx(0.006811623, rel=3e-6)
    np.testing.assert_allclose(drifts[0], run["peak_spring_deformation"][0], rtol=1e-5)


@pytest.mark.parametrize("alpha0", [0.5, 4.0, 15.0])
def test_the_first_period_is_exact_and_higher_ones_approach_the_continuum(alpha0):
    from warpdyn.model.structures.lumped.flexural_shear import flexural_shear_period_ratios

    tower = wd.FlexuralShearBuilding([*[1e5] * 39, 0.5e5], 3.0, period=2.5, alpha0=alpha0)
    periods = tower.modal()["period"].values
    assert periods[0] == pytest.approx(2.5, rel=1e-9)
    np.testing.assert_allclose(periods[:4] / 2.5, flexural_shear_period_ratios(alpha0, 4), rtol=0.015)


def test_the_base_moment_is_that_of_the_floor_forces():
    # A tower without damping in free response: forces of floors are minus masses times total accelerations.
    tower = wd.FlexuralShearBuilding([1e5, 2e5, 1e5], [4.0, 3.0, 3.0], period=0.6, alpha0=3.0)
    run = run_of(tower, pulse(2.0, 0.5, 0.4, 3.0), 0.001, histories=wd.Histories([0], every=1))
    acceleration = run["acceleration"].isel(history=0).transpose("time", "dof").values
    forces = acceleration * [1e5, 2e5, 1e5]
    for name, row in {"base shear": [1.0, 1.0, 1.0], "base moment": [4.0, 7.0, 10.0]}.items():
        due = np.abs(forces @ row).max()
        assert run["peak_output"].sel(output=name).item() == pytest.approx(due, rel=1e-4)


def test_a_yielding_tower_has_the_response_of_an_independent_integration():
    # Bilinear frames beside an elastic wall; SciPy integrates the elastic-plastic springs with their plastic drifts.
    storeys, yields, hardening = 4, np.array([6e5, 5e5, 4e5, 2.5e5]), 0.05
    given = {
        "bending_stiffness": 4e10,
        "shear_stiffness": 6e8,
        "damping": "stiffness_proportional",
        "damping_ratio": 0.03,
    }
    law = {"law": "bilinear", "yield_force": yields, "hardening_ratio": hardening}
    tower = wd.FlexuralShearBuilding([3e5] * storeys, 3.5, **given, **law)
    assert "base shear" not in tower.outputs
    assert "wall base shear" in tower.outputs
    wall, k = tower.stick.bending_matrix, 6e8 / 3.5
    rows = np.eye(storeys) - np.eye(storeys, k=-1)
    elastic = wall + k * rows.T @ rows
    damping = 2 * 0.03 / tower.modal()["circular_frequency"].values[0] * elastic
    motion = pulse(9.0, 0.6, 0.4, 4.0)
    time = 0.01 * np.arange(motion.acceleration.size)
    limit = (1 - hardening) * yields / ((1 - hardening) * k)

    def rate(t: float, state: np.ndarray) -> np.ndarray:
        u, v, plastic = np.split(state, 3)
        drift, speed = rows @ u, rows @ v
        stretch = drift - plastic
        flows = (np.abs(stretch) >= limit) & (stretch * speed > 0)
        clipped = np.clip(stretch, -limit, limit)
        force = hardening * k * drift + (1 - hardening) * k * clipped
        ground = np.interp(t, time, motion.acceleration)
        return np.concatenate([v, -(wall @ u + rows.T @ force + damping @ v) / 3e5 - ground, np.where(flows, speed, 0)])

    found = solve_ivp(rate, (0, 4), np.zeros(12), "RK45", rtol=1e-7, atol=1e-10, max_step=5e-4, dense_output=True)
    states = found.sol(np.linspace(0, 4, 8001))
    run = run_of(tower, motion)
    np.testing.assert_allclose(run["peak_displacement"][0], np.abs(states[:4]).max(axis=1), rtol=5e-4)
    due = np.abs(rows @ states[:4]).max(axis=1)
    assert (due > 2 * yields / k).any()
    np.testing.assert_allclose(run["peak_spring_deformation"][0], due, rtol=5e-4)
    np.testing.assert_allclose(
        run["peak_output"].sel(output="wall base shear").item(), np.abs(wall.sum(axis=0) @ states[:4]).max(), rtol=5e-4
    )


def test_gravity_lengthens_the_period_and_buckles_at_the_critical_factor():
    given = {"period": 3.0, "alpha0": 5.0}
    bare, loaded = (wd.FlexuralShearBuilding([4e5] * 20, 3.0, **given, gravity_load=each) for each in (None, "weight"))
    factor = wd.buckling_factors(loaded)[0]
    matrix = wd.geometric_stiffness([4e5 * 9.80665] * 20, 3.0)
    np.testing.assert_allclose(loaded.matrices["geometric_stiffness"], matrix, rtol=1e-12)
    stiffness = bare.stick.stiffness
    assert np.linalg.eigvalsh(stiffness - 0.9999 * factor * matrix)[0] > 0
    assert np.linalg.eigvalsh(stiffness - 1.0001 * factor * matrix)[0] < 0
    assert loaded.fundamental_period == pytest.approx(3.0 / np.sqrt(1 - 1 / factor), rel=0.01)
    assert loaded.fundamental_period > 3.01


def test_the_critical_load_is_that_of_a_bar():
    # A uniform shear beam under a load at its top buckles at GA, a flexural one at pi^2 EI / (4 H^2).
    with pytest.raises(ValueError, match="no geometric stiffness"):
        wd.buckling_factors(wd.FlexuralShearBuilding([1e5] * 4, 3.0, period=1.0, alpha0=2.0))
    top = [0.0] * 39 + [1e6]
    given = {"bending_stiffness": 1e10, "gravity_load": top}
    bending = wd.FlexuralShearBuilding([1e5] * 40, 1.0, shear_stiffness=1.0, **given)
    assert wd.buckling_factors(bending)[0] * 1e6 == pytest.approx(np.pi**2 * 1e10 / (4 * 40**2), rel=2e-3)
    both = wd.FlexuralShearBuilding([1e5] * 40, 1.0, shear_stiffness=3e7, **given)
    euler = wd.buckling_factors(bending)[0] * 1e6
    # In parallel, the critical loads of bending and shear add up.
    assert wd.buckling_factors(both)[0] * 1e6 == pytest.approx(euler + 3e7, rel=1e-6)


def test_the_inertia_of_a_hinge_hardly_changes_the_periods():
    from warpdyn.model.structures.lumped.sticks import bending_matrix_with_base_rotation, static_condensation

    for storeys, hinge in ((2, 1e8), (3, 1e9), (20, 1e11), (20, 1e13)):
        given = {"bending_stiffness": 5e10, "shear_stiffness": 5e8}
        tower = wd.FlexuralShearBuilding([2e5] * storeys, 3.0, **given, base_hinge={"stiffness": hinge})
        assert tower.dof_names[:2] == ("base rotation", "u1")
        whole = bending_matrix_with_base_rotation([3.0] * storeys, 5e10)
        whole[0, 0] += hinge
        rows = np.eye(storeys) - np.eye(storeys, k=-1)
        massless = static_condensation(whole, np.arange(1, storeys + 1))[0] + 5e8 / 3 * rows.T @ rows
        due = 2 * np.pi * np.sqrt(2e5 / np.linalg.eigvalsh(massless))
        periods = tower.modal()["period"].values
        np.testing.assert_allclose(periods[0], due[0], rtol=1e-3)
        np.testing.assert_allclose(periods[1], due[1], rtol=0.02)
        highest = tower.stick.periods[-1]
        assert storeys < 20 or periods[-1] > highest / 2  # and therefore the stable step
    light = wd.FlexuralShearBuilding([2e5] * 3, 3.0, **given, base_hinge={"stiffness": 1e9}, base_inertia=1.0)
    whole = bending_matrix_with_base_rotation([3.0] * 3, 5e10)
    whole[0, 0] += 1e9
    rows = np.eye(3) - np.eye(3, k=-1)
    massless = static_condensation(whole, [1, 2, 3])[0] + 5e8 / 3 * rows.T @ rows
    due = 2 * np.pi * np.sqrt(2e5 / np.linalg.eigvalsh(massless))
    np.testing.assert_allclose(light.modal()["period"][:3], due, rtol=1e-4)


def test_a_stiff_hinge_is_a_fixed_base():
    given = {"period": 0.8, "alpha0": 3.0, "damping": "stiffness_proportional", "damping_ratio": 0.03}
    fixed = wd.FlexuralShearBuilding([1e5] * 4, 3.0, **given)
    hinged = wd.FlexuralShearBuilding([1e5] * 4, 3.0, **given, base_hinge={"stiffness": 1e14})
    motion = pulse(2.0, 0.5, 0.4, 3.0)
    one, other = run_of(fixed, motion, 0.001), run_of(hinged, motion, 0.001)
    for name in ("drift 1", "drift 4", "base shear", "base moment", "wall base moment"):
        value = one["peak_output"].sel(output=name).item()
        assert other["peak_output"].sel(output=name).item() == pytest.approx(value, rel=1e-3)
    # The hinge has the moment of the wall at its base.
    moment = other["peak_spring_force"].sel(spring="base hinge").item()
    assert moment == pytest.approx(other["peak_output"].sel(output="wall base moment").item(), rel=2e-3)


WRONG = [
    ({}, "give period= and alpha0=, or bending_stiffness= and shear_stiffness=; got neither"),
    ({"period": 2.0}, "got period"),
    ({"period": 2.0, "alpha0": 3.0, "shear_stiffness": 1e9}, "got period, alpha0, shear_stiffness"),
    ({"period": 2.0, "alpha0": 0.0}, "alpha0 is 0"),
    ({"period": -2.0, "alpha0": 3.0}, "period"),
    ({"period": 2.0, "alpha0": 3.0, "law": "bilinear", "hardening_ratio": 0.1}, "yield_force .* is missing"),
    (
        {"period": 2.0, "alpha0": 3.0, "law": "bilinear", "yield_force": [1e5, 2e5], "hardening_ratio": 0.1},
        r"yield_force must be one value or one per storey \(3\)",
    ),
    ({"bending_stiffness": 1e10, "shear_stiffness": [1e8, 0.0, 1e8]}, "shear_stiffness of storey 2 is 0 N"),
    ({"period": 2.0, "alpha0": 3.0, "gravity_load": [1e9] * 3}, "buckles under the geometric stiffness"),
    ({"period": 2.0, "alpha0": 3.0, "base_inertia": 1e5}, "base_inertia needs a base_hinge"),
    ({"period": 2.0, "alpha0": 3.0, "base_hinge": {"law": "bilinear"}}, "spring 'base hinge': stiffness is missing"),
    ({"period": 2.0, "alpha0": 3.0, "storey_height": [3.0, -1.0, 3.0]}, "storey_height of storey 2 is -1 m"),
]


@pytest.mark.parametrize(("changed", "message"), WRONG)
def test_a_wrong_building_is_refused(changed, message):
    with pytest.raises(ValueError, match=message):
        wd.FlexuralShearBuilding(**{"floor_mass": [1e5] * 3, "storey_height": 3.0} | changed)


def test_a_hinge_that_is_no_dictionary_is_refused():
    with pytest.raises(TypeError, match="base_hinge must be a dictionary of the law and its parameters"):
        wd.FlexuralShearBuilding([1e5], 3.0, period=0.5, alpha0=3.0, base_hinge="bilinear")
