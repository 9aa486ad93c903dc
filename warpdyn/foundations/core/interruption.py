"""Ctrl-C and SIGTERM act between pieces of work, never within one.

Python raises KeyboardInterrupt between any two instructions, also between taking a lock and the `with` statement that
releases it. The lock is then never released, and the cleaning-up waits for it for ever (in most trials with xarray's
file manager). Within `interruptible` a signal is recorded instead, and `stop_if_asked` calls the previous handler.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)  # Ctrl-C; sent by Slurm and other schedulers

_asked: list[int] = []  # signals that came and have not acted yet
_handlers: dict[int, object] = {}  # handlers that `_note` has replaced
_is_noting = False  # whether `_note` records signals; otherwise it calls the replaced handler at once


@contextmanager
def interruptible() -> Iterator[None]:
    """Within the block, let Ctrl-C and SIGTERM act only at calls of `stop_if_asked`, and at the end.

    SIGTERM, which would end the process at once, ends it as Ctrl-C does, after cleaning up and with exit status 143.
    Signals that the program ignores stay ignored, and its own handlers are called. In threads other than the main
    one, which Python never interrupts, the block has no effect.
    """
    global _is_noting
    if threading.current_thread() is not threading.main_thread() or _is_noting:
        yield
        return
    # A signal may act, and raise an error, between any two of these statements, so that some handlers are not restored.
    # Then `_note` calls them, and the end of the next `interruptible` restores them.
    try:
        for number in SIGNALS:
            handler = signal.getsignal(number)
            if handler is _note:
                continue
            _handlers.pop(number, None)
            # None: a handler that was not set by Python, which could not be restored.
            if handler is not None and handler is not signal.SIG_IGN:
                _handlers[number] = handler
                signal.signal(number, _note)
        _is_noting = True
        yield
    finally:
        _is_noting = False
        try:
            for each, replaced in list(_handlers.items()):
                signal.signal(each, replaced)  # type: ignore[arg-type]
        finally:
            _act_on_asked()


def stop_if_asked() -> None:
    """Let the signals act that came since the last call; long work calls this about every 0.1 s.

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
    """Let every recorded signal act once, also if an earlier one raises; the error of the last one is raised."""
    if _asked:
        number = _asked.pop(0)
        while number in _asked:
            _asked.remove(number)
        try:
            _act(number, _handlers.get(number, signal.SIG_DFL))
        finally:
            _act_on_asked()


def _act(number: int, handler: object) -> None:
    """Do what the replaced handler would have done."""
    if callable(handler):
        handler(number, None)
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        raise SystemExit(128 + number)
