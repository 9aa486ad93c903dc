"""Ctrl-C and SIGTERM take effect only between pieces of work.

Python raises KeyboardInterrupt between any two instructions. If this is between the call that acquires a lock and the
`with` statement that releases it, the lock is never released, and cleaning up waits for it forever (in most trials with
xarray's file manager). Within `interruptible`, a signal is recorded instead; `stop_if_asked` then calls the signal's
previous handler.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)  # SIGINT: Ctrl-C; SIGTERM: sent by Slurm and other schedulers

_asked: list[int] = []  # recorded signals whose handlers have not been called yet
_handlers: dict[int, object] = {}  # handlers that `_note` has replaced
_is_noting = False  # whether `_note` records signals; otherwise it calls the replaced handler at once


@contextmanager
def interruptible() -> Iterator[None]:
    """Delay Ctrl-C and SIGTERM within the block until a call of `stop_if_asked` or the end of the block.

    After SIGTERM the process does not end immediately: warpdyn cleans up first, and the exit status is 143. Signals
    that the user's program ignores stay ignored, and signal handlers of the user's program are called. The block has no
    effect in threads other than the main thread, because Python never interrupts those threads.
    """
    global _is_noting
    if threading.current_thread() is not threading.main_thread() or _is_noting:
        yield
        return
    # A signal may arrive and raise an error between any two of the following statements. Some handlers are then not
    # restored here: until the end of the next `interruptible` restores them, `_note` calls them.
    try:
        for number in SIGNALS:
            handler = signal.getsignal(number)
            if handler is _note:
                continue
            _handlers.pop(number, None)
            # None: a handler that was not set by Python, so that Python could not restore it.
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
    """Handle Ctrl-C and SIGTERM signals that were recorded since the last call.

    Functions that run for a long time call this function about every 0.1 s.

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
    """Handle every recorded signal once, also if the handler of another signal raises; the last error is raised."""
    if _asked:
        number = _asked.pop(0)
        while number in _asked:
            _asked.remove(number)
        try:
            _act(number, _handlers.get(number, signal.SIG_DFL))
        finally:
            _act_on_asked()


def _act(number: int, handler: object) -> None:
    """Call the handler that a signal had before `interruptible`; without a handler, raise the error of the default."""
    if callable(handler):
        handler(number, None)
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        raise SystemExit(128 + number)
