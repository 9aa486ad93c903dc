"""Device functions of magnetorheological dampers: the modified Bouc-Wen model of Spencer, Dyke, Sain and Carlson.

    f  = c1 y' + k1 (x - x0)
    y' = (alpha z + c0 x' + k0 (x - y)) / (c0 + c1)
    z' = -gamma |x' - y'| z |z| - beta (x' - y') z^2 + A (x' - y')
    alpha = alpha_a + alpha_b u,  c1 = c1a + c1b u,  c0 = c0a + c0b u,  u' = -eta (u - v)

x is the drift, f the force that resists it, v the voltage. z depends only on the path of x - y, so it is computed
exactly from the change of x - y within a step. (The differential equation of z has rates above 10,000 1/s.)
"""

# No `from __future__ import annotations`: Warp needs the types of annotations, not their text.

from typing import Any

import warp as wp

#: Names of the parameters in the order in which `damper_response` reads them.
NAMES = (
    *("dashpot_0", "dashpot_0_per_volt", "stiffness_0", "dashpot_1", "dashpot_1_per_volt", "stiffness_1"),
    *("offset", "alpha", "alpha_per_volt", "gamma", "beta", "slope", "voltage_rate"),
)
C0, C0_VOLT, K0, C1, C1_VOLT, K1, OFFSET, ALPHA, ALPHA_VOLT, GAMMA, BETA, SLOPE, ETA = range(len(NAMES))
WIDTH = len(NAMES)
SAME = wp.constant(wp.float64(1e-9))  # relative difference of beta and gamma below which they count as equal


@wp.func
def followed_loop(z: Any, move: Any, gamma: Any, beta: Any, slope: Any):
    """Return the evolutionary variable z after x - y has changed by `move`, for dz = (A - z^2 (...)) d(x - y).

    Towards zero the bracket is beta - gamma, and away from zero beta + gamma. Each part has a closed form.
    """
    one = type(z)(1.0)
    zero = type(z)(0.0)
    side = wp.where(move < zero, -one, one)
    here = side * z  # by symmetry, x - y increases
    rest = side * move
    if here < zero:
        less = beta - gamma
        size = wp.abs(less)
        if size <= type(z)(SAME) * (beta + gamma):
            reached = here + slope * rest
            rest = rest + here / slope  # what is left after z has reached 0
            if reached < zero:
                return side * reached
        else:
            limit = wp.sqrt(slope / size)
            ratio = here / limit
            turn = slope * rest / limit
            if less > zero:
                grown = wp.tanh(turn)
                if ratio + grown < zero:
                    return side * limit * (ratio + grown) / (one + ratio * grown)
                rest = rest - type(z)(0.5) * wp.log((one - ratio) / (one + ratio)) * limit / slope
            else:
                needed = wp.atan(-ratio)
                if turn < needed:
                    return side * limit * wp.tan(turn - needed)
                rest = rest - needed * limit / slope
        here = zero
        rest = wp.max(rest, zero)
    bound = wp.sqrt(slope / (beta + gamma))
    part = here / bound
    risen = wp.tanh(slope * rest / bound)
    return side * bound * (part + risen) / (one + part * risen)


@wp.func
def damper_response(
    parameters: Any, first: int, drift: Any, rate: Any, inner: Any, volts: Any, z: Any, reference: Any, voltage: Any
):
    """Return the force on the upper end [N], the rate of the inner displacement [m/s] and of the voltage [V/s].

    Args:
        parameters: Array with the parameters of all dampers, in the order of NAMES.
        first: Place of the damper's first parameter.
        drift: Displacement between the ends [m].
        rate: Velocity between the ends [m/s].
        inner: Inner displacement y [m].
        volts: Filtered voltage [V].
        z: Evolutionary variable at the start of the step [m].
        reference: Drift minus inner displacement at the start of the step [m].
        voltage: Command [V].
    """
    now = followed_loop(
        z,
        drift - inner - reference,
        parameters[first + GAMMA],
        parameters[first + BETA],
        parameters[first + SLOPE],
    )
    c0 = parameters[first + C0] + parameters[first + C0_VOLT] * volts
    c1 = parameters[first + C1] + parameters[first + C1_VOLT] * volts
    pull = parameters[first + ALPHA] + parameters[first + ALPHA_VOLT] * volts
    inner_rate = (pull * now + c0 * rate + parameters[first + K0] * (drift - inner)) / (c0 + c1)
    force = c1 * inner_rate + parameters[first + K1] * (drift - parameters[first + OFFSET])
    return -force, inner_rate, parameters[first + ETA] * (voltage - volts)
