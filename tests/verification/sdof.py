"""Problems with one degree of freedom: forces, base motion, spectra, a damper at resonance."""

from __future__ import annotations

import numpy as np

import warpdyn as wd

from . import sdof_truth as truth
from .el_centro import STEP, el_centro
from .problem import CLOSED, PUBLISHED, SCIPY, Outcome, Problem, Row, series
from .runs import AS_GIVEN, at, curve, history, storey

GROUP = "Linear systems with one degree of freedom"
RK4 = "The error of rk4 at this step is about (ωh)⁴/120 per radian of the motion, below the tolerance."
TIME_AND_U = ("time [s]", "displacement [m]")


def critical_damping() -> Outcome:
    """Matrix system with one degree of freedom, rk4 at 1 ms."""
    run = history(wd.LinearSystem([10.0], [[1000.0]], [[25000.0]]), wd.HarmonicForce([5.0], 50.0, 0.5), 1e-3)
    values = [*at(run, "displacement", truth.TIMES_U), *at(run, "velocity", truth.TIMES_V)]
    return Outcome(values, {"displacement": curve(run)})


def el_centro_spectrum() -> Outcome:
    """Response spectra, and the method `exact` at the samples of the record."""
    motion = wd.GroundMotion(truth.GRAVITY * el_centro(), STEP)
    periods = sorted({period for period, _ in truth.SPECTRUM})
    with AS_GIVEN:
        spectra = wd.response_spectra(motion, periods, [0.0, 0.02, 0.05], device="cpu").isel(motion=0)
    rows = [spectra.sel(period=period, damping_ratio=ratio) for period, ratio in truth.SPECTRUM]
    between = [float(row["spectral_displacement"]) for row in rows]
    velocity = [float(row["pseudo_spectral_velocity"]) for row in rows[:3]]
    acceleration = [float(row["pseudo_spectral_acceleration"]) / truth.GRAVITY for row in rows[:3]]
    at_samples = []
    for period, ratio in truth.SPECTRUM:
        w = 2 * np.pi / period
        run = history(wd.LinearSystem([1.0], [[2 * ratio * w]], [[w**2]]), motion, STEP, "exact")
        at_samples.append(np.abs(run["displacement"].values).max())
    return Outcome([*between, *velocity, *acceleration, *at_samples])


def ramp_force() -> Outcome:
    """Sampled force, rk4 at pi/1000 s; the largest displacement is that of the steps."""
    values, curves = [], {}
    step = np.pi / 1000
    for share, times in truth.RAMPS:
        time = np.pi * np.array([0, share, 2.0]) if share != 1 else np.pi * np.array([0, 1.0, 2.0])
        force = np.interp(np.arange(5) * np.pi / 2, time, [0, 1.0, 1.0])
        run = history(wd.LinearSystem([1.0], [[0.0]], [[4.0]]), wd.ForceHistory(4 * force[:, None], np.pi / 2), step)
        u = run["displacement"].values[0, :2001, 0]
        values += [*at(run, "displacement", np.pi * np.array(times)), u.max()]
        curves["rise time T" if share == 1 else "rise time T/2"] = (run["time"].values[:2001:2], u[::2])
    return Outcome(values, curves)


def resonance() -> Outcome:
    """A dashpot as damping of the storey, and a `MaxwellDamper`; rk4 at 20 pi/20000 s."""
    load, step = wd.HarmonicForce([10.0], 10.0, 20 * np.pi), np.pi / 10000
    dashpot = history(storey(1.0, 100.0, damping="storey", damping_coefficient=1.0), load, 10 * step)
    with AS_GIVEN:
        device = wd.laws.MaxwellDamper(damper_coefficient=1.0, brace_stiffness=1e4)
        maxwell = history(storey(1.0, 100.0, devices=[device]), load, step / 2)
    values = [at(run, "displacement", truth.RESONANCE_TIMES) for run in (dashpot, maxwell)]
    time, u = curve(dashpot)
    return Outcome(np.concatenate(values), {"displacement": (time[::10], u[::10])})


def slow_sine() -> Outcome:
    """Matrix system, rk4 at 1 ms."""
    natural = 2 * np.pi / 0.8
    mass, values = 2.0 / natural**2, []
    for ratio in (0.0, 0.05):
        system = wd.LinearSystem([mass], [[2 * ratio * mass * natural]], [[2.0]])
        run = history(system, wd.HarmonicForce([2.0], 2 * np.pi / 5, 12.0), 1e-3)
        values += [*at(run, "displacement", truth.SLOW_TIMES)]
    time, u = curve(run)
    return Outcome(values, {"displacement, damping ratio 0.05": (time[::2], u[::2])})


