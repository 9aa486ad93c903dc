"""Rounds of capacity searches that add structures to every motion until the intervals of the medians are narrow."""

from __future__ import annotations

import math
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import stdtrit

from warpdyn.answers.fragility.capacity_curves import fragility_from_capacities
from warpdyn.answers.fragility.lognormal_fit import SEPARATED
from warpdyn.answers.fragility.sample_size.variance_components import MOST_STRUCTURES, records_for, variances_of
from warpdyn.campaigns.accuracy.pilot import choose_method
from warpdyn.foundations.core.messages import no_warnings, warn_caller
from warpdyn.model.ground_motions.designs import Cloud, Stripes
from warpdyn.model.scene.scene import Scene

# Relative width of brackets divided by the precision, and limits of this width. The uncertainty within brackets
# averages
# out: a width of 50 % adds ln(1.5)^2 / 12 = 0.014 to the variance of ln(capacity), which is usually 0.05 to 0.2.
WIDTH_OVER_PRECISION, LEAST_WIDTH, LARGEST_WIDTH = 10 / 3, 0.02, 0.5
LEAST_RATIO = 1.1  # smallest ratio of neighbouring levels; narrower brackets are found by a search between levels
# Brackets determine a dispersion if their width in ln(intensity) is at most WIDEST_OVER_DISPERSION times the
# dispersion; otherwise they are narrowed to NARROWING times the dispersion.
WIDEST_OVER_DISPERSION, NARROWING = 3.0, 2.0
# Largest number of rounds, and factor on the number of structures if a prediction of this number was too small.
MOST_ROUNDS, GROWTH = 6, 1.5
# Target error of the integration divided by the precision, and limits of this target error.
ERROR_SHARE, LEAST_ERROR, LARGEST_ERROR = 0.2, 0.002, 0.02
PLANNED_LEVELS = 4  # number of levels in the pilot run that chooses the step
# `plan` is called only if at least this number of histories is expected: its pilot run integrates about ten thousand
# histories, most of them with shorter steps. The default step has an error of 0.1 % (studies/decision.py), far below
# the uncertainty of the curves.
PLANNED_FROM = 50_000


