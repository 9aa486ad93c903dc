"""Intensity measures: their values, their names, and what they refuse."""

import numpy as np
import pytest

from warpdyn.intensity import PeakGroundAcceleration, SpectralAcceleration, spectral_acceleration
from warpdyn.motions import GroundMotion


def test_shapes():
    motion = GroundMotion([0.0, 1.0, -2.0, 0.5], 0.1)
    periods = np.array([[0.3, 0.5, 1.0], [2.0, 3.0, 4.0]])
    result = spectral_acceleration(motion, periods)
    assert result.shape == (2, 3)
    assert result[1, 0] == spectral_acceleration(motion, 2.0)
    assert isinstance(spectral_acceleration(motion, 1), float)
    assert spectral_acceleration(motion, []).shape == (0,)


def test_measures():
    motion = GroundMotion([0.0, 1.0, -2.0, 0.5], 0.1)
    assert PeakGroundAcceleration().of(motion) == 2.0
    assert PeakGroundAcceleration().name == "PGA"
    measure = SpectralAcceleration(0.75)
    assert measure.name == "Sa(0.75 s, 5 %)"
    assert SpectralAcceleration(2, damping_ratio=0.025).name == "Sa(2 s, 2.5 %)"
    assert measure.of(motion) == spectral_acceleration(motion, 0.75, 0.05)
    assert measure == SpectralAcceleration(0.75, 0.05)
    with pytest.raises(AttributeError):
        measure.period = 1.0


def test_silence_has_no_intensity():
    motion = GroundMotion(np.zeros(5), 0.1)
    assert SpectralAcceleration(1.0).of(motion) == 0.0
    assert PeakGroundAcceleration().of(motion) == 0.0


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, np.inf, "1", None])
def test_bad_period(period):
    with pytest.raises(ValueError, match="period must be"):
        SpectralAcceleration(period)
    with pytest.raises(ValueError, match="period must be"):
        spectral_acceleration(GroundMotion([0.0, 1.0], 0.1), [1.0, period])


def test_one_measure_has_one_period():
    with pytest.raises(ValueError, match="period must be one number"):
        SpectralAcceleration([0.5, 1.0])


@pytest.mark.parametrize("damping_ratio", [-0.01, 1.0, 5, np.nan, "0.05", None])
def test_bad_damping_ratio(damping_ratio):
    with pytest.raises(ValueError, match="damping_ratio must be a number from 0"):
        SpectralAcceleration(1.0, damping_ratio)
    with pytest.raises(ValueError, match="damping_ratio must be a number from 0"):
        spectral_acceleration(GroundMotion([0.0, 1.0], 0.1), 1.0, damping_ratio)
