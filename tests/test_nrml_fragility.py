"""OpenQuake's NRML 0.5 fragility models: what is written, what is refused, and what is read back."""

import warnings
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
import xarray as xr
from scipy.stats import fisk, lognorm, norm

import warpdyn as wd

pytestmark = pytest.mark.fast

STATES = ("slight", "moderate", "extensive")
NAMESPACE = "{http://openquake.org/xmlns/nrml/0.5}"


def make_curves(median=(0.2, 0.35, 0.5), dispersion=(0.4, 0.42, 0.45), states=STATES, units="g", measure="PGA"):
    """Build curves as `fragility` returns them."""
    return xr.Dataset(
        {
            "fragility_median": ("damage_state", np.array(median), {"units": units}),
            "fragility_dispersion": ("damage_state", np.array(dispersion), {"units": "1"}),
        },
        {"damage_state": list(states)},
        {"intensity_measure": measure, "fragility_method": "by hand"},
    )


def make_stripes(fractions, levels=(0.1, 0.2, 0.4)):
    """Build stripe fractions as `fragility` returns them."""
    curves = make_curves()
    curves["exceedance_fraction"] = (("damage_state", "stripe"), np.array(fractions))
    return curves.assign_coords(stripe=("stripe", list(levels), {"units": "g"}))


RISING = [[0.1, 0.5, 1.0], [0.0, 0.25, 0.75], [0.0, 0.0, 0.5]]


def written(path, *tags):
    """Return the elements of a file that are at a path of tags below the root."""
    return ElementTree.parse(path).getroot().findall("/".join(f"{NAMESPACE}{tag}" for tag in tags))


def engine_probability(path, taxonomy, state, intensity):
    """Return a probability as the engine computes it of a continuous function (risklib.scientific).

    Its variance of the logarithm is ln(stddev^2 / mean^2 + 1), its median mean^2 / sqrt(stddev^2 + mean^2); intensities
    are clipped to minIML and maxIML, and those up to noDamageLimit have none.
    """
    functions = {each.get("id"): each for each in written(path, "fragilityModel", "fragilityFunction")}
    levels, *rows = functions[taxonomy]
    row = next(each for each in rows if each.get("ls") == state)
    mean, stddev = float(row.get("mean")), float(row.get("stddev"))
    clipped = np.clip(intensity, float(levels.get("minIML")), float(levels.get("maxIML")))
    sigma, median = np.sqrt(np.log(stddev**2 / mean**2 + 1)), mean**2 / np.hypot(stddev, mean)
    return 0.0 if clipped <= float(levels.get("noDamageLimit")) else lognorm.cdf(clipped, sigma, scale=median)


def test_mean_and_stddev_are_arithmetic(tmp_path):
    path = tmp_path / "model.xml"
    curves = make_curves((0.2, 0.5), (0.40, 0.45), ("slight", "extensive"), measure="Sa(0.3 s, 5 %)")
    assert wd.write_nrml_fragility({"C1M_H": curves}, path) == path
    (function,) = written(path, "fragilityModel", "fragilityFunction")
    assert function.attrib == {"id": "C1M_H", "format": "continuous", "shape": "logncdf"}
    levels, *rows = function
    assert levels.get("imt") == "SA(0.3)"
    told = [(row.get("ls"), float(row.get("mean")), float(row.get("stddev"))) for row in rows]
    assert [state for state, *_ in told] == ["slight", "extensive"]
    for (_, *values), (median, dispersion) in zip(told, ((0.2, 0.40), (0.5, 0.45)), strict=True):
        capacity = lognorm(dispersion, scale=median)
        assert values == pytest.approx([capacity.mean(), capacity.std()], rel=1e-12)


