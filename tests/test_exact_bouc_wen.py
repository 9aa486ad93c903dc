"""The near-exact response of Bouc-Wen chains against closed forms, 12-digit tables and scipy left to itself."""

import numpy as np
import pytest
from matrices import chain_matrix
from scipy.integrate import simpson, solve_ivp
from scipy.interpolate import CubicHermiteSpline
from validation import difference

from warpdyn.truth import bouc_wen_chain_response, piecewise_linear_response

pytestmark = pytest.mark.fast


def oscillator(force, step, velocity, mass=1.0, **law):
    """The response of a mass on 100 N/m that yields at 1 N and 0.01 m."""
    return bouc_wen_chain_response([mass], 100.0, 1.0, 0.0, [[0.0]], np.asarray(force)[:, None], step, velocity, **law)


# Three storeys of 9, 29 and 45 rad/s, damped in no proportion to anything.
MASS, STIFFNESS = np.array([2000.0, 1500.0, 1000.0]), np.array([1.2e6, 9e5, 5e5])
STRENGTH, DAMPING = np.array([12e3, 8e3, 4e3]), chain_matrix(np.array([2e3, 6e3, 1e3]))
STEP = 0.05
RECORD = np.random.default_rng(3).normal(size=31) * 4 * np.hanning(31)


def refined(force, parts):
    """Samples of the same force, so many times denser."""
    time, dense = np.arange(len(force)), np.arange((len(force) - 1) * parts + 1) / parts
    return np.stack([np.interp(dense, time, column) for column in force.T], axis=1)


def test_free_vibration():
    # Turning points by integration to 15 digits, n = 2 and beta = gamma = 1/2.
    expected = [0.0519311632668102, 0.0310821714329424, 0.0474074291337121,
                0.0334477333716394, 0.0458722556099268, 0.0345532763737686]  # fmt: skip
    step = 0.002
    run = oscillator(np.zeros(1001), step, 0.3, exponent=2.0)
    path = CubicHermiteSpline(step * np.arange(1001), run.displacement[:, 0], run.velocity[:, 0])
    turns = path.derivative().roots(extrapolate=False)
    # The cubic between samples: (10 / s)^4 h^4 / 384 of 0.02 m.
    np.testing.assert_allclose(path(turns), expected, rtol=0, atol=1e-11)
    # Tolerance 1e-12 in each of some steps.
    assert run.peak_storey_drift[0] == pytest.approx(expected[0], rel=1e-12)
    at_peak = oscillator(np.zeros(2), 0.3238675337677, 0.3, exponent=2.0)
    assert at_peak.displacement[-1, 0] == pytest.approx(expected[0], rel=1e-12)
    assert at_peak.velocity[-1, 0] == pytest.approx(0, abs=1e-13)  # the instant has 13 digits, at 1 m/s2
    # 0.045 J is in motion, in the spring or gone.
    left = 0.5 * run.velocity**2 + 0.5 * 0.01 * run.memory**2 + run.hysteretic_energy
    np.testing.assert_allclose(left, 0.045, rtol=1e-11)
    assert run.hysteretic_energy[-1, 0] > 0.04


