"""Storey loss functions, on a run that is made by hand: its drifts and collapses are known."""

import numpy as np
import pytest
from plotted_runs import CAPACITY, COLLAPSES, LEVELS, MOTIONS, STOREYS, striped_run

import warpdyn as wd

pytestmark = pytest.mark.fast

DRIFT = [0.0, 0.01, 0.05], [0.0, 0.02, 0.3]
ACCELERATION = [0.0, 4.0, 8.0], [0.0, 0.0, 0.1]


def run_with_accelerations():
    run = striped_run()
    acceleration = np.tile([2.0, 6.0, 10.0], (run.sizes["sample"], 1))
    return run.assign(peak_floor_acceleration=(("sample", "floor"), acceleration))


def drift_loss(drift):
    """Return the loss of a storey by the two lines of the function."""
    rising = 2.0 * drift if drift <= 0.01 else 0.02 + (drift - 0.01) * 7.0
    return min(rising, 0.3)


def test_losses_of_storeys_and_floors_add_up():
    run = run_with_accelerations()
    found = wd.storey_losses(run, DRIFT, ACCELERATION)
    sample = 4 * 3  # motion 3 at 0.2 g: 0.8 % in the first storey
    ratios = 0.01 * 4 * 0.2 * np.array([1.0, 0.6, 0.3])
    assert run["peak_storey_drift_ratio"].values[sample] == pytest.approx(ratios)
    # Of the floors the first is below 4 m/s2, the second halfway to 8, the third above.
    expected = sum(drift_loss(ratio) for ratio in ratios) + 0.05 + 0.1
    assert float(found["loss_ratio"][sample]) == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(found["acceleration_loss_ratio"][sample], [0.0, 0.05, 0.1], rtol=1e-12)
    only = wd.storey_losses(striped_run(), drift_loss=DRIFT)["loss_ratio"]
    assert float(only[sample]) == pytest.approx(expected - 0.15, rel=1e-12)


def test_collapsed_samples_lose_all_and_none_loses_more():
    run = striped_run()
    found = wd.storey_losses(run, DRIFT, collapse_loss=0.9)
    collapsed = run["status"].values == 1
    assert (found["loss_ratio"].values[collapsed] == 0.9).all()
    steep = wd.storey_losses(run, ([0.0, 1e-4], [0.0, 1.0]), collapse_loss=0.9)["loss_ratio"]
    assert (steep == 0.9).all()
    np.testing.assert_allclose(found["collapsed_share"], np.array(COLLAPSES) / MOTIONS)


def test_statistics_of_stripes_and_their_figure():
    run = striped_run()
    found = wd.storey_losses(run, DRIFT)
    drifts = 0.01 * (np.arange(MOTIONS) + 1) * LEVELS[1]
    standing = [min(drift, 0.9 * CAPACITY) for drift in drifts[: MOTIONS - COLLAPSES[1]]]
    losses = [sum(drift_loss(share * drift) for share in (1.0, 0.6, 0.3)) for drift in standing] + [1.0] * COLLAPSES[1]
    assert float(found["mean_loss_ratio"][1]) == pytest.approx(np.mean(losses), rel=1e-12)
    variation = np.std(losses, ddof=1) / np.mean(losses)
    assert float(found["coefficient_of_variation"][1]) == pytest.approx(variation, rel=1e-12)
    assert wd.plots.vulnerability(found).axes[0].get_xlabel() == "PGA [g]"
    other = run["im_level"].assign_attrs(units="m s-1", intensity_measure="PGV")
    found = wd.storey_losses(run.assign_coords(im_level=other), DRIFT)
    assert found["intensity"].attrs == {"long_name": "intensity of the stripe", "units": "m s-1"}


def test_storeys_may_differ():
    run = striped_run()
    each = np.array([DRIFT[1], [0.0, 0.0, 0.0], [0.0, 0.1, 0.2]])
    found = wd.storey_losses(run, (DRIFT[0], each))["drift_loss_ratio"]
    assert found.sizes["storey"] == STOREYS
    assert (found.isel(storey=1).dropna("sample") == 0).all()
    assert float(found[0, 2]) == pytest.approx(10 * float(run["peak_storey_drift_ratio"][0, 2]), rel=1e-12)


