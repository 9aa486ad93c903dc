"""Problems on yielding storeys: elastoplastic and Bouc-Wen oscillators, P-Delta."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import warpdyn as wd

from . import yielding_truth as truth
from .el_centro import STEP, el_centro
from .methods_truth import CHOPRA, TENTHS, chopra_force
from .problem import CLOSED, PUBLISHED, SCIPY, STORED, Outcome, Problem, Row, series
from .runs import AS_GIVEN, at, curve, history, loop, storey
from .solvers import peak

GROUP = "Yielding storeys and P-Delta"
PLASTIC = "elastic_perfectly_plastic"
TIME_AND_U = ("time [s]", "displacement [m]")


def newmark_elastoplastic() -> Outcome:
    """Method `newmark_average` at 0.1 s."""
    p = CHOPRA
    building = storey(
        p["mass"], p["stiffness"], law=PLASTIC, yield_force=7.5, damping="storey", damping_coefficient=p["damping"]
    )
    run = history(building, wd.ForceHistory(chopra_force()[:, None], 0.1), 0.1, "newmark_average")
    values = [at(run, name, TENTHS) for name in ("displacement", "velocity", "acceleration")]
    time, u = curve(run)
    return Outcome(np.concatenate(values), {"displacement": (time[:11], u[:11])})


def step_and_free() -> Outcome:
    """Constant force and free vibration, rk4 at 0.02 ms."""
    step = 2e-5
    plastic = storey(1.0, 100.0, law="bilinear", yield_force=1.0, hardening_ratio=0.0)
    bilinear = storey(1.0, 100.0, law="bilinear", yield_force=1.0, hardening_ratio=0.1)
    pushed = history(plastic, wd.HarmonicForce([0.75], 0.0, 1.0, phase=np.pi / 2), step)
    free = [
        history(each, wd.FreeVibration(0.4, velocity=0.3), step, recorders=("energy",)) for each in (plastic, bilinear)
    ]
    time, u = curve(pushed)
    tops = [peak(run["displacement"].values[0, :, 0]) for run in free]
    dissipated = [float(run["hysteretic_energy"].values.sum()) for run in free]
    values = [*at(pushed, "displacement", truth.EPP_TIMES), peak(u), *tops, *dissipated]
    return Outcome(values, {"displacement under the step force": (time[::250], u[::250])})


def el_centro_strengths() -> Outcome:
    """rk4 at 0.5 ms, and a linear run for the elastic peak."""
    w = 2 * np.pi / 0.5
    k, dashpot = w**2, {"damping": "storey", "damping_coefficient": 2 * 0.05 * w}
    motion = wd.GroundMotion(9.81 * el_centro(), STEP)
    values, curves = [], {}
    for share in (None, *truth.STRENGTHS):
        strength = 1e9 if share is None else share * k * truth.ELASTIC_PEAK * truth.INCH
        building = storey(1.0, k, law="bilinear", yield_force=strength, hardening_ratio=0.0, **dashpot)
        run = history(building, motion, 5e-4)
        time, u = run["time"].values, run["displacement"].values[0, :, 0] / truth.INCH
        permanent = np.abs(u - run["storey_force"].values[0, :, 0] / k / truth.INCH)[-1]
        values += [peak(u)] if share is None else [peak(u), peak(u) / (share * truth.ELASTIC_PEAK), permanent]
        if share == 0.25:
            curves["displacement, f = 0.25"] = (time[:30001:10], u[:30001:10])
    return Outcome(values, curves)


def bouc_wen_curves() -> Outcome:
    """Quasi-static paths in steps of 0.001 yield displacements."""
    values = []
    for n in truth.EXPONENTS:
        law = wd.laws.BoucWen(yield_force=1.0, hardening_ratio=0.0, exponent=n)
        values.append(loop(storey(1.0, 1.0, law=law), np.arange(1001) / 1000)[-1])
    turns = np.array([0.0, *truth.TURNS])
    path = np.concatenate([[0.0], *(np.linspace(a, b, 4001)[1:] for a, b in pairwise(turns))])
    z = loop(storey(1.0, 1.0, law=wd.laws.BoucWen(yield_force=1.0, hardening_ratio=0.0, exponent=2)), path)
    work = np.concatenate([[0.0], np.cumsum((z[1:] + z[:-1]) / 2 * np.diff(path))])
    ends = 4000 * np.arange(1, 5)
    return Outcome([*values, *z[ends], *work[ends]], {"loop": (path[::100], z[::100])})


def bouc_wen_free() -> Outcome:
    """rk4 at 0.5 ms; turning points by parabolas."""
    law = wd.laws.BoucWen(yield_force=1.0, hardening_ratio=0.0, exponent=2)
    run = history(storey(1.0, 100.0, law=law), wd.FreeVibration(6.0, velocity=0.3), 5e-4)
    time, u = curve(run)
    v = run["velocity"].values[0, :, 0]
    turns = np.flatnonzero(v[1:-1] * v[2:] < 0)[:6] + 1
    values = [signed_top(time[i - 2 : i + 4], u[i - 2 : i + 4]) for i in turns]
    return Outcome(values, {"displacement": (time[::20], u[::20])})


def signed_top(time: np.ndarray, u: np.ndarray) -> float:
    """Return a turning point inside a few steps, by a parabola; displacements may turn towards zero."""
    a, b, c = np.polyfit(time - time[2], u, 2)
    return float(c - b**2 / (4 * a))


def p_delta() -> Outcome:
    """Pushover of a storey with a gravity load, and its period."""
    found = []
    for load in truth.AISC_LOADS:
        with AS_GIVEN:
            column = wd.ShearBuilding(1.0, truth.COLUMN["stiffness"], truth.COLUMN["length"], gravity_load=load)
            pushed = wd.pushover(column, [0.0, 1.0])
        found.append((1 / float(pushed["base_shear"][-1]), column.fundamental_period))
    return Outcome(np.array(found).T.ravel())


U_H1 = [0.0437, 0.2326, 0.6121, 1.1143, 1.6214, 1.9891, 2.0951, 1.924, 1.5602, 1.415]
V_H1 = [0.8733, 2.9057, 4.6833, 5.3624, 4.7792, 2.5742, -0.4534, -2.96, -4.3075, -4.0668]
A_H1 = [17.4666, 23.1801, 12.3719, 1.2103, -12.8735, -31.227, -29.3242, -20.9876, -5.783, 10.5962]
PROBLEMS = (
    Problem(
        "V28",
        "Newmark's method for an elastoplastic oscillator",
        GROUP,
        PUBLISHED,
        "Chopra, Dynamics of Structures, 4th ed. 2012, examples 5.5 (Newton) and 5.6 (modified Newton); printed "
        "values as "
        "in OpenSees, EXAMPLES/verification/NewmarkIntegrator.tcl.",
        "System and load of problem V07 with an elastic-perfectly-plastic spring; average acceleration with a coarse "
        "step "
        "and Newton iterations.",
        (
            ("mass m", "0.2533", "kip s²/in"),
            ("stiffness k", "10", "kip/in"),
            ("yield force", "7.5", "kip"),
            ("damping ratio", "0.05", ""),
            ("force", "10 sin(πt/0.6) up to 0.6 s, then 0", "kip"),
            ("step", "0.1", "s"),
        ),
        [
            *series("u({} s)", TENTHS, "in", U_H1),
            *series("v({} s)", TENTHS, "in/s", V_H1),
            *series("a({} s)", TENTHS, "in/s²", A_H1),
        ],
        ("oscillator", {"damper": True, "load": "p(t)", "law": "plastic"}),
        truth.newmark_elastoplastic,
        newmark_elastoplastic,
        1e-9,
        "The same formulas; the iterations end at 1e-13 of the load and at the tolerance of warpdyn.",
        axes={"displacement": ("time [s]", "displacement [in]")},
        marks={"displacement": (TENTHS, 0)},
        notes="u(1.0 s) is printed as 1.415 (Newton) and 1.414 (modified Newton): a digit is lost, correct is 1.1416. "
        "v(0.8 s) is printed as -2.960, correct is -2.9688. Neither number is tested by the script.",
    ),
    Problem(
        "V29",
        "Elastoplastic oscillator: step force and free vibration",
        GROUP,
        CLOSED,
        "Closed forms: harmonic and parabolic pieces; energies of the spring.",
        "A step force of 0.75 times the yield force causes the ductility ½/(1 - 0.75) = 2. Free vibration from 0.3 "
        "m/s ends "
        "where the spring has absorbed the kinetic energy, without hardening and with a hardening ratio of 0.1.",
        (
            ("mass m", "1", "kg"),
            ("stiffness k", "100", "N/m"),
            ("yield force", "1", "N"),
            ("method and step", "rk4, 0.02 ms", ""),
        ),
        [
            *series("u({} s), step force", truth.EPP_TIMES, "m"),
            Row("peak, step force", "m"),
            Row("peak, free vibration, no hardening", "m"),
            Row("peak, free vibration, hardening ratio 0.1", "m"),
            Row("dissipated energy, no hardening", "J"),
            Row("dissipated energy, hardening ratio 0.1", "J"),
        ],
        ("oscillator", {"damper": False, "load": "p(t)", "law": "plastic"}),
        truth.step_and_free,
        step_and_free,
        1e-6,
        "rk4 passes a corner of the spring within a step, with an error of about (ωh)² = 4e-8 per corner.",
        axes={"displacement under the step force": TIME_AND_U},
    ),
    Problem(
        "V30",
        "Elastoplastic oscillator under El Centro",
        GROUP,
        STORED,
        "Chopra, Dynamics of Structures, section 7.4.1, figures 7.4.2 and 7.4.3. Independent: exact between samples, "
        "yield "
        "and unloading by bisection; OpenSees 3.7.1 at 2 ms gives ductilities of 1.44636, 3.10826 and 7.35088.",
        "Three normalised yield strengths f = f_y/(k u₀), u₀ the elastic peak.",
        (
            ("period and damping ratio", "0.5 s, 0.05", ""),
            ("strengths f", "0.5, 0.25, 0.125", ""),
            ("ground motion", "El Centro 1940 NS as in Chopra's book, g = 9.81 m/s²", ""),
            ("method and step", "rk4, 0.5 ms", ""),
        ),
        [
            Row("u₀", "in", 2.25),
            *[
                Row(name.format(share), unit, printed)
                for share, um, ductility in zip(truth.STRENGTHS, (1.62, 1.75, 2.07), (1.44, 3.11, 7.36), strict=True)
                for name, unit, printed in (
                    ("peak, f = {}", "in", um),
                    ("ductility, f = {}", "1", ductility),
                    ("permanent displacement, f = {}", "in", None),
                )
            ],
        ],
        ("oscillator", {"damper": True, "load": "a_g(t)", "law": "plastic"}),
        truth.el_centro_strengths,
        el_centro_strengths,
        2e-5,
        "rk4 at 0.5 ms passes each corner of the spring with an error of about (ωh)² = 4e-5 of a step's motion.",
        axes={"displacement, f = 0.25": ("time [s]", "displacement [in]")},
        notes="The curve of the independent result is from OpenSees.",
    ),
    Problem(
        "V31",
        "Bouc-Wen storey: monotonic loading and cycles",
        GROUP,
        CLOSED,
        "Monotonic loading: x = ∫ dz/(1 - zⁿ), so z = 1 - exp(-x) for n = 1 and tanh x for n = 2. Cycles: SciPy's "
        "DOP853.",
        "The hysteretic variable z against the drift x over the yield drift, beta = gamma = ½, without hardening.",
        (("exponents n", "1, 2, 3, 5, 10", ""), ("cycles (n = 2)", "0, 2, -2, 2, -2", "yield drifts")),
        [
            *series("z(1), n = {}", truth.EXPONENTS, "1"),
            *series("z at turning point {}, n = 2", range(1, 5), "1"),
            *series("∫z dx to turning point {}, n = 2", range(1, 5), "yield drifts"),
        ],
        ("law", {"shape": "smooth"}),
        truth.bouc_wen_curves,
        bouc_wen_curves,
        2e-7,
        "Quasi-static steps of 0.001 yield drifts; the work by the trapezoidal rule has an error of about 1e-7.",
        axes={"loop": ("drift over yield drift", "z")},
    ),
    Problem(
        "V32",
        "Bouc-Wen oscillator in free vibration",
        GROUP,
        SCIPY,
        "SciPy's DOP853 with an event at each turning point, relative tolerance 1e-11.",
        "The spring absorbs most of the energy in the first half cycle, and the oscillator keeps a permanent "
        "displacement.",
        (
            ("mass m", "1", "kg"),
            ("stiffness k", "100", "N/m"),
            ("yield force", "1", "N"),
            ("β, gamma, n, hardening ratio", "0.5, 0.5, 2, 0", ""),
            ("initial velocity", "0.3", "m/s"),
            ("method and step", "rk4, 0.5 ms", ""),
        ),
        series("turning point {}", range(1, 7), "m"),
        ("oscillator", {"damper": False, "load": "", "law": "smooth"}),
        truth.bouc_wen_free,
        bouc_wen_free,
        1e-6,
        "The rate of z has a corner where the velocity changes its sign: rk4 at 0.5 ms passes it with an error of "
        "about "
        "1e-7.",
        axes={"displacement": TIME_AND_U},
    ),
    Problem(
        "V33",
        "P-Delta: deflection and period of a cantilever storey",
        GROUP,
        CLOSED,
        "u = H/(k - P/L), T = 2π√(m/(k - P/L)). The column is case 2 of the AISC 360-16 commentary C2.1 (W14x48, 28 "
        "ft), "
        "without the second-order effect of the curvature of the column (P-δ).",
        "A storey with a gravity load. `pushover` gives the lateral load at a displacement of 1 in.",
        (
            ("stiffness 3EI/L³", "1.11006", "kip/in"),
            ("length L", "336", "in"),
            ("gravity load P", "100, 150, 200", "kip"),
            ("horizontal load H", "1", "kip"),
            ("mass", "1", "kip s²/in"),
        ),
        [
            *series("deflection, P = {} kip", truth.AISC_LOADS, "in"),
            *series("period, P = {} kip", truth.AISC_LOADS, "s"),
        ],
        ("p_delta", {}),
        truth.p_delta,
        p_delta,
        1e-10,
        "Rounding.",
        scale="value",
        notes="AISC prints 1.33, 1.75 and 2.56 in, which include P-δ. A shear building has P-Delta only: 1.231, "
        "1.507 and "
        "1.942 in.",
    ),
)
