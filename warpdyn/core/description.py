"""Scenes, structures and motions as JSON, as datasets hold it."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import Any

import numpy as np

LONGEST_ARRAY = 1024  # values; of longer arrays the shape alone is written


def to_json(value: object) -> str:
    """Return a value as JSON: what has a `description()` by that, data classes by their fields, long arrays by size."""
    return json.dumps(plain(value), separators=(",", ":"))


def plain(value: Any) -> Any:
    """Return a value as JSON can hold it, recursively."""
    if hasattr(value, "description"):
        return plain(value.description())
    if isinstance(value, np.ndarray):
        if value.size > LONGEST_ARRAY:
            return f"array of shape {value.shape}"
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
        return {"type": type(value).__name__, **fields}
    return value
