"""An ensemble whose response histories pause between intervals of the motion until more samples are known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import warp as wp

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.time_grid import Schedule
from warpdyn.engine.kernels import arguments
from warpdyn.engine.kernels.auxiliary.interpolation import write_interpolated
from warpdyn.engine.kernels.build import pausing_of
from warpdyn.engine.kernels.kernel_cache import THREADS_OF_A_BLOCK
from warpdyn.engine.kernels.pausing.paused_text import Pausing
from warpdyn.engine.kernels.plan import DTYPES, LAST_INTERVAL, Plan, output_struct, paused_struct, structs
from warpdyn.engine.kernels.queues import Launch
from warpdyn.model.ground_motions.excitation import MOST_STEPS

ROOM = 2**10  # least number of accelerations in the memory of a packet


@dataclass
class Group:
    """Samples with the same number of integration steps per interval of the motion, which one launch integrates.

    Args:
        plan: Plan of the kernel, which can pause.
        finer: Number of intervals of the kernel in one interval of the motion (on a GPU, one for each step).
        substeps: Number of integration steps in one interval of the motion.
        count: Number of samples.
        inputs: Structs Control, Samples and Structure of the launch.
        order: Indices of the samples in the order of the launch, shape [sample].
        state: Values that the kernel stores when it pauses: {field of the struct Paused: array [row, column]}.
        paused: Struct Paused with the arrays `state`.
    """

    plan: Plan
    finer: int
    substeps: int
    count: int
    inputs: tuple[Any, Any, Any]
    order: np.ndarray
    state: dict[str, wp.array]
    paused: Any

    @property
    def pausing(self) -> Pausing:
        """The source of the kernel, and the variables that it stores."""
        return pausing_of(self.plan)


class PausedEnsemble:
    """All samples of an ensemble under one motion, integrated up to the last sample of the motion that is known.

    Args:
        ensemble: The samples with their structures and steps. The values and the length of its motion are not read.

    Attributes:
        intervals: Number of intervals of the motion (times between two samples) that have been integrated.
    """

    def __init__(self, ensemble: Ensemble) -> None:
        self.ensemble, self.queue, self.dtype = ensemble, ensemble.queue, ensemble.plan.dtype
        self.device, self.intervals = ensemble.queue.device, 0
        self.is_whole = True
        # While the motion arrives, its end is not known: more intervals than kernels can count steps.
        self.most_intervals = MOST_STEPS // (int(ensemble.schedule.substeps.max()) + 1)
        self._base = ensemble.model.packed_loads()
        self._components = max(1, ensemble.scene.excitation.base_components)
        self._history = self.queue.upload("History", {}, self.dtype)
        self._loads: dict[int, Any] = {}  # structs Load, by `Group.finer`; their arrays are kept for the next packet
        self.groups = [self._group(launch) for launch in self._launches()]

    def _launches(self) -> list[Launch]:
        """Upload the samples with their structures; return their launches, in an order that does not depend on ends."""
        ensemble, schedule = self.ensemble, self.ensemble.schedule
        endless = np.full(ensemble.size, self.most_intervals, dtype=np.int32)
        ensemble.schedule = replace(schedule, run_intervals=endless, repeats=1)
        launches = ensemble.launches()
        ensemble.schedule = schedule
        return launches

    def _group(self, launch: Launch) -> Group:
        """Return the group of a launch, with a state of zeros."""
        plan, finer = replace(launch.plan, pauses=True), launch.substeps if launch.plan.undivided else 1
        columns = -(-launch.count // plan.lanes) * plan.lanes
        if self.device != "cpu":  # whole blocks of threads are launched
            columns = -(-plan.threads_of(launch.count) // THREADS_OF_A_BLOCK) * THREADS_OF_A_BLOCK * plan.lanes
        pausing = pausing_of(plan)
        types = {"real": DTYPES[self.dtype], "real64": wp.float64, "whole": wp.int32}
        state = {
            name: wp.zeros((pausing.rows(name), columns), dtype=kind, device=self.device)
            for name, kind in types.items()
        }
        paused = paused_struct(self.dtype)()
        for name, array in state.items():
            setattr(paused, name, array)
        return Group(plan, finer, launch.substeps, launch.count, launch.inputs[:3], launch.order, state, paused)

    def advance(self, values: np.ndarray) -> None:
        """Integrate all intervals of the motion that these samples end.

        Args:
            values: Accelerations [m/s2], shape [time, component]: of the sample up to which the histories are
                integrated, and of all following samples that are known.

        Raises:
            ValueError: If the motion would have more steps than kernels can count.
        """
        count = len(values) - 1
        if self.intervals + count >= self.most_intervals:
            raise ValueError(
                f"the motion has more than {self.most_intervals} samples, the most that can be integrated with these "
                "steps: call finish(), and begin a new Live"
            )
        self.check_whole()
        if count < 1:
            return
        self.is_whole = False  # an interruption leaves some samples behind the others
        self._launch(values, self.most_intervals, self.most_intervals, count)
        self.intervals += count
        self.is_whole = True

    def check_whole(self) -> None:
        """Raise a ValueError if `advance` was interrupted, so that only some samples were integrated."""
        if not self.is_whole:
            raise ValueError(
                "the integration of the last packet was interrupted, so that samples are at different times: begin "
                "again, or continue from a saved state with wd.load_state"
            )

    def outputs(self, values: np.ndarray, motion: int, schedule: Schedule | None = None) -> Arrays:
        """Integrate the rest of a run, and return all its outputs by name, shape [sample, ...]; no state changes.

        Arguments: see `write_outputs`.
        """
        self.write_outputs(values, motion, schedule)
        return self.read_outputs()

    def write_outputs(self, values: np.ndarray, motion: int, schedule: Schedule | None = None) -> None:
        """Integrate the rest of a run, and write all its outputs to `output`; no state changes.

        Args:
            values: Accelerations [m/s2] from the last integrated sample to the last sample, shape [time, component].
            motion: Number of intervals of the whole motion.
            schedule: Durations of the samples with the free vibration after the motion, and of the average that gives
                the residual drift; None: the run ends with the motion.
        """
        self.check_whole()
        struct = output_struct(self.dtype, self.ensemble.model.shapes)
        for name in self.ensemble.model.shapes:
            getattr(self.output, name).fill_(arguments.blank_value(struct, name))
        if schedule is not None:
            self.groups[0].inputs[1].residual_steps.assign(schedule.residual_steps.astype(np.int32))
        self._launch(values, motion, motion if schedule is None else schedule.run_intervals, None)

    def read_outputs(self) -> Arrays:
        """Return all outputs that `write_outputs` has written, by name, as new arrays of shape [sample, ...]."""
        rows = self.ensemble.model.blank_outputs(self.ensemble.size)
        if self.device == "cpu":
            for name, values in rows.items():
                np.copyto(values, getattr(self.output, name).numpy().T)
        else:
            self.queue.start_reading(self.output, {name: array.shape for name, array in rows.items()})
            self.queue.read_into(rows)
        return rows

    @cached_property
    def output(self) -> Any:
        """Struct Output whose arrays, shape [..., sample], are on the device and are used again by each launch."""
        shapes, size = self.ensemble.model.shapes, self.ensemble.size
        struct = output_struct(self.dtype, shapes)
        output = struct()
        for name, shape in shapes.items():
            kind = struct.vars[name].type.dtype
            setattr(output, name, wp.empty((*reversed(shape), size), dtype=kind, device=self.device))
        return output

    def states(self) -> Arrays:
        """Return the values that live between two intervals, by the name of the kernel's variable.

        Returns:
            Arrays of shape [sample, row], such as `u` (displacements), `v` (velocities) and `z` (memory of the storey
            laws), with one row for each floor, storey or value of a memory.

        Raises:
            ValueError: If several threads of a GPU share a sample.
        """
        self._check_one_thread()
        found: Arrays = {}
        for group in self.groups:
            arrays = {name: array.numpy() for name, array in group.state.items()}
            for each in group.pausing.carried:
                rows = arrays[each.array][each.first : each.first + each.rows, : group.count].T
                whole = found.setdefault(each.name, np.zeros((self.ensemble.size, each.rows), rows.dtype))
                whole[group.order] = rows
        return found

    def set_states(self, states: Arrays) -> None:
        """Replace the values that live between two intervals; `states` is in the form that `states()` returns."""
        self._check_one_thread()
        for group in self.groups:
            arrays = {name: array.numpy().copy() for name, array in group.state.items()}
            for each in group.pausing.carried:
                given = np.asarray(states[each.name])[group.order]
                if given.shape != (group.count, each.rows) or not np.isfinite(given).all():
                    raise ValueError(
                        f"states[{each.name!r}] must be finite values of shape [{self.ensemble.size}, {each.rows}] "
                        f"(sample, row), got the shape {np.shape(states[each.name])}"
                    )
                rows = slice(each.first, each.first + each.rows)
                arrays[each.array][rows, : group.count] = given.T
                # Lanes beyond the last sample repeat it, and may write its results.
                arrays[each.array][rows, group.count :] = given.T[:, -1:]
            for name, array in group.state.items():
                array.assign(arrays[name])

    def resample(self, samples: np.ndarray, drawn: Arrays | None = None) -> None:
        """Let each sample continue from the state of another one, with its parameters or with new ones.

        Args:
            samples: Index of the sample from whose state sample i continues, shape [sample].
            drawn: New scattered parameters of the structures, by name, first dimension structure; None: those of
                `samples`.

        Raises:
            ValueError: If a sample would continue from a sample with another integration step.
        """
        ensemble, samples = self.ensemble, np.asarray(samples)
        substeps = ensemble.schedule.substeps
        if (substeps[samples] != substeps).any():
            raise ValueError(
                "samples with different integration steps cannot be exchanged: give step= [s], so that all have the "
                "same step"
            )
        if ensemble.drawn and not np.array_equal(ensemble.row, np.arange(ensemble.size)):
            raise ValueError("only a scene with one motion per structure can be resampled: give one motion")
        self.set_states({name: values[samples] for name, values in self.states().items()})
        parameters = {name: values[samples] for name, values in ensemble.drawn.items()} if drawn is None else drawn
        if not parameters:
            return
        rayleigh = ensemble.model.dynamics.vibration_of(
            parameters, ensemble.model.method, ensemble.model.threads
        ).rayleigh
        held = ensemble.structures, parameters, rayleigh, ensemble.assignment, ensemble.row, ensemble.schedule
        self.ensemble = Ensemble(ensemble.model, *held, ensemble.sample, self.queue)
        for group, launch in zip(self.groups, self._launches(), strict=True):
            group.inputs = launch.inputs[:3]

    def _check_one_thread(self) -> None:
        """Raise a ValueError if several threads of a GPU share a sample, so that a state is not in one column."""
        if any(group.plan.sections > 1 for group in self.groups):
            raise ValueError("the states of tall chains on a GPU are divided among threads: give device='cpu'")

    def _launch(self, values: np.ndarray, motion: int, run: int | np.ndarray, count: int | None) -> None:
        """Integrate `count` intervals and pause, or, if `count` is None, integrate to the end of the run."""
        self.queue.begin()  # deletes the times of earlier launches
        loads = {finer: self._load(values, motion, finer) for finer in {group.finer for group in self.groups}}
        run_intervals = self.groups[0].inputs[1].run_intervals  # all groups share this array
        costs: np.ndarray  # intervals of each sample in this launch, by which a CPU divides it among its threads
        if isinstance(run, np.ndarray):
            run_intervals.assign(run.astype(np.int32))
            costs = np.maximum(run - self.intervals, 1)
        else:
            run_intervals.fill_(run)
            costs = np.broadcast_to(max(len(values) - 1, 1), self.ensemble.size)
        wp.synchronize_device(self.device)  # streams of the queue do not wait for these copies
        for group in self.groups:
            paused = group.paused
            paused.first = self.intervals * group.finer
            paused.last = LAST_INTERVAL if count is None else paused.first + count * group.finer
            paused.stores = 0 if count is None else 1
            inputs = (*group.inputs, loads[group.finer])
            launch = Launch(group.plan, inputs, group.count, group.substeps, group.order, costs)
            self.queue.launch([launch], [self.output, self._history, paused])
        # A GPU still reads the samples of the packet and the ends of the runs, and writes the states.
        wp.synchronize_device(self.device)
        self.queue.settle()

    def _load(self, values: np.ndarray, motion: int, finer: int) -> Any:
        """Return the struct Load with the samples of a packet; the first is that of interval `self.intervals`."""
        given = arguments.as_field(structs(self.dtype).Load, "values", np.ravel(values))
        load = self._held_load(1, given.size)
        # The current stream belongs to the device: another thread may replace it between the copy and the kernel.
        stream = None if self.device == "cpu" else wp.get_stream(self.device)
        here: wp.array = wp.array(given, dtype=load.values.dtype, device="cpu", copy=False)
        wp.copy(load.values, here, count=given.size, stream=stream)
        if finer > 1:
            coarse, rows = load.values, finer * (len(values) - 1) + 1
            load = self._held_load(finer, rows * self._components)
            write_interpolated(coarse, self.dtype, finer, self._components, load.values, rows, stream)
        load.first.fill_(-self.intervals * finer)
        load.intervals.fill_(motion * finer)
        return load

    def _held_load(self, finer: int, size: int) -> Any:
        """Return a struct Load whose arrays have at least `size` accelerations and are kept for the next packet."""
        load = self._loads.get(finer)
        if load is None or load.values.size < size:
            room = np.zeros(max(2 * size, ROOM))
            packed = self._base | {"values": room, "first": np.zeros(1), "intervals": np.zeros(1)}
            load = self._loads[finer] = arguments.brought("Load", packed, self.dtype, self.device)
        return load
