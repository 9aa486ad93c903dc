"""Checks of arguments; the message of an error names the value, its position, and the allowed values."""

from __future__ import annotations

import os
import reprlib
from collections.abc import Collection
from numbers import Integral, Real
from types import UnionType
from typing import Any, cast

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, DTypeLike

from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.foundations.core.units import without_units

# Largest number of replicates of a bootstrap or draws of a posterior; their quantiles are then exact to 0.1 % of the
# standard deviation.
MOST_REPLICATES = 10**6
LARGEST_NUMBER = float(np.finfo(np.float64).max)
LONGEST_ROW = 2**27  # values of a range that is given as an argument; 1 GB as float64
LARGEST_WHOLE_NUMBER = 2**63 - 1  # the largest integer that a netCDF attribute can store


def check_kind(function: str, what: str, value: object, kind: type, advice: str = "", *, argument: str = "") -> None:
    """Raise a TypeError if an argument of a function does not have the required class.

    Args:
        function: Name of the public function.
        what: The required class in words for the message, such as "a ShearBuilding".
        value: Value of the argument.
        kind: The required class.
        advice: Advice that ends the message, such as "give the result of simulate()".
        argument: Name of the argument.
    """
    if not isinstance(value, kind):
        hint = f"; {advice}" if advice else ""
        given = f"the class {value.__name__} itself" if isinstance(value, type) else type(value).__name__
        named = f" as {argument}" if argument not in ("", "dataset") else ""
        raise TypeError(f"{function}() takes {what}, got {given}{named}{hint}")


def check_dataset(function: str, dataset: Any, *names: str, advice: str, argument: str = "dataset") -> None:
    """Raise an error that ends with `advice` if an argument is not an xarray Dataset, or lacks one of `names`.

    Raises:
        TypeError: If the argument is not a Dataset.
        ValueError: If one of `names` is neither a variable nor an attribute of the dataset.
    """
    named = "" if argument == "dataset" else f" as {argument}"
    if isinstance(dataset, str | os.PathLike):
        advice = f"open the file first: xarray.open_dataset({os.fspath(dataset)!r})"
        raise TypeError(f"{function}() takes a Dataset, got the path of a file{named}; {advice}")
    check_kind(function, "a Dataset", dataset, xr.Dataset, advice, argument=argument)
    missing = [name for name in names if name not in dataset and name not in dataset.attrs]
    if missing:
        raise ValueError(f"{function}: the dataset has no {', '.join(missing)}: {advice}{named}")


def one_of(what: str, name: object, allowed: Collection[str]) -> None:
    """Raise a ValueError that lists the allowed names, if `name` is not one of them."""
    if not isinstance(name, str) or name not in allowed:
        hint = did_you_mean(name, list(allowed))
        raise ValueError(
            f"unknown {what} {shortened(name)}{hint}; allowed: {', '.join(repr(each) for each in allowed)}"
        )


def real_number(
    what: str, value: Any, *, above: float | None = None, least: float | None = None, units: str | None = None
) -> float:
    """Return a number as a float; raise a ValueError if it is not finite or is outside its bound.

    The message of the error gives the bound. The number may also be a quantity of the package pint or an array of NumPy
    or xarray without dimensions; see `without_units`.
    """
    value = without_units(what, value, units)
    is_masked = np.ma.is_masked(value)  # its item is 0
    if getattr(value, "shape", None) == () and hasattr(value, "item"):
        value = value.item()  # Python has integers larger than any float
    bound = f" above {above:g}" if above is not None else f" of at least {least:g}" if least is not None else ""
    number: Any = value  # type checkers do not know the absolute value of a Real
    good = isinstance(value, Real) and not isinstance(value, bool) and abs(number) <= LARGEST_NUMBER
    if is_masked or not good or (above is not None and not value > above) or (least is not None and not value >= least):
        raise ValueError(f"{what} must be a finite number{bound}, got {shortened(value)}")
    return float(value)


def whole_number(what: str, value: Any, least: int, most: int = LARGEST_WHOLE_NUMBER) -> int:
    """Return a whole number as an int; raise a ValueError if it is not whole, below `least` or above `most`."""
    good = isinstance(value, Integral) and not isinstance(value, bool | np.bool_)
    if not good or not least <= int(value) <= most:
        limit = ("2^63 - 1" if most == LARGEST_WHOLE_NUMBER else f"{most}") if good and value > least else None
        raise ValueError(
            f"{what} must be a whole number of at least {least}{f' and at most {limit}' if limit else ''}, "
            f"got {shortened(value)}"
        )
    return int(value)


def true_or_false(what: str, value: Any) -> bool:
    """Return a truth value as a bool; raise a TypeError for any other value, such as 1."""
    if not isinstance(value, bool | np.bool_):
        raise TypeError(f"{what} must be True or False, got {shortened(value)}")
    return bool(value)


def checked_text(what: str, value: Any) -> str:
    """Return the value of an argument as a str; raise a TypeError if it is not text."""
    if not isinstance(value, str):
        raise TypeError(f"{what} must be text, got {shortened(value)}")
    return str(value)


