"""The event-exact response of bilinear chains against closed forms, scipy's own events and the linear solution."""

from itertools import pairwise

import numpy as np
import pytest
from matrices import chain_matrix
from scipy.integrate import simpson, solve_ivp
from validation import difference

from warpdyn.truth import bilinear_chain_response, piecewise_linear_response

pytestmark = pytest.mark.fast


def oscillator(force, step, hardening_ratio=0.0, damping=0.0, **initial):
    """The response of 1 kg on 100 N/m that yields at 1 N and 0.01 m."""
    return bilinear_chain_response(
        [1.0], 100.0, 1.0, hardening_ratio, [[damping]], np.asarray(force)[:, None], step, **initial
    )


# Three storeys of 9, 29 and 45 rad/s, damped in no proportion to anything.
MASS, STIFFNESS = np.array([2000.0, 1500.0, 1000.0]), np.array([1.2e6, 9e5, 5e5])
STRENGTH, DAMPING = np.array([12e3, 8e3, 4e3]), chain_matrix(np.array([2e3, 6e3, 1e3]))
STEP = 0.05
RECORD = np.random.default_rng(3).normal(size=61) * 4 * np.hanning(61)


def refined(force, parts):
    """Samples of the same force, so many times denser."""
    time, dense = np.arange(len(force)), np.arange((len(force) - 1) * parts + 1) / parts
    return np.stack([np.interp(dense, time, column) for column in force.T], axis=1)


def test_elastic_perfectly_plastic_under_a_step_force():
    run = oscillator(np.full(11, 0.75), 0.1)
    # Closed forms in pieces, written to 15 digits after the point.
    expected = [0.00344773270598895, 0.010621935423531, 0.016219586326019, 0.0199153699715823, 0.0188036277033006]
    np.testing.assert_allclose(run.displacement[[1, 2, 3, 5, 10], 0], expected, rtol=0, atol=1e-15)
    # Ductility 1/2 / (1 - F0 / fy) = 2, between two samples: 0.01 m of yield, and 1 N over it dissipated.
    assert run.peak_storey_drift[0] == pytest.approx(0.02, abs=1e-15)
    assert run.hysteretic_energy[-1, 0] == pytest.approx(0.01, abs=1e-15)
    assert run.displacement[-1, 0] - 0.01 * run.memory[-1, 0] == pytest.approx(0.01, abs=1e-15)  # plastic drift
    at_peak = oscillator(np.full(11, 0.75), 0.0473906036099521)
    assert at_peak.displacement[-1, 0] == pytest.approx(0.02, abs=1e-15)
    assert at_peak.velocity[-1, 0] == pytest.approx(0.0, abs=1e-15)
    assert at_peak.hysteretic_energy[-1, 0] == pytest.approx(0.01, abs=1e-15)
    yielding = oscillator(np.full(2, 0.75), 0.191063323624902)
    assert yielding.displacement[-1, 0] == pytest.approx(0.01, abs=1e-15)
    assert yielding.hysteretic_energy[-1, 0] < 1e-15


@pytest.mark.parametrize(
    ("hardening_ratio", "instant", "peak", "dissipated"),
    # With hardening: energy 0.045 J in, less 1/2 k u_y^2 and the elastic energy beyond yield, by hand from u_max.
    [(0.0, 0.316826403420031, 0.05, 0.04), (0.1, 0.264743837474769, 0.0441640786499874, 0.9 * 0.0341640786499874)],
)
@pytest.mark.parametrize("samples", [2, 8])
@pytest.mark.parametrize("sign", [1, -1])
def test_free_vibration_beyond_yield(hardening_ratio, instant, peak, dissipated, samples, sign, measured):
    run = oscillator(np.zeros(samples), instant / (samples - 1), hardening_ratio, initial_velocity=sign * 0.3)
    measured(
        "peak of a bilinear oscillator in free vibration (`wd.truth`)",
        truth="closed form by the energies of its spring",
        value=abs(run.displacement[-1, 0] - sign * peak),
        bound=1e-15,
        units="m",
    )
    assert run.hysteretic_energy[-1, 0] == pytest.approx(dissipated, abs=1e-15)
    run = oscillator(np.zeros(samples), 1.7 * instant / (samples - 1), hardening_ratio, initial_velocity=sign * 0.3)
    assert run.peak_storey_drift[0] == pytest.approx(peak, abs=1e-15)


