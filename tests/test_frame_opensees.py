"""Frames against OpenSeesPy (elasticBeamColumn): static analysis, periods and histories."""

from __future__ import annotations

import numpy as np
import pytest
from frame_cases import chain
from lumped_cases import pulse
from opensees_frames import build, solve

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")


def offsets_and_releases() -> wd.Frame:
    """Two bays and two storeys with rigid offsets, released beams, a brace and inclined members."""
    nodes = {f"{level}{line}": (5.0 * line, 3.6 * level) for level in range(3) for line in range(3)}
    nodes["top"] = (2.0, 9.0)
    members = {}
    for level in range(2):
        for line in range(3):
            column = {"start": f"{level}{line}", "end": f"{level + 1}{line}", "section": "column"}
            members[f"C{level}{line}"] = column | {"offset_end_y": -0.25}
        for bay in range(2):
            beam = {"start": f"{level + 1}{bay}", "end": f"{level + 1}{bay + 1}", "section": "beam"}
            beam |= {"offset_start_x": 0.2, "offset_end_x": -0.2} if level == 0 else {}
            members[f"B{level}{bay}"] = beam
    members["B10"]["release"] = "start"
    members["B11"]["release"] = "both"
    members["D"] = ("00", "11", "brace", "truss")
    members["I1"], members["I2"] = ("20", "top", "beam"), ("21", "top", "beam")
    sections = {
        "column": {"elastic_modulus": 2e11, "area": 0.014, "second_moment": 2.2e-4, "mass_per_length": 110.0},
        "beam": {"elastic_modulus": 2e11, "area": 0.011, "second_moment": 3.1e-4, "mass_per_length": 2500.0},
        "brace": {"elastic_modulus": 2e11, "area": 0.003},
    }
    supports = {"00": "fixed", "01": "pinned", "02": "roller"}
    return wd.Frame(nodes, members, sections, supports=supports, masses={"10": 4e3, "top": 2e3})


def deep_beams() -> wd.Frame:
    """A portal of Timoshenko members."""
    nodes = {"A": (0, 0), "B": (0, 3), "C": (4, 3), "D": (4, 0)}
    members = {"l": ("A", "B", "s"), "b": ("B", "C", "s"), "r": ("D", "C", "s")}
    section = {"elastic_modulus": 3e10, "area": 0.3, "second_moment": 9e-3, "shear_modulus": 1.2e10, "shear_area": 0.25}
    return wd.Frame(nodes, members, {"s": section}, supports={"A": "fixed", "D": "fixed"}, masses={"B": 2e4, "C": 3e4})


def divided(member_mass: str = "consistent") -> wd.Frame:
    """A two-storey frame with distributed mass; every member is divided."""
    places = {"a": (0, 0), "b": (0, 3.5), "c": (0, 7), "d": (6, 0), "e": (6, 3.5), "f": (6, 7)}
    nodes, members = {}, {}
    for line in ("ab", "bc", "de", "ef", "be", "cf"):
        more = chain(
            line[0], line[1], places[line[0]], places[line[1]], 3, "beam" if line in ("be", "cf") else "column"
        )
        nodes |= more[0]
        members |= more[1]
    sections = {
        "column": {"elastic_modulus": 2e11, "area": 0.012, "second_moment": 1.8e-4, "mass_per_length": 100.0},
        "beam": {"elastic_modulus": 2e11, "area": 0.012, "second_moment": 2.4e-4, "mass_per_length": 3000.0},
    }
    supports = {"a": "fixed", "d": "fixed"}
    return wd.Frame(nodes, members, sections, supports=supports, member_mass=member_mass)


def lumped() -> wd.Frame:
    return divided("lumped")


LOADS = {
    offsets_and_releases: {"21": {"fx": 3e4, "fy": -2e4}, "top": {"fy": -5e4}, "11": {"mz": 1.5e4}},
    deep_beams: {"B": {"fx": 1e5, "fy": -3e4, "mz": 2e4}},
    divided: {"c": {"fx": 4e4}, "e": {"fy": -9e4}},
}
FRAMES = list(LOADS)


