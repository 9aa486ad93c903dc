"""What a building's springs do when they are pushed slowly, by the kernels' own storey laws."""

from __future__ import annotations

import numpy as np
import warp as wp
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.checks import finite_numbers
from warpdyn.kernels.storey_path import storey_path_kernel
from warpdyn.laws import LAWS
from warpdyn.structures import ShearBuilding


def storey_hysteresis(building: ShearBuilding, drift: ArrayLike) -> xr.Dataset:
    """Return the forces of a building's storeys that are taken slowly through given drifts, in double precision.

    Args:
        building: The building.
        drift: Storey drifts to go through, from 0 [m], shape [step] for all storeys alike or [step, storey].

    Returns:
        `storey_drift` [m], `storey_force` [N] and `dissipated_energy` [J], the work done less what is still stored, by
        the trapezoidal rule; all of shape [step, storey].

    Raises:
        ValueError: If a drift is not finite or the shape is another.
    """
    path = finite_numbers("drift", drift)
    if path.ndim == 1:
        path = np.repeat(path[:, None], building.storeys, axis=1)
    if path.ndim != 2 or path.shape[1] != building.storeys or not path.size:
        raise ValueError(f"drift must have shape [step] or [step, {building.storeys}], got {np.shape(drift)}")
    parameters = {name: np.atleast_1d(value)[None] for name, value in building.parameters.items()}
    law = LAWS[building.law]
    spring = law.spring(parameters)
    coefficients = np.concatenate(np.broadcast_arrays(*law.coefficients(parameters, spring)))
    arrays = [wp.array(np.ascontiguousarray(values, np.float64), device="cpu") for values in (coefficients, path)]
    results = [wp.full(path.shape, np.nan, dtype=wp.float64, device="cpu") for _ in range(2)]
    kernel = storey_path_kernel(spring, "float64")
    wp.launch(kernel, dim=building.storeys, inputs=arrays, outputs=results, device="cpu")
    dims = ("step", "storey")
    force, dissipated = (result.numpy() for result in results)
    return xr.Dataset(
        {
            "storey_drift": (dims, path, {"units": "m", "long_name": "storey drift"}),
            "storey_force": (dims, force, {"units": "N", "long_name": "restoring force of the storey"}),
            "dissipated_energy": (dims, dissipated, {"units": "J", "long_name": "work done less what is stored"}),
        },
        coords={"storey": np.arange(1, building.storeys + 1)},
    )
