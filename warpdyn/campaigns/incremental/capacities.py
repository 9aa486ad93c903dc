"""The public function of incremental dynamic analysis: the capacity of every structure under every motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import xarray as xr

from warpdyn.campaigns.incremental.labels import Found, labelled_capacities
from warpdyn.campaigns.incremental.pairs import DRIFT_RATIO, Pairs
from warpdyn.campaigns.incremental.search import Search
from warpdyn.campaigns.integration.run import Run, build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.reductions.limits import LIMIT_BANDS, state_names
from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.engine.kernels.queues import open_queues, seconds_in_kernels
from warpdyn.foundations.core.checks import check_memory, one_of, real_number, real_numbers, true_or_false, whole_number
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import LARGEST_EXCLUDED_FRACTION
from warpdyn.foundations.core.plausibility import warn_of_implausible_limits
from warpdyn.foundations.core.progress import counted_histories
from warpdyn.model.ground_motions.designs import Cloud, Design, Stripes
from warpdyn.model.scene.arguments import takes_scene
from warpdyn.model.scene.number_of_structures import number_of_structures
from warpdyn.model.scene.plausibility import warn_of_implausible
from warpdyn.model.scene.scene import Scene

PAIRS_AT_A_TIME = 2**16
LARGEST_LIMIT = 1e9
LARGEST_LADDER = 10.0  # ratio of neighbouring levels
BYTES_OF_A_CAPACITY = 64  # its bracket, value, status and resurrections, while they are joined
FIRST_SHARE = 1e-3  # level of the elastic run, over the middle of the intensities as recorded
BEYOND_ELASTIC = 4.0  # highest level of a cloud, over the largest that the first structure's elastic response needs


@takes_scene
def capacities(
    scene: Scene,
    limits: Mapping[str, float],
    *,
    structures: int | None = None,
    demand: str = DRIFT_RATIO,
    tolerance: float = 0.02,
    highest: float | None = None,
    ladder: float = 1.1,
    reuse_elastic: bool = True,
    keep_curves: bool = False,
    added_storeys: bool = False,
    seed: int = 0,
    method: str | None = None,
    step: float | None = None,
    longest_step: float | None = None,
    dtype: str | None = None,
    on_unstable: str = "substep",
    device: str | None = None,
    threads: int | None = None,
) -> xr.Dataset:
    """Find the intensity at which every structure first passes each limit, under every motion (IDA).

    The demand of each pair of a structure and a motion is evaluated on a ladder of levels, up to the first that passes
    the last limit; then two levels at a time between the last level that stays within a limit and the first that passes
    it, where a power law between them passes it, until the bracket is as narrow as the tolerance. All pairs are run at
    once, in some ten launches, and a history informs every damage state. A limit is passed by a demand above it, and
    by a collapse. Structures are those that `simulate` draws with the same seed. Where either of two demands brings a
    damage state about, its capacity is the smaller of two calls.

    What a bracket promises: the demand at `capacity_lower` is within the limit, as it is at every lower level that was
    run, and at `capacity_upper` it is above. A demand need not grow with the intensity: it may pass a limit between two
    rungs of the ladder and return. Where rungs give a sign of it (a peak or a shoulder near the limit), levels between
    them are run; a collapse at single levels gives none, and a finer `ladder` sees more of these. Of the README's first
    study no capacity comes after the first passage on 200 levels, in 11,264 cases; of a frame whose storeys deteriorate
    a few in a thousand do, at collapse, and none with `ladder=1.03`. Levels above a capacity at which the demand is
    within the limit again (resurrections) are counted, up to the level that passes the last limit, and warned of.

    Source: Vamvatsikos and Cornell (2002), "Incremental dynamic analysis", Earthquake Engineering and Structural
    Dynamics 31(3); the search is theirs (hunt and fill, 2004, Earthquake Spectra 20(2)) over all pairs at once.

    Args:
        scene: The scene; its excitation is a Cloud or Stripes, whose motions are scaled and whose measure is the
            intensity. Its recorders are not needed.
        limits: Limit of each damage state, from the lightest on, in the units of the demand (storey drift ratio [1],
            floor acceleration [m/s2]). A limit of `math.inf` is passed by collapse alone.
        structures: Number of structures to draw; None for 1, with a warning if parameters are scattered. Leave it out
            if Stripes have `structures_per_motion`: then the dimension `structure` numbers the structures of each
            motion, and `drawn_structure` says which were drawn.
        demand: Name of a recorded variable, such as "peak_floor_acceleration", of which the worst storey or floor
            counts, as an absolute value.
        tolerance: Relative width of a bracket [1]: capacity_upper / capacity_lower - 1 is at most this.
        highest: Highest level [g, or SI units of a measure that is no acceleration]: a limit that is not passed there
            has an infinite capacity. None for the last level of Stripes, and of a Cloud for four times as much as the
            elastic response of its first structure needs; `math.inf` for this whatever the design.
        ladder: Ratio of neighbouring levels of the ladder [1], at most 10. Each pair has a ladder of its own, up to
            the highest level.
        reuse_elastic: Whether a demand below the first yield is scaled from one elastic run instead of being run again.
        keep_curves: Whether all levels that were run are part of the dataset, as a table over `sample`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper count as storeys of the building, and the
            floors above them. A collapse of theirs passes every limit in either case.
        seed: Seed of every random draw.
        method: Integration method, as of `simulate`.
        step: Integration step [s], as of `simulate`.
        longest_step: Upper bound of the chosen steps [s], as of `simulate`.
        dtype: "float32" or "float64", as of `simulate`.
        on_unstable: What is done where the step is beyond a structure's stability limit, as of `simulate`.
        device: "cpu" or "cuda:0"; of several the first; None for the first GPU, or the CPU where there is none.
        threads: CPU threads; None for every core this process may use.

    Returns:
        Dataset over `structure`, `motion` and `damage_state`: `capacity`, the geometric mean of its bracket
        `capacity_lower` and `capacity_upper` (infinite, as the upper end is, where the limit was not passed up to the
        highest level: right-censored), `capacity_status` (found, above_highest, below_lowest, failed) and
        `resurrections`, the number of levels above the capacity that were within the limit again. With `keep_curves`
        over `sample`: `im_level`, the demand, `status`, `structure_index`, `motion_index`, by pair and level.

    Raises:
        ValueError: If an argument is out of its range, limits do not increase, the demand is not recorded, or more than
            1 % of the pairs failed.
        TypeError: If the scene is none, its excitation is no Cloud or Stripes, or `keep_curves` or `reuse_elastic`
            is not True or False.

    Example:
        >>> found = wd.capacities(scene, {"slight": 0.005, "complete": 0.015}, structures=2)
        >>> found["capacity"].median(["structure", "motion"]).round(1).values  # g
        array([0.5, 1.2])
    """
    design = _design_of(scene)
    names, limit = _checked(limits)
    tolerance = real_number("tolerance", tolerance, above=0)
    if not 1e-5 <= tolerance < 1:
        raise ValueError(f"tolerance must be a relative width from 1e-5 to below 1, got {tolerance:g}")
    if real_number("ladder", ladder, above=1) > LARGEST_LADDER:
        raise ValueError(f"ladder must be at most {LARGEST_LADDER:g}, got {ladder:g}: levels between would be missed")
    for name, choice in {"reuse_elastic": reuse_elastic, "keep_curves": keep_curves}.items():
        true_or_false(name, choice)
    integration = Integration(method=method, dtype=dtype, step=step, longest_step=longest_step, on_unstable=on_unstable)
    execution = Execution(device=device, threads=threads).on_first()
    finite = {f" of {name!r}": float(value) for name, value in zip(names, limit, strict=True) if value < np.inf}
    if demand in LIMIT_BANDS:
        warn_of_implausible_limits(finite, LIMIT_BANDS[demand])
    if demand == DRIFT_RATIO:
        _warn_of_limits_beyond_collapse(scene, finite)
    warn_of_implausible(scene, step=step, longest_step=longest_step)
    count = number_of_structures("capacities", scene, structures)
    check_memory(
        f"capacities() of structures={whole_number('structures', count, 1)} under {len(design.motions)} motions",
        BYTES_OF_A_CAPACITY * count * len(design.motions) * len(names),
        "take fewer structures: a few per motion determine a fragility curve",
    )
    run = build_run(replace(scene, recorders=_recorders_for(scene, demand)), count, integration, execution, seed)
    if np.isinf(limit[-1]) and not run.model.plan.collapses:
        raise ValueError(
            f"the limit of damage state {names[-1]!r} is infinite, which collapse alone passes, and nothing collapses "
            "in the scene: give it a collapse_drift_ratio, or the building a drift capacity"
        )
    first = FIRST_SHARE * float(np.median(design.intensities))
    if isinstance(highest, float) and highest == np.inf:
        highest = None
    elif highest is not None:
        highest = real_number("highest", highest, above=first)
    elif isinstance(design, Stripes):
        highest = float(design.levels[-1])
    own = design.structures_per_motion or run.structures
    findings = StabilityFindings(own * len(design.motions), run.integration.method)
    queue = open_queues(execution.devices, run.model.threads)[0]
    found = Found(names, limit, demand, tolerance, ladder, keep_curves)
    counts_added = true_or_false("added_storeys", added_storeys)
    size = max(1, PAIRS_AT_A_TIME // len(design.motions))
    starts = range(0, own, size)
    with interruptible(), counted_histories(0) as progress:
        for start in starts:
            part = np.arange(start, min(start + size, own))
            pairs = Pairs(
                run,
                part,
                demand,
                run.integration,
                queue,
                first,
                findings,
                progress.update,
                reuse_elastic=reuse_elastic,
                added_storeys=counts_added,
            )
            if highest is None:
                highest = _highest_of(pairs, limit, len(design.motions))
            search = Search(pairs, limit, highest, ladder, tolerance)
            search.run()
            found.add(search)
    findings.warn(on_unstable)
    _refuse_failed(found, run)
    result = labelled_capacities(found, run, run.integration, float(highest or np.nan))
    result.attrs["seconds_in_kernels"] = seconds_in_kernels([queue])
    _warn_of_resurrections(result)
    return result


def _design_of(scene: Scene) -> Design:
    """Return the scene's design, or raise an error unless its motions can be scaled."""
    design = scene.excitation
    if scene.structure.is_many:
        raise TypeError("capacities() takes a scene of one structure, got a Portfolio: give it an archetype's scene")
    if not isinstance(design, Cloud | Stripes):
        raise TypeError(f"capacities() scales the motions of a Cloud or of Stripes, got {type(design).__name__}")
    if isinstance(design, Stripes):
        design.check_scaled_to_all("capacities")
    if design.measure.power == 0:
        raise ValueError(
            f"{design.measure.name} does not grow with a motion's scale: take another intensity measure, such as "
            "SpectralAcceleration(period)"
        )
    bad = np.flatnonzero(~(design.intensities > 0))
    if bad.size:
        raise ValueError(f"motion {bad[0]} ({design.motions[bad[0]].name!r}) has no intensity to scale: leave it out")
    return design


