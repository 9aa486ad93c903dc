"""One progress bar for the response histories of a run, or of several runs together."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from tqdm import tqdm

_shown: ContextVar[tqdm | None] = ContextVar("shown", default=None)


@contextmanager
def counted_histories(total: int) -> Iterator[tqdm]:
    """Show a progress bar for `total` response histories; within another call, continue the bar of that call."""
    around = _shown.get()
    if around is not None:
        yield around
        return
    with tqdm(total=total, unit="history", unit_scale=True, disable=None) as bar:
        token = _shown.set(bar)
        try:
            yield bar
        finally:
            _shown.reset(token)
