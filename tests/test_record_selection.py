"""Selection of records: published algorithm, agreement with targets, bounds, flat files and designs."""

from __future__ import annotations

import time

import numpy as np
import pandas as pd
import pytest
from scipy.stats import kstest, norm
from selection_library import PERIODS, ln_library, median, sigma

import warpdyn as wd
from warpdyn.model.ground_motions.selection.greedy import Problem, _kolmogorov_smirnov, improved, largest_errors

pytestmark = pytest.mark.filterwarnings("ignore:select_records. the records do not agree")
ONE = wd.SpectralAcceleration(1.0)
# Indices of the reference: starting set, and selected records after two and after four passes.
START = "753 847 724 154 208 462 1237 1788 463 1823 815 1700 283 1928 179 170 742 372 1824 1119 1176 1742 369 1874 1534"
START += " 1919 1719 1890 1046 1313"
TWO = "1646 1530 1055 1476 435 831 180 1804 1049 1001 1340 1765 490 1700 179 753 742 837 462 298 170 1824 1176 246 1788"
TWO += " 1919 1719 1890 1046 847"
FOUR = "1646 1530 1055 1476 837 831 180 1804 1049 1001 791 710 490 1700 179 753 742 1103 462 154 170 1824 1176 246 372"
FOUR += " 1919 1719 1890 1046 847"
# Largest relative errors of median and standard deviation at the start and after the passes.
ERRORS = {START: (0.0787624, 0.654121), TWO: (0.0368414, 0.176641), FOUR: (0.0177886, 0.173109)}


def indices(text):
    return np.array(text.split(), int)


@pytest.fixture(scope="module")
def library():
    return wd.RecordSpectra(PERIODS, np.exp(ln_library()))


@pytest.fixture(scope="module")
def target():
    return wd.conditional_spectrum(PERIODS, median(PERIODS), sigma(PERIODS), ONE, epsilon=1.5)


@pytest.mark.fast
def test_greedy_improvement_selects_the_records_of_the_reference(target, measured):
    spectra = ln_library()
    assert spectra.sum() == pytest.approx(-96032.1452, abs=1e-3)  # the library is that of the reference
    factors = target.level / np.exp(spectra[:, 13])
    allowed = np.flatnonzero(factors < 4)
    assert allowed.size == 860
    problem = Problem(
        *(spectra[allowed], factors[allowed], (0.0, 4.0), np.arange(allowed.size), 30, target, (1.0, 2.0, 0.3)),
        statistic="moments",
    )
    start = np.searchsorted(allowed, indices(START))
    for passes, expected in ((0, START), (2, TWO), (4, FOUR)):
        chosen, used = improved(problem, start, problem.factors[start], passes)
        measured(
            "records that differ from those that the greedy selection of Baker and Lee (2018) selects",
            truth="another program, 30 of 860 records after 0, 2 and 4 passes",
            value=np.count_nonzero(allowed[chosen] != indices(expected)),
            bound=0,
        )
        scaled = problem.spectra[chosen] + np.log(used)[:, None]
        np.testing.assert_allclose(largest_errors(target, scaled), ERRORS[expected], rtol=5e-6)  # printed digits


@pytest.mark.fast
def test_forty_of_2000_records_have_the_mean_and_the_deviation_of_the_target(library, target):
    started = time.process_time()
    selection = wd.select_records(library, target, 40, tolerance=0.0)
    # 0.7 s on one core; the limit of 5 s is for slow processors.
    assert time.process_time() - started < 5.0
    table = selection.agreement()
    np.testing.assert_allclose(table["median"], table["target_median"], rtol=0.05)
    varying = table["target_dispersion"] > 0
    np.testing.assert_allclose(table["dispersion"][varying], table["target_dispersion"][varying], rtol=0.1)
    assert table["dispersion"][~varying].to_numpy() == pytest.approx(0, abs=1e-12)
    assert selection.levels[0].records.size == np.unique(selection.levels[0].records).size == 40