def _checked(limits: Mapping[str, float]) -> tuple[list[str], np.ndarray]:
    """Return names and limits, or raise an error unless they are positive and increase."""
    if not isinstance(limits, Mapping) or not limits:
        raise ValueError(f"limits must map at least one damage state to a limit of the demand, got {limits!r}")
    names = list(state_names(limits))
    for name, value in limits.items():
        if isinstance(value, Mapping):
            raise ValueError(
                f"the limit of damage state {name!r} is {dict(value)}; capacities() and levels_for() take limits of "
                "one demand, such as {'slight': 0.005}, with demand= for its variable"
            )
    try:
        values = np.array([float(real_numbers("limits", value)) for value in limits.values()])
    except (TypeError, ValueError):
        hint = " (0.5 % is 0.005)" if any("%" in str(value) for value in limits.values()) else ""
        raise ValueError(f"limits must be numbers, got {dict(limits)}{hint}") from None
    for name, value in zip(names, values, strict=True):
        if LARGEST_LIMIT < value < np.inf:
            raise ValueError(f"limits: {name!r} is {value:g}; it must be at most {LARGEST_LIMIT:g}, or math.inf")
        if not value > 0:
            raise ValueError(f"the limit of damage state {name!r} is {value}; it must be above 0")
    for i in range(len(names) - 1):
        if not values[i + 1] > values[i]:
            raise ValueError(
                f"limits must increase from one damage state to the next, but {names[i]!r} has {values[i]} "
                f"and {names[i + 1]!r} after it {values[i + 1]}"
            )
    return names, values


