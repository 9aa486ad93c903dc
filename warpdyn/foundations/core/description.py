"""Scenes, structures and motions as JSON (for datasets) and as HTML tables (for notebooks)."""

from __future__ import annotations

import dataclasses
import hashlib
import html
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, cached_property
from typing import Any

import numpy as np

NAMED_BY_SHAPE = "array of shape "  # text that replaces an array longer than LONGEST_ARRAY
LONGEST_ARRAY = 1024  # values; JSON contains only the shape of longer arrays
SCALARS = (bool, int, float, str)
MOST_CELLS = 12  # values of a row that a table shows


def to_json(value: object) -> str:
    """Return a value as JSON text: the result of its method `description`, or the fields of a data class."""
    return json.dumps(plain(value), separators=(",", ":"))


def plain(value: Any) -> Any:
    """Return a value (an object, array, mapping or list) converted to dictionaries, lists, text and numbers, for JSON.

    An object becomes the result of its method `description` or the dictionary of its fields.
    """
    if hasattr(value, "description"):
        return plain(value.description())
    if isinstance(value, np.ndarray):
        if value.size > LONGEST_ARRAY:
            return f"{NAMED_BY_SHAPE}{value.shape}"
        # JSON has no NaN. An array contains NaN in storeys whose law does not have the parameter.
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
    """Return the name of the class of a value, preceded by the name of the module unless the class is of warpdyn."""
    kind = type(value)
    return kind.__name__ if kind.__module__.startswith("warpdyn.") else f"{kind.__module__}.{kind.__qualname__}"


def fingerprint(*values: object) -> str:
    """Return a hash of values (SHA-256 as hexadecimal text), including attributes of objects and numbers of arrays.

    Equal numbers that are not in arrays have the same hash, whether they are integers or floats, of Python or NumPy.
    """
    digest, texts = hashlib.sha256(), list[str]()
    _feed(digest, texts, values)
    digest.update("".join(texts).encode())
    return digest.hexdigest()


def _feed(digest: hashlib._Hash, texts: list[str], value: Any) -> None:
    """Add a value to a hash, with its class and length; elements and attributes of the value are added recursively.

    Args:
        digest: The hash.
        texts: Texts that are not yet in the hash. They are added before the numbers of the next array.
        value: The value.
    """
    kind = type(value)
    if kind is str:  # first, because most values are texts, tuples and lists; exact types are found fastest
        text = repr(value)
        texts.append(f"str:{len(text)}:{text}")
        return
    if kind is dict:
        value, kind = value.items(), list
    if kind is tuple or kind is list:
        texts.append(f"[{len(value)}")
        for item in value:
            _feed(digest, texts, item)
        return
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, SCALARS):
        if isinstance(value, float) and value.is_integer():
            value = int(value)
        text = repr(value)
        name = "number" if isinstance(value, int | float) and not isinstance(value, bool) else type(value).__name__
        texts.append(f"{name}:{len(text)}:{text}")
        return
    if isinstance(value, np.ndarray) and value.dtype.kind != "O":
        array = np.ascontiguousarray(value)
        texts.append(f"{array.dtype.str}{array.shape}")
        digest.update("".join(texts).encode())
        texts.clear()
        digest.update(array.reshape(-1).view(np.uint8).data)  # without a copy, which may take 100 MB
        return
    if isinstance(value, Mapping):
        value = list(value.items())
    if isinstance(value, list | tuple | np.ndarray):
        texts.append(f"[{len(value)}")
        for item in value:
            _feed(digest, texts, item)
        return
    if callable(value) and hasattr(value, "__qualname__"):
        written = getattr(value, "written", "")  # the text of a user's storey law
        texts.append(f"{value.__module__}.{value.__qualname__}{written};")
        return
    value = getattr(value, "read_from_json", value)  # equal after it was written to JSON and read again
    kind = type(value)
    texts.append(f"<{kind.__module__}.{kind.__qualname__}")
    if hasattr(value, "own_fingerprint"):  # an immutable object that keeps its hash
        texts.append(value.own_fingerprint)
        return
    if dataclasses.is_dataclass(value):
        held = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    elif hasattr(value, "__dict__"):
        computed = _cached_properties(kind)  # type: ignore[arg-type] # classes are hashable
        held = {name: item for name, item in vars(value).items() if name not in computed}
    else:
        raise TypeError(
            f"a {kind.__name__} has no fingerprint, so a run with it cannot be identified: "
            f"{value!r}. Give a dataclass or an object with attributes"
        )
    _feed(digest, texts, sorted(held.items()))


@cache
def _cached_properties(kind: type) -> set[str]:
    """Return the names of the cached properties of a class, which are not part of the value of an object."""
    return {name for each in kind.__mro__ for name, of in vars(each).items() if isinstance(of, cached_property)}


class Text(str):
    """A string that is displayed with its line breaks in notebooks and at the Python prompt."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return f"<pre>{html.escape(str(self))}</pre>"


def html_table(caption: str, rows: Iterable[Sequence[object]], heads: Sequence[str] = ()) -> str:
    """Return a table as HTML text, which a notebook displays if a method `_repr_html_` returns it.

    Args:
        caption: Title of the table.
        rows: Rows of the table; the first cell of a row is its label.
        heads: Labels of the columns.
    """
    left = ' style="text-align:left"'
    # Screen readers announce headers with their column or row; an empty header would have no name.
    head = "".join(f'<th scope="col"{left}>{html.escape(text)}</th>' if text else f"<td{left}></td>" for text in heads)
    body = "".join(
        f'<tr><th scope="row"{left}>{_cell(first)}</th>'
        + "".join(f"<td{left}>{_cell(each)}</td>" for each in rest)
        + "</tr>"
        for first, *rest in rows
    )
    above = f"<thead><tr>{head}</tr></thead>" if heads else ""
    title = f'<caption style="text-align:left"><b>{html.escape(caption)}</b></caption>'
    return f"<table>{title}{above}<tbody>{body}</tbody></table>"


def _cell(value: object) -> str:
    return html.escape(number_text(value))


def number_text(value: object) -> str:
    """Return a value as short text for a table cell.

    Numbers have six digits, None becomes "", and a row of equal values is shortened to one value and their number.
    """
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
