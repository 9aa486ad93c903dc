"""Methods as checked data: rows that are wrong are refused, and the rows of the table do what they are called.

Steps are walked here one equation at a time, as textbooks write them; nothing comes from `amplification` but what is
compared with it.
"""

from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from validation import relative_difference

from warpdyn.engine.methods.kinds import ExactMethod, ExplicitMethod, ImplicitMethod, MultistepMethod
from warpdyn.engine.methods.table import METHODS

pytestmark = pytest.mark.fast

EXPLICIT = [name for name, method in METHODS.items() if isinstance(method, ExplicitMethod)]
IMPLICIT = [name for name, method in METHODS.items() if isinstance(method, ImplicitMethod)]
RK4 = {
    "name": "mine",
    "order": 4,
    "a": ((0, 0, 0, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 1, 0)),
    "b": (1 / 6, 1 / 3, 1 / 3, 1 / 6),
    "c": (0, 0.5, 0.5, 1),
}
NYSTROEM = {
    "a_displacement": ((0, 0, 0, 0), (1 / 8, 0, 0, 0), (1 / 8, 0, 0, 0), (0, 0, 1 / 2, 0)),
    "b_displacement": (1 / 6, 1 / 6, 1 / 6, 0),
}
HEUN_THIRD = {"order": 3, "a": ((0, 0, 0), (1 / 3, 0, 0), (0, 2 / 3, 0)), "b": (0.25, 0, 0.75), "c": (0, 1 / 3, 2 / 3)}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            {"b": (1 / 6, 1 / 3, 1 / 3)},
            r"a, b and c must have one row per stage, got shapes \(4, 4\), \(3,\) and \(4,\)",
        ),
        ({"a": ((0, 0, 0), (0.5, 0, 0), (0, 0.5, 0))}, "a, b and c must have one row per stage, got shapes"),
        ({"a": ((0, 0, 0, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 0.5, 0.5))}, "explicit"),
        ({"a": ((0, 0.1, -0.1, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 1, 0))}, "explicit"),
        ({"c": (0, 0.5, 0.6, 1)}, "rows of a must sum to c"),
        ({"b": (1 / 6, 1 / 3, 1 / 3, 1 / 5)}, "b to 1"),
        ({"b": (1 / 6, 1 / 3, 1 / 3, 1 / 6 + 1e-9)}, "b to 1"),  # a slip in the tenth digit
        ({"b": (1 / 6 + 1e-9, 1 / 3 - 1e-9, 1 / 3, 1 / 6)}, "not of order 4"),
        ({"b": (0.25, 0.25, 0.25, 0.25)}, "not of order 4"),
        ({"order": 5}, "order must be from 1 to the number of stages, 4, got 5"),
        ({"order": 0}, "order must be from 1 to the number of stages, 4, got 0"),
        ({"a": ((0, 0, 0, 0), (0.5, 0, 0, 0), (0.5, 0, 0, 0), (0, 0, 1, 0))}, "not of order 4"),
        ({"a_displacement": NYSTROEM["a_displacement"]}, "give a_displacement and b_displacement, or neither"),
        ({"b_displacement": NYSTROEM["b_displacement"]}, "give a_displacement and b_displacement, or neither"),
        (NYSTROEM | {"b_displacement": (0.5, 0, 0)}, "a_displacement and b_displacement must have the 4 stages"),
        (NYSTROEM | {"a_displacement": ((0, 0), (0, 0))}, "a_displacement and b_displacement must have the 4 stages"),
        (NYSTROEM | {"b_displacement": (1 / 3, 1 / 6, 0, 0)}, "not of order 4"),
        (
            NYSTROEM | {"a_displacement": ((0,) * 4, (1 / 4, 0, 0, 0), (1 / 8, 0, 0, 0), (0, 0, 1 / 2, 0))},
            "not of order",
        ),
        (NYSTROEM | {"a_displacement": ((0,) * 4, (0, 1 / 8, 0, 0), (1 / 8, 0, 0, 0), (0, 0, 1 / 2, 0))}, "explicit"),
        ({"error": (0.1, -0.1)}, "error must have one value per stage, 4, got 2"),
        (NYSTROEM | {"error": (0.1, -0.1)}, "error must have one value per stage, 4, got 2"),
        ({"error": (0.1, 0.1, 0, 0)}, "error must sum to 0"),
    ],
)
def test_a_wrong_tableau_is_refused(change, told):
    with pytest.raises(ValueError, match=f"method 'mine': .*{told}"):
        ExplicitMethod(**(RK4 | change))


