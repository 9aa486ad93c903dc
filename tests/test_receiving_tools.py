"""Files that are written for other tools, read by these tools' own readers where they are installed.

Neither is among the test requirements: openquake.engine needs GDAL, and pelicun an older pandas. Without them these
tests are skipped; what the readers demand is tested one by one in the files of each format.
"""

import types

import numpy as np
import pytest
from scipy.stats import lognorm
from test_nrml_fragility import RISING, STATES, make_curves, make_stripes
from test_nrml_vulnerability import LEVELS, MEANS, SHARES, VARIATIONS, make_function
from test_pelicun_demands import complete_run

import warpdyn as wd

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def nrml():
    pytest.importorskip("openquake.risklib")
    from openquake.hazardlib import nrml
    from openquake.risklib import read_nrml

    read_nrml.update_validators()
    return nrml


def test_the_engine_has_the_same_continuous_curves(tmp_path, nrml):
    curves = {"C1M_H": make_curves(measure="Sa(0.3 s, 5 %)"), "CR/LFM:5": make_curves((0.3, 0.5, 0.9))}
    model = nrml.to_python(str(wd.write_nrml_fragility(curves, tmp_path / "model.xml")))
    assert model.limitStates == list(STATES)
    for taxonomy, measure in (("C1M_H", "SA(0.3)"), ("CR/LFM:5", "PGA")):
        median, dispersion = (curves[taxonomy][f"fragility_{name}"].values for name in ("median", "dispersion"))
        functions = model[measure, taxonomy].build(model.limitStates)
        levels = np.geomspace(0.1, 1.0, 30)
        for function, m, b in zip(functions, median, dispersion, strict=True):
            # Round trips through mean and stddev cost some ten roundings.
            np.testing.assert_allclose(function(levels), lognorm.cdf(levels, b, scale=m), rtol=0, atol=1e-12)
            assert function(np.array([1e-3]))[0] == 0


def test_the_engine_has_the_same_discrete_curves(tmp_path, nrml):
    path = wd.write_nrml_fragility({"A": make_stripes(RISING)}, tmp_path / "model.xml", format="discrete")
    model = nrml.to_python(str(path))
    functions = model["PGA", "A"].build(model.limitStates)
    for function, (first, second, third) in zip(functions, RISING, strict=True):
        # Linear between the stripes at 0.1, 0.2 and 0.4 g, from 0 below (1e-9: in truth from 1e-10 g), held beyond.
        expected = [first / 2, first, (first + second) / 2, (second + third) / 2, third, third]
        found = function(np.array([0.05, 0.1, 0.15, 0.3, 0.4, 3.0]))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("distribution", ["BT", "LN"])
def test_the_engine_has_the_same_losses(tmp_path, nrml, distribution):
    path = tmp_path / "model.xml"
    wd.write_nrml_vulnerability({"C1M_H": make_function()}, path, distribution=distribution)
    function = nrml.to_python(str(path))["SA(0.3)", "C1M_H"]
    np.testing.assert_array_equal(function.imls, LEVELS)
    np.testing.assert_array_equal(function.mean_loss_ratios, MEANS)
    np.testing.assert_array_equal(function.covs, VARIATIONS)
    assert function.distribution_name == distribution


def test_the_engine_reads_the_tables(tmp_path):
    readinput = pytest.importorskip("openquake.commonlib.readinput")
    mapping = wd.write_taxonomy_mapping({"CR": {"C1M_H": 0.7, "C1L_H": 0.3}, "W": "W1"}, tmp_path / "mapping.csv")
    table = readinput._taxonomy_mapping(str(mapping), {"CR": 0, "W": 1})
    assert table[["risk_id", "weight", "taxi"]].values.tolist() == [["C1M_H", 0.7, 0], ["C1L_H", 0.3, 0], ["W1", 1, 1]]
    consequences = wd.write_consequences({"C1M_H": SHARES}, tmp_path / "consequences.csv")
    job = types.SimpleNamespace(inputs={"consequence": {"taxonomy": str(consequences)}, "job_ini": "job.ini"})
    read = readinput.read_consdict(job, list(SHARES), ["groundshaking"])["losses_by_risk_id"]
    assert read[list(SHARES)].values.tolist() == [list(SHARES.values())]


def test_pelicun_finds_the_same_medians_and_leaves_failures_out(tmp_path):
    assessment = pytest.importorskip("pelicun.assessment")
    run, path = complete_run(), tmp_path / "demands.csv"
    run["status"][2] = 2  # the first record at 0.8 g diverges
    wd.write_pelicun_demands(run, path, level=0.8)
    own = assessment.DLCalculationAssessment({"PrintLog": False, "LogFile": str(tmp_path / "log.txt")})
    own.demand.load_sample(str(path))
    sample = own.demand.sample
    kept = run.isel(sample=np.flatnonzero((run["im_level"] == 0.8) & (run["status"] != 2)))
    assert len(sample) == 9
    for kind, variable in (("PID", "peak_storey_drift_ratio"), ("PFA", "peak_floor_acceleration")):
        values = kept[variable].values
        found = [sample[kind, str(place), "1"].median() for place in (1, 2, 3)]
        np.testing.assert_allclose(found, np.median(values, axis=0), rtol=1e-12)
    np.testing.assert_allclose(sample["PFA", "0", "1"], 0.8 * 9.80665, rtol=1e-12)
    np.testing.assert_allclose(sample["PGA", "0", "1"], 0.8 * 9.80665, rtol=1e-12)  # g in the file
    # Five collapses, which a limit of 0.1 tells from the four that stand.
    assert (sample["PID"].max(axis=1) >= 0.1).sum() == 5


def test_pelicun_censors_collapses_as_by_hand(tmp_path):
    from scipy.optimize import minimize
    from scipy.stats import norm

    assessment = pytest.importorskip("pelicun.assessment")
    run, path = complete_run(), tmp_path / "demands.csv"
    # One storey: pelicun 3.10 fails to fit several whose drifts are proportional to each other.
    one = run[["peak_storey_drift_ratio", "status", "storey_of_collapse"]].isel(storey=[0])
    wd.write_pelicun_demands(one, path, level=0.8)
    own = assessment.DLCalculationAssessment({"PrintLog": False, "LogFile": str(tmp_path / "log.txt")})
    own.demand.load_sample(str(path))
    calibration = {"DistributionFamily": "lognormal", "CensorUpper": "0.1", "Unit": "rad"}
    own.demand.calibrate_model({"ALL": {"DistributionFamily": "empirical"}, "PID": calibration})
    fitted = own.demand.marginal_params.loc[("PID", "1", "1")]
    standing = np.log(0.008 * np.arange(1, 6))

    def loss(x):
        return -norm.logpdf(standing, x[0], np.exp(x[1])).sum() - 5 * norm.logsf(np.log(0.1), x[0], np.exp(x[1]))

    mean, logarithm = minimize(
        loss, [np.log(0.05), 0.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}
    ).x
    # pelicun's BFGS stops at a gradient of 1e-5; 1e-3 is far above that and far below the spread.
    assert fitted["Theta_0"] == pytest.approx(np.exp(mean), rel=1e-3)
    assert fitted["Theta_1"] == pytest.approx(np.exp(logarithm), rel=1e-3)
