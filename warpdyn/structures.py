"""Structures: what they are made of, in SI units, checked when they are built."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.laws import LAWS, Parameter
from warpdyn.modal import chain_stiffness_matrix, modal_damping_matrix, modal_properties, rayleigh_coefficients

MAXIMUM_STOREYS = 60
MAXIMUM_DOFS = 32

DAMPING_RATIO = Parameter("1", "viscous damping ratio", low=0.0, high=1.0, high_open=True)
# Each kind of damping with the parameters it takes: one value a storey, or one for the building.
DAMPING = {
    "none": {},
    "storey": {"damping_coefficient": Parameter("N s m-1", "viscous damping coefficient of the storey", low=0.0)},
    "rayleigh": {"damping_ratio": DAMPING_RATIO},
    "modal": {"damping_ratio": DAMPING_RATIO},
}
BUILDING_PARAMETERS = ("damping_ratio",)  # the others have one value a storey


def one_of(what: str, name: object, allowed: Mapping | tuple) -> None:
    """Raise a ValueError that lists what is allowed, unless `name` is among it."""
    if name not in allowed:
        raise ValueError(f"unknown {what} {name!r}; allowed: {', '.join(repr(a) for a in allowed)}")


def first_violation(name: str, values: np.ndarray, parameter: Parameter, axes: tuple[str, ...]) -> str | None:
    """Return a sentence on the first value out of bounds, with its place along `axes`, or None."""
    bad = parameter.violations(values)
    if not bad.any():
        return None
    place = np.argwhere(bad)[0]
    where = ", ".join(f"{axis} {i + (axis == 'storey')}" for axis, i in zip(axes, place, strict=True))
    return f"{name} is {values[tuple(place)]:g}{' at ' if where else ''}{where}; it must be {parameter.allowed}"


def _per_storey(name: str, values: ArrayLike) -> np.ndarray:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers, one a storey: {error}") from None
    if array.ndim > 1:
        raise ValueError(f"{name} must be one value or one a storey, got shape {array.shape}")
    return array


class ShearBuilding:
    """A chain of storeys: masses that move sideways, joined by storey springs and dampers.

    Args:
        mass: Floor mass [kg], shape [storey], from the ground up; a single value serves every storey.
        stiffness: Initial storey stiffness [N/m], shape [storey].
        height: Storey height [m], shape [storey].
        law: Storey law: "elastic", "bilinear" (kinematic hardening) or "bouc_wen".
        damping: "none"; "storey" (`damping_coefficient` a storey); "rayleigh" (`damping_ratio` at `damping_modes`, from
            mass and initial stiffness); or "modal" (`damping_ratio` in every mode).
        damping_modes: The two modes, counted from 1, at which Rayleigh damping has its ratio; 1 and 2 by default.
        **parameters: What the law and the damping take, one value or one a storey: `yield_force` [N],
            `hardening_ratio`, `beta`, `gamma`, `exponent`; `damping_coefficient` [N s/m], `damping_ratio`.

    Raises:
        ValueError: If a value is out of bounds, lengths differ, or a name is unknown.
    """

    family = "chain"

    def __init__(
        self,
        mass: ArrayLike,
        stiffness: ArrayLike,
        height: ArrayLike,
        *,
        law: str = "elastic",
        damping: str = "none",
        damping_modes: tuple[int, int] | None = None,
        **parameters: ArrayLike,
    ) -> None:
        one_of("storey law", law, LAWS)
        one_of("damping", damping, DAMPING)
        self.law, self.damping = law, damping
        self.parameter_table: Mapping[str, Parameter] = MappingProxyType(
            {
                "mass": Parameter("kg", "floor mass", low=0.0, low_open=True),
                "stiffness": Parameter("N m-1", "initial storey stiffness", low=0.0, low_open=True),
                "height": Parameter("m", "storey height", low=0.0, low_open=True),
                **LAWS[law].parameters,
                **DAMPING[damping],
            }
        )
        given = {"mass": mass, "stiffness": stiffness, "height": height, **parameters}
        for name in given:
            if name not in self.parameter_table:
                takes = ", ".join(self.parameter_table)
                raise ValueError(
                    f"unknown parameter {name!r}: a building of law {law!r} and damping {damping!r} takes {takes}"
                )
        arrays = {}
        for name, parameter in self.parameter_table.items():
            value = given.get(name, parameter.default)
            if value is None:
                raise ValueError(
                    f"{name} ({parameter.long_name}) is missing: law {law!r} and damping {damping!r} need it"
                )
            arrays[name] = _per_storey(name, value)
        self.storeys = max(array.size for array in arrays.values())
        if not 1 <= self.storeys <= MAXIMUM_STOREYS:
            raise ValueError(f"a shear building has 1 to {MAXIMUM_STOREYS} storeys, got {self.storeys}")
        for name, array in arrays.items():
            if name in BUILDING_PARAMETERS:
                if array.size != 1:
                    raise ValueError(f"{name} must be one value for the building, got {array.size}")
                arrays[name] = array.reshape(())
            elif array.ndim and array.size != self.storeys:
                raise ValueError(f"{name} has {array.size} values, but the building has {self.storeys} storeys")
            else:
                arrays[name] = np.array(np.broadcast_to(array, self.storeys))
            axes = () if name in BUILDING_PARAMETERS else ("storey",)
            problem = first_violation(name, arrays[name], self.parameter_table[name], axes)
            if problem:
                raise ValueError(problem)
            arrays[name].flags.writeable = False
        self.parameters: Mapping[str, np.ndarray] = MappingProxyType(arrays)
        if damping_modes is not None and damping != "rayleigh":
            raise ValueError(f"damping_modes belong to damping 'rayleigh', not {damping!r}")
        self.damping_modes = self._checked_modes(damping_modes) if damping == "rayleigh" else None

    def _checked_modes(self, modes: tuple[int, int] | None) -> tuple[int, int]:
        """Return the two modes of Rayleigh damping; a one-storey building has its only mode twice."""
        first, second = (1, min(2, self.storeys)) if modes is None else modes
        if self.storeys > 1 and not 1 <= first < second <= self.storeys:
            raise ValueError(f"damping_modes must be two different modes from 1 to {self.storeys}, got {modes}")
        return int(first), int(second)

    @property
    def dofs(self) -> int:
        """Degrees of freedom: one a storey."""
        return self.storeys

    def modal(self) -> xr.Dataset:
        """Return periods, shapes, participation factors and effective masses of the undamped building."""
        return modal_properties(self.parameters["mass"], chain_stiffness_matrix(self.parameters["stiffness"]))

    @property
    def fundamental_period(self) -> float:
        """First period of the undamped building [s]."""
        return float(self.modal()["period"][0])

    def damping_matrix(self) -> np.ndarray:
        """Return the viscous damping matrix [N s/m], shape [storey, storey]."""
        p, modes = self.parameters, self.damping_modes
        if self.damping == "none":
            return np.zeros((self.storeys, self.storeys))
        if self.damping == "storey":
            return chain_stiffness_matrix(p["damping_coefficient"])
        stiffness = chain_stiffness_matrix(p["stiffness"])
        if self.damping == "modal":
            return modal_damping_matrix(p["mass"], stiffness, p["damping_ratio"])
        frequency = self.modal()["circular_frequency"].values
        of_mass, of_stiffness = rayleigh_coefficients(*(frequency[m - 1] for m in modes), p["damping_ratio"])
        return of_mass * np.diag(p["mass"]) + of_stiffness * stiffness

    def __repr__(self) -> str:
        return f"ShearBuilding({self.storeys} storeys, law={self.law!r}, damping={self.damping!r})"


class LinearSystem:
    """A linear system of full matrices: M u'' + C u' + K u = F.

    Args:
        mass: Mass matrix [kg], shape [dof, dof], or its diagonal, shape [dof].
        damping: Viscous damping matrix [N s/m], shape [dof, dof].
        stiffness: Stiffness matrix [N/m], shape [dof, dof].
        influence: Displacement of each degree of freedom under a unit base displacement, shape [dof]; ones by default.

    Raises:
        ValueError: If shapes differ, a value is not finite, a matrix is not symmetric, or the mass matrix is not
            positive definite.
    """

    family = "dense"
    law = "elastic"

    def __init__(
        self, mass: ArrayLike, damping: ArrayLike, stiffness: ArrayLike, *, influence: ArrayLike | None = None
    ) -> None:
        matrices = {"mass": mass, "damping": damping, "stiffness": stiffness}
        for name, values in matrices.items():
            matrix = np.array(values, dtype=np.float64)
            if name == "mass" and matrix.ndim == 1:
                matrix = np.diag(matrix)
            if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
                raise ValueError(f"{name} must be a square matrix [dof, dof], got shape {matrix.shape}")
            if matrix.shape != (expected := (matrices["mass"].shape if name != "mass" else matrix.shape)):
                raise ValueError(f"{name} has shape {matrix.shape}, but mass has {expected}: they must agree")
            if not np.all(np.isfinite(matrix)):
                row, column = np.argwhere(~np.isfinite(matrix))[0]
                raise ValueError(f"{name}[{row}, {column}] is {matrix[row, column]}; every entry must be finite")
            difference = np.abs(matrix - matrix.T)
            # Rounding of an assembly is forgiven; anything above it is a mistake in the matrix.
            if difference.max() > 1e-12 * np.abs(matrix).max():
                row, column = np.unravel_index(difference.argmax(), difference.shape)
                raise ValueError(
                    f"{name} is not symmetric: [{row}, {column}] is {matrix[row, column]:g} "
                    f"but [{column}, {row}] is {matrix[column, row]:g}"
                )
            matrix.flags.writeable = False
            matrices[name] = matrix
        self.dofs = matrices["mass"].shape[0]
        if not 1 <= self.dofs <= MAXIMUM_DOFS:
            raise ValueError(f"a linear system has 1 to {MAXIMUM_DOFS} degrees of freedom, got {self.dofs}")
        smallest, largest = np.linalg.eigvalsh(matrices["mass"])[[0, -1]]
        if smallest <= 1e-13 * abs(largest):
            raise ValueError(
                f"mass is singular or not positive definite (smallest eigenvalue {smallest:g} kg): "
                "every degree of freedom needs mass; condense those without it"
            )
        self.parameters: Mapping[str, np.ndarray] = MappingProxyType(matrices)
        self.parameter_table: Mapping[str, Parameter] = MappingProxyType(
            {
                "mass": Parameter("kg", "mass matrix"),
                "damping": Parameter("N s m-1", "viscous damping matrix"),
                "stiffness": Parameter("N m-1", "stiffness matrix"),
            }
        )
        self.influence = np.ones(self.dofs) if influence is None else np.array(influence, dtype=np.float64)
        if self.influence.shape != (self.dofs,) or not np.all(np.isfinite(self.influence)):
            raise ValueError(f"influence must be {self.dofs} finite values, one a degree of freedom")
        self.damping = "matrix"
        self.modal()  # says what is wrong with a stiffness that is not positive definite

    def modal(self) -> xr.Dataset:
        """Return periods, shapes, participation factors and effective masses of the undamped system."""
        return modal_properties(self.parameters["mass"], self.parameters["stiffness"], self.influence)

    @property
    def fundamental_period(self) -> float:
        """First period of the undamped system [s]."""
        return float(self.modal()["period"][0])

    def damping_matrix(self) -> np.ndarray:
        """Return the viscous damping matrix [N s/m], shape [dof, dof]."""
        return self.parameters["damping"]

    def __repr__(self) -> str:
        return f"LinearSystem({self.dofs} degrees of freedom)"
