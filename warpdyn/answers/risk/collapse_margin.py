"""Collapse margins by FEMA P-695: spectral shape factors, total uncertainty, and acceptable margins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.special import ndtr, ndtri

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.foundations.core.checks import finite_numbers, one_of
from warpdyn.foundations.core.messages import amount_of, warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings

SOURCE = "FEMA P-695 (2009), chapters 6 and 7, appendix B"
RATINGS = {"A": 0.10, "B": 0.20, "C": 0.35, "D": 0.50}  # uncertainty beta of each rating: tables 3-1, 3-2 and 5-3
# Target epsilon by design category: table 7-1a is for B, C and Dmin, table 7-1b for Dmax (section B.3.2).
TARGET_EPSILON = {"B": 1.0, "C": 1.0, "Dmin": 1.0, "Dmax": 1.5}
RECORD_SETS = ("far_field", "near_field")
MOST_DUCTILITY = 8.0  # last column of the tables ("at least 8"); larger ductilities count as 8
ROUNDED_TO = 0.025  # the total uncertainty is rounded to multiples of this, as in tables 7-2 and 7-3


@suggests_names
def spectral_shape_factor(
    period: ArrayLike, ductility: ArrayLike, design_category: str = "Dmax", *, record_set: str = "far_field"
) -> np.ndarray:
    """Return the spectral shape factor of FEMA P-695, by the formulas from which its tables were computed.

    Scaled records of ordinary motions have another spectral shape than records of rare, strong motions; the factor
    corrects for this difference. SSF = exp(beta_1 (eps_0 - eps(T))), with beta_1 = 0.14 (mu_T - 1)^0.42 (equations B-3
    and B-4), the target epsilon eps_0 of the design category, and the mean epsilon eps(T) of the record set at the
    period T (equations B-1 and B-6).

    Args:
        period: Fundamental period of the archetype [s], of any shape.
        ductility: Period-based ductility mu_T [1], at least 1, of a shape that broadcasts with `period`; values above 8
            count as 8, as in the tables.
        design_category: Seismic design category "B", "C", "Dmin" or "Dmax".
        record_set: Record set of the collapse analyses: "far_field" or "near_field" of FEMA P-695.

    Returns:
        The factor [1], of the common shape of `period` and `ductility`.

    Raises:
        ValueError: If a period is not positive, a ductility is below 1, or a name is unknown.

    Example:
        >>> float(wd.spectral_shape_factor(1.5, 8.0).round(2))
        1.61
    """
    one_of("seismic design category", design_category, TARGET_EPSILON)
    one_of("record set", record_set, RECORD_SETS)
    periods, ductilities = finite_numbers("period", period), finite_numbers("ductility", ductility)
    for name, values in (("period", periods), ("ductility", ductilities)):
        if not values.size:
            raise ValueError(f"{name} is empty: give at least one value")
    if np.any(periods <= 0):
        raise ValueError(f"every period must be above 0, got {periods.min():g} s")
    findings = PlausibilityFindings()
    findings.add("first_period", periods)
    findings.warn()
    if np.any(ductilities < 1):
        raise ValueError(f"every period-based ductility must be at least 1, got {ductilities.min():g}")
    slope = 0.14 * (np.minimum(ductilities, MOST_DUCTILITY) - 1) ** 0.42
    if record_set == "far_field":
        of_records = np.clip(0.6 * (1.5 - periods), 0.0, 0.6)
    else:
        of_records = np.clip(0.2 * (periods - 1.5), 0.0, 0.2)
    return np.exp(slope * (TARGET_EPSILON[design_category] - of_records))


@suggests_names
def collapse_margin(
    collapse_median: ArrayLike,
    design_intensity: ArrayLike,
    *,
    period: ArrayLike,
    ductility: ArrayLike,
    design_category: str = "Dmax",
    record_set: str = "far_field",
    design_requirements: str = "B",
    test_data: str = "B",
    model: str = "B",
    names: Sequence[str] | None = None,
) -> xr.Dataset:
    """Return the collapse margins of the archetypes of a performance group by FEMA P-695, and whether they suffice.

    The adjusted margin of an archetype is its collapse margin ratio times its spectral shape factor. Two margins are
    acceptable: for each archetype, the margin at which the probability of collapse under the maximum considered
    earthquake is 20 %; for the mean of the group, the margin at which it is 10 %. The total uncertainty, beta =
    sqrt(beta_RTR^2 + beta_DR^2 + beta_TD^2 + beta_MDL^2) with beta_RTR = 0.1 + 0.1 mu_T, at most 0.4 (section 7.3), is
    rounded to 0.025 as in tables 7-2 and 7-3.

    Args:
        collapse_median: Median collapse intensity S_CT of each archetype [g], such as the `fragility_median` of the
            collapse state; one number, or shape [archetype].
        design_intensity: Spectral acceleration S_MT of the maximum considered earthquake at the archetype's period [g].
        period: Fundamental period of each archetype [s]; in FEMA P-695 at least 0.25 s.
        ductility: Period-based ductility mu_T of each archetype [1], from its pushover.
        design_category: Seismic design category of the group: "B", "C", "Dmin" or "Dmax".
        record_set: "far_field" or "near_field".
        design_requirements: Rating of the design requirements: "A" superior, "B" good, "C" fair, "D" poor.
        test_data: Rating of the test data, from "A" to "D".
        model: Rating of the archetypes' numerical models, from "A" to "D".
        names: Names of the archetypes; None: numbers from 1.

    Returns:
        For each archetype: `collapse_margin_ratio`, `spectral_shape_factor`, `adjusted_collapse_margin_ratio`,
        `total_uncertainty`, `acceptable_margin_10` and `acceptable_margin_20` [1]; `probability_of_collapse` at the
        design intensity, computed from the adjusted margin [1]; and `is_acceptable`. For the group:
        `mean_adjusted_margin`, `mean_acceptable_margin_10` and `group_is_acceptable`.

    Raises:
        TypeError: If an intensity is a Dataset.
        ValueError: If a value is not positive, a rating or a name is unknown, or shapes do not match.

    Example:
        >>> found = wd.collapse_margin(2.4, 1.5, period=0.7, ductility=6.0, model="C")
        >>> float(found["adjusted_collapse_margin_ratio"][0].round(2)), bool(found["is_acceptable"][0])
        (2.12, True)
    """
    for what, value in (("collapse_median", collapse_median), ("design_intensity", design_intensity)):
        if isinstance(value, xr.Dataset):
            states = value["damage_state"].values.ravel().tolist() if "damage_state" in value else []
            state = str(states[-1]) if states else "collapse"
            raise TypeError(
                f"collapse_margin: {what} must be one number or one per archetype [g], but got a Dataset; "
                f"give the median of one damage state: curves['fragility_median'].sel(damage_state={state!r})"
            )
    # The three ratings apply to all archetypes of the group.
    ratings = {"design_requirements": design_requirements, "test_data": test_data, "model": model}
    for what, rating in ratings.items():
        one_of(f"rating of {what}", rating, RATINGS)
    values = {
        "collapse_median": collapse_median,
        "design_intensity": design_intensity,
        "period": period,
        "ductility": ductility,
    }
    arrays = {what: np.atleast_1d(finite_numbers(what, value)) for what, value in values.items()}
    for what, array in arrays.items():
        if np.any(array <= 0):
            raise ValueError(f"every {what} must be above 0, got {array.min():g}")
    try:
        median, design, periods, ductilities = np.broadcast_arrays(*arrays.values())
    except ValueError as error:
        shapes = ", ".join(f"{what} {array.shape}" for what, array in arrays.items())
        raise ValueError(f"give one value for all archetypes or one per archetype; shapes are {shapes}") from error
    if median.ndim != 1:
        raise ValueError(f"values must be one number or have the shape [archetype], got shape {median.shape}")
    if np.any(periods < 0.25):
        warn_caller(
            f"the shortest period is {periods.min():g} s, but FEMA P-695 takes periods of at least 0.25 s, also for "
            "the design intensity: give period=np.maximum(period, 0.25) and the design_intensity at this period"
        )
    if names is not None and (isinstance(names, str) or not isinstance(names, Sequence | np.ndarray)):
        raise TypeError(f"names must be a list of names, one per archetype, got {names!r}")
    labels = np.arange(1, median.size + 1) if names is None else np.array(list(names), dtype=str)
    if labels.shape != median.shape:
        raise ValueError(
            f"names has {amount_of(labels.size, 'value')} for {amount_of(median.size, 'archetype')}: give "
            "one name per archetype"
        )

    shape = spectral_shape_factor(periods, ductilities, design_category, record_set=record_set)
    ratio = median / design
    adjusted = ratio * shape
    record_to_record = np.minimum(0.1 + 0.1 * ductilities, 0.4)
    of_system = sum(RATINGS[rating] ** 2 for rating in ratings.values())
    # A value halfway between two multiples is rounded up, which is conservative.
    beta = np.floor(np.sqrt(record_to_record**2 + of_system) / ROUNDED_TO + 0.5) * ROUNDED_TO
    acceptable = {share: np.exp(-ndtri(share) * beta) for share in (0.1, 0.2)}
    each = adjusted >= acceptable[0.2]
    mean, needed = adjusted.mean(), acceptable[0.1].mean()
    along = "archetype"
    rows = {
        "collapse_margin_ratio": (ratio, "collapse margin ratio S_CT / S_MT"),
        "spectral_shape_factor": (shape, "spectral shape factor"),
        "adjusted_collapse_margin_ratio": (adjusted, "adjusted collapse margin ratio"),
        "total_uncertainty": (beta, "total system collapse uncertainty, rounded to 0.025"),
        "acceptable_margin_10": (acceptable[0.1], "acceptable margin for 10 % probability of collapse"),
        "acceptable_margin_20": (acceptable[0.2], "acceptable margin for 20 % probability of collapse"),
        "probability_of_collapse": (
            ndtr(-np.log(adjusted) / beta),
            "probability of collapse under the design intensity",
        ),
    }
    group = {
        "mean_adjusted_margin": (mean, "mean adjusted collapse margin ratio of the group"),
        "mean_acceptable_margin_10": (needed, "mean acceptable margin for 10 % probability of collapse"),
    }
    is_acceptable = bool(each.all() and mean >= needed)
    return xr.Dataset(
        {name: variable(along, row, words) for name, (row, words) in rows.items()}
        | {name: variable((), value, words) for name, (value, words) in group.items()}
        | {
            "is_acceptable": (along, each, {"long_name": "the archetype reaches the margin for 20 %"}),
            "group_is_acceptable": (
                (),
                is_acceptable,
                {"long_name": "every archetype reaches the margin for 20 %, and their mean that for 10 %"},
            ),
        },
        {along: (along, labels, {"long_name": "archetype"})},
        ratings | {"design_category": design_category, "record_set": record_set, "source": SOURCE},
    )
