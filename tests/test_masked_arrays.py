"""Masked values are refused by every public function that takes an array; arrays that mask nothing are arrays."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.filterwarnings("ignore")]

PAIR = [wd.GroundMotion(np.sin(np.arange(200) * 0.1 + i), 0.02, f"m{i}", record="r", component="NE"[i]) for i in (0, 1)]
MASSES, STIFFNESSES, EYE = [2e5, 2e5], [1e8, 1e8], [[100.0, 0.0], [0.0, 100.0]]
BUILDING = wd.ShearBuilding(MASSES, STIFFNESSES, 3.0)
NONE = [[0.0, 0.0], [0.0, 0.0]]
HAZARD = wd.HazardCurve([0.1, 0.2], [0.1, 0.01])
CHAIN = SimpleNamespace(mass=[1.0], stiffness=[1.0], yield_force=[1.0], hardening_ratio=[0.1], damping=[[0.0]])


def chain(function: Callable, **changes: object) -> object:
    return function(**(vars(CHAIN) | {"force": [[0.0], [0.1], [0.2]], "step": 0.1} | changes))


# What a call gives, and the values of one argument, the second of which is masked.
CALLS: dict[str, tuple[Callable, list]] = {
    "GroundMotion": (lambda a: wd.GroundMotion(a, 0.01), [0.0, 1.3, 0.0]),
    "records.from_array": (lambda a: wd.records.from_array(a, 0.01, "g"), [0.0, 1.3, 0.0]),
    "ForceHistory": (lambda a: wd.ForceHistory(a, 0.1), [[0.0, 1.0], [1.0, 2.0]]),
    "HarmonicForce": (lambda a: wd.HarmonicForce(a, 1.0, duration=3.0), [1.0, 2.0]),
    "FreeVibration.displacement": (lambda a: wd.FreeVibration(1.0, displacement=a), [0.1, 0.2]),
    "FreeVibration.velocity": (lambda a: wd.FreeVibration(1.0, velocity=a), [0.1, 0.2]),
    "Stripes": (lambda a: wd.Stripes(PAIR, a, wd.PeakGroundAcceleration()), [0.1, 0.2]),
    "OneMotionPerStructure.scale": (lambda a: wd.OneMotionPerStructure(PAIR, scale=a), [1.0, 2.0]),
    "OneMotionPerStructure.motion": (lambda a: wd.OneMotionPerStructure(PAIR, motion=a), [0, 1]),
    "MotionsAtSites.motion": (lambda a: wd.MotionsAtSites(PAIR, a, 1.0, [[0]]), [[[0], [1]]]),
    "MotionsAtSites.scale": (lambda a: wd.MotionsAtSites(PAIR, [[[0], [1]]], a, [[0]]), [[[1.0], [2.0]]]),
    "MotionsAtSites.site": (lambda a: wd.MotionsAtSites(PAIR, [[[0]], [[1]]], 1.0, a), [[0, 1]]),
    "MotionsAtSites.earthquake": (lambda a: wd.MotionsAtSites(PAIR, [[[0], [1]]], 1.0, [[0, 0]], a), [0, 1]),
    "response_spectra.periods": (lambda a: wd.response_spectra(PAIR, a, [0.05]), [0.5, 1.0]),
    "response_spectra.damping_ratios": (lambda a: wd.response_spectra(PAIR, [0.5], a), [0.05, 0.1]),
    "AverageSpectralAcceleration": (wd.AverageSpectralAcceleration, [0.5, 1.0]),
    "ShearBuilding.mass": (lambda a: wd.ShearBuilding(a, STIFFNESSES, 3.0), MASSES),
    "ShearBuilding.stiffness": (lambda a: wd.ShearBuilding(MASSES, a, 3.0), STIFFNESSES),
    "ShearBuilding.height": (lambda a: wd.ShearBuilding(MASSES, STIFFNESSES, a), [3.0, 3.0]),
    "ShearBuilding.yield_force": (
        lambda a: wd.ShearBuilding(MASSES, STIFFNESSES, 3.0, law="bilinear", yield_force=a, hardening_ratio=0.1),
        [1e5, 1e5],
    ),
    "laws.Bilinear": (
        lambda a: wd.ShearBuilding(MASSES, STIFFNESSES, 3.0, law=wd.laws.Bilinear(yield_force=a, hardening_ratio=0.1)),
        [1e5, 1e5],
    ),
    "ShearBuilding.from_periods.period": (lambda a: wd.ShearBuilding.from_periods(a, 2, 2e5, 3.0), [0.6, 0.2]),
    "ShearBuilding.from_periods.mass": (lambda a: wd.ShearBuilding.from_periods(0.5, 2, a, 3.0), MASSES),
    "ShearBuilding.from_capacity.displacement": (
        lambda a: wd.ShearBuilding.from_capacity(a, [1e5, 2e5], 2, 1e5, 3.0), [0.01, 0.1]),
    "ShearBuilding.from_capacity.capacity": (
        lambda a: wd.ShearBuilding.from_capacity([0.01, 0.1], a, 2, 1e5, 3.0), [1e5, 2e5]),
    "LinearSystem.mass": (lambda a: wd.LinearSystem(a, NONE, EYE), [1.0, 1.0]),
    "LinearSystem.damping": (lambda a: wd.LinearSystem([1.0, 1.0], a, EYE), NONE),
    "LinearSystem.stiffness": (lambda a: wd.LinearSystem([1.0, 1.0], NONE, a), EYE),
    "LinearSystem.influence": (lambda a: wd.LinearSystem([1.0, 1.0], NONE, EYE, influence=a), [1.0, 1.0]),
    "GivenValues": (wd.GivenValues, [1.0, 2.0]),
    "Histories": (wd.Histories, [0, 1]),
    "storey_hysteresis": (lambda a: wd.storey_hysteresis(BUILDING, a), [0.0, 0.01, 0.02]),
    "pushover": (lambda a: wd.pushover(BUILDING, a), [0.01, 0.02]),
    "DemandHistogram.edges": (lambda a: wd.DemandHistogram("peak_storey_drift_ratio", edges=a), [0.01, 0.02]),
    "DamageCounts.number": (lambda a: wd.DamageCounts({"slight": 0.01}, number=a), [1.0, 2.0]),
    "DamageLoss": (lambda a: wd.DamageLoss({"slight": 0.01}, {"slight": 0.1}, a), [1.0, 2.0]),
    "HazardCurve.intensity": (lambda a: wd.HazardCurve(a, [0.1, 0.01]), [0.1, 0.2]),
    "HazardCurve.annual_rate": (lambda a: wd.HazardCurve([0.1, 0.2], a), [0.1, 0.01]),
    "HazardCurve.from_probabilities": (
        lambda a: wd.HazardCurve.from_probabilities([0.1, 0.2], a, 50.0), [0.2, 0.1]),
    "HazardCurve.rate_of": (HAZARD.rate_of, [0.1, 0.15]),
    "HazardCurve.intensity_of": (HAZARD.intensity_of, [0.1, 0.05]),
    "spectral_shape_factor.period": (lambda a: wd.spectral_shape_factor(a, 3.0), [0.5, 0.6]),
    "spectral_shape_factor.ductility": (lambda a: wd.spectral_shape_factor(0.5, a), [3.0, 4.0]),
    "collapse_margin": (
        lambda a: wd.collapse_margin(a, 1.0, period=0.5, ductility=3.0), [2.0, 3.0]),
    "KanaiTajimi.spectral_density": (wd.KanaiTajimi(1.0, 10.0, 0.6).spectral_density, [1.0, 2.0]),
    "JenningsEnvelope.at": (wd.JenningsEnvelope(2.0, 5.0, 0.3).at, [1.0, 2.0]),
    "sites.SpatialCorrelation.correlation": (wd.sites.JayaramBaker2009(1.0).correlation, [1.0, 2.0]),
    "sites.within_event_residuals": (
        lambda a: wd.sites.within_event_residuals(a, [40.0, 40.1], wd.sites.JayaramBaker2009(1.0), 2), [10.0, 10.1]),
    "truth.harmonic_response": (
        lambda a: wd.truth.harmonic_response([1.0, 1.0], NONE, EYE, a, 1.0, 0.0, [0.0, 0.1, 0.2]), [1.0, 2.0]),
    "truth.piecewise_linear_response": (
        lambda a: wd.truth.piecewise_linear_response([1.0, 1.0], NONE, EYE, a, 0.1), NONE),
    "truth.bilinear_chain_response": (lambda a: chain(wd.truth.bilinear_chain_response, force=a), [[0.0], [0.1]]),
    "truth.bouc_wen_chain_response": (lambda a: chain(wd.truth.bouc_wen_chain_response, force=a), [[0.0], [0.1]]),
}  # fmt: skip


def with_second_masked(values: list) -> np.ma.MaskedArray:
    array = np.ma.masked_array(np.array(values), mask=np.zeros(np.shape(values), dtype=bool))
    array.mask.flat[1] = True
    return array


@pytest.mark.parametrize("name", CALLS)
def test_masked_values_are_refused(name):
    call, values = CALLS[name]
    with pytest.raises(ValueError, match=r"is masked, so its value is unknown \(1 of \d+ values are masked\)"):
        call(with_second_masked(values))


@pytest.mark.parametrize("name", CALLS)
def test_an_array_that_masks_nothing_is_an_array(name):
    call, values = CALLS[name]
    call(np.ma.masked_array(np.array(values)))


def test_a_masked_row_of_a_list_is_refused():
    """np.array drops the masks of the rows, and turns numpy.ma.masked to nan."""
    rows = [np.ma.masked_array([0.0, 1.0]), np.ma.masked_array([1.0, 9.0], [False, True])]
    with pytest.raises(ValueError, match=r"force\[1\]\[1\] is masked"):
        wd.ForceHistory(rows, 0.1)
    with pytest.raises(ValueError, match=r"acceleration\[1\] is masked"):
        wd.GroundMotion([0.0, np.ma.masked, 0.0], 0.01)


def test_place_of_the_first_masked_value():
    values = np.ma.masked_array(np.zeros((3, 2)), np.arange(6).reshape(3, 2) > 2)
    with pytest.raises(ValueError, match=r"force\[1\]\[1\] is masked, .*\(3 of 6 values are masked\): fill the gaps"):
        wd.ForceHistory(values, 0.1)


def test_filled_values_are_what_the_user_fills_in():
    gap = np.ma.masked_array([0.0, 1.3, 0.0, 0.2], [False, True, False, False])
    assert wd.GroundMotion(gap.filled(0.0), 0.01).peak_ground_acceleration == 0.2
