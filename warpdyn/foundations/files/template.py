"""Template of a dataset: its labels, from which datasets of samples are made."""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr


@dataclass(frozen=True)
class Template:
    """Content of a dataset of a run without samples; it is not a dataset, because making one takes 1 ms.

    Args:
        variables: Its variables by name, including the coordinates.
        coords: Names of its coordinates.
        attrs: Its attributes.
    """

    variables: dict[str, xr.Variable]
    coords: tuple[str, ...]
    attrs: dict[str, object]
