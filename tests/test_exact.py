"""The exact responses against 40-digit tables, closed forms and scipy's adaptive integrators."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from seed_problem import AMPLITUDE, DAMPING, MASS, SEED_DISPLACEMENT, STIFFNESS
from validation import difference

from warpdyn.truth import harmonic_response, piecewise_linear_response

NONCLASSICAL = np.array([[60.0, -30, 0], [-30, 430, -400], [0, -400, 400]])


def integrate(mass, damping, stiffness, force, end, displacement, velocity, max_step=np.inf):
    """Displacement, velocity and acceleration at `end` by scipy's eighth-order method near rounding."""
    dof = len(mass)

    def rate(t, y):
        return np.concatenate([y[dof:], (force(t) - damping @ y[dof:] - stiffness @ y[:dof]) / mass])

    start = np.concatenate([displacement, velocity])
    y = solve_ivp(rate, (0, end), start, "DOP853", rtol=1e-13, atol=1e-16, max_step=max_step).y[:, -1]
    return y[:dof], y[dof:], rate(end, y)[dof:]


@pytest.mark.parametrize("step", [1e-3, 5e-4])
def test_seed_problem_matches_its_table(step, measured):
    time = step * np.arange(round(10 / step) + 1)
    displacement, velocity, _ = harmonic_response(MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time)
    for instant, expected in SEED_DISPLACEMENT.items():
        # Rounding of the phase w_max t = 209 rad at 0.01 m: 2e-16 m.
        measured(
            "exact solution of linear systems under harmonic forces (`wd.truth`)",
            truth="a three-storey frame by matrix exponentials in 40-digit arithmetic",
            value=difference(displacement[round(instant / step)], expected),
            bound=1e-15,
            units="m",
        )
    assert np.abs(displacement[:, 2] - 2 * displacement[:, 0]).max() < 1e-16
    assert np.abs(velocity[:, 2] - 2 * velocity[:, 0]).max() < 1e-15


@pytest.mark.parametrize(
    ("dof", "instant", "peak"),
    [(0, 0.8091918791077, -0.0070275945603231), (1, 2.012739324485, -0.009352205768429), (2, 0.8091918791077, None)],
)
def test_seed_problem_peaks_in_continuous_time(dof, instant, peak):
    peak = -0.014055189120646 if peak is None else peak
    displacement, velocity, acceleration = harmonic_response(
        MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, np.array([0, instant])
    )
    assert displacement[1, dof] == pytest.approx(peak, abs=1e-15)
    # The instants carry 13 digits: 5e-13 s at about 1 m/s2.
    assert abs(velocity[1, dof]) < 1e-12
    assert acceleration[1, dof] > 0.1


def test_rounding_does_not_add_up_over_steps():
    # A mass on a spring is cos wt. Rounding of w alone turns the phase by w t eps = 1.4e-13 after 100,000 steps.
    omega, time = 2 * np.pi, 1e-3 * np.arange(100_001)
    displacement, velocity, acceleration = harmonic_response(
        [2.0], [[0.0]], [[2 * omega**2]], [0.0], 1.0, 0.0, time, initial_displacement=[1.0]
    )
    assert np.abs(displacement[:, 0] - np.cos(omega * time)).max() < 7e-13
    assert np.abs(velocity[:, 0] + omega * np.sin(omega * time)).max() < 7e-13 * omega
    assert np.abs(acceleration[:, 0] + omega**2 * np.cos(omega * time)).max() < 7e-13 * omega**2


def test_undamped_resonance():
    # u = F0 / (2 k) (sin wt - wt cos wt), Chopra equation 3.1.13.
    omega, time = 5.0, np.linspace(0, 20, 501)
    displacement = harmonic_response([4.0], [[0.0]], [[100.0]], [30.0], omega, 0.0, time)[0][:, 0]
    expected = 30 / 200 * (np.sin(omega * time) - omega * time * np.cos(omega * time))
    np.testing.assert_allclose(displacement, expected, rtol=0, atol=1e-13 * 15)  # 15 m at the end


def test_constant_load_and_critical_damping():
    # A sine of frequency 0 and phase pi/2 is a step load; critically damped: F0/k (1 - (1 + wt) exp(-wt)).
    omega, time = 5.0, np.linspace(0, 4, 101)
    displacement = harmonic_response([4.0], [[40.0]], [[100.0]], [30.0], 0.0, np.pi / 2, time)[0][:, 0]
    np.testing.assert_allclose(displacement, 0.3 * (1 - (1 + omega * time) * np.exp(-omega * time)), rtol=0, atol=1e-15)


