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

        Storeys have one mass (1,000 kg/m2) and one stiffness, which give the type's first period; their strengths are
        the storey shears of a triangular load whose base shear is the type's yield spectral acceleration times the
        mass in the first mode. Laws of a yield force and a hardening ratio go on hardening beyond the ultimate strength
        of the capacity curve; `trilinear`, `quadrilinear`, `pinching4` and `hysteretic` stay at it, and `hysteretic`
        is the storey of SimCenter's MDOF-LU, with its pinching and softer unloading. `hazus_drift_limits` gives the
        limits of the damage states. The type's period is that without P-Delta: a `gravity_load` makes the building's
        own period longer.

        Lu, Han, Hori, Xiong, Xu (2014), Advances in Engineering Software 70; Lu and Guan (2017), Earthquake Disaster
        Simulation of Civil Infrastructures; Lu, McKenna, Cheng, Xu, Zeng, Mahin (2020), Earthquake Spectra 36, of
        MDOF-LU; numbers from FEMA's Hazus Earthquake Model Technical Manual.

        Args:
            building_type: One of the 36 model building types, such as "C1M".
            design_level: "high", "moderate", "low" or "pre" (code).
            storeys: Number of storeys, within the type's class of heights. Types of a single class (W1, W2, S3, PC1,
                MH) are accepted up to 50 storeys, although Hazus means one or two: periods and strengths are then
                unrealistic.
            floor_area: Area of a floor [m2].
            law: Storey law; it takes yield force, hardening ratio, corners and pinching as far as it has them.
            damping: As of ShearBuilding; a damping that takes a damping ratio takes the type's.
            **parameters: As of ShearBuilding: other parameters of the law, and values that replace the type's.

        Raises:
            ValueError: If a name is unknown, the type has no such number of storeys, or ShearBuilding refuses a value.

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

        Laws of a yield force and a hardening ratio (`bilinear`, `bouc_wen`, `takeda` ...) take the bilinear curve that
        has the area of the given one up to its peak (a curve of a yield and an ultimate point is kept), and go on
        rising beyond it: a curve that they leave by more than 1 % after its peak is refused.

        Laws with a backbone follow a curve of two to four points, yield first, point by point:

        - `pinching4`: any that does not rise again once it fell, but for 1 % at its last point, as GEM's curves do.
          Missing corners lie on the last branch, where GEM's toolkit has them. `**warpdyn.laws.GEM_DAMAGE` is that
          toolkit's damage.
        - `hysteretic`: the same of two or three points, and a last one of residual strength.
        - `ibarra_medina_krawinkler_...`: yield, capping point, a point of the falling branch, and a last one that makes
          the one before the beginning of the residual strength, below yield. With two points the falling branch is
          the caller's, `post_capping_drift`.
        - `trilinear` and `quadrilinear`: three and four points that bend down and do not fall; with fewer they are
          level after the last.

        A last pair of points within 1 % of each other is level in `hysteretic` and the IMK laws, at the pair's mean.
        Beyond the last point a branch that rises goes on, unless `collapses_at_end`; others are level, or fall to no
        force (IMK without residual strength).

        The curve is distributed over the storeys, which all come to its points at once up to the peak:

        - "triangular", after Lu: all storeys have one stiffness, and strengths are the storey shears of floor loads
          mass times height above the ground. The chain has the capacity spectrum's period and base shear, or, pushed by
          these loads, the pushover curve itself.
        - "first_mode", after GEM's Vulnerability Modellers ToolKit: strengths and drifts are those of the first mode of
          a chain of equal stiffness. This mode is then the chain's own, and it has the curve exactly, in both forms.
        - "frame" and "soft_storey", GEM's other shapes, likewise: the first mode is the height to the power 0.6, up to
          12 storeys, or that of a chain whose first storey has a fifth of the others' stiffness.

        Beyond the peak one storey softens and the others unload: that is the only balance that lasts. So with
        `softening` "one_storey" each storey's falling branch is the one by which the roof follows the curve if that
        storey softens alone. `pushover` by the distribution's loads then gives the curve again up to its last point:
        to rounding, whichever storey softens, but for storeys that unload softer than at first by damage, which it
        leaves out (GEM's shifts the curve by less than 1 %). With "every_storey", as GEM's toolkit and Lu's model have
        it, each storey's backbone is the whole curve in proportion. The roof follows the curve if all storeys soften
        alike, as they do where the first tangent is followed; a push that finds the lasting balance, or an earthquake,
        makes one storey soften alone, and the building falls more steeply than the curve, the more so the more storeys
        it has.

        A warning names a chain whose period, strength or yield drift seems to come of a curve in mm, kN or g.

        The curve is that without P-Delta: with a `gravity_load` the building's own curve lies below it.

        Lu, Han, Hori, Xiong, Xu (2014), Advances in Engineering Software 70; Martins, Silva, Crowley, Cavalieri (2021),
        Bulletin of Earthquake Engineering 19, and GEM's oq-vmtk.

        Args:
            displacement: Roof displacements [m], or spectral ones; increasing, shape [point].
            capacity: Base shears [N], or spectral accelerations [m/s2], at these, shape [point].
            storeys: Number of storeys.
            mass: Floor mass [kg], one value or one a storey.
            height: Storey height [m], one value or one a storey.
            curve: "pushover" (roof displacement and base shear) or "spectrum" (spectral displacement, acceleration).
            distribution: "triangular", "first_mode", "frame" or "soft_storey".
            law: Storey law, by its name or class.
            softening: Beyond the peak, "one_storey" or "every_storey".
            collapses_at_end: Whether a storey that passes its drift at the curve's last point makes the building
                collapse, as in GEM's toolkit (OpenSees' MinMax): the chain's `drift_capacity`.
            damping: As of ShearBuilding.
            **parameters: As of ShearBuilding, except stiffness, yield force and what else follows from the curve.

        Raises:
            ValueError: If the curve starts below zero, folds back, has no yield point or stiffens, or the law cannot
                follow it, a name is unknown, a parameter is given that follows from the curve, or ShearBuilding refuses
                a value.

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
        """Build the chain with the values that the law takes; the caller's parameters replace them."""
        _refuse_several_laws(law)
        (law,), own = laws_and_values(law, parameters)
        taken = {"mass", "stiffness", "height", "drift_capacity", *law.parameters}
        values = {name: value for name, value in chain.items() if name in taken} | own | dict(parameters)
        if np.ndim(values["mass"]) == 0:
            values["mass"] = np.full(storeys, values["mass"])  # says how many storeys there are, whatever else is given
        building: type[Any] = cls  # a ShearBuilding, which this is a part of
        return building(law=law, damping=damping, **values)


