"""Misfit of many candidates of a structure to measured response histories."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from warpdyn.campaigns.accuracy.scattered_steps import shorten_steps
from warpdyn.campaigns.inference.measured import MeasuredResponse
from warpdyn.campaigns.inference.priors import Prior, Values
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import guard
from warpdyn.engine.kernels.queues import open_queues
from warpdyn.foundations.core.checks import free_memory
from warpdyn.foundations.core.messages import no_warnings
from warpdyn.foundations.core.output_variables import DIVERGED
from warpdyn.model.scene.scene import Scene, with_recorders

MOST_HALVINGS = 4  # of the steps of a candidate whose integration fails; then it counts as impossible
BYTES_OF_A_VALUE = 24  # of a history, as in `running/histories`
STEPS_OF_SHORTEST, MOST_STEPS_OF_LONGEST = 20, 400  # integration steps in the shortest and the longest period
SHARE_OF_MEMORY = 0.25  # of the free memory that the histories of one block may take


class ResponseMisfit:
    """Differences of the histories of candidates from measured ones.

    Args:
        scene: The scene: one structure under one motion or load.
        prior: Prior of its parameters.
        measured: The measured histories.
        execution: Devices and threads.
        integration: How samples are integrated; None: RK4 with a step of at most 1/20 of the shortest period, since
            phases count, unlike in runs for peaks.

    Raises:
        ValueError: If a sensor is on a floor that the structure does not have, the scene has several samples per
            structure, or the sampling of the measurement does not fit the motion.
    """

    def __init__(
        self,
        scene: Scene,
        prior: Prior,
        measured: MeasuredResponse,
        execution: Execution,
        integration: Integration | None,
    ) -> None:
        check_response("calibrate", scene, measured)
        self.prior, self.measured = prior, measured
        self.execution = execution.on_first()
        self.scene = replace(with_recorders(scene, ()), tail=_covering(scene, measured), correlation={})
        self.integration = integration or Integration(step=accurate_step(scene, measured))
        self.count = len(measured.values) - measured.first

    def __call__(self, values: Values) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return sums of differences and of their squares, [candidate, sensor], and the peak computed values.

        The sums are NaN for candidates whose integration fails.
        """
        count = len(next(iter(values.values())))
        times = len(self.measured.values)
        size = BYTES_OF_A_VALUE * 4 * times * self.scene.structure.dofs
        at_a_time = int(max(64, SHARE_OF_MEMORY * free_memory() / size))
        found = []
        for first in range(0, count, at_a_time):
            histories = self.histories({name: each[first : first + at_a_time] for name, each in values.items()})
            part = histories[:, self.measured.first : times]
            difference = self.measured.values[None, self.measured.first :] - part
            with np.errstate(invalid="ignore", over="ignore"):
                found.append((difference.sum(axis=1), np.square(difference).sum(axis=1), np.abs(part).max(axis=(1, 2))))
        sums, squares, peaks = (np.concatenate(each) for each in zip(*found, strict=True))
        return sums, squares, peaks

    def histories(self, values: Values) -> np.ndarray:
        """Return the computed histories at the measured times, shape [candidate, time, sensor]; NaN after a failure."""
        scene = replace(self.scene, scatter=self.prior.as_scatter(values))
        count = len(next(iter(values.values())))
        with no_warnings():  # of candidates far from the measurement
            run = build_run(scene, count, self.integration, self.execution)
            queue = open_queues(run.execution.devices, run.model.threads)[0]
            ensemble, vibration = run.events(np.arange(count), queue)[0]
            shorten_steps(ensemble, vibration, run.findings[0], divides=run.integration.divides_steps)
            guard(ensemble, vibration, run.integration.on_unstable)
            found, failed = self._integrated(ensemble, np.arange(count))
            for _ in range(MOST_HALVINGS):
                if not failed.size:
                    break
                ensemble.halve_steps(failed)
                found[failed], still = self._integrated(ensemble, failed)
                failed = failed[still]
        found[failed] = np.nan
        return found

    def _integrated(self, ensemble: Ensemble, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the histories of some candidates, and the places in `rows` of those whose integration failed."""
        ratio = self.measured.step / ensemble.schedule.step
        if np.any(np.abs(ratio - np.round(ratio)) > 1e-6 * ratio):
            raise ValueError(
                f"the integration step {ensemble.schedule.step.max():.6g} s does not divide the sampling step of the "
                f"sensors, {self.measured.step:g} s: give integration=wd.Integration(step={self.measured.step / 4:g})"
            )
        _, histories, status = ensemble.histories_and_status(rows.tolist(), 1, self.measured.step)
        return histories[self.measured.quantity][:, : len(self.measured.values), self.measured.places], np.flatnonzero(
            status >= DIVERGED
        )


def accurate_step(scene: Scene, measured: MeasuredResponse) -> float:
    """Return a step [s] that divides the steps of motion and sensors, and keeps the phases of all modes."""
    motions = getattr(scene.excitation, "motions", ())
    given = motions[0].step if motions else measured.step
    modal = getattr(scene.structure, "modal", None)
    periods = np.asarray(modal()["period"]) if modal is not None else np.array([np.inf])
    periods = periods[np.isfinite(periods) & (periods > 0)]
    longest = max(periods.min() / STEPS_OF_SHORTEST, periods.max() / MOST_STEPS_OF_LONGEST) if periods.size else given
    return float(given / max(1, np.ceil(given / longest * (1 - 1e-9))))


def check_response(function: str, scene: Scene, measured: MeasuredResponse) -> None:
    """Raise a ValueError if a sensor is on a floor, or measures a quantity, that the structure does not have."""
    structure = scene.structure
    if structure.is_many or scene.excitation.samples_per_structure != 1 or len(scene.excitation.event_names) > 1:
        raise ValueError(
            f"{function}: the scene must have one structure under one motion or load, which was measured: give "
            "wd.Scene(building, motion, scatter)"
        )
    what = "storey" if measured.quantity == "storey_force" else "floor"
    if measured.is_on_all_floors and measured.channels < structure.dofs:
        example = list(range(structure.dofs, structure.dofs - measured.channels, -1))[::-1]
        raise ValueError(
            f"MeasuredResponse: the measurement has {measured.channels} column{'s' * (measured.channels > 1)}, but the "
            f"structure has {structure.dofs} {what}s: give floors=, the {what} of each column from 1, such as "
            f"floors={example} for the top"
        )
    for floor in measured.floors or ():
        if floor > structure.dofs:
            raise ValueError(
                f"MeasuredResponse: a sensor is on {what} {floor}, but the structure has {structure.dofs} {what}s: "
                "correct floors="
            )


def _covering(scene: Scene, measured: MeasuredResponse) -> float | None:
    """Return the tail [s] of a scene that lasts as long as the measurement; None: its load has no tail.

    Raises:
        ValueError: If the sampling step of the measurement is not a multiple of that of the motion, or the load ends
            before the measurement.
    """
    excitation = scene.excitation
    lasting = (len(measured.values) - 1) * measured.step
    motions = getattr(excitation, "motions", ())
    if motions:
        ratio = measured.step / motions[0].step
        if abs(ratio - round(ratio)) > 1e-6 * ratio or round(ratio) < 1:
            raise ValueError(
                f"MeasuredResponse.step is {measured.step:g} s, which is not a multiple of the step of the motion, "
                f"{motions[0].step:g} s: resample the motion at the sampling step of the sensors, or a divisor of it"
            )
        length = motions[0].step * (len(motions[0].values) - 1)
    else:
        length = excitation.duration  # type: ignore[attr-defined] # of loads that are formulas
    if lasting > length * (1 + 1e-9) and not excitation.has_tail:
        raise ValueError(
            f"the measurement lasts {lasting:g} s, but the load ends at {length:g} s: give a load that lasts as "
            "long, or fewer values"
        )
    return max(0.0, lasting - length + measured.step) if excitation.has_tail else None