def is_row_of_text(values: object) -> bool:
    """Return whether a value is a list, a tuple or a one-dimensional array of strings."""
    is_row = isinstance(values, list | tuple) or (isinstance(values, np.ndarray) and values.ndim == 1)
    return is_row and all(isinstance(each, str) for each in cast("Any", values))


def shortened(value: object) -> str:
    """Return the text of a value, shortened for a message: long lists end in "...", long texts lack their middle."""
    return reprlib.repr(value)


def real_numbers(what: str, values: ArrayLike, units: str | None = None) -> np.ndarray:
    """Return the values as a new float64 array. Quantities of pint are converted to `units`; see `without_units`.

    Raises:
        ValueError: If the values contain truth values, text, dates, complex numbers, masked values or rows of different
            lengths, or are a range longer than LONGEST_ROW.
    """
    for each in values if isinstance(values, list | tuple) else (values,):
        if isinstance(each, range) and len(each) > LONGEST_ROW:
            raise ValueError(f"{what} must have at most {LONGEST_ROW} values, got {each!r}")
    values = without_units(what, values, units)
    refuse_masked(what, values)
    try:
        array = np.array(np.nan if _has(values, bool | np.bool_) else values)
    except (TypeError, ValueError):
        array = np.array(None)
    if array.dtype.kind not in "iuf" or _has(values, bool | np.bool_):
        raise ValueError(f"{what} must be numbers, in rows of equal length, got {shortened(values)}")
    return array.astype(np.float64)


def _has(values: object, kind: type | UnionType) -> bool:
    """Return whether a value is of the class `kind`, or is a list or tuple with such an element at any depth."""
    if not isinstance(values, list | tuple):
        return isinstance(values, kind)
    return any(isinstance(each, kind) or (isinstance(each, list | tuple) and _has(each, kind)) for each in values)


def finite_numbers(what: str, values: ArrayLike, units: str | None = None) -> np.ndarray:
    """Return the values as a new float64 array, as `real_numbers` does; raise a ValueError if a value is not finite."""
    array = real_numbers(what, values, units)
    bad = ~np.isfinite(array)
    if bad.any():
        place = tuple(np.argwhere(bad)[0])
        where = f"[{', '.join(map(str, place))}]" if place else ""
        raise ValueError(f"{what}{where} is {array[place]}; every value must be finite")
    return array


def refuse_masked(what: str, values: object) -> None:
    """Raise a ValueError if an array of NumPy, or an array within a list or tuple, has masked values.

    `np.asarray` would return the numbers behind the mask as if they were valid.

    Args:
        what: Name of the argument.
        values: Value of the argument.
    """
    if isinstance(values, list | tuple):
        for i, row in enumerate(values):
            if isinstance(row, np.ma.MaskedArray | list | tuple):
                refuse_masked(f"{what}[{i}]", row)
    elif np.ma.is_masked(values):
        mask = np.ma.getmaskarray(np.ma.asarray(values))
        place = "".join(f"[{i}]" for i in np.argwhere(mask)[0])
        raise ValueError(
            f"{what}{place} is masked, so its value is unknown ({int(mask.sum())} of {mask.size} values are masked): "
            "fill the gaps, such as values.filled(0.0), or remove them"
        )


def unmasked(what: str, values: ArrayLike, dtype: DTypeLike | None = None) -> np.ndarray:
    """Return the values as an array, as `np.asarray` does; raise a ValueError if the array has masked values."""
    values = without_units(what, values, None)
    refuse_masked(what, values)
    return np.asarray(values, dtype=dtype)


class TooLargeError(ValueError, MemoryError):
    """Error: an argument needs more memory than is free, or more than the user allows."""


def free_memory() -> int:
    """Return the free memory of this machine [bytes], including file cache that the system can release."""
    try:
        with open("/proc/meminfo") as lines:
            return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration):  # systems without /proc/meminfo: assume 1 GiB
        return 2**30


def check_memory(what: str, needed: float, remedy: str, *, limit: int | None = None) -> None:
    """Raise a TooLargeError if the arrays of an argument do not fit in the free memory.

    Args:
        what: The argument and its value, for the message.
        needed: Size of the arrays [bytes].
        remedy: Advice for the user, which ends the message.
        limit: Largest size that the user allows [bytes]; None: no limit except the free memory.
    """
    if limit is not None and needed > limit:
        raise TooLargeError(
            f"{what} needs {in_words(needed)} of memory, but memory={limit} (bytes) allows less: {remedy}"
        )
    if needed > (free := free_memory()):
        raise TooLargeError(f"{what} needs {in_words(needed)} of memory, but only {in_words(free)} are free: {remedy}")


def in_words(size: float) -> str:
    """Return a number of bytes as text with a unit, such as "1.5 GB"."""
    for unit, value in (("GB", 1e9), ("MB", 1e6)):
        if size >= value:
            return f"{size / value:.3g} {unit}"
    return f"{size:.0f} bytes"
