"""Synthetic motions: parameters, the random process, spectra of a scenario, and velocity pulses."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy import integrate, signal, stats
from validation import difference

import warpdyn as wd
from warpdyn.engine.kernels.auxiliary.synthetic_motions import launches
from warpdyn.foundations.core.random_numbers import Purpose, normals
from warpdyn.model.ground_motions.synthetic.modulation import gamma_modulation

SCENARIO = wd.RezaeianDerKiureghian(6.5, 20.0, 760.0)
G = 9.80665
# Periods [s], and medians [g] and standard deviations of ln PGA and ln Sa of 2,000 motions of another program.
PERIODS = np.array([0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0])
MEDIANS = np.array([0.144, 0.198, 0.3165, 0.339, 0.259, 0.1663, 0.117, 0.09056, 0.06457, 0.04939, 0.03352, 0.02439])
SPREADS = np.array([0.5572, 0.6064, 0.6526, 0.6511, 0.6967, 0.7156, 0.7089, 0.7069, 0.702, 0.7047, 0.7267, 0.7367])

GOOD = pd.DataFrame({"arias_intensity": [0.5], "duration": 12.0, "middle": 7.0, "frequency": 5.0})
GOOD = GOOD.assign(frequency_slope=-0.1, damping_ratio=0.3)


@pytest.mark.fast
def test_median_parameters_of_a_scenario():
    """Values of another program; the slope differs by its bounds, which the other program does not apply."""
    row = SCENARIO.median_parameters().iloc[0]
    assert row["arias_intensity"] == pytest.approx(0.0230351 * np.pi / 2 * G, rel=3e-6)
    expected = {"duration": 13.8261, "middle": 7.22931, "frequency": 6.59571, "damping_ratio": 0.292499}
    for name, value in expected.items():
        assert row[name] == pytest.approx(value, rel=4e-6)
    assert row["frequency_slope"] == pytest.approx(-0.0893606, rel=3e-5)


@pytest.mark.fast
def test_median_parameters_of_a_reverse_earthquake():
    """The regressions of the source by hand, for M 7, 15 km and 400 m/s, and the quantiles of SciPy."""
    row = wd.RezaeianDerKiureghian(7.0, 15.0, 400.0, "reverse").median_parameters().iloc[0]
    # -2.2962 + 2.9440 - 0.0707 - 1.3564 ln(15 / 25) - 0.2654 ln(400 / 750) = 1.436817
    assert np.log(row["arias_intensity"] / (np.pi / 2 * G)) == pytest.approx(-4.8255 + 1.4318 * 1.436817, abs=2e-6)
    share = stats.norm.cdf([-0.2554, -0.5895, 0.2355, -0.0375, 0.1571])
    assert row["duration"] == pytest.approx(5 + 40 * stats.beta.ppf(share[0], 1.1314, 2.4474), rel=1e-9)
    assert row["middle"] == pytest.approx(0.5 + 39.5 * stats.beta.ppf(share[1], 1.5792, 3.6405), rel=1e-9)
    assert row["frequency"] == pytest.approx(stats.gamma.ppf(share[2], 4.0982, scale=1.4330), rel=1e-9)
    assert row["damping_ratio"] == pytest.approx(0.02 + 0.98 * stats.beta.ppf(share[4], 1.4250, 5.7208), rel=1e-9)
    below, above = 4.8512 / 6.7729 * (1 - np.exp(-2 * 6.7729)), 4.8512 / 17.095 * (1 - np.exp(-0.5 * 17.095))
    left = integrate.quad(lambda x: 4.8512 * np.exp(6.7729 * x), -2.0, row["frequency_slope"])[0]
    assert row["frequency_slope"] < 0
    assert left == pytest.approx(share[3] * (below + above), rel=1e-9)


@pytest.mark.fast
def test_random_parameters_have_the_distributions_of_the_regressions():
    table = SCENARIO.parameters(4000, seed=5)
    of_arias = np.log(table["arias_intensity"] / (np.pi / 2 * G))
    mean = -4.8255 + 1.4318 * 0.736671
    spread = 1.4318 * np.hypot(0.5937, 0.2738)
    # 2 % of the parameter sets are drawn again, which changes the distribution by less than this share.
    assert stats.kstest(of_arias, "norm", (mean, spread)).statistic < 0.02 + 1.63 / np.sqrt(4000)
    assert table["duration"].between(5, 45).all()
    assert table["damping_ratio"].between(0.02, 1).all()
    normal = stats.norm.ppf(stats.beta.cdf((table["damping_ratio"] - 0.02) / 0.98, 1.4250, 5.7208))
    assert np.mean(normal) == pytest.approx(0.65615, abs=0.05)  # three standard errors, and sets drawn again
    frequency = stats.norm.ppf(stats.gamma.cdf(table["frequency"], 4.0982, scale=1.4330))
    # Correlation of the errors of frequency and damping ratio, within three standard errors.
    assert np.corrcoef(normal, frequency)[0, 1] == pytest.approx(0.2814, abs=0.05)
    part = SCENARIO.parameters(3, seed=5, first=7)
    pd.testing.assert_frame_equal(part, table.iloc[7:10])


@pytest.mark.fast
def test_the_modulation_has_its_duration_and_middle():
    duration, middle = np.array([8.0, 14.0, 30.0]), np.array([9.0, 7.2, 16.0])
    shape, scale = gamma_modulation(duration, middle)
    for k, theta, d, t in zip(shape, scale, duration, middle, strict=True):
        law = stats.gamma(k, scale=theta)
        assert law.ppf(0.95) - law.ppf(0.05) == pytest.approx(d, rel=1e-9)
        assert law.ppf(0.45) == pytest.approx(t, rel=1e-9)


def direct(row, index, seed, step, samples):
    """Return a motion by a sum over all values of the noise, and the high-pass filter by SciPy."""
    shape, scale = (float(each) for each in gamma_modulation(np.array(row["duration"]), np.array(row["middle"])))
    law, zeta = stats.gamma(shape, scale=scale), row["damping_ratio"]
    time = step * np.arange(samples)
    noise = normals(seed, index, Purpose.SYNTHETIC_NOISE, np.arange(-(-samples // 2))).ravel()[:samples]
    changing = np.clip(time, law.ppf(0.01), law.ppf(0.99)) - row["middle"]
    omega = 2 * np.pi * np.maximum(row["frequency"] + row["frequency_slope"] * changing, 0.3)
    since = time[:, None] - time[None, :]
    h = omega / np.sqrt(1 - zeta**2) * np.exp(-zeta * omega * since) * np.sin(omega * np.sqrt(1 - zeta**2) * since)
    h = np.where(since > 0, h, 0.0)
    variance = np.sum(h**2, axis=1)
    x = np.divide(h @ noise, np.sqrt(variance), out=np.zeros(samples), where=variance > 0)
    modulated = np.sqrt(row["arias_intensity"] * 2 * G / np.pi * law.pdf(time)) * x
    w = 2 * np.pi * 0.1
    (over,), under, _ = signal.cont2discrete(([1, 0, 0], [1, 2 * w, w**2]), step, method="foh")
    return signal.lfilter(over, under, modulated)


@pytest.fixture(scope="module")
def motions():
    return SCENARIO.motions(64, seed=1)


def test_a_motion_is_the_sum_over_its_noise(motions, measured):
    # The last one decays so slowly that it is divided into parts.
    frequency, slope, damping = [5.0, 2.0, 1.5], [-0.1, -0.3, -0.1], [0.3, 0.1, 0.03]
    table = pd.concat([GOOD] * 3).set_axis([5, 9, 6]).assign(frequency=frequency, frequency_slope=slope)
    table = table.assign(damping_ratio=damping, duration=[5.0, 7.0, 8.0], middle=[3.0, 4.0, 5.0])
    for index, motion in zip(table.index, wd.synthetic_motions(table, seed=1, step=0.02), strict=True):
        expected = direct(table.loc[index], index, 1, 0.02, motion.acceleration.size)
        measured(
            "accelerations of synthetic motions, over their peaks",
            truth="the sum over all values of the noise in NumPy, and the high-pass filter by SciPy",
            value=difference(motion.acceleration, expected) / motion.peak_ground_acceleration,
            bound=1e-6,  # responses end at 1e-7 of their start, and are interpolated within 1e-7
        )
    # A longer step, so that some of the motions get a shorter one.
    longer = SCENARIO.motions(8, seed=1, step=0.04)
    assert {motion.step for motion in longer} >= {0.04, 0.02}
    assert [motion.name for motion in longer] == [motion.name for motion in motions[:8]]
    (alone,) = SCENARIO.motions(1, seed=1, first=5)
    np.testing.assert_allclose(alone.acceleration, motions[5].acceleration, rtol=0, atol=1e-10)


def test_motions_in_the_memory_layout_of_a_gpu_are_those_of_a_cpu(motions, monkeypatch):
    """The kernel of a GPU, here on the CPU: other lanes, and samples of the same time are neighbours."""
    monkeypatch.setattr(launches, "MOST_SAMPLES_ON_A_GPU", 20_000)  # so that there are several launches
    parts = []

    def in_parts_of_a_gpu(given, *arguments):
        found = [None] * given["samples"].size
        for chosen, values in launches.generated_on_gpu(given, *arguments):
            parts.append(values.size)
            for column, place in enumerate(chosen):
                found[place] = values.numpy()[: given["samples"][place], column]
                assert np.isnan(values.numpy()[given["samples"][place] :, column]).all()
        return found

    monkeypatch.setattr(launches, "generated", in_parts_of_a_gpu)
    again = SCENARIO.motions(16, seed=1)
    assert max(parts) <= 20_000
    assert len(parts) > 1
    for one, other in zip(again, motions, strict=False):
        # Sums over some hundred terms in float64, in another order.
        assert difference(one.acceleration, other.acceleration) < 1e-11 * other.peak_ground_acceleration


def test_motions_have_the_energy_and_duration_of_their_parameters(motions):
    table = SCENARIO.parameters(64, seed=1)
    ratio = np.array([wd.AriasIntensity().value(each) for each in motions]) / table["arias_intensity"]
    # The high-pass filter removes 2 to 5 %; ln of the ratio scatters by 0.2 between motions, 0.025 in the mean of 64.
    assert -0.15 < np.log(ratio).mean() < 0.05
    lasting = np.array([wd.SignificantDuration(0.05, 0.95).value(each) for each in motions]) / table["duration"]
    assert np.log(lasting).mean() == pytest.approx(0.0, abs=0.1)


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore:implausible")
def test_spectra_of_2000_motions_agree_with_another_program():
    found = SCENARIO.motions(2000, seed=1)
    spectra = wd.response_spectra(found, PERIODS)["pseudo_spectral_acceleration"].values[:, 0]
    peaks = [each.peak_ground_acceleration for each in found]
    values = np.log(np.column_stack([peaks, spectra]) / G)
    # Both means have a standard error of SPREADS / sqrt(2000); 12 values are compared.
    error = (values.mean(axis=0) - np.log(MEDIANS)) / (SPREADS * np.sqrt(2 / 2000))
    assert np.abs(error).max() < 3.5
    # Standard error of a standard deviation: SPREADS / sqrt(2 * 2000).
    error = (values.std(axis=0, ddof=1) - SPREADS) / (SPREADS * np.sqrt(1 / 2000))
    assert np.abs(error).max() < 3.5


@pytest.mark.fast
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: wd.RezaeianDerKiureghian(65, 20, 760), "magnitude must be from 4 to 9, got 65"),
        (
            lambda: wd.RezaeianDerKiureghian(6.5, 20e3, 760),
            "distance must be at most 300 km, got 20000: give kilometres",
        ),
        (lambda: wd.RezaeianDerKiureghian(6.5, 20, 0.76), "vs30 must be from 100 to 3000 m/s"),
        (
            lambda: wd.RezaeianDerKiureghian(6.5, 20, 760, "normal"),
            "unknown mechanism 'normal'; allowed: 'strike_slip'",
        ),
        (lambda: wd.synthetic_motions(GOOD.drop(columns="middle")), "no column 'middle'"),
        (
            lambda: wd.synthetic_motions(GOOD.assign(duration=40.0)),
            "too long for middle=7 s in row 0.*give a duration bel",
        ),
        (lambda: wd.synthetic_motions(GOOD.assign(damping_ratio=30.0)), "30 in row 0; it must be above 0 and below 1"),
        (lambda: SCENARIO.motions(4, step=1e-6), "step=1e-06 s is too short.*50,000,000 samples.*step=0.005"),
        (lambda: wd.synthetic_motions(GOOD, step=0.1), "step=0.1 s is too long for a filter frequency of 5.511 Hz"),
        (
            lambda: wd.synthetic_motions(GOOD.assign(frequency_slope=-2.0), step=0.03),
            "frequency of 15.21 Hz.*at most 0.0164 s",
        ),
        (
            lambda: wd.synthetic_motions(GOOD.set_axis(["a"])),
            "index of parameters must contain different whole numbers",
        ),
        (lambda: wd.synthetic_motions({"duration": 1}), "must be a pandas DataFrame"),
        (lambda: wd.VelocityPulse(1.0, 0.5, 1.0), "oscillations must be a finite number above 1"),
        (lambda: wd.VelocityPulse(1.0, 0.5, 2.0, time=1.0).motion(0.01, 5.0), "give a time of at least 2 s"),
        (lambda: wd.VelocityPulse(1.0, 0.5, 2.0, time=3.0).added_to(GOOD), "must be a GroundMotion, got DataFrame"),
    ],
)
def test_refused(call, message):
    with pytest.raises((TypeError, ValueError), match=message):
        call()


@pytest.mark.fast
@pytest.mark.parametrize("phase", [0.0, 0.7, np.pi / 2])
def test_a_pulse_is_the_closed_form(phase):
    pulse = wd.VelocityPulse(0.9, 0.5, 1.8, phase, time=4.0)
    step = 1e-3
    motion = pulse.motion(step, 8.0)
    time = step * np.arange(motion.acceleration.size)
    velocity = np.concatenate([[0.0], np.cumsum(step / 2 * (motion.acceleration[1:] + motion.acceleration[:-1]))])
    # The trapezoidal rule errs by step^2 / 12 times the change of the slope.
    np.testing.assert_allclose(velocity, pulse.velocity(time), atol=2e-6)
    displacement = step * np.sum(pulse.velocity(time))
    # Permanent displacement, Dabaghi and Der Kiureghian (2018).
    a, g = phase + 1.8 * np.pi, phase - 1.8 * np.pi
    expected = 0.9 * 2.0 * (np.sin(a) - np.sin(g)) / (4 * np.pi * (1 - 1.8**2))
    assert displacement == pytest.approx(expected, abs=1e-6)
    assert pulse.velocity(4.0) == pytest.approx(0.9 * np.cos(phase))
    assert np.all(pulse.velocity(np.array([4 - 1.81, 4 + 1.81])) == 0)


@pytest.mark.fast
@pytest.mark.meant_as_given("pulse_time")  # the motion is made longer for the pulse
def test_a_pulse_is_added_to_a_motion():
    record = wd.GroundMotion(np.sin(np.arange(300)), 0.01, "record")
    pulse = wd.VelocityPulse(0.5, 1.0, 2.0, time=4.0)
    together = pulse.added_to(record)
    assert together.duration >= 5.0
    np.testing.assert_allclose(
        together.acceleration[:300] - record.acceleration, pulse.acceleration(0.01 * np.arange(300))
    )
