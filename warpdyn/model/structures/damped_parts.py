"""Checks of the arguments `damping_modes` and `damped_storeys`."""

from __future__ import annotations

from collections.abc import Sequence

from warpdyn.foundations.core.checks import whole_number


def checked_storeys(given: tuple[int, int], storeys: int) -> tuple[int, int]:
    """Return the first and last damped storey."""
    if not isinstance(given, Sequence) or len(given) != 2:
        raise ValueError(f"damped_storeys must be the first and the last storey, such as (2, 6), got {given!r}")
    first, last = (whole_number(f"damped_storeys[{i}]", storey, 1) for i, storey in enumerate(given))
    if not first <= last <= storeys:
        raise ValueError(f"damped_storeys must be within 1 to {storeys}, first to last, got {given!r}")
    return first, last


def checked_modes(given: tuple[int, int] | None, storeys: int) -> tuple[int, int]:
    """Return the two modes of Rayleigh damping; for one storey its only mode twice."""
    if given is None:
        return 1, min(2, storeys)
    if not isinstance(given, Sequence) or len(given) != 2:
        raise ValueError(f"damping_modes must be two modes, such as (1, 3), got {given!r}")
    first, second = (whole_number(f"damping_modes[{i}]", mode, 1) for i, mode in enumerate(given))
    if max(first, second) > storeys or (first >= second and storeys > 1):
        raise ValueError(f"damping_modes must be two different modes from 1 to {storeys}, got {given!r}")
    return first, second
