"""A synthetic San Francisco Bay Area: buildings around its towns, and an earthquake on the Hayward fault."""

from __future__ import annotations

import numpy as np
import pandas as pd
import xarray as xr
from portfolio import CITY

import warpdyn as wd

# For each town: longitude and latitude [degree], share of the buildings of the region, and standard deviation of their
# distance from the centre in each direction [km]. The values are assumed after the population of the region; they are
# not a survey of any place.
TOWNS = {
    "San Francisco": (-122.44, 37.76, 0.10, 3.5),
    "Daly City and San Mateo": (-122.36, 37.59, 0.09, 6.0),
    "Palo Alto and Redwood City": (-122.15, 37.44, 0.08, 6.0),
    "San Jose": (-121.88, 37.33, 0.22, 8.0),
    "Fremont and Hayward": (-122.03, 37.59, 0.12, 6.0),
    "Oakland and Berkeley": (-122.22, 37.80, 0.13, 5.0),
    "Richmond and Vallejo": (-122.31, 37.99, 0.06, 7.0),
    "Concord and Walnut Creek": (-122.03, 37.94, 0.09, 6.0),
    "Livermore and Pleasanton": (-121.84, 37.68, 0.05, 6.0),
    "San Rafael and Novato": (-122.55, 38.03, 0.03, 6.0),
    "Napa and Santa Rosa": (-122.52, 38.36, 0.03, 12.0),
}
# Assumed typical buildings: plan area [m2] by the number of storeys.
PLAN_AREA = {1: 140.0, 2: 160.0, 3: 350.0}
LARGE_PLAN_AREA = 900.0  # plan area of buildings with more than 3 storeys [m2]
COST_OF_AREA = 3200.0  # assumed cost of a square metre of floor area [USD/m2]
# Trace of the Hayward fault [degree] and magnitude of the scenario, both as in SimCenter's testbed.
FAULT = np.array([[-122.43, 38.03], [-122.25, 37.87], [-122.08, 37.68], [-121.92, 37.50], [-121.81, 37.41]])
MAGNITUDE = 7.0
SPACING = 0.05  # spacing of the grid of ground motions [degree]
BETWEEN, WITHIN = 0.25, 0.55  # standard deviations of ln PGA; together 0.6, the value of Joyner and Boore (1981)
MOST_DEVIATIONS = 2.0  # largest deviation from the median, because more than 3 g has hardly ever been recorded
KILOMETRES_OF_A_DEGREE = 111.19


def build_inventory(buildings: int, seed: int) -> pd.DataFrame:
    """Return an inventory: a table with type, age, location, plan area and replacement cost of each building.

    The building types are those of the city in studies/portfolio.py.
    """
    random = np.random.default_rng(seed)
    kinds = [(kind, storeys, share / len(each)) for kind, (share, each) in CITY.items() for storeys in each]
    share = np.array([part for *_, part in kinds])
    kind = random.choice(len(kinds), size=buildings, p=share / share.sum())
    storeys = np.array([count for _, count, _ in kinds])[kind]
    longitude, latitude, of_region, spread = np.array(list(TOWNS.values())).T
    town = random.choice(len(TOWNS), size=buildings, p=of_region / of_region.sum())
    east, north = random.standard_normal((2, buildings)).clip(-2.5, 2.5) * spread[town] / KILOMETRES_OF_A_DEGREE
    year = random.triangular(1900, 1965, 2020, size=buildings).astype(np.int32)
    recent = np.array([name in ("S3", "PC1", "MH") for name, *_ in kinds])[kind]  # types not built before 1941
    year[recent] = np.maximum(year[recent], 1941)
    plan_area = np.array([PLAN_AREA.get(count, LARGE_PLAN_AREA) for count in range(13)])[storeys]
    plan_area = plan_area * np.exp(random.normal(0.0, 0.3, buildings))
    names = list(CITY)
    type_of_kind = np.array([names.index(name) for name, *_ in kinds])
    table = pd.DataFrame(
        {
            "id": np.arange(buildings),
            "longitude": longitude[town] + east / np.cos(np.radians(latitude[town])),
            "latitude": latitude[town] + north,
            "storeys": storeys,
            "year": year,
            "structure_type": pd.Categorical.from_codes(type_of_kind[kind], names),
            "plan_area": plan_area,
            "replacement_cost": COST_OF_AREA * plan_area * storeys,
            "town": pd.Categorical.from_codes(town, list(TOWNS)),
        }
    )
    return wd.inventories.from_table(table)


def median_field(inventory: pd.DataFrame) -> xr.DataArray:
    """Return the median peak ground accelerations of the scenario [g], on a grid that covers the buildings.

    The median is that of Joyner and Boore 1981 (Bulletin of the Seismological Society of America 71(6), 2011-2038):
    log10 PGA = -1.02 + 0.249 M - log10 r - 0.00255 r with r^2 = d^2 + 7.3^2, at the distance d [km] from the trace of
    the fault.
    """
    axes = []
    for name in ("longitude", "latitude"):
        low, high = inventory[name].min(), inventory[name].max()
        axes.append(np.arange(np.floor(low / SPACING), np.ceil(high / SPACING) + 1) * SPACING)
    longitude, latitude = (each.ravel() for each in np.meshgrid(*axes))
    shrink = np.array([np.cos(np.radians(latitude.mean())), 1.0]) * KILOMETRES_OF_A_DEGREE
    points, ends = np.stack([longitude, latitude], axis=1) * shrink, FAULT * shrink
    along = np.diff(ends, axis=0)
    from_start = points[:, None] - ends[:-1]
    share = ((from_start * along).sum(axis=2) / (along**2).sum(axis=1)).clip(0, 1)
    distance = np.linalg.norm(from_start - share[..., None] * along, axis=2).min(axis=1)
    r = np.hypot(distance, 7.3)
    median = 10 ** (-1.02 + 0.249 * MAGNITUDE - np.log10(r) - 0.00255 * r)
    at_points = {"longitude": ("point", longitude), "latitude": ("point", latitude)}
    coordinates = at_points | {"earthquake": [f"Hayward M{MAGNITUDE:g}"]}
    said = {"long_name": "peak ground acceleration", "units": "g"}
    return xr.DataArray(median[None], coordinates, ("earthquake", "point"), "PGA", said)


def shaking(inventory: pd.DataFrame, stock: wd.inventories.BuildingStock, pairs: list, seed: int) -> wd.MotionsAtSites:
    """Return the ground motions of all buildings: one correlated field of peak accelerations per pair of records."""
    median = median_field(inventory)
    field = wd.sites.correlated_fields(
        median,
        wd.sites.JayaramBaker2009(0.0),
        between=BETWEEN,
        within=WITHIN,
        draws=len(pairs),
        seed=seed,
    )
    largest = median.values * np.exp(MOST_DEVIATIONS * np.hypot(BETWEEN, WITHIN))
    field = field.copy(data=np.minimum(field.values, largest))
    grid = wd.sites.scale_records(field, pairs, record=np.arange(len(pairs)))
    return grid.at(inventory, stock, seed=seed)
