"""Ctrl-C and SIGTERM take effect only between pieces of work.

Python raises KeyboardInterrupt between any two instructions, also between acquiring a lock and the `with` statement
that releases it. The lock is then never released, and cleaning up waits for it forever (in most trials with xarray's
file manager). Within `interruptible`, a signal is recorded instead; `stop_if_asked` then calls its previous handler.
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
    """Within the block, Ctrl-C and SIGTERM take effect only at calls of `stop_if_asked`, and at the end of the block.

    SIGTERM does not end the process immediately: as after Ctrl-C, warpdyn cleans up first; the exit status is 143.
    Signals that the user's program ignores stay ignored, and handlers of the user's program are called. In threads
    other than the main thread, which Python never interrupts, the block has no effect.
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
    """Handle the signals that were recorded since the last call. Long work calls this function about every 0.1 s.

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
    """Handle every recorded signal once, even if handling another one raises an error; the last error is raised."""
    if _asked:
        number = _asked.pop(0)
        while number in _asked:
            _asked.remove(number)
        try:
            _act(number, _handlers.get(number, signal.SIG_DFL))
        finally:
            _act_on_asked()


def _act(number: int, handler: object) -> None:
    """Call the replaced handler, or raise the error of the default handler."""
    if callable(handler):
        handler(number, None)
    elif number == signal.SIGINT:
        raise KeyboardInterrupt
    else:
        raise SystemExit(128 + number)
