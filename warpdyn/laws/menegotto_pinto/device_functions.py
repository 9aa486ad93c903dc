"""Menegotto-Pinto steel: from every turn a curve that leaves the elastic line for the hardening one.

The drift x is in yield drifts. A hardening spring stands beside a force h that is 1 where the storey yields. From a
turn at (x_r, h_r) in the direction s it is h_r + s S g(r), with r = s (x - x_r) / S, g = r / (1 + r^R)^(1/R) and the
way S = s_y - s h_r that is left to yield, at s_y, which is 1 without isotropic hardening. R = R0 (1 - c1 xi / (c2 +
xi)) falls with the plastic excursion xi before the turn.

Coefficients: 1 / yield drift, force of h = 1, hardening stiffness, R0, c1, c2; with isotropic hardening its ratio,
and a half over the ductility that it is for.
The memory: x and h of the last step, x_r and h_r, by how much the largest x of a turn was above 1 and the smallest
below -1, with isotropic hardening s_y - 1, and of the branch R, 1 / R, S and 1 / S.
"""

from typing import Any

import warp as wp

from warpdyn.device.exponentials import decay, exponential, logarithm_of_one_and, natural_logarithm
from warpdyn.laws.row_functions import device_functions
from warpdyn.laws.spring import Spring

# No less may be left from a turn to the hardening line: a turn that rounding puts upon the line divides by it.
LEAST_SPAN = wp.constant(wp.float64(1e-9))
LEAST_RATIO = wp.constant(wp.float64(1e-30))  # of which a logarithm is taken
TERMS = wp.constant(16)  # of the series of stored energy, each less than 0.5^R of the one before


@wp.func
def last_direction(memory: Any):
    """Return the direction in which the storey moves; 1 where it has not moved yet."""
    return wp.where(memory[0] < memory[2], -type(memory[0])(1.0), type(memory[0])(1.0))


@wp.func
def curvature(direction: Any, branch: Any, yield_level: Any, c: Any):
    """Return 1 / R and S of a branch, which is a memory just after its turn."""
    one = type(direction)(1.0)
    farthest = one + wp.where(direction > type(direction)(0.0), branch[4], branch[5])
    left = wp.max(yield_level - direction * branch[3], type(direction)(LEAST_SPAN))
    excursion = wp.abs(farthest - direction * branch[2] - left)
    return (c[5] + excursion) / (c[3] * (c[5] + (one - c[4]) * excursion)), left


@wp.func
def transition(ratio: Any, exponent: Any, inverse_exponent: Any):
    """Return g and its slope at a ratio r: never r^R where r is above 1, which single precision does not hold."""
    one = type(ratio)(1.0)
    distance = wp.abs(natural_logarithm(wp.max(ratio, type(ratio)(LEAST_RATIO))))
    power = decay(distance * exponent)
    root = decay(inverse_exponent * logarithm_of_one_and(power))
    slope = root / (one + power) * wp.where(ratio < one, one, power / wp.max(ratio, one))
    return wp.min(ratio, one) * root, slope


@wp.func
def area_under(height: Any, inverse_exponent: Any):
    """Return the integral of r over g from 0 to a height of at most about a half, by the binomial series."""
    one = type(height)(1.0)
    exponent = one / inverse_exponent
    power = exponential(exponent * natural_logarithm(wp.max(height, type(height)(LEAST_RATIO))))
    total = type(height)(0.5)
    term = one
    for k in range(TERMS):
        order = type(height)(k + 1)
        term *= power * (inverse_exponent + order - one) / order
        total += term / (order * exponent + type(height)(2.0))
    return height * height * total