@pytest.mark.parametrize("storeys", [2, 7, 20])
def test_storeys_that_yield_and_unload_together(storeys):
    # In the shape of equal drifts, which is a mode at 10 rad/s if each storey carries what is above it, also while all
    # of them yield. So every storey does what the oscillator does: 0.05 m, yield 0.04 m of it, and comes back.
    mass = np.linspace(2, 1, storeys)
    stiffness = 100.0 * np.cumsum((mass * np.arange(1, storeys + 1))[::-1])[::-1]
    run = bilinear_chain_response(
        mass, stiffness, 0.01 * stiffness, 0.0, np.zeros((storeys, storeys)), np.zeros((101, storeys)), 0.01,
        initial_velocity=0.3 * np.arange(1, storeys + 1),
    )  # fmt: skip
    alone = oscillator(np.zeros(101), 0.01, initial_velocity=0.3)
    assert alone.peak_storey_drift[0] == pytest.approx(0.05, abs=1e-15)
    # Rounding of the stiffness matrix, whose entries are as many times those of one drift as there are storeys.
    atol = 1e-14 * storeys
    np.testing.assert_allclose(run.displacement, alone.displacement * np.arange(1, storeys + 1), rtol=0, atol=atol)
    np.testing.assert_allclose(run.peak_storey_drift, 0.05, rtol=0, atol=atol)
    np.testing.assert_allclose(run.hysteretic_energy[-1], 0.04 * 0.01 * stiffness, rtol=1e-12)


def by_scipy_events(mass, stiffness, strength, hardening, damping, force, step, velocity):
    """Displacement, velocity and dissipated energy [time, storey], peaks, and how often a storey yielded.

    scipy's adaptive method with its own events, interval by interval, the storeys written as their forces.
    """
    n = len(mass)
    flow, plastic, peak, yields = np.zeros(n), np.zeros(n), np.zeros(n), 0

    def motion(y):
        return np.diff(y[:n], prepend=0), np.diff(y[n : 2 * n], prepend=0)  # of storeys

    def rate(t, y, start, end):
        drift, speed = motion(y)
        hysteretic = np.where(flow, flow * strength, stiffness * (drift - plastic))
        storey = hardening * stiffness * drift + (1 - hardening) * hysteretic
        balance = start + (end - start) * t / step - storey + np.append(storey[1:], 0) - damping @ y[n : 2 * n]
        return np.concatenate([y[n : 2 * n], balance / mass, (1 - hardening) * strength * np.abs(flow * speed)])

    def switch(storey):
        def gap(t, y, *ends):
            drift, speed = motion(y)
            return (np.where(flow, flow * speed, strength / stiffness - np.abs(drift - plastic)))[storey]

        gap.terminal, gap.direction = True, -1
        return gap

    events = [switch(storey) for storey in range(n)] + [lambda t, y, *e, s=s: motion(y)[1][s] for s in range(n)]
    state = np.concatenate([np.zeros(n), velocity, np.zeros(n)])
    history = [state]
    for ends in pairwise(force):
        time = 0.0
        while time < step:
            run = solve_ivp(
                rate, (time, step), state, "DOP853", events=events, args=ends, rtol=1e-12, atol=1e-14, max_step=0.01
            )
            time, state = run.t[-1], run.y[:, -1]
            for instant in [state, *(y for turns in run.y_events[n:] for y in turns)]:
                peak = np.maximum(peak, np.abs(motion(instant)[0]))
            for storey in range(n):
                if run.t_events[storey].size:
                    elastic = motion(state)[0] - plastic
                    if flow[storey]:
                        plastic[storey] += (elastic - flow * strength / stiffness)[storey]
                    flow[storey] = 0 if flow[storey] else np.sign(elastic[storey])
                    yields += flow[storey] != 0
        history.append(state)
    return *np.split(np.array(history), 3, axis=1), peak, yields


