"""The intensity measure of a run and its curves: attributes with name, period and damping; no label is read."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from test_fragility import synthetic_run
from test_simulate import MOTIONS, make_building

import warpdyn as wd
from warpdyn.foundations.core.output_variables import measure_name, measure_of_dataset

pytestmark = [pytest.mark.fast, pytest.mark.meant_as_given("drift_limit")]
SA = wd.SpectralAcceleration(0.4, 0.03)
MEASURES = [
    (wd.PeakGroundAcceleration(), {"intensity_measure": "PGA"}),
    (
        SA,
        {
            "intensity_measure": "Sa(0.4 s, 3 %)",
            "intensity_measure_period": 0.4,
            "intensity_measure_damping_ratio": 0.03,
        },
    ),
    (
        wd.GeometricMean(SA),
        {
            "intensity_measure": "geometric mean of Sa(0.4 s, 3 %)",
            "intensity_measure_period": 0.4,
            "intensity_measure_damping_ratio": 0.03,
        },
    ),
    (
        wd.LargerComponent(wd.PeakGroundVelocity()),
        {"intensity_measure": "larger component of PGV"},
    ),
    (
        wd.RotatedSpectralAcceleration(0.4),
        {
            "intensity_measure": "RotD50 Sa(0.4 s, 5 %)",
            "intensity_measure_period": 0.4,
            "intensity_measure_damping_ratio": 0.05,
        },
    ),
]


@pytest.mark.parametrize(("measure", "expected"), MEASURES)
def test_a_measure_names_itself_with_period_and_damping(measure, expected):
    assert measure.attributes() == expected


def test_an_average_names_all_its_periods():
    found = wd.AverageSpectralAcceleration([0.2, 0.4, 0.8]).attributes()
    assert found["intensity_measure_periods"].tolist() == [0.2, 0.4, 0.8]
    assert found["intensity_measure_damping_ratio"] == 0.05


def labelled_run(measure=SA):
    """Return a run with the attributes of a measure, and a label that says another one."""
    run = synthetic_run(3)
    run["im_level"].attrs |= measure.attributes() | {"long_name": "PGA of the scaled motion"}
    return run


@pytest.mark.parametrize("function", [wd.fragility, wd.fragility_of_cloud])
def test_a_hazard_curve_of_another_measure_is_refused_whatever_the_label_says(function):
    curves = function(labelled_run(), {"light": 0.02})
    assert curves.attrs["intensity_measure"] == "Sa(0.4 s, 3 %)"
    assert curves.attrs["intensity_measure_period"] == 0.4
    assert curves.attrs["intensity_measure_damping_ratio"] == 0.03
    levels, rates = [0.05, 0.5, 1.0, 3.0], [1e-1, 1e-2, 1e-3, 1e-5]
    with pytest.raises(
        ValueError, match=r"the measure of the hazard is 'PGA' and that of the curves is 'Sa\(0.4 s, 3 %\)'"
    ):
        wd.annual_rates(curves, wd.HazardCurve(levels, rates, measure="PGA"))
    assert float(wd.annual_rates(curves, wd.HazardCurve(levels, rates, measure="Sa(0.4 s, 3 %)"))["annual_rate"][0]) > 0


def test_an_axis_is_labelled_by_the_measure():
    assert wd.plots.fragility_curves(wd.fragility(labelled_run(), {"light": 0.02})).axes[0].get_xlabel() == (
        "Sa(0.4 s, 3 %) [g]"
    )


def test_a_dataset_that_names_its_measure_on_the_root_alone_keeps_it():
    run = synthetic_run(3)
    assert measure_name(run) == "intensity measure"
    assert measure_of_dataset(run) == {}
    run.attrs |= SA.attributes()
    assert wd.fragility(run, {"light": 0.02}).attrs["intensity_measure_period"] == 0.4


def test_runs_and_events_name_their_measures(tmp_path):
    events = {"first": wd.Stripes(MOTIONS, [0.1, 0.2], SA), "second": wd.Cloud(MOTIONS[:1])}
    structure = make_building()
    run = wd.simulate(wd.Scene(structure, events["first"], recorders=("drift",)), device="cpu")
    path = tmp_path / "run.nc"
    wd.write(run, path)

    with xr.open_dataset(path) as again:
        for attributes in (run.attrs, run["im_level"].attrs, again["im_level"].attrs):
            assert {key: attributes[key] for key in SA.attributes()} == SA.attributes()
    both = wd.simulate(wd.Scene(structure, wd.EventSequence(events), recorders=("drift",)), device="cpu")
    assert "intensity_measure" not in both.attrs
    first, second = (wd.select_event(both, name) for name in events)
    assert measure_of_dataset(first) == SA.attributes()
    assert measure_of_dataset(second) == {"intensity_measure": "PGA"}
    assert np.isnan(both["im_level_intensity_measure_period"].sel(event="second"))


def test_capacities_and_counts_name_their_measure():
    scene = wd.Scene(make_building(), wd.Stripes(MOTIONS, [0.1, 0.2], SA), recorders=("drift",))
    counts = wd.DamageCounts({"slight": 0.01}, over=("motion", "stripe", "structure_group"))
    assert measure_of_dataset(wd.simulate(scene, statistics=counts, device="cpu")) == SA.attributes()
    found = wd.capacities(scene, {"slight": 0.01}, tolerance=0.5, device="cpu")
    assert measure_of_dataset(found) == SA.attributes()
    with pytest.warns(UserWarning, match="'slight'"):  # no capacity of three weak records is reached
        assert wd.fragility_from_capacities(found).attrs["intensity_measure"] == "Sa(0.4 s, 3 %)"
