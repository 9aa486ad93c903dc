"""Kinds of inherent damping of a shear building, one class each: what a kind takes, and what follows from it.

To add one, write its class below and give it a row in DAMPING; a kind that kernels do not have yet is a part of theirs.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from warpdyn.engine.laws import Parameter
from warpdyn.model.structures.damped_parts import checked_modes, checked_storeys
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_damping_matrix, rayleigh_coefficients
from warpdyn.model.structures.physics import effective_stiffness

Arrays = Mapping[str, np.ndarray]

DAMPING_RATIO = Parameter("1", "viscous damping ratio", low=0.0, high=1.0, high_open=True, often_in_percent=True)


class Damping:
    """No damping, and what all kinds have in common: C = a0 M + dashpots, and a matrix of its own where there is one.

    Args:
        modes: The two modes, counted from 1, at which it has its ratio; None where the kind takes none.
        storeys: First and last storey that it is of, counted from 1; None for all.
    """

    parameters: ClassVar[Mapping[str, Parameter]] = {}  # one value a storey, or one for the building
    kernel: ClassVar[str] = "none"  # the damping that a kernel is built with, of those in its plan
    takes_modes: ClassVar[bool] = False  # whether a building may name modes
    takes_storeys: ClassVar[bool] = False  # whether it may name storeys
    is_of_springs: ClassVar[bool] = False  # dashpots in proportion to the storeys' springs, without what gravity takes
    is_uneven: ClassVar[bool] = False  # couples undamped modes even without gravity
    follows_tangent: ClassVar[bool] = False  # dashpots in proportion to the tangent stiffness

    def __init__(self, modes: tuple[int, int] | None = None, storeys: tuple[int, int] | None = None) -> None:
        self.modes, self.storeys = modes, storeys

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return the factors of the mass [1/s] and the stiffness [s], shape [2, structure]; 0 without.

        Args:
            parameters: Parameters of the buildings, `structure` first.
            frequency: Undamped circular frequencies [rad/s], shape [mode, structure].
        """
        return np.zeros((2, frequency.shape[1]))

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return the storeys' dashpots at rest [N s/m], shape [structure, storey]; None where there are none.

        Args:
            parameters: Parameters of the buildings, `structure` first.
            of_stiffness: Rayleigh's factor of the stiffness [s], shape [structure].
        """
        return None

    def ratios(self, parameters: Arrays, frequency: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return the damping ratios of modes that do not couple, shape [mode, structure]."""
        return (rayleigh[0] / frequency + rayleigh[1] * frequency) / 2

    def of_mass(self, parameters: Arrays, squared: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return the modes' damping over their mass, but for the dashpots' part [1/s], shape [structure, 1 or mode].

        Args:
            parameters: Parameters of the buildings, `structure` first.
            squared: Squared circular frequencies [rad2/s2], shape [structure, mode].
            rayleigh: As `rayleigh` returns it.
        """
        return rayleigh[0][:, None]

    def own_matrix(self, parameters: Arrays) -> np.ndarray | None:
        """Return the part that neither dashpots nor the mass give [N s/m], shape [structure, storey, storey]."""
        return None

    def of_modes(self, parameters: Arrays, shape: np.ndarray, of_mass: np.ndarray) -> np.ndarray:
        """Return the matrix that couples modes of unit mass, but for the dashpots' part [1/s].

        Args:
            parameters: Parameters of the buildings, `structure` first.
            shape: Displacements of the modes, shape [structure, storey, mode].
            of_mass: As `of_mass` returns it.

        Returns:
            Shape [structure, mode, mode].
        """
        own = self.own_matrix(parameters)
        diagonal = of_mass[:, :, None] * np.eye(shape.shape[-1])
        return diagonal if own is None else diagonal + shape.transpose(0, 2, 1) @ own @ shape

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return what kernels read of it, but for dashpots, structures last; `rayleigh` is [structure, 2]."""
        return {}

    def pack_dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return the dashpots that kernels read, shape [structure, storey]; None where there are none."""
        return self.dashpots(parameters, of_stiffness)

    def matrix(self, parameters: Arrays, rayleigh: np.ndarray, dampers: np.ndarray | float) -> np.ndarray:
        """Return the damping matrices [N s/m], shape [structure, storey, storey].

        Args:
            parameters: Parameters of the buildings, `structure` first.
            rayleigh: As `rayleigh` returns it.
            dampers: Slopes of viscous dampers' forces [N s/m], shape [structure, storey], or 0.
        """
        mass = parameters["mass"]
        inherent = self.dashpots(parameters, rayleigh[1])
        dashpots = np.broadcast_to((0.0 if inherent is None else inherent) + dampers, mass.shape)
        matrix = chain_stiffness_matrix(dashpots)
        matrix += rayleigh[0][:, None, None] * mass[:, :, None] * np.eye(mass.shape[1])
        own = self.own_matrix(parameters)
        if own is not None:
            matrix += own
        return matrix

    @classmethod
    def checked(
        cls,
        name: str,
        storeys: int,
        damping_modes: tuple[int, int] | None,
        damped_storeys: tuple[int, int] | None,
    ) -> Damping:
        """Return the damping of a building of so many storeys, or raise a ValueError on the modes or storeys named."""
        for what, given in {"takes_modes": damping_modes, "takes_storeys": damped_storeys}.items():
            kinds = [repr(other) for other, kind in DAMPING.items() if getattr(kind, what)]
            if given is not None and not getattr(cls, what):
                public = "damping_modes" if what == "takes_modes" else "damped_storeys"
                raise ValueError(f"{public} belong to damping {' or '.join(kinds)}, not {name!r}")
        if damping_modes is not None and damped_storeys is not None:
            raise ValueError(
                "damping_modes and damped_storeys exclude each other: of some storeys it is the first mode"
            )
        if damped_storeys is not None:
            return RayleighOfStoreys(storeys=checked_storeys(damped_storeys, storeys))
        return cls(checked_modes(damping_modes, storeys) if cls.takes_modes else None)


class StoreyDamping(Damping):
    """A dashpot in every storey."""

    parameters: ClassVar[Mapping[str, Parameter]] = {
        "damping_coefficient": Parameter("N s m-1", "viscous damping coefficient of the storey", low=0.0)
    }
    kernel = "storey"
    is_uneven = True

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return the dashpots that the building names."""
        return parameters["damping_coefficient"]


class RatioDamping(Damping):
    """What all kinds with a damping ratio take."""

    parameters: ClassVar[Mapping[str, Parameter]] = {"damping_ratio": DAMPING_RATIO}


class MassProportional(RatioDamping):
    """In proportion to the mass, with its ratio in the first mode."""

    kernel = "mass_proportional"

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return 2 zeta w1 for the mass."""
        factors = super().rayleigh(parameters, frequency)
        factors[0] = 2 * parameters["damping_ratio"] * frequency[0]
        return factors

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the factor of the mass."""
        return {"mass_damping": rayleigh[:, 0]}


class StiffnessProportional(RatioDamping):
    """In proportion to the initial stiffness, with its ratio in the first mode: dashpots alone."""

    kernel = "storey"
    is_of_springs = True

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return 2 zeta / w1 for the stiffness."""
        factors = super().rayleigh(parameters, frequency)
        factors[1] = 2 * parameters["damping_ratio"] / frequency[0]
        return factors

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return dashpots in proportion to the storeys' stiffness."""
        return of_stiffness[:, None] * parameters["stiffness"]


class Rayleigh(StiffnessProportional):
    """In proportion to mass and initial stiffness, with its ratio in two modes."""

    kernel = "rayleigh"
    takes_modes = takes_storeys = True

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return the factors that give the ratio in both modes."""
        assert self.modes is not None
        factors = Damping.rayleigh(self, parameters, frequency)
        first, second = (frequency[mode - 1] for mode in self.modes)
        factors[:] = rayleigh_coefficients(first, second, parameters["damping_ratio"])
        return factors

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the factor of the mass."""
        return {"mass_damping": rayleigh[:, 0]}


class TangentRayleigh(Rayleigh):
    """Rayleigh damping of the tangent stiffness: a kernel multiplies that by its factor as it goes."""

    kernel = "rayleigh_tangent"
    takes_storeys = False
    follows_tangent = True

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return both factors."""
        return super().pack(parameters, rayleigh) | {"tangent_damping": rayleigh[:, 1]}

    def pack_dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return None: they change with the tangent stiffness."""
        return None


class RayleighOfStoreys(StiffnessProportional):
    """Dashpots of some storeys, with their ratio in the first mode that these would have on a fixed base."""

    is_uneven = True

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return 2 zeta / w1 of the storeys by themselves."""
        from warpdyn.engine.kernels.auxiliary.frequencies import (
            circular_frequencies,  # brings warp, which a scene needs not
        )

        assert self.storeys is not None
        factors = Damping.rayleigh(self, parameters, frequency)
        lowest, last = self.storeys
        own = slice(lowest - 1, last)
        of_own = circular_frequencies(parameters["mass"][:, own], effective_stiffness(parameters)[:, own])
        factors[1] = 2 * parameters["damping_ratio"] / of_own[:, 0]
        return factors

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return dashpots in proportion to these storeys' stiffness, 0 in the others."""
        assert self.storeys is not None
        first, last = self.storeys
        dashpots = of_stiffness[:, None] * parameters["stiffness"]
        storey = np.arange(1, dashpots.shape[1] + 1)
        return np.where((storey >= first) & (storey <= last), dashpots, 0.0)


class ModalDamping(RatioDamping):
    """One ratio in every mode."""

    kernel = "modal"

    def ratios(self, parameters: Arrays, frequency: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return the one ratio."""
        return np.zeros_like(frequency) + parameters["damping_ratio"]

    def of_mass(self, parameters: Arrays, squared: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return 2 zeta w of each mode."""
        return 2 * parameters["damping_ratio"][:, None] * np.sqrt(squared)

    def of_modes(self, parameters: Arrays, shape: np.ndarray, of_mass: np.ndarray) -> np.ndarray:
        """Return the one ratio's part alone, which couples no modes."""
        return of_mass[:, :, None] * np.eye(shape.shape[-1])

    def own_matrix(self, parameters: Arrays) -> np.ndarray | None:
        """Return the sum over the modes."""
        elastic = chain_stiffness_matrix(effective_stiffness(parameters))
        return modal_damping_matrix(parameters["mass"], elastic, parameters["damping_ratio"])

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the matrix, row by row."""
        matrix = self.own_matrix(parameters)
        assert matrix is not None
        return {"damping_matrix": matrix.reshape(len(matrix), -1).T}


# What a ShearBuilding calls each kind.
DAMPING: dict[str, type[Damping]] = {
    "none": Damping,
    "storey": StoreyDamping,
    "rayleigh": Rayleigh,
    "rayleigh_tangent": TangentRayleigh,
    "mass_proportional": MassProportional,
    "stiffness_proportional": StiffnessProportional,
    "modal": ModalDamping,
}
