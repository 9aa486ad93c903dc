"""Incremental dynamic analysis (IDA): the capacity of every structure under every motion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from warpdyn.campaigns.incremental.labels import Found, labelled_capacities
from warpdyn.campaigns.incremental.pairs import Pairs
from warpdyn.campaigns.incremental.search import Search
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.reductions.limits import DRIFT as DRIFT_RATIO, DamageLimits
from warpdyn.engine.device.running_time import seconds_in_kernels
from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.engine.kernels.queues import open_queues
from warpdyn.foundations.core.checks import check_memory, one_of, real_number, true_or_false, whole_number
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.output_variables import LARGEST_EXCLUDED_FRACTION
from warpdyn.foundations.core.progress import counted_histories
from warpdyn.model.ground_motions.designs import Cloud, Design, Stripes
from warpdyn.model.ground_motions.filtered_noise import FilteredNoise
from warpdyn.model.scene.arguments import takes_scene
from warpdyn.model.scene.number_of_structures import number_of_structures, with_default_design
from warpdyn.model.scene.plausibility import warn_of_implausible
from warpdyn.model.scene.scene import Scene, with_recorders
from warpdyn.model.structures.lumped.structure import LumpedStructure

PAIRS_AT_A_TIME = 2**16  # number of pairs of a structure and a motion that are searched at the same time
LARGEST_LIMIT = 1e9  # largest finite limit
LARGEST_LADDER = 10.0  # largest ratio of neighbouring levels
BYTES_OF_A_CAPACITY = 64  # memory of a pair's bracket, value, status and count while results are joined [bytes]
FIRST_SHARE = 1e-3  # level of the elastic run, divided by the median intensity of the unscaled motions
BEYOND_ELASTIC = 4.0  # highest level of a cloud, divided by the level at which the elastic response reaches the limits


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
    """Find the intensity at which every structure first exceeds each limit, under every motion (IDA).

    A pair is a structure under a motion. Each pair is run at increasing levels, up to the first level at which the
    demand exceeds the last limit. Each limit then has a bracket: the last level within the limit, and the first level
    that exceeds it. The bracket is narrowed to the tolerance by two levels on both sides of the point at which a power
    law through its ends reaches the limit. All pairs run at once, in about ten launches, and each history is used for
    all damage states. A limit is exceeded by a larger demand and by a collapse. Structures are those that `simulate`
    draws with the same seed. For a damage state that either of two demands causes, call the function for each demand
    and use the smaller capacity.

    At `capacity_lower` and all lower levels that were run, the demand is within the limit; at `capacity_upper` it
    exceeds the limit. A demand need not grow with the intensity: it may exceed a limit between two levels and return.
    If neighbouring levels indicate this (a peak or a shoulder near the limit), levels between them are run. Collapses
    at single levels are not indicated in this way; a smaller `ladder` detects more of them. This was checked against
    200 levels: in the README's first study, no capacity of 11,264 is above the first of these levels that exceeds the
    limit. In a frame with deteriorating storeys a few per thousand are above it (at collapse), and none with
    `ladder=1.03`. A warning gives the share of capacities above which the demand is within the limit again.

    Source: Vamvatsikos and Cornell (2002), "Incremental dynamic analysis", Earthquake Engineering and Structural
        Dynamics 31(3). The search for all pairs at once follows Vamvatsikos and Cornell (2004, hunt and fill,
        Earthquake Spectra 20(2)).

    Args:
        scene: The scene; its excitation is a Cloud or Stripes, whose motions are scaled and whose measure is the
            intensity. Recorders of the scene are ignored.
        limits: Limit of each damage state, from the lightest to the heaviest, in the units of the demand (storey drift
            ratio [1], floor acceleration [m/s2]). Only collapse exceeds a limit of `math.inf`.
        structures: Number of structures to draw; each runs under every motion. None: the number of
            `structures_per_motion`, if the design has it; 3 structures per motion for Stripes and random parameters;
            otherwise 1, with a warning if parameters are scattered. If each motion has its own structures, the
            dimension `structure` counts the structures of a motion, and `drawn_structure` is the index of the drawn
            structure. To compare motions on the same structures, give `structures`.
        demand: Name of a recorded variable, such as "peak_floor_acceleration"; the largest absolute value over storeys
            or floors counts.
        tolerance: Largest relative width of a bracket [1], capacity_upper / capacity_lower - 1.
        highest: Highest level [g, or SI units of a measure that is not an acceleration]; the capacity is infinite if
            the limit is not exceeded up to this level. None: the last level of Stripes; for a Cloud, four times the
            level at which the elastic response of its first structure exceeds the limits. `math.inf`: the rule for a
            Cloud, also for Stripes.
        ladder: Ratio of neighbouring levels [1], at most 10. Each pair has its own levels below the highest.
        reuse_elastic: Whether demands below the first yield are computed by scaling one elastic run, without a further
            run.
        keep_curves: Whether the dataset contains the demands at all levels that were run (IDA curves), with the
            dimension `sample`.
        added_storeys: Whether storeys of isolators or of a tuned mass damper, and the floors above them, count as
            storeys of the building. In both cases a collapse of such a storey exceeds every limit.
        seed: Seed of every random draw.
        method: Integration method, as in `simulate`.
        step: Integration step [s], as in `simulate`.
        longest_step: Upper bound of the chosen steps [s], as in `simulate`.
        dtype: "float32" or "float64", as in `simulate`.
        on_unstable: Action if the step is beyond a structure's stability limit, as in `simulate`.
        device: "cpu" or "cuda:0"; if several are given, the first is used. None: the first GPU, or the CPU if there is
            no GPU.
        threads: Number of CPU threads; None: every core that this process may use.

    Returns:
        Dataset with the dimensions `structure`, `motion` and `damage_state`. `capacity` is the geometric mean of the
        ends of its bracket, `capacity_lower` and `capacity_upper`. If the limit was not exceeded up to the highest
        level, `capacity` and `capacity_upper` are infinite (right-censored). `capacity_status` is found, above_highest,
        below_lowest or failed. `resurrections` is the number of levels above the capacity at which the demand is within
        the limit again; only levels up to the first that exceeds the last limit are counted. `keep_curves` adds
        `im_level`, the demand, `status`, `structure_index` and `motion_index` of each level that was run, with the
        dimension `sample`.

    Raises:
        ValueError: If an argument is out of its range, limits do not increase, the demand is not recorded, or more than
            1 % of the pairs failed.
        TypeError: If `scene` is not a Scene, its excitation is not a Cloud or Stripes, or `keep_curves` or
            `reuse_elastic` is not True or False.

    Example:
        >>> found = wd.capacities(scene, {"slight": 0.005, "complete": 0.015}, structures=2)
        >>> found["capacity"].median(["structure", "motion"]).round(1).values  # g
        array([0.5, 1.2])
    """
    scene = with_default_design(scene, structures)
    design = _design_of(scene)
    checked = _checked(limits, demand)
    names, limit = list(checked.states), checked.values[0]
    tolerance = real_number("tolerance", tolerance, above=0)
    if not 1e-5 <= tolerance < 1:
        raise ValueError(f"tolerance must be a relative width from 1e-5 to below 1, such as 0.02, got {tolerance:g}")
    if real_number("ladder", ladder, above=1) > LARGEST_LADDER:
        raise ValueError(
            f"ladder={ladder:g} would miss capacities: give a ladder= of at most {LARGEST_LADDER:g}, such as 1.1"
        )
    for name, choice in {"reuse_elastic": reuse_elastic, "keep_curves": keep_curves}.items():
        true_or_false(name, choice)
    integration = Integration(method=method, dtype=dtype, step=step, longest_step=longest_step, on_unstable=on_unstable)
    execution = Execution(device=device, threads=threads).on_first()
    finite = {f" of {name!r}": float(value) for name, value in zip(names, limit, strict=True) if value < np.inf}
    if demand == DRIFT_RATIO:
        _warn_of_limits_beyond_collapse(scene, finite)
    warn_of_implausible(scene, step=step, longest_step=longest_step)
    count = number_of_structures("capacities", scene, structures)
    check_memory(
        f"capacities() of structures={whole_number('structures', count, 1)} under {len(design.motions)} motions",
        BYTES_OF_A_CAPACITY * count * len(design.motions) * len(names),
        "take fewer structures: a few per motion determine a fragility curve",
    )
    counts_added = true_or_false("added_storeys", added_storeys)
    recorders = _recorders_for(scene, demand, added_storeys=counts_added)
    run = build_run(with_recorders(scene, recorders), count, integration, execution, seed)
    if np.isinf(limit[-1]) and not run.model.plan.collapses:
        raise ValueError(
            f"the limit of damage state {names[-1]!r} is infinite, so only collapse exceeds it, but the scene has no "
            "collapse criterion: give Scene(collapse_drift_ratio=...), or give the building a drift_capacity"
        )
    first = FIRST_SHARE * float(np.median(design.intensities))
    if isinstance(highest, float) and highest == np.inf:
        highest = None
    elif highest is not None:
        highest = real_number("highest", highest, above=first)
    elif isinstance(design, Stripes):
        highest = float(design.levels[-1])
    own = design.own_structures or run.structures
    findings = StabilityFindings(own * len(design.motions), run.integration.method)
    queue = open_queues(execution.devices, run.model.threads)[0]
    found = Found(names, limit, demand, tolerance, ladder, keep_curves)
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
    _refuse_failed(found)
    result = labelled_capacities(found, run, run.integration, float(highest or np.nan))
    result.attrs["seconds_in_kernels"] = seconds_in_kernels([queue])
    _warn_of_resurrections(result)
    return result


def _design_of(scene: Scene) -> Design:
    """Return the design of a scene (its motions and intensity measure); raise an error if it cannot be scaled."""
    design = scene.excitation
    if scene.structure.is_many:
        raise TypeError("capacities() needs a scene of one structure, got a Portfolio: give the scene of one archetype")
    if not isinstance(design, Cloud | Stripes):
        made = ", motions = [noise.motion(i, seed=1) for i in range(64)]" if isinstance(design, FilteredNoise) else ""
        raise TypeError(
            f"capacities() scales the motions of a Cloud or of Stripes, got {type(design).__name__}: give "
            f"Scene(building, Cloud(motions, measure)){made}"
        )
    if isinstance(design, Stripes):
        design.check_scaled_to_all("capacities")
    if design.measure.power == 0:
        raise ValueError(
            f"{design.measure.name} is not proportional to the scale factor of a motion: choose another intensity "
            "measure, such as SpectralAcceleration(period)"
        )
    bad = np.flatnonzero(~(design.intensities > 0))
    if bad.size:
        raise ValueError(f"motion {bad[0]} ({design.motions[bad[0]].name!r}) has an intensity of 0: remove this motion")
    return design


def _checked(limits: Mapping[str, float], demand: str) -> DamageLimits:
    """Return the checked limits of the damage states for one demand; raise an error if a limit is too large."""
    for name, value in limits.items() if isinstance(limits, Mapping) else ():
        if isinstance(value, Mapping):
            raise ValueError(
                f"the limit of damage state {name!r} is {dict(value)}; capacities() and levels_for() need limits of "
                "one demand, such as {'slight': 0.005}, and the name of its variable as demand="
            )
    checked = DamageLimits.of(limits, demand)
    for name, value in zip(checked.states, checked.values[0], strict=True):
        if LARGEST_LIMIT < value < np.inf:
            raise ValueError(f"limits: {name!r} is {value:g}; give at most {LARGEST_LIMIT:g}, or math.inf")
    return checked


def _warn_of_limits_beyond_collapse(scene: Scene, limits: Mapping[str, float]) -> None:
    """Warn of drift limits above the collapse drift ratio, at which histories end: only collapses exceed them.

    `limits` contains the drift limits by a text for the message, such as " of 'slight'".
    """
    collapse = scene.collapse_limit
    for where, limit in limits.items():
        if collapse is not None and limit > collapse:
            warn_caller(
                f"the limit{where}, {limit:g}, is above the drift ratio of collapse, {collapse:g}, so only collapses "
                "exceed it: choose a smaller limit or a larger Scene(collapse_drift_ratio=...)"
            )


def _recorders_for(scene: Scene, demand: str, *, added_storeys: bool) -> tuple[str, ...]:
    """Return the recorders that the search needs: of the demand, and of drifts, which show when a storey yields."""
    table = RECORDERS[scene.structure.family]
    demands = {name: (row, each) for row, names in table.items() for name, each in names.items() if each.is_demand}
    filled = {name: row for name, (row, each) in demands.items() if "period" not in each.dims}
    structure = scene.structure
    filled = {name: row for name, row in filled.items() if row not in structure.lacking}
    if "drift" in filled.values():
        filled[DRIFT_RATIO] = "drift"
    drift = ("drift",) if "drift" in filled.values() and not isinstance(structure, LumpedStructure) else ()
    if isinstance(structure, LumpedStructure) and demand not in filled:
        raise ValueError(
            f"capacities: {structure!r} has no demand {demand!r}: give demand=, such as "
            f"demand='peak_spring_deformation'; it has {', '.join(sorted(filled))}"
        )
    one_of(f"demand of a {type(structure).__name__}", demand, sorted(filled))
    if isinstance(structure, LumpedStructure):
        dims = table[filled[demand]][demand].dims if demand != DRIFT_RATIO else ("storey",)
        problem = structure.kinds.unit_problem(demand, dims[0], added_storeys=added_storeys) if dims else None
        if problem:
            raise ValueError(f"capacities: {problem}")
    return tuple({*drift, filled[demand]})


def _highest_of(pairs: Pairs, limit: np.ndarray, motions: int) -> float:
    """Return the highest level of a cloud: BEYOND_ELASTIC times the level of the first structure's elastic capacity."""
    finite = limit[np.isfinite(limit)]
    needed = [pairs.collapse_level[:motions]] + ([pairs.elastic_level_of(finite[-1])[:motions]] if finite.size else [])
    known = np.concatenate(needed)
    known = known[np.isfinite(known)]
    return BEYOND_ELASTIC * float(known.max(initial=pairs.first_level / FIRST_SHARE))


