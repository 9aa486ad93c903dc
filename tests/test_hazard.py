"""Hazard curves: their points, the files of OpenQuake and of the USGS, interpolation, logic trees, refusals."""

import json
import warnings

import numpy as np
import pyFragility
import pytest
from fragility_parameters import curves

import warpdyn as wd
from warpdyn.answers.risk.hazard.plausible import highest_rate
from warpdyn.model.ground_motions.measures.names import same_measure

pytestmark = pytest.mark.fast

# What the engine 3.15 exported of its own test case 18, cut to five levels and two sites.
OPENQUAKE = (
    "#,,,,,,,\"generated_by='OpenQuake engine 3.15.0-gite40420dd8d', start_date='2022-05-13T12:42:07', "
    "checksum=2967670219, kind='mean', investigation_time=1.0, "
    "imt='SA(0.2)'\"\nlon,lat,depth,poe-0.0010197,poe-0.0101972,poe-0.0178450,poe-0.0305915,poe-0.3059150\n-123.23738,49.27479,0.00000,3.417221E-02,3.090177E-03,9.733151E-04,2.144403E-04,0.000000E+00\n-123.23282,49.26162,0.00000,3.388751E-02,3.008998E-03,9.390406E-04,2.045477E-04,0.000000E+00\n"
)
# From the example outputs of the USGS's nshmp-haz, cut to some levels.
USGS = (
    "name,lon,lat,0.128,0.288,0.649,1.46,3.28,4.92\n"
    "Concord CA,-122.00000,37.95000,2.85270518e-03,2.83008128e-03,2.28696055e-03,6.77886373e-04,2.95347392e-05,0.0\n"
    "Oakland CA,-122.25000,37.80000,2.44724494e-03,8.89662810e-04,5.37386169e-05,0.0,0.0,0.0\n"
)
POINTS = [0.1, 0.3, 1.0], [1e-2, 1e-3, 1e-5]


def test_openquake_probabilities_become_rates(tmp_path):
    path = tmp_path / "hazard_curve-mean-SA(0.2)_1.csv"
    path.write_text(OPENQUAKE)
    curve = wd.HazardCurve.from_openquake_csv(path, site=(-123.2328, 49.2616))
    assert (curve.measure, curve.units) == ("SA(0.2)", "g")
    np.testing.assert_array_equal(curve.intensity, [0.0010197, 0.0101972, 0.0178450, 0.0305915])
    probability = np.array([3.388751e-02, 3.008998e-03, 9.390406e-04, 2.045477e-04])
    np.testing.assert_allclose(1 - np.exp(-curve.annual_rate), probability, rtol=1e-12)  # rounding alone
    # In 50 years the same probabilities are of rates 50 times smaller.
    path.write_text(OPENQUAKE.replace("investigation_time=1.0", "investigation_time=50.0"))
    in_50 = wd.HazardCurve.from_openquake_csv(path, site=(-123.2328, 49.2616))
    np.testing.assert_allclose(50 * in_50.annual_rate, curve.annual_rate, rtol=1e-12)


def test_openquake_velocities_and_saturated_points(tmp_path):
    path = tmp_path / "hazard_curve-mean-PGV.csv"
    text = OPENQUAKE.replace("SA(0.2)", "PGV").replace("3.417221E-02", "1.000000E+00")
    path.write_text("\n".join(text.splitlines()[:3]))
    curve = wd.HazardCurve.from_openquake_csv(path)  # one site needs no place
    assert curve.units == "m s-1"
    np.testing.assert_allclose(curve.intensity, [0.000101972, 0.000178450, 0.000305915])  # cm/s in the file


def test_openquake_cumulative_absolute_velocities(tmp_path):
    path = tmp_path / "hazard_curve-mean-CAV.csv"
    path.write_text("\n".join(OPENQUAKE.replace("SA(0.2)", "CAV").splitlines()[:3]))
    curve = wd.HazardCurve.from_openquake_csv(path)
    assert (curve.measure, curve.units) == ("CAV", "m s-1")
    np.testing.assert_allclose(curve.intensity, 9.80665 * np.array([0.0010197, 0.0101972, 0.0178450, 0.0305915]))  # g s


