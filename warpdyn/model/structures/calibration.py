"""Shear buildings from properties of the whole building: a Hazus type, a capacity curve, or periods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws import Law
from warpdyn.engine.laws.lookup import law_name, laws_and_values
from warpdyn.foundations.core.checks import finite_numbers, one_of, whole_number
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.capacity.chains import capacity_chain
from warpdyn.model.structures.damping import DAMPING
from warpdyn.model.structures.hazus import hazus_chain
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_properties
from warpdyn.model.structures.periods import chain_of_periods
from warpdyn.model.structures.physics import storey_weight_over_height
from warpdyn.model.structures.structure import MAXIMUM_STOREYS


class CalibratedChain:
    """Constructors of a ShearBuilding from properties of the whole building."""

    @classmethod
    @suggests_names
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

        All storeys have the same mass (1,000 kg per m2 of floor area) and the same stiffness, chosen to give the
        type's first period. The storey strengths are the storey shears of a triangular load. Its base shear is the
        type's yield spectral acceleration times the effective mass of the first mode. Beyond the ultimate strength of
        the capacity curve, laws with a yield force and a hardening ratio continue to harden; `trilinear`,
        `quadrilinear`, `pinching4` and `hysteretic` have constant strength. `hysteretic` is the storey law of
        SimCenter's MDOF-LU, with its pinching and its reduced unloading stiffness. The type's period excludes P-Delta;
        a `gravity_load` makes the period longer. `hazus_drift_limits` returns the drift limits of damage states.

        Lu, Han, Hori, Xiong, Xu (2014), Advances in Engineering Software 70; Lu and Guan (2017), Earthquake Disaster
        Simulation of Civil Infrastructures; for MDOF-LU, Lu, McKenna, Cheng, Xu, Zeng, Mahin (2020), Earthquake Spectra
        36; numbers from FEMA's Hazus Earthquake Model Technical Manual.

        Args:
            building_type: One of the 36 model building types, such as "C1M".
            design_level: Design level: "high", "moderate" or "low" code, or "pre" (pre-code).
            storeys: Number of storeys, within the type's height class. Types with a single class (W1, W2, S3, PC1, MH)
                accept up to 50 storeys, but represent buildings with one or two storeys: for more storeys, periods
                and strengths are unrealistic.
            floor_area: Area of a floor [m2].
            law: Storey law. Its yield force, hardening ratio, corners and pinching, if it has these parameters, are set
                to the type's values.
            damping: As in ShearBuilding. If the damping has a damping ratio, the type's ratio is the default.
            **parameters: As in ShearBuilding: other parameters of the law, and values that replace those of the type.

        Raises:
            ValueError: If a name is unknown, the type does not have this number of storeys, or a value is invalid.

        Example:
            >>> building = wd.ShearBuilding.from_hazus("C1M", "high", storeys=5, law="hysteretic")
            >>> building.dofs, round(building.fundamental_period, 2)
            (5, 0.75)
        """
        _refuse_several_laws(law)
        chain = hazus_chain(building_type, design_level, storeys, floor_area, law_name(law))
        ratio = chain.pop("damping_ratio")
        one_of("damping", damping, DAMPING)
        if "damping_ratio" in DAMPING[damping].parameters:
            parameters = {"damping_ratio": ratio} | parameters
        return cls._from_chain(storeys, chain, law, damping, parameters)

    @classmethod
    @suggests_names
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
        law: str | type[Law] = "bilinear",
        softening: str = "one_storey",
        collapses_at_end: bool = False,
        damping: str = "none",
        **parameters: ArrayLike,
    ) -> Self:
        """Return a shear building whose capacity is a given pushover curve or capacity spectrum.

        Laws with a yield force and a hardening ratio (`bilinear`, `bouc_wen`, `takeda` ...) get a bilinear curve. It
        has the same area as the given curve up to its peak; a curve that consists of a yield and an ultimate point is
        used unchanged. The bilinear curve continues to rise beyond the peak. If the given curve falls more than 1 %
        below it, an error is raised.

        Laws with a backbone follow a curve of two to four points exactly; the first is the yield point:

        - `pinching4`: any curve that does not rise again after falling, except by up to 1 % at its last point, as in
          GEM's curves. If the curve has fewer than four points, corners are added on its last branch, as in GEM's
          toolkit. `**warpdyn.laws.GEM_DAMAGE` gives the damage parameters of that toolkit.
        - `hysteretic`: such a curve with two or three points; a fourth point must be at the residual strength.
        - `ibarra_medina_krawinkler_...` (IMK): yield point, capping point, and a point on the falling branch; a fourth
          point ends the constant residual strength, which begins at the third point and is below the yield strength.
          For a curve with two points, give the falling branch by `post_capping_drift`.
        - `trilinear` and `quadrilinear`: curves with up to three and four points that bend down at each point and do
          not fall. If the curve has fewer points, the backbone is level after the last point.

        In `hysteretic` and the IMK laws, if the forces of the last two points differ by at most 1 %, both get the mean
        force. Beyond the last point, a rising branch continues, unless `collapses_at_end` is True; a level branch
        stays level; a falling branch becomes level, or falls to zero force (IMK without residual strength).

        The curve is distributed over the storeys. Up to the peak, all storeys reach the points of the curve together:

        - "triangular", after Lu: all storeys have the same stiffness. Strengths are the storey shears of floor loads
          in proportion to mass times height above the ground. The building has the period and base shear of a given
          capacity spectrum; if it is pushed by these loads, it has exactly a given pushover curve.
        - "first_mode", after GEM's Vulnerability Modellers ToolKit: strengths and drifts follow the first mode of a
          chain with equal storey stiffnesses, which is then also the first mode of the building. The building has
          exactly the given curve, whether it is a pushover curve or a spectrum.
        - "frame" and "soft_storey", GEM's other shapes: as "first_mode", but the mode shape is the height to the power
          0.6 (up to 12 storeys), or the first mode of a chain whose first storey has 0.2 times the stiffness of others.

        Beyond the peak, only one equilibrium is stable: one storey softens and the others unload. `softening` defines
        the falling branches of the storeys:

        - "one_storey": if any one storey softens alone, the roof follows the curve. A `pushover` by the loads of the
          distribution then gives the curve up to its last point, exact to rounding. With damage, the other storeys
          unload more softly, and the curve differs (by less than 1 % for GEM's damage).
        - "every_storey", as in GEM's toolkit and Lu's model: the backbone of each storey is the whole curve, scaled.
          The roof follows the curve only if all storeys soften equally. In a pushover to the stable equilibrium, and
          in an earthquake, one storey softens alone, and the resistance of the building falls more steeply than the
          curve. The difference grows with the number of storeys.

        A warning is given if the building's period, strength or yield drift suggests that the curve is in mm, kN or g.

        The curve excludes P-Delta: a `gravity_load` lowers the building's curve.

        Lu, Han, Hori, Xiong, Xu (2014), Advances in Engineering Software 70; Martins, Silva, Crowley, Cavalieri (2021),
        Bulletin of Earthquake Engineering 19, and GEM's oq-vmtk.

        Args:
            displacement: Roof or spectral displacements [m], increasing, shape [point].
            capacity: Base shears [N] or spectral accelerations [m/s2] at these displacements, shape [point].
            storeys: Number of storeys.
            mass: Floor mass [kg], one value or one per storey.
            height: Storey height [m], one value or one per storey.
            curve: "pushover" (roof displacement and base shear) or "spectrum" (spectral displacement, acceleration).
            distribution: "triangular", "first_mode", "frame" or "soft_storey".
            law: Storey law, by its name or class.
            softening: Falling branches of the storeys, "one_storey" or "every_storey".
            collapses_at_end: Whether the building collapses if a storey's drift exceeds that at the curve's last
                point. This drift becomes the storey's `drift_capacity`, as in GEM's toolkit (OpenSees' MinMax).
            damping: As in ShearBuilding.
            **parameters: As in ShearBuilding, except parameters that follow from the curve (stiffness, yield force and
                others).

        Raises:
            ValueError: If the curve starts below zero, has a displacement that does not increase, has no yield point
                or stiffens; if the law cannot follow it; if a name is unknown; or if a parameter follows from the
                curve or is invalid.

        Example:
            >>> curve = [0.02, 0.10, 0.20, 0.40], [1.0e6, 1.5e6, 0.7e6, 0.7e6]  # m, N
            >>> building = wd.ShearBuilding.from_capacity(*curve, storeys=4, mass=1.0e5, height=3.0, law="pinching4")
            >>> round(building.fundamental_period, 2)
            0.47
        """
        if isinstance(law, Law):
            raise ValueError(
                f"law must be a name or a class here, such as {law.name!r}: its strength follows from the curve"
            )
        _refuse_several_laws(law)
        chain: dict[str, Any] = {**_masses_and_heights(storeys, mass, height)}
        found, end_drift = capacity_chain(
            displacement,
            capacity,
            chain["mass"],
            chain["height"],
            curve=curve,
            distribution=distribution,
            law=law_name(law),
            softening=softening,
            unloading_exponent=parameters.get("unloading_exponent", 0.0),
        )
        if collapses_at_end:
            found["drift_capacity"] = end_drift
        _refuse_determined(parameters, (*found, "hardening_ratio"), "the capacity curve")
        chain |= found
        _warn_of_implausible_curve(chain)
        return cls._from_chain(storeys, chain, law, damping, parameters)

    @classmethod
    @suggests_names
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
        """Return a shear building that has the given first periods.

        If one period is given, the stiffness distribution over the height is scaled to give this period. If several
        periods are given, the distribution is also modified, as smoothly as possible. With a `gravity_load`, the
        periods include P-Delta, and `distribution` describes the stiffness minus the P-Delta stiffness W / h (load on
        the storey divided by its height).

        Args:
            period: First period [s], or the periods of the first modes in decreasing order, at most one per storey.
            storeys: Number of storeys.
            mass: Floor mass [kg], one value or one per storey.
            height: Storey height [m], one value or one per storey.
            distribution: Stiffness over the storeys: "uniform", or "linear_mode", which makes the first mode a straight
                line (for equal heights: in proportion to the storey shears of a triangular load).
            law: Storey law.
            damping: As in ShearBuilding.
            **parameters: As in ShearBuilding, except the stiffness, which follows from the periods.

        Raises:
            ValueError: If periods do not decrease, no chain with these masses has these periods, a name is unknown, a
                stiffness is given, or a value is invalid.

        Example:
            >>> building = wd.ShearBuilding.from_periods([0.6, 0.22, 0.14], storeys=3, mass=1e5, height=3.0)
            >>> building.modal()["period"].round(2).values
            array([0.6 , 0.22, 0.14])
        """
        _refuse_determined(parameters, ("stiffness",), "the periods")
        chain = _masses_and_heights(storeys, mass, height)
        chain["stiffness"] = chain_of_periods(period, chain["mass"], chain["height"], distribution)
        if not (chain["stiffness"] > 0).all():
            raise ValueError("period is so long that a storey stiffness is 0: give period in s")
        if parameters.get("gravity_load") is not None:
            load = _one_per_storey("gravity_load", parameters["gravity_load"], len(chain["mass"]))
            chain["stiffness"] += storey_weight_over_height({"gravity_load": load, "height": chain["height"]})
        return cls._from_chain(storeys, chain, law, damping, parameters)

    @classmethod
    def _from_chain(
        cls,
        storeys: int,
        chain: Mapping[str, ArrayLike],
        law: str | Law | type[Law],
        damping: str,
        parameters: Mapping[str, ArrayLike],
    ) -> Self:
        """Return the ShearBuilding with the parameters of the law that `chain` and `parameters` contain.

        Values in `parameters`, which the user gave, replace values in `chain`, which were computed.
        """
        _refuse_several_laws(law)
        (law,), own = laws_and_values(law, parameters)
        taken = {"mass", "stiffness", "height", "drift_capacity", *law.parameters}
        values = {name: value for name, value in chain.items() if name in taken} | own | dict(parameters)
        if np.ndim(values["mass"]) == 0:
            values["mass"] = np.full(storeys, values["mass"])  # sets the number of storeys
        building: type[Any] = cls  # ShearBuilding
        return building(law=law, damping=damping, **values)