def _warn_of_limits_beyond_collapse(scene: Scene, limits: Mapping[str, float]) -> None:
    """Warn of drift limits that lie above the drift at which every sample ends."""
    collapse = scene.collapse_limit
    for where, limit in limits.items():
        if collapse is not None and limit > collapse:
            warn_caller(
                f"the limit{where}, {limit:g}, lies above the drift ratio of collapse, {collapse:g}: every collapse "
                "passes it, and nothing else does"
            )


def _recorders_for(scene: Scene, demand: str) -> tuple[str, ...]:
    """Return the recorders that fill a demand, with that of drifts, which tell what is elastic."""
    table = RECORDERS[scene.structure.family]
    filled = {name: row for row, names in table.items() for name, variable in names.items() if variable.is_demand}
    drift = ("drift",) if "drift" in table else ()
    if drift:
        filled[DRIFT_RATIO] = "drift"
    one_of(f"demand of a {type(scene.structure).__name__}", demand, sorted(filled))
    return tuple({*drift, filled[demand]})


def _highest_of(pairs: Pairs, limit: np.ndarray, motions: int) -> float:
    """Return the highest level of a cloud, from the first structure's elastic response: more of them change nothing."""
    finite = limit[np.isfinite(limit)]
    needed = [pairs.collapse_level[:motions]] + ([pairs.elastic_level_of(finite[-1])[:motions]] if finite.size else [])
    known = np.concatenate(needed)
    known = known[np.isfinite(known)]
    return BEYOND_ELASTIC * float(known.max(initial=pairs.first_level / FIRST_SHARE))


