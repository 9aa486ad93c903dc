"""Checks of the control of a scene against its structure and excitation."""

from __future__ import annotations

from typing import Any

from warpdyn.foundations.core.checks import check_kind
from warpdyn.model.control.control import Control
from warpdyn.model.ground_motions.excitation import Excitation
from warpdyn.model.structures.structure import Structure


def check_control(control: Any, structure: Structure, excitation: Excitation) -> None:
    """Raise an error unless a scene with this structure and excitation can have the control."""
    check_kind("control", "a wd.control.Control", control, Control)
    if structure.is_many:
        raise ValueError(
            "a Portfolio cannot have a control, because its buildings have different numbers of storeys: give a scene "
            "with one building and scatter"
        )
    if len(excitation.event_names) > 1:
        raise ValueError(
            "an EventSequence cannot have a control, because the state of the controller would be lost between the "
            "events: run each event as a separate scene"
        )
    control.check(structure, base_components=excitation.base_components)
