"""Warnings that name the line of the user's code that they are about."""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path
from types import FrameType

PACKAGE = str(Path(__file__).parent.parent) + os.sep


def warn_caller(message: str, category: type[Warning] = UserWarning) -> None:
    """Warn, as of the line that called warpdyn, however deep within it this was found."""
    frame: FrameType | None = sys._getframe(1)
    level, of_caller = 2, 2
    while frame is not None:
        level += 1
        if frame.f_code.co_filename.startswith(PACKAGE):
            of_caller = level
        frame = frame.f_back
    warnings.warn(message, category, stacklevel=of_caller)
