"""Lumped structures pushed slowly: chains, OpenSees' displacement control, plastic limit loads, and equilibrium."""

from __future__ import annotations

import importlib.util
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from labels import check_labels
from opensees import opensees
from opensees_frames import controlled
from scipy.optimize import linprog

import warpdyn as wd

STIFFNESS = np.array([1.0e8, 2.0e8, 1.5e8, 0.8e8])
STRENGTH = np.array([2.0e6, 2.2e6, 1.5e6, 0.4e6])
HARDENING = np.array([0.05, 0.02, 0.1, 0.03])
TO_AND_FRO = np.concatenate([np.linspace(a, b, 120)[1:] for a, b in pairwise([0, 0.1, -0.15, 0.2, -0.05, 0.3])])
GRAVITY = {"gravity_load": [1.0e7, 6.0e6, 4.0e6, 8.0e6]}
PLAN = [[-10.0, 10.0], [-6.0, 6.0]]
FRAMES = [("a", (0, 5), 0, 6e7, 9e5), ("b", (-2, -5), 0, 4e7, 6e5), ("c", (-9, 1), 1, 9e7, 12e5)]
FRAMES += [("d", (9, 0), 1, 3e7, 4e5)]
SHARE = np.array([1.0, 0.7])  # of the frames' first storeys
needs_opensees = pytest.mark.skipif(importlib.util.find_spec("openseespy") is None, reason="openseespy is missing")


def chain(hardening: float | np.ndarray = HARDENING, **changed) -> wd.ShearBuilding:
    law = {"law": "bilinear", "yield_force": STRENGTH, "hardening_ratio": hardening}
    return wd.ShearBuilding(2.0e5, STIFFNESS, [4.0, 3.0, 3.0, 3.0], **law, **changed)


def torsional(hardening: float) -> wd.TorsionalBuilding:
    law = {"law": "bilinear", "hardening_ratio": hardening}
    frames = [
        wd.PlanFrame(name, at, "xy"[axis], k * SHARE, yield_force=fy * SHARE, **law) for name, at, axis, k, fy in FRAMES
    ]
    return wd.TorsionalBuilding([1.5e5, 1.2e5], PLAN, frames, mass_centre=(1.2, -0.7))


def unbalanced(structure: wd.LumpedStructure, pushed: xr.Dataset) -> float:
    """Return the largest force or moment without balance over the largest load, from forces and displacements."""
    forces = pushed["spring_force"].values @ structure.directions
    one = {name: values[None] for name, values in structure.parameters.items()}
    elastic = structure.elastic_matrices(one) - structure.geometric_matrices(one)
    forces = forces + pushed["displacement"].values @ (np.zeros((structure.dofs, structure.dofs)) + elastic)
    loads = pushed["base_shear"].values[:, None] * pushed["dof_load"].values
    return float(np.abs(forces - loads).max() / np.abs(loads).max())


@pytest.mark.parametrize("pattern", ["first_mode", "uniform", [1.0, 2.0, 3.0, 4.0]])
@pytest.mark.parametrize("gravity", [{}, GRAVITY], ids=["plain", "gravity"])
def test_a_chain_has_the_curve_of_its_shear_building(pattern, gravity):
    building = chain(HARDENING + 0.08, **gravity)
    expected = wd.pushover(building, TO_AND_FRO, pattern=pattern)
    pushed = wd.pushover(wd.lumped_chain(building), TO_AND_FRO, pattern=pattern)
    largest = float(np.abs(expected["base_shear"]).max())
    np.testing.assert_allclose(pushed["base_shear"], expected["base_shear"], rtol=0, atol=1e-9 * largest)
    np.testing.assert_allclose(pushed["spring_deformation"], expected["storey_drift"], rtol=0, atol=1e-10)
    largest = float(expected["dissipated_energy"].max())
    np.testing.assert_allclose(pushed["dissipated_energy"], expected["dissipated_energy"], rtol=0, atol=1e-8 * largest)
    np.testing.assert_allclose(pushed["dof_load"], expected["floor_load"], rtol=1e-12)
    assert pushed.attrs["control"] == "u4"


