"""Fragility curves of a stated precision: a pilot says what it takes, and a run of its own gives the answer."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import stdtrit

from warpdyn.accuracy.pilot import choose_method
from warpdyn.core.checks import check_kind, real_number, whole_number
from warpdyn.core.messages import warn_caller
from warpdyn.ground_motions.designs import Cloud, Stripes
from warpdyn.incremental.capacities import capacities
from warpdyn.reduction.limits import DRIFT
from warpdyn.scene.scatter import GivenValues
from warpdyn.scene.scene import Scene
from warpdyn.statistics.capacity_curves import fragility_from_capacities
from warpdyn.statistics.lognormal_fit import check_confidence

# Structures that each motion has in the pilot: two tell the variance within motions from that among them.
PILOT_STRUCTURES, MOST_STRUCTURES = 2, 256
SAFETY = 0.95  # share of the precision that the predicted interval takes: the pilot's variances are estimates
# Where the records bound the precision: the share of their variance that structures may add, 2.5 % of the interval.
LEAST_SHARE = 0.05
# Share of the precision that the integration may err by, and the bounds of this error.
ERROR_SHARE, LEAST_ERROR, LARGEST_ERROR = 0.2, 0.002, 0.02
PILOT_LADDER = 1.3  # of the pilot, whose brackets are not narrowed
LEAST_TOLERANCE, LARGEST_TOLERANCE = 0.02, 0.1  # of the brackets of capacities, whose own error averages out
MOST_RECORDS = 10**6
PLANNED_LEVELS = 4  # that the step is chosen at
# Histories from which `plan` pays: its own pilot runs some ten thousand, most of them at shorter steps. Below, the
# default method errs by a thousandth at its default step (studies/decision.py), and the answer by far more.
PLANNED_FROM = 50_000


@dataclass(frozen=True, eq=False)
class Variances:
    """Variances of the logarithm of the capacity, of each damage state.

    Args:
        among: Among motions, shape [damage_state].
        within: Among the structures of one motion.
        motions: Number of motions.
        confidence: Probability that an interval covers.
    """

    among: np.ndarray
    within: np.ndarray
    motions: int
    confidence: float

    def half_width(self, structures: float) -> np.ndarray:
        """Return half the interval of ln(median) with so many structures of each motion's own."""
        variance = (self.among + self.within / structures) / self.motions
        return stdtrit(self.motions - 1, 0.5 + 0.5 * self.confidence) * np.sqrt(variance)

    def records_for(self, half_width: float) -> np.ndarray:
        """Return how many motions such an interval takes, however many structures there are."""
        count = np.arange(3, 2000)
        factor = stdtrit(count - 1, 0.5 + 0.5 * self.confidence) / np.sqrt(count)
        enough = factor[:, None] * np.sqrt(self.among) <= half_width
        few = np.where(enough.any(axis=0), count[enough.argmax(axis=0)], 0)
        many = np.ceil((stdtrit(count[-1], 0.5 + 0.5 * self.confidence) / half_width) ** 2 * self.among)
        return np.where(few > 0, few, np.minimum(many, MOST_RECORDS)).astype(np.int64)


