"""Names that users give motions, damage states and designs: in figures, reports and tables they stand as they are."""

import html
import json

import matplotlib as mpl
import numpy as np
import pandas as pd
import plotted_runs
import pytest
import xarray as xr
from matplotlib.text import Text
from report_pages import Page

import warpdyn as wd
from warpdyn.interfaces.plots.style import literal

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("hazard_over_highest", "drift_limit")]

NAMES = [
    r"$\nosuch$",
    "_slight",
    "__",
    "costs $5, or $6",
    r"\alpha_{1}^2 %s {0}",
    "<b>&amp; 'a' \"b\"</b>",
    "line\nbreak\tand tab",
    "comma, semicolon; equals=",
    "über 損傷 é",
    "x" * 500,
    "$",
    "50 % ^ _ ~ #",
]
TOGETHER = [NAMES[first : first + 3] for first in range(0, len(NAMES), 3)]


@pytest.fixture(autouse=True)
def backend():
    mpl.use("agg")


def texts(figure):
    """Return what is drawn, after everything has been laid out."""
    figure.canvas.draw()
    return "\n".join(text.get_text() for text in figure.findobj(Text)).replace(r"\$", "$")


def curves_of(*states):
    run = plotted_runs.striped_run()
    return run, wd.fragility(run, {state: 0.01 * (i + 1) for i, state in enumerate(states)}, replicates=20)


def shown(name):
    """Return what a figure shows of a name: one line of at most 60 letters."""
    words = " ".join(name.split())
    return words if len(words) <= 60 else words[:57] + "..."


@pytest.mark.parametrize("names", TOGETHER)
@pytest.mark.filterwarnings("ignore:Glyph .* missing from font")  # the letters of another script, in matplotlib's own
@pytest.mark.filterwarnings("ignore:.*(extrapolat|hazard|penalised|beyond|do not determine|fitted|interval)")
def test_figures(names):
    """Figures of several damage states, runs or motions show several names; the others are drawn once per name."""
    run, curves = curves_of(*names)
    run["motion_name"] = ("motion", np.resize(names, run.sizes["motion"]))
    hazard = wd.HazardCurve([0.05, 0.2, 1.0, 4.0], [2e-2, 3e-3, 1e-4, 5e-7])
    both = run.merge(curves, combine_attrs="no_conflicts")
    motions = [wd.GroundMotion(np.sin(np.arange(200) / 9), 0.02, name) for name in names]
    found = plotted_runs.found_capacities().assign_coords(damage_state=names)
    drawn = [
        wd.plots.fragility_curves(curves),
        wd.plots.fragility_comparison({name: curves for name in names}),
        wd.plots.drift_against_intensity(both),
        wd.plots.drift_over_height(both),
        wd.plots.ida_curves(both),
        wd.plots.drift_distributions({name: run for name in names}, level=0.4),
        wd.plots.hazard_and_rates(curves, hazard),
        wd.plots.disaggregation(wd.disaggregate(curves, hazard)),
        wd.plots.ground_motions(motions),
        wd.plots.capacities(found),
    ]
    for number, figure in enumerate(drawn):
        shows = texts(figure)
        assert [name for name in names if shown(name) not in shows] == [], number
    for name, motion in zip(names, motions, strict=True):
        run["motion_name"] = ("motion", np.array([name] * run.sizes["motion"]))
        for number, figure in enumerate([wd.plots.histories(run), wd.plots.ground_motions([motion])]):
            assert shown(name) in texts(figure), number


@pytest.mark.parametrize("name", NAMES)
def test_a_name_has_its_line_in_the_legend(name):
    _, curves = curves_of(name, "complete")
    figure = wd.plots.fragility_curves(curves)
    labels = [text.get_text() for axes in figure.axes if axes.get_legend() for text in axes.get_legend().get_texts()]
    assert any(shown(name) in label.replace(r"\$", "$") for label in labels), labels


def test_a_name_without_letters_is_told():
    assert literal(" \n ") == "(no name)"


@pytest.mark.parametrize("name", NAMES)
def test_tables(name, tmp_path):
    """A table holds the name to the letter, whatever separates its columns."""
    _, curves = curves_of(name, "complete")
    path = wd.write_table(curves, tmp_path / "curves.csv")
    assert pd.read_csv(path)["damage_state"].tolist() == [name, "complete"]
    path = wd.write_table(curves, tmp_path / "curves.parquet")
    assert pd.read_parquet(path)["damage_state"].tolist() == [name, "complete"]


@pytest.mark.parametrize("name", NAMES)
def test_netcdf(name, tmp_path):
    _, curves = curves_of(name, "complete")
    with xr.open_dataset(wd.write(curves, tmp_path / "curves.nc")) as again:
        assert again["damage_state"].values.tolist() == [name, "complete"]


@pytest.mark.parametrize("name", NAMES)
def test_html_and_json(name):
    motion = wd.GroundMotion(np.sin(np.arange(200) / 9), 0.02, name)
    building = wd.ShearBuilding(1e5, 4e7, 3.0, damping="rayleigh", damping_ratio=0.05)
    scene = wd.Scene(building, motion, title=name)
    assert f"Scene: {html.escape(name)}" in scene._repr_html_()
    assert "<b>&" not in scene._repr_html_().replace("<b>Scene", "")
    again = wd.Scene.from_json(scene.to_json(), motion)
    assert again.title == name
    assert json.loads(again.to_json()) == json.loads(scene.to_json())


@pytest.mark.parametrize("names", TOGETHER)
@pytest.mark.filterwarnings("ignore:Glyph .* missing from font")
def test_reports(names, tmp_path):
    building = wd.ShearBuilding(2e5, [2e8, 1.8e8, 1.5e8], 3.0, damping="rayleigh", damping_ratio=0.05)
    run, curves = curves_of(*names)
    run["motion_name"] = ("motion", np.resize(names, run.sizes["motion"]))
    run["peak_storey_drift_ratio"].attrs = {"long_name": "peak absolute storey drift ratio", "units": "1"}
    motions = [wd.GroundMotion(np.sin(np.arange(200) / 9), 0.02, name) for name in names]
    scene = wd.Scene(building, wd.Stripes(motions, [0.2], wd.PeakGroundAcceleration()))
    run.attrs |= {"scene": scene.to_json(), "seed": 7, "source": "warpdyn", "history": "today", "step": 0.01}
    both = run.merge(curves, combine_attrs="no_conflicts")
    title = " ".join(names)
    page = Page(wd.report(both, tmp_path / "page.html", title=title))
    assert page.headings[0].split() == title.split()
    caption = next(caption for caption in page.tables if caption.startswith("Fragility curves"))
    assert [cell.split() for cell in page.column(caption, "damage state")] == [name.split() for name in names]
    assert len(page.figures) >= 3