@pytest.mark.parametrize("make", FRAMES, ids=lambda make: make.__name__)
def test_displacements_reactions_and_member_forces_are_those_of_opensees(make):
    frame = make()
    found = frame.static(LOADS[make])
    ops, number, tags, _ = build(frame)
    for node, row in LOADS[make].items():
        ops.load(number[node], *(row.get(force, 0.0) for force in ("fx", "fy", "mz")))
    solve(ops)
    ops.reactions()
    due = np.array([ops.nodeDisp(node) for node in number.values()])
    turns = frame.numbering.places[:, 2]
    due[~np.isin(turns, [*frame.numbering.free]), 2] = 0.0
    np.testing.assert_allclose(found["displacement"], due, rtol=1e-8, atol=1e-10 * np.abs(due).max())
    supported = list(frame.supports)
    due = np.array([ops.nodeReaction(number[name]) for name in supported])
    got = found["reaction"].sel(node=supported)
    np.testing.assert_allclose(got, due, rtol=1e-7, atol=1e-7 * np.abs(due).max())
    for name, tag in tags.items():
        if frame.members[name]["kind"] == "truss":
            assert found["axial_force"].sel(member=name).item() == pytest.approx(ops.basicForce(tag)[0], rel=1e-7)
            continue
        ends = found["end_force"].sel(member=name).values.ravel()
        np.testing.assert_allclose(ends, ops.eleResponse(tag, "localForce"), rtol=1e-6, atol=1e-3)
    ops.wipe()


@pytest.mark.parametrize("make", FRAMES, ids=lambda make: make.__name__)
def test_periods_are_those_of_opensees(make):
    frame = make()
    ops = build(frame).ops
    squared = np.sort(ops.eigen("-fullGenLapack", 4))
    ops.wipe()
    found = frame.modal(modes=4)["circular_frequency"].values
    np.testing.assert_allclose(found, np.sqrt(squared), rtol=1e-8)


@pytest.mark.parametrize("make", [offsets_and_releases, deep_beams, lumped], ids=lambda make: make.__name__)
def test_histories_are_those_of_opensees(make):
    """Peaks of displacements and of a member's moment; OpenSees: Newmark's average acceleration with a short step."""
    frame = make()
    motion, step = pulse(1.5, 0.45, 0.5, 3.0), 0.0005
    member = next(iter(frame.members))
    options = {"outputs": ("member_force",), "members": [member]}
    plain = frame.lumped(**options)
    a0, a1 = 0.3, 0.0008
    one = {name: each[None] for name, each in plain.parameters.items()}
    matrix = a0 * plain.mass_matrices(one)[0] + a1 * plain.stiffness_matrices(one)[0]
    structure = frame.lumped(damping_matrix=matrix, **options)
    run = wd.simulate(wd.Scene(structure, motion), step=step, dtype="float64", device="cpu", method="rk4")
    ops, number, tags, _ = build(frame, has_member_mass=False)
    ops.timeSeries("Path", 2, "-dt", 0.01, "-values", *motion.acceleration.tolist())
    ops.pattern("UniformExcitation", 2, 1, "-accel", 2)
    ops.rayleigh(a0, a1, 0.0, 0.0)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-12, 10)
    ops.algorithm("Linear")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    names = [name for name in structure.dof_names if name.endswith("ux")]
    peaks, moment = np.zeros(len(names)), 0.0
    for _ in range(round(3.0 / step)):
        assert ops.analyze(1, step) == 0
        peaks = np.maximum(peaks, [abs(ops.nodeDisp(number[name.removesuffix(" ux")], 1)) for name in names])
        moment = max(moment, abs(ops.eleResponse(tags[member], "localForce")[2]))
    ops.wipe()
    np.testing.assert_allclose(run["peak_displacement"].sel(dof=names)[0], peaks, rtol=2e-4)
    found = run["peak_output"].sel(output=f"{member} moment start").item()
    assert found == pytest.approx(moment, rel=2e-4)
