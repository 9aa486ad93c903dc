"""Warnings that name the line of the user's code that they are about, and what is said of a run's progress."""

from __future__ import annotations

import logging
import os
import sys
import warnings
from pathlib import Path
from types import FrameType

from tqdm import tqdm

LOGGER = logging.getLogger("warpdyn")
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


def say(message: str) -> None:
    """Say what takes time: on a terminal, as progress bars do, and to the logger "warpdyn" as information."""
    LOGGER.info(message)
    if sys.stderr.isatty() and not LOGGER.isEnabledFor(logging.INFO):
        tqdm.write(message, file=sys.stderr)


def tell(message: str) -> None:
    """Say what the user must know, who is not to change anything: it is logged, and shown on any stderr by default."""
    LOGGER.warning(message)
