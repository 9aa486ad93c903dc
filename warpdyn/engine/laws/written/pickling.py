"""Pickled classes of users' laws: the process that defined a class keeps it when it reads its own pickle.

cloudpickle sends a class of a script or notebook with all its attributes. A process that reads such a pickle sets them,
also on a class that it has defined itself: copies would replace its functions.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any, TypeVar, cast
from uuid import uuid4
from weakref import WeakKeyDictionary, WeakValueDictionary

Kind = TypeVar("Kind", bound=type[Any])
DEFINED_HERE: WeakValueDictionary[str, type] = WeakValueDictionary()
IDENTITIES: WeakKeyDictionary[type, str] = WeakKeyDictionary()  # also of classes from other processes


@dataclass(frozen=True)
class SentClass:
    """A class in a pickle.

    Args:
        identity: Text that no other class has.
        data: The pickled class.
    """

    identity: str
    data: bytes


def sent(cls: Kind) -> Kind | SentClass:
    """Return a class for a pickle; a class of warpdyn is returned unchanged, because it is pickled by its name."""
    import cloudpickle

    if cls.__module__.startswith("warpdyn."):
        return cls
    if cls not in IDENTITIES:
        IDENTITIES[cls] = identity = uuid4().hex
        DEFINED_HERE[identity] = cls
    return SentClass(IDENTITIES[cls], cloudpickle.dumps(cls))


def received(kind: Kind | SentClass) -> Kind:
    """Return the class for a result of `sent`: in the process that defined it this class, otherwise the pickled one."""
    if not isinstance(kind, SentClass):
        return kind
    if (here := DEFINED_HERE.get(kind.identity)) is not None:
        return cast(Kind, here)
    found: Kind = pickle.loads(kind.data)
    IDENTITIES[found] = kind.identity
    return found


def received_element(kind: type[Any] | SentClass, values: dict[str, Any]) -> Any:
    """Return a law or device with these values; `kind` is its class as `sent`."""
    return received(kind)(**values)
