"""Tanks: the reference case, closed forms, and invalid input."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import peak, response

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
SETTINGS = {"dtype": "float64", "device": "cpu"}
CYLINDER = wd.housner_cylinder(radius=10.0, depth=8.0)


def slow_motion() -> wd.GroundMotion:
    time = 0.01 * np.arange(2001)
    return wd.GroundMotion(2.0 * np.sin(2 * np.pi * time / 4) * np.exp(-0.2 * time), 0.01)


def run_of(tank, **changed):
    return wd.simulate(wd.Scene(tank, slow_motion(), tail=10.0), step=0.001, **SETTINGS, **changed)


def test_a_tank_has_the_reference_response():
    # L12: Tc = 4.930596 s; impulsive period 0.15 s with 5 %, sloshing with 0.5 %.
    tank = wd.HousnerTank(CYLINDER, impulsive_period=0.15)
    np.testing.assert_allclose(tank.modal()["period"], [4.930596, 0.15], rtol=1e-7)
    np.testing.assert_allclose(tank.parameters["mass"], [1130691, 1300559], rtol=5e-7)
    run = run_of(tank, histories=wd.Histories([0], every=1))
    assert run["peak_displacement"].sel(dof="impulsive").item() == pytest.approx(0.0009459211, rel=1e-5)
    assert run["peak_displacement"].sel(dof="convective").item() == pytest.approx(2.578738, rel=1e-5)
    # The reference takes masses times total accelerations, with the forces of dashpots.
    acceleration = run["acceleration"].isel(history=0)
    masses = zip(tank.dof_names, tank.parameters["mass"], strict=True)
    forces = {dof: acceleration.sel(dof=dof).values * mass for dof, mass in masses}
    shear = np.abs(forces["impulsive"] + forces["convective"]).max()
    assert shear == pytest.approx(5080820, rel=1e-5)
    moment = np.abs(3.0 * forces["impulsive"] + 4.5939 * forces["convective"]).max()
    assert moment == pytest.approx(2.392251e7, rel=1e-5)
    outputs = run["peak_output"]
    assert outputs.sel(output="base shear").item() == pytest.approx(5080820, rel=1e-3)
    assert outputs.sel(output="wall moment").item() == pytest.approx(2.392251e7, rel=1e-3)
    below = np.abs(7.891105 * forces["impulsive"] + 7.253056 * forces["convective"]).max()
    assert outputs.sel(output="foundation moment").item() == pytest.approx(below, rel=1e-3)


def test_a_rectangular_tank_with_a_wall_has_the_exact_response():
    liquid = wd.housner_rectangle(length=20.0, width=10.0, depth=6.0)
    tank = wd.HousnerTank(liquid, impulsive_period=0.2, wall_mass=3e5, wall_height=4.0)
    mass = np.array([liquid.impulsive_mass + 3e5, liquid.convective_mass])
    omega = np.array([2 * np.pi / 0.2, liquid.convective_frequency])
    stiffness, damping = np.diag(mass * omega**2), np.diag(2 * np.array([0.05, 0.005]) * omega * mass)
    found = response(np.diag(mass), damping, stiffness, mass, slow_motion().acceleration, duration=30.0)
    due = [peak(found["time"], found["u"][:, dof], found["v"][:, dof])[0] for dof in range(2)]
    run = run_of(tank)
    np.testing.assert_allclose(run["peak_displacement"][0], due, rtol=1e-5)
    arms = [(liquid.impulsive_mass * liquid.impulsive_height + 3e5 * 4.0) / mass[0], liquid.convective_height]
    row = np.array(arms) * mass * omega**2
    moment = peak(found["time"], found["u"] @ row, found["v"] @ row)[0]
    assert run["peak_output"].sel(output="wall moment").item() == pytest.approx(moment, rel=1e-5)


def test_wrong_tanks_are_refused():
    with pytest.raises(ValueError, match=r"impulsive_period \[s\] must be a finite number above 0"):
        wd.HousnerTank(CYLINDER, impulsive_period=0.0)
    with pytest.raises(ValueError, match="wall_height is missing: wall_mass needs it"):
        wd.HousnerTank(CYLINDER, impulsive_period=0.1, wall_mass=1e5)
    with pytest.raises(ValueError, match="convective_damping_ratio must be a finite number of at least 0"):
        wd.HousnerTank(CYLINDER, impulsive_period=0.1, convective_damping_ratio=-0.1)
    with pytest.raises(TypeError, match=r"takes the result of wd\.housner_cylinder\(\.\.\.\), got float"):
        wd.HousnerTank(10.0, impulsive_period=0.1)
