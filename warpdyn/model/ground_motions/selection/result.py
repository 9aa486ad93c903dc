"""The result of a selection of records: motions, scale factors and tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.model.ground_motions.designs import Stripes
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions
from warpdyn.model.ground_motions.selection.greedy import largest_errors
from warpdyn.model.ground_motions.selection.record_spectra import RecordSpectra
from warpdyn.model.ground_motions.selection.target import TargetSpectrum

Motion = GroundMotion | PairOfMotions


@dataclass(frozen=True, eq=False)
class LevelSelection(FrozenArrays):
    """The records that were selected for one target.

    Args:
        target: The target.
        records: Indices of the selected records, shape [selected].
        factors: Scale factors [1], shape [selected].
        left: Bound -> number of records that satisfy it.
    """

    target: TargetSpectrum
    records: np.ndarray
    factors: np.ndarray
    left: Mapping[str, int]


@dataclass(frozen=True, eq=False, repr=False)
class RecordSelection:
    """Records that `select_records` selected, with their scale factors, for one or several targets.

    Args:
        records: The spectra of all records.
        levels: The selection for each target: `target`, `records` (indices), `factors`, and `left` (number of records
            that each bound leaves).

    Example:
        >>> spectra = wd.RecordSpectra.from_motions(motions, periods=[0.1, 0.3, 1.0])
        >>> measure, shape, sigma = wd.SpectralAcceleration(0.3), np.array([2.0, 1.0, 0.35]), [0.3, 0.0, 0.4]
        >>> targets = [wd.TargetSpectrum([0.1, 0.3, 1.0], a * shape, sigma, measure) for a in (0.4, 0.8)]  # g
        >>> selection = wd.select_records(spectra, targets, number=4)
        >>> selection
        RecordSelection(4 records for each of 2 targets)
        >>> selection.stripes().levels
        array([0.4, 0.8])
    """

    records: RecordSpectra
    levels: tuple[LevelSelection, ...]

    def table(self) -> pd.DataFrame:
        """Return one row per selected record: level [g], index of the record, scale factor, and its data."""
        rows = []
        assert self.records.table is not None
        for each in self.levels:
            own = self.records.table.iloc[each.records].reset_index(drop=True)
            own.insert(0, "scale_factor", each.factors)
            own.insert(0, "record", each.records)
            if each.target.level is not None:
                own.insert(0, "level", each.target.level)
            rows.append(own)
        return pd.concat(rows, ignore_index=True)

    def agreement(self) -> pd.DataFrame:
        """Return medians [g] and standard deviations of ln Sa of target and selection, one row per level and period.

        Standard deviations of the selection divide by the number of records minus 1.
        """
        rows = []
        for place, each in enumerate(self.levels):
            scaled = self.spectra(place)
            spread = scaled.std(axis=0, ddof=1) if len(scaled) > 1 else np.full(scaled.shape[1], np.nan)
            columns = {
                "period": np.asarray(each.target.periods),
                "target_median": np.asarray(each.target.median),
                "median": np.exp(scaled.mean(axis=0)),
                "target_dispersion": each.target.dispersion,
                "dispersion": spread,
            }
            of_level = {} if each.target.level is None else {"level": each.target.level}
            rows.append(pd.DataFrame(of_level | columns))
        return pd.concat(rows, ignore_index=True)

    def candidates(self) -> pd.DataFrame:
        """Return the number of records that satisfy each bound, one row per target."""
        rows = [
            ({} if each.target.level is None else {"level": each.target.level}) | dict(each.left)
            for each in self.levels
        ]
        return pd.DataFrame(rows)

    @property
    def largest_errors(self) -> list[tuple[float, float]]:
        """Largest relative errors of the median and of the standard deviation over the periods [1], for each target."""
        return [largest_errors(each.target, self.spectra(place)) for place, each in enumerate(self.levels)]

    def spectra(self, level: int = 0) -> np.ndarray:
        """Return ln Sa of the scaled records at the periods of the target, with Sa in g, shape [selected, period].

        Args:
            level: Index of the target.
        """
        own = self._level(level)
        recorded = self.records.ln_at(np.asarray(own.target.periods))[own.records]
        return recorded + np.log(own.factors)[:, None]

    @suggests_names
    def motions(self, level: int = 0, motions: Mapping[str, Motion] | None = None) -> list[Motion]:
        """Return the selected motions of one target, unscaled.

        Args:
            level: Index of the target.
            motions: Name in the table -> motion, if the spectra come from a flat file.

        Raises:
            ValueError: If a selected record has no motion, or its name is that of another record, too.
        """
        chosen = self._level(level).records
        if motions is None and not self.records.motions:
            raise ValueError(
                "these spectra come from a file without motions: give motions={name: motion} with the motions of the "
                f"selected records, whose names are in selection.table(): {self._names(chosen)}"
            )
        if motions is None:
            return [self.records.motions[i] for i in chosen]
        assert self.records.table is not None
        names = [self.records.table["name"].iloc[i] for i in chosen]
        of_name = self.records.table["name"].value_counts()
        if repeated := [name for name in names if of_name[name] > 1]:
            raise ValueError(
                f"{of_name[repeated[0]]} records have the name {repeated[0]!r}, so it determines no motion: "
                "give each record another name in the column 'name' of the table"
            )
        missing = [name for name in names if name not in motions]
        if missing:
            raise ValueError(
                f"motions= has no motion for {len(missing)} of {len(names)} selected records: {missing[:5]}"
            )
        return [motions[name] for name in names]

    @suggests_names
    def stripes(self, motions: Mapping[str, Motion] | None = None) -> Stripes:
        """Return the design for a scene: the selected motions of each level, scaled to the level.

        Args:
            motions: Name in the table -> motion, if the spectra come from a flat file.

        Raises:
            ValueError: If the targets are unconditional, or a selected record has no motion.
        """
        measure = self.levels[0].target.conditioning
        if measure is None:
            raise ValueError(
                "the target is unconditional, so its records are not scaled to a level: use "
                "wd.Cloud(selection.scaled_motions())"
            )
        of_levels = [self.motions(place, motions) for place in range(len(self.levels))]
        levels = [each.target.level for each in self.levels]
        known = list({id(motion): motion for row in of_levels for motion in row}.values())
        place_of = {id(motion): place for place, motion in enumerate(known)}
        indices = [[place_of[id(motion)] for motion in row] for row in of_levels]
        return Stripes(known, levels, self.records.measure(measure), motions_of_levels=indices)  # type: ignore[arg-type]

    @suggests_names
    def scaled_motions(self, level: int = 0, motions: Mapping[str, Motion] | None = None) -> list[Motion]:
        """Return the selected motions of one target, multiplied by their scale factors.

        Args:
            level: Index of the target.
            motions: Name in the table -> motion, if the spectra come from a flat file.

        Raises:
            ValueError: If a selected record has no motion.
        """
        chosen = self.motions(level, motions)
        return [_scaled(motion, float(c)) for motion, c in zip(chosen, self._level(level).factors, strict=True)]

    def _level(self, level: int) -> LevelSelection:
        return self.levels[whole_number("level", level, 0, len(self.levels) - 1)]

    def _names(self, chosen: Sequence[int] | np.ndarray) -> str:
        assert self.records.table is not None
        names = self.records.table["name"].iloc[list(chosen)].tolist()
        return ", ".join(names[:3]) + (", ..." if len(names) > 3 else "")

    def __repr__(self) -> str:
        number = self.levels[0].records.size
        of_targets = "" if len(self.levels) == 1 else f" for each of {len(self.levels)} targets"
        return f"RecordSelection({number} records{of_targets})"


def _scaled(motion: Motion, factor: float) -> Motion:
    if isinstance(motion, PairOfMotions):
        parts = {name: _scaled(part, factor) for name, part in zip(("x", "y"), motion.components[:2], strict=True)}
        if motion.vertical is not None:
            parts["vertical"] = _scaled(motion.vertical, factor)
        return replace(motion, **parts)  # type: ignore[arg-type] # of GroundMotions
    return replace(motion, acceleration=factor * motion.acceleration)
