"""Buildings from properties of the whole building: a Hazus type, a capacity curve, periods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.core.checks import finite_numbers, one_of, whole_number
from warpdyn.core.plausibility import Findings
from warpdyn.core.units import STANDARD_GRAVITY
from warpdyn.laws import LAWS, Law
from warpdyn.laws.lookup import laws_and_values
from warpdyn.structures.capacity_curves import capacity_chain
from warpdyn.structures.damping import DAMPING
from warpdyn.structures.hazus import hazus_chain
from warpdyn.structures.modal import chain_stiffness_matrix, modal_properties
from warpdyn.structures.periods import chain_of_periods
from warpdyn.structures.physics import storey_weight_over_height


class CalibratedChain:
    """Constructors of a ShearBuilding from properties of the whole building."""

    @classmethod
    def from_hazus(
        cls,
        building_type: str,
        design_level: str,
        storeys: int,
        *,
        floor_area: float = 1000.0,
        law: str | Law = "bilinear",
        damping: str = "rayleigh",
        **parameters: ArrayLike,
    ) -> Self:
        """Return the shear building for one of the 36 Hazus types, after Lu's MDOF model.

        Storeys have one mass (1,000 kg/m2) and one stiffness, which give the type's first period; their strengths are
        the storey shears of a triangular load whose base shear is the type's yield spectral acceleration times the
        mass in the first mode. A bilinear law does not represent the ultimate strength of the capacity curve.
        `hazus_drift_limits` gives the limits of the damage states. The type's period is that without P-Delta: a
        `gravity_load` makes the building's own period longer.

        Lu, Han, Hori, Xiong, Xu (2014), Advances in Engineering Software 70; Lu and Guan (2017), Earthquake Disaster
        Simulation of Civil Infrastructures; numbers from FEMA's Hazus Earthquake Model Technical Manual.

        Args:
            building_type: One of the 36 model building types, such as "C1M".
            design_level: "high", "moderate", "low" or "pre" (code).
            storeys: Number of storeys, within the type's class of heights. Types of a single class (W1, W2, S3, PC1,
                MH) are accepted up to 50 storeys, although Hazus means one or two: periods and strengths are then
                unrealistic.
            floor_area: Area of a floor [m2].
            law: Storey law; it takes yield force and hardening ratio as far as it has them.
            damping: As of ShearBuilding; a damping that takes a damping ratio takes the type's.
            **parameters: As of ShearBuilding: other parameters of the law, and values that replace the type's.

        Raises:
            ValueError: If a name is unknown, the type has no such number of storeys, or ShearBuilding refuses a value.
        """
        chain = hazus_chain(building_type, design_level, storeys, floor_area)
        ratio = chain.pop("damping_ratio")
        one_of("damping", damping, DAMPING)
        if "damping_ratio" in DAMPING[damping].parameters:
            parameters = {"damping_ratio": ratio} | parameters
        return cls._from_chain(storeys, chain, law, damping, parameters)

    @classmethod
    def from_capacity(
        cls,
        displacement: ArrayLike,
        capacity: ArrayLike,
        storeys: int,
        mass: ArrayLike,
        height: ArrayLike,
        *,
        curve: str = "pushover",
        distribution: str = "triangular",
        law: str | Law = "bilinear",
        damping: str = "none",
        **parameters: ArrayLike,
    ) -> Self:
        """Return a chain whose capacity is a given pushover curve or capacity spectrum.

        The curve up to its peak is replaced by the bilinear curve of the same area (a curve of a yield and an ultimate
        point is kept) and distributed over the storeys, which all yield at once under the assumed lateral loads:

        - "triangular", after Lu: all storeys have one stiffness, and strengths are the storey shears of floor loads
          mass times height above the ground. The chain has the capacity spectrum's period and base shear, or, pushed by
          these loads, the pushover curve itself.
        - "first_mode", after GEM's Vulnerability Modellers ToolKit: strengths and drifts are those of the first mode of
          a chain of equal stiffness. This mode is then the chain's own, and it has the curve exactly, in both forms.

        A warning names a chain whose period, strength or yield drift seems to come of a curve in mm, kN or g.

        The curve is that without P-Delta: with a `gravity_load` the building's own curve lies below it.

        Args:
            displacement: Roof displacements [m], or spectral ones; increasing, shape [point].
            capacity: Base shears [N], or spectral accelerations [m/s2], at these, shape [point].
            storeys: Number of storeys.
            mass: Floor mass [kg], one value or one a storey.
            height: Storey height [m], one value or one a storey.
            curve: "pushover" (roof displacement and base shear) or "spectrum" (spectral displacement, acceleration).
            distribution: "triangular" or "first_mode".
            law: Storey law; it takes yield force and hardening ratio as far as it has them.
            damping: As of ShearBuilding.
            **parameters: As of ShearBuilding, except stiffness, yield force and hardening ratio.

        Raises:
            ValueError: If the curve starts below zero, folds back, has no yield point or stiffens, a name is unknown,
                a parameter is given that follows from the curve, or ShearBuilding refuses a value.
        """
        _refuse_determined(parameters, ("stiffness", "yield_force", "hardening_ratio"), "the capacity curve")
        if isinstance(law, Law):
            raise ValueError(
                f"law must be a name or a class here, such as {law.name!r}: its strength follows from the curve"
            )
        chain: dict[str, Any] = {**_masses_and_heights(storeys, mass, height)}
        chain |= capacity_chain(displacement, capacity, chain["mass"], chain["height"], curve, distribution)
        _warn_of_implausible_curve(chain)
        return cls._from_chain(storeys, chain, law, damping, parameters)

    @classmethod
    def from_periods(
        cls,
        period: ArrayLike,
        storeys: int,
        mass: ArrayLike,
        height: ArrayLike,
        *,
        distribution: str = "uniform",
        law: str | Law = "elastic",
        damping: str = "none",
        **parameters: ArrayLike,
    ) -> Self:
        """Return a chain that has given first periods.

        One period scales a distribution of stiffness over the height. Several periods also modify the distribution, as
        smoothly as they allow. With a `gravity_load` they are the periods with P-Delta, and the distribution is that
        of the stiffness less the P-Delta stiffness.

        Args:
            period: First period [s], or the periods of the first modes, falling, as many as storeys at most.
            storeys: Number of storeys.
            mass: Floor mass [kg], one value or one a storey.
            height: Storey height [m], one value or one a storey.
            distribution: Of the stiffness over the storeys: "uniform", or "linear_mode", which makes the first mode a
                straight line (in storeys of one height: in proportion to the storey shears of a triangular load).
            law: Storey law.
            damping: As of ShearBuilding.
            **parameters: As of ShearBuilding, except the stiffness; the strength of the law is one of them.

        Raises:
            ValueError: If periods do not fall, no chain of these masses has them, a name is unknown, a stiffness is
                given, or ShearBuilding refuses a value.
        """
        _refuse_determined(parameters, ("stiffness",), "the periods")
        chain = _masses_and_heights(storeys, mass, height)
        chain["stiffness"] = chain_of_periods(period, chain["mass"], chain["height"], distribution)
        if parameters.get("gravity_load") is not None:
            load = _one_per_storey("gravity_load", parameters["gravity_load"], len(chain["mass"]))
            chain["stiffness"] += storey_weight_over_height({"gravity_load": load, "height": chain["height"]})
        return cls._from_chain(storeys, chain, law, damping, parameters)

    @classmethod
    def _from_chain(
        cls,
        storeys: int,
        chain: Mapping[str, ArrayLike],
        law: str | Law,
        damping: str,
        parameters: Mapping[str, ArrayLike],
    ) -> Self:
        """Build the chain with the values that the law takes; the caller's parameters replace them."""
        if isinstance(law, list | tuple):
            raise ValueError(
                f"law must be one name here, as 'bilinear', got {law!r}: build the ShearBuilding directly where "
                "storeys differ in their laws"
            )
        (law,), own = laws_and_values(law, parameters)
        taken = {"mass", "stiffness", "height", *LAWS[law].parameters}
        values = {name: value for name, value in chain.items() if name in taken} | own | dict(parameters)
        if np.ndim(values["mass"]) == 0:
            values["mass"] = np.full(storeys, values["mass"])  # says how many storeys there are, whatever else is given
        building: type[Any] = cls  # a ShearBuilding, which this is a part of
        return building(law=law, damping=damping, **values)


