"""Rotors with unbalance: the reference case of a run-up, the steady whirl, and invalid input."""

from __future__ import annotations

import numpy as np
import pytest

import warpdyn as wd

SETTINGS = {"device": "cpu", "dtype": "float64"}


def rotor(**changes) -> wd.UnbalancedRotor:
    given = {"mass": 100.0, "stiffness": 4e6, "eccentricity": 1e-4, "damping_ratio": 0.02} | changes
    return wd.UnbalancedRotor(given.pop("mass"), given.pop("stiffness"), **given)


# L11: peak of x [m] and its time [s], peak of y, of an independent integration (two tolerances agree to 8 digits).
@pytest.mark.parametrize(
    ("acceleration", "duration", "x", "y"),
    [
        (50.0, 5.0, (0.001948744, 4.22016), (0.001950006, 4.22787)),
        (200.0, 1.6, (0.001399773, 1.13286), (0.0013965, 1.12531)),
    ],
)
def test_a_run_up_has_the_peaks_of_the_reference(acceleration, duration, x, y):
    machine, step = rotor(), 1e-4
    force = wd.unbalance_force(machine.unbalance, acceleration=acceleration, duration=duration, step=step)
    histories = wd.Histories([0])
    run = wd.simulate(wd.Scene(machine, force), step=step, histories=histories, **SETTINGS)
    for dof, (peak, at) in {"x": x, "y": y}.items():
        assert run["peak_displacement"].sel(dof=dof).item() == pytest.approx(peak, rel=1e-3)
        history = np.abs(run["displacement"].isel(history=0).sel(dof=dof).values)
        assert run["time"].values[np.nanargmax(history)] == pytest.approx(at, abs=2 * step)


@pytest.mark.parametrize(("q", "due"), [(0.5, 3.332149e-05), (0.9, 0.0004188634), (1.0, 0.0025), (2.0, 0.000133286)])
def test_a_constant_speed_leads_to_the_steady_whirl(q, due):
    machine = rotor()
    assert machine.steady_amplitude(200.0 * q) == pytest.approx(due, rel=1e-6)
    step = 2 * np.pi / (200.0 * q) / 200
    force = wd.unbalance_force(
        machine.unbalance, acceleration=0.0, duration=2.0 + 200 * step, step=step, speed=200.0 * q
    )
    run = wd.simulate(wd.Scene(machine, force), step=step, histories=wd.Histories([0]), **SETTINGS)
    last = np.abs(run["displacement"].isel(history=0).sel(dof="x").values)
    last = last[(run["time"].values > 2.0) & (run["time"].values < 2.0 + 200 * step)]
    assert last.max() == pytest.approx(due, rel=2e-3)


def test_different_stiffnesses_have_two_critical_speeds():
    machine = rotor(stiffness=(4e6, 9e6))
    np.testing.assert_allclose(machine.critical_speeds, [200.0, 300.0], rtol=1e-12)
    assert machine.steady_amplitude(300.0, "y") == pytest.approx(0.0025, rel=1e-9)
    assert repr(machine) == "UnbalancedRotor(100 kg, critical speed 200 and 300 rad/s)"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: rotor(mass=0.0), r"mass \[kg\]"),
        (lambda: rotor(stiffness=(1e6, 1e6, 1e6)), "stiffness must be one value or one for x and one for y"),
        (lambda: rotor(stiffness=(1e6, -1.0)), "stiffness of y"),
        (lambda: rotor(eccentricity=0.0), r"eccentricity \[m\]"),
        (lambda: rotor(damping_ratio=-0.1), "damping_ratio"),
        (lambda: wd.unbalance_force(0.01, acceleration=50.0, duration=0.0, step=1e-4), "duration"),
        (
            lambda: wd.unbalance_force(0.01, acceleration=50.0, duration=1e4, step=1e-4),
            "duration over step is 100,000,000",
        ),
        (lambda: wd.unbalance_force(0.0, acceleration=50.0, duration=1.0, step=1e-4), "unbalance"),
    ],
)
def test_a_wrong_rotor_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
