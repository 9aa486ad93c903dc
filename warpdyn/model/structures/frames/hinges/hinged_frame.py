"""A frame with several bays and nonlinear hinges, as a structure of scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.engine.laws.elastic.parameters import Elastic
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.frames.column_line import ENDS
from warpdyn.model.structures.frames.frame import Frame
from warpdyn.model.structures.frames.hinges.checks import (
    AXIAL,
    check_frame,
    check_gravity,
    checked_hinges,
    warn_of_gravity_moments,
)
from warpdyn.model.structures.frames.hinges.hinged_structure import Hinge, HingedStructure
from warpdyn.model.structures.frames.hinges.joints import Joints, joints_of
from warpdyn.model.structures.frames.hinges.packing import layout_of, packed
from warpdyn.model.structures.frames.hinges.statics import FrameStatics, frame_statics
from warpdyn.model.structures.frames.hinges.values import (
    ELASTIC_PART,
    FrameValues,
    HingedMembers,
    Permanent,
    floors_under_gravity,
    geometric_stiffness,
    moments_under_gravity,
    permanent_of,
    values_of,
)
from warpdyn.model.structures.frames.members.elements import Sections, beam_stiffness
from warpdyn.model.structures.frames.members.reduced_matrices import AT_A_TIME, are_equal
from warpdyn.model.structures.lumped.matrices import StaticSystem
from warpdyn.model.structures.lumped.spring import Spring


@with_suggestions
class HingedFrame(HingedStructure):
    """A plane frame with several bays whose members have nonlinear hinges at their ends.

    The floors' displacements are integrated. Rotations of joints, vertical displacements and rotations of hinges have
    no mass and are solved in each stage of the method. A hinge is a rotational spring of any of the laws elastic,
    bilinear, elastic-perfectly-plastic or Ibarra-Medina-Krawinkler (bilinear), in series with the elastic member; its
    initial stiffness is that of the member's `spring_start` or `spring_end`. Axial forces do not change the moments of
    hinges. A brace (`kind="truss"`) yields in tension and compression if it has a law at ("D1", "axial"), as a
    buckling-restrained brace; its initial stiffness is that of its section. Members without hinges are elastic. Gravity
    loads of the tables act from the start, in equilibrium; drifts are relative to this state. Damping acts on the
    velocities of floors: Rayleigh damping is proportional to mass and initial stiffness of the elastic frame.

    Springs of the structure are the storeys ("storey 1": drift [m] and storey shear [N], of all columns and braces,
    without P-Delta) and then the hinges ("C1 start": rotation [rad] and moment [N m]; "D1 axial": elongation [m],
    without 1 % of the elastic elongation, and force [N]); parameters of the hinges' laws
    can be random with `per="spring"`, with `only=` names of hinges. A random `elastic_modulus` of a member also
    multiplies its `shear_modulus`.

    Args:
        frame: Frame whose masses are on rigid floors. Its geometric stiffness is "string".
        hinges: Laws of hinges by member and end, {(member, "start" or "end"): {"law": law, parameter: value}}, and of
            braces, {(member, "axial"): ...} (bilinear or elastic-perfectly-plastic, yield force in N). Member ends
            without a hinge are elastic: rigid, released, or with the linear spring of the frame.
        p_delta: Whether gravity loads soften the frame.
        outputs: ("drift",): storey drift ratios "drift 1" and so on [1]; or ().
        drift_capacity: Storey drift ratio at which samples collapse [1]; None: no collapse.
        damping: Inherent damping, as for a LumpedStructure.
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2.
        damping_matrix: Damping of the floors in addition to `damping` [N s/m], shape [floor, floor].

    Raises:
        ValueError: If a mass is not on a rigid floor, a hinge is at an end without a spring, a name or a law is
            unknown, gravity exceeds the buckling load, or the frame has too many massless displacements.
        TypeError: If `frame` is not a Frame, or `hinges` is not a dictionary.

    Example:
        The portal of the example of the package with gravity loads, and hinges at the ends of its beam.

        >>> told = portal.description()
        >>> told["nodes"]["B"]["gravity_load"] = told["nodes"]["C"]["gravity_load"] = 2e5  # N
        >>> told["members"]["beam"] |= {"spring_start": 1e9, "spring_end": 1e9}  # N m/rad
        >>> hinge = {"law": "bilinear", "yield_force": 3e5, "hardening_ratio": 0.02}  # N m
        >>> hinges = {("beam", "start"): hinge, ("beam", "end"): hinge}
        >>> structure = wd.HingedFrame(wd.Frame(**told), hinges, damping="modal", damping_ratio=0.02)
        >>> structure.hinge_names
        ('beam start', 'beam end')
        >>> scene = wd.Scene(structure, wd.Cloud(motions), recorders=("spring",))
        >>> wd.simulate(scene, device="cpu")["peak_spring_deformation"].sel(spring="beam start").dims
        ('sample',)
    """

    most_springs = 512  # storeys and hinges

    def __init__(
        self,
        frame: Frame,
        hinges: Mapping[tuple[str, str], Mapping[str, Any]],
        *,
        p_delta: bool = True,
        outputs: Sequence[str] = ("drift",),
        drift_capacity: float | None = None,
        damping: str = "none",
        damping_ratio: float | None = None,
        damping_modes: tuple[int, int] | None = None,
        damping_matrix: ArrayLike | None = None,
    ) -> None:
        check_kind("HingedFrame", "a Frame", frame, Frame, argument="frame")
        check_frame(frame)
        checked = checked_hinges(frame, hinges)
        if p_delta is True:
            check_gravity(frame)
        super().__init__(
            frame,
            checked,
            p_delta=p_delta,
            outputs=outputs,
            drift_capacity=drift_capacity,
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
            damping_matrix=damping_matrix,
        )
        warn_of_gravity_moments(
            list(self.springs[len(frame.storey_drifts) :]), self.gravity_moments, self.implausible_hinges
        )

    @cached_property
    def gravity_moments(self) -> np.ndarray:
        """Absolute moments of the hinges, and forces of braces, under gravity [N m or N], shape [hinge]."""
        moments = np.abs(moments_under_gravity(self.joints, self.hinged_members, self.frame_values, self.permanent))
        rows = {member: row for row, member in enumerate(self.hinged_members.members)}
        return np.array([moments[rows[member], end] for member, end in self.places_of_hinges])

    @cached_property
    def places_of_hinges(self) -> list[tuple[int, int]]:
        """Member and end of each hinge, as indices; a brace has it at its start."""
        members = {name: place for place, name in enumerate(self.frame.members)}
        return [(members[member], 0 if end == AXIAL else ENDS.index(end)) for member, end in self.hinges]

    @cached_property
    def given_braces(self) -> dict[str, Hinge]:
        """Springs with the stiffness and the parameters of whole braces that yield, by name."""
        found, dof = {}, next(iter(self.frame.diaphragms))
        axial = beam_stiffness(self.frame.geometry, self.frame.nominal)[..., 0, 0].ravel()
        for name, (member, _), ((_, end), row) in zip(
            self.hinge_names, self.places_of_hinges, self.hinges.items(), strict=True
        ):
            if end == AXIAL:
                parameters = {key: value for key, value in row.items() if key != "law"}
                found[name] = Hinge(name, dof, float(axial[member]), row["law"], is_axial=True, **parameters)
        return found

    def _gauges(self, names: Sequence[str]) -> tuple[list[Spring], list[float]]:
        """Return the storeys followed by the hinges, and the storey heights [m]."""
        found, heights = super()._gauges(names)
        for name, (member, end), row in zip(self.hinge_names, self.places_of_hinges, self.hinges.values(), strict=True):
            if name in self.given_braces:
                found.append(_yielding_part(self.given_braces[name], names[0]))
                continue
            stiffness = float(self.frame.geometry.end_springs[member, end])
            parameters = {key: value for key, value in row.items() if key != "law"}
            found.append(Hinge(name, names[0], stiffness, row["law"], **parameters))
        return found, heights

    def scatter_problem(self, name: str, *, is_common_factor: bool) -> str | None:
        """Return why a parameter cannot be random."""
        if self.given_braces and name in ("area", "elastic_modulus"):
            return "the initial stiffness of braces that yield belongs to the frame: scatter yield_force instead"
        return super().scatter_problem(name, is_common_factor=is_common_factor)

    @cached_property
    def hinged_members(self) -> HingedMembers:
        """The members with hinges."""
        places = self.places_of_hinges
        members = sorted({member for member, _ in places})
        is_hinge = np.array([[(member, end) in places for end in range(len(ENDS))] for member in members])
        stiffness = np.where(is_hinge, self.frame.geometry.end_springs[members], np.inf)
        is_axial = np.array([self.frame.members[name]["kind"] == "truss" for name in self.frame.members])[members]
        rows = {member: row for row, member in enumerate(members)}
        for spring, (member, _) in zip(self.springs[-len(places) :], places, strict=True):
            if is_axial[rows[member]]:
                stiffness[rows[member], 0] = spring.stiffness
        return HingedMembers(members, is_hinge, stiffness, is_axial)

    @cached_property
    def joints(self) -> Joints:
        """The massless displacements."""
        return joints_of(self.frame, self.kept, self.hinged_members.members, self.hinged_members.is_axial)

    @cached_property
    def column_line(self) -> JointFrame:
        """The layout of the frame for its kernel."""
        random, storeys = np.random.default_rng(0), len(self.frame.storey_drifts)
        unequal = (each[None] * random.uniform(0.8, 1.2, each.shape) for each in self.nominal_sections)
        return layout_of(
            self.joints,
            self.hinged_members,
            self._values_of(Sections(*unequal)),
            {place: storeys + hinge for hinge, place in enumerate(self.places_of_hinges)},
            storeys,
            [place for place, spring in enumerate(self.springs) if place >= storeys and spring.law is Elastic],
        )

    @cached_property
    def frame_values(self) -> FrameValues:
        """The values of the frame with its nominal sections."""
        return self._values_of(Sections(*(each[None] for each in self.nominal_sections)))

    def _values_of(self, sections: Sections) -> FrameValues:
        return values_of(self.frame, self.joints, self.hinged_members, self.permanent, sections)

    @cached_property
    def permanent(self) -> Permanent:
        """Permanent loads and stiffness."""
        return permanent_of(self.frame, self.joints, self.kept, has_p_delta=self.p_delta)

    def _drifts_under_gravity(self, sections: Sections) -> np.ndarray:
        """Return the storey drifts under gravity [m], shape [structure, storey]; without loads [1, storey]."""
        storeys = self.directions[: len(self.frame.storey_drifts)]
        if not self.column_line.lengths["drift"]:
            return np.zeros((1, len(storeys)))
        elastic, under_gravity = self.condensations
        softening = self._softening_of_floors if under_gravity is None else np.zeros((self.dofs, self.dofs))
        floors = floors_under_gravity(self.frame, under_gravity or elastic, softening, self.permanent, sections)
        found: np.ndarray = floors @ storeys.T
        return found

    def values_of_line(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the values of the layout, shape [value, structure]; the last are the stiffnesses of the hinges."""
        count = len(values["mass"])
        given = [np.atleast_2d(values.get(name, nominal)) for name, nominal in self._sections_by_name.items()]
        given = [each[:1] if are_equal(each) else each for each in given]
        most = max(map(len, given))
        of_hinges = np.broadcast_to(values["stiffness"], (count, len(self.springs)))[:, len(self.frame.storey_drifts) :]
        found = np.zeros((0, count))
        for first in range(0, most, AT_A_TIME):
            part = Sections(*(each if len(each) == 1 else each[first : first + AT_A_TIME] for each in given))
            own, drifts = self._values_of(part), self._drifts_under_gravity(part)
            rows = packed(self.column_line, self.joints, own, drifts, self.softening_of_storeys)
            if first == 0:
                found = np.empty((len(rows) + of_hinges.shape[1], count))
            found[: len(rows), first : first + AT_A_TIME if most > 1 else count] = rows
        found[len(found) - of_hinges.shape[1] :] = of_hinges.T
        return found

    @cached_property
    def _softening_of_floors(self) -> np.ndarray:
        """Geometric stiffness between floors, tension positive [N/m], shape [floor, floor]."""
        kept = self.kept
        return geometric_stiffness(self.frame)[np.ix_(kept, kept)] if self.p_delta else np.zeros((kept.size,) * 2)

    @cached_property
    def softening_of_storeys(self) -> np.ndarray:
        """Storey shear of P-Delta per drift [N/m], shape [storey, storey]."""
        to_floors = self.joints.to_free[self.kept][:, self.joints.places.size :]
        found: np.ndarray = -(to_floors.T @ self._softening_of_floors @ to_floors)
        return found

    @cached_property
    def statics(self) -> FrameStatics:
        """The equations of static equilibrium with the nominal sections."""
        return frame_statics(self)

    def static_system(self) -> StaticSystem:
        """Return the equations of static equilibrium of floors, joints and hinges; see LumpedMatrices."""
        return self.statics.system

    def forces_of_gauges(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the storey shears of columns and braces [N], shape [step, storey]; see LumpedMatrices."""
        found: np.ndarray = coordinates @ self.statics.shears.T
        return found

    def linear_matrices(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the difference of the condensed geometric stiffness and that between floors, which the kernel needs.

        The kernel finds all forces of members from rotations and vertical displacements. It subtracts the geometric
        stiffness from this matrix and thus gets that between floors, without condensation.
        """
        if not self.p_delta:
            return super().linear_matrices(values)
        found = self.geometric_matrices(values) + self._softening_of_floors
        size = np.abs(self._softening_of_floors).max()
        return np.where(np.abs(found) > 1e-12 * size, found, 0.0)


def _yielding_part(brace: Hinge, dof: str) -> Hinge:
    """Return the yielding part of a brace, which is as stiff as the brace in series with its elastic part."""
    stiffness = brace.stiffness / (1 - 1 / ELASTIC_PART)
    parameters = dict(brace.parameters)
    if "hardening_ratio" in parameters:
        ratio = parameters["hardening_ratio"]
        parameters["hardening_ratio"] = ratio * (1 - 1 / ELASTIC_PART) / (1 - ratio / ELASTIC_PART)
    return Hinge(brace.name, dof, stiffness, brace.law.name, is_axial=True, **parameters)
