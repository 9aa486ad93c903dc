"""Problems on integration methods: Newmark's, Wilson's, central differences, stability limits, period errors."""

from __future__ import annotations

import numpy as np

import warpdyn as wd
from warpdyn.engine.methods.stability_limits import stability_limit
from warpdyn.engine.methods.table import METHODS

from . import methods_truth as truth
from .problem import CLOSED, PUBLISHED, SCIPY, Outcome, Problem, Row, series
from .runs import at, curve, history

GROUP = "Integration methods"
ROUNDING = "Both programs use the same formulas; the difference is rounding."
NAMES = {"newmark_average": "average acceleration", "newmark_linear": "linear acceleration"}


def newmark_examples() -> Outcome:
    """Sampled force at 0.1 s, methods `newmark_average` and `newmark_linear` at the same step."""
    p, values, curves = truth.CHOPRA, [], {}
    system = wd.LinearSystem([p["mass"]], [[p["damping"]]], [[p["stiffness"]]])
    load = wd.ForceHistory(truth.chopra_force()[:, None], 0.1)
    for method, name in NAMES.items():
        run = history(system, load, 0.1, method)
        values += [*(at(run, each, truth.TENTHS) for each in ("displacement", "velocity", "acceleration"))]
        time, v = curve(run, "velocity")
        curves[name] = (time[:11], v[:11])
    return Outcome(np.concatenate(values), curves)


def near_resonance() -> Outcome:
    """Harmonic force, method `newmark_average` at 0.01 s."""
    w = 6 * np.pi
    run = history(
        wd.LinearSystem([1.0], [[0.0]], [[w**2]]), wd.HarmonicForce([1.0], 1.1 * w, 1.0), 0.01, "newmark_average"
    )
    values = [at(run, each, truth.NEAR_TIMES) for each in ("displacement", "acceleration")]
    return Outcome(np.concatenate(values), {"displacement": curve(run)})


def period_elongation() -> Outcome:
    """Angle of a step from three displacements of free vibration: cos = (u0 + u2) / (2 u1)."""
    values = []
    for method in ("newmark_average", "newmark_linear", "central_difference"):
        for share in truth.ELONGATION_STEPS:
            w = 2 * np.pi
            system = wd.LinearSystem([1.0], [[0.0]], [[w**2]])
            run = history(system, wd.FreeVibration(4 * share, displacement=1.0), share, method)
            u = run["displacement"].values[0, :, 0]
            values.append(w * share / np.arccos((u[1] + u[3]) / (2 * u[2])) - 1)
    return Outcome(values)


def stability_limits() -> Outcome:
    """The limits with which warpdyn chooses and checks steps."""
    newmark = [stability_limit(METHODS[name], 0.0) / (2 * np.pi) for name in ("central_difference", "newmark_linear")]
    others = [stability_limit(METHODS[name], ratio) for name in truth.POLYNOMIALS for ratio in truth.DAMPED]
    return Outcome([*newmark, *others])


def bathe_two_dofs() -> Outcome:
    """Matrix system under a constant force, four methods at 0.28 s."""
    values, curves = [], {}
    system = wd.LinearSystem(truth.BATHE_MASS, np.zeros((2, 2)), truth.BATHE_STIFFNESS)
    load = wd.HarmonicForce([0.0, 10.0], 0.0, truth.BATHE_STEP * truth.BATHE_STEPS, phase=np.pi / 2)
    for method in ("central_difference", "wilson_theta", "newmark_average", "exact"):
        run = history(system, load, truth.BATHE_STEP, method)
        values.append(run["displacement"].values[0, 1:].T.ravel())
        curves[method] = curve(run)
    names = {"central difference": "central_difference", "Newmark": "newmark_average", "exact": "exact"}
    return Outcome(np.concatenate(values), {name: curves[method] for name, method in names.items()})


