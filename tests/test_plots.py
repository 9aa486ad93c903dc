"""Figures of runs: what is in them where samples collapsed, where they are drawn, and what they refuse."""

from __future__ import annotations

from functools import cache

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from fragility_parameters import curves
from frame_cases import portal
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from plotted_curves import CLOUD, CURVES, MERGED, RUN
from plotted_runs import CAPACITY, LEVELS, MOTIONS, found_capacities
from test_maps import make_results

import warpdyn as wd
from warpdyn import plots
from warpdyn.interfaces.plots.samples import fractiles

pytestmark = pytest.mark.fast

PULSE = wd.GroundMotion(9.81 * np.sin(np.arange(200) / 10) * np.exp(-np.arange(200) / 80), 0.01, "pulse")
WEAK = wd.GroundMotion(0.5 * PULSE.acceleration[:150], 0.01, "weak")
SITE = wd.HazardCurve([0.02, 0.1, 0.5, 2.0, 10.0], [0.3, 0.05, 3e-3, 1e-4, 1e-6])
FITTED = curves({"slight": (0.2, 0.4), "moderate": (0.5, 0.45)})
RATIOS = {"slight": (0.05, 0.6), "moderate": 0.4}


@cache  # computed by the process that runs the tests of this file, not by each that collects them
def computed_spectra() -> xr.Dataset:
    return wd.response_spectra([PULSE, WEAK], [0.1, 0.5, 1.0], [0.02, 0.05], device="cpu")


def selected_records() -> wd.RecordSelection:
    motions = [wd.GroundMotion(factor * PULSE.acceleration, 0.01, f"pulse {factor}") for factor in (0.2, 0.5, 1.0, 2.0)]
    spectra = wd.RecordSpectra.from_motions(motions, periods=[0.1, 0.3, 1.0])
    target = wd.TargetSpectrum([0.1, 0.3, 1.0], [0.8, 0.4, 0.2], [0.3, 0.0, 0.4], wd.SpectralAcceleration(0.3))
    return wd.select_records(spectra, target, number=4, scale=(0.05, 20.0))


def shares_of_variance() -> xr.Dataset:
    shares = {f"correlation_ratio{end}": ("input", [0.3, 0.6]) for end in ("", "_lower", "_upper")}
    return xr.Dataset(shares, {"input": ["mass", "stiffness (storey 2)"]})


def made_surface() -> xr.Dataset:
    axes = {"first_intensity": [0.1, 0.2, 0.4], "second_intensity": [0.1, 0.3]}
    values = [[[0.05, 0.1], [0.3, 0.6], [0.8, 0.95]]]
    return xr.Dataset({"probability": (("damage_state", *axes), values)}, {"damage_state": ["slight"], **axes})


def damaged_curves() -> xr.Dataset:
    dims, nan = ("from_state", "damage_state"), np.nan
    values = {
        "fragility_median": (dims, [[0.2, 0.5], [nan, 0.3]]),
        "fragility_dispersion": (dims, np.full((2, 2), 0.4)),
    }
    values["exceedance_fraction"] = (*dims, "stripe"), [[[0.1, 0.8], [0.0, 0.4]], [[nan, nan], [0.1, 0.6]]]
    return xr.Dataset(values, {"from_state": ["none", "a"], "damage_state": ["a", "b"], "stripe": [0.1, 0.4]})