def test_harmonic_response_with_non_classical_damping_and_initial_motion(measured):
    time = np.linspace(0.5, 3, 26)  # need not start at 0
    u0, v0 = np.array([0.01, -0.02, 0.005]), np.array([0.1, 0.0, -0.3])
    got = harmonic_response(MASS, NONCLASSICAL, STIFFNESS, AMPLITUDE, 12.0, 0.7, time, u0, v0)
    expected = integrate(MASS, NONCLASSICAL, STIFFNESS, lambda t: AMPLITUDE * np.sin(12 * t + 0.7), 3.0, u0, v0)
    for value, reference, scale in zip(got, expected, (0.02, 0.3, 5), strict=True):
        measured(
            "exact solution with damping that couples modes, over the size of the motion",
            truth="scipy's DOP853 at a relative tolerance of 1e-13",
            value=difference(value[-1], reference) / scale,
            bound=1e-11,
        )


def test_full_mass_matrix_is_a_change_of_coordinates():
    transform = np.array([[1.0, 0, 0], [-1, 1, 0], [0, 0.5, 1]])  # u = T q
    time = np.linspace(0, 2, 41)
    plain = harmonic_response(MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time)
    congruent = (transform.T @ matrix @ transform for matrix in (np.diag(MASS), DAMPING, STIFFNESS))
    turned = harmonic_response(*congruent, transform.T @ AMPLITUDE, 10.0, 0.0, time)
    for value, other in zip(plain, turned, strict=True):
        np.testing.assert_allclose(other @ transform.T, value, rtol=0, atol=1e-13 * np.abs(value).max())


def test_piecewise_linear_base_acceleration():
    time = 0.05 * np.arange(41)
    acceleration = np.interp(time, [0, 0.1, 0.25, 0.4, 0.5], [0, 3, -2, 1, 0])
    omega = 2 * np.pi
    displacement, velocity, response = piecewise_linear_response(
        [1.0], [[0.1 * omega]], [[omega**2]], -acceleration[:, None], 0.05
    )
    for i, expected in ((8, -0.02028422540627496), (10, -0.004978677451611657), (40, 0.003283299086913671)):
        assert displacement[i, 0] == pytest.approx(expected, abs=1e-16)
    residual = response[:, 0] + 0.1 * omega * velocity[:, 0] + omega**2 * displacement[:, 0] + acceleration
    assert np.abs(residual).max() < 1e-14


def test_piecewise_linear_force_on_several_dofs():
    step, samples = 0.02, 101
    force = np.random.default_rng(4).normal(size=(samples, 3)) * 100
    u0, v0 = np.array([0.0, 0.01, 0.0]), np.array([0.1, 0.0, -0.1])
    got = piecewise_linear_response(MASS, NONCLASSICAL, STIFFNESS, force, step, u0, v0)
    u, v = u0, v0
    for i in range(samples - 1):  # one interval at a time, so that the integrator sees smooth loads only
        u, v, a = integrate(
            MASS,
            NONCLASSICAL,
            STIFFNESS,
            lambda t, i=i: force[i] + (force[i + 1] - force[i]) * t / step,
            step,
            u,
            v,
        )
    for value, reference in zip(got, (u, v, a), strict=True):
        # DOP853 at rtol 1e-13, 100 intervals.
        np.testing.assert_allclose(value[-1], reference, rtol=0, atol=1e-11 * np.abs(value).max())


def test_bad_input_is_named():
    time = np.linspace(0, 1, 5)
    harmonic = [MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time]
    for place, value, message in (
        (0, MASS[:2], r"damping must be of shape \[2, 2\]"),
        (0, -MASS, "mass must be positive definite"),
        (1, np.full((3, 3), np.nan), "damping.*must be finite"),
        (2, -STIFFNESS, "stiffness must be positive definite"),
        (2, np.triu(STIFFNESS), "stiffness must be symmetric"),
        (3, [0, 100.0], r"amplitude must be of shape \[3\]"),
        (4, np.inf, r"frequency \[rad/s\] must be a finite number"),
        (6, np.array([0, 0.1, 0.3]), r"time\[1\] is 0.05 s off"),
        (6, np.array([0.2, 0.1]), "at least 2 increasing values"),
    ):
        arguments = [*harmonic[:place], value, *harmonic[place + 1 :]]
        with pytest.raises(ValueError, match=message):
            harmonic_response(*arguments)
    with pytest.raises(ValueError, match=r"force must be of shape \[time, 3\]"):
        piecewise_linear_response(MASS, DAMPING, STIFFNESS, np.zeros(5), 0.1)
    with pytest.raises(ValueError, match=r"step \[s\] must be a finite number above 0"):
        piecewise_linear_response(MASS, DAMPING, STIFFNESS, np.zeros((5, 3)), 0.0)