def test_the_engine_s_formula_has_one_half_at_the_median_and_ends_where_told(tmp_path):
    path = tmp_path / "model.xml"
    curves = make_curves()
    wd.write_nrml_fragility({"A": curves}, path)
    for state, median, dispersion in zip(STATES, (0.2, 0.35, 0.5), (0.4, 0.42, 0.45), strict=True):
        # 1e-12: some ten roundings of 1e-16, multiplied by at most the slope of the curve, 1 / dispersion.
        assert engine_probability(path, "A", state, median) == pytest.approx(0.5, abs=1e-12)
        at = 0.6 * median
        expected = norm.cdf(np.log(0.6) / dispersion)
        assert engine_probability(path, "A", state, at) == pytest.approx(expected, abs=1e-12)
    # Below the least intensity nothing, and at most 1e-6 is left out; beyond the greatest at least 0.999 is held.
    levels = written(path, "fragilityModel", "fragilityFunction")[0][0]
    least = float(levels.get("noDamageLimit"))
    assert engine_probability(path, "A", "slight", least) == 0
    assert engine_probability(path, "A", "slight", 1.0001 * least) == pytest.approx(1e-6, rel=0.01)
    assert engine_probability(path, "A", "extensive", 1e3) == pytest.approx(0.999, abs=1e-9)


def test_limits_of_the_intensity_are_the_user_s(tmp_path):
    path = tmp_path / "model.xml"
    how = {"minimum_intensity": 0.01, "maximum_intensity": 5.0, "no_damage_limit": 0.05}
    wd.write_nrml_fragility({"A": make_curves()}, path, **how)
    levels = written(path, "fragilityModel", "fragilityFunction")[0][0]
    assert levels.attrib == {"imt": "PGA", "minIML": "0.01", "maxIML": "5.0", "noDamageLimit": "0.05"}
    assert {name: wd.read_nrml_fragility(path)["A"].attrs[name] for name in how} == how
    with pytest.raises(ValueError, match=r"the medians are 0\.2 to 0\.5 g"):
        wd.write_nrml_fragility({"A": make_curves()}, path, no_damage_limit=0.3)


@pytest.mark.parametrize(
    ("units", "measure", "name", "factor"),
    [
        ("g", "PGA", "PGA", 1),
        ("m s-2", "Sa(1.5 s, 5 %)", "SA(1.5)", 1 / 9.80665),
        ("g", "geometric mean of Sa(0.75 s, 5 %)", "SA(0.75)", 1),
        ("g", "RotD50 Sa(2 s, 5 %)", "SA(2.0)", 1),
        ("g", "SA(0.3s)", "SA(0.3)", 1),
        ("g", "Sa_avg(0.1 to 2 s, 20 periods, 5 %)", "AvgSA", 1),
        ("m s-1", "PGV", "PGV", 100),
        ("m", "PGD", "PGD", 100),
        ("m s-1", "CAV", "CAV", 1 / 9.80665),
        ("m s-1", "Arias intensity", "IA", 1),
        ("s", "D5-95", "RSD595", 1),
    ],
)
def test_measures_have_openquake_s_names_and_units(tmp_path, units, measure, name, factor):
    path = tmp_path / "model.xml"
    wd.write_nrml_fragility({"A": make_curves(units=units, measure=measure)}, path)
    levels, *rows = written(path, "fragilityModel", "fragilityFunction")[0]
    assert levels.get("imt") == name
    assert float(rows[0].get("mean")) == pytest.approx(0.2 * np.exp(0.08) * factor, rel=1e-12)
    again = wd.read_nrml_fragility(path)["A"]
    in_g = factor == 1 / 9.80665 and units == "m s-2"  # accelerations are read in g
    np.testing.assert_allclose(again["fragility_median"] * (9.80665 if in_g else 1), [0.2, 0.35, 0.5], rtol=1e-12)
    assert again["fragility_median"].attrs["units"] == ("g" if in_g else units)


def test_curves_written_as_of_another_measure_are_warned_of(tmp_path):
    curves = {"A": make_curves(measure="Sa(0.3 s, 5 %)")}
    for measure in ("PGA", "SA(1.0)"):
        with pytest.warns(UserWarning, match=r"'A': the intensities are 'Sa\(0.3 s, 5 %\)' but are written as"):
            wd.write_nrml_fragility(curves, tmp_path / "model.xml", measure=measure)
    unknown = {"A": make_curves(measure="Housner intensity")}
    with pytest.warns(UserWarning, match="are 'Housner intensity' but are written as PGA"):
        wd.write_nrml_fragility(unknown, tmp_path / "model.xml", measure="PGA")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.write_nrml_fragility(curves, tmp_path / "model.xml", measure="SA(0.3)")
        unnamed = {"A": make_curves(measure="intensity measure")}  # as of a run that names none
        wd.write_nrml_fragility(unnamed, tmp_path / "model.xml", measure="PGA")


