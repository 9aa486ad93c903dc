"""Scenes, structures and motions as JSON, as datasets hold it, and as tables, as notebooks show them."""

from __future__ import annotations

import dataclasses
import hashlib
import html
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

NAMED_BY_SHAPE = "array of shape "
LONGEST_ARRAY = 1024  # values; of longer arrays the shape alone is written
MOST_CELLS = 12  # of a row of values in a table


def to_json(value: object) -> str:
    """Return a value as JSON: what has a `description()` by that, data classes by their fields, long arrays by size."""
    return json.dumps(plain(value), separators=(",", ":"))


def plain(value: Any) -> Any:
    """Return a value as JSON can hold it, recursively."""
    if hasattr(value, "description"):
        return plain(value.description())
    if isinstance(value, np.ndarray):
        if value.size > LONGEST_ARRAY:
            return f"{NAMED_BY_SHAPE}{value.shape}"
        # JSON has no NaN, which stands where a storey's law does not take a parameter.
        return np.where(np.isnan(value), np.array(None), value).tolist() if value.dtype.kind == "f" else value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {key if isinstance(key, str) else " ".join(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if dataclasses.is_dataclass(value):
        fields = {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
        return {"type": _name_of_class(value), **fields}
    return value if value is None or isinstance(value, bool | int | float | str) else {"type": _name_of_class(value)}


def _name_of_class(value: object) -> str:
    """Return the name of a value's class, with its module where it is not warpdyn's own."""
    kind = type(value)
    return kind.__name__ if kind.__module__.startswith("warpdyn.") else f"{kind.__module__}.{kind.__qualname__}"


def fingerprint(*values: object) -> str:
    """Return a digest of values with all that they hold, every number of every array: equal ones have the same.

    A number is the same as NumPy's and as Python's, as an integer and as a float.
    """
    digest = hashlib.sha256()
    _feed(digest, values)
    return digest.hexdigest()


def _feed(digest: hashlib._Hash, value: Any) -> None:
    """Feed a value to a digest, recursively, each part with its kind and its length."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, np.ndarray) and value.dtype.kind != "O":
        array = np.ascontiguousarray(value)
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(array.reshape(-1).view(np.uint8).data)  # without a copy, of which some take 100 MB
        return
    if isinstance(value, Mapping):
        value = list(value.items())
    if isinstance(value, list | tuple | np.ndarray):
        digest.update(f"[{len(value)}".encode())
        for item in value:
            _feed(digest, item)
        return
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    text = repr(value) if value is None or isinstance(value, bool | int | float | str) else ""
    if text:
        name = "number" if isinstance(value, int | float) and not isinstance(value, bool) else type(value).__name__
        digest.update(f"{name}:{len(text)}:{text}".encode())
        return
    if callable(value) and hasattr(value, "__qualname__"):
        written = getattr(value, "written", "")  # the text of a user's storey law
        digest.update(f"{value.__module__}.{value.__qualname__}{written};".encode())
        return
    kind = type(value)
    digest.update(f"<{kind.__module__}.{kind.__qualname__}".encode())
    if dataclasses.is_dataclass(value):
        held = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    elif hasattr(value, "__dict__"):
        # What a class computes later and keeps does not count.
        kept = {name for each in kind.__mro__ for name, of in vars(each).items() if isinstance(of, cached_property)}
        held = {name: item for name, item in vars(value).items() if name not in kept}
    else:
        raise TypeError(f"a {kind.__name__} has no fingerprint: {value!r}")
    _feed(digest, sorted(held.items()))


class Text(str):
    """Text of several lines, which a notebook and a prompt show line by line; elsewhere it is a string."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"


def html_table(caption: str, rows: Iterable[Sequence[object]], heads: Sequence[str] = ()) -> str:
    """Return a table as HTML, as notebooks take it of `_repr_html_`.

    Args:
        caption: What it is of.
        rows: Its rows; the first cell of each is what it is of.
        heads: What stands above its columns.
    """
    left = ' style="text-align:left"'
    head = "".join(f"<th{left}>{html.escape(text)}</th>" for text in heads)
    body = "".join(
        f"<tr><th{left}>{_cell(first)}</th>" + "".join(f"<td{left}>{_cell(each)}</td>" for each in rest) + "</tr>"
        for first, *rest in rows
    )
    above = f"<thead><tr>{head}</tr></thead>" if heads else ""
    title = f'<caption style="text-align:left"><b>{html.escape(caption)}</b></caption>'
    return f"<table>{title}{above}<tbody>{body}</tbody></table>"


def _cell(value: object) -> str:
    """Return what stands in a cell: numbers with six digits, rows of numbers with commas, none as nothing."""
    return html.escape(number_text(value))


def number_text(value: object) -> str:
    """Return a value in a few letters: numbers with six digits, equal ones of a row once."""
    if value is None:
        return ""
    if isinstance(value, bool | str):
        return str(value)
    if isinstance(value, np.ndarray) and not value.ndim:
        value = value.item()
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Iterable):
        cells = [number_text(each) for each in value]
        if len(cells) > 1 and len(set(cells)) == 1:
            return f"{cells[0]} (all {len(cells)})"
        return ", ".join(cells if len(cells) <= MOST_CELLS else [*cells[: MOST_CELLS - 1], "...", cells[-1]])
    return str(value)
