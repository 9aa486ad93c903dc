"""Random fields of intensities, with between-event residuals and spatially correlated within-event residuals."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import check_kind, check_memory, finite_numbers, whole_number
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.model.sites.places import EARTH_RADIUS, check_degrees, distances_between
from warpdyn.model.sites.spatial_correlations import SpatialCorrelation

FEWER = "draw fewer fields"
MOST_BY_CHOLESKY = 4096  # points; the covariance matrix of this number of points takes 128 MiB
MOST_EMBEDDED = 2**26  # points of the periodic grid of the circulant embedding
ROUNDING_OF_VARIANCE = (1e-10, 1e-9, 1e-8)  # relative additions to the variance, tried one after the other
SMALL = 1e-4  # largest relative change of the variance by setting negative eigenvalues to 0
UNEVEN = 0.1  # times the spacing: tolerance for the rounding of printed coordinates


def correlated_fields(
    median: xr.DataArray,
    correlation: SpatialCorrelation,
    *,
    between: float,
    within: ArrayLike,
    draws: int,
    seed: int = 0,
) -> xr.DataArray:
    """Draw random intensity fields with between-event residuals and spatially correlated within-event residuals.

    ln(intensity) = ln(median) + tau eta + phi eps. The between-event residual eta is one standard normal value for the
    whole field; the within-event residual eps is standard normal at each point and correlated in space. The variance of
    ln(intensity) is tau^2 + phi^2. Draw the fields on a grid; `scale_records` and `MotionGrid.at` assign them to
    buildings. A grid with up to 4,096 points may be irregular (Cholesky factor of the covariance). More points must be
    evenly spaced in longitude and latitude, as in a ShakeMap (circulant embedding, Dietrich and Newsam 1997, SIAM
    Journal on Scientific Computing 18(4), with distances on a plane at the middle latitude).

    Args:
        median: Median field, dimensions `earthquake` and `point`, such as `read_shakemap("grid.xml")["SA(1.0)"]`.
        correlation: Spatial correlation model of within-event residuals, such as `JayaramBaker2009(period)`.
        between: Standard deviation tau of between-event residuals of ln(intensity) [1].
        within: Standard deviation phi of within-event residuals of ln(intensity) [1]: one value, or one per point.
        draws: Number of fields per earthquake.
        seed: Seed of the draws. A larger number of draws adds fields and does not change the first ones.

    Returns:
        Fields with the units and points of `median`. The dimension `earthquake` contains `draws` successive fields for
        each earthquake of `median`, named "<earthquake> <draw>".

    Raises:
        ValueError: If a standard deviation is below 0, the median is not above 0, or the grid is too large.
        TypeError: If an argument is of the wrong kind.

    Example:
        >>> shaking = wd.sites.read_shakemap("grid.xml")["SA(1.0)"]
        >>> model = wd.sites.JayaramBaker2009(1.0)
        >>> fields = wd.sites.correlated_fields(shaking, model, between=0.3, within=0.55, draws=50, seed=1)
        >>> dict(fields.sizes)
        {'earthquake': 50, 'point': 4}
    """
    check_kind("correlated_fields", "a DataArray of medians", median, xr.DataArray, argument="median")
    if set(median.dims) != {"earthquake", "point"}:
        raise ValueError(
            f"correlated_fields: median must have the dimensions earthquake and point, got {median.dims}: use "
            "median.rename(...)"
        )
    check_kind("correlated_fields", "a SpatialCorrelation", correlation, SpatialCorrelation, argument="correlation")
    draws = whole_number("draws", draws, 1)
    median = median.transpose("earthquake", "point")
    tau, phi = finite_numbers("between", between), finite_numbers("within", within)
    earthquakes, points = median.shape
    if tau.ndim or tau < 0 or np.any(phi < 0) or phi.shape not in ((), (points,)):
        raise ValueError(
            "correlated_fields: between must be one standard deviation of at least 0; within must be one, or one for "
            f"each of {points:,} points, of at least 0; got shapes {tau.shape} and {phi.shape}"
        )
    values = median.values.astype(np.float64)
    if not np.all(np.isfinite(values) & (values > 0)):
        earthquake, point = np.argwhere(~(np.isfinite(values) & (values > 0)))[0].tolist()
        raise ValueError(
            f"correlated_fields: the median is {values[earthquake, point]:g} at point {point} of earthquake "
            f"{earthquake}; it must be finite and above 0, because its logarithm is used"
        )
    longitude, latitude = median["longitude"].values, median["latitude"].values
    count = earthquakes * draws
    check_memory(f"draws={draws} fields of {earthquakes} earthquakes at {points} points", 40 * count * points, FEWER)
    eps = within_event_residuals(longitude, latitude, correlation, count, seed)
    eta = np.random.default_rng([whole_number("seed", seed, 0), Purpose.BETWEEN_EARTHQUAKES]).standard_normal(count)
    # Each draw covers all earthquakes, so that the first draws do not depend on the number of draws.
    residual = (tau * eta[:, None] + phi * eps).reshape(draws, earthquakes, points).swapaxes(0, 1)
    drawn = (values[:, None] * np.exp(residual)).reshape(count, points)
    names = [f"{name} {draw}" for name in median["earthquake"].values for draw in range(draws)]
    at_points = {name: each for name, each in median.coords.items() if each.dims == ("point",)}
    return xr.DataArray(drawn, at_points | {"earthquake": names}, ("earthquake", "point"), median.name, median.attrs)


def within_event_residuals(
    longitude: ArrayLike, latitude: ArrayLike, correlation: SpatialCorrelation, draws: int, seed: int = 0
) -> np.ndarray:
    """Draw spatially correlated standard normal residuals at grid points, shape [draw, point].

    Points at the same place (equal longitude and latitude) get the same residual.

    Args:
        longitude: Longitudes of the points [degree], shape [point].
        latitude: Latitudes of the points [degree], shape [point].
        correlation: Spatial correlation model of the residuals.
        draws: Number of fields.
        seed: Seed of the draws. A larger number of draws adds fields and does not change the first ones.

    Raises:
        ValueError: If longitudes and latitudes have different lengths or are not in degrees; if there are more than
            4,096 different places that are not evenly spaced, or an even grid is too large; or if the model is not
            positive definite (the variance of a sum of residuals would be below 0).
        TypeError: If `correlation` is not a SpatialCorrelation.

    Example:
        >>> longitude, latitude = [-122.3, -122.2], [37.8, 37.8]
        >>> model = wd.sites.JayaramBaker2009(1.0)
        >>> wd.sites.within_event_residuals(longitude, latitude, model, draws=50, seed=1).shape
        (50, 2)
    """
    check_kind(
        "within_event_residuals", "a SpatialCorrelation", correlation, SpatialCorrelation, argument="correlation"
    )
    lon, lat, place = _distinct_places(*_checked_places(longitude, latitude))
    draws = whole_number("draws", draws, 1)
    check_memory(f"draws={draws} fields at {lon.size} points", 24 * draws * lon.size, FEWER)
    random = np.random.default_rng([whole_number("seed", seed, 0), Purpose.WITHIN_EARTHQUAKES])
    if lon.size <= MOST_BY_CHOLESKY:
        factor = _cholesky(correlation.correlation(distances_between(lon, lat)))
        return (random.standard_normal((draws, lon.size)) @ factor.T)[:, place]
    column, row, step = _even_grid(lon, lat)
    fields = _embedded(correlation, (int(row.max()) + 1, int(column.max()) + 1), step, draws, random)
    return fields[:, row[place], column[place]]


def _checked_places(longitude: ArrayLike, latitude: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return longitudes and latitudes as arrays of shape [point]; raise a ValueError if they are invalid."""
    lon, lat = (
        np.atleast_1d(finite_numbers(f"within_event_residuals: {name}", values))
        for name, values in (("longitude", longitude), ("latitude", latitude))
    )
    if lon.ndim != 1 or lon.shape != lat.shape or not lon.size:
        raise ValueError(
            "within_event_residuals: longitude and latitude must be lists of the same length, with at least one point, "
            f"got shapes {lon.shape} and {lat.shape}"
        )
    check_degrees("within_event_residuals", lon, lat)
    return lon, lat


