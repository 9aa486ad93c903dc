"""`select_records`: records whose spectra have the mean and covariance of a target."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warpdyn.foundations.core.checks import check_kind, finite_numbers, one_of, real_number, shortened, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.model.ground_motions.selection.bounds import (
    check_enough,
    check_events,
    checked_bounds,
    events_of,
    screened,
)
from warpdyn.model.ground_motions.selection.greedy import (
    Problem,
    improved,
    largest_errors,
    nearest_records,
    simulated_spectra,
)
from warpdyn.model.ground_motions.selection.record_spectra import RecordSpectra
from warpdyn.model.ground_motions.selection.result import LevelSelection, RecordSelection
from warpdyn.model.ground_motions.selection.target import TargetSpectrum

STATISTICS = ("moments", "kolmogorov_smirnov")
PLAUSIBLE_FACTOR = 10.0  # a larger bound of the scale factor gives a warning
PLAUSIBLE_ERROR = 0.2  # a larger relative error of the median or the standard deviation gives a warning
ERROR_OF_MEDIAN = 2.0  # weight of the largest error of the median in the choice between several starts
FEW = 2.0  # fewer than this multiple of `number` candidates give a warning


@suggests_names
def select_records(
    records: RecordSpectra,
    targets: TargetSpectrum | Sequence[TargetSpectrum],
    number: int = 30,
    *,
    scale: tuple[float, float] = (0.2, 5.0),
    magnitude: tuple[float, float] | None = None,
    distance: tuple[float, float] | None = None,
    vs30: tuple[float, float] | None = None,
    most_per_event: int | None = None,
    statistic: str = "moments",
    weights: tuple[float, float, float] = (1.0, 2.0, 0.3),
    tolerance: float = 0.1,
    passes: int = 4,
    starts: int = 1,
    seed: int = 0,
) -> RecordSelection:
    """Select records whose response spectra have the mean and the standard deviation of a target.

    Spectra are simulated from the target distribution (Latin hypercube sampling), the record nearest to each of them is
    chosen, and then the records are replaced one after the other by the candidates with the smallest error. The
    selection is separate for each target; a record may be selected for several targets.

    If a target has a conditioning measure, every record is scaled to its level. Otherwise each record first has the
    factor with the smallest squared difference of Sa to its simulated spectrum, and the greedy improvement chooses
    factors from 0.1, 0.2, ... within `scale`. A first selection within `tolerance` keeps the least-squares factors.
    `scale=(1, 1)` selects unscaled records.

    Sources: Jayaram, Lin and Baker (2011), Earthquake Spectra 27(3); Baker and Lee (2018), Journal of Earthquake
    Engineering 22(4).

    Args:
        records: Spectra of the records, such as RecordSpectra.from_motions(motions, periods).
        targets: One target, or one per level of the conditioning measure.
        number: Number of records per target.
        scale: Smallest and largest scale factor [1].
        magnitude: Smallest and largest magnitude [1]; None: no bound. Records with a missing value do not satisfy it.
        distance: Smallest and largest distance [km], as `magnitude`.
        vs30: Smallest and largest time-averaged shear-wave velocity of the upper 30 m [m/s], as `magnitude`.
        most_per_event: Largest number of records of one event per target; None: no limit.
        statistic: "moments": sum of squared errors of mean and standard deviation; "kolmogorov_smirnov": sum over
            periods of the Kolmogorov-Smirnov statistic.
        weights: Weights of the errors of mean, standard deviation and (of simulated spectra) skewness [1].
        tolerance: The passes end if the largest relative errors of median and standard deviation are below it [1].
        passes: Largest number of passes of the greedy improvement.
        starts: Largest number of sets of simulated spectra from which the selection starts. The starts end at the
            tolerance; otherwise the selection with the smallest errors is returned. Give 10 for small sets of records.
        seed: Seed of the simulated spectra.

    Returns:
        The selected records and scale factors: see RecordSelection.

    Raises:
        ValueError: If too few records satisfy the bounds (the message states how many each bound leaves), the target
            has periods outside of those of the spectra, or an argument is out of range.
        TypeError: If `records` or a target has another class.

    Example:
        >>> spectra = wd.RecordSpectra.from_motions(motions, periods=[0.1, 0.3, 1.0])
        >>> target = wd.TargetSpectrum([0.1, 0.3, 1.0], [0.8, 0.4, 0.14], [0.3, 0.0, 0.4], wd.SpectralAcceleration(0.3))
        >>> selection = wd.select_records(spectra, target, number=4)
        >>> bool(selection.table()["scale_factor"].between(0.2, 5).all())
        True
    """
    check_kind("select_records", "RecordSpectra", records, RecordSpectra, _ADVICE, argument="records")
    row = _checked_targets(targets)
    number = whole_number("select_records: number", number, 1)
    passes = whole_number("select_records: passes", passes, 0)
    starts = whole_number("select_records: starts", starts, 1)
    tolerance = real_number("select_records: tolerance", tolerance, least=0)
    one_of("statistic", statistic, STATISTICS)
    seed = whole_number("select_records: seed", seed, 0)
    most = number if most_per_event is None else whole_number("select_records: most_per_event", most_per_event, 1)
    bound = checked_bounds("scale", scale)
    if bound is None or not 0 < bound[1] < np.inf:
        raise ValueError(f"select_records: scale must be the smallest and largest scale factor, got {scale!r}")
    if bound[1] > PLAUSIBLE_FACTOR:
        warn_caller(
            f"select_records: scale allows factors up to {bound[1]:g}. Records that are scaled by more than about 5 "
            "have other magnitudes and durations than motions of this level: give scale=(0.2, 5)"
        )
    bounds = {
        name: checked_bounds(name, given)
        for name, given in (("magnitude", magnitude), ("distance", distance), ("vs30", vs30))
    }
    shares = finite_numbers("select_records: weights", weights)
    if shares.shape != (3,) or np.any(shares < 0) or shares[0] + shares[1] <= 0:
        raise ValueError(
            "select_records: weights must be 3 numbers of at least 0, such as (1.0, 2.0, 0.3), and that of the mean or "
            f"that of the standard deviation must be above 0, got {weights!r}"
        )
    events = events_of(records)
    if most_per_event is not None and records.table is not None and "event" not in records.table:
        raise ValueError(
            "select_records: most_per_event needs the event of each record: add a column 'event' to the table of the "
            "records, or remove most_per_event="
        )
    settings = {"weights": tuple(shares.tolist()), "statistic": statistic, "most_per_event": most}
    found = [
        _selected(records, target, number, bound, bounds, events, settings, tolerance, passes, starts, (seed, place))
        for place, target in enumerate(row)
    ]
    selection = RecordSelection(records, tuple(found))
    _warn_of_errors(selection, max(tolerance, PLAUSIBLE_ERROR))
    return selection


def _warn_of_errors(selection: RecordSelection, most: float) -> None:
    """Warn if the selection differs much from its targets, with the period of the largest difference."""
    found = []
    for place, (each, errors) in enumerate(zip(selection.levels, selection.largest_errors, strict=True)):
        if max(errors) <= most:
            continue
        target, scaled = each.target, selection.spectra(place)
        ratio = np.exp(scaled.mean(axis=0) - target.mean)
        worst = int(np.argmax(np.abs(ratio - 1)))
        level = "" if target.level is None else f"level {target.level:.3g} g: "
        found.append(
            f"- {level}the median at {np.asarray(target.periods)[worst]:.3g} s is {ratio[worst]:.2f} times that of the "
            f"target, and a standard deviation differs by {100 * errors[1]:.0f} %"
        )
    if found:
        listed = "\n".join(found)
        warn_caller(
            f"select_records: the records do not agree with the target:\n{listed}\nToo few of the records have such "
            "spectra. Add records, widen scale= or other bounds, select fewer records, or give a target at the periods "
            "of the structure"
        )


_ADVICE = "give wd.RecordSpectra.from_motions(motions, periods), or the spectra of a flat file"


def _checked_targets(targets: TargetSpectrum | Sequence[TargetSpectrum]) -> list[TargetSpectrum]:
    row = (
        [targets] if isinstance(targets, TargetSpectrum) else list(targets) if isinstance(targets, list | tuple) else []
    )
    wrong = [each for each in row if not isinstance(each, TargetSpectrum)]
    if not row or wrong:
        raise TypeError(
            f"select_records: targets must be TargetSpectrum objects, such as [wd.conditional_spectrum(...)], got "
            f"{shortened(wrong[0] if wrong else targets)}"
        )
    names = {"" if target.conditioning is None else target.conditioning.name for target in row}
    levels = [target.level or 0.0 for target in row]
    if len(row) > 1 and (len(names) > 1 or "" in names or np.any(np.diff(levels) <= 0)):
        raise ValueError(
            "select_records: several targets must have the same conditioning measure and increasing levels, got "
            f"{', '.join(map(repr, row))}: select for other targets in separate calls"
        )
    return row


def _selected(
    records: RecordSpectra,
    target: TargetSpectrum,
    number: int,
    scale: tuple[float, float],
    bounds: dict[str, tuple[float, float] | None],
    events: np.ndarray,
    settings: dict,
    tolerance: float,
    passes: int,
    starts: int,
    seed: tuple[int, int],
) -> LevelSelection:
    """Return the selection for one target."""
    spectra = records.ln_at(np.asarray(target.periods))
    factors = None
    if target.level is not None:
        of_measure = records.ln_at(target.conditioning_periods).mean(axis=1)
        factors = target.level / np.exp(of_measure)
    passing, left = screened(records, target, bounds, factors, scale)
    allowed = np.flatnonzero(passing)
    check_enough(number, allowed.size, records.number, left, target.level)
    check_events(allowed.size, events[allowed], settings["most_per_event"], number)
    if allowed.size < FEW * number:
        warn_caller(
            f"select_records: only {allowed.size} of {records.number} records satisfy all bounds for number={number}, "
            "so few sets of records can be compared: widen the bounds or give a smaller number="
        )
    problem = Problem(
        spectra[allowed],
        None if factors is None else factors[allowed],
        scale,
        np.unique(events[allowed], return_inverse=True)[1],
        target=target,
        **settings,
    )
    random = np.random.default_rng([*seed, Purpose.RECORD_SELECTION])

    def is_good(scaled: np.ndarray) -> bool:
        return max(largest_errors(target, scaled)) <= tolerance

    best, least = None, np.inf
    for _ in range(starts):
        simulated = simulated_spectra(target, number, problem.weights, random)
        chosen, used = nearest_records(problem, simulated)
        if not is_good(problem.spectra[chosen] + np.log(used)[:, None]):
            chosen, used = improved(problem, chosen, used, passes, is_good)
        scaled = problem.spectra[chosen] + np.log(used)[:, None]
        median, deviation = largest_errors(target, scaled)
        score = max(ERROR_OF_MEDIAN * median, deviation)
        if best is None or score < least:
            best, least = (chosen, used), score
        if is_good(scaled):
            break
    assert best is not None
    return LevelSelection(target, allowed[best[0]], best[1], left | {"all bounds": allowed.size})
