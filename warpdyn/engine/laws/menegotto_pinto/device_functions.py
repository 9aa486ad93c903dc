"""Device functions of Menegotto-Pinto steel: after a reversal, the force curves from the elastic to the hardening line.

The drift x is in yield drifts. A hardening spring acts in parallel with a force h, which is 1 at yield. After a
reversal at (x_r, h_r), the storey moves in the direction s (1 or -1). Then h = h_r + s S g(r), where r = s (x - x_r) /
S, g = r / (1 + r^R)^(1/R), and S = s_y - s h_r is the distance to yield. The yield level s_y is 1 without isotropic
hardening. The exponent R = R0 (1 - c1 xi / (c2 + xi)) decreases with the plastic excursion xi before the reversal; c1
is `curvature_reduction` and c2 the ductility of this reduction.
"""

import enum
from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import decay, exponential, logarithm_of_one_and, natural_logarithm
from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.menegotto_pinto.parameters import Coefficient as C, MenegottoPinto
from warpdyn.engine.laws.row_functions import device_functions
from warpdyn.engine.laws.spring import Spring

# Smallest distance S from a reversal to the hardening line; it is a divisor, and rounding could make it 0.
LEAST_SPAN = wp.constant(wp.float64(1e-9))
LEAST_RATIO = wp.constant(wp.float64(1e-30))  # smallest argument of a logarithm
TERMS = wp.constant(16)  # terms of the series for the elastic energy; each is less than 0.5^R times the last one


class M(Layout):
    """Memory of a storey: the history variables that a reversal sets; HARDENED exists only with isotropic hardening."""

    DRIFT = enum.auto()  # x at the last step
    TRANSITION = enum.auto()  # h at the last step
    TURN_DRIFT = enum.auto()  # x_r
    TURN_TRANSITION = enum.auto()  # h_r
    LARGEST_ABOVE = enum.auto()  # (largest x of a reversal) - 1
    LARGEST_BELOW = enum.auto()  # -1 - (smallest x of a reversal)
    HARDENED = enum.auto()  # s_y - 1


class Branch(Layout):
    """History variables of the present branch, which follow those of `M`; all are 0 before the first step."""

    EXPONENT = enum.auto()  # R
    INVERSE_EXPONENT = enum.auto()
    SPAN = enum.auto()  # S
    INVERSE_SPAN = enum.auto()


@wp.func
def last_direction(memory: Any):
    """Return the direction in which the storey last moved, 1 or -1; 1 before the first step."""
    return wp.where(memory[M.DRIFT] < memory[M.TURN_DRIFT], -type(memory[M.DRIFT])(1.0), type(memory[M.DRIFT])(1.0))


@wp.func
def curvature(direction: Any, branch: Any, yield_level: Any, c: Any):
    """Return 1 / R and S of a branch (see the module's docstring).

    `branch` is the memory just after the reversal at which the branch begins.
    """
    one = type(direction)(1.0)
    farthest = one + wp.where(direction > type(direction)(0.0), branch[M.LARGEST_ABOVE], branch[M.LARGEST_BELOW])
    left = maximum(yield_level - direction * branch[M.TURN_TRANSITION], type(direction)(LEAST_SPAN))
    excursion = wp.abs(farthest - direction * branch[M.TURN_DRIFT] - left)
    return (c[C.CURVATURE_REDUCTION_DUCTILITY] + excursion) / (
        c[C.TRANSITION_CURVATURE] * (c[C.CURVATURE_REDUCTION_DUCTILITY] + (one - c[C.CURVATURE_REDUCTION]) * excursion)
    ), left


@wp.func
def transition(ratio: Any, exponent: Any, inverse_exponent: Any):
    """Return g and its slope dg/dr at a ratio r (see the module's docstring).

    For r above 1, the function avoids r^R, which can overflow in float32.
    """
    one = type(ratio)(1.0)
    distance = wp.abs(natural_logarithm(maximum(ratio, type(ratio)(LEAST_RATIO))))
    power = decay(distance * exponent)
    root = decay(inverse_exponent * logarithm_of_one_and(power))
    slope = root / (one + power) * wp.where(ratio < one, one, power / maximum(ratio, one))
    return minimum(ratio, one) * root, slope


