"""Template of a dataset: variables and attributes without samples, from which datasets with samples are made."""

from __future__ import annotations

from dataclasses import dataclass

import xarray as xr


@dataclass(frozen=True)
class Template:
    """Content of a dataset of a run without samples. It is not an xarray Dataset, because making one takes 1 ms.

    Args:
        variables: Name -> variable, including the coordinates.
        coords: Names of the coordinates.
        attrs: Attributes of the dataset.
    """

    variables: dict[str, xr.Variable]
    coords: tuple[str, ...]
    attrs: dict[str, object]