def test_an_order_that_only_growth_disproves_is_refused():
    with pytest.raises(ValueError, match="'dormand_prince5': it is not of order 6"):
        replace(METHODS["dormand_prince5"], order=6)
    padded = np.pad(RK4["a"], (0, 2))  # RK4 and two stages without weight
    with pytest.raises(ValueError, match="'mine': it is not of order 5"):
        ExplicitMethod("mine", 5, tuple(map(tuple, padded)), (*RK4["b"], 0, 0), (*RK4["c"], 0, 0))


@pytest.mark.parametrize(
    "change",
    [
        {"order": 3},
        {"gamma": 0.6},  # order 1
        {"force_lag": 0.1},  # needs gamma = 0.6 (Hilber, Hughes and Taylor 1977)
        {"mass_lag": 0.1},
        {"extension": 1.4, "gamma": 0.6},
    ],
)
def test_a_wrong_implicit_method_is_refused(change):
    with pytest.raises(ValueError, match=f"method 'mine': it is not of order {change.get('order', 2)}"):
        ImplicitMethod(**({"name": "mine", "order": 2, "beta": 1 / 4} | change))


@pytest.mark.parametrize(
    "tableau",
    [
        RK4,
        RK4 | NYSTROEM,
        RK4 | HEUN_THIRD,
        RK4 | {"order": 1, "a": ((0,),), "b": (1,), "c": (0,)},
    ],
)
def test_a_sound_tableau_is_accepted(tableau):
    method = ExplicitMethod(**tableau)
    assert method.stages == len(method.b)
    assert method.is_nystroem == ("a_displacement" in tableau)
    assert not method.is_adaptive


def test_rows_are_named_and_of_known_kinds():
    assert all(method.name == name for name, method in METHODS.items())
    kinds = {"explicit": [*EXPLICIT, "stoermer", "leapfrog"], "implicit": IMPLICIT, "exact": ["exact"]}
    assert {name: method.kind for name, method in METHODS.items()} == {n: kind for kind in kinds for n in kinds[kind]}
    assert [name for name, method in METHODS.items() if method.is_adaptive] == ["dormand_prince54"]
    assert METHODS["exact"] == ExactMethod("exact")


def test_parameters_of_the_dissipative_methods():
    # Hilber, Hughes and Taylor: beta = (1 - alpha)^2 / 4, gamma = 1/2 - alpha. Chung and Hulbert: alpha_m = (2 rho - 1)
    # / (rho + 1), alpha_f = rho / (rho + 1), gamma = 1/2 - alpha_m + alpha_f, beta = (1 - alpha_m + alpha_f)^2 / 4.
    hilber, chung = METHODS["hht_alpha"], METHODS["generalised_alpha"]
    values = [hilber.beta, hilber.gamma, hilber.mass_lag, hilber.force_lag]
    assert values == pytest.approx([0.3025, 0.6, 0, 0.1], rel=1e-15)
    values = [chung.beta, chung.gamma, chung.mass_lag, chung.force_lag]
    assert values == pytest.approx([25 / 81, 11 / 18, 1 / 3, 4 / 9], rel=1e-15)
    # What they leave of the highest frequencies: (1 + alpha) / (1 - alpha), and rho.
    for method, left in ((hilber, 0.9 / 1.1), (chung, 0.8)):
        growth = np.abs(np.linalg.eigvals(method.amplification(np.array(1e6), np.array(0.0)))).max()
        assert growth == pytest.approx(left, abs=1e-3)  # a triple eigenvalue is good to the cube root of rounding


def test_error_weights_of_dormand_and_prince():
    # The embedded method of order 4 as printed (Hairer, Norsett and Wanner, II.5, table 5.2).
    method = METHODS["dormand_prince54"]
    fourth = [5179 / 57600, 0, 7571 / 16695, 393 / 640, -92097 / 339200, 187 / 2100, 1 / 40]
    np.testing.assert_allclose(np.array(method.b) - np.array(method.error), fourth, atol=1e-15)
    np.testing.assert_array_equal(method.a[-1], method.b)  # the last stage is the next step's first


