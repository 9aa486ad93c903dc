"""Problems on linear chains of masses: histories, harmonic response, complex modes, the seed frame."""

from __future__ import annotations

import numpy as np

import warpdyn as wd

from . import chains_truth as truth
from .problem import CLOSED, PUBLISHED, SCIPY, Outcome, Problem, Row, series
from .runs import at, curve, history
from .solvers import top

GROUP = "Linear chains and matrix systems"
VPCS = "Original: Société Française des Mécaniciens, Guide de validation des progiciels de calcul de structures."
EXACT = "The method `exact` has rounding errors only, at any step that divides the load's."
TIME_AND_U = ("time [s]", "displacement [m]")


def damped_chain() -> wd.LinearSystem:
    """Return the eight masses with dampers of 50 N s/m."""
    return wd.LinearSystem(np.full(8, truth.EIGHT_MASS), truth.EIGHT / 2000, truth.EIGHT)


def eight_masses() -> Outcome:
    """Modes of a matrix system."""
    system = wd.LinearSystem(np.full(8, truth.EIGHT_MASS), np.zeros((8, 8)), truth.EIGHT)
    return Outcome(system.modal()["circular_frequency"].values / (2 * np.pi))


def harmonic_response() -> Outcome:
    """Steady state after 70 s from rest: u(n T) and u(n T + T/4) under F cos(w t) are Re U and -Im U."""
    values, grid = [], []
    for f in truth.FREQUENCIES:
        period, count = 1 / f, int(np.ceil(70 * f))
        step = period / 8
        load = wd.HarmonicForce(np.eye(8)[3], 2 * np.pi * f, (count + 1) * period, phase=np.pi / 2)
        run = history(damped_chain(), load, step, "exact")
        real, minus_imaginary = at(run, "displacement", [count * period, (count + 0.25) * period], 3)
        values += [real, -minus_imaginary]
        if f < 20:
            grid.append((f, np.hypot(real, minus_imaginary)))
    frequencies, sizes = np.array(grid).T
    return Outcome(values, {"amplitude": (frequencies, sizes)})


def rectangular_pulse() -> Outcome:
    """Constant force for 1 s, then free vibration from the state that it leaves; method `exact` at 1 ms."""
    loaded = history(damped_chain(), wd.HarmonicForce(np.eye(8)[3], 0.0, 1.0, phase=np.pi / 2), 1e-3, "exact")
    state = {name: loaded[name].values[0, -1] for name in ("displacement", "velocity")}
    free = history(damped_chain(), wd.FreeVibration(0.5, **state), 1e-3, "exact")
    u = np.append(loaded["displacement"].values[0, :, 3], free["displacement"].values[0, 1:501, 3])
    rows = np.round(np.array(truth.PULSE_TIMES) / 1e-3).astype(int)
    return Outcome(u[rows], {"displacement of mass 4": (1e-3 * np.arange(1501)[::5], u[::5])})


def unequal_dampers() -> Outcome:
    """Free vibration in each complex mode; its eigenvalue from the recurrence of four displacements."""
    system = wd.LinearSystem(np.full(8, truth.EIGHT_MASS), truth.fixed_chain(truth.UNEQUAL), truth.EIGHT)
    frequencies, ratios = [], []
    for root, shape in zip(*(np.moveaxis(each, -1, 0) for each in truth.complex_modes()), strict=True):
        start = {"displacement": shape.real, "velocity": (root * shape).real}
        run = history(system, wd.FreeVibration(0.1, **start), 2e-3, "exact")
        u = run["displacement"].values[0, :, int(np.abs(shape).argmax())]
        # u(n+1) = 2 e^(a h) cos(w h) u(n) - e^(2 a h) u(n-1)
        (sum_, product), *_ = np.linalg.lstsq(np.stack([u[1:-1], -u[:-2]], axis=1), u[2:], rcond=None)
        decay = np.log(product) / 2 / 2e-3
        turn = np.arccos(sum_ / (2 * np.sqrt(product))) / 2e-3
        frequencies.append(turn / (2 * np.pi))
        ratios.append(-decay / np.hypot(decay, turn))
    return Outcome([*frequencies, *ratios])


def square_acceleration() -> Outcome:
    """Three storeys, base acceleration sampled at 0.05 ms, rk4 at 0.05 ms."""
    building = wd.ShearBuilding(np.full(3, 1.0), 1000.0, 3.0)
    time = 5e-5 * np.arange(2001)
    run = history(building, wd.GroundMotion(2e5 * time**2, 5e-5), 5e-5)
    frequencies = building.modal()["circular_frequency"].values / (2 * np.pi)
    values = [*frequencies, *at(run, "displacement", truth.SQUARE_TIMES, 2)]
    return Outcome(values, {"displacement of the top": tuple(each[:2001:10] for each in curve(run, dof=2))})


SEED_SYSTEM = wd.LinearSystem(truth.SEED["mass"], 0.0015 * truth.SEED["stiffness"], truth.SEED["stiffness"])