# Every plot, with how many axes it takes.
PLOTS = {
    "building": (lambda **how: plots.building(wd.ShearBuilding.from_hazus("C1L", "high", 2), **how), 1),
    "capacities": (lambda **how: plots.capacities(found_capacities(), **how), 1),
    "cloud_regression": (lambda **how: plots.cloud_regression(RUN, CLOUD, **how), 1),
    "damage_map": (lambda **how: plots.damage_map(make_results(50), "slight", **how), 1),
    "disaggregation": (lambda **how: plots.disaggregation(wd.disaggregate(FITTED, SITE), **how), 1),
    "drift_against_intensity": (lambda **how: plots.drift_against_intensity(MERGED, **how), 1),
    "drift_distributions": (lambda **how: plots.drift_distributions({"a": RUN}, level=0.8, **how), 1),
    "drift_over_height": (lambda **how: plots.drift_over_height(MERGED, **how), 1),
    "fragility_comparison": (lambda **how: plots.fragility_comparison({"a": CURVES, "b": MERGED}, **how), 2),
    "fragility_curves": (lambda **how: plots.fragility_curves(MERGED, **how), 1),
    "fragility_surface": (lambda **how: plots.fragility_surface(made_surface(), **how), 1),
    "frame": (lambda **how: plots.frame(portal(), **how), 1),
    "ground_motions": (lambda **how: plots.ground_motions([PULSE, WEAK], **how), 3),
    "hazard_and_rates": (lambda **how: plots.hazard_and_rates(FITTED, SITE, **how), 2),
    "histories": (lambda **how: plots.histories(RUN, 1, **how), 3),
    "hysteresis": (lambda **how: plots.hysteresis(RUN, 1, **how), 3),
    "ida_curves": (lambda **how: plots.ida_curves(MERGED, **how), 1),
    "loss_exceedance": (lambda **how: plots.loss_exceedance(wd.annual_losses(FITTED, SITE, RATIOS), **how), 1),
    "pushover_curve": (
        lambda **how: plots.pushover_curve(
            wd.pushover(wd.ShearBuilding.from_hazus("C1L", "high", 2), np.linspace(0.01, 0.1, 9)), **how
        ),
        2,
    ),
    "record_selection": (lambda **how: plots.record_selection(selected_records(), **how), 2),
    "residual_drifts": (lambda **how: plots.residual_drifts(RUN, **how), 1),
    "sensitivity": (lambda **how: plots.sensitivity(shares_of_variance(), **how), 1),
    "spectra": (lambda **how: plots.spectra(computed_spectra(), **how), 2),
    "state_dependent_fragility": (lambda **how: plots.state_dependent_fragility(damaged_curves(), **how), 2),
    "vulnerability": (lambda **how: plots.vulnerability(wd.vulnerability(FITTED, RATIOS), **how), 1),
}


def test_every_plot_is_here():
    assert {*PLOTS, "animate"} == set(plots.__all__)  # test_animations.py tests the animation


@pytest.mark.parametrize("name", PLOTS)
def test_a_plot_is_a_figure_of_its_own_or_in_given_axes(name):
    plot, count = PLOTS[name]
    plt.close("all")  # figures that tests of other files have left
    figure = plot()
    assert isinstance(figure, Figure)
    assert figure._repr_png_()[1:4] == b"PNG"
    assert not plt.get_fignums()  # pyplot keeps no figure, which a notebook would show a second time
    own = Figure()
    given = own.subplots(count, squeeze=False)[:, 0]
    result = plot(ax=given[0] if count == 1 else given)
    assert result is given[0] if count == 1 else list(result) == list(given)
    assert all(axes.has_data() for axes in given)
    own.draw_without_rendering()
    with pytest.raises(ValueError, match=rf"plots\.{name} draws {count} panels?: give one axes for each as ax=, got 5"):
        plot(ax=Figure().subplots(5))
    with pytest.raises(TypeError, match=rf"plots\.{name}: ax must be matplotlib axes, .*got Figure"):
        plot(ax=own)


def test_fractiles_end_where_too_many_collapse():
    demand = np.array([4.0, 1.0, np.inf, 3.0, 2.0, np.inf, np.inf])  # 3 of 7 collapsed
    low, median, high = fractiles(demand)
    assert low == pytest.approx(1 + 0.16 * 6)
    assert median == 4.0
    assert np.isnan(high)
    # With half of the samples the median is the largest that stands; with more there is none.
    assert fractiles(np.array([1.0, 2.0, np.inf, np.inf]))[1] == 2.0
    assert np.isnan(fractiles(np.array([1.0, np.inf, np.inf]))[1])
    assert np.isnan(fractiles(np.full(3, np.inf))).all()
    table = np.random.default_rng(0).lognormal(size=(44, 3))
    np.testing.assert_allclose(fractiles(table), np.quantile(table, (0.16, 0.5, 0.84), axis=0), rtol=1e-14)


def line_named(axes, name):
    """Return the line of a name in the legend."""
    (line,) = (line for line in axes.lines if line.get_label() == name)
    return line


def test_the_median_ends_and_collapses_are_marked():
    # By hand: at 0.8 g five of ten stand, with 0.8 to 4 %; the largest of them is the median. At 1.6 g four stand.
    axes = plots.drift_against_intensity(MERGED).axes[0]
    median = line_named(axes, "median").get_ydata()
    np.testing.assert_allclose(median[:3], [1.1, 2.2, 4.0])
    assert np.isnan(median[3])
    high = axes.lines[2].get_ydata()
    np.testing.assert_allclose(high[:2], [0.2 * (1 + 0.84 * 9), 0.4 * (1 + 0.84 * 9)])
    assert np.isnan(high[2:]).all()
    (crosses,) = (each for each in axes.collections if each.get_label() == "collapsed: 12 of 40")
    np.testing.assert_allclose(crosses.get_offsets(), [[level, 100 * CAPACITY] for level in LEVELS[1:]])
    assert axes.get_xscale() == "log"
    assert plots.drift_against_intensity(RUN, scale="linear").axes[0].get_xscale() == "linear"

    residual = plots.residual_drifts(RUN).axes[0]
    np.testing.assert_allclose(line_named(residual, "median").get_ydata()[:3], [0.11, 0.22, 0.4])
    assert np.isnan(line_named(residual, "median").get_ydata()[3])
    assert "collapsed: 12 of 40" in [each.get_label() for each in residual.collections]