def test_failed_samples_are_left_out():
    run = striped_run()
    many = run.isel(sample=np.tile(np.arange(run.sizes["sample"]), 3)).assign_coords(sample=np.arange(120))
    many = many.assign_coords(structure=("sample", np.arange(120)))
    status = many["status"].values.copy()
    status[7] = 2
    found = wd.storey_losses(many.assign(status=("sample", status, many["status"].attrs)), DRIFT)
    assert np.isnan(found["loss_ratio"][7])
    assert np.isfinite(found["mean_loss_ratio"]).all()
    status[:3] = 2
    with pytest.raises(ValueError, match="4 of 120 samples failed"):
        wd.storey_losses(many.assign(status=("sample", status, many["status"].attrs)), DRIFT)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((None,), "needs drift_loss"),
        ((None, ACCELERATION), "no peak_floor_acceleration: add 'acceleration' to Scene"),
        ((([0.0, 0.0], [0.0, 0.1]),), "increasing"),
        ((([0.0, 0.1], [0.1, 0.2]),), "first loss must be 0, got 0.1 at a demand of 0:"),
        ((([0.0, 0.1, 0.2], [0.0, 0.2, 0.1]),), "not fall, but go from 0.2 at a demand of 0.1 to 0.1 at 0.2"),
        ((([0.0, 0.1], [0.0, 20.0]),), r"at most 1 \(2 % is 0.02\), got 20"),
        ((([0.0, 0.1], [[0.0, 0.2]] * 4),), r"\[3, 2\], one row per storey"),
        (([0.0, 0.1, 0.2],), "must be a pair"),
    ],
)
def test_impossible_functions_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        wd.storey_losses(striped_run(), *arguments)


def test_runs_of_several_events_or_no_samples_are_refused():
    run = striped_run()
    with pytest.raises(ValueError, match="storey_losses: the run has several events: select one, select_event"):
        wd.storey_losses(run.expand_dims(event=["mainshock", "aftershock"], axis=-1), DRIFT)
    with pytest.raises(ValueError, match="the run has no samples"):
        wd.storey_losses(run.isel(sample=[]), DRIFT)


def test_what_is_given_in_percent_is_told():
    with pytest.warns(UserWarning, match="first loss of drift_loss is 0.4 .* given in percent, it would be 0.004"):
        wd.storey_losses(striped_run(), ([0.0, 0.4, 3.0], [0.0, 0.02, 0.3]))
    with pytest.raises(ValueError, match="collapse_loss is 100; it is a share"):
        wd.storey_losses(striped_run(), DRIFT, collapse_loss=100)


def test_accelerations_are_taken_in_the_units_of_the_run():
    run = run_with_accelerations()
    expected = wd.storey_losses(run, None, ACCELERATION)["loss_ratio"]
    in_g = run["peak_floor_acceleration"] / 9.80665
    found = wd.storey_losses(run.assign(peak_floor_acceleration=in_g.assign_attrs(units="g")), None, ACCELERATION)
    np.testing.assert_allclose(found["loss_ratio"], expected, rtol=1e-12)  # of two roundings
    feet = run["peak_floor_acceleration"].assign_attrs(units="ft s-2")
    with pytest.raises(ValueError, match="peak_floor_acceleration is in 'ft s-2'; allowed are 'm s-2'"):
        wd.storey_losses(run.assign(peak_floor_acceleration=feet), None, ACCELERATION)
    drift = run["peak_storey_drift_ratio"].assign_attrs(units="mm")
    with pytest.raises(ValueError, match="peak_storey_drift_ratio is in 'mm'; allowed are '1'"):
        wd.storey_losses(run.assign(peak_storey_drift_ratio=drift), DRIFT)


def test_functions_of_accelerations_in_g_are_told():
    with pytest.warns(
        UserWarning, match=r"acceleration loss function is 2 m s-2 .* given in g, it would be 19.6 m s-2"
    ):
        wd.storey_losses(run_with_accelerations(), None, ([0.0, 0.5, 2.0], [0.0, 0.0, 0.1]))


def test_a_portfolio_is_refused_by_all_that_take_one_archetype():
    run = striped_run()
    of_sample = ("sample", np.arange(run.sizes["sample"]) % 2)
    several = run.assign_coords(archetype_index=of_sample, archetype=["low", "high"])
    limits = {"slight": 0.01}
    for name, call in {
        "storey_losses": lambda: wd.storey_losses(several, DRIFT),
        "plots.ida_curves": lambda: wd.plots.ida_curves(several),
        "fragility_of_cloud": lambda: wd.fragility_of_cloud(several, limits),
        "fragility": lambda: wd.fragility(several, limits),
    }.items():
        with pytest.raises(
            ValueError, match=rf"several archetypes, but {name}\(\) needs .*select_archetype\(run, name\)"
        ):
            call()
