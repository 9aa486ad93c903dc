"""Regional risk: every building of a synthetic Bay Area in a large earthquake, with 25 pairs of motions for each.

    python studies/metropolis.py --out results
    python studies/metropolis.py --out results --buildings 1840000      # on a GPU
    python studies/metropolis.py --out results --flexural-shear

The study follows SimCenter's Bay Area testbed: 1.84 million buildings, a magnitude 7 earthquake on the Hayward fault,
and 25 pairs of ground motions. An inventory becomes a portfolio of Hazus buildings. Peak accelerations are drawn as
spatially correlated fields on a grid. Each building is analysed under the motions of nearby grid points, and only
statistics are stored. The study writes metropolis_buildings.parquet (GeoParquet with the probabilities of damage and
loss of each building, and their uncertainty), metropolis.nc (losses and damage of the city for each event) and a
figure. With --flexural-shear, buildings above ten storeys are flexural-shear buildings instead of chains of storeys.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import pandas as pd
from parts.command_line import file_in, read_arguments, save_figures
from parts.metropolis.figure import draw
from parts.metropolis.region import build_inventory, shaking
from parts.metropolis.tall import MOST_CHAIN_STOREYS, tall_archetypes
from portfolio import CORRELATION, SCATTER

import warpdyn as wd
from warpdyn.foundations.files import netcdf

PAIRS = 25  # number of pairs of ground motions
OCCUPANCY = "RES1"  # occupancy of all buildings, for the repair costs of Hazus
COLLAPSE_DRIFT_RATIO = 0.10  # storey drift ratio at which a building collapses [1]


class Region(NamedTuple):
    """A region for the study: buildings, their scene, and the statistics that a run returns.

    Args:
        inventory: Table of the buildings.
        stock: Their portfolio, with limits of damage states.
        scene: The portfolio under the motions of the earthquake.
        values: Replacement cost of each building.
        loss_ratios: Damage state -> repair cost over replacement cost.
        statistics: Counts and losses that `simulate` adds up.
    """

    inventory: pd.DataFrame
    stock: wd.inventories.BuildingStock
    scene: wd.Scene
    values: np.ndarray
    loss_ratios: dict[str, float]
    statistics: list[wd.DamageCounts | wd.DamageLoss]


def build_region(buildings: int, seed: int, flexural_shear: bool = False) -> Region:
    """Return the region with this number of buildings, under 25 pairs of motions."""
    inventory = build_inventory(buildings, seed)
    own, limits = tall_archetypes() if flexural_shear else ({}, {})
    stock = wd.inventories.portfolio(inventory, archetypes=own, limits=limits, scatter=SCATTER, correlation=CORRELATION)
    pairs = wd.records.pairs(wd.records.near_field())[:PAIRS]
    scene = wd.Scene(
        stock.portfolio,
        shaking(inventory, stock, pairs, seed),
        recorders=("drift",),
        collapse_drift_ratio=COLLAPSE_DRIFT_RATIO,
        title="Hazus buildings of a synthetic Bay Area under a magnitude 7 earthquake on the Hayward fault",
    )
    events = [first.record for first, _ in pairs for _ in range(2)]  # two components; the worse one counts
    ratios, values = wd.hazus_loss_ratios(OCCUPANCY), stock.replacement_costs(inventory)
    asked = [
        wd.DamageCounts(stock.limits, events=events, over="building"),
        wd.DamageCounts(stock.limits, events=events, over=("archetype", "event")),
        wd.DamageLoss(stock.limits, ratios, values, events=events, over="event"),
    ]
    return Region(inventory, stock, scene, values, ratios, asked)


def main() -> None:
    """Run the study from the command line."""
    tall = {"flexural-shear": f"flexural-shear buildings above {MOST_CHAIN_STOREYS} storeys"}
    arguments = read_arguments(__doc__, 20_000, "buildings of the region", counted="buildings", switches=tall)
    target = file_in(arguments.out, "metropolis.nc")
    times = {"": time.perf_counter()}

    region = build_region(arguments.buildings, arguments.seed, arguments.flexural_shear)
    times["portfolio and motions"] = time.perf_counter()

    stock = region.stock
    print(f"{stock.portfolio}: {stock.portfolio.buildings * 2 * PAIRS:,} histories")
    counted = wd.simulate(region.scene, device=arguments.device, seed=arguments.seed, statistics=region.statistics)
    times["simulate"] = time.perf_counter()

    results = wd.building_results(counted, stock, region.inventory, region.loss_ratios)
    with ThreadPoolExecutor(1) as beside:  # for a million buildings, writing and drawing take about a second each
        writing = beside.submit(wd.write_building_results, results, arguments.out / "metropolis_buildings.parquet")
        losses = wd.event_losses(counted)
        netcdf.write(losses.merge(wd.damage_shares(counted), compat="override", combine_attrs="override"), target)
        save_figures({"metropolis": draw(results, losses)}, arguments.out)
        writing.result()
    times["results and figure"] = time.perf_counter()

    low, middle, high = np.quantile(losses["loss"] / region.values.sum(), [0.16, 0.5, 0.84])
    print(f"loss of the city over its value: median {middle:.3f}, {low:.3f} to {high:.3f} in two thirds of the events")
    moments = list(times.values())
    parts = ", ".join(f"{name} {b - a:.2f}" for name, a, b in zip(list(times)[1:], moments, moments[1:], strict=False))
    print(f"{moments[-1] - moments[0]:.1f} s: {parts}; in kernels {counted.attrs['seconds_in_kernels']:.2f}")
    print(f"wrote {target}, metropolis_buildings.parquet and metropolis.png")


if __name__ == "__main__":
    main()
