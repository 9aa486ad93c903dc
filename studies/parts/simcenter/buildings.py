"""Twenty Hazus buildings of 1 to 20 storeys, as warpdyn and as SimCenter's MDOF-LU have them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import warpdyn as wd
from warpdyn.model.structures.hazus import building_class

SMALL, LARGE = 150.0, 900.0  # plan area of a storey [m2], up to two storeys and beyond
# MDOF-LU's fits over the storeys N: share of the mass in the first mode; stiffness over mass and squared frequency.
MASS_SHARE = np.polynomial.Polynomial([0.8106, 0.402, -0.3037, 0.09117])  # of 1 / N
STIFFNESS_FACTOR = np.polynomial.Polynomial([0.1869, 0.405, 0.4053])  # of N
GRAVITY = 9.8  # m/s2, as in MDOF-LU


@dataclass(frozen=True)
class Building:
    """A building of the inventory.

    Args:
        building_type: One of the 36 Hazus types.
        design_level: "high", "moderate", "low" or "pre".
        storeys: Their number.
    """

    building_type: str
    design_level: str
    storeys: int

    @property
    def name(self) -> str:
        """Name in tables."""
        return f"{self.building_type} {self.design_level} {self.storeys}"

    @property
    def plan_area(self) -> float:
        """Area of a storey [m2]."""
        return SMALL if self.storeys <= 2 else LARGE


BUILDINGS = tuple(
    Building(*values)
    for values in (
        ("W1", "high", 1),
        ("URML", "pre", 1),
        ("MH", "low", 1),
        ("W1", "moderate", 2),
        ("RM1L", "low", 2),
        ("W2", "high", 3),
        ("S2L", "low", 3),
        ("C2L", "moderate", 3),
        ("C3M", "pre", 4),
        ("RM2M", "high", 5),
        ("C1M", "high", 5),
        ("S4M", "pre", 6),
        ("C2M", "moderate", 7),
        ("S1H", "high", 8),
        ("C1H", "moderate", 9),
        ("S5H", "low", 10),
        ("S4H", "high", 12),
        ("PC2H", "moderate", 14),
        ("C2H", "low", 16),
        ("S1H", "moderate", 20),
    )
)


@dataclass(frozen=True, eq=False)
class MultiStoreyModel:
    """Model of a building by MDOF-LU for OpenSees: Lu et al. 2014, Advances in Engineering Software 70.

    Args:
        mass: Floor mass [kg].
        stiffness: Storey stiffness [N/m].
        height: Storey height [m].
        yield_force: Yield force of the storeys [N], shape [storey].
        yield_drift: Yield drift of the storeys [m], shape [storey].
        ultimate_force: Ultimate force of the storeys [N], shape [storey]; constant at larger drifts.
        ultimate_drift: Drift at the ultimate force [m], shape [storey].
        pinching: Pinching factor of drift and force in reloading [1].
        unloading_exponent: Exponent of the ductility in the unloading stiffness [1].
        damping_ratio: Damping ratio of Rayleigh damping [1].
    """

    mass: float
    stiffness: float
    height: float
    yield_force: np.ndarray
    yield_drift: np.ndarray
    ultimate_force: np.ndarray
    ultimate_drift: np.ndarray
    pinching: float
    unloading_exponent: float
    damping_ratio: float


def multi_storey_model(building: Building) -> MultiStoreyModel:
    """Return a building as MDOF-LU makes it of its Hazus type, by its own fits."""
    n, row = building.storeys, building_class(building.building_type, building.design_level)
    mass = 1000.0 * building.plan_area
    period = n * row["period_per_storey_s"]
    stiffness = (2 * np.pi / period) ** 2 * STIFFNESS_FACTOR(n) * mass
    base_shear = row["yield_spectral_acceleration_g"] * GRAVITY * n * mass * (MASS_SHARE(1 / n) if n > 1 else 1.0)
    storey = np.arange(1, n + 1)
    yield_force = base_shear * (1 - storey * (storey - 1) / (n * (n + 1)))
    return MultiStoreyModel(
        mass=mass,
        stiffness=stiffness,
        height=row["storey_height_m"],
        yield_force=yield_force,
        yield_drift=yield_force / stiffness,
        ultimate_force=row["overstrength_ratio"] * yield_force,
        ultimate_drift=yield_force / stiffness * (1 + (row["overstrength_ratio"] - 1) / row["hardening_ratio"]),
        pinching=row["pinching"],
        unloading_exponent=row["unloading_exponent"],
        damping_ratio=row["damping_ratio"],
    )


def shear_building(building: Building) -> wd.ShearBuilding:
    """Return a building as warpdyn has it, with the stiffness of MDOF-LU's fit and the damping of R2D's models.

    The fit is 0.3 % below the stiffness of `from_hazus` at one storey and within 0.01 % of it elsewhere.
    docs/coming_from/r2d.md explains the damping.
    """
    of_type = building.building_type, building.design_level, building.storeys
    given = {"floor_area": building.plan_area, "law": "hysteretic", "damping": "mass_proportional"}
    given |= {"stiffness": multi_storey_model(building).stiffness}
    whole = wd.ShearBuilding.from_hazus(*of_type, **given)
    frequency = whole.modal()["circular_frequency"].values
    left = frequency[-1] / (frequency[0] + frequency[-1])
    return wd.ShearBuilding.from_hazus(*of_type, **given, damping_ratio=left * whole.parameters["damping_ratio"])
