"""Rocking and sliding blocks: integrations with SciPy, closed forms, published edges of overturning, invalid input."""

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import warpdyn as wd

G = 9.80665
BLOCK = wd.RockingBlock(half_width=0.25, half_height=1.0)


def sine(block, amplitude, w_over_p, points=4000, cycles=1.0):
    """Return sine cycles with an amplitude [g tan(alpha)] and a frequency [p of the block]."""
    omega = w_over_p * block.frequency
    time = np.linspace(0.0, cycles * 2 * np.pi / omega, points + 1)
    values = amplitude * block.static_acceleration * np.sin(omega * time)
    values[-1] = 0.0
    return wd.GroundMotion(values, time[1], "sine")


@pytest.mark.parametrize(
    ("size", "amplitude", "w_over_p", "ratio"),
    [((0.25, 1.0), 1.5, 5, 0.255141), ((0.25, 1.0), 2.5, 5, 0.714771), ((0.5, 2.5), 2.0, 4, None)],
)
def test_nonlinear_blocks_under_one_sine_cycle(size, amplitude, w_over_p, ratio):
    # Reference: integration of order 8 with a search for impacts.
    block = wd.RockingBlock(*size)
    found = wd.rocking_response(sine(block, amplitude, w_over_p), block, device="cpu")
    assert int(found["overturned"].item()) == (ratio is None)
    if ratio is None:
        assert float(found["peak_rotation"].item()) == pytest.approx(np.pi / 2)
        assert np.isfinite(found["time_of_overturning"].item())
    else:
        assert float(found["peak_rotation_ratio"].item()) == pytest.approx(ratio, rel=1e-5)


def with_scipy(block, motion, factor=1.0):
    """Return whether a block overturns and its largest rotation / alpha, by DOP853 with a search for impacts."""
    alpha, p, bound = block.slenderness, block.frequency, block.static_acceleration
    values = np.append(factor * motion.acceleration, [0.0, 0.0])
    times = motion.step * np.arange(values.size)
    times[-2:] = times[-3] + 1e-9, times[-3] + 15 / p
    side, state, peak = 1.0, None, 0.0  # no state: the block is at rest
    for first in range(values.size - 1):
        t, until = times[first : first + 2]
        slope = (values[first + 1] - values[first]) / (until - t)
        while t < until - 1e-12:
            a = values[first] + slope * (t - times[first])
            if state is None:
                if max(abs(a), abs(values[first + 1])) <= bound:
                    break
                side = -np.sign(a if abs(a) > bound else values[first + 1])
                t = t if abs(a) > bound else times[first] + (-side * bound - values[first]) / slope
                state = [0.0, 0.0]

            def rocks(now, y, s=side, begin=times[first], low=values[first], slope=slope):
                a = low + slope * (now - begin)
                return [y[1], -p * p * (np.sin(alpha * s - y[0]) + a / G * np.cos(alpha * s - y[0]))]

            def hits(now, y, s=side):
                return s * y[0]

            def falls(now, y, s=side):
                return s * y[0] - np.pi / 2

            hits.terminal, hits.direction, falls.terminal = True, -1, True
            options = dict(method="DOP853", rtol=1e-10, atol=1e-13, dense_output=True)
            found = solve_ivp(rocks, (t, until), state, events=[hits, falls], **options)
            inner = found.sol(np.linspace(t, found.t[-1], 400 if until - t > 0.1 else 20))
            peak = max(peak, np.abs(inner[0]).max() / alpha)
            if found.t_events[1].size:
                return True, peak
            t, state = found.t[-1], found.y[:, -1]
            if found.t_events[0].size:
                state, side = [0.0, block.coefficient_of_restitution * state[1]], -side
                if abs(state[1]) < 1e-5 * p * alpha:
                    state = None
    return False, peak


def test_a_random_motion_with_many_impacts():
    time, random = np.arange(0, 2.5, 0.02), np.random.default_rng(3)
    motion = wd.GroundMotion(4.0 * random.normal(size=time.size) * np.sin(np.pi * time / 2.5), 0.02, "noise")
    block = wd.RockingBlock(0.3, 1.2, restitution=0.85)
    found = wd.rocking_response(motion, block, device="cpu")
    assert found["impacts"].item() >= 3
    overturns, peak = with_scipy(block, motion)
    assert bool(found["overturned"].item()) == overturns
    assert found["peak_rotation_ratio"].item() == pytest.approx(peak, rel=1e-4)


