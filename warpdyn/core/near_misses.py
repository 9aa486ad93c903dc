"""Suggest the name that was meant."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping


def did_you_mean(name: object, known: Mapping[str, str] | Iterable[str]) -> str:
    """Return " (did you mean 'yield_force'?)" for a near miss of a known name, or nothing.

    Args:
        name: What was given.
        known: Names that may be meant; of a mapping each with the name to suggest, as OpenSees' with ours.
    """
    if not isinstance(name, str):
        return ""
    known = known if isinstance(known, Mapping) else {word: word for word in known}
    by_lower = {word.lower(): suggested for word, suggested in known.items()}
    close = difflib.get_close_matches(name.lower().replace(" ", "_").replace("-", "_"), by_lower, n=1, cutoff=0.7)
    return f" (did you mean {by_lower[close[0]]!r}?)" if close else ""