def linear_base_motion() -> Outcome:
    """Sampled base acceleration, by rk4 at 5 ms and by the method `exact` at 50 ms."""
    w, ratio = 2 * np.pi, 0.05
    base = np.interp(np.arange(41) * 0.05, [0, 0.1, 0.25, 0.4, 0.5], [0, 3.0, -2.0, 1.0, 0.0])
    system = wd.LinearSystem([1.0], [[2 * ratio * w]], [[w**2]])
    fine = history(system, wd.GroundMotion(base, 0.05), 0.0025)
    exact = history(system, wd.GroundMotion(base, 0.05), 0.05, "exact")
    values = [at(run, "displacement", truth.BASE_TIMES) for run in (fine, exact)]
    return Outcome(np.concatenate(values), {"displacement": curve(fine)})


OSCILLATOR = ("oscillator", {"damper": True, "load": "p(t)"})
PROBLEMS = (
    Problem(
        "V01",
        "SDOF system at critical damping under a sine force",
        GROUP,
        CLOSED,
        "Code_Aster test SDLD321 (repository ehmoussi/code_aster, astest/sdld321a.comm, 2020-11-09).",
        "A damped oscillator starts from rest under a sine force at its natural frequency. The damping is critical, so "
        "that the transient does not oscillate.",
        (
            ("mass m", "10", "kg"),
            ("stiffness k", "25000", "N/m"),
            ("damping c", "1000 (critical)", "N s/m"),
            ("force", "5 sin(50 t)", "N"),
            ("method and step", "rk4, 1 ms", ""),
        ),
        [
            *series(
                "u({} s)",
                truth.TIMES_U,
                "m",
                [0.000118914, -9.42819e-05, 9.97958e-05, -9.97748e-05, 9.78457e-05, -9.88705e-05, 9.99961e-05],
            ),
            *series(
                "v({} s)",
                truth.TIMES_V,
                "m/s",
                [0.003314, -0.0051376, 0.00493337, -0.00500087, 0.00495298, -0.00487813, 0.00498415, -0.00499041],
            ),
        ],
        OSCILLATOR,
        truth.critical_damping,
        critical_damping,
        1e-6,
        RK4,
        axes={"displacement": TIME_AND_U},
        marks={"displacement": (truth.TIMES_U, 0)},
    ),
    Problem(
        "V02",
        "Response spectrum of El Centro 1940",
        GROUP,
        PUBLISHED,
        "Chopra, Dynamics of Structures, figures 6.4.1 and 6.6.2; deformations as in OpenSees, "
        "EXAMPLES/verification/sdofTransient.tcl.",
        "Peak displacement D, pseudo-velocity V = 2πD/T and pseudo-acceleration A = (2π/T)² D of linear oscillators. "
        "`response_spectra` returns the peak in continuous time; the last rows are the peaks at the samples of the "
        "record, "
        "by the method `exact`.",
        (
            ("ground motion", "El Centro 1940 NS as in Chopra's book, 1560 samples at 0.02 s", ""),
            ("acceleration of gravity", "386.4", "in/s²"),
            ("periods", "0.5, 1, 2", "s"),
            ("damping ratios", "0, 0.02, 0.05", ""),
        ),
        [
            *[
                Row(f"D(T = {t:g} s, ζ = {z:g}), between samples", "in", p)
                for (t, z), p in zip(truth.SPECTRUM, (2.67, 5.97, 7.47, 9.91, 5.37), strict=True)
            ],
            *[
                Row(f"V(T = {t:g} s, ζ = 0.02)", "in/s", p)
                for (t, _), p in zip(truth.SPECTRUM[:3], (33.7, 37.5, 23.5), strict=True)
            ],
            *[
                Row(f"A(T = {t:g} s, ζ = 0.02)", "g", p)
                for (t, _), p in zip(truth.SPECTRUM[:3], (1.09, 0.61, 0.191), strict=True)
            ],
            *[
                Row(f"D(T = {t:g} s, ζ = {z:g}), at samples", "in", p)
                for (t, z), p in zip(truth.SPECTRUM, (2.67, 5.97, 7.47, 9.91, 5.37), strict=True)
            ],
        ],
        ("oscillator", {"damper": True, "load": "a_g(t)"}),
        truth.el_centro_spectrum,
        el_centro_spectrum,
        1e-7,
        "Both solutions are exact between the samples; the independent peak is the top of a parabola through points "
        "0.5 ms apart.",
        scale="value",
        notes="The printed values agree with peaks at the samples. The peak between samples is up to 0.5 % larger "
        "(T = 0.5 s). The printed 2.67 in for T = 0.5 s is 0.2 % below the recomputed 2.676 in at the samples.",
    ),
    Problem(
        "V03",
        "Ramp force with finite rise time",
        GROUP,
        CLOSED,
        "Model of SAP2000 verification example 6-001; theory: Chopra, Dynamics of Structures, section 4.5. The "
        "numbers of "
        "the manual could not be read.",
        "An undamped oscillator under a force that rises linearly to p₀ in the time t_r and is constant afterwards. "
        "With "
        "t_r = T no vibration remains after the ramp.",
        (
            ("mass m", "1", "kip s²/in"),
            ("stiffness k", "4 (period π s)", "kip/in"),
            ("rise time t_r", "T and T/2", "s"),
            ("method and step", "rk4, π/1000", "s"),
        ),
        [
            Row("u(0.75π s) k/p₀, t_r = T", "1"),
            Row("u(1.5π s) k/p₀, t_r = T", "1"),
            Row("largest u k/p₀, t_r = T", "1"),
            Row("u(0.375π s) k/p₀, t_r = T/2", "1"),
            Row("u(0.75π s) k/p₀, t_r = T/2", "1"),
            Row("largest u k/p₀, t_r = T/2", "1"),
        ],
        ("oscillator", {"damper": False, "load": "p(t)"}),
        truth.ramp_force,
        ramp_force,
        1e-7,
        RK4,
        axes={
            "rise time T": ("time [s]", "displacement over p₀/k"),
            "rise time T/2": ("time [s]", "displacement over p₀/k"),
        },
    ),
    Problem(
        "V04",
        "Spring with a dashpot and with a Maxwell damper at resonance",
        GROUP,
        CLOSED,
        "Model of SAP2000 verification example 6-005; theory: Chopra, Dynamics of Structures, section 3.2. The "
        "numbers of "
        "the manual could not be read.",
        "The oscillator starts from rest under a sine force at its natural frequency. The amplitude approaches p₀/(c "
        "ω) = 1 "
        "in. The second run has a Maxwell damper: the dashpot in series with a stiff spring.",
        (
            ("mass m", "1", "kip s²/in"),
            ("stiffness k", "100", "kip/in"),
            ("dashpot c", "1 (5 % of critical)", "kip s/in"),
            ("spring of the Maxwell damper", "10000", "kip/in"),
            ("force", "10 sin(10 t)", "kip"),
            ("method and step", "rk4, π/1000 s (dashpot), π/20000 s (Maxwell damper)", ""),
        ),
        [Row(f"u({t}π s), {kind}", "in") for kind in ("dashpot", "Maxwell damper") for t in ("0.05", "0.5", "2", "20")],
        ("device", {"kind": "maxwell"}),
        truth.resonance,
        resonance,
        1e-6,
        "The dashpot relaxes its spring in 0.1 ms, so that the step of the Maxwell damper is 0.16 ms; at this step the "
        "error of rk4 is below 1e-6.",
        axes={"displacement": ("time [s]", "displacement [in]")},
    ),
    Problem(
        "V05",
        "SDOF system under a slow sine force, undamped and damped",
        GROUP,
        CLOSED,
        "Chopra, Dynamics of Structures, sections 3.1 and 3.2; model as in OpenSees, "
        "EXAMPLES/verification/sdofTransient.tcl, which prints no fixed number.",
        "The force has a period of 5 s, the oscillator one of 0.8 s. The response is the steady state plus free "
        "vibration.",
        (
            ("stiffness k", "2", "consistent units"),
            ("period", "0.8", "s"),
            ("force", "2 sin(2πt/5)", "consistent units"),
            ("damping ratio", "0 and 0.05", ""),
            ("method and step", "rk4, 1 ms", ""),
        ),
        [Row(f"u({t:g} s), ζ = {z}", "m") for z in ("0", "0.05") for t in truth.SLOW_TIMES],
        OSCILLATOR,
        truth.slow_sine,
        slow_sine,
        1e-8,
        RK4,
        axes={"displacement, damping ratio 0.05": TIME_AND_U},
        notes="In the public script the first term of the coefficient B of the damped case is -2 ζ ω/ω_n. It must be "
        "2 ζ² ω (same factor outside). The tolerance of the script, 0.01, hides the error.",
    ),
    Problem(
        "V06",
        "SDOF system under a piecewise linear base acceleration",
        GROUP,
        SCIPY,
        "Matrix exponentials of the straight pieces (scipy.linalg.expm).",
        "The base acceleration is linear through five points and zero after the last one. rk4 and the method `exact` "
        "are "
        "compared with the exact solution, during and after the motion.",
        (
            ("circular frequency ω", "2π", "rad/s"),
            ("damping ratio", "0.05", ""),
            ("base acceleration", "(0, 0), (0.1, 3), (0.25, -2), (0.4, 1), (0.5, 0)", "s, m/s²"),
            ("method and step", "rk4 at 2.5 ms, exact at 50 ms", ""),
        ),
        [Row(f"u({t:g} s), {method}", "m") for method in ("rk4", "exact") for t in truth.BASE_TIMES],
        ("oscillator", {"damper": True, "load": "a_g(t)"}),
        truth.linear_base_motion,
        linear_base_motion,
        1e-8,
        "The error of rk4 at 2.5 ms is about (ωh)⁴/120 = 5e-10 per radian, and the motion lasts 13 radians; the method "
        "`exact` has rounding errors only.",
        axes={"displacement": TIME_AND_U},
    ),
)
