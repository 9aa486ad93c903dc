"""Fragility curves of a stated precision: each motion gets structures of its own until the intervals are narrow."""

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
    """Find the fragility curves of a scene with intervals of a stated width, by as few histories as that takes.

    Every motion gets one structure of its own, whose capacities are bracketed (by `capacities`). Where the intervals of
    all medians are as narrow as asked for, that is the answer. Else every motion gets a second structure; how much
    capacities vary among motions and among the structures of one motion then tells how many more it takes, and these
    are added to the first two (an internal pilot: no history is run to plan alone). Where that takes many histories,
    the method and the step are those of `plan`, and the answer is run anew by these.

    Brackets are wider the less precision is asked for, at most 50 %: the curves are fitted to brackets, and the
    intervals hold what they leave open. The ladder of levels is then as coarse, so that a demand that passes a limit
    and returns between two of its rungs is more often overlooked than by `capacities` as it stands, with rungs 10 %
    apart. With rungs 50 % apart none of 2,816 capacities of the README's first study comes out above its bracket by
    rungs 3 % apart, and none of 1,760 of the same frame whose storeys deteriorate. A precision below .03 has the rungs
    of `capacities`.

    To stop once the interval is narrow favours samples that happen to vary little. Coverage hardly suffers, because the
    records stay the same and only the number of structures is decided so: docs/explanation/intervals.md has it
    measured. On a GPU more histories are run, those that launches have room for.

    Often the records decide, and no number of structures reaches the precision: then structures stop where they add
    next to nothing, and a warning says so and how many records it would take.

    Source: Wittes and Brittain (1990), "The role of internal pilot studies in increasing the efficiency of clinical
    trials", Statistics in Medicine 9.

    Args:
        scene: The scene; its excitation is a Cloud or Stripes of at least three motions, whose levels are not needed.
        limits: Limit of each damage state, from the lightest on [units of the demand]; `math.inf` is passed by
            collapse alone.
        precision: Half the width of the interval of each median, relative [1]: 0.1 asks for medians to within 10 %.
        demand: Variable that limits are of, as of `capacities`.
        method: Integration method; None to let `plan` choose, or for the default where `plan` would cost more.
        confidence: Probability that the intervals cover [1].
        seed: Seed of every random draw.
        device: "cpu" or "cuda:0"; None for the first GPU, or the CPU where there is none.
        threads: CPU threads; None for every core this process may use.

    Returns:
        What `fragility_from_capacities` returns, with `half_width(damage_state)` reached [1], `records_needed` for the
        precision with as many structures of each, and attributes of what was chosen and spent: structures_per_motion,
        bracket_width, method, dtype, longest_step (by `plan`), histories (of the answer), pilot_histories (those that
        the answer does not hold), bounded_by ("records" where they keep it from the precision, else "structures").

    Raises:
        ValueError: If the intensity does not grow with the scale, there are fewer than three motions, the precision is
            not between 0.001 and 1, fewer than two motions reach a limit, or as `capacities` and `plan`.
        TypeError: If the scene is none, or its excitation is no Cloud or Stripes.

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
    with each_warning_once():
        search = partial(capacities, limits=limits, demand=demand, device=device, threads=threads)
        return Rounds(scene, search, precision, confidence, seed, {"method": method}).run()