def seed_frame() -> Outcome:
    """Matrix system under the harmonic force, rk4; tops by a parabola through three steps of 1 ms."""
    load = wd.HarmonicForce(truth.SEED["force"], 10.0, 10.0)
    runs = {step: history(SEED_SYSTEM, load, step) for step in truth.SEED_STEPS}
    run = runs[1e-3]
    time, u = run["time"].values, run["displacement"].values[0]
    tops = [top(time, u[:, dof]) for dof in range(3)]
    values = [u[round(t / 1e-3), dof] for t in truth.SEED_TIMES for dof in range(3)]
    values += [*(abs(each) for _, each in tops), *(t for t, _ in tops), tops[2][1] / tops[0][1]]
    for step, found in runs.items():
        values.append(np.abs(found["displacement"].values[0] - truth.seed_exact(step)).max() * 1e6)
    return Outcome(values, {f"displacement u{dof + 1}": (time[:3001:5], u[:3001:5, dof]) for dof in (0, 2)})


EIGHT_INPUT = (
    ("masses", "8 of 10", "kg"),
    ("springs", "9 of 1e5, both ends fixed", "N/m"),
)
EIGHT_SKETCH = {"masses": 8, "fixed_top": True}
DAMPERS = ("dampers", "9 of 50 (C = K/2000)", "N s/m")
HARMONIC = [
    0.00010237, -8.5187e-06, 0.00045066, -0.00077914, -9.4101e-05, -1.0585e-05, -4.139e-05, -2.6083e-06,
    -2.4232e-05, -1.2233e-06, -1.5691e-05, -7.6742e-07, -1.0509e-05, -5.8171e-07, -2.5696e-06, -2.7554e-07,
]  # fmt: skip

