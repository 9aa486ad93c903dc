"""Writer of the measured stability limits, as a table for the pages on methods."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import xarray as xr


def write(result: xr.Dataset, damping_ratios: Sequence[float], path: Path) -> None:
    """Write the measured stability limits: one row per method that has a limit, one column per damping ratio.

    Args:
        result: Dataset of `build_dataset`.
        damping_ratios: Damping ratios of the columns [1]; they must be among the measured ones.
        path: Path of the CSV file that is written.
    """
    device = result.attrs["device"]
    lines = [
        f"# warpdyn {version('warpdyn')}, {device}, {datetime.date.today():%Y-%m-%d}",
        "# Largest w h without growth by damping ratio, measured from the kernels in float64.",
        "# Written by studies/stability.py.",
        ",".join(["method", *(f"{ratio:g}" for ratio in damping_ratios)]),
    ]
    for name in result["limited_method"].values:
        limits = result["measured_limit"].sel(limited_method=name)
        values = (float(limits.sel(limit_damping_ratio=ratio, method="nearest")) for ratio in damping_ratios)
        lines.append(",".join([str(name), *(f"{value:.6f}" for value in values)]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
