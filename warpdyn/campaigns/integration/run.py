"""Preparation of runs: arguments are checked, structures drawn, and the integration steps of samples chosen."""

from __future__ import annotations

import collections.abc
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays, Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.model import Model, central_vibration, check_controlled, dynamics_of, plan_of
from warpdyn.campaigns.integration.sampler import Sampler
from warpdyn.campaigns.integration.settings import DEFAULT_TOLERANCE, Execution, Integration, Settled
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.integration.time_grid import build_schedule, build_timeline, durations_need_decay
from warpdyn.engine.kernels.queues import Queue, open_queues
from warpdyn.engine.methods.defaults import FALLBACK
from warpdyn.engine.methods.table import METHODS, check_fits
from warpdyn.foundations.core.checks import check_kind, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.scene.scene import Scene

# Drawn parameters by name, and the vibration of each structure with the method's longest stable step.
Drawn = tuple[Arrays, Vibration]
MOST_SAMPLES = 2**31 - 1  # samples are numbered by 32-bit integers


@dataclass(frozen=True, eq=False)
class Run:
    """A run with checked arguments, from which any of its structures can be prepared for integration.

    Args:
        model: Equation of motion, method, kernel and time grids for all samples.
        sampler: Sampler of the structures' scattered parameters.
        structures: Number of structures.
        first: Scattered parameters of the first structure, by name.
        execution: Devices, threads and memory.
        integration: Settings of the integration, with the chosen method.
    """

    model: Model
    sampler: Sampler
    structures: int
    first: Arrays
    execution: Execution
    integration: Settled

    @property
    def samples(self) -> int:
        """Number of samples of the run (of its last event)."""
        return self.samples_by_event[-1]

    @property
    def samples_by_event(self) -> tuple[int, ...]:
        """Number of samples in each event; the samples of the last event are the samples of the run."""
        return tuple(self.structures * samples for samples in self.model.scene.excitation.samples_by_event)

    @property
    def findings(self) -> list[StabilityFindings]:
        """New, empty findings on stability for each event."""
        counts = zip(self.samples_by_event, self.model.scene.excitation.event_names, strict=True)
        return [StabilityFindings(count, self.integration.method, name) for count, name in counts]

    def draw(self, structures: np.ndarray) -> Drawn:
        """Return the scattered parameters and the vibration of the given structures (increasing indices).

        The decay is NaN if the durations of samples do not depend on it and its computation takes most of the time.
        """
        dynamics, method, threads = self.model.dynamics, self.model.method, self.model.threads
        if not (self.sampler.scatter and dynamics.is_checked_by_vibration):
            drawn = self.sampler.draw(structures, threads)
            return drawn, dynamics.vibration_of(drawn, method, threads)
        found: dict[int, Vibration] = {}
        needs_decay = durations_need_decay(self.model.scene)

        def vibrate(part: slice, drawn: Arrays) -> None:  # in the thread whose caches contain the drawn values
            found[part.start] = dynamics.vibration_of_part(drawn, method, needs_decay=needs_decay)

        at_a_time = dynamics.at_a_time(structures.size, threads)
        drawn = self.sampler.draw(structures, threads, at_a_time=at_a_time, then=vibrate)
        return drawn, Vibration.joined([found[first] for first in sorted(found)])

    def events(
        self, structures: np.ndarray, queue: Queue, known: Drawn | None = None
    ) -> list[tuple[Ensemble, Vibration]]:
        """Return, for each event, the samples of the given structures as an ensemble, and the structures' vibration.

        From the second event on, each sample of the previous event counts as a separate structure.

        Args:
            structures: Indices of the structures, increasing.
            queue: Device queue on which they will be integrated.
            known: Result of `draw` for these structures; None: this method draws them.
        """
        model, excitation = self.model, self.model.scene.excitation
        drawn, vibration = self.draw(structures) if known is None else known
        building, samples_before = np.asarray(structures), 1
        found: list[tuple[Ensemble, Vibration]] = []
        for event, samples in enumerate(excitation.samples_by_event):
            before = found[-1][0] if found else None
            if before is not None:
                drawn = {name: values[before.row] for name, values in drawn.items()}
                vibration, building = vibration.select(before.row), before.assignment.structure
            assignment = excitation.assign(building, model.seed, event)
            row = np.repeat(np.arange(building.size, dtype=np.int32), samples // samples_before)
            if before is None and not drawn:  # all samples share one structure
                row[:] = 0
            comes_to_rest = event + 1 < len(excitation.event_names)
            schedule = build_schedule(model.scene, model.timeline, vibration, assignment, row, comes_to_rest)
            sample = np.add.outer(structures * samples, np.arange(samples)).astype(np.int32).ravel()
            place = structures if before is None else before.sample
            held = drawn, vibration.rayleigh, assignment, row, schedule
            found.append((Ensemble(model.by_event[event], place, *held, sample, queue, before), vibration))
            samples_before = samples
        return found


def build_run(
    scene: Scene, structures: int, how: Integration, execution: Execution, seed: int = 0, **chosen: Any
) -> Run:
    """Check the arguments of a run, draw only its first structure, and return the run with its time grid.

    Args:
        scene: The scene.
        structures: Number of structures to draw.
        how: Settings of the integration.
        execution: Devices, threads and memory.
        seed: Seed of every random draw.
        chosen: Settings that replace those of `how` after the method is chosen, such as `longest_step`.
    """
    check_kind("simulate", "a Scene", scene, Scene)
    excitation, dynamics = scene.excitation, dynamics_of(scene)
    forces, damping = dynamics.forces, scene.structure.damping
    if isinstance(how, Settled):
        settled = how
    else:
        error = dynamics.error_of_float32
        settled = how.settled(forces, scene, is_gpu=execution.is_gpu, error_of_float32=error)
        if error and how.dtype == "float32":
            warn_caller(
                f"in float32, rounding makes the peak displacements of this structure wrong by {error:.2g} to "
                f"{4 * error:.2g} times their value, because large terms of its stiffness matrix nearly cancel: give "
                "dtype='float64', or remove dtype="
            )
    integration = replace(settled, **chosen)
    method, row = integration.method, METHODS[integration.method]
    check_fits(method, forces, damping)
    check_controlled(method, scene)
    structures, seed = whole_number("structures", structures, 1), whole_number("seed", seed, 0)
    if structures * excitation.samples_per_structure > MOST_SAMPLES:
        raise ValueError(
            f"{structures} structures have more than {MOST_SAMPLES} samples: give fewer structures=, and join runs "
            "of other seeds by wd.join"
        )
    sampler = Sampler(scene.structure, scene.scatter, scene.correlation, scene.sampling, structures, seed)
    if len(excitation.event_names) > 1 and row.kind == "exact":
        raise ValueError(
            "method 'exact' is for linear structures, which an earthquake does not damage: give another method= for "
            "an EventSequence, or run each event as a separate scene"
        )
    excitation.check_structures(structures)
    # If a distribution exceeds its bounds, the error names a drawn value instead of the median.
    first = sampler.draw(np.arange(1))
    sampler.check_given_and_medians()
    stepped_as = METHODS[FALLBACK] if integration.refinement > 1 else row  # refinement divides the default steps of RK4
    timeline = build_timeline(
        scene,
        lambda: central_vibration(scene, dynamics, stepped_as),
        integration.step,
        integration.longest_step,
        integration.resample,
        refinement=integration.refinement,
        share=dynamics.share_of_default_step,
    )
    if scene.floor_spectra is not None:
        if row.kind == "explicit" and row.is_adaptive:
            raise ValueError(
                f"method {method!r} changes its step, but the oscillators of floor spectra need equal steps: remove "
                "method=, or choose one with equal steps, such as method='rk4'"
            )
        scene.floor_spectra.check_step(float(timeline.steps.max()))
    plan = plan_of(scene, dynamics, method, integration.dtype, is_gpu=execution.is_gpu)
    tolerance = DEFAULT_TOLERANCE if integration.tolerance is None else integration.tolerance
    model = Model(scene, dynamics, row, plan, timeline, tolerance, seed, execution.cores, integration.refinement)
    return Run(model, sampler, structures, first, execution, integration)


def prepare(
    scene: Scene,
    *,
    structures: int,
    seed: int = 0,
    device: str | collections.abc.Sequence[str] | None = None,
    threads: int | None = None,
    known: dict[str, Drawn] | None = None,
    **integration: object,
) -> tuple[Ensemble, Vibration]:
    """Return all samples of a run of one event as one ensemble on its first device, and the structures' vibration.

    Arguments: see `simulate`. For several runs of the same samples of one scene, pass the same dictionary `known` in
    each call (empty at first): the drawn structures and their vibration are kept in it, by method.
    """
    how = Settled(**integration)  # type: ignore[arg-type]
    run = build_run(scene, structures, how, Execution(device=device, threads=threads).on_first(), seed)
    everything = np.arange(run.structures)
    known = {} if known is None else known
    if how.method not in known:
        known[how.method] = run.draw(everything)
    return run.events(everything, open_queues(run.execution.devices, run.model.threads)[0], known[how.method])[0]
