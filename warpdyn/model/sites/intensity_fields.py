"""Fields of an intensity measure at grid points: their dataset, and ground motions that are scaled to a field."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import check_kind, unmasked, whole_number
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.foundations.core.units import IN_G
from warpdyn.model.ground_motions.measures.names import measure_named
from warpdyn.model.ground_motions.motions import GroundMotion, checked_motions
from warpdyn.model.sites.motion_grid import MotionGrid
from warpdyn.model.sites.places import check_degrees

MOST_SHOWN = 3  # wrong values in an error message
SCALED = ("PGA", "PGV", "PGD", "SA")  # intensity measures to which records can be scaled

Record = GroundMotion | tuple[GroundMotion, GroundMotion]


def field_dataset(
    what: str,
    longitude: np.ndarray,
    latitude: np.ndarray,
    fields: Mapping[str, tuple[np.ndarray, str]],
    points: Sequence[str] | None = None,
    earthquakes: Sequence[str] | None = None,
    attributes: Mapping[str, object] | None = None,
) -> xr.Dataset:
    """Return a dataset of intensity fields, with the dimensions `earthquake` and `point`.

    Args:
        what: Name of the file, for errors.
        longitude: Longitudes of the points [degree], shape [point].
        latitude: Latitudes of the points [degree], shape [point].
        fields: Name of the field -> values, shape [earthquake, point], and their unit ("" if it is unknown).
        points: Names of the points; None: no names.
        earthquakes: Names of the earthquakes; None: numbers from 0.
        attributes: Attributes of the dataset.

    Raises:
        ValueError: If a longitude or latitude is out of range.
    """
    check_degrees(what, longitude, latitude)
    variables = {}
    for name, (values, units) in fields.items():
        about = {"long_name": name} | ({"units": units} if units else {}) | ({"comment": IN_G} if units == "g" else {})
        variables[name] = (("earthquake", "point"), values, about)
    count = next(iter(fields.values()))[0].shape[0]
    names = [str(each) for each in (range(count) if earthquakes is None else earthquakes)]
    coordinates = {
        "longitude": ("point", longitude, {"standard_name": "longitude", "units": "degrees_east"}),
        "latitude": ("point", latitude, {"standard_name": "latitude", "units": "degrees_north"}),
        "earthquake": ("earthquake", np.array(names, dtype=str), {"long_name": "name of the earthquake"}),
    }
    if points is not None:
        coordinates["point_name"] = ("point", np.array(points, dtype=str), {"long_name": "name of the point"})
    return xr.Dataset(variables, coordinates, attributes)


def scale_records(
    field: xr.DataArray, motions: Sequence[Record], *, seed: int = 0, record: ArrayLike | None = None
) -> MotionGrid:
    """Return ground motions at the points of an intensity field: records scaled to the field's values.

    In each earthquake, all points get the same record, multiplied by different factors. Both components of a pair are
    multiplied by the same factor, so that the geometric mean of their intensities is the value of the field.

    Args:
        field: Values of an intensity measure, dimensions `earthquake` and `point`, from a reader of `wd.sites` or from
            `correlated_fields`, such as `wd.sites.read_shakemap("grid.xml")["SA(1.0)"]`.
        motions: Records: motions, or pairs of components, as from `records.pairs`.
        seed: Seed of the random choice of records. No record is used again before all records were used.
        record: Index into `motions` for each earthquake, shape [earthquake]; None: chosen at random.

    Returns:
        The grid of motions. Its method `at` returns the excitation of buildings.

    Raises:
        ValueError: If the field's measure or unit is unknown, values are below 0 or not finite, or a motion has no
            intensity to scale.
        TypeError: If `field` is not a DataArray, or a motion is not a GroundMotion.

    Example:
        >>> shaking = wd.sites.read_shakemap("grid.xml")
        >>> grid = wd.sites.scale_records(shaking["SA(1.0)"], motions, seed=1)
        >>> grid.scale.shape  # point, earthquake, component
        (4, 1, 1)
    """
    check_kind("scale_records", "a DataArray of intensities", field, xr.DataArray, argument="field")
    name = str(field.name)
    measure = measure_named(name)
    if measure is None or measure.kind not in SCALED or measure.components:
        raise ValueError(
            f"scale_records: the field is named {name!r}, but its name must be an intensity measure: PGA, PGV, PGD or "
            "SA(period in s), such as 'SA(1.0)'. Rename it: field.rename('SA(1.0)')"
        )
    try:
        factor = measure.unit_size(field.attrs.get("units"))
    except ValueError as error:
        raise ValueError(f"scale_records: field.attrs['units']: {error}") from None
    if set(field.dims) != {"earthquake", "point"}:
        raise ValueError(
            f"scale_records: {name} must have the dimensions earthquake and point, got "
            f"{', '.join(map(str, field.dims))}"
        )
    values = field.transpose("earthquake", "point").values.astype(np.float64)
    bad = ~(np.isfinite(values) & (values >= 0))
    if bad.any():
        at = np.argwhere(bad)
        shown = ", ".join(f"{values[e, p]:g} at point {p} of earthquake {e}" for e, p in at[:MOST_SHOWN])
        raise ValueError(
            f"scale_records: values of {name} must be finite numbers of at least 0, but {len(at):,} of {bad.size:,} "
            f"are not: {shown}. Correct the field"
        )
    if isinstance(motions, list | tuple):
        pairs = [each if isinstance(each, tuple) else (each,) for each in motions]
    else:
        single: Any = motions
        pairs = [(each,) for each in checked_motions(single)]
    if not pairs:
        raise ValueError("scale_records: motions is empty: give at least one GroundMotion")
    if len({len(each) for each in pairs}) != 1:
        raise ValueError(
            "scale_records: motions must be all single motions, or all pairs of components, such as "
            "records.pairs(motions)"
        )
    flat = checked_motions([motion for pair in pairs for motion in pair])
    of_motion = measure.values(flat).reshape(len(pairs), -1)
    if not np.all(of_motion > 0):
        silent = flat[int(np.argmin(of_motion.ravel()))].name
        raise ValueError(f"scale_records: motion {silent!r} has {name} = 0, so that it cannot be scaled: remove it")
    of_record = np.exp(np.log(of_motion).mean(axis=1))
    chosen = _chosen(record, values.shape[0], len(pairs), whole_number("seed", seed, 0))
    components = of_motion.shape[1]
    shape = (values.shape[1], values.shape[0], components)
    motion = np.broadcast_to(chosen[:, None] * components + np.arange(components), shape)
    scale = np.broadcast_to((values * factor / of_record[chosen, None]).T[:, :, None], shape)
    points = field["point_name"].values if "point_name" in field.coords else np.arange(shape[0])
    return MotionGrid(
        field["longitude"].values,
        field["latitude"].values,
        flat,
        motion.astype(np.int32),
        scale,
        [str(each) for each in points],
        [str(each) for each in field["earthquake"].values],
        measure,
    )


def _chosen(record: ArrayLike | None, earthquakes: int, records: int, seed: int) -> np.ndarray:
    """Return the index of the record that each earthquake gets, given or chosen at random, shape [earthquake]."""
    if record is None:
        random = np.random.default_rng([seed, Purpose.RECORDS_OF_EARTHQUAKES])
        rounds = -(-earthquakes // records)
        return np.concatenate([random.permutation(records) for _ in range(rounds)])[:earthquakes]
    chosen = unmasked("record", record)
    if chosen.shape != (earthquakes,) or chosen.dtype.kind not in "iu" or chosen.min() < 0 or chosen.max() >= records:
        raise ValueError(
            f"scale_records: record must contain one index from 0 to {records - 1} into motions for each of "
            f"{earthquakes} earthquakes, shape [{earthquakes}]"
        )
    return chosen
