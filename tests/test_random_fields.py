"""Correlated intensity fields against their models: variances, and the semivariogram of many draws."""

import numpy as np
import pytest
import xarray as xr
from test_sites import haversine

import warpdyn as wd
from warpdyn.model.sites import random_fields

pytestmark = pytest.mark.fast

# Of published equations, worked by hand: the range [km].
RANGES = [
    (wd.sites.JayaramBaker2009(0.0), 8.5),
    (wd.sites.JayaramBaker2009(0.5), 17.1),
    (wd.sites.JayaramBaker2009(0.0, is_clustered=True), 40.7),
    (wd.sites.JayaramBaker2009(0.5, is_clustered=True), 33.2),
    (wd.sites.JayaramBaker2009(1.0), 25.7),  # the same in both cases from 1 s on
    (wd.sites.JayaramBaker2009(1.0, is_clustered=True), 25.7),
    (wd.sites.JayaramBaker2009(10.0), 59.0),
    (wd.sites.EspositoIervolino2012(0.0), 13.5),
    (wd.sites.EspositoIervolino2012(0.0, "Italy"), 11.5),
    (wd.sites.EspositoIervolino2012(1.0), 24.4),
    (wd.sites.EspositoIervolino2012(2.0, "Italy"), 31.8),
]
DRAWS = 4000


@pytest.mark.parametrize(("model", "kilometres"), RANGES)
def test_ranges_are_those_of_the_equations(model, kilometres):
    assert model.correlation_range == pytest.approx(1000 * kilometres, rel=1e-12)
    assert model.correlation([0.0, 1000 * kilometres / 3, 1000 * kilometres]) == pytest.approx(np.exp([0, -1, -3]))


def even_grid(columns, rows, step=0.01):
    """Return longitudes and latitudes as a ShakeMap has them, row by row from the north, with few digits."""
    lon, lat = np.meshgrid(-122 + step * np.arange(columns), 38 - step * np.arange(rows))
    return np.round(lon.ravel(), 4), np.round(lat.ravel(), 4)


def semivariogram_errors(residuals, longitude, latitude, model, first, others):
    """Return how far draws of residuals at a point and others are from the model, pair by pair, in standard errors."""
    distance = haversine(longitude[first], latitude[first], longitude[others], latitude[others])
    expected = 1 - np.exp(-3 * distance / model.correlation_range)
    found = 0.5 * np.mean((residuals[:, [first]] - residuals[:, others]) ** 2, axis=0)
    # Half a squared difference of normals is its mean times a chi-square of one degree, whose variance is 2. With what
    # circulant embedding may change.
    error = expected * np.sqrt(2 / len(residuals)) + random_fields.SMALL
    return np.abs(found - expected) / error


@pytest.mark.parametrize("model", [wd.sites.JayaramBaker2009(0.3), wd.sites.JayaramBaker2009(0.3, is_clustered=True)])
@pytest.mark.parametrize("way", ["cholesky", "embedding"])
def test_residuals_have_the_models_semivariogram(model, way, monkeypatch, measured):
    lon, lat = even_grid(24, 20)
    if way == "embedding":
        monkeypatch.setattr(random_fields, "MOST_BY_CHOLESKY", 10)
    residuals = wd.sites.within_event_residuals(lon, lat, model, DRAWS, seed=1)
    assert residuals.shape == (DRAWS, 480)
    assert np.all(np.abs(residuals.mean(axis=0)[::37]) < 4 / np.sqrt(DRAWS))
    assert np.all(np.abs(residuals.var(axis=0)[::37] - 1) < 4 * np.sqrt(2 / DRAWS) + random_fields.SMALL)
    # Along a row, along a column and across, from neighbours to 25 km.
    others = np.array([1, 5, 23, 24, 24 * 9, 24 * 19, 24 * 7 + 7, 479])
    measured(
        "semivariogram of residuals between sites, in standard errors of 8 pairs",
        truth="the exponential model of Jayaram and Baker (2009)",
        value=semivariogram_errors(residuals, lon, lat, model, 0, others).max(),
        bound=4,  # which a pair passes in 1 of 16,000 seeds
    )
    # Two fields of one transform are independent.
    product = (residuals[0::2, 100] * residuals[1::2, 100]).mean()
    assert abs(product) < 4 / np.sqrt(DRAWS / 2)


