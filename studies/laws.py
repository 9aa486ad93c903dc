"""Forces and dissipated energies of every storey law that yields, in the same cycles of increasing drift.

    python studies/laws.py --out results

All storeys have the same stiffness and yield force. Their other parameters are those of typical buildings
(studies/peers/storey_laws.py also contains the parameters of the OpenSees materials). The study writes laws.nc, which
contains drifts, forces and energies, and laws.png.
"""

from __future__ import annotations

import argparse
import datetime
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from parts.command_line import file_in, save_figures
from peers.storey_laws import LAWS

import warpdyn as wd
from warpdyn.foundations.files import netcdf
from warpdyn.interfaces.plots.style import COLOURS

STIFFNESS, YIELD_FORCE = 1.0e7, 1.0e5  # N/m and N, so the yield drift is 10 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
DUCTILITIES, CYCLES = (0.8, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0), 2  # amplitudes of the cycles; cycles at each
DRIFT_STEP = YIELD_DRIFT / 100  # drift increment per step [m]
COLUMNS = 3  # number of panels in a row of the figure
TEXT = 8.5  # font size [pt]; at least 11 px in a figure 9 inches wide on the page


def protocol() -> np.ndarray:
    """Return the drifts [m] of the cycles that are imposed on all storeys, shape [step]."""
    turns = [0.0, *(sign * d for d in DUCTILITIES for _ in range(CYCLES) for sign in (1, -1)), 0.0]
    legs = [np.linspace(a, b, round(abs(b - a) * YIELD_DRIFT / DRIFT_STEP), endpoint=False) for a, b in pairwise(turns)]
    return YIELD_DRIFT * np.append(np.concatenate(legs), turns[-1])


def take_through(drift: np.ndarray) -> xr.Dataset:
    """Return a dataset of the forces [N] and dissipated energies [J] of all yielding laws for given drifts [m]."""
    runs = {}
    for law in (name for name in LAWS if name != "elastic"):
        parameters = LAWS[law].parameters(YIELD_DRIFT)
        # Height and mass have no effect on the force of a storey.
        storey = wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law, yield_force=YIELD_FORCE, **parameters)
        runs[law] = wd.storey_hysteresis(storey, drift).squeeze("storey", drop=True)
        runs[law].attrs["parameters"] = json.dumps(parameters)
    result = xr.concat([run.drop_vars("storey_drift") for run in runs.values()], "law", combine_attrs="drop_conflicts")
    result["storey_drift"] = next(iter(runs.values()))["storey_drift"]
    words = {"long_name": "OpenSees' uniaxial material of the same rules"}
    return result.assign_coords(
        law=("law", list(runs), {"long_name": "storey law"}),
        opensees_material=("law", [LAWS[law].material for law in runs], words),
        law_parameters=(
            "law",
            [run.attrs["parameters"] for run in runs.values()],
            {"long_name": "parameters of the law, as JSON"},
        ),
    ).assign_attrs(stiffness=STIFFNESS, yield_force=YIELD_FORCE)


def in_yield_energies(result: xr.Dataset) -> np.ndarray:
    """Return the energy dissipated by each law in all cycles over yield force times yield drift, shape [law]."""
    return result["dissipated_energy"].isel(step=-1).values / (YIELD_FORCE * YIELD_DRIFT)


def draw(result: xr.Dataset) -> Figure:
    """Draw one panel per law (force over yield force against ductility), and one panel with the imposed cycles."""
    laws = result["law"].values.tolist()
    rows = -(-(len(laws) + 1) // COLUMNS)
    figure = Figure(figsize=(9.0, 2.1 * rows + 0.4), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, sharex=False, sharey=False).ravel()
    ductility = result["storey_drift"].values / YIELD_DRIFT
    forces, energies = result["storey_force"].values / YIELD_FORCE, in_yield_energies(result)
    largest = 1.08 * np.abs(forces).max()
    for i, (axes, law, force, energy) in enumerate(zip(panels, laws, forces, energies, strict=False)):
        axes.plot(ductility, force, color=COLOURS[0], lw=0.7)
        _frame(axes, law.replace("ibarra_medina_krawinkler", "ibarra_..."))
        axes.set(xlim=(-11, 11), ylim=(-largest, largest))
        axes.tick_params(labelleft=i % COLUMNS == 0, labelbottom=i + COLUMNS >= len(laws))
        text = f"{result['opensees_material'].values[i]}\n{energy:.0f} $F_y d_y$"
        axes.text(0.97, 0.04, text, transform=axes.transAxes, ha="right", va="bottom", fontsize=TEXT)
    last = panels[len(laws)]
    last.plot(np.linspace(0, 1, ductility.size), ductility, color=COLOURS[3], lw=0.8)
    _frame(last, "ductility of all, step by step")
    last.tick_params(left=False, labelleft=False, right=True, labelright=True, bottom=False, labelbottom=False)
    for axes in panels[len(laws) + 1 :]:
        axes.set_axis_off()
    figure.supxlabel("Ductility: storey drift over yield drift", fontsize=TEXT + 0.5)
    figure.supylabel("Storey force over yield force", fontsize=TEXT + 0.5)
    return figure


def _frame(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize=TEXT)
    axes.tick_params(labelsize=TEXT)
    axes.axhline(0, color="0.7", lw=0.5, zorder=0)
    axes.axvline(0, color="0.7", lw=0.5, zorder=0)
    axes.grid(alpha=0.25)


def main() -> None:
    """Run the study from the command line: write laws.nc, draw laws.png and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    arguments = parser.parse_args()
    target = file_in(arguments.out, "laws.nc")
    result = take_through(protocol())
    result.attrs |= {
        "Conventions": "CF-1.11",
        "title": "Storey laws under the same cycles",
        "history": f"{datetime.datetime.now(datetime.UTC):%Y-%m-%dT%H:%M:%SZ} studies/laws.py",
    }
    netcdf.write(result, target)
    save_figures({"laws": draw(result)}, arguments.out)
    print(f"{'storey law':<40}{'OpenSees':<17}{'dissipated over Fy dy':>22}{'last peak over Fy':>19}")
    last_cycle = np.abs(result["storey_drift"].values) >= DUCTILITIES[-1] * YIELD_DRIFT * (1 - 1e-9)
    for law, material, energy, force in zip(
        result["law"].values,
        result["opensees_material"].values,
        in_yield_energies(result),
        np.abs(result["storey_force"].values[:, last_cycle][:, -1]) / YIELD_FORCE,
        strict=True,
    ):
        print(f"{law:<40}{material:<17}{energy:>22.1f}{force:>19.2f}")
    print(f"wrote {target} and laws.png")


if __name__ == "__main__":
    main()