def test_warpdyn_s_own_names_are_all_understood():
    from warpdyn.interfaces.exchange.measures import openquake_measure

    measures = {
        wd.PeakGroundAcceleration(): "PGA",
        wd.PeakGroundVelocity(): "PGV",
        wd.PeakGroundDisplacement(): "PGD",
        wd.AriasIntensity(): "IA",
        wd.CumulativeAbsoluteVelocity(): "CAV",
        wd.SignificantDuration(0.05, 0.75): "RSD575",
        wd.SpectralAcceleration(1e-2): "SA(0.01)",
        wd.AverageSpectralAcceleration([0.1, 0.2]): "AvgSA",
        wd.GeometricMean(wd.PeakGroundAcceleration()): "PGA",
        wd.RotatedSpectralAcceleration(0.5): "SA(0.5)",
    }
    for measure, name in measures.items():
        assert openquake_measure(measure.name) == name


def test_a_continuous_model_is_read_back(tmp_path):
    curves = {"C1M_H": make_curves(), "CR/LFM+CDH/HEX:5": make_curves((0.3, 0.5, 0.9), (0.5, 0.5, 0.5))}
    again = wd.read_nrml_fragility(wd.write_nrml_fragility(curves, tmp_path / "model.xml", description="two frames"))
    assert list(again) == list(curves)
    for taxonomy, dataset in curves.items():
        for name in ("fragility_median", "fragility_dispersion"):
            np.testing.assert_allclose(again[taxonomy][name], dataset[name], rtol=1e-13)
        assert again[taxonomy]["damage_state"].values.tolist() == list(STATES)
        assert again[taxonomy].attrs["intensity_measure"] == "PGA"
        assert "two frames" in again[taxonomy].attrs["fragility_method"]


def test_a_discrete_model_of_stripe_fractions_is_read_back_and_written_again(tmp_path):
    curves = make_stripes(RISING)
    curves["fragility_median"][2] = np.nan  # fractions need no fit
    path = wd.write_nrml_fragility({"A": curves}, tmp_path / "model.xml", format="discrete")
    levels, *rows = written(path, "fragilityModel", "fragilityFunction")[0]
    assert (levels.text, levels.attrib) == ("0.1 0.2 0.4", {"imt": "PGA"})
    assert [row.text for row in rows] == ["0.1 0.5 1.0", "0.0 0.25 0.75", "0.0 0.0 0.5"]
    again = wd.read_nrml_fragility(path)["A"]
    np.testing.assert_array_equal(again["exceedance_fraction"], RISING)
    np.testing.assert_array_equal(again["stripe"], [0.1, 0.2, 0.4])
    twice = wd.write_nrml_fragility({"A": again}, tmp_path / "again.xml", format="discrete", description="x")
    assert twice.read_text().split("limitStates")[1:] == path.read_text().split("limitStates")[1:]


def test_discrete_functions_are_fitted_curves_at_intensities(tmp_path):
    levels = [0.1, 0.2, 0.5, 1.0]
    path = tmp_path / "model.xml"
    wd.write_nrml_fragility({"A": make_curves()}, path, format="discrete", intensities=levels, no_damage_limit=0.05)
    points, *rows = written(path, "fragilityModel", "fragilityFunction")[0]
    assert points.get("noDamageLimit") == "0.05"
    for row, median, dispersion in zip(rows, (0.2, 0.35, 0.5), (0.4, 0.42, 0.45), strict=True):
        expected = lognorm.cdf(levels, dispersion, scale=median)
        np.testing.assert_allclose([float(word) for word in row.text.split()], expected, atol=1e-12)


def test_loglogistic_curves_are_written_as_such(tmp_path):
    curves, path = make_curves().assign_attrs(fragility_shape="loglogistic"), tmp_path / "model.xml"
    with pytest.raises(ValueError, match="loglogistic, but OpenQuake's continuous functions are lognormal"):
        wd.write_nrml_fragility({"A": curves}, path)
    levels = [0.1, 0.2, 0.5, 1.0]
    wd.write_nrml_fragility({"A": curves}, path, format="discrete", intensities=levels)
    _, *rows = written(path, "fragilityModel", "fragilityFunction")[0]
    for row, median, dispersion in zip(rows, (0.2, 0.35, 0.5), (0.4, 0.42, 0.45), strict=True):
        # scipy's loglogistic distribution, whose logarithm has the standard deviation pi / (sqrt(3) c).
        expected = fisk.cdf(levels, np.pi / np.sqrt(3) / dispersion, scale=median)
        np.testing.assert_allclose([float(word) for word in row.text.split()], expected, atol=1e-12)


