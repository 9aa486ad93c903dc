"""Structures with the same connections share a kernel: rounding and magnitudes do not decide its text."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.campaigns.integration.lumped.dynamics import LumpedDynamics

SIZES = (0.31, 0.7, 1.0, 1.1, 1.31, 1.37, 2.11)


def chain(size: float) -> wd.ShearBuilding:
    return wd.ShearBuilding([1e5] * 3, 5e7 * size, 3.0, damping="modal", damping_ratio=0.05)


def torsional(size: float) -> wd.TorsionalBuilding:
    share = np.array([1.0, 0.8, 0.5]) * size
    frames = [
        wd.PlanFrame("front", (0.0, -5.0), "x", 6e7 * share),
        wd.PlanFrame("back", (0.0, 5.0), "x", 6e7 * share),
        wd.PlanFrame("wall", (-9.0, 0.0), "y", 9e7 * share),
        wd.PlanFrame("frame", (9.0, 0.0), "y", 5e7 * share),
    ]
    masses = np.array([1.5e5, 1.5e5, 1.2e5]) * (1 + 0.3 * size)
    plan = [[-10.0, 10.0], [-6.0, 6.0]]
    damping = {"damping": "modal", "damping_ratio": 0.05}
    return wd.TorsionalBuilding(masses, plan, frames, mass_centre=(0.5, 0.7), **damping)


def tower(**other) -> Callable[[float], wd.FlexuralShearBuilding]:
    hinge = {"law": "bilinear", "stiffness": 1e12, "yield_force": 4e8, "hardening_ratio": 0.02}
    if other.pop("is_hinged", False):
        other["base_hinge"] = hinge
    return lambda size: wd.FlexuralShearBuilding([4e5] * 10, 3.0, period=size, alpha0=4.0, **other)


MODAL = {"damping": "modal", "damping_ratio": 0.03}
SOIL = wd.FoundationSprings(2e8, 2e9, sway_dashpot=6e6, rocking_dashpot=2e8)


@pytest.mark.parametrize(
    "made",
    [
        tower(),
        tower(**MODAL),
        tower(**MODAL, gravity_load="weight"),
        tower(**MODAL, is_hinged=True),
        tower(damping="rayleigh", damping_ratio=0.03),
        torsional,
        lambda size: wd.with_equipment(chain(size), "u2", 100.0, tuned_to_mode=1, damping_ratio=0.01),
        lambda size: wd.with_absorber(chain(size), "u2", mass_ratio=0.02, inertance_ratio=0.1),
        lambda size: wd.structure_on_soil(chain(size), SOIL, foundation_mass=1e5, rocking_inertia=1e6),
    ],
    ids=["tower", "modal", "gravity", "hinged", "rayleigh", "torsional", "equipment", "absorber", "soil"],
)
def test_structures_with_the_same_connections_have_the_same_pattern(made):
    patterns = {LumpedDynamics(made(size), {}).pattern for size in SIZES}
    assert len(patterns) == 1


def test_the_base_forces_of_a_tower_are_those_of_its_stiffness_matrix():
    building = tower()(1.0)
    heights = np.arange(3.0, 33.0, 3.0)
    rows = dict(zip(building.outputs, building.output_rows, strict=True))
    whole = building.stick.stiffness
    np.testing.assert_allclose(rows["base shear"], whole.sum(axis=0), atol=1e-9 * np.abs(whole).max())
    np.testing.assert_allclose(rows["base moment"], heights @ whole, atol=1e-9 * np.abs(heights @ whole).max() + 1.0)
