"""Distances and correlated residuals of sites that are close to each other, or at one place."""

from decimal import Decimal, getcontext

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.model.sites.places import EARTH_RADIUS, distances_between, grid_spacing

pytestmark = pytest.mark.fast
MODEL = wd.sites.JayaramBaker2009(1.0)
getcontext().prec = 50


def exact_distance(lon, lat):
    """Great-circle distance of two places by the haversine in 50 digits (for angles below 0.1)."""
    pi = Decimal("3.14159265358979323846264338327950288419716939937510")

    def sine(x):
        term = total = x
        for k in range(1, 20):
            term = -term * x * x / ((2 * k) * (2 * k + 1))
            total += term
        return total

    degrees = [[Decimal(float(value)) * pi / 180 for value in axis] for axis in (lon, lat)]
    (a, b), (c, d) = degrees
    cosines = [sine(pi / 2 - value) for value in (c, d)]
    square = sine((d - c) / 2) ** 2 + cosines[0] * cosines[1] * sine((b - a) / 2) ** 2
    half = square.sqrt()
    arcsine = half + half**3 / 6 + 3 * half**5 / 40 + 15 * half**7 / 336
    return float(2 * arcsine * Decimal(EARTH_RADIUS))


@pytest.mark.parametrize("apart", [1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3, 0.1, 1.0])  # degree; 1e-6 is 0.1 m
@pytest.mark.parametrize(("lon", "lat"), [(0.0, 0.0), (-122.3, 37.8), (179.99999, -60.0), (10.0, 89.0)])
def test_distances_of_close_sites_lose_nothing(apart, lon, lat):
    lon, lat = np.array([lon, lon + apart]), np.array([lat, lat + 0.3 * apart])
    found = distances_between(lon, lat)
    # Unit vectors are rounded by 2e-16 in each of three coordinates, of two places: 4e-9 m. The last term that the
    # arcsine of the reference leaves out is 1e-9 of a distance of one degree.
    assert found[0, 1] == found[1, 0] == pytest.approx(exact_distance(lon, lat), rel=1e-9, abs=4e-9)
    assert found[0, 0] == found[1, 1] == 0


@pytest.mark.parametrize("apart", [1e-9, 1e-7, 1e-6, 2e-6, 1e-5])
def test_residuals_of_close_sites_are_correlated_as_the_model_says(apart):
    lon = -122.3 + apart * np.arange(300)
    residuals = wd.sites.within_event_residuals(lon, np.full(300, 37.8), MODEL, draws=200, seed=1)
    # The variance of the difference of neighbours is 2 (1 - rho), and 2e-8 at most by what outweighs rounding.
    distance = np.radians(apart) * np.cos(np.radians(37.8)) * EARTH_RADIUS
    variance = 2 * -np.expm1(-3 * distance / MODEL.correlation_range)
    # 299 neighbours in 200 draws: 60,000 differences, whose sample variance has a scatter of sqrt(2 / 60,000) = 0.6 %.
    assert np.diff(residuals, axis=1).var() == pytest.approx(variance, rel=0.03, abs=4e-8)
    assert residuals[:, 0].std() == pytest.approx(1.0, abs=0.25)  # 5 sigma of 200 draws


@pytest.mark.parametrize("count", [2, 300, 5000])
def test_sites_at_one_place_are_fully_correlated(count):
    residuals = wd.sites.within_event_residuals(np.full(count, 14.2), np.full(count, 42.3), MODEL, draws=3)
    assert residuals.shape == (3, count)
    assert (residuals == residuals[:, :1]).all()
    assert np.unique(residuals).size == 3


def test_sites_that_repeat_leave_the_others_as_they_are():
    lon, lat = np.array([14.2, 14.3, 14.25]), np.array([42.3, 42.3, 42.35])
    alone = wd.sites.within_event_residuals(lon, lat, MODEL, draws=4, seed=2)
    places = np.array([0, 1, 0, 2, 1, 1])
    np.testing.assert_array_equal(
        wd.sites.within_event_residuals(lon[places], lat[places], MODEL, draws=4, seed=2), alone[:, places]
    )


def test_a_grid_with_stations_at_one_place_has_the_spacing_of_its_places():
    lon, lat = (axis.ravel() for axis in np.meshgrid([14.0, 14.1, 14.2], [42.0, 42.1, 42.2]))
    assert grid_spacing(np.tile(lon, 4), np.tile(lat, 4)) == grid_spacing(lon, lat) > 8e3
    assert grid_spacing(np.full(4, 14.0), np.full(4, 42.0)) == np.inf


@pytest.mark.parametrize(
    ("longitude", "latitude", "message"),
    [
        ([42.0, 42.1], [114.0, 114.1], "latitude outside -90 to 90 degrees.*exchanged"),
        ([14.0, np.nan], [42.0, 42.1], "longitude.1. is nan"),
        ([14.0, 14.1], [42.0], "lists of the same length"),
        ([], [], "at least one point"),
        ([[14.0]], [[42.0]], "lists of the same length"),
    ],
)
def test_places_that_cannot_be_are_refused(longitude, latitude, message):
    with pytest.raises(ValueError, match=message):
        wd.sites.within_event_residuals(longitude, latitude, MODEL, draws=1)


def test_a_model_that_is_no_correlation_is_refused():
    class Negative(wd.sites.SpatialCorrelation):
        correlation_range = 1e4

        def correlation(self, distance):
            return np.where(np.asarray(distance) == 0, 1.0, -0.9)

    with pytest.raises(ValueError, match="has a negative eigenvalue"):
        wd.sites.within_event_residuals([14.0, 14.1, 14.2], [42.0, 42.1, 42.3], Negative(), draws=1)
    with pytest.raises(TypeError, match="takes a SpatialCorrelation"):
        wd.sites.within_event_residuals([14.0], [42.0], "exponential", draws=1)
    with pytest.raises(ValueError, match="draws"):
        wd.sites.within_event_residuals([14.0], [42.0], MODEL, draws=0)