def crossing(by):
    """Curves whose states cross by more than a probability of 0.001 between the limits."""
    return make_curves((0.2, 0.35, 0.5), (0.4, 0.42, 0.42 + by))


REFUSED = {
    "a state without a fit": (make_curves((0.2, np.nan, 0.5)), {}, r"'A'.*'moderate' has no fragility curve"),
    "a dispersion of 0": (
        make_curves(dispersion=(0.4, 0, 0.4)),
        {},
        r"'moderate' has no fragility curve \(median 0.35, dispersion 0\)",
    ),
    "medians that fall": (
        make_curves((0.2, 0.5, 0.35)),
        {},
        r"median of 'extensive' \(0\.35 g\) is below the median of 'moderate' \(0\.5 g\)",
    ),
    "states that cross": (
        crossing(0.4),
        {},
        r"'moderate' and 'extensive' cross: at 0\.\d+ g the probability of exceeding the heavier",
    ),
    "states that cross at given intensities": (
        crossing(0.4),
        {"format": "discrete", "intensities": [0.1, 0.2]},
        r"'moderate' and 'extensive' cross: at 0\.\d g",
    ),
    "fractions that fall": (
        make_stripes([[0.1, 0.5, 0.4], *RISING[1:]]),
        {"format": "discrete"},
        r"exceeding 'slight' falls from 0\.5 at 0\.2 g to 0\.4 at 0\.4 g",
    ),
    "fractions above 1": (make_stripes([[0.1, 0.5, 1.1], *RISING[1:]]), {"format": "discrete"}, r"'slight' is 1\.1 at"),
    "fractions of no sample": (
        make_stripes([[np.nan, 0.5, 1], *RISING[1:]]),
        {"format": "discrete"},
        r"is nan at 0\.1",
    ),
    "fractions that cross": (
        make_stripes([RISING[0], [0.2, 0.25, 0.75], RISING[2]]),
        {"format": "discrete"},
        r"'slight' and 'moderate' cross: at 0\.1 g",
    ),
    "no fractions": (make_curves(), {"format": "discrete"}, r"exceedance_fraction.* \(or intensities="),
    "unsorted intensities": (
        make_curves(),
        {"format": "discrete", "intensities": [0.2, 0.1]},
        "increasing intensities",
    ),
    "intensities of 0": (
        make_curves(),
        {"format": "discrete", "intensities": [0, 0.1]},
        "increasing intensities above 0",
    ),
    "intensities of a continuous function": (make_curves(), {"intensities": [0.1, 0.2]}, "format='discrete'"),
    "limits of a discrete function": (
        make_stripes(RISING),
        {"format": "discrete", "maximum_intensity": 2.0},
        "remove minimum_intensity= and maximum_intensity=",
    ),
    "no damage within": (make_stripes(RISING), {"format": "discrete", "no_damage_limit": 0.3}, "below the first"),
    "an unknown measure": (make_curves(), {"measure": "SA0.3"}, r"no intensity measure 'SA0\.3'.*'SA\(0\.3\)'"),
    "the largest of all directions": (make_curves(measure="RotD100 Sa(1 s, 5 %)"), {}, "no intensity measure"),
    "another damping": (make_curves(measure="Sa(1 s, 2 %)"), {}, r"damping ratio of 2 %.*measure='SA\(1.0\)'$"),
    "an average with another damping": (
        make_curves(measure=wd.AverageSpectralAcceleration([0.2, 2.0], damping_ratio=0.1).name),
        {},
        "damping ratio of 10 %.*if the intensities are for 5 %, give measure='AvgSA'$",
    ),
    "an average with another damping and without periods": (
        make_curves(measure="AvgSA(10 periods, 10 %)"),
        {},
        "damping ratio of 10 %.*give measure='AvgSA'$",
    ),
    "no measure": (make_curves().drop_attrs(deep=False), {}, "give measure="),
    "a unit of something else": (make_curves(units="m s-1"), {}, r"PGA must be in 'g' or 'm s-2', got 'm s-1'"),
    "no description": (make_curves(), {"description": " "}, "OpenQuake requires it"),
    "an unknown loss type": (make_curves(), {"loss_type": "structure"}, "did you mean 'structural'"),
    "an unknown format": (make_curves(), {"format": "lognormal"}, "unknown format"),
    "a state of two words": (make_curves(states=("slight", "moderate", "very bad")), {}, "'very bad'"),
    "states of one name": (
        make_curves(states=("slight", "slight", "bad")),
        {},
        "two damage states have the same name: slight, slight, bad",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_the_engine_would_take_wrongly_is_refused(tmp_path, case):
    curves, how, message = REFUSED[case]
    with pytest.raises(ValueError, match=message):
        wd.write_nrml_fragility({"A": curves}, tmp_path / "model.xml", **how)
    assert not list(tmp_path.iterdir())


def test_names_and_mappings_are_checked(tmp_path):
    path = tmp_path / "model.xml"
    for name in ("two words", "O'Higgins", "a#b", "", "béton", 3):
        with pytest.raises(ValueError, match="taxonomy"):
            wd.write_nrml_fragility({name: make_curves()}, path)
    with pytest.raises(ValueError, match=r"'B' has the damage states slight, moderate, bad, but 'A' has"):
        wd.write_nrml_fragility({"A": make_curves(), "B": make_curves(states=("slight", "moderate", "bad"))}, path)
    with pytest.raises(TypeError, match="mapping of taxonomies"):
        wd.write_nrml_fragility(make_curves()["fragility_median"], path)
    with pytest.raises(TypeError, match="mapping of taxonomies to datasets, got one Dataset"):
        wd.write_nrml_fragility(make_curves(), path)
    with pytest.raises(ValueError, match="at least one"):
        wd.write_nrml_fragility({}, path)
    with pytest.raises(ValueError, match=r"end in '\.xml'"):
        wd.write_nrml_fragility({"A": make_curves()}, tmp_path / "model.csv")
    with pytest.raises(FileNotFoundError, match="no folder"):
        wd.write_nrml_fragility({"A": make_curves()}, tmp_path / "there" / "model.xml")


def test_tails_may_cross_by_what_matters_not(tmp_path):
    # By hand: the widest gap below the point where both meet is under 0.001 there.
    levels = np.geomspace(0.03, 3, 4001)
    curves = make_curves((0.2, 0.5, 1.0), (0.4, 0.42, 0.45))
    lighter, heavier = (lognorm.cdf(levels, b, scale=m) for m, b in ((0.2, 0.4), (0.5, 0.42)))
    assert np.max(heavier - lighter) < 1e-3
    wd.write_nrml_fragility({"A": curves}, tmp_path / "model.xml")


BROKEN = {
    "<nrml/>": "is not NRML 0.5",
    "no xml": "is not XML",
    '<nrml xmlns="http://openquake.org/xmlns/nrml/0.4"/>': "is not NRML 0.5",
    '<nrml xmlns="http://openquake.org/xmlns/nrml/0.5"><vulnerabilityModel/></nrml>': "contains no fragilityModel",
}


@pytest.mark.parametrize("text", BROKEN)
def test_files_of_something_else_are_refused(tmp_path, text):
    path = tmp_path / "model.xml"
    path.write_text(text)
    with pytest.raises(ValueError, match=BROKEN[text]):
        wd.read_nrml_fragility(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('ls="moderate"', 'ls="extensive"', "limitStates, in the same order: slight, moderate"),
        ('id="A"', "", "no attribute 'id'"),
        ('minIML="', 'min="', "no attribute 'minIML'"),
        ('mean="', 'mean="x', "must contain numbers"),
        ('mean="', 'mean="-', "finite and above 0"),
        ("continuous", "Gaussian", "unknown format"),
    ],
)
def test_broken_functions_are_named(tmp_path, old, new, message):
    path = wd.write_nrml_fragility({"A": make_curves()}, tmp_path / "model.xml")
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(ValueError, match=message):
        wd.read_nrml_fragility(path)
