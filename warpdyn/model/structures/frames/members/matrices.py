"""Stiffness, geometric stiffness and mass matrices of a frame, of one structure (sparse) or of many (dense)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from warpdyn.model.structures.frames.members.elements import (
    EndConditions,
    Geometry,
    Sections,
    beam_stiffness,
    deformations_of,
    end_conditions,
    geometric_stiffness_of,
    mass_of,
    shear_ratio,
    stiffness_coefficients,
)
from warpdyn.model.structures.frames.members.numbering import Numbering
from warpdyn.model.structures.frames.tables.columns import DIRECTIONS
from warpdyn.model.structures.frames.tables.table import Rows

if TYPE_CHECKING:
    from scipy import sparse

Bent: TypeAlias = tuple[np.ndarray, EndConditions]


class FrameMatrices:
    """Methods of a Frame that return matrices; section properties have the last dimension member."""

    nodes: Rows
    members: Rows
    diaphragms: dict[str, list[str]]
    masses: Mapping[str, Mapping[str, float]]
    member_mass: str
    geometric_kind: str
    geometry: Geometry
    nominal: Sections
    numbering: Numbering

    def bent(self, sections: Sections) -> Bent:
        """Return the local stiffness without releases, and the effect of end springs, shape [..., member, 6, 6]."""
        stiffness = beam_stiffness(self.geometry, sections)
        return stiffness, end_conditions(self.geometry, stiffness)

    def in_nodes(self, local: np.ndarray) -> np.ndarray:
        """Return local matrices in the displacements of the nodes, shape [..., member, 6, 6]."""
        to_local = self.geometry.to_local
        found: np.ndarray = to_local.transpose(0, 2, 1) @ local @ to_local
        return found

    @cached_property
    def deformations(self) -> np.ndarray:
        """Deformations of members, see `deformations_of`, per free displacement, shape [member, 3, free]."""
        of_nodes, numbering = deformations_of(self.geometry), self.numbering
        found = np.zeros((*of_nodes.shape[:2], len(numbering.names)))
        places = np.broadcast_to(numbering.of_members[:, None], of_nodes.shape)
        members, deformations = np.ogrid[: len(found), : found.shape[1]]
        np.add.at(found, (members[..., None], deformations[..., None], places), of_nodes)
        return found[..., numbering.free]

    def stiffness_of_members(self, sections: Sections) -> np.ndarray:
        """Return the stiffness matrices of members in the displacements of their nodes, shape [..., member, 6, 6]."""
        moved = deformations_of(self.geometry)
        axial, start, both, end = np.moveaxis(stiffness_coefficients(self.geometry, sections), -1, 0)[..., None, None]
        outer = moved[:, :, None, :, None] * moved[:, None, :, None, :]
        found: np.ndarray = axial * outer[:, 0, 0] + start * outer[:, 1, 1] + end * outer[:, 2, 2]
        return found + both * (outer[:, 1, 2] + outer[:, 2, 1])

    def geometric_of_members(self, axial: np.ndarray, sections: Sections) -> np.ndarray:
        """Return the geometric stiffness of members; `axial`: tension [N], shape [member].

        That of strings is [member, 6, 6], because it does not depend on the sections; others are [..., member, 6, 6].
        """
        if self.geometric_kind == "string":
            return self.in_nodes(self.local_geometric(axial, None))
        _, conditions = self.bent(sections)
        return self.in_nodes(self.local_geometric(axial, conditions, sections))

    def local_geometric(
        self, axial: np.ndarray, conditions: EndConditions | None, sections: Sections | None = None
    ) -> np.ndarray:
        """Return the geometric stiffness in local axes, 0 for members with `p_delta="no"`, shape [..., member, 6, 6].

        Args:
            axial: Tension [N], shape [member].
            conditions: Effect of end springs; None for strings, which have no stiffness against rotations.
            sections: Section properties; None: the nominal ones.
        """
        axial = np.where([row["p_delta"] == "yes" for row in self.members.values()], axial, 0.0)
        phi = shear_ratio(self.geometry, self.nominal if sections is None else sections)
        unit = geometric_stiffness_of(self.geometry, self.geometric_kind, phi) * axial[:, None, None]
        if conditions is None or self.geometric_kind == "string":
            return unit
        found: np.ndarray = np.swapaxes(conditions.ends, -1, -2) @ unit @ conditions.ends
        return found

    def mass_of_members(self, sections: Sections) -> np.ndarray:
        """Return the mass matrices of members in the displacements of their nodes, shape [..., member, 6, 6].

        Lumped masses do not depend on the sections: shape [member, 6, 6].
        """
        one = shear_ratio(self.geometry, sections if self.member_mass == "consistent" else self.nominal)
        local = mass_of(self.geometry, self.member_mass, one)
        if self.member_mass == "consistent":
            _, conditions = self.bent(sections)
            local = np.swapaxes(conditions.ends, -1, -2) @ local @ conditions.ends
            return self.in_nodes(local)
        # A lumped mass has no rotational inertia, also if it is at a rigid end offset from its node.
        found = self.in_nodes(local)
        keep = np.zeros((6, 6))
        for place in (0, 1, 3, 4):
            keep[place, place] = 1.0
        return found * keep

    @cached_property
    def lumped_masses(self) -> np.ndarray:
        """Masses of nodes and diaphragms [kg] or [kg m2] at the independent degrees of freedom, shape [dof]."""
        found = np.zeros(len(self.numbering.names))
        index = {name: place for place, name in enumerate(self.nodes)}
        for name, mass in self.masses.items():
            for direction, value in mass.items():
                if name in self.diaphragms:
                    found[self.numbering.names.index(name)] += value
                else:
                    found[self.numbering.places[index[name], DIRECTIONS.index(direction)]] += value
        return found

    def stiffness(self, sections: Sections, *, has_springs: bool = True) -> sparse.csc_array:
        """Return the stiffness matrix of all independent degrees of freedom [N/m], sparse."""
        return self.numbering.assembled(self.stiffness_of_members(sections), has_springs=has_springs)

    def geometric(self, axial: np.ndarray) -> sparse.csc_array:
        """Return the geometric stiffness under axial forces (tension positive) [N/m], sparse."""
        return self.numbering.assembled(self.geometric_of_members(axial, self.nominal))

    def mass(self) -> sparse.csc_array:
        """Return the mass matrix of all independent degrees of freedom [kg], sparse."""
        from scipy import sparse

        found = self.numbering.assembled(self.mass_of_members(self.nominal))
        return found + sparse.diags_array(self.lumped_masses).tocsc()
