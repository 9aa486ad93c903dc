"""A biaxial spring of a lumped structure: two directions, and a law with a common state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws import BIAXIAL_LAWS
from warpdyn.engine.laws.biaxial.law import BiaxialLaw
from warpdyn.engine.laws.law import StoreyElement
from warpdyn.engine.laws.lookup import class_and_values
from warpdyn.foundations.core.checks import checked_text, finite_numbers, real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.lumped.names import checked_coefficients
from warpdyn.model.structures.lumped.spring import check_law, checked_parameters


@dataclass(frozen=True)
class Component:
    """One of the two components of a biaxial spring; its attributes are those of a Spring."""

    name: str
    direction: Mapping[str, float]
    law: type[StoreyElement]
    stiffness: float
    damping_coefficient: float
    parameters: Mapping[str, float]
    deformation_capacity: float | None = None


@with_suggestions
class BiaxialSpring:
    """A spring of a LumpedStructure with two components, whose forces depend on a common state, such as an isolator.

    In the dataset it is two springs, called "NAME x" and "NAME y". A parameter has the same value in both components,
    also if it is random.

    Args:
        name: Name of the spring in messages and datasets.
        direction_x: Coefficients of the deformation of the first component, {degree of freedom: coefficient}: [1] for a
            translation, [m] for a rotation in rad.
        direction_y: Coefficients of the deformation of the second component: [1] or [m].
        law: A biaxial law: its name, its class, or an object with its parameters. See `warpdyn.laws.BIAXIAL_LAWS`.
        stiffness: Initial stiffness of each component [N/m].
        damping_coefficient: Coefficient of a linear dashpot parallel to each component [N s/m].
        **parameters: Parameters of the law, one value each, such as `yield_force` [N].

    Raises:
        ValueError: If no coefficient of a component differs from 0, a value is out of its bounds, or a parameter is
            missing or unknown.
        TypeError: If a name is not text, or a direction is not a dictionary.

    Example:
        >>> wd.BiaxialSpring(
        ...     "bearing",
        ...     {"x": 1.0, "theta": -5.0},
        ...     {"y": 1.0, "theta": 8.0},
        ...     law="circular_yield",
        ...     stiffness=5e6,
        ...     yield_force=2e5,
        ...     post_yield_stiffness=5e5,
        ... )
        BiaxialSpring('bearing', law='circular_yield', stiffness=5000000.0)
    """

    def __init__(
        self,
        name: str,
        direction_x: Mapping[str, float],
        direction_y: Mapping[str, float],
        *,
        law: str | BiaxialLaw | type[BiaxialLaw],
        stiffness: float,
        damping_coefficient: float = 0.0,
        **parameters: float,
    ) -> None:
        self.name = checked_text("BiaxialSpring: name", name)
        where = f"biaxial spring {self.name!r}"
        self.direction_x = checked_coefficients(f"{where}: direction_x", direction_x)
        self.direction_y = checked_coefficients(f"{where}: direction_y", direction_y)
        for which, direction in {"direction_x": self.direction_x, "direction_y": self.direction_y}.items():
            if not any(direction.values()):
                raise ValueError(
                    f"{where}: {which} names no degree of freedom: give a coefficient other than 0, as in {{'x': 1.0}}"
                )
        try:
            self.law, own = class_and_values("biaxial law", law, BIAXIAL_LAWS, parameters)
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from None
        self.stiffness = real_number(f"{where}: stiffness [N/m]", stiffness, above=0)
        self.damping_coefficient = real_number(f"{where}: damping_coefficient [N s/m]", damping_coefficient, least=0)
        self.parameters = checked_parameters(where, self.law, {**parameters, **own})
        check_law(where, self.law, self.stiffness, self.parameters)

    @classmethod
    def of_components(cls, first: Component, second: Component) -> BiaxialSpring:
        """Return the spring with these components, which differ only in their names and directions."""
        return cls(
            first.name.removesuffix(" x"),
            first.direction,
            second.direction,
            law=first.law,  # type: ignore[arg-type] # the law of a component is a biaxial law
            stiffness=first.stiffness,
            damping_coefficient=first.damping_coefficient,
            **first.parameters,
        )

    @property
    def components(self) -> tuple[Component, Component]:
        """The two components."""
        own = (self.law, self.stiffness, self.damping_coefficient, self.parameters)
        return Component(f"{self.name} x", self.direction_x, *own), Component(f"{self.name} y", self.direction_y, *own)

    def forces_along(self, path: ArrayLike) -> np.ndarray:
        """Return the forces of the spring along a slow path, without its dashpot, in double precision.

        A friction slider has the friction at rest.

        Args:
            path: Deformations [m] of the two components, starting from rest at 0, shape [step, 2]. Each step follows a
                straight line; for laws of Bouc-Wen it must be short compared with the yield displacement.

        Returns:
            Forces [N], shape [step, 2].

        Raises:
            ValueError: If a deformation is not finite, or the shape is wrong.

        Example:
            >>> law = wd.laws.CircularYield(yield_force=1e5, post_yield_stiffness=1e6)
            >>> spring = wd.BiaxialSpring("bearing", {"x": 1.0}, {"y": 1.0}, law=law, stiffness=1e7)
            >>> spring.forces_along([[0.005, 0.0], [0.02, 0.0]]) / 1e3  # kN
            array([[ 50.,   0.],
                   [110.,   0.]])
        """
        import warp as wp

        from warpdyn.engine.kernels.auxiliary.biaxial_path import biaxial_path_kernel
        from warpdyn.engine.kernels.kernel_cache import initialise, loaded

        points = finite_numbers("path", path, "m")
        if points.ndim != 2 or points.shape[1] != 2 or not len(points):
            raise ValueError(f"path must have shape [step, 2], got {list(points.shape)}")
        one = {name: np.full((1, 1), each) for name, each in (self.parameters | {"stiffness": self.stiffness}).items()}
        variant = self.law.variant(one)
        read = np.array([np.ravel(each)[0] for each in self.law.coefficients(one, variant.name)], dtype=np.float64)
        given = (np.ascontiguousarray(each, np.float64) for each in (read, points))
        initialise()  # before Warp starts with the first array
        inputs: list[wp.array] = [wp.array(each, device="cpu") for each in given]
        force = wp.zeros(points.shape, dtype=wp.float64, device="cpu")
        wp.launch(loaded(biaxial_path_kernel(variant)), dim=1, inputs=inputs, outputs=[force], device="cpu")
        found: np.ndarray = force.numpy()
        return found

    def description(self) -> dict[str, object]:
        """Return the spring as a dictionary, for the JSON of its scene."""
        said: dict[str, object] = {"name": self.name, "direction_x": self.direction_x, "direction_y": self.direction_y}
        said |= {"law": self.law.name, "stiffness": self.stiffness}
        said |= {"damping_coefficient": self.damping_coefficient} if self.damping_coefficient else {}
        return said | self.parameters

    def __repr__(self) -> str:
        return f"BiaxialSpring({self.name!r}, law={self.law.name!r}, stiffness={self.stiffness!r})"
