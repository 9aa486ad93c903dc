"""Warnings that name the line of the user's code that they are about, and what is said of a run's progress."""

from __future__ import annotations

import logging
import os
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import FrameType

from tqdm import tqdm

LOGGER = logging.getLogger("warpdyn")
PACKAGE = str(Path(__file__).parents[2]) + os.sep

# Warnings that were given within the present block, by their text without its numbers; None outside such a block.
_given: ContextVar[set[str] | None] = ContextVar("given_warnings", default=None)
# Digits of names, such as 'DS2', and of what is quoted are no numbers of a message.
_NUMBER = re.compile(r"(?<![\w'])\d[\d.,]*(?:e[+-]?\d+)?")
_is_silent: ContextVar[bool] = ContextVar("warnings_are_silent", default=False)
_collected: ContextVar[list[tuple[str, type[Warning]]] | None] = ContextVar("collected_warnings", default=None)


@contextmanager
def each_warning_once() -> Iterator[None]:
    """Give a warning once within a block that does the same work several times, even if its numbers differ."""
    before = _given.set(set())
    try:
        yield
    finally:
        _given.reset(before)


@contextmanager
def no_warnings() -> Iterator[None]:
    """Give no warnings of what is tried within a block, and may yet be tried otherwise."""
    before = _is_silent.set(True)
    try:
        yield
    finally:
        _is_silent.reset(before)


@contextmanager
def collected_warnings() -> Iterator[list[tuple[str, type[Warning]]]]:
    """Collect the warnings that a block would give in this thread, for its caller to give: messages and categories."""
    found: list[tuple[str, type[Warning]]] = []
    before = _collected.set(found)
    try:
        yield found
    finally:
        _collected.reset(before)


def warn_caller(message: str, category: type[Warning] = UserWarning) -> None:
    """Warn, as of the line that called warpdyn, however deep within it this was found."""
    collected = _collected.get()
    if collected is not None and not _is_silent.get():
        collected.append((message, category))
        return
    given, text = _given.get(), _NUMBER.sub("", message)
    if _is_silent.get() or (given is not None and text in given):
        return
    if given is not None:
        given.add(text)
    frame: FrameType | None = sys._getframe(1)
    level, of_caller = 2, 2
    while frame is not None:
        level += 1
        if frame.f_code.co_filename.startswith(PACKAGE):
            of_caller = level
        frame = frame.f_back
    warnings.warn(message, category, stacklevel=of_caller)


def warn_of_all(function: str, sentences: Sequence[str]) -> None:
    """Give one warning with several sentences, if there are any, as a list that begins with the function's name."""
    if sentences:
        warn_caller("\n- ".join([f"{function}:", *sentences]) if len(sentences) > 1 else f"{function}: {sentences[0]}")


def say(message: str) -> None:
    """Say what takes time: on a terminal, as progress bars do, and to the logger "warpdyn" as information."""
    LOGGER.info(message)
    if sys.stderr.isatty() and not LOGGER.isEnabledFor(logging.INFO):
        tqdm.write(message, file=sys.stderr)


def tell(message: str) -> None:
    """Say what the user must know, who is not to change anything: it is logged, and shown on any stderr by default."""
    LOGGER.warning(message)
