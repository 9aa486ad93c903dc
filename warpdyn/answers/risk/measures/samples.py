"""Intensities of the samples of a run in any intensity measure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.demands import checked_demand, refuse_failed_samples, refuse_portfolio
from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.running.selections import without_added_places
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.output_variables import OK
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions

SAME = 1e-6  # larger relative differences of a step or a peak acceleration mean another motion


@dataclass(frozen=True, eq=False)
class MeasuredSamples:
    """The samples of a run with their intensities.

    Args:
        run: The run, without places that are not part of the building.
        status: Outcome of each sample, an index into STATUS_MEANINGS, shape [sample].
        motion: Index of the motion of each sample among the motions of the run, shape [sample].
        intensities: Intensity of each sample in each measure [level units of the measure], shape [measure, sample].
    """

    run: xr.Dataset
    status: np.ndarray
    motion: np.ndarray
    intensities: np.ndarray

    def worst(self, function: str, demand: str) -> np.ndarray:
        """Return the demand of each sample at its worst place, shape [sample]; NaN for collapsed samples."""
        found: np.ndarray = checked_demand(function, self.run, demand, self.status).max(axis=0).astype(np.float64)
        return np.where(self.status == OK, found, np.nan)


def measured(
    function: str, run: xr.Dataset, motions: Sequence[GroundMotion], measures: Sequence[IntensityMeasure]
) -> MeasuredSamples:
    """Return the samples of a run with their intensities in several measures.

    Args:
        function: Name of the public function, for messages.
        run: The run.
        motions: The motions of the run's scene, in its order.
        measures: The measures.

    Raises:
        TypeError: If a measure or a motion is of another class.
        ValueError: If the motions are not those of the run, an intensity is not above 0, or samples failed.
    """
    check_dataset(
        function, run, "status", "motion_index", advice="give the result of simulate() under motions", argument="run"
    )
    refuse_portfolio(function, run)
    if "event" in run.dims:
        raise ValueError(f"{function}: the run has several events: select one by select_event(run, name)")
    given = checked_motions(motions)
    for each in measures:
        if not isinstance(each, IntensityMeasure):
            raise TypeError(f"{function}: measures must be intensity measures such as wd.SpectralAcceleration(1.0)")
    names = [str(each) for each in run["motion_name"].values]
    if [each.name for each in given] != names:
        raise ValueError(
            f"{function}: motions= must be the {len(names)} motions of the run's scene, in its order, beginning with "
            f"{names[0]!r}, got {len(given)} motions, beginning with {given[0].name!r}"
        )
    _check_same_motions(function, run, given)
    status, index = decoded_status(run["status"]), run["motion_index"].values.astype(np.int64)
    refuse_failed_samples(function, status)
    factor = run["scale_factor_of_motion"].values if "scale_factor_of_motion" in run.coords else np.ones(status.size)
    values = np.array([each.scaled_levels(factor, each.level_values(given)[index]) for each in measures])
    if not (values > 0).all():
        place, sample = np.argwhere(~(values > 0))[0]
        raise ValueError(
            f"{function}: {measures[place].name} of motion {names[index[sample]]!r} is {values[place, sample]:g}; "
            "logarithms need intensities above 0: leave out this motion"
        )
    return MeasuredSamples(without_added_places(run), status, index, values)


def _check_same_motions(function: str, run: xr.Dataset, motions: Sequence[GroundMotion]) -> None:
    """Raise a ValueError that names the first motion whose step or peak acceleration differs from that of the run."""
    for name, attribute, words, units in (
        ("motion_step", "step", "step", "s"),
        ("motion_peak_acceleration", "peak_ground_acceleration", "peak acceleration", "m/s2"),
    ):
        if name not in run:
            continue
        given = np.array([getattr(each, attribute) for each in motions])
        differs = ~np.isclose(given, run[name].values, rtol=SAME, atol=0.0)
        if differs.any():
            place = int(differs.argmax())
            raise ValueError(
                f"{function}: {motions[place].name!r} in motions= has a {words} of {given[place]:.6g} {units}, but the "
                f"motion of this name in the run has {float(run[name].values[place]):.6g} {units}: give the motions of "
                "the run's scene, as they were given to it (not scaled)"
            )
