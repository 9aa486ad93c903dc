"""The state of the springs of a pushed structure, and steps that are divided until they succeed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import warp as wp

from warpdyn.engine.kernels.auxiliary.storey_step import storey_step_kernel
from warpdyn.engine.kernels.kernel_cache import initialise, loaded
from warpdyn.engine.laws.springs import StoreyRules, spring_row
from warpdyn.foundations.core.messages import warn_caller

TOLERANCE = 1e-9  # largest unbalanced force in equilibrium, as a share of the base shear
ITERATIONS = 50  # most corrections in the search for an equilibrium
SHORTENINGS = 40  # most halvings of one correction
SHORTEST_STEP = 2.0**-10  # as a share of a requested step
LEAST_STIFFNESS = 1e-6  # as a share of the initial stiffness; a tangent stiffness below it is replaced in a correction


class Pushed:
    """Springs of a structure in static equilibrium; `push` moves them to the next prescribed displacement.

    Args:
        rules: Device functions of the law of all springs.
        coefficients: Coefficients of the law, shape [coefficient, spring].
    """

    def __init__(self, rules: StoreyRules, coefficients: np.ndarray) -> None:
        springs = coefficients.shape[1]
        memory = (max(1, spring_row(rules).memory), springs)
        # The kernel and numpy share this memory.
        self.drift, self.trial = np.zeros(springs), np.zeros(springs)
        self.memory, self.trial_memory = np.zeros(memory), np.full(memory, np.nan)
        self.trial_force, self.tangent, self.trial_recoverable = (np.full(springs, np.nan) for _ in range(3))
        given = (coefficients, self.drift, self.memory, self.trial)
        found = (self.trial_memory, self.trial_force, self.tangent, self.trial_recoverable)
        initialise()  # before Warp starts with the first array
        self.kept: list[wp.array] = [
            wp.array(values, dtype=wp.float64, device="cpu", copy=False) for values in (*given, *found)
        ]
        kernel = loaded(storey_step_kernel(rules))
        self.launch = wp.launch(kernel, dim=springs, inputs=self.kept, device="cpu", record_cmd=True)
        self.force, self.work, self.recoverable = np.zeros(springs), np.zeros(springs), np.zeros(springs)
        self.largest_shear, self.base_shear = 0.0, 0.0

    @property
    def reached(self) -> float:
        """The displacement that is prescribed [m]."""
        raise NotImplementedError

    @property
    def moved(self) -> np.ndarray:
        """Displacements of all floors or degrees of freedom [m], shape [place]."""
        raise NotImplementedError

    def reason_to_stop(self) -> str:
        """Return, as text for a message, why the last call of `push` found no further equilibrium."""
        raise NotImplementedError

    def _step(self, displacement: float, stops_at_peak: bool) -> bool:
        """Move to `displacement` [m] in one step; return whether an equilibrium was found there.

        The result is False if there is no equilibrium, or if `stops_at_peak` is True and the step would pass the peak
        strength of a spring. The caller then uses a shorter step that ends at the peak, because from that point on the
        other springs may unload while this spring softens.
        """
        raise NotImplementedError

    def push(self, displacement: float) -> float:
        """Move towards `displacement` [m] in one or several steps; return the share reached [1]."""
        begin, done, share = self.reached, 0.0, 1.0
        while done < 1:
            if self._step(begin + (done + share) * (displacement - begin), share > SHORTEST_STEP):
                done += share
                share = min(2 * share, 1 - done)
            elif share > SHORTEST_STEP:
                share *= 0.5
            else:
                break
        return done

    def _accept(self) -> None:
        self.work += 0.5 * (self.trial_force + self.force) * (self.trial - self.drift)
        self.drift[:], self.memory[:], self.force[:] = self.trial, self.trial_memory, self.trial_force
        self.recoverable[:] = self.trial_recoverable


@dataclass(frozen=True)
class PushedPath:
    """Equilibria along a path of prescribed displacements.

    Args:
        prescribed: Prescribed displacements [m], shape [step].
        displacement: Displacements of all floors or degrees of freedom [m], shape [step, place].
        base_shear: Base shears [N], shape [step].
        drift: Deformations of the springs [m], shape [step, spring].
        force: Forces of the springs [N], shape [step, spring].
        dissipated: Work done on the springs less what they store [J], shape [step, spring].
        stopped: The attribute `stopped_because`, if the path ended early.
    """

    prescribed: np.ndarray
    displacement: np.ndarray
    base_shear: np.ndarray
    drift: np.ndarray
    force: np.ndarray
    dissipated: np.ndarray
    stopped: dict[str, str]


def pushed_along(pushed: Pushed, path: np.ndarray) -> PushedPath:
    """Return the equilibria along a path; it ends at the last one if no other exists, with a warning.

    Args:
        pushed: The structure at rest.
        path: Displacements to prescribe [m], shape [step].

    Raises:
        RuntimeError: If no equilibrium is found at all.
    """
    rows: list[tuple[np.ndarray, ...]] = []
    prescribed, base_shear, stopped = [], [], dict[str, str]()
    for step, displacement in enumerate(path):
        share = pushed.push(displacement)
        if share < 1:
            stopped = {"stopped_because": f"step {step}, to {displacement:g} m: {pushed.reason_to_stop()}"}
            if share == 0:
                break
        prescribed.append(displacement if share == 1 else pushed.reached)
        base_shear.append(pushed.base_shear)
        rows.append((pushed.moved, pushed.drift.copy(), pushed.force.copy(), pushed.work - pushed.recoverable))
        if stopped:
            break
    if stopped:
        if not rows:
            raise RuntimeError(f"pushover: {stopped['stopped_because']}")
        warn_caller(f"pushover: the curve ends before the given path does. {stopped['stopped_because']}")
    displacements, drift, force, dissipated = (np.stack(each) for each in zip(*rows, strict=True))
    return PushedPath(np.array(prescribed), displacements, np.array(base_shear), drift, force, dissipated, stopped)
