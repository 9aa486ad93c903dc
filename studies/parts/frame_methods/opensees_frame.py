"""OpenSees model of the four-storey frame: hinges as zeroLength elements, P-Delta, damping of all modes of the floors.

The history is integrated by Newmark's average acceleration with Newton iterations. Damping acts on the velocities of
the floors only: modal damping with the ratios of the frame's Rayleigh damping in all four modes is the same matrix.
"""

from __future__ import annotations

import time
from types import ModuleType

import numpy as np
from peers.opensees_newmark import load_opensees

import warpdyn as wd
from parts.four_storey_frame.frame import COEFFICIENTS, MASSES, MODULUS, frame_and_hinges

FIRST_END = 10_000  # number of the first node at the end of a member
FIRST_LINK = 20_000  # number of the first link to the leaning column
RIGID_AREA = 100.0  # m2, of beams and of the links to the leaning column: OpenSees cannot tie a node to two others
# Tolerance of the displacement increments [m]. IMKBilin returns secants, so that some steps need many iterations.
TOLERANCE, ITERATIONS = 1e-7, 50
ALGORITHMS = ("Newton", "KrylovNewton")  # the second one, if the first one does not converge in a step


def newmark_history(motion: wd.GroundMotion, step: float, interval: float, end: float) -> tuple[np.ndarray, float]:
    """Return the storey drifts [m] at multiples of an interval, shape [time, storey], and the processor time [s].

    Args:
        motion: Base motion.
        step: Integration step [s], which divides the interval.
        interval: Time between two returned states [s].
        end: End of the history [s].

    Raises:
        ImportError: If OpenSeesPy is missing.
        RuntimeError: If a step does not converge.
    """
    ops = load_opensees()
    floors = _build(ops)
    ops.timeSeries("Path", 2, "-dt", motion.step, "-values", *motion.acceleration.tolist())
    ops.pattern("UniformExcitation", 2, 1, "-accel", 2)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", TOLERANCE, ITERATIONS, 0)
    ops.algorithm(ALGORITHMS[0])
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    start = np.array([ops.nodeDisp(floor, 1) for floor in floors])  # under gravity
    found, seconds = [], 0.0
    for _ in range(round(end / interval)):
        begun = time.process_time()
        for _ in range(round(interval / step)):
            _advance(ops, step)
        seconds += time.process_time() - begun
        found.append(np.diff(np.array([ops.nodeDisp(floor, 1) for floor in floors]) - start, prepend=0.0))
    ops.wipe()
    return np.array(found), seconds


def _advance(ops: ModuleType, step: float) -> None:
    """Integrate one step."""
    for algorithm in ALGORITHMS:
        if algorithm != ALGORITHMS[0]:
            ops.algorithm(algorithm)
        failed = ops.analyze(1, step)
        if algorithm != ALGORITHMS[0]:
            ops.algorithm(ALGORITHMS[0])
        if not failed:
            return
    raise RuntimeError(f"OpenSees' analyze() returned {failed} at {ops.getTime():.3f} s with a step of {step} s")


def _build(ops: ModuleType) -> list[int]:
    """Build the frame, let it rest under gravity, and return the numbers of a node of each floor."""
    frame, hinges = frame_and_hinges()
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    number = {name: place for place, name in enumerate(frame.nodes, start=1)}
    for name, row in frame.nodes.items():
        ops.node(number[name], row["x"], row["y"])
        is_base, is_leaning = row["y"] == 0, name.startswith("L")
        ops.fix(number[name], int(is_base), int(is_base), int(is_leaning or is_base))
    for tag, (name, row) in enumerate(frame.members.items(), start=1):
        section, ends = frame.sections[row["section"]], [number[row[end]] for end in ("start", "end")]
        ops.geomTransf("Linear" if name.startswith("B") else "PDelta", tag)
        if row["kind"] == "truss":  # a leaning column: nearly no stiffness in bending, and a release
            values = section["area"], section["elastic_modulus"], 1e-6
            ops.element("elasticBeamColumn", tag, *ends, *values, tag, "-release", 3)
            continue
        for place, end in enumerate(("start", "end")):
            node, joint = FIRST_END + 2 * tag + place, row[end]
            ops.node(node, frame.nodes[joint]["x"], frame.nodes[joint]["y"])
            ops.uniaxialMaterial("IMKBilin", node, row[f"spring_{end}"], *_law(hinges[name, end]))
            ops.element("zeroLength", node, number[joint], node, "-mat", node, "-dir", 6)
            if frame.nodes[joint]["y"] == 0:
                ops.fix(node, 1, 1, 0)
            else:
                ops.equalDOF(number[joint], node, 1, 2)
            ends[place] = node
        area = RIGID_AREA if name.startswith("B") else section["area"]  # floors are rigid
        ops.element("elasticBeamColumn", tag, *ends, area, section["elastic_modulus"], section["second_moment"], tag)
    ops.uniaxialMaterial("Elastic", FIRST_END, MODULUS)
    floors = []
    for nodes, mass in zip(frame.diaphragms.values(), MASSES, strict=True):
        first, *_, last, leaning = (number[node] for node in nodes)
        ops.mass(first, mass, 0.0, 0.0)
        ops.element("Truss", FIRST_LINK + first, last, leaning, RIGID_AREA, FIRST_END)
        floors.append(first)
    frequency = np.sqrt(ops.eigen("-fullGenLapack", len(floors)))  # before gravity: without P-Delta
    ops.modalDampingQ(*((COEFFICIENTS[0] / frequency + COEFFICIENTS[1] * frequency) / 2).tolist())
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    for name, row in frame.nodes.items():
        if row["gravity_load"]:
            ops.load(number[name], 0.0, -float(row["gravity_load"]), 0.0)
    ops.constraints("Transformation")
    ops.numberer("RCM")
    ops.system("UmfPack")
    ops.test("NormDispIncr", 1e-12, 10)
    ops.algorithm("Linear")
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    if ops.analyze(1):
        raise RuntimeError("OpenSees found no equilibrium under gravity")
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()
    return floors


def _law(hinge: dict[str, float]) -> list[float]:
    """Return the parameters of IMKBilin after the initial stiffness: both sides, deterioration, exponents, rates."""
    side = [hinge[f"{name}_drift"] for name in ("post_capping", "ultimate")]
    side = [hinge["plastic_drift_to_capping"], *side]
    side += [hinge[name] for name in ("yield_force", "capping_force_ratio", "residual_force_ratio")]
    capacities = [hinge[f"{name}_deterioration_drift"] for name in ("strength", "post_capping", "unloading")]
    return [*side, *side, *capacities, 1.0, 1.0, 1.0, 1.0, 1.0]
