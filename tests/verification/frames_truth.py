"""Independent results of frames: beam-columns in closed form, a portal by slope-deflection, a portal by OpenSees."""

from __future__ import annotations

import functools

import numpy as np
from opensees import opensees

from .problem import Outcome

# V79: a cantilever under an axial force and a lateral force at its tip.
CANTILEVER = {"EI": 4e7, "EA": 2e9, "L": 4.0, "P": 2.5e6, "H": 5e4}  # N m2, N, m, N, N

# V80: a portal whose columns and beam have perfectly plastic hinges; the weight is on a leaning column.
PORTAL = {"height": 3.5, "width": 7.0, "EI column": 4e7, "EI beam": 6e7, "weight": 8e5}  # m, m, N m2, N m2, N
SPRINGS = {"base": 4e8, "beam": 5e8}  # N m/rad
PLASTIC = {"base": 3.5e5, "beam": 1.8e5}  # N m
ROOF = np.linspace(0.0, 0.14, 57)  # m
CHECKED = {"elastic": 0.01, "beam hinges yield": 0.0225, "mechanism": 0.12}  # m

# V81: a portal that has springs 10 times as stiff as 6 E I / L of the members, whose I is 1.1 times as large.
STEEL, HINGE_RATIO, HARDENING = 200e9, 10.0, 0.0028037383177570096  # Pa
MEMBERS = {"column": (1.184e-2, 1.492e-4, 4.0, 3.5e5), "beam": (8.446e-3, 2.313e-4, 6.0, 3e5)}  # m2, m4, m, N m
MASS, JOINT_LOAD, LEANING_LOAD = 70e3, 50e3, 586.7e3  # kg, N, N
DAMPING = 0.53126396, 0.0047057587  # factors of mass [1/s] and initial stiffness [s]
PULSE = {"A": 4.0, "T": 0.8, "b": 0.4}  # m/s2, s, 1/s
STEP, SUBSTEPS, INTERVALS = 0.01, 20, 1000  # of the motion [s], of OpenSees in it; number of intervals
LARGE_AREA = 100.0  # m2, of the beam and the link, because the floor is rigid


def beam_column() -> Outcome:
    """Second-order deflection of a cantilever, EI v'' = -P (v - v_tip) + H (L - x)."""
    p = CANTILEVER
    k = np.sqrt(p["P"] / p["EI"])
    angle = k * p["L"]
    tip = p["H"] * (np.tan(angle) - angle) / (k * p["P"])
    rotation = p["H"] * (1 / np.cos(angle) - 1) / p["P"]
    moment = p["H"] * np.tan(angle) / k
    factor = np.pi**2 * p["EI"] / (4 * p["L"] ** 2) / p["P"]
    return Outcome([tip, rotation, moment, factor])


def base_shear(roof: float) -> tuple[float, float, float]:
    """Return base shear [N], rotation of a base hinge and of a beam hinge [rad] at a roof displacement [m].

    Both halves are antisymmetric. Unknowns: rotation of the joint, of the column's lower end, and of the beam's end. A
    hinge has its moment of elasticity, or its plastic moment.
    """
    p = PORTAL
    height, column, chord = p["height"], p["EI column"] / p["height"], roof / p["height"]
    beam = 6 * p["EI beam"] / p["width"]
    # Rows: moment of the lower end of the column, of the beam's end, and of the joint.
    for base_yields, beam_yields in ((False, False), (False, True), (True, False), (True, True)):
        matrix = column * np.array([[2.0, 4.0, 0.0], [0.0, 0.0, 0.0], [4.0, 2.0, 0.0]])
        known = 6 * column * chord * np.array([1.0, 0.0, 1.0])
        matrix[1] += [0.0, 0.0, beam]
        matrix[2] += [0.0, 0.0, beam]
        if base_yields:
            known[0] -= PLASTIC["base"]
        else:
            matrix[0, 1] += SPRINGS["base"]
        if beam_yields:
            known[1] += PLASTIC["beam"]
        else:
            matrix[1] += [-SPRINGS["beam"], 0.0, SPRINGS["beam"]]
        joint, lower, end = np.linalg.solve(matrix, known)
        rotations = lower, joint - end
        moments = [
            PLASTIC[name] if yields else SPRINGS[name] * rotation
            for name, yields, rotation in zip(SPRINGS, (base_yields, beam_yields), rotations, strict=True)
        ]
        is_within = all(
            yields or moment <= PLASTIC[name]
            for name, yields, moment in zip(SPRINGS, (base_yields, beam_yields), moments, strict=True)
        )
        is_forward = all(
            not yields or rotation >= PLASTIC[name] / SPRINGS[name]
            for name, yields, rotation in zip(SPRINGS, (base_yields, beam_yields), rotations, strict=True)
        )
        if is_within and is_forward:
            shear = 2 * (moments[0] + moments[1]) / height - p["weight"] * roof / height
            return shear, *rotations
    raise ValueError(f"no state of the hinges fits the roof displacement {roof} m")


