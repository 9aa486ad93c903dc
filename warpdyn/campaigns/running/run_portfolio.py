"""Runs of portfolios: an ordinary run for each group of buildings, and one dataset of all."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from itertools import chain

import numpy as np
import xarray as xr

from warpdyn.campaigns.integration.run import MOST_SAMPLES, build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.portfolio.groups import Group, checked_archetypes, groups_of, portfolio_of
from warpdyn.campaigns.portfolio.labels import Joined, common_attributes, largest_estimate
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.running.journal import FINGERPRINT, Journal, is_finished
from warpdyn.campaigns.running.run_scene import Kept, SceneRun, fingerprint_of_run, machines_of, plans_of
from warpdyn.engine.kernels.compilation import compiling
from warpdyn.engine.kernels.plan import Plan
from warpdyn.engine.kernels.queues import open_queues
from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.messages import collected_warnings, no_warnings, tell, warn_caller
from warpdyn.foundations.core.progress import counted_histories
from warpdyn.foundations.core.thread_pool import Ahead, result_of
from warpdyn.foundations.files.unfinished import Unfinished
from warpdyn.model.scene.portfolio import Portfolio
from warpdyn.model.scene.scene import Scene


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
    """Return what `simulate` returns of a portfolio; arguments as of `SceneRun`.

    Buildings with the same number of storeys, law and damping run together, whatever their archetypes. A building's
    step is that of its archetype in a run by itself, rounded down to 10 ms over a power of 2, so that its results do
    not depend on the rest of the portfolio. Only reruns of failed samples do, since they are limited over all buildings
    that run together: if many fail, other buildings decide which of them stay failed. With a target error a plan is
    made for each group.
    """
    started = time.perf_counter()
    seed = whole_number("seed", seed, 0)
    with ThreadPoolExecutor(1) as beside:  # a city has so many numbers that their digest takes a third of a second
        machines = machines_of(execution)
        fingerprinting = beside.submit(fingerprint_of_run, scene, structures, integration, machines, kept, seed)
        portfolio, groups = divided(scene, structures, integration, execution, kept, seed)
        digest = result_of(fingerprinting)
    samples_per_building = scene.excitation.samples_per_structure
    attributes = {"scene": scene.to_json(), "title": scene.title, "seed": seed, FINGERPRINT: digest}
    if unfinished is not None:
        Journal(unfinished, digest, kept.overwrite)
    seconds = time.perf_counter() - started

    with ExitStack() as stack, counted_histories(portfolio.buildings * samples_per_building):
        plans = [list(plans_of_group(group, integration, execution, kept, seed)) for group in groups]
        wait_for: Callable[[list[Plan]], object] = stack.enter_context(
            compiling(chain(*plans), execution.devices[0], execution.cores)
        )
        # Memory is bounded group by group: groups then share nothing, and none begins before its turn.
        is_bounded = execution.memory is not None
        queues = None if is_bounded else open_queues(execution.devices, execution.cores)

        def begin(group: Group, place: Unfinished | None = None, own_digest: str = digest) -> SceneRun:
            own = None if reduced is None else (reduced[0], reduced[1][group.buildings])
            what = group.scene, group.buildings.size, how_of(group, integration), execution, kept, seed
            return SceneRun(*what, place, own, own_digest, queues)

        runs = []
        if unfinished is None:
            # A group begins while the one before it runs, unless a pilot would run beside it, whose times count.
            is_ahead = integration.target_error is None and not is_bounded
            upcoming = _GroupRuns(begin, groups, is_ahead=is_ahead)
            stack.callback(upcoming.close)
            for own_plans, group in zip(plans, groups, strict=True):
                wait_for(own_plans)
                with group.named_in_messages():
                    runs.append(upcoming.next().finish())
        else:
            for number, group in enumerate(groups):
                wait_for(plans[number])
                own_digest = _digest_of(group, integration, execution, kept, seed)
                run = _finished(unfinished, number, own_digest)
                if run is None:
                    of_group = Unfinished(unfinished.kept / f"{number}.nc", is_group=True)
                    with group.named_in_messages(), of_group as place:
                        run = begin(group, place, own_digest).finish()
                stack.callback(run.close)
                runs.append(run)
        if reduced is not None:
            return largest_estimate(runs).assign_attrs(attributes | common_attributes(runs, seconds))
        joined = Joined(
            portfolio, [group.buildings for group in groups], runs, samples_per_building, attributes, seconds
        )
        return joined.in_memory() if unfinished is None else joined.in_file(unfinished)


class _GroupRuns:
    """The runs of groups, each of which begins while the one before it runs.

    Args:
        begin: Begins the run of a group.
        groups: The groups.
        is_ahead: Whether they begin ahead; otherwise each begins when it is asked for.
    """

    def __init__(self, begin: Callable[[Group], SceneRun], groups: list[Group], *, is_ahead: bool) -> None:
        self._begin_run, self._begun = begin, list[SceneRun]()
        self._upcoming = Ahead(self._begin, groups, int(is_ahead))

    def _begin(self, group: Group) -> tuple[Future[SceneRun], list[tuple[str, type[Warning]]]]:
        """Begin the run of a group; its warnings are returned beside an error, too."""
        result: Future[SceneRun] = Future()
        with collected_warnings() as found:  # the caller's line is not known in this thread
            try:
                run = self._begin_run(group)
                self._begun.append(run)
                result.set_result(run)
            except BaseException as error:
                result.set_exception(error)
        return result, found

    def next(self) -> SceneRun:
        """Return the run of the next group, and give the warnings of its beginning."""
        result, warnings = next(self._upcoming)
        for message, category in warnings:
            warn_caller(message, category)
        run = result.result()
        self._begun.remove(run)  # which closes itself, and whose samples are let go of when they are joined
        return run

    def close(self) -> None:
        """Begin no more, and prepare nothing more of those that have begun."""
        self._upcoming.close()
        for run in self._begun:
            run.close()


def divided(
    scene: Scene, structures: int, integration: Integration, execution: Execution, kept: Kept, seed: int
) -> tuple[Portfolio, list[Group]]:
    """Return a scene's portfolio and its groups, after all checks that concern no group; arguments as of `SceneRun`."""
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
    with no_warnings():  # the runs give them
        # Settings are checked before anything is drawn, since their errors concern no archetype.
        build_run(replace(scene, structure=first), portfolio.buildings, integration, execution, seed)
    return portfolio, groups_of(portfolio, archetypes, integration, seed)