@pytest.mark.fast
def test_each_statistic_is_smaller_if_it_is_minimised(library, target):
    of_moments = wd.select_records(library, target, 30, tolerance=0.0, passes=2)
    of_distribution = wd.select_records(library, target, 30, statistic="kolmogorov_smirnov", tolerance=0.0, passes=2)

    def distance(selection):
        spectra, varying = selection.spectra(), target.dispersion > 0
        return sum(
            kstest(spectra[:, k], "norm", (target.mean[k], target.dispersion[k])).statistic
            for k in np.flatnonzero(varying)
        )

    assert distance(of_distribution) < distance(of_moments)
    assert sum(of_moments.largest_errors[0]) < sum(of_distribution.largest_errors[0])


@pytest.mark.fast
def test_the_statistic_of_kolmogorov_and_smirnov_is_that_of_scipy(library, target):
    spectra = ln_library()[:50]
    problem = Problem(spectra, None, (1, 1), np.arange(50), 9, target, (1, 1, 0), "kolmogorov_smirnov")
    found = _kolmogorov_smirnov(problem, spectra[:8], spectra[20:23])
    for place, one in zip(range(20, 23), found, strict=True):
        total = 0.0
        for k in np.flatnonzero(target.dispersion > 0):
            values = np.sort(np.append(spectra[:8, k], spectra[place, k]))
            shares = np.arange(1, 10) / 9
            cdf = kstest(values, "norm", (target.mean[k], target.dispersion[k]))
            of_normal = np.abs(norm.cdf(values, target.mean[k], target.dispersion[k]) - shares).max()
            smallest = norm.cdf(values[:1], target.mean[k], target.dispersion[k])[0]
            total += max(of_normal, smallest)
            # SciPy compares each value also with the share of the values before it, which adds at most 1 / n.
            assert 0 <= cdf.statistic - max(of_normal, smallest) + 1e-12 <= 1 / 9 + 1e-9
        assert one == pytest.approx(total, rel=1e-12)


@pytest.mark.fast
def test_unconditional_targets(library):
    covariance = np.outer(sigma(PERIODS), sigma(PERIODS)) * wd.spectral_correlation(PERIODS[:, None], PERIODS)
    wide = wd.TargetSpectrum(PERIODS, 0.5 * median(PERIODS), covariance)
    unscaled = wd.select_records(library, wide, 20, scale=(1.0, 1.0), passes=2)
    assert np.all(unscaled.levels[0].factors == 1)
    assert max(unscaled.largest_errors[0]) < 0.1
    scaled = wd.select_records(library, wide, 10, scale=(0.5, 2.0), passes=1, tolerance=0.0)
    assert np.all((scaled.levels[0].factors >= 0.5) & (scaled.levels[0].factors <= 2.0))
    # The upper bound is a factor, even if it is below 0.1.
    problem = Problem(np.zeros((2, 1)), None, (0.0, 0.05), np.arange(2), 1, wide, (1, 2, 0.3), "moments")
    assert problem.grid.tolist() == [0.05]
    with pytest.raises(ValueError, match=r"the target is unconditional.*scaled_motions"):
        scaled.stripes()


@pytest.fixture(scope="module")
def screened():
    """Return spectra of 120 records with their properties; four records per event."""
    random = np.random.default_rng(3)
    table = pd.DataFrame({"event": np.repeat(np.arange(30), 4), "magnitude": random.uniform(5, 8, 120)})
    table["distance"], table["vs30"] = random.uniform(0, 100, 120), random.uniform(200, 800, 120)
    table["longest_usable_period"] = np.where(np.arange(120) < 100, 8.0, 1.5)
    table.loc[5, "magnitude"] = np.nan
    return wd.RecordSpectra(PERIODS, np.exp(ln_library()[:120]), table)