def test_profiles_tell_the_share_of_collapses_and_title_stands_clear():
    figure = plots.drift_over_height(MERGED)
    axes = figure.axes[0]
    third, last = line_named(axes, "0.8, 50 % collapsed"), line_named(axes, "1.6, 60 % collapsed")
    # At 0.8 g five of ten collapse, in the first storey, at 10 %: its median is the largest that stands, 4 %. In the
    # others, where they have .6 and .3 of it, it is half-way to the peaks at which these collapse. At 1.6 g six do.
    np.testing.assert_allclose(third.get_xdata(), [4.0, 0.6 * 7.0, 0.3 * 7.0])
    np.testing.assert_allclose(last.get_xdata(), [np.nan, 6.0, 3.0])
    unknown = plots.drift_over_height(RUN.drop_vars("storey_of_collapse")).axes[0]
    assert np.isnan(line_named(unknown, "1.6, 60 % collapsed").get_xdata()).all()
    figure.draw_without_rendering()
    title = axes.title.get_window_extent()
    above = axes.child_axes[0].get_xticklabels()
    assert [label.get_text() for label in above] == ["slight", "extensive"]
    assert not any(title.overlaps(label.get_window_extent()) for label in above)


ALL = RUN.assign(status=RUN["status"].copy(data=np.ones(40, np.int8)), storey_of_collapse=("sample", np.ones(40, int)))
NONE = RUN.assign({name: 0 * RUN[name] for name in ("peak_storey_drift_ratio", "residual_drift_ratio")})


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("run", [ALL.isel(storey=[0]), NONE], ids=["all collapsed", "nothing moves"])
def test_runs_without_a_drift_to_draw_are_drawn(run):
    for plot in (plots.drift_over_height, plots.drift_against_intensity, plots.residual_drifts, plots.ida_curves):
        plot(run).draw_without_rendering()
    plots.ida_curves(run, scale="log").draw_without_rendering()
    plots.drift_distributions({"a": run}, level=0.8).draw_without_rendering()


def test_fractiles_of_capacities_end_where_too_many_are_infinite():
    axes = plots.capacities(found_capacities()).axes[0]
    median, high = (line_named(axes, f"{share} % of capacities") for share in (50, 84))
    np.testing.assert_allclose(median.get_ydata(), [1.0, 1.9, 2.5])  # of 0.5, 1, 1.5; 1, 2, 1.9; inf, 2.5, 1.9
    np.testing.assert_allclose(median.get_xdata()[:2], [1.0, 2.0])
    assert np.isnan(high.get_ydata()[2])
    (curves,) = (each.get_segments() for each in axes.collections if each.get_label() == "3 curves")
    np.testing.assert_allclose(curves[0], [[0.5, 0.25], [1, 0.5], [2, 1], [6, 4]])
    np.testing.assert_allclose(curves[2][:, 1], [0.75, 1.5, 1.8, 2.0, 2.0])  # flat from its collapse on
    with pytest.raises(ValueError, match="no capacity is finite"):
        plots.capacities(found_capacities() * np.inf)
    with pytest.raises(ValueError, match=r"no capacity.*draw the result of capacities\(scene, limits\)"):
        plots.capacities(RUN)


def test_ida_curves_end_at_collapse():
    axes = plots.ida_curves(MERGED).axes[0]
    curves, flat = (collection.get_segments() for collection in axes.collections[:2])
    assert len(curves) == MOTIONS
    assert len(flat) == 6  # of ten motions six collapse at some level
    np.testing.assert_allclose(curves[0], np.column_stack([100 * 0.01 * np.append(0, LEVELS), np.append(0, LEVELS)]))
    np.testing.assert_allclose(curves[9][-1], [100 * CAPACITY, 0.4])  # its first collapse, and no further
    assert len(curves[9]) == 3
    median = line_named(axes, "50 % of the drifts")
    np.testing.assert_allclose(median.get_xdata(), [0, 1.1, 2.2, 4.0])
    np.testing.assert_allclose(median.get_ydata(), [0, 0.2, 0.4, 0.8])
    assert len(line_named(axes, "84 % of the drifts").get_xdata()) == 3
    assert [text.get_text() for text in axes.get_legend().get_texts()][:2] == ["10 curves", "collapse: 6"]
    with pytest.raises(ValueError, match="unknown scale 'lin'"):
        plots.ida_curves(RUN, scale="lin")
    with pytest.raises(ValueError, match="needs at least two levels, but the run has fewer"):
        plots.ida_curves(RUN.isel(sample=RUN["im_level"].values == 0.8))


