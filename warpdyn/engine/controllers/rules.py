"""The properties of a control that decide the source of a kernel: actuators, sensors, delay and controller."""

from __future__ import annotations

from dataclasses import dataclass

from warpdyn.engine.laws.written.source import Written

#: Kinds of actuators: a force, a damper with a variable coefficient, and a magnetorheological damper.
FORCE, DAMPER, MAGNETORHEOLOGICAL = "force", "damper", "magnetorheological"
#: Kinds of sensors with one value per degree of freedom, in the order of the vector of sensor values.
DISPLACEMENT, VELOCITY, ACCELERATION = OF_DOFS = ("displacement", "velocity", "acceleration")
#: Kinds of sensors; the last one has one value per actuator.
SENSORS = (*OF_DOFS, "force")


@dataclass(frozen=True)
class ActuatorRules:
    """The kind and the place of an actuator.

    Args:
        kind: FORCE, DAMPER or MAGNETORHEOLOGICAL.
        rows: Degrees of freedom on which the actuator acts, and the factor of its force on each of them.
        order: Order of the differential equation by which the force follows the command: 0 (at once), 1 or 2.
    """

    kind: str
    rows: tuple[tuple[int, float], ...]
    order: int = 0


@dataclass(frozen=True)
class ControlRules:
    """The properties of a control that decide the source of a kernel; values such as gains are not among them.

    Args:
        actuators: The actuators.
        written: Device function of the controller; None: the command is the output of the regulator.
        memory: Number of memory values of the controller for each actuator.
        states: Number of states of the regulator's observer.
        has_regulator: Whether there is a regulator (a gain matrix).
        sensors: Number of kinds of sensors of degrees of freedom: 2, or 3 with accelerations.
        is_noisy: Whether sensors have noise.
        is_rounded: Whether sensor values are rounded to a resolution.
        delay: Number of sampling intervals between a sample and its command.
        senses_ground: Whether the controller reads the velocity of the base.
        fails_at_limits: Whether a command beyond its limits is a failure.
        is_limited: Whether an actuator has a limit of its stroke.
    """

    actuators: tuple[ActuatorRules, ...]
    written: Written | None = None
    memory: int = 0
    states: int = 0
    has_regulator: bool = False
    sensors: int = 2
    is_noisy: bool = False
    is_rounded: bool = False
    delay: int = 0
    senses_ground: bool = False
    fails_at_limits: bool = False
    is_limited: bool = False

    @property
    def is_magnetorheological(self) -> bool:
        """Whether an actuator is a magnetorheological damper, whose state the kernel integrates."""
        return any(each.kind == MAGNETORHEOLOGICAL for each in self.actuators)

    @property
    def is_lagging(self) -> bool:
        """Whether the force of an actuator follows its command with a lag, which the kernel integrates."""
        return any(each.order for each in self.actuators)

    @property
    def has_parameters(self) -> bool:
        """Whether kernels read parameters of actuators."""
        return self.is_magnetorheological or self.is_lagging