def newmark_two_modes() -> Outcome:
    """Two modal equations by `newmark_linear`, and the storeys by `newmark_average` and `exact`, at 0.1 s."""
    motion = wd.GroundMotion(truth.sine_force(), 0.1)
    building = wd.ShearBuilding(
        np.full(5, truth.SINE_MASS), truth.SINE_STIFFNESS, 3.0, damping="modal", damping_ratio=0.05
    )
    modes = building.modal()
    w = modes["circular_frequency"].values[:2]
    system = wd.LinearSystem(np.eye(2), np.diag(0.1 * w), np.diag(w**2), influence=[1.0, 1.0])
    run = history(system, motion, 0.1, "newmark_linear")
    roof = (modes["participation_factor"] * modes["shape"].isel(dof=4)).values[:2]
    u = run["displacement"].values[0] @ roof
    average = history(building, motion, 0.1, "newmark_average")
    mass, stiffness = np.full(5, truth.SINE_MASS), building_stiffness()
    dense = wd.LinearSystem(mass, damping_of(mass, stiffness), stiffness)
    exact = history(dense, motion, 0.1, "exact")
    roofs = [curve(each, dof=4)[1] for each in (average, exact)]
    time = run["time"].values[:21]
    curves = {"two modes": (time, u[:21]), "all modes, exact": (time, roofs[1][:21])}
    return Outcome([u[20], roofs[0][20], roofs[1][20]], curves)


def building_stiffness() -> np.ndarray:
    """Return the stiffness matrix of the five storeys."""
    from warpdyn.model.structures.modal import chain_stiffness_matrix

    return chain_stiffness_matrix(np.full(5, truth.SINE_STIFFNESS))


