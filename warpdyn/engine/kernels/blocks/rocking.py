"""The kernel of rocking blocks (Housner 1963): RK4 between impacts, whose times are found by a search.

A block rotates by theta about the corner on the side s = 1 or -1. Its equation of motion is

    theta'' = -p^2 (sin(s alpha - theta) + (a / g) cos(s alpha - theta)).

The block starts to rock if |a| > g tan(alpha), at the time at which the linear base acceleration passes this bound. At
an impact (theta = 0) the side changes and the angular velocity is multiplied by the coefficient of restitution. After
the end of the motion, energies decide in closed form whether the block overturns and which rotation it reaches.
"""

import functools
import math

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.blocks.histories import BaseHistories, filled, launched
from warpdyn.engine.kernels.functions.oscillators import largest_between

double = wp.float64
STEP = 0.02  # largest p h of a step of RK4
FLAT = wp.constant(double(0.5 * math.pi))  # rotation at which a block lies on its side
SEARCHES = wp.constant(60)  # most iterations of the search for an impact
IMPACTS = wp.constant(20)  # most impacts in a step; then the block is at rest
AT_REST = wp.constant(double(1e-7))  # angular velocity / (p alpha) after an impact at which the block is at rest
CLOSE = wp.constant(double(1e-13))  # the search ends at |theta| / alpha below this bound


@wp.struct
class RockingBlocks:
    """Rocking blocks, [block]."""

    slenderness: wp.array(dtype=double)  # angle alpha [rad]
    frequency: wp.array(dtype=double)  # parameter p [rad/s]
    restitution: wp.array(dtype=double)  # angular velocity after an impact / before [1]
    static_acceleration: wp.array(dtype=double)  # g tan(alpha) [m/s2]
    gravity: double  # [m/s2]


@wp.func
def angular_acceleration(theta: double, a: double, side: double, alpha: double, p: double, g: double):
    """Return theta'' [rad/s2] at a rotation [rad] and a base acceleration a [m/s2]; other arguments: see the module."""
    angle = side * alpha - theta
    return -p * p * (wp.sin(angle) + a / g * wp.cos(angle))


@wp.func
def rotated(
    theta: double, rate: double, a: double, slope: double, h: double, side: double, alpha: double, p: double, g: double
):
    """Return rotation [rad] and angular velocity [rad/s] after a step h [s] of RK4.

    The base acceleration is a + slope * time [m/s2]; `side`, `alpha`, `p` and `g` are those of the module.
    """
    half = double(0.5) * h
    middle = a + slope * half
    k1 = angular_acceleration(theta, a, side, alpha, p, g)
    k2 = angular_acceleration(theta + half * rate, middle, side, alpha, p, g)
    k3 = angular_acceleration(theta + half * (rate + half * k1), middle, side, alpha, p, g)
    k4 = angular_acceleration(theta + h * (rate + half * k2), a + slope * h, side, alpha, p, g)
    moved = theta + h * (rate + h / double(6.0) * (k1 + k2 + k3))
    return moved, rate + h / double(6.0) * (k1 + double(2.0) * (k2 + k3) + k4)


@wp.func
def time_of_impact(
    theta: double, rate: double, a: double, slope: double, h: double, side: double, alpha: double, p: double, g: double
):
    """Return the time [s] within a step h at which the rotation is zero; it has the sign -side at the end of the step.

    Arguments: see `rotated`. Newton's method within a bracket.
    """
    low = double(0.0)
    high = h
    end, _end_rate = rotated(theta, rate, a, slope, h, side, alpha, p, g)
    t = h
    if theta != double(0.0):
        t = h * theta / (theta - end)
    for _search in range(SEARCHES):
        here, speed = rotated(theta, rate, a, slope, t, side, alpha, p, g)
        if wp.abs(here) <= CLOSE * alpha and t > double(0.0) and side * speed <= double(0.0):
            break
        if side * here > double(0.0) or (side * here == double(0.0) and side * speed > double(0.0)):
            low = t
        else:
            high = t
        step = double(0.0)
        if speed != double(0.0):
            step = -here / speed
        t_next = t + step
        if not (t_next > low and t_next < high) or step == double(0.0):
            t_next = double(0.5) * (low + high)
        t = t_next
    return t


@wp.func
def after_the_motion(theta: double, rate: double, side: double, alpha: double, p: double, restitution: double):
    """Return whether a freely rocking block overturns (1 or 0), and the largest rotation [rad] that it still reaches.

    The energy rate^2 / 2 + p^2 cos(alpha - |theta|) is constant between impacts; p^2 is the energy at |theta| = alpha.
    """
    size = side * theta
    outward = side * rate
    energy = double(0.5) * rate * rate + p * p * wp.cos(alpha - size)
    top = p * p
    overturns = int(0)
    largest = size
    if size > alpha and (outward >= double(0.0) or energy < top):
        overturns = 1  # beyond the top, and never back
    elif outward > double(0.0) and energy >= top:
        overturns = 1
    elif outward > double(0.0):
        largest = alpha - wp.acos(wp.clamp(energy / top, double(-1.0), double(1.0)))
    # The first impact, at the bottom of the energy.
    floor = top * wp.cos(alpha)
    left = floor + restitution * restitution * wp.max(energy - floor, double(0.0))
    if overturns == 0:
        if left >= top:
            overturns = 1
        else:
            largest = wp.max(largest, alpha - wp.acos(wp.clamp(left / top, double(-1.0), double(1.0))))
    return overturns, largest