def test_gravity_brings_the_line_of_the_weakest_storey():
    """Perfectly plastic storeys with P-Delta: the storey that yields first falls, the others unload; by hand."""
    pattern, roof = np.array([1.0, 2.0, 3.0, 4.0]), np.linspace(0, 0.06, 61)[1:]
    building = chain(0.0, **GRAVITY)
    pushed = wd.pushover(
        wd.lumped_chain(building), roof, pattern=dict(zip(("u1", "u2", "u3", "u4"), pattern, strict=True))
    )
    leaning = np.array([28.0e6 / 4, 18.0e6 / 3, 12.0e6 / 3, 8.0e6 / 3])
    share = np.cumsum(pattern[::-1])[::-1] / pattern.sum()
    shear_at_yield = (STRENGTH - leaning * STRENGTH / STIFFNESS) / share
    weakest = int(shear_at_yield.argmin())
    flexible = share / (STIFFNESS - leaning)
    peak, rising = shear_at_yield.min(), 1 / flexible.sum()
    falling = 1 / (-share[weakest] / leaning[weakest] + np.delete(flexible, weakest).sum())
    expected = np.where(roof < peak / rising, rising * roof, peak + falling * (roof - peak / rising))
    np.testing.assert_allclose(pushed["base_shear"], expected, rtol=0, atol=1e-7 * peak)
    assert expected[-1] < 0.8 * peak


@pytest.mark.parametrize("steps", [1, 7, 100])
def test_of_equal_springs_that_come_to_their_peaks_together_one_softens(steps):
    """Equal storeys whose falling branches are such that the roof's is 4e6 N/m steep if all but one unload."""
    stiffness, strength, storeys = 1.0e8, 1.0e6, 4
    falling = 1 / (1 / -4.0e6 - (storeys - 1) / stiffness)
    ductility = 1 + 0.4 * stiffness / -falling
    corners = {"ductility_2": ductility, "force_ratio_2": 0.6, "ductility_3": 2 * ductility, "force_ratio_3": 0.5}
    building = wd.ShearBuilding(2e5, [stiffness] * 4, 3.0, law="hysteretic", yield_force=strength, **corners)
    peak = storeys * strength / stiffness
    roof = np.linspace(0, peak + 0.1, steps + 1)[1:]
    pushed = wd.pushover(wd.lumped_chain(building), roof, pattern={"u4": 1.0})
    expected = np.interp(roof, [0, peak, peak + 0.1], [0, strength, strength - 4.0e5])
    np.testing.assert_allclose(pushed["base_shear"], expected, rtol=0, atol=4.0e6 * 0.15 / steps * 2**-10)


@needs_opensees
@pytest.mark.parametrize("control", ["ux2", "uy2"])
def test_a_torsional_building_is_that_of_opensees(control):
    """Loads along x, along y and a moment; frames between nodes that rigid links connect with the centres of mass."""
    building, path = torsional(0.05), TO_AND_FRO[::2]
    loads = {"ux1": 0.6, "uy1": 0.2, "theta1": 0.5, "ux2": 1.0, "uy2": 0.5, "theta2": 1.5}
    pushed = wd.pushover(building, path, pattern=loads, control=control)
    assert unbalanced(building, pushed) < 1e-8
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    for floor in range(3):
        tag = 100 * floor
        ops.node(tag + 10, 0.0, 0.0)
        for place, (_, at, *_) in enumerate(FRAMES):
            ops.node(tag + 11 + place, float(at[0]), float(at[1]))
            if floor == 0:
                ops.fix(tag + 11 + place, 1, 1, 1)
            else:
                ops.rigidLink("beam", tag + 10, tag + 11 + place)
        if floor == 0:
            ops.fix(tag + 10, 1, 1, 1)
    for storey in range(2):
        for place, (_, _, axis, k, fy) in enumerate(FRAMES):
            tag = 10 * (storey + 1) + place
            ops.uniaxialMaterial("Steel01", tag, fy * SHARE[storey], k * SHARE[storey], 0.05)
            nodes = (100 * storey + 11 + place, 100 * storey + 111 + place)
            ops.element("zeroLength", tag, *nodes, "-mat", tag, "-dir", axis + 1)
    per_shear = dict(zip(building.dof_names, pushed["dof_load"].values, strict=True))
    assert per_shear["ux1"] + per_shear["ux2"] == pytest.approx(1.0, rel=1e-12)
    places = {
        (100 * floor + 10, axis + 1): f"{name}{floor}"
        for floor in (1, 2)
        for axis, name in enumerate(("ux", "uy", "theta"))
    }
    factors = list(
        controlled(
            ops,
            {place: float(per_shear[name]) for place, name in places.items()},
            next(place for place, name in places.items() if name == control),
            path,
        )
    )
    ops.wipe()
    np.testing.assert_allclose(pushed["base_shear"], factors, rtol=0, atol=1e-7 * np.abs(factors).max())
    assert (np.abs(pushed["spring_force"]).max("step") > building.parameters["yield_force"]).sum() >= 4


