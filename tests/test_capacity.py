"""Chains from capacity curves: pushed or set free, they have the curve they were made from."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.model.structures.capacity.bilinear_curve import bilinear_curve
from warpdyn.model.structures.hazus import DESIGN_LEVELS, building_class, building_types

pytestmark = pytest.mark.fast

DISPLACEMENT, SHEAR = [0.03, 0.3], [2.0e6, 3.0e6]
MASS, HEIGHT = np.array([3.0e5, 2.0e5, 2.0e5, 1.0e5]), np.array([4.5, 3.0, 3.0, 3.0])


@pytest.mark.parametrize("distribution", ["triangular", "first_mode"])
@pytest.mark.parametrize("mass", [2.0e5, MASS])
def test_pushed_building_has_its_pushover_curve(distribution: str, mass: np.ndarray) -> None:
    building = wd.ShearBuilding.from_capacity(DISPLACEMENT, SHEAR, 4, mass, HEIGHT, distribution=distribution)
    roof = np.linspace(0, 0.3, 121)[1:]
    pushed = wd.pushover(building, roof, pattern=distribution)
    expected = np.interp(roof, [0, *DISPLACEMENT], [0, *SHEAR])
    np.testing.assert_allclose(pushed["base_shear"], expected, rtol=1e-8)  # forces balance within 1e-9


@pytest.mark.parametrize("distribution", ["triangular", "first_mode"])
@pytest.mark.parametrize("mass", [2.0e5, MASS])
def test_spectrum_gives_period_and_base_shear(distribution: str, mass: np.ndarray) -> None:
    building = wd.ShearBuilding.from_capacity(
        [0.04, 0.4], [1.5, 3.0], 4, mass, HEIGHT, curve="spectrum", distribution=distribution
    )
    first = building.modal().isel(mode=0)
    assert float(first["period"]) == pytest.approx(2 * np.pi * np.sqrt(0.04 / 1.5), rel=1e-12)
    assert building.parameters["yield_force"][0] == pytest.approx(1.5 * float(first["effective_mass"]), rel=1e-12)
    hardening = (3.0 / 1.5 - 1) / (0.4 / 0.04 - 1)
    np.testing.assert_allclose(building.parameters["hardening_ratio"], hardening, rtol=1e-12)


def test_first_mode_is_that_of_gems_toolkit() -> None:
    """Uniform storeys under a roof of three quarters: drifts Gamma Sd dphi, forces Gamma Sa sum of m phi above."""
    mass = 1.0e5 * np.array([1, 1, 1, 0.75])
    building = wd.ShearBuilding.from_capacity(
        [0.02, 0.2], [2.0, 2.0], 4, mass, 3.0, curve="spectrum", distribution="first_mode"
    )
    matrix = 2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1)
    matrix[3, 3] = 1
    shape = np.ones(4)  # on its way to the first eigenvector, by the power method
    for _ in range(400):
        shape = np.linalg.solve(matrix, mass * shape)
        shape /= shape[-1]
    participation = (mass @ shape) / (mass @ shape**2)
    yield_force = 2.0 * participation * np.cumsum((mass * shape)[::-1])[::-1]
    yield_drift = 0.02 * participation * np.diff(shape, prepend=0.0)
    np.testing.assert_allclose(building.parameters["yield_force"], yield_force, rtol=1e-12)
    np.testing.assert_allclose(building.parameters["stiffness"], yield_force / yield_drift, rtol=1e-12)


def test_triangular_is_lus_and_near_the_hazus_chain() -> None:
    period, storeys = 0.75, 5
    acceleration = 0.208 * 9.8
    displacement = acceleration * (period / (2 * np.pi)) ** 2
    slope = 1 + 0.133025 * 9
    building = wd.ShearBuilding.from_capacity(
        [displacement, 10 * displacement], [acceleration, slope * acceleration], storeys, 1.0e6, 3.05, curve="spectrum"
    )
    hazus = wd.ShearBuilding.from_hazus("C1M", "high", storeys).parameters
    np.testing.assert_allclose(building.parameters["stiffness"], hazus["stiffness"], rtol=1e-12)
    # Lu's cubic for the mass in the first mode is 6e-5 off at five storeys.
    np.testing.assert_allclose(building.parameters["yield_force"], hazus["yield_force"], rtol=1e-4)
    np.testing.assert_allclose(building.parameters["hardening_ratio"], hazus["hardening_ratio"], rtol=1e-12)


def test_many_points_become_the_curve_of_equal_area() -> None:
    x = np.linspace(0, 0.2, 401)
    y = 1.0e6 * np.tanh(x / 0.03) + 2.0e6 * x
    falling = np.append(y, [0.9e6, 0.3e6])  # what comes after the peak has no say
    at, strength, hardening = bilinear_curve(np.append(x, [0.25, 0.3]), falling)
    stiffness = strength / at
    bilinear = np.where(x < at, stiffness * x, strength + hardening * stiffness * (x - at))
    fine = np.linspace(0, 0.2, 200_001)
    area = np.trapezoid(np.where(fine < at, stiffness * fine, strength + hardening * stiffness * (fine - at)), fine)
    assert area == pytest.approx(np.trapezoid(y, x), rel=1e-8)  # the fine sum's own kink
    assert bilinear[-1] == pytest.approx(y[-1], rel=1e-12)
    assert np.interp(0.6 * at, x, y) == pytest.approx(0.6 * strength, rel=1e-12)
    assert 0 < hardening < 0.2


@pytest.mark.parametrize("with_origin", [False, True])
def test_yield_and_ultimate_point_are_taken_as_they_are(with_origin: bool) -> None:
    for end in (2.0e6, 2.1e6, 5.0e6):
        x, y = [0.03, 0.3], [2.0e6, end]
        if with_origin:
            x, y = [0.0, *x], [0.0, *y]
        at, strength, hardening = bilinear_curve(x, y)
        assert at == pytest.approx(0.03, rel=1e-9)
        assert strength == pytest.approx(2.0e6, rel=1e-9)
        assert hardening == pytest.approx((end / 2.0e6 - 1) / 9, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize("with_origin", [False, True])
@pytest.mark.parametrize("design_level", DESIGN_LEVELS)
def test_every_hazus_curve_is_itself(design_level: str, with_origin: bool) -> None:
    for building_type in building_types():
        row = building_class(building_type, design_level)
        over, hardening = row["overstrength_ratio"], row["hardening_ratio"]
        x, y = [1.0, 1 + (over - 1) / hardening], [1.0, over]
        found = bilinear_curve([0.0, *x] if with_origin else x, [0.0, *y] if with_origin else y)
        np.testing.assert_allclose(found, (1.0, 1.0, hardening), rtol=1e-12)


def test_a_point_more_on_its_second_branch_changes_nothing() -> None:
    """Hazus' C1M, high code [inch, g], whose excess of area falls again below 0 towards the peak."""
    x, y = [1.15, 10.0, 18.44], [0.208, np.interp(10.0, [1.15, 18.44], [0.208, 0.624]), 0.624]
    expected = (1.15, 0.208, (0.624 - 0.208) / (18.44 - 1.15) * 1.15 / 0.208)
    np.testing.assert_allclose(bilinear_curve(x, y), expected, rtol=1e-9)