def portal_pushover() -> Outcome:
    """Slope-deflection equations of the portal, with each combination of elastic and plastic hinges."""
    shears = np.array([base_shear(each)[0] for each in ROOF])
    values = [value for each in CHECKED.values() for value in base_shear(each)]
    p = PORTAL
    plastic = 2 * (PLASTIC["base"] + PLASTIC["beam"]) / p["height"]  # the work of the mechanism
    last = plastic - p["weight"] * CHECKED["mechanism"] / p["height"]
    assert abs(values[6] / last - 1) < 1e-12
    return Outcome(values, {"base shear against roof displacement": (ROOF, shears)})


def pulse() -> np.ndarray:
    """Return the base acceleration [m/s2], every STEP."""
    time = STEP * np.arange(INTERVALS + 1)
    return PULSE["A"] * np.sin(2 * np.pi * time / PULSE["T"]) * np.exp(-PULSE["b"] * time)


@functools.cache
def portal_history() -> Outcome:
    """OpenSees: Newmark's average acceleration with 0.5 ms, Steel01 hinges, P-Delta, damping of the sway mode."""
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    places = {1: (0, 0), 2: (6, 0), 3: (0, 4), 4: (6, 4), 5: (12, 0), 6: (12, 4)}
    for node, place in places.items():
        ops.node(node, *map(float, place))
        ops.fix(node, *((1, 1, 1) if place[1] == 0 else (0, 0, int(node == 6))))
    for tag, (start, end, kind) in enumerate(((1, 3, "column"), (2, 4, "column"), (3, 4, "beam")), start=1):
        area, inertia, length, strength = MEMBERS[kind]
        inertia *= (HINGE_RATIO + 1) / HINGE_RATIO
        ops.geomTransf("PDelta" if kind == "column" else "Linear", tag)
        ends = []
        for joint in (start, end):
            node = 10 * tag + joint
            ops.node(node, *map(float, places[joint]))
            ops.uniaxialMaterial("Steel01", node, strength, HINGE_RATIO * 6 * STEEL * inertia / length, HARDENING)
            ops.element("zeroLength", node, joint, node, "-mat", node, "-dir", 6)
            if places[joint][1] == 0:
                ops.fix(node, 1, 1, 0)
            else:
                ops.equalDOF(joint, node, 1, 2)
            ends.append(node)
        ops.element("elasticBeamColumn", tag, *ends, LARGE_AREA if kind == "beam" else area, STEEL, inertia, tag)
    ops.geomTransf("PDelta", 4)
    ops.element("elasticBeamColumn", 4, 5, 6, 1.0, STEEL, 1e-6, 4, "-release", 3)
    ops.uniaxialMaterial("Elastic", 1000, STEEL)
    ops.element("Truss", 5, 4, 6, LARGE_AREA, 1000)
    ops.mass(3, MASS, 0.0, 0.0)
    frequency = np.sqrt(ops.eigen("-fullGenLapack", 1)[0])  # before gravity acts: without P-Delta
    ops.modalDampingQ(float(DAMPING[0] / frequency + DAMPING[1] * frequency) / 2)
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for node, load in ((3, JOINT_LOAD), (4, JOINT_LOAD), (6, LEANING_LOAD)):
        ops.load(node, 0.0, -load, 0.0)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-10, 20)
    ops.algorithm("Newton")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    assert ops.analyze(1) == 0
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()
    ops.timeSeries("Path", 2, "-dt", STEP, "-values", *pulse().tolist())
    ops.pattern("UniformExcitation", 2, 1, "-accel", 2)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-10, 20)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    found = []
    for _ in range(INTERVALS * SUBSTEPS):
        assert ops.analyze(1, STEP / SUBSTEPS) == 0
        turned = [ops.nodeDisp(node, 3) - ops.nodeDisp(joint, 3) for node, joint in ((11, 1), (33, 3))]
        moments = [ops.eleResponse(node, "force")[5] for node in (11, 33)]
        found.append([ops.nodeDisp(3, 1), *turned, *moments])
    ops.wipe()
    values = np.array(found)
    time = STEP * np.arange(1, INTERVALS + 1)
    curve = time, values[SUBSTEPS - 1 :: SUBSTEPS, 0]
    return Outcome([*np.abs(values).max(axis=0), values[-1, 0]], {"drift": curve})
