"""Problems on plane frames: second-order elastic analysis, plastic mechanism, response history with hinges."""

from __future__ import annotations

import numpy as np
from hinged_frame_cases import reference_model

import warpdyn as wd

from . import frames_truth as truth
from .problem import CLOSED, OPENSEES, Outcome, Problem, Row
from .runs import AS_GIVEN

GROUP = "Plane frames"
ELEMENTS = 16  # of the cantilever


def beam_column() -> Outcome:
    """Frame.static with p_delta=True and Frame.buckling_factors; 16 members with consistent geometric stiffness."""
    p = truth.CANTILEVER
    nodes = {f"{i}": {"x": 0.0, "y": p["L"] * i / ELEMENTS} for i in range(ELEMENTS + 1)}
    nodes[f"{ELEMENTS}"]["gravity_load"] = p["P"]
    section = {"elastic_modulus": 2e11, "area": p["EA"] / 2e11, "second_moment": p["EI"] / 2e11}
    frame = wd.Frame(
        nodes,
        {f"m{i}": (f"{i}", f"{i + 1}", "any") for i in range(ELEMENTS)},
        {"any": section},
        supports={"0": "fixed"},
        geometric_stiffness="consistent",
    )
    top = f"{ELEMENTS}"
    found = frame.static({top: {"fx": p["H"]}}, gravity=True, p_delta=True)
    moved = found["displacement"].sel(node=top)
    moment = abs(found["end_force"].sel(member="m0", end="start", action="moment").item())
    sway, rotation = (moved.sel(direction=each).item() for each in ("ux", "rz"))
    return Outcome([sway, -rotation, moment, frame.buckling_factors()[0]])


@AS_GIVEN
def portal_pushover() -> Outcome:
    """wd.pushover of a HingedFrame; columns do not shorten, and the weight is on a leaning column."""
    p = truth.PORTAL
    height, width = p["height"], p["width"]
    nodes = {"A": (0, 0), "D": (width, 0), "E": (2 * width, 0), "B": (0, height), "C": (width, height)}
    nodes["F"] = {"x": 2 * width, "y": height, "gravity_load": p["weight"]}
    column = {"section": "column", "spring_start": truth.SPRINGS["base"]}
    beam = {"section": "beam", "spring_start": truth.SPRINGS["beam"], "spring_end": truth.SPRINGS["beam"]}
    frame = wd.Frame(
        nodes,
        {
            "left": {"start": "A", "end": "B", **column},
            "right": {"start": "D", "end": "C", **column},
            "beam": {"start": "B", "end": "C", **beam},
            "leaning": {"start": "E", "end": "F", "section": "column", "kind": "truss"},
        },
        {
            kind: {"elastic_modulus": 2e11, "area": 0.02, "second_moment": p[f"EI {kind}"] / 2e11}
            for kind in ("column", "beam")
        },
        supports={"A": "fixed", "D": "fixed", "E": "pinned", "B": "roller", "C": "roller"},
        diaphragms={"roof": ["B", "C", "F"]},
        masses={"roof": p["weight"] / 9.80665},
    )
    places = {("left", "start"): "base", ("right", "start"): "base", ("beam", "start"): "beam", ("beam", "end"): "beam"}
    hinges = {
        place: {"law": "elastic_perfectly_plastic", "yield_force": truth.PLASTIC[kind]}
        for place, kind in places.items()
    }
    pushed = wd.pushover(wd.HingedFrame(frame, hinges), truth.ROOF)
    shear, turned = pushed["base_shear"].values, pushed["spring_deformation"]
    values = []
    for roof in truth.CHECKED.values():
        row = int(np.argmin(np.abs(truth.ROOF - roof)))
        rotations = [abs(turned.sel(spring=name).values[row]) for name in ("left start", "beam start")]
        values += [shear[row], *rotations]
    return Outcome(values, {"base shear against roof displacement": (truth.ROOF, shear)})


@AS_GIVEN
def portal_history() -> Outcome:
    """HingedFrame with rk4 at 1.25 ms."""
    motion = wd.GroundMotion(truth.pulse(), truth.STEP, "pulse")
    recorders = ("spring", "acceleration")
    scene = wd.Scene(reference_model("portal"), wd.Cloud([motion]), recorders=recorders, tail=0.0)
    run = wd.simulate(
        scene, method="rk4", step=0.00125, dtype="float64", device="cpu", histories=wd.Histories([0], every=8)
    )
    names = ["C1_1 start", "B1_1 start"]
    peaks = run.isel(sample=0)
    rotations = peaks["peak_spring_deformation"].sel(spring=["storey 1", *names]).values
    moments = peaks["peak_spring_force"].sel(spring=names).values
    drift = run["spring_deformation"].isel(history=0, spring=0).values
    time = run["time"].values
    return Outcome([*rotations, *moments, drift[-1]], {"drift": (time[1:], drift[1:])})


