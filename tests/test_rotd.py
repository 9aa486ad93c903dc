"""Response spectra of pairs of components: RotD50, RotD100, geometric mean, larger component."""

from __future__ import annotations

import numpy as np
import pytest
from public_names import problems

import warpdyn as wd
from warpdyn.model.ground_motions.measures import rotd

PERIODS = np.array([0.2, 0.5, 1.0, 2.5])
STEP = 0.02


def pair(record: str, seed: int, angle: float = 0.0) -> list[wd.GroundMotion]:
    """Return two random components, turned by an angle [degrees]."""
    random = np.random.default_rng(seed)
    time = STEP * np.arange(600)
    rows = 2.0 * random.normal(size=(2, time.size)) * np.exp(-(((time - 4) / 2) ** 2))
    rows[1] = 0.6 * rows[1] + 0.3 * rows[0]
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turned = np.array([[c, s], [-s, c]]) @ rows
    return [
        wd.GroundMotion(row, STEP, f"{record}-{i}", record=record, component="NE"[i]) for i, row in enumerate(turned)
    ]


@pytest.fixture(scope="module")
def spectra():
    return rotd.pair_response_spectra([*pair("a", 1), *pair("b", 2)], PERIODS, device="cpu")


def test_spectra_are_those_of_the_intensity_measures(spectra) -> None:
    motions = [*pair("a", 1), *pair("b", 2)]
    for period in PERIODS:
        found = spectra.sel(period=period)
        mean = wd.GeometricMean(wd.SpectralAcceleration(period)).values(motions)[::2]
        assert found["geometric_mean"].values == pytest.approx(mean, rel=1e-12)
        for percentile in (50, 100):
            expected = wd.RotatedSpectralAcceleration(period, percentile=percentile).values(motions)[::2]
            assert found["rotated"].sel(percentile=percentile).values == pytest.approx(expected, rel=1e-12)
        both = wd.SpectralAcceleration(period).values(motions).reshape(2, 2)
        assert found["larger_component"].values == pytest.approx(both.max(axis=1), rel=1e-12)
    single = wd.response_spectra(motions, PERIODS, device="cpu")["pseudo_spectral_acceleration"].values[:, 0]
    assert spectra["components"].values.reshape(4, -1) == pytest.approx(single, rel=1e-12)
    assert spectra["record"].values.tolist() == ["a", "b"]


def test_spectra_are_ordered(spectra) -> None:
    rotated = spectra["rotated"]
    assert (rotated.sel(percentile=50) < rotated.sel(percentile=100)).all()
    assert (spectra["geometric_mean"] <= spectra["larger_component"]).all()
    assert (spectra["larger_component"] <= rotated.sel(percentile=100) * (1 + 1e-12)).all()
    # The larger of two perpendicular components is at least the largest of all directions over the square root of 2.
    assert (spectra["larger_component"] >= rotated.sel(percentile=100) / np.sqrt(2) * (1 - 1e-3)).all()


def test_rotated_spectra_do_not_depend_on_the_directions_of_the_sensors(spectra) -> None:
    turned = rotd.pair_response_spectra([*pair("a", 1, 37.0), *pair("b", 2, 37.0)], PERIODS, device="cpu")
    assert turned["rotated"].values == pytest.approx(spectra["rotated"].values, rel=1e-9)
    # The geometric mean in the recorded directions does.
    assert np.abs(turned["geometric_mean"] / spectra["geometric_mean"] - 1).max() > 0.01


def test_a_motion_in_one_direction_has_the_closed_form() -> None:
    north, _ = pair("a", 3)
    east = wd.GroundMotion(north.acceleration, STEP, "east", record="a", component="E")
    found = rotd.pair_response_spectra([north, east], 0.7, percentiles=[0, 50, 100], device="cpu").squeeze()
    one = wd.SpectralAcceleration(0.7).value(north)
    # sqrt(2) |cos(angle - 45 degrees)|, whose median over whole degrees is between those at 45 and 46 degrees.
    assert found["rotated"].sel(percentile=100) == pytest.approx(np.sqrt(2) * one, rel=1e-9)
    assert found["rotated"].sel(percentile=0) == pytest.approx(0, abs=1e-9)
    median = np.median(np.abs(np.cos(np.radians(np.arange(180) - 45))))
    assert np.cos(np.radians(46)) < median < np.cos(np.radians(44))
    assert found["rotated"].sel(percentile=50) == pytest.approx(np.sqrt(2) * median * one, rel=1e-9)
    assert found["geometric_mean"] == pytest.approx(one, rel=1e-9)
    assert found["larger_component"] == pytest.approx(one, rel=1e-9)


def test_a_circular_harmonic_motion_has_the_same_spectrum_in_all_directions() -> None:
    time = STEP * np.arange(3000)
    rows = (np.sin(3 * time), np.cos(3 * time) * (1 - np.exp(-time)))
    motions = [wd.GroundMotion(row, STEP, f"{i}", record="a", component="NE"[i]) for i, row in enumerate(rows)]
    found = rotd.pair_response_spectra(motions, 2 * np.pi / 3, percentiles=[0, 100], device="cpu").squeeze()
    # Resonance: 1 / (2 zeta).
    assert found["rotated"].values == pytest.approx([10.0, 10.0], rel=0.02)


def test_rotd_is_documented() -> None:
    assert problems("pair_response_spectra", rotd.pair_response_spectra) == []


WRONG = [
    (dict(periods=[0.0]), "periods must be finite and above 0 s"),
    (dict(periods=[[0.5]]), "periods must be one value or a 1-D array"),
    (dict(damping_ratio=1.0), "damping_ratio must be one number from 0"),
    (dict(damping_ratio=[0.02, 0.05]), "damping_ratio must be one number from 0"),
    (dict(percentiles=[101.0]), "percentiles must be one row of numbers from 0 to 100"),
]


@pytest.mark.parametrize(("changes", "message"), WRONG)
def test_invalid_arguments_are_refused(changes, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        rotd.pair_response_spectra(pair("a", 1), **{"periods": [0.5]} | changes)


def test_motions_that_are_not_pairs_are_refused() -> None:
    with pytest.raises(ValueError, match="must have 2 horizontal components, has 1"):
        rotd.pair_response_spectra(pair("a", 1)[:1], [0.5])
    first, second = pair("a", 1)
    slow = wd.GroundMotion(second.acceleration, 0.03, "slow", record="a", component="E")
    with pytest.raises(ValueError, match=r"both need the same step: call motion.resampled\(0.02\)"):
        rotd.pair_response_spectra([first, slow], [0.5], device="cpu")
