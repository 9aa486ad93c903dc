"""OpenSees models of plane frames: members, releases, rigid offsets, diaphragms, hinges and leaning columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from opensees import opensees

import warpdyn as wd

DEGREE = {"ux": 1, "uy": 2, "rz": 3}
ENDS = ("start", "end")
FIRST_END = 10_000  # number of the first node at the end of a member with a spring
RIGID = 1_000_000  # number of a nearly rigid material


class Model(NamedTuple):
    """An OpenSees model, the numbers of its nodes and members, and of the elements of hinges ("C1 start")."""

    ops: ModuleType
    nodes: dict[str, int]
    members: dict[str, int]
    hinges: dict[str, int]


def build(
    frame: wd.Frame,
    hinges: Mapping[tuple[str, str], Mapping[str, Any]] | None = None,
    *,
    has_member_mass: bool = True,
    p_delta: bool = False,
) -> Model:
    """Build an OpenSees model of a frame.

    Without `has_member_mass`, lumped masses of members are masses of nodes: with masses of elements, UniformExcitation
    of OpenSees 3.7.1 applies twice the load of these masses. With `p_delta`, columns and trusses, which
    are leaning columns, have OpenSees' P-Delta transformation, and the gravity loads act.
    """
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    number = {name: place for place, name in enumerate(frame.nodes, start=1)}
    for name, row in frame.nodes.items():
        ops.node(number[name], row["x"], row["y"])
    tags = {name: place for place, name in enumerate(frame.members, start=1)}
    turns, of_hinges, ties = set(), {}, []
    ops.uniaxialMaterial("Elastic", RIGID, 1e13)
    for member, (name, row) in enumerate(frame.members.items()):
        section, tag = frame.sections[row["section"]], tags[name]
        ends = [number[row[end]] for end in ENDS]
        is_leaning = p_delta and row["kind"] == "truss"
        is_column = frame.nodes[row["start"]]["y"] != frame.nodes[row["end"]]["y"]
        ops.geomTransf(
            "PDelta" if p_delta and is_column else "Linear",
            tag,
            "-jntOffset",
            *(row["offset_start_x"], row["offset_start_y"], row["offset_end_x"], row["offset_end_y"]),
        )
        if row["kind"] == "truss":
            if is_leaning:
                values = [section["area"], section["elastic_modulus"], 1e-6]
                ops.element("elasticBeamColumn", tag, *ends, *values, tag, "-release", 3)
                continue
            ops.uniaxialMaterial("Elastic", tag, section["elastic_modulus"])
            ops.element("Truss", tag, *ends, section["area"], tag, "-doRayleigh", 1)
            continue
        turns |= {row[end] for end in ENDS}
        for place, end in enumerate(ENDS):
            stiffness = frame.geometry.end_springs[member, place]
            if np.isfinite(stiffness) and stiffness > 0:
                node = FIRST_END + 2 * tag + place
                ops.node(node, *(frame.nodes[row[end]][axis] for axis in "xy"))
                law, parameters = material(float(stiffness), (hinges or {}).get((name, end)))
                ops.uniaxialMaterial(law, node, *parameters)
                if "uy" in frame.supports.get(row[end], {}):
                    ops.element("zeroLength", node, ends[place], node, "-mat", node, "-dir", 6)
                    ties.append((row[end], node))
                else:  # OpenSees' transformation allows one tie per node, but the joint moves in two directions
                    rigid = RIGID, RIGID, node
                    ops.element("zeroLength", node, ends[place], node, "-mat", *rigid, "-dir", 1, 2, 6)
                of_hinges[f"{name} {end}"] = node
                ends[place] = node
        values = [section["area"], section["elastic_modulus"], section["second_moment"]]
        code = {"none": 0, "start": 1, "end": 2, "both": 3}[row["release"]]
        more = ["-mass", section["mass_per_length"]] if has_member_mass else []
        more += ["-cMass"] if frame.member_mass == "consistent" else []
        if section["shear_area"]:
            values = [values[0], values[1], section["shear_modulus"], values[2], section["shear_area"]]
            ops.element("ElasticTimoshenkoBeam", tag, *ends, values[1], values[2], values[0], values[3],
                        values[4], tag, *more)  # fmt: skip
            continue
        ops.element("elasticBeamColumn", tag, *ends, *values, tag, *more, "-release", code)
    support = _supported(frame, number, turns)
    _tie(ops, frame, number, ties, support)
    _give_masses(ops, frame, number, has_member_mass=has_member_mass)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    if p_delta:
        for name, row in frame.nodes.items():
            if row["gravity_load"]:
                ops.load(number[name], 0.0, -float(row["gravity_load"]), 0.0)
    return Model(ops, number, tags, of_hinges)


def material(stiffness: float, hinge: Mapping[str, Any] | None) -> tuple[str, list[float]]:
    """Return the uniaxial material of a hinge and its parameters in OpenSees' order."""
    if hinge is None:
        return "Elastic", [stiffness]
    if hinge["law"] in ("bilinear", "elastic_perfectly_plastic"):
        return "Steel01", [hinge["yield_force"], stiffness, hinge.get("hardening_ratio", 0.0)]
    assert hinge["law"] == "ibarra_medina_krawinkler_bilinear"
    names = ("plastic_drift_to_capping", "post_capping_drift", "ultimate_drift")
    side = [*(hinge[name] for name in names), hinge["yield_force"], hinge["capping_force_ratio"]]
    side.append(hinge["residual_force_ratio"])
    names = ("strength", "post_capping", "unloading")
    capacities = [hinge.get(f"{name}_deterioration_drift", 0.0) for name in names]
    return "IMKBilin", [stiffness, *side, *side, *capacities, 1.0, 1.0, 1.0, 1.0, 1.0]


