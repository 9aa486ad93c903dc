"""Problems on isolators, dampers, stops and friction."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import warpdyn as wd

from . import devices_truth as truth
from .problem import CLOSED, PUBLISHED, SCIPY, Outcome, Problem, Row, series
from .runs import AS_GIVEN, at, curve, history, loop, storey

GROUP = "Isolators, dampers, stops and friction"
TIME_AND_U = ("time [s]", "displacement [m]")
FREE = 1e-9  # N/m: a storey spring without effect


def turning_points(run, count: int) -> np.ndarray:
    """Return the first turning points of a free vibration, at steps."""
    u, v = run["displacement"].values[0, :, 0], run["velocity"].values[0, :, 0]
    turns = np.flatnonzero(v[1:-1] * v[2:] < 0)[:count] + 1
    return np.array([u[i : i + 2][np.abs(u[i : i + 2]).argmax()] for i in turns])


def friction_decay() -> Outcome:
    """`FrictionDamper` with a stiff brace parallel to an elastic storey, rk4 at 0.05 ms."""
    with AS_GIVEN:
        device = wd.laws.FrictionDamper(slip_force=1.5, brace_stiffness=1e7)
        run = history(storey(1.0, 100.0, devices=[device]), wd.FreeVibration(1.2, displacement=0.1), 5e-5)
    time, u = curve(run)
    swings = [u[round(n * np.pi / 10 / 5e-5)] for n in (1, 2, 3)]
    return Outcome(swings, {"displacement": (time[::100], u[::100])})


def friction_pendulum() -> Outcome:
    """Storey law `friction_pendulum`, rk4 at 0.1 ms."""
    p = truth.PENDULUM
    law = wd.laws.FrictionPendulum(friction_coefficient=p["friction"], radius=p["radius"], weight=p["mass"] * 9.80665)
    building = storey(p["mass"], p["stiffness"], law=law)
    run = history(building, wd.FreeVibration(5.0, displacement=p["start"]), 1e-4)
    u = run["displacement"].values[0, :, 0]
    # Small vibrations before each slide have turning points, too: the extreme of each third is the swing.
    half = np.pi * np.sqrt(p["radius"] / 9.80665)
    parts = [u[round((n + 0.5) * half / 1e-4) : round((n + 1.5) * half / 1e-4)] for n in range(3)]
    return Outcome([part[np.abs(part).argmax()] for part in parts])


def lead_rubber() -> Outcome:
    """Storey law `lead_rubber_bearing` along closed cycles."""
    p = truth.BEARING
    law = wd.laws.LeadRubberBearing(yield_force=p["yield_force"], post_yield_stiffness=p["post_yield"])
    building = storey(1e5, p["stiffness"], law=law)
    force, energy = [], []
    for drift in truth.BEARING_DRIFTS:
        turns = np.array([0, drift, -drift, drift])
        path = np.concatenate([np.linspace(a, b, 2001)[1:] for a, b in pairwise(turns)])
        found = wd.storey_hysteresis(building, np.append(0, path))
        dissipated = found["dissipated_energy"].values[:, 0]
        force.append(found["storey_force"].values[2000, 0])
        energy.append(dissipated[6000] - dissipated[2000])
    largest = truth.BEARING_DRIFTS[-1]
    corner = largest - 2 * p["yield_force"] / p["stiffness"]
    turns = np.array([0, largest, corner, -largest, -corner, largest])
    return Outcome(
        [*force, *(np.array(force) / truth.BEARING_DRIFTS), *energy], {"loop": (turns[1:], loop(building, turns)[1:])}
    )


def falling_mass() -> Outcome:
    """`OneSidedGap` below a mass without a spring, downwards positive, rk4 at 0.01 ms."""
    step = 1e-5
    with AS_GIVEN:
        device = wd.laws.OneSidedGap(clearance=2.0, contact_stiffness=100.0)
        load = wd.HarmonicForce([10.0], 0.0, 1.2, phase=np.pi / 2, initial_velocity=1.0)
        run = history(storey(1.0, FREE, devices=[device]), load, step)
    time, u = curve(run)
    inside = np.flatnonzero(u > 2)
    crossings = []
    for i in (inside[0] - 1, inside[-1]):
        crossings.append(time[i] + step * (2 - u[i]) / (u[i + 1] - u[i]))
    values = [*crossings, *-at(run, "displacement", [1.0, 1.1])]
    return Outcome(values, {"height": (time[::500], -u[::500])})


def sliding_block() -> Outcome:
    """`FrictionDamper` with a stiff brace on a mass without a spring: ten times its dissipated power, 4 to 12 s."""
    values = []
    for size in truth.DRIVES:
        energy = []
        for duration in (4.0, 12.0):
            with AS_GIVEN:
                device = wd.laws.FrictionDamper(slip_force=1.0, brace_stiffness=2.5e8)
                block = storey(1.0, FREE, devices=[device])
                load = wd.HarmonicForce([size], 2 * np.pi, duration)
                scene = wd.Scene(block, load, recorders=("energy",))
                run = wd.simulate(scene, method="rk4", step=1e-4, dtype="float64", device="cpu")
            energy.append(float(run["hysteretic_energy"].sum()))
        values.append(10 * (energy[1] - energy[0]) / 8)
    return Outcome(values)


def viscous_damper() -> Outcome:
    """`ViscousDamper` on a mass without a spring, and taken through a sine by a force; rk4 at 0.1 ms and T/16000."""
    values, energy = [], []
    for a in truth.POWERS:
        with AS_GIVEN:
            device = wd.laws.ViscousDamper(damper_coefficient=5e4, velocity_exponent=a, linear_velocity=1e-3)
            run = history(storey(1e5, FREE, devices=[device]), wd.FreeVibration(0.5, velocity=1.0), 1e-4)
        values += [*at(run, "velocity", truth.POWER_TIMES)]
    mass, stiffness, c, size, w = 1e5, 4e6, 2e5, 0.05, 8.0
    interval = 2 * np.pi / w / 4000
    time = interval * np.arange(4001)
    v = size * w * np.sin(w * time)
    for a in truth.POWERS:
        force = mass * size * w**2 * np.cos(w * time) + stiffness * size * (1 - np.cos(w * time))
        force += c * np.sign(v) * np.abs(v) ** a
        with AS_GIVEN:
            device = wd.laws.ViscousDamper(damper_coefficient=c, velocity_exponent=a, linear_velocity=1e-4)
            load = wd.ForceHistory(force[:, None], interval)
            run = history(storey(mass, stiffness, devices=[device]), load, interval / 4, recorders=("energy",))
        energy.append(float(run["viscous_energy"].sum()))
    return Outcome([*values, *energy])


def maxwell_damper() -> Outcome:
    """`MaxwellDamper`, velocity exponent 0.35, on a heavy mass that a force moves as imposed; rk4 at 0.1 ms."""
    case, heavy, interval = truth.maxwell_case(), 1e12, 1e-4
    w, size = 2 * np.pi / case["T"], case["U"]
    time = interval * np.arange(round(case["times"][-1] / interval) + 2)
    fading, wave, cross = np.exp(-2 * time), np.sin(w * time), np.cos(w * time)
    acceleration = size * (-(w**2) * wave * (1 - fading) + 4 * w * cross * fading - 4 * wave * fading)
    with AS_GIVEN:
        device = wd.laws.MaxwellDamper(
            damper_coefficient=case["C"], velocity_exponent=case["alpha"], brace_stiffness=case["K"]
        )
        load = wd.ForceHistory(heavy * acceleration[:, None], interval)
        run = history(wd.ShearBuilding(heavy, 1e-3, 3.0, devices=[device]), load, interval)
    force = run["storey_force"].values[0, :, 0]
    rows = np.round(np.array(case["times"]) / interval).astype(int)
    return Outcome(force[rows][:: truth.MAXWELL_EVERY], {"force": (np.array(case["times"]), force[rows])})


def tuned_mass_damper() -> Outcome:
    """A chain of main mass and absorber under a sine force on the main mass, in the steady state."""
    mu, f = truth.ABSORBER_MASS, 1 / (1 + truth.ABSORBER_MASS)

    def steady(g: float, ratio: float) -> float:
        with AS_GIVEN:
            building = wd.ShearBuilding(
                [1.0, mu], [1.0, mu * f**2], 3.0, damping="storey", damping_coefficient=[0.0, 2 * ratio * mu * f]
            )
            count = 150
            period = 2 * np.pi / g
            load = wd.HarmonicForce([1.0, 0.0], g, (count + 1) * period)
            run = history(building, load, period / 200)
        return float(np.hypot(*at(run, "displacement", [count * period, (count + 0.25) * period])))

    values = [steady(g, ratio) for ratio in truth.ABSORBER_RATIOS for g in truth.fixed_points()]
    grid = np.linspace(0.7, 1.25, 12)
    sizes = np.array([steady(g, truth.ABSORBER_RATIOS[1]) for g in grid])
    return Outcome(values, {"amplitude, damping ratio 0.2": (grid, sizes)})


PROBLEMS = (
    Problem(
        "V34",
        "Coulomb friction: amplitudes of free vibration",
        GROUP,
        CLOSED,
        "Den Hartog 1931: each half swing is shorter by 2F/k, and the mass stops where k|u| < F.",
        "A friction damper parallel to an elastic storey, released from 0.1 m. It stops at -0.01 m.",
        (
            ("mass m", "1", "kg"),
            ("stiffness k", "100", "N/m"),
            ("slip force F", "1.5", "N"),
            ("brace stiffness", "1e7", "N/m"),
            ("method and step", "rk4, 0.05 ms", ""),
        ),
        series("displacement at {}π/10 s", (1, 2, 3), "m"),
        ("device", {"kind": "friction"}),
        truth.friction_decay,
        friction_decay,
        1e-5,
        "The brace gives by F/k_brace = 1.5e-7 m, twice in each half swing.",
        axes={"displacement": TIME_AND_U},
    ),
    Problem(
        "V35",
        "Friction pendulum: swings of an isolated mass",
        GROUP,
        CLOSED,
        "Balance of energy between turning points: slope W/R, friction μW, unloading with the initial stiffness.",
        "The mass is released from 0.75 m. In the limit of a rigid start each half swing is shorter by 2μR = 0.2 m.",
        (
            ("mass", "1e5", "kg"),
            ("radius R", "2 (T = 2π√(R/g) = 2.84 s)", "m"),
            ("friction coefficient μ", "0.05", ""),
            ("initial stiffness", "2e7", "N/m"),
            ("method and step", "rk4, 0.1 ms", ""),
        ),
        series("swing {}", (1, 2, 3), "m"),
        ("isolated", {}),
        truth.friction_pendulum,
        friction_pendulum,
        1e-5,
        "The swing is read at steps: (ωh)²/8 < 1e-7; each corner of the law costs about (ωh)² = 2e-6 with the initial "
        "stiffness.",
    ),
    Problem(
        "V36",
        "Lead-rubber bearing: forces, secant stiffness and energy of a cycle",
        GROUP,
        CLOSED,
        "F = Q + k₂U, K = F/U, E = 4Q(U - u_y), as in AASHTO's Guide Specifications for Seismic Isolation Design.",
        "Closed cycles of three amplitudes U.",
        (("initial stiffness", "2e7", "N/m"), ("yield force", "1e5", "N"), ("post-yield stiffness k₂", "1.5e6", "N/m")),
        [
            *series("force at {} m", truth.BEARING_DRIFTS, "N"),
            *series("secant stiffness, {} m", truth.BEARING_DRIFTS, "N/m"),
            *series("energy of a cycle, {} m", truth.BEARING_DRIFTS, "J"),
        ],
        ("isolated", {}),
        truth.lead_rubber,
        lead_rubber,
        1e-6,
        "Forces agree to rounding. The energy is summed by the trapezoidal rule over 4000 steps per cycle.",
        axes={"loop": ("drift [m]", "force [N]")},
    ),
    Problem(
        "V37",
        "Mass falling onto an elastic floor",
        GROUP,
        PUBLISHED,
        "Code_Aster test SDND108 (repository ehmoussi/code_aster, astest/sdnd108a.comm, 2020-11-09), analytic "
        "reference.",
        "A stop with a gap of 2 m below a mass. It starts downwards with 1 m/s and rebounds.",
        (
            ("mass", "1", "kg"),
            ("gravity", "10", "m/s²"),
            ("floor", "at -2 m, 100 N/m, no tension", ""),
            ("method and step", "rk4, 0.01 ms", ""),
        ),
        [
            Row("time of contact", "s", 0.5403124237),
            Row("time of separation", "s", 0.8854561531),
            Row("height at 1.0 s", "m", -1.332162982),
            Row("height at 1.1 s", "m", -0.856394405),
        ],
        ("device", {"kind": "stop"}),
        truth.falling_mass,
        falling_mass,
        1e-8,
        "rk4 passes the two corners of the contact within a step of ωh = 1e-4: an error of about (ωh)² each.",
        axes={"height": ("time [s]", "height [m]")},
    ),
    Problem(
        "V38",
        "Sliding block under a sine force",
        GROUP,
        PUBLISHED,
        "Code_Aster test SDND104 (repository ehmoussi/code_aster, astest/sdnd104a.comm, 2020-11-09), analytic "
        "reference.",
        "A block on a rough base sticks and slides. Wear power: mean of normal force (10 N) times sliding speed from "
        "4 to "
        "12 s, which is ten times the dissipated power.",
        (
            ("mass", "1", "kg"),
            ("friction force", "1", "N"),
            ("driving force", "A sin(2πt)", "N"),
            ("brace stiffness", "2.5e8", "N/m"),
            ("method and step", "rk4, 0.1 ms", ""),
        ),
        [
            Row(f"wear power, A = {a:g} N", "W", p, None if a > 2 else 1e-7 if a > 1.1 else 1e-9)
            for a, p in zip(truth.DRIVES, (15.2671, 0.409062, 0.000226164, 0.0), strict=True)
        ],
        ("device", {"kind": "friction"}),
        truth.sliding_block,
        sliding_block,
        4e-5,
        "The friction turns while the brace unloads, which takes 30 µs with 2.5e8 N/m: a difference of 2.6e-5. It is "
        "proportional to 1/√k (7.5e-5 with 1e7 N/m and 1.3e-5 with 1e9 N/m). With smaller forces the block stops in "
        "each half cycle and the difference does not add up.",
        notes="The printed quantity is the wear power, with the normal force. The power of the friction force is a "
        "tenth of "
        "it.",
    ),
    Problem(
        "V39",
        "Viscous damper with a power of the velocity",
        GROUP,
        CLOSED,
        "Decay: v^(1-a) = v₀^(1-a) - (1-a) c t/m. Cycle: λ c ω^a A^(1+a), λ = 2^(2+a) Γ(1+a/2)²/Γ(2+a) (FEMA 274, "
        "C9-36).",
        "The damper stops a mass without a spring; and its energy in a sine cycle of 0.05 m, through which a force "
        "takes the "
        "storey.",
        (
            ("exponents a", "1, 0.5, 0.3", ""),
            ("decay", "1e5 kg, 5e4 N(s/m)^a, 1 m/s", ""),
            ("cycle", "c = 2e5 N(s/m)^a, A = 0.05 m, ω = 8 rad/s", ""),
            ("method and step", "rk4, 0.1 ms and T/16000", ""),
        ),
        [
            *[Row(f"v({t:g} s), a = {a:g}", "m/s") for a in truth.POWERS for t in truth.POWER_TIMES],
            *[Row(f"energy of a cycle, a = {a:g}", "J", None, 5e-5) for a in truth.POWERS],
        ],
        ("device", {"kind": "viscous"}),
        truth.viscous_damper,
        viscous_damper,
        1e-6,
        "The force of the cycles is linear between samples and misses the vertical start of the power: 5e-5. The decay "
        "stays above the velocity below which the damper is linear.",
    ),
    Problem(
        "V40",
        "Maxwell damper with a power of the velocity under an imposed motion",
        GROUP,
        SCIPY,
        "ODE solver with a relative tolerance of 1e-10 (stored): `F' = K (v - sign(F) (|F|/C)^(1/a))`.",
        "Dashpot (exponent 0.35) and spring in series. OpenSees' material Maxwell is linear and is wrong here by 35 "
        "to 80 %.",
        (
            ("spring K", "5e7", "N/m"),
            ("dashpot C", "4e5", "N(s/m)^0.35"),
            ("motion", "0.04 sin(2πt) (1 - exp(-2t))", "m"),
            ("method and step", "rk4, 0.1 ms", ""),
        ),
        [Row(f"F({t:g} s)", "N") for t in truth.maxwell_case()["times"][:: truth.MAXWELL_EVERY]],
        ("device", {"kind": "maxwell"}),
        truth.maxwell_damper,
        maxwell_damper,
        1e-5,
        "The force that imposes the motion is linear between samples of 0.1 ms; stored values have 8 digits.",
        axes={"force": ("time [s]", "force [N]")},
    ),
    Problem(
        "V41",
        "Tuned mass damper: Den Hartog's fixed points",
        GROUP,
        CLOSED,
        "Den Hartog, Mechanical Vibrations, section 3.3: with the tuning 1/(1 + μ) the amplitudes at two frequencies "
        "are "
        "√(1 + 2/μ), for any damping of the absorber.",
        "Steady state of a main mass with an absorber under a sine force on the main mass.",
        (
            ("mass ratio μ", "0.05", ""),
            ("damping ratio of the absorber", "0.08 and 0.2", ""),
            ("method and step", "rk4, T/200, 150 periods from rest", ""),
        ),
        [Row(f"amplitude at fixed point {p}, ζ = {z}", "1") for z in truth.ABSORBER_RATIOS for p in ("P", "Q")],
        ("chain", {"masses": 1, "equipment": True, "load": 1}),
        truth.tuned_mass_damper,
        tuned_mass_damper,
        1e-6,
        "rk4 at T/200 changes frequencies by 1e-8; after 150 periods the transient is below 1e-7.",
        scale="value",
        axes={
            "amplitude, damping ratio 0.2": (
                "frequency over that of the main mass",
                "amplitude over static displacement",
            )
        },
    ),
)