def _menegotto_pinto(name: str, IS_ISOTROPIC: bool) -> Spring:
    """Return the row without or with isotropic hardening."""
    # What a turn makes of the path, then what the branch has of it: R, 1 / R, S and 1 / S, all 0 before anything moved.
    VALUES = SHAPE = wp.constant(7 if IS_ISOTROPIC else 6)

    def turned(direction: Any, memory: Any, c: Any):
        """Return the memory after a turn at the last step into this direction."""
        one = type(direction)(1.0)
        branch = memory
        branch[2] = memory[0]
        branch[3] = memory[1]
        upward = direction > type(direction)(0.0)
        branch[4] = wp.where(upward, memory[4], wp.max(memory[4], memory[0] - one))
        branch[5] = wp.where(upward, wp.max(memory[5], -memory[0] - one), memory[5])
        if IS_ISOTROPIC:
            width = (branch[4] + branch[5] + one + one) * c[7]
            branch[6] = c[6] * exponential(type(direction)(0.8) * natural_logarithm(width))
        return branch

    def yield_level(memory: Any):
        level = type(memory[0])(1.0)
        if IS_ISOTROPIC:
            level += memory[6]
        return level

    turned, yield_level = device_functions(name, turned, yield_level).values()

    def turns(drift: Any, memory: Any, c: Any):
        x = drift * c[0]
        last = last_direction(memory)
        return memory[0] != memory[2] and (x - memory[0]) * last < type(drift)(0.0)

    turns = device_functions(name, turns)["turns"]

    def decides(drift: Any, memory: Any, c: Any):
        return memory[SHAPE] == type(drift)(0.0) or turns(drift, memory, c)

    def along_branch(drift: Any, memory: Any, c: Any):
        """Return the memory at a drift on the branch that the storey is on, and the slope of h over x."""
        x = drift * c[0]
        last = last_direction(memory)
        direction = wp.where(x > memory[0], type(drift)(1.0), wp.where(x < memory[0], -type(drift)(1.0), last))
        ratio = direction * (x - memory[2]) * memory[SHAPE + 3]
        height, slope = transition(ratio, memory[SHAPE], memory[SHAPE + 1])
        after = memory
        after[0] = x
        after[1] = memory[3] + direction * memory[SHAPE + 2] * height
        return after, slope

    along_branch, decides = device_functions(name, along_branch, decides).values()

    def follow(drift: Any, memory: Any, c: Any):
        """Return the same, on a new branch where the storey turns."""
        direction = wp.where(turns(drift, memory, c), -last_direction(memory), last_direction(memory))
        after = turned(direction, memory, c)
        for m in range(VALUES):
            after[m] = wp.where(turns(drift, memory, c), after[m], memory[m])
        inverse_exponent, left = curvature(direction, after, yield_level(after), c)
        begins = decides(drift, memory, c)
        after[SHAPE] = wp.where(begins, type(drift)(1.0) / inverse_exponent, memory[SHAPE])
        after[SHAPE + 1] = wp.where(begins, inverse_exponent, memory[SHAPE + 1])
        after[SHAPE + 2] = wp.where(begins, left, memory[SHAPE + 2])
        after[SHAPE + 3] = wp.where(begins, type(drift)(1.0) / left, memory[SHAPE + 3])
        return along_branch(drift, after, c)

    follow = device_functions(name, follow)["follow"]

    def glide(drift: Any, memory: Any, c: Any):
        after, _slope = along_branch(drift, memory, c)
        return after

    def force(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return c[2] * drift + c[1] * after[1]

    def held(drift: Any, memory: Any, c: Any):
        return c[2] * drift + c[1] * memory[1]

    def evolve(drift: Any, memory: Any, c: Any):
        after, _slope = follow(drift, memory, c)
        return after

    def recoverable(drift: Any, memory: Any, c: Any):
        """Return what unloading to h = 0 gives back, on the branch that it is on or would turn to."""
        direction = wp.where(memory[1] > type(drift)(0.0), -type(drift)(1.0), type(drift)(1.0))
        after = turned(direction, memory, c)
        for m in range(VALUES):
            after[m] = wp.where(direction * last_direction(memory) < type(drift)(0.0), after[m], memory[m])
        inverse_exponent, left = curvature(direction, after, yield_level(after), c)
        ratio = direction * (after[0] - after[2]) / left
        height, _slope = transition(ratio, type(drift)(1.0) / inverse_exponent, inverse_exponent)
        end = wp.max(wp.abs(after[3]) / left, height)
        area = area_under(end, inverse_exponent) - area_under(height, inverse_exponent) - (end - height) * ratio
        return type(drift)(0.5) * c[2] * drift * drift + c[1] / c[0] * left * left * area

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _after, slope = follow(drift, before, c)
        return c[2] + c[1] * c[0] * slope

    def advance(drift: Any, increment: Any, memory: Any, c: Any):
        return evolve(drift, memory, c)

    functions = device_functions(name, force, held, evolve, glide, recoverable, tangent, advance)
    evolve = functions["evolve"]
    coefficients = 8 if IS_ISOTROPIC else 6
    return Spring(coefficients=coefficients, memory=VALUES + 4, gliding=2, decides=decides, **functions)


SPRINGS = {
    "menegotto_pinto": _menegotto_pinto("menegotto_pinto", False),
    "menegotto_pinto_isotropic": _menegotto_pinto("menegotto_pinto_isotropic", True),
}
