"""Equipment on a structure, and absorbers with or without an inerter."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.foundations.core.checks import checked_text, real_number, shortened, whole_number
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.model.structures.builders.changed_structures import (
    arguments_after,
    lumped,
    modes,
    values_of_one,
    whole_mass,
    with_group,
)
from warpdyn.model.structures.lumped.inerters import inertance_matrix, optimum_tmdi, tmdi_absorber
from warpdyn.model.structures.lumped.names import check_known, checked_coefficients, row_of
from warpdyn.model.structures.lumped.spring import Spring
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding

LEAST_SHAPE = 1e-6  # displacement of a mode, over the largest one, at which an absorber can be tuned


@suggests_names
def with_equipment(
    structure: LumpedStructure | ShearBuilding,
    at: str | Mapping[str, float],
    mass: float,
    *,
    damping_ratio: float,
    period: float | None = None,
    tuned_to_mode: int | None = None,
    name: str = "equipment",
) -> LumpedStructure:
    """Return a structure with equipment: a mass on a spring and a dashpot at one of its floors.

    The equipment has the degree of freedom and the spring `name`, in the group "equipment", which does not count in the
    largest demand of the building. Its interaction with the structure is included: light
    equipment that is tuned to the structure makes the damping non-classical, with two close modes of about the mean
    damping. Inherent damping of the structure becomes the constant damping matrix of the bare structure, so that
    `damping_ratio` of the structure and eccentricities cannot be random in the result.

    Args:
        structure: The structure; a ShearBuilding becomes a `lumped_chain` with the degrees of freedom "u1", "u2" ...
        at: The degree of freedom that carries the equipment, or coefficients of its displacement at the equipment [1]
            or [m], such as {"ux3": 1.0, "theta3": -4.0}.
        mass: Mass of the equipment [kg].
        damping_ratio: Damping ratio of the equipment on a rigid floor [1].
        period: Period of the equipment on a rigid floor [s].
        tuned_to_mode: Instead of `period`: number of the mode of the bare structure, from 1, with the same period.
        name: Name of the equipment.

    Returns:
        The structure with the equipment.

    Raises:
        ValueError: If a value is out of its range, a name is unknown or taken, or neither or both of `period` and
            `tuned_to_mode` are given.
        TypeError: If `structure` is of another class.

    Example:
        >>> equipped = wd.with_equipment(building, "u2", 100.0, tuned_to_mode=1, damping_ratio=0.01)
        >>> equipped.dof_names
        ('u1', 'u2', 'equipment')
        >>> equipped.modal()["period"].values[:2].round(3)
        array([0.54 , 0.525])
    """
    whole = lumped("with_equipment", structure)
    own_mass = real_number("mass [kg]", mass, above=0)
    ratio = real_number("damping_ratio", damping_ratio, least=0)
    if (period is None) == (tuned_to_mode is None):
        given = "both" if period is not None else "neither"
        raise ValueError(f"with_equipment(): give period= in s or tuned_to_mode=, such as tuned_to_mode=1; got {given}")
    if tuned_to_mode is not None:
        mode = whole_number("tuned_to_mode", tuned_to_mode, 1, whole.dofs)
        omega = float(np.sqrt(modes(whole)[0][mode - 1]))
    else:
        omega = 2 * np.pi / real_number("period [s]", period, above=0)
    dashpot = 2 * ratio * omega * own_mass
    return _with_mass(whole, name, "equipment", _row(whole, at), own_mass, own_mass * omega**2, dashpot)


@suggests_names
def with_absorber(
    structure: LumpedStructure | ShearBuilding,
    at: str,
    *,
    mass_ratio: float,
    inertance_ratio: float = 0.0,
    inerter_to: str | None = None,
    frequency_ratio: float | None = None,
    damping_ratio: float | None = None,
    mode: int = 1,
    name: str = "absorber",
) -> LumpedStructure:
    """Return a structure with a tuned mass damper, with or without an inerter (TMDI).

    The absorber has the degree of freedom and the spring `name`, in the group "absorber", which does not count in the
    largest demand of the building. The inerter connects it with the ground, or with
    another degree of freedom; the inertance b is part of the mass matrix, but not of the load. With the modal mass m of
    a mode (with shape 1 at the absorber) and its frequency omega_s: m_t = mass_ratio m, b = inertance_ratio m, k_t =
    (m_t + b) omega_t^2, omega_t = frequency_ratio omega_s and c_t = 2 damping_ratio omega_t (m_t + b). Defaults of the
    two ratios are the optimum for an undamped structure under white noise at its base. Inherent damping is treated as
    in `with_equipment`.

    Source: Marian and Giaralis (2014), "Optimal design of a novel tuned mass-damper-inerter (TMDI) passive vibration
    control configuration for stochastically support-excited structural systems".

    Args:
        structure: The structure; a ShearBuilding becomes a `lumped_chain` with the degrees of freedom "u1", "u2" ...
        at: The degree of freedom that carries the absorber.
        mass_ratio: Mass of the absorber over the modal mass [1].
        inertance_ratio: Inertance over the modal mass [1], 0 or above.
        inerter_to: Degree of freedom at the other end of the inerter; None: the ground. The optimum is known only
            for the ground.
        frequency_ratio: Frequency of the absorber over that of the mode [1]; None: the optimum.
        damping_ratio: Damping ratio of the absorber [1]; None: the optimum.
        mode: Number of the mode, from 1.
        name: Name of the absorber.

    Returns:
        The structure with the absorber.

    Raises:
        ValueError: If a value is out of its range, a name is unknown or taken, the degree of freedom does not move in
            the mode, or there is no optimum.
        TypeError: If `structure` is of another class.

    Example:
        >>> damped = wd.with_absorber(building, "u2", mass_ratio=0.02, inertance_ratio=0.1)
        >>> damped.dof_names
        ('u1', 'u2', 'absorber')
    """
    whole = lumped("with_absorber", structure)
    mu = real_number("mass_ratio", mass_ratio, above=0)
    beta = real_number("inertance_ratio", inertance_ratio, least=0)
    other = None if inerter_to is None else checked_text("inerter_to", inerter_to)
    if other is not None:
        check_known("with_absorber(): inerter_to", (other,), whole.dof_names)
    if frequency_ratio is None or damping_ratio is None:
        if other is not None:
            raise ValueError(
                "with_absorber(): no formula for the optimum is known if inerter_to= is not the ground: give "
                "frequency_ratio= and damping_ratio="
            )
        optimum = optimum_tmdi(mu, beta)
        frequency_ratio = optimum.frequency_ratio if frequency_ratio is None else frequency_ratio
        damping_ratio = optimum.damping_ratio if damping_ratio is None else damping_ratio
    findings = PlausibilityFindings()
    findings.add("tuned_mass_ratio", mu)
    findings.add("tuned_frequency_ratio", real_number("frequency_ratio", frequency_ratio, above=0))
    if real_number("damping_ratio", damping_ratio, least=0) > 0:
        findings.add("tuned_damping_ratio", damping_ratio)
    findings.warn()
    row = _row(whole, checked_text("at", at))
    squared, shapes = modes(whole)
    number = whole_number("mode", mode, 1, whole.dofs) - 1
    moved = float(row @ shapes[:, number])
    if abs(moved) < LEAST_SHAPE * np.abs(shapes[:, number]).max():
        raise ValueError(
            f"with_absorber(): degree of freedom {at!r} does not move in mode {number + 1}: give another mode= or at="
        )
    period = 2 * np.pi / np.sqrt(squared[number])
    own = tmdi_absorber(1 / moved**2, period, mu, beta, frequency_ratio, damping_ratio)
    spring = own.mass, own.stiffness, own.dashpot
    return _with_mass(whole, name, "absorber", row, *spring, inertance=own.inertance, inerter_to=other)


def _with_mass(
    structure: LumpedStructure,
    name: str,
    group: str,
    row: np.ndarray,
    mass: float,
    stiffness: float,
    dashpot: float,
    *,
    inertance: float = 0.0,
    inerter_to: str | None = None,
) -> LumpedStructure:
    """Return a structure with one more mass, on a spring and a dashpot, perhaps with an inerter.

    Args:
        structure: The structure.
        name: Name of the degree of freedom and of the spring.
        group: Name of their group.
        row: Displacement of the structure at the mass, from its degrees of freedom, shape [dof].
        mass: The mass [kg].
        stiffness: Stiffness of the spring [N/m].
        dashpot: Coefficient of the dashpot [N s/m].
        inertance: Inertance of the inerter [kg].
        inerter_to: Degree of freedom at the other end of the inerter; None: the ground.
    """
    name = checked_text("name", name)
    if name in structure.dof_names or name in structure.names_along("spring"):
        raise ValueError(f"the structure already has the name {name!r}: give another name=, such as {name + ' 2'!r}")
    dofs = (*structure.dof_names, name)
    old = np.eye(structure.dofs, len(dofs))
    arguments = arguments_after(structure, dofs, old)
    direction = {name: 1.0} | {dof: -float(value) for dof, value in zip(dofs, row, strict=False) if value}
    arguments["springs"].append(Spring(name, direction, stiffness=stiffness, damping_coefficient=dashpot))
    arguments["groups"] = with_group(structure, group, name)
    masses = [*structure.parameters["mass"].tolist(), mass]
    without = np.diag([0.0] * structure.dofs + [mass])  # the new mass alone
    coupling = old.T @ whole_mass(structure) @ old + without - np.diag(masses)
    load = old.T @ structure.load_masses(values_of_one(structure))[0] @ old + without
    if inertance:
        other = None if inerter_to is None else dofs.index(inerter_to)
        coupling += inertance_matrix(len(dofs), inertance, len(dofs) - 1, other)
    influence = np.vstack([structure.influence, row @ structure.influence])
    return LumpedStructure(
        dict(zip(dofs, masses, strict=True)),
        influence=[dict(zip(dofs, column.tolist(), strict=True)) for column in influence.T],
        mass_matrix=coupling if coupling.any() else None,
        load_mass=load if inertance or structure.load_mass is not None else None,
        **arguments,
    )


def _row(structure: LumpedStructure, at: str | Mapping[str, float]) -> np.ndarray:
    """Return the coefficients of a displacement, shape [dof]."""
    given = {at: 1.0} if isinstance(at, str) else checked_coefficients("at", at)
    check_known("at", given, structure.dof_names)
    row = row_of(given, structure.dof_names)
    if not row.any():
        raise ValueError(f"at must have a coefficient other than 0, such as {{'u2': 1.0}}, got {shortened(at)}")
    return row