@pytest.mark.parametrize("hardening_ratio", [0.0, 0.1])
@pytest.mark.parametrize("storeys", [1, 2, 3])
def test_hysteresis_under_a_record(storeys, hardening_ratio, measured):
    mass, stiffness, strength = MASS[:storeys], STIFFNESS[:storeys], STRENGTH[:storeys] * (0.6 if storeys == 1 else 1)
    damping = DAMPING[:storeys, :storeys]
    force = -mass * RECORD[10:45, None]
    velocity = np.linspace(0.1, 0.2, storeys)
    run = bilinear_chain_response(mass, stiffness, strength, hardening_ratio, damping, force, STEP, velocity)
    displacement, speed, energy, peak, yields = by_scipy_events(
        mass, stiffness, strength, hardening_ratio, damping, force, STEP, velocity
    )
    assert yields >= 5  # or the comparison is empty
    assert (peak > 1.2 * strength / stiffness).all()
    # Adaptive steps at rtol 1e-12, and events to about 1e-12 s each, where velocities are below 1 m/s.
    for found, expected in (
        (run.displacement, displacement),
        (run.velocity, speed),
        (run.hysteretic_energy / strength, energy / strength),
        (run.peak_storey_drift, peak),
    ):
        measured(
            "event-exact chains of bilinear storeys under a record (`wd.truth`)",
            truth="scipy's DOP853 with an event at every yielding and turning, relative tolerance 1e-12",
            value=difference(found, expected) / max(1, np.abs(expected).max()),
            bound=1e-10,
        )


@pytest.mark.parametrize("hardening_ratio", [0.0, 0.05])
@pytest.mark.parametrize("strength", [0.2, 1.0])  # from yield at every turn to a few times
def test_samples_do_not_matter(hardening_ratio, strength):
    force = -MASS * RECORD[:, None]
    arguments = MASS, STIFFNESS, strength * STRENGTH, hardening_ratio, DAMPING
    run = bilinear_chain_response(*arguments, force, STEP)
    assert (run.hysteretic_energy[-1] > 0).all()
    dense = bilinear_chain_response(*arguments, refined(force, 13), STEP / 13)
    scale = np.abs(run.displacement).max()
    # The same motion in 13 times as many pieces, each off by rounding.
    np.testing.assert_allclose(dense.displacement[::13], run.displacement, rtol=0, atol=1e-13 * scale)
    np.testing.assert_allclose(dense.hysteretic_energy[::13], run.hysteretic_energy, rtol=1e-11)
    np.testing.assert_allclose(dense.peak_storey_drift, run.peak_storey_drift, rtol=1e-12)
    sampled = np.abs(np.diff(dense.displacement, prepend=0, axis=1)).max(axis=0)
    assert (sampled <= run.peak_storey_drift * (1 + 1e-12)).all()
    # Within the parabola at the peak, half the dense step away: 45 rad/s and forced accelerations of 4 m/s2 at most.
    assert (sampled >= run.peak_storey_drift - 0.5 * (STEP / 26) ** 2 * (45**2 * run.peak_storey_drift + 12)).all()


def test_energy_balance():
    parts = 200
    force = refined(-MASS * RECORD[:, None], parts)
    run = bilinear_chain_response(MASS, STIFFNESS, STRENGTH, 0.05, DAMPING, force, STEP / parts)
    drift = np.diff(run.displacement, prepend=0, axis=1)
    elastic = run.memory * STRENGTH / STIFFNESS
    stored = 0.5 * STIFFNESS * (0.05 * drift**2 + 0.95 * elastic**2)
    left = (0.5 * MASS * run.velocity[-1] ** 2 + stored[-1] + run.hysteretic_energy[-1]).sum()
    # Simpson's rule at 1/4000 s: twice 45 rad/s turn (90 / 4000)^4 / 180 = 1.4e-9 of what is in that mode, a tenth.
    work = simpson((force * run.velocity).sum(axis=1), dx=STEP / parts)
    viscous = simpson(np.einsum("ti,ij,tj->t", run.velocity, DAMPING, run.velocity), dx=STEP / parts)
    assert run.hysteretic_energy[-1].sum() > 0.2 * work
    assert left + viscous == pytest.approx(work, rel=1e-9)


def test_strong_storeys_follow_the_linear_solution():
    force = np.random.default_rng(1).normal(size=(60, 3)) * 1e3
    velocity, displacement = np.array([0.1, 0.0, -0.2]), np.array([0.01, 0.0, 0.02])
    run = bilinear_chain_response(MASS, STIFFNESS, 1e9, 0.3, DAMPING, force, 0.3, velocity, displacement)
    linear = piecewise_linear_response(
        MASS, DAMPING, chain_matrix(STIFFNESS), force, 0.3, initial_displacement=displacement, initial_velocity=velocity
    )
    # Rounding of a phase of 60 * 0.3 * 45 = 800 rad.
    np.testing.assert_allclose(run.displacement, linear[0], rtol=0, atol=1e-13 * np.abs(linear[0]).max())
    np.testing.assert_allclose(run.velocity, linear[1], rtol=0, atol=1e-13 * np.abs(linear[1]).max())
    assert not run.hysteretic_energy.any()
    dense = piecewise_linear_response(
        MASS, DAMPING, chain_matrix(STIFFNESS), refined(force, 300), 1e-3, displacement, velocity
    )[0]
    sampled = np.abs(np.diff(dense, prepend=0, axis=1)).max(axis=0)
    assert (sampled <= run.peak_storey_drift * (1 + 1e-12)).all()
    assert (sampled >= run.peak_storey_drift * (1 - 0.5 * (45 * 0.5e-3) ** 2)).all()  # the parabola at the peak


