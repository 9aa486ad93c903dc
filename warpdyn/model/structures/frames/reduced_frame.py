"""An elastic frame with few degrees of freedom, as a structure of scenes; section properties may be random."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws import Parameter
from warpdyn.foundations.core.checks import one_of, real_number, true_or_false, whole_number
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.near_misses import did_you_mean
from warpdyn.model.structures.frames.choices import checked_members, checked_outputs, kept_places
from warpdyn.model.structures.frames.members.condensation import UnstableSections
from warpdyn.model.structures.frames.members.elements import Sections
from warpdyn.model.structures.frames.members.forces import unit_of
from warpdyn.model.structures.frames.members.reduced_matrices import MEMBER_PARAMETERS, ReducedMatrices
from warpdyn.model.structures.frames.reduction import free_matrices, inner_masses, reduced, shapes_of
from warpdyn.model.structures.lumped.matrices import INCIDENCE
from warpdyn.model.structures.lumped.spring import Gauge, Spring
from warpdyn.model.structures.lumped.structure import MOST_DOFS

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

REDUCTIONS = ("static", "guyan", "craig_bampton")


class ReducedFrame(ReducedMatrices):
    """An elastic frame with few degrees of freedom; `Frame.lumped` makes it and describes the arguments."""

    can_have_zero_outputs = True  # a force may be 0 only because the nominal sections are equal

    def __init__(
        self,
        frame: Frame,
        *,
        dofs: Sequence[str] | None,
        reduction: str,
        modes: int,
        p_delta: bool,
        vertical: bool,
        outputs: Sequence[str],
        members: Sequence[str] | None,
        drift_capacity: float | None,
        damping: str,
        damping_ratio: float | None,
        damping_modes: tuple[int, int] | None,
        damping_matrix: ArrayLike | None,
    ) -> None:
        one_of("reduction", reduction, REDUCTIONS)
        self.frame, self.reduction = frame, reduction
        self.p_delta = true_or_false("p_delta", p_delta)
        self.vertical = true_or_false("vertical", vertical)
        stiffness, geometric, mass = free_matrices(frame, has_p_delta=p_delta)
        self.kept = kept_places(frame, dofs, mass, reduction)
        self.interface_modes = self._modes(modes, mass)
        shapes = shapes_of(stiffness, mass, self.kept, self.interface_modes)
        names = [frame.numbering.free_names[place] for place in self.kept]
        dof_names = [*names, *(f"interior mode {mode + 1}" for mode in range(self.interface_modes))]
        if len(dof_names) > MOST_DOFS:
            raise ValueError(
                f"lumped(): {len(dof_names)} degrees of freedom, but at most {MOST_DOFS} are possible: give fewer "
                "dofs= (such as those of diaphragms) and reduction='guyan' or 'craig_bampton'"
            )
        self.output_kinds = checked_outputs(outputs)
        self.members_out = checked_members(frame, members, self.output_kinds)
        self.drift_capacity = drift_capacity
        reduced_mass = reduced(mass, shapes)
        self.nominal_mass = np.diag(reduced_mass).copy()
        for place in np.flatnonzero(self.nominal_mass <= 0):
            raise ValueError(f"dofs: degree of freedom {dof_names[place]!r} has no mass: remove it from dofs=")
        self.motion = self._motions(dof_names)
        softened = self._softened(stiffness, geometric, shapes)
        named_outputs = self._named_outputs(dof_names, stiffness + geometric, softened)
        gauges, heights = self._gauges(names)
        super().__init__(
            dict(zip(dof_names, self.nominal_mass.tolist(), strict=True)),
            gauges,
            influence=[dict(zip(dof_names, row.tolist(), strict=True)) for row in self.motion.T],
            mass_matrix=reduced_mass - np.diag(self.nominal_mass),
            stiffness_matrix=reduced(stiffness, shapes),
            geometric_stiffness=-reduced(geometric, shapes, softened) if p_delta else None,
            load_mass=None if reduction == "static" else self.load_masses({"mass": self.nominal_mass[None]})[0],
            outputs=named_outputs,
            output_units={name: unit_of(name) for name in named_outputs},
            rotations=[name for name in names if name.endswith(" rz")],
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
            damping_matrix=damping_matrix,
            storey_height=heights or None,
            storey_springs=[gauge.name for gauge in gauges[: len(heights)]] if heights else None,
        )
        sections = {name: np.array(each) for name, each in zip(MEMBER_PARAMETERS, self.nominal_sections, strict=True)}
        self.parameters = FrozenMapping({**self.parameters, **sections})
        table = {
            name: Parameter(units, words, low=0.0, low_open=name != "second_moment")
            for name, (units, words) in MEMBER_PARAMETERS.items()
        }
        self.parameter_table = FrozenMapping({**self.parameter_table, **table})

    def _modes(self, given: int, mass: np.ndarray) -> int:
        whole_number("modes", given, 0)
        if self.reduction != "craig_bampton":
            if given:
                raise ValueError(f"modes={given} needs reduction='craig_bampton', got {self.reduction!r}")
            return 0
        most = inner_masses(mass, self.kept)
        if not 1 <= given <= most:
            raise ValueError(f"modes must be 1 to {most} for reduction='craig_bampton', got {given}")
        return given

    def _motions(self, names: Sequence[str]) -> np.ndarray:
        """Return the displacements of the kept degrees of freedom under a unit base motion, shape [dof, component]."""
        numbering, free = self.frame.numbering, self.frame.numbering.free
        x, y = (np.zeros(len(names)) for _ in range(2))
        x[: self.kept.size] = numbering.is_horizontal[free[self.kept]]
        y[: self.kept.size] = numbering.is_vertical[free[self.kept]]
        if self.vertical and (self.reduction != "static" or not y.any()):
            raise ValueError(
                "vertical=True needs vertical masses and reduction='static': give nodes masses in y, such as "
                "masses={'B': 1e4}, or remove vertical=True"
            )
        return np.stack([x, y] if self.vertical else [x], axis=1)

    def _gauges(self, names: Sequence[str]) -> tuple[list[Spring], list[float]]:
        """Return the springs without stiffness and the storey heights [m]; without storeys, one spring and ()."""
        given = self.drift_capacity
        capacity = None if given is None else real_number("drift_capacity", given, above=0)
        found: list[Spring] = []
        heights: list[float] = []
        for storey, (upper, lower, height) in enumerate(self.frame.storey_drifts.values()):
            if upper in names and (lower is None or lower in names):
                direction = {upper: 1.0} | ({} if lower is None else {lower: -1.0})
                limit = None if capacity is None else capacity * height
                found.append(Gauge(f"storey {storey + 1}", direction, limit))
                heights.append(height)
        if found:
            return found, heights
        if capacity is not None:
            raise ValueError("drift_capacity needs storeys: give the frame diaphragms=, and keep them in dofs=")
        return [Gauge("first", {names[0]: 1.0}, None)], []

    def _named_outputs(
        self, names: Sequence[str], total: np.ndarray, shapes: np.ndarray
    ) -> dict[str, dict[str, float]]:
        """Return the outputs, and note the places of those that are not 0 for all section properties."""
        every, rows = self._rows(total[None], shapes[None], self.frame.nominal)
        random = np.random.default_rng(0)
        other = Sections(*(each * random.uniform(0.8, 1.2, each.shape) for each in self.nominal_sections))
        changed = self._of_many(other)
        of_changed = self._rows(changed["stiffness"] + changed["geometric"], changed["softened"], other)[1]
        self.output_places = np.flatnonzero(rows[0].any(axis=1) | of_changed[0].any(axis=1))
        return {every[place]: dict(zip(names, rows[0, place].tolist(), strict=True)) for place in self.output_places}

    def dim_of(self, name: str) -> str:
        """Return the dimension of a parameter's values: "dof", "spring" or "member"."""
        return "member" if name in MEMBER_PARAMETERS else super().dim_of(name)

    def names_along(self, dim: str) -> tuple[str, ...]:
        """Return the names of the members, degrees of freedom or springs."""
        return tuple(self.frame.members) if dim == "member" else super().names_along(dim)

    def length_along(self, dim: str) -> int:
        """Return the number of members, degrees of freedom, springs or outputs."""
        return len(self.frame.members) if dim == "member" else super().length_along(dim)

    def varied(self, name: str, only: tuple[str, ...] | tuple[int, ...] | None) -> np.ndarray | None:
        """Return which values of a parameter a random scatter draws, shape [place]; None: all.

        For members, `only` contains names of members or of sections.
        """
        if name not in MEMBER_PARAMETERS:
            return super().varied(name, only)
        members = self.frame.members.items()
        found = np.array([only is None or member in only or row["section"] in only for member, row in members])
        return None if found.all() else found

    def only_problem(self, name: str, only: tuple[str, ...] | tuple[int, ...]) -> str | None:
        """Return why scatter of a parameter cannot be restricted to these names; None if it can."""
        if name not in MEMBER_PARAMETERS:
            return super().only_problem(name, only)
        known = [*self.frame.members, *self.frame.sections]
        for each in only:
            if each not in known:
                return f"only= names {each!r}, which is neither a member nor a section{did_you_mean(each, known)}"
        return None

    def problem(self, values: Mapping[str, np.ndarray]) -> str | None:
        """Return a sentence on a mass or a member without stiffness or another wrong value; None if all are right."""
        for name, nominal in self._sections_by_name.items():
            given = np.atleast_2d(values.get(name, nominal))
            wrong = np.argwhere((nominal > 0) & ~(given > 0))
            if wrong.size:
                structure, member = wrong[0]
                of_member = f"{name} of member {list(self.frame.members)[member]!r}"
                return f"{of_member} must be above 0, got {given[structure, member]:g} in structure {structure}"
        try:
            return super().problem(values)
        except UnstableSections as error:
            return f"structure {self._first_unstable(values)}: {error}"

    def _first_unstable(self, values: Mapping[str, np.ndarray]) -> int:
        """Return the first structure whose eliminated displacements are not stable, by bisection.

        Args:
            values: Parameters, with which at least one structure is not stable.
        """
        given = [np.atleast_2d(values.get(name, nominal)) for name, nominal in self._sections_by_name.items()]
        first, last = 0, max(map(len, given))
        whole = [np.broadcast_to(each, (last, each.shape[1])) for each in given]
        while last - first > 1:
            middle = (first + last) // 2
            try:
                self._reduced(Sections(*(each[first:middle] for each in whole)))
            except UnstableSections:
                last = middle
            else:
                first = middle
        return first

    def free_motion_problem(self, dof: str, structure: int, values: Mapping[str, np.ndarray]) -> str:
        """Return a sentence on a structure that buckles under gravity, with its weakest random section."""
        shares = {
            (name, member): value / own
            for name, nominal in self._sections_by_name.items()
            for member, value, own in zip(self.frame.members, values[name][structure], nominal, strict=True)
            if own > 0
        }
        (name, member), share = min(shares.items(), key=lambda each: each[1])
        if not self.p_delta or share >= 1:
            return super().free_motion_problem(dof, structure, values)
        return (
            f"structure {structure} buckles under gravity (P-Delta): degree of freedom {dof!r} has no positive "
            f"stiffness. Its weakest section is {share:.3g} times the nominal one ({name} of member {member!r}). "
            f"Reduce the scatter of {name}, or correct gravity_load [N]"
        )

    def scatter_problem(self, name: str, *, is_common_factor: bool) -> str | None:
        """Return why a parameter cannot be random: the stiffness of gauges, and single masses of a reduced frame."""
        if name == "stiffness":
            return "the springs of a frame only measure drifts: scatter elastic_modulus, area or second_moment instead"
        if name == "mass" and self.reduction != "static" and not is_common_factor:
            return (
                f"masses of a frame with reduction={self.reduction!r} can only have one common factor: give "
                "RandomFactor(..., per='building')"
            )
        if name == INCIDENCE:
            return "a plane frame has no angle of incidence: its base moves in x, and vertically"
        return super().scatter_problem(name, is_common_factor=is_common_factor)

    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinates `dof`, `spring`, `member` and, if there are outputs, `output`: their names."""
        names = np.array(list(self.frame.members))
        return {**super().numbered(recorders), "member": ("member", names, {"long_name": "member"})}

    def chosen(self) -> dict[str, Any]:
        """Return the frame and the choices of its reduction, for the structure's JSON."""
        kept = [self.frame.numbering.free_names[place] for place in self.kept]
        found: dict[str, Any] = {
            "frame": self.frame.description(),
            "dofs": kept,
            "reduction": self.reduction,
            "modes": self.interface_modes,
            "p_delta": self.p_delta,
            "vertical": self.vertical,
            "outputs": list(self.output_kinds),
            "members": list(self.members_out),
            "damping": self.damping,
        }
        found |= {} if self.drift_capacity is None else {"drift_capacity": float(self.drift_capacity)}
        given = "damping_matrix" in self.matrices
        found |= {"damping_matrix": self.matrices["damping_matrix"].tolist()} if given else {}
        return found | ({"damping_modes": list(self.damping_modes)} if self.damping_modes else {})

    def description(self) -> dict[str, Any]:
        """Return the structure as a dictionary, for its JSON."""
        ratio = {name: each for name, each in self.parameters.items() if name == "damping_ratio"}
        return {"type": "ReducedFrame", **self.chosen(), **ratio}

    def __repr__(self) -> str:
        dofs = f"{self.dofs} degree{'s' if self.dofs > 1 else ''} of freedom of {self.frame.numbering.free.size}"
        return f"ReducedFrame({dofs}, T = {self.fundamental_period:.4g} s, damping={self.damping!r})"
