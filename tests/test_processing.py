"""What is done to records before they are used."""

import numpy as np
import pytest

import warpdyn as wd

pytestmark = pytest.mark.fast

TIME = 0.01 * np.arange(4000)


def test_detrend():
    wave = np.sin(2 * np.pi * TIME)
    wave[-1] = wave[0]
    motion = wd.GroundMotion(0.5 + 0.25 * TIME, 0.01, "line", record="r", component="N")
    line = wd.records.detrend(motion)
    # The line is of least squares over 4,000 values of at most 10.5: rounding of 4,000 terms.
    assert np.abs(line.acceleration).max() < 4000 * 10.5 * 2.3e-16
    assert (line.name, line.record, line.component, line.step) == ("line", "r", "N", 0.01)
    assert wd.records.detrend(motion, "constant").acceleration.mean() == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(ValueError, match="unknown trend 'quadratic'"):
        wd.records.detrend(motion, "quadratic")


@pytest.mark.parametrize("frequency", [0.05, 0.2, 1.0, 5.0, 20.0, 30.0])
def test_band_pass(frequency):
    """A sine comes out with the squared gain of a Butterworth band-pass, and without a shift of phase."""
    sine = np.sin(2 * np.pi * frequency * TIME)
    passed = wd.records.band_pass(wd.GroundMotion(sine, 0.01), 0.2, 20.0, order=2).acceleration
    # The bilinear transform warps frequencies: tan(pi f h) takes the place of pi f h.
    low, high, f = (np.tan(np.pi * each * 0.01) for each in (0.2, 20.0, frequency))
    gain = 1 / (1 + ((f**2 - low * high) / (f * (high - low))) ** 4)
    middle = slice(1500, 2500)
    # At its ends the wave starts and stops, which dies out as exp(-.9 t) from the slower pole, by 15 s from either.
    assert passed[middle] == pytest.approx(gain * sine[middle], abs=1e-3)


def test_bad_corners():
    motion = wd.GroundMotion(np.ones(100), 0.01, "m")
    for lowest, highest in ((1.0, 0.5), (0.1, 50.0)):
        with pytest.raises(ValueError, match=r"motion 'm': corners must be 0 < lowest < highest < 50 Hz"):
            wd.records.band_pass(motion, lowest, highest)
    with pytest.raises(ValueError, match=r"lowest \[Hz\] must be a finite number above 0"):
        wd.records.band_pass(motion, 0.0, 20.0)


def test_trim():
    """Of a constant acceleration, the Arias intensity grows evenly: the shares are shares of the time."""
    motion = wd.GroundMotion(np.r_[np.zeros(50), np.ones(101), np.zeros(50)], 0.01, "m")
    trimmed = wd.records.trim(motion, 0.05, 0.95)
    # A ramp on either side holds a third of an interval, the whole 100.67: 5 % are 4.7 intervals behind the first one,
    # 95 % are 95.3, so that samples 54 to 146 of the record hold both.
    assert trimmed.acceleration.size == 146 - 54 + 1
    assert trimmed.acceleration.tolist() == [1.0] * trimmed.acceleration.size
    padded = wd.records.trim(motion, 0.05, 0.95, pad=0.2)
    assert padded.acceleration.size == trimmed.acceleration.size + 40
    whole = wd.records.trim(motion, 0.05, 0.95, pad=100.0)
    assert whole.acceleration.tolist() == motion.acceleration.tolist()
    # Nothing between the two shares is lost.
    assert trimmed.duration >= wd.SignificantDuration().value(motion)
    for bad in ({"start": 0.95, "end": 0.05}, {"end": 1.0}):
        with pytest.raises(ValueError, match="shares of the Arias intensity must be 0 < start < end < 1"):
            wd.records.trim(motion, **bad)
    with pytest.raises(ValueError, match="'m' is zero throughout"):
        wd.records.trim(wd.GroundMotion([0.0, 0.0], 0.01, "m"))
