"""Pushover of a portal frame with six plastic hinges, with OpenSeesPy and with warpdyn.

    python docs/coming_from/scripts/frame_with_openseespy.py

It needs warpdyn with the extra ".[test]", which brings OpenSeesPy, and prints the base shears of both programs.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import warpdyn as wd

sys.path.insert(0, str(Path(__file__).parents[3] / "studies"))
from peers.opensees_newmark import load_opensees

ops = load_opensees()

# [frame]
WIDTH, HEIGHT, MODULUS = 6.0, 4.0, 200e9  # m, m, Pa
INERTIA = {"column": 1.1 * 1.492e-4, "beam": 1.1 * 2.313e-4}  # m4, of the elastic part of a member
SPRING = {"column": 4.9236e8, "beam": 5.0886e8}  # N m/rad, 10 times 6 E I / L
STRENGTH = {"column": 350e3, "beam": 300e3}  # N m
HARDENING_RATIO, WEIGHT = 0.0028, 686.7e3  # of the hinge; N, on the leaning column
ROOF = np.linspace(0.0, 0.2, 41)  # m


# [opensees]
def by_opensees() -> np.ndarray:
    """Return the base shears [N] at the roof displacements."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    places = {1: (0, 0), 2: (0, HEIGHT), 3: (WIDTH, HEIGHT), 4: (WIDTH, 0), 5: (2 * WIDTH, 0), 6: (2 * WIDTH, HEIGHT)}
    for node, place in places.items():
        ops.node(node, *place)
    for node in (1, 4):
        ops.fix(node, 1, 1, 1)
    ops.fix(5, 1, 1, 1)
    ops.fix(6, 0, 0, 1)
    for node in (3, 6):
        ops.equalDOF(2, node, 1)
    ops.uniaxialMaterial("Elastic", 9, 1e13)  # nearly rigid
    ops.geomTransf("Linear", 1)
    ops.geomTransf("PDelta", 2)
    for member, (kind, ends) in enumerate({"column": ((1, 2), (4, 3)), "beam": ((2, 3),)}.items(), start=1):
        ops.uniaxialMaterial("Steel01", member, STRENGTH[kind], SPRING[kind], HARDENING_RATIO)
        for element, pair in enumerate(ends):
            hinged = []
            for side, joint in enumerate(pair):  # a second node at each end, and a spring between both nodes
                node = 100 * member + 10 * element + side
                ops.node(node, *places[joint])
                ops.element("zeroLength", node, joint, node, "-mat", 9, 9, member, "-dir", 1, 2, 6)
                hinged.append(node)
            ops.element("elasticBeamColumn", member * 10 + element, *hinged, 1.0, MODULUS, INERTIA[kind], 1)
    ops.element("elasticBeamColumn", 50, 5, 6, 1.0, MODULUS, 1e-9, 2, "-release", 3)  # leaning column
    ops.timeSeries("Linear", 1)
    ops.pattern("Plain", 1, 1)
    ops.load(6, 0.0, -WEIGHT, 0.0)
    solve = {"constraints": ("Transformation",), "numberer": ("RCM",), "system": ("UmfPack",)}
    solve |= {"test": ("NormDispIncr", 1e-12, 50), "algorithm": ("Newton",)}
    for name, arguments in solve.items():
        getattr(ops, name)(*arguments)
    ops.integrator("LoadControl", 1.0)
    ops.analysis("Static")
    ops.analyze(1)
    ops.loadConst("-time", 0.0)
    ops.wipeAnalysis()
    ops.timeSeries("Linear", 2)
    ops.pattern("Plain", 2, 2)
    ops.load(2, 1.0, 0.0, 0.0)
    for name, arguments in solve.items():
        getattr(ops, name)(*arguments)
    found = [0.0]
    for step in np.diff(ROOF):
        ops.integrator("DisplacementControl", 2, 1, float(step))
        ops.analysis("Static")
        if ops.analyze(1) != 0:
            raise RuntimeError("OpenSees found no equilibrium")
        found.append(ops.getLoadFactor(2))
    return np.array(found)


# [warpdyn]
def by_warpdyn() -> np.ndarray:
    """Return the base shears [N] at the roof displacements."""
    joints = {"A": (0, 0), "B": (0, HEIGHT), "C": (WIDTH, HEIGHT), "D": (WIDTH, 0)}
    leaning = {"E": {"x": 2 * WIDTH, "y": 0}, "F": {"x": 2 * WIDTH, "y": HEIGHT, "gravity_load": WEIGHT}}
    members = {"left": ("A", "B", "column"), "right": ("D", "C", "column"), "beam": ("B", "C", "beam")}
    rows = {
        name: {"start": start, "end": end, "section": kind, "spring_start": SPRING[kind], "spring_end": SPRING[kind]}
        for name, (start, end, kind) in members.items()
    }
    frame = wd.Frame(
        joints | leaning,
        rows | {"leaning": ("E", "F", "column", "truss")},
        {kind: {"elastic_modulus": MODULUS, "area": 1.0, "second_moment": INERTIA[kind]} for kind in INERTIA},
        supports={"A": "fixed", "D": "fixed", "E": "pinned"},
        diaphragms={"roof": ["B", "C", "F"]},
        masses={"roof": 70e3},  # kg
    )
    hinges = {
        (name, end): {"law": "bilinear", "yield_force": STRENGTH[kind], "hardening_ratio": HARDENING_RATIO}
        for name, (_, _, kind) in members.items()
        for end in ("start", "end")
    }
    pushed = wd.pushover(wd.HingedFrame(frame, hinges), ROOF, pattern="triangular")
    return pushed["base_shear"].values


# [end]
if __name__ == "__main__":
    both = np.stack([by_opensees(), by_warpdyn()])
    for place in range(0, len(ROOF), 8):
        print(
            f"{ROOF[place]:.2f} m: {both[0, place] / 1e3:8.2f} kN (OpenSees), {both[1, place] / 1e3:8.2f} kN (warpdyn)"
        )
    print(
        f"largest difference: {np.abs(both[1] / both[0, -1] - both[0] / both[0, -1]).max():.1e} of the last base shear"
    )
