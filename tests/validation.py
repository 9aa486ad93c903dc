"""What tests measure against truths from elsewhere, for the summary of checks of the documentation.

A test that takes the fixture `measured` calls it with a claim, the truth that the claim is held to, the figure that
it measured and the bound of that figure; the call fails beyond the bound, as an assertion would. With `pytest
--validation FILE` these tests run alone and write each call as a line of JSON to a file, of which
`studies/validation.py` makes the table docs/verification/measured.csv. In other runs each call is compared with its row
there, so that claims, truths and bounds of the report are always those of the tests.
"""

from __future__ import annotations

import csv
import functools
import json
import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

KEPT = Path(__file__).parents[1] / "docs" / "verification" / "measured.csv"


def difference(found: ArrayLike, due: ArrayLike) -> float:
    """Return the largest absolute difference of arrays of one shape; NaN, which no bound admits, if any is NaN."""
    found, due = np.asarray(found, np.float64), np.asarray(due, np.float64)
    assert np.broadcast_shapes(found.shape, due.shape) == found.shape, (found.shape, due.shape)
    return float(np.max(np.abs(found - due)))


def relative_difference(found: ArrayLike, due: ArrayLike) -> float:
    """Return the largest difference over the absolute value that is due, element by element."""
    scale = np.abs(np.asarray(due, np.float64))
    return difference(np.asarray(found, np.float64) / scale, np.asarray(due, np.float64) / scale)


@functools.cache
def kept_rows() -> dict[str, dict[str, str]]:
    """Return the rows of the kept table by their claims; none where there is no table, as beside an installed wheel."""
    if not KEPT.is_file():
        return {}
    lines = [line for line in KEPT.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return {row["claim"]: row for row in csv.DictReader(lines)}


class Measured:
    """What the fixture `measured` returns: a function that holds a figure to its bound, and keeps it.

    Args:
        test: File and name of the test.
        target: File that figures are written to, if any.
        is_thorough: Whether the test is one that the report is not made of, and may claim what is not there.
    """

    def __init__(self, test: str, target: str | None, *, is_thorough: bool = False) -> None:
        self.test, self.target, self.is_thorough = test, target, is_thorough

    def __call__(self, claim: str, *, truth: str, value: float, bound: float, units: str = "1") -> None:
        """Fail unless a figure is within its bound.

        Args:
            claim: What the figure is, in words; cases of a test that have one bound may share it, and the worst counts.
            truth: What it is held to, with its source.
            value: The figure, such as a largest error; 0 or above.
            bound: What it may be at most.
            units: Units of both.
        """
        value, bound = float(value), float(bound)
        assert value <= bound, f"{claim}: {value:.3g} is above {bound:.3g} [{units}], held to: {truth}"  # NaN fails
        assert value >= 0, f"{claim}: {value:.3g} is no size of an error"
        row = {"claim": claim, "truth": truth, "value": value, "bound": bound, "units": units, "test": self.test}
        if self.target is not None:
            with os.fdopen(os.open(self.target, os.O_WRONLY | os.O_APPEND | os.O_CREAT), "a") as file:
                file.write(json.dumps(row) + "\n")  # one call of the system, also where processes write side by side
        elif kept_rows():
            kept = kept_rows().get(claim)
            if kept is None and self.is_thorough:
                return
            advice = "; run `python studies/validation.py --out docs/verification`"
            assert kept is not None, f"the summary of checks lacks {claim!r}{advice}"
            for key in ("truth", "units", "test"):
                assert kept[key] == row[key], f"{key} of {claim!r} is another in the summary of checks{advice}"
            assert abs(float(kept["bound"]) - bound) <= 1e-5 * bound, f"bound of {claim!r} is another there{advice}"
