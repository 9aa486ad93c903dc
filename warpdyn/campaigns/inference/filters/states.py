"""An ensemble of structures whose states and parameters filters read and change between two measured times."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from warpdyn.campaigns.inference.filters.present_response import present_response
from warpdyn.campaigns.inference.measured import MeasuredResponse
from warpdyn.campaigns.inference.priors import Prior
from warpdyn.campaigns.inference.responses import accurate_step
from warpdyn.campaigns.integration.run import prepare
from warpdyn.campaigns.integration.settings import Execution
from warpdyn.campaigns.live.paused_ensemble import PausedEnsemble
from warpdyn.foundations.core.messages import no_warnings
from warpdyn.model.scene.scene import Scene, with_recorders

DISPLACEMENT, VELOCITY, MEMORY = "u", "v", "z"  # variables of the kernel that a filter changes
BASE = "base_at_end"  # variable of the kernel: acceleration of the base at the last sample


class StructureStates:
    """Structures that are integrated from one measured time to the next.

    Args:
        scene: The scene: one ShearBuilding under one motion.
        prior: Prior of the parameters; None: no parameter is unknown.
        measured: The measured response.
        normals: Standard normal variables of the parameters, shape [member, variable].
        execution: Device and threads.
    """

    def __init__(
        self, scene: Scene, prior: Prior | None, measured: MeasuredResponse, normals: np.ndarray, execution: Execution
    ) -> None:
        self.prior, self.measured = prior, measured
        known: Any = scene.excitation
        self.motion = known.motions[0]
        self.count, self.dofs = len(normals), scene.structure.dofs
        self.ratio = round(measured.step / self.motion.step)
        given = {} if prior is None else prior.as_scatter(prior.values(normals))
        own = replace(
            with_recorders(scene, (present_response(),)),
            scatter=given,
            correlation={},
            tail=0.0,
            collapse_drift_ratio=None,
        )
        with no_warnings():
            ensemble = prepare(
                own,
                structures=self.count,
                device=execution.devices[0],
                threads=execution.threads,
                method="rk4",
                dtype="float64",
                step=accurate_step(scene, measured),
                on_unstable="flag",
            )[0]
        self.paused = PausedEnsemble(ensemble)
        # A kernel reads states from the second interval on: a first interval at rest, before the motion, precedes it.
        self.paused.advance(np.zeros((2, 1)))
        found = self.paused.states()
        found[BASE][:] = self.motion.values[0] * ensemble.assignment.scale[:, None]
        self.paused.set_states(found)
        self.names: tuple[str, ...] = (DISPLACEMENT, VELOCITY)
        # The memory of other laws contains branches and counts, which cannot be corrected by a linear update.
        if scene.structure.storey_law.forces().has_rate and MEMORY in self.paused.states():
            self.names = (*self.names, MEMORY)

    def _motion(self, first: int, last: int) -> np.ndarray:
        """Return accelerations of the base [m/s2] at these samples of the motion, 0 after its end, shape [time, 1]."""
        places = np.arange(first, last + 1)
        values = np.asarray(self.motion.values)
        return np.where(places < len(values), values[np.minimum(places, len(values) - 1)], 0.0)[:, None]

    def advance(self) -> None:
        """Integrate all members to the next measured time."""
        first = self.paused.intervals - 1
        self.paused.advance(self._motion(first, first + self.ratio))

    def predicted(self) -> np.ndarray:
        """Return the computed values of the sensors at the present time, shape [member, sensor]."""
        places = self.measured.places
        if self.measured.quantity in ("displacement", "velocity"):
            name = DISPLACEMENT if self.measured.quantity == "displacement" else VELOCITY
            return self.paused.states()[name][:, places]
        now = self.paused.intervals - 1
        return self.paused.outputs(self._motion(now, now), now + 1)[f"present_{self.measured.quantity}"][:, places]

    def states(self) -> np.ndarray:
        """Return displacements, velocities and, for rate laws, memories of all members, shape [member, state]."""
        found = self.paused.states()
        return np.concatenate([found[name] for name in self.names], axis=1)

    def set_states(self, values: np.ndarray) -> None:
        """Replace the states of all members, in the form of `states`."""
        found, end = self.paused.states(), 0
        for name in self.names:
            first, end = end, end + found[name].shape[1]
            found[name] = values[:, first:end]
        self.paused.set_states(found)

    def resample(self, members: np.ndarray) -> None:
        """Give each member the state and the parameters of another one."""
        self.paused.resample(members)

    def set_parameters(self, normals: np.ndarray, before: np.ndarray) -> np.ndarray:
        """Give the members other parameters; a member whose parameters would be impossible keeps those it has.

        Args:
            normals: New standard normal variables, shape [member, variable].
            before: The present variables.

        Returns:
            The variables that the members now have.
        """
        if self.prior is None or not normals.size:
            return normals
        allowed = self.prior.allowed(self.prior.values(normals))
        kept = np.where(allowed[:, None], normals, before)
        self.paused.resample(np.arange(self.count), self.prior.values(kept))
        return kept
