"""Parameters of shear buildings that represent FEMA's Hazus building types, after Lu's MDOF model."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from warpdyn.engine.laws import Hysteretic
from warpdyn.foundations.core.checks import one_of, real_number, whole_number
from warpdyn.foundations.core.messages import amount_of
from warpdyn.foundations.files.packaged import packaged_rows
from warpdyn.model.structures.capacity.backbones import LEVEL_END, SHAPED, law_parameters
from warpdyn.model.structures.lateral_loads import floor_loads, storey_shears

DESIGN_LEVELS = ("high", "moderate", "low", "pre")
DAMAGE_STATES = ("slight", "moderate", "extensive", "complete")
MASS_PER_AREA = 1000.0  # kg/m2 of floor
GRAVITY_OF_LU = 9.8  # m/s2; Lu's published strengths are computed with this rounded value
THIRD_CORNER = 1.0  # m; drift at which MDOF-LU ends the level branch of ultimate strength, if it begins at less


@functools.cache
def _hazus_table() -> Mapping[tuple[str, str], Mapping[str, float]]:
    """Return the table hazus_buildings.csv as (building type, design level) -> values by column name."""
    table = {}
    for row in packaged_rows("hazus_buildings.csv"):
        key = row.pop("building_type"), row.pop("design_level")
        table[key] = MappingProxyType({name: float(value) for name, value in row.items()})
    return MappingProxyType(table)


def building_types() -> tuple[str, ...]:
    """Return the names of the 36 model building types of Hazus, such as "C1M"."""
    return tuple(dict.fromkeys(building_type for building_type, _ in _hazus_table()))


def building_class(building_type: str, design_level: str) -> Mapping[str, float]:
    """Return the row of a Hazus building type at a design level: capacity, period, height, damping and drift limits.

    Args:
        building_type: One of the 36 model building types.
        design_level: "high", "moderate" or "low" code, or "pre" (pre-code).

    Raises:
        ValueError: If the building type or the design level is unknown.
    """
    one_of("Hazus building type", building_type, building_types())
    one_of("design level", design_level, DESIGN_LEVELS)
    return _hazus_table()[building_type, design_level]


def hazus_drift_limits(building_type: str, design_level: str) -> dict[str, float]:
    """Return the median storey drift ratio [1] of each structural damage state, as limits for `fragility`.

    The limits depend on the height class: for example, C1L, C1M and C1H have different limits.

    Args:
        building_type: One of the 36 model building types, such as "C1M".
        design_level: "high", "moderate" or "low" code, or "pre" (pre-code).

    Raises:
        ValueError: If the building type or the design level is unknown.

    Example:
        >>> wd.hazus_drift_limits("C1M", "high")
        {'slight': 0.0033, 'moderate': 0.0067, 'extensive': 0.02, 'complete': 0.0533}
    """
    row = building_class(building_type, design_level)
    return {state: row[f"drift_{state}"] for state in DAMAGE_STATES}


def hazus_chain(
    building_type: str, design_level: str, storeys: int, floor_area: float, law: str
) -> dict[str, float | np.ndarray]:
    """Return the parameters of the shear building that represents a Hazus type, after Lu.

    All storeys have the same stiffness, chosen to give the type's first period. Storey strengths are the storey shears
    of floor loads that are proportional to the floor number. As in SimCenter's MDOF-LU, g is 9.8 m/s2, and the share of
    the mass that acts in the first mode is a cubic polynomial of 1/N, within 2e-4 of the closed form.

    Returns:
        `mass` [kg], `stiffness` [N/m], `height` [m], `yield_force` [N] of shape [storey], `hardening_ratio` and
        `damping_ratio`. Laws with several corners also get the parameters of a backbone that rises to the ultimate
        strength and stays level; "hysteretic" also gets pinching parameters and `unloading_exponent`, as in MDOF-LU.
    """
    row = building_class(building_type, design_level)
    n = whole_number("storeys", storeys, 1)
    least, most = int(row["min_storeys"]), int(row["max_storeys"])
    if not least <= n <= most:
        raise ValueError(
            f"Hazus type {building_type} has {least} to {most} storeys, got {n}: choose the type for "
            f"{amount_of(n, 'storey')}, such as C1L, C1M or C1H for low, medium and high concrete frames"
        )
    mass = real_number("floor_area", floor_area, above=0) * MASS_PER_AREA
    real_number("floor_area times the mass of a floor [kg]", mass)
    period = n * row["period_per_storey_s"]
    # The first frequency of a chain with N equal masses and stiffnesses is 2 sin(pi / (4N + 2)) sqrt(k / m).
    stiffness = (np.pi / (period * np.sin(np.pi / (4 * n + 2)))) ** 2 * mass
    mass_share = 1.0 if n == 1 else 0.8106 + 0.402 / n - 0.3037 / n**2 + 0.09117 / n**3
    base_shear = row["yield_spectral_acceleration_g"] * GRAVITY_OF_LU * mass_share * mass * n
    yield_force = base_shear * storey_shears(floor_loads("triangular", np.ones(n), np.ones(n)))
    chain: dict[str, float | np.ndarray] = {
        "mass": mass,
        "stiffness": stiffness,
        "height": row["storey_height_m"],
        "yield_force": yield_force,
        "hardening_ratio": row["hardening_ratio"],
        "damping_ratio": row["damping_ratio"],
    }
    if law in SHAPED:
        at_yield, over = yield_force / stiffness, row["overstrength_ratio"]
        at_ultimate = at_yield * (1 + (over - 1) / row["hardening_ratio"])
        end = np.where(at_ultimate < THIRD_CORNER, THIRD_CORNER, LEVEL_END * at_ultimate)
        chain |= law_parameters(law, np.array([at_yield, at_ultimate, end]), np.outer([1, over, over], yield_force))
    if law == Hysteretic.name:
        chain |= dict.fromkeys(("pinching_drift", "pinching_force"), row["pinching"])
        chain |= {"unloading_exponent": row["unloading_exponent"]}
    return chain