@functools.cache
def rocking_kernel() -> wp.Kernel:
    """Return the kernel of rocking blocks."""

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def rock(
        first_element: int,
        histories: BaseHistories,
        blocks: RockingBlocks,
        factors: wp.array2d(dtype=double),  # scale factors, [history x block, factor]
        peak_rotation: wp.array(dtype=double),  # [element]
        time_of_overturning: wp.array(dtype=double),
        impacts: wp.array(dtype=wp.int32),
    ):
        element = first_element + wp.tid()
        count = factors.shape[1]
        row = element // count
        of_block = blocks.slenderness.shape[0]
        history = row // of_block
        b = row - history * of_block
        factor = factors[row, element - row * count]
        alpha = blocks.slenderness[b]
        p = blocks.frequency[b]
        restitution = blocks.restitution[b]
        bound = blocks.static_acceleration[b]
        g = blocks.gravity
        step = histories.step[history]
        first = histories.first[history]
        substeps = int(wp.ceil(p * step / double(STEP)))
        h = step / double(substeps)

        theta = double(0.0)
        rate = double(0.0)
        side = double(1.0)
        rocks = int(0)
        peak = double(0.0)
        overturned = double(-1.0)  # time of overturning
        hits = int(0)
        intervals = histories.intervals[history]
        for interval in range(intervals):
            start = factor * histories.acceleration[first + interval]
            slope = (factor * histories.acceleration[first + interval + 1] - start) / step
            for substep in range(substeps):
                if overturned < double(0.0):
                    a = start + slope * (double(substep) * h)
                    rest = h  # time left in the step
                    trial = int(0)
                    while rest > double(0.0) and trial < IMPACTS:
                        trial += 1
                        if rocks == 0:
                            end = a + slope * rest
                            if wp.abs(a) > bound:
                                rocks = 1
                                side = wp.where(a < double(0.0), double(1.0), double(-1.0))
                            elif wp.abs(end) > bound:
                                rocks = 1
                                side = wp.where(end < double(0.0), double(1.0), double(-1.0))
                                wait = wp.clamp((-side * bound - a) / slope, double(0.0), rest)
                                a += slope * wait
                                rest -= wait
                            else:
                                rest = double(0.0)
                            theta = double(0.0)
                            rate = double(0.0)
                        if rest > double(0.0):
                            end_theta, end_rate = rotated(theta, rate, a, slope, rest, side, alpha, p, g)
                            if side * end_theta >= double(0.0):
                                peak = wp.max(peak, largest_between(theta, end_theta, rate * rest, end_rate * rest))
                                theta = end_theta
                                rate = end_rate
                                rest = double(0.0)
                                if side * theta >= FLAT:
                                    overturned = step * double(interval) + h * double(substep + 1)
                                    peak = FLAT
                            else:
                                t = time_of_impact(theta, rate, a, slope, rest, side, alpha, p, g)
                                _hit_theta, hit_rate = rotated(theta, rate, a, slope, t, side, alpha, p, g)
                                a += slope * t
                                rest -= t
                                hits += 1
                                theta = double(0.0)
                                rate = restitution * hit_rate
                                side = -side
                                if wp.abs(rate) <= AT_REST * p * alpha and wp.abs(a) <= bound:
                                    rocks = 0
                                    rate = double(0.0)
                    if rest > double(0.0):  # very many impacts: the block is at rest
                        rocks = 0
                        rate = double(0.0)
                        theta = double(0.0)
        if overturned < double(0.0) and rocks == 1:
            falls, largest = after_the_motion(theta, rate, side, alpha, p, restitution)
            peak = wp.max(peak, largest)
            if falls == 1:
                peak = FLAT
                overturned = step * double(intervals)
        peak_rotation[element] = peak
        if overturned >= double(0.0):
            time_of_overturning[element] = overturned
        impacts[element] = hits

    return rock


def rocked(
    histories: dict[str, np.ndarray], blocks: dict[str, np.ndarray], factors: np.ndarray, device: str, threads: int
) -> dict[str, np.ndarray]:
    """Return peak rotation, time of overturning and number of impacts of blocks under scaled base accelerations.

    Args:
        histories: The arrays of `BaseHistories`: {field: array}.
        blocks: The arrays of `RockingBlocks`: {field: array}.
        factors: Factors on the base accelerations [1], shape [history, block, factor].
        device: Warp device, such as "cpu" or "cuda:0".
        threads: Number of CPU threads.

    Returns:
        `peak_rotation` [rad], `time_of_overturning` [s] (NaN if the block stands; the end of the motion if it
        overturns later) and `impacts`, the number of impacts during the motion, each of the shape of `factors`.
    """
    shape = factors.shape
    size = (factors.size,)
    outputs = {"peak_rotation": (size, double), "time_of_overturning": (size, double), "impacts": (size, wp.int32)}
    inputs = [
        filled(BaseHistories, histories, device),
        filled(RockingBlocks, {k: v for k, v in blocks.items() if k != "gravity"}, device),
        wp.array(factors.reshape(-1, shape[-1]), dtype=double, device=device),
    ]
    inputs[1].gravity = float(blocks["gravity"])
    found = launched(rocking_kernel(), inputs, outputs, device, threads)
    return {name: values.reshape(shape) for name, values in found.items()}