@dataclass(eq=False)
class Rounds:
    """Rounds of capacity searches that add structures to every motion until the intervals are narrow enough.

    Args:
        scene: The scene.
        search: The function `capacities` with its constant arguments.
        precision: Required half width of the intervals of the medians, relative to the median [1].
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of the first round.
        integration: Arguments of `capacities` for the integration: method and, after a plan, dtype and longest step.
    """

    scene: Scene
    search: partial[xr.Dataset]
    precision: float
    confidence: float
    seed: int
    integration: dict[str, Any]
    width: float = field(init=False)  # relative width of the brackets
    highest: float = math.inf
    rounds: list[xr.Dataset] = field(default_factory=list)
    begun: int = 0  # number of rounds, including discarded ones
    pilot_histories: int = 0  # number of histories that are not part of the result

    def __post_init__(self) -> None:
        self.width = float(np.clip(WIDTH_OVER_PRECISION * self.precision, LEAST_WIDTH, LARGEST_WIDTH))

    def run(self) -> xr.Dataset:
        """Add rounds until the precision is reached or limited by the number of records; return the curves."""
        asked, more, is_bound = math.log1p(self.precision), 1, np.array(False)
        while True:
            self._add(more)
            count = sum(each.sizes["structure"] for each in self.rounds)
            curves = self._fit(quietly=True)
            if count == 1 and self._narrow_brackets(curves):
                continue
            met = ~(curves["half_width"].values > self.precision)  # also True for a state without a fit
            if met.all() or self.begun >= MOST_ROUNDS:
                break
            if count == 1:
                continue
            needed, is_bound = variances_of(_together(self.rounds), self.confidence).structures_for(asked)
            if needed <= count:
                if is_bound.any() or count == MOST_STRUCTURES:
                    break
                needed = min(math.ceil(GROWTH * count), MOST_STRUCTURES)
            more = needed - count
            if self._plan(needed, count):
                more = needed
        curves = self._fit(quietly=False)
        self._label(curves, "structures" if met.all() else "records")
        self._warn_unless(met, curves, bool(is_bound.any()))
        return curves

    def _add(self, structures: int) -> None:
        """Search the capacities of `structures` more structures for each motion, and add them as a round."""
        seed = self.seed
        if self.begun:
            seed = int(np.random.SeedSequence([self.seed, self.begun]).generate_state(1)[0])
        found = self.search(
            _nested(self.scene, structures),
            tolerance=self.width,
            ladder=1 + max(self.width, LEAST_RATIO - 1),
            highest=self.highest,
            seed=seed,
            **self.integration,
        )
        reached = np.isfinite(found["capacity"].values).any(axis=0).sum(axis=0)
        if not self.begun and reached.max() < 2:
            raise ValueError(
                "fewer than two motions exceed a limit at any level up to the highest one, "
                f"{found.attrs['highest']:g} "
                f"{found['capacity'].attrs['units']}: check that the limits are in the unit of the demand"
            )
        self.highest = float(found.attrs["highest"])
        self.rounds.append(found)
        self.begun += 1

    def _restart(self) -> None:
        """Discard all rounds that were run so far, and count their histories as pilot histories."""
        self.pilot_histories += sum(each.attrs["histories"] for each in self.rounds)
        self.rounds = []

    def _fit(self, *, quietly: bool) -> xr.Dataset:
        """Return the curves fitted to all rounds, with half the relative widths of the medians' intervals."""
        with no_warnings() if quietly else nullcontext():
            curves = fragility_from_capacities(_together(self.rounds), confidence=self.confidence, seed=self.seed)
        half = (curves["fragility_median_upper"] / curves["fragility_median_lower"]).values ** 0.5 - 1
        words = {"long_name": "half the width of the interval", "units": "1"}
        words["comment"] = f"relative, of the {100 * self.confidence:g} % interval of the median"
        return curves.assign(half_width=("damage_state", half, words))

    def _narrow_brackets(self, curves: xr.Dataset) -> bool:
        """Discard all rounds and narrow the brackets if they determine no dispersion; return whether this happened.

        `curves` are the curves fitted to the rounds so far.
        """
        reach = math.log1p(self.width)
        if (curves["fit_status"] == SEPARATED).any():
            least = LEAST_WIDTH
        else:
            dispersion = float(curves["fragility_dispersion"].min())
            if not dispersion < reach / WIDEST_OVER_DISPERSION:
                return False
            least = math.expm1(NARROWING * dispersion)
        if self.width <= LEAST_WIDTH:
            return False
        self.width = max(least, LEAST_WIDTH)
        self._restart()
        return True

    def _plan(self, needed: int, count: int) -> bool:
        """Choose method and step by `plan` if more than PLANNED_FROM histories are expected; return whether it did.

        The rounds so far are then discarded, because they had another method or step.

        Args:
            needed: Number of structures per motion that is needed in total.
            count: Number of structures per motion so far.
        """
        expected = sum(each.attrs["histories"] for each in self.rounds) * needed / count
        if expected <= PLANNED_FROM or "longest_step" in self.integration:
            return False
        final = _nested(self.scene, needed)
        chosen = choose_method(
            _where_it_counts(final, _together(self.rounds)),
            float(np.clip(ERROR_SHARE * self.precision, LEAST_ERROR, LARGEST_ERROR)),
            structures=final.structures_given,
            seed=self.seed,
            method=self.integration["method"],
            dtype=None,
            device=self.search.keywords["device"],
            threads=self.search.keywords["threads"],
        )
        self.integration = {"method": chosen.method, "dtype": chosen.dtype, "longest_step": chosen.longest_step}
        self._restart()
        return True

    def _label(self, curves: xr.Dataset, bounded_by: str) -> None:
        """Add the method, the step, the numbers of histories and the records needed to the dataset of the curves."""
        first, motions = self.rounds[0], self.rounds[0].sizes["motion"]
        quantile = stdtrit(motions - 1, 0.5 + 0.5 * self.confidence)
        of_motion = motions * (np.log1p(curves["half_width"].values) / quantile) ** 2
        needed = records_for(math.log1p(self.precision), of_motion, self.confidence)
        words = {
            "long_name": "records needed for the precision with these structures per record",
            "units": "1",
        }
        curves["records_needed"] = ("damage_state", needed, words)
        curves.attrs |= {
            "precision": self.precision,
            "structures_per_motion": sum(each.sizes["structure"] for each in self.rounds),
            "bracket_width": self.width,
            **{name: value for name, value in self.integration.items() if name == "longest_step"},
            "method": first.attrs["method"],
            "dtype": first.attrs["dtype"],
            "histories": sum(int(each.attrs["histories"]) for each in self.rounds),
            "pilot_histories": int(self.pilot_histories),
            "bounded_by": bounded_by,
        }

    def _warn_unless(self, met: np.ndarray, curves: xr.Dataset, is_bound: bool) -> None:
        """Warn of medians that do not reach the precision, with the number of records that would be needed.

        Args:
            met: Whether the median of each damage state reaches the precision, shape [damage_state].
            curves: The curves.
            is_bound: Whether the records limit the precision, so that more structures do not help.
        """
        if met.all():
            return
        widths = ", ".join(
            f"{str(state)!r} {100 * width:.3g} % ({count:,} records would be enough)"
            for state, width, count in zip(
                curves["damage_state"].values[~met],
                curves["half_width"].values[~met],
                curves["records_needed"].values[~met],
                strict=True,
            )
        )
        records, structures = self.rounds[0].sizes["motion"], curves.attrs["structures_per_motion"]
        why = "and more structures do not help" if is_bound else f"after {structures} structures of each"
        warn_caller(
            f"the precision is limited by the {records} records, {why}: half the interval of the median is {widths}, "
            "not "
            f"{100 * self.precision:.3g} %. Add records, or choose a larger precision="
        )


