"""Reports: the page's figures are there and its numbers are the dataset's, whatever the run is of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from plotted_runs import COLLAPSES, LEVELS, MOTIONS, found_capacities, striped_run
from report_pages import Page

import warpdyn as wd
from warpdyn.foundations.core.output_variables import DIVERGED

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit", "no_damping", "yield_drift_ratio")]
DRIFT = "peak absolute storey drift ratio [1]"


def run_with_scene(**changes: object) -> xr.Dataset:
    """Return the run made by hand with the attributes that `simulate` writes, and some more."""
    building = wd.ShearBuilding(2e5, [2e8, 1.8e8, 1.5e8], 3.0, law="bilinear", yield_force=2e6, hardening_ratio=0.02)
    motion = wd.GroundMotion(np.sin(np.arange(200)), 0.02, "a<b>&c")
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    scene = wd.Scene(building, wd.Stripes([motion], [0.2], wd.PeakGroundAcceleration()), scatter=scatter)
    run = striped_run()
    run["peak_storey_drift_ratio"].attrs = {"long_name": "peak absolute storey drift ratio", "units": "1"}
    run["motion_name"].values[0] = "a<b>&c"
    run.attrs |= {"scene": scene.to_json(), "seed": 7, "source": "warpdyn 9.9, numpy 0", "history": "yesterday"}
    run.attrs |= {"step": 0.01, "method_chosen_because": "of a <reason>"} | changes
    return run


@pytest.fixture(scope="module")
def fitted() -> xr.Dataset:
    run = run_with_scene()
    return run.merge(wd.fragility(run, {"slight": 0.01, "extensive": 0.04}), combine_attrs="no_conflicts")


def test_numbers_are_those_of_the_dataset(fitted: xr.Dataset, tmp_path: Path) -> None:
    page = Page(wd.report(fitted, tmp_path / "page.html", title="A building & its <storeys>"))
    assert page.headings[0] == "A building & its <storeys>"
    status = fitted["status"].values
    assert page.column("Status of the samples", "status") == ["ok", "collapsed"]
    np.testing.assert_array_equal(page.numbers("Status of the samples", "samples"), np.bincount(status))
    assert page.numbers("Storey that collapsed first", "samples").tolist() == [sum(COLLAPSES)]
    # Fractiles by hand: of sorted values, where a collapsed sample is beyond all.
    caption = f"{DRIFT}, by level"
    assert page.numbers(caption, "collapsed").tolist() == list(COLLAPSES)
    assert page.numbers(caption, "samples").tolist() == [MOTIONS] * len(LEVELS)
    worst = fitted["peak_storey_drift_ratio"].max("storey").values
    for level, median, high in zip(LEVELS, page.numbers(caption, "50%"), page.numbers(caption, "84%"), strict=True):
        own = np.sort(np.where(status == 1, np.inf, worst)[fitted["im_level"].values == level])
        due = (own[4] + own[5]) / 2 if np.isfinite(own[5]) else own[4]  # of ten: halfway from the fifth to the sixth
        assert median == pytest.approx(due, rel=6e-4) or (np.isnan(median) and np.isinf(due))
        assert np.isnan(high) == np.isinf(own[8])
    table = "Fragility curves, with 95% intervals"
    for head, name in (("median", "fragility_median"), ("dispersion", "fragility_dispersion")):
        np.testing.assert_allclose(page.numbers(table, head), fitted[name], rtol=6e-4)  # four digits
    assert page.column(table, "damage state") == ["slight", "extensive"]
    np.testing.assert_allclose(page.numbers(table, "limit"), [0.01, 0.04])
    said = dict(page.tables["Provenance of the results"])
    assert (said["versions"], said["why this method"]) == ("warpdyn 9.9, numpy 0", "of a <reason>")
    assert said["seed of every random draw"] == "7"
    assert page.column("Ground motions: 10", "motion")[0] == "a<b>&c"
    assert dict(page.tables["Structure (kg, m, s, N; from the ground up)"])["stiffness"] == "2e+08, 1.8e+08, 1.5e+08"


def test_figures_are_in_the_page_and_nothing_is_loaded(fitted: xr.Dataset, tmp_path: Path) -> None:
    page = Page(wd.report(fitted, tmp_path / "page.HTM"))
    starts = ("Largest peak drift", "Share of the samples", "Median peak drift", "Largest residual", "The first of the")
    assert len(page.figures) == 6
    for start in (*starts, "Fragility curves"):
        (pixels,) = (pixels for caption, pixels in page.figures.items() if caption.startswith(start))
        assert pixels.shape[1] > 700
        assert np.mean(pixels[..., :3].min(axis=2) < 0.9) > 0.01  # ink on the paper
    assert all(link.startswith("data:") for link in page.links)
    assert "http" not in page.text
    assert "@page { size: A4" in page.text


def test_remarks_name_what_limits_the_results(fitted: xr.Dataset, tmp_path: Path) -> None:
    bad = fitted.copy(deep=True)
    bad["status"].values[:3] = DIVERGED
    bad["energy_balance_error"] = "sample", np.where(np.arange(bad.sizes["sample"]) == 5, -0.5, 1e-5)
    bad["unreliable"] = "sample", (np.arange(bad.sizes["sample"]) < 4).astype(np.int8)
    bad["sensitive"] = "sample", (np.arange(bad.sizes["sample"]) < 2).astype(np.int8)
    bad["integration_step"].values[-1] = 0.002
    bad["status"].values[-1] = 0
    meanings = bad["fit_status"].attrs["flag_meanings"].split()
    bad["fit_status"].values[1] = meanings.index("separated")
    told = " ".join(Page(wd.report(bad, tmp_path / "page.html")).remarks)
    for words in (
        "3 of 40 samples failed in the integration and have no demands. This is more than 1%",
        "In 1 sample the energies do not balance within 2% of the energy supplied (largest error 0.5)",
        "4 samples flagged unreliable",
        "2 samples flagged sensitive",
        "No sample was run again with a finer step",
        "1 sample needed shorter steps",
        "'extensive' is not a regular fit: separated",
    ):
        assert words in told, words
    checked = fitted.copy()
    checked["estimated_relative_error"] = ("demand", "error_statistic"), [[1e-4, 2e-3, 5e-2]]
    checked = checked.assign_coords(demand=["peak_storey_drift_ratio"], error_statistic=["median", "95 %", "worst"])
    page = Page(wd.report(checked, tmp_path / "page.html"))
    caption = "Estimated relative error, from samples run again in float64 with half the step"
    assert page.numbers(caption, "worst").tolist() == [0.05]
    assert not any("finer step" in remark for remark in page.remarks)


def test_a_run_without_levels_or_drifts_has_what_it_has(tmp_path: Path) -> None:
    run = run_with_scene().drop_vars(["im_level", "displacement", "residual_drift_ratio", "storey_force"])
    page = Page(wd.report(run, tmp_path / "page.html"))
    assert len(page.figures) == 1  # the distribution of the drifts
    assert "Fragility" not in page.headings
    page = Page(wd.report(run.drop_vars("peak_storey_drift_ratio"), tmp_path / "page.html"))
    assert not page.figures
    assert "Demands" not in page.headings
    failed = run.assign(status=run["status"].copy(data=np.full(40, DIVERGED, np.int8)))
    assert "Demands" not in Page(wd.report(failed, tmp_path / "page.html")).headings


def test_long_tables_and_scenes_are_cut_and_say_so(tmp_path: Path) -> None:
    run = run_with_scene().drop_vars("motion_name")
    run["motion_name"] = "motion", np.array([f"record {i}" for i in range(70)])
    run.attrs["scene"] = run.attrs["scene"][:-1] + ',"more":"' + 7000 * "x" + '"}'
    page = Page(wd.report(run, tmp_path / "page.html"))
    assert len(page.column("Ground motions: 70, the first 60", "motion")) == 60
    assert "letters in all)" in page.text


BAD = {
    "ending": (lambda run, folder: wd.report(run, folder / "page.pdf"), ValueError, r"must end in '.html' or '.htm'"),
    "folder": (
        lambda run, folder: wd.report(run, folder / "no" / "page.html"),
        FileNotFoundError,
        "there is no folder",
    ),
    "path": (lambda run, folder: wd.report(run, None), TypeError, "path must name a file"),
    "no dataset": (lambda run, folder: wd.report({}, folder / "page.html"), TypeError, "takes a Dataset, got dict"),
    "no run": (
        lambda run, folder: wd.report(found_capacities(), folder / "page.html"),
        ValueError,
        "the dataset has no scene, seed, method, source: pass the result of simulate",
    ),
    "no status": (
        lambda run, folder: wd.report(run.drop_vars("status"), folder / "page.html"),
        ValueError,
        "the dataset has no status: pass the result of simulate",
    ),
    "no samples": (
        lambda run, folder: wd.report(run.isel(sample=[]), folder / "page.html"),
        ValueError,
        "the run has no samples",
    ),
    "one sample": (
        lambda run, folder: wd.report(run.isel(sample=0), folder / "page.html"),
        ValueError,
        r"select a single sample by isel\(sample=\[number\]\)",
    ),
    "title": (lambda run, folder: wd.report(run, folder / "page.html", title=" "), ValueError, "must not be empty"),
    "title's kind": (
        lambda run, folder: wd.report(run, folder / "page.html", title=3),
        TypeError,
        "must be text, got 3",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_refused_before_anything_is_written(case: str, tmp_path: Path) -> None:
    call, error, words = BAD[case]
    with pytest.raises(error, match=words):
        call(run_with_scene(), tmp_path)
    assert not list(tmp_path.iterdir())