def _warn_of_implausible_curve(chain: Mapping[str, Any]) -> None:
    """Warn if a chain's period or yield drift seems to be of a capacity curve in other units than m, N and m/s2."""
    findings = Findings()
    modes = modal_properties(chain["mass"], chain_stiffness_matrix(chain["stiffness"]))
    findings.add("capacity_period", float(modes["period"][0]))
    weight = STANDARD_GRAVITY * chain["mass"].sum()
    findings.add("capacity_base_shear_coefficient", chain["yield_force"][0] / weight)
    ratio = chain["yield_force"] / chain["stiffness"] / chain["height"]
    findings.add("capacity_yield_drift_ratio", ratio, along="storey")
    findings.warn()


def _masses_and_heights(storeys: int, mass: ArrayLike, height: ArrayLike) -> dict[str, np.ndarray]:
    """Return masses and heights, one for each storey."""
    count = whole_number("storeys", storeys, 1)
    chain = {name: _one_per_storey(name, value, count) for name, value in {"mass": mass, "height": height}.items()}
    for name, array in chain.items():
        for storey in np.flatnonzero(array <= 0):
            raise ValueError(f"{name} is {array[storey]:g} at storey {storey + 1}; it must be finite and above 0")
    return chain


def _one_per_storey(name: str, value: ArrayLike, storeys: int) -> np.ndarray:
    """Return finite numbers, one for each storey."""
    array = finite_numbers(name, value)
    if array.shape not in ((), (storeys,)):
        raise ValueError(f"{name} must be one value or one a storey ({storeys}), got shape {array.shape}")
    return np.array(np.broadcast_to(array, storeys))


def _refuse_determined(parameters: Mapping[str, ArrayLike], determined: tuple[str, ...], source: str) -> None:
    """Raise a ValueError if a parameter is given that is derived from a source."""
    for name in determined:
        if name in parameters:
            raise ValueError(f"{name} follows from {source}; leave it out, or build the ShearBuilding of it directly")
