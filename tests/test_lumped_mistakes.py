"""Mistakes in lumped structures are named early: lengths, laws, correlations, and calls for storeys."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from lumped_cases import pulse

import warpdyn as wd
from warpdyn.foundations.core.description import fingerprint

LUMPED = wd.LumpedStructure({"x": 1e5}, [wd.Spring("s", {"x": 1.0}, stiffness=1e7)])
PLAN = [[-10.0, 10.0], [-6.0, 6.0]]


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: wd.FlexuralShearBuilding([1e5] * 3, [3.0], period=1.0, alpha0=4.0), "storey_height must be one value"),
        (
            lambda: wd.FlexuralShearBuilding([1e5] * 3, 3.0, bending_stiffness=[1e9], shear_stiffness=1e8),
            "bending_stiffness must be one value or one per storey \\(3\\)",
        ),
        (
            lambda: wd.FlexuralShearBuilding([1e5] * 3, 3.0, period=1.0, alpha0=4.0, gravity_load=[1e6]),
            "gravity_load must be one value",
        ),
        (
            lambda: wd.TorsionalBuilding(
                [1e5] * 2, PLAN, [wd.PlanFrame("a", (0.0, 0.0), "x", [1e7])] * 1, base_motion="x"
            ),
            "frame 'a': stiffness must be one value or one per storey \\(2\\)",
        ),
    ],
)
def test_a_list_with_one_value_is_not_a_value_for_all_storeys(made, message):
    with pytest.raises(ValueError, match=message):
        made()


def test_a_biaxial_spring_whose_parameters_contradict_each_other_is_refused_when_it_is_made():
    axes = {"x": 1.0}, {"y": 1.0}
    with pytest.raises(ValueError, match=r"biaxial spring 'b': post_yield_stiffness is 2e\+06 N/m; it must be below"):
        wd.BiaxialSpring("b", *axes, law="circular_yield", stiffness=1e6, yield_force=1e4, post_yield_stiffness=2e6)
    slider = {"fast_friction": 0.03, "slow_friction": 0.08, "rate_parameter": 50.0, "radius": 2.0, "weight": 1e5}
    with pytest.raises(ValueError, match=r"biaxial spring 'b': fast_friction is 0.03 and slow_friction is 0.08"):
        wd.BiaxialSpring("b", *axes, law="friction_slider", stiffness=1e6, **slider)


def test_a_correlation_between_springs_and_degrees_of_freedom_is_refused():
    chain = wd.lumped_chain(wd.ShearBuilding([1e5, 1e5], 5e7, 3.0, damping="rayleigh", damping_ratio=0.05))
    factor = wd.Lognormal(1.0, 0.1)
    of_each = {
        "stiffness": wd.RandomFactor(factor, per="spring"),
        "mass": wd.RandomFactor(factor, per="dof"),
    }
    with pytest.raises(ValueError, match="stiffness has one draw per spring and mass one per dof"):
        wd.Scene(chain, pulse(2.0, 0.5, 0.4), of_each, {("stiffness", "mass"): 0.5})
    of_building = {**of_each, "mass": wd.RandomFactor(factor)}
    wd.Scene(chain, pulse(2.0, 0.5, 0.4), of_building, {("stiffness", "mass"): 0.5})


def test_calls_that_need_storeys_say_what_to_do_with_a_lumped_structure():
    with pytest.raises(TypeError, match=r"got LumpedStructure as building; push a lumped structure"):
        wd.storey_hysteresis(LUMPED, [0.1])
    with pytest.raises(TypeError, match="forces_along"):
        wd.laws.certify(wd.laws.CircularYield(yield_force=1e5, post_yield_stiffness=1e6))
    with pytest.raises(TypeError, match="it needs the rate of deformation"):
        wd.laws.certify(wd.laws.HertzContact(clearance=0.02, hertz_stiffness=2.75e9))


@pytest.mark.meant_as_given("no_damping", "first_period", "strongest_motion")
def test_fragility_names_the_demand_of_a_lumped_structure():
    stripes = wd.Stripes([pulse(2.0, 0.5, 0.4, 2.0)], [0.1, 0.2], wd.PeakGroundAcceleration())
    run = wd.simulate(wd.Scene(LUMPED, stripes), device="cpu")
    for function in (wd.fragility, wd.fragility_of_cloud):
        with pytest.raises(ValueError, match=r"LumpedStructure needs storeys .*; otherwise give demand=, such as"):
            function(run, {"slight": 0.01})


def test_a_vehicle_from_json_gives_no_warnings_meant_for_buildings():
    car = wd.QuarterCar(300.0, 60.0, 16e3, 1e3, 190e3)
    road = wd.SineRoad(0.01, 5.0).motion(speed=20.0, duration=1.0, step=0.002)
    again = wd.Scene.from_json(wd.Scene(car, road).to_json(), road)
    assert again.structure.is_machine
    assert not wd.Scene.from_json(wd.Scene(LUMPED, road).to_json(), road).structure.is_machine
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = wd.simulate(again, device="cpu")
    first = wd.simulate(wd.Scene(car, road), device="cpu")
    np.testing.assert_array_equal(run["peak_acceleration"], first["peak_acceleration"])


def test_machines_from_json_are_those_of_their_builders():
    road = wd.RoadBump(height=0.05, length=2.0)
    car = wd.HalfCar(1200.0, 2100.0, 0.9, 1.2, (60.0, 60.0), (28e3, 21e3), (2500.0, 2000.0), (2e5, 2e5))
    axles = road.motion_of_axles(car.wheelbase, speed=10.0, duration=1.0, step=0.002)
    for machine in (car, wd.UnbalancedRotor(100.0, 4e6, eccentricity=1e-4, damping_ratio=0.02)):
        scene = wd.Scene(machine, axles)
        again = wd.Scene.from_json(scene.to_json(), [axles])
        assert again.structure.is_machine
        assert "incidence_angle" not in again.structure.parameters
        assert again.to_json() == scene.to_json()
        first, second = (wd.simulate(each, device="cpu") for each in (scene, again))
        np.testing.assert_array_equal(first["peak_acceleration"], second["peak_acceleration"])
    equipped = wd.with_equipment(car, "bounce", 10.0, period=0.1, damping_ratio=0.05)
    assert equipped.is_machine
    assert not wd.with_equipment(LUMPED, LUMPED.dof_names[0], 10.0, period=0.1, damping_ratio=0.05).is_machine
    with pytest.raises(TypeError, match="is_machine must be True or False"):
        wd.LumpedStructure({"x": 1.0}, [wd.Spring("k", {"x": 1.0}, stiffness=1.0)], is_machine=1)


def test_fingerprints_of_built_structures_survive_the_json():
    """A run to a file that was interrupted can be resumed with the scene from the JSON."""
    motion = pulse(2.0, 0.5, 0.4)
    both = wd.PairOfMotions(motion, motion)
    built = {
        wd.QuarterCar(300.0, 60.0, 16e3, 1e3, 190e3): motion,
        wd.HalfCar(1200.0, 2100.0, 0.9, 1.2, (60.0, 60.0), (28e3, 21e3), (2500.0, 2000.0), (2e5, 2e5)): both,
        wd.UnbalancedRotor(100.0, 4e6, eccentricity=1e-4, damping_ratio=0.02): both,
        wd.HousnerTank(wd.housner_cylinder(radius=10.0, depth=8.0), impulsive_period=0.15): motion,
        wd.FlexuralShearBuilding([1e5] * 3, 3.0, period=0.6, alpha0=5.0): motion,
    }
    found = set()
    for structure, motions in built.items():
        scene = wd.Scene(structure, motions)
        again = wd.Scene.from_json(scene.to_json(), [motions])
        assert again.to_json() == scene.to_json()
        assert type(again.structure) is wd.LumpedStructure
        assert fingerprint(again) == fingerprint(scene)
        found.add(fingerprint(scene))
    assert len(found) == len(built)
    others = [wd.UnbalancedRotor(mass, 4e6, eccentricity=1e-4, damping_ratio=0.02) for mass in (100.0, 101.0)]
    assert fingerprint(others[0]) != fingerprint(others[1])
