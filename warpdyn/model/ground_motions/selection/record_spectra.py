"""Response spectra of a set of records, and the properties by which records are screened."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_numbers, shortened
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.one_component import AverageSpectralAcceleration, SpectralAcceleration
from warpdyn.model.ground_motions.measures.pairs import RotatedSpectralAcceleration
from warpdyn.model.ground_motions.measures.rotd import pair_response_spectra
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions
from warpdyn.model.ground_motions.pairs_of_motions import PairOfMotions
from warpdyn.model.ground_motions.response_spectra import checked_periods, response_spectra
from warpdyn.model.ground_motions.selection.flat_files import esm_table, ngawest2_table, user_table

# Columns of the table of records, with their units in messages.
NUMBERS = {
    "magnitude": "",
    "distance": " km",
    "vs30": " m/s",
    "longest_usable_period": " s",
}
COMPONENTS = ("", "RotD50")
NEAR = 1e-6  # two periods are equal if their relative difference is at most this


@with_suggestions
@dataclass(frozen=True, eq=False, repr=False)
class RecordSpectra(FrozenArrays):
    """Response spectra of a set of records (5 % damping), from which `select_records` selects.

    Args:
        periods: Natural periods [s], increasing, shape [period].
        spectral_acceleration: Sa of each record [g], shape [record, period].
        table: One row per record, with any of the columns `name`, `event`, `magnitude`, `distance` [km], `vs30` [m/s]
            and `longest_usable_period` [s]; missing values are NaN. Further columns are kept. None: records are
            numbered.
        component: "" for spectra of one component; "RotD50" for the median over all directions of both components.
        motions: The records as GroundMotions, or as PairOfMotions for "RotD50"; () if they are not in memory.

    Raises:
        ValueError: If shapes differ, a spectral acceleration is not finite and above 0, or a value in the table is not
            a number.
        TypeError: If the table is not a DataFrame.

    Example:
        >>> spectra = wd.RecordSpectra.from_motions(motions, periods=[0.1, 0.3, 1.0])
        >>> spectra
        RecordSpectra(8 records, 3 periods from 0.1 to 1 s)
    """

    periods: ArrayLike
    spectral_acceleration: ArrayLike
    table: pd.DataFrame | None = None
    component: str = ""
    motions: Sequence[GroundMotion | PairOfMotions] = ()

    def __post_init__(self) -> None:
        periods = checked_periods(self.periods, "RecordSpectra.periods")
        if periods.ndim != 1 or periods.size == 0 or np.any(np.diff(periods) <= 0):
            raise ValueError(
                f"RecordSpectra.periods must be one row of increasing periods [s], got {shortened(self.periods)}"
            )
        values = finite_numbers("RecordSpectra.spectral_acceleration [g]", self.spectral_acceleration, "g")
        if values.ndim != 2 or values.shape[1] != periods.size or not len(values):
            raise ValueError(
                f"RecordSpectra.spectral_acceleration must have shape [record, {periods.size}], one column per period, "
                f"got shape {values.shape}"
            )
        if np.any(values <= 0):
            record, place = np.argwhere(values <= 0)[0]
            raise ValueError(
                f"RecordSpectra.spectral_acceleration[{record}] is {values[record, place]:g} g at "
                f"{periods[place]:g} s: it must be above 0; remove this record"
            )
        one_of("component", self.component, COMPONENTS)
        motions = tuple(self.motions)
        if motions and len(motions) != len(values):
            raise ValueError(
                f"RecordSpectra: there are {amount_of(len(motions), 'motion')}, but spectra of "
                f"{amount_of(len(values), 'record')}"
            )
        object.__setattr__(self, "periods", periods)
        object.__setattr__(self, "spectral_acceleration", values)
        object.__setattr__(self, "table", _checked_table(self.table, len(values)))
        object.__setattr__(self, "motions", motions)

    @classmethod
    @suggests_names
    def from_motions(
        cls,
        motions: Sequence[GroundMotion] | Sequence[PairOfMotions],
        periods: ArrayLike,
        table: pd.DataFrame | None = None,
    ) -> RecordSpectra:
        """Return the response spectra (5 % damping) of ground motions; of pairs of motions, RotD50.

        Args:
            motions: GroundMotions, or PairOfMotions.
            periods: Natural periods [s], increasing, shape [period].
            table: As in RecordSpectra; its rows are in the order of `motions`. None: names of the motions, and the
                name of the record as event.

        Raises:
            ValueError, TypeError: If a motion is not a GroundMotion or PairOfMotions, or as in RecordSpectra.

        Example:
            >>> table = pd.DataFrame({"magnitude": 6.5, "distance": range(10, 18), "event": [1, 1, 1, 2, 2, 3, 3, 4]})
            >>> wd.RecordSpectra.from_motions(motions, [0.1, 0.3, 1.0], table).table["event"].nunique()
            4
        """
        given = checked_motions(motions, or_pairs=True)  # type: ignore[arg-type] # or pairs
        row = np.atleast_1d(checked_periods(periods, "RecordSpectra.from_motions: periods"))
        pairs = [motion for motion in cast("Sequence[object]", given) if isinstance(motion, PairOfMotions)]
        if pairs and len(pairs) < len(given):
            raise ValueError("RecordSpectra.from_motions: give either GroundMotions or PairOfMotions, not both")
        if table is None:
            table = pd.DataFrame({"name": [motion.name for motion in given]})
            if not pairs and all(motion.record for motion in given):
                table["event"] = [motion.record for motion in given]
        elif isinstance(table, pd.DataFrame) and "name" not in table and len(table) == len(given):
            table = table.assign(name=[motion.name for motion in given])
        if not pairs:
            spectra = response_spectra(given, row)["pseudo_spectral_acceleration"].values[:, 0]
            return cls(row, spectra / STANDARD_GRAVITY, table, "", given)
        both = [
            replace(motion, record=str(i), component=str(90 * place))
            for i, pair in enumerate(pairs)
            for place, motion in enumerate((pair.x, pair.y))
        ]
        rotated = pair_response_spectra(both, row, percentiles=50)["rotated"]
        order = [int(name) for name in rotated["record"].values]
        values = np.empty((len(pairs), row.size))
        values[order] = rotated.values[:, 0]
        return cls(row, values / STANDARD_GRAVITY, table, "RotD50", given)

    @classmethod
    @suggests_names
    def from_ngawest2(cls, path: str | os.PathLike) -> RecordSpectra:
        """Return the spectra in the flat file of NGA-West2 (RotD50, horizontal components).

        The event is `EQID`, the distance `ClstD (km)` (closest distance to the rupture), and the longest usable period
        the reciprocal of `Lowest Usable Freq - Ave. Component (Hz)`. The table also contains `rsn`, `file_1` and
        `file_2`. Records whose spectrum has missing values (-999) are omitted.

        Args:
            path: The flat file as CSV; save an Excel file as CSV first.

        Raises:
            ValueError: If a column is missing, or no record has a complete spectrum.
            FileNotFoundError: If the file does not exist.

        Example:
            >>> spectra = wd.RecordSpectra.from_ngawest2("ngawest2.csv")
            >>> spectra.table["rsn"].tolist()
            [1, 2, 3]
        """
        return cls(*ngawest2_table(path), "RotD50")

    @classmethod
    @suggests_names
    def from_esm(cls, path: str | os.PathLike) -> RecordSpectra:
        """Return the spectra in the flat file of ESM 2018 (RotD50, horizontal components).

        The magnitude is `EMEC_Mw` if it is given, otherwise `Mw`; the distance is `rup_dist`, otherwise `JB_dist`,
        otherwise `epi_dist`. The longest usable period is 1 over the larger high-pass corner frequency of both
        components. Spectral accelerations are converted from cm/s2.

        Args:
            path: The flat file as CSV, with commas or semicolons between columns.

        Raises:
            ValueError: If a column is missing, or no record has a complete spectrum.
            FileNotFoundError: If the file does not exist.

        Example:
            >>> wd.RecordSpectra.from_esm("esm.csv").table["magnitude"].tolist()
            [6.5, 6.0, 5.5]
        """
        return cls(*esm_table(path), "RotD50")

    @classmethod
    @suggests_names
    def from_table(
        cls,
        path: str | os.PathLike | pd.DataFrame,
        spectra: Mapping[float, str],
        columns: Mapping[str, str],
        *,
        unit: str = "g",
        component: str = "RotD50",
        missing: float = -999.0,
    ) -> RecordSpectra:
        """Return the spectra in any flat file, such as that of NGA-Subduction, with the names of its columns.

        Args:
            path: The flat file as CSV, or a DataFrame.
            spectra: Period [s] -> name of the column with its spectral acceleration.
            columns: Name in the table of RecordSpectra (`name`, `event`, `magnitude`, `distance`, `vs30`,
                `longest_usable_period`, or any other name) -> name of the column in the file.
            unit: Unit of spectral accelerations; see `wd.records.UNITS`.
            component: "RotD50", or "" for one component.
            missing: Value that marks missing numbers.

        Raises:
            ValueError: If a column is missing, or no record has a complete spectrum.
            FileNotFoundError: If the file does not exist.

        Example:
            >>> flat = pd.DataFrame({"NGAsubRSN": [7, 8], "M": [8.0, 7.5], "T1": [0.2, 0.1], "T2": [0.1, 0.04]})
            >>> columns = {"name": "NGAsubRSN", "magnitude": "M"}
            >>> spectra = wd.RecordSpectra.from_table(flat, {1.0: "T1", 2.0: "T2"}, columns)
            >>> spectra.spectral_acceleration
            array([[0.2 , 0.1 ],
                   [0.1 , 0.04]])
        """
        return cls(*user_table(path, spectra, columns, unit, missing), component)

    @property
    def number(self) -> int:
        """Number of records."""
        return len(np.asarray(self.spectral_acceleration))

    def ln_at(self, periods: np.ndarray) -> np.ndarray:
        """Return ln Sa at some periods, with Sa in g, shape [record, period]; linear in ln T between the periods.

        Raises:
            ValueError: If a period is outside of the periods of the spectra.
        """
        own = np.asarray(self.periods)
        outside = periods[(periods < own[0] * (1 - NEAR)) | (periods > own[-1] * (1 + NEAR))]
        if outside.size:
            raise ValueError(
                f"the target has a period of {outside[0]:g} s, but the spectra of the records are for {own[0]:g} to "
                f"{own[-1]:g} s: give a target within this range, or compute spectra at more periods"
            )
        at = np.interp(np.log(periods), np.log(own), np.arange(own.size))
        left = np.minimum(at.astype(int), max(own.size - 2, 0))
        share = at - left
        spectra = np.log(np.asarray(self.spectral_acceleration))
        right = np.minimum(left + 1, own.size - 1)
        return (1 - share) * spectra[:, left] + share * spectra[:, right]

    def measure(self, conditioning: IntensityMeasure) -> IntensityMeasure:
        """Return the intensity measure by which `Stripes` scale the motions, for the conditioning of a target."""
        if self.component and isinstance(conditioning, SpectralAcceleration):
            return RotatedSpectralAcceleration(conditioning.period, conditioning.damping_ratio)
        if self.component and isinstance(conditioning, AverageSpectralAcceleration):
            raise ValueError(
                "the average of RotD50 over periods is not an intensity measure of stripes: use "
                "selection.scaled_motions(level), or spectra of one component"
            )
        return conditioning

    def __repr__(self) -> str:
        own = np.asarray(self.periods)
        kind = f" of {self.component}" if self.component else ""
        return f"RecordSpectra({self.number} records, {own.size} periods{kind} from {own[0]:g} to {own[-1]:g} s)"


def _checked_table(table: pd.DataFrame | None, records: int) -> pd.DataFrame:
    if table is None:
        table = pd.DataFrame(index=range(records))
    if not isinstance(table, pd.DataFrame):
        raise TypeError(f"RecordSpectra.table must be a pandas DataFrame, got {type(table).__name__}")
    if len(table) != records:
        raise ValueError(
            f"RecordSpectra.table has {amount_of(len(table), 'row')}, but there are {amount_of(records, 'record')}"
        )
    table = table.reset_index(drop=True).copy()
    for name in NUMBERS:
        if name in table:
            values = real_numbers(f"RecordSpectra.table[{name!r}]", table[name].to_numpy())
            if name != "magnitude" and np.any(values < 0):
                row = int(np.argmax(values < 0))
                raise ValueError(
                    f"RecordSpectra.table[{name!r}] is {values[row]:g}{NUMBERS[name]} in row {row}: it must be at "
                    "least 0; give NaN for a missing value"
                )
            table[name] = values
    if "name" not in table:
        table.insert(0, "name", [f"record {i}" for i in range(records)])
    table["name"] = table["name"].astype(str)
    return table
