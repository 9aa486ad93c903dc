"""`LiveDisplay`: a web page on this computer that shows a live ensemble while its motion arrives."""

from __future__ import annotations

import atexit
import json
import threading
import time
from types import TracebackType
from typing import Self

import xarray as xr

from warpdyn.campaigns.live.live import Live
from warpdyn.foundations.core.checks import check_kind, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.interfaces.live_display.frames import Frames
from warpdyn.interfaces.live_display.server import PageServer

PERIOD = 0.1  # time between two frames [s]
MOST_LOAD = 0.2  # largest share of the time in which the display computes
SECONDS_OF_A_CHECK = 0.5  # time between two checks whether the motion is finished [s]


@with_suggestions
class LiveDisplay:
    """A web page on this computer that shows a live ensemble while its motion arrives, up to ten times per second.

    The page shows the motion, the shares of the damage states over time, the peak storey drift ratios over height
    (median, 5 % and 95 % of the ensemble), and the hysteresis loop of one sample. `Live.push` never waits for it:
    another thread draws the newest answer, in at most 20 % of the time, and leaves out the answers between. Only
    browsers of this computer that know the address `url`, which contains a random token, can open the page, until the
    `with` block ends or `close` is called.

    Args:
        live: The live ensemble. Its scene records drifts. With `keep_samples=False`, its `quantiles` must contain 0.05,
            0.5 and 0.95.
        sample: Index of the sample whose hysteresis loop is shown; it is integrated once more. None: no loop.
        storey: Storey of the loop, counted from 1; in a LumpedStructure, name or number of a spring.
        port: Port of the page; 0: a free port, which the attribute `url` contains.

    Attributes:
        url: Address of the page.

    Raises:
        ValueError: If the scene does not record drifts, the ensemble does not have the sample or storey, its motion is
            finished, its answers contain neither the samples nor the quantiles 0.05, 0.5 and 0.95, or the port is not
            free.
        TypeError: If `live` is not a Live.

    Example:
        >>> live = wd.Live(wd.Scene(building, motions[0], scatter), structures=3, limits={"slight": 0.005})
        >>> with wd.LiveDisplay(live, storey=1) as display:
        ...     print("open", display.url.rsplit(":", 1)[0], "in a browser")
        ...     for answer in live.follow(wd.packets.from_motion(motions[0], 50)):
        ...         pass
        open http://127.0.0.1 in a browser
    """

    def __init__(self, live: Live, *, sample: int | None = 0, storey: int | str = 1, port: int = 0) -> None:
        check_kind("LiveDisplay", "a Live", live, Live)
        if live.is_finished:
            raise ValueError("LiveDisplay: the motion of this Live is finished: make the display before finish()")
        whole_number("port", port, 0, 65535)
        self.live = live
        self._frames = Frames(live, sample, storey)
        self._answer: xr.Dataset | None = None
        self._error: Exception | None = None
        self._arrived, self._closing = threading.Event(), threading.Event()
        if len(live.record):
            self._take(live.answer())
        first = self._frame("waiting")
        self._server = PageServer(port)  # after everything that may raise an error, which would leave it open
        self.url = self._server.url
        self._server.publish(first)
        self._observer = self._take
        live.observers.append(self._observer)
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()
        atexit.register(self.close)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"LiveDisplay({self.url!r}{', closed' if self._closing.is_set() else ''})"

    def close(self) -> None:
        """Show the last answer, and close the page; browsers that show it keep the last frame.

        Warns if the display has failed; the live ensemble continues without it.
        """
        if self._closing.is_set():
            return
        atexit.unregister(self.close)
        self.live.observers.remove(self._observer)
        self._closing.set()
        self._arrived.set()
        self._thread.join()
        self._server.close()
        if self._error is not None:
            warn_caller(
                f"the live display has failed ({type(self._error).__name__}: {self._error}); the live ensemble is not "
                "affected. This is a bug in warpdyn: please report it"
            )

    def _take(self, answer: xr.Dataset) -> None:
        """Keep an answer for the next frame, in place of an earlier one."""
        self._frames.note(answer)
        self._answer = answer
        self._arrived.set()

    def _work(self) -> None:
        """Publish a frame of the newest answer, again and again, until the display closes."""
        try:
            is_finished = False
            while not self._closing.is_set():
                has_answer = self._arrived.wait(SECONDS_OF_A_CHECK)
                if not has_answer and self.live.is_finished == is_finished:
                    continue
                self._arrived.clear()
                is_finished = self.live.is_finished
                began = time.perf_counter()
                self._server.publish(self._frame("finished" if is_finished else "running"))
                taken = time.perf_counter() - began
                self._closing.wait(max(PERIOD, taken / MOST_LOAD) - taken)
            self._server.publish(self._frame("closed"))
        except Exception as error:
            self._error = error
            self._server.publish(json.dumps({"state": "failed"}))

    def _frame(self, state: str) -> str:
        """Return the frame of the newest answer, a JSON text."""
        return json.dumps(self._frames.of(self._answer) | {"state": state}, allow_nan=False)
