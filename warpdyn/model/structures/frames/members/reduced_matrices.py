"""Reduced matrices of a frame with random section properties."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from warpdyn.engine.methods.undamped_modes import are_diagonal, diagonal_matrices
from warpdyn.model.structures.frames.members.condensation import BUCKLES, Condensation
from warpdyn.model.structures.frames.members.elements import Sections, stiffness_coefficients
from warpdyn.model.structures.frames.members.forces import force_names, force_rows
from warpdyn.model.structures.frames.reduction import condensation_under_gravity, reduced, shapes_of
from warpdyn.model.structures.lumped.structure import LumpedStructure

if TYPE_CHECKING:
    from warpdyn.model.structures.frames.frame import Frame

MEMBER_PARAMETERS = {  # name -> (units, name in words), in the order of `Sections`
    "elastic_modulus": ("Pa", "elastic modulus of the member"),
    "area": ("m2", "cross-sectional area of the member"),
    "second_moment": ("m4", "second moment of area of the member"),
}
# Structures whose free degrees of freedom are assembled at once, and most values of their matrices.
AT_A_TIME, MOST_VALUES = 512, 2**23
# The frame and the section properties that a thread has reduced last, and the result: several matrices need it.
_last = threading.local()


def are_equal(values: np.ndarray) -> bool:
    """Return whether all structures have equal values, shape [structure, ...]."""
    return values.strides[0] == 0 or bool((values == values[:1]).all())  # a distance of 0: they share memory


class ReducedMatrices(LumpedStructure):
    """Methods of a ReducedFrame that return matrices; `values` are parameters with the first dimension structure."""

    frame: Frame
    reduction: str
    p_delta: bool
    kept: np.ndarray
    interface_modes: int
    output_kinds: tuple[str, ...]
    members_out: tuple[str, ...]
    nominal_mass: np.ndarray
    motion: np.ndarray
    output_places: np.ndarray

    @property
    def nominal_sections(self) -> tuple[np.ndarray, ...]:
        """Section properties of the frame in the order of `Sections`, shape [member] each."""
        nominal = self.frame.nominal
        return nominal.modulus, nominal.area, nominal.inertia

    def mass_matrices(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the mass matrices [kg]: the nominal matrix, scaled by the masses of the degrees of freedom."""
        factor, mass = np.sqrt(values["mass"] / self.nominal_mass), self._part("mass", values)
        if len(mass) == 1 and are_diagonal(mass).all():
            return diagonal_matrices(np.diag(mass[0]) * factor * factor)
        return mass * factor[:, :, None] * factor[:, None, :]

    def load_masses(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return symmetric matrices whose product with the influence is the load of the whole frame [kg]."""
        mass = self.mass_matrices(values)
        if self.reduction == "static":
            return mass
        # L with L i = p: p is the load of all masses, also of eliminated degrees of freedom.
        factor = np.sqrt(values["mass"] / self.nominal_mass)
        load = self._part("load", values) * factor**2
        motion = self.motion[:, 0]
        square = motion @ motion
        outer = load[:, :, None] * motion
        along = (load @ motion)[:, None, None] * np.outer(motion, motion)
        found: np.ndarray = (outer + np.swapaxes(outer, 1, 2)) / square - along / square**2
        return found

    def elastic_matrices(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the elastic stiffness without the geometric one [N/m], shape [structure or 1, dof, dof]."""
        return self._part("stiffness", values)

    def geometric_matrices(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the geometric stiffness that is subtracted [N/m], shape [structure or 1, dof, dof]."""
        return self._part("geometric", values)

    def output_matrices(self, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the coefficients of the outputs, shape [structure or 1, output, dof]."""
        return self._part("output", values)

    def _part(self, name: str, values: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return a reduced matrix of structures with drawn section properties, first dimension structure or 1."""
        found: np.ndarray = self.constant[name] if name in self.constant else self._parts(values)[name]
        return found

    def _parts(self, values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the reduced matrices that depend on the sections."""
        given = [np.atleast_2d(values.get(name, nominal)) for name, nominal in self._sections_by_name.items()]
        given = [each[:1] if are_equal(each) else each for each in given]
        frame, last = getattr(_last, "reduced", (lambda: None, []))
        if frame() is self and all(np.array_equal(*pair) for pair in zip(last[0], given, strict=True)):
            return dict(last[1])
        found = self._reduced(Sections(*given))
        kept = [[each.copy() for each in given], found]
        _last.reduced = weakref.ref(self, lambda _: kept.clear()), kept
        return dict(found)

    @property
    def _sections_by_name(self) -> dict[str, np.ndarray]:
        return dict(zip(MEMBER_PARAMETERS, self.nominal_sections, strict=True))

    def _of_many(self, sections: Sections) -> dict[str, np.ndarray]:
        """Return the matrices of the free degrees of freedom of some structures, and the shapes of their reduction."""
        frame, numbering = self.frame, self.frame.numbering
        stiffness = numbering.assembled_of_many(frame.stiffness_of_members(sections), has_springs=True)
        mass = numbering.assembled_of_many(frame.mass_of_members(sections))
        mass = mass + np.diag(frame.lumped_masses[numbering.free])
        shapes = shapes_of(stiffness, mass, self.kept, self.interface_modes)
        geometric = np.zeros((1, *stiffness.shape[1:]))
        if self.p_delta:
            geometric = numbering.assembled_of_many(frame.geometric_of_members(frame.gravity, sections))
        softened = self._softened(stiffness, geometric, shapes)
        return {"stiffness": stiffness, "geometric": geometric, "mass": mass, "shapes": shapes, "softened": softened}

    def _condensed(self, sections: Sections) -> dict[str, np.ndarray]:
        """Return stiffness and geometric stiffness of structures whose other matrices do not depend on the sections."""
        coefficients = stiffness_coefficients(self.frame.geometry, sections)
        elastic, under_gravity = self.condensations
        found = {"stiffness": elastic.condensed(coefficients)}
        if under_gravity is not None:
            found["geometric"] = found["stiffness"] - under_gravity.condensed(coefficients)
        return found

    def _reduced(self, sections: Sections) -> dict[str, np.ndarray]:
        """Return the reduced matrices that depend on the sections."""
        if self.constant:
            return self._condensed(sections)
        values = np.broadcast_arrays(sections.modulus, sections.area, sections.inertia)
        count, size = len(values[0]), self.frame.numbering.free.size
        step = max(1, min(AT_A_TIME, MOST_VALUES // (size * size)))
        parts = [
            self._reduced_part(Sections(*(each[first : first + step] for each in values)))
            for first in range(0, count, step)
        ]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def _reduced_part(self, sections: Sections) -> dict[str, np.ndarray]:
        """Return the reduced matrices of some structures that depend on their sections."""
        whole = self._of_many(sections)
        stiffness, geometric, mass, shapes, softened = whole.values()
        moved = self.frame.numbering.is_horizontal[self.frame.numbering.free].astype(float)
        found = {
            "stiffness": reduced(stiffness, shapes),
            "mass": reduced(mass, shapes),
            "load": np.swapaxes(shapes, 1, 2) @ (mass @ moved)[..., None],
            "output": self._rows(stiffness + geometric, softened, sections)[1][:, self.output_places],
            "geometric": np.zeros((len(shapes), *self.nominal_mass.shape * 2)),
        }
        found["load"] = found["load"][..., 0]
        # Fixed-interface modes are decoupled from each other and from the kept displacements.
        kept, modes = self.kept.size, self.interface_modes
        if modes:
            found["stiffness"][:, :kept, kept:] = found["stiffness"][:, kept:, :kept] = 0.0
            found["stiffness"][:, kept:, kept:] *= np.eye(modes)
            found["mass"][:, kept:, kept:] = np.eye(modes)
        if self.p_delta:
            found["geometric"] = -reduced(geometric, shapes, softened)
        return found

    @cached_property
    def constant(self) -> dict[str, np.ndarray]:
        """The reduced matrices that do not depend on the sections, first dimension 1.

        They are given if the shapes of eliminated displacements are not needed; then only the stiffness is condensed.
        Otherwise the dictionary is empty. The geometric stiffness is constant if it acts only on kept displacements.
        """
        frame, kept = self.frame, self.frame.numbering.free[self.kept]
        drifts = {floor for upper, lower, _ in frame.storey_drifts.values() for floor in (upper, lower) if floor}
        is_alone = self.reduction == "static" and frame.member_mass == "lumped" and not {*self.output_kinds} - {"drift"}
        is_alone &= not self.p_delta or frame.geometric_kind == "string"
        if not is_alone or drifts - {frame.numbering.names[place] for place in kept}:
            return {}
        found = {"mass": frame.mass()[kept][:, kept].toarray()[None], "output": self.output_rows[None]}
        geometric = self._geometric
        rest = geometric.copy()
        rest[np.ix_(self.kept, self.kept)] = 0.0
        return found if rest.any() else found | {"geometric": -geometric[np.ix_(self.kept, self.kept)][None]}

    @property
    def _geometric(self) -> np.ndarray:
        """Geometric stiffness with the nominal sections, tension positive [N/m], shape [free, free]."""
        free = self.frame.numbering.free
        found: np.ndarray = np.zeros((free.size,) * 2)
        return self.frame.geometric(self.frame.gravity)[free][:, free].toarray() if self.p_delta else found

    @cached_property
    def condensations(self) -> tuple[Condensation, Condensation | None]:
        """Condensation of the stiffness without and with the geometric stiffness; None if this is constant."""
        frame, free = self.frame, self.frame.numbering.free
        springs = np.diag(frame.numbering.springs[free])
        elastic = Condensation(frame.deformations, springs, self.kept)
        if "geometric" in self.constant:
            return elastic, None
        return elastic, Condensation(frame.deformations, springs + self._geometric, self.kept, BUCKLES)

    def _softened(self, stiffness: np.ndarray, geometric: np.ndarray, shapes: np.ndarray) -> np.ndarray:
        """Return the shapes under gravity: with "static" those of K + K_g, otherwise those of K."""
        if not self.p_delta or self.reduction != "static":
            return shapes
        return condensation_under_gravity(stiffness, geometric, self.kept)

    def _rows(self, total: np.ndarray, shapes: np.ndarray, sections: Sections) -> tuple[tuple[str, ...], np.ndarray]:
        """Return the names of outputs and their coefficients, shape [structure, output, dof].

        Args:
            total: Stiffness with the geometric stiffness of P-Delta, shape [structure, free, free].
            shapes: Displacements per kept degree of freedom, shape [structure, free, dof].
            sections: Section properties.
        """
        frame, count, dofs = self.frame, *shapes.shape[::2]
        free_names = list(frame.numbering.free_names)
        names: list[str] = []
        rows: list[np.ndarray] = []
        if "drift" in self.output_kinds:
            for name, (upper, lower, height) in frame.storey_drifts.items():
                row = shapes[:, free_names.index(upper)]
                if lower is not None:
                    row = row - shapes[:, free_names.index(lower)]
                names.append(name)
                rows.append(row[:, None] / height)
        if "base_shear" in self.output_kinds:
            moved = frame.numbering.is_horizontal[frame.numbering.free].astype(float)
            names.append("base shear")
            rows.append((moved @ total)[:, None] @ shapes)
        if "member_force" in self.output_kinds:
            names += force_names(self.members_out)
            bent = frame.bent(sections)
            softening = frame.local_geometric(frame.gravity, bent[1], sections) if self.p_delta else None
            rows.append(force_rows(frame, self.members_out, shapes, bent, softening))
        found = np.concatenate(rows, axis=1) if rows else np.zeros((count, 0, dofs))
        return tuple(names), found
