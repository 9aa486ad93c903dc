"""Damage of a city: many Hazus buildings of different types and heights under the FEMA P-695 far-field record pairs.

    python studies/portfolio.py --out results

Every building is analysed under both unscaled components of the 22 record pairs. The worse of the two results counts,
because the building is assumed to be equal in both directions. Histories are not stored, only counts. The study writes
portfolio.nc, with the share of buildings in each damage state for each record pair, for the city and for each building
type, and a figure.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from parts.command_line import file_in, read_arguments, save_figures

import warpdyn as wd
from warpdyn.foundations.files import netcdf
from warpdyn.model.ground_motions.records import far_field

# The city is an assumption, not a survey; its building stock resembles the western United States. About 90 % of the
# buildings are wood houses, manufactured homes and small masonry buildings, because most buildings are dwellings.
# Commerce and industry use low buildings of wood, steel, concrete, masonry and tilt-up walls. A few per cent of the
# buildings are mid-rise, and less than 1 % are high-rise. For each type: share of the buildings [%], and numbers of
# storeys, which have equal shares.
CITY = {
    "W1": (70.0, (1,)),
    "W2": (6.0, (1, 2)),
    "MH": (5.0, (1,)),
    "RM1L": (5.0, (1, 2, 3)),
    "RM2L": (1.5, (1, 2)),
    "URML": (2.5, (1, 2)),
    "URMM": (0.5, (3, 4)),
    "PC1": (2.0, (1,)),
    "PC2L": (0.4, (2, 3)),
    "C1L": (1.2, (2, 3)),
    "C1M": (0.6, (4, 5, 6)),
    "C1H": (0.2, (8, 10, 12)),
    "C2L": (1.5, (1, 2, 3)),
    "C2M": (0.8, (4, 5, 6)),
    "C2H": (0.2, (8, 10, 12)),
    "C3L": (0.4, (2, 3)),
    "C3M": (0.2, (4, 5)),
    "S1L": (0.6, (2, 3)),
    "S1M": (0.3, (4, 5, 6)),
    "S1H": (0.2, (8, 10, 12)),
    "S2L": (0.4, (2, 3)),
    "S3": (0.5, (1,)),
}
# Design levels by the year of construction, as in Hazus for high seismicity (Technical Manual, chapter 5): high code
# after 1975, moderate code from 1941, pre-code before 1941 (wood houses: moderate code). The share of buildings of each
# age [%] is assumed. Unreinforced masonry, and frames with masonry infill, were not built to a seismic code. Steel
# light frames, tilt-up buildings and manufactured homes were not built before 1941.
OLD, RECENT = {"pre": 100.0}, {"high": 60.0, "moderate": 40.0}
LEVELS = {
    "others": {"high": 45.0, "moderate": 40.0, "pre": 15.0},
    "W1": {"high": 45.0, "moderate": 55.0},
    "URML": OLD,
    "URMM": OLD,
    "C3L": OLD,
    "C3M": OLD,
    "S3": RECENT,
    "PC1": RECENT,
    "MH": RECENT,
}
# Scatter of the buildings of a type; the values are those of studies/p695_fragility.py.
SCATTER = {
    "mass": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.10)),
    "stiffness": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.20)),
    "yield_force": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.25), per="storey", storey_correlation=0.8),
    "damping_ratio": wd.RandomFactor(wd.Lognormal(median=1.0, dispersion=0.30)),
}
CORRELATION = {("stiffness", "yield_force"): 0.6}
# Colours from no damage to complete damage; heavier damage is darker, also in grey.
COLOURS = ("#E8E8E8", "#FFE08A", "#F5A742", "#D55E00", "#7A1C1C")


def shared_out(total: int, shares: list[float]) -> list[int]:
    """Return whole numbers proportional to the shares, with the given total (method of largest remainders)."""
    exact = total * np.array(shares) / np.sum(shares)
    counts = np.floor(exact).astype(int)
    counts[np.argsort(counts - exact, kind="stable")[: total - counts.sum()]] += 1
    return counts.tolist()


def build_city(buildings: int) -> tuple[wd.Portfolio, dict[str, dict[str, float]]]:
    """Return the portfolio of a city, and the drift ratio limits [1] of each archetype by damage state."""
    kinds = {}
    for building_type, (share, storeys) in CITY.items():
        levels = LEVELS.get(building_type, LEVELS["others"])
        for level, part in levels.items():
            for count in storeys:
                kinds[building_type, level, count] = share * part / len(storeys)
    archetypes, limits = {}, {}
    for (building_type, level, storeys), count in zip(kinds, shared_out(buildings, list(kinds.values())), strict=True):
        if count:
            name = f"{building_type} {level} {storeys}"
            building = wd.ShearBuilding.from_hazus(building_type, level, storeys)
            archetypes[name] = wd.Archetype(building, count, SCATTER, CORRELATION)
            limits[name] = wd.hazus_drift_limits(building_type, level)
    return wd.Portfolio(archetypes), limits


def pairs_of(names: list[str]) -> list[str]:
    """Return the record pair of each component: "1 Northridge 1994" for "1a Northridge 1994 MUL009"."""
    parts = [name.split() for name in names]
    return [" ".join([part[0][:-1], *part[1:-1]]) for part in parts]


def by_type(shares: xr.Dataset) -> xr.DataArray:
    """Return the share of the buildings of each type in each damage state, for each record pair."""
    kind = xr.DataArray([name.split()[0] for name in shares["archetype"].values], dims="archetype")
    counted = shares["counted_buildings"]
    buildings = (shares["archetype_damage_share"] * counted).groupby(kind.rename("building_type")).sum()
    found = buildings / counted.groupby(kind.rename("building_type")).sum()
    found.attrs = {"long_name": "share of the type's buildings in the damage state", "units": "1"}
    return found.sel(building_type=[name for name in CITY if name in found["building_type"].values])


def draw(result: xr.Dataset) -> Figure:
    """Return a figure of the shares for each record pair, and for each building type as the mean over the pairs."""
    figure = Figure(figsize=(9.0, 7.2), layout="constrained")
    city, types = figure.subplots(1, 2)
    ordered = result["damage_share"].isel(event=np.argsort(result["damage_share"].sel(damage_state="none").values))
    of_types = result["type_damage_share"].mean("event")
    for axes, shares, dim, what in (
        (city, ordered, "event", f"{result.attrs['buildings']:,} buildings, by record pair as recorded"),
        (types, of_types, "building_type", "by Hazus type, mean of the pairs"),
    ):
        labels, left = shares[dim].values.astype(str), np.zeros(shares.sizes[dim])
        for state, colour in zip(shares["damage_state"].values, COLOURS, strict=True):
            width = 100 * shares.sel(damage_state=state).values
            axes.barh(np.arange(labels.size), width, left=left, color=colour, label=str(state), height=0.82)
            left += width
        axes.set_yticks(np.arange(labels.size), labels, fontsize=8.5)
        axes.set_ylim(labels.size - 0.5, -0.5)
        axes.set_xlim(0, 100)
        axes.set_xlabel("buildings [%]")
        axes.set_title(what, fontsize=10)
        axes.spines[["top", "right"]].set_visible(False)
    handles, names = city.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=5, frameon=False)
    return figure


def main() -> None:
    """Run the study from the command line."""
    arguments = read_arguments(__doc__, 10_000, meaning="buildings of the city", counted="buildings")
    target = file_in(arguments.out, "portfolio.nc")
    started = time.perf_counter()
    portfolio, limits = build_city(arguments.buildings)
    motions = far_field()
    print(f"{portfolio}, {len(motions)} records: {portfolio.buildings * len(motions):,} histories")
    title = "Hazus buildings of a city under the FEMA P-695 far-field record pairs"
    pairs = pairs_of([motion.name for motion in motions])
    counted = wd.simulate(
        wd.Scene(portfolio, wd.Cloud(motions), recorders=("drift",), title=title),
        device=arguments.device,
        seed=arguments.seed,
        checked_share=0.01,
        statistics=wd.DamageCounts(limits, events=pairs, over=("archetype", "event")),
    )
    simulated = time.perf_counter()
    result = wd.damage_shares(counted)
    result["type_damage_share"] = by_type(result)
    result["estimated_relative_error"] = counted["estimated_relative_error"]
    result.attrs["buildings"] = portfolio.buildings
    netcdf.write(result, target)
    save_figures({"portfolio": draw(result)}, arguments.out)
    drawn = time.perf_counter()

    print(f"\n{'share of buildings [%]':<24}" + "".join(f"{state:>11}" for state in result["damage_state"].values))
    mean = result["damage_share"].mean("event")
    for name, row in [*zip(result["event"].values, result["damage_share"].values, strict=True), ("mean", mean.values)]:
        print(f"{name:<24}" + "".join(f"{100 * share:>11.1f}" for share in row))
    error = counted["estimated_relative_error"].sel(demand="peak_storey_drift", error_statistic="95 %")
    print(f"\n95 % of the peak drifts of any group err by less than {100 * float(error):.2g} %")
    parts = {
        "sampling": counted.attrs["seconds_sampling"],
        "integrating": counted.attrs["seconds_integrating"],
        "the rest of the run": simulated
        - started
        - counted.attrs["seconds_sampling"]
        - counted.attrs["seconds_integrating"],
        "shares, file and figure": drawn - simulated,
    }
    print(f"{drawn - started:.1f} s: " + ", ".join(f"{name} {value:.2f}" for name, value in parts.items()))
    print(f"{counted.attrs['groups']} groups, {int(counted['failed_samples'].sum())} samples failed")
    print(f"wrote {target} and portfolio.png")


if __name__ == "__main__":
    main()
