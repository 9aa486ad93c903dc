"""Efficiency, surfaces and conversion of intensity measures agree with a reference, statsmodels and closed forms.

The reference was computed by another program: the bilinear oscillator of 1 s under the 44 far-field motions, measures
in SI units (m/s2, m/s), where warpdyn has accelerations in g.
"""

import numpy as np
import pytest
import statsmodels.api as sm
import xarray as xr
from scipy.integrate import quad
from scipy.stats import norm

import warpdyn as wd

G = 9.80665
FIV3 = wd.FilteredIncrementalVelocity(1.0, 0.7, 0.85)
AVERAGE = wd.AverageSpectralAcceleration(np.linspace(0.2, 3.0, 10))
# slope, intercept (SI units), efficiency, proficiency, R squared
REFERENCE = {
    wd.PeakGroundAcceleration(): (0.770081, -3.37364, 0.432294, 0.561362, 0.32737),
    wd.SpectralAcceleration(1.0): (0.885352, -3.52246, 0.254652, 0.287628, 0.766594),
    AVERAGE: (1.08116, -3.33294, 0.277226, 0.256414, 0.723378),
    FIV3: (0.820895, -2.02702, 0.349442, 0.425684, 0.560491),
    wd.CumulativeAbsoluteVelocity(): (0.660229, -3.95805, 0.423976, 0.642165, 0.353006),
}
MEASURES = list(REFERENCE)
LEVELS = [0.1, 0.14, 0.18, 0.22, 0.26, 0.3, 0.4, 0.6, 0.8, 1.2]  # g


@pytest.fixture(scope="module")
def motions() -> list[wd.GroundMotion]:
    return list(wd.records.far_field())


def oscillator() -> wd.ShearBuilding:
    mass, omega = 1e5, 2 * np.pi
    law = {"law": "bilinear", "yield_force": [0.1 * G * mass], "hardening_ratio": 0.05}
    damping = {"damping": "rayleigh", "damping_ratio": 0.05}
    return wd.ShearBuilding([mass], [mass * omega**2], 3.0, **law, **damping)


@pytest.fixture(scope="module")
def cloud(motions) -> xr.Dataset:
    scene = wd.Scene(oscillator(), wd.Cloud(motions), recorders=("drift",), tail=5.0)
    return wd.simulate(scene, dtype="float64")


def test_fiv3_and_average_spectral_accelerations_are_those_of_the_reference(motions):
    time = np.arange(0, 20.005, 0.01)
    pulse = wd.GroundMotion(4.0 * np.sin(2 * np.pi * time / 0.8) * np.exp(-0.25 * time), 0.01, "P1")
    both = [pulse, motions[0]]
    np.testing.assert_allclose(FIV3.values(both), [0.131156, 0.92126], rtol=5e-6)
    shorter = wd.AverageSpectralAcceleration(np.linspace(0.2, 2.0, 10))
    np.testing.assert_allclose(shorter.values(both), [5.51061, 6.46715], rtol=3e-5)
    np.testing.assert_allclose(AVERAGE.values(both), [3.63415, 4.1753], rtol=3e-5)
    doubled = wd.GroundMotion(2 * motions[0].acceleration, motions[0].step)
    assert FIV3.value(doubled) == pytest.approx(2 * FIV3.value(motions[0]), rel=1e-12)


def test_efficiency_and_proficiency_are_those_of_the_reference(cloud, motions):
    drift = cloud["peak_storey_drift"].values[:, 0]
    assert np.exp(np.log(drift).mean()) == pytest.approx(0.0903477, rel=2e-3)
    found = wd.compare_measures(cloud, motions, MEASURES, demand="peak_storey_drift")
    slope, intercept, efficiency, proficiency, determination = np.array(list(REFERENCE.values())).T
    to_g = np.where([each.level_units == "g" for each in MEASURES], slope * np.log(G), 0.0)
    np.testing.assert_allclose(found["slope"], slope, rtol=2e-3)
    np.testing.assert_allclose(found["intercept"], intercept + to_g, atol=4e-3)
    np.testing.assert_allclose(found["efficiency"], efficiency, rtol=2e-3)
    np.testing.assert_allclose(found["proficiency"], proficiency, rtol=3e-3)
    np.testing.assert_allclose(found["determination"], determination, rtol=4e-3)
    assert (found["efficiency_lower"] < efficiency).all()
    assert (found["efficiency_upper"] > efficiency).all()