BROKEN = {
    "no first line": (OPENQUAKE.partition("\n")[2], "investigation_time"),
    "no poe columns": (OPENQUAKE.replace("poe-", "iml-"), "poe-"),
    "a broken number": (OPENQUAKE.replace("3.008998E-03", "3.0089x8E-03"), "line 4.*3.0089x8E-03"),
    "a missing value": (OPENQUAKE.replace(",0.000000E+00", ""), "line 4"),
    "above 1": (OPENQUAKE.replace("3.388751E-02", "3.388751E+02"), "from 0 to 1"),
    "an unknown measure": (OPENQUAKE.replace("SA(0.2)", "MMI"), "MMI"),
    "a curve that rises": (OPENQUAKE.replace("9.390406E-04", "9.390406E-03"), "never rises"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_openquake_files_are_refused(case, tmp_path):
    text, words = BROKEN[case]
    path = tmp_path / "curve.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=words):
        wd.HazardCurve.from_openquake_csv(path, site=(-123.2328, 49.2616))


def test_sites_are_chosen(tmp_path):
    path = tmp_path / "curve.csv"
    path.write_text(OPENQUAKE)
    with pytest.raises(ValueError, match=r"2 sites: give site="):
        wd.HazardCurve.from_openquake_csv(path)
    with pytest.raises(ValueError, match=r"the nearest is -123\.2"):
        wd.HazardCurve.from_openquake_csv(path, site=(-120.0, 49.0))
    with pytest.raises(FileNotFoundError):
        wd.HazardCurve.from_openquake_csv(tmp_path / "none.csv")


def test_usgs_csv(tmp_path):
    path = tmp_path / "curves" / "SA0P2" / "total.csv"
    path.parent.mkdir(parents=True)
    path.write_text(USGS)
    curve = wd.HazardCurve.from_usgs(path, site="Oakland CA")
    assert curve.measure == "SA(0.2)"
    np.testing.assert_array_equal(curve.intensity, [0.128, 0.288, 0.649])  # further points have no hazard
    np.testing.assert_array_equal(curve.annual_rate, [2.44724494e-03, 8.89662810e-04, 5.37386169e-05])
    by_place = wd.HazardCurve.from_usgs(path, site=(-122.0, 37.95))
    assert by_place.annual_rate[-1] == 2.95347392e-05
    elsewhere = tmp_path / "total.csv"
    elsewhere.write_text(USGS)
    with pytest.raises(ValueError, match="give measure="):
        wd.HazardCurve.from_usgs(elsewhere, site="Oakland CA")
    with pytest.raises(ValueError, match="no site 'Reno NV'; it has Concord CA, Oakland CA"):
        wd.HazardCurve.from_usgs(path, site="Reno NV")


def test_usgs_json_of_both_services(tmp_path):
    x, y = [0.1, 0.3, 1.0, 4.0], [1e-2, 1e-3, 1e-5, 0.0]
    total = {"component": "Total", "values": {"xs": x, "ys": y}}
    part = {"component": "Fault", "values": {"xs": x, "ys": [v / 2 for v in y]}}
    named = ("PGA", "Peak Ground Acceleration"), ("SA0P75", "0.75 Second Spectral Acceleration")
    today = [{"imt": {"value": value, "display": text}, "data": [part, total]} for value, text in named]
    older = [
        {"metadata": {"imt": {"value": value}, "xvalues": x}, "data": [{"component": "Total", "yvalues": y}]}
        for value, _ in named
    ]
    path = tmp_path / "hazard.json"
    for response in ({"hazardCurves": today}, older):
        path.write_text(json.dumps({"status": "success", "response": response}))
        curve = wd.HazardCurve.from_usgs(path, measure="SA(0.75)")
        assert curve.measure == "SA(0.75)"
        np.testing.assert_array_equal(curve.annual_rate, y[:3])
        with pytest.raises(ValueError, match=r"several .*: give measure=.*PGA, SA\(0.75\)"):
            wd.HazardCurve.from_usgs(path)
    path.write_text('{"status": "error"}')
    with pytest.raises(ValueError, match="not the JSON of a USGS hazard service"):
        wd.HazardCurve.from_usgs(path)


def test_interpolation_is_in_logarithms_and_inverts():
    curve = wd.HazardCurve(*POINTS)
    assert curve.rate_of(np.sqrt(0.03)) == pytest.approx(np.sqrt(1e-5), rel=1e-14)  # halfway in both logarithms
    np.testing.assert_allclose(curve.rate_of(curve.intensity), curve.annual_rate, rtol=1e-14)
    assert curve.rate_of(np.inf) == 0
    rates = np.geomspace(1e-5, 1e-2, 7)
    np.testing.assert_allclose(curve.rate_of(curve.intensity_of(rates)), rates, rtol=1e-13)
    with pytest.warns(UserWarning, match="extrapolated"):
        beyond = curve.intensity_of(1e-6)
    assert beyond == pytest.approx(10 ** (np.log10(1 / 0.3) / 2))  # a decade of rate is half of the last segment


def test_a_level_curve_gives_its_largest_intensity():
    curve = wd.HazardCurve([0.1, 0.2, 0.4, 0.8], [1e-2, 1e-3, 1e-3, 1e-4])
    assert curve.intensity_of(1e-3) == pytest.approx(0.4)
    level_first = wd.HazardCurve([0.1, 0.2, 0.4], [1e-3, 1e-3, 1e-4])
    with pytest.raises(ValueError, match=r"more often than 0\.001"):
        level_first.intensity_of(1e-2)


REFUSED = {
    "one point": (([0.1], [1e-2]), "at least 2 points"),
    "unequal": (([0.1, 0.2], [1e-2]), "intensity has 2 values and annual_rate has 1: give one rate"),
    "rising": (([0.1, 0.2, 0.3], [1e-3, 1e-2, 1e-4]), r"goes from 0.001 at 0.1 g to 0.01 at 0.2 g"),
    "no order": (([0.1, 0.1, 0.3], [1e-2, 1e-3, 1e-4]), "0.1 is followed by 0.1"),
    "zero": (([0.1, 0.2, 0.3], [1e-2, 1e-3, 0.0]), r"annual_rate\[2\] is 0.*remove points"),
    "negative": (([-0.1, 0.2], [1e-2, 1e-3]), r"intensity\[0\] is -0.1"),
    "not a number": (([0.1, np.nan], [1e-2, 1e-3]), r"intensity\[1\] is nan"),
    "level end": (([0.1, 0.2, 0.3], [1e-2, 1e-3, 1e-3]), "last two annual rates are equal"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_impossible_curves_are_refused(case):
    points, words = REFUSED[case]
    with pytest.raises(ValueError, match=words):
        wd.HazardCurve(*points)


def test_rates_and_probabilities_that_are_taken_for_each_other():
    with pytest.raises(ValueError, match=r"probability\[0\] is 1.2; it must be below 1: give annual rates"):
        wd.HazardCurve.from_probabilities([0.1, 0.2], [1.2, 0.1], years=50)
    with pytest.warns(UserWarning, match="implausible input.*from_probabilities"):
        wd.HazardCurve([0.01, 0.02, 0.1, 0.5], [0.9999, 0.995, 0.5, 0.02])
    with pytest.warns(UserWarning, match="implausible input.*percent"):
        wd.HazardCurve([0.01, 0.1, 0.5], [63.0, 10.0, 2.0])
    wd.HazardCurve([0.01, 0.1, 0.5], [0.98, 0.05, 2e-3])  # frequent small motions are no mistake
    with pytest.warns(UserWarning, match=r"rate at a hazard curve's first points is 0.95"):
        wd.HazardCurve([0.01, 0.02, 0.05], [0.95, 0.88, 0.6])  # one point above 0.9, level there


# An active site and a quiet one, power laws of the slope 2:
# PGA of 0.6 g in 475 years, as in Los Angeles, and 0.05 g, as in northern Germany.
LEVELS = np.array([0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.5])
ACTIVE, QUIET = ((LEVELS / at) ** -2.0 / 475 for at in (0.6, 0.05))


def test_the_highest_hazard_of_spectral_accelerations_is_that_of_the_pga_times_a_plateau():
    # 2.5 times the PGA up to 0.7 s, and in proportion to 1 / period beyond, as in design spectra.
    of_pga = float(highest_rate(np.array(0.3), "PGA"))
    for measure, factor in (("SA(0.1)", 2.5), ("SA(0.7)", 2.5), ("SA(1.4)", 1.25), ("SA(3.5)", 0.5), ("AvgSA", 2.5)):
        assert float(highest_rate(np.array(factor * 0.3), measure)) == pytest.approx(of_pga, rel=1e-12), measure
    assert float(highest_rate(np.array(0.75), "unknown")) == pytest.approx(of_pga, rel=1e-12)


def test_curves_above_the_highest_hazard_are_told():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for rate in (ACTIVE, QUIET):
            wd.HazardCurve(LEVELS, np.minimum(rate, 0.9), measure="PGA")
    told = r"over the highest of any site at the same intensity \({}\) is .*with intensities given in m/s2"
    with pytest.warns(UserWarning, match=told.format(".* per year at 0.981 g")) as warned:
        wd.HazardCurve(9.80665 * LEVELS[2:], ACTIVE[2:], measure="PGA")
    assert "probabilities in 50 years given as annual rates" in str(warned[0].message)
    with pytest.warns(UserWarning, match=told.format(".*")):
        wd.HazardCurve(LEVELS, -np.expm1(-50 * ACTIVE), measure="PGA")
    # GEM's global map of 475 years has colours up to 1.5 g: the bound is there within 10 % of the rate.
    assert float(highest_rate(np.array(1.5), "PGA")) == pytest.approx(1 / 475, rel=0.1)
    with wd.meant_as_given("hazard_over_highest"):
        wd.HazardCurve(9.80665 * LEVELS[2:], ACTIVE[2:], measure="PGA")
    # What is usual of short periods is not of the ground, nor of long ones.
    high = [1.0, 2.0, 3.0], [8e-3, 4e-3, 2e-3]
    wd.HazardCurve(*high, measure="SA(0.2)")
    for measure in ("PGA", "SA(2.0)"):
        with pytest.warns(UserWarning, match="over the highest of any site"):
            wd.HazardCurve(*high, measure=measure)
    wd.HazardCurve(9.80665 * LEVELS[2:], ACTIVE[2:], measure="PGA", units="m s-2")
    wd.HazardCurve(9.80665 * LEVELS[2:], QUIET[2:], measure="PGA")  # as of an active site: nothing tells the mistake


# Public curves: of pyFragility's wood frames, and of the USGS for Concord (California), as in USGS above.
WOOD_FRAME = pyFragility.datasets.load_msa_wood_frame().hazard
PUBLIC = {
    "SA(0.5)": (np.asarray(WOOD_FRAME.im), np.asarray(WOOD_FRAME.annual_rate)),
    "SA(0.2)": (
        np.array([0.128, 0.288, 0.649, 1.46, 3.28]),
        np.array([2.85270518e-03, 2.83008128e-03, 2.28696055e-03, 6.77886373e-04, 2.95347392e-05]),
    ),
}


@pytest.mark.parametrize("measure", PUBLIC)
def test_public_curves_are_usual_and_their_mistakes_are_not(measure):
    intensity, rate = PUBLIC[measure]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.HazardCurve(intensity, rate, measure=measure)
    for wrong in ((9.80665 * intensity, rate), (intensity, -np.expm1(-50 * rate))):
        with pytest.warns(UserWarning, match="implausible input"):
            wd.HazardCurve(*wrong, measure=measure)


@pytest.mark.parametrize("names", [("Housner intensity", "PGA"), ("PGA", "spectral acceleration at 1 s")])
def test_names_that_are_not_understood_are_told(names):
    of_hazard, of_curves = names
    hazard = wd.HazardCurve(*POINTS, measure=of_hazard)
    given = curves({"complete": (0.2, 0.2)}, measure=of_curves)
    with pytest.warns(
        UserWarning, match=r"annual_rates: the hazard and the curves .* cannot be compared.*It knows PGA"
    ):
        wd.annual_rates(given, hazard)
    with pytest.warns(UserWarning, match="HazardLogicTree: two curves .* cannot be compared"):
        wd.HazardLogicTree([hazard, wd.HazardCurve(*POINTS, measure=of_curves)], [0.5, 0.5])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        wd.annual_rates(given, wd.HazardCurve(*POINTS, measure=of_curves))  # the same words
        wd.annual_rates(given, wd.HazardCurve(*POINTS, measure=""))  # not to be compared


def test_a_hazard_that_does_not_name_its_measure_gives_a_warning():
    unnamed, skipped = wd.HazardCurve(*POINTS), wd.HazardCurve(*POINTS, measure="")
    with_measure = curves({"complete": (0.2, 0.2)}, measure="Sa(0.6 s, 5 %)")
    tree = wd.HazardLogicTree([unnamed, unnamed], [0.5, 0.5])
    match = r"annual_rates: the hazard does not name .* Give HazardCurve\(\.\.\., measure='Sa\(0\.6 s, 5 %\)'\)"
    for hazard in (unnamed, tree):
        with pytest.warns(UserWarning, match=match):
            found = wd.annual_rates(with_measure, hazard)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        same = wd.annual_rates(with_measure, skipped)
        wd.annual_rates(curves({"complete": (0.2, 0.2)}), unnamed)  # curves of a table without a measure
    np.testing.assert_array_equal(found["annual_rate"], same["annual_rate"])


def test_intensities_in_another_unit_are_told():
    gal = 981 * np.array([0.05, 0.5, 2.0])
    with pytest.warns(UserWarning, match=r"curve is 49.05 g .* given in cm/s2 \(gal\), it would be 0.05 g"):
        wd.HazardCurve(gal, [2e-2, 1e-3, 1e-5])
    wd.HazardCurve(gal, [2e-2, 1e-3, 1e-5], units="cm s-2")


# PGV of a site as active as Los Angeles: 0.6 m/s in 475 years, and as quiet as northern Germany: 0.05 m/s.
OF_VELOCITY = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0]
ACTIVE_VELOCITY, QUIET_VELOCITY = ((np.array(OF_VELOCITY) / at) ** -1.8 / 475 for at in (0.6, 0.05))


def test_curves_of_velocity_are_checked_as_those_of_accelerations_are():
    of_pgv = {"measure": "PGV", "units": "m s-1"}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for rate in (ACTIVE_VELOCITY, QUIET_VELOCITY):
            wd.HazardCurve(OF_VELOCITY, np.minimum(rate, 0.9), **of_pgv)
    in_cm = 100 * np.array(OF_VELOCITY)
    for rate in (ACTIVE_VELOCITY, QUIET_VELOCITY):
        with pytest.warns(UserWarning, match=r"velocity of a hazard curve at its (first|last) point .* given in cm/s"):
            wd.HazardCurve(in_cm, np.minimum(rate, 0.9), **of_pgv)
    with pytest.warns(UserWarning, match=r"over the highest of any site .* with intensities given in cm/s"):
        wd.HazardCurve(in_cm[:3], np.minimum(ACTIVE_VELOCITY, 0.9)[:3], **of_pgv)
    with pytest.warns(UserWarning, match="implausible input.*from_probabilities"):
        wd.HazardCurve(OF_VELOCITY, -np.expm1(-50 * ACTIVE_VELOCITY), **of_pgv)
    # The bound is that of the PGA, of 2.5 times the median ratio: at 1.45 g it allows 3.9 m/s once in 475 years.
    assert float(highest_rate(np.array(2.5 * 1.092 * 1.5), "PGV")) == pytest.approx(1 / 475, rel=0.15)
    for measure, units, levels, unit in (
        ("PGD", "m", [2.0, 20.0, 60.0], "given in cm"),
        ("CAV", "m s-1", [50.0, 500.0, 5000.0], "given in cm/s"),
        ("Arias intensity", "m s-1", [10.0, 100.0, 500.0], "given in cm/s"),
    ):
        with pytest.warns(UserWarning, match=unit):
            wd.HazardCurve(levels, [1e-2, 1e-3, 1e-5], measure=measure, units=units)


def test_units_of_hazard_curves_are_read_and_fit_the_measure():
    levels, rates = [3.0, 10.0, 100.0], [4e-2, 8e-3, 3e-5]
    metres = np.array(levels) / 100
    for units, values in (("m/s", metres), ("m s-1", metres), ("cm/s", levels), ("cm s-1", levels)):
        curve = wd.HazardCurve(values, rates, measure="PGV", units=units)
        assert curve.units == "m s-1"
        np.testing.assert_allclose(curve.intensity, metres, rtol=1e-15)
    assert wd.HazardCurve(levels, rates, measure="PGD", units="cm").units == "m"
    in_50 = wd.HazardCurve.from_probabilities(levels, [0.8, 0.3, 0.001], 50, measure="PGV", units="cm/s")
    np.testing.assert_allclose(in_50.intensity, metres, rtol=1e-15)
    assert wd.HazardCurve(metres, rates, measure="SA(0.5)").units == "g"
    with pytest.raises(ValueError, match=r"'PGV' is not in g, .*: give units='m s-1'"):
        wd.HazardCurve(metres, rates, measure="PGV")
    with pytest.raises(ValueError, match=r"units of a hazard curve of 'PGV' are 'm s-1', got 'g'; .*'cm/s'"):
        wd.HazardCurve(metres, rates, measure="PGV", units="g")
    with pytest.raises(ValueError, match=r"of 'SA\(0.5\)' are 'g' or 'm s-2', got 'm s-1'"):
        wd.HazardCurve(metres, rates, measure="SA(0.5)", units="m s-1")
    # Forgotten units and measure are the likely cause where curves are of a velocity.
    given = curves({"complete": (0.2, 0.2)}, units="m s-1", measure="PGV")
    with pytest.raises(ValueError, match=r"without units is in g. .*HazardCurve\(..., measure='PGV', units='m s-1'\)"):
        wd.annual_rates(given, wd.HazardCurve(metres, rates))


def test_logic_trees():
    low, high = wd.HazardCurve(*POINTS), wd.HazardCurve([0.05, 0.5, 2.0], [2e-2, 1e-3, 1e-5])
    tree = wd.HazardLogicTree([low, high], [0.25, 0.75])
    assert tree.rate_of(0.2) == pytest.approx(0.25 * low.rate_of(0.2) + 0.75 * high.rate_of(0.2), rel=1e-14)
    for branches, weights, words in (
        ([low, high], [0.5, 0.4], "sum up to 1, got a sum of 0.9"),
        ([low, high], [1.0], "2 curves and 1 weight: give"),
        ([low, wd.HazardCurve(*POINTS, units="m s-2")], [0.5, 0.5], "the same measure and unit"),
        ([], [], "at least one"),
    ):
        with pytest.raises(ValueError, match=words):
            wd.HazardLogicTree(branches, weights)
    for one in (low, None):
        with pytest.raises(TypeError, match=rf"a list of HazardCurves, such as \[curve\], got {type(one).__name__}"):
            wd.HazardLogicTree(one, [1.0])


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("SA(0.75)", "Sa(0.75 s, 5 %)", True),
        ("SA(0.75)", "Sa(1 s, 5 %)", False),
        ("SA(0.75)", "Sa(0.75 s, 2 %)", False),
        ("PGA", "PGA", True),
        ("SA0P2", "SA(0.2)", True),  # as the USGS writes it
        ("PGA", "SA(0.2)", False),
        ("SA(0.75)", "geometric mean of Sa(0.75 s, 5 %)", True),
        ("SA(0.75)", "RotD50 Sa(0.75 s, 5 %)", True),
        ("SA(1.0)", "geometric mean of Sa(0.75 s, 5 %)", False),
        ("PGA", "RotD50 Sa(0.75 s, 5 %)", False),
        ("AvgSA", "Sa_avg(0.2 to 1.5 s, 6 periods, 5 %)", True),
        ("AvgSA", "Sa(0.75 s, 5 %)", False),
        ("SA(0.75)", "Sa_avg(0.2 to 1.5 s, 6 periods, 5 %)", False),
        ("", "PGA", None),
        ("D5-95", "RSD595", True),
        ("D5-95", "D5-75", False),
        ("Housner intensity", "Housner intensity", True),
        ("geometric mean of Sa(0.75 s, 5 %)", "SA(0.75)", True),
        ("geometric mean of Sa(0.75 s, 5 %)", "SA(1.5)", False),
        ("RotD50 Sa(1 s, 5 %)", "PGA", False),
        ("geometric mean of PGV", "PGA", False),
        ("Sa_avg(0.2 s to 3 s, 5 %)", "AvgSA", True),
        ("Sa_avg(0.2 to 1.5 s, 6 periods, 5 %)", "Sa_avg(0.2 s to 1.5 s, 5 %)", True),
        ("Sa_avg(0.2 to 1.5 s, 6 periods, 5 %)", "Sa_avg(0.5 to 3 s, 6 periods, 5 %)", False),
        ("Sa_avg(0.2 to 1.5 s, 6 periods, 5 %)", "Sa_avg(0.2 to 1.5 s, 6 periods, 2 %)", False),
        ("Sa_avg(0.2 s to 3 s, 5 %)", "SA(1.0)", False),
        ("Arias intensity", "IA", True),
        ("Housner intensity", "PGA", None),  # a name that is not understood is not judged
    ],
)
def test_measures_are_compared(one, other, same):
    assert same_measure(one, other) is same
