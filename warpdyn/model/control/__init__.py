"""Control of structures: actuators, sensors, controllers, regulators (LQR, LQG), and analysis of closed loops.

wd.control.Control([wd.control.Actuator(1)], regulator=..., sampling_interval=0.01)
"""

from __future__ import annotations

from warpdyn.engine.controllers.built_in import (
    ClippedOptimal,
    ConstantCommand,
    ContinuousSkyhook,
    OnOffSkyhook,
    SkyhookDamper,
)
from warpdyn.engine.controllers.controller import Controller
from warpdyn.model.control.actuators import Actuator, MRDamper, VariableDamper
from warpdyn.model.control.control import Control
from warpdyn.model.control.loops import closed_loop_eigenvalues, delay_margin, sampled_eigenvalues
from warpdyn.model.control.regulators import Regulator, lqg, lqr
from warpdyn.model.control.state_space import StateSpace, state_space

__all__ = [
    "Actuator",
    "ClippedOptimal",
    "ConstantCommand",
    "ContinuousSkyhook",
    "Control",
    "Controller",
    "MRDamper",
    "OnOffSkyhook",
    "Regulator",
    "SkyhookDamper",
    "StateSpace",
    "VariableDamper",
    "closed_loop_eigenvalues",
    "delay_margin",
    "lqg",
    "lqr",
    "sampled_eigenvalues",
    "state_space",
]
