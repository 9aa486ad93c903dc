"""Kinds of inherent damping of a shear building; each kind is a class.

To add a kind of damping, write its class and add a row to DAMPING. If its attribute `kernel` names new kernel code,
write also this kernel part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from warpdyn.engine.laws import Parameter
from warpdyn.foundations.core.checks import whole_number
from warpdyn.model.structures.modal import chain_stiffness_matrix, modal_damping_matrix, rayleigh_coefficients
from warpdyn.model.structures.physics import effective_stiffness

Arrays = Mapping[str, np.ndarray]

DAMPING_RATIO = Parameter("1", "viscous damping ratio", low=0.0, high=1.0, high_open=True, often_in_percent=True)


class Damping:
    """No damping, and base class of all kinds of inherent damping.

    The damping matrix is C = a0 M + the matrix of storey dashpots + an additional matrix; a kind uses some of these. An
    argument `parameters` contains the values of all parameters of one or several buildings, each of shape
    [structure, ...].

    Args:
        modes: The two modes, counted from 1, in which the damping ratio is given; None: this kind has no such modes.
        storeys: First and last damped storey, counted from 1; None: all storeys.
    """

    parameters: ClassVar[Mapping[str, Parameter]] = {}  # parameters of the kind, per storey or for the building
    kernel: ClassVar[str] = "none"  # name of the kernel part
    takes_modes: ClassVar[bool] = False  # whether the argument damping_modes is allowed
    takes_storeys: ClassVar[bool] = False  # whether the argument damped_storeys is allowed
    is_of_springs: ClassVar[bool] = False  # whether dashpots are proportional to the stiffness without P-Delta
    is_uneven: ClassVar[bool] = False  # whether the damping couples undamped modes even without gravity loads
    follows_tangent: ClassVar[bool] = False  # whether dashpots are proportional to the tangent stiffness
    has_own_matrix: ClassVar[bool] = False  # whether `own_matrix` returns a matrix

    def __init__(self, modes: tuple[int, int] | None = None, storeys: tuple[int, int] | None = None) -> None:
        self.modes, self.storeys = modes, storeys

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return the Rayleigh factors a0 of the mass [1/s] and a1 of the stiffness [s], shape [2, structure].

        A factor that this kind of damping does not use is 0.

        Args:
            parameters: Parameter values.
            frequency: Undamped circular frequencies [rad/s], shape [mode, structure].
        """
        return np.zeros((2, frequency.shape[1]))

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return the coefficients of the dashpots in undeformed storeys [N s/m], shape [structure, storey]; or None.

        Args:
            parameters: Parameter values.
            of_stiffness: Rayleigh factor a1 of the stiffness [s], shape [structure].
        """
        return None

    def ratios(self, parameters: Arrays, frequency: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return the damping ratio of each mode [1], shape [mode, structure], assuming that modes are uncoupled."""
        return (rayleigh[0] / frequency + rayleigh[1] * frequency) / 2

    def of_mass(self, parameters: Arrays, squared: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return the damping that is not due to dashpots, divided by modal mass [1/s], shape [structure, 1 or mode].

        Args:
            parameters: Parameter values.
            squared: Squared circular frequencies [rad2/s2], shape [structure, mode].
            rayleigh: Rayleigh factors a0 and a1, as `rayleigh` returns them, shape [2, structure].
        """
        return rayleigh[0][:, None]

    def own_matrix(self, parameters: Arrays) -> np.ndarray | None:
        """Return the additional damping matrix [N s/m], shape [structure, storey, storey]; None: this kind has none."""
        return None

    def of_modes(self, parameters: Arrays, shape: np.ndarray, of_mass: np.ndarray) -> np.ndarray:
        """Return the damping matrix in modal coordinates, without dashpots [1/s], shape [structure, mode, mode].

        The modes are scaled to unit modal mass.

        Args:
            parameters: Parameter values.
            shape: Displacements of the modes, shape [structure, storey, mode].
            of_mass: Damping divided by modal mass [1/s], as `of_mass` returns it.
        """
        own = self.own_matrix(parameters)
        diagonal = of_mass[:, :, None] * np.eye(shape.shape[-1])
        return diagonal if own is None else diagonal + shape.transpose(0, 2, 1) @ own @ shape

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the arrays of damping that kernels read, except dashpots, by name; the last dimension is `structure`.

        Args:
            parameters: Parameter values.
            rayleigh: Rayleigh factors a0 [1/s] and a1 [s], shape [structure, 2].
        """
        return {}

    def pack_dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return the dashpot coefficients that kernels read [N s/m], shape [structure, storey]; None: no dashpots."""
        return self.dashpots(parameters, of_stiffness)

    def all_dashpots(self, parameters: Arrays, rayleigh: np.ndarray, dampers: np.ndarray | float) -> np.ndarray:
        """Return the sum of the coefficients of inherent dashpots and dampers [N s/m], shape [structure, storey].

        Args:
            parameters: Parameter values.
            rayleigh: Rayleigh factors a0 and a1, as `rayleigh` returns them, shape [2, structure].
            dampers: Derivative of the force of viscous dampers by velocity [N s/m], shape [structure, storey], or 0.
        """
        inherent = self.dashpots(parameters, rayleigh[1])
        return np.broadcast_to((0.0 if inherent is None else inherent) + dampers, parameters["mass"].shape)

    def matrix(self, parameters: Arrays, rayleigh: np.ndarray, dampers: np.ndarray | float) -> np.ndarray:
        """Return the damping matrices of buildings, with dampers [N s/m], shape [structure, storey, storey].

        The arguments are described in `all_dashpots`.
        """
        mass = parameters["mass"]
        matrix = chain_stiffness_matrix(self.all_dashpots(parameters, rayleigh, dampers))
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
        """Return the damping of a building; raise a ValueError if the given modes or storeys are invalid."""
        for what, given in {"takes_modes": damping_modes, "takes_storeys": damped_storeys}.items():
            kinds = [repr(other) for other, kind in DAMPING.items() if getattr(kind, what)]
            if given is not None and not getattr(cls, what):
                public = "damping_modes" if what == "takes_modes" else "damped_storeys"
                raise ValueError(
                    f"{public} needs damping={' or '.join(kinds)}, got damping={name!r}: change damping=, or remove "
                    f"{public}="
                )
        if damping_modes is not None and damped_storeys is not None:
            raise ValueError(
                "damping_modes and damped_storeys cannot be given together: with damped_storeys the damping ratio is "
                "that of the first mode of these storeys. Remove damping_modes="
            )
        if damped_storeys is not None:
            return RayleighOfStoreys(storeys=_checked_storeys(damped_storeys, storeys))
        return cls(checked_modes(damping_modes, storeys) if cls.takes_modes else None)


class StoreyDamping(Damping):
    """Damping by one dashpot in every storey, with given coefficients [N s/m]."""

    parameters: ClassVar[Mapping[str, Parameter]] = {
        "damping_coefficient": Parameter("N s m-1", "viscous damping coefficient of the storey", low=0.0)
    }
    kernel = "storey"
    is_uneven = True

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return the parameter `damping_coefficient` of the buildings [N s/m], shape [structure, storey]."""
        return parameters["damping_coefficient"]


class RatioDamping(Damping):
    """Base class of the kinds of damping that are given by a damping ratio."""

    parameters: ClassVar[Mapping[str, Parameter]] = {"damping_ratio": DAMPING_RATIO}


class MassProportional(RatioDamping):
    """Damping proportional to the mass matrix, with the given damping ratio in the first mode."""

    kernel = "mass_proportional"

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return the Rayleigh factors a0 = 2 zeta w1 [1/s] and a1 = 0, shape [2, structure]."""
        of_mass = 2 * parameters["damping_ratio"] * frequency[0]
        return np.stack([of_mass, np.zeros_like(of_mass)])

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the Rayleigh factor a0 of the mass [1/s], shape [structure], under the name that kernels read."""
        return {"mass_damping": rayleigh[:, 0]}


class StiffnessProportional(RatioDamping):
    """Damping proportional to the initial stiffness, with the given damping ratio in the first mode."""

    kernel = "storey"
    is_of_springs = True

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return the Rayleigh factors a0 = 0 and a1 = 2 zeta / w1 [s], shape [2, structure]."""
        of_stiffness = 2 * parameters["damping_ratio"] / frequency[0]
        return np.stack([np.zeros_like(of_stiffness), of_stiffness])

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return dashpots that are proportional to the storey stiffness [N s/m], shape [structure, storey]."""
        return of_stiffness[:, None] * parameters["stiffness"]


class Rayleigh(StiffnessProportional):
    """Damping proportional to mass and initial stiffness, with the given damping ratio in two modes."""

    kernel = "rayleigh"
    takes_modes = takes_storeys = True

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return the Rayleigh factors a0 [1/s] and a1 [s] that give the damping ratio in both modes, [2, structure]."""
        assert self.modes is not None
        first, second = (frequency[mode - 1] for mode in self.modes)
        return np.stack(rayleigh_coefficients(first, second, parameters["damping_ratio"]))

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the Rayleigh factor a0 of the mass [1/s], shape [structure], under the name that kernels read."""
        return {"mass_damping": rayleigh[:, 0]}


class TangentRayleigh(Rayleigh):
    """Rayleigh damping with the tangent stiffness: in each step, kernels multiply the tangent stiffness by a1."""

    kernel = "rayleigh_tangent"
    takes_storeys = False
    follows_tangent = True

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the Rayleigh factors a0 [1/s] and a1 [s], shape [structure], under the names that kernels read."""
        return super().pack(parameters, rayleigh) | {"tangent_damping": rayleigh[:, 1]}

    def pack_dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return None: kernels read no constant dashpots, because dashpots change with the tangent stiffness."""
        return None


class RayleighOfStoreys(StiffnessProportional):
    """Stiffness-proportional damping of some storeys only.

    The damping ratio is given in the first mode of the damped storeys, as if the lowest of them were on a fixed base.
    """

    is_uneven = True

    def rayleigh(self, parameters: Arrays, frequency: np.ndarray) -> np.ndarray:
        """Return the Rayleigh factors a0 = 0 and a1 = 2 zeta / w1 [s], shape [2, structure].

        w1 is the first circular frequency of the damped storeys alone, on a fixed base [rad/s].
        """
        from warpdyn.engine.kernels.auxiliary.frequencies import (
            circular_frequencies,  # this import includes warp, which building a scene does not need
        )

        assert self.storeys is not None
        lowest, last = self.storeys
        own = slice(lowest - 1, last)
        of_own = circular_frequencies(parameters["mass"][:, own], effective_stiffness(parameters)[:, own])
        of_stiffness = 2 * parameters["damping_ratio"] / of_own[:, 0]
        return np.stack([np.zeros_like(of_stiffness), of_stiffness])

    def dashpots(self, parameters: Arrays, of_stiffness: np.ndarray) -> np.ndarray | None:
        """Return dashpots [N s/m], shape [structure, storey]: a1 times the stiffness in damped storeys, 0 elsewhere."""
        assert self.storeys is not None
        first, last = self.storeys
        dashpots = of_stiffness[:, None] * parameters["stiffness"]
        storey = np.arange(1, dashpots.shape[1] + 1)
        return np.where((storey >= first) & (storey <= last), dashpots, 0.0)


class ModalDamping(RatioDamping):
    """Modal damping, with the same damping ratio in every mode."""

    kernel = "modal"
    has_own_matrix = True

    def ratios(self, parameters: Arrays, frequency: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return the damping ratio of each mode [1], shape [mode, structure]: the same ratio in every mode."""
        return np.zeros_like(frequency) + parameters["damping_ratio"]

    def of_mass(self, parameters: Arrays, squared: np.ndarray, rayleigh: np.ndarray) -> np.ndarray:
        """Return 2 zeta w for each mode [1/s], shape [structure, mode]."""
        return 2 * parameters["damping_ratio"][:, None] * np.sqrt(squared)

    def of_modes(self, parameters: Arrays, shape: np.ndarray, of_mass: np.ndarray) -> np.ndarray:
        """Return the diagonal damping matrix in modal coordinates [1/s]; modal damping does not couple modes."""
        return of_mass[:, :, None] * np.eye(shape.shape[-1])

    def own_matrix(self, parameters: Arrays) -> np.ndarray | None:
        """Return the damping matrix [N s/m], shape [structure, storey, storey], as a sum over the modes."""
        elastic = chain_stiffness_matrix(effective_stiffness(parameters))
        return modal_damping_matrix(parameters["mass"], elastic, parameters["damping_ratio"])

    def pack(self, parameters: Arrays, rayleigh: np.ndarray) -> dict[str, np.ndarray]:
        """Return the entries of the damping matrices [N s/m], row by row, shape [storey * storey, structure]."""
        matrix = self.own_matrix(parameters)
        assert matrix is not None
        return {"damping_matrix": matrix.reshape(len(matrix), -1).T}


def _checked_storeys(given: tuple[int, int], storeys: int) -> tuple[int, int]:
    """Return the first and the last damped storey, counted from 1; raise a ValueError if they are invalid."""
    if not isinstance(given, Sequence) or len(given) != 2:
        raise ValueError(f"damped_storeys must be the first and the last storey, such as (2, 6), got {given!r}")
    first, last = (whole_number(f"damped_storeys[{i}]", storey, 1) for i, storey in enumerate(given))
    if not first <= last <= storeys:
        raise ValueError(
            f"damped_storeys must be the first and the last damped storey in this order, from 1 to {storeys}, "
            f"got {given!r}"
        )
    return first, last


def checked_modes(given: tuple[int, int] | None, storeys: int) -> tuple[int, int]:
    """Return the two modes of Rayleigh damping, (1, 1) for a one-storey building; raise a ValueError if invalid."""
    if given is None:
        return 1, min(2, storeys)
    if not isinstance(given, Sequence) or len(given) != 2:
        raise ValueError(f"damping_modes must be two modes, such as (1, 3), got {given!r}")
    first, second = (whole_number(f"damping_modes[{i}]", mode, 1) for i, mode in enumerate(given))
    if max(first, second) > storeys or (first >= second and storeys > 1):
        allowed = f"two different modes from 1 to {storeys}, in increasing order"
        if storeys == 1:
            allowed = "(1, 1) for a one-storey building, which has only mode 1"
        raise ValueError(f"damping_modes must be {allowed}, got {given!r}")
    return first, second


# Value of the argument `damping` of a ShearBuilding -> kind of damping.
DAMPING: dict[str, type[Damping]] = {
    "none": Damping,
    "storey": StoreyDamping,
    "rayleigh": Rayleigh,
    "rayleigh_tangent": TangentRayleigh,
    "mass_proportional": MassProportional,
    "stiffness_proportional": StiffnessProportional,
    "modal": ModalDamping,
}