@pytest.mark.parametrize(
    ("exponent", "expected"),
    # 1 - exp(-x) and tanh x at x = 1, and numbers of 13 digits.
    [(1, 1 - np.exp(-1)), (2, np.tanh(1)), (3, 0.8230405355016), (5, 0.8830224247924), (10, 0.936596963131)],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_steady_push(exponent, expected, sign):
    # A mass that the spring cannot slow.
    run = oscillator(np.zeros(2), 0.01, sign * 1.0, mass=1e15, exponent=exponent)
    assert run.memory[-1, 0] == pytest.approx(sign * expected, abs=1e-12)


def test_cycles_to_and_fro():
    # An acceleration that is a triangular wave of A takes a heavy mass h A / 2 fast through 0 to A h^2 / 3, where it
    # turns, and back: to 2, -2, 2 and -2 yield drifts.
    mass, h = 1e15, 0.5
    amplitude = 3 * 0.02 / h**2
    wave = mass * amplitude * np.array([0, -1, 0, 1, 0, -1, 0, 1])
    run = oscillator(wave, h, amplitude * h / 2, mass=mass, exponent=2.0)
    memory = run.memory[1::2, 0]
    np.testing.assert_allclose(run.displacement[1::2, 0], [0.02, -0.02, 0.02, -0.02], rtol=0, atol=1e-14)
    assert run.peak_storey_drift[0] == pytest.approx(0.02, abs=1e-14)
    # Tables of 12 digits, and their z and integral of z du.
    expected = [0.964027580076, -0.995397251646, 0.995099957222, -0.995102862735]
    np.testing.assert_allclose(memory, expected, rtol=0, atol=2e-12)
    area = run.hysteretic_energy[1::2, 0] / 0.01 + memory**2 / 2
    np.testing.assert_allclose(area, [1.325002747358, 3.205457425557, 5.023958176661, 6.843050647726], rtol=1e-12)


@pytest.mark.parametrize(
    ("beta", "gamma", "exponent"), [(0.5, 0.5, 1.0), (0.6, -0.3, 2.0), (0.5, 0.2, [1.0, 3.0, 1.5]), (0.5, 0.5, 10.0)]
)
def test_three_storeys_by_scipy_alone(beta, gamma, exponent, measured):
    """scipy's method goes over the law's corners in steps too small to matter."""
    force, velocity = -MASS * RECORD[10:22, None], np.array([0.1, 0.2, 0.5])
    run = bouc_wen_chain_response(
        MASS, STIFFNESS, STRENGTH, 0.1, DAMPING, force, STEP, velocity, beta=beta, gamma=gamma, exponent=exponent
    )

    def rate(t, y, start, end):
        drift, speed, z = np.diff(y[:3], prepend=0), np.diff(y[3:6], prepend=0), y[6:9]
        storey = 0.1 * STIFFNESS * drift + 0.9 * STRENGTH * z
        balance = start + (end - start) * t / STEP - storey + np.append(storey[1:], 0) - DAMPING @ y[3:6]
        bend = np.abs(z) ** exponent * (beta * np.abs(speed) * np.sign(z) + gamma * speed)
        return np.concatenate([y[3:6], balance / MASS, (speed - bend) * STIFFNESS / STRENGTH])

    state, peak = np.concatenate([np.zeros(3), velocity, np.zeros(3)]), np.zeros(3)
    turns = [lambda t, y, *ends, s=s: np.diff(y[3:6], prepend=0)[s] for s in range(3)]
    for i in range(len(force) - 1):
        part = solve_ivp(
            rate, (0, STEP), state, "DOP853", args=(force[i], force[i + 1]), events=turns,
            rtol=1e-13, atol=1e-15, max_step=0.001,
        )  # fmt: skip
        state = part.y[:, -1]
        for instant in [state, *(y for events in part.y_events for y in events)]:
            peak = np.maximum(peak, np.abs(np.diff(instant[:3], prepend=0)))
        # What it errs at corners: with steps of 0.05 s instead it is 2e-10 of z off at n = 10, with 0.0002 s 3e-12.
        measured(
            "chains of Bouc-Wen storeys (`wd.truth`)",
            truth="scipy's DOP853 at a relative tolerance of 1e-13, with independently programmed equations",
            value=difference(run.displacement[i + 1], state[:3]),
            bound=1e-11,
            units="m",
        )
        np.testing.assert_allclose(run.velocity[i + 1], state[3:6], rtol=0, atol=1e-10)
        np.testing.assert_allclose(run.memory[i + 1], state[6:9], rtol=0, atol=1e-10)
    assert (peak > 1.2 * STRENGTH / STIFFNESS).all()
    np.testing.assert_allclose(run.peak_storey_drift, peak, rtol=1e-9)  # its events are those of its interpolant


def test_samples_do_not_matter_and_energy_balances():
    parts = 40
    law = {"beta": 0.6, "gamma": 0.3, "exponent": 1.0}
    force = -MASS * RECORD[:, None]
    run = bouc_wen_chain_response(MASS, STIFFNESS, STRENGTH, 0.05, DAMPING, force, STEP, **law)
    force = refined(force, parts)
    dense = bouc_wen_chain_response(MASS, STIFFNESS, STRENGTH, 0.05, DAMPING, force, STEP / parts, **law)
    # The tolerance of 1e-12 in each of thousands of steps, most of it forgotten by damping and yielding.
    scale = np.abs(run.displacement).max()
    np.testing.assert_allclose(dense.displacement[::parts], run.displacement, rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(dense.peak_storey_drift, run.peak_storey_drift, rtol=1e-10)
    drift = np.diff(dense.displacement, prepend=0, axis=1)
    sampled = np.abs(drift).max(axis=0)
    assert (sampled <= run.peak_storey_drift * (1 + 1e-10)).all()
    # Within the parabola at the peak, half the dense step away: 45 rad/s and forced accelerations of 4 m/s2 at most.
    acceleration = 45**2 * run.peak_storey_drift + 12
    assert (sampled >= run.peak_storey_drift - 0.5 * (STEP / parts / 2) ** 2 * acceleration).all()
    stored = 0.5 * (0.05 * STIFFNESS * drift**2 + 0.95 * STRENGTH**2 / STIFFNESS * dense.memory**2)
    left = (0.5 * MASS * dense.velocity[-1] ** 2 + stored[-1] + dense.hysteretic_energy[-1]).sum()
    work = simpson((force * dense.velocity).sum(axis=1), dx=STEP / parts)
    viscous = simpson(np.einsum("ti,ij,tj->t", dense.velocity, DAMPING, dense.velocity), dx=STEP / parts)
    assert dense.hysteretic_energy[-1].sum() > 0.2 * work
    # Simpson's rule at 1/800 s: twice 29 rad/s turn (58 / 800)^4 / 180 = 1.5e-7, of what little is in that mode.
    assert left + viscous == pytest.approx(work, rel=1e-7)


def test_strong_storeys_follow_the_linear_solution():
    force, velocity = np.random.default_rng(1).normal(size=(20, 3)) * 1e3, np.array([0.1, 0.0, -0.2])
    run = bouc_wen_chain_response(MASS, STIFFNESS, 1e30, 0.3, DAMPING, force, 0.1, velocity, exponent=2.0)
    linear = piecewise_linear_response(MASS, DAMPING, chain_matrix(STIFFNESS), force, 0.1, initial_velocity=velocity)
    for found, expected in zip((run.displacement, run.velocity), linear, strict=False):
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_bad_input_is_named():
    good = {
        "mass": MASS, "stiffness": STIFFNESS, "yield_force": STRENGTH, "hardening_ratio": 0.1,
        "damping": DAMPING, "force": np.zeros((4, 3)), "step": 0.1,
    }  # fmt: skip
    for change, message in (
        ({"beta": 0.0}, "beta is 0 at storey 1; it must be finite and above 0"),
        ({"gamma": [0.5, 0.6, 0.5]}, r"gamma is 0.6 and beta is 0.5 \(storey 2\)"),
        ({"gamma": -0.5}, r"gamma is -0.5 and beta is 0.5 \(storey 1\); a Bouc-Wen storey needs -beta < gamma <= beta"),
        ({"exponent": [1.0, 2.0]}, r"exponent must be one value or one per storey, shape \[3\], got \(2,\)"),
        ({"initial_velocity": np.nan}, "initial_velocity is nan"),
    ):
        with pytest.raises(ValueError, match=message):
            bouc_wen_chain_response(**good | change)