def _distinct_places(lon: np.ndarray, lat: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return longitudes and latitudes of the different places, in the order of points, and the place of each point.

    The first two arrays have shape [place], the third has shape [point] and contains indices of places.
    """
    _, first, place = np.unique(lon + 1j * lat, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    return lon[first[order]], lat[first[order]], rank[place]


def _cholesky(covariance: np.ndarray) -> np.ndarray:
    """Return the lower Cholesky factor of a correlation matrix; raise a ValueError if an eigenvalue is negative.

    If points are nearly at the same place, rounding may make an eigenvalue slightly negative. Therefore, the smallest
    value of ROUNDING_OF_VARIANCE for which the factorisation succeeds is added to the diagonal.
    """
    variance = np.diag_indices_from(covariance)
    for added in ROUNDING_OF_VARIANCE:
        covariance[variance] = 1 + added
        with suppress(np.linalg.LinAlgError):
            return np.linalg.cholesky(covariance)
    raise ValueError(
        "within_event_residuals: the model's correlation matrix at these points has a negative eigenvalue, so that "
        "sums of residuals would have a variance below 0: correlation() must be a positive definite function of the "
        "distance, such as exp(-distance / length)"
    )


def _even_grid(longitude: np.ndarray, latitude: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Return the column and the row of each point of an even grid, and the spacings of rows and of columns [m]."""
    places, steps = [], []
    for values in (longitude, latitude):
        found = np.unique(values)
        step = (found[-1] - found[0]) / max(found.size - 1, 1)
        place = np.round((values - found[0]) / (step or 1.0)).astype(np.int64)
        is_even = np.all(np.abs(values - found[0] - place * step) <= UNEVEN * step)
        if not is_even:
            raise ValueError(
                f"the {longitude.size:,} grid points are not evenly spaced in longitude and latitude: use at most "
                f"{MOST_BY_CHOLESKY:,} of them, or an even grid"
            )
        places.append(place)
        steps.append(np.radians(step) * EARTH_RADIUS)
    middle = np.cos(np.radians((latitude.min() + latitude.max()) / 2))
    return places[0], places[1], (float(steps[1]), float(steps[0] * middle))


def _embedded(
    correlation: SpatialCorrelation,
    shape: tuple[int, int],
    step: tuple[float, float],
    draws: int,
    random: np.random.Generator,
) -> np.ndarray:
    """Return random fields on an even grid by circulant embedding, shape [draw, row, column].

    Args:
        correlation: Spatial correlation model.
        shape: Number of rows and of columns.
        step: Spacing of rows and of columns [m].
        draws: Number of fields.
        random: Generator of the random numbers.
    """
    for padding in (2, 3, 4, 6, 8, 12, 16):
        wide = tuple(padding * count for count in shape)
        if np.prod(wide) > MOST_EMBEDDED:
            break
        away = [np.minimum(np.arange(n), n - np.arange(n)) * h for n, h in zip(wide, step, strict=True)]
        spectrum = np.fft.fft2(correlation.correlation(np.hypot(away[0][:, None], away[1]))).real
        if -spectrum[spectrum < 0].sum() <= SMALL * spectrum.size:  # the sum of the spectrum is its size (variance 1)
            amplitude = np.sqrt(np.maximum(spectrum, 0.0) / spectrum.size)
            made = np.empty((draws, *shape))
            for first in range(0, draws, 2):  # real and imaginary part are independent fields
                noise = random.standard_normal((2, *wide))
                field = np.fft.fft2(amplitude * (noise[0] + 1j * noise[1]))[: shape[0], : shape[1]]
                made[first] = field.real
                if first + 1 < draws:
                    made[first + 1] = field.imag
            return made
    raise ValueError(
        f"a grid of {shape[0]} x {shape[1]} points every {step[0] / 1000:.3g} km is too large, or too small for the "
        f"range of the correlation, {correlation.correlation_range / 1000:.3g} km: use fewer points with a larger "
        "spacing"
    )
