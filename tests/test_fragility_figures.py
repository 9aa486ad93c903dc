"""Figures of fragility curves and of clouds: their legends, their names of limits and their colours."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from plotted_curves import CLOUD, CURVES, MERGED, RUN

import warpdyn as wd
from warpdyn import plots

pytestmark = pytest.mark.fast


def test_a_cloud_has_its_line_its_collapses_and_a_median_for_each_limit():
    (axes,) = plots.cloud_regression(RUN, CLOUD).axes
    line = axes.get_lines()[0]
    level, drift = line.get_data()
    expected = np.exp(float(CLOUD["regression_intercept"])) * level ** float(CLOUD["regression_slope"])
    np.testing.assert_allclose(drift, 100 * expected, rtol=1e-9)
    said = [text.get_text() for text in axes.texts] + [text.get_text() for text in axes.get_legend().get_texts()]
    assert "collapsed: 12 of 40" in said
    median = float(CLOUD["fragility_median"][0])
    assert f"slight: median {median:.3g}" in said
    assert any(each.startswith("median of collapse") for each in said)
    with pytest.raises(ValueError, match=r"no regression_intercept.*: pass the result of fragility_of_cloud"):
        plots.cloud_regression(RUN, CURVES)


@pytest.mark.parametrize("side", ["min", "max"])
def test_the_name_of_a_limit_leaves_its_median_free(side):
    """Whether the median is at the left or at the right of the cloud."""
    median = float(getattr(RUN["im_level"], side)())
    moved = CLOUD.assign(fragility_median=xr.full_like(CLOUD["fragility_median"], median))
    (axes,) = plots.cloud_regression(RUN, moved).axes
    axes.figure.draw_without_rendering()
    for name, limit in zip(axes.texts, CLOUD["damage_limit"], strict=True):
        x, y = axes.transData.transform((median, 100 * float(limit)))
        assert not name.get_window_extent().padded(3).contains(x, y)


def test_curves_without_stripes_are_drawn():
    (axes,) = plots.fragility_curves(CLOUD).axes
    assert len(axes.get_lines()) == 2
    assert axes.get_xlim()[1] < 1.2 * CLOUD["intensity"].max()
    plots.fragility_comparison({"stripes": CURVES, "cloud": CLOUD}).draw_without_rendering()


def test_the_legend_of_curves_that_rise_at_once_stands_clear_of_them():
    """The levels begin where the first curve is halfway up, so that it fills the upper left corner."""
    early = wd.fragility(RUN, {"slight": 0.008, "extensive": 0.02})
    figure = plots.fragility_curves(early.sel(stripe=slice(float(early["fragility_median"][0]), None)))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    covered = axes.get_legend().get_window_extent()
    for line in axes.get_lines():
        drawn = axes.transData.transform(line.get_xydata()[np.isfinite(line.get_xydata()).all(axis=1)])
        assert not covered.count_contains(drawn[drawn[:, 0] >= axes.bbox.x0])


def test_names_of_designs_have_room_above_a_lone_panel():
    of_one_state = CURVES.isel(damage_state=[1])
    names = "as built", "after moderate damage", "after extensive damage"
    figure = plots.fragility_comparison(dict.fromkeys(names, of_one_state))
    figure.draw_without_rendering()
    (legend,) = figure.legends
    ends = legend.get_window_extent().intervalx
    assert all(figure.bbox.containsx(end) for end in ends)


def test_colours_are_the_users():
    axes = plots.fragility_curves(CURVES, colours={"slight": "gold", "extensive": "tab:red"}).axes[0]
    assert [line.get_color() for line in axes.lines if "drift" in str(line.get_label())] == ["gold", "tab:red"]
    assert axes.get_xscale() == "log"
    assert axes.get_xlabel() == "PGA [g]"  # without the run as well
    assert plots.fragility_curves(MERGED, scale="linear").axes[0].get_xscale() == "linear"
    with pytest.raises(ValueError, match="colours has no colour for 'extensive'"):
        plots.fragility_curves(CURVES, colours={"slight": "gold"})
    with pytest.raises(ValueError, match="colours contains 'golden', which is not a colour of matplotlib"):
        plots.fragility_curves(CURVES, colours=["golden"])
    with pytest.raises(ValueError, match="unknown scale 'logarithmic'"):
        plots.fragility_curves(CURVES, scale="logarithmic")
    other = CURVES.assign_attrs(intensity_measure="PGV")
    with pytest.raises(ValueError, match=r"different intensity measures \('a': PGA \[g\]; 'b': PGV \[g\]\)"):
        plots.fragility_comparison({"a": CURVES, "b": other})
