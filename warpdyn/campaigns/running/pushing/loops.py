"""Loops of storeys along given drifts: hysteresis of one building or of many parameter sets."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import warp as wp

from warpdyn.engine.kernels.auxiliary.storey_path import storey_path_kernel
from warpdyn.engine.kernels.kernel_cache import initialise, loaded
from warpdyn.foundations.core.messages import amount_of
from warpdyn.model.scene.scatter import GivenValues, Scatter, check_scatter
from warpdyn.model.structures.physics import physics_problem
from warpdyn.model.structures.shear_building import ShearBuilding

# Longest step of a law with a rate [yield drifts], and most such steps of a path of drifts.
LONGEST_STEP, MOST_STEPS = 0.25, 10_000_000
DRIFTS_AT_A_TIME = 2**22  # of all storeys of a launch, so that its arrays take little memory


def given_sets(function: str, building: ShearBuilding, scatter: Scatter) -> dict[str, np.ndarray]:
    """Return the parameter sets of a scatter of given values, {name: values [structure, storey]}, after checks.

    Raises:
        TypeError: If a scatter is random.
        ValueError: If the numbers of structures differ, or a value is out of its bounds or contradicts another value.
    """
    check_scatter(building, scatter)
    if not scatter:
        raise ValueError(f"{function}: scatter is empty: give wd.GivenValues of a parameter, or remove scatter=")
    values: dict[str, np.ndarray] = {}
    for name, spread in scatter.items():
        if not isinstance(spread, GivenValues):
            raise TypeError(
                f"{function}: the scatter of {name} is random ({spread!r}): give the parameter sets as "
                "wd.GivenValues(...)"
            )
        nominal = building.parameters[name]
        if not nominal.ndim:
            raise ValueError(f"{function}: {name} has no effect on the force of a storey: remove it from scatter=")
        given = np.broadcast_to(spread.in_structures(nominal).T, (nominal.size, len(spread.values))).T
        if spread.values.ndim == 1 and given.shape != (len(spread.values), nominal.size):
            given = np.repeat(spread.values[:, None], nominal.size, axis=1)
        problem = building.parameter_table[name].first_violation(f"the given {name}", given, ("structure", "storey"))
        if problem:
            raise ValueError(f"{function}: {problem}")
        values[name] = given
    counts = {name: len(each) for name, each in values.items()}
    if len(set(counts.values())) > 1:
        listed = ", ".join(f"{name} {amount_of(count, 'structure')}" for name, count in counts.items())
        raise ValueError(f"{function}: the scatters have different numbers of structures: {listed}")
    everything = {**building.parameters, **values}
    if problem := building.problem(everything) or physics_problem(everything):
        raise ValueError(f"{function}: {problem}")
    return values


def loops_along(
    building: ShearBuilding, parameters: Mapping[str, np.ndarray], path: np.ndarray, count: int = 1
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces [N] and dissipated energies [J] of storeys, each of shape [structure, step, storey].

    Args:
        building: The building, whose laws the storeys have.
        parameters: Parameters, each of shape [storey] or [structure, storey].
        path: Drifts of the storeys [m], shape [step, storey].
        count: Number of structures.
    """
    initialise()  # before Warp starts with the first array
    storeys = building.storeys
    force, dissipated = (np.full((count, len(path), storeys), np.nan) for _ in range(2))
    variants = building.storey_law.variants({name: np.atleast_2d(each) for name, each in parameters.items()})
    rules = building.storey_law.rules({name: np.atleast_2d(each) for name, each in parameters.items()})
    kernel = loaded(storey_path_kernel(rules, "float64"))
    has_rate = building.storey_law.forces().has_rate and "yield_force" in parameters
    at_a_time = max(1, DRIFTS_AT_A_TIME // path.size)
    for first in range(0, count, at_a_time):
        rows = slice(first, min(first + at_a_time, count))
        size = rows.stop - first
        own = {
            name: each[rows] if np.ndim(each) == 2 else np.atleast_1d(each)[None] for name, each in parameters.items()
        }
        own = {name: np.broadcast_to(each, (size, each.shape[1])) for name, each in own.items()}
        coefficients = np.stack(np.broadcast_arrays(*building.storey_law.coefficients(own, variants)))
        drifts, steps = np.tile(path, (1, size)), np.arange(len(path))
        if has_rate:
            drifts, steps = divided(path, own["yield_force"] / own["stiffness"])
            drifts = np.tile(drifts, (1, size))
        given = coefficients.reshape(len(coefficients), size * storeys), drifts
        arrays: list[wp.array] = [wp.array(np.ascontiguousarray(each, np.float64), device="cpu") for each in given]
        results = [wp.full(drifts.shape, np.nan, dtype=wp.float64, device="cpu") for _ in range(2)]
        wp.launch(kernel, dim=size * storeys, inputs=arrays, outputs=results, device="cpu")
        for into, result in zip((force, dissipated), results, strict=True):
            into[rows] = result.numpy()[steps].reshape(len(path), size, storeys).transpose(1, 0, 2)
    return force, dissipated


def divided(path: np.ndarray, yield_drift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a path with steps of at most LONGEST_STEP yield drifts, and the places of the given drifts in it.

    Args:
        path: Storey drifts [m], shape [step, storey]; the path starts from 0.
        yield_drift: Yield drift of each storey [m], shape [structure, storey]; NaN in storeys whose law has none.

    Raises:
        ValueError: If the path has more than MOST_STEPS such steps.
    """
    least = np.min(np.where(np.isnan(yield_drift), np.inf, yield_drift), axis=0)
    moved = np.abs(np.diff(path, axis=0, prepend=0.0)) / least
    parts = np.maximum(1, np.ceil(np.nan_to_num(moved).max(axis=1) / LONGEST_STEP))
    if parts.sum() > MOST_STEPS:
        raise ValueError(
            f"drift: the path has {parts.sum() * LONGEST_STEP:.3g} yield drifts, more than "
            f"{MOST_STEPS * LONGEST_STEP:,.0f}: give drifts in m, or a shorter path"
        )
    steps = np.cumsum(parts.astype(int)) - 1
    before = np.vstack([np.zeros((1, path.shape[1])), path])
    at = np.arange(int(parts.sum())) + 1.0
    known = np.concatenate([[0.0], steps + 1.0])
    return np.stack([np.interp(at, known, drifts) for drifts in before.T], axis=1), steps