def _warn_of_implausible_curve(chain: Mapping[str, Any]) -> None:
    """Warn if a chain's period or yield drift seems to be of a capacity curve in other units than m, N and m/s2."""
    findings = PlausibilityFindings()
    modes = modal_properties(chain["mass"], chain_stiffness_matrix(chain["stiffness"]))
    findings.add("capacity_period", float(modes["period"][0]))
    weight = STANDARD_GRAVITY * chain["mass"].sum()
    findings.add("capacity_base_shear_coefficient", chain["yield_force"][0] / weight)
    # Of the roof: a distribution may leave upper storeys little.
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
        raise ValueError(f"{name} must be one value or one a storey ({storeys}), got shape {array.shape}")
    return np.array(np.broadcast_to(array, storeys))


def _refuse_several_laws(law: object) -> None:
    """Raise a ValueError if there are laws of several storeys."""
    if isinstance(law, list | tuple):
        raise ValueError(
            f"law must be one name here, as 'bilinear', got {law!r}: build the ShearBuilding directly where "
            "storeys differ in their laws"
        )


def _refuse_determined(parameters: Mapping[str, ArrayLike], determined: tuple[str, ...], source: str) -> None:
    """Raise a ValueError if a parameter is given that is derived from a source."""
    for name in determined:
        if name in parameters:
            raise ValueError(f"{name} follows from {source}; leave it out, or build the ShearBuilding of it directly")