def test_concave_curves_keep_their_area() -> None:
    random, alone = np.random.default_rng(1), 0
    for _ in range(2000):
        points = random.integers(2, 8)
        length, slope = random.uniform(0.05, 1, points), np.sort(random.uniform(0, 1, points))[::-1]
        x, y = np.append(0, np.cumsum(length)), np.append(0, np.cumsum(length * slope))
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            at, strength, hardening = bilinear_curve(x, y)
        if said:  # nearly straight: no yield strength of a thousand gives an area as large
            fits = np.linspace(0, y[-1], 1001)[1:]
            areas = 0.5 * (fits * x[-1] + y[-1] * (x[-1] - np.interp(0.6 * fits, y, x) / 0.6))
            assert areas.max() < np.trapezoid(y, x)
            alone += 1
            continue
        end = strength * (1 + hardening * (x[-1] / at - 1))
        area = 0.5 * at * strength + 0.5 * (strength + end) * (x[-1] - at)
        assert area == pytest.approx(np.trapezoid(y, x), rel=1e-9)
        assert end == pytest.approx(y[-1], rel=1e-9)
        assert 0 < at < x[-1]
        assert 0 <= hardening < 1
        if points > 2:
            assert np.interp(0.6 * at, x, y) == pytest.approx(0.6 * strength, rel=1e-9)
    assert alone < 20


