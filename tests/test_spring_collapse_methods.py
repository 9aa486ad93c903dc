"""Collapse by the capacity of a spring, with one-step and multistep methods of lumped structures."""

from __future__ import annotations

import numpy as np
import pytest

import warpdyn as wd

LAW = wd.laws.Bilinear(yield_force=2e5, hardening_ratio=0.05)
TIME = np.arange(800) * 0.01
MOTION = wd.GroundMotion(4.0 * np.sin(2 * np.pi * TIME) * np.exp(-0.2 * TIME), 0.01, "decaying sine")


def collapse_times(method: str) -> np.ndarray:
    springs = [
        wd.Spring("low", {"u1": 1.0}, stiffness=4e6, law=LAW, deformation_capacity=0.3),
        wd.Spring("high", {"u1": -1.0, "u2": 1.0}, stiffness=4e6, law=LAW),
    ]
    structure = wd.LumpedStructure({"u1": 1e5, "u2": 1e5}, springs, damping="mass_proportional", damping_ratio=0.02)
    scatter = {"mass": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    run = wd.simulate(
        wd.Scene(structure, MOTION, scatter), structures=8, seed=1, method=method, step=0.0025, dtype="float64"
    )
    return run["time_of_collapse"].values


@pytest.mark.parametrize("method", ["leapfrog", "stoermer"])
def test_multistep_methods_find_the_collapses_of_rk4(method):
    expected, found = collapse_times("rk4"), collapse_times(method)
    assert 0 < np.isfinite(expected).sum() < expected.size
    np.testing.assert_allclose(found, expected, atol=5e-5)  # they differ by 2e-5 s; a step has 2.5e-3 s


def test_a_start_beyond_capacities_names_the_spring_with_the_largest_ratio():
    springs = [
        wd.Spring("low", {"u1": 1.0}, stiffness=4e6, deformation_capacity=0.02),
        wd.Spring("middle", {"u1": -1.0, "u2": 1.0}, stiffness=4e6, deformation_capacity=0.02),
        wd.Spring("high", {"u2": -1.0, "u3": 1.0}, stiffness=4e6, deformation_capacity=0.02),
    ]
    masses = {"u1": 1e5, "u2": 1e5, "u3": 1e5}
    structure = wd.LumpedStructure(masses, springs, damping="mass_proportional", damping_ratio=0.02)
    start = wd.FreeVibration(0.5, displacement=[0.01, 0.06, 0.09])  # ratios .5, 2.5 and 1.5
    run = wd.simulate(wd.Scene(structure, start), step=0.0025, dtype="float64", method="rk4")
    assert run["time_of_collapse"].item() == 0.0
    assert run["spring"].values[run["spring_of_collapse"].item()] == "middle"
