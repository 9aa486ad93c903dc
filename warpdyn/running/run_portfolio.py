"""Runs of portfolios: an ordinary run for each group of buildings, and one dataset of all."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import replace
from itertools import chain

import numpy as np
import xarray as xr

from warpdyn.core.checks import whole_number
from warpdyn.core.messages import tell
from warpdyn.core.progress import counted_histories
from warpdyn.files.unfinished import Unfinished
from warpdyn.integration.run import MOST_SAMPLES, build_run
from warpdyn.integration.settings import Execution, Integration
from warpdyn.kernels.compilation import compiling
from warpdyn.kernels.plan import Plan
from warpdyn.portfolio.groups import Group, checked_archetypes, groups_of, portfolio_of
from warpdyn.portfolio.labels import Joined, common_attributes, largest_estimate
from warpdyn.reduction.reduction import Reduction
from warpdyn.running.journal import FINGERPRINT, Journal
from warpdyn.running.run_scene import Kept, fingerprint_of_run, machines_of, plans_of, run_scene
from warpdyn.scene.portfolio import Portfolio
from warpdyn.scene.scene import Scene


def run_portfolio(
    scene: Scene,
    structures: int,
    integration: Integration,
    execution: Execution,
    kept: Kept,
    seed: int,
    unfinished: Unfinished | None,
    reduced: tuple[Reduction, np.ndarray] | None = None,
) -> xr.Dataset:
    """Return what `simulate` returns of a portfolio; arguments as of `run_scene`.

    Buildings with the same number of storeys, law and damping run together, whatever their archetypes. A building's
    step is that of its archetype in a run by itself, rounded down to 10 ms over a power of 2, so that its results do
    not depend on the rest of the portfolio. Only reruns of failed samples do, since they are limited over all buildings
    that run together: if many fail, other buildings decide which of them stay failed. With a target error a plan is
    made for each group.
    """
    started = time.perf_counter()
    seed = whole_number("seed", seed, 0)
    portfolio, groups = divided(scene, structures, integration, execution, kept, seed)
    samples_per_building = scene.excitation.samples_per_structure
    digest = fingerprint_of_run(scene, structures, integration, machines_of(execution), kept, seed)
    attributes = {"scene": scene.to_json(), "title": scene.title, "seed": seed, FINGERPRINT: digest}
    if unfinished is not None:
        Journal(unfinished, digest, kept.overwrite)
    seconds = time.perf_counter() - started

    with ExitStack() as stack, counted_histories(portfolio.buildings * samples_per_building):
        plans = [list(plans_of_group(group, integration, execution, kept, seed)) for group in groups]
        wait_for: Callable[[list[Plan]], object] = stack.enter_context(
            compiling(chain(*plans), execution.devices[0], execution.cores)
        )
        runs = []
        for number, group in enumerate(groups):
            wait_for(plans[number])
            arguments = group.scene, group.buildings.size, how_of(group, integration), execution, kept, seed
            own_digest = digest if unfinished is None else _digest_of(*arguments)
            finished = _finished(unfinished, number, own_digest)
            with group.named_in_messages(), _place(unfinished, number) as place:
                own = None if reduced is None else (reduced[0], reduced[1][group.buildings])
                run = run_scene(*arguments, place, own, own_digest) if finished is None else finished
            if unfinished is not None:
                stack.callback(run.close)
            runs.append(run)
        if reduced is not None:
            return largest_estimate(runs).assign_attrs(attributes | common_attributes(runs, seconds))
        joined = Joined(
            portfolio, [group.buildings for group in groups], runs, samples_per_building, attributes, seconds
        )
        return joined.in_memory() if unfinished is None else joined.in_file(unfinished)


def divided(
    scene: Scene, structures: int, integration: Integration, execution: Execution, kept: Kept, seed: int
) -> tuple[Portfolio, list[Group]]:
    """Return a scene's portfolio and its groups, after all checks that concern no group; arguments as `run_scene`."""
    portfolio, excitation = portfolio_of(scene), scene.excitation
    if structures != 1:
        raise ValueError("structures= does not apply to a portfolio: leave it out, and give each Archetype its `count`")
    if kept.histories is not None:
        raise ValueError("histories of a portfolio are not kept: keep them in a run of the archetype by itself")
    if portfolio.buildings * excitation.samples_per_structure > MOST_SAMPLES:
        raise ValueError(f"{portfolio!r} has more than {MOST_SAMPLES} samples: divide it into several")
    excitation.check_structures(portfolio.buildings)
    archetypes = checked_archetypes(scene, integration.method)
    first = next(iter(portfolio.archetypes.values())).building
    with warnings.catch_warnings():  # the runs give the warnings
        warnings.simplefilter("ignore")
        # Settings are checked before anything is drawn, since their errors concern no archetype.
        build_run(replace(scene, structure=first), portfolio.buildings, integration, execution, seed)
    return portfolio, groups_of(portfolio, archetypes, integration, seed)


def how_of(group: Group, integration: Integration) -> Integration:
    """Return how a group is integrated."""
    return integration if group.longest_step is None else replace(integration, longest_step=group.longest_step)


def _digest_of(
    scene: Scene, structures: int, integration: Integration, execution: Execution, kept: Kept, seed: int
) -> str:
    """Return the fingerprint of a group's run; arguments as of `run_scene`."""
    return fingerprint_of_run(scene, structures, integration, machines_of(execution), kept, seed)


def _finished(unfinished: Unfinished | None, number: int, digest: str) -> xr.Dataset | None:
    """Return the dataset of a group that an earlier run has finished, and say so; None if there is none."""
    path = None if unfinished is None else unfinished.kept / f"{number}.nc"
    if unfinished is None or path is None or not path.exists():
        return None
    run = xr.open_dataset(path, engine="netcdf4")
    if run.attrs.get(FINGERPRINT) == digest:
        tell(f"{unfinished.path}: group {number + 1} has been finished by an earlier run")
        return run
    run.close()
    return None


def _place(unfinished: Unfinished | None, number: int) -> AbstractContextManager[Unfinished | None]:
    """Return where the file of a group is written."""
    if unfinished is None:
        return nullcontext()
    return Unfinished(unfinished.kept / f"{number}.nc")


def plans_of_group(
    group: Group, integration: Integration, execution: Execution, kept: Kept, seed: int
) -> Iterator[Plan]:
    """Yield the plans of a group's kernel and of that for its error estimates; none if the method is to be chosen."""
    if integration.target_error is not None:
        return
    with group.named_in_messages(), warnings.catch_warnings():  # the group's run gives them
        warnings.simplefilter("ignore")
        run = build_run(group.scene, group.buildings.size, how_of(group, integration), execution, seed)
    yield from plans_of(run, kept)
