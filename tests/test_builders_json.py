"""Scenes with built structures from their JSON: the same samples."""

from __future__ import annotations

import numpy as np
import pytest
from lumped_cases import pair, pulse

import warpdyn as wd

SETTINGS = {"dtype": "float64", "device": "cpu"}
FIRST, SECOND = pulse(4.0, 0.7, 0.5, 2.0), pulse(3.0, 0.5, 0.5, 2.0)
LAW = {"law": "bilinear", "yield_force": [3e5, 2e5], "hardening_ratio": 0.05}


def twisting() -> wd.TorsionalBuilding:
    frames = [wd.PlanFrame(f"{axis}{side}", (side, side), axis, 3e7, **LAW) for axis in "xy" for side in (-4.0, 5.0)]
    return wd.TorsionalBuilding(
        [2e5, 1e5],
        [[-10.0, 10.0], [-6.0, 6.0]],
        frames,
        mass_centre=(1.0, -0.5),
        storey_height=3.5,
        gravity_load="weight",
        damping="rayleigh",
        damping_ratio=0.05,
        damping_modes=(1, 4),
    )


def scenes() -> dict[str, wd.Scene]:
    eccentric = {"eccentricity_x": wd.RandomValue(wd.Uniform(-1.0, 1.0))}
    building = wd.ShearBuilding([1e5] * 2, 1e8, 3.0, damping="modal", damping_ratio=0.05)
    tower = wd.FlexuralShearBuilding([1e5] * 2, 3.0, period=0.5, alpha0=3.0, damping="modal", damping_ratio=0.05, **LAW)
    on_soil = wd.structure_on_soil(
        building, wd.FoundationSprings(1e9, 1e11, 1e7, 1e8), foundation_mass=1e5, rocking_inertia=1e6
    )
    tank = wd.HousnerTank(wd.housner_cylinder(10.0, 8.0), impulsive_period=0.2)
    damped = wd.with_absorber(building, "u2", mass_ratio=0.02, inertance_ratio=0.1)
    return {
        "torsional": wd.Scene(twisting(), pair(FIRST, SECOND), eccentric),
        "tower": wd.Scene(tower, FIRST, {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}),
        "on soil": wd.Scene(on_soil, FIRST),
        "tank": wd.Scene(tank, FIRST),
        "absorber": wd.Scene(damped, FIRST),
    }


@pytest.mark.parametrize("name", scenes())
def test_a_scene_from_its_json_has_the_same_samples(name):
    scene = scenes()[name]
    motions = scene.excitation.motions
    other = wd.Scene.from_json(scene.to_json(), motions)
    one, two = (wd.simulate(each, structures=5, seed=2, **SETTINGS) for each in (scene, other))
    assert one["peak_displacement"].max() > 0
    for variable in ("peak_displacement", "peak_spring_force"):
        np.testing.assert_array_equal(one[variable], two[variable])
