"""Which failed samples of a region are run again, as if all samples before them had been run in one process.

`Reruns` has a budget over a run: whether a failed sample is run again depends on the steps of all samples before it. A
region is run as if it were alone, which decides nearly always as the whole run would. What decided is kept, in little
room, and when the regions before it are known, each decision is made again: a region where one turns out otherwise is
run again from the true state.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.stability_guard import ROW, Reruns, affordable
from warpdyn.model.ground_motions.excitation import MOST_STEPS


@dataclass(frozen=True)
class Decisions:
    """What one call of `Reruns.settle` decided, and what from.

    A row of samples is charged with the steps of its first one. Which samples begin rows depends on the number of
    samples before the region, so that sums are kept for each of the possible beginnings.

    Args:
        count: Number of samples.
        total: Steps that rows of them take, by the place of the first row's beginning, shape [ROW].
        until: The same up to each failed sample, shape [failed, ROW].
        steps: Steps of each failed sample, shape [failed].
        sizes: Number of samples that had failed before each rerun.
        failed: Which of the failed samples these are, one rerun after the other.
        granted: Which of these were run again.
        dofs: Degrees of freedom, of which the least budget depends.
    """

    count: int
    total: np.ndarray
    until: np.ndarray
    steps: np.ndarray
    sizes: np.ndarray
    failed: np.ndarray
    granted: np.ndarray
    dofs: int

    @property
    def arrays(self) -> Arrays:
        """All of it as arrays, which `Decisions.of_arrays` reads."""
        return {name: np.asarray(value) for name, value in vars(self).items()}

    @classmethod
    def of_arrays(cls, arrays: Arrays) -> Decisions:
        """Return what `arrays` was made of."""
        whole = {name: int(arrays[name]) for name in ("count", "dofs")}
        return cls(**(dict(arrays) | whole))  # type: ignore[arg-type]


def decisions(reruns: Reruns, dofs: int) -> list[Decisions]:
    """Return what reruns have decided since `seen` was set."""
    found = []
    for steps, reruns_of_it in reruns.seen or ():
        candidates = reruns_of_it[0][0] if reruns_of_it else np.arange(0)
        total, until = np.zeros(ROW), np.zeros((candidates.size, ROW))
        for place in range(ROW):
            sums = np.concatenate([[0.0], ROW * np.cumsum(steps[place::ROW])])
            total[place] = sums[-1]
            until[:, place] = sums[np.maximum(0, (candidates - place) // ROW + 1)]
        sizes = np.array([failed.size for failed, _ in reruns_of_it], dtype=np.int64)
        failed = np.concatenate([candidates[:0], *(np.searchsorted(candidates, failed) for failed, _ in reruns_of_it)])
        granted = np.concatenate([np.zeros(0, dtype=bool), *(granted for _, granted in reruns_of_it)])
        found.append(Decisions(steps.size, total, until, steps[candidates], sizes, failed, granted, dofs))
    return found


def stand(state: dict[str, Any], made: list[Decisions]) -> dict[str, Any] | None:
    """Return the state of reruns after decisions, or None if from this state one of them would have been another.

    Args:
        state: `Reruns.state` after all samples before them.
        made: The decisions.
    """
    reruns = Reruns()
    reruns.state = state
    for one in made:
        count, taken = reruns.state["count"], reruns.state["taken"]
        place = -count[0] % ROW
        afforded = affordable(taken[0] + one.until[:, place], one.dofs)
        count[0], taken[0] = count[0] + one.count, taken[0] + float(one.total[place])
        reruns.state = {"count": count, "taken": taken}
        edges = np.concatenate([[0], np.cumsum(one.sizes)])
        for rerun, (first, last) in enumerate(pairwise(edges), start=1):
            failed, granted = one.failed[first:last], one.granted[first:last]
            steps = 2**rerun * one.steps[failed]
            is_afforded = reruns.charged(rerun, steps) <= afforded[failed]
            if not np.array_equal(is_afforded & (steps <= MOST_STEPS), granted):
                return None
    return reruns.state