def _refuse_failed(found: Found, run: Run) -> None:
    """Raise a ValueError if too many pairs failed, and warn of fewer."""
    failed = found.failed
    count = int(failed.sum())
    if not count:
        return
    first = int(failed.ravel().argmax())
    where = f"{count} of {failed.size} pairs of a structure and a motion failed, the first of them structure "
    where += f"{first // failed.shape[1]} under motion {first % failed.shape[1]}: {found.reasons()}"
    if count > LARGEST_EXCLUDED_FRACTION * failed.size:
        raise ValueError(
            f"{where}; at most {100 * LARGEST_EXCLUDED_FRACTION:g} % may. Take a smaller step or another method"
        )
    warn_caller(f"{where}; their capacities are NaN. A shorter step may hold")


def _warn_of_resurrections(result: xr.Dataset) -> None:
    """Warn of demands that are within a limit again at a higher level."""
    returned = result["resurrections"].values > 0
    if not returned.any():
        return
    shares = [
        f"{name} {100 * share:.1f} %"
        for name, share in zip(result["damage_state"].values, returned.mean(axis=(0, 1)), strict=True)
        if share
    ]
    warn_caller(
        "a demand is within its limit again at a higher level, so that the capacity is that of the first passage, in "
        f"these shares of the pairs: {', '.join(shares)}"
    )