def test_no_last_digit_of_a_kernels_constants_is_the_processors():
    # A tableau's products are sums in full, rounded once; a matrix product adds in an order of each processor's own.
    method = METHODS["dormand_prince54"]
    for weights, products in ((method.b, method.displacement_b), (method.a[4], method.displacement_a[4])):
        columns = zip(*method.a, strict=True)
        terms = [[Fraction(weight * a) for weight, a in zip(weights, each, strict=True)] for each in columns]
        assert products.tolist() == [float(sum(column)) for column in terms]
    np.testing.assert_array_equal(method.displacement_a[-1], method.displacement_b)


def test_stability_polynomials_in_closed_form():
    # exp(z) cut after the order, where there are as many stages (Hairer and Wanner, IV.2); Dormand and Prince: z^6/600.
    series = [1, 1, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 600]
    for name in EXPLICIT:
        method = METHODS[name]
        due = series[: method.order + (2 if method.order == 5 else 1)]
        np.testing.assert_allclose(method.stability_polynomial[: len(due)], due, rtol=1e-14, err_msg=name)
        np.testing.assert_array_equal(method.stability_polynomial[len(due) :], 0, err_msg=name)


@pytest.mark.parametrize("name", EXPLICIT)
def test_stability_polynomial_is_the_growth_of_a_step(name):
    # One step of y' = lambda y, stage by stage, is not how the polynomial was found.
    method = METHODS[name]
    for z in (0.3, -1.7, 0.2 + 2.4j):
        slopes = []
        for row in method.a:
            slopes.append(z * (1 + sum(a * k for a, k in zip(row, slopes, strict=False))))
        growth = 1 + sum(b * k for b, k in zip(method.b, slopes, strict=True))
        assert growth == pytest.approx(np.polyval(method.stability_polynomial[::-1], z), rel=1e-14)


def explicit_step(method, acceleration, t, u, v, h, first):
    """One step from t of u'' = acceleration(t, u, v), as Runge and Kutta or Nystroem have it."""
    u_rates, v_rates = [], []
    for stage, node in enumerate(method.c):
        vs = v + h * np.dot(method.a[stage][:stage], v_rates)
        if method.is_nystroem:
            us = u + node * h * v + h**2 * np.dot(method.a_displacement[stage][:stage], v_rates)
        else:
            us = u + h * np.dot(method.a[stage][:stage], u_rates)
        u_rates.append(vs)
        v_rates.append(acceleration(t + node * h, us, vs))
    share = 0.5 if first and method.starts_halfway else 1.0
    v1 = v + share * h * np.dot(method.b, v_rates)
    if method.is_nystroem:
        return u + h * v + share * h**2 * np.dot(method.b_displacement, v_rates), v1
    return u + h * np.dot(method.b, u_rates), v1


def implicit_step(method, acceleration, t, u, v, a, h):
    """One step from t with acceleration a, by a root search for the acceleration at the end."""
    reach = method.extension * h

    def moved(end, step):
        displacement = u + step * v + step**2 * ((0.5 - method.beta) * a + method.beta * end)
        return displacement, v + step * ((1 - method.gamma) * a + method.gamma * end)

    def residual(end):
        forces = (1 - method.force_lag) * acceleration(t + reach, *moved(end, reach))
        forces += method.force_lag * acceleration(t, u, v)
        return (1 - method.mass_lag) * end + method.mass_lag * a - forces

    end = brentq(residual, -1e3, 1e3, xtol=1e-15, rtol=1e-15)
    a1 = a + (end - a) / method.extension
    return *moved(a1, h), a1


START, TIMES = (0.4, -0.8), np.linspace(0, 2, 9)


def acceleration(t, u, v, is_damped):
    """An oscillator whose stiffness and damping are not linear, under a load that varies."""
    return np.cos(1.7 * t) - 2 * np.sin(2 * u) - (0.4 * v + 0.3 * v**3 if is_damped else 0)


