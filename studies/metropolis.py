"""A metropolis under a large earthquake: every building of a synthetic Bay Area, 25 pairs of motions each.

    python studies/metropolis.py --out results
    python studies/metropolis.py --out results --buildings 1840000      # on a GPU

As in SimCenter's Bay Area testbed (1.84 million buildings, a magnitude 7 earthquake on the Hayward fault, 25 pairs of
ground motions): an inventory becomes a portfolio of Hazus buildings, peak accelerations are drawn as correlated fields
on a grid, each building takes the motions of grid points near it, and only statistics are kept. Writes
metropolis_buildings.parquet (each building's probabilities of damage and expected loss), metropolis.nc (losses of the
city by event and of cells of the map) and a figure.
"""

from __future__ import annotations

import time

import numpy as np
from parts.command_line import file_in, read_arguments, save_figures
from parts.metropolis.figure import draw
from parts.metropolis.region import build_inventory, shaking
from portfolio import CORRELATION, SCATTER

import warpdyn as wd
from warpdyn.files import netcdf

PAIRS = 25
OCCUPANCY = "RES1"  # of all buildings, whose repair costs Hazus gives by damage state
COLLAPSE_DRIFT_RATIO = 0.10
CELL = 0.02  # degree, of the map


def main() -> None:
    """Run the study."""
    arguments = read_arguments(__doc__, 20_000, meaning="buildings of the region", counted="buildings")
    target = file_in(arguments.out, "metropolis.nc")
    times = {"": time.perf_counter()}

    inventory = build_inventory(arguments.buildings, arguments.seed)
    times["inventory"] = time.perf_counter()
    stock = wd.inventories.portfolio(inventory, scatter=SCATTER, correlation=CORRELATION)
    buildings = inventory.iloc[stock.rows]
    pairs = wd.records.pairs(wd.records.near_field())[:PAIRS]
    design = shaking(inventory, stock.rows, pairs, arguments.seed)
    times["portfolio and motions"] = time.perf_counter()

    scene = wd.Scene(
        stock.portfolio,
        design,
        recorders=("drift",),
        collapse_drift_ratio=COLLAPSE_DRIFT_RATIO,
        title="Hazus buildings of a synthetic Bay Area under a magnitude 7 earthquake on the Hayward fault",
    )
    events = [first.record for first, _ in pairs for _ in range(2)]  # the worse of both components is a building's
    east, north = (np.floor(buildings[name].to_numpy() / CELL).astype(np.int64) for name in ("longitude", "latitude"))
    cells, cell = np.unique(np.stack([east, north], axis=1), axis=0, return_inverse=True)
    ratios, values = wd.hazus_loss_ratios(OCCUPANCY), buildings["replacement_cost"].to_numpy()
    asked = [
        wd.DamageCounts(stock.limits, events=events, over="building"),
        wd.DamageCounts(stock.limits, events=events, over=("archetype", "event")),
        wd.DamageLoss(stock.limits, ratios, values, events=events, over="event"),
        wd.DamageLoss(stock.limits, ratios, values, events=events, over="cell", labels={"cell": cell}),
    ]
    print(f"{stock.portfolio}: {stock.portfolio.buildings * 2 * PAIRS:,} histories")
    counted = wd.simulate(scene, device=arguments.device, seed=arguments.seed, statistics=asked)
    times["simulate"] = time.perf_counter()

    counts = counted["damage_count_by_building"].transpose("building", "damage_state")
    share = counts.values / np.maximum(counts.values.sum(axis=1, keepdims=True), 1)
    loss_ratio = share @ np.array([0.0, *(ratios[name] for name in counts["damage_state"].values[1:])])
    table = buildings.drop(columns="number", errors="ignore").assign(
        **{f"probability_{name}": share[:, place] for place, name in enumerate(counts["damage_state"].values)},
        expected_loss_ratio=loss_ratio,
        expected_loss=loss_ratio * values,
    )
    table.to_parquet(arguments.out / "metropolis_buildings.parquet", index=False)
    of_city = counted.drop_dims("building")
    of_city["longitude"] = ("cell", CELL * (cells[:, 0] + 0.5), {"units": "degrees_east"})
    of_city["latitude"] = ("cell", CELL * (cells[:, 1] + 0.5), {"units": "degrees_north"})
    of_city["replacement_value"] = ("cell", np.bincount(cell.ravel(), values), {"long_name": "replacement value"})
    netcdf.write(of_city, target)
    times["results"] = time.perf_counter()
    save_figures({"metropolis": draw(of_city, stock.portfolio.buildings)}, arguments.out)
    times["figure"] = time.perf_counter()

    losses = np.sort(of_city["loss_sum_by_event"].values) / values.sum()
    low, middle, high = np.quantile(losses, [0.16, 0.5, 0.84])
    print(f"loss of the city over its value: median {middle:.3f}, {low:.3f} to {high:.3f} in two thirds of the events")
    moments = list(times.values())
    parts = ", ".join(f"{name} {b - a:.2f}" for name, a, b in zip(list(times)[1:], moments, moments[1:], strict=False))
    print(f"{moments[-1] - moments[0]:.1f} s: {parts}; in kernels {counted.attrs['seconds_in_kernels']:.2f}")
    print(f"wrote {target}, metropolis_buildings.parquet and metropolis.png")


if __name__ == "__main__":
    main()