@needs_opensees
def test_gaps_sliders_and_an_elastic_matrix_are_those_of_opensees():
    """Two masses: bilinear spring, slider with a brace, elastic matrix between the masses, a stop with a gap."""
    coupling = 3e6 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    structure = wd.LumpedStructure(
        {"a": 1e5, "b": 2e5},
        [
            wd.Spring("frame", {"a": 1.0}, law="bilinear", stiffness=2e7, yield_force=2e5, hardening_ratio=0.1),
            wd.Spring("slider", {"b": 1.0, "a": -1.0}, law="friction_damper", slip_force=5e4, brace_stiffness=1e7),
            wd.Spring("stop", {"b": 1.0}, law="one_sided_gap", clearance=0.03, contact_stiffness=5e7),
        ],
        stiffness_matrix=coupling,
    )
    path = np.concatenate([np.linspace(a, b, 50)[1:] for a, b in pairwise([0, 0.06, -0.05, 0.08])])
    pushed = wd.pushover(structure, path, pattern={"a": 0.3, "b": 1.0}, control="b")
    assert unbalanced(structure, pushed) < 1e-8
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    for node in range(3):
        ops.node(node, 0.0)
    ops.fix(0, 1)
    ops.uniaxialMaterial("Steel01", 1, 2e5, 2e7, 0.1)
    ops.uniaxialMaterial("ElasticPP", 2, 1e7, 5e-3)
    ops.uniaxialMaterial("Elastic", 3, 3e6)
    ops.uniaxialMaterial("ElasticPPGap", 4, 5e7, 1e12, 0.03)
    for tag, nodes in enumerate([(0, 1), (1, 2), (1, 2), (0, 2)], start=1):
        ops.element("zeroLength", tag, *nodes, "-mat", tag, "-dir", 1)
    factors = list(controlled(ops, {(1, 1): 0.3 / 1.3, (2, 1): 1.0 / 1.3}, (2, 1), path))
    ops.wipe()
    np.testing.assert_allclose(pushed["base_shear"], factors, rtol=0, atol=1e-7 * np.abs(factors).max())
    assert float(pushed["spring_force"].sel(spring="stop").max()) > 1e6


@pytest.mark.parametrize("pattern", [{"ux2": 1.0}, {"ux1": 0.5, "ux2": 1.0, "uy2": 0.4}, "first_mode"])
def test_perfectly_plastic_frames_carry_the_limit_load(pattern):
    """The largest load in equilibrium with forces below the strengths (lower bound theorem), by linear programming."""
    building = torsional(0.0)
    pushed = wd.pushover(building, np.linspace(0, 0.6, 61)[1:], pattern=pattern)
    loads, strength = pushed["dof_load"].values, building.parameters["yield_force"]
    springs = len(building.springs)
    best = linprog(
        np.append(np.zeros(springs), -1.0),
        A_eq=np.column_stack([building.directions.T, -loads]),
        b_eq=np.zeros(building.dofs),
        bounds=[*((-each, each) for each in strength), (None, None)],
    )
    assert float(pushed["base_shear"][-1]) == pytest.approx(best.x[-1], rel=1e-7)
    assert float(pushed["base_shear"][0]) < 0.9 * best.x[-1]
    assert unbalanced(building, pushed) < 1e-8


