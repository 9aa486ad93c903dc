"""Storey laws: one folder each, with the parameters a scene gives them and the device functions a kernel runs.

A law's folder holds `parameters.py`, which names its parameters, their bounds and the coefficients its kernels read,
and `device_functions.py`, its Warp functions. The tables LAWS and DEVICES are found: they have what the folders'
`parameters.py` say. Nothing here imports warp; `warpdyn.laws.springs` imports the device functions when asked for one.
"""

from __future__ import annotations

import importlib
import pkgutil

from warpdyn.laws.law import HARDENING_RATIO, YIELD_FORCE, Law, Parameter

FIRST = ("elastic", "bilinear", "bouc_wen")  # folders that come first in messages; the others follow by name


def law_folders() -> list[str]:
    """Return the names of the folders of laws, devices and isolators, in the order of the tables."""
    found = sorted(module.name for module in pkgutil.iter_modules(__path__) if module.ispkg)
    return [name for name in FIRST if name in found] + [name for name in found if name not in FIRST]


def _found(table: str) -> dict[str, Law]:
    found: dict[str, Law] = {}
    for folder in law_folders():
        module = importlib.import_module(f"{__name__}.{folder}.parameters")
        found |= getattr(module, table, {})
    return found


LAWS = _found("LAWS")
DEVICES = _found("DEVICES")

__all__ = ["DEVICES", "HARDENING_RATIO", "LAWS", "YIELD_FORCE", "Law", "Parameter"]
