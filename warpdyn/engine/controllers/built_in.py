"""Controllers of warpdyn: skyhook, semi-active skyhook, and clipped-optimal control of a magnetorheological damper."""

from __future__ import annotations

from typing import Any

from warpdyn.engine.controllers.controller import Controller
from warpdyn.engine.controllers.rules import DAMPER, FORCE, MAGNETORHEOLOGICAL
from warpdyn.engine.laws.law import parameter


class SkyhookDamper(Controller):
    """Ideal skyhook: a force against the absolute velocity of the actuator's upper end, for an `Actuator`.

    The absolute velocity is that relative to the base plus the velocity of the base, which is 0 at the start of the
    run. (Karnopp, Crosby and Harwood 1974.)

    Example:
        >>> wd.control.SkyhookDamper(coefficient=1500.0)
        SkyhookDamper(coefficient=1500)
    """

    acts_on = FORCE
    coefficient: float = parameter("N s m-1", "force divided by the absolute velocity", low=0.0)

    def command(measured: Any, memory: Any, c: Any) -> Any:
        return -c.coefficient * (measured.upper_velocity + measured.ground_velocity)


class OnOffSkyhook(Controller):
    """On-off skyhook of a `VariableDamper`: the high coefficient if the damper slows the body down, else the low one.

    Example:
        >>> wd.control.OnOffSkyhook(low=300.0, high=3000.0)
        OnOffSkyhook(low=300, high=3000)
    """

    acts_on = DAMPER
    low: float = parameter("N s m-1", "coefficient if the damper would accelerate the body", low=0.0)
    high: float = parameter("N s m-1", "coefficient if the damper slows the body down", low=0.0, low_open=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_bounds_in_order(self.low, self.high)

    def command(measured: Any, memory: Any, c: Any) -> Any:
        absolute = measured.upper_velocity + measured.ground_velocity
        if absolute * measured.rate > 0:
            return c.high
        return c.low


class ContinuousSkyhook(Controller):
    """Continuous skyhook of a `VariableDamper`: it follows the ideal skyhook force within its range of coefficients.

    The coefficient is `high` times the absolute velocity of the body divided by the rate of the damper, between `low`
    and `high`; it is `low` if the damper would accelerate the body.

    Example:
        >>> wd.control.ContinuousSkyhook(low=300.0, high=3000.0)
        ContinuousSkyhook(low=300, high=3000)
    """

    acts_on = DAMPER
    low: float = parameter("N s m-1", "lowest coefficient", low=0.0)
    high: float = parameter("N s m-1", "highest coefficient, and that of the ideal skyhook", low=0.0, low_open=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_bounds_in_order(self.low, self.high)

    def command(measured: Any, memory: Any, c: Any) -> Any:
        absolute = measured.upper_velocity + measured.ground_velocity
        if absolute * measured.rate > 0:
            return min(max(c.high * absolute / measured.rate, c.low), c.high)
        return c.low


class ClippedOptimal(Controller):
    """Clipped-optimal control of an `MRDamper`: full voltage if it brings the force closer to the desired one, else 0.

    The regulator of the control computes the desired force f_d. With the measured force f, the voltage is `voltage` if
    (f_d - f) f > 0, else 0. (Dyke, Spencer, Sain and Carlson 1996.)

    Example:
        >>> wd.control.ClippedOptimal(voltage=2.25)
        ClippedOptimal(voltage=2.25)
    """

    acts_on = MAGNETORHEOLOGICAL
    voltage: float = parameter("V", "greatest voltage", low=0.0, low_open=True)

    def command(measured: Any, memory: Any, c: Any) -> Any:
        if (measured.desired - measured.force) * measured.force > 0:
            return c.voltage
        return 0.0


class ConstantCommand(Controller):
    """A constant command, such as the voltage of a magnetorheological damper in passive-on control.

    Example:
        >>> wd.control.ConstantCommand(value=2.25)
        ConstantCommand(value=2.25)
    """

    value: float = parameter("1", "the command, in the unit of the actuator")

    def command(measured: Any, memory: Any, c: Any) -> Any:
        return c.value


def _check_bounds_in_order(low: float, high: float) -> None:
    """Raise a ValueError if the low coefficient of a semi-active damper is above the high one."""
    if low > high:
        raise ValueError(f"low={low:g} N s/m is above high={high:g} N s/m: exchange them")
