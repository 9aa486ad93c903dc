"""Correlation of spectral accelerations, conditional spectra, and targets that are refused."""

from __future__ import annotations

import numpy as np
import pytest
from selection_library import median, sigma
from validation import difference, relative_difference

import warpdyn as wd
from warpdyn.model.ground_motions.measures.one_component import AverageSpectralAcceleration

pytestmark = pytest.mark.fast

# Baker and Jayaram (2008): periods [s] and correlation, recomputed from the published formula by another program.
CORRELATIONS = [
    (0.01, 0.05, 0.947631),
    (0.05, 0.1, 0.942121),
    (0.05, 0.15, 0.915305),
    (0.1, 0.19, 0.799616),
    (0.1, 0.5, 0.474524),
    (0.05, 1.0, 0.415716),
    (0.2, 1.0, 0.444425),
    (0.3, 0.5, 0.814125),
    (0.5, 1.0, 0.749021),
    (0.02, 3.0, 0.236239),
    (0.11, 0.12, 0.968159),
    (0.108, 0.15, 0.883418),
]
# Period [s], median [g] and dispersion of Boore et al. (2014) for M 6.5, Rjb 11 km, Vs30 259 m/s and strike slip;
# median [g] and dispersion given 1.9 standard deviations at 1.5 s (OpenQuake 3.26 and pygmm agree within 3e-7).
BOORE = np.array(
    [
        (0.02, 0.267494, 0.597134, 0.423868, 0.545776),
        (0.1, 0.434517, 0.703391, 0.556486, 0.691233),
        (0.2, 0.629119, 0.601457, 0.914781, 0.568268),
        (0.5, 0.519997, 0.6109, 1.05394, 0.484709),
        (1.0, 0.313311, 0.6832, 0.947047, 0.357524),
        (1.5, 0.200153, 0.689991, 0.742531, 0.0),
        (3.0, 0.0821603, 0.708165, 0.225087, 0.469192),
        (10.0, 0.00937169, 0.649567, 0.0146164, 0.605985),
    ]
)
ONE, PERIODS = wd.SpectralAcceleration(1.0), np.array([0.2, 0.5, 0.75, 1.0, 2.0])


def test_correlations_are_those_of_the_publication(measured):
    first, second, expected = np.array(CORRELATIONS).T
    measured(
        "correlations of spectral accelerations at 12 pairs of periods",
        truth="Baker and Jayaram (2008), recomputed by another program and printed with six digits",
        value=difference(wd.spectral_correlation(first, second), expected),
        bound=5.1e-7,
    )
    np.testing.assert_array_equal(wd.spectral_correlation(first, second), wd.spectral_correlation(second, first))


def test_a_conditional_spectrum_of_a_ground_motion_model(measured):
    period, of_model, spread, expected, left = BOORE.T
    target = wd.conditional_spectrum(period, of_model, spread, wd.SpectralAcceleration(1.5), epsilon=1.9)
    measured(
        "medians of a conditional spectrum for the ground-motion model of Boore et al. (2014)",
        truth="another program, with the correlation of Baker and Jayaram (2008), printed with six digits",
        value=relative_difference(target.median, expected),
        bound=5e-6,
    )
    np.testing.assert_allclose(target.dispersion, left, atol=2e-6)
    assert target.level == pytest.approx(0.742531, rel=3e-6)


def test_the_covariance_is_that_of_a_million_samples():
    target = wd.conditional_spectrum(PERIODS, median(PERIODS), sigma(PERIODS), ONE, epsilon=1.5)
    assert target.covariance[0, 4] == pytest.approx(-0.0261657, abs=6e-8)  # published values of another program
    assert target.covariance[1, 2] == pytest.approx(0.0602035, abs=6e-8)
    again = wd.conditional_spectrum(PERIODS, median(PERIODS), sigma(PERIODS), ONE, level=target.level)
    np.testing.assert_allclose(again.median, target.median, rtol=1e-12)