def damping_of(mass: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return warpdyn's matrix of modal damping, 5 % in each mode."""
    from warpdyn.model.structures.modal import modal_damping_matrix

    return modal_damping_matrix(mass, stiffness, 0.05)


V_AVERAGE = [0.8733, 2.9057, 4.6833, 4.426, 2.2421, -2.3996, -6.8192, -8.6092, -7.2932, -3.5026]
A_AVERAGE = [17.4666, 23.1801, 12.3719, -11.5175, -38.1611, -54.6722, -33.6997, -2.1211, 28.4423, 47.3701]
V_LINEAR = [0.8995, 2.9819, 4.7716, 4.7419, 2.1802, -2.6911, -7.1468, -8.7758, -7.1539, -3.0508]
A_LINEAR = [17.9904, 23.6566, 12.1372, -12.7305, -39.9425, -56.0447, -33.0689, 0.4892, 31.9491, 50.1114]
U_AVERAGE = [0.0437, 0.2326, 0.6121, 1.0825, 1.4309, 1.4231, 0.9622, 0.1908, -0.6044, -1.1442]
U_LINEAR = [0.0300, 0.2193, 0.6166, 1.1130, 1.4782, 1.4625, 0.9514, 0.1273, -0.6954, -1.2208]
BATHE_PRINTED = [  # rows: u1 and u2 of central difference, Wilson 1.4, Newmark 1/4, exact
    [0, 0.0307, 0.168, 0.487, 1.02, 1.7, 2.4, 2.91, 3.07, 2.77, 2.04, 1.02],
    [0.392, 1.45, 2.83, 4.14, 5.02, 5.26, 4.9, 4.17, 3.37, 2.78, 2.54, 2.6],
    [0.00605, 0.0525, 0.196, 0.49, 0.952, 1.54, 2.16, 2.67, 2.92, 2.82, 2.33, 1.54],
    [0.366, 1.34, 2.64, 3.92, 4.88, 5.31, 5.18, 4.61, 3.82, 3.06, 2.52, 2.29],
    [0.00673, 0.0505, 0.189, 0.485, 0.961, 1.58, 2.23, 2.76, 3, 2.85, 2.28, 1.4],
    [0.364, 1.35, 2.68, 4, 4.95, 5.34, 5.13, 4.48, 3.64, 2.9, 2.44, 2.31],
    [0.003, 0.038, 0.176, 0.486, 0.996, 1.66, 2.338, 2.861, 3.052, 2.806, 2.131, 1.157],
    [0.382, 1.41, 2.78, 4.09, 5, 5.29, 4.986, 4.277, 3.457, 2.806, 2.484, 2.489],
]
BATHE_ROWS = [
    Row(f"u{dof}({n}h), {method}", "m", BATHE_PRINTED[2 * i + dof - 1][n - 1])
    for i, method in enumerate(("central difference", "Wilson", "Newmark", "exact"))
    for dof in (1, 2)
    for n in range(1, 13)
]
TIME_AND_U = ("time [s]", "displacement [m]")

PROBLEMS = (
    Problem(
        "V07",
        "Newmark's method: displacements, velocities and accelerations",
        GROUP,
        PUBLISHED,
        "Chopra, Dynamics of Structures, 4th ed. 2012, examples 5.3 (average acceleration) and 5.4 (linear "
        "acceleration); "
        "printed velocities and accelerations as in OpenSees, EXAMPLES/verification/NewmarkIntegrator.tcl.",
        "A damped oscillator under a half sine force, integrated with a coarse step, so that every digit depends on "
        "the "
        "formulas of the method.",
        (
            ("mass m", "0.2533", "kip s²/in"),
            ("stiffness k", "10", "kip/in"),
            ("damping ratio", "0.05", ""),
            ("force", "10 sin(πt/0.6) up to 0.6 s, then 0", "kip"),
            ("step", "0.1", "s"),
        ),
        [
            row
            for name, u, v, a in (
                ("average", U_AVERAGE, V_AVERAGE, A_AVERAGE),
                ("linear", U_LINEAR, V_LINEAR, A_LINEAR),
            )
            for symbol, unit, printed in (("u", "in", u), ("v", "in/s", v), ("a", "in/s²", a))
            for row in series(f"{name}: {symbol}({{}} s)", truth.TENTHS, unit, printed)
        ],
        ("oscillator", {"damper": True, "load": "p(t)"}),
        truth.newmark_examples,
        newmark_examples,
        1e-10,
        ROUNDING,
        axes={name: ("time [s]", "velocity [in/s]") for name in NAMES.values()},
        marks={"average acceleration": (truth.TENTHS, 10), "linear acceleration": (truth.TENTHS, 40)},
        notes="Two printed velocities are wrong: v(0.4 s) by average acceleration is printed as 4.4260 (correct: "
        "4.7261), "
        "and v(0.5 s) by linear acceleration as 2.1802 (correct: 2.1083). Both contradict the printed accelerations, "
        "because v(n+1) = v(n) + 0.05 (a(n) + a(n+1)). The script prints the velocities but does not test them.",
    ),
    Problem(
        "V08",
        "Average acceleration near resonance",
        GROUP,
        PUBLISHED,
        "Code_Aster test SDLD31 (repository ehmoussi/code_aster, astest/sdld31a.comm, 2020-11-09); 16 digits of an "
        "external program.",
        "An undamped oscillator under a sine force at 1.1 times its frequency. The step of 0.01 s has a visible period "
        "error: the exact displacements are 0.010842667, -0.003795694 and -0.012746319 m.",
        (
            ("mass m", "1", "kg"),
            ("stiffness k", "(6π)²", "N/m"),
            ("force", "sin(1.1 · 6π t)", "N"),
            ("method and step", "newmark_average, 0.01 s", ""),
        ),
        [
            *series("u({} s)", truth.NEAR_TIMES, "m", [0.01080450021, -0.00406717795, -0.01302618984]),
            *series("a({} s)", truth.NEAR_TIMES, "m/s²", [-4.647918136, 2.374868232, 5.579336777]),
        ],
        ("oscillator", {"damper": False, "load": "p(t)"}),
        truth.near_resonance,
        near_resonance,
        1e-10,
        ROUNDING,
        axes={"displacement": TIME_AND_U},
        marks={"displacement": (truth.NEAR_TIMES, 0)},
    ),
    Problem(
        "V09",
        "Period elongation of Newmark's methods",
        GROUP,
        CLOSED,
        "Closed form for gamma = 1/2: cos(angle of a step) = 1 - ½x²/(1 + βx²), x = ωh.",
        "Free vibration of an undamped oscillator. The angle of a step follows from three displacements of the run.",
        (
            ("methods", "newmark_average (β = 1/4), newmark_linear (β = 1/6), central_difference (β = 0)", ""),
            ("step over period", "0.05, 0.1, 0.2", ""),
        ),
        [
            Row(f"elongation, {method}, h/T = {share:g}", "1")
            for method in ("newmark_average", "newmark_linear", "central_difference")
            for share in truth.ELONGATION_STEPS
        ],
        ("oscillator", {"damper": False, "load": ""}),
        truth.period_elongation,
        period_elongation,
        1e-9,
        "The formulas are the same; rounding grows because the period follows from an inverse cosine.",
        scale="value",
    ),
    Problem(
        "V10",
        "Stability limits of explicit and Newmark methods",
        GROUP,
        PUBLISHED,
        "Newmark 1959, ASCE EM3, h/T = 0.318 and 0.551 for β = 0 and 1/6; Runge-Kutta methods: first root of |R(q)| "
        "= 1.",
        "warpdyn chooses and checks steps with these limits. The manual compares them with closed forms and with "
        "roots of "
        "the stability functions that are found without warpdyn.",
        (
            ("damping ratios", "0, 0.05, 0.2", ""),
            ("methods", "central_difference, newmark_linear, heun, kutta3, rk4, dormand_prince5", ""),
        ),
        [
            Row("h/T, central_difference", "1", 0.318),
            Row("h/T, newmark_linear", "1", 0.551),
            *[Row(f"ωh, {name}, ζ = {ratio:g}", "ωh") for name in truth.POLYNOMIALS for ratio in truth.DAMPED],
        ],
        ("oscillator", {"damper": True, "load": ""}),
        truth.stability_limits,
        stability_limits,
        1e-8,
        "warpdyn finds the limit by bisection. heun has no stable step without damping: both values are 0.",
        notes="Newmark's paper also gives 0.389 for β = 1/12, which is truncated, not rounded (0.38985).",
    ),
    Problem(
        "V11",
        "Two degrees of freedom under a step force: four integration methods",
        GROUP,
        PUBLISHED,
        "Bathe, Finite Element Procedures, 2nd ed. 2014, examples 9.1 (central difference), 9.3 (Newmark) and 9.7 "
        "(exact), "
        "as cited in ONSAS/StructuralDynamicsODESolvers.jl, test/solvers.jl; Wilson's method: 1st ed. 1996, example "
        "9.3.",
        "An undamped system from rest under a constant force. The step is a tenth of the second period.",
        (
            ("mass matrix", "diag(2, 1)", "kg"),
            ("stiffness matrix", "[[6, -2], [-2, 4]]", "N/m"),
            ("force", "[0, 10] from t = 0", "N"),
            ("step h", "0.28", "s"),
        ),
        BATHE_ROWS,
        ("chain", {"masses": 2, "fixed_top": True, "load": 2}),
        truth.bathe_two_dofs,
        bathe_two_dofs,
        1e-10,
        ROUNDING,
        axes={name: ("time [s]", "displacement u1 [m]") for name in ("central difference", "Newmark", "exact")},
        marks={
            name: (tuple(truth.BATHE_STEP * np.arange(1, 13)), first)
            for name, first in (("central difference", 0), ("Newmark", 48), ("exact", 72))
        },
        notes="Exact u1(h) is printed as 0.003; it is 0.00251. The book's other methods, Houbolt's and Bathe's "
        "composite "
        "method, are not part of warpdyn.",
    ),
    Problem(
        "V12",
        "Five-storey building under a sine acceleration: linear acceleration with two modes",
        GROUP,
        SCIPY,
        "Chopra, Dynamics of Structures, 5th ed., example 16.1; printed value as in the package structdyn 0.8.0, "
        "examples/mdf/eg_newmark_gm.py.",
        "Modal equations with a coarse step. Linear acceleration is stable for two modes and unstable for all five "
        "(0.1 s > 0.551 T₅).",
        (
            ("floors", "5 of 25910", "kg"),
            ("storey stiffness", "1e7", "N/m"),
            ("damping ratio", "0.05 in each mode", ""),
            ("base acceleration", "1.93 sin(2πt) below 1 s, then 0", "m/s²"),
            ("step", "0.1", "s"),
        ),
        [
            Row("u5(2 s), two modes, newmark_linear", "m", 0.0588840125),
            Row("u5(2 s), all modes, newmark_average", "m"),
            Row("u5(2 s), all modes, exact", "m"),
        ],
        ("chain", {"masses": 5, "load": 0}),
        truth.newmark_two_modes,
        newmark_two_modes,
        1e-9,
        ROUNDING,
        axes={name: ("time [s]", "roof displacement [m]") for name in ("two modes", "all modes, exact")},
        notes="The printed value is correct for its method, but the step is coarse: the exact displacement for the "
        "same "
        "samples is 0.0702 m, 19 % larger.",
    ),
)