def test_sufficiency_is_the_p_value_of_statsmodels_for_structures_and_scaled_motions(motions):
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3))}
    scene = wd.Scene(oscillator(), wd.Cloud(motions), scatter, recorders=("drift",))
    run = wd.simulate(scene, structures=3, seed=1)
    magnitude = 6.5 + 0.02 * np.arange(44) + 0.2 * np.sin(np.arange(44))
    found = wd.compare_measures(run, motions, MEASURES[:2], covariates={"magnitude": magnitude})
    ln_demand, index = np.log(run["peak_storey_drift_ratio"].values[:, 0]), run["motion_index"].values
    for place, measure in enumerate(MEASURES[:2]):
        x = np.log(measure.values(motions))[index]
        line = sm.OLS(ln_demand, sm.add_constant(x)).fit()
        assert float(found["efficiency"][place]) == pytest.approx(np.sqrt(line.mse_resid), rel=1e-6)
        mean = np.bincount(index, line.resid) / np.bincount(index)
        expected = sm.OLS(mean, sm.add_constant(magnitude)).fit().pvalues[1]
        assert float(found["sufficiency"].sel(covariate="magnitude")[place]) == pytest.approx(expected, rel=1e-5)
    factors = np.linspace(0.5, 2.0, 44)
    one_each = wd.OneMotionPerStructure(motions, motion=np.arange(44), scale=factors)
    scaled = wd.simulate(wd.Scene(oscillator(), one_each, recorders=("drift",)))
    arias = wd.AriasIntensity()
    x = np.log(arias.values(motions) * factors**2)
    y = np.log(scaled["peak_storey_drift_ratio"].values[:, 0])
    slope = float(wd.compare_measures(scaled, motions, [arias])["slope"][0])
    assert slope == pytest.approx(sm.OLS(y, sm.add_constant(x)).fit().params[1], rel=1e-6)


def test_a_surface_is_the_probit_of_statsmodels(motions):
    stripes = wd.Stripes(motions, LEVELS, wd.SpectralAcceleration(1.0))
    run = wd.simulate(wd.Scene(oscillator(), stripes, recorders=("drift",)))
    limits = {"slight": 0.02, "extensive": 0.06}
    both = wd.SpectralAcceleration(1.0), wd.SpectralAcceleration(2.0)
    found = wd.fragility_surface(run, limits, motions, both)
    index, factor = run["motion_index"].values, run["scale_factor_of_motion"].values
    x = np.log([each.values(motions)[index] * factor / G for each in both]).T
    drift = run["peak_storey_drift_ratio"].values[:, 0]
    for state, limit in limits.items():
        exceeds = (drift > limit) | (run["status"].values == 1)
        expected = sm.Probit(exceeds, sm.add_constant(x)).fit(disp=0, tol=1e-12, maxiter=100).params
        row = found.sel(damage_state=state)
        np.testing.assert_allclose(row["coefficient"], expected, rtol=1e-6)
        assert (row["coefficient_lower"] < expected).all()
        assert (row["coefficient_upper"] > expected).all()
        at = row.isel(first_intensity=20, second_intensity=10)
        eta = expected @ [1, np.log(float(at["first_intensity"])), np.log(float(at["second_intensity"]))]
        assert float(at["probability"]) == pytest.approx(norm.cdf(eta), rel=1e-6)
    # Long periods matter beyond yield: the second measure adds information.
    assert float(found["coefficient_lower"].sel(damage_state="extensive", term="second")) > 0


def given_curves(median: float, dispersion: float) -> xr.Dataset:
    values = {
        "fragility_median": ("damage_state", [median], {"units": "g"}),
        "fragility_dispersion": ("damage_state", [dispersion]),
        "replicate_median": (("replicate", "damage_state"), np.full((50, 1), median)),
        "replicate_dispersion": (("replicate", "damage_state"), np.full((50, 1), dispersion)),
    }
    return xr.Dataset(values, {"damage_state": ["slight"]}, {"intensity_measure": "PGA"})


