"""Matrices of lumped structures with drawn parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from warpdyn.engine.kernels.hinges.layout import JointFrame
from warpdyn.engine.kernels.lumped.pattern import ColumnLine
from warpdyn.engine.methods.undamped_modes import undamped
from warpdyn.model.structures.lumped.biaxial_spring import Component
from warpdyn.model.structures.lumped.damping import rayleigh_factors
from warpdyn.model.structures.lumped.names import Rows, row_of
from warpdyn.model.structures.lumped.spring import Spring

Values = Mapping[str, np.ndarray]
INCIDENCE = "incidence_angle"  # parameter of structures under pairs of motions
SAME_FACTOR = 1e-9  # largest relative difference of two factors on masses that count as equal
ROUNDED_DAMPING = 1e-12  # see `without_rounding`: entries of modal damping matrices
# Parameters with one value per degree of freedom, and with one per member of a frame; others have one per spring or per
# structure.
OF_DOFS = ("mass",)
OF_STOREYS = ("height",)
OF_STRUCTURE = ("damping_ratio", INCIDENCE)
OF_MEMBERS = ("elastic_modulus", "area", "second_moment")


class StaticSystem(NamedTuple):
    """Equations of static equilibrium; the first coordinates are the degrees of freedom, the others are massless.

    Args:
        deformations: Coefficients of the springs' deformations, shape [spring, coordinate].
        stiffness: Elastic minus geometric stiffness without springs [N/m], shape [coordinate, coordinate].
        loads: Permanent loads [N], shape [coordinate].
    """

    deformations: np.ndarray
    stiffness: np.ndarray
    loads: np.ndarray


class LumpedMatrices:
    """Methods of a LumpedStructure that return matrices; `values` are parameters with the first dimension structure."""

    dof_names: tuple[str, ...]
    springs: tuple[Spring | Component, ...]
    matrices: Mapping[str, np.ndarray]
    load_mass: np.ndarray | None
    parameters: Mapping[str, np.ndarray]
    influence: np.ndarray
    outputs: Mapping[str, Rows]
    damping: str
    damping_modes: tuple[int, int] | None

    @cached_property
    def directions(self) -> np.ndarray:
        """Coefficients of the springs' deformations, shape [spring, dof]."""
        return np.stack([row_of(spring.direction, self.dof_names) for spring in self.springs])

    @property
    def output_rows(self) -> np.ndarray:
        """Coefficients of the outputs, shape [row, dof]: the first rows of all outputs, then the others."""
        given = list(self.outputs.values())
        ordered = [rows[0] for rows in given] + [row for rows in given for row in rows[1:]]
        rows: Sequence[np.ndarray] = [row_of(row, self.dof_names) for row in ordered]
        return np.stack(rows) if rows else np.zeros((0, len(self.dof_names)))

    @property
    def resultants(self) -> tuple[tuple[int, ...], ...]:
        """For each output the places of its rows in `output_rows` after the first one; () for an ordinary output."""
        found, place = [], len(self.outputs)
        for rows in self.outputs.values():
            found.append(tuple(range(place, place + len(rows) - 1)))
            place += len(rows) - 1
        return tuple(found)

    @property
    def loaded_coupling(self) -> np.ndarray | None:
        """The part of `mass_matrix` on which the base acceleration acts [kg], shape [dof, dof]; None: it has no entry.

        The other part, such as an inertance, is not random; this part is proportional to the masses.
        """
        found = self.matrices.get("mass_matrix")
        if self.load_mass is not None:
            found = self.load_mass - np.diag(self.parameters["mass"])
        return found if found is not None and found.any() else None

    def mass_matrices(self, values: Values) -> np.ndarray:
        """Return the mass matrices [kg], shape [structure, dof, dof]."""
        found: np.ndarray = values["mass"][:, :, None] * np.eye(len(self.dof_names))
        found = found + self.matrices.get("mass_matrix", 0.0)
        nominal = self.parameters["mass"]
        coupling = None if (values["mass"] == nominal).all() else self.loaded_coupling
        if coupling is not None:  # `mass_problem` refuses different factors of two coupled degrees of freedom
            factor = np.where(nominal > 0, values["mass"] / np.where(nominal > 0, nominal, 1.0), 1.0)
            root = np.sqrt(np.maximum(factor, 0.0))
            found = found + (root[:, :, None] * root[:, None, :] - 1) * coupling
        return found

    def coupled_mass_problem(self, values: Values) -> str | None:
        """Return a sentence on random masses of two degrees of freedom that `mass_matrix` couples, or None."""
        nominal = self.parameters["mass"]
        coupling = None if (values["mass"] == nominal).all() else self.loaded_coupling
        if coupling is None:
            return None
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = np.atleast_2d(values["mass"]) / nominal
        for i, j in np.argwhere(coupling):
            bad = np.abs(factor[:, i] - factor[:, j]) > SAME_FACTOR * np.abs(factor[:, i])
            if bad.any() or not np.isfinite(factor[:, i]).all():
                pair = f"{self.dof_names[i]!r} and {self.dof_names[j]!r}"
                return (
                    f"the random masses of {pair}, which mass_matrix couples, have different factors, or the mass is "
                    "only in mass_matrix, so that its value in mass_matrix is unknown: give RandomFactor(..., "
                    "per='building'), which multiplies mass and mass_matrix by one factor, only= degrees of freedom "
                    "that are not coupled, or load_mass= without the entries that are not random"
                )
        return None

    def load_masses(self, values: Values) -> np.ndarray:
        """Return the mass matrices of the load [kg], shape [structure or 1, dof, dof]."""
        mass = self.mass_matrices(values)
        if self.load_mass is None:
            return mass
        # The difference between both matrices, such as an inertance, is not random.
        nominal = self.mass_matrices({name: each[None] for name, each in self.parameters.items()})
        return mass - (nominal - self.load_mass)

    def influences(self, values: Values) -> np.ndarray:
        """Return the influence matrices [1], shape [structure, dof, component], of structures at drawn angles."""
        if INCIDENCE in values:
            return turned_influence(self.influence, values[INCIDENCE])
        return np.broadcast_to(self.influence, (len(values["mass"]), *self.influence.shape))

    def free_motion_problem(self, dof: str, structure: int, values: Values) -> str:
        """Return a sentence on a motion of one of the structures without resistance, mainly of `dof`."""
        cause = " or buckles under the geometric stiffness" if "geometric_stiffness" in self.matrices else ""
        return (
            f"degree of freedom {dof!r} can move freely{cause}: no spring with an initial stiffness resists this "
            "motion. Add a spring, or correct a direction"
        )

    def of_springs(self, per_spring: np.ndarray) -> np.ndarray:
        """Return the matrix of springs with these stiffnesses or dashpots, shape [structure, dof, dof].

        Args:
            per_spring: Stiffness [N/m] or damping coefficient [N s/m], shape [structure, spring].
        """
        # Hinges of frames act on no degree of freedom.
        acting = np.flatnonzero(self.directions.any(axis=1) & per_spring.any(axis=0))
        rows = self.directions[acting]
        found: np.ndarray = rows.T @ (per_spring[:, acting, None] * rows)
        return found

    def stiffness_matrices(
        self, values: Values, per_spring: np.ndarray | None = None, *, has_gravity: bool = True
    ) -> np.ndarray:
        """Return the stiffness matrices [N/m], shape [structure, dof, dof].

        Args:
            values: Parameter values.
            per_spring: Stiffness of the springs [N/m], shape [structure, spring]; None: the initial stiffness.
            has_gravity: Whether the geometric stiffness is subtracted.
        """
        found = self.of_springs(values["stiffness"] if per_spring is None else per_spring)
        found = found + self.elastic_matrices(values)
        return found - self.geometric_matrices(values) if has_gravity else found

    def elastic_matrices(self, values: Values) -> np.ndarray | float:
        """Return the elastic stiffness in addition to the springs [N/m], shape [structure or 1, dof, dof], or 0."""
        return self.matrices.get("stiffness_matrix", 0.0)

    def linear_matrices(self, values: Values) -> np.ndarray | float:
        """Return the part of `elastic_matrices` that kernels multiply by displacements."""
        return self.elastic_matrices(values)

    @property
    def column_line(self) -> ColumnLine | JointFrame | None:
        """The column line of a fish-bone frame with hinges, or the layout of another frame with hinges, or None."""
        return None

    def values_of_line(self, values: Values) -> np.ndarray:
        """Return the values of the column line, shape [value, structure]."""
        return np.zeros((0, len(values["mass"])))

    def geometric_matrices(self, values: Values) -> np.ndarray | float:
        """Return the stiffness that gravity takes away [N/m], shape [structure or 1, dof, dof], or 0."""
        return self.matrices.get("geometric_stiffness", 0.0)

    def static_system(self) -> StaticSystem:
        """Return the equations of static equilibrium; loads of a pushover act on the degrees of freedom."""
        one = {name: values[None] for name, values in self.parameters.items()}
        elastic = np.zeros((1, len(self.dof_names), len(self.dof_names)))
        elastic = elastic + self.elastic_matrices(one) - self.geometric_matrices(one)
        return StaticSystem(self.directions, elastic[0], np.zeros(len(self.dof_names)))

    def forces_of_gauges(self, coordinates: np.ndarray) -> np.ndarray:
        """Return the forces that members exert in place of the first springs [N], shape [step, spring].

        Args:
            coordinates: Coordinates of `static_system` relative to the state under permanent loads, shape [step,
                coordinate].
        """
        return np.zeros((len(coordinates), 0))

    def output_matrices(self, values: Values) -> np.ndarray:
        """Return the coefficients of the outputs, shape [structure or 1, output, dof]."""
        return self.output_rows[None]

    def rayleigh(self, values: Values, frequency: np.ndarray) -> np.ndarray:
        """Return the factors of mass [1/s] and stiffness [s], shape [2, structure]; `frequency`: [structure, mode]."""
        return rayleigh_factors(self.damping, self.damping_modes, values, frequency)

    def dashpots(self, values: Values, rayleigh: np.ndarray) -> np.ndarray:
        """Return the coefficients of the springs' dashpots [N s/m], shape [structure, spring]."""
        own = values.get("damping_coefficient", 0.0)
        return own + rayleigh[1][:, None] * values["stiffness"]

    def damping_between_dofs(self, values: Values, rayleigh: np.ndarray) -> np.ndarray:
        """Return the damping matrices without dashpots and without the part in proportion to the mass [N s/m]."""
        count, dofs = len(values["mass"]), len(self.dof_names)
        found = np.broadcast_to(self.matrices.get("damping_matrix", 0.0), (count, dofs, dofs))
        if "stiffness_matrix" in self.matrices and rayleigh[1].any():
            found = found + rayleigh[1][:, None, None] * self.elastic_matrices(values)
        if self.damping == "modal":
            mass = self.mass_matrices(values)
            squared, shape = undamped(mass, self.stiffness_matrices(values))
            momentum = mass @ shape
            ratio = values["damping_ratio"][:, None] * 2 * np.sqrt(squared)
            modal = (momentum * ratio[:, None, :]) @ momentum.transpose(0, 2, 1)
            found = found + without_rounding((modal + modal.transpose(0, 2, 1)) / 2, ROUNDED_DAMPING)
        return found

    def damping_matrices(self, values: Values, rayleigh: np.ndarray) -> np.ndarray:
        """Return the damping matrices at rest [N s/m], shape [structure, dof, dof]."""
        found = self.damping_between_dofs(values, rayleigh) + self.of_springs(self.dashpots(values, rayleigh))
        return found + rayleigh[0][:, None, None] * self.mass_matrices(values) if rayleigh[0].any() else found

    def central_matrices(self, values: Values) -> dict[str, np.ndarray]:
        """Return mass, stiffness and damping matrix of one structure; `values` have no dimension structure."""
        one = {name: np.asarray(each)[None] for name, each in values.items()}
        mass, stiffness = self.mass_matrices(one), self.stiffness_matrices(one)
        damping = self.damping_matrices(one, self.rayleigh(one, np.sqrt(undamped(mass, stiffness)[0])))
        return {"mass": mass[0], "stiffness": stiffness[0], "damping": damping[0]}


