"""Linear systems with full matrices, in SI units, checked when they are built."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.engine.laws import Elastic, Parameter
from warpdyn.engine.laws.building_law import BuildingLaw
from warpdyn.foundations.core.checks import finite_numbers
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.modal import modal_properties
from warpdyn.model.structures.structure import Structure, count_along

MAXIMUM_DOFS = 32


@with_suggestions
class LinearSystem(Structure):
    """A linear system with full matrices and at most 32 degrees of freedom: M u'' + C u' + K u = F.

    The stiffness matrix may be singular, so that the system has rigid-body modes. Their periods are infinite; the
    default integration step is computed from the other modes.

    Args:
        mass: Mass matrix [kg], shape [dof, dof], or its diagonal, shape [dof].
        damping: Viscous damping matrix [N s/m], shape [dof, dof].
        stiffness: Stiffness matrix [N/m], shape [dof, dof]; it may be singular.
        influence: Displacement of each degree of freedom under a unit base displacement [1], shape [dof]; ones by
            default.

    Raises:
        ValueError: If there are more than 32 degrees of freedom, shapes differ, a value is not finite, a matrix is not
            symmetric, the mass matrix is not positive definite, the damping or stiffness matrix has a negative
            eigenvalue, or the stiffness matrix is 0.

    Example:
        >>> mass, stiffness = [2.0, 1.0], np.array([[300.0, -100.0], [-100.0, 100.0]])  # kg, N/m
        >>> system = wd.LinearSystem(mass, 0.01 * stiffness, stiffness)
        >>> round(system.fundamental_period, 3)
        0.889
    """

    family = "dense"
    demand = "displacement"
    can_yield = False
    is_scaled = True
    law, storey_laws, storey_law, devices = "elastic", ("elastic",), BuildingLaw((Elastic,)), ()
    damping = "matrix"

    def __init__(
        self, mass: ArrayLike, damping: ArrayLike, stiffness: ArrayLike, *, influence: ArrayLike | None = None
    ) -> None:
        matrices: dict[str, np.ndarray] = {}
        for name, values in {"mass": mass, "damping": damping, "stiffness": stiffness}.items():
            matrix = finite_numbers(name, values)
            if name == "mass" and matrix.ndim == 1:
                matrix = np.diag(matrix)
            if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
                raise ValueError(f"{name} must be a square matrix [dof, dof], got shape {matrix.shape}")
            if matrix.shape != (expected := (matrices["mass"].shape if name != "mass" else matrix.shape)):
                raise ValueError(
                    f"{name} has shape {matrix.shape}, but mass has {expected}: give matrices of one shape"
                )
            difference = np.abs(matrix - matrix.T)
            # Accept differences that are due to rounding when a matrix was assembled.
            if difference.max() > 1e-12 * np.abs(matrix).max():
                row, column = np.unravel_index(difference.argmax(), difference.shape)
                raise ValueError(
                    f"{name} is not symmetric: [{row}, {column}] is {matrix[row, column]:g} but [{column}, {row}] is "
                    f"{matrix[column, row]:g}, but both must be equal: correct the matrix"
                )
            matrix.flags.writeable = False
            matrices[name] = matrix
        dofs = matrices["mass"].shape[0]
        if not 1 <= dofs <= MAXIMUM_DOFS:
            raise ValueError(
                f"a linear system has 1 to {MAXIMUM_DOFS} degrees of freedom, got {dofs}: eliminate some by static "
                "condensation"
            )
        smallest, largest = np.linalg.eigvalsh(matrices["mass"])[[0, -1]]
        if smallest <= 1e-13 * abs(largest):
            raise ValueError(
                f"mass is singular or not positive definite (smallest eigenvalue {smallest:g} kg): "
                "every degree of freedom needs mass. Eliminate massless degrees of freedom by static condensation"
            )
        smallest, largest = np.linalg.eigvalsh(matrices["damping"])[[0, -1]]
        if smallest < -1e-12 * abs(largest):
            raise ValueError(
                f"damping has a negative eigenvalue ({smallest:g} N s/m), so that it would add energy: all eigenvalues "
                "must be at least 0. Correct the matrix"
            )
        self.parameters: Mapping[str, np.ndarray] = FrozenMapping(matrices)
        # Scatter can only multiply a matrix by a factor; the table contains the bounds of the factors.
        self.parameter_table: Mapping[str, Parameter] = FrozenMapping(
            {
                "mass": Parameter("1", "factor on the mass matrix", low=0.0, low_open=True),
                "damping": Parameter("1", "factor on the viscous damping matrix", low=0.0),
                "stiffness": Parameter("1", "factor on the stiffness matrix", low=0.0, low_open=True),
            }
        )
        self.influence = np.ones(dofs) if influence is None else finite_numbers("influence", influence)
        if self.influence.shape != (dofs,):
            raise ValueError(
                f"influence must have one value per degree of freedom, shape [{dofs}], got shape {self.influence.shape}"
            )
        self.modal()  # raises an error if the stiffness matrix has a negative eigenvalue

    def modal(self) -> xr.Dataset:
        """Return a dataset with the periods, shapes, participation factors and effective masses of the undamped modes.

        The period of a rigid-body mode is infinite.

        Raises:
            ValueError: If the stiffness matrix has a negative eigenvalue or is 0.
        """
        mass, stiffness = self.parameters["mass"], self.parameters["stiffness"]
        return modal_properties(mass, stiffness, self.influence, may_move_freely=True)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom of the system."""
        return len(self.parameters["mass"])

    @property
    def nominal_values(self) -> Mapping[str, np.ndarray]:
        """Nominal values that scatter changes: a factor of 1 for each matrix (mass, damping, stiffness)."""
        return dict.fromkeys(self.parameters, np.array(1.0))

    def is_by_storey(self, name: str) -> bool:
        """Return False for every parameter, because a factor scales the whole matrix."""
        return False

    def input_name(self, name: str) -> str:
        """Return the name of the factor on the matrix `name` in the dataset, such as "mass_factor"."""
        return f"{name}_factor"

    def chosen(self) -> dict[str, Any]:
        """Return the names of the law and the damping, and the influence vector, for the JSON of the scene."""
        return {"law": self.law, "damping": self.damping, "influence": self.influence.tolist()}

    def numbered(self, recorders: tuple[str, ...]) -> dict[str, tuple]:
        """Return the coordinate `dof`, which numbers the degrees of freedom from 1."""
        return {"dof": count_along("dof", self.dofs, "degree of freedom")}

    @property
    def fundamental_period(self) -> float:
        """First period of the undamped system [s]; infinite if the system has a rigid-body mode."""
        return float(self.modal()["period"][0])

    def told(self) -> list[tuple[object, ...]]:
        """Return the rows of the table that notebooks show for the system: periods, masses and influence vector."""
        return [
            ("periods", "period", self.modal()["period"].values, "s"),
            ("diagonal of the mass matrix", "mass", np.diag(self.parameters["mass"]), "kg"),
            ("influence", "influence", self.influence, "1"),
        ]

    def __repr__(self) -> str:
        return f"LinearSystem({self.dofs} degrees of freedom)"
