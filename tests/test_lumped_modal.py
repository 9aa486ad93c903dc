"""Effective modal masses of lumped structures: by component of base motion, and with a separate load mass."""

from __future__ import annotations

import numpy as np
import pytest

import warpdyn as wd

MASS, INERTIA = 1.5e5, 6.8e6  # kg, kg m2


def deck(arm: float) -> wd.LumpedStructure:
    """Return a deck that is symmetric about the x axis; the frames along y have different stiffnesses."""
    springs = [
        wd.Spring("south", {"x": 1.0, "theta": 5.0}, stiffness=5e7),
        wd.Spring("north", {"x": 1.0, "theta": -5.0}, stiffness=5e7),
        wd.Spring("west", {"y": 1.0, "theta": -arm}, stiffness=9e7),
        wd.Spring("east", {"y": 1.0, "theta": arm}, stiffness=3e7),
    ]
    masses = {"x": MASS, "y": MASS, "theta": INERTIA}
    return wd.LumpedStructure(masses, springs, influence=[{"x": 1.0}, {"y": 1.0}])


def test_effective_masses_of_two_components_have_the_closed_form():
    modes = deck(9.0).modal()
    assert modes["effective_mass"].dims == ("mode", "component")
    # y and theta are coupled: a problem of two degrees of freedom, in m and in radii of gyration.
    k_y, k_yt = 12e7, -9.0 * 6e7
    k_t = 10e7 * 25.0 + 12e7 * 81.0
    a, b, d = k_y / MASS, k_yt / np.sqrt(MASS * INERTIA), k_t / INERTIA
    squared = (a + d) / 2 + np.array([-1.0, 1.0]) * np.hypot((a - d) / 2, b)
    of_y = b**2 / (b**2 + (squared - a) ** 2)  # squared component in y of the unit eigenvector
    due = {float(square): (0.0, MASS * share) for square, share in zip(squared, of_y, strict=True)}
    due[10e7 / MASS] = (MASS, 0.0)
    order = sorted(due)
    np.testing.assert_allclose(modes["circular_frequency"] ** 2, order, rtol=1e-9)
    np.testing.assert_allclose(modes["effective_mass"], [due[each] for each in order], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(modes["effective_mass_ratio"].sum("mode"), 1.0, rtol=1e-12)


def test_the_table_shows_both_components():
    table = wd.modal_table(deck(9.0).modal())
    head = table.splitlines()[0]
    assert head.count("effective mass [t]") == head.count("sum of shares") == 2
    assert "base 1: " in head
    assert "base 2: " in head
    assert table.splitlines()[-1].count("100.00 %") >= 2


def test_one_component_keeps_its_columns():
    modes = wd.LumpedStructure({"x": 1e5}, [wd.Spring("s", {"x": 1.0}, stiffness=1e7)]).modal()
    assert modes["effective_mass"].dims == ("mode",)
    assert "participation" in wd.modal_table(modes)


def test_an_inerter_does_not_count_in_the_effective_mass():
    # A mass with an inerter to the ground: the base pulls at the mass alone, (m)^2 / (m + b).
    springs = [wd.Spring("s", {"x": 1.0}, stiffness=1e7)]
    modes = wd.LumpedStructure({"x": 1e5}, springs, mass_matrix=[[5e4]], load_mass=[1e5]).modal()
    assert modes["effective_mass"].item() == pytest.approx(1e10 / 1.5e5, rel=1e-12)
    assert modes["participation_factor"].item() == pytest.approx(1 / 1.5, rel=1e-12)