PROBLEMS = (
    Problem(
        "V13",
        "Natural frequencies of eight masses fixed at both ends",
        GROUP,
        CLOSED,
        f"Code_Aster test SDLD02 (repository ehmoussi/code_aster, astest/sdld02a.comm, 2020-11-09). {VPCS}",
        "Undamped modes of a chain of equal masses and springs.",
        EIGHT_INPUT,
        series("f{} ", range(1, 9), "Hz", [5.5274, 10.8868, 15.9155, 20.4606, 24.384, 27.5664, 29.9113, 31.3474]),
        ("chain", EIGHT_SKETCH),
        truth.eight_masses,
        eight_masses,
        1e-12,
        "Rounding of an 8 by 8 eigenvalue problem.",
        scale="value",
    ),
    Problem(
        "V14",
        "Eight masses with dampers: harmonic response",
        GROUP,
        PUBLISHED,
        f"Code_Aster test SDLD21 (repository ehmoussi/code_aster, astest/sdld21a.comm, 2020-11-09). {VPCS}",
        "Complex displacement of the fourth mass under a force of 1 N exp(i2πft) on it. The run starts from rest and "
        "lasts "
        "70 s, so that the transient (0.30 1/s in the first mode) has decayed to 1e-9.",
        (*EIGHT_INPUT, DAMPERS, ("force", "1 on mass 4", "N"), ("method and step", "exact, T/8", "")),
        [
            Row(f"{part} u4({f:g} Hz)", "m", HARMONIC[2 * i + j])
            for i, f in enumerate(truth.FREQUENCIES)
            for j, part in enumerate(("Re", "Im"))
        ],
        ("chain", EIGHT_SKETCH | {"load": 4}),
        truth.harmonic_response,
        harmonic_response,
        1e-8,
        "The method `exact` has rounding errors only; the transient has decayed to 1e-9.",
        axes={"amplitude": ("frequency [Hz]", "amplitude of mass 4 [m]")},
    ),
    Problem(
        "V15",
        "Eight masses with dampers: rectangular force pulse",
        GROUP,
        PUBLISHED,
        f"Code_Aster test SDLD22 (repository ehmoussi/code_aster, astest/sdld22a.comm, 2020-11-09). {VPCS}",
        "A force of 1 N acts on the fourth mass for 1 s. The printed times are near the extremes of its displacement.",
        (*EIGHT_INPUT, DAMPERS, ("force", "1 on mass 4, 0 to 1 s", "N"), ("method and step", "exact, 1 ms", "")),
        series(
            "u4({} s)",
            truth.PULSE_TIMES,
            "m",
            [
                4.02e-05,
                4.22e-06,
                3.89e-05,
                5.98e-06,
                3.73e-05,
                7.14e-06,
                3.64e-05,
                8.07e-06,
                3.58e-05,
                8.76e-06,
                3.52e-05,
                -3.08e-05,
                3.02e-05,
                -2.88e-05,
                2.8e-05,
                -2.65e-05,
            ],
        ),
        ("chain", EIGHT_SKETCH | {"load": 4}),
        truth.rectangular_pulse,
        rectangular_pulse,
        1e-10,
        EXACT,
        axes={"displacement of mass 4": TIME_AND_U},
        marks={"displacement of mass 4": (truth.PULSE_TIMES, 0)},
        notes="The printed minima at 0.184, 0.365, 0.544, 0.724 and 0.904 s are 1.2 to 4.8 % too large. The maxima "
        "agree "
        "within 0.4 %.",
    ),
    Problem(
        "V16",
        "Eight masses with unequal dampers: complex modes",
        GROUP,
        PUBLISHED,
        f"Code_Aster test SDLD27 (repository ehmoussi/code_aster, astest/sdld27a.comm, 2020-11-09). {VPCS}",
        "The dampers couple the undamped modes. The system is released in each complex mode; the recurrence of its "
        "displacements contains the eigenvalue λ of the mode. Frequency: |Im λ|/2π. Damping ratio: -Re λ/|λ|.",
        (*EIGHT_INPUT, ("dampers", "250, seven of 50, 25", "N s/m"), ("method and step", "exact, 2 ms", "")),
        [
            *series("f{}", range(1, 9), "Hz", [5.53, 10.9, 15.93, 20.45, 24.34, 27.49, 29.84, 31.29]),
            *series("ζ{}", range(1, 9), "1", [0.01521, 0.02877, 0.0396, 0.04709, 0.05098, 0.05183, 0.05115, 0.05036]),
        ],
        ("chain", EIGHT_SKETCH),
        truth.unequal_dampers,
        unequal_dampers,
        1e-9,
        "Rounding of the displacements, about 100 times larger in the eigenvalue.",
        scale="value",
        notes="The printed damping ratios are -Re λ/|Im λ| = ζ/√(1 - ζ²), which is 0.01 to 0.13 % larger than ζ.",
    ),
    Problem(
        "V17",
        "Three storeys under a base acceleration that grows with the square of time",
        GROUP,
        PUBLISHED,
        f"Code_Aster test SDLD04 (repository ehmoussi/code_aster, astest/sdld04a.comm, 2020-11-09). {VPCS}",
        "Displacement of the top mass relative to the base, from rest, without damping.",
        (
            ("masses", "3 of 1", "kg"),
            ("springs", "3 of 1000", "N/m"),
            ("base acceleration", "2e5 t²", "m/s²"),
            ("method and step", "rk4, 0.05 ms, the sampling step of the motion", ""),
        ),
        [
            *series("f{}", range(1, 4), "Hz", [2.239, 6.275, 9.069]),
            *series("u3({} s)", truth.SQUARE_TIMES, "m", [-0.0027, -0.0426, -0.1041, -0.2158, -0.6813, -1.658]),
        ],
        ("chain", {"masses": 3, "motion": True}),
        truth.square_acceleration,
        square_acceleration,
        1e-6,
        "The motion is linear between samples: its mean error of A h²/6 = 8e-5 m/s² changes u3(0.1 s) by 4e-7 m.",
        axes={"displacement of the top": TIME_AND_U},
        marks={"displacement of the top": (truth.SQUARE_TIMES, 3)},
        notes="The first two printed frequencies are truncated. The printed displacements from 0.04 s on are 0.05 to "
        "0.15 % too small, beyond rounding.",
    ),
    Problem(
        "V18",
        "Three-storey frame under a harmonic force: the published table and the exact solution",
        GROUP,
        SCIPY,
        "Table of peak displacements in the paper on explicit Runge-Kutta methods from which warpdyn started "
        "(see studies/seed_frame.py). Exact solution: matrix exponentials, confirmed in 40-digit arithmetic.",
        "M ü + C u̇ + K u = [0, 100, 0] sin(10t) N from rest, C = 0.0015 K, for 10 s. The rows are displacements, "
        "peaks, "
        "times of the peaks, and the largest errors of rk4 at three steps, which show its order 4.",
        (
            ("masses", "200, 150, 100", "kg"),
            ("storey stiffness", "3 of 20000", "N/m"),
            ("force", "100 sin(10 t) on mass 2", "N"),
            ("method and step", "rk4, 1 ms", ""),
        ),
        [
            *[Row(f"u{dof}({t:g} s)", "m") for t in truth.SEED_TIMES for dof in (1, 2, 3)],
            *[Row(f"peak |u{dof}|", "m", p) for dof, p in zip((1, 2, 3), (0.0038, 0.0051, 0.0042), strict=True)],
            *[Row(f"time of the peak of u{dof}", "s", p) for dof, p in zip((1, 2, 3), (1.27, 1.26, 1.26), strict=True)],
            Row("peak u3 over peak u1", "1", 4.2 / 3.8),
            *[Row(f"largest error of rk4, h = {step * 1e3:g} ms", "µm") for step in truth.SEED_STEPS],
        ],
        ("chain", {"masses": 3, "load": 2}),
        truth.seed_frame,
        seed_frame,
        1e-8,
        "The error of rk4 at 1 ms is 2.2e-11 m. Errors of rk4 are compared with those of a Runge-Kutta program in "
        "NumPy.",
        axes={f"displacement u{dof}": TIME_AND_U for dof in (1, 3)},
        notes="The published peaks do not follow from the published parameters. Row 1 of the equations, divided by "
        "2, is "
        "row 3 with u3 = 2 u1. So u3 = 2 u1 at all times, for any load on mass 2, while the published peaks have "
        "u3 = 1.105 u1. warpdyn is compared with the exact solution, never with the published peaks.",
    ),
)