@pytest.mark.parametrize("samples", [2, 3, 5, 12, 33])
@pytest.mark.parametrize("beyond", [1e-3, 1e-6, 1e-9])
def test_a_peak_just_beyond_yield(samples, beyond):
    # Energy: 1/2 m v0^2 = 1/2 k u_y^2 + dissipated.
    speed = 0.1 * (1 + beyond)
    run = oscillator(np.zeros(samples), 0.5 / samples, initial_velocity=speed)
    assert run.hysteretic_energy[-1, 0] == pytest.approx(0.005 * beyond * (2 + beyond), abs=2e-16)
    # Just within yield: a sine, to rounding in each piece.
    run = oscillator(np.zeros(samples), 0.5 / samples, initial_velocity=0.1 * (1 - beyond))
    assert not run.hysteretic_energy.any()
    assert run.peak_storey_drift[0] == pytest.approx(0.01 * (1 - beyond), abs=2e-16)


@pytest.mark.parametrize("sign", [1, -1])
def test_yield_at_the_first_instant(sign):
    run = oscillator(np.zeros(3), 0.15, initial_displacement=sign * 0.01, initial_velocity=sign * 0.3)
    # A constant 1 N stops 1 kg at 0.3 m/s in 0.3 s and 0.045 m.
    assert run.displacement[-1, 0] == pytest.approx(sign * 0.055, abs=1e-15)
    assert run.hysteretic_energy[-1, 0] == pytest.approx(0.045, abs=1e-15)


def test_masses_may_rest_at_yield():
    # A force on the roof that every storey carries at its yield force, for as long as one likes.
    run = bilinear_chain_response(
        MASS, STIFFNESS, 1e3, 0.0, DAMPING, np.tile([0.0, 0.0, 1e3], (50, 1)), 0.1,
        initial_displacement=np.cumsum(1e3 / STIFFNESS),
    )  # fmt: skip
    np.testing.assert_allclose(run.displacement, np.tile(np.cumsum(1e3 / STIFFNESS), (50, 1)), rtol=1e-11)
    assert run.hysteretic_energy[-1].sum() < 1e-9
    run = oscillator(np.ones(50), 0.1, initial_displacement=0.01)
    np.testing.assert_allclose(run.displacement, 0.01, rtol=1e-12)
    assert run.hysteretic_energy[-1, 0] < 1e-14


def test_bad_input_is_named():
    good = {
        "mass": MASS, "stiffness": STIFFNESS, "yield_force": STRENGTH, "hardening_ratio": 0.1,
        "damping": DAMPING, "force": np.zeros((4, 3)), "step": 0.1,
    }  # fmt: skip
    for change, message in (
        ({"mass": 1.0}, r"mass must have shape \[storey\], got \(\)"),
        ({"mass": [1.0, 0.0, 1.0]}, "mass is 0 at storey 2; it must be finite and above 0"),
        ({"stiffness": [1.0, 2.0]}, r"stiffness must be one value or one per storey, shape \[3\], got \(2,\)"),
        ({"yield_force": -1.0}, "yield_force is -1 at storey 1; it must be finite and above 0"),
        ({"hardening_ratio": 1.0}, "hardening_ratio is 1 at storey 1; it must be finite and at least 0 and below 1"),
        ({"damping": 0.0}, r"damping must have shape \[3, 3\]"),
        ({"force": np.zeros(4)}, r"force must have shape \[time, 3\], got \(4,\)"),
        ({"force": np.full((4, 3), np.nan)}, r"force\[0, 0\] is nan"),
        ({"step": 0.0}, "step must be a finite number above 0"),
        ({"initial_velocity": np.inf}, "initial_velocity is inf"),
        ({"initial_displacement": [0.0, 0.0, 0.02]}, "puts storey 3 at 0.02 m; it must be within yield, 0.008 m"),
    ):
        with pytest.raises(ValueError, match=message):
            bilinear_chain_response(**good | change)
