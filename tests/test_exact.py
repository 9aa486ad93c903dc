"""The exact responses against 40-digit tables, closed forms, event-exact numbers and scipy's adaptive integrators."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from seed_problem import AMPLITUDE, DAMPING, MASS, SEED_DISPLACEMENT, STIFFNESS

from warpdyn.exact import elastoplastic_response, harmonic_response, piecewise_linear_response

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
def test_seed_problem_matches_its_table(step):
    time = step * np.arange(round(10 / step) + 1)
    displacement, velocity, _ = harmonic_response(MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time)
    for instant, expected in SEED_DISPLACEMENT.items():
        # Rounding of the phase w_max t = 209 rad at 0.01 m: 2e-16 m.
        np.testing.assert_allclose(displacement[round(instant / step)], expected, rtol=0, atol=1e-15)
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


def test_harmonic_response_with_non_classical_damping_and_initial_motion():
    time = np.linspace(0.5, 3, 26)  # need not start at 0
    u0, v0 = np.array([0.01, -0.02, 0.005]), np.array([0.1, 0.0, -0.3])
    got = harmonic_response(MASS, NONCLASSICAL, STIFFNESS, AMPLITUDE, 12.0, 0.7, time, u0, v0)
    expected = integrate(MASS, NONCLASSICAL, STIFFNESS, lambda t: AMPLITUDE * np.sin(12 * t + 0.7), 3.0, u0, v0)
    for value, reference, scale in zip(got, expected, (0.02, 0.3, 5), strict=True):
        np.testing.assert_allclose(value[-1], reference, rtol=0, atol=1e-11 * scale)  # DOP853 at rtol 1e-13


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


def test_elastic_perfectly_plastic_under_a_step_force():
    displacement, dissipated = elastoplastic_response(1.0, 100.0, 1.0, np.full(11, 0.75), 0.1)
    # Closed forms in pieces, written to 15 digits after the point.
    expected = [0.00344773270598895, 0.010621935423531, 0.016219586326019, 0.0199153699715823, 0.0188036277033006]
    np.testing.assert_allclose(displacement[[1, 2, 3, 5, 10]], expected, rtol=0, atol=1e-15)
    # Ductility 1/2 / (1 - F0 / fy) = 2: 0.01 m of yield, and 1 N over it dissipated.
    at_peak, energy = elastoplastic_response(1.0, 100.0, 1.0, np.full(11, 0.75), 0.0473906036099521)
    assert at_peak[-1] == pytest.approx(0.02, abs=1e-15)
    assert energy[-1] == pytest.approx(0.01, abs=1e-15)
    assert dissipated[-1] == pytest.approx(0.01, abs=1e-15)
    yielding, energy = elastoplastic_response(1.0, 100.0, 1.0, np.full(2, 0.75), 0.191063323624902)
    assert yielding[-1] == pytest.approx(0.01, abs=1e-15)
    assert energy[-1] < 1e-15


@pytest.mark.parametrize(
    ("hardening_ratio", "instant", "peak", "dissipated"),
    # With hardening: energy 0.045 J in, less 1/2 k u_y^2 and the elastic energy beyond yield, by hand from u_max.
    [(0.0, 0.316826403420031, 0.05, 0.04), (0.1, 0.264743837474769, 0.0441640786499874, 0.9 * 0.0341640786499874)],
)
@pytest.mark.parametrize("samples", [2, 8])
@pytest.mark.parametrize("sign", [1, -1])
def test_free_vibration_beyond_yield(hardening_ratio, instant, peak, dissipated, samples, sign):
    displacement, energy = elastoplastic_response(
        1.0,
        100.0,
        1.0,
        np.zeros(samples),
        instant / (samples - 1),
        hardening_ratio=hardening_ratio,
        initial_velocity=sign * 0.3,
    )
    assert displacement[-1] == pytest.approx(sign * peak, abs=1e-15)
    assert energy[-1] == pytest.approx(dissipated, abs=1e-15)


@pytest.mark.parametrize("hardening_ratio", [0.0, 0.1])
def test_hysteresis_under_a_random_force(hardening_ratio):
    rng = np.random.default_rng(7)
    step = 0.1
    force = 1.2 * np.sin(8 * step * np.arange(41)) + 0.5 * rng.normal(size=41)
    mass, stiffness, yield_force, damping = 1.0, 100.0, 1.0, 1.0
    displacement, dissipated = elastoplastic_response(
        mass,
        stiffness,
        yield_force,
        force,
        step,
        hardening_ratio=hardening_ratio,
        damping_coefficient=damping,
        initial_displacement=0.004,
    )
    # The oracle: scipy's adaptive method with its own events, interval by interval, the spring written as its force.
    u, v, energy, direction, plastic, yields = 0.004, 0.0, 0.0, 0, 0.0, 0
    expected = [(u, energy)]
    for i in range(force.size - 1):
        t = 0.0
        while t < step:

            def rate(t, y, i=i, direction=direction, plastic=plastic):
                hysteretic = direction * yield_force if direction else stiffness * (y[0] - plastic)
                spring = hardening_ratio * stiffness * y[0] + (1 - hardening_ratio) * hysteretic
                load = force[i] + (force[i + 1] - force[i]) * t / step
                power = (1 - hardening_ratio) * yield_force * abs(y[1]) if direction else 0.0
                return [y[1], (load - spring - damping * y[1]) / mass, power]

            def switch(t, y, direction=direction, plastic=plastic):
                return -direction * y[1] if direction else abs(y[0] - plastic) - yield_force / stiffness

            switch.terminal, switch.direction = True, 1
            run = solve_ivp(
                rate, (t, step), [u, v, energy], "DOP853", events=switch, rtol=1e-12, atol=1e-14, max_step=0.01
            )
            t, (u, v, energy) = run.t[-1], run.y[:, -1]
            if run.status == 1:
                plastic = u - direction * yield_force / stiffness if direction else plastic
                direction = 0 if direction else int(np.sign(u - plastic))
                yields += direction != 0
        expected.append((u, energy))
    expected = np.array(expected)
    assert yields >= 8  # or the comparison is empty
    assert dissipated[-1] > 0.1
    # Adaptive steps at rtol 1e-12, and events to about 1e-12 s each.
    np.testing.assert_allclose(displacement, expected[:, 0], rtol=0, atol=1e-10)
    np.testing.assert_allclose(dissipated, expected[:, 1], rtol=0, atol=1e-10)


@pytest.mark.parametrize("samples", [2, 3, 5, 12, 33])
def test_a_peak_just_beyond_yield_between_two_looks(samples):
    # Energy: 1/2 m v0^2 = 1/2 k u_y^2 + dissipated; beyond yield by 1e-3 for 2.6 degrees of the oscillation each side.
    dissipated = elastoplastic_response(1.0, 100.0, 1.0, np.zeros(samples), 0.5 / samples, initial_velocity=0.1001)[1]
    assert dissipated[-1] == pytest.approx(0.5 * (0.1001**2 - 0.1**2), abs=1e-16)


@pytest.mark.parametrize("sign", [1, -1])
def test_yield_at_the_first_instant(sign):
    displacement, dissipated = elastoplastic_response(
        1.0, 100.0, 1.0, np.zeros(3), 0.15, initial_displacement=sign * 0.01, initial_velocity=sign * 0.3
    )
    # A constant 1 N stops 1 kg at 0.3 m/s in 0.3 s and 0.045 m.
    assert displacement[-1] == pytest.approx(sign * 0.055, abs=1e-15)
    assert dissipated[-1] == pytest.approx(0.045, abs=1e-15)


def test_weak_damped_spring_follows_the_linear_solution():
    force = np.random.default_rng(1).normal(size=30)
    displacement, dissipated = elastoplastic_response(2.0, 50.0, 1e3, force, 0.3, damping_coefficient=1.5)
    linear = piecewise_linear_response([2.0], [[1.5]], [[50.0]], force[:, None], 0.3)[0][:, 0]
    np.testing.assert_allclose(displacement, linear, rtol=0, atol=1e-14)
    assert not dissipated.any()


def test_a_mass_may_rest_at_yield():
    displacement, dissipated = elastoplastic_response(1.0, 100.0, 1.0, np.ones(50), 0.1, initial_displacement=0.01)
    np.testing.assert_allclose(displacement, 0.01, rtol=1e-12)
    assert dissipated[-1] < 1e-14


def test_bad_input_is_named():
    time = np.linspace(0, 1, 5)
    harmonic = [MASS, DAMPING, STIFFNESS, AMPLITUDE, 10.0, 0.0, time]
    for place, value, message in (
        (0, MASS[:2], r"damping must be finite and of shape \[2, 2\]"),
        (0, -MASS, "mass must be positive definite"),
        (1, np.full((3, 3), np.nan), "damping must be finite"),
        (2, -STIFFNESS, "stiffness must be positive definite"),
        (2, np.triu(STIFFNESS), "stiffness must be symmetric"),
        (3, [0, 100.0], r"amplitude must be finite and of shape \[3\]"),
        (4, np.inf, "frequency and phase must be finite"),
        (6, np.array([0, 0.1, 0.3]), r"time\[1\] is 0.05 s off"),
        (6, np.array([0.2, 0.1]), "rising"),
    ):
        arguments = [*harmonic[:place], value, *harmonic[place + 1 :]]
        with pytest.raises(ValueError, match=message):
            harmonic_response(*arguments)
    with pytest.raises(ValueError, match=r"force must be finite and of shape \[time, 3\]"):
        piecewise_linear_response(MASS, DAMPING, STIFFNESS, np.zeros(5), 0.1)
    with pytest.raises(ValueError, match="step must be finite and above 0"):
        piecewise_linear_response(MASS, DAMPING, STIFFNESS, np.zeros((5, 3)), 0.0)
    for change, message in (
        ({"mass": 0.0}, "mass must be finite and above 0"),
        ({"force": [0, np.nan]}, "force must be finite"),
        ({"hardening_ratio": 1.0}, "hardening_ratio must be from 0 to below 1"),
        ({"initial_displacement": 0.02}, "must be within yield, 0.01 m"),
        ({"damping_coefficient": -1.0}, "must be 0 or above"),
    ):
        arguments = {"mass": 1.0, "stiffness": 100.0, "yield_force": 1.0, "force": np.zeros(3), "step": 0.1} | change
        with pytest.raises(ValueError, match=message):
            elastoplastic_response(**arguments)
