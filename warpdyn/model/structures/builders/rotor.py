"""Rotors with unbalance: a disc on a flexible shaft that whirls in two directions."""

from __future__ import annotations

import numpy as np

from warpdyn.foundations.core.checks import one_of, real_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.model.structures.builders.built_structure import BuiltStructure
from warpdyn.model.structures.lumped.spring import Spring


@with_suggestions
class UnbalancedRotor(BuiltStructure):
    """A Jeffcott rotor: an unbalanced disc on a flexible shaft, or on flexible bearings, that whirls in x and y.

    Degrees of freedom: "x" and "y" of the centre of the shaft [m], at right angles to the shaft. Springs: "shaft x" and
    "shaft y". With the angle p of the rotor, the unbalance force is m e (p'^2 cos(p) + p'' sin(p)) in x and m e (p'^2
    sin(p) - p'' cos(p)) in y: it is proportional to the square of the speed. Gravity, gyroscopic moments and internal
    damping of the shaft are not included. `wd.unbalance_force` returns the force of a run-up or of a constant speed.

    Args:
        mass: Mass of the disc [kg].
        stiffness: Stiffness of the shaft [N/m], of both directions, or of x and y, shape [2].
        eccentricity: Distance of the centre of mass from the centre of the shaft [m].
        damping_ratio: Viscous damping ratio of each direction [1].

    Raises:
        ValueError: If a value is not finite or is out of its range.
        TypeError: If a value is not a number.

    Example:
        >>> rotor = wd.UnbalancedRotor(100.0, 4e6, eccentricity=1e-4, damping_ratio=0.02)
        >>> rotor.critical_speeds.round(6)
        array([200., 200.])
        >>> start = wd.unbalance_force(rotor.unbalance, acceleration=200.0, duration=1.5, step=2e-4)
        >>> run = wd.simulate(wd.Scene(rotor, start), step=2e-4, device="cpu")
        >>> run["peak_displacement"].sel(dof="x").item() < rotor.steady_amplitude(200.0)
        True
    """

    names_of_builder = ("eccentricity", "ratio")

    def __init__(
        self, mass: float, stiffness: float | tuple[float, float], *, eccentricity: float, damping_ratio: float
    ) -> None:
        own = real_number("mass [kg]", mass, above=0)
        both = stiffness if isinstance(stiffness, list | tuple) else (stiffness, stiffness)
        if len(both) != 2:
            raise ValueError(f"stiffness must be one value or one for x and one for y in N/m, got {stiffness!r}")
        values = [
            real_number(f"stiffness of {name} [N/m]", each, above=0) for name, each in zip("xy", both, strict=True)
        ]
        ratio = real_number("damping_ratio", damping_ratio, least=0)
        self.eccentricity = real_number("eccentricity [m]", eccentricity, above=0)
        self.ratio = ratio
        super().__init__(
            {"x": own, "y": own},
            [
                Spring(
                    f"shaft {name}", {name: 1.0}, stiffness=each, damping_coefficient=2 * ratio * np.sqrt(own * each)
                )
                for name, each in zip("xy", values, strict=True)
            ],
            influence=[{"x": 1.0}, {"y": 1.0}],
            is_machine=True,
        )

    @property
    def unbalance(self) -> float:
        """Mass times eccentricity [kg m]."""
        return float(self.parameters["mass"][0]) * self.eccentricity

    @property
    def critical_speeds(self) -> np.ndarray:
        """Speeds at which the undamped rotor is in resonance in x and in y [rad/s], shape [2]."""
        return np.sqrt(self.parameters["stiffness"] / self.parameters["mass"])

    def steady_amplitude(self, speed: float, direction: str = "x") -> float:
        """Return the amplitude of the steady whirl in one direction [m], e q^2 / sqrt((1 - q^2)^2 + (2 zeta q)^2).

        Args:
            speed: Constant speed [rad/s].
            direction: "x" or "y".
        """
        one_of("direction", direction, ("x", "y"))
        q = real_number("speed [rad/s]", speed, least=0) / self.critical_speeds["xy".index(direction)]
        return float(self.eccentricity * q**2 / np.hypot(1 - q**2, 2 * self.ratio * q))

    def __repr__(self) -> str:
        speeds = " and ".join(f"{speed:.4g}" for speed in dict.fromkeys(self.critical_speeds.tolist()))
        return f"UnbalancedRotor({self.parameters['mass'][0]:g} kg, critical speed {speeds} rad/s)"