def test_distributions_end_below_one_where_samples_collapse():
    runs = {"as it is": RUN, "stronger": RUN.isel(sample=RUN["motion_index"].values < 5)}
    axes = plots.drift_distributions(runs, level=0.8, colours={"as it is": "red", "stronger": "#123456"}).axes[0]
    line, cross = axes.lines[:2]
    assert line.get_label() == "as it is: 50 % collapsed"
    np.testing.assert_allclose(line.get_xdata(), [0.8, 0.8, 1.6, 2.4, 3.2, 4.0])
    np.testing.assert_allclose(line.get_ydata(), [0, 0.1, 0.2, 0.3, 0.4, 0.5])
    np.testing.assert_allclose(cross.get_xydata(), [[4.0, 0.5]])
    assert to_hex(line_named(axes, "stronger").get_color()) == "#123456"
    assert line_named(axes, "stronger").get_ydata()[-1] == 1
    assert axes.get_title() == "PGA = 0.8 g"
    with pytest.raises(ValueError, match=r"run 'as it is' has several stripes: give level=, one of 0\.2, 0\.4, 0\.8"):
        plots.drift_distributions(runs)
    with pytest.raises(ValueError, match=r"run 'as it is' has no stripe at 0\.5 g: level= may be 0\.2, 0\.4"):
        plots.drift_distributions(runs, level=0.5)
    # Under random motions samples have no level.
    without = RUN.isel(sample=np.flatnonzero(RUN["im_level"] == 0.8)).drop_vars("im_level")
    (axes,) = plots.drift_distributions({"random": without}).axes
    np.testing.assert_array_equal(line_named(axes, "random: 50 % collapsed").get_xydata(), line.get_xydata())
    assert axes.get_title() == ""


def test_histories_end_at_the_collapse():
    figure = plots.histories(RUN, 1)
    displacement, drift, shear = figure.axes
    assert displacement.get_title() == "Sample 39: record 9, PGA = 1.6 g"
    assert line_named(displacement, "collapse of storey 1 at 1.2 s").get_xdata()[0] == 1.195
    np.testing.assert_allclose(drift.lines[1].get_ydata()[:120], 0.6 * drift.lines[0].get_ydata()[:120], rtol=1e-12)
    np.testing.assert_allclose(shear.lines[0].get_ydata()[:120], 10 * 0.05 * np.sin(3 * RUN["time"].values[:120]))
    assert [text.get_text() for text in displacement.get_legend().get_texts()][:2] == ["floor 1", "floor 2"]
    assert [text.get_text() for text in drift.get_legend().get_texts()][:2] == ["storey 1", "storey 2"]
    assert not any("collapse" in str(line.get_label()) for line in plots.histories(RUN, 0).axes[0].lines)
    with pytest.raises(ValueError, match=r"plots\.histories: history=2 does not exist; give 0 to 1"):
        plots.histories(RUN, 2)
    linear = plots.histories(RUN.drop_vars("storey_force"), 0)
    assert len(linear.axes) == 1
    # A selection that left the sample out has its history still.
    assert plots.histories(RUN.isel(sample=[0]), 1).axes[0].get_title() == "Sample 39"


def test_ground_motions_are_measured():
    history, growth, spectrum = plots.ground_motions(PULSE).axes
    # 9.81 sin(1.4) exp(-14 / 80) over 9.80665.
    assert "PGA 0.828 g at 0.14 s, 1.99 s long" in history.get_title()
    share = growth.lines[0].get_ydata()
    # By trapezoids of fine interpolation.
    fine = np.linspace(0, 1.99, 199_001)
    square = np.interp(fine, 0.01 * np.arange(200), PULSE.acceleration) ** 2
    expected = np.cumsum(square) / square.sum()
    np.testing.assert_allclose(share, expected[::1000], atol=2e-4)  # half a fine step of the largest square
    assert len(spectrum.lines) == 1
    with pytest.raises(ValueError, match="motions is empty"):
        plots.ground_motions([])