def test_curve_without_a_bilinear_one_is_said() -> None:
    """A soft start up to most of the peak: no secant at 0.6 is stiff enough."""
    with pytest.warns(UserWarning, match="no bilinear curve has the area .* up to its peak, point 3: an elastic"):
        at, strength, hardening = bilinear_curve([0.0, 0.3, 0.35, 1.0], [0.0, 0.6, 0.99, 1.0])
    assert (at, strength, hardening) == pytest.approx((0.5, 1.0, 0.0))


@pytest.mark.parametrize(
    ("displacement", "capacity", "message"),
    [
        ([-0.01, 0.03, 0.3], [-1.0, 2.0, 3.0], r"starts at \(-0.01, -1\), point 0; it must start at the origin"),
        ([0.0, 0.03, 0.3], [0.5, 2.0, 3.0], r"starts at \(0, 0.5\), point 0"),
        ([0.01, 0.03, 0.3], [0.0, 2.0, 3.0], r"starts at \(0.01, 0\), point 0"),
        ([0.03, 0.3, 0.2], [2.0, 3.0, 2.0], "folds back at point 2: its displacement 0.2 is not above 0.3"),
        ([0.03, 0.03, 0.2], [2.0, 3.0, 2.0], "folds back at point 1"),
        ([0.03, 0.1, 0.2], [2.0, 3.0, -2.0], "capacity at point 2 is -2; it must be at least 0"),
        ([0.03], [2.0], "needs a yield point and, after it, another point"),
        ([0.03, 0.1], [2.0, 1.0], "needs a yield point and, after it, another point"),
        ([0.0, 0.1, 0.2], [0.0, 1.0, 3.0], "stiffens up to its peak, point 2"),
        ([0.1, 0.2], [1.0, 3.0], "stiffens up to its peak, point 1"),
        ([0.1, 0.2], [1.0, 2.0], "is a straight line up to its peak, point 1"),
        ([0.1, np.nan], [1.0, 2.0], r"displacement\[1\] is nan"),
        ([0.1, 0.2], [1.0, 2.0, 3.0], "must have the same shape"),
    ],
)
def test_bad_curves_are_named_by_their_point(displacement: list, capacity: list, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wd.ShearBuilding.from_capacity(displacement, capacity, 3, 1.0e5, 3.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"curve": "drift"}, "unknown capacity curve 'drift'; allowed: 'pushover', 'spectrum'"),
        ({"distribution": "lu"}, "unknown distribution over the storeys 'lu'; allowed: 'triangular', 'first_mode'"),
        ({"mass": [1.0, 2.0]}, r"mass must be one value or one per storey \(4\), got shape \(2,\)"),
        ({"height": 0.0}, "height is 0 at storey 1; it must be finite and above 0"),
        ({"law": "steel"}, "unknown storey law 'steel'"),
        ({"law": ["bilinear"] * 2}, r"law must be one name here, .* got \['bilinear', 'bilinear'\]: for storeys"),
        ({"stiffness": 1.0e8}, "stiffness follows from the capacity curve: remove"),
        ({"yield_force": 1.0}, "yield_force follows from the capacity curve: remove"),
        ({"hardening_ratio": 0.1}, "hardening_ratio follows from the capacity curve: remove"),
    ],
)
def test_other_bad_input_is_named(changed: dict, message: str) -> None:
    given = {"mass": 1.0e5, "height": 3.0} | changed
    with pytest.raises(ValueError, match=message):
        wd.ShearBuilding.from_capacity(DISPLACEMENT, SHEAR, 4, **given)
