"""Figure of the study metropolis: a map of expected losses, and the losses of the city by event."""

from __future__ import annotations

import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

import warpdyn as wd
from parts.metropolis.region import FAULT, MAGNITUDE

CELL = 2.0  # side length of the cells of the map [km]


def draw(results: pd.DataFrame, losses: xr.Dataset) -> Figure:
    """Return a figure with a map of the loss ratios, and with the losses of the city by event."""
    figure = Figure(figsize=(10.6, 5.8), layout="constrained")
    area, curve = figure.subplots(1, 2, width_ratios=(1.0, 1.0))
    wd.plots.damage_map(results, cell=CELL, ax=area)
    area.plot(*FAULT.T, color="black", linewidth=1.6)
    beside = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    area.annotate("Hayward fault", FAULT[0], (-70, -38), textcoords="offset points", fontsize=9, bbox=beside)
    area.set_title(f"Magnitude {MAGNITUDE:g}: {area.get_title()}", fontsize=10)
    wd.plots.loss_exceedance(losses, ax=curve)
    curve.set(xlabel="Loss of the city [USD]")
    curve.set_title(f"{losses.sizes['event']} fields of motions, one record pair each", fontsize=10)
    return figure
