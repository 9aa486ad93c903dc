"""Preparation of the blocks of a run (drawing, steps, sorting) by kernels on the device that integrates them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.integration import packing
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.preparation.traced_samples import traced_samples
from warpdyn.campaigns.preparation.traced_structures import traced_structures
from warpdyn.engine.kernels import arguments
from warpdyn.engine.kernels.loads import LOADS
from warpdyn.engine.kernels.plan import structs
from warpdyn.engine.kernels.preparing import samples as of_samples
from warpdyn.engine.kernels.preparing.samples import Design, sort_samples
from warpdyn.engine.kernels.preparing.structures import LEAST_STABLE_STEP, LONGEST_PERIOD
from warpdyn.engine.kernels.queues import Queue
from warpdyn.engine.tracing.arrays import NotTraceableError
from warpdyn.foundations.core.messages import LOGGER
from warpdyn.model.ground_motions.excitation import Assignment

# Recording the NumPy computation as a kernel takes 10 to 20 ms. In this time the host prepares 2^14 structures, or 2^18
# samples of a few structures (H100, 16 cores).
LEAST_SAMPLES = 2**17


@dataclass(frozen=True, eq=False, kw_only=True)
class PreparedBlock:
    """A block of samples whose arrays a device has prepared in its memory, with the results that the host needs.

    Args:
        structures, samples: Arguments of the kernels that integrate the samples.
        dtype: Number type of these kernels.
        fields: Names of the arrays in `samples`.
        count: Number of samples.
        step: Integration step of each sample [s], a device array in float64.
        substeps: Number of steps per motion interval of each sample, a device array.
        groups: For each launch, the number of steps per interval and the number of samples.
        counts, extremes: Counts and extreme values from the preparation kernels; see `engine/kernels/preparing`.
        usual_steps: Steps of the samples of each structure [s] if no step was divided; None if structures differ.
    """

    structures: Any
    samples: Any
    dtype: str
    fields: list[str]
    count: int
    step: Any
    substeps: Any
    groups: list[tuple[int, int]]
    counts: np.ndarray
    extremes: np.ndarray
    usual_steps: np.ndarray | None

    @property
    def is_refused(self) -> bool:
        """Whether a structure or a sample is invalid or cannot be prepared by kernels, so that the host must do it."""
        return bool(self.counts[of_samples.REFUSED])

    @property
    def unstable(self) -> int:
        """Number of samples whose step was beyond the stability limit before it was divided."""
        return int(self.counts[of_samples.UNSTABLE])

    @property
    def first_unstable(self) -> int:
        """Index of the first sample whose step was beyond the stability limit."""
        return int(self.counts[of_samples.FIRST_UNSTABLE])

    @property
    def long(self) -> int:
        """Number of samples whose step is too long to be accurate."""
        return int(self.counts[of_samples.LONG])

    @property
    def longest_period(self) -> float:
        """Longest first period of the structures [s]."""
        return float(self.extremes[LONGEST_PERIOD])

    @property
    def least_stable_step(self) -> float:
        """Longest step that is stable for all structures [s]."""
        return float(self.extremes[LEAST_STABLE_STEP])

    @property
    def largest_factor(self) -> float:
        """Largest factor by which the number of steps of a sample was multiplied to make it stable."""
        return float(self.extremes[of_samples.LARGEST_FACTOR])

    @property
    def least_accurate_step(self) -> float:
        """Longest step that is accurate for all samples [s]."""
        return float(self.extremes[of_samples.LEAST_ACCURATE_STEP])

    def samples_from(self, first: int, count: int) -> Any:
        """Return the kernel argument `samples` for `count` samples from number `first` on, in the launch order."""
        if count == self.count:
            return self.samples
        return arguments.with_part(self.samples, "Samples", self.fields, self.dtype, order=slice(first, first + count))

    def on_host(self, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the launch order and the durations (in intervals) of samples for a CPU; a GPU does not read them."""
        if not self.step.device.is_cpu:
            nothing = np.arange(0)
            return nothing, nothing
        return self.samples.order.numpy()[first : first + count], self.samples.run_intervals.numpy()

    def steps(self) -> np.ndarray:
        """Return the integration step of each sample [s]."""
        if self.usual_steps is None or self.counts[of_samples.IS_DIVIDED]:
            return self.step.numpy().copy()
        return np.tile(self.usual_steps, self.count // self.usual_steps.size)

    def numbers_of_steps(self) -> np.ndarray:
        """Return the number of integration steps of each sample, in float64."""
        numbers: np.ndarray = self.samples.run_intervals.numpy() * self.substeps.numpy().astype(np.float64)
        return numbers


class Preparation:
    """Preparation of a run's blocks by kernels on the devices: structures are drawn, steps chosen, samples sorted.

    Args:
        run: The prepared run.

    Raises:
        NotTraceableError: If kernels cannot prepare this run.
    """

    def __init__(self, run: Run) -> None:
        model = run.model
        if LOADS[model.plan.load].noise_states:
            raise NotTraceableError("the motion of a sample depends on its number")
        self.run, self.dtype = run, model.plan.dtype
        self._each = run.samples // run.structures
        self._structures = traced_structures(run) if run.sampler.scatter else None
        self._samples = traced_samples(run)
        self._has_ties = model.plan.collapses
        self._brought: dict[str, Design] = {}  # by device
        excitation = model.scene.excitation
        self._pattern = excitation.assign(np.arange(1), model.seed) if excitation.is_same_for_all else None
        table = excitation.motion_table()
        self._table = None if table is None or table.entries.motion.size > run.samples else table

    @property
    def kernels(self) -> list[wp.Kernel]:
        """The kernels that prepare a block of samples."""
        return [*([] if self._structures is None else self._structures.kernels), *self._samples.kernels]

    def begin(self, structures: range, queue: Queue) -> Callable[[], PreparedBlock]:
        """Queue the preparation of a range of structures; return a function that waits for it and returns the block."""
        count, samples, first = len(structures), len(structures) * self._each, structures.start
        with queue.urgently():
            shape = 1 if self._structures is None else count
            vibration = queue.memory("vibration", "", (3, shape), wp.float64)
            counts = queue.memory("counts", "", (of_samples.COUNTS,), wp.int32)
            extremes = queue.memory("extremes", "", (of_samples.EXTREMES,), wp.float64)
            # Copy before launching kernels: the host waits for a copy, which waits for kernels queued before it.
            counts.assign(_first_counts(samples))
            extremes.assign(np.array([0.0, np.inf, 1.0, np.inf]))
            design = self._design(structures, queue)
            packed = self._packed(first, count, queue, vibration, counts, extremes)
            struct = self._struct("Samples", dict.fromkeys(self._samples.fields, ()), samples, queue)
            taken = queue.memory("taken", "", (samples,), wp.int32)
            step = queue.memory("step", "", (samples,), wp.float64)
            self._samples.prepare(samples, design, vibration, struct, (taken, step), counts, extremes)
            keys = queue.memory("keys", "", (2 * samples,), wp.int64)
            order = queue.memory("order", "", (2 * samples,), wp.int32)
            sort_samples(samples, design, struct.run_intervals, taken, counts, keys, order, has_ties=self._has_ties)
            struct.order = order[:samples]
            fetched = queue.fetch({"counts": counts, "extremes": extremes})

        def finish() -> PreparedBlock:
            found = fetched()
            starts = found["counts"][of_samples.STARTS :]
            substeps = np.flatnonzero(starts >= 0)  # in the order of the launch
            numbers = np.diff(starts[substeps], append=samples)
            return PreparedBlock(
                structures=packed,
                samples=struct,
                dtype=self.dtype,
                fields=[*self._samples.fields, "order"],
                count=samples,
                step=step,
                substeps=taken,
                groups=[(int(each), int(number)) for each, number in zip(substeps, numbers, strict=True)],
                counts=found["counts"],
                extremes=found["extremes"],
                usual_steps=None if self._pattern is None else self.run.model.timeline.steps[self._pattern.motion],
            )

        return finish

    def _packed(self, first: int, count: int, queue: Queue, vibration: Any, counts: Any, extremes: Any) -> Any:
        """Queue the preparation of `count` structures from number `first` on; return them as kernels read them.

        The kernels write periods, decays and stable steps of the structures to `vibration`.
        """
        if self._structures is None:  # nothing is drawn: all samples share one structure
            drawn, of_one = self.run.draw(np.arange(1))
            rows = np.array([of_one.period, of_one.decay, of_one.stable_step])
            vibration.assign(rows)
            extremes.assign(np.array([of_one.period[0], of_one.stable_step[0], 1.0, np.inf]))
            parameters = self.run.model.dynamics.parameters_of(drawn)
            packed = packing.pack_structures(self.run.model, parameters, None, of_one.rayleigh)
            return queue.upload("Structure", arguments.as_fields("Structure", packed, self.dtype), self.dtype)
        struct = self._struct("Structure", self._structures.rows, count, queue)
        self._structures.prepare(first, count, struct, vibration, counts, extremes)
        return struct

    def _struct(self, kind: str, rows: Mapping[str, tuple[int, ...]], count: int, queue: Queue) -> Any:
        """Return a kernel struct of the name `kind` with device memory for its fields.

        Args:
            kind: Name of the struct, "Structure" or "Samples".
            rows: Shape of each field without its last dimension.
            count: Length of the last dimension: number of structures or samples.
            queue: Device queue.
        """
        struct = getattr(structs(self.dtype), kind)
        instance = struct()
        for name, shape in rows.items():
            setattr(instance, name, queue.memory(kind, name, (*shape, count), struct.vars[name].type.dtype))
        return instance

    def _design(self, structures: range, queue: Queue) -> Design:
        """Return the motions and scale factors of the samples of a range of structures, in the memory of a device."""
        device = queue.device
        if self._pattern is None and self._table is None:
            assignment = self.run.model.scene.excitation.assign(np.asarray(structures), self.run.model.seed)
            return self._brought_to(device, assignment, of_samples.LISTED)
        if device not in self._brought:
            if self._table is not None:
                self._brought[device] = self._brought_to(device, self._table.entries, of_samples.AT_SITES)
            elif self._pattern is not None:
                self._brought[device] = self._brought_to(device, self._pattern, of_samples.SAME_FOR_ALL)
        if self._table is None:
            return self._brought[device]
        rows = self._table.site[structures.start : structures.stop]
        site = queue.memory("site", "", rows.shape, wp.int32)
        site.assign(rows.astype(np.int32))
        return self._brought[device]._replace(site=site)

    def _brought_to(self, device: str, assignment: Assignment, kind: int) -> Design:
        """Return motions and scale factors in the memory of a device; `kind` is the kind of design that they follow."""
        timeline = self.run.model.timeline

        def brought(values: np.ndarray, dtype: Any) -> Any:
            return wp.array(np.ascontiguousarray(values), dtype=dtype, device=device)

        tie = np.zeros(assignment.motion.size, np.uint32)
        if self._has_ties:  # the strongest motions come first, in the order in which the host sorts them
            rank = packing.rank_of_intensity(assignment).astype(np.uint32)
            tie = (rank << np.uint32(16)) | np.minimum(assignment.motion, 2**16 - 1).astype(np.uint32)
        table = self._table
        return Design(
            self._each,
            self._structures is None,
            kind,
            brought(np.zeros((1, 1)), wp.int32),
            brought(np.zeros(1) if table is None else table.offset, wp.int32),
            0 if table is None else table.stride,
            brought(assignment.motion, wp.int32),
            brought(assignment.scale, wp.float64),
            brought(timeline.interval, wp.float64),
            brought(timeline.substeps, wp.int32),
            brought(timeline.intervals, wp.int32),
            brought(tie, wp.uint32),
        )


def preparation_of(run: Run) -> Preparation | None:
    """Return the preparation of a run by kernels on its devices, or None if the host must prepare it.

    The host prepares small runs, runs on a CPU, and sequences of events. It also prepares runs whose computation cannot
    be recorded as a kernel (see `NotTraceableError`): full matrices, exact methods, and motions that depend on the
    number of the sample.
    """
    events = run.model.scene.excitation.event_names
    if (
        not is_large_on_gpu(run)
        or len(events) > 1
        or run.model.scene.control is not None
        or run.integration.on_unstable != "substep"
    ):
        return None
    try:
        return Preparation(run)
    except NotTraceableError as reason:
        LOGGER.info("the host prepares the structures and samples of this run, because %s", reason)
        return None


def is_large_on_gpu(run: Run) -> bool:
    """Return whether a run is executed on GPUs and has at least LEAST_SAMPLES samples, so that kernels save time.

    On a CPU, the threads that run kernels also prepare the next samples. The choice depends on the whole run and not on
    a block, because kernels and host round differently: results must not depend on the division into blocks.
    """
    return run.execution.is_gpu and run.samples >= LEAST_SAMPLES


def _first_counts(samples: int) -> np.ndarray:
    """Return initial counts of a block (unstable samples, longest duration, ...), which preparation kernels update."""
    counts = np.zeros(of_samples.COUNTS, np.int32)
    counts[of_samples.FIRST_UNSTABLE] = samples
    counts[of_samples.STARTS :] = -1
    return counts
