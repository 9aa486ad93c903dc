"""The energy that one linear part of pinching4's paths gives back, by hand."""

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.laws.pinching4.backbone_and_paths import pinching4_release

pytestmark = pytest.mark.fast


@wp.kernel(module="unique", enable_backward=False)
def release(part: wp.array2d(dtype=wp.float64), energy: wp.array(dtype=wp.float64)):
    i = wp.tid()
    energy[i] = pinching4_release(part[i, 0], part[i, 1], part[i, 2], part[i, 3], part[i, 4])


PARTS = {  # drift, ends (drift, force) of the part, and the area between the line and zero up to zero force
    "ends before zero force": (0, 0, -2, 2, -1, 3.0),
    "ends before zero force, from its middle": (1, 0, -2, 2, -1, 1.25),
    "ends at zero force": (0, 0, -2, 2, 0, 2.0),
    "crosses zero force": (0, 0, -2, 3, 1, 2.0),
    "crosses zero force, from its middle": (1, 0, -2, 3, 1, 0.5),
    "lies ahead": (-1, 0, -2, 2, -1, 3.0),
    "lies behind": (3, 0, -2, 2, -1, 0.0),
    "has a positive force": (0, 0, 1, 2, 3, 0.0),
}


@pytest.mark.parametrize("name", PARTS)
def test_the_energy_of_a_part_ends_with_the_part_or_at_zero_force(name):
    *part, expected = PARTS[name]
    energy = wp.zeros(1, dtype=wp.float64, device="cpu")
    given = wp.array(np.array([part], dtype=np.float64), dtype=wp.float64, device="cpu")
    wp.launch(release, dim=1, inputs=[given, energy], device="cpu")
    assert energy.numpy()[0] == pytest.approx(expected, abs=1e-14)
