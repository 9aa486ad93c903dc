"""The largest displacement of an oscillator between two points of a record, accurate to rounding.

Local extrema of the displacement are zeros of the velocity. The time between the two points is divided into pieces. A
piece is so short that it contains at most two zeros of the velocity. If there is one zero, the velocity changes its
sign in the piece. If there are two, the acceleration changes its sign between them, at a time that is known in closed
form. Newton's method within a bracket finds each zero. The search ends when a better zero could increase the
displacement by at most 1e-16 of the peak. Pieces in which the displacement cannot exceed the peak so far are skipped.
"""

from math import factorial

import warp as wp

from warpdyn.engine.methods.oscillator_increments import HIGHEST_POWER

double = wp.float64
_coefficients = wp.types.vector(length=HIGHEST_POWER + 3, dtype=double)
SERIES = wp.constant(_coefficients(*(1 / factorial(n) for n in range(HIGHEST_POWER + 3))))
LAST = wp.constant(HIGHEST_POWER + 2)
TERMS = wp.constant(HIGHEST_POWER + 1)

# The length of a piece is limited by LARGEST_NORM to far less than half a period, so that the acceleration has at most
# one zero, and exp(zeta omega t) is at most exp(1/6) = 1.18. The factor of the bound from the curvature is 1.18 / 8,
# rounded up.
BEND = wp.constant(double(0.15))
NEGLIGIBLE = wp.constant(double(1e-16))  # largest possible gain, relative to the peak, at which the search stops
MOST_TRIALS = wp.constant(60)  # after 60 bisections the bracket is as small as the rounding of float64


@wp.func
def opposite(x: double, y: double):
    """Return whether two numbers have opposite signs."""
    return (x > double(0.0) and y < double(0.0)) or (x < double(0.0) and y > double(0.0))


@wp.func
def angle_to_zero(x: double, rate: double, decay: double, damped: double):
    """Return the smallest angle, from 0 to pi, at which a damped free vibration is zero.

    The vibration is exp(-decay t) (x cos(angle) + (rate + decay x) / damped sin(angle)) with angle = damped t; x and
    `rate` are its value and its derivative at t = 0, `decay` is its rate of decay, and `damped` its circular frequency
    [rad/s].
    """
    towards = wp.where(x < double(0.0), double(1.0), double(-1.0))
    return wp.atan2(wp.abs(x) * damped, towards * (rate + decay * x))


@wp.func
def moved(u: double, v: double, a: double, slope: double, t: double, stiffness: double, damping: double):
    """Return displacement and velocity of an oscillator after a time t, within a piece (see the module's docstring).

    The base acceleration is a + slope * t. methods/oscillator_increments.py does the same calculation on the host.

    Args:
        u: Displacement at the start [m].
        v: Velocity at the start [m/s].
        a: Base acceleration at the start [m/s2].
        slope: Rate of change of the base acceleration [m/s3].
        t: Time [s].
        stiffness: Stiffness / mass [1/s2].
        damping: Damping coefficient / mass [1/s].
    """
    w = stiffness * t * t
    d = damping * t
    g1 = double(0.0)
    g2 = double(0.0)
    for n in range(TERMS):
        total = SERIES[LAST - n] - w * g2 - d * g1
        g2 = g1
        g1 = total
    g0 = double(1.0) - d * g1 - w * g2
    later_u = u + (t * g0 * v - w * g1 * u - t * t * (g1 * a + g2 * slope * t))
    later_v = v - (stiffness * t * g0 * u + (w * g1 + d * g0) * v + t * (g0 * a + g1 * slope * t))
    return later_u, later_v


@wp.func
def at_rest(
    u: double,
    v: double,
    a: double,
    slope: double,
    begin: double,
    end: double,
    v_begin: double,
    v_end: double,
    peak: double,
    stiffness: double,
    damping: double,
):
    """Return the displacement [m] at the time between `begin` and `end` at which the velocity is zero.

    The velocities `v_begin` and `v_end` at these times have opposite signs. The other arguments are those of `moved`.
    """
    low = begin
    high = end
    t = begin + (end - begin) * v_begin / (v_begin - v_end)
    here = double(0.0)
    trial = int(0)
    while trial < MOST_TRIALS:
        here, speed = moved(u, v, a, slope, t, stiffness, damping)
        ahead = double(1.0)
        if opposite(speed, v_begin):
            high = t
            ahead = double(-1.0)
        else:
            low = t
        change = speed / (a + slope * t + damping * speed + stiffness * here)
        # Newton's step is trusted if it goes towards the zero and not past the bracket's other end.
        if ahead * change >= double(0.0) and ahead * change < high - low:
            if wp.abs(speed * change) <= NEGLIGIBLE * peak:
                break
            t += change
        else:
            if speed == double(0.0):
                break
            t = double(0.5) * (low + high)
        trial += 1
    return here


@wp.func
def searched(
    peak: double,
    start_u: double,
    start_v: double,
    start: double,
    slope: double,
    t: double,
    pieces: int,
    stiffness: double,
    damping: double,
    decay: double,
    damped: double,
):
    """Return the largest displacement [m] in an interval of the record, or `peak` if `peak` is larger.

    The interval is searched in `pieces` pieces of length t [s]. `start_u` [m], `start_v` [m/s] and `start` [m/s2] are
    displacement, velocity and base acceleration at its start; the other arguments are those of `moved` and
    `angle_to_zero`.
    """
    u = start_u
    v = start_v
    largest = peak
    for k in range(pieces):
        a = start + slope * (double(k) * t)
        a_end = a + slope * t
        u_end, v_end = moved(u, v, a, slope, t, stiffness, damping)
        end = wp.max(wp.abs(u), wp.abs(u_end))
        largest = wp.max(largest, end)
        bend = BEND * t * t
        if end + bend * wp.max(wp.abs(a), wp.abs(a_end)) > (double(1.0) - bend * stiffness) * largest:
            middle = t
            v_middle = v_end
            if not opposite(v, v_end):
                rate = -(a + damping * v + stiffness * u)
                rate_end = -(a_end + damping * v_end + stiffness * u_end)
                if opposite(rate, rate_end):
                    jerk = -(slope + damping * rate + stiffness * v)
                    middle = wp.min(t, angle_to_zero(rate, jerk, decay, damped) / damped)
                    _u, v_turn = moved(u, v, a, slope, middle, stiffness, damping)
                    v_middle = v_turn
            if opposite(v, v_middle):
                rest = at_rest(u, v, a, slope, double(0.0), middle, v, v_middle, largest, stiffness, damping)
                largest = wp.max(largest, wp.abs(rest))
            if opposite(v_middle, v_end):
                rest = at_rest(u, v, a, slope, middle, t, v_middle, v_end, largest, stiffness, damping)
                largest = wp.max(largest, wp.abs(rest))
        u = u_end
        v = v_end
    return largest
