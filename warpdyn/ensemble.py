"""One run under way: the device's copies of its inputs, and the launches over its samples in chunks."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from tqdm import tqdm

from warpdyn import pack
from warpdyn.kernels import build
from warpdyn.kernels.loads import LOADS
from warpdyn.kernels.plan import Plan
from warpdyn.methods import METHODS
from warpdyn.motions import Assignment
from warpdyn.propagators import damping_of
from warpdyn.random_numbers import key_of
from warpdyn.recorders import ADAPTIVE, HISTORY, RECORDERS
from warpdyn.scene import Scene
from warpdyn.timeline import Schedule, Timeline

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
        schedule: How each sample is stepped; it may be changed between integrations.
        method: Integration method.
        tolerance: Relative error a step that an adaptive method allows itself.
        dtype: "float32" or "float64".
        device: Warp device.
        threads: CPU threads.
        seed: Seed of random motions.
    """

    def __init__(
        self,
        scene: Scene,
        drawn: dict[str, np.ndarray],
        assignment: Assignment,
        timeline: Timeline,
        schedule: Schedule,
        *,
        method: str,
        tolerance: float,
        dtype: str,
        device: str,
        threads: int,
        seed: int,
    ) -> None:
        self.scene, self.drawn, self.assignment, self.timeline = scene, drawn, assignment, timeline
        self.schedule, self.tolerance = schedule, tolerance
        self.dtype, self.device, self.threads, self.seed = dtype, device, threads, seed
        family = scene.structure.family
        lanes, max_unroll = build.lanes_and_unroll(family, scene.structure.dofs, method, device != "cpu")
        is_exact = METHODS[method].kind == "exact"
        self.plan = Plan(
            family=family,
            dofs=scene.structure.dofs,
            law=pack.spring_of(scene, pack.parameters_of(scene, drawn)),
            damping=damping_of(scene) if is_exact else scene.structure.damping,
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
        variables |= ADAPTIVE if METHODS[method].is_adaptive else {}
        self.shapes = {name: (self.plan.dofs,) * len(v.dims) for name, v in variables.items()} | {"status": ()}

    @property
    def kernel_name(self) -> str:
        """What the kernel computes, in one line."""
        p = self.plan
        return f"{p.family} {p.dofs} {p.law} {p.damping} {p.load} {'+'.join(p.recorders)} {p.method} {p.dtype}"

    def alike(self, schedule: Schedule, dtype: str, tolerance: float) -> Ensemble:
        """Return the launches of the same samples on other terms."""
        return Ensemble(
            self.scene,
            self.drawn,
            self.assignment,
            self.timeline,
            schedule,
            method=self.plan.method,
            tolerance=tolerance,
            dtype=dtype,
            device=self.device,
            threads=self.threads,
            seed=self.seed,
        )

    def common_step(self, samples: Sequence[int]) -> float:
        """Return the longest step [s] of some samples; raise unless the others' steps divide it."""
        steps = self.schedule.step[list(samples)]
        longest = int(steps.argmax())
        times = steps[longest] / steps
        differs = ~np.isclose(times, np.round(times), rtol=1e-6, atol=0.0)
        if differs.any():
            other = int(np.flatnonzero(differs)[0])
            raise ValueError(
                f"histories of samples {samples[longest]} and {samples[other]} have steps {steps[longest]:g} and "
                f"{steps[other]:g} s: ask for samples of one step, or give simulate() a step that divides all"
            )
        return float(steps[longest])

    def _structures(self, samples: np.ndarray) -> tuple[object, np.ndarray]:
        """Return the structures of some samples on the device, and which of them each sample has.

        Where a kernel reads propagators, there is one for each structure and step that meet.
        """
        index = self.assignment.structure[samples] if self.drawn else np.zeros(samples.size, dtype=np.int64)
        steps, place_of_step = np.zeros(1), np.zeros(samples.size, dtype=np.int64)
        if pack.needs_step(self.plan):
            steps, place_of_step = np.unique(self.schedule.step[samples], return_inverse=True)
        pairs, place = np.unique(index * steps.size + place_of_step, return_inverse=True)
        parameters = pack.parameters_of(self.scene, self.drawn, pairs // steps.size)
        packed = pack.pack_structures(self.scene, parameters, self.plan, steps[pairs % steps.size])
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
        schedule = self.schedule
        for substeps in np.unique(schedule.substeps[samples]):
            chosen = np.flatnonzero(schedule.substeps[samples] == substeps)
            # Longest first and neighbours alike: no thread waits long for another's last history.
            chosen = chosen[np.argsort(-schedule.run_intervals[samples[chosen]], kind="stable")]
            arrays = {
                "output": columns[chosen],
                "structure": place[chosen],
                "motion": self.assignment.motion[samples[chosen]],
                "scale": self.assignment.scale[samples[chosen]],
                "step": schedule.step[samples[chosen]],
                "run_intervals": schedule.run_intervals[samples[chosen]],
                "residual_steps": schedule.residual_steps[samples[chosen]],
            }
            control = build.control(
                self.dtype,
                samples=chosen.size,
                substeps=int(substeps),
                every=every,
                collapse_drift_ratio=np.inf if limit is None else limit,
                tolerance=self.tolerance,
                key=key_of(self.seed),
            )
            if LOADS[plan.load].noise_states:
                arrays["number"] = samples[chosen]
            launched = build.fill_struct("Samples", arrays, self.dtype, self.device)
            arguments = [control, launched, structures, self.loads, output, history]
            build.launch(plan, chosen.size, arguments, self.device, self.threads, advance)

    def _chunk(self) -> int:
        """Return how many samples fit the memory at hand, with the structures they need."""
        samples = self.assignment.structure.size
        values = sum(int(np.prod(shape)) for shape in self.shapes.values()) + 8  # and a sample's own indices
        one = pack.parameters_of(self.scene, self.drawn, slice(0, 1))
        packed = pack.pack_structures(self.scene, one, self.plan, self.schedule.step[:1])
        structures = len(next(iter(self.drawn.values()))) if self.drawn else 0
        if pack.needs_step(self.plan):
            structures *= np.unique(self.schedule.step).size
        values += COPIES_OF_A_STRUCTURE * sum(array.size for array in packed.values()) * structures / samples
        fitting = int(SHARE_OF_FREE_MEMORY * build.free_memory(self.device) / (8 * values))
        return max(self.plan.lanes, min(fitting, LARGEST_CHUNK))

    def integrate(self, chosen: np.ndarray, samples_per_chunk: int | None = None) -> dict[str, np.ndarray]:
        """Return every recorded variable of some samples, sample last."""
        total = chosen.size
        chunk = samples_per_chunk or self._chunk()
        results: dict[str, np.ndarray] = {}
        no_history = build.fill_struct("History", {}, self.dtype, self.device)
        with tqdm(total=total, unit="history", unit_scale=True, disable=None) as progress:
            for start in range(0, total, chunk):
                samples = chosen[start : start + chunk]
                output = build.blank_output(self.shapes, samples.size, self.dtype, self.device)
                self._launch(self.plan, samples, np.arange(samples.size), output, no_history, advance=progress.update)
                for name, shape in self.shapes.items():
                    part = build.read_array(output, name)
                    if name not in results:
                        results[name] = np.empty((*shape, total), part.dtype)
                    results[name][..., start : start + samples.size] = part
        return results

    def integrate_histories(
        self, kept: Sequence[int], every: int, common_step: float
    ) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Return the time grid [s] and each variable's histories, shape [history, time, dof], NaN after a run's end.

        Args:
            kept: The samples.
            every: Common steps between the states kept.
            common_step: A step [s] that all their steps divide.
        """
        samples = np.array(kept)
        times_finer = np.round(common_step / self.schedule.step[samples]).astype(np.int64)
        every_own = every * times_finer
        last = self.schedule.run_intervals[samples] * self.schedule.substeps[samples] // every_own
        times = int(last.max()) + 1
        plan = build.history_plan(self.plan)
        names = list(HISTORY) if plan.family == "chain" else [n for n in HISTORY if n != "storey_force"]
        shape = (samples.size, times, plan.dofs)
        history = build.fill_struct(
            "History", {name: np.full(shape, np.nan) for name in names}, self.dtype, self.device
        )
        output = build.blank_output({"status": ()}, samples.size, self.dtype, self.device)
        for own in np.unique(every_own):
            rows = np.flatnonzero(every_own == own)
            self._launch(plan, samples[rows], rows, output, history, every=int(own))
        values = {name: build.read_array(history, name) for name in names}
        for row, end in enumerate(last):
            for array in values.values():
                array[row, end + 1 :] = np.nan
        return np.arange(times) * every * common_step, values
