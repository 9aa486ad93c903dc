"""Fragility curves of a stated precision: what is predicted, what is spent, and what bounds it."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from scipy.stats import f_oneway, t

import warpdyn as wd
from warpdyn.answers.fragility.sample_size.variance_components import Variances, records_for, variances_of

LIMITS = {"slight": 0.005, "extensive": 0.02}
STIFFNESS = 2e5 * (2 * np.pi / 0.5) ** 2


def scene(motions: int) -> wd.Scene:
    """Return one storey that yields, with scatter, under short motions of filtered noise."""
    generator, time = np.random.default_rng(1), 0.02 * np.arange(400)
    envelope = np.exp(-(((time - 2) / 1.5) ** 2))
    found = []
    for number in range(motions):
        values = np.convolve(generator.normal(size=400), np.ones(5 + number % 4), "same") * envelope
        found.append(wd.GroundMotion(values - values.mean(), 0.02, f"noise {number}"))
    law = {"law": "bilinear", "yield_force": 0.012 * STIFFNESS, "hardening_ratio": 0.02}
    building = wd.ShearBuilding([2e5], [STIFFNESS], 3.0, **law, damping="rayleigh", damping_ratio=0.05)
    scatter = {
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.25)),
    }
    return wd.Scene(building, wd.Cloud(found, wd.SpectralAcceleration(0.5)), scatter, recorders=("drift",))


def capacities_of(logarithm: np.ndarray) -> xr.Dataset:
    """Return capacities, shape [structure, motion], as those of two damage states, the second twice as large."""
    values = np.stack([np.exp(logarithm), 2 * np.exp(logarithm)], axis=-1)
    return xr.Dataset({"capacity": (("structure", "motion", "damage_state"), values)})


@pytest.mark.fast
def test_predicted_widths_and_records():
    found = Variances(np.array([0.09, 0.0]), np.array([0.04, 0.04]), 30, 0.95)
    expected = t.ppf(0.975, 29) * np.sqrt((np.array([0.09, 0.0]) + 0.04 / 4) / 30)
    np.testing.assert_allclose(found.half_width(4), expected, rtol=1e-12)
    # The fewest records n with t sqrt(.09 / n) <= .1, counted up by hand.
    by_hand = next(n for n in range(3, 200) if t.ppf(0.975, n - 1) * 0.3 / math.sqrt(n) <= 0.1)
    assert records_for(0.1, np.array([0.09, 0.0, np.nan]), 0.95).tolist() == [by_hand, 3, 0]
    assert t.ppf(0.975, by_hand - 2) * 0.3 / math.sqrt(by_hand - 1) > 0.1
    # Many: Student's t of 1,999 records and more is 1.961.
    assert records_for(0.003, np.array([0.09]), 0.95)[0] == pytest.approx((1.961 * 0.3 / 0.003) ** 2, rel=1e-3)


@pytest.mark.fast
def test_variances_are_those_of_an_analysis_of_variance():
    generator = np.random.default_rng(7)
    logarithm = 0.4 * generator.standard_normal(40) + 0.2 * generator.standard_normal((3, 40))
    # F is the ratio of the mean squares, so that the variances follow from it and from the mean square within.
    ratio, within = f_oneway(*logarithm.T).statistic, logarithm.var(axis=0, ddof=1).mean()
    found = variances_of(capacities_of(logarithm), 0.95)
    np.testing.assert_allclose(found.within, within, rtol=1e-10)
    np.testing.assert_allclose(found.among, (ratio - 1) * within / 3, rtol=1e-10)
    # A motion of which one structure did not pass the limit is left out.
    logarithm[1, 5] = np.inf
    without = variances_of(capacities_of(np.delete(logarithm, 5, axis=1)), 0.95)
    np.testing.assert_allclose(variances_of(capacities_of(logarithm), 0.95).among, without.among, rtol=1e-12)


@pytest.mark.fast
def test_structures_by_the_precision_and_by_what_the_records_leave():
    found = Variances(np.array([0.01, 0.01]), np.array([0.04, 0.09]), 40, 0.95)
    asked = 1.3 * found.half_width(math.inf)[0]
    count, is_bound = found.structures_for(asked)
    assert not is_bound.any()
    assert (found.half_width(count) <= asked).all()
    assert (found.half_width(count - 1) > 0.95 * asked).any()
    # Half of what the records leave: structures go on until they add next to nothing.
    count, is_bound = found.structures_for(0.5 * asked)
    assert is_bound.all()
    assert found.half_width(count)[1] == pytest.approx(found.half_width(math.inf)[1], rel=0.03)
    assert Variances(np.array([0.01]), np.array([0.0]), 40, 0.95).structures_for(0.5)[0] == 1


def test_one_structure_of_each_motion_is_the_answer_where_it_reaches_the_precision():
    given = scene(24)
    curves = wd.fragility_to(given, LIMITS, 0.3, method="rk4", device="cpu", seed=3)
    assert (curves["half_width"] <= 0.3).all()
    attributes = [curves.attrs[name] for name in ("structures_per_motion", "pilot_histories", "bounded_by")]
    assert attributes == [1, 0, "structures"]
    # From the first rung to the last limit's passage, a factor of some 20, in steps of 50 %, and the elastic run.
    assert curves.attrs["histories"] < 24 * (1 + 2 + math.log(20) / math.log(1.5))
    # The same structures by hand, in brackets of 2 %.
    stripes = wd.Stripes(given.excitation.motions, [1.0], given.excitation.measure, structures_per_motion=1)
    by_hand = wd.capacities(
        replace(given, excitation=stripes),
        LIMITS,
        highest=math.inf,
        seed=3,
        method="rk4",
        dtype=curves.attrs["dtype"],
        device="cpu",
    )
    again = wd.fragility_from_capacities(by_hand)
    # A bracket of a ratio of 1.5 leaves ln(1.5) / sqrt(12) of a capacity open, and 24 of these a mean and a variance.
    open_by = math.log(1.5) / math.sqrt(12)
    np.testing.assert_allclose(
        np.log(curves["fragility_median"]), np.log(again["fragility_median"]), atol=3 * open_by / math.sqrt(24)
    )
    dispersion = again["fragility_dispersion"].values
    of_variance = np.sqrt((2 * open_by**4 + 4 * open_by**2 * dispersion**2) / 24) / dispersion**2
    ratio = curves["fragility_dispersion"].values / dispersion
    assert (np.abs(np.log(ratio)) <= 3 * of_variance / 2).all()


def test_structures_are_added_until_the_precision_is_reached():
    given = scene(24)
    once = wd.fragility_to(given, LIMITS, 0.45, method="rk4", device="cpu", seed=3)
    asked = 0.92 * float(once["half_width"].max())
    curves = wd.fragility_to(given, LIMITS, asked, method="rk4", device="cpu", seed=3)
    assert (curves["half_width"] <= asked).all()
    assert curves.attrs["structures_per_motion"] > 1
    assert curves.attrs["pilot_histories"] == 0, "every history is part of the answer"
    with pytest.warns(
        UserWarning, match=r"limited by the 24 records.*'slight' .* % \([0-9,]+ records would be enough\)"
    ):
        bound = wd.fragility_to(given, LIMITS, 0.05, method="rk4", device="cpu", seed=3)
    assert bound.attrs["bounded_by"] == "records"
    assert (bound["records_needed"] > 24).all()


@pytest.mark.meant_as_given("peak_ground_acceleration")
def test_brackets_that_are_too_wide_for_a_dispersion_are_narrowed():
    # Elastic, with hardly any scatter, under one motion at several scales: capacities are the same to some per cent.
    given = scene(1)
    motion = given.excitation.motions[0]
    scaled = [wd.GroundMotion(scale * motion.acceleration, motion.step, f"times {scale:g}") for scale in range(1, 7)]
    given = replace(
        given,
        excitation=wd.Cloud(scaled, wd.SpectralAcceleration(0.5)),
        scatter={"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.05))},
    )
    curves = wd.fragility_to(given, {"slight": 0.003}, 0.3, method="rk4", device="cpu")
    assert curves.attrs["bracket_width"] < 0.5
    assert curves.attrs["pilot_histories"] > 0
    assert float(curves["fragility_dispersion"][0]) < 0.1


def test_what_is_implausible_is_warned_of_once():
    given = scene(4)
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        curves = wd.fragility_to(given, {"slight": 0.5}, 0.01, method="rk4", device="cpu")
    assert curves.attrs["structures_per_motion"] > 1
    assert sum("implausible" in str(one.message) for one in found) == 1


@pytest.mark.fast
@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"precision": 0.0}, ValueError, "precision must be"),
        ({"precision": 5.0}, ValueError, "from 0.001 to below 1, got 5"),
        ({"confidence": 95}, ValueError, "confidence must be a number between 0 and 1"),
        ({"scene": 3}, TypeError, "a Scene"),
        ({"limits": {}}, ValueError, "limits must map"),
        ({"limits": {"slight": {"peak_storey_drift_ratio": 0.01}}}, ValueError, "limits of one demand"),
    ],
)
def test_bad_arguments(change, error, message):
    given = {"scene": scene(3), "limits": LIMITS} | change
    with pytest.raises(error, match=message):
        wd.fragility_to(given.pop("scene"), given.pop("limits"), device="cpu", **given)


@pytest.mark.fast
def test_given_structures():
    given = replace(scene(3), scatter={"stiffness": wd.GivenValues([STIFFNESS, STIFFNESS])})
    with pytest.raises(ValueError, match=r"scatter\['stiffness'\] lists the values of given structures"):
        wd.fragility_to(given, LIMITS, device="cpu")


@pytest.mark.fast
def test_too_few_motions():
    with pytest.raises(ValueError, match="at least 3 motions, got 2"):
        wd.fragility_to(scene(2), LIMITS, device="cpu")


@pytest.mark.fast
def test_an_intensity_that_does_not_grow_is_refused():
    given = scene(3)
    durations = wd.Scene(given.structure, wd.Cloud(given.excitation.motions, wd.SignificantDuration()), given.scatter)
    with pytest.raises(ValueError, match="D5-95 does not grow with a motion's scale"):
        wd.fragility_to(durations, LIMITS, device="cpu")