PROBLEMS = [
    Problem(
        "V79",
        "Cantilever under axial and lateral force",
        GROUP,
        CLOSED,
        "Differential equation of the beam-column (Timoshenko and Gere, Theory of Elastic Stability).",
        "A second-order elastic analysis includes the moments of the axial force on the displacements of the joints "
        "(P-Delta) and on the curvature of the members (P-delta). The axial force is 41 % of the buckling load.",
        (
            ("EI, EA", "40, 2000", "MN m², MN"),
            ("length", "4", "m"),
            ("axial and lateral force at the tip", "2.5, 0.05", "MN"),
            ("members", f'{ELEMENTS}, geometric_stiffness="consistent"', ""),
        ),
        [
            Row("displacement of the tip", "m"),
            Row("rotation of the tip", "rad"),
            Row("moment at the base", "N m"),
            Row("buckling load over axial force", "1"),
        ],
        ("cantilever", {}),
        truth.beam_column,
        beam_column,
        1e-6,
        "The error of the cubic shape functions decreases with the fourth power of the length of a member.",
        scale="value",
    ),
    Problem(
        "V80",
        "Plastic mechanism of a portal with P-Delta",
        GROUP,
        CLOSED,
        "Slope-deflection equations with elastic or plastic hinges; in the mechanism the work of the loads equals that "
        "of the plastic moments.",
        "A portal with perfectly plastic hinges at the bases of the columns and at the ends of the beam is pushed "
        "beyond its mechanism; the weight softens it by P/h. Rotations of hinges include the elastic part.",
        (
            ("height, width", "3.5, 7", "m"),
            ("EI of columns and beam", "40, 60", "MN m²"),
            ("springs of hinges: base, beam", "400, 500", "MN m"),
            ("plastic moments: base, beam", "350, 180", "kN m"),
            ("weight on a leaning column", "800", "kN"),
        ),
        [
            row
            for state, roof in truth.CHECKED.items()
            for row in (
                Row(f"base shear at {roof} m ({state})", "N"),
                Row(f"base hinge at {roof} m", "rad"),
                Row(f"beam hinge at {roof} m", "rad"),
            )
        ],
        ("portal", {"motion": False}),
        truth.portal_pushover,
        portal_pushover,
        1e-8,
        "Newton's method of the pushover analysis ends at relative residuals below 1e-9.",
        scale="value",
        axes={"base shear against roof displacement": ("roof displacement [m]", "base shear [N]")},
    ),
    Problem(
        "V81",
        "Portal with plastic hinges under base motion",
        GROUP,
        OPENSEES,
        "OpenSees 3.7.1: elasticBeamColumn, zeroLength with Steel01, PDelta, modalDampingQ, Newmark's average "
        "acceleration with 0.5 ms.",
        "A portal with bilinear hinges at all ends of its members and a leaning column. Rotations of joints and "
        "vertical displacements have no mass; rk4 solves them in each stage.",
        (
            ("height, width", "4, 6", "m"),
            ("I of columns and beam", "149.2, 231.3", "10⁶ mm⁴"),
            ("yield moments: columns, beam", "350, 300", "kN m"),
            ("hardening ratio of hinges", "0.0028", ""),
            ("mass; load on joints and leaning column", "70; 50, 50, 586.7", "t; kN"),
            ("damping factors of mass and stiffness", "0.53126, 0.0047058", "1/s, s"),
            ("motion", "4 sin(2πt/0.8) exp(-0.4t), every 0.01 s", "m/s²"),
            ("method and step", "rk4, 1.25 ms", ""),
        ),
        [
            Row("peak drift", "m"),
            Row("peak rotation of a base hinge", "rad"),
            Row("peak rotation of a beam hinge", "rad"),
            Row("peak moment of a base hinge", "N m"),
            Row("peak moment of a beam hinge", "N m"),
            Row("drift at 10 s", "m"),
        ],
        ("portal", {"motion": True}),
        truth.portal_history,
        portal_history,
        1e-4,
        "Both methods pass the corners of the hinges within a step; peaks are those at the steps. The error of a step "
        "of 1.25 ms is a few 1e-5.",
        scale="largest",
        axes={"drift": ("time [s]", "drift [m]")},
    ),
]