def how_of(group: Group, integration: Integration) -> Integration:
    """Return how a group is integrated."""
    return integration if group.longest_step is None else replace(integration, longest_step=group.longest_step)


def _digest_of(group: Group, integration: Integration, execution: Execution, kept: Kept, seed: int) -> str:
    """Return the fingerprint of a group's run; arguments as of `SceneRun`."""
    machines = machines_of(execution)
    return fingerprint_of_run(group.scene, group.buildings.size, how_of(group, integration), machines, kept, seed)


def _finished(unfinished: Unfinished, number: int, digest: str) -> xr.Dataset | None:
    """Return the dataset of a group that an earlier run has finished, and say so; None if there is none."""
    path = unfinished.kept / f"{number}.nc"
    if not is_finished(path, digest):
        return None
    tell(f"{unfinished.path}: group {number + 1} has been finished by an earlier run")
    return xr.open_dataset(path, engine="netcdf4")


def plans_of_group(
    group: Group, integration: Integration, execution: Execution, kept: Kept, seed: int
) -> Iterator[Plan]:
    """Yield the plans of a group's kernel and of that for its error estimates; none if the method is to be chosen."""
    if integration.target_error is not None:
        return
    with group.named_in_messages(), no_warnings():  # the group's run gives them
        run = build_run(group.scene, group.buildings.size, how_of(group, integration), execution, seed)
    yield from plans_of(run, kept)
