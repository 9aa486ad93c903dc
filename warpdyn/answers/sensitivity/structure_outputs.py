"""One output per structure of a run: its mean demand at each level, or its fragility medians."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.answers.fragility.demands import checked_demand, damage_of, refuse_failed_samples, refuse_portfolio
from warpdyn.answers.fragility.estimators.table import estimator_of
from warpdyn.answers.fragility.lognormal_fit import FIT_MEANINGS
from warpdyn.answers.fragility.reduced_counts import limits_of
from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.reductions.limits import Limit
from warpdyn.campaigns.running.selections import without_added_places
from warpdyn.foundations.core.checks import check_dataset
from warpdyn.foundations.core.output_variables import COLLAPSED, STRIPED
from warpdyn.foundations.core.units import unit_attributes

LEVEL, MOTION, STRUCTURE = "im_level", "motion_index", "structure"


@dataclass(frozen=True, eq=False)
class StructureOutputs:
    """Demands or exceedances of the samples of a run, which become one or more outputs per structure.

    Args:
        dim: Dimension of the outputs: "stripe" or "damage_state"; "" if there is one output.
        labels: Label of each output, shape [output]: intensity levels or names of damage states.
        attributes: Name and units of the outputs, for a dataset.
        structure, motion, level: Index of the structure, motion and level of each sample, shape [sample].
        counts: Numbers of structures, motions and levels.
        levels: Intensity levels, shape [level].
        samples: Demand of each sample, shape [sample]; or number of damage states that it exceeds.
    """

    dim: str
    labels: np.ndarray
    attributes: dict[str, Any]
    structure: np.ndarray
    motion: np.ndarray
    level: np.ndarray
    counts: tuple[int, int, int]
    levels: np.ndarray
    samples: np.ndarray

    @cached_property
    def values(self) -> np.ndarray:
        """The outputs of all structures, shape [structure, output]."""
        found, outcome = self._computed(np.ones(self.samples.size, bool))
        if np.isnan(found).any():
            place, output = (int(each) for each in np.argwhere(np.isnan(found))[0])
            what = "its counts of" if self.dim == "damage_state" else "the level"
            why = FIT_MEANINGS[outcome[place, output]] if self.dim == "damage_state" else "no sample"
            raise ValueError(
                f"{int(np.isnan(found).any(axis=1).sum())} of {len(found)} structures have no output; the first is "
                f"structure {place}, for {what} {str(self.labels[output])!r} ({why}): add levels to Stripes, or motions"
            )
        return found

    @property
    def have_equal_motions(self) -> bool:
        """Whether all structures were under the same motions at the same levels (crossed design)."""
        structures, _, levels = self.counts
        if self.structure.size % structures:
            return False
        cell = self.motion * levels + self.level
        order = np.lexsort((cell, self.structure))
        own, cells = (values[order].reshape(structures, -1) for values in (self.structure, cell))
        return bool((own == np.arange(structures)[:, None]).all() and (cells == cells[0]).all())

    def named(self, output: int) -> str:
        """Return words that name an output, such as " at 0.2 g" or " of 'slight'"; "" if there is one output."""
        label = self.labels[output]
        if not self.dim:
            return ""
        return (
            f" of {str(label)!r}" if self.dim == "damage_state" else f" at {label:g} {self.attributes['level_units']}"
        )

    def without(self, motion: int) -> np.ndarray:
        """Return the outputs without the samples of one motion, shape [structure, output]; NaN without a curve."""
        return self._computed(self.motion != motion)[0]

    def _computed(self, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return outputs and the outcomes of their fits (0 for demands), both of shape [structure, output]."""
        structures, _, levels = self.counts
        cell = (self.structure * levels + self.level)[kept]
        number = np.bincount(cell, minlength=structures * levels)
        if self.dim != "damage_state":
            total = np.bincount(cell, self.samples[kept], minlength=structures * levels)
            with np.errstate(invalid="ignore"):
                mean = (total / number).reshape(structures, levels)
            return mean, np.zeros(mean.shape, int)
        states = self.labels.size
        exceeding = np.stack(
            [np.bincount(cell[self.samples[kept] > state], minlength=structures * levels) for state in range(states)]
        )
        exceeding = np.moveaxis(exceeding.reshape(states, structures, levels), 0, 1)
        fit = estimator_of("lognormal").fit
        median, _, outcome = fit(self.levels, exceeding, number.reshape(structures, 1, levels))
        return median, outcome

    def dataset_of(self, values: np.ndarray, *dims: str, name: str, **attributes: Any) -> tuple:
        """Return values, shape [..., output], as (dimensions, values, attributes) of a variable of a dataset."""
        if not self.dim:
            return variable(dims, values[..., 0], name, **attributes)
        return variable((*dims, self.dim), values, name, **attributes)

    @property
    def coordinates(self) -> dict[str, Any]:
        """Coordinates of the dimension of the outputs, for a dataset."""
        if self.dim == "stripe":
            words = "intensity of the stripe"
            return {self.dim: variable(self.dim, self.labels, words, **unit_attributes(self.attributes["level_units"]))}
        return {self.dim: (self.dim, self.labels, {"long_name": "damage state"})} if self.dim else {}