def _refuse_failed(found: Found) -> None:
    """Raise a ValueError if more than LARGEST_EXCLUDED_FRACTION of the pairs failed; warn if fewer failed."""
    failed = found.failed
    count = int(failed.sum())
    if not count:
        return
    first = int(failed.ravel().argmax())
    where = f"{count} of {failed.size} pairs of a structure and a motion failed, the first is structure "
    where += f"{first // failed.shape[1]} under motion {first % failed.shape[1]}: {found.reasons()}"
    if count > LARGEST_EXCLUDED_FRACTION * failed.size:
        raise ValueError(
            f"{where}; at most {100 * LARGEST_EXCLUDED_FRACTION:g} % may fail. Choose a smaller step= or another "
            "method="
        )
    warn_caller(f"{where}; their capacities are NaN. Choose a smaller step= or another method=")


def _warn_of_resurrections(result: xr.Dataset) -> None:
    """Warn if demands are within a limit again at a level above the capacity, with the share for each damage state."""
    returned = result["resurrections"].values > 0
    if not returned.any():
        return
    shares = [
        f"{name} {100 * share:.1f} %"
        for name, share in zip(result["damage_state"].values, returned.mean(axis=(0, 1)), strict=True)
        if share
    ]
    warn_caller(
        "the capacity is the first level that exceeds the limit, but the demand is within the limit again at a higher "
        f"level in these shares of the pairs: {', '.join(shares)}. A smaller ladder= may find earlier exceedances"
    )
