"""The map of expected losses, and the losses of the city by event."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from parts.metropolis.region import FAULT, MAGNITUDE


def draw(result: xr.Dataset, buildings: int) -> Figure:
    """Return the figure of what studies/metropolis.py keeps of the city."""
    figure = Figure(figsize=(11.0, 5.6), layout="constrained")
    area, curve = figure.subplots(1, 2, width_ratios=(1.25, 1.0))
    ratio = 100 * result["loss_sum_by_cell"] / result["replacement_value"] / result.sizes["event"]
    longitude, latitude = result["longitude"].values, result["latitude"].values
    shown = area.scatter(longitude, latitude, c=ratio.values, s=9, marker="s", cmap="YlOrRd", vmin=0, linewidths=0)
    area.plot(*FAULT.T, color="black", linewidth=1.6)
    beside = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    area.annotate("Hayward fault", FAULT[0], (-70, -38), textcoords="offset points", fontsize=9, bbox=beside)
    area.set_aspect(1 / np.cos(np.radians(latitude.mean())))
    area.xaxis.set_major_locator(MultipleLocator(0.4))
    area.set(xlabel="Longitude [degree]", ylabel="Latitude [degree]")
    area.set_title(f"{buildings:,} buildings, magnitude {MAGNITUDE:g}", fontsize=10)
    figure.colorbar(shown, ax=area, label="Expected loss over replacement value [%]", shrink=0.85)
    losses = np.sort(result["loss_sum_by_event"].values)[::-1] / float(result["replacement_value"].sum())
    above = np.arange(1, losses.size + 1) / losses.size
    curve.step(100 * np.append(losses, 0.0), np.append(above, 1.0), where="pre", color="#7A1C1C")
    curve.set(xlabel="Loss of the city over its value [%]", ylabel="Share of the events with a larger loss")
    curve.set(xlim=(0, None), ylim=(0, 1.02))
    curve.grid(alpha=0.3)
    curve.spines[["top", "right"]].set_visible(False)
    curve.set_title(f"{losses.size} fields of motions, one record pair each", fontsize=10)
    return figure