@pytest.mark.fast
def test_bounds_are_satisfied(screened, target):
    bounds = {"magnitude": (5.5, 8.0), "distance": (0.0, 90.0), "vs30": (200.0, 760.0)}
    selection = wd.select_records(screened, target, 12, scale=(0.2, 5.0), most_per_event=1, **bounds, passes=1)
    table = selection.table()
    for name, (least, most) in bounds.items():
        assert table[name].between(least, most).all()
    assert table["scale_factor"].between(0.2, 5.0).all()
    assert table["event"].is_unique
    assert (table["longest_usable_period"] == 8).all()
    at_one = np.exp(selection.spectra()[:, 13])
    np.testing.assert_allclose(at_one, target.level, rtol=1e-12)
    left = selection.candidates().iloc[0]
    assert left["usable up to 5 s"] == 100
    assert left["magnitude 5.5 to 8"] == int((screened.table["magnitude"] >= 5.5).sum())


@pytest.mark.fast
@pytest.mark.filterwarnings("ignore:select_records. only")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"magnitude": (7.9, 8.0)},
            r"of 120 records satisfy all bounds.*magnitude 7.9 to 8: \d.*Widen the bound on 'mag",
        ),
        ({"scale": (0.99, 1.01)}, r"scale factor 0.99 to 1.01: \d"),
        ({"most_per_event": 1, "number": 29}, "at most .* can be selected with most_per_event=1, fewer than number=29"),
        ({"magnitude": (8.0, 7.0)}, "magnitude must be two numbers of at least 0, the least and the largest"),
        ({"statistic": "moment"}, r"unknown statistic 'moment' \(did you mean 'moments'"),
        ({"number": 0}, "number must be a whole number of at least 1"),
        (
            {"weights": (0.0, 0.0, 1.0)},
            r"of the standard deviation must be above 0, got \(0.0, 0.0, 1.0\)",
        ),
    ],
)
def test_refused(screened, target, arguments, message):
    with pytest.raises(ValueError, match=message):
        wd.select_records(screened, target, **{"number": 20} | arguments)


@pytest.mark.fast
@pytest.mark.filterwarnings("default")
def test_a_selection_that_differs_from_its_target_is_reported(library):
    far = wd.TargetSpectrum(PERIODS, median(PERIODS) * PERIODS**-2, sigma(PERIODS))
    with pytest.warns(UserWarning, match=r"the median at 5 s is \d+.\d+ times that of the target"):
        wd.select_records(library, far, 10, passes=0)


@pytest.mark.fast
def test_periods_and_properties_that_are_missing(library, target):
    longer = wd.TargetSpectrum([1.0, 8.0], [0.3, 0.1], [0.0, 0.5], ONE)
    with pytest.raises(ValueError, match=r"period of 8 s, but the spectra of the records are for 0.05 to 5 s"):
        wd.select_records(library, longer)
    with pytest.raises(ValueError, match=r"needs the vs30 of each record.*add a column 'vs30'"):
        wd.select_records(library, target, vs30=(300.0, 600.0))
    with pytest.raises(ValueError, match="needs the event of each record"):
        wd.select_records(library, target, most_per_event=2)
    with pytest.raises(ValueError, match="the same conditioning measure and increasing levels"):
        wd.select_records(library, [target, target])
    with pytest.raises(TypeError, match="takes RecordSpectra, got ndarray"):
        wd.select_records(ln_library(), target)
    with pytest.warns(UserWarning, match="factors up to 40"):
        wd.select_records(library, target, 5, scale=(0.1, 40.0), passes=0)


def waves():
    random, motion_time = np.random.default_rng(7), np.arange(0, 8, 0.02)
    shape = np.exp(-(((motion_time - 3) / 1.5) ** 2))
    rows = [shape * random.normal(size=motion_time.size) * (1 + i % 3) for i in range(24)]
    return [
        wd.GroundMotion(row, 0.02, f"wave {i}", record=f"quake {i // 2}", component="NE"[i % 2])
        for i, row in enumerate(rows)
    ]