def test_the_elastic_curve_is_that_of_the_stiffness_matrix():
    building = torsional(0.1)
    mode = building.modal()
    pushed = wd.pushover(building, [1e-4])
    loads = building.central_matrices(building.parameters)["mass"] @ mode["shape"].values[0]
    loads = loads / (loads @ building.influence).flat[int(pushed.attrs["component"]) - 1]
    np.testing.assert_allclose(pushed["dof_load"], loads, rtol=0, atol=1e-12 * np.abs(loads).max())
    moved = np.linalg.solve(building.central_matrices(building.parameters)["stiffness"], loads)
    control = building.dof_names.index(pushed.attrs["control"])
    assert float(pushed["base_shear"][0]) == pytest.approx(1e-4 / moved[control], rel=1e-9)
    np.testing.assert_allclose(pushed["displacement"][0], 1e-4 * moved / moved[control], rtol=0, atol=1e-13)


def test_the_prescribed_degree_of_freedom_does_not_change_the_curve():
    building, loads = torsional(0.05), {"ux1": 0.5, "ux2": 1.0}
    first = wd.pushover(building, np.linspace(0, 0.2, 41)[1:], pattern=loads)
    assert first.attrs["control"] == "ux2"
    rotations = first["displacement"].sel(dof="theta2").values
    assert (rotations > 0).all()
    second = wd.pushover(building, rotations, pattern=loads, control="theta2")
    lower = wd.pushover(building, first["displacement"].sel(dof="ux1").values, pattern=loads, control="ux1")
    assert lower["roof_displacement"].attrs["units"] == "m"
    for other in (lower, second):
        np.testing.assert_allclose(other["base_shear"], first["base_shear"], rtol=1e-7)
        np.testing.assert_allclose(other["displacement"], first["displacement"], rtol=0, atol=1e-8)


def test_a_path_in_mm_is_named():
    springs = [wd.Spring("first", {"u1": 1.0}, stiffness=5e7), wd.Spring("second", {"u2": 1, "u1": -1}, stiffness=5e7)]
    storeys = {"storey_height": 3.0, "storey_springs": ["first", "second"]}
    building = wd.LumpedStructure({"u1": 1e5, "u2": 1e5}, springs, **storeys)
    wd.pushover(building, [0.0, 0.06])
    with pytest.warns(UserWarning, match="largest drift over height is 10 .*if given in mm, it would be 0.01"):
        wd.pushover(building, [0.0, 60.0])


def test_a_path_that_snaps_back_ends_with_the_spring_named():
    """Springs in series: the first loses strength faster than the second unloads."""
    corners = {"ductility_2": 2.0, "force_ratio_2": 0.2, "ductility_3": 40.0, "force_ratio_3": 0.1}
    springs = [
        wd.Spring("brittle", {"a": 1.0}, law="hysteretic", stiffness=1e8, yield_force=1e6, **corners),
        wd.Spring("soft", {"b": 1.0, "a": -1.0}, stiffness=1e7),
    ]
    structure = wd.LumpedStructure({"a": 1e5, "b": 1e5}, springs)
    with pytest.warns(UserWarning, match="no stable equilibrium was found beyond .* 'b'.*Spring 'brittle'"):
        pushed = wd.pushover(structure, np.linspace(0, 0.2, 41)[1:], pattern={"b": 1.0})
    # The peak: 1e6 N at 0.01 m + 0.1 m, found within 2^-10 of a step of 0.005 m.
    assert float(pushed["roof_displacement"][-1]) == pytest.approx(0.11, abs=0.005 * 2**-9)
    assert float(pushed["base_shear"][-1]) == pytest.approx(1e6, rel=1e-4)
    assert "snap-back" in pushed.attrs["stopped_because"]


