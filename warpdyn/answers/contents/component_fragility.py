"""Fragility curves of components whose capacity is random."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from scipy.special import ndtri

from warpdyn.answers.contents.component import Component
from warpdyn.answers.contents.storey_demands import checked_run, demand_of_storeys
from warpdyn.answers.fragility.fragility_curves import fragility
from warpdyn.foundations.core.checks import check_kind, shortened, whole_number
from warpdyn.foundations.core.near_misses import suggests_names

FUNCTION = "component_fragility"
RATIO = "demand_over_capacity"


@suggests_names
def component_fragility(
    run: xr.Dataset, component: Component, storey: int | None = None, *, seed: int = 0, **options: Any
) -> xr.Dataset:
    """Return fragility curves of a component: the probability that a unit exceeds each limit state, by intensity.

    Each sample and storey has one unit with a random capacity: exp(dispersion z) times the median of each limit state,
    with one standard normal number z for all limit states. The numbers of a storey are spread evenly (Latin hypercube).
    The unit exceeds a limit state if its demand exceeds its capacity. `fragility` fits the curves; their dispersion
    contains the variability of records, structures and capacities.

    Args:
        run: A run on stripes of a ShearBuilding (or of a structure with storeys), with the demand of the component.
        component: The component.
        storey: Storey of the component, from 1. None: a unit in every storey, and the worst of them counts.
        seed: Seed of the capacities.
        options: Further arguments of `fragility`: estimator, intervals_over, replicates, confidence.

    Returns:
        The result of `fragility`, with the damage states "limit_state_1", "limit_state_2" and so on.

    Raises:
        TypeError, ValueError: As `fragility`; if the run lacks the demand, or the storey is unknown.

    Example:
        >>> ceiling = wd.Component("peak_floor_acceleration", medians=[2.0], dispersions=[0.3])  # m/s2
        >>> curves = wd.component_fragility(run, ceiling, storey=2, intervals_over="records")
        >>> curves["fragility_median"].round(2).values  # g
        array([0.46])
    """
    check_kind(FUNCTION, "a Component", component, Component, argument="component")
    run, status = checked_run(FUNCTION, run)
    seed = whole_number("seed", seed, 0)
    unknown = options.keys() - {"estimator", "intervals_over", "replicates", "confidence"}
    if unknown:
        raise TypeError(f"{FUNCTION}() has no argument {sorted(unknown)[0]!r}")
    storeys = run.sizes["storey"]
    used = np.ones(storeys, dtype=bool)
    if storey is not None:
        numbers = run["storey"].values.tolist() if "storey" in run.coords else list(range(1, storeys + 1))
        if whole_number("storey", storey, 1) not in numbers:
            raise ValueError(f"{FUNCTION}: unknown storey {storey}; the run has {shortened(numbers)}")
        used = np.array(numbers) == storey
    demand = demand_of_storeys(FUNCTION, run, "component", component, status, used)[used]
    samples = status.size
    generator = np.random.default_rng(seed)
    ranks = np.stack([generator.permutation(samples) for _ in demand])
    normal = ndtri((ranks + generator.random(ranks.shape)) / samples)
    dims = ("sample", "storey")
    limits = {}
    units = run[component.demand].attrs.get("units", "1")
    kept = run.isel(storey=np.flatnonzero(used)) if storey is None else run.drop_dims("storey")
    if storey is None and "floor" in kept.dims:
        kept = kept.drop_dims("floor")
    for place, (median, dispersion) in enumerate(zip(component.medians, component.dispersions, strict=True)):
        name = f"{RATIO}_{place + 1}"
        ratio = demand / (median * np.exp(dispersion * normal))
        values = (dims, ratio.T) if storey is None else ("sample", ratio[0])
        kept = kept.assign({name: (*values, {"units": "1", "long_name": f"{component.demand} / capacity [{units}]"})})
        limits[f"limit_state_{place + 1}"] = {name: 1.0}
    found = fragility(kept, limits, seed=seed, **options)
    about = {"component_demand": component.demand, "capacity_seed": seed}
    return found.assign_attrs(about | ({} if storey is None else {"storey": storey}))
