"""Conversion of drawn parameters and samples to the arrays of a kernel, named like the fields of its structs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.propagators import pack_linear
from warpdyn.campaigns.integration.time_grid import Schedule
from warpdyn.engine.kernels.arguments import check_held
from warpdyn.foundations.core.thread_pool import STRUCTURES_AT_A_TIME, in_parts
from warpdyn.model.ground_motions.excitation import Assignment

if TYPE_CHECKING:
    from warpdyn.campaigns.integration.model import Model

ROUNDING = 1e-9  # relative error of a time over a step that does not change the number of steps


def pack_structures(
    model: Model, parameters: Arrays, step: np.ndarray | None, rayleigh: np.ndarray, threads: int = 1
) -> Arrays:
    """Return the fields of the Structure struct of a model's kernel.

    Args:
        model: The model.
        parameters: Every parameter of some structures; the first dimension is the structure.
        step: Integration step of each of them [s], if the model needs it.
        rayleigh: Factors of Rayleigh damping of each of them.
        threads: CPU threads.
    """
    plan, dynamics = model.plan, model.dynamics
    if model.needs_step:
        assert step is not None
        return pack_linear(dynamics, model.scene.excitation, model.method, parameters, step)
    if not dynamics.is_packed_in_parts:
        return dynamics.pack(parameters, rayleigh)

    def part(structures: slice) -> Arrays:
        values = {name: array[structures] for name, array in parameters.items()}
        return dynamics.pack(values, rayleigh[structures])

    count = len(rayleigh)
    if count <= STRUCTURES_AT_A_TIME:
        return part(slice(None))
    whole = {name: np.empty((*of_one.shape[:-1], count), plan.dtype) for name, of_one in part(slice(1)).items()}

    def fill(structures: slice) -> None:
        for name, values in part(structures).items():
            check_held(name, values, plan.dtype)
            whole[name][..., structures] = values

    in_parts(fill, count, threads)
    return whole


def pack_samples(
    schedule: Schedule,
    assignment: Assignment,
    place: np.ndarray,
    number: np.ndarray | None = None,
    chosen: np.ndarray | None = None,
    *,
    by_intensity: bool = False,
    record_from: float = 0.0,
) -> tuple[Arrays, list[tuple[int, int]]]:
    """Return the fields of the Samples struct: the samples, unsorted, and the order in which they are launched.

    Args:
        schedule: How each sample is stepped.
        assignment: The motion of each sample.
        place: Place of each sample's structure in the packed arrays, shape [sample].
        number: Index of each sample in the run, shape [sample], if its motion depends on it.
        chosen: The samples that are launched; None: all.
        by_intensity: Whether samples with the strongest motions come first: such samples collapse at similar times, so
            that their threads end together.
        record_from: Start time of the recorders of peaks [s].

    Returns:
        The arrays; and, for each group of samples (one launch), the number of steps per interval and of samples.
    """
    # Consecutive samples with the same steps are sorted as one.
    repeats = 1 if by_intensity or chosen is not None else schedule.repeats
    run_intervals, substeps = schedule.run_intervals[::repeats], schedule.substeps[::repeats]
    # Longest first, so that no thread waits long for the last history of another thread.
    if chosen is not None:
        order = chosen[_longest_first(run_intervals[chosen])]
    elif by_intensity:
        strongest = _strongest_first(assignment)
        order = strongest[_longest_first(run_intervals[strongest])]
    else:
        order = _longest_first(run_intervals)
    in_order = substeps[order]
    kinds = _distinct(in_order)
    parts = [order]
    if kinds.size > 1:
        parts = [order[in_order == kind] for kind in kinds]
        order = np.concatenate(parts)
    order = order.astype(np.int32)
    if repeats > 1:
        order = np.add.outer(order * np.int32(repeats), np.arange(repeats, dtype=np.int32)).ravel()
    arrays = {
        "order": order,
        "structure": place,
        "motion": assignment.motion,
        "scale": assignment.scale,
        "step": schedule.step,
        "run_intervals": schedule.run_intervals,
        "residual_steps": schedule.residual_steps,
    }
    if record_from > 0:
        steps = schedule.run_intervals * schedule.substeps
        arrays["first_recorded"] = first_recorded_step(record_from, schedule.step, steps)
    if number is not None:
        arrays["number"] = number
    return arrays, [(int(kind), part.size * repeats) for kind, part in zip(kinds, parts, strict=True)]


def first_recorded_step(record_from: float, step: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the first step whose peaks are recorded, as real numbers; at least the last step is recorded."""
    return np.minimum(np.ceil(record_from / step * (1 - ROUNDING)), steps - 1)


def _longest_first(durations: np.ndarray) -> np.ndarray:
    """Return the order of decreasing durations; samples of equal duration keep their order."""
    return np.argsort(-durations, kind="stable")


def rank_of_intensity(assignment: Assignment) -> np.ndarray:
    """Return numbers that increase with falling intensity, in steps of a factor of 2^(1/256), shape [sample]."""
    level = assignment.scale if assignment.im_level is None else assignment.im_level
    octaves = np.log2(np.maximum(level, np.finfo(np.float64).tiny))
    return np.minimum(256 * (octaves.max() - octaves), 2**16 - 1).astype(np.uint16)


def _strongest_first(assignment: Assignment) -> np.ndarray:
    """Return the order of decreasing intensities, rounded to powers of 2^(1/256); equal intensities by motion."""
    return np.lexsort((assignment.motion, rank_of_intensity(assignment)))


def _distinct(counts: np.ndarray) -> np.ndarray:
    """Return the distinct values of positive counts, in order; small values are tallied, because sorting is slower."""
    if counts.size and counts.max() <= counts.size:
        return np.flatnonzero(np.bincount(counts))
    return np.unique(counts)