def outputs_of(function: str, run: xr.Dataset, demand: str, limits: Mapping[str, Limit] | None) -> StructureOutputs:
    """Return the outputs of the structures of a run.

    Args:
        function: Name of the public function, for messages.
        run: The run.
        demand: Name of the demand; at each sample, that of the worst storey or floor counts.
        limits: Limits of damage states; None: the demands are the outputs.

    Raises:
        ValueError: If samples failed; if samples collapsed and `limits` is None; or if a structure has no curve.
    """
    check_dataset(function, run, "status", advice="give the result of simulate()", argument="run")
    refuse_portfolio(function, run)
    if "sample" not in run.dims or "event" in run.dims:
        raise ValueError(f"{function}: the run needs single samples of one event: use a run without statistics")
    run = without_added_places(run)
    status = decoded_status(run["status"])
    refuse_failed_samples(function, status)
    has_levels = LEVEL in run and run[LEVEL].attrs.get("design") == STRIPED
    nothing = np.zeros(status.size)
    structures, structure = np.unique(run[STRUCTURE].values if STRUCTURE in run else nothing, return_inverse=True)
    motions, motion = np.unique(run[MOTION].values if MOTION in run else nothing, return_inverse=True)
    levels, level = np.unique(run[LEVEL].values if has_levels else nothing, return_inverse=True)
    counts = structures.size, motions.size, levels.size
    units = str(run[LEVEL].attrs.get("units", "1")) if has_levels else "1"
    if limits is None:
        if (status == COLLAPSED).any():
            raise ValueError(
                f"{function}: {int((status == COLLAPSED).sum())} of {status.size} samples collapsed, so that their "
                "demands have no value: give limits=, for the fragility medians"
            )
        worst = checked_demand(function, run, demand, status).max(axis=0).astype(np.float64)
        words = {"long_name": f"mean {demand} of the motions", "units": str(run[demand].attrs.get("units", "1"))}
        dim, words = "stripe" if has_levels else "", {**words, "level_units": units}
        return StructureOutputs(dim, levels, words, structure, motion, level, counts, levels, worst)
    if not has_levels or levels.size < 2:
        raise ValueError(f"{function}: fragility medians need Stripes with at least 2 levels: remove limits=")
    checked = limits_of(run, limits, demand)
    passed = damage_of(function, run, checked, status).passed[-1]
    words = {"long_name": "median capacity", "level_units": units, **unit_attributes(units)}
    states = np.array(checked.states)
    return StructureOutputs("damage_state", states, words, structure, motion, level, counts, levels, passed)