def _together(rounds: list[xr.Dataset]) -> xr.Dataset:
    """Return the capacities of all rounds in one dataset, in which structures of different rounds are different."""
    parts, before = [], 0
    for found in rounds:
        drawn = found["drawn_structure"]
        numbered = drawn.dims, drawn.values + before, drawn.attrs
        parts.append(found[["capacity", "capacity_lower", "capacity_upper"]].assign_coords(drawn_structure=numbered))
        before += int(drawn.max()) + 1
    return xr.concat(parts, "structure", combine_attrs="override")


def _nested(scene: Scene, structures: int) -> Scene:
    """Return the scene with `structures` separate structures for each motion; `capacities` ignores the level."""
    design = scene.excitation
    assert isinstance(design, Cloud | Stripes)
    level = [float(np.median(design.intensities))]
    return replace(scene, excitation=Stripes(design.motions, level, design.measure, structures_per_motion=structures))


def _where_it_counts(scene: Scene, pilot: xr.Dataset) -> Scene:
    """Return the scene with stripes in the range of the capacities, for the choice of the step.

    Args:
        scene: The scene with separate structures for each motion.
        pilot: The capacities found so far.
    """
    capacity = pilot["capacity"].values
    lowest, highest = np.nanquantile(capacity[np.isfinite(capacity)], [0.16, 0.84])
    design = scene.excitation
    assert isinstance(design, Stripes)
    stripes = Stripes(design.motions, np.geomspace(lowest, 1.001 * highest, PLANNED_LEVELS).tolist(), design.measure)
    return replace(scene, excitation=stripes)
