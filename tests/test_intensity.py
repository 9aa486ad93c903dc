"""Intensity measures: what they are called, what designs make of them, and what they refuse."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import gmean

import warpdyn as wd
import warpdyn.interfaces.plots.drifts
from warpdyn.model.ground_motions.measures import one_component
from warpdyn.model.ground_motions.measures.measure import IntensityMeasure
from warpdyn.model.ground_motions.measures.names import measure_named
from warpdyn.model.ground_motions.measures.one_component import spectral_acceleration

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("no_damping", "record_step")]

G = 9.80665
MOTIONS = [wd.GroundMotion(np.random.default_rng(i).normal(size=30 + 10 * i), 0.1, f"motion {i}") for i in range(3)]


def test_shapes():
    motion = wd.GroundMotion([0.0, 1.0, -2.0, 0.5], 0.1)
    periods = np.array([[0.3, 0.5, 1.0], [2.0, 3.0, 4.0]])
    result = spectral_acceleration(motion, periods)
    assert result.shape == (2, 3)
    assert result[1, 0] == spectral_acceleration(motion, 2.0)
    assert isinstance(spectral_acceleration(motion, 1), float)
    assert spectral_acceleration(motion, []).shape == (0,)
    spectra = wd.response_spectra(motion, periods.ravel(), device="cpu")["pseudo_spectral_acceleration"]
    np.testing.assert_array_equal(spectra.values.ravel(), result.ravel())


def test_measures():
    motion = wd.GroundMotion([0.0, 1.0, -2.0, 0.5], 0.1)
    assert wd.PeakGroundAcceleration().value(motion) == 2.0
    assert wd.PeakGroundAcceleration().name == "PGA"
    measure = wd.SpectralAcceleration(0.75)
    assert measure.name == "Sa(0.75 s, 5 %)"
    assert wd.SpectralAcceleration(2, damping_ratio=0.025).name == "Sa(2 s, 2.5 %)"
    assert measure.value(motion) == spectral_acceleration(motion, 0.75, 0.05)
    assert measure == wd.SpectralAcceleration(0.75, 0.05)
    assert wd.SignificantDuration(0.05, 0.75).name == "D5-75"
    with pytest.raises(AttributeError):
        measure.period = 1.0


def test_average_spectral_acceleration():
    periods = np.arange(0.15, 2.25, 0.01)
    measure = wd.AverageSpectralAcceleration(periods, 0.02)
    assert measure.name == "Sa_avg(0.15 to 2.24 s, 210 periods, 2 %)"
    assert measure.parameters == (2.0, pytest.approx(0.15), pytest.approx(2.24))
    assert measure == wd.AverageSpectralAcceleration(list(periods), 0.02)
    for motion, value in zip(MOTIONS, measure.values(MOTIONS), strict=True):
        assert value == pytest.approx(gmean(spectral_acceleration(motion, periods, 0.02)), rel=1e-13)
        assert value == measure.value(motion)
    single = wd.AverageSpectralAcceleration([0.7])
    np.testing.assert_allclose(single.values(MOTIONS), wd.SpectralAcceleration(0.7).values(MOTIONS), rtol=1e-15)


@pytest.mark.parametrize(
    ("measure", "units"),
    [
        (wd.SpectralAcceleration(0.6), "g"),
        (wd.AverageSpectralAcceleration([0.2, 0.6, 1.8]), "g"),
        (wd.PeakGroundVelocity(), "m s-1"),
        (wd.PeakGroundDisplacement(), "m"),
        (wd.AriasIntensity(), "m s-1"),
        (wd.CumulativeAbsoluteVelocity(), "m s-1"),
    ],
)
def test_stripes_are_scaled_to_their_level(measure, units):
    stripes = wd.Stripes(MOTIONS, [0.3, 1.2], measure)
    assert stripes.intensity_units == units
    assert (f"levels [{units}]", [0.3, 1.2]) in [(name, list(values)) for name, values in stripes.told()[:1]]
    assignment = stripes.assign(structures=[0], seed=0)
    assert assignment.units == units
    assert assignment.measure.keys() == measure.attributes().keys()
    assert assignment.measure["intensity_measure"] == measure.name
    for motion, scale, level in zip(assignment.motion, assignment.scale, assignment.im_level, strict=True):
        scaled = wd.GroundMotion(scale * MOTIONS[motion].acceleration, MOTIONS[motion].step)
        # Rounding of a sum over the 30 to 50 values, and of the power.
        assert measure.value(scaled) == pytest.approx(level * (G if units == "g" else 1.0), rel=1e-13)


def test_levels_of_a_duration_are_refused():
    with pytest.raises(ValueError, match=r"D5-95 does not grow with a motion's scale"):
        wd.Stripes(MOTIONS, [10.0, 20.0], wd.SignificantDuration())


@pytest.mark.parametrize(
    ("measure", "units"),
    [(wd.PeakGroundVelocity(), "m s-1"), (wd.AriasIntensity(), "m s-1"), (wd.SignificantDuration(), "s")],
)
def test_other_measures_label_what_runs_at_any_scale(measure, units):
    cloud = wd.Cloud(MOTIONS, measure).assign(structures=[0, 1], seed=0)
    assert cloud.units == units
    np.testing.assert_allclose(cloud.im_level, np.tile(measure.values(MOTIONS), 2), rtol=1e-15)
    individual = wd.OneMotionPerStructure(MOTIONS, motion=[2, 0], scale=[0.5, 3.0], measure=measure).assign([0, 1], 0)
    scaled = [wd.GroundMotion(0.5 * MOTIONS[2].acceleration, 0.1), wd.GroundMotion(3.0 * MOTIONS[0].acceleration, 0.1)]
    np.testing.assert_allclose(individual.im_level, measure.values(scaled), rtol=1e-12)


def test_units_reach_the_dataset():
    structure = wd.ShearBuilding(mass=1.0, stiffness=[100.0], height=3.0)
    run = wd.simulate(wd.Scene(structure, wd.Cloud(MOTIONS, wd.PeakGroundVelocity())), device="cpu")
    assert run["im_level"].attrs["units"] == "m s-1"
    assert run["im_level"].attrs["long_name"] == "PGV of the scaled motion"
    assert "comment" not in run["im_level"].attrs
    assert wd.plots.drift_against_intensity(run).axes[0].get_xlabel() == "PGV [m s-1]"
    run = wd.simulate(wd.Scene(structure, wd.Cloud(MOTIONS)), device="cpu")
    assert run["im_level"].attrs["units"] == "g"
    assert "standard gravity" in run["im_level"].attrs["comment"]


def test_every_measure_is_in_si_units_and_named():
    # Those of pairs are tested in test_pairs.py.
    classes = [each for each in vars(one_component).values() if isinstance(each, type)]
    of_one = [each for each in classes if issubclass(each, IntensityMeasure) and not each.__abstractmethods__]
    assert len(of_one) == 8
    for measure in of_one:
        arguments = {"SpectralAcceleration": (1.0,), "AverageSpectralAcceleration": ([1.0, 2.0],)}
        instance = measure(*arguments.get(measure.__name__, ()))
        assert instance.units in ("m s-2", "m s-1", "m", "s")
        assert instance.name
        assert instance.values(MOTIONS).shape == (3,)
        assert instance.values(MOTIONS)[1] == instance.value(MOTIONS[1])


NAMED = {
    "PGA": wd.PeakGroundAcceleration(),
    "ia": wd.AriasIntensity(),
    "RSD2080": wd.SignificantDuration(0.2, 0.8),
    "SA(1.0)": wd.SpectralAcceleration(1.0),
    "SA(T=1.0s)": wd.SpectralAcceleration(1.0),
    "SA(T=1.0, 2 %)": wd.SpectralAcceleration(1.0, 0.02),
    "SA(T)": None,
    "SA(.5 s, 2 %)": wd.SpectralAcceleration(0.5, 0.02),
    "SA1P5": wd.SpectralAcceleration(1.5),
    "SA(0.0)": None,
    "SA(1.0, 100 %)": None,
    "geometric mean PGV": wd.GeometricMean(wd.PeakGroundVelocity()),
    "RotD00 Sa(1 s, 5 %)": wd.RotatedSpectralAcceleration(1.0, 0.05, 0),
    "rotd100 of SA(0.2)": wd.RotatedSpectralAcceleration(0.2, 0.05, 100),
    "Housner intensity": None,
    "": None,
}


@pytest.mark.parametrize("name", NAMED)
def test_a_name_has_a_measure(name):
    assert measure_named(name) == NAMED[name]


def test_names_without_a_formula_have_units_and_no_value():
    for name, units, kind, components in (
        ("AvgSA", "m s-2", "AvgSA", ""),
        ("RotD50 PGV", "m s-1", "PGV", "RotD50"),
        ("geometric mean of Sa_avg(0.2 to 1.5 s, 6 periods, 2 %)", "m s-2", "AvgSA", "geometric mean"),
    ):
        measure = measure_named(name)
        assert (measure.name, measure.units, measure.kind, measure.components) == (name, units, kind, components)
    assert measure.parameters == (2.0, 0.2, 1.5)
    with pytest.raises(ValueError, match="cannot compute 'AvgSA': give a measure"):
        measure_named("AvgSA").values(MOTIONS)


def test_levels_are_in_g_or_si_units():
    for measure, units, size in ((wd.SpectralAcceleration(0.5), "g", G), (wd.PeakGroundVelocity(), "m s-1", 1.0)):
        assert (measure.level_units, measure.unit_size(units)) == (units, size)
        np.testing.assert_array_equal(measure.level_values(MOTIONS), measure.values(MOTIONS) / size)
        with pytest.raises(ValueError, match=rf"must be in .*{measure.units}', got 'cm s-1'"):
            measure.unit_size("cm s-1")
    durations = [wd.SignificantDuration(0.1, end) for end in (0.8, 0.9)]  # OpenQuake lacks both
    assert not durations[0].is_like(durations[1])
    arias = wd.AriasIntensity()
    assert arias.scale_factors(np.array([8.0]), np.array([2.0])) == 2.0
    assert arias.scaled_levels(np.array([2.0]), np.array([2.0])) == 8.0


def test_silence_has_no_intensity():
    motion = wd.GroundMotion(np.zeros(5), 0.1)
    assert wd.AverageSpectralAcceleration([0.5, 1.0]).value(motion) == 0.0
    assert wd.SpectralAcceleration(1.0).value(motion) == 0.0
    assert wd.PeakGroundAcceleration().value(motion) == 0.0


@pytest.mark.parametrize("period", [0.0, -1.0, np.nan, np.inf, "1", None])
def test_bad_period(period):
    with pytest.raises(ValueError, match="period must be"):
        wd.SpectralAcceleration(period)
    with pytest.raises(ValueError, match="period must be"):
        spectral_acceleration(wd.GroundMotion([0.0, 1.0], 0.1), [1.0, period])


def test_one_measure_has_one_period():
    with pytest.raises(ValueError, match="period must be one number"):
        wd.SpectralAcceleration([0.5, 1.0])


@pytest.mark.parametrize("damping_ratio", [-0.01, 1.0, 5, np.nan, "0.05", None])
def test_bad_damping_ratio(damping_ratio):
    with pytest.raises(ValueError, match="damping_ratio must be a number from 0"):
        wd.SpectralAcceleration(1.0, damping_ratio)
    with pytest.raises(ValueError, match="damping_ratio must be a number from 0"):
        spectral_acceleration(wd.GroundMotion([0.0, 1.0], 0.1), 1.0, damping_ratio)


@pytest.mark.parametrize(("start", "end"), [(0.0, 0.95), (0.05, 1.0), (0.75, 0.05), (0.5, 0.5), (-0.1, 0.5)])
def test_bad_duration(start, end):
    with pytest.raises(ValueError, match="start"):
        wd.SignificantDuration(start, end)


@pytest.mark.parametrize("periods", [[], 1.0, [[1.0, 2.0]], [1.0, 0.0], [np.nan], "T", [1.0, None]])
def test_bad_periods_of_an_average(periods):
    with pytest.raises(ValueError, match="periods must be"):
        wd.AverageSpectralAcceleration(periods)


def test_bad_motions_of_intensity_measures():
    with pytest.raises(ValueError, match="motions is empty"):
        wd.intensity_measures([])
    with pytest.raises(TypeError, match=r"motions\[0\] is a str"):
        wd.intensity_measures(["a.AT2"])


def test_scenes_and_designs_do_not_import_warp():
    """They are data: only a measure that needs oscillators does, when it is computed."""
    program = (
        "import sys, types; package = types.ModuleType('warpdyn'); package.__path__ = [sys.argv[1]];"
        "sys.modules['warpdyn'] = package; import warpdyn.model.scene; assert 'warp' not in sys.modules"
    )
    path = Path(wd.__file__).parent
    subprocess.run([sys.executable, "-c", program, str(path)], check=True)
