"""Preparation kernels for the steps of samples, recorded from the NumPy functions that choose steps on the host."""

from __future__ import annotations

from typing import Any

import numpy as np

from warpdyn.campaigns.accuracy.scattered_steps import accurate_substeps, is_too_long, longest_steps
from warpdyn.campaigns.integration.packing import first_recorded_step
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.stability_guard import stable_substeps
from warpdyn.campaigns.integration.time_grid import divided, intervals_with_tail, steps_of_window, tail_of
from warpdyn.engine.kernels.preparing.samples import SamplePreparation, SampleValues
from warpdyn.engine.kernels.preparing.structures import PERIOD, SLOWEST_DECAY, STABLE_STEP
from warpdyn.engine.tracing.arrays import Traced
from warpdyn.engine.tracing.nodes import Node, apply, constant
from warpdyn.model.ground_motions.excitation import MOST_STEPS


def traced_samples(run: Run) -> SamplePreparation:
    """Return the kernels that choose the integration steps and durations of a run's samples on a device.

    Raises:
        NotTraceableError: If a NumPy function of the preparation cannot be recorded as a kernel.
    """
    model, scene = run.model, run.model.scene
    period, decay, stable = (_given(f"vibration[{row}, s]") for row in (PERIOD, SLOWEST_DECAY, STABLE_STEP))
    interval, before, intervals = (_given(name) for name in ("interval", "substeps", "intervals"))
    tail, window = tail_of(scene, period, decay)
    run_intervals = intervals_with_tail(intervals, tail, interval)
    step = interval / before
    residual = steps_of_window(window, step, run_intervals * before)
    # As in `shorten_steps`: divide steps that are too long for the period.
    divides = run.integration.divides_steps
    longest = longest_steps(model, period, decay, stable, run_intervals * before * step, is_default=divides)
    is_long = is_too_long(step, longest)
    substeps: Any = before
    if divides:
        substeps = np.where(is_long, accurate_substeps(step, before, longest), before)
        step, residual = _where(is_long, divided(step, residual, substeps / before), (step, residual))
    # As in `guard`: divide steps beyond the stability limit.
    is_unstable = step > stable
    needed = np.where(is_unstable, stable_substeps(step, substeps, stable), substeps)
    factor = needed / substeps
    step, residual = _where(is_unstable, divided(step, residual, factor), (step, residual))
    steps = run_intervals * needed
    values: dict[str, Any] = {"run_intervals": run_intervals, "step": step, "residual_steps": residual}
    if scene.record_from > 0:
        values["first_recorded"] = first_recorded_step(scene.record_from, step, steps)
    return SamplePreparation(
        SampleValues(
            fields={name: _node(value) for name, value in values.items()},
            substeps=_node(needed),
            is_long=constant(False) if divides else _node(is_long),
            longest=_node(longest),
            is_unstable=_node(is_unstable),
            factor=_node(factor),
            refused=apply("logical_or", _node(~(steps < MOST_STEPS)), _node(~(stable > 0))),
        ),
        model.plan.dtype,
    )


def _given(text: str) -> Any:  # used as an array
    return Traced.inputs(lambda: text)


def _where(condition: Any, new: tuple[Any, Any], old: tuple[Any, Any]) -> tuple[Any, Any]:
    """Return a pair of values: the pair `new` if a condition is true for a sample, else the pair `old`."""
    return np.where(condition, new[0], old[0]), np.where(condition, new[1], old[1])


def _node(value: Any) -> Node:
    node: Node = value.nodes[()]
    return node
