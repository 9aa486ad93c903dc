"""Values over time for a display, thinned so that their number stays small, and numbers for JSON."""

from __future__ import annotations

import numpy as np

MOST_TIMES = 600  # times of a series that are shown; about one per pixel
DIGITS = 5  # significant digits of the largest value of an array; 4 of them are certain


class Series:
    """Values over time; if there are too many, every second time is left out, except the last one.

    Attributes:
        times: Times of the values [s].
        values: The values, one array for each time.
    """

    def __init__(self) -> None:
        self.times: list[float] = []
        self.values: list[np.ndarray] = []
        self._apart = 0.0  # least time between two values that are kept [s]

    def append(self, time: float, values: np.ndarray) -> None:
        """Append the values at a time, which replace the last ones if these are too near to those before them."""
        if len(self.times) > 1 and self.times[-1] - self.times[-2] < self._apart:
            self.times.pop()
            self.values.pop()
        self.times.append(time)
        self.values.append(values)
        if len(self.times) > 2 * MOST_TIMES:
            self.times, self.values = self.times[::2], self.values[::2]
            self._apart = (self.times[-1] - self.times[0]) / MOST_TIMES


def envelope(values: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    """Return the number of samples in an interval of a time series, and the least and greatest value of each interval.

    Args:
        values: Samples of the time series, shape [time].
    """
    width = 2 ** max(0, int(np.ceil(np.log2(max(1, len(values)) / MOST_TIMES))))
    starts = np.arange(0, len(values), width)
    if not starts.size:
        return width, values, values
    return width, np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)


def numbers(values: np.ndarray) -> list:
    """Return an array as lists of numbers with at most DIGITS significant digits; None for NaN and infinity."""
    values = np.asarray(values, dtype=np.float64)
    finite = np.isfinite(values)
    largest = np.abs(values[finite]).max(initial=0.0)
    places = DIGITS - int(np.ceil(np.log10(largest))) if largest > 0 else 0
    found = np.round(values, min(max(places, 0), 12))
    boxed = np.array(found, dtype=object)
    boxed[~finite] = None
    return boxed.tolist()
