"""Incremental dynamic analysis of the four-storey frame with hinges: capacities within 1 % of OpenSees."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hinged_frame_cases import reference_model

import warpdyn as wd

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.meant_as_given("damping_ratio", "no_damping", "strongest_motion", "peak_ground_acceleration"),
]
DURATION = 15.0  # s, from 1 s before the motion has 0.5 % of its Arias intensity
LIMIT = 0.04  # storey drift ratio
# OpenSees 3.7.1: Newmark's average acceleration with 0.0025 s, Newton's method to displacement increments of 1e-8,
# IMKBilin hinges, modal damping, P-Delta of all columns. Peak ground acceleration [g], largest storey drift ratio.
OPENSEES = {
    "MUL279": ((1.221965, 0.03900115), (1.246651, 0.0408278)),
    "LOS270": ((0.813138, 0.03954313), (0.829565, 0.04054671)),
    "NIS090": ((1.581593, 0.03919137), (1.613545, 0.04094737)),
}

COLLAPSE = {"LOS270": (2.141343, 2.184603)}  # g: the largest drift ratio is 0.09745898, and reaches 0.1 at 14.67 s


def strong_part(name: str) -> wd.GroundMotion:
    """Return the strong part of a record of the far-field set, which both programs use."""
    [record] = [each for each in wd.records.far_field() if name in each.name]
    values, step = np.asarray(record.acceleration), record.step
    intensity = np.cumsum(values**2) / np.sum(values**2)
    first = max(0, int(np.argmax(intensity > 0.005)) - int(1 / step))
    return wd.GroundMotion(np.append(values[first : first + int(DURATION / step)], 0.0), step, name)


def test_capacities_are_those_of_opensees():
    motions = [strong_part(name) for name in OPENSEES]
    excitation = wd.Stripes(motions, [0.1, 8.0], wd.PeakGroundAcceleration())
    scene = wd.Scene(reference_model("four_storey", drift_capacity=0.1), excitation, tail=0.0)
    limits = {"4 %": LIMIT, "collapse": math.inf}
    found = wd.capacities(scene, limits, structures=1, tolerance=0.002, highest=math.inf, device="cpu")
    for motion, (name, ((low, below), (high, above))) in enumerate(OPENSEES.items()):
        assert below <= above
        due = low + (LIMIT - below) / (above - below) * (high - low)  # of the line through both points
        capacity = found["capacity"].isel(structure=0, motion=motion, damage_state=0).item()
        assert capacity == pytest.approx(due, rel=0.01), name
        if name in COLLAPSE:
            capacity = found["capacity"].isel(structure=0, motion=motion, damage_state=1).item()
            assert COLLAPSE[name][0] < capacity < COLLAPSE[name][1]  # 2 % apart
