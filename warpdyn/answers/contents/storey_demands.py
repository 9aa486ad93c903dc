"""Demands of components in each storey of a run: drifts of the storey, or accelerations of the floor above or below."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from warpdyn.answers.contents.component import ABOVE, ACCELERATION, Component
from warpdyn.answers.fragility.demands import checked_demand, refuse_portfolio
from warpdyn.answers.fragility.stripe_counts import decoded_status
from warpdyn.campaigns.running.joining.duplicates import check_samples
from warpdyn.campaigns.running.selections import without_added_storeys
from warpdyn.foundations.core.checks import check_dataset, shortened
from warpdyn.foundations.core.output_variables import COLLAPSED, LARGEST_EXCLUDED_FRACTION


def checked_run(function: str, run: xr.Dataset) -> tuple[xr.Dataset, np.ndarray]:
    """Return a run without storeys of isolators or dampers, and the status of its samples, after a check."""
    check_dataset(function, run, "status", advice="give the result of simulate()", argument="run")
    refuse_portfolio(function, run)
    run = without_added_storeys(run)
    if "event" in run.dims:
        raise ValueError(f"{function}: the run has several events: select one, select_event(run, name)")
    if not run.sizes.get("sample", 0) or "storey" not in run.dims:
        raise ValueError(f"{function}: the run has no samples or no storeys: give a run of a ShearBuilding")
    check_samples(function, run)
    status = decoded_status(run["status"])
    failed = status > COLLAPSED
    if failed.sum() > LARGEST_EXCLUDED_FRACTION * status.size:
        raise ValueError(
            f"{function}: {failed.sum()} of {status.size} samples failed; at most {100 * LARGEST_EXCLUDED_FRACTION:g} "
            "% may fail: simulate with a smaller step= or another method="
        )
    return run, status


def checked_components(function: str, components: object) -> dict[str, Component]:
    """Return components by name after a check."""
    if not isinstance(components, Mapping) or not components:
        raise TypeError(
            f"{function}: components must be a dictionary of names and Component objects, got {shortened(components)}"
        )
    for name, each in components.items():
        if not isinstance(name, str) or not isinstance(each, Component):
            raise TypeError(f"{function}: components[{name!r}] must be a Component, got {shortened(each)}")
    return dict(components)


def demand_of_storeys(
    function: str, run: xr.Dataset, name: str, component: Component, status: np.ndarray, used: np.ndarray | None = None
) -> np.ndarray:
    """Return the demand of a component in each storey, shape [storey, sample] [unit of the demand].

    Args:
        function: Name of the public function, for messages.
        run: The run, from `checked_run`.
        name: Name of the component, for messages.
        component: The component.
        status: Status of each sample.
        used: Whether each storey has such components, shape [storey]; None: all.
    """
    demand = component.demand
    if demand not in run:
        raise ValueError(
            f"{function}: component {name!r} needs {demand}, which the run does not have: add {component.recorder!r} "
            "to Scene(recorders=...)"
        )
    part = run
    if component.period is not None:
        known = run["period"].values
        near = np.flatnonzero(np.isclose(known, component.period, rtol=1e-6))
        if not near.size:
            raise ValueError(
                f"{function}: component {name!r} has the period {component.period:g} s, but the floor spectra of the "
                f"run have the periods {shortened(known.tolist())}: add it to FloorSpectra(periods=...)"
            )
        part = run.isel(period=int(near[0]))
    values = checked_demand(function, part, demand, status).astype(np.float64)
    if not component.by_floor or component.place == ABOVE:
        return values
    ground = np.full((1, values.shape[1]), np.nan)
    if demand == ACCELERATION and {"motion_peak_acceleration", "motion_index"} <= run.variables.keys():
        peaks = run["motion_peak_acceleration"].values[run["motion_index"].values]
        ground[0] = peaks * run["scale_factor_of_motion"].values
    elif used is None or used[0]:
        raise ValueError(
            f"{function}: component {name!r} is fixed to the floor below its storey, but the run has no {demand} of "
            "the ground below storey 1: give place='floor_above', or the quantity 0 in storey 1"
        )
    return np.concatenate([ground, values[:-1]])
