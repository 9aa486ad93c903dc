"""Self-centring storeys: exact loops, OpenSees' FlagShape, slip and bearing, energy, and a system under a pulse."""

import numpy as np
import pytest
from law_cases import cases, loop_error, material_of, pulse_error, run_pulse
from opensees import finer, growing, material_forces, ratcheting, wandering
from storey_steps import steps

import warpdyn as wd
from warpdyn.engine.laws import LAWS

STIFFNESS, YIELD_FORCE = 2.0e7, 2.0e5  # a storey that yields at 10 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8]), 50),
    "random": wandering(8 * YIELD_DRIFT, 60, 37, seed=1),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 40),
}
FLAGS = [(0.05, 0.8), (0.01, 0.3), (0.2, 1.0), (0.0, 0.5), (0.1, 0.0)]  # hardening ratio, flag height


def law_of(k1, k2, yield_force, flag_height, slip=0.0, bearing=0.0, bearing_ratio=1.0):
    """Return the storey's stiffness and its law from the numbers of OpenSees' SelfCentering."""
    return k1, wd.laws.SelfCentring(
        yield_force=yield_force,
        hardening_ratio=k2 / k1,
        flag_height=flag_height,
        slip_drift=slip,
        bearing_drift=bearing,
        bearing_stiffness_ratio=bearing_ratio,
    )


def law_of_flag_shape(stiffness, yield_force, hardening, beta):
    """Return the same from the numbers of FlagShape, whose beta is half the flag height."""
    return law_of(stiffness, hardening, yield_force, 2 * beta)


def law_of_case(case):
    make = law_of_flag_shape if case["opensees"][0][0] == "FlagShape" else law_of
    return make(*material_of(case))


def storey(stiffness, law):
    return wd.ShearBuilding(1.0, stiffness, 3.0, law=law)


def storey_of(hardening, flag_height, **limits):
    law = wd.laws.SelfCentring(yield_force=YIELD_FORCE, hardening_ratio=hardening, flag_height=flag_height, **limits)
    return storey(STIFFNESS, law)


@pytest.mark.fast
@pytest.mark.parametrize("name", ["self_centring_1", "self_centring_2", "self_centring_3_bearing", "flag_shape_1"])
def test_forces_are_those_of_the_exact_loops(name, measured):
    # Long steps give the same force as short ones.
    error = max(loop_error(cases("loops")[name], storey(*law_of_case(cases("loops")[name])), n) for n in (100, 1000))
    measured(
        "forces of storeys of law `self_centring` along loops, over the largest force",
        truth="a solution that is exact for each segment (for `FlagShape` the same as OpenSees)",
        value=error,
        bound=1e-7,
    )


@pytest.mark.fast
@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize(("hardening", "flag_height"), FLAGS[:-1])
def test_forces_are_those_of_flag_shape(protocol, hardening, flag_height):
    drift = PROTOCOLS[protocol]
    ours = wd.storey_hysteresis(storey_of(hardening, flag_height), drift)["storey_force"].values[:, 0]
    theirs = material_forces("FlagShape", [STIFFNESS, YIELD_FORCE, hardening * STIFFNESS, flag_height / 2], drift)
    assert np.ptp(theirs) > 1.99 * YIELD_FORCE
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * YIELD_FORCE)


@pytest.mark.fast
def test_slip_leaves_a_residual_drift_and_bearing_acts_at_its_drift():
    building = storey_of(0.1, 0.6, slip_drift=0.03, bearing_drift=0.05, bearing_stiffness_ratio=0.5)
    # Yield drift 10 mm: 200 kN. Slip from 30 mm, at 240 kN, to 50 mm, where the bearing with 10 kN/mm begins.
    drift = np.array([0.03, 0.05, 0.06, 0.05, 0.04, 0.036, 0.02, 0.01, 0.0, -0.01, -0.02])
    # Back from 50 mm, slipped by 20 mm: slope 20 kN/mm until the gap closes, 0.6 x 180 = 108 kN below the upper line;
    # then slope 2 kN/mm to 4 mm from the slipped origin (80 kN), then slope 20 to the other side of that origin.
    expected = np.array([240, 240, 340, 240, 112, 104, 0, -200, -220, -240, -240]) * 1e3
    found = wd.storey_hysteresis(building, drift)["storey_force"].values[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * YIELD_FORCE)


@pytest.mark.fast
@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize(("hardening", "flag_height"), FLAGS)
def test_dissipated_energy_never_falls_and_counts_the_flags(protocol, hardening, flag_height):
    building = storey_of(hardening, flag_height)
    drift = finer(PROTOCOLS[protocol], 400)
    found = wd.storey_hysteresis(building, drift)["dissipated_energy"].values[:, 0]
    assert np.diff(found).min() > -1e-5 * YIELD_FORCE * YIELD_DRIFT  # of the trapezoidal rule at corners
    # One cycle to 5 yield drifts encloses a parallelogram on each side: its height times the way of the gap.
    cycle = np.concatenate([np.linspace(a, b, 20001)[1:] for a, b in ((0, 5), (5, -5), (-5, 0))]) * YIELD_DRIFT
    found = wd.storey_hysteresis(building, cycle)["dissipated_energy"].values[-1, 0]
    enclosed = 2 * flag_height * (1 - hardening) * YIELD_FORCE * 4 * YIELD_DRIFT
    assert found == pytest.approx(enclosed, rel=1e-6, abs=1e-6 * YIELD_FORCE * YIELD_DRIFT)


@pytest.mark.fast
@pytest.mark.parametrize("limits", [{}, {"slip_drift": 0.03, "bearing_drift": 0.05}])
def test_trials_tangents_and_precision(limits):
    drift = PROTOCOLS["random"]
    building = storey_of(0.05, 0.7, **limits)
    double, single = steps(building, drift), steps(building, drift, "float32")
    np.testing.assert_allclose(double.trial_force, double.force, rtol=0, atol=1e-12 * YIELD_FORCE)
    np.testing.assert_allclose(single.force, double.force, rtol=0, atol=2e-6 * YIELD_FORCE * 100)
    assert (np.abs(double.tangent - double.chord) < 1e-5 * STIFFNESS).mean() > 0.99


@pytest.mark.fast
def test_rows_names_and_bad_input():
    spring = LAWS["self_centring"].spring
    assert spring(storey_of(0.1, 0.5).parameters) == "self_centring"
    assert spring(storey_of(0.1, 0.5, slip_drift=0.1).parameters) == "self_centring_with_limits"
    given = wd.ShearBuilding(
        1.0, STIFFNESS, 3.0, law="SelfCentering", yield_force=YIELD_FORCE, hardening_ratio=0.1, flag_height=0.5
    )
    assert given.law == "self_centring"
    with pytest.raises(ValueError, match=r"slip_drift is 0\.005 at storey 1; it must be 0 .* at least 0\.01"):
        storey_of(0.1, 0.5, slip_drift=0.005)
    with pytest.raises(ValueError, match=r"flag_height is 60; it must be .*; 60 % is 0\.6"):
        storey_of(0.1, 60)


def test_a_system_under_a_pulse(measured):
    case = cases("dynamic")["dynamic_flag"]
    stiffness, law = law_of_flag_shape(*material_of(case))
    measured(
        "peak and last drifts of a `self_centring` storey under a pulse, over the largest drift",
        truth="central differences with an independent law, step 0.05 ms",
        value=pulse_error(case, run_pulse(case, stiffness, law=law)),
        bound=2e-4,
    )
