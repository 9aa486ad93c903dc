"""Ctrl-C and SIGTERM act between pieces of work, never within one.

Python raises KeyboardInterrupt between any two instructions: also after a lock was taken and before the `with`
statement knows of it. The lock then stays taken, and whoever cleans up waits for it for ever: xarray's file manager did
so in most tries. Within `interruptible` a signal is noted instead, and `stop_if_asked` hands it to the handler that
stood before.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)  # Ctrl-C; what Slurm and other schedulers send

_asked: list[int] = []  # signals that came and have not acted yet
_handlers: dict[int, object] = {}  # those that stood where `_note` stands now
_is_noting = False  # whether signals wait; where `_note` stands beyond that, they act through it


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM act at calls of `stop_if_asked` alone, and at the end.

    SIGTERM, which would end the process at once, ends it as Ctrl-C does, with everything cleaned up and exit status
    143. Signals that the program ignores stay ignored, and its own handlers are called. Threads other than the main
    one, which Python interrupts never, change nothing.
    """
    global _is_noting
    if threading.current_thread() is not threading.main_thread() or _is_noting:
        yield
        return
    # A signal may act, and raise, before it waits and after it no longer does: between any two of these statements, so
    # that some handlers are not put back. Nothing is stuck then: `_note` does what they would do, and the next end of
    # an `interruptible` puts them back.
    try:
        for number in SIGNALS:
            handler = signal.getsignal(number)
            if handler is _note:
                continue
            _handlers.pop(number, None)
            # None: a handler that is not Python's, which could not be put back.
            if handler is not None and handler is not signal.SIG_IGN:
                _handlers[number] = handler
                signal.signal(number, _note)
        _is_noting = True
        yield
    finally:
        _is_noting = False
        try:
            for each, standing in list(_handlers.items()):
                signal.signal(each, standing)  # type: ignore[arg-type]
        finally:
            _act_on_asked()


def stop_if_asked() -> None:
    """Let signals act that came since the last call; long work calls this every tenth of a second or so.

    Raises:
        KeyboardInterrupt: After Ctrl-C.
        SystemExit: After SIGTERM.
    """
    if _asked and threading.current_thread() is threading.main_thread():
        _act_on_asked()


def _note(number: int, frame: FrameType | None) -> None:
    if _is_noting:
        _asked.append(number)
    else:
        _act(number, _handlers.get(number, signal.SIG_DFL))


def _act_on_asked() -> None:
    """Let every signal that waits act once, also where one before it raises: the last one's error is raised."""
    if _asked:
        number = _asked.pop(0)
        while number in _asked:
            _asked.remove(number)
        try:
            _act(number, _handlers.get(number, signal.SIG_DFL))
        finally:
            _act_on_asked()


def _act(number: int, handler: object) -> None:
    """Do what a handler would have done, by which `interruptible` was entered."""
    if callable(handler):
        handler(number, None)
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        raise SystemExit(128 + number)
