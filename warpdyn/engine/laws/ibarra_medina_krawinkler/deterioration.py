"""Rules that the laws of Ibarra, Medina and Krawinkler (2005) share: backbones, and deterioration by dissipated energy.

Drifts and forces are divided by the yield drift and yield force of the positive side, so the initial stiffness is 1. A
backbone consists of the hardening line and the falling capping line. Without deterioration, the energy capacity of a
storey is infinite.
"""

import enum
from collections.abc import Callable
from typing import Any

import warp as wp

from warpdyn.engine.device.exponentials import power_of
from warpdyn.engine.device.extrema import maximum, minimum
from warpdyn.engine.laws.ibarra_medina_krawinkler.parameters import Coefficient as C, Negative as N
from warpdyn.engine.laws.law import Layout
from warpdyn.engine.laws.row_functions import device_functions, kept_force
from warpdyn.engine.laws.spring import Spring

SMALLEST = wp.constant(wp.float64(1e-30))  # smallest divisor, to avoid divisions by 0 in quotients that are not used


class Common(Layout):
    """The first history variables of all laws in this folder, in units of yield drift and yield force."""

    DRIFT = enum.auto()  # drift at the last step
    FORCE = enum.auto()
    STIFFNESS_LOSS = enum.auto()  # fraction of the unloading stiffness that is lost
    ENERGY = enum.auto()  # energy dissipated so far
    ENERGY_BEFORE = enum.auto()  # energy dissipated before the last change of the sign of the force


def side_rules(name: str, FIRST_NEGATIVE: int | None) -> Callable:
    """Return the device function `(is_up, c) -> values` for the backbone of the side towards which a storey moves.

    The values are yield force, hardening slope, falling slope, height of the capping line, residual force, ultimate
    drift, and deterioration rate.

    Args:
        name: Prefix of the name of the device function.
        FIRST_NEGATIVE: Index of the first coefficient of the negative side; None if both sides are the same.
    """
    ASYMMETRIC = FIRST_NEGATIVE is not None
    FIRST = wp.constant(FIRST_NEGATIVE or 0)

    def of_side(is_up: bool, c: Any):
        yields = type(c[0])(1.0)
        hardening, falling, height = c[C.HARDENING_SLOPE], c[C.FALLING_SLOPE], c[C.CAPPING_HEIGHT]
        residual, ultimate, rate = c[C.RESIDUAL_FORCE], c[C.ULTIMATE_DRIFT], c[C.DETERIORATION_RATE]
        if ASYMMETRIC:
            yields = wp.where(is_up, yields, c[FIRST + N.YIELD_FORCE])
            hardening = wp.where(is_up, hardening, c[FIRST + N.HARDENING_SLOPE])
            falling = wp.where(is_up, falling, c[FIRST + N.FALLING_SLOPE])
            height = wp.where(is_up, height, c[FIRST + N.CAPPING_HEIGHT])
            residual = wp.where(is_up, residual, c[FIRST + N.RESIDUAL_FORCE])
            ultimate = wp.where(is_up, ultimate, c[FIRST + N.ULTIMATE_DRIFT])
            rate = wp.where(is_up, rate, c[FIRST + N.DETERIORATION_RATE])
        return yields, hardening, falling, height, residual, ultimate, rate

    return device_functions(name, of_side)["of_side"]


def energy_rules(POWERS: bool) -> tuple[Callable, Callable]:
    """Return two device functions for deterioration; POWERS is False if the exponent is 1, because powers are slow.

    Returns:
        `(spent, left, exponent) -> share`: the fraction of a strength or stiffness that is lost; `spent` is the energy
        of the last excursion, `left` the remaining energy capacity.
        `(force, stiffness, energy, energy_before, exponent, c) -> stiffness, is_exhausted`: the unloading stiffness of
        a storey that turns back, and whether its energy capacity is exhausted.
    """

    def deterioration(spent: Any, left: Any, exponent: Any):
        share = minimum(spent / maximum(left, type(spent)(SMALLEST)), type(spent)(1.0))
        if POWERS:
            share = power_of(share, exponent)
        return share

    name = f"imk_powers_{POWERS}"
    share_of = device_functions(name, deterioration)["deterioration"]

    def after_turning(force: Any, stiffness: Any, energy: Any, energy_before: Any, exponent: Any, c: Any):
        elastic = type(force)(0.5) * force * force / maximum(stiffness, type(force)(SMALLEST))
        spent = maximum(energy - energy_before - elastic, type(force)(0.0))
        left = c[C.UNLOADING_CAPACITY] - (energy - elastic)
        deteriorated = stiffness * (type(force)(1.0) - share_of(spent, left, exponent))
        # An excursion returns at most the energy that was put into it; an almost exhausted stiffness would return more.
        given = maximum(type(force)(2.0) * (energy - energy_before), type(force)(SMALLEST))
        least = minimum(force * force / given, stiffness)
        return maximum(deteriorated, least), spent > left

    return share_of, device_functions(name, after_turning)["after_turning"]