@pytest.mark.filterwarnings("ignore:implausible")
def test_selected_motions_are_stripes_of_a_scene():
    motions, periods = waves(), np.array([0.1, 0.2, 0.4, 0.8])
    spectra = wd.RecordSpectra.from_motions(motions, periods)
    middle = np.exp(spectra.ln_at(periods).mean(axis=0))
    measure = wd.SpectralAcceleration(0.4)
    targets = [wd.TargetSpectrum(periods, a * middle, [0.3, 0.2, 0.0, 0.3], measure) for a in (0.8, 1.6)]
    selection = wd.select_records(spectra, targets, 6)
    design = selection.stripes()
    np.testing.assert_allclose(design.levels, [target.level for target in targets])
    assigned = design.assign(np.arange(1), 0)
    for level, each in zip(design.levels, selection.levels, strict=True):
        found = {
            motions.index(design.motions[i]): c
            for i, c, at in zip(assigned.motion, assigned.scale, assigned.im_level, strict=True)
            if at == level
        }
        assert found == pytest.approx(dict(zip(each.records.tolist(), each.factors.tolist(), strict=True)), rel=1e-9)
    scaled = selection.scaled_motions(1)
    values = wd.response_spectra(scaled, periods)["pseudo_spectral_acceleration"].values[:, 0] / 9.80665
    np.testing.assert_allclose(np.log(values), selection.spectra(1), atol=1e-9)
    pairs = wd.PairOfMotions.from_records(motions)
    rotated = wd.RecordSpectra.from_motions(pairs, periods)
    expected = wd.RotatedSpectralAcceleration(0.4).pair_values([(p.x, p.y) for p in pairs]) / 9.80665
    np.testing.assert_allclose(np.asarray(rotated.spectral_acceleration)[:, 2], expected, rtol=1e-9)
    of_pairs = wd.select_records(rotated, targets[0], 4, scale=(0.1, 8.0))
    assert of_pairs.stripes().measure == wd.RotatedSpectralAcceleration(0.4)


NGA = {
    "Record Sequence Number": [1, 2, 3],
    "EQID": [1, 1, 2],
    "Earthquake Magnitude": [6.0, 6.0, -999],
    "ClstD (km)": [10.0, 20.0, 30.0],
    "Vs30 (m/s) selected\n for analysis": [300.0, 400.0, 500.0],
    "Lowest Usable Freq - Ave. Component (Hz)": [0.1, 0.25, -999],
    "File Name (Horizontal 1)": ["a", "b", "c"],
    "File Name (Horizontal 2)": ["d", "e", "f"],
    "T0.100S": [0.3, 0.2, 0.1],
    "T1.000S": [0.1, -999, 0.05],
}


@pytest.mark.fast
def test_flat_files(tmp_path):
    file = tmp_path / "nga.csv"
    pd.DataFrame(NGA).to_csv(file, index=False)
    with pytest.warns(UserWarning, match="1 record of 3 without a complete spectrum"):
        spectra = wd.RecordSpectra.from_ngawest2(file)
    assert spectra.table["name"].tolist() == ["RSN1", "RSN3"]
    assert spectra.table["longest_usable_period"].tolist() == pytest.approx([10.0, np.nan], nan_ok=True)
    assert spectra.table["magnitude"].tolist() == pytest.approx([6.0, np.nan], nan_ok=True)
    np.testing.assert_array_equal(spectra.spectral_acceleration, [[0.3, 0.1], [0.1, 0.05]])
    pd.DataFrame(NGA).drop(columns="EQID").to_csv(file, index=False)
    with pytest.raises(ValueError, match="has no column 'EQID', which the NGA-West2 flat file needs"):
        wd.RecordSpectra.from_ngawest2(file)
    esm = {"event_id": ["e1"], "network_code": ["IT"], "station_code": ["AQG"], "Mw": [6.1], "EMEC_Mw": [np.nan]}
    esm |= {
        "rup_dist": [np.nan],
        "JB_dist": [5.0],
        "epi_dist": [9.0],
        "vs30_m_sec": [685.0],
        "U_hp": [0.1],
        "V_hp": [0.2],
    }
    pd.DataFrame(esm | {"rotD50_T0_100": [490.3325], "rotD50_T1_000": [98.0665]}).to_csv(file, index=False, sep=";")
    spectra = wd.RecordSpectra.from_esm(file)
    np.testing.assert_allclose(spectra.spectral_acceleration, [[0.5, 0.1]])
    row = spectra.table.iloc[0]
    assert (row["name"], row["magnitude"], row["distance"], row["longest_usable_period"]) == (
        "e1 IT.AQG",
        6.1,
        5.0,
        5.0,
    )


