"""Distances on Earth, the grid points nearest to buildings, and a check that buildings are within the grid."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from warpdyn.foundations.core.thread_pool import cores, in_parts
from warpdyn.model.inventories.table import named_rows

EARTH_RADIUS = 6_371_008.8  # m, the mean radius of WGS 84 (Moritz 2000, Journal of Geodesy 74, R1)
BESIDE = 3  # grid_spacing uses the distance of a point from its third neighbour, the longer side of a cell


def unit_vectors(longitude: np.ndarray, latitude: np.ndarray) -> np.ndarray:
    """Return places [degree] as points on the unit sphere, shape [place, 3]; they are continuous across 180 degrees."""
    lon, lat = np.radians(longitude), np.radians(latitude)
    return np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)


def arc(chord: np.ndarray) -> np.ndarray:
    """Return the great-circle distances on Earth [m] that belong to chord lengths on the unit sphere [1]."""
    return 2 * EARTH_RADIUS * np.arcsin(np.minimum(chord / 2, 1.0))


def check_degrees(what: str, longitude: np.ndarray, latitude: np.ndarray) -> None:
    """Raise a ValueError if a longitude is outside -180 to 180 degrees or a latitude outside -90 to 90 degrees.

    Args:
        what: Name of the function or the file, for the message.
        longitude: Longitudes [degree], shape [point].
        latitude: Latitudes [degree], shape [point].
    """
    for name, values, most in (("longitude", longitude, 180), ("latitude", latitude, 90)):
        bad = np.flatnonzero(~(np.abs(values) <= most))
        if bad.size:
            fits = np.all(np.abs(longitude) <= 90) and np.all(np.abs(latitude) <= 180)
            hint = ": longitude and latitude seem to be exchanged" if fits else ": correct these points"
            raise ValueError(
                f"{what}: {bad.size:,} of {values.size:,} grid points have a {name} outside -{most} to {most} degrees, "
                f"the first is point {bad[0]} with {values[bad[0]]:g}{hint}"
            )


def distances_between(longitude: np.ndarray, latitude: np.ndarray) -> np.ndarray:
    """Return the great-circle distances between all pairs of places [m], shape [place, place].

    Distances are computed from differences of unit vectors instead of cosines of angles: because of rounding, a cosine
    does not distinguish angles below 1e-8 (distances below 0.1 m) from 0.
    """
    square = np.zeros((longitude.size, longitude.size))
    for axis in unit_vectors(longitude, latitude).T:
        square += (axis[:, None] - axis) ** 2
    return arc(np.sqrt(square))


def grid_spacing(longitude: np.ndarray, latitude: np.ndarray) -> float:
    """Return the spacing of a grid [m]: the median, over all points, of the distance from the third neighbour.

    In a rectangular grid this is the longer side of a cell, if it is at most twice the shorter side. Points at the same
    place count as one point. If all points are at the same place, the spacing is infinite.
    """
    distinct = np.unique(longitude + 1j * latitude)
    if distinct.size == 1:
        return np.inf
    points = unit_vectors(distinct.real, distinct.imag)
    count = min(BESIDE + 1, distinct.size)  # + 1, because the query also returns the point itself
    chord, _ = cKDTree(points).query(points, k=count, workers=-1)
    return float(np.median(arc(chord[:, -1])))


def nearest_points(
    what: str,
    inventory: pd.DataFrame,
    rows: np.ndarray,
    longitude: np.ndarray,
    latitude: np.ndarray,
    neighbours: int,
    reach: float | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the grid points nearest to each building, and their distances.

    Args:
        what: Name of the function, for errors.
        inventory: Buildings, with columns `id`, `longitude` and `latitude` [degree].
        rows: Inventory row of each building, counted from 0.
        longitude: Longitudes of the grid points [degree], shape [point].
        latitude: Latitudes of the grid points [degree], shape [point].
        neighbours: Number of nearest points; if the grid has fewer points, all of them.
        reach: Largest allowed distance of a building from its nearest point [m]; None: the grid's spacing.

    Returns:
        Indices of the points, the nearest first, and great-circle distances [m], both of shape [building, neighbour].

    Raises:
        ValueError: If buildings are farther than `reach` from the grid; the message counts and names these buildings.
    """
    tree = cKDTree(unit_vectors(longitude, latitude))
    count = min(neighbours, longitude.size)
    places = [inventory[name].to_numpy(dtype=np.float64) for name in ("longitude", "latitude")]
    distance = np.empty((rows.size, count))
    index = np.empty(distance.shape, np.intp)

    def find(part: slice) -> None:
        own = unit_vectors(*(each[rows[part]] for each in places))
        chord, index[part] = tree.query(own, k=[*range(1, count + 1)])
        distance[part] = arc(chord)

    in_parts(find, rows.size, cores())
    most = grid_spacing(longitude, latitude) if reach is None else reach
    outside = distance[:, 0] > most
    if outside.any():
        latitude_first = (each[rows[outside]] for each in reversed(places))
        swapped, _ = tree.query(unit_vectors(*latitude_first), k=1, workers=-1)
        hint = "; longitude and latitude seem to be exchanged" if np.all(arc(swapped) <= most) else ""
        allowed = f"{'its spacing' if reach is None else 'reach'} is {most / 1000:.2f} km"
        raise ValueError(
            f"{what}: {named_rows(inventory.iloc[rows], outside)} of {rows.size:,} buildings are outside the grid, "
            f"up to {distance[:, 0].max() / 1000:.1f} km from its nearest point, and {allowed}; it spans longitudes "
            f"{longitude.min():g} to {longitude.max():g} and latitudes {latitude.min():g} to {latitude.max():g}{hint}. "
            "Remove these buildings, or give a larger reach="
        )
    return index, distance


def inverse_distance_weights(distance: np.ndarray) -> np.ndarray:
    """Return weights of grid points in proportion to 1 / distance squared, shape [building, neighbour].

    The weights of each building add up to 1. Distances have the same shape [m].
    """
    weight = 1.0 / np.maximum(distance, 1e-6) ** 2  # [m]; a point closer than 1e-6 m gets all the weight
    return weight / weight.sum(axis=1, keepdims=True)
