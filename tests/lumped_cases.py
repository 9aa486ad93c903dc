"""Reference cases of lumped structures: structures, motions, and peaks that another program computed.

The peaks are those of event-exact solutions (Taylor series of order 26 between located events), which Newmark's method
and, for L02, L04 and L05, OpenSees confirm.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from lumped_attachments import heavier_equipment, inerter, light_equipment, with_p_delta, without_p_delta
from lumped_case import Case, pair, pulse

import warpdyn as wd


def torsional_storey() -> Case:
    """L01: one elastic storey; frame A across, frames B and C along."""
    mass, width, depth = 27215.5422, 9.144, 6.096
    springs = [
        wd.Spring("A", {"y": 1.0, "theta": 0.4572}, stiffness=1094542.72),
        wd.Spring("B", {"x": 1.0, "theta": -depth / 2}, stiffness=583756.117),
        wd.Spring("C", {"x": 1.0, "theta": depth / 2}, stiffness=583756.117),
    ]
    masses = {"x": mass, "y": mass, "theta": mass * (width**2 + depth**2) / 12}
    deck = wd.LumpedStructure(masses, springs, influence={"y": 1.0}, damping="modal", damping_ratio=0.05)
    peaks = {
        "peak_displacement": {"y": 0.1832691, "theta": 0.04548127},
        "peak_spring_deformation": {"A": 0.1802158, "B": 0.1386269},
        "peak_acceleration": {"y": 7.309982},
    }
    return Case(deck, pulse(3.0, 1.0, 0.5, 10.0), peaks, circular_frequencies=(5.876126, 6.549712, 6.791378))


def torsional_building() -> Case:
    """L02: three storeys with bilinear frames under two components."""
    masses = {}
    for floor, mass in enumerate((150e3, 150e3, 120e3), 1):
        masses |= {f"x{floor}": mass, f"y{floor}": mass, f"theta{floor}": mass * (20**2 + 12**2) / 12}
    frames = [("x", 5, 60e6, 900e3), ("x", -5, 40e6, 600e3)]
    frames += [("y", -9, 90e6, 1200e3), ("y", 0, 30e6, 400e3), ("y", 9, 30e6, 400e3)]
    springs = []
    for storey, share in enumerate((1.0, 0.85, 0.65), 1):
        for axis, place, stiffness, force in frames:
            arm = -place if axis == "x" else place
            direction = {f"{axis}{storey}": 1.0, f"theta{storey}": arm}
            if storey > 1:
                direction |= {f"{axis}{storey - 1}": -1.0, f"theta{storey - 1}": -arm}
            law = wd.laws.Bilinear(yield_force=share * force, hardening_ratio=0.05)
            springs.append(wd.Spring(f"{storey}{axis}{place:+}", direction, law=law, stiffness=share * stiffness))
    building = wd.LumpedStructure(
        masses,
        springs,
        influence=[{f"{axis}{floor}": 1.0 for floor in (1, 2, 3)} for axis in "xy"],
        damping="rayleigh",
        damping_ratio=0.05,
        damping_modes=(1, 5),
    )
    peaks = {
        "peak_displacement": {"x3": 0.08927797, "y3": 0.04588134, "theta3": 0.005485471},
        "peak_spring_deformation": {"1x+5": 0.07317494, "1y-9": 0.01222826, "1y+9": 0.05619458},
        "peak_spring_force": {"1y+9": 464291.9},
        "peak_acceleration": {"x3": 7.880575},
    }
    frequencies = (11.30993, 12.27073, 20.34943, 28.77817, 31.22293, 41.31271, 44.82231, 51.77922, 74.33204)
    last = {"x1": 0.00974664, "y1": -0.00127953, "theta1": -0.000112164, "x3": 0.0159521, "theta3": 0.000126062}
    both = pair(pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5))
    return Case(building, both, peaks, circular_frequencies=frequencies, last=last)


def condensed_stick(storeys: int, height: float, bending: float) -> np.ndarray:
    """Return the lateral stiffness [N/m] of a cantilever of Hermite beams, shape [floor, floor]."""
    beam = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    scale = np.array([1.0, height, 1.0, height])
    beam = bending / height**3 * beam * scale[:, None] * scale
    whole = np.zeros((2 * storeys + 2, 2 * storeys + 2))
    for storey in range(storeys):
        own = slice(2 * storey, 2 * storey + 4)
        whole[own, own] += beam
    free = whole[2:, 2:]
    lateral, turning = free[::2, ::2], free[1::2, 1::2]
    return lateral - free[::2, 1::2] @ np.linalg.solve(turning, free[1::2, ::2])


def wall_frame_tower() -> Case:
    """L03: a stick of 20 storeys that bends and shears."""
    storeys, height, mass = 20, 3.0, 400e3
    bending, shear = 2.39250923e11, 1.06333744e9
    floors = [f"u{floor}" for floor in range(1, storeys + 1)]
    wall = condensed_stick(storeys, height, bending)
    springs = [
        wd.Spring(floor, {floor: 1.0} | ({floors[place - 1]: -1.0} if place else {}), stiffness=shear / height)
        for place, floor in enumerate(floors)
    ]
    frame = np.zeros((storeys, storeys))
    for place in range(storeys):
        row = np.eye(storeys)[place] - (np.eye(storeys)[place - 1] if place else 0)
        frame += shear / height * np.outer(row, row)
    tower = wd.LumpedStructure(
        dict.fromkeys(floors, mass),
        springs,
        stiffness_matrix=wall,
        outputs={"base shear": dict(zip(floors, (wall + frame).sum(axis=0), strict=True))},
        damping="modal",
        damping_ratio=0.03,
    )
    peaks = {
        "peak_displacement": {"u20": 0.3196972},
        "peak_acceleration": {"u10": 1.710967},
        "peak_output": {"base shear": 9321352.0},
    }
    hertz = (0.4818632, 1.765076, 3.996459, 7.333397, 11.79809)
    frequencies = tuple(2 * np.pi * each for each in hertz)
    return Case(tower, pulse(2.0, 1.2, 0.4, 12.0), peaks, circular_frequencies=frequencies)


def pounding() -> Case:
    """L04: two oscillators with linear contact."""
    springs = []
    for name, mass, period in (("1", 200e3, 0.8), ("2", 350e3, 0.45)):
        stiffness = mass * (2 * np.pi / period) ** 2
        dashpot = 2 * 0.05 * np.sqrt(stiffness * mass)
        springs.append(wd.Spring(name, {name: 1.0}, stiffness=stiffness, damping_coefficient=dashpot))
    law = wd.laws.OneSidedGap(clearance=0.02, contact_stiffness=93.5e6)
    springs.append(wd.Spring("contact", {"1": 1.0, "2": -1.0}, law=law))
    row = wd.LumpedStructure({"1": 200e3, "2": 350e3}, springs)
    peaks = {
        "peak_displacement": {"1": 0.2605235, "2": 0.0904291},
        "peak_spring_force": {"contact": 8470988.0},
        "peak_acceleration": {"1": 52.78469, "2": 17.70298},
    }
    return Case(row, pulse(6.0, 0.7, 0.4), peaks, bound=1e-3, last={"1": -0.0331855, "2": -0.00358287})


def bridge() -> Case:
    """L05: pier, deck, bearings and abutment gaps."""
    law = wd.laws.OneSidedGap(clearance=0.05, contact_stiffness=150e6)
    bilinear = {"law": "bilinear"}
    springs = [
        wd.Spring("pier", {"pier": 1.0}, stiffness=40e6, yield_force=0.8e6, hardening_ratio=0.03, **bilinear),
        wd.Spring(
            "bearing", {"deck": 1.0, "pier": -1.0}, stiffness=20e6, yield_force=0.4e6, hardening_ratio=0.1, **bilinear
        ),
        wd.Spring("abutment bearings", {"deck": 1.0}, stiffness=6e6),
        wd.Spring("right", {"deck": 1.0}, law=law),
        wd.Spring("left", {"deck": -1.0}, law=law),
    ]
    structure = wd.LumpedStructure(
        {"pier": 60e3, "deck": 800e3}, springs, damping="rayleigh", damping_ratio=0.05, damping_modes=(1, 2)
    )
    peaks = {
        "peak_displacement": {"pier": 0.02861445, "deck": 0.1317049},
        "peak_spring_deformation": {"bearing": 0.1117918},
        "peak_spring_force": {"pier": 810337.3, "bearing": 583583.6, "right": 1.225574e7, "left": 9716607.0},
        "peak_acceleration": {"deck": 17.04199},
    }
    last = {"pier": -0.00478185, "deck": -0.0102303}
    motion = pulse(5.0, 0.9, 0.35, 10.0)
    return Case(structure, motion, peaks, circular_frequencies=(4.895108, 31.75749), bound=1e-4, last=last)


def sway_and_rocking() -> Case:
    """L07: an oscillator on a foundation that sways and rocks; the mass matrix is full."""
    m, mf, h, inertia = 500e3, 150e3, 12.0, 2.0e6
    stiffness, dashpot = 123370055.0, 2 * 0.05 * np.sqrt(123370055.0 * m)
    coupling = np.array([[0, m, m * h], [m, 0, m * h], [m * h, m * h, 0]])
    springs = [
        wd.Spring("structure", {"u": 1.0}, stiffness=stiffness, damping_coefficient=dashpot),
        wd.Spring("sway", {"sway": 1.0}, stiffness=1.80526547e9, damping_coefficient=64783675.5),
        wd.Spring("rocking", {"rocking": 1.0}, stiffness=7.61376826e10, damping_coefficient=207438885.0),
    ]
    structure = wd.LumpedStructure(
        {"u": m, "sway": m + mf, "rocking": m * h**2 + inertia},
        springs,
        mass_matrix=coupling,
        influence={"sway": 1.0},
        outputs={"floor": {"u": 1.0, "sway": 1.0, "rocking": h}},
    )
    peaks = {
        "peak_displacement": {"u": 0.04667903, "sway": 0.003024341, "rocking": 0.0009143329},
        "peak_output": {"floor": 0.06049148},
    }
    return Case(structure, pulse(3.0, 0.5, 0.5), peaks)


def inclined_springs() -> Case:
    """L08: one mass on four inclined bilinear springs under three components."""
    rows = [
        ((0.6, 0, 0.8), 8e6, 60e3),
        ((-0.6, 0, 0.8), 6e6, 50e3),
        ((0, 0.6, 0.8), 5e6, 45e3),
        ((0, -0.8, 0.6), 7e6, 55e3),
    ]
    springs = [
        wd.Spring(
            str(number),
            dict(zip("xyz", direction, strict=True)),
            law=wd.laws.Bilinear(yield_force=force, hardening_ratio=0.08),
            stiffness=stiffness,
        )
        for number, (direction, stiffness, force) in enumerate(rows, 1)
    ]
    structure = wd.LumpedStructure(
        dict.fromkeys("xyz", 20e3),
        springs,
        influence=[{axis: 1.0} for axis in "xyz"],
        damping="rayleigh",
        damping_ratio=0.03,
        damping_modes=(1, 3),
    )
    peaks = {
        "peak_displacement": {"x": 0.03588411, "y": 0.02264925, "z": 0.02035719},
        "peak_spring_force": {"1": 67787.5, "3": 51199.76},
        "peak_spring_deformation": {"4": 0.02007562},
    }
    motions = (pulse(4.0, 0.5, 0.6, 6.0), pulse(3.0, 0.4, 0.5, 6.0), pulse(2.5, 0.25, 0.8, 6.0))
    last = {"x": -0.00103935, "y": 0.00105885, "z": 0.00182745}
    return Case(structure, pair(*motions), peaks, circular_frequencies=(15.7134, 17.57978, 27.2771), last=last)


def deck_about(x: float, y: float) -> Case:
    """L09: a deck whose degrees of freedom are those of a point, at (x, y) from its corner; (0, 0) has a full mass."""
    mass, centre = 150e3, np.array([10.0 - x, 6.0 - y])  # of mass, from the point
    inertia = mass * (20**2 + 12**2) / 12 + mass * float(centre @ centre)
    coupling = np.zeros((3, 3))
    coupling[0, 2] = coupling[2, 0] = -mass * centre[1]
    coupling[1, 2] = coupling[2, 1] = mass * centre[0]
    frames = [("x", 11, 60e6, 900e3), ("x", 1, 40e6, 600e3), ("y", 1, 90e6, 1200e3), ("y", 19, 30e6, 400e3)]
    springs = [
        wd.Spring(
            f"{axis}{place}",
            {axis: 1.0, "theta": -(place - y) if axis == "x" else place - x},
            law=wd.laws.Bilinear(yield_force=force, hardening_ratio=0.05),
            stiffness=stiffness,
        )
        for axis, place, stiffness, force in frames
    ]
    structure = wd.LumpedStructure(
        {"x": mass, "y": mass, "theta": inertia},
        springs,
        mass_matrix=coupling,
        influence=[{"x": 1.0}, {"y": 1.0}],
        outputs={
            "corner x": {"x": 1.0, "theta": y},
            "corner y": {"y": 1.0, "theta": -x},
            "centre x": {"x": 1.0, "theta": y - 6.0},
            "centre y": {"y": 1.0, "theta": 10.0 - x},
        },
        damping="rayleigh",
        damping_ratio=0.05,
        damping_modes=(1, 3),
    )
    peaks = {
        "peak_displacement": {"theta": 0.002839879},
        "peak_output": {
            "corner x": 0.04477649,
            "corner y": 0.01004903,
            "centre x": 0.03248537,
            "centre y": 0.02139396,
        },
        "peak_spring_deformation": {"y19": 0.04603151},
    }
    both = pair(pulse(9.0, 0.35, 0.6, 6.0), pulse(8.0, 0.3, 0.5, 6.0))
    return Case(structure, both, peaks, circular_frequencies=(23.51723, 25.98215, 45.11755))


def deck_about_its_corner() -> Case:
    """L09 with a full mass matrix."""
    return deck_about(0.0, 0.0)


CASES: tuple[Callable[[], Case], ...] = (
    *(torsional_storey, torsional_building, wall_frame_tower, pounding, bridge, sway_and_rocking, inclined_springs),
    *(deck_about_its_corner, inerter, with_p_delta, without_p_delta, light_equipment, heavier_equipment),
)