def test_a_spectrum_given_the_average_over_periods():
    own = np.union1d(np.round(0.2 * np.arange(1, 11), 6), [0.05, 0.3, 5.0])
    measure = AverageSpectralAcceleration(np.round(0.2 * np.arange(1, 11), 6))
    target = wd.conditional_spectrum(own, median(own), sigma(own), measure, epsilon=1.0)
    assert target.level == pytest.approx(0.151417 * np.exp(0.512854), rel=4e-6)  # six printed digits of both
    for period, rho in ((0.05, 0.50605), (0.3, 0.66967), (1.0, 0.937479), (5.0, 0.517517)):
        place = int(np.flatnonzero(own == period)[0])
        assert target.mean[place] == pytest.approx(np.log(median(period)) + rho * sigma(period), abs=2e-6)
        assert target.dispersion[place] == pytest.approx(sigma(period) * np.sqrt(1 - rho**2), abs=2e-6)


def test_several_scenarios_have_the_law_of_total_variance():
    medians = np.array([median(PERIODS), 0.6 * median(PERIODS) * PERIODS**0.2])
    spreads, shares = np.array([sigma(PERIODS), 1.1 * sigma(PERIODS)]), np.array([0.3, 0.7])
    target = wd.conditional_spectrum(PERIODS, medians, spreads, ONE, level=0.4, weights=10 * shares)
    parts = [wd.conditional_spectrum(PERIODS, a, b, ONE, level=0.4) for a, b in zip(medians, spreads, strict=True)]
    mean = sum(p * part.mean for p, part in zip(shares, parts, strict=True))
    variance = sum(p * (part.dispersion**2 + (part.mean - mean) ** 2) for p, part in zip(shares, parts, strict=True))
    np.testing.assert_allclose(target.mean, mean, atol=1e-12)
    np.testing.assert_allclose(target.dispersion**2, variance, atol=1e-12)


def test_spectra_of_openquake(tmp_path):
    file = tmp_path / "conditional-spectrum-0.csv"
    file.write_text(
        "#,,,,\"generated_by='OpenQuake engine 3.21.0', site_id=0, lon=0.0, lat=0.1\"\n"
        "poe,stat,period,mea,std\n2.0E-02,mean,0.0,5.05591E-01,2.70195E-01\n2.0E-02,mean,0.1,1.03518E+00,3.87262E-01\n"
        "2.0E-02,mean,0.2,1.38210E+00,1.02245E-02\n1.0E-01,mean,0.0,2.0E-01,2.7E-01\n1.0E-01,mean,0.1,4.0E-01,3.9E-01\n"
        "1.0E-01,mean,0.2,6.0E-01,1.0E-02\n1.0E-01,mean,1.0,2.0E-01,5.0E-01\n"
    )
    frequent, rare = wd.read_openquake_spectrum(file, wd.SpectralAcceleration(0.2))
    assert (frequent.level, rare.level) == (0.6, 1.3821)
    np.testing.assert_array_equal(rare.periods, [0.1, 0.2])
    np.testing.assert_allclose(rare.dispersion, [0.387262, 0.0])
    a, b, c = (float(wd.spectral_correlation(*pair)) for pair in ((0.1, 1.0), (0.1, 0.2), (0.2, 1.0)))
    partial = (a - b * c) / np.sqrt((1 - b**2) * (1 - c**2))
    assert frequent.covariance[0, 2] == pytest.approx(0.39 * 0.5 * partial, rel=1e-12)
    file.write_text(
        file.read_text() + "2.0E-02,quantile-0.5,0.1,9.0E-01,3.8E-01\n2.0E-02,quantile-0.5,0.2,1.2,1.0E-02\n"
    )
    assert [target.level for target in wd.read_openquake_spectrum(file, wd.SpectralAcceleration(0.2))] == [0.6, 1.3821]
    (middle,) = wd.read_openquake_spectrum(file, wd.SpectralAcceleration(0.2), statistic="quantile-0.5")
    assert middle.level == 1.2
    with pytest.raises(ValueError, match=r"unknown statistic 'quantile-0.8'.*'mean'"):
        wd.read_openquake_spectrum(file, wd.SpectralAcceleration(0.2), statistic="quantile-0.8")
    with pytest.raises(ValueError, match=r"no row for the conditioning period 0.5 s.*\[0.1, 0.2"):
        wd.read_openquake_spectrum(file, wd.SpectralAcceleration(0.5))


