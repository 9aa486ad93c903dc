"""Buildings from properties of the whole building: a Hazus type, a capacity curve, periods."""

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

        All storeys have the same mass (1,000 kg/m2) and stiffness, which give the type's first period. Strengths are
        the storey shears of a triangular load whose base shear is the type's yield spectral acceleration times the
        mass in the first mode. Laws with a yield force and a hardening ratio continue to harden beyond the ultimate
        strength of the capacity curve; `trilinear`, `quadrilinear`, `pinching4` and `hysteretic` stay at it.
        `hysteretic` is the storey of SimCenter's MDOF-LU, with its pinching and softer unloading. The type's period is
        that without P-Delta; a `gravity_load` makes it longer. `hazus_drift_limits` gives limits of damage states.

        Lu, Han, Hori, Xiong, Xu (2014), Advances in Engineering Software 70; Lu and Guan (2017), Earthquake Disaster
        Simulation of Civil Infrastructures; for MDOF-LU, Lu, McKenna, Cheng, Xu, Zeng, Mahin (2020), Earthquake Spectra
        36; numbers from FEMA's Hazus Earthquake Model Technical Manual.

        Args:
            building_type: One of the 36 model building types, such as "C1M".
            design_level: "high", "moderate", "low" or "pre" (code).
            storeys: Number of storeys, within the type's height class. Types with a single class (W1, W2, S3, PC1, MH)
                accept up to 50 storeys, but are meant for one or two: beyond, periods and strengths are unrealistic.
            floor_area: Area of a floor [m2].
            law: Storey law; it gets those of the yield force, hardening ratio, corners and pinching that it has.
            damping: As in ShearBuilding; a damping with a damping ratio gets the type's ratio.
            **parameters: As in ShearBuilding: other parameters of the law, and values that replace the type's.

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
        """Return a chain whose capacity is a given pushover curve or capacity spectrum.

        Laws with a yield force and a hardening ratio (`bilinear`, `bouc_wen`, `takeda` ...) get the bilinear curve with
        the area of the given one up to its peak; a curve of a yield and an ultimate point is kept. They continue to
        rise beyond the peak. An error is raised if the given curve falls more than 1 % below them.

        Laws with a backbone follow a curve of two to four points, yield first, exactly:

        - `pinching4`: any curve that does not rise again after falling, except by 1 % at its last point, as GEM's
          curves do. Missing corners are on the last branch, as in GEM's toolkit. `**warpdyn.laws.GEM_DAMAGE` is that
          toolkit's damage.
        - `hysteretic`: the same curves of two or three points, and a fourth point of residual strength.
        - `ibarra_medina_krawinkler_...`: yield, capping point, a point on the falling branch, and a fourth point of
          residual strength, which begins at the third and is below yield. With two points, give the falling branch by
          `post_capping_drift`.
        - `trilinear` and `quadrilinear`: three and four points that bend down and do not fall; with fewer points the
          backbone is level after the last.

        In `hysteretic` and the IMK laws, two last points within 1 % of each other become level, at their mean. Beyond
        the last point a rising branch continues, unless `collapses_at_end`; others are level, or fall to zero force
        (IMK without residual strength).

        The curve is distributed over the storeys, which reach its points together up to the peak:

        - "triangular", after Lu: all storeys have the same stiffness, and strengths are the storey shears of floor
          loads mass times height above the ground. The chain has the period and base shear of a capacity spectrum, or
          exactly the pushover curve if it is pushed by these loads.
        - "first_mode", after GEM's Vulnerability Modellers ToolKit: strengths and drifts are those of the first mode of
          a chain of equal stiffness. This is also the first mode of the result, whose curve is exact in both forms.
        - "frame" and "soft_storey", GEM's other shapes: as "first_mode", with the height to the power 0.6 as mode (up
          to 12 storeys), or the mode of a chain whose first storey has a fifth of the others' stiffness.

        Beyond the peak the only stable equilibrium is that one storey softens and the others unload. With `softening`
        "one_storey", therefore, each storey gets the falling branch with which the roof follows the curve if this
        storey softens alone. `pushover` by the distribution's loads then repeats the curve up to its last point, to
        rounding, for any softening storey, except that unloading is softer with damage (GEM's damage shifts the curve
        by less than 1 %). With "every_storey", as in GEM's toolkit and Lu's model, each storey's backbone is the whole
        curve in proportion, and the roof follows the curve if all storeys soften alike. In a pushover that finds the
        stable equilibrium, and in an earthquake, one storey softens alone, and the building's resistance falls more
        steeply than the curve; the difference grows with the number of storeys.

        A warning is given if the chain's period, strength or yield drift suggests a curve in mm, kN or g.

        The curve is that without P-Delta: a `gravity_load` lowers the building's curve.

        Lu, Han, Hori, Xiong, Xu (2014), Advances in Engineering Software 70; Martins, Silva, Crowley, Cavalieri (2021),
        Bulletin of Earthquake Engineering 19, and GEM's oq-vmtk.

        Args:
            displacement: Roof displacements [m], or spectral ones; increasing, shape [point].
            capacity: Base shears [N], or spectral accelerations [m/s2], at these, shape [point].
            storeys: Number of storeys.
            mass: Floor mass [kg], one value or one per storey.
            height: Storey height [m], one value or one per storey.
            curve: "pushover" (roof displacement and base shear) or "spectrum" (spectral displacement, acceleration).
            distribution: "triangular", "first_mode", "frame" or "soft_storey".
            law: Storey law, by its name or class.
            softening: Beyond the peak, "one_storey" or "every_storey".
            collapses_at_end: Whether the building collapses if a storey exceeds its drift at the curve's last point,
                which becomes the `drift_capacity`, as in GEM's toolkit (OpenSees' MinMax).
            damping: As in ShearBuilding.
            **parameters: As in ShearBuilding, except stiffness, yield force and others that follow from the curve.

        Raises:
            ValueError: If the curve starts below zero, folds back, has no yield point or stiffens, the law cannot
                follow it, a name is unknown, a parameter is given that follows from the curve, or a value is invalid.

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
        """Return a chain that has given first periods.

        One period scales a distribution of stiffness over the height. Several periods also modify the distribution, as
        smoothly as possible. With a `gravity_load` the periods include P-Delta, and the distribution is that of the
        stiffness less the P-Delta stiffness.

        Args:
            period: First period [s], or decreasing periods of the first modes, at most one per storey.
            storeys: Number of storeys.
            mass: Floor mass [kg], one value or one per storey.
            height: Storey height [m], one value or one per storey.
            distribution: Stiffness over the storeys: "uniform", or "linear_mode", which makes the first mode a straight
                line (for equal heights: in proportion to the storey shears of a triangular load).
            law: Storey law.
            damping: As in ShearBuilding.
            **parameters: As in ShearBuilding, except the stiffness; they include the strength of the law.

        Raises:
            ValueError: If periods do not decrease, no chain of these masses has them, a name is unknown, a stiffness is
                given, or a value is invalid.

        Example:
            >>> building = wd.ShearBuilding.from_periods([0.6, 0.22, 0.14], storeys=3, mass=1e5, height=3.0)
            >>> building.modal()["period"].round(2).values
            array([0.6 , 0.22, 0.14])
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
        law: str | Law | type[Law],
        damping: str,
        parameters: Mapping[str, ArrayLike],
    ) -> Self:
        """Build the chain with those of its values that the law takes; the caller's parameters replace them."""
        _refuse_several_laws(law)
        (law,), own = laws_and_values(law, parameters)
        taken = {"mass", "stiffness", "height", "drift_capacity", *law.parameters}
        values = {name: value for name, value in chain.items() if name in taken} | own | dict(parameters)
        if np.ndim(values["mass"]) == 0:
            values["mass"] = np.full(storeys, values["mass"])  # sets the number of storeys
        building: type[Any] = cls  # ShearBuilding
        return building(law=law, damping=damping, **values)


