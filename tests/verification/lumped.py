"""Problems on lumped structures: torsion, towers, pounding, bridges, soil-structure interaction."""

from __future__ import annotations

import numpy as np

import warpdyn as wd

from . import lumped_truth as truth
from .problem import SCIPY, Outcome, Problem, Row
from .runs import AS_GIVEN, frequencies, history, motion, pair, states

GROUP = "Lumped structures"
TIME_AND_U = ("time [s]", "displacement [m]")
STEP = truth.STEP / truth.PARTS
peak_of = truth.peak_of


@AS_GIVEN
def torsional_storey() -> Outcome:
    """TorsionalBuilding of one storey, rk4 at 0.5 ms."""
    p = truth.DECK
    half, edge = p["depth"] / 2, p["width"] / 2
    frames = [
        wd.PlanFrame("A", (p["arm"], 0.0), "y", p["a"]),
        wd.PlanFrame("B", (0.0, half), "x", p["b"]),
        wd.PlanFrame("C", (0.0, -half), "x", p["b"]),
    ]
    plan = [[-edge, edge], [-half, half]]
    deck = wd.TorsionalBuilding([p["mass"]], plan, frames, base_motion="y", damping="modal", damping_ratio=0.05)
    run = history(deck, motion(truth.pulse(3.0, 1.0, 0.5, 10.0)), STEP)
    u = states(run, "displacement", ["uy1", "theta1"])
    values = [peak_of(each) for each in [*u.T, *states(run, "spring_deformation", ["A 1", "B 1"]).T]]
    return Outcome([*frequencies(deck), *values], {"displacement in y": (run["time"].values, u[:, 0])})


@AS_GIVEN
def torsional_building() -> Outcome:
    """TorsionalBuilding under a pair of motions, rk4 at 0.5 ms."""
    shares = np.array(truth.SHARES)
    frames = [
        wd.PlanFrame(
            f"{axis}{place:g}",
            (0.0, place) if axis == "x" else (place, 0.0),
            axis,
            k * shares,
            law=wd.laws.Bilinear(yield_force=force * shares, hardening_ratio=0.05),
        )
        for axis, place, k, force in truth.FRAMES
    ]
    damped = {"damping": "rayleigh", "damping_ratio": 0.05, "damping_modes": (1, 5)}
    building = wd.TorsionalBuilding(truth.FLOORS, [[-10.0, 10.0], [-6.0, 6.0]], frames, **damped)
    run = history(building, pair(truth.pulse(5.0, 0.9, 0.6), truth.pulse(4.0, 0.6, 0.5)), STEP)
    w = frequencies(building)
    values = [w[0], w[8], *(peak_of(each) for each in states(run, "displacement", ["ux3", "uy3", "theta3"]).T)]
    names = [f"{frame.name} 1" for frame in frames]
    deformation, force = (states(run, f"spring_{name}", names) for name in ("deformation", "force"))
    values += [peak_of(deformation[:, each]) for each in (0, 2, 4)]
    values += [peak_of(force[:, 4]), peak_of(force[:, :2].sum(axis=1)), peak_of(force[:, 2:].sum(axis=1))]
    return Outcome(values, {"deformation of the frame at x = 9 m": (run["time"].values, deformation[:, 4])})


@AS_GIVEN
def tower() -> Outcome:
    """FlexuralShearBuilding from period and stiffness ratio, rk4 at 0.5 ms."""
    p = truth.TOWER
    building = wd.FlexuralShearBuilding(
        [p["mass"]] * p["storeys"],
        p["height"],
        period=p["period"],
        alpha0=p["alpha0"],
        damping="modal",
        damping_ratio=0.03,
    )
    run = history(building, motion(truth.pulse(2.0, 1.2, 0.4, 12.0)), STEP)
    shear = building.parameters["stiffness"][0] * p["height"]  # alpha0^2 = shear / bending * height^2
    bending = shear * (p["storeys"] * p["height"] / p["alpha0"]) ** 2
    u = run["displacement"].isel(history=0)
    top, tenth = f"u{p['storeys']}", states(run, "acceleration", ["u10"])
    values = [bending, *(2 * np.pi / frequencies(building)[:5]), peak_of(u.sel(dof=top))]
    values += [peak_of(run["spring_deformation"]), peak_of(tenth)]
    return Outcome(values, {"displacement of the top": (run["time"].values, u.sel(dof=top).values)})


