"""Storey laws as scalar device functions, one row each in SPRINGS.

A law sees the storey drift [m], its own memory and its coefficients, both as short vectors, and returns a force [N].
The coefficients are prepared once per structure (each law's `parameters.py`), so that no division stands in the time
loop. The rows are those of the folders' `device_functions.py`; a folder's are imported when one of them is asked for,
as Warp reads each function's text, a third of a second for all.

`spring_row` also makes rows of several: "bouc_wen_1+gap" is of storeys that have both, "bilinear|bouc_wen_1+gap" of
storeys that have the first or the second, and the third besides.
"""

from __future__ import annotations

import functools
import importlib
from importlib.util import find_spec
from typing import TYPE_CHECKING

from warpdyn.engine import laws

if TYPE_CHECKING:
    from warpdyn.engine.laws.spring import Spring

    SPRINGS: dict[str, Spring]  # rows of laws
    DEVICE_SPRINGS: dict[str, Spring]  # rows of devices, which stand beside a storey's law


_FOUND: dict[str, dict[str, Spring]] = {"SPRINGS": {}, "DEVICE_SPRINGS": {}}  # rows of the folders imported so far


@functools.cache
def _find_rows(folder: str) -> dict[str, dict[str, Spring]]:
    """Add the rows that a folder's device functions give to those found, and return them by table."""
    name = f"{laws.__name__}.{folder}.device_functions"
    if find_spec(name) is None:  # isolators have those of bilinear storeys
        return {}
    module = importlib.import_module(name)
    own = {table: getattr(module, table, {}) for table in _FOUND}
    for table, rows in own.items():
        for row, spring in rows.items():
            _check_coefficients(row, spring)
        _FOUND[table] |= rows
    return own


@functools.cache
def _find_all_rows() -> None:
    """Add the rows of all folders, in the order of the folders, whichever of them have been asked for before."""
    for own in [_find_rows(folder) for folder in laws.law_folders()]:
        for table, rows in own.items():
            for row in rows:
                _FOUND[table][row] = _FOUND[table].pop(row)


def __getattr__(name: str) -> dict[str, Spring]:
    if name in _FOUND:
        _find_all_rows()
        return _FOUND[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


@functools.cache
def spring_row(name: str) -> Spring:
    """Return the row of a name, made of several where it names several: the same name gives the same row."""
    one, _, other = name.rpartition("+")
    if one:
        from warpdyn.engine.laws.combined_springs import side_by_side

        return side_by_side(one, spring_row(one), other, spring_row(other))
    one, _, other = name.partition("|")
    if other:
        from warpdyn.engine.laws.combined_springs import one_or_other

        return one_or_other(one, spring_row(one), other, spring_row(other))
    springs, of_devices = _FOUND.values()
    if name not in springs and name not in of_devices:
        for element in (laws.LAWS | laws.DEVICES).values():  # a row may be of laws in several folders
            if name in element.rows:
                _find_rows(element.__module__.split(".")[-2])
    return (springs | of_devices)[name]


def _check_coefficients(name: str, row: Spring) -> None:
    """Raise a TypeError if a row reads another number of coefficients than its laws name."""
    for element in (laws.LAWS | laws.DEVICES).values():
        named = element.rows.get(name)
        if named is not None and len(named) != row.coefficients:
            raise TypeError(f"row {name!r} reads {row.coefficients} coefficients; {element.name!r} names {len(named)}")
