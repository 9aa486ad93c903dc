"""Actuators of controlled structures: forces, dampers with a variable coefficient, and magnetorheological dampers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from warpdyn.engine.controllers.rules import DAMPER, FORCE, MAGNETORHEOLOGICAL, ActuatorRules
from warpdyn.foundations.core.checks import real_number, shortened
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.near_misses import did_you_mean, with_suggestions
from warpdyn.foundations.core.plausibility import PlausibilityFindings
from warpdyn.foundations.core.plausibility.forces import CHECKS_OF_ACTUATORS
from warpdyn.model.structures.lumped.structure import LumpedStructure
from warpdyn.model.structures.shear_building import ShearBuilding
from warpdyn.model.structures.structure import Structure

Place = int | str | Mapping[Any, float]
NO_LIMIT = 1e30  # kernels need finite limits
STEADY = 2.0  # product of step and rate up to which `heun` and `rk4` are stable


def rows_at(structure: Structure, place: Place) -> tuple[tuple[int, float], ...]:
    """Return the degrees of freedom of a place and their factors: ((index from 0, factor), ...), the upper end first.

    Args:
        structure: The structure.
        place: See `Actuator`.

    Raises:
        ValueError: If the place does not exist.
    """
    names: list[Any]
    if isinstance(structure, ShearBuilding):
        if isinstance(place, str):
            raise ValueError(f"a ShearBuilding has storeys with numbers, not the spring {place!r}: give place=1")
        if not isinstance(place, Mapping):
            storey = int(place)
            if storey != place or not 1 <= storey <= structure.storeys:
                raise ValueError(
                    f"the actuator is in storey {place}, but the building has storeys 1 to {structure.storeys}"
                )
            return ((storey - 1, 1.0),) if storey == 1 else ((storey - 1, 1.0), (storey - 2, -1.0))
        names = list(range(1, structure.storeys + 1))
        place = {int(name) if str(name).isdigit() else name: factor for name, factor in place.items()}
        what = "floor"
    else:
        assert isinstance(structure, LumpedStructure)
        names = list(structure.dof_names)
        what = "degree of freedom"
        if isinstance(place, str):
            springs = [spring.name for spring in structure.given_springs]
            if place not in springs:
                hint = did_you_mean(place, springs)
                raise ValueError(f"the structure has no spring {place!r}{hint}; its springs are {', '.join(springs)}")
            direction = structure.directions[springs.index(place)]
            place = {name: float(factor) for name, factor in zip(names, direction, strict=True) if factor}
        if not isinstance(place, Mapping):
            raise ValueError(
                f"place={place!r} is not a spring of the LumpedStructure: give the name of a spring, or degrees of "
                f"freedom with factors, such as {{{names[0]!r}: 1.0}}"
            )
    rows = []
    for name, factor in place.items():
        if name not in names:
            raise ValueError(f"the structure has no {what} {name!r}; it has {', '.join(map(repr, names))}")
        value = real_number(f"factor of {what} {name!r}", factor)
        if value:
            rows.append((names.index(name), value))
    if not rows:
        raise ValueError(f"place={place!r} has no {what} with a factor other than 0: give the ends of the actuator")
    return tuple(sorted(rows, key=lambda row: -row[1]))


@dataclass(frozen=True, eq=False)
class _Attached:
    """An actuator between degrees of freedom; `place` and `stroke_limit` are those of `Actuator`."""

    place: Place
    kind: ClassVar[str]

    def __post_init__(self) -> None:
        if not isinstance(self.place, int | str | Mapping | np.integer) or isinstance(self.place, bool):
            raise TypeError(
                "place must be the number of a storey, the name of a spring, or degrees of freedom with factors such "
                f"as {{2: 1.0, 1: -1.0}}, got {shortened(self.place)}"
            )
        if isinstance(self.place, Mapping):  # text as keys, as in JSON
            for name, each in self.place.items():
                real_number(f"the factor of {name!r} in place", each)
            object.__setattr__(self, "place", FrozenMapping({str(name): each for name, each in self.place.items()}))
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name != "place" and value is not None:
                object.__setattr__(self, field.name, real_number(field.name, value, **self._bounds(field.name)))

    def _bounds(self, name: str) -> dict[str, Any]:
        return {"above": 0.0}

    def rules(self, structure: Structure) -> ActuatorRules:
        """Return the kind and the place of the actuator in a structure."""
        return ActuatorRules(self.kind, rows_at(structure, self.place))

    def influence(self, structure: Structure) -> np.ndarray:
        """Return the force on each degree of freedom per unit force of the actuator [1], shape [dof]."""
        found = np.zeros(structure.dofs)
        for dof, factor in rows_at(structure, self.place):
            found[dof] = factor
        return found

    @property
    def command_limits(self) -> tuple[float, float]:
        """Lowest and highest command, in the unit of the command."""
        raise NotImplementedError

    @property
    def stroke(self) -> float:
        """Largest stroke [m]; NO_LIMIT without a limit."""
        limit = getattr(self, "stroke_limit", None)
        return NO_LIMIT if limit is None else limit

    def fastest_rate(self, mobility: float) -> float:
        """Return a bound of the fastest rate [1/s] that the actuator adds to the structure.

        Args:
            mobility: Acceleration between the free ends of the actuator per unit force [1/kg].
        """
        return 0.0


@with_suggestions
@dataclass(frozen=True, eq=False)
class Actuator(_Attached):
    """An actuator whose force is the command: hydraulic cylinder, active tendon, or drive of an active mass damper.

    A positive force pushes the upper end (the floors with positive factors) in the positive direction.

    Args:
        place: Number of the storey in which the actuator acts (ShearBuilding); name of the spring parallel to which it
            acts (LumpedStructure); or floors or degrees of freedom with factors, such as {2: 1.0, 1: -1.0}.
        force_limit: Largest force [N]; commands beyond it are limited, and `limited_share` counts them.
        stroke_limit: Largest displacement between the ends [m]; a sample that exceeds it has the status
            control_failed.
        time_constant: Time constant T [s] of a force f that follows the command c with a lag of first order, T f' = c -
            f; None: without this lag.
        frequency: Natural frequency [Hz] of a force that follows the command by an equation of second order,
            f'' + 2 zeta w f' + w^2 f = w^2 c with w = 2 pi frequency; None: without this equation.
        damping_ratio: Damping ratio zeta [1] of the equation of second order.

    Without a lag, the force is the command. The limit applies to the command; the force of an actuator of second order
    may exceed it for a short time. `wd.control.lqr` does not include the lag; `closed_loop_eigenvalues`,
    `delay_margin` and `sampled_eigenvalues` include it.

    Raises:
        ValueError: If a limit is not finite and positive, or the arguments of the lag do not fit each other.
        TypeError: If `place` is of another type.

    Example:
        >>> wd.control.Actuator(2, force_limit=1e5).influence(building)
        array([-1.,  1.])
        >>> hydraulic = wd.control.Actuator(1, time_constant=0.02)  # s
        >>> round(hydraulic.phase_lag(2 * 3.141593 * 1.0), 1)  # degrees at 1 Hz
        7.2
    """

    force_limit: float | None = None
    stroke_limit: float | None = None
    time_constant: float | None = None
    frequency: float | None = None
    damping_ratio: float | None = None
    kind = FORCE

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.time_constant is not None and (self.frequency is not None or self.damping_ratio is not None):
            raise ValueError(
                "an actuator has either time_constant= (a lag of first order) or frequency= and damping_ratio= (second "
                "order): remove one of them"
            )
        if (self.frequency is None) != (self.damping_ratio is None):
            missing = "damping_ratio=0.7" if self.damping_ratio is None else "frequency=10.0 [Hz]"
            raise ValueError(
                f"an actuator of second order needs frequency= [Hz] and damping_ratio= [1]: add, for example, {missing}"
            )
        if not np.all(np.isfinite(self.lag)):
            given = "frequency= [Hz]" if self.time_constant is None else "time_constant= [s]"
            raise ValueError(f"the rates of the lag, {self.lag}, are not finite: check the unit of {given}")
        findings = PlausibilityFindings()
        for name in CHECKS_OF_ACTUATORS:
            value = getattr(self, name.removeprefix("actuator_"))
            findings.add(name, np.nan if value is None else value)
        findings.warn()

    def rules(self, structure: Structure) -> ActuatorRules:
        """Return the kind, the place and the order of the lag of the actuator in a structure."""
        return ActuatorRules(self.kind, rows_at(structure, self.place), len(self.lag))

    @property
    def lag(self) -> tuple[float, ...]:
        """Rates of the equation of the force: (); (1 / T [1/s],); or (w^2 [1/s2], 2 zeta w [1/s])."""
        if self.time_constant is not None:
            return (1.0 / self.time_constant,)
        if self.frequency is None or self.damping_ratio is None:
            return ()
        turn = 2 * np.pi * self.frequency
        return turn * turn, 2 * self.damping_ratio * turn

    def phase_lag(self, rate: float) -> float:
        """Return the angle [degrees] by which the force lags behind a command of this circular frequency [1/s]."""
        rate = real_number("rate [1/s]", rate)
        if len(self.lag) == 1:
            return float(np.degrees(np.arctan2(rate, self.lag[0])))
        if len(self.lag) == 2:
            return float(np.degrees(np.arctan2(self.lag[1] * rate, self.lag[0] - rate**2)))
        return 0.0

    def fastest_rate(self, mobility: float) -> float:
        """Return the rate of the lag [1/s]: STEADY over the longest step at which `heun` and `rk4` are stable.

        This is the largest eigenvalue, except for a damping ratio zeta below 0.5. Then the product x of natural
        frequency and step up to which `heun` is stable is the root of x^3 - 4 zeta x^2 + 8 zeta^2 x - 8 zeta, which
        is below 2.
        """
        if self.frequency is None or self.damping_ratio is None:
            return sum(self.lag, 0.0)
        zeta, turn = self.damping_ratio, 2 * np.pi * self.frequency
        if zeta < 0.5:
            roots = np.roots([1.0, -4 * zeta, 8 * zeta**2, -8 * zeta])
            return float(STEADY * turn / roots.real[np.abs(roots.imag).argmin()])
        return turn * max(1.0, zeta + np.sqrt(max(zeta**2 - 1.0, 0.0)))

    @property
    def command_limits(self) -> tuple[float, float]:
        """Lowest and highest command [N]."""
        limit = NO_LIMIT if self.force_limit is None else self.force_limit
        return -limit, limit


@dataclass(frozen=True, eq=False)
class VariableDamper(_Attached):
    """A viscous damper whose coefficient is the command: a semi-active damper, for example of a vehicle.

    The coefficient is constant between two sampling instants; the force follows the velocity continuously.

    Args:
        place: As for `Actuator`.
        low: Lowest coefficient [N s/m].
        high: Highest coefficient [N s/m].
        stroke_limit: As for `Actuator`.

    Raises:
        ValueError: If a value is out of its range, or `low` is above `high`.
        TypeError: If `place` is of another type.

    Example:
        >>> wd.control.VariableDamper(1, low=1e3, high=2e4).command_limits
        (1000.0, 20000.0)
    """

    low: float = 0.0
    high: float = 0.0
    stroke_limit: float | None = None
    kind = DAMPER

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low > self.high:
            raise ValueError(f"low={self.low:g} N s/m is above high={self.high:g} N s/m: exchange them")

    def _bounds(self, name: str) -> dict[str, Any]:
        return {"least": 0.0} if name == "low" else {"above": 0.0}

    @property
    def command_limits(self) -> tuple[float, float]:
        """Lowest and highest command [N s/m]."""
        return self.low, self.high

    def fastest_rate(self, mobility: float) -> float:
        """Return the rate at which the damper slows down a relative motion of its free ends [1/s]."""
        return self.high * mobility


@dataclass(frozen=True, eq=False)
class MRDamper(_Attached):
    """A magnetorheological damper (modified Bouc-Wen model), whose command is a voltage.

    The force that resists the drift x is c1 y' + k1 (x - x0), with

        y' = (alpha z + c0 x' + k0 (x - y)) / (c0 + c1)
        z' = -gamma abs(x' - y') z abs(z) - beta (x' - y') z^2 + A (x' - y')

    alpha, c0 and c1 are linear in the filtered voltage u, with u' = eta (v - u). The exponent n of the model is 2. The
    default values are those of the prototype of Dyke, Spencer, Sain and Carlson (1996), Smart Materials and Structures
    5, 565-575. Its force of about 1 kN is too small for a building: multiply all c, k and alpha by one factor.

    Args:
        place: As for `Actuator`.
        dashpot_0: c0 at 0 V [N s/m].
        dashpot_0_per_volt: Change of c0 [N s/(m V)].
        stiffness_0: k0 [N/m].
        dashpot_1: c1 at 0 V [N s/m].
        dashpot_1_per_volt: Change of c1 [N s/(m V)].
        stiffness_1: k1 of the accumulator [N/m].
        offset: x0 [m]; the force at rest is -k1 x0.
        alpha: alpha at 0 V [N/m].
        alpha_per_volt: Change of alpha [N/(m V)].
        gamma: gamma [1/m2].
        beta: beta [1/m2].
        slope: A [1].
        voltage_rate: eta [1/s].
        voltage_limit: Highest voltage [V].
        first_voltage: Filtered voltage at the start [V].
        stroke_limit: As for `Actuator`.

    Raises:
        ValueError: If a value is out of its range.
        TypeError: If `place` is of another type.

    Example:
        >>> damper = wd.control.MRDamper(1)
        >>> round(100 * damper.largest_loop, 4)  # cm
        0.6439
    """

    dashpot_0: float = 2100.0
    dashpot_0_per_volt: float = 350.0
    stiffness_0: float = 4690.0
    dashpot_1: float = 28300.0
    dashpot_1_per_volt: float = 295.0
    stiffness_1: float = 500.0
    offset: float = 0.143
    alpha: float = 14000.0
    alpha_per_volt: float = 69500.0
    gamma: float = 3.63e6
    beta: float = 3.63e6
    slope: float = 301.0
    voltage_rate: float = 190.0
    voltage_limit: float = 2.25
    first_voltage: float = 0.0
    stroke_limit: float | None = None
    kind = MAGNETORHEOLOGICAL

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.gamma + self.beta <= 0:
            raise ValueError(
                f"gamma + beta must be above 0 (they are {self.gamma:g} and {self.beta:g} 1/m2): otherwise the "
                "evolutionary variable z grows without bound"
            )
        if self.first_voltage > self.voltage_limit:
            raise ValueError(f"first_voltage={self.first_voltage:g} V is above voltage_limit={self.voltage_limit:g} V")

    def _bounds(self, name: str) -> dict[str, Any]:
        if name in ("beta", "offset"):
            return {}
        return (
            {"above": 0.0}
            if name in ("dashpot_1", "slope", "voltage_rate", "voltage_limit", "stroke_limit")
            else {"least": 0.0}
        )

    @property
    def command_limits(self) -> tuple[float, float]:
        """Lowest and highest command [V]."""
        return 0.0, self.voltage_limit

    @property
    def largest_loop(self) -> float:
        """Largest evolutionary variable z [m]."""
        return float(np.sqrt(self.slope / (self.gamma + self.beta)))

    @property
    def hysteretic_force(self) -> float:
        """Largest force alpha z at the highest voltage [N]."""
        return (self.alpha + self.alpha_per_volt * self.voltage_limit) * self.largest_loop

    def fastest_rate(self, mobility: float) -> float:
        """Return the largest eigenvalue [1/s] of the damper on a free mass, at z = 0 and any voltage in range."""
        rates = []
        for volts in (0.0, self.voltage_limit):
            c0 = self.dashpot_0 + self.dashpot_0_per_volt * volts
            c1 = self.dashpot_1 + self.dashpot_1_per_volt * volts
            spring = (self.alpha + self.alpha_per_volt * volts) * self.slope + self.stiffness_0
            inner = np.array([spring, c0, -spring]) / (c0 + c1)  # y' for x, x' and y
            matrix = np.array([[0.0, 1.0, 0.0], -mobility * (c1 * inner + [self.stiffness_1, 0.0, 0.0]), inner])
            rates.append(float(np.abs(np.linalg.eigvals(matrix)).max()))
        return max(*rates, self.voltage_rate)
