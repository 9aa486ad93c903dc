"""Checks that what counts, sizes and steps ask for fits in memory, before any of it is allocated."""

from __future__ import annotations


class TooLargeError(ValueError, MemoryError):
    """An argument asks for more memory than this machine has free."""


def free_memory() -> int:
    """Return the free memory of this machine [bytes], with what the system would give back of its file cache."""
    try:
        with open("/proc/meminfo") as lines:
            return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration):  # other systems: a modest guess
        return 2**30


def check_memory(what: str, needed: float, remedy: str, *, limit: int | None = None) -> None:
    """Raise a TooLargeError if arrays that an argument asks for do not fit in the free memory.

    Args:
        what: What needs the memory, with the argument and its value.
        needed: Bytes of these arrays.
        remedy: What to do instead.
        limit: Bytes that the user allows; None for the free memory.
    """
    if limit is not None and needed > limit:
        raise TooLargeError(f"{what} needs {in_words(needed)} of memory, and memory={limit} allows less: {remedy}")
    if needed > (free := free_memory()):
        raise TooLargeError(f"{what} needs {in_words(needed)} of memory, and {in_words(free)} are free: {remedy}")


def in_words(size: float) -> str:
    """Return a number of bytes with a unit."""
    for unit, value in (("GB", 1e9), ("MB", 1e6)):
        if size >= value:
            return f"{size / value:.3g} {unit}"
    return f"{size:.0f} bytes"