def _warn_of_implausible_curve(chain: Mapping[str, Any]) -> None:
    """Warn if the period, strength or yield drift of the chain suggest that the curve is not in m, N and m/s2."""
    findings = PlausibilityFindings()
    modes = modal_properties(chain["mass"], chain_stiffness_matrix(chain["stiffness"]))
    findings.add("capacity_period", float(modes["period"][0]))
    weight = STANDARD_GRAVITY * chain["mass"].sum()
    findings.add("capacity_base_shear_coefficient", chain["yield_force"][0] / weight)
    # The yield drift ratio of the roof is checked, because upper storeys may be weak in some distributions.
    roof_drift = (chain["yield_force"] / chain["stiffness"]).sum()
    findings.add("capacity_yield_drift_ratio", float(roof_drift / chain["height"].sum()))
    findings.warn()


def _masses_and_heights(storeys: int, mass: ArrayLike, height: ArrayLike) -> dict[str, np.ndarray]:
    """Return masses [kg] and heights [m] as arrays of shape [storey]; raise a ValueError if one is not above 0."""
    count = whole_number("storeys", storeys, 1, MAXIMUM_STOREYS)
    chain = {name: _one_per_storey(name, value, count) for name, value in {"mass": mass, "height": height}.items()}
    for name, array in chain.items():
        for storey in np.flatnonzero(array <= 0):
            raise ValueError(f"{name} is {array[storey]:g} at storey {storey + 1}; it must be finite and above 0")
    return chain


def _one_per_storey(name: str, value: ArrayLike, storeys: int) -> np.ndarray:
    """Return an array with one finite number per storey, from a single number or from one number per storey."""
    array = finite_numbers(name, value)
    if array.shape not in ((), (storeys,)):
        raise ValueError(f"{name} must be one value or one per storey ({storeys}), got shape {array.shape}")
    return np.array(np.broadcast_to(array, storeys))


def _refuse_several_laws(law: object) -> None:
    """Raise a ValueError if `law` is a list of laws, one per storey, which these constructors do not accept."""
    if isinstance(law, list | tuple):
        raise ValueError(
            f"law must be one name here, such as 'bilinear', got {law!r}: for storeys with different laws use "
            "ShearBuilding(law=[...])"
        )


def _refuse_determined(parameters: Mapping[str, ArrayLike], determined: tuple[str, ...], source: str) -> None:
    """Raise a ValueError if the user gave a parameter that is computed from `source`, such as the capacity curve."""
    for name in determined:
        if name in parameters:
            raise ValueError(f"{name} follows from {source}: remove {name}=, or use ShearBuilding({name}=...)")