def test_selections_of_curves_that_leave_nothing_are_refused():
    for dim in ("damage_state", "stripe", "intensity"):
        for part in (MERGED.isel({dim: []}), MERGED.isel({dim: 0})):
            with pytest.raises(ValueError, match=rf"plots\.fragility_curves: the curves have no {dim} left"):
                plots.fragility_curves(part)
    with pytest.raises(ValueError, match=r"no dimension storey: select a single storey by isel\(storey=\[number\]\)"):
        plots.drift_over_height(RUN.isel(storey=0))


OF_RUNS = {
    "cloud_regression": lambda run: plots.cloud_regression(run, CLOUD),
    "drift_against_intensity": plots.drift_against_intensity,
    "drift_over_height": plots.drift_over_height,
    "ida_curves": plots.ida_curves,
    "residual_drifts": plots.residual_drifts,
    "drift_distributions": lambda run: plots.drift_distributions({"a": run}),
    "histories": plots.histories,
    "hysteresis": plots.hysteresis,
}


@pytest.mark.parametrize("name", OF_RUNS)
def test_selections_that_leave_nothing_are_refused(name):
    with pytest.raises(ValueError, match=rf"plots\.{name}: the run has no samples: check the condition"):
        OF_RUNS[name](RUN.isel(sample=[]))
    needed = ["peak_storey_drift_ratio", "residual_drift_ratio", "displacement"]
    with pytest.raises(ValueError, match=r"the dataset has no \w+: (draw|run)"):
        OF_RUNS[name](RUN.drop_vars(needed))
    if name not in ("histories", "hysteresis"):
        with pytest.raises(ValueError, match=rf"plots\.{name}: all 40 samples failed"):
            OF_RUNS[name](
                RUN.assign(status=RUN["status"] * 0 + 2).assign(status=lambda d: RUN["status"].copy(data=d.status))
            )
    with pytest.raises(ValueError, match=rf"plots\.{name} draws one event: select it by select_event"):
        OF_RUNS[name](RUN.expand_dims(event=["first", "second"]))


@pytest.mark.parametrize("sample", [0, 39])
def test_one_sample_is_drawn(sample):
    for plot in (plots.drift_against_intensity, plots.ida_curves, wd.summary):
        with pytest.raises(ValueError, match=r"no dimension sample: select a single sample by isel"):
            plot(RUN.isel(sample=sample))
    one = RUN.isel(sample=[sample])
    for plot in (plots.drift_against_intensity, plots.drift_over_height, plots.residual_drifts):
        plot(one).draw_without_rendering()
    plots.drift_distributions({"a": one}).draw_without_rendering()


def test_summary_tells_of_collapses_and_refuses_nothing():
    text = wd.summary(RUN)
    assert text.splitlines()[0] == "40 samples: 28 ok, 12 collapsed"
    assert "collapsed in storey 1 (12), at 1.195 to 1.195 s" in text
    with pytest.raises(ValueError, match="summary: the run has no samples"):
        wd.summary(RUN.isel(sample=[]))
    with pytest.raises(ValueError, match="the dataset has no status"):
        wd.summary(xr.Dataset())


SELECTED = {
    "disaggregation": (lambda: wd.disaggregate(FITTED, SITE), {"damage_state": 1}),
    "capacities": (found_capacities, {"damage_state": 0}),
    "vulnerability": (lambda: wd.vulnerability(FITTED, RATIOS), {"intensity": 3}),
    "loss_exceedance": (lambda: wd.annual_losses(FITTED, SITE, RATIOS), {"return_period": 0}),
}


@pytest.mark.parametrize("name", SELECTED)
def test_one_place_is_selected_as_a_row(name):
    make, place = SELECTED[name]
    (dim,) = place
    with pytest.raises(ValueError, match=rf"plots.{name}: the .* have no {dim} left: select some by isel\({dim}="):
        getattr(plots, name)(make().isel(place))
    getattr(plots, name)(
        make().isel({dim: [place[dim], place[dim] + 1]} if dim == "intensity" else {dim: [place[dim]]})
    )


@pytest.mark.parametrize("name", ["ida_curves", "drift_against_intensity", "residual_drifts"])
@pytest.mark.parametrize("is_kept", [False, True])
def test_capacities_are_sent_to_their_own_figure(name, is_kept):
    found = found_capacities()
    found = found if is_kept else found.drop_dims("sample")
    with pytest.raises(ValueError, match=rf"plots\.{name} draws a run, .* plots\.capacities\(found\)"):
        getattr(wd.plots, name)(found)
