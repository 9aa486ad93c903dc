"""Frames with hinges and several bays: invalid input, elastic limit of irregular frames, safe solutions, JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from frame_cases import portal
from hinge_cases import motion
from hinged_frame_cases import irregular, reference_model

import warpdyn as wd
from warpdyn.model.scene.plausibility import warn_of_implausible

pytestmark = pytest.mark.meant_as_given(
    "gravity_load_of_one",  # a load above the buckling load
    "no_damping",
    "damping_ratio",
    "first_period",
    "strongest_motion",
    "peak_ground_acceleration",
    "frame_gravity_over_weight",
)
STRONG = {"law": "bilinear", "yield_force": 5e7, "hardening_ratio": 0.02}
HINGE = STRONG | {"yield_force": 3e5}


def changed(**changes: Any) -> wd.Frame:
    """Return the portal of the reference set with other entries in rows of its tables; None removes an entry."""
    arguments = portal().description()
    for table, rows in changes.items():
        if not isinstance(rows, dict):
            arguments[table] = rows
            continue
        for name, row in rows.items():
            if not isinstance(row, dict):
                arguments[table][name] = row
                continue
            entries = arguments[table].get(name, {}) | row
            arguments[table][name] = {key: value for key, value in entries.items() if value is not None}
    return wd.Frame(**arguments)


@pytest.mark.parametrize(
    ("hinges", "message"),
    [
        ({("C1_3", "start"): HINGE}, "'C1_3' of .* is not a member .did you mean 'C1_"),
        ({("C1_1", "top"): HINGE}, "'top' of .* is not an end: give 'start', 'end' or, for a truss, 'axial'"),
        ({"C1_1": HINGE}, "'C1_1' is not a pair such as"),
        ({("L1", "start"): HINGE}, "'L1' has kind='truss' and no moments"),
        ({("C1_1", "start"): {"yield_force": 5e6}}, "needs a dictionary with 'law'"),
        ({("C1_1", "start"): HINGE | {"stiffness": 1e9}}, "remove stiffness of .*: it is spring_start"),
        ({("C1_1", "start"): {"law": "bouc_wen"}}, "hinge 'C1_1 start': 'bouc_wen' is not a law of hinges"),
        ({("C1_1", "start"): {"law": None}}, "'None' is not a law of hinges; choose one of bilinear"),
        ({}, "hinges is empty: give at least one hinge.*Frame.lumped"),
    ],
)
def test_wrong_hinges_are_named(hinges, message):
    with pytest.raises(ValueError, match=message):
        wd.HingedFrame(portal(), hinges)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"members": {"C1_1": {"spring_start": None}}}, r"\('C1_1', 'start'\) has no spring.* spring_start="),
        ({"members": {"C1_1": {"spring_start": math.inf}}}, r"has no spring.* spring_start=.*, a finite number"),
        ({"members": {"C1_1": {"spring_start": 0.0}}}, r"\('C1_1', 'start'\) is released"),
        ({"geometric_stiffness": "consistent"}, "geometric_stiffness='string'"),
        ({"masses": {"J1_1": {"ux": 0.0, "uy": 500.0, "rz": 0.0}}}, "'J1_1 uy' has the mass 500"),
        ({"supports": {"J1_1": "roller"}}, r"gravity_load of node 'J1_1' has no P-Delta effect.*leaning column"),
        ({"nodes": {"L1": {"gravity_load": 1e9}}}, "buckl"),
    ],
)
def test_frames_that_cannot_have_hinges_are_named(changes, message):
    frame = changed(**changes)
    with pytest.raises(ValueError, match=message):
        wd.HingedFrame(frame, {("C1_1", "start"): HINGE})


def test_frame_without_rigid_floors_is_refused():
    told = portal().description() | {"diaphragms": {}, "masses": {"J1_1": 7e4}}
    told["supports"] |= {"L1": "fixed"}
    frame = wd.Frame(**told)
    with pytest.raises(ValueError, match="no rigid floors, whose displacements are integrated"):
        wd.HingedFrame(frame, {("C1_1", "start"): HINGE})


def test_hinges_must_be_a_dictionary():
    with pytest.raises(TypeError, match="hinges must be a dictionary"):
        wd.HingedFrame(portal(), [HINGE])


def test_gravity_that_makes_hinges_yield_is_warned_of():
    frame = changed(members={"B1_1": {"gravity_load": 50e3}})
    # A beam of 6 m under 50 kN/m: about w L^2 / 12 = 150 kN m at its ends, less because the columns rotate.
    with pytest.warns(UserWarning, match="gravity alone exceeds the yield moment of hinge 'B1_1 (start|end)'.*1 other"):
        wd.HingedFrame(frame, {("B1_1", end): HINGE | {"yield_force": 9e4} for end in ("start", "end")})
    wd.HingedFrame(frame, {("B1_1", end): HINGE | {"yield_force": 16e4} for end in ("start", "end")})


@pytest.mark.parametrize(
    ("factor", "meant"), [(1e-3, "kN m, it would be 0.00609 rad"), (1e3, "N mm, it would be 0.00609 rad")]
)
def test_yield_moments_in_other_units_are_warned_of(factor, meant):
    frame = changed(members={"C1_1": {"spring_start": factor * 1.4e9}})  # the stiffness of the spring is as wrong
    hinges = {("C1_1", "start"): HINGE | {"yield_force": factor * HINGE["yield_force"]}}
    # M_y L / (6 E I) of the column
    with pytest.warns(UserWarning, match=f"M_y L .*'C1_1 start' is .*with yield_force given in {meant}") as caught:
        wd.HingedFrame(frame, hinges)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    with wd.meant_as_given("hinge_yield_rotation"):
        wd.HingedFrame(frame, hinges)
    rigid = changed(members={"C1_1": {"spring_start": 1.4e9}}, sections={"C1_1": {"second_moment": 0.1}})
    wd.HingedFrame(rigid, hinges)  # a rigid part, whose rotation has no usual value


def test_a_wrong_yield_moment_is_warned_of_once(recwarn):
    frame = changed(members={"B1_1": {"gravity_load": 50e3}})  # also above the wrong yield moments
    hinges = {("B1_1", end): HINGE | {"yield_force": 300.0} for end in ("start", "end")}
    with pytest.warns(UserWarning, match="of 'B1_1 start' is .*with yield_force given in kN m") as caught:
        structure = wd.HingedFrame(frame, hinges, damping="modal", damping_ratio=0.02)
    assert len(caught) == 1
    warn_of_implausible(wd.Scene(structure, motion("pulse_2", 0.5)))
    assert not recwarn.list
    soft = changed(members={"B1_1": {"spring_start": 2.5e5}})  # a spring in kN m/rad
    structure = wd.HingedFrame(soft, {("B1_1", "start"): HINGE}, damping="modal", damping_ratio=0.02)
    with pytest.warns(UserWarning, match="rotation at which the spring yields of spring 'B1_1 start'"):
        warn_of_implausible(wd.Scene(structure, motion("pulse_2", 0.5)))
    for stiffness, strength in ((1e13, HINGE["yield_force"]), (2.5e9, 1e12)):  # rigid until it yields; stays elastic
        usual = changed(members={"B1_1": {"spring_start": stiffness}})
        hinges = {("B1_1", "start"): HINGE | {"yield_force": strength}}
        structure = wd.HingedFrame(usual, hinges, damping="modal", damping_ratio=0.02)
        warn_of_implausible(wd.Scene(structure, motion("pulse_2", 0.5)))


@pytest.mark.parametrize(
    ("rotations", "meant"),
    [
        ({"plastic_drift_to_capping": 2.0}, "plastic_drift_to_capping of the hinge 'B1_1 start' is 2 rad .*percent"),
        ({"post_capping_drift": 16.0}, "post_capping_drift of the hinge 'B1_1 start' is 16 rad .*percent"),
    ],
)
def test_plastic_rotations_in_percent_are_warned_of(rotations, meant):
    steel = {
        "law": "ibarra_medina_krawinkler_bilinear",
        "yield_force": 3e5,
        "plastic_drift_to_capping": 0.02,
        "post_capping_drift": 0.16,
        "capping_force_ratio": 1.1,
    }
    with pytest.warns(UserWarning, match=meant) as caught:
        wd.HingedFrame(portal(), {("B1_1", "start"): steel | rotations})
    assert len(caught) == 1
    wd.HingedFrame(portal(), {("B1_1", "start"): steel | {"post_capping_drift": 1e6}})  # it keeps its strength


def test_yield_force_of_a_brace_in_kilonewtons_is_warned_of():
    frame = changed(members={"D1": {"start": "J0_1", "end": "J1_2", "section": "C1_2", "kind": "truss"}})
    force = 235e6 * frame.sections["C1_2"]["area"]  # N
    brace = {"law": "elastic_perfectly_plastic", "yield_force": force}
    wd.HingedFrame(frame, {("D1", "axial"): brace})
    with pytest.warns(UserWarning, match="strain of the brace .* of 'D1 axial' .*yield_force given in kN"):
        wd.HingedFrame(frame, {("D1", "axial"): brace | {"yield_force": 1e-3 * force}})


def test_frame_with_too_many_massless_displacements_is_refused():
    nodes, members, supports = {}, {}, {}
    for level in range(13):
        for line in range(11):
            nodes[f"{level} {line}"] = (6.0 * line, 3.5 * level)
            if level:
                members[f"C{level} {line}"] = (f"{level - 1} {line}", f"{level} {line}", "any")
            else:
                supports[f"0 {line}"] = "fixed"
            if level and line:
                members[f"B{level} {line}"] = (f"{level} {line - 1}", f"{level} {line}", "any")
    members["C1 0"] = {"start": "0 0", "end": "1 0", "section": "any", "spring_start": 1e9}
    floors = {f"floor {level}": [f"{level} {line}" for line in range(11)] for level in range(1, 13)}
    section = {"elastic_modulus": 2e11, "area": 0.02, "second_moment": 5e-4}
    frame = wd.Frame(
        nodes, members, {"any": section}, supports=supports, diaphragms=floors, masses=dict.fromkeys(floors, 1e5)
    )
    with pytest.raises(ValueError, match=r"has 264 massless displacements.* at most 256 .*'roller'"):
        wd.HingedFrame(frame, {("C1 0", "start"): HINGE}, p_delta=False)


def test_strong_hinges_equal_the_elastic_frame():
    """One hinge of each kind of end; the other end springs of the frame are linear. P-Delta acts on inclined braces."""
    frame = irregular()
    ends = [("CA1", "start"), ("CA1", "end"), ("CB1", "start"), ("CC1", "start"), ("BA1", "start"), ("BA1", "end")]
    hinges = dict.fromkeys([*ends, ("BB1", "end"), ("BA2", "start")], STRONG)
    hinges["BA2", "end"] = {"law": "elastic"}
    damping = {"damping": "rayleigh", "damping_ratio": 0.03}
    motions = wd.Cloud([motion("pulse_1", 2.0)])
    settings = {"device": "cpu", "method": "leapfrog", "step": 0.005, "dtype": "float64"}
    found, due = (
        wd.simulate(wd.Scene(each, motions, recorders=("spring", "output")), **settings)
        for each in (
            wd.HingedFrame(frame, hinges, **damping),
            frame.lumped(p_delta=True, outputs=("drift",), **damping),
        )
    )
    assert found["status"].values.tolist() == [0]
    for name, of in (("peak_spring_deformation", "spring"), ("peak_output", "output")):
        both = [each[name].isel({of: slice(2)}).values for each in (found, due)]
        np.testing.assert_allclose(*both, rtol=1e-8)  # moments balance within 1e-9 of the largest one


def test_scatter_of_initial_stiffness_is_refused():
    with pytest.raises(ValueError, match="initial stiffnesses of hinges belong to the frame"):
        wd.Scene(
            reference_model("portal"),
            wd.Cloud([motion("pulse_1", 1)]),
            {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="spring")},
        )


def test_scene_from_json():
    used = motion("pulse_1", 1)
    hinges = {("B1_1", "start"): HINGE, ("C1_1", "end"): HINGE}
    structure = wd.HingedFrame(portal(), hinges, damping="rayleigh", damping_ratio=0.03, drift_capacity=0.1)
    scene = wd.Scene(structure, wd.Cloud([used]), recorders=("spring",))
    again = wd.Scene.from_json(scene.to_json(), motions=[used])
    assert again.to_json() == scene.to_json()
    assert isinstance(again.structure, wd.HingedFrame)
    assert again.structure.hinge_names == ("B1_1 start", "C1_1 end")


@pytest.mark.thorough
def test_random_frames_agree_with_a_quarter_of_the_step():
    """No history may converge to a false root: four storeys with deterioration up to collapse, random hinges."""
    motions = wd.Cloud([motion("LOS270", level) for level in (1.6, 2.4)])
    scatter = {
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring"),
        "post_capping_drift": wd.RandomFactor(wd.Lognormal(0.8, 0.3), per="spring"),
    }
    structure = reference_model("four_storey", drift_capacity=0.1)
    scene = wd.Scene(structure, motions, scatter, recorders=("spring",))
    settings = {"structures": 64, "seed": 3, "device": "cpu", "method": "leapfrog"}
    coarse, fine = (wd.simulate(scene, step=step, **settings) for step in (0.005, 0.00125))
    assert (coarse["status"].values <= 1).all()
    same = (coarse["status"].values == 0) & (fine["status"].values == 0)
    drifts = [each["peak_spring_deformation"].values[same, :4].max(axis=1) for each in (coarse, fine)]
    assert np.quantile(np.abs(drifts[0] / drifts[1] - 1), 0.95) < 0.02