def test_a_converted_curve_is_the_mean_of_the_curve_over_the_scatter_of_the_first_measure(motions):
    first, second = wd.PeakGroundAcceleration(), wd.SpectralAcceleration(1.0)
    found = wd.convert_curves(given_curves(0.5, 0.4), motions, first, second)
    line = sm.OLS(np.log(first.values(motions) / G), sm.add_constant(np.log(second.values(motions) / G))).fit()
    assert float(found["slope"]) == pytest.approx(line.params[1], rel=1e-9)
    deviation = np.sqrt(line.mse_resid)
    assert float(found["residual_dispersion"]) == pytest.approx(deviation, rel=1e-9)
    for level in (0.2, 0.6, 1.5):  # probability of exceedance at this Sa, by quadrature over PGA
        centre = line.params @ [1, np.log(level)]

        def density(x: float, centre: float = centre) -> float:
            return norm.pdf(x, centre, deviation) * norm.cdf((x - np.log(0.5)) / 0.4)

        expected = quad(density, centre - 10 * deviation, centre + 10 * deviation, epsabs=1e-12)[0]
        z = np.log(level / float(found["fragility_median"][0])) / float(found["fragility_dispersion"][0])
        assert norm.cdf(z) == pytest.approx(expected, rel=1e-8)
    assert float(found["fragility_dispersion"][0]) > 0.4
    assert float(found["fragility_median_lower"][0]) < float(found["fragility_median"][0])
    hazard = wd.HazardCurve([0.05, 0.2, 1.0, 4.0], [2e-2, 3e-3, 1e-4, 5e-7], measure="SA(1.0)")
    assert float(wd.annual_rates(found, hazard)["annual_rate"][0]) > 0
    same = wd.convert_curves(given_curves(0.5, 0.4), motions, first, first)
    assert float(same["fragility_median"][0]) == pytest.approx(0.5, rel=1e-9)
    assert float(same["fragility_dispersion"][0]) == pytest.approx(0.4, rel=1e-9)


def test_other_motions_measures_and_curves_are_refused(cloud, motions):
    with pytest.raises(ValueError, match="motions= must be the 44 motions of the run's scene"):
        wd.compare_measures(cloud, motions[:10], MEASURES[:1])
    with pytest.raises(TypeError, match="measures must be intensity measures"):
        wd.compare_measures(cloud, motions, ["PGA"])
    with pytest.raises(ValueError, match=r"covariates\['magnitude'\] must be a row of 44 numbers"):
        wd.compare_measures(cloud, motions, MEASURES[:1], covariates={"magnitude": [7.0]})
    limits = {"slight": 0.02}
    with pytest.raises(ValueError, match="measures must be two intensity measures"):
        wd.fragility_surface(cloud, limits, motions, MEASURES[:1])
    with pytest.raises(ValueError, match="proportional or constant"):
        wd.fragility_surface(cloud, limits, motions, (MEASURES[0], MEASURES[0]))
    with pytest.warns(UserWarning, match="damage state 'far' has no surface"):
        surface = wd.fragility_surface(cloud, {"far": 0.19}, motions, (MEASURES[0], MEASURES[1]))
    assert np.isnan(surface["coefficient"]).all()
    curves = given_curves(0.5, 0.4)
    with pytest.raises(ValueError, match=r"the curves are of 'PGA', but measure= is 'Sa\(1 s, 5 %\)'"):
        wd.convert_curves(curves, motions, MEASURES[1], MEASURES[0])
    with pytest.raises(ValueError, match="at least 4 motions, got 2"):
        wd.convert_curves(curves, motions[:2], MEASURES[0], MEASURES[1])
    with pytest.raises(ValueError, match=r"the cut-off frequency 85 Hz must be below 50 Hz"):
        wd.FilteredIncrementalVelocity(0.01, 0.7, 0.85).value(motions[0])
    with pytest.raises(ValueError, match=r"FilteredIncrementalVelocity.beta must be a finite number above 0"):
        wd.FilteredIncrementalVelocity(1.0, 0.7, 0.0)