def correlated(correlation):
    return wd.conditional_spectrum(*GOOD, ONE, level=0.1, correlation=correlation)


GOOD = ([0.5, 1.0], [0.3, 0.2], [0.4, 0.5])
CROSSED = [[0.16, 0.3], [0.3, 0.25]]  # a correlation of 1.5


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: wd.TargetSpectrum(*GOOD[:2], CROSSED), r"not positive semidefinite \(least eigenvalue -0.0"),
        (lambda: wd.TargetSpectrum(*GOOD[:2], [[0.1, 0.2], [0.0, 0.1]]), "not symmetric: 0.2 and 0 for 0.5 and 1 s"),
        (lambda: wd.TargetSpectrum(*GOOD[:2], [40.0, 50.0]), "give the covariance of natural logarithms"),
        (lambda: wd.TargetSpectrum(*GOOD, wd.SpectralAcceleration(2.0)), r"2 s is not one of periods=\[0.5, 1.0\]"),
        (lambda: wd.TargetSpectrum(*GOOD, level=0.3), "level belongs to a conditioning measure"),
        (lambda: wd.TargetSpectrum([1.0, 0.5], *GOOD[1:]), "increasing periods"),
        (lambda: wd.conditional_spectrum(*GOOD, ONE), "either level= .g. or epsilon="),
        (lambda: wd.conditional_spectrum(*GOOD, wd.SpectralAcceleration(0.7), level=0.1), "0.7 s is missing: add it"),
        (lambda: wd.conditional_spectrum(*GOOD, wd.PeakGroundAcceleration(), level=0.1), "conditioning must be wd.Sp"),
        (lambda: wd.conditional_spectrum(*GOOD, wd.SpectralAcceleration(1.0, 0.02), level=0.1), "damping ratio 0.02"),
        (lambda: correlated(lambda a, b: 0.5 + 0 * a * b), "with itself that is not 1: 0.5 for 0.5 and 0.5 s"),
        (lambda: correlated(lambda a, b: np.ones(2)), r"shape \[2, 2\].*got shape \(2,\)"),
        (
            lambda: correlated(lambda a, b: 1 + 0.3 * (a < b)),
            "differ if both periods are exchanged: 1.3 for 0.5 and 1 s",
        ),
        (lambda: correlated(lambda a, b: 1.0 + np.abs(a - b)), "a value outside -1 to 1: 1.5 for 0.5 and 1 s"),
        (lambda: wd.spectral_correlation(0.5, 12.0), "periods from 0.01 to 10 s.*got 12"),
        (lambda: wd.ground_motion_model("Boore", [0.5], [6.5]), "parameters must be a dict of numbers"),
    ],
)
def test_refused(call, message):
    with pytest.raises((TypeError, ValueError), match=message):
        call()


def test_a_model_of_openquake():
    pytest.importorskip("openquake.hazardlib")
    scenario = {"mag": 6.5, "rjb": 11.0, "vs30": 259.0, "rake": 0.0}
    of_model, spread = wd.ground_motion_model("BooreEtAl2014", BOORE[:, 0], scenario)
    np.testing.assert_allclose(of_model, BOORE[:, 1], rtol=3e-6)
    np.testing.assert_allclose(spread, BOORE[:, 2], rtol=3e-6)
    with pytest.raises(ValueError, match="missing or unknown: vs30"):
        wd.ground_motion_model("BooreEtAl2014", [1.0], {"mag": 6.5, "rjb": 11.0, "rake": 0.0})