@wp.func
def area_under(height: Any, inverse_exponent: Any):
    """Return the integral of r over g from 0 to the value `height` of g, by the binomial series.

    `height` is at most about 0.5.
    """
    one = type(height)(1.0)
    exponent = one / inverse_exponent
    power = exponential(exponent * natural_logarithm(maximum(height, type(height)(LEAST_RATIO))))
    total = type(height)(0.5)
    term = one
    for k in range(TERMS):
        order = type(height)(k + 1)
        term *= power * (inverse_exponent + order - one) / order
        total += term / (order * exponent + type(height)(2.0))
    return height * height * total


def _menegotto_pinto(name: str, IS_ISOTROPIC: bool) -> Spring:
    """Return the device functions of the law, without or with isotropic hardening."""
    VALUES = wp.constant(len(M) if IS_ISOTROPIC else int(M.HARDENED))  # number of memory values that a reversal sets
    EXPONENT, INVERSE_EXPONENT, SPAN, INVERSE_SPAN = (wp.constant(VALUES + m) for m in Branch)

    def turned(direction: Any, memory: Any, c: Any):
        """Return the memory after a reversal at the last step; `direction` (1 or -1) is the new direction."""
        one = type(direction)(1.0)
        branch = memory
        branch[M.TURN_DRIFT] = memory[M.DRIFT]
        branch[M.TURN_TRANSITION] = memory[M.TRANSITION]
        upward = direction > type(direction)(0.0)
        branch[M.LARGEST_ABOVE] = wp.where(
            upward, memory[M.LARGEST_ABOVE], maximum(memory[M.LARGEST_ABOVE], memory[M.DRIFT] - one)
        )
        branch[M.LARGEST_BELOW] = wp.where(
            upward, maximum(memory[M.LARGEST_BELOW], -memory[M.DRIFT] - one), memory[M.LARGEST_BELOW]
        )
        if IS_ISOTROPIC:
            width = (branch[M.LARGEST_ABOVE] + branch[M.LARGEST_BELOW] + one + one) * c[C.HALF_INVERSE_DUCTILITY]
            branch[M.HARDENED] = c[C.ISOTROPIC_HARDENING] * exponential(type(direction)(0.8) * natural_logarithm(width))
        return branch

    def yield_level(memory: Any):
        level = type(memory[M.DRIFT])(1.0)
        if IS_ISOTROPIC:
            level += memory[M.HARDENED]
        return level

    turned, yield_level = device_functions(name, turned, yield_level).values()

    def turns(drift: Any, memory: Any, c: Any):
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        last = last_direction(memory)
        return memory[M.DRIFT] != memory[M.TURN_DRIFT] and (x - memory[M.DRIFT]) * last < type(drift)(0.0)

    turns = device_functions(name, turns)["turns"]

    def leaves_line(drift: Any, memory: Any, c: Any):
        return memory[EXPONENT] == type(drift)(0.0) or turns(drift, memory, c)

    def along_branch(drift: Any, memory: Any, c: Any):
        """Return the memory after a step to a drift on the storey's present branch, and the slope of h over x."""
        x = drift * c[C.INVERSE_YIELD_DRIFT]
        last = last_direction(memory)
        direction = wp.where(
            x > memory[M.DRIFT], type(drift)(1.0), wp.where(x < memory[M.DRIFT], -type(drift)(1.0), last)
        )
        ratio = direction * (x - memory[M.TURN_DRIFT]) * memory[INVERSE_SPAN]
        height, slope = transition(ratio, memory[EXPONENT], memory[INVERSE_EXPONENT])
        after = memory
        after[M.DRIFT] = x
        after[M.TRANSITION] = memory[M.TURN_TRANSITION] + direction * memory[SPAN] * height
        return after, slope

    along_branch, leaves_line = device_functions(name, along_branch, leaves_line).values()

    def follow(drift: Any, memory: Any, c: Any):
        """Return the memory after a step to a drift, and the slope of h over x.

        If the storey reverses in this step, it moves on a new branch.
        """
        direction = wp.where(turns(drift, memory, c), -last_direction(memory), last_direction(memory))
        after = turned(direction, memory, c)
        for m in range(VALUES):
            after[m] = wp.where(turns(drift, memory, c), after[m], memory[m])
        inverse_exponent, left = curvature(direction, after, yield_level(after), c)
        begins = leaves_line(drift, memory, c)
        after[EXPONENT] = wp.where(begins, type(drift)(1.0) / inverse_exponent, memory[EXPONENT])
        after[INVERSE_EXPONENT] = wp.where(begins, inverse_exponent, memory[INVERSE_EXPONENT])
        after[SPAN] = wp.where(begins, left, memory[SPAN])
        after[INVERSE_SPAN] = wp.where(begins, type(drift)(1.0) / left, memory[INVERSE_SPAN])
        return along_branch(drift, after, c)

    follow = device_functions(name, follow)["follow"]

    def memory_on_line(drift: Any, memory: Any, c: Any):
        after, _slope = along_branch(drift, memory, c)
        return after

    def tangent_on_line(drift: Any, memory: Any, c: Any):
        _after, slope = along_branch(drift, memory, c)
        return c[C.HARDENING_STIFFNESS] + c[C.TRANSITION_FORCE] * c[C.INVERSE_YIELD_DRIFT] * slope

    def force(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return c[C.HARDENING_STIFFNESS] * drift + c[C.TRANSITION_FORCE] * after[M.TRANSITION]

    def force_at_accepted_state(drift: Any, memory: Any, c: Any):
        return c[C.HARDENING_STIFFNESS] * drift + c[C.TRANSITION_FORCE] * memory[M.TRANSITION]

    def return_mapping(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    def elastic_energy(drift: Any, memory: Any, c: Any):
        """Return the energy [J] that the storey returns: that of the hardening spring, and that of unloading to h = 0.

        Unloading follows the present branch if it leads towards h = 0, otherwise a new branch after a reversal.
        """
        direction = wp.where(memory[M.TRANSITION] > type(drift)(0.0), -type(drift)(1.0), type(drift)(1.0))
        after = turned(direction, memory, c)
        for m in range(VALUES):
            after[m] = wp.where(direction * last_direction(memory) < type(drift)(0.0), after[m], memory[m])
        inverse_exponent, left = curvature(direction, after, yield_level(after), c)
        ratio = direction * (after[M.DRIFT] - after[M.TURN_DRIFT]) / left
        height, _slope = transition(ratio, type(drift)(1.0) / inverse_exponent, inverse_exponent)
        end = maximum(wp.abs(after[M.TURN_TRANSITION]) / left, height)
        area = area_under(end, inverse_exponent) - area_under(height, inverse_exponent) - (end - height) * ratio
        return (
            type(drift)(0.5) * c[C.HARDENING_STIFFNESS] * drift * drift
            + c[C.TRANSITION_FORCE] / c[C.INVERSE_YIELD_DRIFT] * left * left * area
        )

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _after, slope = follow(drift, before, c)
        return c[C.HARDENING_STIFFNESS] + c[C.TRANSITION_FORCE] * c[C.INVERSE_YIELD_DRIFT] * slope

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        return return_mapping(drift, memory, c)

    functions = device_functions(
        name, force, force_at_accepted_state, return_mapping, memory_on_line, tangent_on_line, elastic_energy, tangent,
        memory_after,
    )  # fmt: skip
    return_mapping = functions["return_mapping"]
    return Spring(
        coefficients=len(MenegottoPinto.rows[name]),
        memory=VALUES + len(Branch),
        values_on_line=int(M.TURN_DRIFT),
        leaves_line=leaves_line,
        **functions,
    )


SPRINGS = {
    "menegotto_pinto": _menegotto_pinto("menegotto_pinto", False),
    "menegotto_pinto_isotropic": _menegotto_pinto("menegotto_pinto_isotropic", True),
}
