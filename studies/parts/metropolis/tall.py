"""Tall Hazus buildings as flexural-shear buildings: a wall that bends, with a hinge at its base, and a frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from portfolio import CITY, CORRELATION, LEVELS, SCATTER

import warpdyn as wd

MOST_CHAIN_STOREYS = 10  # buildings with more storeys are flexural-shear buildings
# Assumed lateral stiffness ratios H sqrt(GA / EI) of Hazus types. Miranda and Taghavi (2005): 0 to about 2 for shear
# walls, 5 to 20 for moment frames.
ALPHA0 = {"C1H": 8.0, "C2H": 2.0, "S1H": 12.0}
HINGE_RATIO = 100.0  # stiffness of the base hinge over EI / H; it increases the first period by about 1 %


def flexural_shear(building_type: str, level: str, storeys: int) -> wd.FlexuralShearBuilding:
    """Return the flexural-shear building with period, masses, heights and strength of a Hazus building.

    Under the triangular floor loads of Hazus' base shear at yield, all storeys of the frame and the hinge at the base
    of the wall yield together.
    """
    chain = wd.ShearBuilding.from_hazus(building_type, level, storeys)
    values = chain.parameters
    mass, height = values["mass"], values["height"]
    alpha0, law = ALPHA0[building_type], {"law": chain.law, "hardening_ratio": float(values["hardening_ratio"][0])}
    elastic = wd.FlexuralShearBuilding(mass, height, period=chain.fundamental_period, alpha0=alpha0)
    stick, floors = elastic.stick, elastic.floor_heights
    loads = mass * floors
    moved = np.linalg.solve(stick.stiffness, loads * (values["yield_force"][0] / loads.sum()))
    of_frame = stick.storey_shear_stiffness * np.diff(moved, prepend=0.0)
    hinge = {
        "stiffness": HINGE_RATIO * float(stick.bending_stiffness[0]) / float(floors[-1]),
        "yield_force": float(floors @ stick.bending_matrix @ moved),
    }
    return wd.FlexuralShearBuilding(
        mass,
        height,
        period=chain.fundamental_period,
        alpha0=alpha0,
        base_hinge=hinge | law,
        force_outputs=False,
        yield_force=of_frame,
        damping="modal",  # Rayleigh damping would overdamp the high bending modes and need steps of 0.17 ms
        damping_ratio=float(values["damping_ratio"]),
        **law,
    )


def tall_archetypes() -> tuple[dict[str, wd.Archetype], dict[str, dict[str, float]]]:
    """Return the archetypes above MOST_CHAIN_STOREYS storeys by name, and their drift ratio limits [1].

    The factors of stiffness and strength are those of frame and base hinge; the bending stiffness is not random.
    """
    scatter = SCATTER | {"yield_force": replace(SCATTER["yield_force"], per="spring")}
    archetypes, limits = {}, {}
    for kind, (_, counts) in CITY.items():
        for storeys in (count for count in counts if count > MOST_CHAIN_STOREYS):
            for level in LEVELS.get(kind, LEVELS["others"]):
                name = f"{kind} {level} {storeys}"
                archetypes[name] = wd.Archetype(flexural_shear(kind, level, storeys), 1, scatter, CORRELATION)
                limits[name] = wd.hazus_drift_limits(kind, level)
    return archetypes, limits
