"""A fish-bone frame with nonlinear hinges, as a structure of scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.kernels.lumped.pattern import ColumnLine
from warpdyn.engine.laws.elastic.parameters import Elastic
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.model.structures.frames.column_line import ENDS, base_turn, check_gravity, checked_hinges, checked_line
from warpdyn.model.structures.frames.frame import Frame
from warpdyn.model.structures.frames.hinges.hinged_structure import Hinge, HingedStructure
from warpdyn.model.structures.frames.joined_hinges import joined_hinges
from warpdyn.model.structures.frames.line_statics import line_statics
from warpdyn.model.structures.frames.members.elements import Sections, shear_ratio
from warpdyn.model.structures.lumped.matrices import StaticSystem
from warpdyn.model.structures.lumped.spring import Spring


@with_suggestions
class HingedFishbone(HingedStructure):
    """A fish-bone frame whose members have nonlinear hinges at their ends.

    The floors' displacements are integrated; rotations are massless and solved in each stage of the method. A hinge is
    a rotational spring of any of the laws elastic, bilinear, elastic-perfectly-plastic or Ibarra-Medina-Krawinkler
    (bilinear), in series with the elastic member; its initial stiffness is that of the member's `spring_start` or
    `spring_end`. Axial forces do not change the moments of hinges. Damping acts on the velocities of floors: Rayleigh
    damping is proportional to mass and initial stiffness of the elastic frame.

    Springs of the structure are the storeys ("storey 1": drift [m] and storey shear [N]) and then the hinges ("C1
    start": rotation [rad] and moment [N m]); parameters of the hinges' laws can be random with `per="spring"`, with
    `only=` names of hinges. A random `elastic_modulus` of a member also multiplies its `shear_modulus`.

    Args:
        frame: Fish-bone frame, such as the result of `fishbone`: one column per storey without shortening, and one
            half-beam per floor with a vertical roller at its end.
        hinges: Laws of hinges by member and end, {(member, "start" or "end"): {"law": law, parameter: value}}. Member
            ends without a hinge have the linear spring of the frame.
        p_delta: Whether gravity loads soften the frame; they must act on a leaning column.
        outputs: ("drift",): storey drift ratios "drift 1" and so on [1]; or ().
        drift_capacity: Storey drift ratio at which samples collapse [1]; None: no collapse.
        damping: Inherent damping, as for a LumpedStructure.
        damping_ratio: Viscous damping ratio [1].
        damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2.
        damping_matrix: Damping of the floors in addition to `damping` [N s/m], shape [floor, floor].

    Raises:
        ValueError: If the frame is not a fish-bone, a hinge is at an end without a spring, a law is unknown, or a
            gravity load with P-Delta acts on a node that is supported vertically.
        TypeError: If `frame` is not a Frame.

    Example:
        A storey with a hinge at the base of its column line, and a leaning column under the gravity load.

        >>> nodes = {"J0": (0.0, 0.0), "J1": (0.0, 4.0), "R1": (3.0, 4.0), "L0": (6.0, 0.0)}  # m
        >>> nodes["L1"] = {"x": 6.0, "y": 4.0, "gravity_load": 3.4e5}  # N
        >>> springs = {"spring_start": 3e8}  # N m/rad
        >>> column = {"start": "J0", "end": "J1", "section": "column", **springs}
        >>> members = {"C1": column, "B1": ("J1", "R1", "beam"), "L": ("L0", "L1", "column", "truss")}
        >>> bone = wd.Frame(
        ...     nodes,
        ...     members,
        ...     sections,
        ...     supports={"J0": "fixed", "J1": "roller", "R1": "roller", "L0": "pinned"},
        ...     diaphragms={"floor": ["J1", "R1", "L1"]},
        ...     masses={"floor": 35e3},  # kg
        ... )
        >>> hinges = {("C1", "start"): {"law": "bilinear", "yield_force": 2e5, "hardening_ratio": 0.02}}
        >>> structure = wd.HingedFishbone(bone, hinges, damping="modal", damping_ratio=0.02)
        >>> structure.hinge_names
        ('C1 start',)
        >>> scene = wd.Scene(structure, wd.Cloud(motions), recorders=("spring",))
        >>> wd.simulate(scene, device="cpu")["peak_spring_force"].sel(spring="C1 start").dims
        ('sample',)
    """

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
        check_kind("HingedFishbone", "a Frame", frame, Frame, argument="frame")
        self.line = checked_line(frame)
        checked = checked_hinges(frame, self.line, hinges)
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

    @classmethod
    @suggests_names
    def from_frame(
        cls, frame: Frame, hinges: Mapping[tuple[str, str], Mapping[str, Any]], **settings: Any
    ) -> HingedFishbone:
        """Return the fish-bone of a frame whose members have hinges.

        The frame is joined as by `fishbone`. The hinges at the lower ends of the columns of a storey become one hinge,
        as do those at the upper ends, and those of all beams of a floor: stiffnesses and yield moments are added.
        Rotations and ratios are means weighted by the yield moments, so that energy capacities (deterioration rotation
        times yield moment) are added, too; `hardening_ratio` is weighted by the stiffnesses.

        Args:
            frame: Frame with rigid floors whose members have springs where they have hinges.
            hinges: Laws of the hinges of the frame, {(member, "start" or "end"): {"law": law, parameter: value}}.
            **settings: Other arguments of HingedFishbone, such as `damping` and `drift_capacity`.

        Raises:
            ValueError: If `fishbone` refuses the frame, only some ends of a floor's beams or of a storey's columns have
                hinges, or these hinges have different laws.

        Example:
            >>> springs = {"spring_start": 5e8, "spring_end": 5e8}  # N m/rad
            >>> arguments = portal.description()
            >>> for name in arguments["members"]:
            ...     arguments["members"][name] |= springs
            >>> steel = {"law": "bilinear", "yield_force": 3e5, "hardening_ratio": 0.003}
            >>> hinges = {(name, end): steel for name in arguments["members"] for end in ("start", "end")}
            >>> bone = wd.HingedFishbone.from_frame(wd.Frame(**arguments), hinges, p_delta=False)
            >>> {str(spring.name): float(spring.parameters["yield_force"]) for spring in bone.springs[1:]}
            {'C1 start': 600000.0, 'C1 end': 600000.0, 'B1 start': 600000.0}
        """
        check_kind("HingedFishbone.from_frame", "a Frame", frame, Frame, argument="frame")
        return cls(*joined_hinges(frame, hinges), **settings)

    def _gauges(self, names: Sequence[str]) -> tuple[list[Spring], list[float]]:
        """Return the storeys followed by the hinges, storey by storey, and the storey heights [m]."""
        found, heights = super()._gauges(names)
        self.line_places: list[int] = []
        members = list(self.frame.members)
        stiffnesses = self.frame.geometry.end_springs
        for storey, name in zip(self.line, names, strict=True):
            for member, side in storey.places:
                stiffness = float(stiffnesses[member, side])
                if np.isinf(stiffness):
                    self.line_places.append(-1)
                    continue
                row = dict(self.hinges.get((members[member], ENDS[side]), {"law": "elastic"}))
                self.line_places.append(len(found))
                found.append(Hinge(f"{members[member]} {ENDS[side]}", name, stiffness, row.pop("law"), **row))
        return found, heights

    @property
    def column_line(self) -> ColumnLine:
        """Places of the hinges along the column line."""
        linear = tuple(place for place in self.line_places if place >= 0 and self.springs[place].law is Elastic)
        return ColumnLine(tuple(self.line_places), base_turn(self.frame, self.line) is True, linear)

    def values_of_line(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the values of the column line, shape [value, structure].

        They are bending stiffnesses [N m/rad] and inverse heights [1/m] of the storeys, the stiffness of the base, and
        the initial stiffnesses of the hinges.
        """
        count = len(values["mass"])
        given = [np.atleast_2d(values.get(name, nominal)) for name, nominal in self._sections_by_name.items()]
        sections = Sections(*(np.broadcast_to(each, (count, each.shape[1])) for each in given))
        phi = shear_ratio(self.frame.geometry, sections)
        bending = sections.modulus * sections.inertia / self.frame.geometry.length / (1 + phi)
        own, other = (4 + phi) * bending, (2 - phi) * bending
        rows = []
        for column, _, _, beam, _ in self.line:
            beam_end = own[:, beam] - other[:, beam] ** 2 / own[:, beam]
            height = np.full(count, 1 / self.frame.geometry.length[column])
            rows += [own[:, column], other[:, column], beam_end, height]
        turn = base_turn(self.frame, self.line)
        rows.append(np.full(count, 0.0 if turn is True else float(turn)))
        of_hinges = np.broadcast_to(values["stiffness"], (count, len(self.springs)))[:, len(self.line) :]
        return np.concatenate([np.stack(rows), of_hinges.T])

    def static_system(self) -> StaticSystem:
        """Return the equations of static equilibrium of floors, joints and ends of members; see LumpedMatrices."""
        deformations, stiffness, _ = line_statics(self)
        one = {name: values[None] for name, values in self.parameters.items()}
        stiffness[: self.dofs, : self.dofs] -= (np.zeros((1, self.dofs, self.dofs)) + self.geometric_matrices(one))[0]
        return StaticSystem(deformations, stiffness, np.zeros(len(stiffness)))

    def forces_of_gauges(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the storey shears of the columns [N], shape [step, storey]; see LumpedMatrices."""
        found: np.ndarray = coordinates @ line_statics(self).shears.T
        return found
