"""Comparisons, surfaces and conversions of intensity measures refuse or warn of input that has no meaningful result."""

import warnings

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd

pytestmark = pytest.mark.fast

PGA, SA = wd.PeakGroundAcceleration(), wd.SpectralAcceleration(0.5)


def noise(seed: int, size: int = 400) -> wd.GroundMotion:
    random = np.random.default_rng(seed)
    values = random.normal(size=size) * np.exp(random.normal(0.0, 0.6)) * np.hanning(size)
    return wd.GroundMotion(values - values.mean(), 0.02, f"noise {seed}")


def building() -> wd.ShearBuilding:
    return wd.ShearBuilding([1e5, 1e5], [8e7, 6e7], 3.0, damping="rayleigh", damping_ratio=0.05)


@pytest.fixture(scope="module")
def motions() -> list[wd.GroundMotion]:
    return [noise(seed) for seed in range(8)]


@pytest.fixture(scope="module")
def cloud(motions) -> xr.Dataset:
    return wd.simulate(wd.Scene(building(), wd.Cloud(motions), recorders=("drift",)))


def curves(median: float = 0.3, dispersion: float = 0.4) -> xr.Dataset:
    values = {
        "fragility_median": ("damage_state", [median], {"units": "g"}),
        "fragility_dispersion": ("damage_state", [dispersion]),
    }
    return xr.Dataset(values, {"damage_state": ["slight"]}, {"intensity_measure": "PGA"})


@pytest.mark.parametrize("change", ["scaled", "other", "other step"])
def test_other_motions_of_the_same_names_are_refused_by_name(cloud, motions, change):
    values, step = motions[3].acceleration, 0.02
    if change == "scaled":
        values = 5 * values
    elif change == "other":
        values = noise(100).acceleration
    else:
        step = 0.01
    given = [*motions[:3], wd.GroundMotion(values, step, motions[3].name), *motions[4:]]
    with pytest.raises(ValueError, match=r"'noise 3' in motions= has a (peak acceleration|step) of"):
        wd.compare_measures(cloud, given, [PGA])
    with pytest.raises(ValueError, match=r"'noise 3' in motions= has a (peak acceleration|step) of"):
        wd.fragility_surface(cloud, {"slight": 0.002}, given, (PGA, SA))


def test_a_measure_that_is_constant_over_the_samples_is_refused_by_name(motions):
    stripe = wd.Stripes(motions, [0.2], PGA)
    run = wd.simulate(wd.Scene(building(), stripe, recorders=("drift",)))
    with pytest.raises(ValueError, match=r"PGA is 0.2 g in all samples.*remove it from measures="):
        wd.compare_measures(run, motions, [SA, PGA])


def test_motions_with_samples_count(cloud, motions):
    few = cloud.isel(sample=cloud["motion_index"].values < 3)
    with pytest.raises(ValueError, match="samples of at least 4 motions, got 3"):
        wd.compare_measures(few, motions, [PGA])
    part = wd.compare_measures(cloud.isel(sample=cloud["motion_index"].values < 5), motions, [SA])
    alone = wd.simulate(wd.Scene(building(), wd.Cloud(motions[:5]), recorders=("drift",)))
    expected = wd.compare_measures(alone, motions[:5], [SA])
    assert part.attrs["motions"] == 5
    # Student's t of 4 degrees of freedom in both, although the first run lists 8 motions.
    for name in ("efficiency", "efficiency_lower", "efficiency_upper", "proficiency_upper"):
        np.testing.assert_allclose(part[name], expected[name], rtol=1e-4)


def test_invalid_lists_of_measures_are_refused(cloud, motions):
    with pytest.raises(ValueError, match="measures= is empty"):
        wd.compare_measures(cloud, motions, [])
    with pytest.raises(TypeError, match="measures must be a list of intensity measures"):
        wd.compare_measures(cloud, motions, PGA)
    with pytest.raises(ValueError, match="PGA occurs twice in measures="):
        wd.compare_measures(cloud, motions, [PGA, SA, PGA])


def test_a_surface_of_nearly_collinear_measures_warns_of_collinearity(cloud, motions):
    close = wd.SpectralAcceleration(0.5 * (1 + 2e-7))
    limit = float(np.median(cloud["peak_storey_drift_ratio"].max("storey")))
    with pytest.warns(UserWarning, match="nearly collinear"):
        wd.fragility_surface(cloud, {"slight": limit}, motions, (SA, close))


def test_conversions_with_doubtful_results_warn(motions):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.convert_curves(curves(), motions, PGA, SA)
    with pytest.warns(UserWarning, match=r"dispersion of 'slight' in curves= is 40: .*not percent"):
        wd.convert_curves(curves(dispersion=40.0), motions, PGA, SA)
    with pytest.warns(UserWarning, match=r"the converted dispersion of 'slight' is .*above 1.5"):
        wd.convert_curves(curves(dispersion=1.9), motions, PGA, SA)
    with pytest.warns(UserWarning, match="median of 'slight', 30 g, is far outside the range of the motions"):
        wd.convert_curves(curves(median=30.0), motions, PGA, SA)
    nearly_equal = [
        wd.GroundMotion(each.acceleration / each.peak_ground_acceleration * 3.0 * 1.02**place, 0.02, each.name)
        for place, each in enumerate(motions)
    ]
    with pytest.warns(UserWarning, match=r"the slope of ln\(PGA\) over ln\(Sa\(0.5 s, 5 %\)\) is 0.06.*0.3 to 3"):
        wd.convert_curves(curves(), nearly_equal, PGA, SA)
    in_g = [wd.GroundMotion(each.acceleration / 9.80665e3, 0.02, each.name) for each in motions]
    with pytest.warns(UserWarning, match="implausible input: peak ground acceleration"):
        wd.convert_curves(curves(median=3e-4), in_g, PGA, SA)


def test_motions_of_equal_intensity_are_refused_without_a_raw_warning(motions):
    equal = [wd.GroundMotion(each.acceleration / each.peak_ground_acceleration, 0.02, each.name) for each in motions]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for pair in ((PGA, SA), (SA, PGA)):
            set_of_curves = curves().assign_attrs(intensity_measure=pair[0].name)
            with pytest.raises(ValueError, match=r"PGA is 0.102 g for all 8 motions: give motions as they were"):
                wd.convert_curves(set_of_curves, equal, *pair)


def test_motions_without_a_filtered_incremental_velocity_are_refused_by_name(motions):
    measure = wd.FilteredIncrementalVelocity(0.02, 0.7, 0.1)
    with pytest.raises(ValueError, match="of 'short': the filter needs a motion of more than 9 samples, got 9"):
        measure.value(wd.GroundMotion([0.0, 1.0, 0.5, -1.0, 0.5, 0.0, -0.5, 0.2, 0.0], 0.02, "short"))
    assert measure.value(wd.GroundMotion([0.0, 1.0, 0.5, -1.0, 0.5, 0.0, -0.5, 0.2, 0.0, 0.0], 0.02, "longer")) > 0
    with pytest.raises(TypeError, match=r"give its components, as in measure.values"):
        measure.value(wd.PairOfMotions(motions[0], motions[1]))
