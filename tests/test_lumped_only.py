"""Scatter of some springs or degrees of freedom only, and random masses with a full mass matrix."""

from __future__ import annotations

import numpy as np
import pytest
from lumped_cases import pulse

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
MOTION = pulse(2.0, 0.6, 0.4, 3.0)
SETTINGS = {"device": "cpu", "dtype": "float64", "step": 0.005}
SOIL = wd.FoundationSprings(2e8, 2e9, sway_dashpot=6e6, rocking_dashpot=2e8)
FACTOR = wd.Lognormal(1.0, 0.3)


def on_soil() -> wd.LumpedStructure:
    chain = wd.ShearBuilding([1e5, 1e5], 5e7, 3.0, damping="rayleigh", damping_ratio=0.05)
    equipped = wd.with_equipment(chain, "u2", 100.0, period=0.3, damping_ratio=0.02)
    heights = {"u1": 3.0, "u2": 6.0, "equipment": 6.0}
    return wd.structure_on_soil(equipped, SOIL, foundation_mass=1e5, rocking_inertia=1e6, floor_heights=heights)


def drawn(scatter: wd.RandomFactor, name: str = "stiffness") -> np.ndarray:
    """Return the drawn values over the nominal ones, shape [structure, place]."""
    structure = on_soil()
    run = wd.simulate(wd.Scene(structure, MOTION, {name: scatter}), structures=4, seed=2, device="cpu", dtype="float64")
    return run[name].values / structure.parameters[name]


@pytest.mark.parametrize(
    ("only", "varied"),
    [
        (None, ["storey 1", "storey 2"]),
        ("soil", ["sway", "rocking"]),
        (("building", "equipment"), ["storey 1", "storey 2", "equipment"]),
        (("storey 2", "sway"), ["storey 2", "sway"]),
    ],
)
@pytest.mark.parametrize("per", ["building", "spring"])
def test_scatter_changes_the_selected_springs_only(only, varied, per):
    factors = drawn(wd.RandomFactor(FACTOR, per=per, only=only))
    names = on_soil().names_along("spring")
    chosen = np.isin(names, varied)
    np.testing.assert_allclose(factors[:, ~chosen], 1.0, rtol=1e-12)
    assert (np.abs(factors[:, chosen] - 1) > 1e-3).all()
    if per == "building":
        np.testing.assert_allclose(factors[:, chosen], factors[:, chosen][:, :1] * np.ones(chosen.sum()), rtol=1e-12)


def test_a_default_scatter_of_masses_leaves_out_soil_and_equipment():
    factors = drawn(wd.RandomFactor(FACTOR), "mass")
    np.testing.assert_allclose(factors[:, 2:], 1.0, rtol=1e-12)
    assert (np.abs(factors[:, :2] - 1) > 1e-3).all()


def test_values_of_some_springs_give_the_response_of_a_structure_with_these_values():
    structure = on_soil()
    scatter = {"stiffness": wd.RandomFactor(FACTOR, only="soil")}
    run = wd.simulate(wd.Scene(structure, MOTION, scatter), structures=2, seed=2, **SETTINGS)
    factor = float(run["stiffness"].sel(spring="sway")[0]) / 2e8
    soil = wd.FoundationSprings(2e8 * factor, 2e9 * factor, sway_dashpot=6e6, rocking_dashpot=2e8)
    chain = wd.ShearBuilding([1e5, 1e5], 5e7, 3.0, damping="rayleigh", damping_ratio=0.05)
    equipped = wd.with_equipment(chain, "u2", 100.0, period=0.3, damping_ratio=0.02)
    heights = {"u1": 3.0, "u2": 6.0, "equipment": 6.0}
    built = wd.structure_on_soil(equipped, soil, foundation_mass=1e5, rocking_inertia=1e6, floor_heights=heights)
    due = wd.simulate(wd.Scene(built, MOTION), **SETTINGS)
    np.testing.assert_allclose(run["peak_displacement"][0], due["peak_displacement"][0], rtol=1e-8)