@cache
def displacements(is_damped):
    """Its displacements at TIMES after the first, by scipy."""
    state, path = START, []

    def rates(t, y):
        return [y[1], acceleration(t, *y, is_damped)]

    for span in pairwise(TIMES):
        state = solve_ivp(rates, span, state, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        path.append(state[0])
    return np.array(path)


@pytest.mark.parametrize("name", EXPLICIT + IMPLICIT)
@pytest.mark.parametrize("is_damped", [True, False])
def test_order_on_a_nonlinear_oscillator(name, is_damped, measured):
    method = METHODS[name]

    def error(steps):
        forces = partial(acceleration, is_damped=is_damped)
        h, (u, v), path = TIMES[-1] / steps, START, [START[0]]
        a = forces(0.0, u, v)
        for step in range(steps):
            if method.kind == "explicit":
                u, v = explicit_step(method, forces, step * h, u, v, h, step == 0)
            else:
                u, v, a = implicit_step(method, forces, step * h, u, v, a, h)
            path.append(u)
        return np.linalg.norm(np.array(path)[steps // 8 :: steps // 8] - displacements(is_damped))

    steps = 40 if method.order > 2 else 160
    order = 2 if name == "central_difference_lagged" and not is_damped else method.order  # lag of the damping alone
    # The next term of the error is a step's power smaller: some per cent of an order at these steps.
    measured(
        "order of every method on a nonlinear oscillator: measured less stated",
        truth="scipy's DOP853 at a relative tolerance of 1e-13",
        value=abs(np.log2(error(steps) / error(2 * steps)) - order),
        bound=0.12,
    )


@pytest.mark.parametrize("name", EXPLICIT + IMPLICIT)
@pytest.mark.parametrize(("x", "zeta"), [(0.3, 0.0), (1.7, 0.05), (2.9, 0.6), (0.8, 3.0)])
def test_amplification_is_what_a_step_does(name, x, zeta):
    method, h = METHODS[name], 0.1
    w = x / h

    def linear(t, u, v):
        return -(w**2) * u - 2 * zeta * w * v

    matrix = method.amplification(np.array(x), np.array(zeta))
    for column, unit in enumerate(np.eye(len(matrix))):
        u, v, a = unit[0], unit[1] / h, (unit[2] if len(unit) > 2 else 0) / h**2
        if method.kind == "explicit":
            u, v = explicit_step(method, linear, 0.0, u, v, h, first=False)
        else:
            u, v, a = implicit_step(method, linear, 0.0, u, v, a, h)
        stepped = [u, h * v, h**2 * a][: len(unit)]
        # The root search is good to 1e-15 of accelerations of up to 1e3 times h^2; the rest is rounding.
        np.testing.assert_allclose(matrix[:, column], stepped, rtol=1e-12, atol=1e-13)


def stoermer_step(h, path, velocities, accelerations):
    """One step as printed by Hairer, Norsett and Wanner, III.10 (k = 3), and Adams' formula of the velocity, III.1.

    The lists end with the present values.
    """
    a2, a1, a0 = accelerations[-3:]
    following = 2 * path[-1] - path[-2] + h**2 * (13 / 12 * a0 - 1 / 6 * a1 + 1 / 12 * a2)
    return following, velocities[-1] + h * (23 / 12 * a0 - 4 / 3 * a1 + 5 / 12 * a2)


@pytest.mark.parametrize(("x", "zeta"), [(0.3, 0.0), (0.8, 0.05), (0.4, 0.3), (1.5, 0.02)])
def test_stoermer_s_growth_is_that_of_the_printed_formula(x, zeta):
    # A motion s^n of the linear oscillator, put into the printed formulas, is also a motion of the summed form: the
    # velocity of Adams is that of the changes of the displacement without the correction.
    eigenvalues, vectors = np.linalg.eig(METHODS["stoermer"].amplification(np.array(x), np.array(zeta)))
    for s, vector in zip(eigenvalues, vectors.T, strict=True):
        if abs(s) < 0.05:  # powers to -3 would lose all digits
            continue
        u = [s**n for n in (-3, -2, -1, 0)]
        rate = (23 / 12 * vector[1] - 4 / 3 * vector[2] + 5 / 12 * vector[3]) / vector[0]
        v = [s**n * rate for n in (-3, -2, -1, 0)]
        a = [-(x**2) * un - 2 * zeta * x * vn for un, vn in zip(u, v, strict=True)]
        following, velocity = stoermer_step(1.0, u, v, a)
        assert following == pytest.approx(s, rel=1e-9), s
        if abs(s - 1) > 0.05:
            assert velocity == pytest.approx(s * rate, rel=1e-9), s


def test_order_of_stoermer_on_a_nonlinear_oscillator():
    exact = displacements(True)
    start = solve_ivp(
        lambda t, y: [y[1], acceleration(t, *y, True)], (0, -0.1), START, method="DOP853", rtol=1e-13, atol=1e-15,
        dense_output=True,
    ).sol  # fmt: skip

    def error(steps):
        h = TIMES[-1] / steps
        u, v = (list(each) for each in start(-h * np.arange(2, -1, -1)))
        a = [acceleration(-h * (2 - n), u[n], v[n], True) for n in range(3)]
        for step in range(steps):
            following, velocity = stoermer_step(h, u, v, a)
            u.append(following)
            v.append(velocity)
            a.append(acceleration((step + 1) * h, following, velocity, True))
        return np.linalg.norm(np.array(u)[2:][steps // 8 :: steps // 8] - exact)

    # The next term of the error is a step smaller: some per cent of an order at these steps.
    assert np.log2(error(160) / error(320)) == pytest.approx(METHODS["stoermer"].order, abs=0.12)


def test_a_multistep_method_of_another_order_is_refused():
    with pytest.raises(ValueError, match="'mine': it is not of order 3"):
        MultistepMethod("mine", 3, 1 / 12, (15 / 8, -10 / 8, 3 / 8))  # the velocity at half steps, extrapolated
    with pytest.raises(ValueError, match="'mine': it is not of order 3"):
        MultistepMethod("mine", 3, 0.0, (23 / 12, -4 / 3, 5 / 12))
    MultistepMethod("mine", 2, 0.0, (3 / 2, -1 / 2, 0.0))


# Period elongation without damping at h / T = .01, .05, .1 and .2: of Newmark's methods and central differences in
# closed form (Chopra, 5.5), to ten digits.
ELONGATION = {
    "newmark_average": [3.289002722e-4, 8.171242600e-3, 3.207491062e-2, 1.200330860e-1],
    "newmark_linear": [1.644474211e-4, 4.083789215e-3, 1.600192184e-2, 5.914510317e-2],
    "central_difference": [-1.645394288e-4, -4.141454784e-3, -1.693422976e-2, -7.517243636e-2],
    "velocity_verlet": [-1.645394288e-4, -4.141454784e-3, -1.693422976e-2, -7.517243636e-2],
    "central_difference_lagged": [-1.645394288e-4, -4.141454784e-3, -1.693422976e-2, -7.517243636e-2],
}
# RK4 by w h: |R|, relative phase error, amplitude kept a period.
RK4_UNDAMPED = {
    0.1: (0.9999999930642, -8.303591e-7, 0.9999995642),
    0.5: (0.9998948783723, -4.751287e-4, 0.9986798055),
    1.0: (0.9939050368230, -5.578894e-3, 0.9623154561),
    2.0: (0.7453559924999, 1.722197e-2, 0.3972088230),
}


def principal(method, x):
    """The eigenvalue of an undamped step that follows exp(i x)."""
    growth = np.linalg.eigvals(method.amplification(np.array(x), np.array(0.0)))
    return growth[np.abs(growth - np.exp(1j * x)).argmin()]


@pytest.mark.parametrize("name", ELONGATION)
def test_period_elongation(name, measured):
    x = 2 * np.pi * np.array([0.01, 0.05, 0.1, 0.2])
    elongation = [step / np.angle(principal(METHODS[name], step)) - 1 for step in x]
    measured(
        "period elongation of Newmark's methods",
        truth="closed forms to ten digits (Chopra, Dynamics of Structures, 5.5)",
        value=relative_difference(elongation, ELONGATION[name]),
        bound=1e-9,
    )


@pytest.mark.parametrize("x", RK4_UNDAMPED)
def test_amplitude_and_phase_of_rk4(x):
    growth = principal(METHODS["rk4"], x)
    size, phase, kept = RK4_UNDAMPED[x]
    assert abs(growth) == pytest.approx(size, abs=1e-13)
    assert np.angle(growth) / x - 1 == pytest.approx(phase, rel=1e-6)
    assert abs(growth) ** (2 * np.pi / x) == pytest.approx(kept, abs=1e-10)
