"""The two-storey frame of the OpenSees examples (Eads 2010) with panel zones: rigid links, a spring and three pins."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from frame_cases import INCH, KIP, KSI

import warpdyn as wd

pytestmark = pytest.mark.fast
MODULUS = 29000 * KSI
LINES, LEVELS = (0.0, 360.0), (0.0, 180.0, 324.0)  # in
HALF_WIDTH, HALF_DEPTH, HINGE = 12.25, 13.55, 31.0  # of a panel; distance of the beam hinge from the joint [in]
RING = {  # corners and middles of the panel's edges
    "TL": (-1, 1),
    "T": (0, 1),
    "TR": (1, 1),
    "R": (1, 0),
    "BR": (1, -1),
    "B": (0, -1),
    "BL": (-1, -1),
    "L": (-1, 0),
}


def hinged(name: str, start: str, end: str, inertia: float, length: float) -> tuple[dict, dict]:
    """Return section and member with 1.1 I and springs 10 x 6 E (1.1 I) / L; inertia [in4], length [in]."""
    second = 1.1 * inertia * INCH**4
    spring = 10 * 6 * MODULUS * second / (length * INCH)
    area = (38.5 if inertia == 4020 else 30.0) * INCH**2
    section = {"elastic_modulus": MODULUS, "area": area, "second_moment": second}
    return section, {"start": start, "end": end, "section": name, "spring_start": spring, "spring_end": spring}


def panel_zone_frame() -> wd.Frame:
    nodes: dict[str, dict[str, float]] = {}
    members: dict[str, dict] = {}
    sections = {
        "rigid": {"elastic_modulus": MODULUS, "area": 1000 * INCH**2, "second_moment": 1e5 * INCH**4},
        "stub": {"elastic_modulus": MODULUS, "area": 30 * INCH**2, "second_moment": 3620 * INCH**4},
        "leaning": {"elastic_modulus": MODULUS, "area": 1.0},
    }
    panel = 0.95 * (MODULUS / 2.6) * (24.5 * 0.605) * INCH**2 * 27.1 * INCH  # K_e d_b

    def node(name: str, x: float, y: float, load: float = 0.0) -> None:
        nodes[name] = {"x": x * INCH, "y": y * INCH, "gravity_load": load * KIP}

    for line in (0, 1):
        node(f"0{line}", LINES[line], 0.0)
    node("L0", 720.0, 0.0)
    diaphragms = {}
    for floor, joint_load, leaning_load in ((1, 68.49, 398.02), (2, 66.845, 391.31)):
        y = LEVELS[floor]
        node(f"L{floor}", 720.0, y, leaning_load)
        leaning = {"start": f"L{floor - 1}", "end": f"L{floor}", "section": "leaning", "kind": "truss"}
        members[f"leaning {floor}"] = leaning
        for line, x in enumerate(LINES):
            joint = f"{floor}{line}"
            for name, (right, up) in RING.items():
                node(joint + name, x + right * HALF_WIDTH, y + up * HALF_DEPTH, joint_load if name == "R" else 0.0)
            for start, end in itertools.pairwise([*RING, "TL"]):
                link = {"start": joint + start, "end": joint + end, "section": "rigid", "p_delta": "no"}
                link |= {"release": "end"} if end in ("TL", "BR", "BL") else {}
                members[f"{joint} {start}-{end}"] = link | ({"spring_end": panel} if end == "TR" else {})
            below = f"0{line}" if floor == 1 else f"{floor - 1}{line}T"
            length = 180 - HALF_DEPTH if floor == 1 else 144 - 2 * HALF_DEPTH
            name = f"column {floor}"
            sections[name], members[f"C{joint}"] = hinged(name, below, f"{joint}B", 4020, length)
        node(f"{floor} left", HINGE, y)
        node(f"{floor} right", 360 - HINGE, y)
        members[f"stub {floor} left"] = {"start": f"{floor}0R", "end": f"{floor} left", "section": "stub"}
        members[f"stub {floor} right"] = {"start": f"{floor} right", "end": f"{floor}1L", "section": "stub"}
        ends = f"{floor} left", f"{floor} right"
        sections["beam"], members[f"B{floor}"] = hinged("beam", *ends, 3620, 360 - 2 * HINGE)
        diaphragms[f"floor {floor}"] = [f"{floor}0R", f"{floor}1R", f"L{floor}"]
    gravity = 386.2 * INCH
    masses = {"floor 1": 535 * KIP / gravity, "floor 2": 525 * KIP / gravity}
    supports = {"00": "fixed", "01": "fixed", "L0": "pinned"}
    return wd.Frame(nodes, members, sections, supports=supports, diaphragms=diaphragms, masses=masses)


def test_periods_are_the_recomputed_ones_and_close_to_the_published_ones():
    frame = panel_zone_frame()
    assert len(frame.members) == 44
    np.testing.assert_allclose(frame.modal()["period"], [0.805769, 0.184030], atol=5.1e-7)
    found = frame.modal(p_delta=True)["period"].values
    np.testing.assert_allclose(found, [0.815135, 0.184686], atol=5.1e-7)
    np.testing.assert_allclose(found, [0.81, 0.18], atol=0.0055)  # published by Eads