@wp.func
def on_lines(drift: Any, intercept: Any, slope: Any, capping: Any, falling: Any, residual: Any):
    """Return the force and the slope of a backbone at a drift.

    Drift and force are positive on the side of the backbone. The backbone is the hardening line `intercept + slope *
    drift`, limited by the capping line `capping - falling * drift`, but not below the force `residual`.
    """
    hardening = intercept + slope * drift
    capped = capping - falling * drift
    force = maximum(minimum(hardening, capped), residual)
    tangent = wp.where(hardening < capped, slope, -falling)
    return force, wp.where(force > residual, tangent, type(drift)(0.0))


def spring_of(
    name: str,
    follow: Callable,
    go_on: Callable,
    leaves_line: Callable,
    unloading: Callable,
    of_side: Callable,
    memory: int,
    values_on_line: int | None,
    coefficients: int,
) -> Spring:
    """Return the device functions of a storey law, made from Python functions.

    Args:
        name: Prefix of the names of the device functions.
        follow: `(drift, memory, c) -> memory, tangent` after a step to the drift, in yield drifts and yield forces.
        go_on: As `follow`, but only for a storey that stays on its line.
        leaves_line: `(drift, memory, c) -> bool`: whether the storey turns back or passes a corner in the step.
        unloading: `(memory, c) -> stiffness, holds`: the unloading stiffness, and whether energy capacity remains.
        of_side: Result of `side_rules`.
        memory: Number of memory values.
        values_on_line: Number of memory values, from the first, that may change along a line; None: all.
        coefficients: Number of coefficients per storey.
    """

    follow, unloading, leaves_line = device_functions(name, follow, unloading, leaves_line).values()
    go_on = device_functions(f"{name}_going_on", go_on)["follow"]

    def force(drift: Any, memory: Any, c: Any):
        after, _ = follow(drift, memory, c)
        return c[C.YIELD_FORCE] * after[Common.FORCE]

    def return_mapping(drift: Any, memory: Any, c: Any):
        after, _ = follow(drift, memory, c)
        return after

    def memory_on_line(drift: Any, memory: Any, c: Any):
        after, _ = go_on(drift, memory, c)
        return after

    def tangent_on_line(drift: Any, memory: Any, c: Any):
        _, slope = go_on(drift, memory, c)
        return slope * c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE]

    def memory_after(drift: Any, increment: Any, memory: Any, c: Any):
        after, _ = follow(drift, memory, c)
        return after

    def tangent(drift: Any, increment: Any, before: Any, after: Any, c: Any):
        _, slope = follow(drift, before, c)
        return slope * c[C.INVERSE_YIELD_DRIFT] * c[C.YIELD_FORCE]

    def elastic_energy(drift: Any, memory: Any, c: Any):
        stiffness, holds = unloading(memory, c)
        zero = type(drift)(0.0)
        # With an almost exhausted stiffness, unloading would return more energy than was put in. Unloading ends at zero
        # force, or at the ultimate drift of the other side.
        force = wp.abs(memory[Common.FORCE])
        side = wp.where(memory[Common.FORCE] < zero, -type(drift)(1.0), type(drift)(1.0))
        _yields, _hardening, _falling, _height, _residual, ultimate, _rate = of_side(memory[Common.FORCE] < zero, c)
        way = minimum(force / maximum(stiffness, type(drift)(SMALLEST)), ultimate + side * memory[Common.DRIFT])
        energy = minimum(way * (force - type(drift)(0.5) * stiffness * way), memory[Common.ENERGY])
        return wp.where(holds, maximum(energy, zero) * c[C.YIELD_FORCE] / c[C.INVERSE_YIELD_DRIFT], zero)

    own = device_functions(
        name, force, return_mapping, memory_on_line, tangent_on_line, memory_after, tangent, elastic_energy
    )
    return Spring(
        own["force"],
        own["return_mapping"],
        own["elastic_energy"],
        coefficients=coefficients,
        tangent=own["tangent"],
        memory=memory,
        memory_after=own["memory_after"],
        force_at_accepted_state=kept_force,
        memory_on_line=own["memory_on_line"],
        tangent_on_line=own["tangent_on_line"],
        values_on_line=values_on_line,
        leaves_line=leaves_line,
    )
