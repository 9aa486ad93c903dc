"""A reference case of a lumped structure: structure, motion, and results of another program."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

import warpdyn as wd


@dataclass(frozen=True)
class Case:
    """A structure under a motion, with its peaks: {variable: {place: value}}."""

    structure: wd.LumpedStructure
    motion: wd.GroundMotion | wd.PairOfMotions
    peaks: dict[str, dict[str, float]]
    circular_frequencies: tuple[float, ...] = ()
    periods: tuple[float, ...] = ()
    tail: float = 0.0
    bound: float = 5e-5  # relative error
    last: dict[str, float] = field(default_factory=dict)  # displacements at the end


def pulse(amplitude: float, period: float, decay: float, duration: float = 8.0) -> wd.GroundMotion:
    """Return a motion that ends after 8 s, or before, with zeros up to `duration`."""
    time = 0.01 * np.arange(round(duration / 0.01) + 1)
    acceleration = amplitude * np.sin(2 * np.pi * time / period) * np.exp(-decay * time)
    return wd.GroundMotion(np.where(time < 8.005, acceleration, 0.0), 0.01)


def pair(*motions: wd.GroundMotion) -> wd.PairOfMotions:
    return wd.PairOfMotions(*motions)
