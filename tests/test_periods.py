"""Chains made for their periods, against closed forms and scipy's own eigenvalues."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

import warpdyn as wd

pytestmark = pytest.mark.fast


def periods_of(building: wd.ShearBuilding) -> np.ndarray:
    k, storeys = building.parameters["stiffness"], building.storeys
    steps = np.eye(storeys) - np.eye(storeys, k=-1)
    return 2 * np.pi / np.sqrt(eigh(steps.T @ np.diag(k) @ steps, np.diag(building.parameters["mass"]))[0])


def test_uniform_chain_has_the_closed_forms_stiffness() -> None:
    for storeys in (1, 2, 5, 60):
        building = wd.ShearBuilding.from_periods(1.3, storeys, 2.0e5, 3.0)
        stiffness = 2.0e5 * (np.pi / (1.3 * np.sin(np.pi / (4 * storeys + 2)))) ** 2
        np.testing.assert_allclose(building.parameters["stiffness"], stiffness, rtol=1e-10)


def test_linear_mode_is_linear() -> None:
    height = np.array([5.0, 3.0, 3.0, 4.0])
    building = wd.ShearBuilding.from_periods(
        0.8, 4, [3e5, 2e5, 2e5, 1e5], height, distribution="linear_mode", law="bilinear", yield_force=1e6,
        hardening_ratio=0.1,
    )  # fmt: skip
    assert periods_of(building)[0] == pytest.approx(0.8, rel=1e-12)
    shape = building.modal()["shape"].values[0]
    np.testing.assert_allclose(shape, np.cumsum(height) / height.sum(), rtol=1e-12)
    # In storeys of one height and mass: the storey shears of a triangular load.
    equal = wd.ShearBuilding.from_periods(0.8, 5, 1.0e5, 3.0, distribution="linear_mode").parameters["stiffness"]
    np.testing.assert_allclose(equal / equal[0], 1 - np.array([0, 2, 6, 12, 20]) / 30, rtol=1e-12)


@pytest.mark.parametrize(
    ("periods", "storeys"), [([1.0, 0.36], 5), ([1.0, 0.35, 0.2], 5), ([2.0, 0.7, 0.42], 20), ([1.0, 0.38], 2)]
)
@pytest.mark.parametrize("distribution", ["uniform", "linear_mode"])
def test_several_periods_are_met(periods: list[float], storeys: int, distribution: str) -> None:
    building = wd.ShearBuilding.from_periods(periods, storeys, 1.0e5, 3.0, distribution=distribution)
    np.testing.assert_allclose(periods_of(building)[: len(periods)], periods, rtol=2e-9)


def test_all_periods_of_a_chain_are_met() -> None:
    mass = np.array([2.0e5, 2.0e5, 1.5e5, 1.5e5])
    wanted = periods_of(wd.ShearBuilding(mass, [4e8, 3e8, 2.5e8, 1.5e8], 3.0))
    building = wd.ShearBuilding.from_periods(wanted, 4, mass, 3.0)
    np.testing.assert_allclose(periods_of(building), wanted, rtol=2e-9)


def test_few_periods_bend_the_building_smoothly() -> None:
    stiffness = wd.ShearBuilding.from_periods([2.0, 0.7], 20, 1.0e5, 3.0).parameters["stiffness"]
    assert (np.diff(stiffness) < 0).all()
    assert np.abs(np.diff(np.log(stiffness), 2)).max() < 0.02


@pytest.mark.parametrize(
    ("period", "message"),
    [
        # Two equal masses: w1^2 w2^2 = k1 k2 / m^2 and w1^2 + w2^2 = (k1 + 2 k2) / m have no real solution beyond
        # T2 / T1 = sqrt 2 - 1.
        ([1.0, 0.42], "no chain with these masses was found that has these periods: the nearest has"),
        ([1.0, 1.0], "periods must decrease from mode to mode, but mode 2 has 1 s after 1 s"),
        (
            [1.0, 0.3, 0.2],
            r"period must be one value, or a list of at most 2 periods .s., one per mode, got shape \(3,\)",
        ),
        (0.0, "the period of mode 1 is 0 s; it must be above 0"),
        ([1.0, np.inf], r"period\[1\] is inf"),
    ],
)
def test_bad_periods_are_named(period: float | list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wd.ShearBuilding.from_periods(period, 2, 1.0e5, 3.0)


def test_two_storeys_reach_what_algebra_lets_them() -> None:
    building = wd.ShearBuilding.from_periods([1.0, 0.414], 2, 1.0e5, 3.0)
    np.testing.assert_allclose(periods_of(building), [1.0, 0.414], rtol=2e-9)


def test_unknown_distribution_is_named() -> None:
    with pytest.raises(ValueError, match="unknown stiffness distribution 'shear'; allowed: 'uniform', 'linear_mode'"):
        wd.ShearBuilding.from_periods(1.0, 2, 1.0e5, 3.0, distribution="shear")


@pytest.mark.parametrize("period", [1.0, [1.0, 0.35]])
def test_periods_are_those_under_gravity(period: float | list[float]) -> None:
    load, height = np.array([4.0e6, 3.0e6, 2.0e6, 1.0e6]), np.array([4.0, 3.0, 3.0, 3.0])
    building = wd.ShearBuilding.from_periods(period, 4, 1.0e5, height, gravity_load=load)
    left = building.parameters["stiffness"] - np.array([10.0e6 / 4, 6.0e6 / 3, 3.0e6 / 3, 1.0e6 / 3])
    found = periods_of(wd.ShearBuilding(1.0e5, left, height))
    wanted = np.atleast_1d(period)
    np.testing.assert_allclose(found[: wanted.size], wanted, rtol=2e-9)
    np.testing.assert_allclose(building.modal()["period"][: wanted.size], wanted, rtol=2e-9)
    np.testing.assert_allclose(building.parameters["gravity_load"], load)
    if np.ndim(period) == 0:
        np.testing.assert_allclose(left, left[0], rtol=1e-12)  # "uniform" is what gravity leaves


def test_one_gravity_load_serves_every_floor() -> None:
    one, each = (
        wd.ShearBuilding.from_periods(1.0, 3, 1.0e5, 3.0, gravity_load=load) for load in (1.0e6, np.full(3, 1.0e6))
    )
    np.testing.assert_array_equal(one.parameters["stiffness"], each.parameters["stiffness"])
    assert one.fundamental_period == pytest.approx(1.0, rel=1e-9)
    plain = wd.ShearBuilding.from_periods(1.0, 3, 1.0e5, 3.0, gravity_load=None)
    assert "gravity_load" not in plain.parameters
    assert plain.fundamental_period == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"stiffness": 1.0e8}, "stiffness follows from the periods: remove stiffness="),
        ({"gravity_load": [1.0, 2.0]}, r"gravity_load must be one value or one per storey \(3\), got shape \(2,\)"),
        ({"gravity_load": -1.0}, "gravity_load is -1 at storey 1; it must be finite and at least 0"),
        ({"gravity_load": np.nan}, "gravity_load is nan"),
    ],
)
def test_what_the_periods_determine_is_refused(given: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wd.ShearBuilding.from_periods(1.0, 3, 1.0e5, 3.0, **given)
