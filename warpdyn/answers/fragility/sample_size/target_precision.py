"""Fragility curves with a given precision: structures are added to motions until the intervals are narrow enough."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import xarray as xr

from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.fragility.sample_size.rounds import Rounds
from warpdyn.campaigns.incremental.capacities import capacities
from warpdyn.campaigns.reductions.limits import DRIFT
from warpdyn.foundations.core.checks import real_number, whole_number
from warpdyn.foundations.core.messages import each_warning_once
from warpdyn.model.ground_motions.designs import Cloud, Stripes
from warpdyn.model.scene.arguments import takes_scene
from warpdyn.model.scene.scatter import GivenValues
from warpdyn.model.scene.scene import Scene


@takes_scene
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
    """Find the fragility curves of a scene so that the intervals of the medians have a given width, with few histories.

    First each motion gets one structure, and `capacities` brackets its capacities. If the intervals of all medians are
    narrow enough, this is the result. Otherwise each motion gets a second structure. The variances of capacities among
    motions and among the structures of one motion then give the number of structures that is needed. These are added to
    the first two (internal pilot: all histories are part of the result). If many histories are needed, `plan` chooses
    method and step, and the rounds so far are discarded.

    The lower the required precision, the wider the brackets, at most 50 %. The curves are fitted to brackets, and the
    intervals include their uncertainty. Neighbouring levels have the same ratio as the ends of a bracket, so a demand
    that exceeds a limit only between two levels is overlooked more often than by `capacities` with its default of 10 %.
    This was checked with levels 3 % apart: with brackets of 50 %, none of 2,816 capacities of the README's first study
    and none of 1,760 capacities of the same frame with deteriorating storeys was overlooked. If `precision` is below
    0.03, the levels are as close as the default levels of `capacities`.

    Ending as soon as the interval is narrow favours samples with little scatter (optional stopping). The effect on
    coverage is small, because the records are fixed and only the number of structures is chosen in this way (measured
    in docs/explanation/intervals.md). On a GPU more histories are run, because its launches have free capacity.

    Often the number of records limits the precision, whatever the number of structures. Then structures are added only
    as long as they help, and a warning gives the number of records that would be needed.

    Source: Wittes and Brittain (1990), "The role of internal pilot studies in increasing the efficiency of clinical
    trials", Statistics in Medicine 9.

    Args:
        scene: The scene; its excitation is a Cloud or Stripes with at least three motions (the levels of Stripes are
            ignored).
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand]; only collapse
            exceeds `math.inf`.
        precision: Half the relative width of the interval of each median [1]: 0.1 means plus or minus 10 %.
        demand: Name of the demand that is compared with the limits, as in `capacities`.
        method: Integration method. None: the choice of `plan`, or the default method if `plan` would cost more.
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of every random draw.
        device: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is no GPU.
        threads: Number of CPU threads; None: every core that this process may use.

    Returns:
        The dataset of `fragility_from_capacities` with two more variables: `half_width(damage_state)` [1], the reached
        precision, and `records_needed(damage_state)`, the number of records that the precision needs with this number
        of structures per record. Attributes: structures_per_motion, bracket_width, method, dtype, longest_step (if
        chosen by `plan`), histories (number in the result), pilot_histories (number of discarded histories) and
        bounded_by ("records" if they limit the precision, otherwise "structures").

    Raises:
        ValueError: If the intensity is not proportional to the scale factor, there are fewer than three motions, the
            precision is not from 0.001 to below 1, fewer than two motions exceed a limit, or for the reasons in
            `capacities` and `plan`.
        TypeError: If `scene` is not a Scene, or its excitation is not a Cloud or Stripes.

    Example:
        >>> curves = wd.fragility_to(scene, {"slight": 0.005, "complete": 0.015}, precision=0.3)
        >>> bool((curves["half_width"] < 0.3).all())
        True
    """
    precision = real_number("precision", precision, above=0)
    if not 1e-3 <= precision < 1:
        raise ValueError(
            f"precision is half the relative width of an interval; it must be from 0.001 to below 1, got {precision:g}"
        )
    check_confidence(confidence)
    seed = whole_number("seed", seed, 0)
    design = scene.excitation
    if not isinstance(design, Cloud | Stripes) or scene.structure.is_many:
        raise TypeError(
            "fragility_to() takes a scene of one structure under a Cloud or Stripes of motions, got a "
            f"{type(scene.structure).__name__} under {type(design).__name__}: give Scene(building, Cloud(motions, "
            "measure))"
        )
    if isinstance(design, Stripes):
        design.check_scaled_to_all("fragility_to")
    given = [name for name, spread in scene.scatter.items() if isinstance(spread, GivenValues)]
    if given:
        raise ValueError(
            f"fragility_to() chooses the number of structures, but scatter[{given[0]!r}] lists the values of given "
            "structures: use capacities() and fragility_from_capacities(), or give a random factor"
        )
    if isinstance(limits, Mapping) and any(isinstance(limit, Mapping) for limit in limits.values()):
        raise ValueError(
            "fragility_to() needs limits of one demand, named by demand=; for limits of several demands use "
            "fragility() for a run on stripes"
        )
    motions = len(design.motions)
    if motions < 3:
        raise ValueError(f"an interval over records needs at least 3 motions, got {motions}: add motions to the scene")
    with each_warning_once():
        search = partial(capacities, limits=limits, demand=demand, device=device, threads=threads)
        return Rounds(scene, search, precision, confidence, seed, {"method": method}).run()
