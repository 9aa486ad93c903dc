"""The run of a portfolio: a few ordinary runs, one a group of buildings, and one dataset of all."""

from __future__ import annotations

import inspect
import json
import os
import tempfile
import time
import warnings
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import xarray as xr

from warpdyn.core.checks import check_kind, whole_number
from warpdyn.core.netcdf import check_writable
from warpdyn.core.progress import counted_histories
from warpdyn.ground_motions.designs import Cloud, OneMotionPerStructure, Stripes
from warpdyn.ground_motions.motions import GroundMotion
from warpdyn.integration.run import MOST_SAMPLES, build_run
from warpdyn.portfolio.groups import check_method, groups_of, scenes_of
from warpdyn.portfolio.labels import Joined
from warpdyn.portfolio.portfolio import Portfolio
from warpdyn.running.simulate import check_settings, simulate
from warpdyn.scene.scene import Scene

STEPPING = ("step", "longest_step", "target_error")  # settings with which the caller sees to the step
NOT_TAKEN = {
    "structures": "an archetype's `count` says how many buildings there are",
    "histories": "keep them in a run of the archetype by itself",
}
# What `simulate` takes beside what has a name of its own here.
SETTINGS = set(inspect.signature(simulate).parameters) - {"scene", "method", "seed", "path", *NOT_TAKEN}
OF_THE_RUN = ("step", "longest_step", "resample", "dtype", "tolerance", "device", "threads")


def simulate_portfolio(
    portfolio: Portfolio,
    excitation: Stripes | Cloud | OneMotionPerStructure | GroundMotion,
    *,
    recorders: tuple[str, ...] | None = None,
    collapse_drift_ratio: float | None = None,
    tail: float | None = None,
    title: str = "warpdyn portfolio",
    method: str | None = None,
    seed: int = 0,
    path: str | os.PathLike | None = None,
    **settings: object,
) -> xr.Dataset:
    """Integrate every building of a portfolio under its motions and return one dataset of all.

    Buildings of as many storeys, one law and one damping run together, whatever their archetypes. A building's step is
    that of its archetype in a run by itself, rounded down to 10 ms over a power of 2, so that nothing else in the
    portfolio changes a bit of what becomes of it; but how often samples that fail are run again at shorter steps is
    counted over all buildings that run together, so that where many fail, other buildings decide which of them stay
    failed. With `target_error` a plan is made for each group.

    Args:
        portfolio: The buildings.
        excitation: Stripes or Cloud, for every building; or OneMotionPerStructure, with a motion and a scale for each
            building.
        recorders, collapse_drift_ratio, tail, title: As a Scene takes them.
        method, seed, path: As `simulate` takes them. Beside `path` as much room again is needed while it is written.
        **settings: What else `simulate` takes, but `structures` and `histories`.

    Returns:
        What `simulate` returns, in the order of the buildings, storeys and floors above a building's own NaN; of every
        sample the coordinates `building` and `archetype_index`, which counts along `archetype`. Inputs are all
        parameters of the buildings. `estimated_relative_error` is the largest of the groups.

    Raises:
        ValueError, TypeError: If an argument is not valid; the message names archetypes where it is about theirs.
        OSError: If the file cannot be written.
    """
    started = time.perf_counter()
    check_kind("simulate_portfolio", "a Portfolio", portfolio, Portfolio)
    seed = whole_number("seed", seed, 0)
    for name, reason in NOT_TAKEN.items():
        if name in settings:
            raise TypeError(f"simulate_portfolio() takes no {name}: {reason}")
    unknown = sorted(settings.keys() - SETTINGS)
    if unknown:
        raise TypeError(f"simulate_portfolio() takes no setting {unknown[0]!r}; it takes {', '.join(sorted(SETTINGS))}")
    if isinstance(excitation, GroundMotion):
        excitation = Cloud((excitation,))
    if not isinstance(excitation, Stripes | Cloud | OneMotionPerStructure):
        kind = type(excitation).__name__
        raise TypeError(f"the excitation of a portfolio must be Stripes, Cloud or OneMotionPerStructure, got {kind}")
    samples_per_building = excitation.samples_per_structure
    if portfolio.buildings * samples_per_building > MOST_SAMPLES:
        raise ValueError(f"{portfolio!r} has more than {MOST_SAMPLES} samples: divide it into several")
    if isinstance(excitation, OneMotionPerStructure):
        excitation.check_structures(portfolio.buildings)
        # What is drawn of a building goes by its number in the portfolio, not in its group.
        assigned = excitation.assign(np.arange(portfolio.buildings), seed)
        excitation = OneMotionPerStructure(excitation.motions, assigned.motion, assigned.scale, excitation.measure)
    first = next(iter(portfolio.archetypes.values())).building
    common = Scene(first, excitation, {}, {}, "monte_carlo", recorders, collapse_drift_ratio, tail, title)
    scenes = scenes_of(portfolio, common)
    check_method(scenes, method or "rk4")
    _check_settings(common, portfolio.buildings, method or "rk4", seed, settings)
    if path is not None:
        path = check_writable(path)
    is_stepped = any(settings.get(name) is not None for name in STEPPING)
    groups = groups_of(portfolio, scenes, method or "rk4", seed, is_stepped=is_stepped)
    attributes = {"scene": _as_json(portfolio, scenes), "title": title, "seed": seed}
    seconds = time.perf_counter() - started

    with ExitStack() as stack, counted_histories(portfolio.buildings * samples_per_building):
        folder = None
        if path is not None:
            own = tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.")
            folder = Path(stack.enter_context(own))
        runs = []
        for number, group in enumerate(groups):
            if group.longest_step is not None:
                settings["longest_step"] = group.longest_step
            own = None if folder is None else folder / f"{number}.nc"
            with group.named_in_messages():
                run = simulate(
                    group.scene, structures=group.buildings.size, method=method, seed=seed, path=own, **settings
                )
            if folder is not None:
                stack.callback(run.close)
            runs.append(run)
        joined = Joined(
            portfolio, [group.buildings for group in groups], runs, samples_per_building, attributes, seconds
        )
        return joined.in_memory() if path is None else joined.in_file(path)


def _check_settings(common: Scene, buildings: int, method: str, seed: int, settings: dict[str, object]) -> None:
    """Raise an error if a setting is wrong, before anything is drawn: it is about no archetype."""
    beside_target_error = tuple(settings.get(name) for name in ("step", "longest_step", "tolerance"))
    named = ("on_unstable", "checked_share", "resample", "keep_inputs", "memory", "target_error")
    check_settings(
        **{name: settings[name] for name in named if name in settings}, beside_target_error=beside_target_error
    )
    given = {name: settings[name] for name in OF_THE_RUN if settings.get(name) is not None}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # which come with the runs
        build_run(common, structures=buildings, method=method, seed=seed, **({"dtype": "float32"} | given))


def _as_json(portfolio: Portfolio, scenes: dict[str, Scene]) -> str:
    """Return the archetypes, and what they have in common, as JSON."""
    archetypes, rest = {}, {}
    for (name, scene), count in zip(scenes.items(), portfolio.counts, strict=True):
        rest = json.loads(scene.to_json())
        own = {key: rest.pop(key) for key in ("structure", "scatter", "correlation")}
        archetypes[name] = {"count": int(count), **own}
    return json.dumps({"archetypes": archetypes, **rest}, separators=(",", ":"))
