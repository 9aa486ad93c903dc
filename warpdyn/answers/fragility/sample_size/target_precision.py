"""Fragility curves of a given precision: structures are added to each motion until the intervals are narrow."""

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
    """Find the fragility curves of a scene with intervals of a given width, with few histories.

    Each motion gets one structure, whose capacities are bracketed (by `capacities`). If the intervals of all medians
    have the given width, that is the answer. Otherwise each motion gets a second structure; the variances of capacities
    among motions and among the structures of one motion then give the number of structures needed, which are added to
    the first two (an internal pilot: no history is only for planning). If that takes many histories, method and step
    are those of `plan`, and the rounds so far are discarded.

    Brackets are wider for less precision, at most 50 %: the curves are fitted to brackets, and the intervals include
    their uncertainty. Levels are as far apart, so a demand that passes a limit and returns between two levels is
    overlooked more often than by `capacities` with its default, 10 %. With 50 % none of 2,816 capacities of the
    README's first study is above its bracket from levels 3 % apart, and none of 1,760 of the same frame whose storeys
    deteriorate. A precision below 0.03 has the levels of `capacities`.

    Stopping once the interval is narrow favours samples with little scatter (optional stopping). The effect on coverage
    is small, because the records are fixed and only the number of structures is decided in this way: measured in
    docs/explanation/intervals.md. A GPU runs more histories, because its launches have free capacity.

    Often the number of records limits the precision, whatever the number of structures. Then structures are added only
    while they help, and a warning gives the number of records needed.

    Source: Wittes and Brittain (1990), "The role of internal pilot studies in increasing the efficiency of clinical
    trials", Statistics in Medicine 9.

    Args:
        scene: The scene; its excitation is a Cloud or Stripes of at least three motions, whose levels are not used.
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand]; only collapse
            passes `math.inf`.
        precision: Half the width of the interval of each median, relative [1]: 0.1 asks for medians to within 10 %.
        demand: Variable that limits are of, as in `capacities`.
        method: Integration method; None for the choice of `plan`, or for the default if `plan` would cost more.
        confidence: Probability that the intervals cover [1].
        seed: Seed of every random draw.
        device: "cpu" or "cuda:0"; None for the first GPU, or the CPU without a GPU.
        threads: CPU threads; None for every core this process may use.

    Returns:
        The dataset of `fragility_from_capacities`, with the reached `half_width(damage_state)` [1], `records_needed`
        for the precision with this number of structures per record, and attributes: structures_per_motion,
        bracket_width, method, dtype, longest_step (by `plan`), histories (of the answer), pilot_histories (discarded),
        bounded_by ("records" if they limit the precision, otherwise "structures").

    Raises:
        ValueError: If the intensity does not grow with the scale, there are fewer than three motions, the precision is
            not between 0.001 and 1, fewer than two motions reach a limit, or as in `capacities` and `plan`.
        TypeError: If `scene` is not a Scene, or its excitation is not a Cloud or Stripes.

    Example:
        >>> curves = wd.fragility_to(scene, {"slight": 0.005, "complete": 0.015}, precision=0.3)
        >>> bool((curves["half_width"] < 0.3).all())
        True
    """
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
    if isinstance(design, Stripes):
        design.check_scaled_to_all("fragility_to")
    given = [name for name, spread in scene.scatter.items() if isinstance(spread, GivenValues)]
    if given:
        raise ValueError(
            f"fragility_to() draws the structures that the precision needs, but scatter[{given[0]!r}] lists given "
            "ones: use capacities() and fragility_from_capacities()"
        )
    if isinstance(limits, Mapping) and any(isinstance(limit, Mapping) for limit in limits.values()):
        raise ValueError(
            "fragility_to() takes limits of one demand, given as demand=; for the worst of several use fragility() for "
            "a run on stripes"
        )
    motions = len(design.motions)
    if motions < 3:
        raise ValueError(f"an interval over records needs at least 3 motions, got {motions}")
    with each_warning_once():
        search = partial(capacities, limits=limits, demand=demand, device=device, threads=threads)
        return Rounds(scene, search, precision, confidence, seed, {"method": method}).run()
