"""Fragility curves of a stated precision: what is predicted, what is spent, and what bounds it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t

import warpdyn as wd
from warpdyn.statistics.target_precision import Variances, _structures

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


@pytest.mark.fast
def test_predicted_widths_and_records():
    found = Variances(np.array([0.09, 0.0]), np.array([0.04, 0.04]), 30, 0.95)
    expected = t.ppf(0.975, 29) * np.sqrt((np.array([0.09, 0.0]) + 0.04 / 4) / 30)
    np.testing.assert_allclose(found.half_width(4), expected, rtol=1e-12)
    # The fewest records n with t sqrt(.09 / n) <= .1, counted up by hand.
    by_hand = next(n for n in range(3, 200) if t.ppf(0.975, n - 1) * 0.3 / math.sqrt(n) <= 0.1)
    assert found.records_for(0.1).tolist() == [by_hand, 3]
    assert t.ppf(0.975, by_hand - 2) * 0.3 / math.sqrt(by_hand - 1) > 0.1
    # Many: Student's t of 1,999 records and more is 1.961.
    assert found.records_for(0.003)[0] == pytest.approx((1.961 * 0.3 / 0.003) ** 2, rel=1e-3)


@pytest.mark.fast
def test_structures_by_the_precision_and_by_what_the_records_leave():
    found = Variances(np.array([0.01, 0.01]), np.array([0.04, 0.09]), 40, 0.95)
    asked = 1.3 * found.half_width(math.inf)[0]
    count, is_bound = _structures(found, asked)
    assert not is_bound.any()
    assert (found.half_width(count) <= asked).all()
    assert (found.half_width(count - 1) > 0.95 * asked).any()
    # Half of what the records leave: structures go on until they add next to nothing.
    count, is_bound = _structures(found, 0.5 * asked)
    assert is_bound.all()
    assert found.half_width(count)[1] == pytest.approx(found.half_width(math.inf)[1], rel=0.03)
    assert _structures(Variances(np.array([0.01]), np.array([0.0]), 40, 0.95), 0.5)[0] == 1


def test_a_precision_is_met_and_records_that_bound_it_are_told():
    given = scene(24)
    curves = wd.fragility_to(given, LIMITS, 0.3, method="rk4", device="cpu", seed=3)
    assert curves.attrs["bounded_by"] == "structures"
    assert (curves["half_width"] <= 0.3).all()
    per_motion = curves.attrs["structures_per_motion"]
    assert curves.attrs["histories"] < 60 * 24 * per_motion
    # Structures of the answer are none of the pilot's: the same run by hand has the same capacities.
    stripes = wd.Stripes(given.excitation.motions, [1.0], given.excitation.measure, structures_per_motion=per_motion)
    by_hand = wd.capacities(
        wd.Scene(given.structure, stripes, given.scatter),
        LIMITS,
        tolerance=0.1,
        highest=math.inf,
        seed=3,
        method="rk4",
        dtype=curves.attrs["dtype"],
        device="cpu",
    )
    again = wd.fragility_from_capacities(by_hand)
    # The ladders end at other levels, so that brackets of 10 % lie elsewhere: an error of 3 % each, of 24 and more.
    np.testing.assert_allclose(curves["fragility_median"], again["fragility_median"], rtol=0.02)
    with pytest.warns(UserWarning, match=r"24 records bound the precision.*'slight' .* % \([0-9,]+ records would do\)"):
        bound = wd.fragility_to(given, LIMITS, 0.02, method="rk4", device="cpu", seed=3)
    assert bound.attrs["bounded_by"] == "records"
    assert (bound["records_needed"] > 24).all()


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
    with pytest.raises(ValueError, match=r"scatter\['stiffness'\] lists given ones"):
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
