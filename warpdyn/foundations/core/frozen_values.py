"""Read-only mappings and arrays that stay read-only when an object is copied or pickled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

import numpy as np

Key = TypeVar("Key")
Value = TypeVar("Value")


class FrozenMapping(Mapping[Key, Value]):
    """A read-only copy of a mapping; `types.MappingProxyType` can neither be pickled nor deep-copied.

    Args:
        values: The mapping; arrays among its values become read-only.
    """

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[Key, Value]) -> None:
        self._values = dict(values)
        freeze_arrays(self._values)

    def __getitem__(self, key: Key) -> Value:
        return self._values[key]

    def __iter__(self) -> Iterator[Key]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __or__(self, other: Mapping[Any, Any]) -> dict[Any, Any]:
        return {**self, **other}

    def __ror__(self, other: Mapping[Any, Any]) -> dict[Any, Any]:
        return {**other, **self}

    def __reduce__(self) -> tuple[Any, ...]:
        return FrozenMapping, (self._values,)

    def __repr__(self) -> str:
        return repr(self._values)


class FrozenArrays:
    """Base class of objects whose arrays stay read-only in copies and pickles, where NumPy makes arrays writeable."""

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        vars(self).update(state)
        freeze_arrays(vars(self))


def freeze_arrays(values: Mapping[Any, Any]) -> None:
    """Make the arrays among the values of a mapping read-only."""
    for value in values.values():
        if isinstance(value, np.ndarray):
            value.flags.writeable = False
