"""Histories and ensembles of reduced frames: linear response, random sections, drifts and member forces."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from frame_cases import portal, two_storey
from linear_response import peak, response
from lumped_cases import pulse

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")
SETTINGS = {"dtype": "float64", "device": "cpu"}
FORCES = ("drift", "base_shear", "member_force")


def pulse_of_reference(amplitude: float, period: float, decay: float) -> wd.GroundMotion:
    time = 0.01 * np.arange(1001)
    return wd.GroundMotion(amplitude * np.sin(2 * np.pi * time / period) * np.exp(-decay * time), 0.01, "pulse")
