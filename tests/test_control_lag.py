"""Actuators whose force lags behind its command, against matrix exponentials and transfer functions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from validation import difference

import warpdyn as wd

control = wd.control
FRAME = wd.ShearBuilding([1e5, 8e4], [4e7, 3e7], 3.0, damping="storey", damping_coefficient=2e5)
TIME_CONSTANT, FREQUENCY, RATIO, INTERVAL = 0.03, 8.0, 0.6, 0.02  # s, Hz, 1, s
LAGGING = [
    control.Actuator(1, time_constant=TIME_CONSTANT),
    control.Actuator(2, frequency=FREQUENCY, damping_ratio=RATIO),
]
REGULATOR = control.lqr(FRAME, LAGGING, force_weight=1e-8)
CONTROL = control.Control(LAGGING, regulator=REGULATOR, sampling_interval=INTERVAL)
TURN = 2 * np.pi * FREQUENCY


def matrices() -> tuple[np.ndarray, np.ndarray]:
    """A and B of (u1, u2, v1, v2, first force, second force, rate of the second force), written out by hand."""
    mass, stiffness = np.diag([1e5, 8e4]), np.array([[7e7, -3e7], [-3e7, 3e7]])
    damping, places = np.array([[4e5, -2e5], [-2e5, 2e5]]), np.array([[1.0, -1.0], [0.0, 1.0]])
    a, b = np.zeros((7, 7)), np.zeros((7, 2))
    a[:2, 2:4] = np.eye(2)
    a[2:4, :2], a[2:4, 2:4] = -np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)
    a[2:4, 4:6] = np.linalg.solve(mass, places)
    a[4, 4], b[4, 0] = -1 / TIME_CONSTANT, 1 / TIME_CONSTANT
    a[5, 6], a[6, 5], a[6, 6], b[6, 1] = 1.0, -(TURN**2), -2 * RATIO * TURN, TURN**2
    return a, b


def test_forces_of_first_and_second_order_follow_the_sampled_loop():
    a, b = matrices()
    whole = expm(INTERVAL * np.block([[a, b], [np.zeros((2, 9))]]))
    growth, driven = whole[:7, :7], whole[:7, 7:]
    state, states = np.array([0.01, 0.02, 0, 0, 0, 0, 0]), []
    for _ in range(41):
        states.append(state)
        state = growth @ state - driven @ REGULATOR.gain @ state[:4]
    start = wd.FreeVibration(displacement=[0.01, 0.02], velocity=[0.0, 0.0], duration=40 * INTERVAL)
    scene = wd.Scene(FRAME, start, recorders=("drift",), control=CONTROL)
    given = {"step": INTERVAL / 40, "dtype": "float64", "method": "rk4", "device": "cpu"}
    run = wd.simulate(scene, histories=wd.Histories([0]), **given)
    due = np.array(states)
    # RK4 with 40 steps per sampling interval: steps of 1/40 of the shortest time of an actuator (errors below 1e-7)
    assert difference(run["displacement"].values[0, ::40], due[:, :2]) < 1e-6 * 0.02
    force = run["control_force"].values[0, ::40]
    np.testing.assert_allclose(force, due[:, 4:6], atol=1e-6 * np.abs(due[:, 4:6]).max())
    closed = growth.copy()
    closed[:, :4] -= driven @ REGULATOR.gain
    found = control.sampled_eigenvalues(FRAME, CONTROL)
    expected = np.linalg.eigvals(closed)
    expected = expected[np.argsort(-np.abs(expected))]
    np.testing.assert_allclose(np.abs(found[:7]), np.abs(expected), rtol=1e-9, atol=1e-12)
    a[:, :4] -= b @ REGULATOR.gain
    found = control.closed_loop_eigenvalues(FRAME, LAGGING, REGULATOR)
    np.testing.assert_allclose(np.sort(found.real), np.sort(np.linalg.eigvals(a).real), rtol=1e-9)


@pytest.mark.parametrize(
    ("lag", "order"),
    [({"time_constant": 0.02}, 1), ({"frequency": 6.0, "damping_ratio": 0.7}, 2)],
    ids=["first order", "second order"],
)
def test_delay_margin_with_a_lag_is_that_of_the_transfer_functions(lag, order):
    mass, turn, ratio, gain = 1e3, 2 * np.pi, 0.02, 2e3  # velocity feedback [N s/m]
    oscillator = wd.ShearBuilding(
        mass, mass * turn**2, 3.0, damping="storey", damping_coefficient=2 * ratio * turn * mass
    )

    def loop(w):
        s = 1j * w
        if order == 1:
            actuator = 1 / (1 + 0.02 * s)
        else:
            own = 2 * np.pi * 6.0
            actuator = own**2 / (s**2 + 1.4 * own * s + own**2)
        return gain * s * actuator / (mass * (s**2 + 2 * ratio * turn * s + turn**2))

    grid = np.linspace(0.1, 60.0, 2000)
    sign = np.sign(np.abs(loop(grid)) - 1)
    crossings = [
        brentq(lambda w: abs(loop(w)) - 1, grid[place], grid[place + 1], xtol=1e-13)
        for place in np.flatnonzero(np.diff(sign))
    ]
    due = min(np.angle(-loop(w)) % (2 * np.pi) / w for w in crossings)
    actuator, regulator = control.Actuator(1, **lag), control.Regulator([[0.0, gain]])
    found = control.delay_margin(oscillator, [actuator], regulator)
    assert found == pytest.approx(due, rel=1e-7)
    assert found < control.delay_margin(oscillator, [control.Actuator(1)], regulator)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"time_constant": 0.0}, "time_constant"),
        ({"time_constant": 0.02, "frequency": 5.0, "damping_ratio": 0.7}, "either time_constant="),
        ({"frequency": 5.0}, "add, for example, damping_ratio=0.7"),
        ({"damping_ratio": 0.7}, r"add, for example, frequency=10.0 \[Hz\]"),
    ],
)
def test_wrong_lags_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        control.Actuator(1, **arguments)


@pytest.mark.parametrize("damping_ratio", [0.02, 0.3, 0.5, 0.7, 1.0, 3.0])
def test_longest_steps_of_lags_are_those_at_which_heun_and_rk4_do_not_grow(damping_ratio):
    actuator = control.Actuator(1, frequency=5.0, damping_ratio=damping_ratio)
    step = 2.0 / actuator.fastest_rate(1.0)  # the regulator of a Control adds no eigenvalue, because commands are held
    root = np.sqrt(complex(damping_ratio**2 - 1))
    z = step * 2 * np.pi * 5.0 * np.array([-damping_ratio - root, -damping_ratio + root])
    heun, rk4 = 1 + z + z**2 / 2, 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24
    # At the limit, the growth factor of one method is 1, within rounding of the root of the cubic equation.
    assert np.abs(heun).max() < 1 + 1e-12
    assert np.abs(rk4).max() < 1 + 1e-12
    if damping_ratio <= 0.5:  # the limit is not shorter than necessary
        assert np.abs(heun).max() > 1 - 1e-12


def test_a_lag_in_milliseconds_is_reported():
    with wd.meant_as_given("actuator_time_constant"):
        late = [control.Actuator(1, time_constant=20.0)]
    loop = control.Control(late, regulator=control.lqr(FRAME, late, force_weight=1e-8), sampling_interval=INTERVAL)
    with pytest.warns(UserWarning, match="lags behind its command by 90 degrees .* time_constant= is in seconds"):
        loop.check(FRAME, base_components=1)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"frequency": 8.0, "damping_ratio": 70.0},
            "damping_ratio of the actuator is 70 .*in percent, it would be 0.7",
        ),
        ({"time_constant": 20.0}, "time_constant of the actuator is 20 s .*given in ms, it would be 0.02 s"),
        ({"frequency": 8000.0, "damping_ratio": 0.7}, "frequency of the actuator is 8000 Hz"),
        ({"stroke_limit": 300.0}, "stroke_limit of the actuator is 300 m .*given in mm, it would be 0.3 m"),
    ],
)
def test_an_implausible_lag_gets_a_warning(arguments, message):
    with pytest.warns(UserWarning, match=message):
        control.Actuator(1, **arguments)


@pytest.mark.fast
def test_a_lag_with_a_wrong_name_or_an_infinite_rate_is_refused():
    with pytest.raises(TypeError, match=r"has no argument 'time_constat' .did you mean 'time_constant'"):
        control.Actuator(1, time_constat=0.02)
    for arguments in ({"frequency": 1e300, "damping_ratio": 0.7}, {"time_constant": 1e-320}):
        with pytest.raises(ValueError, match="not finite: check the unit of"):
            control.Actuator(1, **arguments)
    with pytest.raises(ValueError, match=r"rate .1/s. must be a finite number, got .a."):
        control.Actuator(1, time_constant=0.02).phase_lag("a")
