"""Ensembles of samples that a device has prepared; arrays on the host are computed only if they are needed."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.integration.dynamics import Arrays, Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import Run
from warpdyn.campaigns.integration.stability_guard import StabilityFindings, guard, structures_of_a_range
from warpdyn.campaigns.integration.time_grid import build_schedule
from warpdyn.campaigns.preparation.inputs import Inputs
from warpdyn.campaigns.preparation.preparation import Preparation, PreparedBlock
from warpdyn.engine.kernels.queues import Queue
from warpdyn.engine.kernels.slicing import Launch
from warpdyn.model.ground_motions.excitation import Assignment

EXAMPLES = 16  # number of structures from whose samples the cost of a run is estimated


class PreparedEnsemble(Ensemble):
    """Some structures of a run with all their samples; the constructor queues their preparation on a device.

    Args:
        run: The prepared run.
        preparation: Kernels that prepare structures and samples.
        structures: Range of structure numbers in the run.
        queue: Device queue on which they are prepared and integrated.
    """

    def __init__(self, run: Run, preparation: Preparation, structures: range, queue: Queue) -> None:
        self.run, self.range, self.queue = run, structures, queue
        self.before, self.state, self.model = None, {}, run.model
        self.scene, self.timeline, self.plan = self.model.scene, self.model.timeline, self.model.plan
        self.tolerance = self.model.tolerance
        self._each = run.samples // run.structures
        self._inputs = Inputs(run, np.arange(structures.start, structures.stop))
        self._factors: dict[int, int] = {}  # factor by which a sample's steps were divided since the preparation
        self._block: PreparedBlock | None = None
        self._finish = preparation.begin(structures, queue)

    def finish_preparation(self, findings: StabilityFindings) -> bool:
        """Wait until the device has prepared the samples; return whether the preparation succeeded.

        If the preparation failed, the host must prepare the samples again, and then reports the error.

        Args:
            findings: Findings on the stability of the samples, which are updated.
        """
        self._block = block = self._finish()
        if block.is_refused:
            return False
        findings.least = min(findings.least, block.least_stable_step)
        if block.unstable:
            findings.beyond += block.unstable
            findings.most = max(findings.most, block.largest_factor)
            part, vibration = self._on_host(np.array([block.first_unstable]), divides=False)
            findings.first = StabilityFindings.description(part, vibration, 0)
        if block.long:
            findings.too_long += block.long
            findings.longest_accurate = min(findings.longest_accurate, block.least_accurate_step)
        return True

    @property
    def longest_period(self) -> float:
        """Longest first period of the structures [s]."""
        assert self._block is not None
        return self._block.longest_period

    def select(self, samples: np.ndarray) -> Ensemble:
        """Return the given samples (indices in this ensemble) with their structures, prepared on the host."""
        part, _ = self._on_host(samples)
        if self._factors:
            first = self.range.start * self._each
            factors = np.array([self._factors.get(int(number) - first, 1) for number in part.sample])
            divided = np.flatnonzero(factors > 1)
            part.schedule = part.restepped(divided, part.schedule.substeps[divided] * factors[divided])
        return part

    def halve_steps(self, samples: np.ndarray) -> None:
        """Divide the integration steps of the given samples (indices in this ensemble) by 2."""
        self._numbers_of_steps[samples] *= 2
        for sample in samples.tolist():
            self._factors[sample] = 2 * self._factors.get(sample, 1)

    def steps_of(self, samples: np.ndarray | slice) -> np.ndarray:
        """Return the number of integration steps of the given samples (indices in this ensemble), in float64."""
        steps: np.ndarray = self._numbers_of_steps[samples]
        return steps

    @property
    def example(self) -> Ensemble:
        """The samples of the first EXAMPLES structures, prepared on the host."""
        return self.select(np.arange(min(len(self.range), EXAMPLES) * self._each))

    @property
    def is_of_whole_ranges(self) -> bool:
        """Whether the ensemble contains whole rerun ranges only (structures that share one limit on reruns)."""
        together = structures_of_a_range(self._each)
        return all(edge % together == 0 or edge == self.run.structures for edge in (self.range.start, self.range.stop))

    @property
    def size(self) -> int:
        """Number of samples in the ensemble."""
        return len(self.range) * self._each

    @property
    def steps(self) -> np.ndarray:
        """Integration step of each sample [s]."""
        assert self._block is not None
        steps = self._block.steps()
        for sample, factor in self._factors.items():
            steps[sample] /= factor
        return steps

    @property
    def structures(self) -> np.ndarray:  # type: ignore[override] # an attribute of the base class
        """Indices of the structures in the run, shape [structure]."""
        return self._inputs.structures

    @cached_property
    def _numbers_of_steps(self) -> np.ndarray:
        """Number of integration steps of each sample, in float64, shape [sample]."""
        assert self._block is not None
        return self._block.numbers_of_steps()

    @cached_property
    def sample(self) -> np.ndarray:  # type: ignore[override]
        """Index of each sample in the run, shape [sample]."""
        return self._inputs.sample

    @property
    def assignment(self) -> Assignment:  # type: ignore[override]
        """Structure, motion and scale factor of each sample."""
        return self._inputs.assignment

    @property
    def drawn(self) -> Arrays:  # type: ignore[override]
        """Scattered parameters of the structures by name; the first dimension is the structure."""
        return self._inputs.drawn

    @property
    def storey_heights(self) -> np.ndarray:
        """Storey heights [m], shape [structure, storey]; [1, storey] if all structures have the same heights."""
        return self._inputs.height if "height" in self.scene.scatter else super().storey_heights

    @cached_property
    def row(self) -> np.ndarray:  # type: ignore[override]
        """Row of each sample's structure in `drawn`, shape [sample]; 0 if nothing is drawn."""
        if not self.run.sampler.scatter:
            return np.zeros(self.size, np.int32)
        return np.repeat(np.arange(len(self.range), dtype=np.int32), self._each)

    def launches(self) -> list[Launch]:
        """Return the kernel launches that integrate all samples, one for each number of steps per interval."""
        block = self._block
        assert block is not None
        launches, first = [], 0
        for substeps, count in block.groups:
            part, on_host = block.samples_from(first, count), block.on_host(first, count)
            launches.append(self._launch(block.structures, part, count, substeps, *on_host))
            first += count
        return launches

    def _on_host(self, samples: np.ndarray, *, divides: bool = True) -> tuple[Ensemble, Vibration]:
        """Return the given samples as an ensemble prepared on the host, and the vibration of their structures.

        Args:
            samples: Indices of the samples in this ensemble.
            divides: Whether steps are divided if the accuracy or the stability of the samples requires it.
        """
        place, row = np.unique(samples // self._each, return_inverse=True)
        structures = self.range.start + place
        drawn, vibration = self.run.draw(structures)
        row = row if drawn else np.zeros_like(row)  # if nothing is drawn, all samples share one structure
        assignment = self.assignment.select(samples)
        schedule = build_schedule(self.scene, self.timeline, vibration, assignment, row)
        held = drawn, vibration.rayleigh, assignment, row, schedule
        part = Ensemble(self.model, structures, *held, self.sample[samples], self.queue)
        findings = StabilityFindings(part.size, self.run.integration.method)
        shorten_steps(part, vibration, findings, divides=self.run.integration.divides_steps)
        if divides:
            guard(part, vibration, "substep", findings)
        return part, vibration