@AS_GIVEN
def pounding() -> Outcome:
    """Two oscillators and a OneSidedGap, rk4 at 0.1 ms."""
    springs = []
    for name, (mass, period) in zip("12", truth.OSCILLATORS, strict=True):
        k = mass * (2 * np.pi / period) ** 2
        dashpot = 2 * 0.05 * np.sqrt(k * mass)
        springs.append(wd.Spring(name, {name: 1.0}, stiffness=k, damping_coefficient=dashpot))
    law = wd.laws.OneSidedGap(clearance=truth.CONTACT["gap"], contact_stiffness=truth.CONTACT["stiffness"])
    springs.append(wd.Spring("contact", {"1": 1.0, "2": -1.0}, law=law))
    row = wd.LumpedStructure(dict(zip("12", [m for m, _ in truth.OSCILLATORS], strict=True)), springs)
    run = history(row, motion(truth.pulse(6.0, 0.7, 0.4)), truth.STEP / truth.CONTACT_PARTS)
    u, total = (states(run, name, ["1", "2"]) for name in ("displacement", "acceleration"))
    values = [*(peak_of(each) for each in u.T), peak_of(states(run, "spring_force", ["contact"]))]
    curve = run["time"].values, u[:, 0] - u[:, 1]
    return Outcome([*values, *(peak_of(each) for each in total.T)], {"gap closed by u1 - u2": curve})


@AS_GIVEN
def bridge() -> Outcome:
    """Bilinear springs and two OneSidedGaps, rk4 at 0.5 ms."""
    p, names = truth.BRIDGE, ("stiffness", "yield_force", "hardening_ratio")
    stop = wd.laws.OneSidedGap(clearance=p["gap"], contact_stiffness=p["stop"])
    springs = [
        wd.Spring("pier", {"pier": 1.0}, law="bilinear", **dict(zip(names, p["pier"], strict=True))),
        wd.Spring(
            "bearing", {"deck": 1.0, "pier": -1.0}, law="bilinear", **dict(zip(names, p["bearing"], strict=True))
        ),
        wd.Spring("abutment bearings", {"deck": 1.0}, stiffness=p["abutments"]),
        wd.Spring("right", {"deck": 1.0}, law=stop),
        wd.Spring("left", {"deck": -1.0}, law=stop),
    ]
    masses = {"pier": 60e3, "deck": 800e3}
    structure = wd.LumpedStructure(masses, springs, damping="rayleigh", damping_ratio=0.05, damping_modes=(1, 2))
    run = history(structure, motion(truth.pulse(5.0, 0.9, 0.35, 10.0)), STEP)
    u, total = states(run, "displacement", ["pier", "deck"]), states(run, "acceleration", ["deck"])
    values = [*(peak_of(each) for each in u.T), peak_of(states(run, "spring_deformation", ["bearing"]))]
    values += [peak_of(each) for each in states(run, "spring_force", ["pier", "bearing", "right", "left"]).T]
    return Outcome([*values, peak_of(total)], {"displacement of the deck": (run["time"].values, u[:, 1])})


@AS_GIVEN
def sway_and_rocking() -> Outcome:
    """structure_on_soil; damping ratio from the decay of the free vibration in the first mode; rk4 at 0.5 ms."""
    p = truth.SOIL
    building = wd.ShearBuilding(
        [p["mass"]], [p["stiffness"]], p["height"], damping="storey",
        damping_coefficient=2 * 0.05 * np.sqrt(p["stiffness"] * p["mass"]),
    )  # fmt: skip
    springs = wd.FoundationSprings(p["Kx"], p["Kr"], p["cx"], p["cr"])
    on_soil = wd.structure_on_soil(building, springs, foundation_mass=p["foundation"], rocking_inertia=p["inertia"])
    run = history(on_soil, motion(truth.pulse(3.0, 0.5, 0.5)), STEP)
    names = ["storey 1", "sway", "rocking"]
    peaks = [peak_of(each) for each in states(run, "spring_deformation", names).T]
    floor = states(run, "displacement", ["u1"])[:, 0]
    shape = on_soil.modal()["shape"].isel(mode=0).values
    free = history(on_soil, wd.FreeVibration(6.0, 0.01 * shape), STEP)
    u = states(free, "displacement", ["u1"])[4000:, 0]  # the second mode has decayed
    ahead, now, before = u[200::100], u[100:-100:100], u[:-200:100]
    (sum_, product), *_ = np.linalg.lstsq(np.stack([now, -before], axis=1), ahead, rcond=None)
    decay, turn = np.log(product) / 2, np.arccos(sum_ / (2 * np.sqrt(product)))
    values = [on_soil.fundamental_period, -decay / np.hypot(decay, turn), *peaks, peak_of(floor)]
    return Outcome(values, {"displacement of the floor": (run["time"].values, floor)})


