"""Intensity measures, state-dependent fragility, losses and sensitivity, compared with reference results.

    python studies/analyses.py --out results

Each analysis runs with the model, the motions and the inputs of its reference result:

- 18 values of intensity measures of two motions, and the efficiency, proficiency and slope of five measures for the
  drift of a bilinear oscillator under the 44 far-field motions of FEMA P-695;
- state-dependent fragility curves of a bilinear oscillator and of an oscillator with P-Delta, from sequences of two
  earthquakes;
- annual rates of damage states and the expected annual loss for a hazard curve that is a power law (closed form);
- Sobol indices, correlation ratios and a tornado diagram of the drift of an elastic building of three storeys.

The study prints a table with the differences, divided by the tolerance that the errors of both results explain: three
standard errors (state-dependent fragility), half of the 95 % interval (Sobol indices and correlation ratios: 5 %
may be outside), or the digits and steps of the reference. It writes analyses.nc and one figure.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from parts.analyses import losses, measures, sensitivities, states
from parts.analyses.rows import Row
from parts.command_line import file_in, read_arguments, save_figures
from scipy.stats import norm

from warpdyn.foundations.files import netcdf


def table_of(rows: list[Row]) -> pd.DataFrame:
    """Return one line per quantity, with the difference over its tolerance."""
    return pd.DataFrame([dataclasses.asdict(row) | {"difference_over_tolerance": row.share} for row in rows])


def draw_efficiency(panel: Axes, found: xr.Dataset) -> None:
    """Draw the efficiency of all measures with its interval, and the reference."""
    names = list(measures.REGRESSIONS)
    value, low, high = (found[f"efficiency{end}"].values for end in ("", "_lower", "_upper"))
    panel.errorbar(value, names, xerr=[value - low, high - value], fmt="o", capsize=3, label="warpdyn, 95 % interval")
    panel.plot([row[2] for row in measures.REGRESSIONS.values()], names, "kx", ms=9, label="reference")
    panel.set(xlabel="efficiency: deviation of ln drift", title="Intensity measures")
    panel.invert_yaxis()


def draw_states(panel: Axes, curves: Mapping[str, xr.Dataset]) -> None:
    """Draw the curves of the heaviest state of the oscillator with P-Delta, and those of the reference."""
    found, level = curves["P-Delta"], np.geomspace(0.05, 1.7, 200)
    for colour, before in zip(("C0", "C1", "C2"), (0, 2, 3), strict=True):
        curve = found.isel(from_state=before, damage_state=-1)
        median, dispersion = float(curve["fragility_median"]), float(curve["fragility_dispersion"])
        name = curve["from_state"].item()
        panel.plot(level, norm.cdf(np.log(level / median) / dispersion), colour, label=f"from {name}")
        _, median, dispersion = states.CASES["P-Delta"][3][(before, 4)]
        at = level[10::18]
        panel.plot(at, norm.cdf(np.log(at / median) / dispersion), f"{colour}x")
    panel.set(
        xlabel="PGA of the second event [g]", ylabel="probability of DS4", title="State-dependent fragility, P-Delta"
    )


def draw_indices(panel: Axes, found: xr.Dataset) -> None:
    """Draw the Sobol indices with their intervals, and the reference."""
    names = [name.replace("_", " ") for name in sensitivities.REFERENCE]
    place = np.arange(len(names))
    for shift, (quantity, column) in zip((-0.12, 0.12), (("first_order", 0), ("total", 1)), strict=True):
        value, low, high = (found[f"{quantity}{end}"].values for end in ("", "_lower", "_upper"))
        label = quantity.replace("_", "-")
        panel.errorbar(value, place + shift, xerr=[value - low, high - value], fmt="o", capsize=3, label=label)
        panel.plot([row[column] for row in sensitivities.REFERENCE.values()], place + shift, "kx", ms=8)
    panel.set_yticks(place, names)
    panel.set(xlabel="Sobol index of the largest drift", title="Sensitivity")
    panel.invert_yaxis()


def draw_differences(panel: Axes, table: pd.DataFrame) -> None:
    """Draw all differences, divided by their tolerances."""
    for place, (_, part) in enumerate(table.groupby("analysis", sort=False)):
        share = np.maximum(part["difference_over_tolerance"], 1e-4)
        panel.plot(share, place + np.linspace(-0.25, 0.25, len(part)), ".")
    panel.set_yticks(range(table["analysis"].nunique()), table["analysis"].unique())
    panel.axvline(1.0, color="k", lw=0.8)
    panel.set(xscale="log", xlabel="difference / tolerance", title=f"All {len(table)} quantities")
    panel.invert_yaxis()


def draw(table: pd.DataFrame, regressions: xr.Dataset, curves: Mapping[str, xr.Dataset], indices: xr.Dataset) -> Figure:
    """Return the figure of all analyses."""
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    draw_efficiency(panels[0], regressions)
    draw_states(panels[1], curves)
    draw_indices(panels[2], indices)
    draw_differences(panels[3], table)
    for panel in panels:
        panel.grid(alpha=0.3)
    for panel in panels[:3]:
        panel.plot([], [], "kx", label="reference" if panel is not panels[0] else None)
        panel.legend(fontsize="small")
    return figure


def main() -> None:
    """Run the study from the command line: print and write the table, and draw the figure."""
    arguments = read_arguments(__doc__, 4000, "sequences of two earthquakes, and base samples", "structures")
    path = file_in(arguments.out, "analyses.nc")
    rows, regressions = measures.compared(arguments.device)
    of_states, curves = states.compared(arguments.structures, arguments.seed, arguments.device)
    of_losses, _ = losses.compared()
    base = 2 ** int(np.log2(arguments.structures))
    of_inputs, indices = sensitivities.compared(base, arguments.seed, arguments.device)
    table = table_of([*rows, *of_states, *of_losses, *of_inputs])
    with pd.option_context("display.width", 200, "display.max_rows", None, "display.max_colwidth", None):
        print(table.drop(columns="tolerance").to_string(index=False, float_format=lambda value: f"{value:.6g}"))
    outside = int((table["difference_over_tolerance"] > 1).sum())
    print(f"{outside} of {len(table)} differences are larger than their tolerance")
    netcdf.write(xr.Dataset({name: ("row", table[name].to_numpy()) for name in table}), path)
    save_figures({"analyses": draw(table, regressions, curves, indices)}, arguments.out)


if __name__ == "__main__":
    main()