def test_datasets_say_what_they_hold(tmp_path: Path):
    building = torsional(0.05)
    pushed = wd.pushover(building, [0.0, 0.01, 0.02], pattern={"ux2": 1.0})
    check_labels(pushed)
    own = {"building", "control", "component", "pattern"}
    assert set(pushed.attrs) == {"Conventions", "title", "history", "source"} | own
    assert json.loads(pushed.attrs["building"])["plan"] == PLAN
    assert pushed.attrs["component"] == 1
    assert (pushed.isel(step=0)["spring_force"] == 0).all()
    assert pushed["displacement"].attrs["units"] == "m (rad for rotations)"
    assert list(pushed["dof"].values) == list(building.dof_names)
    pushed.to_netcdf(tmp_path / "pushed.nc")
    with xr.open_dataset(tmp_path / "pushed.nc") as read:
        assert read.load().identical(pushed)


ONE = wd.LumpedStructure(
    {"a": 1e5, "r": 1e6},
    [wd.Spring("k", {"a": 1.0}, stiffness=1e7), wd.Spring("s", {"r": 1.0}, stiffness=1e9)],
    influence={"a": 1.0},
    rotations=["r"],
)
TURNING = wd.LumpedStructure(
    {"r": 1e6}, [wd.Spring("s", {"r": 1.0}, stiffness=1e9)], influence={"r": 1.0}, rotations=["r"]
)
BEARING = wd.laws.CircularYield(yield_force=1e5, post_yield_stiffness=1e6)
ISOLATED = wd.LumpedStructure(
    {"x": 1e5, "y": 1e5},
    [wd.BiaxialSpring("bearing", {"x": 1.0}, {"y": 1.0}, law=BEARING, stiffness=1e7)],
    influence=[{"x": 1.0}, {"y": 1.0}],
)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: wd.pushover(ONE, [np.nan]), r"roof_displacement\[0\] is nan"),
        (lambda: wd.pushover(ONE, [[0.1]]), r"roof_displacement must have shape \[step\], got \(1, 1\)"),
        (
            lambda: wd.pushover(ONE, [0.1], pattern="triangular"),
            "not a frame has no heights for pattern='triangular'.*'a': 1.0",
        ),
        (lambda: wd.pushover(ONE, [0.1], pattern="mode"), "unknown load pattern 'mode'"),
        (lambda: wd.pushover(ONE, [0.1], pattern={"b": 1.0}), "pattern names the unknown degree of freedom 'b'"),
        (lambda: wd.pushover(ONE, [0.1], pattern=[1.0]), r"one load per degree of freedom, shape \[2\]"),
        (lambda: wd.pushover(ONE, [0.1], pattern={"r": 1.0}), "given loads have no resultant.*'a': 1.0"),
        (lambda: wd.pushover(ONE, [0.1], control="b"), "control names the unknown degree of freedom 'b'"),
        (lambda: wd.pushover(ONE, [0.1], control="r"), "control='r': the loads do not move this degree of freedom"),
        (lambda: wd.pushover(TURNING, [0.1]), "control is missing: no translation has a positive.*control='r'"),
        (lambda: wd.pushover(torsional(0.1), [0.1], pattern="uniform"), "pattern='uniform' has no direction"),
        (lambda: wd.pushover(ISOLATED, [0.1]), "biaxial spring 'bearing' is not supported"),
        (lambda: wd.pushover(chain(), [0.1], control="u4"), "control= names a degree of freedom of a lumped structure"),
        (lambda: wd.pushover(chain(), [0.1], pattern={"u4": 1.0}), "one load per floor of a ShearBuilding"),
    ],
)
def test_bad_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_other_classes_are_refused():
    with pytest.raises(TypeError, match="takes a ShearBuilding or a LumpedStructure, got dict as building"):
        wd.pushover({}, [0.1])
    with pytest.raises(ValueError, match=r"pattern\[.a.\] must be a finite number"):
        wd.pushover(ONE, [0.1], pattern={"a": "much"})
