"""Implausible masses, loads, random sections and random yield moments of frames are warned of before a run."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import four_storey, portal

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = pytest.mark.fast
MOTION = wd.GroundMotion(np.sin(np.arange(200) / 10), 0.01)
ENDS = ("start", "end")


def with_masses(masses: list[float]) -> wd.Frame:
    arguments = four_storey().description()
    arguments["masses"] = dict(zip(arguments["masses"], masses, strict=True))
    return wd.Frame(**arguments)


@pytest.mark.parametrize(
    ("masses", "meant"),
    [
        (
            [322917.0, 321573.0, 321.573, 303646.0],
            r"of a floor over that of a neighbouring one \('floor 2': 321573 kg, 'floor 3': 321.573 kg\) is 1000 .*"
            "with one given in tonnes, it would be 1,",
        ),
        # A weight of 3,154 kN, as 1 kN is 102 kg.
        ([322917.0, 321573.0, 321573.0, 3154.0], r"'floor 4': 3154 kg\) is 101.* with one given in kN of weight"),
        ([322917.0, 321573.0, 321573.0 / 60, 303646.0], r"'floor 2': 321573 kg, 'floor 3': 5359.55 kg\) is 60 "),
        ([322917.0, 321573.0, 0.0, 303646.0], "mass of floor 'floor 3' is 0 kg .*give the mass, or remove the entry"),
    ],
)
def test_one_wrong_mass_is_named(masses, meant):
    with pytest.warns(UserWarning, match=meant) as caught:
        frame = with_masses(masses)
    assert len(caught) == 1
    wd.fishbone(frame)  # does not repeat the warning


def test_light_floors_and_nodes_along_members_are_not_warned_of():
    with_masses([322917.0, 321573.0, 321573.0, 32e3])  # a light roof
    with_masses([322917.0, 321573.0, 321573.0, 321573.0 / 60])  # a penthouse
    nodes = {"A": (0.0, 0.0), "M": {"x": 0.0, "y": 5.0, "mass": 500.0}, "B": {"x": 0.0, "y": 10.0, "mass": 5e5}}
    pier = {"elastic_modulus": 3e10, "area": 2.0, "second_moment": 0.3}
    wd.Frame(nodes, {"low": ("A", "M", "p"), "high": ("M", "B", "p")}, {"p": pier}, supports={"A": "fixed"})


@pytest.mark.parametrize(
    ("load", "mass", "meant"),
    [
        (10.0, 10.0, "masses as weights in N"),  # N over kg: both are weights with g = 10
        (9.81, 10.0, "masses as weights in N"),
        (10.0, 9.81, "masses as weights in N"),
        (100.0, 1.0, "multiplied by g twice"),
        (98.1, 1.0, "multiplied by g twice"),
    ],
)
def test_weights_with_a_rounded_g_are_warned_of(load, mass, meant):
    def frame(load: float, mass: float) -> wd.Frame:
        arguments = portal().description()
        nodes = {name: row | {"gravity_load": 0.0} for name, row in arguments["nodes"].items()}
        nodes["L1"]["gravity_load"] = 70e3 * load
        return wd.Frame(**arguments | {"nodes": nodes, "masses": {"floor 1": 70e3 * mass}})

    frame(9.81, 1.0)
    frame(10.0, 1.0)
    with pytest.warns(UserWarning, match=f"gravity loads of the frame over its masses is .*{meant}") as caught:
        frame(load, mass)
    assert len(caught) == 1


def structure() -> wd.LumpedStructure:
    return portal().lumped(damping="modal", damping_ratio=0.02)


@pytest.mark.parametrize(
    ("name", "factor", "meant"),
    [
        ("second_moment", 1e12, "second_moment over the nominal value of member 'C1_1' is 1e.12.*given in mm4.* be 1,"),
        ("second_moment", 1e-3, "of second_moment over the nominal value of member 'C1_1' is 0.001 .*another unit"),
        ("area", 1e6, "of area over the nominal value .*: if given in mm2, it would be 1,"),
        ("elastic_modulus", 1e-6, "of elastic_modulus over the nominal value .*: if given in MPa or N/mm2, .* 1,"),
        ("mass", 1e-3, "of mass over the nominal value of dof 'floor 1' is 0.001 .*: if given in tonnes, .* 1,"),
    ],
)
def test_given_masses_and_sections_in_other_units_are_warned_of(name, factor, meant):
    nominal = structure().parameters[name]
    given = wd.GivenValues(np.outer([0.5, 1.0, 2.0], nominal))
    warn_of_implausible(wd.Scene(structure(), MOTION, {name: given}))
    wrong = wd.GivenValues(factor * np.asarray(given.values))
    with wd.meant_as_given("first_period"), pytest.warns(UserWarning, match=meant) as caught:
        warn_of_implausible(wd.Scene(structure(), MOTION, {name: wrong}))
    assert len(caught) == 1


@pytest.mark.parametrize("mean", [1000.0, 0.001])
def test_factors_that_change_the_unit_are_warned_of(mean):
    factor = wd.RandomFactor(wd.Lognormal(mean, 0.1), per="member", only=("C1_1",))
    with pytest.warns(UserWarning, match=r"random factor of second_moment is .* for a change of units, multiply"):
        warn_of_implausible(wd.Scene(structure(), MOTION, {"second_moment": factor}))


def with_hinges(strength: float) -> wd.HingedFrame:
    """Return the portal with 50 kN/m on its beam, which lead to end moments of about 139 kN m, and hinges there."""
    arguments = portal().description()
    arguments["members"]["B1_1"] |= {"gravity_load": 50e3}
    hinge = {"law": "bilinear", "yield_force": strength, "hardening_ratio": 0.02}
    hinges = {("B1_1", end): hinge for end in ENDS}
    return wd.HingedFrame(wd.Frame(**arguments), hinges, damping="modal", damping_ratio=0.02)


def test_random_yield_moments_below_those_under_gravity_are_warned_of():
    moment = with_hinges(4e5).gravity_moments[0]
    # w L^2 / 12 with fixed ends; the joints rotate.
    assert 0.5 * 50e3 * 6.0**2 / 12 < moment < 50e3 * 6.0**2 / 12
    frame = with_hinges(2 * moment)
    values = np.full((20, 3), np.nan)  # the storey has no yield moment
    values[:, 1:] = 2 * moment
    few = values.copy()
    few[0, 1:] = 0.9 * moment
    many = values.copy()
    many[:3, 1:] = 0.9 * moment
    # The 5 % quantile of a lognormal factor of median 1 is exp(-1.645 dispersion): 0.52 and 0.44.
    for spread in (
        wd.RandomFactor(wd.Lognormal(1.0, 0.4), per="spring"),
        wd.RandomValue(wd.Lognormal(2 * moment, 0.4), per="building", only=frame.hinge_names),
        wd.GivenValues(few),
    ):
        warn_of_implausible(wd.Scene(frame, MOTION, {"yield_force": spread}))
    for spread in (
        wd.RandomFactor(wd.Lognormal(1.0, 0.5), per="spring"),
        wd.RandomValue(wd.Lognormal(2 * moment, 0.5), per="building", only=frame.hinge_names),
        wd.GivenValues(many),
    ):
        text = r"under gravity over the random yield_force .*of 'B1_1 (start|end)' is 1\..*scatter of yield_force"
        with pytest.warns(UserWarning, match=text) as caught:
            warn_of_implausible(wd.Scene(frame, MOTION, {"yield_force": spread}))
        assert len(caught) == 1


def test_a_hinge_that_stays_elastic_gives_no_warning():
    warn_of_implausible(wd.Scene(with_hinges(1e13), MOTION, {}))


def test_the_gravity_check_is_kept_where_that_of_yield_rotations_is_turned_off():
    with (
        wd.meant_as_given("hinge_yield_rotation"),
        pytest.warns(UserWarning, match="gravity alone exceeds the yield moment"),
    ):
        with_hinges(300.0)


@pytest.mark.parametrize("wrong", [0.0, -1e4, np.nan])
def test_masses_without_inertia_are_refused_with_the_degree_of_freedom(wrong):
    message = f"degree of freedom 'floor 1' has no mass in structure 1 ({wrong:g} kg): give it a mass above 0"
    for each in (with_hinges(4e5), structure()):
        problem = each.problem(dict(each.parameters) | {"mass": np.array([[1e5], [wrong], [1e5]])})
        assert problem.startswith(message)


def test_one_stiffness_of_a_hinge_in_another_unit_is_warned_of():
    arguments = portal().description()
    hinge = {"law": "bilinear", "yield_force": 4e5, "hardening_ratio": 0.02}
    whole = arguments["members"]["B1_1"]["spring_start"]
    for factor in (0.1, 1.0, 1e3):
        arguments["members"]["B1_1"]["spring_start"] = factor * whole
        wd.HingedFrame(wd.Frame(**arguments), {("B1_1", "start"): hinge}, damping="modal", damping_ratio=0.02)
    arguments["members"]["B1_1"]["spring_start"] = 1e-3 * whole
    meant = r"of 'B1_1 start' is 0.01 .*with spring_start or spring_end given in kN m/rad, it would be 10"
    with pytest.warns(UserWarning, match=meant):
        wd.HingedFrame(wd.Frame(**arguments), {("B1_1", "start"): hinge}, damping="modal", damping_ratio=0.02)


@pytest.mark.parametrize(
    ("name", "factor", "meant"),
    [
        (
            "second_moment",
            1e8,
            "given second_moment of member 'B1_1' in structure 2 over .* is 1e.08 .*in cm4, .* be 1,",
        ),
        (
            "area",
            1e4,
            "given area of member 'B1_1' in structure 2 over .* is 10000 .*: if given in cm2, it would be 1,",
        ),
        ("elastic_modulus", 1e-6, "given elastic_modulus of member 'B1_1' in structure 2 .*: if given in MPa .* be 1,"),
    ],
)
def test_one_structure_of_many_in_another_unit_is_warned_of(name, factor, meant):
    given = np.outer(np.ones(5), structure().parameters[name])
    given[2, list(structure().frame.members).index("B1_1")] *= factor
    with pytest.warns(UserWarning, match=meant) as caught:
        warn_of_implausible(wd.Scene(structure(), MOTION, {name: wd.GivenValues(given)}))
    assert len(caught) == 1


def test_one_structure_with_a_damaged_member_is_not_warned_of():
    given = np.outer(np.ones(5), structure().parameters["second_moment"])
    given[2, list(structure().frame.members).index("B1_1")] *= 1e-3
    warn_of_implausible(wd.Scene(structure(), MOTION, {"second_moment": wd.GivenValues(given)}))
