"""Twenty Hazus buildings of 1 to 20 storeys, as models of warpdyn and as models of SimCenter's MDOF-LU."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import warpdyn as wd
from warpdyn.model.structures.hazus import building_class

SMALL, LARGE = 150.0, 900.0  # plan area of a storey [m2]: up to two storeys, and more than two storeys
# Polynomials that MDOF-LU uses for a building of N storeys. MASS_SHARE: share of the mass in the first mode, as a
# function of 1 / N. STIFFNESS_FACTOR: stiffness divided by mass and by squared frequency, as a function of N.
MASS_SHARE = np.polynomial.Polynomial([0.8106, 0.402, -0.3037, 0.09117])
STIFFNESS_FACTOR = np.polynomial.Polynomial([0.1869, 0.405, 0.4053])
GRAVITY = 9.8  # m/s2, the value in MDOF-LU


@dataclass(frozen=True)
class Building:
    """Building of the inventory, given by type, design level and number of storeys.

    Args:
        building_type: One of the 36 building types of Hazus, such as "C1M".
        design_level: Seismic design level: "high", "moderate", "low" or "pre".
        storeys: Number of storeys.
    """

    building_type: str
    design_level: str
    storeys: int

    @property
    def name(self) -> str:
        """Name of the building in tables, such as "C1M high 5"."""
        return f"{self.building_type} {self.design_level} {self.storeys}"

    @property
    def plan_area(self) -> float:
        """Plan area of a storey [m2]."""
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
    """Model that MDOF-LU creates for OpenSees: Lu et al. 2014, Advances in Engineering Software 70.

    Args:
        mass: Mass of each floor [kg].
        stiffness: Initial stiffness of each storey [N/m].
        height: Height of each storey [m].
        yield_force: Yield force of the storeys [N], shape [storey].
        yield_drift: Yield drift of the storeys [m], shape [storey].
        ultimate_force: Ultimate force of the storeys [N], shape [storey]; the force is constant at larger drifts.
        ultimate_drift: Drift at the ultimate force [m], shape [storey].
        pinching: Pinching factor of drift and force during reloading [1].
        unloading_exponent: Exponent of the ductility in the formula of the unloading stiffness [1].
        damping_ratio: Ratio of Rayleigh damping [1].
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
    """Return the model of a building that MDOF-LU creates from the Hazus type, with the polynomials of MDOF-LU."""
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
    """Return a building as a model of warpdyn, with the stiffness of MDOF-LU and the damping of the models in R2D.

    The stiffness of MDOF-LU is 0.3 % below the stiffness of `from_hazus` for one storey, and within 0.01 % of it for
    other buildings. docs/coming_from/r2d.md explains the damping.
    """
    of_type = building.building_type, building.design_level, building.storeys
    given = {"floor_area": building.plan_area, "law": "hysteretic", "damping": "mass_proportional"}
    given |= {"stiffness": multi_storey_model(building).stiffness}
    whole = wd.ShearBuilding.from_hazus(*of_type, **given)
    frequency = whole.modal()["circular_frequency"].values
    left = frequency[-1] / (frequency[0] + frequency[-1])
    return wd.ShearBuilding.from_hazus(*of_type, **given, damping_ratio=left * whole.parameters["damping_ratio"])