@pytest.mark.parametrize(
    ("name", "scatter", "message"),
    [
        (
            "stiffness",
            {"only": "sol"},
            r"only= names 'sol', but no spring and no group has this name.*'soil'",
        ),
        ("mass", {"only": "storey 1"}, "only= names 'storey 1', but no degree of freedom and no group"),
    ],
)
def test_unknown_names_are_refused(name, scatter, message):
    with pytest.raises(ValueError, match=message):
        wd.Scene(on_soil(), MOTION, {name: wd.RandomFactor(FACTOR, **scatter)})


def test_only_needs_names():
    with pytest.raises(TypeError, match=r"only must be storeys, .* or names of springs"):
        wd.RandomFactor(FACTOR, only={"soil": True})
    with pytest.raises(ValueError, match="only= contains the number 3, but springs and degrees of freedom have names"):
        wd.Scene(on_soil(), MOTION, {"stiffness": wd.RandomFactor(FACTOR, only=3)})


def test_the_json_keeps_the_names():
    scatter = {"stiffness": wd.RandomFactor(FACTOR, only=("soil",)), "mass": wd.RandomFactor(FACTOR)}
    scene = wd.Scene(on_soil(), MOTION, scatter)
    assert wd.Scene.from_json(scene.to_json(), MOTION).scatter == scatter
    assert scene.to_json().count('"only"') == 1


def coupled(factor: float = 1.0, **other) -> wd.LumpedStructure:
    """Return a block whose centre of mass is 2 m from its reference point, with masses times a factor."""
    springs = [
        wd.Spring("y", {"y": 1.0}, stiffness=4e7),
        wd.Spring("core", {"theta": 1.0}, stiffness=2e9),
    ]
    coupling = np.array([[0.0, 2e5], [2e5, 4e5]]) * factor
    masses = {"y": 1e5 * factor, "theta": 4e6 * factor}
    return wd.LumpedStructure(masses, springs, influence={"y": 1.0}, mass_matrix=coupling, **other)


def test_a_common_factor_on_the_mass_multiplies_the_mass_matrix():
    scatter = {"mass": wd.RandomFactor(FACTOR)}
    run = wd.simulate(wd.Scene(coupled(), MOTION, scatter), structures=3, seed=1, **SETTINGS)
    for sample in range(3):
        factor = float(run["mass"][sample, 0]) / 1e5
        due = wd.simulate(wd.Scene(coupled(factor), MOTION), **SETTINGS)
        np.testing.assert_allclose(run["peak_displacement"][sample], due["peak_displacement"][0], rtol=1e-8)


def test_masses_that_contradict_the_mass_matrix_are_refused():
    of_dofs = wd.RandomFactor(FACTOR, per="dof")
    with pytest.raises(ValueError, match="the random masses of 'y' and 'theta', which mass_matrix couples"):
        wd.simulate(wd.Scene(coupled(), MOTION, {"mass": of_dofs}), structures=3, **SETTINGS)
    with pytest.raises(ValueError, match="the random masses of 'y' and 'theta', which mass_matrix couples"):
        wd.simulate(wd.Scene(coupled(), MOTION, {"mass": wd.RandomFactor(FACTOR, only="y")}), **SETTINGS)


@pytest.mark.parametrize("name", ["mass", "stiffness"])
def test_one_given_value_does_not_replace_those_of_equipment(name):
    chain = wd.ShearBuilding([1e5, 1e5], 5e7, 3.0, damping="modal", damping_ratio=0.05)
    both = wd.with_equipment(chain, "u2", 100.0, period=0.3, damping_ratio=0.02)
    with pytest.raises(ValueError, match=r"of the building and those of equipment.*GivenValues of shape .structure, 3"):
        wd.Scene(both, MOTION, {name: wd.GivenValues([1e5, 1.2e5])})