def of_springs_only(values: Values) -> dict[str, np.ndarray]:
    """Return the parameters without those of degrees of freedom, storeys and members, for the laws of the springs."""
    return {name: each for name, each in values.items() if name not in (*OF_DOFS, *OF_MEMBERS, *OF_STOREYS)}


def turned_influence(influence: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the influence matrices of structures that are turned anticlockwise, seen from above.

    The first two components of the base motion are horizontal and perpendicular. In the axes of the turned structure
    they are c x + s y and c y - s x, with the cosine c and the sine s of the angle.

    Args:
        influence: Displacements of the degrees of freedom under unit displacements of the base, shape [dof, component].
        angle: Angle of each structure [rad], shape [structure].

    Returns:
        The matrices, shape [structure, dof, component].
    """
    cosine, sine = (function(angle)[:, None] for function in (np.cos, np.sin))
    found = np.repeat(influence[None], len(angle), axis=0)
    x, y = influence[:, 0], influence[:, 1]
    found[:, :, 0] = cosine * x - sine * y
    found[:, :, 1] = sine * x + cosine * y
    return found


def without_rounding(matrices: np.ndarray, share: float) -> np.ndarray:
    """Return symmetric matrices with 0 where an entry is only rounding, shape [structure, dof, dof].

    An entry is rounding if it is at most `share` times the geometric mean of the diagonal entries of its row and
    column. Otherwise rounding would decide which entries a kernel contains, and equal structures would need other
    kernels.

    Args:
        matrices: Matrices with positive or zero diagonals.
        share: Largest share that is rounding.
    """
    root = np.sqrt(np.maximum(np.einsum("sii->si", matrices), 0.0))
    return np.where(np.abs(matrices) <= share * root[:, :, None] * root[:, None, :], 0.0, matrices)