def test_all_intervals_of_overturning():
    # Edges for w = 5 p: event search and bisection. The block stands again between 6.71 and 7.33.
    factors = np.linspace(1.05, 14.0, 1296)
    found = wd.overturning_intervals(sine(BLOCK, 1.0, 5), BLOCK, factors, device="cpu")
    np.testing.assert_allclose(found["overturning_from"].values.ravel(), [2.8486699, 7.3295877], rtol=1e-5)
    np.testing.assert_allclose(found["overturning_to"].values.ravel(), [6.70745, np.inf], rtol=1e-5)
    # For w = 3 p, SciPy confirms a second, narrow range in which the block stands.
    motion = sine(BLOCK, 1.0, 3)
    narrow = wd.overturning_intervals(motion, BLOCK, factors, device="cpu")
    assert narrow["overturning_from"].values.ravel()[0] == pytest.approx(1.4002816, rel=1e-5)
    assert narrow["interval_count"].item() == 2
    end, start = narrow["overturning_to"].values.ravel()[0], narrow["overturning_from"].values.ravel()[1]
    coarse = sine(BLOCK, 1.0, 3, points=100)
    outcomes = [with_scipy(BLOCK, coarse, each)[0] for each in (0.99 * end, 1.01 * end, 0.99 * start, 1.01 * start)]
    assert outcomes == [True, False, False, True]


def test_edges_at_the_ends_of_the_factors():
    motion = sine(BLOCK, 1.0, 5)
    found = wd.overturning_intervals(motion, {"a": BLOCK}, [3.0, 5.0, 7.0], device="cpu")
    assert found["overturning_from"].values.ravel().tolist() == [3.0]
    assert found["overturning_to"].values.ravel() == pytest.approx([6.70745], rel=1e-5)
    low = wd.overturning_intervals(motion, BLOCK, [0.5, 0.9], device="cpu")
    assert low["interval_count"].item() == 0
    assert np.isnan(low["overturning_from"].values).all()


@pytest.mark.parametrize(("w_over_p", "edge"), [(2.0, 1.80072), (5.0, 3.28915)])
def test_closed_form_of_slender_blocks_under_half_a_sine(w_over_p, edge):
    # The closed form is that of the linearised block; at alpha = 0.005 the difference is of the order alpha^2.
    block = wd.RockingBlock(0.005, 1.0)
    half = sine(block, 1.0, w_over_p, cycles=0.5)
    found = wd.overturning_intervals(half, block, np.linspace(1.1, 4.0, 60), device="cpu")
    assert found["overturning_from"].values.ravel() == pytest.approx([edge], rel=1e-4)


def test_a_block_that_does_not_rock():
    found = wd.rocking_response(sine(BLOCK, 0.999, 5), BLOCK, device="cpu")
    assert (found["peak_rotation"].item(), found["impacts"].item(), found["overturned"].item()) == (0.0, 0, 0)
    still = wd.sliding_response(sine(BLOCK, 0.999, 5), wd.SlidingBlock(0.25), device="cpu")
    assert still["peak_sliding_displacement"].item() == 0.0


def slide(values, step, friction):
    found = wd.sliding_response(wd.GroundMotion(values, step, "pulse"), wd.SlidingBlock(friction), device="cpu")
    return found["peak_sliding_displacement"].item(), found["residual_sliding_displacement"].item()


def test_newmarks_rectangular_pulse():
    peak, residual = slide(np.full(401, 3.0), 0.001, 0.1)
    expected = 3.0 * 0.4**2 / 2 * (3.0 / (0.1 * G) - 1)
    assert (peak, residual) == pytest.approx((expected, -expected), rel=1e-12)


@pytest.mark.parametrize(("n", "expected"), [(1.5, 0.0154386), (3.0, 0.182763), (6.0, 1.03308)])
def test_half_a_sine(n, expected):
    time = np.linspace(0.0, 0.4, 4001)
    peak, _ = slide(n * 0.12 * G * np.sin(2 * np.pi * time / 0.8), time[1], 0.12)
    assert peak == pytest.approx(expected, rel=1e-5)


def test_sliding_in_both_directions():
    time = np.arange(2001) * 0.01
    pulse = 4.0 * np.sin(2 * np.pi * time / 0.8) * np.exp(-0.25 * time)
    assert slide(pulse, 0.01, 0.15) == pytest.approx((0.123243, -0.0920156), rel=1e-5)
    time = np.arange(801) * 0.001
    cycle = 3 * 0.12 * G * np.sin(2 * np.pi * time / 0.8)
    assert slide(cycle, 0.001, 0.12) == pytest.approx((0.135616, -0.0308639), rel=1e-5)


