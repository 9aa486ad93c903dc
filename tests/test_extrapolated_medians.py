"""Medians outside the levels: marked in the warning, the dataset and whatever is written of it; NaN if undetermined."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ElementTree

import numpy as np
import pandas as pd
import pytest
from test_cloud_curves import make_cloud
from test_fragility import make_run, synthetic_run

import warpdyn as wd
from warpdyn.answers.fragility.intervals.extrapolation import levels_towards

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]
MEDIAN = 1.5  # of the synthetic run at a limit of 0.03, which drifts by 0.02 times the intensity in the median


def lognormal_run(counts, levels, records=44):
    """Return a run in which so many records exceed a limit of 0.02 at each level: the first ones."""
    record, level = np.repeat(np.arange(records), len(levels)), np.tile(levels, records)
    drift = np.where(record < np.tile(counts, records), 0.03, 0.01)
    run = make_run(drift, record, level)
    run["im_level"].attrs |= wd.SpectralAcceleration(0.75).attributes()
    return run


def wide_run(levels):
    """Return a run at levels below a median of 1.5 at a limit of 0.03."""
    run = synthetic_run(5, records=60, structures=20, levels=levels)
    run["im_level"].attrs |= wd.SpectralAcceleration(0.75).attributes() | {"design": "stripes"}
    return run


def test_the_data_of_one_sample_above_the_limit_do_not_determine_a_median():
    run = lognormal_run([0, 0, 0, 1], [0.2, 0.4, 0.8, 1.4], records=24)
    told = (
        r"(?s)'complete': the data do not determine the curve.*NaN; the fit has a median of [0-9.]+ g.*add levels above"
    )
    with pytest.warns(UserWarning, match=told):
        curves = wd.fragility(run, {"complete": 0.02})
    for name in ("fragility_median", "fragility_dispersion", "fragility_curve", "replicate_median"):
        assert np.isnan(curves[name]).all(), name
    meanings = curves["fit_status"].attrs["flag_meanings"].split()
    assert meanings[int(curves["fit_status"][0])] == "undetermined"
    assert curves["median_status"].attrs["flag_meanings"].split()[int(curves["median_status"][0])] == "none"
    assert curves["exceeding_samples"].values.tolist() == [[0, 0, 0, 1]]  # what was counted stays
    with pytest.raises(ValueError, match="'complete' has no fragility curve"):
        wd.annual_rates(curves, wd.HazardCurve([0.1, 1.0], [1e-2, 1e-4]))


def test_a_slope_whose_interval_reaches_zero_determines_no_median():
    # 1 and 6 of 176 samples, in a few records: the fitted median is 3 times the highest level, within 0.006 to 25 g.
    generator = np.random.default_rng(2)
    run = synthetic_run(2, records=44, structures=4, between=0.6, within=0.3, levels=(0.2, 0.4, 0.8, 1.4))
    run = run.isel(sample=generator.permutation(run.sizes["sample"]))
    limit = float(np.sort(run["peak_storey_drift_ratio"].values.max(axis=1))[-6])
    with pytest.warns(UserWarning, match="'complete': the data do not determine the curve"):
        curves = wd.fragility(run, {"complete": limit})
    assert np.isnan(curves["fragility_median"][0])


def extrapolated():
    """Return curves whose median lies above the levels, and is determined."""
    with pytest.warns(UserWarning, match=r"'heavy': the median of 1\.\d+ g is an extrapolation, above the highest"):
        return wd.fragility(wide_run((0.3, 0.6, 0.9, 1.2)), {"light": 0.015, "heavy": 0.03})


def test_a_median_beyond_the_levels_that_is_determined_is_kept_and_marked():
    curves = extrapolated()
    assert curves["median_status"].values.tolist() == [0, 1]
    assert curves["median_status"].attrs["flag_meanings"] == "within_levels extrapolated none"
    lower, upper = (float(curves[f"fragility_median_{side}"][1]) for side in ("lower", "upper"))
    assert lower < MEDIAN < upper  # the true median of how the run was made
    assert curves["storey_median_status"].dims == ("damage_state", "storey")


def test_levels_about_the_median_remove_the_mark():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        curves = wd.fragility(wide_run((0.3, 0.6, 0.9, 1.2, 1.8)), {"heavy": 0.03})
    assert curves["median_status"].values.tolist() == [0]


def test_tables_figures_reports_and_exports_carry_the_mark(tmp_path):
    curves = extrapolated()
    table = pd.read_csv(wd.write_table(curves, tmp_path / "curves.csv"))
    assert table["median_status"].tolist() == ["within_levels", "extrapolated"]
    figure = wd.plots.fragility_curves(curves)
    labels = figure.axes[0].get_legend_handles_labels()[1]
    assert any(label.startswith("heavy") and label.endswith("extrapolated") for label in labels)
    assert not any(label.startswith("light") and "extrapolated" in label for label in labels)
    from warpdyn.interfaces.reports.curves import fragility as section

    run = wide_run((0.3, 0.6, 0.9, 1.2))
    (shown,) = (part for part in section(run.merge(curves, combine_attrs="no_conflicts")) if part["kind"] == "table")
    assert [row[-1] for row in shown["rows"]] == ["within levels", "extrapolated"]
    one = curves.sel(damage_state=["heavy"])
    with pytest.warns(UserWarning, match="median of 'heavy' .* is an extrapolation"):
        path = wd.write_nrml_fragility({"A": one}, tmp_path / "model.xml")
    text = ElementTree.parse(path).getroot()[0][0].text
    assert "Extrapolated medians: A: 'heavy' (1." in text
    hazard = wd.HazardCurve([0.05, 0.5, 1.0, 4.0], [1e-1, 1e-2, 1e-3, 1e-5], measure="Sa(0.75 s, 5 %)")
    with pytest.warns(UserWarning, match="median of 'heavy' .* is an extrapolation"):
        wd.annual_rates(one, hazard)


def test_curves_of_capacities_and_clouds_carry_it_too():
    generator = np.random.default_rng(1)
    capacity = MEDIAN * np.exp(0.4 * generator.standard_normal((2, 200)))
    import xarray as xr

    highest = 1.3
    found = xr.Dataset(
        {
            "capacity": (("damage_state", "motion"), np.where(capacity > highest, np.inf, capacity), {"units": "g"}),
            "capacity_lower": (("damage_state", "motion"), np.minimum(capacity, highest)),
        },
        {"damage_state": ["a", "b"]},
    )
    with pytest.warns(UserWarning, match="the median of 1.* g is an extrapolation, above the highest"):
        curves = wd.fragility_from_capacities(found)
    assert curves["median_status"].values.tolist() == [1, 1]
    np.testing.assert_allclose(
        curves["fragility_median"], MEDIAN, rtol=0.12
    )  # 3 standard errors: 0.4 / sqrt(200) = 3 %
    intensity = np.exp(generator.uniform(np.log(0.2), np.log(1.2), 200))
    drift = 0.02 * intensity * np.exp(0.3 * generator.standard_normal(200))
    with pytest.warns(UserWarning, match="'heavy': the median of 1.* g is an extrapolation"):
        curves = wd.fragility_of_cloud(make_cloud(intensity, drift), {"light": 0.01, "heavy": 0.03})
    assert curves["median_status"].values.tolist() == [0, 1]


def test_advised_levels_lie_towards_the_median():
    assert levels_towards(4.69, 0.2, 1.4, "g") == "add levels above 1.4 g, such as 2.1, 3.1, 4.7"
    assert levels_towards(109.0, 0.2, 1.4, "g") == "add levels above 1.4 g, such as 2.2, 3.5, 5.6"  # 4 times, at most
    assert levels_towards(0.05, 0.2, 1.4, "g") == "add levels below 0.2 g, such as 0.05, 0.079, 0.13"
    # Of a median close to the highest level (or the lowest), levels up to 1.25 times as high, with two digits.
    assert levels_towards(1.22, 0.2, 1.2, "g") == "add levels above 1.2 g, such as 1.3, 1.4, 1.5"
    assert levels_towards(0.199, 0.2, 1.2, "g") == "add levels below 0.2 g, such as 0.16, 0.17, 0.19"
