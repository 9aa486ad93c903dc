"""One run under way: the device's copies of its inputs, and the launches over its samples in chunks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from tqdm import tqdm

from warpdyn import pack
from warpdyn.kernels import build
from warpdyn.kernels.plan import Plan
from warpdyn.motions import Assignment
from warpdyn.recorders import HISTORY, RECORDERS
from warpdyn.scene import Scene
from warpdyn.timeline import Timeline

SHARE_OF_FREE_MEMORY = 0.25
LARGEST_CHUNK = 2**20
COPIES_OF_A_STRUCTURE = 8  # its parameters, drawn, combined and packed, in float64 and in the run's dtype


class Ensemble:
    """The launches of one run.

    Args:
        scene: The scene.
        drawn: Scattered parameters, one entry a structure.
        assignment: Which structure and motion each sample has.
        timeline: Time grid of each motion.
        run_intervals: Intervals each sample is integrated for, shape [sample].
        residual_steps: Steps at the end over which each residual drift is averaged, shape [sample].
        method: Integration method.
        dtype: "float32" or "float64".
        device: Warp device.
        threads: CPU threads.
    """

    def __init__(
        self,
        scene: Scene,
        drawn: dict[str, np.ndarray],
        assignment: Assignment,
        timeline: Timeline,
        run_intervals: np.ndarray,
        residual_steps: np.ndarray,
        *,
        method: str,
        dtype: str,
        device: str,
        threads: int,
    ) -> None:
        self.scene, self.drawn, self.assignment, self.timeline = scene, drawn, assignment, timeline
        self.run_intervals, self.residual_steps = run_intervals, residual_steps
        self.substeps = timeline.substeps[assignment.motion]
        self.dtype, self.device, self.threads = dtype, device, threads
        family = scene.structure.family
        lanes, max_unroll = build.lanes_and_unroll(family, scene.structure.dofs, device != "cpu")
        self.plan = Plan(
            family=family,
            dofs=scene.structure.dofs,
            law=pack.spring_of(scene, pack.parameters_of(scene, drawn)),
            damping=scene.structure.damping,
            load=pack.load_of(scene),
            recorders=scene.record,
            method=method,
            dtype=dtype,
            lanes=lanes,
            max_unroll=max_unroll,
        )
        self.loads = build.fill_struct("Load", pack.pack_load(scene, timeline), dtype, device)
        # Every dimension beside `sample` is as long as there are degrees of freedom.
        variables = {name: variable for r in scene.record for name, variable in RECORDERS[family][r].items()}
        self.shapes = {name: (self.plan.dofs,) * len(v.dims) for name, v in variables.items()} | {"status": ()}

    @property
    def kernel_name(self) -> str:
        """What the kernel computes, in one line."""
        p = self.plan
        return f"{p.family} {p.dofs} {p.law} {p.damping} {p.load} {'+'.join(p.recorders)} {p.method} {p.dtype}"

    def check_common_step(self, samples: Sequence[int]) -> None:
        """Raise unless the histories asked for share one time grid."""
        steps = self.timeline.step[self.assignment.motion[list(samples)]]
        differs = ~np.isclose(steps, steps[0], rtol=1e-6, atol=0.0)
        if differs.any():
            other = int(np.flatnonzero(differs)[0])
            raise ValueError(
                f"histories of samples {samples[0]} and {samples[other]} have steps {steps[0]:g} and "
                f"{steps[other]:g} s: ask for samples of one step, or give simulate() a step that divides all"
            )

    def _structures(self, samples: np.ndarray) -> tuple[object, np.ndarray]:
        """Return the structures of some samples on the device, and which of them each sample has."""
        index = self.assignment.structure[samples] if self.drawn else np.zeros(samples.size, dtype=np.int32)
        unique, place = np.unique(index, return_inverse=True)
        parameters = pack.parameters_of(self.scene, self.drawn, unique)
        packed = pack.PACKERS[self.plan.family](self.scene, parameters, self.plan.law)
        return build.fill_struct("Structure", packed, self.dtype, self.device), place

    def _launch(
        self,
        plan: Plan,
        samples: np.ndarray,
        columns: np.ndarray,
        output: object,
        history: object,
        every: int = 1,
        advance: Callable[[int], object] = lambda done: None,
    ) -> None:
        """Integrate some samples and write each to its column of the outputs."""
        structures, place = self._structures(samples)
        limit = self.scene.collapse_drift_ratio
        collapse = [np.inf if limit is None else limit] if plan.family == "chain" else []
        for substeps in np.unique(self.substeps[samples]):
            chosen = np.flatnonzero(self.substeps[samples] == substeps)
            # Longest first and neighbours alike: no thread waits long for another's last history.
            chosen = chosen[np.argsort(-self.run_intervals[samples[chosen]], kind="stable")]
            arrays = {
                "output": columns[chosen],
                "structure": place[chosen],
                "motion": self.assignment.motion[samples[chosen]],
                "scale": self.assignment.scale[samples[chosen]],
                "run_intervals": self.run_intervals[samples[chosen]],
                "residual_steps": self.residual_steps[samples[chosen]],
            }
            launched = build.fill_struct("Samples", arrays, self.dtype, self.device)
            arguments = [
                chosen.size,
                int(substeps),
                every,
                *collapse,
                launched,
                structures,
                self.loads,
                output,
                history,
            ]
            build.launch(plan, chosen.size, arguments, self.device, self.threads, advance)

    def _chunk(self) -> int:
        """Return how many samples fit the memory at hand, with the structures they need."""
        samples = self.assignment.structure.size
        values = sum(int(np.prod(shape)) for shape in self.shapes.values()) + 8  # and a sample's own indices
        one = pack.parameters_of(self.scene, self.drawn, slice(0, 1))
        packed = pack.PACKERS[self.plan.family](self.scene, one, self.plan.law)
        structures = len(next(iter(self.drawn.values()))) if self.drawn else 0
        values += COPIES_OF_A_STRUCTURE * sum(array.size for array in packed.values()) * structures / samples
        fitting = int(SHARE_OF_FREE_MEMORY * build.free_memory(self.device) / (8 * values))
        return max(self.plan.lanes, min(fitting, LARGEST_CHUNK))

    def integrate(self, samples_per_chunk: int | None) -> dict[str, np.ndarray]:
        """Return every recorded variable, sample last."""
        total = self.assignment.structure.size
        chunk = samples_per_chunk or self._chunk()
        results: dict[str, np.ndarray] = {}
        no_history = build.fill_struct("History", {}, self.dtype, self.device)
        with tqdm(total=total, unit="history", unit_scale=True, disable=None) as progress:
            for start in range(0, total, chunk):
                samples = np.arange(start, min(start + chunk, total))
                output = build.blank_output(self.shapes, samples.size, self.dtype, self.device)
                self._launch(self.plan, samples, samples - start, output, no_history, advance=progress.update)
                for name, shape in self.shapes.items():
                    part = build.read_array(output, name)
                    if name not in results:
                        results[name] = np.empty((*shape, total), part.dtype)
                    results[name][..., start : start + samples.size] = part
        return results

    def integrate_histories(self, kept: Sequence[int], every: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return the time grid [s] and each variable's histories, shape [history, time, dof], NaN after a run's end."""
        samples = np.array(kept)
        last = self.run_intervals[samples] * self.substeps[samples]
        times = last.max() // every + 1
        plan = build.history_plan(self.plan)
        names = list(HISTORY) if plan.family == "chain" else [n for n in HISTORY if n != "storey_force"]
        shape = (samples.size, int(times), plan.dofs)
        history = build.fill_struct(
            "History", {name: np.full(shape, np.nan) for name in names}, self.dtype, self.device
        )
        output = build.blank_output({"status": ()}, samples.size, self.dtype, self.device)
        self._launch(plan, samples, np.arange(samples.size), output, history, every=every)
        time_grid = np.arange(times) * every * self.timeline.step[self.assignment.motion[samples[0]]]
        values = {name: build.read_array(history, name) for name in names}
        for row, end in enumerate(last):
            for array in values.values():
                array[row, end // every + 1 :] = np.nan
        return time_grid, values
