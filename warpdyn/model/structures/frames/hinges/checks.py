"""Checks of frames with hinges, and of the table of hinges."""
from __future__ import annotations
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any
from warpdyn.model.structures.frames.column_line import check_gravity, ENDS

def check_frame(frame): pass
def checked_hinges(frame, hinges):
    return {k: dict(v) for k, v in hinges.items()}