def _supported(frame: wd.Frame, number: Mapping[str, int], turns: set[str]) -> dict[str, list[int]]:
    ops, found = opensees(), {}
    for name, node in number.items():
        support = frame.supports.get(name, {})
        fixed = [int(support.get(direction) is True) for direction in DEGREE]
        fixed[2] = int(fixed[2] or name not in turns)
        ops.fix(node, *fixed)
        found[name] = fixed
    return found


def _tie(ops, frame, number, ties, support) -> None:
    """Tie nodes of rigid floors, and ends of members with springs to their joints, without chains of ties."""
    first = {node: nodes[0] for nodes in frame.diaphragms.values() for node in nodes}
    for nodes in frame.diaphragms.values():
        for other in nodes[1:]:
            ops.equalDOF(number[nodes[0]], number[other], 1)
    for joint, node in ties:
        held = support[joint]
        ops.fix(node, held[0], held[1], 0)
        if not held[0]:
            ops.equalDOF(number[first.get(joint, joint)], node, 1)


def _give_masses(ops, frame, number, *, has_member_mass: bool) -> None:
    of_members = dict.fromkeys(number, 0.0)
    for place, row in enumerate(frame.members.values()):
        for end in ENDS:
            half = frame.geometry.mass_per_length[place] * frame.geometry.length[place] / 2
            of_members[row[end]] += 0.0 if has_member_mass else half
    for name, mass in of_members.items():
        ops.mass(number[name], mass, mass, 0.0)
    for name, mass in frame.masses.items():
        first = number[frame.diaphragms[name][0]] if name in frame.diaphragms else number[name]
        own = of_members.get(name, 0.0)
        ops.mass(first, *(mass.get(direction, 0.0) + own * (direction != "rz") for direction in DEGREE))


def solve(ops: ModuleType) -> None:
    """Apply the loads of a linear model in one step."""
    _static(ops)
    ops.test("NormDispIncr", 1e-12, 10)
    ops.algorithm("Linear")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    assert ops.analyze(1) == 0


def rest_under_gravity(ops: ModuleType) -> None:
    """Apply the gravity loads, keep them, and set the time to 0."""
    solve(ops)
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()


def controlled(
    ops: ModuleType, loads: Mapping[tuple[int, int], float], control: tuple[int, int], path: np.ndarray
) -> Iterator[float]:
    """Yield the load factors of OpenSees' displacement control at each point of a path.

    Args:
        ops: OpenSees with a model.
        loads: Load pattern, {(node, degree of freedom): load}.
        control: Node and degree of freedom whose displacement is prescribed.
        path: Displacements, shape [step].
    """
    ops.timeSeries("Linear", 2)
    ops.pattern("Plain", 2, 2)
    for node in dict.fromkeys(node for node, _ in loads):
        ops.load(node, *(loads.get((node, dof), 0.0) for dof in range(1, ops.getNDF()[0] + 1)))
    _static(ops)
    ops.test("NormDispIncr", 1e-9, 200)
    ops.algorithm("Newton")
    for step in np.diff(path, prepend=0.0):
        ops.integrator("DisplacementControl", *control, float(step))
        ops.analysis("Static")
        assert ops.analyze(1) == 0
        yield ops.getLoadFactor(2)


def shaken(ops: ModuleType, motion: wd.GroundMotion, step: float, steps: int) -> Iterator[float]:
    """Integrate a model under a base motion by Newmark's average acceleration; yield the time [s] after each step."""
    ops.timeSeries("Path", 3, "-dt", motion.step, "-values", *motion.acceleration.tolist())
    ops.pattern("UniformExcitation", 3, 1, "-accel", 3)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-8, 100)  # IMKBilin returns secants, so that Newton's method converges slowly
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    for _ in range(steps):
        assert ops.analyze(1, step) == 0
        yield ops.getTime()


def _static(ops: ModuleType) -> None:
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
