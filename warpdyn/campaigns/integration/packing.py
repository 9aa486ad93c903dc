"""Conversion of drawn parameters and samples to the arrays that a kernel reads, by the fields of its structs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.propagators import pack_linear
from warpdyn.campaigns.integration.time_grid import Schedule
from warpdyn.engine.kernels.arguments import check_held
from warpdyn.foundations.core.thread_pool import in_parts, structures_of_a_part
from warpdyn.model.ground_motions.excitation import Assignment

if TYPE_CHECKING:
    from warpdyn.campaigns.integration.model import Model

ROUNDING = 1e-9  # relative error of (time / step) that does not change the number of steps


def pack_structures(
    model: Model, parameters: Arrays, step: np.ndarray | None, rayleigh: np.ndarray, threads: int = 1
) -> Arrays:
    """Return the values of structures for the fields of the struct Structure, which a model's kernel reads, by name.

    Args:
        model: The model.
        parameters: Every parameter of the structures by name; the first dimension is the structure.
        step: Integration step of each structure [s], shape [structure]; None unless `model.needs_step`.
        rayleigh: Rayleigh factors of mass [1/s] and stiffness [s], shape [structure, 2].
        threads: Number of CPU threads.
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
    at_a_time = structures_of_a_part(count, threads)
    if count <= at_a_time:
        return part(slice(None))
    whole = {name: np.empty((*of_one.shape[:-1], count), plan.dtype) for name, of_one in part(slice(1)).items()}

    def fill(structures: slice) -> None:
        for name, values in part(structures).items():
            check_held(name, values, plan.dtype)
            whole[name][..., structures] = values

    in_parts(fill, count, threads, at_a_time)
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
    """Return the fields of the kernel's struct Samples: values of all samples, and the order of the launch.

    Args:
        schedule: Integration steps and duration of each sample.
        assignment: Motion and scale factor of each sample.
        place: Index of each sample's structure in the packed arrays, shape [sample].
        number: Index of each sample in the run, shape [sample], if its motion depends on this index; otherwise None.
        chosen: Indices of the samples that are launched; None: all.
        by_intensity: Whether samples with the strongest motions come first. Samples with similar intensities collapse
            at similar times, so that the threads of a launch end together.
        record_from: Time from which peaks are recorded [s].

    Returns:
        The arrays by name; and for each group of samples (one launch): the number of steps per interval, and the number
        of samples.
    """
    # Consecutive samples with the same schedule are sorted as one.
    repeats = 1 if by_intensity or chosen is not None else schedule.repeats
    run_intervals, substeps = schedule.run_intervals[::repeats], schedule.substeps[::repeats]
    # Longest first, so that no thread waits long for another thread that integrates the last history.
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
    """Return the index of the first step whose peaks are recorded, shape [sample]; at most that of the last step.

    Args:
        record_from: Time from which peaks are recorded [s].
        step: Integration step of each sample [s].
        steps: Number of steps of each sample.
    """
    return np.minimum(np.ceil(record_from / step * (1 - ROUNDING)), steps - 1)


def _longest_first(durations: np.ndarray) -> np.ndarray:
    """Return the indices that sort durations, longest first; samples with equal durations keep their order."""
    return np.argsort(-durations, kind="stable")


def rank_of_intensity(assignment: Assignment) -> np.ndarray:
    """Return a rank of each sample, shape [sample]: 0 is the strongest intensity; +1 is weaker by 2^(1/256)."""
    level = assignment.scale if assignment.im_level is None else assignment.im_level
    octaves = np.log2(np.maximum(level, np.finfo(np.float64).tiny))
    return np.minimum(256 * (octaves.max() - octaves), 2**16 - 1).astype(np.uint16)


def _strongest_first(assignment: Assignment) -> np.ndarray:
    """Return the indices that sort samples by `rank_of_intensity`, strongest first, and then by motion."""
    return np.lexsort((assignment.motion, rank_of_intensity(assignment)))


def _distinct(counts: np.ndarray) -> np.ndarray:
    """Return the distinct values of positive counts, increasing; small counts by a histogram, which is faster."""
    if counts.size and counts.max() <= counts.size:
        return np.flatnonzero(np.bincount(counts))
    return np.unique(counts)