def fragility_to(
    scene: Scene,
    limits: Mapping[str, float],
    precision: float = 0.1,
    *,
    demand: str = DRIFT,
    method: str | None = None,
    confidence: float = 0.95,
    seed: int = 0,
    device: str | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Find the fragility curves of a scene with intervals of a stated width, by as few histories as that takes.

    A pilot of two structures for each motion finds the capacities (by `capacities`), and from these how much they vary
    among motions and among the structures of one motion, and where the levels must lie. Where the answer takes many
    histories, the method and the step are those of `plan`, else the default ones. Then every motion gets as many
    structures of its own as the precision takes, with a seed of their own: the answer rests on these alone, so that
    what the pilot found by chance does not bias it.

    Often the records decide, and no number of structures reaches the precision: then structures stop where they add
    next to nothing, and a warning says so and how many records it would take.

    Args:
        scene: The scene; its excitation is a Cloud or Stripes of at least three motions, whose levels are not needed.
        limits: Limit of each damage state, from the lightest on, in the units of the demand; `math.inf` is passed by
            collapse alone.
        precision: Half the width of the interval of each median, relative: 0.1 asks for medians to within 10 %.
        demand: Variable that limits are of, as of `capacities`.
        method: Integration method; None to let `plan` choose, or for the default where `plan` would cost more.
        confidence: Probability that the intervals cover.
        seed: Seed of every random draw.
        device: "cpu" or "cuda:0"; None for the first GPU, or the CPU where there is none.
        threads: CPU threads; None for every core this process may use.

    Returns:
        What `fragility_from_capacities` returns, with `half_width(damage_state)` reached [1],
        `expected_half_width` by the pilot, `records_needed(damage_state)` for the precision, and attributes of what was
        chosen and spent: structures_per_motion, method, dtype, longest_step (by `plan`), histories and pilot_histories.

    Raises:
        ValueError: If the intensity is no acceleration, there are fewer than three motions, the precision is not
            between 0.001 and 1, no pair of the pilot reaches a limit, or as `capacities` and `plan`.
        TypeError: If the scene is none, or its excitation is no Cloud or Stripes.

    Example:
        >>> curves = wd.fragility_to(scene, {"slight": 0.005, "complete": 0.05}, precision=0.1)
    """
    check_kind("fragility_to", "a Scene", scene, Scene)
    precision = real_number("precision", precision, above=0)
    if not 1e-3 <= precision < 1:
        raise ValueError(
            f"precision is half the relative width of an interval, from 0.001 to below 1, got {precision:g}"
        )
    check_confidence(confidence)
    seed = whole_number("seed", seed, 0)
    design = scene.excitation
    if not isinstance(design, Cloud | Stripes) or scene.structure.is_many:
        raise TypeError("fragility_to() takes a scene of one structure under a Cloud or Stripes of motions")
    if design.intensity_units != "g":
        raise ValueError(
            f"fragility_to() scales motions to levels of an acceleration, got {design.measure.name}: take "
            "SpectralAcceleration(period), or fragility_from_capacities() of capacities()"
        )
    given = [name for name, spread in scene.scatter.items() if isinstance(spread, GivenValues)]
    if given:
        raise ValueError(
            f"fragility_to() draws as many structures as the precision takes, and scatter[{given[0]!r}] lists given "
            "ones: take capacities() of these, and fragility_from_capacities()"
        )
    if isinstance(limits, Mapping) and any(isinstance(limit, Mapping) for limit in limits.values()):
        raise ValueError(
            "fragility_to() takes limits of one demand, demand=; for the worst of several take fragility() of a run on "
            "stripes"
        )
    motions = len(design.motions)
    if motions < 3:
        raise ValueError(f"an interval over records takes at least 3 motions, got {motions}")
    search = partial(capacities, demand=demand, device=device, threads=threads)
    pilot_seed = int(np.random.SeedSequence([seed, 1]).generate_state(1)[0])
    pilot = search(
        _nested(scene, PILOT_STRUCTURES),
        limits,
        tolerance=PILOT_LADDER - 1,
        ladder=PILOT_LADDER,
        highest=math.inf,
        seed=pilot_seed,
        method=method,
    )
    found = _variances(pilot, confidence)
    asked = math.log1p(precision)
    structures, is_bound = _structures(found, asked)
    final = _nested(scene, structures)
    integration: dict[str, Any] = {"method": method}
    expected_histories = pilot.attrs["histories"] * structures / PILOT_STRUCTURES
    if expected_histories > PLANNED_FROM:
        chosen = choose_method(
            _where_it_counts(final, pilot),
            float(np.clip(ERROR_SHARE * precision, LEAST_ERROR, LARGEST_ERROR)),
            structures=final.structures_given,
            seed=pilot_seed,
            method=method,
            dtype=None,
            device=device,
            threads=threads,
        )
        integration = {"method": chosen.method, "dtype": chosen.dtype, "longest_step": chosen.longest_step}
    answer = search(
        final,
        limits,
        tolerance=float(np.clip(precision, LEAST_TOLERANCE, LARGEST_TOLERANCE)),
        highest=float(pilot.attrs["highest"]),
        seed=seed,
        **integration,
    )
    curves = fragility_from_capacities(answer, confidence=confidence, seed=seed)
    expected, needed = found.half_width(structures), found.records_for(asked)
    half = (curves["fragility_median_upper"] / curves["fragility_median_lower"]).values ** 0.5 - 1
    said = {"units": "1", "comment": f"relative, of the {100 * confidence:g} % interval of the median"}
    words = {"long_name": "half the width of the interval"}
    curves["half_width"] = ("damage_state", half, said | words)
    words = {"long_name": "half the width of the interval that the pilot expected"}
    curves["expected_half_width"] = ("damage_state", np.expm1(expected), said | words)
    words = {"long_name": "records that the precision takes, however many structures there are", "units": "1"}
    curves["records_needed"] = ("damage_state", needed, words)
    curves.attrs |= {
        "precision": precision,
        "structures_per_motion": structures,
        **{name: value for name, value in integration.items() if name == "longest_step"},
        "method": answer.attrs["method"],
        "dtype": answer.attrs["dtype"],
        "histories": int(answer.attrs["histories"]),
        "pilot_histories": int(pilot.attrs["histories"]),
        "bounded_by": "records" if is_bound.any() else "structures",
    }
    _warn_of_records(curves, is_bound, found, asked)
    return curves


def _nested(scene: Scene, structures: int) -> Scene:
    """Return the scene with structures of each motion's own; the one level stands for those that are searched."""
    design = scene.excitation
    assert isinstance(design, Cloud | Stripes)
    level = [float(np.median(design.intensities))]
    return replace(scene, excitation=Stripes(design.motions, level, design.measure, structures_per_motion=structures))


def _where_it_counts(scene: Scene, pilot: xr.Dataset) -> Scene:
    """Return the scene at levels where its damage states are passed, which the step is chosen for."""
    capacity = pilot["capacity"].values
    lowest, highest = np.nanquantile(capacity[np.isfinite(capacity)], [0.16, 0.84])
    design = scene.excitation
    assert isinstance(design, Stripes)
    stripes = Stripes(design.motions, np.geomspace(lowest, 1.001 * highest, PLANNED_LEVELS).tolist(), design.measure)
    return replace(scene, excitation=stripes)


def _variances(pilot: xr.Dataset, confidence: float) -> Variances:
    """Return the variances of the capacities of a pilot, by an analysis of variance."""
    with np.errstate(invalid="ignore"):
        logarithm = np.log(pilot["capacity"].transpose("structure", "motion", "damage_state").values)
    logarithm[~np.isfinite(logarithm)] = np.nan
    known = np.isfinite(logarithm).all(axis=0)  # motions of which every structure passed the limit
    if not (known.sum(axis=0) >= 2).any():
        raise ValueError(
            "no limit is passed by two of the motions, up to the highest level "
            f"{pilot.attrs['highest']:g} {pilot['capacity'].attrs['units']}: are the limits in the demand's unit?"
        )
    among, within = np.zeros(known.shape[1]), np.zeros(known.shape[1])
    rounding = math.log(PILOT_LADDER) ** 2 / 12  # of brackets that are not narrowed
    for state, of_state in enumerate(known.T):
        values = logarithm[:, of_state, state]
        if values.shape[1] < 2:
            continue
        within[state] = max(values.var(axis=0, ddof=1).mean() - rounding, 0.0)
        among[state] = max(values.mean(axis=0).var(ddof=1) - (within[state] + rounding) / len(values), 0.0)
    return Variances(among, within, pilot.sizes["motion"], confidence)


def _structures(found: Variances, asked: float) -> tuple[int, np.ndarray]:
    """Return how many structures each motion gets, and of which damage states the records bound the precision."""
    is_bound = found.half_width(math.inf) > SAFETY * asked
    with np.errstate(divide="ignore", invalid="ignore"):
        by_records = found.within / (LEAST_SHARE * found.among)
        floor = (SAFETY * asked / stdtrit(found.motions - 1, 0.5 + 0.5 * found.confidence)) ** 2 * found.motions
        by_precision = found.within / (floor - found.among)
    needed = np.where(is_bound, by_records, np.minimum(by_precision, by_records))
    most = np.nanmax(np.where(np.isfinite(needed), needed, 1.0), initial=1.0)
    return int(np.clip(math.ceil(most), 1, MOST_STRUCTURES)), is_bound


def _warn_of_records(curves: xr.Dataset, is_bound: np.ndarray, found: Variances, asked: float) -> None:
    """Say where the records bound the precision: no more work helps."""
    if not is_bound.any():
        return
    needed = curves["records_needed"].values
    said = [
        f"{str(state)!r} {100 * math.expm1(width):.2g} % ({count:,} records would do)"
        for state, width, count, bound in zip(
            curves["damage_state"].values, found.half_width(math.inf), needed, is_bound, strict=True
        )
        if bound
    ]
    warn_caller(
        f"{found.motions} records bound the precision, and more structures do not help: with any number of them half "
        f"the interval of the median is {', '.join(said)}; {100 * math.expm1(asked):.2g} % was asked for"
    )
