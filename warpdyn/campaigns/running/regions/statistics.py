"""Statistics that runs in regions are reduced to, as they travel to the workers."""

from __future__ import annotations

from dataclasses import dataclass

from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.reductions.statistic import Statistic
from warpdyn.model.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Asked:
    """Statistics that are asked for, of one run or of all groups of a portfolio.

    Args:
        statistics: The statistics.
        scene: The scene, of all groups.
        structures: Number of its structures, or of a portfolio's buildings.
        key: Name that no others have.
    """

    statistics: tuple[Statistic, ...]
    scene: Scene
    structures: int
    key: str


_made: dict[str, Reduction] = {}


def reduction_for(asked: Asked, threads: int) -> Reduction:
    """Return what reduces regions of a run, which a process makes once; it holds no cells until one is added."""
    found = _made.get(asked.key)
    if found is None:
        for each in _made.values():  # of earlier runs
            each.__exit__()
        _made.clear()
        found = _made[asked.key] = Reduction(asked.statistics, Population(asked.scene, asked.structures), threads)
    return found
