"""Ensemble: some structures of a run with all their samples, drawn parameters, steps, and kernel launches."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from warpdyn.campaigns.integration import packing
from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.model import Model
from warpdyn.campaigns.integration.time_grid import Schedule, steps_of_sampling
from warpdyn.engine.kernels import arguments, queues as devices
from warpdyn.engine.kernels.build import history_plan
from warpdyn.engine.kernels.loads import LOADS
from warpdyn.engine.kernels.output_table import (
    COLLAPSE,
    COLLAPSE_OF_SPRINGS,
    HISTORIES,
    OF_CONTROL,
    OF_FAILURES,
    OF_ROTATIONS,
)
from warpdyn.engine.kernels.plan import Plan, whole_run
from warpdyn.foundations.core.random_numbers import key_of
from warpdyn.model.ground_motions.excitation import MOST_STEPS, Assignment

MapFunction = Callable[..., Iterable[object]]  # the function map, or a parallel one


class Packed(NamedTuple):
    """Arrays that a kernel launch reads, in the number types of the kernel.

    Args:
        structures: Values of each structure, by the fields of the kernel's struct Structure.
        samples: Values of each sample, by the fields of the kernel's struct Samples, and the order of the launch.
            Samples with the same number of steps per motion interval form a group and follow one another.
        groups: For each group, its number of steps per interval and its number of samples.
    """

    structures: Arrays
    samples: Arrays
    groups: list[tuple[int, int]]


class Ensemble:
    """Some structures of a run with all their samples (structure, motion and level), ready to be integrated.

    Args:
        model: Equation of motion, method, kernel and time grids of the run.
        structures: Indices of the structures in the run, increasing, shape [structure].
        drawn: Scattered parameters of the structures, by name; the first dimension is the structure.
        rayleigh: Rayleigh factors of mass [1/s] and stiffness [s], shape [structure, 2].
        assignment: Structure, motion and scale factor of each sample.
        row: Row of each sample's structure in `drawn`, shape [sample]; 0 if nothing is drawn.
        schedule: Integration steps and duration of each sample; it may be changed between integrations.
        sample: Index of each sample in the run, shape [sample].
        queue: Device queue on which the samples are integrated.
        before: Samples of the previous event, from whose final states the structures start; None: first event.
    """

    def __init__(
        self,
        model: Model,
        structures: np.ndarray,
        drawn: Arrays,
        rayleigh: np.ndarray,
        assignment: Assignment,
        row: np.ndarray,
        schedule: Schedule,
        sample: np.ndarray,
        queue: devices.Queue,
        before: Ensemble | None = None,
    ) -> None:
        self.before = before
        self.state: Arrays = {}  # initial state: final state of `before`; the first dimension is the structure
        self.model, self.queue = model, queue
        self.scene, self.timeline, self.plan, self.tolerance = model.scene, model.timeline, model.plan, model.tolerance
        self.structures, self.drawn, self.rayleigh = structures, drawn, rayleigh
        self.assignment, self.row = assignment, row
        self.schedule, self.sample = schedule, sample
        self._packed: Packed | None = None

    @property
    def example(self) -> Ensemble:
        """Samples whose schedules are typical of this ensemble: all samples, because all schedules are known."""
        return self

    @property
    def is_of_whole_ranges(self) -> bool:
        """Whether the ensemble contains whole rerun ranges only.

        A rerun range contains structures whose failed samples share one limit on reruns.
        """
        return False

    @property
    def size(self) -> int:
        """Number of samples in the ensemble."""
        return len(self.sample)

    @property
    def steps(self) -> np.ndarray:
        """Integration step of each sample [s]."""
        return self.schedule.step

    @property
    def storey_heights(self) -> np.ndarray:
        """Storey heights [m], shape [structure, storey]; [1, storey] if all structures have the same heights."""
        if "height" in self.scene.scatter:
            return self.drawn["height"]
        return self.scene.structure.parameters["height"][None]

    def heights_of(self, samples: np.ndarray) -> np.ndarray:
        """Return the storey heights of the given samples (rows of this ensemble) [m], shape [storey, sample]."""
        heights = self.storey_heights
        return heights[self.row[samples] % len(heights)].T

    def select(self, samples: np.ndarray) -> Ensemble:
        """Return an ensemble of the given samples (rows of this ensemble) with their structures, for the same model."""
        structures, row = np.unique(self.row[samples], return_inverse=True)
        part = Ensemble(
            self.model,
            self.structures[structures] if self.drawn or self.before else self.structures,
            {name: values[structures] for name, values in self.drawn.items()},
            self.rayleigh[structures],
            self.assignment.select(samples),
            row,
            self.schedule.select(samples),
            self.sample[samples],
            self.queue,
            self.before and self.before.select(structures),
        )
        part.state = {name: values[structures] for name, values in self.state.items()}
        return part

    def resume(self, outputs: Arrays) -> None:
        """Set the initial states of the structures from the outputs of `before`, whose last dimension is the sample."""
        left = {name: values.T for name, values in outputs.items() if name.startswith("final_")}
        self.state = {name.replace("final", "initial"): values for name, values in left.items()}

    def with_model(self, model: Model, schedule: Schedule) -> Ensemble:
        """Return an ensemble of the same samples with another model and schedule."""
        held = self.structures, self.drawn, self.rayleigh, self.assignment, self.row
        return Ensemble(model, *held, schedule, self.sample, self.queue, self.before)

    def halve_steps(self, samples: np.ndarray) -> None:
        """Divide the integration steps of the given samples (rows of this ensemble) by 2."""
        self.schedule = self.restepped(samples, self.schedule.substeps[samples] * 2)

    def steps_of(self, samples: np.ndarray | slice) -> np.ndarray:
        """Return the number of integration steps of the given samples (rows of this ensemble), in float64."""
        return self.schedule.run_intervals[samples] * self.schedule.substeps[samples].astype(np.float64)

    def restepped(self, samples: np.ndarray, substeps: np.ndarray) -> Schedule:
        """Return a schedule in which the given samples have other numbers of steps per interval and equal durations.

        Raises:
            ValueError: If a sample would take more steps than MOST_STEPS.
        """
        if self.scene.control is not None:  # sampling instants remain ends of steps
            each = np.maximum(self.scene.control.samplings_per_interval(self._intervals_of(samples)), 1)
            substeps = (np.ceil(substeps / each * (1 - 1e-9)) * each).astype(np.int64)
        steps = self.schedule.run_intervals[samples] * np.asarray(substeps, dtype=np.float64)
        if (steps > MOST_STEPS).any():
            first = int(steps.argmax())
            raise ValueError(
                f"sample {self.sample[samples][first]} would take {steps[first]:.3g} steps, but "
                f"at most {MOST_STEPS} can be counted: give another method=, or shorten the motions or the tail"
            )
        return self.schedule.with_substeps(samples, substeps)

    def _intervals_of(self, samples: np.ndarray | slice) -> np.ndarray:
        """Return the sampling steps of the motions of samples (rows of this ensemble) [s]."""
        return self.timeline.interval[self.assignment.motion[samples]]

    def start(
        self,
        rows: Arrays,
        advance: Callable[[int], object] = lambda done: None,
        arriving: Collection[str] | None = None,
        *,
        is_rerun: bool = False,
    ) -> None:
        """Start to integrate all samples; `finish` waits until they are done.

        Args:
            rows: Arrays for all outputs by name, shape [sample, ...].
            advance: Called with the number of samples done since its last call, if the launch waits for the device.
            arriving: Names of the variables that are copied from a GPU to the host; None: all. The GPU keeps all.
            is_rerun: Whether samples of a block are run again; other blocks on the same GPU then wait for them.
        """
        rows = {name: rows[name] for name in self.model.shapes}
        history = self.queue.upload("History", {}, self.plan.dtype)
        # Queue the uploads first: kernels queued before the uploads would delay them until the GPU is free.
        launches = self.launches()
        output = self.queue.blank(rows, self.plan.dtype)
        self.queue.launch(launches, [output, history, *whole_run(self.plan)], advance, is_rerun=is_rerun)
        self.queue.start_reading(output, {name: values.shape for name, values in rows.items()}, arriving)

    def finish(self, rows: Arrays, map_function: MapFunction = map) -> None:
        """Wait until the integration is done, and write the outputs to `rows`, the arrays that `start` was given."""
        self.queue.read_into(rows, map_function)

    def integrate(self, chosen: np.ndarray) -> Arrays:
        """Integrate the given samples (rows of this ensemble); return all outputs by name, the sample last."""
        part = self.select(chosen)
        rows = self.model.blank_outputs(chosen.size)
        part.start(rows, is_rerun=True)
        part.finish(rows)
        return {name: values.T for name, values in rows.items()}

    def integrate_histories(
        self, kept: Sequence[int] | np.ndarray, every: int, common_step: float
    ) -> tuple[np.ndarray, Arrays]:
        """Integrate samples and return their whole histories.

        Args:
            kept: The samples, as rows of this ensemble.
            every: Number of common steps between two returned states.
            common_step: Time [s] that is a multiple of the step of each of the samples.

        Returns:
            Times of the returned states [s]; histories by variable name, shape [history, time, dof], NaN after the end
            of a sample's run.
        """
        time, values, _ = self.histories_and_status(kept, every, common_step)
        return time, values

    def histories_and_status(
        self, kept: Sequence[int] | np.ndarray, every: int, common_step: float
    ) -> tuple[np.ndarray, Arrays, np.ndarray]:
        """Integrate samples and return their whole histories and their status.

        Args:
            kept: The samples, as rows of this ensemble.
            every: Number of common steps between two returned states.
            common_step: Time [s] that is a multiple of the step of each of the samples.

        Returns:
            Times of the returned states [s]; histories by variable name, shape [history, time, dof], NaN after the end
            of a sample's run; status of the samples, such as OK or DIVERGED.
        """
        part = self.select(np.array(kept))
        times_finer = np.round(common_step / part.schedule.step).astype(np.int64)
        every_own = every * times_finer
        last = part.schedule.run_intervals * part.schedule.substeps // every_own
        times = int(last.max()) + 1
        names = (*self.model.dynamics.histories, *(OF_CONTROL if self.plan.control is not None else ()))
        widths = {name: self.plan.length(HISTORIES[name].dims[0]) for name in names}
        blank = {name: np.full((last.size, times, width), np.nan) for name, width in widths.items()}
        history = self.queue.upload("History", blank, self.plan.dtype)
        of_outcome = {
            "status",
            *OF_ROTATIONS,
            *OF_FAILURES,
            *(COLLAPSE | COLLAPSE_OF_SPRINGS if self.plan.collapses else ()),
        }
        outcomes = {name: values for name, values in self.model.blank_outputs(last.size).items() if name in of_outcome}
        output = self.queue.blank(outcomes, self.plan.dtype)
        for own in np.unique(every_own):
            rows = np.flatnonzero(every_own == own)
            launches = part._launches_of(part._pack(rows), history_plan(self.plan), int(own))
            self.queue.launch(launches, [output, history])
        values = {name: self.queue.read(getattr(history, name)) for name in names}
        if self.plan.collapses:
            # The last state is at the end of the step in which the sample collapses; an adaptive method stops within
            # this step.
            steps = self.queue.read(output.time_of_collapse) / part.schedule.step
            steps = np.floor(steps + 1e-3) if self.model.method.is_adaptive else np.ceil(steps - 1e-6)
            last = np.where(np.isfinite(steps), steps // every_own, last).astype(np.int64)
        for row, end in enumerate(last):
            for array in values.values():
                array[row, end + 1 :] = np.nan
        status = self.queue.read(output.status)
        return np.arange(times) * every * common_step, values, status

    def pack(self) -> None:
        """Sort the samples and pack their structures as the kernel reads them; otherwise, `start` does this."""
        self._packed = self._pack()

    def _pack(self, chosen: np.ndarray | None = None) -> Packed:
        """Return the arrays that a launch of the chosen samples reads; None: of all samples.

        If the kernel reads propagators (matrices that advance a linear structure by one step), they contain one
        propagator for each pair of a structure and a step.
        """
        dynamics = self.model.dynamics
        if self.model.needs_step:
            steps, of_step = np.unique(self.schedule.step, return_inverse=True)
            pairs, place = np.unique(self.row * steps.size + of_step, return_inverse=True)
            parameters = dynamics.parameters_of(self.drawn, pairs // steps.size)
            step = steps[pairs % steps.size]
        else:
            everything = np.arange(len(self.structures)) if self.before else slice(None)
            parameters, place, step = dynamics.parameters_of(self.drawn, everything), self.row, None
        structures = packing.pack_structures(self.model, parameters, step, self.rayleigh, self.model.threads)
        structures |= {name: values.T for name, values in self.state.items()}
        control = self.scene.control
        has_noise = LOADS[self.plan.load].noise_states > 0 or (control is not None and control.is_noisy)
        number = self.sample if has_noise else None
        samples, groups = packing.pack_samples(
            self.schedule,
            self.assignment,
            place,
            number,
            chosen,
            by_intensity=self.plan.collapses,
            record_from=self.scene.record_from,
        )
        if control is not None:
            intervals = self._intervals_of(slice(None))
            samples["steps_of_sampling"] = steps_of_sampling(self.scene, intervals, self.schedule.substeps)
        dtype = self.plan.dtype
        return Packed(
            arguments.as_fields("Structure", structures, dtype), arguments.as_fields("Samples", samples, dtype), groups
        )

    def launches(self) -> list[devices.Launch]:
        """Upload all samples with their structures to the device; return the launches that integrate them."""
        packed, self._packed = self._packed, None
        return self._launches_of(self._pack() if packed is None else packed)

    def _launches_of(self, packed: Packed, plan: Plan | None = None, every: int = 1) -> list[devices.Launch]:
        """Upload packed samples with their structures to the device; return the launches, one for each group.

        Args:
            packed: The packed samples and structures.
            plan: Plan of the kernel that returns whole histories; None: the kernels of the model.
            every: Number of steps between two returned states of a history.
        """
        dtype = self.plan.dtype
        structures = self.queue.upload("Structure", packed.structures, dtype)
        samples = self.queue.upload("Samples", packed.samples, dtype)
        launches, first = [], 0
        for substeps, count in packed.groups:
            part, last = samples, first + count
            if len(packed.groups) > 1:
                part = arguments.with_part(samples, "Samples", packed.samples, dtype, order=slice(first, last))
            of_launch = packed.samples["order"][first:last], packed.samples["run_intervals"]
            launches.append(self._launch(structures, part, count, substeps, *of_launch, plan=plan, every=every))
            first = last
        return launches

    def _launch(
        self,
        structures: object,
        samples: object,
        count: int,
        substeps: int,
        order: np.ndarray,
        intervals: np.ndarray,
        *,
        plan: Plan | None = None,
        every: int = 1,
    ) -> devices.Launch:
        """Return the launch of samples with the same steps per interval; arguments: see `Launch`, `_launches_of`."""
        own, finer = self.model.launched(substeps) if plan is None else (plan, 1)
        loads = self.model.loads_on(self.queue.device, finer)
        inputs = self._control(count, substeps, own.dtype, every), samples, structures, loads
        return devices.Launch(own, inputs, count, substeps, order, intervals)

    def _control(self, samples: int, substeps: int, dtype: str, every: int = 1) -> object:
        """Return the scalar arguments of a launch as the kernel's struct.

        Args:
            samples: Number of samples.
            substeps: Number of integration steps per motion interval.
            dtype: Number type.
            every: Number of steps between two returned states of a history.
        """
        limit = self.scene.collapse_limit
        return arguments.control(
            dtype,
            samples=samples,
            substeps=substeps,
            every=every,
            collapse_drift_ratio=np.inf if limit is None else limit,
            tolerance=self.tolerance,
            key=key_of(self.model.seed),
        )
