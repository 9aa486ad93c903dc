"""The kernel of sliding blocks (Coulomb friction; Newmark 1965): exact for a base acceleration linear between samples.

The velocity v of a block relative to its base follows v' = -a - mu g sign(v) while it slides. A block at rest starts to
slide if |a| > mu g. Between two events (start, stop), v is quadratic and the displacement is cubic in time.
"""

import functools

import numpy as np
import warp as wp

from warpdyn.engine.device.processor import module_options
from warpdyn.engine.kernels.blocks.histories import BaseHistories, filled, launched

double = wp.float64
MOST_EVENTS = wp.constant(12)  # in an interval, in which a linear acceleration allows at most 4


@wp.func
def time_of_stop(v: double, deceleration: double, slope: double, longest: double):
    """Return the first positive time [s] at which v + deceleration t + slope t^2 / 2 is zero; `longest` if it is later.

    Args:
        v: Speed in the direction of sliding [m/s], at least 0.
        deceleration: Its rate of change at the start [m/s2].
        slope: Rate of change of this rate [m/s3].
        longest: Longest time [s].
    """
    half = double(0.5) * slope
    root = deceleration * deceleration - double(4.0) * half * v
    t = longest
    if root >= double(0.0):
        # Both roots without cancellation.
        q = double(-0.5) * (
            deceleration + wp.where(deceleration < double(0.0), double(-1.0), double(1.0)) * wp.sqrt(root)
        )
        if half != double(0.0):
            one = q / half
            if one > double(0.0) and one < t:
                t = one
        if q != double(0.0):
            other = v / q
            if other > double(0.0) and other < t:
                t = other
    return t


@functools.cache
def sliding_kernel() -> wp.Kernel:
    """Return the kernel of sliding blocks."""

    @wp.kernel(module="unique", enable_backward=False, module_options=module_options(max_unroll=1))
    def slide(
        first_element: int,
        histories: BaseHistories,
        resistances: wp.array(dtype=double),  # friction coefficient times gravity [m/s2], [block]
        factors: wp.array2d(dtype=double),  # scale factors, [history x block, factor]
        peak_displacement: wp.array(dtype=double),  # [element]
        residual_displacement: wp.array(dtype=double),
    ):
        element = first_element + wp.tid()
        count = factors.shape[1]
        row = element // count
        of_block = resistances.shape[0]
        history = row // of_block
        resistance = resistances[row - history * of_block]
        factor = factors[row, element - row * count]
        step = histories.step[history]
        first = histories.first[history]
        v = double(0.0)  # relative to the base
        x = double(0.0)
        peak = double(0.0)
        side = double(0.0)  # direction of sliding; 0: the block is at rest
        for interval in range(histories.intervals[history]):
            a = factor * histories.acceleration[first + interval]
            slope = (factor * histories.acceleration[first + interval + 1] - a) / step
            rest = step
            event = int(0)
            while rest > double(0.0) and event < MOST_EVENTS:
                event += 1
                if side == double(0.0):
                    if wp.abs(a) > resistance:
                        side = wp.where(a > double(0.0), double(-1.0), double(1.0))
                    elif wp.abs(a + slope * rest) > resistance:
                        side = wp.where(slope > double(0.0), double(-1.0), double(1.0))
                        wait = wp.clamp((-side * resistance - a) / slope, double(0.0), rest)
                        a = -side * resistance
                        rest -= wait
                    else:
                        rest = double(0.0)
                    v = double(0.0)
                if rest > double(0.0):
                    rate = -side * a - resistance  # rate of change of the speed side * v
                    t = time_of_stop(side * v, rate, -side * slope, rest)
                    x += t * (v + t * (double(0.5) * side * rate - t * slope / double(6.0)))
                    v += t * (side * rate - double(0.5) * t * slope)
                    a += slope * t
                    if t < rest:
                        side = double(0.0)
                        v = double(0.0)
                    rest -= t
                    peak = wp.max(peak, wp.abs(x))
        x += double(0.5) * v * wp.abs(v) / resistance  # until the block stops after the motion
        peak_displacement[element] = wp.max(peak, wp.abs(x))
        residual_displacement[element] = x

    return slide


def slid(
    histories: dict[str, np.ndarray], resistances: np.ndarray, factors: np.ndarray, device: str, threads: int
) -> dict[str, np.ndarray]:
    """Return the peak and residual displacements [m] of sliding blocks, each of the shape of `factors`.

    Args:
        histories: The arrays of `BaseHistories`: {field: array}.
        resistances: Friction coefficient times gravity [m/s2], shape [block].
        factors: Factors on the base accelerations [1], shape [history, block, factor].
        device: Warp device, such as "cpu" or "cuda:0".
        threads: Number of CPU threads.
    """
    shape, size = factors.shape, (factors.size,)
    outputs = {"peak_displacement": (size, double), "residual_displacement": (size, double)}
    inputs = [
        filled(BaseHistories, histories, device),
        wp.array(resistances, dtype=double, device=device),
        wp.array(factors.reshape(-1, shape[-1]), dtype=double, device=device),
    ]
    found = launched(sliding_kernel(), inputs, outputs, device, threads)
    return {name: values.reshape(shape) for name, values in found.items()}
