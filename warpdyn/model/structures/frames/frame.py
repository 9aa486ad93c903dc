"""Plane frames of beam-columns and bars; checked when they are built."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import one_of, true_or_false, whole_number
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.model.structures.frames import static
from warpdyn.model.structures.frames.choices import DEFAULT_OUTPUTS
from warpdyn.model.structures.frames.members.elements import Geometry, Sections, local_axes
from warpdyn.model.structures.frames.members.forces import demand_capacity_ratios
from warpdyn.model.structures.frames.members.matrices import FrameMatrices
from warpdyn.model.structures.frames.members.numbering import numbering_of
from warpdyn.model.structures.frames.reduced_frame import ReducedFrame
from warpdyn.model.structures.frames.reduction import frame_modes
from warpdyn.model.structures.frames.storeys import FrameStoreys
from warpdyn.model.structures.frames.tables import checks
from warpdyn.model.structures.frames.tables.columns import (
    MEMBER_COLUMNS,
    NODE_COLUMNS,
    SECTION_COLUMNS,
    read_diaphragms,
    read_loads,
    read_masses,
    read_member_loads,
    read_supports,
)
from warpdyn.model.structures.frames.tables.plausibility import warn_of_implausible_tables
from warpdyn.model.structures.frames.tables.plausible_loads import warn_of_small_static_loads
from warpdyn.model.structures.frames.tables.table import Rows, TableLike, column_of, read_table

MASS_KINDS, GEOMETRIC_KINDS = ("lumped", "consistent"), ("string", "consistent")


@with_suggestions
class Frame(FrameStoreys, FrameMatrices):
    """A plane frame: beam-columns (Euler-Bernoulli or Timoshenko) and bars between nodes in the x-y plane.

    Each table is a dictionary {name: {column: value}} (or {name: list of values in the order of the columns}), a
    DataFrame, or the path of a CSV file; the names are in the index or in the column "node", "member" or "section".
    y points up. Each node can move in x and y ("ux", "uy" [m]) and rotate counter-clockwise ("rz" [rad]). A rotation
    that no member resists, such as that of a node with trusses only, is not a degree of freedom.

    Args:
        nodes: Columns: `x`, `y` [m]; optional `support` ("fixed", "pinned", "roller" (uy) or "none"), `diaphragm` (its
            name), `mass` [kg] (in x and y), `gravity_load` [N] (downward).
        members: Columns: `start`, `end` (nodes), `section`; optional `kind` ("beam", or "truss" with only an axial
            force), `release` ("start", "end" or "both": hinges), `spring_start`, `spring_end` (rotational springs
            between joint and member end [N m/rad]; infinite: rigid), `offset_start_x`, `offset_start_y`,
            `offset_end_x`, `offset_end_y` (rigid end offsets from node to member end [m]), `gravity_load` (downward,
            along the length [N/m]), `p_delta` ("yes", or "no" for a member without geometric stiffness).
        sections: Columns: `elastic_modulus` [Pa], `area` [m2]; `second_moment` [m4] (of beams); optional
            `shear_modulus` [Pa] and `shear_area` [m2] (shear deformation: Timoshenko), `mass_per_length` [kg/m],
            `moment_capacity` [N m], `axial_capacity` [N], `shear_capacity` [N] (for demand-capacity ratios).
        supports: {node: "fixed", "pinned", "roller", or {direction: True or the stiffness of a spring [N/m or
            N m/rad]}}, in addition to the column `support`.
        diaphragms: Rigid floors, {name: list of nodes}: the nodes have one horizontal displacement, a degree of freedom
            with the name of the diaphragm.
        masses: {node: mass [kg] in x and y}, {node: {"ux": kg, "uy": kg, "rz": kg m2}}, or {diaphragm: horizontal mass
            [kg]}, in addition to the column `mass` and the mass of members.
        member_mass: Mass of members: "lumped" (half at each end, without rotational inertia) or "consistent".
        geometric_stiffness: Effect of axial forces: "string" (P-Delta, chords of members) or "consistent" (also the
            curvature of members, P-delta).

    Raises:
        ValueError: If a name is unknown or given twice, a value is missing or out of its range, a node belongs to no
            member, two nodes coincide, a member has no length, or the frame is a mechanism. The message gives the name.
        TypeError: If an argument is of another type.

    Example:
        The portal is defined in the example of the package:

        >>> portal = wd.Frame(nodes, members, sections, supports={"A": "fixed", "D": "fixed"}, **floor)
        >>> portal
        Frame(4 nodes, 3 members, 5 degrees of freedom)
        >>> portal.modal()["period"].values.round(4)
        array([0.5925])
    """

    def __init__(
        self,
        nodes: TableLike,
        members: TableLike,
        sections: TableLike,
        *,
        supports: Mapping[str, Any] | None = None,
        diaphragms: Mapping[str, Sequence[str]] | None = None,
        masses: Mapping[str, Any] | None = None,
        member_mass: str = "lumped",
        geometric_stiffness: str = "string",
    ) -> None:
        self.nodes: Rows = read_table("nodes", nodes, "node", NODE_COLUMNS)
        self.members: Rows = read_table("members", members, "member", MEMBER_COLUMNS)
        self.sections: Rows = read_table("sections", sections, "section", SECTION_COLUMNS)
        one_of("member_mass", member_mass, MASS_KINDS)
        one_of("geometric_stiffness", geometric_stiffness, GEOMETRIC_KINDS)
        self.member_mass, self.geometric_kind = member_mass, geometric_stiffness
        checks.check_tables(self.nodes, self.members, self.sections)
        self.supports = read_supports(supports, self.nodes)
        self.diaphragms = read_diaphragms(diaphragms, self.nodes)
        self.masses = read_masses(masses, self.nodes, self.diaphragms)
        self.coordinates = np.stack([column_of(self.nodes, "x"), column_of(self.nodes, "y")], axis=1)
        node_index = {name: place for place, name in enumerate(self.nodes)}
        self.ends = np.array([[node_index[row["start"]], node_index[row["end"]]] for row in self.members.values()])
        self.geometry, self.nominal = self._geometry(), self._nominal()
        offsets = self._offsets().any(axis=-1)
        resists = (~self.geometry.is_bar[:, None] & (self.geometry.end_springs > 0)) | offsets
        self.numbering = numbering_of(list(self.nodes), self.ends, resists, self.supports, self.diaphragms)
        checks.check_moves(self)
        warn_of_implausible_tables(self)

    def _of_section(self, column: str) -> np.ndarray:
        return np.array([self.sections[row["section"]][column] for row in self.members.values()])

    def _offsets(self) -> np.ndarray:
        columns = [[column_of(self.members, f"offset_{end}_{axis}") for axis in "xy"] for end in ("start", "end")]
        return np.moveaxis(np.array(columns), -1, 0)

    def _geometry(self) -> Geometry:
        start, end = (self.coordinates[self.ends[:, place]] for place in (0, 1))
        length, to_local = local_axes(start, end, self._offsets())
        checks.check_lengths(self.members, length, self.coordinates, self.ends)
        shear_stiffness = self._of_section("shear_modulus") * self._of_section("shear_area")
        with np.errstate(divide="ignore"):
            shear = np.where(shear_stiffness > 0, self._of_section("elastic_modulus") / shear_stiffness, 0.0)
        springs = np.stack([column_of(self.members, "spring_start"), column_of(self.members, "spring_end")], axis=1)
        for place, row in enumerate(self.members.values()):
            springs[place] = np.where(
                [row["release"] in ("start", "both"), row["release"] in ("end", "both")], 0.0, springs[place]
            )
        is_bar = np.array([row["kind"] == "truss" for row in self.members.values()])
        return Geometry(length, to_local, shear, springs, is_bar, self._of_section("mass_per_length"))

    def _nominal(self) -> Sections:
        return Sections(*(self._of_section(name) for name in ("elastic_modulus", "area", "second_moment")))

    @cached_property
    def gravity(self) -> np.ndarray:
        """Axial forces of the members under the gravity loads, tension positive [N], shape [member]."""
        return static.gravity_forces(self)

    @suggests_names
    def static(
        self,
        loads: TableLike | None = None,
        member_loads: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
        *,
        gravity: bool = False,
        settlements: Mapping[str, Mapping[str, float]] | None = None,
        p_delta: bool = False,
    ) -> xr.Dataset:
        """Return displacements, reactions and member forces under static loads.

        Args:
            loads: Forces on nodes, {node: {"fx": N, "fy": N, "mz": N m}}, or horizontal forces on diaphragms.
            member_loads: Loads on members in the directions of x and y, {member: {"qx", "qy": N/m along the length,
                "px", "py": N at the distance "at" [m] from the start}}; a list of such dictionaries for several loads.
            gravity: Whether the gravity loads of the tables act, too.
            settlements: Displacements of fixed supports, {node: {"ux", "uy": m, "rz": rad}}.
            p_delta: Whether equilibrium includes the geometric stiffness under the axial forces of all loads; the
                forces are found by iteration (second-order analysis).

        Returns:
            Dataset with `displacement` [node, direction], `reaction` [node, direction], `end_force` [member, end,
            force] (forces on the member's ends in its local axes: axial, shear, moment) and `axial_force` [member]
            (tension positive). The attribute `includes_gravity` is 1 or 0.

        Raises:
            ValueError: If a name is unknown, a value is not finite, a load acts on a rotation that no member resists,
                or the loads exceed the buckling load.

        Example:
            >>> pushed = portal.static({"floor": {"fx": 10e3}})
            >>> round(pushed["displacement"].sel(node="B", direction="ux").item() * 1e3, 4)  # mm
            1.2704
        """
        nodal = read_loads("loads", loads, [*self.nodes, *self.diaphragms])
        on_members = read_member_loads(member_loads, self.members)
        true_or_false("gravity", gravity)
        true_or_false("p_delta", p_delta)
        found = static.solve(self, nodal, on_members, settlements or {}, has_gravity=gravity, has_p_delta=p_delta)
        if not gravity and not settlements:
            warn_of_small_static_loads(self, nodal, on_members, found["displacement"].values)
        return found

    @suggests_names
    def buckling_factors(
        self,
        loads: TableLike | None = None,
        member_loads: Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = None,
        *,
        count: int = 1,
    ) -> np.ndarray:
        """Return the factors on the loads at which the elastic frame buckles (linear buckling analysis).

        Args:
            loads: As in `static`; None and no `member_loads`: the gravity loads of the tables.
            member_loads: As in `static`.
            count: Number of factors.

        Returns:
            The lowest positive factors in increasing order [1], shape [factor]; fewer if there are no more.

        Raises:
            ValueError: If there are no loads, or no member is compressed.

        Example:
            >>> portal.buckling_factors({"B": {"fy": -1e6}, "C": {"fy": -1e6}}).round(2)
            array([15.74])
        """
        whole_number("count", count, 1)
        nodal = read_loads("loads", loads, [*self.nodes, *self.diaphragms])
        return static.buckling(self, nodal, read_member_loads(member_loads, self.members), count)

    @suggests_names
    def modal(self, *, modes: int | None = None, p_delta: bool = False) -> xr.Dataset:
        """Return periods, shapes, participation factors and effective masses of the undamped modes.

        Degrees of freedom without mass are eliminated by static condensation, which is exact.

        Args:
            modes: Number of modes; None: all.
            p_delta: Whether the geometric stiffness under the gravity loads of the tables is included.

        Raises:
            ValueError: If the frame has no mass, or gravity exceeds the buckling load.

        Example:
            >>> portal.modal()["participation_factor"].values
            array([1.])
        """
        if modes is not None:
            whole_number("modes", modes, 1)
        return frame_modes(self, modes, has_p_delta=true_or_false("p_delta", p_delta))

    @suggests_names
    def lumped(
        self,
        dofs: Sequence[str] | None = None,
        *,
        reduction: str = "static",
        modes: int = 0,
        p_delta: bool = False,
        vertical: bool = False,
        outputs: Sequence[str] = DEFAULT_OUTPUTS,
        members: Sequence[str] | None = None,
        drift_capacity: float | None = None,
        damping: str = "none",
        damping_ratio: float | None = None,
        damping_modes: tuple[int, int] | None = None,
        damping_matrix: ArrayLike | None = None,
    ) -> ReducedFrame:
        """Return the elastic frame as a LumpedStructure with few degrees of freedom, for histories and ensembles.

        Besides `mass` and `damping_ratio`, the parameters `elastic_modulus` [Pa], `area` [m2] and `second_moment` [m4]
        can be random: one value per member (`per="member"`), or one factor for all. Members with shear deformation
        keep the ratio of `shear_modulus` to `elastic_modulus` (Poisson's ratio): a random `elastic_modulus` multiplies
        both, and `shear_area` is not random.

        Args:
            dofs: Degrees of freedom to keep: diaphragms, and "node ux", "node uy" or "node rz"; None: all with mass.
            reduction: "static" (massless degrees of freedom are eliminated, exact), "guyan" (others are eliminated as
                if they had no inertia forces, which makes frequencies too high) or "craig_bampton" (Guyan's shapes and
                the first `modes` modes with fixed `dofs`).
            modes: Number of fixed-interface modes of "craig_bampton".
            p_delta: Whether gravity loads soften the frame.
            vertical: Whether the base moves vertically, too: motions are a `PairOfMotions` of x and y (only "static").
            outputs: Outputs of runs: "drift" (storey drift ratios "drift 1" and so on [1]), "base_shear" [N] and
                "member_force" (axial force, shear force and moment at both ends of `members` [N, N m], such as "beam
                moment start").
            members: Members of the outputs "member_force"; None: all.
            drift_capacity: Storey drift ratio at which samples collapse [1]; None: no collapse. It needs diaphragms.
            damping: Inherent damping, as for a LumpedStructure.
            damping_ratio: Viscous damping ratio [1].
            damping_modes: The two modes of Rayleigh damping, counted from 1; None: 1 and 2.
            damping_matrix: Damping of the kept degrees of freedom in addition to `damping` [N s/m], shape [dof, dof].

        Returns:
            The structure. Its springs, "storey 1" and so on, have no stiffness: their deformations are the storey
            drifts [m].

        Raises:
            ValueError: If a name is unknown, a kept degree of freedom has no mass, an eliminated one has mass with
                "static", there are more than 64, or gravity exceeds the buckling load.

        Example:
            >>> structure = portal.lumped(damping="modal", damping_ratio=0.02)
            >>> structure
            ReducedFrame(1 degree of freedom of 5, T = 0.5925 s, damping='modal')
            >>> scatter = {"second_moment": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="member")}
            >>> run = wd.simulate(wd.Scene(structure, wd.Cloud(motions), scatter), structures=3, seed=1)
            >>> run["peak_output"].sel(output="drift 1").dims
            ('sample',)
        """
        return ReducedFrame(
            self,
            dofs=dofs,
            reduction=reduction,
            modes=modes,
            p_delta=p_delta,
            vertical=vertical,
            outputs=outputs,
            members=members,
            drift_capacity=drift_capacity,
            damping=damping,
            damping_ratio=damping_ratio,
            damping_modes=damping_modes,
            damping_matrix=damping_matrix,
        )

    @suggests_names
    def demand_capacity(self, results: xr.Dataset, *, gravity: bool = True) -> xr.Dataset:
        """Return the largest forces of members (their envelope) and their ratios to the capacities of the sections.

        Args:
            results: Result of `static`; or a run of a structure of `lumped` with the outputs "member_force".
            gravity: Whether the absolute forces under the gravity loads of the tables are added, unless the result is
                that of `static(gravity=True)`. The sum is an upper bound, because both may have opposite signs.

        Returns:
            Dataset with `axial_demand`, `shear_demand` [N] and `moment_demand` [N m], their ratios `axial_ratio`,
            `shear_ratio`, `moment_ratio` to the capacities [1] (0 for an infinite capacity), and `interaction_ratio`,
            the sum of axial and moment ratio; dimensions (sample,) member.

        Raises:
            ValueError: If the results contain no forces of members, or those of `static` have lost the attribute
                `includes_gravity`.
            TypeError: If `results` is not a Dataset.

        Example:
            >>> forces = portal.static({"floor": {"fx": 10e3}})
            >>> portal.demand_capacity(forces)["moment_demand"].values.round(0)
            array([11399.,  8601., 11399.])
        """
        true_or_false("gravity", gravity)
        return demand_capacity_ratios(self, results, has_gravity=gravity and static.has_gravity(self))

    def description(self) -> dict[str, Any]:
        """Return the arguments of the frame as a dictionary, for the JSON of scenes; defaults are left out."""
        tables = (
            ("nodes", self.nodes, NODE_COLUMNS),
            ("members", self.members, MEMBER_COLUMNS),
            ("sections", self.sections, SECTION_COLUMNS),
        )
        # The arguments supports, diaphragms and masses contain those of the table of nodes.
        elsewhere = ("support", "diaphragm", "mass")
        found: dict[str, Any] = {
            argument: {
                name: {
                    key: row[key]
                    for key, column in columns.items()
                    if row[key] != column.default and (argument != "nodes" or key not in elsewhere)
                }
                for name, row in rows.items()
            }
            for argument, rows, columns in tables
        }
        return found | {
            "supports": self.supports,
            "diaphragms": self.diaphragms,
            "masses": self.masses,
            "member_mass": self.member_mass,
            "geometric_stiffness": self.geometric_kind,
        }

    def __repr__(self) -> str:
        size = f"{len(self.nodes)} nodes, {len(self.members)} members, {self.numbering.free.size} degrees of freedom"
        return f"Frame({size})"