def run_with_histories():
    """Return a run as `simulate` returns it: two samples of two floors; the second sample ends early."""
    time = np.arange(400) * 0.01
    rows = np.sin(2 * np.pi * time[:, None] / 0.6) * np.array([[2.0, 6.0]])
    acceleration = np.stack([rows, 2 * rows])
    acceleration[1, 300:] = np.nan
    return xr.Dataset(
        {"acceleration": (("history", "time", "dof"), acceleration)},
        {"time": time, "dof": [1, 2], "history_sample": ("history", [0, 5])},
    )


def test_blocks_on_floors_are_those_on_the_motion_of_the_floor():
    run = run_with_histories()
    blocks = {"low": wd.RockingBlock(0.3, 0.6), "high": BLOCK}
    found = wd.rocking_response(run, blocks, device="cpu")
    assert found["peak_rotation"].dims == ("sample", "floor", "block")
    assert found["sample"].values.tolist() == [0, 5]
    for number, end in ((0, 400), (1, 300)):
        motion = wd.GroundMotion(run["acceleration"].values[number, :end, 1], 0.01, "floor 2")
        alone = wd.rocking_response(motion, blocks, device="cpu")
        xr.testing.assert_equal(
            found["peak_rotation"][number, 1].drop_vars(["sample", "floor"]),
            alone["peak_rotation"][0].drop_vars(["motion", "motion_name"]),
        )
    top = wd.sliding_response(run, wd.SlidingBlock(0.2), floors=2, device="cpu")
    assert top.sizes == {"sample": 2, "floor": 1, "block": 1}


def test_invalid_blocks():
    for given in (dict(half_width=0.0, half_height=1.0), dict(half_width=0.2, half_height=-1.0)):
        with pytest.raises(ValueError, match="above 0"):
            wd.RockingBlock(**given)
    with pytest.raises(ValueError, match="Exchange half_width= and half_height="):
        wd.RockingBlock(half_width=1.5, half_height=0.5)
    with pytest.raises(ValueError, match=r"restitution must be at most 1, got 1\.2"):
        wd.RockingBlock(0.2, 1.0, restitution=1.2)
    with pytest.raises(ValueError, match="above 0"):
        wd.SlidingBlock(0.0)
    with pytest.warns(UserWarning, match="not in cm or mm"):
        wd.RockingBlock(25.0, 100.0)
    with pytest.warns(UserWarning, match="probably slides"):
        wd.RockingBlock(0.6, 0.5)
    with pytest.warns(UserWarning, match=r"30 % is 0\.3"):
        wd.SlidingBlock(30.0)


def test_invalid_calls():
    motion, run = sine(BLOCK, 1.0, 5), run_with_histories()
    with pytest.raises(ValueError, match="unknown floor 3; the run has 1 to 2"):
        wd.rocking_response(run, BLOCK, floors=3)
    with pytest.raises(ValueError, match="remove floors="):
        wd.rocking_response(motion, BLOCK, floors=1)
    with pytest.raises(ValueError, match="has no histories"):
        wd.rocking_response(run.drop_vars("acceleration"), BLOCK)
    with pytest.raises(TypeError, match="must be a RockingBlock"):
        wd.rocking_response(motion, {"a": wd.SlidingBlock(0.2)})
    with pytest.raises(TypeError, match="dictionary of names"):
        wd.sliding_response(motion, [wd.SlidingBlock(0.2)])
    with pytest.raises(ValueError, match="above 0"):
        wd.rocking_response(motion, BLOCK, scale_factors=[0.0, 1.0])
    with pytest.raises(ValueError, match="2 increasing numbers"):
        wd.overturning_intervals(motion, BLOCK, [2.0, 1.0])
    with pytest.raises(ValueError, match="tolerance"):
        wd.overturning_intervals(motion, BLOCK, [1.0, 2.0], tolerance=0.0)
    with pytest.raises(TypeError, match="simulate stripes"):
        wd.overturning_intervals(run, BLOCK, [1.0, 2.0])
    with pytest.warns(UserWarning, match="shorter steps"):
        wd.rocking_response(wd.GroundMotion(np.sin(np.arange(20.0)), 0.1, "coarse"), BLOCK, device="cpu")
