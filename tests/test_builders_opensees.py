"""Built structures against models in OpenSees that are assembled from nodes, elements and constraints."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable

import numpy as np
import pytest
from lumped_cases import pair, pulse
from opensees import chain_drifts, opensees

import warpdyn as wd

pytestmark = [
    pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion"),
    pytest.mark.skipif(importlib.util.find_spec("openseespy") is None, reason="openseespy is not installed"),
]
SETTINGS = {"dtype": "float64", "device": "cpu"}
STEP = 0.0005
BOUND = 5e-4  # relative difference of peaks; both have an error of about 1e-4 at yielding


def run_of(structure, motion, step=STEP, **changed):
    return wd.simulate(wd.Scene(structure, motion, tail=0.0), step=step, **SETTINGS, **changed)


def analysed(motions: dict[int, wd.GroundMotion], rayleigh: tuple[float, float], state: Callable, duration: float):
    """Return the states of a model that is built, at all steps, by average acceleration."""
    ops = opensees()
    for direction, motion in motions.items():
        values = [*motion.acceleration.tolist(), 0.0, 0.0]
        ops.timeSeries("Path", direction, "-dt", motion.step, "-values", *values)
        ops.pattern("UniformExcitation", direction, direction, "-accel", direction)
    ops.rayleigh(rayleigh[0], 0.0, rayleigh[1], 0.0)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("FullGeneral")
    ops.test("NormDispIncr", 1e-11, 50)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    found = []
    for _ in range(round(duration / STEP)):
        assert ops.analyze(1, STEP) == 0
        found.append(state())
    ops.wipe()
    return np.array(found)


def test_a_torsional_building_with_an_eccentric_mass():
    # Nodes in plan, with the displacements x and y and the rotation; frames are zero-length springs between nodes that
    # rigid links connect with the centres of mass.
    floors, centre, plan = 2, (1.2, -0.7), [[-10.0, 10.0], [-6.0, 6.0]]
    masses, share = [1.5e5, 1.2e5], np.array([1.0, 0.7])
    rows = [("a", (0, 5), 0, 6e7, 9e5), ("b", (-2, -5), 0, 4e7, 6e5)]
    rows += [("c", (-9, 1), 1, 9e7, 12e5), ("d", (9, 0), 1, 3e7, 4e5)]
    frames = [
        wd.PlanFrame(name, at, "xy"[axis], k * share, law="bilinear", yield_force=fy * share, hardening_ratio=0.05)
        for name, at, axis, k, fy in rows
    ]
    building = wd.TorsionalBuilding(
        masses, plan, frames, mass_centre=centre, damping="rayleigh", damping_ratio=0.05, damping_modes=(1, 4)
    )
    first, fourth = building.modal()["circular_frequency"].values[[0, 3]]
    a1 = 2 * 0.05 / (first + fourth)
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for floor in range(floors + 1):
        tag = 100 * floor
        ops.node(tag + 10, *centre)
        for place, (_, at, *_) in enumerate(rows):
            ops.node(tag + 11 + place, float(at[0]), float(at[1]))
            if floor == 0:
                ops.fix(tag + 11 + place, 1, 1, 1)
            else:
                ops.rigidLink("beam", tag + 10, tag + 11 + place)
        if floor == 0:
            ops.fix(tag + 10, 1, 1, 1)
        else:
            mass = masses[floor - 1]
            ops.mass(tag + 10, mass, mass, mass * (20**2 + 12**2) / 12)
    for storey in range(floors):
        for place, (_, _, axis, k, fy) in enumerate(rows):
            tag = 10 * (storey + 1) + place
            ops.uniaxialMaterial("Steel01", tag, fy * share[storey], k * share[storey], 0.05)
            nodes = (100 * storey + 11 + place, 100 * storey + 111 + place)
            ops.element("zeroLength", tag, *nodes, "-mat", tag, "-dir", axis + 1, "-doRayleigh", 1)

    def drifts() -> list[float]:
        return [
            ops.nodeDisp(100 * storey + 111 + place, axis + 1) - ops.nodeDisp(100 * storey + 11 + place, axis + 1)
            for place, (_, _, axis, *_) in enumerate(rows)
            for storey in range(floors)
        ]

    both = pair(pulse(5.0, 0.9, 0.6, 4.0), pulse(4.0, 0.6, 0.5, 4.0))
    found = np.abs(analysed({1: both.x, 2: both.y}, (a1 * first * fourth, a1), drifts, 4.0)).max(axis=0)
    run = run_of(building, both)
    assert [spring.name for spring in building.springs[:3]] == ["a 1", "a 2", "b 1"]
    np.testing.assert_allclose(run["peak_spring_deformation"][0], found, rtol=BOUND)
    yields = building.parameters["yield_force"] / building.parameters["stiffness"]
    assert (found > 2 * yields).sum() >= 2


@pytest.mark.parametrize("gravity_load", [None, [3e6] * 4])
def test_a_flexural_shear_building_with_yielding_frames(gravity_load):
    storeys, height, mass, bending, shear = 4, 3.5, 3e5, 4e10, 6e8
    yields = np.array([6e5, 5e5, 4e5, 2.5e5])
    tower = wd.FlexuralShearBuilding(
        [mass] * storeys,
        height,
        bending_stiffness=bending,
        shear_stiffness=shear,
        law="bilinear",
        yield_force=yields,
        hardening_ratio=0.05,
        gravity_load=gravity_load,
        damping="stiffness_proportional",
        damping_ratio=0.03,
    )
    a1 = 2 * 0.03 / tower.modal()["circular_frequency"].values[0]
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.geomTransf("Linear", 1)
    for floor in range(storeys + 1):
        ops.node(floor, 0.0, height * floor)
        ops.node(100 + floor, 0.0, 0.0)  # of the shear springs
        ops.fix(floor, *((1, 1, 1) if floor == 0 else (0, 1, 0)))
        ops.fix(100 + floor, *((1, 1, 1) if floor == 0 else (0, 1, 1)))
        if floor:
            ops.mass(floor, mass, 0.0, 0.0)
            ops.equalDOF(floor, 100 + floor, 1)
    for storey in range(storeys):
        ops.element("elasticBeamColumn", storey + 1, storey, storey + 1, 1.0, bending, 1.0, 1)
        ops.uniaxialMaterial("Steel01", storey + 1, yields[storey], shear / height, 0.05)
        nodes = (100 + storey, 101 + storey)
        ops.element("zeroLength", 11 + storey, *nodes, "-mat", storey + 1, "-dir", 1, "-doRayleigh", 1)
        if gravity_load is not None:
            ops.uniaxialMaterial("Elastic", 51 + storey, -sum(gravity_load[storey:]) / height)
            ops.element("zeroLength", 51 + storey, *nodes, "-mat", 51 + storey, "-dir", 1)
    motion = pulse(9.0, 0.6, 0.4, 4.0)

    def displacements() -> list[float]:
        return [ops.nodeDisp(floor, 1) for floor in range(1, storeys + 1)]

    found = analysed({1: motion}, (0.0, a1), displacements, 4.0)
    run = run_of(tower, motion)
    np.testing.assert_allclose(run["peak_displacement"][0], np.abs(found).max(axis=0), rtol=BOUND)
    drifts = np.abs(np.diff(found, axis=1, prepend=0.0)).max(axis=0)
    np.testing.assert_allclose(run["peak_spring_deformation"][0], drifts, rtol=BOUND)
    assert (drifts > 2 * yields / (shear / height)).any()


def test_a_wall_with_a_yielding_hinge_at_its_base():
    # In OpenSees the rotations have no mass; here the base rotation has a moment of inertia.
    storeys, height, mass, bending, shear = 10, 3.0, 2e5, 8e10, 4e8
    hinge, moment = 5e10, 3e7
    tower = wd.FlexuralShearBuilding(
        [mass] * storeys,
        height,
        bending_stiffness=bending,
        shear_stiffness=shear,
        base_hinge={"law": "bilinear", "stiffness": hinge, "yield_force": moment, "hardening_ratio": 0.03},
        damping="stiffness_proportional",
        damping_ratio=0.03,
    )
    a1 = 2 * 0.03 / tower.modal()["circular_frequency"].values[0]
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.geomTransf("Linear", 1)
    ops.node(99, 0.0, 0.0)
    ops.fix(99, 1, 1, 1)
    for floor in range(storeys + 1):
        ops.node(floor, 0.0, height * floor)
        ops.node(100 + floor, 0.0, 0.0)  # of the shear springs
        ops.fix(floor, *((1, 1, 0) if floor == 0 else (0, 1, 0)))
        ops.fix(100 + floor, *((1, 1, 1) if floor == 0 else (0, 1, 1)))
        if floor:
            ops.mass(floor, mass, 0.0, 0.0)
            ops.equalDOF(floor, 100 + floor, 1)
    ops.uniaxialMaterial("Steel01", 1, moment, hinge, 0.03)
    ops.element("zeroLength", 50, 99, 0, "-mat", 1, "-dir", 3, "-doRayleigh", 1)
    ops.uniaxialMaterial("Elastic", 2, shear / height)
    for storey in range(storeys):
        ops.element("elasticBeamColumn", storey + 1, storey, storey + 1, 1.0, bending, 1.0, 1)
        nodes = (100 + storey, 101 + storey)
        ops.element("zeroLength", 21 + storey, *nodes, "-mat", 2, "-dir", 1, "-doRayleigh", 1)
    motion = pulse(6.0, 0.8, 0.4, 4.0)

    def state() -> list[float]:
        return [ops.nodeDisp(0, 3), *(ops.nodeDisp(floor, 1) for floor in range(1, storeys + 1))]

    found = np.abs(analysed({1: motion}, (0.0, a1), state, 4.0)).max(axis=0)
    run = run_of(tower, motion)
    assert found[0] > 5 * moment / hinge
    np.testing.assert_allclose(run["peak_displacement"][0], found, rtol=2e-3)


def test_a_yielding_oscillator_on_soil():
    # The floor hangs on a spring between it and a node that a stiff beam connects with the base.
    mass, height, stiffness, fy = 5e5, 12.0, 1.2e8, 1.5e6
    law = wd.laws.Bilinear(yield_force=fy, hardening_ratio=0.05)
    building = wd.ShearBuilding([mass], [stiffness], height, law=law, damping="storey", damping_coefficient=7e5)
    springs = wd.FoundationSprings(9e8, 3e10, sway_dashpot=2e7, rocking_dashpot=3e8)
    on_soil = wd.structure_on_soil(building, springs, foundation_mass=1.5e5, rocking_inertia=2e6)
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    ops.node(1, 0.0, 0.0)
    ops.fix(1, 1, 1, 1)
    ops.node(2, 0.0, 0.0)  # base
    ops.fix(2, 0, 1, 0)
    ops.mass(2, 1.5e5, 0.0, 2e6)
    ops.node(3, 0.0, height)  # on a stiff beam (a rigid link from a node that is fixed in y gives another response)
    ops.geomTransf("Linear", 1)
    ops.element("elasticBeamColumn", 3, 2, 3, 1e3, 1e13, 10.0, 1)
    ops.node(4, 0.0, height)  # floor
    ops.fix(4, 0, 1, 1)
    ops.mass(4, mass, 0.0, 0.0)
    for tag, (k, c) in enumerate(((9e8, 2e7), (3e10, 3e8), (0.0, 7e5)), 1):
        ops.uniaxialMaterial("Elastic", tag, k, c)
    ops.uniaxialMaterial("Steel01", 4, fy, stiffness, 0.05)
    ops.element("zeroLength", 1, 1, 2, "-mat", 1, 2, "-dir", 1, 3)
    ops.element("zeroLength", 2, 3, 4, "-mat", 3, 4, "-dir", 1, 1)

    def state() -> list[float]:
        floor, line = ops.nodeDisp(4, 1), ops.nodeDisp(3, 1)
        return [floor - line, ops.nodeDisp(2, 1), ops.nodeDisp(2, 3), floor]

    motion = pulse(6.0, 0.5, 0.4, 4.0)
    found = np.abs(analysed({1: motion}, (0.0, 0.0), state, 4.0)).max(axis=0)
    run = run_of(on_soil, motion)
    assert found[0] > 2 * fy / stiffness
    np.testing.assert_allclose(run["peak_spring_deformation"][0], found[:3], rtol=BOUND)
    assert run["peak_displacement"].sel(dof="u1").item() == pytest.approx(found[3], rel=BOUND)


@pytest.mark.parametrize("kind", ["equipment", "absorber"])
def test_equipment_and_an_absorber_on_a_yielding_building(kind):
    mass, stiffness, yields = [2e5, 1e5], np.array([1.2e8, 7e7]), [9e5, 4e5]
    law = wd.laws.Bilinear(yield_force=yields, hardening_ratio=0.05)
    building = wd.ShearBuilding(mass, stiffness, 3.0, law=law, damping="stiffness_proportional", damping_ratio=0.03)
    if kind == "equipment":
        whole = wd.with_equipment(building, "u2", 500.0, tuned_to_mode=1, damping_ratio=0.01)
    else:
        whole = wd.with_absorber(building, "u2", mass_ratio=0.03)
    a1 = 2 * 0.03 * building.fundamental_period / (2 * np.pi)
    last = whole.springs[-1]
    materials = [("Steel01", (fy, k, 0.05)) for fy, k in zip(yields, stiffness, strict=True)]
    dashpots = [*(a1 * stiffness), last.damping_coefficient]
    motion = pulse(6.0, 0.5, 0.4, 4.0)
    drifts = chain_drifts(
        whole.parameters["mass"],
        [*materials, ("Elastic", (last.stiffness,))],
        (0.0, dashpots),
        [0.0] * 3,
        motion.acceleration,
        *(0.01, 400, 20),
    )
    found = np.abs(drifts).max(axis=0)
    assert (found[:2] > 2 * np.array(yields) / stiffness).any()
    np.testing.assert_allclose(run_of(whole, motion)["peak_spring_deformation"][0], found, rtol=BOUND)


def test_a_tank():
    tank = wd.HousnerTank(wd.housner_cylinder(10.0, 8.0), impulsive_period=0.15)
    motion = pulse(2.0, 4.0, 0.2, 8.0)
    found = []
    for spring, mass in zip(tank.springs, tank.parameters["mass"], strict=True):
        material = ("Elastic", (spring.stiffness,))
        dashpot = (0.0, [spring.damping_coefficient])
        drifts = chain_drifts([mass], [material], dashpot, [0.0], motion.acceleration, 0.01, 800, 10)
        found.append(np.abs(drifts).max())
    np.testing.assert_allclose(run_of(tank, motion, 0.001)["peak_displacement"][0], found, rtol=BOUND)


def test_a_quarter_car_whose_suspension_yields():
    law = wd.laws.Bilinear(yield_force=300.0, hardening_ratio=0.5)
    car = wd.QuarterCar(300.0, 60.0, 16e3, 1e3, 190e3, suspension_law=law)
    motion = wd.RoadBump(0.05, 2.0).motion(10.0, 2.0, 0.001)
    materials = [("Elastic", (190e3,)), ("Steel01", (300.0, 16e3, 0.5))]
    drifts = chain_drifts(
        [60.0, 300.0], materials, (0.0, [0.0, 1e3]), [0.0] * 2, motion.acceleration, *(0.001, 2000, 5)
    )
    found = np.abs(drifts).max(axis=0)
    run = run_of(car, motion, 0.0002)
    assert run["peak_spring_deformation"].sel(spring="tyre").item() == pytest.approx(found[0], rel=BOUND)
    assert run["peak_spring_deformation"].sel(spring="suspension").item() == pytest.approx(found[1], rel=BOUND)
    assert found[1] > 2 * 300.0 / 16e3
