"""Some structures of a run with all their samples: what was drawn of them, how they are stepped, and their launches."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from warpdyn.core.output_variables import HISTORY, STATE, recorded
from warpdyn.core.random_numbers import key_of
from warpdyn.ground_motions.motions import Assignment
from warpdyn.integration import packing
from warpdyn.integration.time_grid import MOST_STEPS, Schedule, Timeline
from warpdyn.kernels import arguments, queues as devices
from warpdyn.kernels.build import history_plan
from warpdyn.kernels.loads import LOADS
from warpdyn.kernels.plan import Plan
from warpdyn.laws.springs import spring_row
from warpdyn.methods.table import METHODS
from warpdyn.scene.scene import Scene

Arrays = dict[str, np.ndarray]
MapFunction = Callable[..., Iterable[object]]  # map, or one that works on several items at a time


class Packed(NamedTuple):
    """What a launch reads, as arrays of the kernels' types.

    Args:
        structures: Of each structure, by the fields of the kernels' struct.
        samples: Of each sample, likewise; samples that take as many steps an interval lie together.
        groups: How many steps those are, and of how many samples, one group after the other.
    """

    structures: Arrays
    samples: Arrays
    groups: list[tuple[int, int]]


@dataclass(frozen=True, eq=False)
class Terms:
    """How a scene's samples are integrated, all of them alike.

    Args:
        scene: The scene.
        timeline: Time grid of each motion.
        plan: The kernel's plan.
        tolerance: Relative error a step that an adaptive method allows itself.
        seed: Seed of random motions.
        threads: CPU threads.
    """

    scene: Scene
    timeline: Timeline
    plan: Plan
    tolerance: float
    seed: int
    threads: int
    _loads: dict[str, object] = field(default_factory=dict, init=False, repr=False)

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """What is recorded of one sample: every dimension beside `sample` is as long as there are dofs."""
        variables = recorded(self.plan.family, self.plan.recorders, METHODS[self.plan.method].is_adaptive)
        shapes = {name: (self.plan.dofs,) * len(v.dims) for name, v in variables.items()} | {"status": ()}
        if STATE in self.plan.recorders:
            values = {"displacement": 1, "velocity": 1, "memory": spring_row(self.plan.law).memory}
            shapes |= {f"final_{name}": (self.plan.dofs * count,) for name, count in values.items() if count}
        return shapes

    def for_event(self, resumes: bool) -> Terms:
        """Return the terms of an event of a sequence, which leaves a state and may go on from one, too."""
        return replace(self, plan=replace(self.plan, recorders=(*self.plan.recorders, STATE), resumes=resumes))

    @property
    def kernel_name(self) -> str:
        """What the kernel computes, in one line."""
        p = self.plan
        return f"{p.family} {p.dofs} {p.law} {p.damping} {p.load} {'+'.join(p.recorders)} {p.method} {p.dtype}"

    def loads_on(self, device: str) -> object:
        """Return the load as a device holds it, brought there once."""
        if device not in self._loads:
            packed = packing.pack_load(self.scene, self.timeline)
            self._loads[device] = arguments.brought("Load", packed, self.plan.dtype, device)
        return self._loads[device]


class Ensemble:
    """Some structures of a run with all their samples.

    Args:
        terms: How they are integrated.
        structures: Indices of the structures in the run, increasing, shape [structure].
        drawn: Their scattered parameters, structure first.
        rayleigh: Their Rayleigh damping, as their vibration tells it.
        assignment: Which structure and motion each sample has.
        row: Place of each sample's structure in `drawn`, shape [sample]; 0 where nothing is drawn.
        schedule: How each sample is stepped; it may be changed between integrations.
        sample: Index of each sample in the run, shape [sample].
        queue: Where they run.
        before: Where they go on from an event before: its samples, each of which is one of the structures here.
    """

    def __init__(
        self,
        terms: Terms,
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
        self.state: Arrays = {}  # that `before` has left, structure first
        self.terms, self.queue = terms, queue
        self.scene, self.timeline, self.plan, self.tolerance = terms.scene, terms.timeline, terms.plan, terms.tolerance
        self.structures, self.drawn, self.rayleigh = structures, drawn, rayleigh
        self.assignment, self.row = assignment, row
        self.schedule, self.sample = schedule, sample
        self._packed: Packed | None = None

    @property
    def heights(self) -> np.ndarray:
        """Storey heights of each structure [m], shape [structure, storey]."""
        nominal = self.scene.structure.parameters["height"]
        return self.drawn.get("height", np.broadcast_to(nominal, (len(self.structures), nominal.size)))

    def select(self, samples: np.ndarray) -> Ensemble:
        """Return some of the samples with their structures, to be integrated on the same terms."""
        structures, row = np.unique(self.row[samples], return_inverse=True)
        part = Ensemble(
            self.terms,
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
        """Take the state from which the structures go on: what the samples of `before` recorded, sample last."""
        left = {name: values.T for name, values in outputs.items() if name.startswith("final_")}
        self.state = {name.replace("final", "initial"): values for name, values in left.items()}

    def with_terms(self, terms: Terms, schedule: Schedule) -> Ensemble:
        """Return the same samples on other terms."""
        held = self.structures, self.drawn, self.rayleigh, self.assignment, self.row
        return Ensemble(terms, *held, schedule, self.sample, self.queue, self.before)

    def restepped(self, samples: np.ndarray, substeps: np.ndarray) -> Schedule:
        """Return the schedule with other steps an interval for some samples, which run as long as before.

        Raises:
            ValueError: If a sample would take more steps than can be counted.
        """
        steps = self.schedule.run_intervals[samples] * np.asarray(substeps, dtype=np.float64)
        if (steps > MOST_STEPS).any():
            first = int(steps.argmax())
            raise ValueError(
                f"sample {self.sample[samples][first]} would take {steps[first]:.3g} steps, and "
                f"{MOST_STEPS} can be counted: choose another method or a shorter run"
            )
        return self.schedule.with_substeps(samples, substeps)

    def common_step(self, samples: Sequence[int]) -> float:
        """Return the longest step [s] of some samples; raise unless the others' steps divide it."""
        steps = self.schedule.step[list(samples)]
        longest = int(steps.argmax())
        times = steps[longest] / steps
        differs = ~np.isclose(times, np.round(times), rtol=1e-6, atol=0.0)
        if differs.any():
            one, other = self.sample[[samples[longest], samples[int(np.flatnonzero(differs)[0])]]]
            raise ValueError(
                f"histories of samples {one} and {other} have steps {steps[longest]:g} and "
                f"{steps[differs][0]:g} s: ask for samples of one step, or give simulate() a step that divides all"
            )
        return float(steps[longest])

    def start(self, rows: Arrays, advance: Callable[[int], object] = lambda done: None) -> None:
        """Begin to integrate all samples; `finish` waits for them.

        Args:
            rows: Where each recorded variable goes, sample first.
            advance: Called with the number of samples done since its last call, by a device that is waited for.
        """
        rows = {name: rows[name] for name in self.terms.shapes}
        output = self.queue.blank(rows, self.plan.dtype)
        history = self.queue.upload("History", {}, self.plan.dtype)
        if self._packed is None:
            self.pack()
        packed, self._packed = self._packed, None
        self._launch(self.plan, packed, output, history, advance=advance)
        self.queue.start_reading(output, {name: values.shape for name, values in rows.items()})

    def finish(self, rows: Arrays, map_function: MapFunction = map) -> None:
        """Wait until the rows that `start` was given hold what was recorded."""
        self.queue.read_into(rows, map_function)

    def integrate(self, chosen: np.ndarray) -> Arrays:
        """Return every recorded variable of some samples, sample last."""
        part = self.select(chosen)
        rows = {
            name: np.empty((chosen.size, *shape), arguments.output_dtype(name, self.plan.dtype))
            for name, shape in self.terms.shapes.items()
        }
        part.start(rows)
        part.finish(rows)
        return {name: values.T for name, values in rows.items()}

    def integrate_histories(self, kept: Sequence[int], every: int, common_step: float) -> tuple[np.ndarray, Arrays]:
        """Return the time grid [s] and each variable's histories, shape [history, time, dof], NaN after a run's end.

        Args:
            kept: The samples.
            every: Common steps between the states kept.
            common_step: A step [s] that all their steps divide.
        """
        part = self.select(np.array(kept))
        times_finer = np.round(common_step / part.schedule.step).astype(np.int64)
        every_own = every * times_finer
        last = part.schedule.run_intervals * part.schedule.substeps // every_own
        times = int(last.max()) + 1
        names = list(HISTORY) if self.plan.family == "chain" else [n for n in HISTORY if n != "storey_force"]
        blank = {name: np.full((last.size, times, self.plan.dofs), np.nan) for name in names}
        history = self.queue.upload("History", blank, self.plan.dtype)
        output = self.queue.blank({"status": np.empty(last.size, np.int8)}, self.plan.dtype)
        for own in np.unique(every_own):
            rows = np.flatnonzero(every_own == own)
            own_part = part.select(rows)
            own_part._launch(history_plan(self.plan), own_part._pack(rows), output, history, every=int(own))
        values = {name: self.queue.read(getattr(history, name)) for name in names}
        for row, end in enumerate(last):
            for array in values.values():
                array[row, end + 1 :] = np.nan
        return np.arange(times) * every * common_step, values

    def pack(self) -> None:
        """Sort the samples and pack their structures as kernels read them; `start` does so unless it was done."""
        self._packed = self._pack(np.arange(self.sample.size, dtype=np.int32))

    def _pack(self, columns: np.ndarray) -> Packed:
        """Return what a launch reads, of samples that are each written to their column of the outputs.

        Where a kernel reads propagators, there is one for each structure and step that meet.
        """
        if packing.needs_step(self.plan):
            steps, of_step = np.unique(self.schedule.step, return_inverse=True)
            pairs, place = np.unique(self.row * steps.size + of_step, return_inverse=True)
            parameters = packing.parameters_of(self.scene, self.drawn, pairs // steps.size)
            step = steps[pairs % steps.size]
        else:
            everything = np.arange(len(self.structures)) if self.before else slice(None)
            parameters, place, step = packing.parameters_of(self.scene, self.drawn, everything), self.row, None
        structures = packing.pack_structures(self.scene, parameters, self.plan, step, self.rayleigh, self.terms.threads)
        structures |= {name: values.T for name, values in self.state.items()}
        number = self.sample if LOADS[self.plan.load].noise_states else None
        samples, groups = packing.pack_samples(self.schedule, self.assignment, place, columns, number)
        dtype = self.plan.dtype
        return Packed(
            arguments.as_fields("Structure", structures, dtype), arguments.as_fields("Samples", samples, dtype), groups
        )

    def _launch(
        self,
        plan: Plan,
        packed: Packed,
        output: object,
        history: object,
        every: int = 1,
        advance: Callable[[int], object] = lambda done: None,
    ) -> None:
        """Integrate all samples."""
        structures = self.queue.upload("Structure", packed.structures, plan.dtype)
        samples = self.queue.upload("Samples", packed.samples, plan.dtype)
        limit = self.scene.collapse_drift_ratio
        launches, first = [], 0
        for substeps, count in packed.groups:
            control = arguments.control(
                plan.dtype,
                samples=count,
                substeps=substeps,
                every=every,
                collapse_drift_ratio=np.inf if limit is None else limit,
                tolerance=self.tolerance,
                key=key_of(self.terms.seed),
            )
            part, last = samples, first + count
            if len(packed.groups) > 1:
                part = arguments.part_of(samples, "Samples", packed.samples, plan.dtype, first, last)
            launches.append(devices.Launch(control, part, packed.samples["run_intervals"][first:last] * substeps))
            first = last
        loads = self.terms.loads_on(self.queue.device)
        self.queue.launch(plan, launches, [structures, loads, output, history], advance)
