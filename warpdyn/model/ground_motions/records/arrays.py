"""Ground motions from NumPy arrays and xarray datasets."""

from __future__ import annotations

import numpy as np
import xarray as xr

from warpdyn.foundations.core.checks import real_numbers
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.quantities import statement_of_name
from warpdyn.model.ground_motions.records.units import ALLOWED_UNITS, checked_step, step_of_times, unit_factor


def from_array(acceleration: np.ndarray, step: float, unit: str, name: str = "motion") -> GroundMotion:
    """Return the ground motion whose accelerations are in an array.

    Args:
        acceleration: Ground acceleration [`unit`], shape [time]; the first value acts at t = 0.
        step: Sampling step [s].
        unit: Unit of the acceleration, one of `UNITS`.
        name: Name of the motion in results.

    Returns:
        The motion [m/s2].

    Raises:
        ValueError: If the unit is unknown, the step is not positive, or the values are not a 1-D array of finite
            numbers, or some are masked.

    Example:
        >>> motion = wd.records.from_array(0.3 * np.sin(np.arange(0, 10, 0.01)), 0.01, unit="g", name="sine")
        >>> round(motion.peak_ground_acceleration, 2)  # m/s2
        2.94
    """
    values = real_numbers(f"motion {name!r}: acceleration", acceleration)
    factor = unit_factor(unit, f"motion {name!r}")
    step = checked_step(step, f"motion {name!r}: step")
    return GroundMotion(factor * values, step, name, "array")


def from_dataset(data: xr.Dataset | xr.DataArray, variable: str | None = None) -> list[GroundMotion]:
    """Return the ground motions in an xarray object with a coordinate `time` [s] and an attribute `units`.

    Args:
        data: An array with dimension `time` and at most one more, such as `record`, or a dataset that contains it.
        variable: Name of the variable in a dataset; None: the only variable with the dimension `time`.

    Returns:
        One motion [m/s2] per element of the other dimension, named by the coordinate of this dimension. If `time` is
        the only dimension, one motion with the name of the array.

    Raises:
        ValueError: If the variable is missing or ambiguous, or has other dimensions; if its unit is missing or unknown,
            or its name is that of a velocity or displacement; if times are missing, uneven or not in seconds; or if a
            value is not finite or is masked.
        TypeError: If `data` is neither a Dataset nor a DataArray.

    Example:
        >>> import xarray as xr
        >>> coords = {"record": ["a", "b"], "time": [0.0, 0.01, 0.02]}  # s
        >>> data = xr.DataArray([[0.0, 0.1, 0.0], [0.0, 0.2, 0.1]], coords, attrs={"units": "g"})
        >>> [motion.name for motion in wd.records.from_dataset(data)]
        ['a', 'b']
    """
    if isinstance(data, xr.Dataset):
        candidates = [str(key) for key in data.data_vars if "time" in data[key].dims]
        if variable is None and len(candidates) != 1:
            raise ValueError(f"give variable=: {len(candidates)} variables have the dimension 'time': {candidates}")
        if variable is not None and variable not in data.data_vars:
            raise ValueError(
                f"variable={variable!r} is not in the dataset; give one of those with the dimension 'time': "
                f"{candidates}"
            )
        data = data[variable or candidates[0]]
    if not isinstance(data, xr.DataArray):
        raise TypeError(
            f"from_dataset() takes an xarray Dataset or DataArray, got {type(data).__name__}: for an array use "
            "wd.records.from_array(values, step, unit)"
        )
    label = "motion" if data.name in (None, "") else str(data.name)
    others = [dimension for dimension in data.dims if dimension != "time"]
    if "time" not in data.dims or len(others) > 1:
        raise ValueError(
            f"{label}: must have the dimension 'time' and at most one more, has {data.dims}: select along the others "
            "by .isel(...)"
        )
    for text in (label, data.attrs.get("long_name", ""), data.attrs.get("standard_name", "")):
        quantity = statement_of_name(str(text)).quantity
        if quantity in ("velocity", "displacement", "spectrum"):
            raise ValueError(f"{label}: {str(text)!r} says {quantity}, not acceleration: give the accelerations")
    if "units" not in data.attrs:
        raise ValueError(
            f"{label}: has no attribute 'units': set it, such as data.attrs['units'] = 'm/s2'; "
            f"it must be one of {ALLOWED_UNITS}"
        )
    time = data["time"] if "time" in data.coords else None  # without the coordinate, data["time"] is 0, 1, 2, ...
    if time is None or time.dtype.kind not in "iuf":
        found = "is missing" if time is None else f"has dtype {time.dtype}"
        raise ValueError(f"{label}: the coordinate 'time' must contain numbers [s], but it {found}")
    if time.attrs.get("units", "s") not in ("s", "sec", "second", "seconds"):
        raise ValueError(f"{label}: the coordinate 'time' must be in 's', got {time.attrs['units']!r}: convert it")
    if data.sizes["time"] < 2:
        raise ValueError(
            f"{label}: a record needs at least 2 samples along 'time', found {data.sizes['time']}: check how you "
            "selected them"
        )
    step = step_of_times(time.values.astype(np.float64), None, label)
    rows = data.transpose(..., "time").values
    if not others:
        return [from_array(rows, step, data.attrs["units"], label)]
    names = data[others[0]].values  # numbers 0, 1, ... if this dimension has no coordinate
    return [from_array(row, step, data.attrs["units"], str(name)) for name, row in zip(names, rows, strict=True)]