MOTION = ("base motion", "A sin(2πt/T) exp(-bt), every 0.01 s", "m/s²")
RK4 = "Peaks are those at the steps. The error of rk4 at 0.5 ms is below 1e-7 for the frequencies of this problem."
CORNERS = "rk4 at 0.5 ms passes each corner of a spring with an error of about (ωh)² of a step's motion."
EXACT = "SciPy: matrix exponentials"
METHOD = ("method and step", "rk4, 0.5 ms", "")

PROBLEMS = [
    Problem(
        "V63",
        "Torsion of one storey with an eccentric frame",
        GROUP,
        SCIPY,
        f"Frequencies by the closed form of two coupled motions; {EXACT}. The plan is that of Chopra, Dynamics of "
        "Structures, section 9.6, in SI units.",
        "One frame across (A) and two along (B, C). A motion across makes the deck turn, because A is off the centre.",
        (
            ("deck", "9.144 by 6.096, 27,215.5", "m, kg"),
            ("stiffness of A, at x = 0.4572 m", "1,094,542.72", "N/m"),
            ("stiffness of B and C, at y = ±3.048 m", "583,756.117", "N/m"),
            ("damping ratio of each mode", "0.05", ""),
            MOTION,
            ("A, T, b", "3, 1, 0.5", "m/s², s, 1/s"),
            METHOD,
        ),
        [
            *(Row(f"ω{i}", "rad/s") for i in (1, 2, 3)),
            Row("peak u_y", "m"),
            Row("peak rotation", "rad"),
            Row("peak deformation of A", "m"),
            Row("peak deformation of B", "m"),
        ],
        ("plan", {}),
        truth.torsional_storey,
        torsional_storey,
        1e-7,
        RK4,
        axes={"displacement in y": TIME_AND_U},
    ),
    Problem(
        "V64",
        "Torsional building with yielding frames under two components",
        GROUP,
        SCIPY,
        f"{EXACT} between yield and unloading, which Brent's method locates. OpenSees 3.7.1 (0.5 ms) agrees within "
        "2.3e-5.",
        "Three storeys of 20 m by 12 m with five bilinear frames each; both components act at once.",
        (
            ("floor masses", "150, 150, 120", "t"),
            ("frames in x, at y = 5, -5 m", "60, 40; yield 900, 600", "MN/m, kN"),
            ("frames in y, at x = -9, 0, 9 m", "90, 30, 30; yield 1200, 400, 400", "MN/m, kN"),
            ("storeys 1, 2, 3", "1.0, 0.85, 0.65 times these values", ""),
            ("hardening ratio", "0.05", ""),
            ("Rayleigh damping", "0.05 in modes 1 and 5", ""),
            MOTION,
            ("A, T, b in x and y", "5, 0.9, 0.6; 4, 0.6, 0.5", "m/s², s, 1/s"),
            METHOD,
        ),
        [
            *(Row(f"ω{i}", "rad/s") for i in (1, 9)),
            Row("peak u_x of the top", "m"),
            Row("peak u_y of the top", "m"),
            Row("peak rotation of the top", "rad"),
            *(Row(f"peak deformation of the frame at {place}", "m") for place in ("y = 5 m", "x = -9 m", "x = 9 m")),
            Row("peak force of the frame at x = 9 m", "N"),
            Row("base shear in x", "N"),
            Row("base shear in y", "N"),
        ],
        ("frames", {}),
        truth.torsional_building,
        torsional_building,
        1e-5,
        CORNERS,
        axes={"deformation of the frame at x = 9 m": ("time [s]", "deformation [m]")},
    ),
    Problem(
        "V65",
        "Wall-frame tower of 20 storeys from its period",
        GROUP,
        SCIPY,
        f"Hermite beams and shear springs with condensed rotations, scaled to the first period; {EXACT}. The "
        "continuous beam is that of Miranda and Taghavi (2005).",
        "The builder finds the bending stiffness for which the stick with 20 equal masses has the first period of 2 s.",
        (
            ("storeys", "20 of 3 m, 400 t", ""),
            ("first period", "2", "s"),
            ("stiffness ratio α₀ = H √(GA/EI)", "4", ""),
            ("damping ratio of each mode", "0.03", ""),
            MOTION,
            ("A, T, b", "2, 1.2, 0.4", "m/s², s, 1/s"),
            METHOD,
        ),
        [
            Row("EI", "N m²"),
            *(Row(f"T{i}", "s") for i in range(1, 6)),
            Row("peak displacement of the top", "m"),
            Row("largest storey drift", "m"),
            Row("peak acceleration of floor 10", "m/s²"),
        ],
        ("chain", {"masses": 20, "motion": True}),
        truth.tower,
        tower,
        1e-7,
        RK4,
        axes={"displacement of the top": TIME_AND_U},
    ),
    Problem(
        "V66",
        "Pounding of two oscillators",
        GROUP,
        SCIPY,
        f"{EXACT} between touch and separation, which Brent's method locates. OpenSees 3.7.1 (0.05 ms, 3 s) agrees "
        "within 3e-7.",
        "Linear contact after a gap of 2 cm; the oscillators touch eleven times.",
        (
            ("masses", "200, 350", "t"),
            ("periods", "0.8, 0.45", "s"),
            ("damping ratio of each", "0.05", ""),
            ("gap", "0.02", "m"),
            ("contact stiffness", "93.5", "MN/m"),
            MOTION,
            ("A, T, b", "6, 0.7, 0.4", "m/s², s, 1/s"),
            ("method and step", "rk4, 0.1 ms", ""),
        ),
        [
            *(Row(f"peak u{i}", "m") for i in (1, 2)),
            Row("peak contact force", "N"),
            *(Row(f"peak total acceleration {i}", "m/s²") for i in (1, 2)),
        ],
        ("pounding", {}),
        truth.pounding,
        pounding,
        1e-6,
        "rk4 at 0.1 ms passes the corner of the contact force at touch and separation; eleven impacts add up.",
        axes={"gap closed by u1 - u2": ("time [s]", "u₁ - u₂ [m]")},
    ),
    Problem(
        "V67",
        "Bridge: pier, bearing, deck and abutment gaps",
        GROUP,
        SCIPY,
        f"{EXACT} between events that Brent's method locates. OpenSees 3.7.1 (Steel01, ElasticPPGap, 0.2 ms) agrees "
        "within 5e-7.",
        "The pier and the bearing between pier and deck yield, and the deck strikes both abutments.",
        (
            ("masses of pier and deck", "60, 800", "t"),
            ("pier", "40 MN/m, yield 0.8 MN, ratio 0.03", ""),
            ("bearing", "20 MN/m, yield 0.4 MN, ratio 0.10", ""),
            ("bearings of the abutments", "6", "MN/m"),
            ("abutments", "gap 0.05 m, 150 MN/m", ""),
            ("Rayleigh damping", "0.05 in both modes", ""),
            MOTION,
            ("A, T, b", "5, 0.9, 0.35", "m/s², s, 1/s"),
            METHOD,
        ),
        [
            Row("peak displacement of the pier", "m"),
            Row("peak displacement of the deck", "m"),
            Row("peak deformation of the bearing", "m"),
            *(Row(f"peak force of the {name}", "N") for name in ("pier", "bearing", "right stop", "left stop")),
            Row("peak total acceleration of the deck", "m/s²"),
        ],
        ("bridge", {}),
        truth.bridge,
        bridge,
        1e-5,
        f"{CORNERS} The stops are stiff: their corners have the largest error.",
        axes={"displacement of the deck": TIME_AND_U},
    ),
    Problem(
        "V68",
        "Oscillator on a foundation that sways and rocks",
        GROUP,
        SCIPY,
        f"Complex eigenvalues of the matrices; {EXACT}. Springs and dashpots are those of Pais and Kausel (1988) for a "
        "footing of 20 m by 12 m.",
        "Soil-structure interaction: the mass matrix is full, and the dashpots make the damping non-classical.",
        (
            ("mass and height", "500 t, 12 m", ""),
            ("fixed base", "0.4 s, damping ratio 0.05", ""),
            ("foundation", "150 t; rocking inertia 2,000 t m²", ""),
            ("sway", "1.80526547 GN/m, 64.7836755 MN s/m", ""),
            ("rocking", "76.1376826 GN m, 207.438885 MN m s", ""),
            MOTION,
            ("A, T, b", "3, 0.5, 0.5", "m/s², s, 1/s"),
            METHOD,
        ),
        [
            Row("T₁, undamped", "s"),
            Row("damping ratio of the first complex mode", "1"),
            Row("peak deformation of the structure", "m"),
            Row("peak sway", "m"),
            Row("peak rocking", "rad"),
            Row("peak displacement of the floor", "m"),
        ],
        ("rocking", {}),
        truth.sway_and_rocking,
        sway_and_rocking,
        2e-6,
        f"{RK4} The damping ratio follows from displacements of a free vibration at intervals of 50 ms.",
        axes={"displacement of the floor": TIME_AND_U},
    ),
]