def test_a_large_grid_and_one_that_is_not_even():
    lon, lat = even_grid(120, 100)
    model = wd.sites.JayaramBaker2009(1.0)
    residuals = wd.sites.within_event_residuals(lon, lat, model, 200, seed=2)
    errors = semivariogram_errors(residuals, lon, lat, model, 6060, np.array([6061, 6160 + 20, 0, 11_999]))
    assert np.all(errors < 4)  # which a pair passes in 1 of 16,000 seeds
    random = np.random.default_rng(0)
    with pytest.raises(ValueError, match=r"5,000 grid points are not evenly spaced.*at most 4,096"):
        wd.sites.within_event_residuals(random.uniform(0, 1, 5000), random.uniform(0, 1, 5000), model, 1)
    few = wd.sites.within_event_residuals(random.uniform(0, 1, 50), random.uniform(0, 1, 50), model, 3)
    assert few.shape == (3, 50)


def field(values, points=2, apart=3.0):
    at = {"longitude": ("point", apart * np.arange(points)), "latitude": ("point", np.zeros(points))}
    names = [f"e{i}" for i in range(len(values))]
    return xr.DataArray(
        values, at | {"earthquake": names}, ("earthquake", "point"), "SA(1.0)", {"units": "g", "long_name": "SA(1.0)"}
    )


def test_residuals_between_and_within_earthquakes():
    median = field(np.array([[0.2, 0.4], [0.1, 0.1]]))
    tau, phi = 0.3, np.array([0.5, 0.6])
    model = wd.sites.JayaramBaker2009(1.0)  # points 330 km apart have but the residual between in common
    drawn = wd.sites.correlated_fields(median, model, between=tau, within=phi, draws=DRAWS, seed=3)
    assert drawn.sizes == {"earthquake": 2 * DRAWS, "point": 2}
    assert drawn["earthquake"].values[[0, DRAWS]].tolist() == ["e0 0", "e1 0"]
    logarithm = np.log(drawn.values.reshape(2, DRAWS, 2) / median.values[:, None])
    variance = tau**2 + phi**2
    error = np.sqrt(2 / DRAWS) * variance
    assert np.all(np.abs(logarithm.var(axis=1) - variance) < 4 * error)
    assert np.all(np.abs(logarithm.mean(axis=1)) < 4 * np.sqrt(variance / DRAWS))
    product = (logarithm[..., 0] * logarithm[..., 1]).mean(axis=1)
    error = np.sqrt((variance.prod() + tau**4) / DRAWS)  # of a product of two normals (Isserlis)
    assert np.all(np.abs(product - tau**2) < 4 * error)
    across = (logarithm[0] * logarithm[1]).mean()  # earthquakes are independent
    assert abs(across) < 4 * variance.max() / np.sqrt(2 * DRAWS)
    grid = wd.sites.scale_records(drawn.isel(earthquake=slice(3)), [wd.GroundMotion([0.0, 1.0, 0.0], 0.01)])
    assert grid.scale.shape == (2, 3, 1)


def test_draws_depend_on_the_seed_alone():
    median, model = field(np.full((2, 4), 0.2), 4, 0.05), wd.sites.EspositoIervolino2012(1.0)

    def drawn(draws, seed):
        whole = wd.sites.correlated_fields(median, model, between=0.3, within=0.5, draws=draws, seed=seed)
        return whole.values.reshape(2, draws, 4)

    # Products of matrices of other sizes may be summed in another order.
    assert drawn(9, 1)[:, :4] == pytest.approx(drawn(4, 1), rel=1e-13)
    assert not np.any(np.isclose(drawn(4, 1), drawn(4, 2)))


WRONG = {
    "between": ({"between": -0.1}, "between must be one standard deviation"),
    "within": ({"within": [0.1, 0.2, 0.3]}, r"got shapes \(\) and \(3,\)"),
    "draws": ({"draws": 0}, "draws must be a whole number of at least 1"),
    "median": (
        {"median": field(np.array([[0.0, 1.0]]))},
        "the median is 0 at point 0 of earthquake 0; it must be finite and above 0",
    ),
    "dimensions": ({"median": field(np.array([[1.0, 1.0]]))[0]}, "must have the dimensions earthquake and point"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_cannot_be_drawn(what):
    changed, message = WRONG[what]
    given = {"median": field(np.array([[1.0, 1.0]])), "between": 0.1, "within": 0.1, "draws": 1} | changed
    with pytest.raises(ValueError, match=message):
        wd.sites.correlated_fields(given.pop("median"), wd.sites.JayaramBaker2009(1.0), **given)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: wd.sites.JayaramBaker2009(11.0), "model is for 0 to 10 s"),
        (lambda: wd.sites.EspositoIervolino2012(3.0), "model is for 0.1 to 2 s"),
        (lambda: wd.sites.EspositoIervolino2012(1.0, "Japan"), "unknown region 'Japan'"),
    ],
)
def test_models_refuse_what_they_were_not_fitted_to(make, message):
    with pytest.raises(ValueError, match=message):
        make()