def _warn_of_implausible_curve(chain: Mapping[str, Any]) -> None:
    """Warn if a chain's period, strength or yield drift suggests a capacity curve in other units than m, N and m/s2."""
    findings = PlausibilityFindings()
    modes = modal_properties(chain["mass"], chain_stiffness_matrix(chain["stiffness"]))
    findings.add("capacity_period", float(modes["period"][0]))
    weight = STANDARD_GRAVITY * chain["mass"].sum()
    findings.add("capacity_base_shear_coefficient", chain["yield_force"][0] / weight)
    # The yield drift of the roof, because upper storeys may be weak in some distributions.
    roof_drift = (chain["yield_force"] / chain["stiffness"]).sum()
    findings.add("capacity_yield_drift_ratio", float(roof_drift / chain["height"].sum()))
    findings.warn()


def _masses_and_heights(storeys: int, mass: ArrayLike, height: ArrayLike) -> dict[str, np.ndarray]:
    """Return masses and heights, one for each storey."""
    count = whole_number("storeys", storeys, 1, MAXIMUM_STOREYS)
    chain = {name: _one_per_storey(name, value, count) for name, value in {"mass": mass, "height": height}.items()}
    for name, array in chain.items():
        for storey in np.flatnonzero(array <= 0):
            raise ValueError(f"{name} is {array[storey]:g} at storey {storey + 1}; it must be finite and above 0")
    return chain


def _one_per_storey(name: str, value: ArrayLike, storeys: int) -> np.ndarray:
    """Return finite numbers, one for each storey."""
    array = finite_numbers(name, value)
    if array.shape not in ((), (storeys,)):
        raise ValueError(f"{name} must be one value or one per storey ({storeys}), got shape {array.shape}")
    return np.array(np.broadcast_to(array, storeys))


def _refuse_several_laws(law: object) -> None:
    """Raise a ValueError if several laws are given."""
    if isinstance(law, list | tuple):
        raise ValueError(
            f"law must be one name here, such as 'bilinear', got {law!r}: for storeys with different laws use "
            "ShearBuilding(law=[...])"
        )


def _refuse_determined(parameters: Mapping[str, ArrayLike], determined: tuple[str, ...], source: str) -> None:
    """Raise a ValueError if a parameter is given that follows from a source."""
    for name in determined:
        if name in parameters:
            raise ValueError(f"{name} follows from {source}: remove {name}=, or use ShearBuilding({name}=...)")
