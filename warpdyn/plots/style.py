"""Colours and layouts that figures share."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

# Okabe and Ito's colours, which are distinct for any colour vision, from the lightest damage state to the heaviest.
COLOURS = ("#0072B2", "#009E73", "#E69F00", "#D55E00", "#CC79A7", "#56B4E9", "#000000")


def new_figure(width: float = 7.0, height: float = 4.6) -> Figure:
    """Return an empty figure of this size [inch]."""
    return Figure(figsize=(width, height), layout="constrained")


def storey_panels(drift: np.ndarray, force: np.ndarray) -> Figure:
    """Draw the force [N] against the drift [m] of each storey, both of shape [step, storey], a panel each."""
    storeys = force.shape[1]
    figure = new_figure(2.2 * min(storeys, 5) + 0.6, 2.9 * -(-storeys // 5))
    grid = figure.subplots(-(-storeys // 5), min(storeys, 5), sharex=True, sharey=True, squeeze=False)
    for storey, axes in enumerate(grid.ravel()):
        if storey >= storeys:
            axes.set_axis_off()
            continue
        axes.plot(1000 * drift[:, storey], force[:, storey] / 1e6, color=COLOURS[0], lw=0.7)
        axes.set_title(f"storey {storey + 1}", fontsize=9)
        axes.grid(alpha=0.3)
    figure.supxlabel("Storey drift [mm]", fontsize=9)
    figure.supylabel("Storey force [MN]", fontsize=9)
    return figure