@pytest.mark.fast
def test_motions_of_a_flat_file_are_given_by_name():
    flat = pd.DataFrame({"rsn": range(12), "a": np.linspace(0.2, 0.5, 12), "b": np.linspace(0.1, 0.2, 12)})
    spectra = wd.RecordSpectra.from_table(flat, {0.5: "a", 1.0: "b"}, {"name": "rsn"}, component="")
    target = wd.TargetSpectrum([0.5, 1.0], [0.3, 0.15], [0.2, 0.0], ONE)
    with pytest.warns(UserWarning, match="only 12 of 12"):
        selection = wd.select_records(spectra, target, 7)
    with pytest.raises(ValueError, match="come from a file without motions: give motions="):
        selection.stripes()
    motions = {str(i): motion for i, motion in enumerate(waves()[:12])}
    assert len(selection.motions(0, motions)) == 7
    with pytest.raises(ValueError, match="has no motion for"):
        selection.motions(0, {"0": motions["0"]})
    twice = wd.RecordSpectra.from_table(flat.assign(rsn=[1] * 12), {0.5: "a", 1.0: "b"}, {"name": "rsn"}, component="")
    with pytest.warns(UserWarning, match="only 12 of 12"):
        selection = wd.select_records(twice, target, 7)
    with pytest.raises(ValueError, match=r"12 records have the name '1'.*give each record another name"):
        selection.stripes({"1": motions["1"]})
    with pytest.raises(TypeError, match=r"keys of spectra must be periods.*got '2'"):
        wd.RecordSpectra.from_table(flat, {1.0: "a", "2": "b"}, {"name": "rsn"})


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore:implausible")
def test_the_records_of_fema_p695_agree_with_a_target():
    """M 7.3, 10 km, Vs30 300 m/s, reverse (Boore et al. 2014 by OpenQuake 3.26), half a standard deviation at 1 s."""
    periods = np.fromstring(
        "0.1 0.1196 0.143 0.1711 0.2046 0.2447 0.2927 0.3501 0.4187 0.5008 0.599 0.7164 0.8569 1 1.2258 "
        "1.466 1.7534 2.0972 2.5083 3",
        sep=" ",
    )
    of_model = np.fromstring(
        "0.52149 0.58517 0.64117 0.6922 0.73397 0.75712 0.77718 0.76638 0.72467 0.67594 0.60885 0.53322 "
        "0.46958 0.42288 0.3578 0.29891 0.2465 0.20111 0.16395 0.13428",
        sep=" ",
    )
    spread = np.fromstring(
        "0.70883 0.69669 0.66864 0.64301 0.61993 0.61009 0.6052 0.61203 0.61949 0.63961 0.65079 0.67258 "
        "0.6858 0.69241 0.69421 0.69438 0.69689 0.70126 0.70499 0.70816",
        sep=" ",
    )
    spectra = wd.RecordSpectra.from_motions([*wd.records.far_field(), *wd.records.near_field()], periods)
    target = wd.conditional_spectrum(periods, of_model, spread, ONE, epsilon=0.5)
    selection = wd.select_records(spectra, target, 20, tolerance=0.0, starts=12)
    median_error, deviation_error = selection.largest_errors[0]
    assert median_error < 0.05
    assert deviation_error < 0.1
    one = wd.select_records(spectra, target, 20, tolerance=0.0).largest_errors[0]
    assert max(2 * median_error, deviation_error) <= max(2 * one[0], one[1])
