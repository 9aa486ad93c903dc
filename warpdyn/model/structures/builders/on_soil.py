"""Soil-structure interaction: structures on springs and dashpots for sway and rocking of the foundation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from warpdyn.foundations.core.checks import check_kind, one_of, real_number
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.builders.changed_structures import (
    arguments_after,
    lumped,
    modes,
    whole_mass,
    with_group,
)
from warpdyn.model.structures.builders.flexural_shear_building import FlexuralShearBuilding
from warpdyn.model.structures.lumped.foundations.footing import (
    CircularFooting,
    RectangularFooting,
    Soil,
    check_footing,
)
from warpdyn.model.structures.lumped.foundations.impedance import Impedance
from warpdyn.model.structures.lumped.foundations.period_on_soil import period_ratio_on_soil
from warpdyn.model.structures.lumped.foundations.uplift import FoundationUplift
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding

MODES = {"width": ("y", "rx"), "length": ("x", "ry")}  # sway and rocking of a building that is shaken along ...
BASE = ("sway", "rocking")


@with_suggestions
@dataclass(frozen=True)
class FoundationSprings:
    """Springs and dashpots of a foundation in one horizontal direction; see `foundation_springs`.

    Args:
        sway_stiffness: Horizontal stiffness [N/m].
        rocking_stiffness: Rocking stiffness [N m].
        sway_dashpot: Coefficient of the horizontal dashpot [N s/m], 0 or above.
        rocking_dashpot: Coefficient of the rocking dashpot [N m s], 0 or above.
        vertical_stiffness: Vertical stiffness [N/m], for a footing that may lift off; None: unknown.

    Raises:
        ValueError: If a value is not finite or is out of its range.

    Example:
        >>> wd.FoundationSprings(1.8e9, 7.6e10, sway_dashpot=6.5e7, rocking_dashpot=2.1e8).sway_stiffness
        1800000000.0
    """

    sway_stiffness: float
    rocking_stiffness: float
    sway_dashpot: float = 0.0
    rocking_dashpot: float = 0.0
    vertical_stiffness: float | None = None

    def __post_init__(self) -> None:
        for name, units in (("sway_stiffness", "N/m"), ("rocking_stiffness", "N m")):
            object.__setattr__(self, name, real_number(f"{name} [{units}]", getattr(self, name), above=0))
        for name, units in (("sway_dashpot", "N s/m"), ("rocking_dashpot", "N m s")):
            object.__setattr__(self, name, real_number(f"{name} [{units}]", getattr(self, name), least=0))
        if self.vertical_stiffness is not None:
            stiffness = real_number("vertical_stiffness [N/m]", self.vertical_stiffness, above=0)
            object.__setattr__(self, "vertical_stiffness", stiffness)


@suggests_names
def foundation_springs(
    structure: LumpedStructure | ShearBuilding,
    footing: RectangularFooting | CircularFooting,
    soil: Soil,
    *,
    direction: str = "width",
    soil_damping_ratio: float = 0.0,
    rocking_dashpot: float | None = None,
    trapped_inertia: float | None = None,
    floor_heights: Mapping[str, float] | None = None,
) -> FoundationSprings:
    """Return the springs and dashpots of a structure's footing: of Pais and Kausel, or of cone models for a disk.

    Impedances depend on the frequency. They are evaluated at 2 pi / T~, where T~ = T sqrt(1 + k / K_x + k h^2 / K_r) is
    the period on soil with the static stiffnesses K_x and K_r, and k and h are the stiffness and the height of the
    structure's first mode. The base rocks about its centre; coupling between sway and rocking is neglected. The
    vertical stiffness, for `wd.FoundationUplift`, is the static one.

    Sources: Pais and Kausel (1988), "Approximate formulas for dynamic stiffnesses of rigid foundations"; Veletsos and
    Meek (1974), "Dynamic behaviour of building-foundation systems"; NIST GCR 12-917-21 (2012); Wolf and Deeks (2004),
    "Foundation vibration analysis: a strength-of-materials approach".

    Args:
        structure: The structure on a fixed base.
        footing: The footing; a `CircularFooting` has the impedance of cone models.
        soil: The soil.
        direction: Direction of the motion: along the "width" or the "length" of the footing.
        soil_damping_ratio: Hysteretic damping of the soil [1], below 1, which adds 2 beta_s K / omega to both dashpots.
        rocking_dashpot: Coefficient of the rocking dashpot by radiation [N m s]; None: that of Pais and Kausel, which
            exists only for a footing at the surface, or that of the cone.
        trapped_inertia: Moment of inertia of the soil that moves with a disk that rocks [kg m2], 0 or above; only for a
            `CircularFooting` on soil with a Poisson's ratio above 1/3.
        floor_heights: Height of each degree of freedom above the base of the footing [m]; None: the floor heights of a
            ShearBuilding or FlexuralShearBuilding.

    Returns:
        The springs and dashpots.

    Raises:
        ValueError: If a value is out of its range, floor heights are unknown, the footing is embedded and
            `rocking_dashpot` is missing, or `trapped_inertia` is missing or has no effect.
        TypeError: If an argument is of another class.

    Example:
        >>> soil = wd.Soil(poisson_ratio=0.35, density=1800.0, shear_modulus=40e6)
        >>> springs = wd.foundation_springs(building, wd.RectangularFooting(10.0, 6.0), soil)
        >>> f"{springs.sway_stiffness:.4g} N/m, {springs.rocking_stiffness:.4g} N m"
        '1.805e+09 N/m, 7.756e+10 N m'
    """
    check_footing("foundation_springs", footing, soil, can_be_circular=True)
    one_of("direction", direction, MODES)
    damping = real_number("soil_damping_ratio", soil_damping_ratio, least=0)
    if damping >= 1:
        raise ValueError(
            f"soil_damping_ratio is {damping:g}, but must be below 1: give a fraction, such as soil_damping_ratio=0.05 "
            "for 5 percent"
        )
    impedance = Impedance(footing, soil, trapped_inertia)
    whole = _in_one_direction("foundation_springs", structure)
    heights = _heights("foundation_springs", structure, whole, floor_heights)
    mass, height, period = _first_mode(whole, heights)
    sway, rocking = MODES[direction]
    static = impedance.at_rest()
    stiffness = (2 * np.pi / period) ** 2 * mass
    omega = 2 * np.pi / (period * period_ratio_on_soil(stiffness, height, static[sway], static[rocking]))
    springs, dashpots = impedance.at(omega)
    if rocking_dashpot is None and rocking not in dashpots:
        raise ValueError(
            "rocking_dashpot is missing: no confirmed formula exists for the radiation of an embedded footing that "
            "rocks; give rocking_dashpot= in N m s, such as 0.0 (more response), or that of a footing at the surface"
        )
    by_radiation = dashpots.get(rocking, 0.0) if rocking_dashpot is None else rocking_dashpot
    of_soil = 2 * damping / omega
    return FoundationSprings(
        springs[sway],
        springs[rocking],
        dashpots[sway] + of_soil * springs[sway],
        by_radiation + of_soil * springs[rocking],
        static["z"],
    )


@suggests_names
def structure_on_soil(
    structure: LumpedStructure | ShearBuilding,
    springs: FoundationSprings,
    *,
    foundation_mass: float,
    rocking_inertia: float,
    uplift: FoundationUplift | None = None,
    floor_heights: Mapping[str, float] | None = None,
) -> LumpedStructure:
    """Return a structure on a foundation that sways and rocks, and may lift off the soil.

    Degrees of freedom: those of the structure, which become displacements relative to the free-field ground, then
    "sway" [m] and "rocking" [rad] of the foundation. Springs: those of the structure, then "sway" and "rocking". Both
    are in the group "soil", which does not count in the largest demand of the building.
    Deformations of springs and outputs of the structure remain relative to the moving base; gravity loads act on the
    whole displacement, including that by rocking. Inherent damping of the structure becomes a constant matrix for
    motion relative to the base, so that `damping_ratio` cannot be random.

    With `uplift`, the footing also moves vertically: the degree of freedom "heave" [m] is its upward displacement from
    the settlement under the weight. Vertical contacts (`wd.laws.PreloadedContact`), "contact 1" and so on, replace the
    spring "rocking". Until the first lift-off the response is the response without uplift; the contacts share the
    rocking dashpot in proportion to their stiffness. The mass of "heave" is that of structure and foundation. The
    ground does not move vertically, and the footing does not slide.

    Args:
        structure: The structure on a fixed base, in one horizontal direction.
        springs: Springs and dashpots of the foundation, such as those of `wd.foundation_springs`.
        foundation_mass: Mass of the foundation [kg].
        rocking_inertia: Moment of inertia of the foundation about the centre of its base, plus those of the floors
            about their own axes [kg m2].
        uplift: How the footing may lift off; None: it does not. `springs` must have a `vertical_stiffness`.
        floor_heights: Height of each degree of freedom above the base of the footing [m], {name: height}; None: the
            floor heights of a ShearBuilding or FlexuralShearBuilding.

    Returns:
        The structure on soil.

    Raises:
        ValueError: If a value is out of its range, floor heights are unknown, the structure has several components
            of base motion or a load mass, or `vertical_stiffness` is missing.
        TypeError: If an argument is of another class.

    Example:
        >>> springs = wd.FoundationSprings(1.8e9, 7.6e10, sway_dashpot=6.5e7, rocking_dashpot=2.1e8)
        >>> on_soil = wd.structure_on_soil(building, springs, foundation_mass=1.5e5, rocking_inertia=2e6)
        >>> on_soil.dof_names
        ('u1', 'u2', 'sway', 'rocking')
        >>> on_soil.fundamental_period > building.fundamental_period
        True
    """
    check_kind("structure_on_soil", "FoundationSprings", springs, FoundationSprings, "call wd.foundation_springs(...)")
    base_mass = real_number("foundation_mass [kg]", foundation_mass, above=0)
    inertia = real_number("rocking_inertia [kg m2]", rocking_inertia, above=0)
    whole = _in_one_direction("structure_on_soil", structure)
    heights = _heights("structure_on_soil", structure, whole, floor_heights)
    if whole.load_mass is not None:
        raise ValueError(
            "structure_on_soil(): the structure has a load_mass: add inerters after it is put on soil, with "
            "wd.with_absorber(wd.structure_on_soil(...), ...)"
        )
    base = BASE if uplift is None else (*BASE, "heave")
    own = _springs_of_base(springs, uplift, STANDARD_GRAVITY * (_moving_mass(whole) + base_mass))
    new_names = {*base, *(spring.name for spring in own)}
    taken = [name for name in (*whole.dof_names, *whole.names_along("spring")) if name in new_names]
    if taken:
        raise ValueError(f"structure_on_soil(): the structure already has the name {taken[0]!r}: rename it")
    influence = whole.influence[:, 0]
    dofs = (*whole.dof_names, *base)
    none = np.zeros((whole.dofs, len(base) - len(BASE)))
    relative = np.column_stack([np.eye(whole.dofs), -influence, -heights * influence, none])
    arguments = arguments_after(whole, dofs, relative)
    if "geometric_stiffness" in arguments:
        # Gravity acts on the whole displacement, less that of the base.
        drifting = np.column_stack([np.eye(whole.dofs), -influence, np.zeros(whole.dofs), none])
        arguments["geometric_stiffness"] = drifting.T @ whole.matrices["geometric_stiffness"] @ drifting
    arguments["groups"] = with_group(whole, "soil", *dict.fromkeys([*base, *(spring.name for spring in own)]))
    if "rotations" in arguments:
        arguments["rotations"] = [*arguments["rotations"], "rocking"]
    mass = whole_mass(whole)
    masses = whole.parameters["mass"]
    coupling = np.zeros((len(dofs), len(dofs)))
    coupling[: whole.dofs, : whole.dofs] = mass - np.diag(masses)
    arguments["springs"] += own
    of_base = [base_mass, inertia, _moving_mass(whole) + base_mass][: len(base)]
    found = LumpedStructure(
        dict(zip(dofs, [*masses.tolist(), *of_base], strict=True)),
        influence={**dict(zip(whole.dof_names, influence.tolist(), strict=True)), "sway": 1.0},
        mass_matrix=coupling if coupling.any() else None,
        **arguments,
    )
    _warn_of_implausible(whole, found, springs, uplift, base_mass, inertia)
    return found


def _warn_of_implausible(
    fixed: LumpedStructure,
    on_soil: LumpedStructure,
    springs: FoundationSprings,
    uplift: FoundationUplift | None,
    base_mass: float,
    inertia: float,
) -> None:
    """Warn of implausible stiffnesses, dashpots, masses and weights of a foundation, compared with its building.

    Args:
        fixed: The structure on a fixed base.
        on_soil: The structure on soil.
        springs: Springs and dashpots of the foundation.
        uplift: How the footing may lift off.
        base_mass: Mass of the foundation [kg].
        inertia: Moment of inertia of the foundation [kg m2].
    """
    findings = PlausibilityFindings()
    mass = _moving_mass(fixed)
    findings.add("period_on_soil", on_soil.fundamental_period / fixed.fundamental_period)
    if springs.sway_dashpot:
        findings.add("sway_dashpot_over_stiffness", springs.sway_dashpot / springs.sway_stiffness)
    findings.add("foundation_mass_over_building", base_mass / mass)
    lever = springs.rocking_stiffness / springs.sway_stiffness
    findings.add("rocking_inertia_over_masses", inertia / ((mass + base_mass) * lever))
    if uplift is not None and uplift.weight is not None:
        findings.add("uplift_weight_over_weight", uplift.weight / (STANDARD_GRAVITY * (mass + base_mass)))
    findings.warn()


def _moving_mass(structure: LumpedStructure) -> float:
    """Return the mass that moves with a unit displacement of the base [kg]."""
    influence = structure.influence[:, 0]
    return float(influence @ whole_mass(structure) @ influence)


def _springs_of_base(springs: FoundationSprings, uplift: FoundationUplift | None, weight: float) -> list[Spring]:
    """Return the springs between the foundation and the ground; `weight` is that of all masses [N]."""
    if uplift is not None:
        check_kind("structure_on_soil", "a FoundationUplift", uplift, FoundationUplift, argument="uplift")
    found = [
        Spring(
            name,
            {name: 1.0},
            stiffness=getattr(springs, f"{name}_stiffness"),
            damping_coefficient=getattr(springs, f"{name}_dashpot"),
        )
        for name in (BASE if uplift is None else BASE[:1])
    ]
    if uplift is None:
        return found
    if springs.vertical_stiffness is None:
        raise ValueError(
            "structure_on_soil(): uplift= needs the vertical stiffness of the foundation: give "
            "wd.FoundationSprings(..., vertical_stiffness=...) in N/m, or the result of wd.foundation_springs"
        )
    of_rocking = (springs.rocking_stiffness, springs.rocking_dashpot)
    given = weight if uplift.weight is None else uplift.weight
    return found + uplift.contacts(springs.vertical_stiffness, *of_rocking, given)


def _in_one_direction(function: str, structure: LumpedStructure | ShearBuilding) -> LumpedStructure:
    """Return the structure as a LumpedStructure with one component of base motion."""
    found = lumped(function, structure)
    if found.components > 1:
        raise ValueError(
            f"{function}(): the structure has {found.components} components of base motion; give one, such as "
            "influence={'u1': 1.0}"
        )
    return found


def _heights(
    function: str, given: object, structure: LumpedStructure, floor_heights: Mapping[str, float] | None
) -> np.ndarray:
    """Return the height of each degree of freedom [m], shape [dof]."""
    if floor_heights is None:
        if isinstance(given, ShearBuilding):
            return np.cumsum(given.parameters["height"])
        if isinstance(given, FlexuralShearBuilding):
            return np.append(np.zeros(given.dofs - given.floor_heights.size), given.floor_heights)
        raise ValueError(
            f"{function}(): floor_heights is missing: give the height of each degree of freedom in m, such as "
            f"floor_heights={{{structure.dof_names[0]!r}: 3.5}}"
        )
    if not isinstance(floor_heights, Mapping) or set(floor_heights) != set(structure.dof_names):
        raise ValueError(
            f"{function}(): floor_heights must be a dictionary with the height in m of each of "
            f"{', '.join(map(repr, structure.dof_names))}"
        )
    heights = [real_number(f"floor_heights[{dof!r}]", floor_heights[dof], least=0) for dof in structure.dof_names]
    return np.array(heights)


def _first_mode(structure: LumpedStructure, heights: np.ndarray) -> tuple[float, float, float]:
    """Return effective mass [kg], effective height [m] and period [s] of the first mode."""
    squared, shapes = modes(structure)
    momentum = whole_mass(structure) @ shapes[:, 0]
    influence = structure.influence[:, 0]
    share = momentum @ influence
    return float(share**2), float(momentum @ (heights * influence) / share), float(2 * np.pi / np.sqrt(squared[0]))
