"""The end of a live motion: the run of `simulate` for the whole record, whose histories are integrated already."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.integration import run as integration_run
from warpdyn.campaigns.integration.dynamics import Arrays, Vibration
from warpdyn.campaigns.integration.ensemble import Ensemble, MapFunction
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import guard
from warpdyn.campaigns.live.paused_ensemble import PausedEnsemble
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.regions.workers import Here
from warpdyn.campaigns.running.run import Run
from warpdyn.engine.kernels.queues import Queue
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.model.ground_motions.designs import Cloud, OneMotionPerStructure
from warpdyn.model.scene.scene import Scene


class Continued(Ensemble):
    """Samples whose first histories are known already; only reruns, and samples with other steps, are integrated.

    Attributes:
        known: Outputs of all samples of the run by name, shape [sample, ...].
        again: Samples that are integrated from the start of the record, shape [sample].
    """

    known: Arrays
    again: np.ndarray

    @staticmethod
    def of(ensemble: Ensemble, known: Arrays, again: np.ndarray) -> Continued:
        """Return the samples of an ensemble with their known outputs."""
        found = Continued(
            ensemble.model,
            ensemble.structures,
            ensemble.drawn,
            ensemble.rayleigh,
            ensemble.assignment,
            ensemble.row,
            ensemble.schedule,
            ensemble.sample,
            ensemble.queue,
        )
        found.known, found.again = known, again
        return found

    def start(
        self,
        rows: Arrays,
        advance: Callable[[int], object] = lambda done: None,
        arriving: Collection[str] | None = None,
        *,
        is_rerun: bool = False,
    ) -> None:
        """Copy the known outputs to `rows`, and integrate the samples `again`."""
        for name in self.model.shapes:
            rows[name][...] = self.known[name][self.sample]
        others = np.flatnonzero(self.again[self.sample])
        if others.size:
            for name, values in self.integrate(others).items():
                rows[name][others] = values.T
        advance(self.size)

    def finish(self, rows: Arrays, map_function: MapFunction = map) -> None:
        """Do nothing: `start` has written all outputs."""


@dataclass(frozen=True, eq=False)
class ContinuedRun(integration_run.Run):
    """A run whose histories are known already.

    Args:
        known: Outputs of all samples of the run by name, shape [sample, ...].
        again: Samples that are integrated from the start of the record, shape [sample].
    """

    known: Arrays
    again: np.ndarray

    def events(
        self, structures: np.ndarray, queue: Queue, known: integration_run.Drawn | None = None
    ) -> list[tuple[Ensemble, Vibration]]:
        """Return the samples of the given structures with their known outputs, and the structures' vibration."""
        [(ensemble, vibration)] = super().events(structures, queue, known)
        return [(Continued.of(ensemble, self.known, self.again), vibration)]


def finished(
    scene: Scene,
    structures: int,
    integration: Integration,
    execution: Execution,
    seed: int,
    paused: PausedEnsemble,
    rest: np.ndarray,
) -> xr.Dataset:
    """Return the dataset of `simulate` for a scene with the whole record.

    Args:
        scene: The scene with the whole record.
        structures: Number of structures.
        integration: How the structures are integrated.
        execution: Devices, threads and memory.
        seed: Seed of every random draw.
        paused: The samples, integrated up to the first sample of `rest`.
        rest: Last accelerations of the record [m/s2], shape [time, component].
    """
    with interruptible():
        whole = Run(scene, structures, integration, execution, Outputs(), seed)
        assert isinstance(whole.workers, Here)
        prepared = whole.workers.host.prepared(whole.jobs[0])
        run = prepared.run
        [(ensemble, vibration)] = run.events(np.arange(structures), paused.queue)
        findings = run.findings[0]
        shorten_steps(ensemble, vibration, findings, divides=run.integration.divides_steps)
        guard(ensemble, vibration, run.integration.on_unstable, findings)
        outputs = paused.outputs(rest, int(run.model.timeline.intervals[0]), ensemble.schedule)
        # The whole duration may require shorter steps; an average that begins before the free vibration has begun too
        # early for a motion whose end was not known.
        schedule, used = ensemble.schedule, paused.ensemble.schedule.substeps
        average_from = schedule.run_intervals * schedule.substeps.astype(np.int64) - schedule.residual_steps
        begun = average_from < paused.intervals * schedule.substeps.astype(np.int64)
        again = (schedule.substeps != used) | (begun & ("residual" in scene.recorders))
        given = {field.name: getattr(run, field.name) for field in fields(run)}
        prepared.run = ContinuedRun(**given, known=outputs, again=again)
        # The host prepares the samples, and kernels are compiled only if samples are run again.
        vars(prepared).update(preparation=None, plans=[])
        return whole.result()


def scene_of_record(scene: Scene, values: np.ndarray) -> Scene:
    """Return a scene whose only motion has other samples.

    Args:
        scene: The scene, with a Cloud or OneMotionPerStructure.
        values: Accelerations [m/s2], shape [time, component].
    """
    design = scene.excitation
    assert isinstance(design, Cloud | OneMotionPerStructure)  # Live accepts no other designs
    [motion] = design.motions
    names = [name for name in ("x", "y", "vertical") if getattr(motion, name, None) is not None]
    parts: dict[str, Any] = {
        name: replace(getattr(motion, name), acceleration=column) for name, column in zip(names, values.T, strict=False)
    }
    recorded = replace(motion, **parts) if names else replace(motion, acceleration=values[:, 0])
    return replace(scene, excitation=replace(design, motions=(recorded,)))
