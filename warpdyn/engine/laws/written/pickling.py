"""Pickle the classes of users' laws, so that the process that defined a class does not overwrite it.

cloudpickle pickles a class of a script or notebook with all its attributes. A process that loads such a pickle sets
these attributes, even on a class that it has defined itself: copies would replace its functions.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from typing import Any, TypeVar, cast
from uuid import uuid4
from weakref import WeakKeyDictionary, WeakValueDictionary

Kind = TypeVar("Kind", bound=type[Any])
DEFINED_HERE: WeakValueDictionary[str, type] = WeakValueDictionary()
IDENTITIES: WeakKeyDictionary[type, str] = WeakKeyDictionary()  # includes classes from other processes


@dataclass(frozen=True)
class SentClass:
    """A pickled class of a user's storey law, damper or stop.

    Args:
        identity: Text that no other class has.
        data: The pickled class.
    """

    identity: str
    data: bytes


def sent(cls: Kind) -> Kind | SentClass:
    """Return an object to pickle instead of the class of a storey law, damper or stop.

    A class of warpdyn is returned unchanged, because it is pickled by its name.
    """
    import cloudpickle

    if cls.__module__.startswith("warpdyn."):
        return cls
    if cls not in IDENTITIES:
        IDENTITIES[cls] = identity = uuid4().hex
        DEFINED_HERE[identity] = cls
    return SentClass(IDENTITIES[cls], cloudpickle.dumps(cls))


def received(kind: Kind | SentClass) -> Kind:
    """Return the class for a result of `sent`.

    In the process that defined the class, the original class is returned; in other processes, a copy from the pickle.
    """
    if not isinstance(kind, SentClass):
        return kind
    if (here := DEFINED_HERE.get(kind.identity)) is not None:
        return cast(Kind, here)
    found: Kind = pickle.loads(kind.data)
    IDENTITIES[found] = kind.identity
    return found


def received_element(kind: type[Any] | SentClass, values: dict[str, Any]) -> Any:
    """Return a law, damper or stop with these parameter values; `kind` is its class, as `sent` returned it."""
    return received(kind)(**values)
