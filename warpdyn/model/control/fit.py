"""Checks of the control of a scene against its structure and excitation."""

from __future__ import annotations

from typing import Any

from warpdyn.engine.controllers.built_in import ClippedOptimal, ConstantCommand, ContinuousSkyhook, OnOffSkyhook
from warpdyn.engine.controllers.controller import Controller
from warpdyn.engine.controllers.rules import DAMPER, FORCE, MAGNETORHEOLOGICAL
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.control.control import Control
from warpdyn.model.control.regulators import Regulator
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.structures.structure import Structure

# Parameters that a controller returns as its command.
COMMANDS: dict[type, tuple[str, ...]] = {
    ClippedOptimal: ("voltage",),
    ConstantCommand: ("value",),
    ContinuousSkyhook: ("low", "high"),
    OnOffSkyhook: ("low", "high"),
}
UNITS_OF_COMMANDS = {FORCE: "N", DAMPER: "N s/m", MAGNETORHEOLOGICAL: "V"}


def check_control(control: Any, structure: Structure, excitation: Excitation) -> None:
    """Raise an error unless a scene with this structure and excitation can have the control."""
    if isinstance(control, Regulator | Controller):
        raise TypeError(
            f"Scene(control=...) takes a wd.control.Control, got {type(control).__name__}: give control="
            f"wd.control.Control(actuators, {'regulator' if isinstance(control, Regulator) else 'controller'}=..., "
            "sampling_interval=...)"
        )
    check_kind("Scene", "a wd.control.Control", control, Control, argument="control")
    if structure.is_many:
        raise ValueError(
            "a Portfolio cannot have a control, because its buildings have different numbers of storeys: make a scene "
            "for each archetype, wd.Scene(archetype.building, motions, archetype.scatter, control=...), with a control "
            "for its number of storeys"
        )
    if len(excitation.event_names) > 1:
        raise ValueError(
            "an EventSequence cannot have a control, because the states of actuators and controller would be lost "
            "between the events: join the motions of the events, with a quiet time between them, into one motion, such "
            "as wd.GroundMotion(np.concatenate([first, np.zeros(3000), second]), step)"
        )
    control.check(structure, base_components=excitation.base_components)
    _warn_of_limited_commands(control)


def _warn_of_limited_commands(control: Control) -> None:
    """Warn of commands of a controller of warpdyn that are beyond the limits of an actuator."""
    controller = control.controller
    for name in COMMANDS.get(type(controller), ()):
        value = getattr(controller, name)
        for number, actuator in enumerate(control.actuators, 1):
            low, high = actuator.command_limits
            if not low <= value <= high:
                unit = UNITS_OF_COMMANDS[actuator.kind]
                warn_caller(
                    f"{name}={value:g} of {type(controller).__name__} is beyond the limits of actuator {number}, a "
                    f"{type(actuator).__name__} with commands from {low:g} to {high:g} {unit}: the command will be "
                    f"limited, or fail with on_limit='fail'. Check the unit of {name}, or give a value within the "
                    "limits"
                )
