"""Warnings at the line of the user's code that called warpdyn, and messages on the progress of a run."""

from __future__ import annotations

import logging
import os
import re
import sys
import warnings
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import FrameType

from tqdm import tqdm

LOGGER = logging.getLogger("warpdyn")
PACKAGE = str(Path(__file__).parents[2]) + os.sep

# Texts of the warnings given within `each_warning_once`, without their numbers; None outside such a block.
_given: ContextVar[set[str] | None] = ContextVar("given_warnings", default=None)
# Pattern of the numbers in a message. Digits in a name, such as 'DS2', or directly after a quote are not matched.
_NUMBER = re.compile(r"(?<![\w'])\d[\d.,]*(?:e[+-]?\d+)?")
_is_silent: ContextVar[bool] = ContextVar("warnings_are_silent", default=False)
_collected: ContextVar[list[tuple[str, type[Warning]]] | None] = ContextVar("collected_warnings", default=None)


@contextmanager
def each_warning_once() -> Iterator[None]:
    """Within the block, give only the first of several warnings that are equal except for their numbers."""
    before = _given.set(set())
    try:
        yield
    finally:
        _given.reset(before)


@contextmanager
def no_warnings() -> Iterator[None]:
    """Suppress warnings of warpdyn within the `with` block."""
    before = _is_silent.set(True)
    try:
        yield
    finally:
        _is_silent.reset(before)


@contextmanager
def collected_warnings() -> Iterator[list[tuple[str, type[Warning]]]]:
    """Within the block, collect the warnings of this thread as a list of (message, category) without showing them."""
    found: list[tuple[str, type[Warning]]] = []
    before = _collected.set(found)
    try:
        yield found
    finally:
        _collected.reset(before)


def warn_caller(message: str, category: type[Warning] = UserWarning) -> None:
    """Give a warning that Python shows with the line of the user's code that called warpdyn."""
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


def counted(names: Collection[object], most: int = 3) -> str:
    """Return the number of names, followed by the first `most` names, as text such as "5 (a, b, c, ...)"."""
    shown = ", ".join(str(name) for name in [*names][:most])
    return f"{len(names):,} ({shown}{', ...' if len(names) > most else ''})"


def amount_of(count: int, noun: str, nouns: str = "") -> str:
    """Return a count with its noun, such as "1 storey" or "1,200 storeys"; `nouns`: plural (default: `noun` + "s")."""
    return f"{count:,} {noun if count == 1 else nouns or noun + 's'}"


def warn_of_all(function: str, sentences: Sequence[str]) -> None:
    """Give one warning that lists the sentences after the name of the function; without sentences, give no warning."""
    if sentences:
        warn_caller("\n- ".join([f"{function}:", *sentences]) if len(sentences) > 1 else f"{function}: {sentences[0]}")


def say(message: str) -> None:
    """Report a message on progress to the logger "warpdyn" at level INFO and, on a terminal, above the progress bar."""
    LOGGER.info(message)
    if sys.stderr.isatty() and not LOGGER.isEnabledFor(logging.INFO):
        tqdm.write(message, file=sys.stderr)


def tell(message: str) -> None:
    """Report a fact that needs no action of the user: to the logger "warpdyn" at level WARNING (default: stderr)."""
    LOGGER.warning(message)
