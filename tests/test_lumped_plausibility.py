"""Values of lumped structures in other units (kN, mm, percent, t/m3) give one warning that names the quantity."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

TIME = 0.01 * np.arange(500)
MOTION = wd.GroundMotion(3.0 * np.sin(8 * TIME) * np.exp(-0.5 * TIME), 0.01)
DAMPED = {"damping": "rayleigh", "damping_ratio": 0.05}
RATIO = {"damping_ratio": 0.05}
PLAN = [[-10.0, 10.0], [-6.0, 6.0]]


def warnings_of(call: Callable[[], object]) -> str:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        structure = call()
        if isinstance(structure, wd.LumpedStructure):
            motion = wd.PairOfMotions(MOTION, MOTION) if structure.components > 1 else MOTION
            warn_of_implausible(wd.Scene(structure, motion))
    return " ".join(str(each.message) for each in found)


def frame(**changes) -> wd.LumpedStructure:
    """Return two floors on yielding springs, and a stop."""
    given = {"stiffness": 5e7, "yield_force": 3e5, "mass": 1e5, "clearance": 0.05, "capacity": 0.1} | changes
    bilinear = {"law": "bilinear", "hardening_ratio": 0.05, "stiffness": given["stiffness"]}
    bilinear |= {"yield_force": given["yield_force"], "deformation_capacity": given["capacity"]}
    contact = wd.laws.HertzContact(clearance=given["clearance"], hertz_stiffness=given.get("hertz", 2.75e9))
    springs = [
        wd.Spring("first", {"u1": 1.0}, **bilinear),
        wd.Spring("second", {"u2": 1.0, "u1": -1.0}, **bilinear),
        wd.Spring("stop", {"u2": 1.0}, law=contact),
    ]
    return wd.LumpedStructure({"u1": given["mass"], "u2": given["mass"]}, springs, **DAMPED)


def sliding(weight: float = 100e3 * 9.81, **changes) -> wd.LumpedStructure:
    """Return a pier, and a deck of 200 t on two sliders: one on the pier, one on the abutment."""
    law = wd.laws.FrictionSlider(fast_friction=0.08, slow_friction=0.03, rate_parameter=50.0, radius=2.0, weight=weight)
    stiffness = 31 * weight
    springs = [
        wd.BiaxialSpring("at pier", {"x": 1.0, "px": -1.0}, {"y": 1.0, "py": -1.0}, law=law, stiffness=stiffness),
        wd.BiaxialSpring("at abutment", {"x": 1.0}, {"y": 1.0}, law=law, stiffness=stiffness),
        wd.Spring("pier x", {"px": 1.0}, stiffness=1e8),
        wd.Spring("pier y", {"py": 1.0}, stiffness=1e8),
    ]
    masses = {"x": 200e3, "y": 200e3, "px": 40e3, "py": 40e3}
    influence = [{"x": 1.0, "px": 1.0}, {"y": 1.0, "py": 1.0}]
    return wd.LumpedStructure(masses, springs, influence=influence, **DAMPED)


def pounding(impact_mass: float) -> wd.LumpedStructure:
    """Return two masses of 150 and 300 t (mass of the impact: 100 t) with a contact."""
    law = wd.laws.JankowskiContact(clearance=0.02, hertz_stiffness=2.75e9, restitution=0.65, impact_mass=impact_mass)
    springs = [
        wd.Spring("left", {"a": 1.0}, stiffness=3e7),
        wd.Spring("right", {"b": 1.0}, stiffness=9e7),
        wd.Spring("contact", {"a": 1.0, "b": -1.0}, law=law),
    ]
    return wd.LumpedStructure({"a": 150e3, "b": 300e3}, springs, influence={"a": 1.0, "b": 1.0}, **DAMPED)


def hinge(**changes) -> wd.FlexuralShearBuilding:
    given = {"law": "bilinear", "stiffness": 1e12, "yield_force": 4e8, "hardening_ratio": 0.02} | changes
    return wd.FlexuralShearBuilding([4e5] * 4, 3.0, period=0.4, alpha0=4.0, base_hinge=given, **DAMPED)


def torsional(plan: list, **changes) -> wd.TorsionalBuilding:
    edges = np.array(plan)
    frames = [
        wd.PlanFrame("front", (0.0, edges[1, 0]), "x", 6e7),
        wd.PlanFrame("back", (0.0, edges[1, 1]), "x", 6e7),
        wd.PlanFrame("west", (edges[0, 0], 0.0), "y", 9e7),
    ]
    return wd.TorsionalBuilding([1.5e5], plan, frames, base_motion="x", **DAMPED, **changes)


def soil(**changes) -> wd.Soil:
    return wd.Soil(**{"poisson_ratio": 0.35, "density": 1800.0, "shear_wave_velocity": 150.0} | changes)


def tower(height: float = 3.0, **changes) -> wd.FlexuralShearBuilding:
    return wd.FlexuralShearBuilding([4e5] * 4, height, period=0.4, alpha0=4.0, **DAMPED, **changes)


def absorber(**changes) -> wd.LumpedStructure:
    return wd.with_absorber(wd.ShearBuilding([1e5] * 2, 5e7, 3.0, **DAMPED), "u2", **{"mass_ratio": 0.02} | changes)


def storeys(height: float = 3.5) -> wd.LumpedStructure:
    springs = [wd.Spring("first", {"u1": 1.0}, stiffness=5e7)]
    springs += [wd.Spring("second", {"u2": 1.0, "u1": -1.0}, stiffness=5e7)]
    of_storeys = {"storey_height": height, "storey_springs": ["first", "second"]}
    return wd.LumpedStructure({"u1": 1e5, "u2": 1e5}, springs, **of_storeys, **DAMPED)


FOUNDATION = {"sway_stiffness": 1.8e9, "rocking_stiffness": 7.6e10, "sway_dashpot": 6.5e7, "rocking_dashpot": 2.1e8}
FOUNDATION |= {"vertical_stiffness": 2.1e9}


def on_soil(**changes) -> wd.LumpedStructure:
    """Return an oscillator of 500 t and 0.4 s on a foundation of 150 t."""
    given = FOUNDATION | {"foundation_mass": 150e3, "rocking_inertia": 2e6, "weight": None} | changes
    building = wd.ShearBuilding([500e3], [500e3 * (2 * np.pi / 0.4) ** 2], 12.0, **{"damping": "modal"} | RATIO)
    springs = wd.FoundationSprings(**{name: given[name] for name in FOUNDATION})
    uplift = None if given["weight"] is None else wd.FoundationUplift(weight=given["weight"])
    base = {name: given[name] for name in ("foundation_mass", "rocking_inertia")}
    return wd.structure_on_soil(building, springs, uplift=uplift, **base)


def with_factors(name: str, factors: list) -> None:
    building = wd.ShearBuilding([1e5] * 2, 5e7, 3.0, **DAMPED)
    warn_of_implausible(wd.Scene(building, MOTION, {name: wd.GivenFactors(factors)}))


@pytest.mark.parametrize(
    "call",
    [
        *(frame, hinge, lambda: torsional(PLAN), soil, tower, absorber, lambda: tower(gravity_load="weight")),
        *(sliding, lambda: pounding(100e3), lambda: torsional(PLAN, inertia=1.5e5 * 8.0**2, storey_height=3.5)),
        *(storeys, on_soil, lambda: on_soil(weight=9.8 * 650e3), lambda: on_soil(sway_dashpot=0.0)),
        *(lambda: soil(shear_wave_velocity=None, shear_modulus=40e6), lambda: wd.CircularFooting(30.0)),
        *(lambda: with_factors("stiffness", [0.7, 1.4]), lambda: with_factors("damping_ratio", [0.5, 2.0])),
    ],
)
def test_plausible_structures_give_no_warning(call):
    assert warnings_of(call) == ""


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: frame(yield_force=300.0),
            ("deformation at which the spring yields of spring 'first'", "kN, it would be"),
        ),
        (lambda: frame(yield_force=300.0), ("yield forces of all springs over the weight", "given in kN")),
        (lambda: frame(capacity=100.0), ("deformation capacity of the spring", "given in mm, it would be 0.1 m")),
        (
            lambda: frame(clearance=50.0),
            ("clearance of the spring of spring 'stop'", "given in mm, it would be 0.05 m"),
        ),
        (lambda: frame(hertz=2.75e6), ("Hertz stiffness of the contact", "given in kN/m^1.5, it would be 2.75e+09")),
        (lambda: hinge(yield_force=4e5), ("rotation at which the spring yields", "kN m, it would be 0.0004 rad")),
        (lambda: torsional([[-1e4, 1e4], [-6e3, 6e3]]), ("side of the plan", "given in mm, it would be 20 m")),
        (lambda: soil(density=1.8), ("density of the soil is 1.8 kg/m3", "t/m3, it would be 1.8e+03")),
        (lambda: soil(density=18.0), ("density of the soil is 18 kg/m3", "kN/m3 of weight, it would be 1.84e+03")),
        (lambda: soil(shear_wave_velocity=0.15), ("shear-wave velocity of the soil", "km/s, it would be 150 m/s")),
        (lambda: tower(3000.0), ("storey height at storey 1 is 3000 m", "given in mm, it would be 3 m")),
        (lambda: torsional(PLAN, storey_height=3500.0), ("storey height is 3500 m", "given in mm, it would be 3.5 m")),
        (lambda: storeys(3500.0), ("storey height at storey 1 is 3500 m", "given in mm, it would be 3.5 m")),
        (lambda: on_soil(weight=6374.0), ("times g is 0.00099", "weight given in kN, it would be 1")),
        (lambda: on_soil(weight=650e3), ("times g is 0.10197", "weight given in kg, it would be 1")),
        (lambda: on_soil(weight=6.4e7), ("weight of FoundationUplift over the masses", "usual: 0.5 to 2")),
        (
            lambda: on_soil(sway_stiffness=1.8e6, rocking_stiffness=7.6e7, sway_dashpot=0.0),
            ("first period on soil over that on a fixed base is 17.69", "may be given in kN/m and kN m"),
        ),
        (lambda: on_soil(sway_dashpot=6.5e4), ("sway_dashpot over sway_stiffness", "kN s/m, it would be 0.0361 s")),
        (lambda: on_soil(foundation_mass=150.0), ("is 0.0003", "foundation_mass given in tonnes, it would be 0.3")),
        (lambda: on_soil(rocking_inertia=2e3), ("rocking_inertia over all masses", "t m2, it would be 0.0729")),
        (lambda: wd.RectangularFooting(10e3, 6e3), ("footing (half_length) is 10000 m", "given in mm, it would be 10")),
        (lambda: wd.RectangularFooting(10.0, 6.0, 2e3), ("footing (embedment) is 2000 m", "mm, it would be 2 m")),
        (lambda: wd.CircularFooting(5e3), ("footing (radius) is 5000 m", "given in mm, it would be 5 m")),
        (
            lambda: soil(shear_wave_velocity=None, shear_modulus=40.0),
            ("shear modulus of the soil is 40 N/m2", "given in MPa, it would be 4e+07 N/m2"),
        ),
        (
            lambda: soil(shear_wave_velocity=None, shear_modulus=40e3),
            ("shear modulus of the soil is 40000 N/m2", "given in kPa, it would be 4e+07 N/m2"),
        ),
        (
            lambda: with_factors("stiffness", [90, 100, 110]),
            ("given factor of stiffness is 110", "percent, it would be 1.1"),
        ),
        (
            lambda: with_factors("stiffness", [0.1, 0.05, 0.2]),
            ("given factor of stiffness is 0.05", "may be a deviation from 1: give 1 + deviation"),
        ),
        (
            lambda: with_factors("stiffness", [0.2, 0.15, 0.3]),
            ("median of the given factors of stiffness is 0.2", "may be deviations from 1: give 1 + deviation"),
        ),
        (lambda: tower(gravity_load=3924.0), ("gravity load over mass times g is 0.001", "given in kN")),
        (
            lambda: sliding(100e3),
            ("weight on the sliders over the weight that moves on them is 0.10197", "given in kg"),
        ),
        (lambda: sliding(981.0), ("weight on the sliders over the weight that moves on them is 0.001", "given in kN")),
        (lambda: pounding(100.0), ("of spring 'contact' is 0.001", "impact_mass given in tonnes, it would be 1")),
        (lambda: torsional(PLAN, inertia=8.2e3), ("half the diagonal of the plan is 0.02", "inertia given in t m2")),
        (lambda: torsional(PLAN, inertia=7.0), ("half the diagonal of the plan", "mass * radius**2")),
        (lambda: torsional(PLAN, inertia=1.5e5 * 15**2), ("half the diagonal of the plan is 1.28",)),
        (lambda: absorber(mass_ratio=0.9), ("tuned mass damper is 0.9", "percent, it would be 0.009")),
    ],
)
def test_a_value_in_another_unit_is_named(call, words):
    found = warnings_of(call)
    for each in words:
        assert each in found, found


def test_a_warning_can_be_turned_off():
    with wd.meant_as_given("soil_density"):
        assert warnings_of(lambda: soil(density=1.8)) == ""
