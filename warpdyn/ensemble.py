"""One run under way: the device's copies of its inputs, and the launches over its samples in chunks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from tqdm import tqdm

from warpdyn import pack
from warpdyn.kernels import build
from warpdyn.kernels.plan import Plan
from warpdyn.motions import Assignment
from warpdyn.recorders import HISTORY, RECORDERS, Variable
from warpdyn.scene import Scene
from warpdyn.timeline import Timeline

SHARE_OF_FREE_MEMORY = 0.25
LARGEST_CHUNK = 2**20


class Ensemble:
    """One simulate() under way: the device's copies of the inputs, and the launches over them."""

    def __init__(
        self,
        scene: Scene,
        parameters: dict[str, np.ndarray],
        assignment: Assignment,
        timeline: Timeline,
        method: str,
        dtype: str,
        device: str,
        threads: int,
    ) -> None:
        self.scene, self.assignment, self.timeline = scene, assignment, timeline
        self.dtype, self.device, self.threads = dtype, device, threads
        family = scene.structure.family
        lanes, max_unroll = build.lanes_and_unroll(family, scene.structure.dofs, device != "cpu")
        self.plan = build.Plan(
            family=family,
            dofs=scene.structure.dofs,
            law=pack.spring_of(scene, parameters),
            damping=scene.structure.damping,
            load=pack.load_of(scene),
            recorders=scene.record,
            method=method,
            dtype=dtype,
            lanes=lanes,
            max_unroll=max_unroll,
        )
        packed = pack.pack_chain(scene, parameters) if family == "chain" else pack.pack_dense(scene, parameters)
        structures = len(next(iter(parameters.values())))
        self.structure_index = assignment.structure if structures > 1 else np.zeros_like(assignment.structure)
        self.structures = build.fill_struct("Structure", packed, dtype, device)
        self.load = pack.pack_load(scene, structures) | {
            "step": timeline.step,
            "intervals": timeline.intervals,
            "run_intervals": timeline.run_intervals,
            "residual_from": timeline.residual_from,
        }
        self.loads = build.fill_struct("Load", self.load, dtype, device)
        self.variables = {name: variable for r in scene.record for name, variable in RECORDERS[family][r].items()} | {
            "status": Variable((), "1", "", integer=True)
        }

    @property
    def kernel_name(self) -> str:
        """What the kernel computes, in one line."""
        p = self.plan
        return f"{p.family} {p.dofs} {p.law} {p.damping} {p.load} {'+'.join(p.recorders)} {p.method} {p.dtype}"

    def check_common_step(self, samples: Sequence[int]) -> None:
        """Raise unless the histories asked for share one time grid."""
        steps = self.timeline.step[self.assignment.motion[list(samples)]]
        if np.unique(steps).size > 1:
            other = int(np.flatnonzero(steps != steps[0])[0])
            raise ValueError(
                f"histories of samples {samples[0]} and {samples[other]} have steps {steps[0]:g} and "
                f"{steps[other]:g} s: ask for samples of one step, or give simulate() a step that divides all"
            )

    def _launch(
        self,
        plan: Plan,
        chosen: np.ndarray,
        columns: np.ndarray,
        loads: object,
        substeps: int,
        output: object,
        history: object,
        every: int = 1,
        advance: Callable[[int], object] = lambda done: None,
    ) -> None:
        """Integrate the chosen samples and write each to its column of the outputs."""
        arrays = {
            "output": columns,
            "structure": self.structure_index[chosen],
            "motion": self.assignment.motion[chosen],
            "scale": self.assignment.scale[chosen],
        }
        samples = build.fill_struct("Samples", arrays, self.dtype, self.device)
        limit = self.scene.collapse_drift_ratio
        collapse = [np.inf if limit is None else limit] if plan.family == "chain" else []
        arguments = [chosen.size, int(substeps), every, *collapse, samples, self.structures, loads, output, history]
        build.launch(plan, chosen.size, arguments, self.device, self.threads, advance)

    def integrate(self, samples_per_chunk: int | None) -> dict[str, np.ndarray]:
        """Return every recorded variable, sample last."""
        total = self.assignment.structure.size
        sizes = {"storey": self.plan.dofs, "floor": self.plan.dofs, "dof": self.plan.dofs}
        shapes = {name: tuple(sizes[d] for d in v.dims) for name, v in self.variables.items()}
        values = sum(int(np.prod(shape)) for shape in shapes.values()) + 4  # and the four indices of a sample
        fitting = int(SHARE_OF_FREE_MEMORY * build.free_memory(self.device) / (values * np.dtype(self.dtype).itemsize))
        chunk = samples_per_chunk or max(self.plan.lanes, min(fitting, LARGEST_CHUNK))
        results: dict[str, np.ndarray] = {}
        no_history = build.fill_struct("History", {}, self.dtype, self.device)
        substeps_of = self.timeline.substeps[self.assignment.motion]
        with tqdm(total=total, unit="history", unit_scale=True, disable=None) as progress:
            for start in range(0, total, chunk):
                stop = min(start + chunk, total)
                output = build.blank_output(shapes, stop - start, self.dtype, self.device)
                for substeps in np.unique(substeps_of[start:stop]):
                    chosen = start + np.flatnonzero(substeps_of[start:stop] == substeps)
                    # Longest first and neighbours alike: no thread waits long for another's last history.
                    lengths = self.timeline.run_intervals[self.assignment.motion[chosen]]
                    chosen = chosen[np.argsort(-lengths, kind="stable")]
                    self._launch(
                        self.plan,
                        chosen,
                        chosen - start,
                        self.loads,
                        substeps,
                        output,
                        no_history,
                        advance=progress.update,
                    )
                for name, shape in shapes.items():
                    part = build.read_array(output, name)
                    if name not in results:
                        results[name] = np.empty((*shape, total), part.dtype)
                    results[name][..., start:stop] = part
        return results

    def integrate_histories(self, kept: Sequence[int], every: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return the time grid [s] and each variable's histories, shape [history, time, dof], NaN after a run's end."""
        chosen = np.array(kept)
        motion = self.assignment.motion[chosen]
        last = self.timeline.run_intervals[motion] * self.timeline.substeps[motion]
        times = last.max() // every + 1
        # One interval more, so that the state at the end is evaluated and kept too.
        loads = build.fill_struct(
            "Load", self.load | {"run_intervals": self.timeline.run_intervals + 1}, self.dtype, self.device
        )
        plan = build.history_plan(self.plan)
        names = list(HISTORY) if plan.family == "chain" else [n for n in HISTORY if n != "storey_force"]
        shape = (chosen.size, int(times), plan.dofs)
        blank = {name: np.full(shape, np.nan) for name in names}
        history = build.fill_struct("History", blank, self.dtype, self.device)
        output = build.blank_output({"status": ()}, chosen.size, self.dtype, self.device)
        for substeps in np.unique(self.timeline.substeps[motion]):
            rows = np.flatnonzero(self.timeline.substeps[motion] == substeps)
            self._launch(plan, chosen[rows], rows, loads, substeps, output, history, every=every)
        time_grid = np.arange(times) * every * self.timeline.step[motion[0]]
        values = {name: build.read_array(history, name) for name in names}
        for row, end in enumerate(last):
            for array in values.values():
                array[row, end // every + 1 :] = np.nan
        return time_grid, values
