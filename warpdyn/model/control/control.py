"""`Control`: actuators, sensors, regulator and controller of a scene, and the arrays that kernels read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from warpdyn.engine.controllers.controller import Controller
from warpdyn.engine.controllers.rules import DAMPER, FORCE, MAGNETORHEOLOGICAL, OF_DOFS, SENSORS, ControlRules
from warpdyn.foundations.core.checks import one_of, real_number
from warpdyn.foundations.core.frozen_values import FrozenMapping
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.model.control.actuators import NO_LIMIT, STEADY, Actuator, MRDamper, VariableDamper
from warpdyn.model.control.regulators import Regulator
from warpdyn.model.control.state_space import check_structure, state_space
from warpdyn.model.structures.structure import Structure

ON_LIMIT = ("clip", "fail")
WHOLE = 1e-6  # largest difference of a ratio of two times from a whole number
MOST_DELAYED, MOST_ACTUATORS = 1000, 16
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s2", "force": "N"}
COMMANDS = {FORCE: "a force [N]", DAMPER: "a coefficient [N s/m]", MAGNETORHEOLOGICAL: "a voltage [V]"}
# Above this product of the slowest circular frequency and the sampling interval, the loop cannot follow the vibration.
COARSE_SAMPLING = 0.5
LEAST_MILLISECONDS = 0.5  # a number below it is not a time in ms
LARGEST_LAG = 45.0  # of the force of an actuator behind its command at the first period [degrees]; warned above


@dataclass(frozen=True, eq=False)
class Control:
    """Control of a structure: at each sampling instant sensors, a regulator and a controller compute commands.

    The commands are held until the next sampling instant (zero-order hold). The first sampling instant is the start of
    the run. If there is a regulator, its output is the command; a controller receives it as `measured.desired`.

    Args:
        actuators: Objects of `Actuator`, `VariableDamper` or `MRDamper`.
        regulator: A linear regulator, such as `lqr` and `lqg` return it; None: none.
        controller: An object of a subclass of `Controller`; None: the command is the output of the regulator.
        sampling_interval: Time between two sampling instants [s]: a multiple of the sampling step of every motion, or a
            whole fraction of it.
        delay: Time between a sampling instant and the action of its command [s], a multiple of `sampling_interval`.
            Until the first command acts, commands are 0.
        noise: Standard deviation of the sensor noise (white, normal, independent) by kind: "displacement" [m],
            "velocity" [m/s], "acceleration" (absolute) [m/s2] and "force" of the actuator [N].
        resolution: Step to which sensor values are rounded (quantisation), by kind as for `noise`.
        on_limit: "clip": commands beyond the limits of an actuator are limited and counted in `limited_share`. "fail":
            such a sample has the status control_failed.

    Raises:
        ValueError, TypeError: If an argument is invalid, or the arguments do not fit each other.

    Example:
        >>> tendon = wd.control.Actuator(1, force_limit=2e5)
        >>> regulator = wd.control.lqr(building, [tendon], force_weight=1e-8)
        >>> control = wd.control.Control([tendon], regulator=regulator, sampling_interval=0.02, delay=0.02)
        >>> run = wd.simulate(wd.Scene(building, wd.Cloud(motions), control=control), device="cpu")
        >>> run["peak_control_force"].dims
        ('sample', 'actuator')
    """

    actuators: Sequence[Actuator | VariableDamper | MRDamper]
    regulator: Regulator | None = None
    controller: Controller | None = None
    sampling_interval: float = None  # type: ignore[assignment]
    delay: float = 0.0
    noise: Mapping[str, float] = field(default_factory=dict)
    resolution: Mapping[str, float] = field(default_factory=dict)
    on_limit: str = "clip"

    def __post_init__(self) -> None:
        if not isinstance(self.actuators, list | tuple) or not self.actuators:
            raise ValueError("actuators must be a list with at least one actuator, such as [wd.control.Actuator(1)]")
        for each in self.actuators:
            if not isinstance(each, Actuator | VariableDamper | MRDamper):
                raise TypeError(f"actuators must be objects such as wd.control.Actuator(1), got {each!r}")
        if len(self.actuators) > MOST_ACTUATORS:
            raise ValueError(f"at most {MOST_ACTUATORS} actuators are supported, got {len(self.actuators)}")
        object.__setattr__(self, "actuators", tuple(self.actuators))
        if self.sampling_interval is None:
            raise ValueError("sampling_interval is missing: give the time between two samples [s], such as 0.01")
        interval = real_number("sampling_interval [s]", self.sampling_interval, above=0)
        object.__setattr__(self, "sampling_interval", interval)
        delay = real_number("delay [s]", self.delay, least=0)
        object.__setattr__(self, "delay", delay)
        count = delay / interval
        if abs(count - round(count)) > WHOLE:
            near = round(count) * interval
            raise ValueError(
                f"delay={delay:g} s is not a multiple of sampling_interval={interval:g} s: give delay={near:g}, or a "
                f"shorter sampling_interval{_in_seconds(delay, interval)}"
            )
        if round(count) > MOST_DELAYED:
            raise ValueError(
                f"delay={delay:g} s is {round(count)} sampling intervals, more than {MOST_DELAYED}: give a shorter "
                f"delay{_in_seconds(delay, interval)}"
            )
        for name in ("noise", "resolution"):
            given = getattr(self, name)
            if not isinstance(given, Mapping):
                raise TypeError(f'{name} must be a dictionary by kind of sensor, such as {{"velocity": 1e-3}}')
            for kind, value in given.items():
                one_of(f"kind of sensor in {name}", kind, SENSORS)
                real_number(f"{name} of {kind} [{UNITS[kind]}]", value, least=0)
            object.__setattr__(self, name, FrozenMapping(dict(given)))
        one_of("on_limit", self.on_limit, ON_LIMIT)
        self._check_laws()

    def _check_laws(self) -> None:
        if self.regulator is None and self.controller is None:
            raise ValueError("a control needs a regulator= (such as wd.control.lqr(...)) or a controller=, or both")
        if self.regulator is not None:
            if not isinstance(self.regulator, Regulator):
                raise TypeError(f"regulator must be a Regulator, as wd.control.lqr returns it, got {self.regulator!r}")
            if self.regulator.actuators != len(self.actuators):
                raise ValueError(
                    f"the regulator has {self.regulator.actuators} actuators, but the control has "
                    f"{len(self.actuators)}: design it for these actuators"
                )
            designed = self.regulator.sampling_interval
            if designed is not None and abs(designed / self.sampling_interval - 1) > WHOLE:
                raise ValueError(
                    f"the regulator was designed for sampling_interval={designed:g} s, not "
                    f"{self.sampling_interval:g} s: give the same interval to both"
                )
            if self.controller is None:
                for each in self.actuators:
                    if not isinstance(each, Actuator):
                        raise ValueError(
                            f"the regulator returns forces, but the command of a {type(each).__name__} is a "
                            f"{'voltage' if isinstance(each, MRDamper) else 'coefficient'}: add a controller=, such as "
                            "wd.control.ClippedOptimal(voltage=2.25)"
                        )
        if self.controller is not None and not isinstance(self.controller, Controller):
            kind = self.controller
            hint = f": give {kind.__name__}(...)" if isinstance(kind, type) else ""
            raise TypeError(f"controller must be an object of a subclass of wd.control.Controller, got {kind!r}{hint}")
        if self.controller is not None:
            self._check_commands(self.controller)

    def _check_commands(self, controller: Controller) -> None:
        """Raise a ValueError if actuators take other commands than the controller returns, or it has no input."""
        name = type(controller).__name__
        for number, each in enumerate(self.actuators, 1):
            if controller.acts_on not in (None, each.kind):
                raise ValueError(
                    f"{name} returns {COMMANDS[controller.acts_on]}, but the command of actuator {number} "
                    f"({type(each).__name__}) is {COMMANDS[each.kind]}: give another controller, or another actuator"
                )
        if self.regulator is None and self._reads("desired"):
            raise ValueError(
                f"{name} reads measured.desired, which is 0 without a regulator: give regulator=, such as "
                "wd.control.lqr(structure, actuators, force_weight=1e-8)"
            )

    @property
    def delay_in_samples(self) -> int:
        """Number of sampling intervals between a sampling instant and the action of its command."""
        return round(self.delay / self.sampling_interval)

    @property
    def is_noisy(self) -> bool:
        """Whether sensor values have noise."""
        return any(value > 0 for value in self.noise.values())

    def _reads(self, name: str) -> bool:
        """Return whether the controller reads a measured value."""
        return self.controller is not None and f"measured.{name}" in self.controller.written.text

    def check(self, structure: Structure, *, base_components: int) -> None:
        """Raise an error unless the control fits a structure and its excitation.

        Args:
            structure: The structure.
            base_components: Number of components of the base motion; 0 if the base does not move.
        """
        check_structure(structure)
        rules = self.rules(structure)
        if base_components == 0 and self._reads("ground_velocity") and not isinstance(self.controller, type):
            warn_caller("the base does not move, so that measured.ground_velocity is 0")
        load_mass = getattr(structure, "load_mass", None)
        if rules.sensors == len(OF_DOFS) and load_mass is not None:
            raise ValueError(
                "accelerations cannot be measured in a structure with load_mass= (inerters): use displacements and "
                "velocities"
            )
        for kind in ("noise", "resolution"):
            if getattr(self, kind).get("acceleration", 0) > 0 and rules.sensors < len(OF_DOFS):
                raise ValueError(f"{kind} of acceleration has no effect: neither regulator nor controller reads them")
        slowest = np.abs(np.linalg.eigvals(state_space(structure, ()).dynamics)).min()
        for number, each in enumerate(self.actuators, 1):
            if isinstance(each, Actuator) and (late := each.phase_lag(slowest)) > LARGEST_LAG:
                name = "frequency= is in Hz" if each.frequency else "time_constant= is in seconds"
                warn_caller(
                    f"the force of actuator {number} lags behind its command by {late:.0f} degrees at the first period "
                    f"of the structure, {2 * np.pi / slowest:.3g} s, so that the control may amplify the vibration: "
                    f"{name}. Check wd.control.closed_loop_eigenvalues"
                )
        if slowest * self.sampling_interval > COARSE_SAMPLING:
            advice = f"give at most {COARSE_SAMPLING / slowest:.2g} s, mostly 0.001 to 0.02 s"
            if self.sampling_interval >= LEAST_MILLISECONDS:
                advice = f"if {self.sampling_interval:g} is in ms, give {self.sampling_interval / 1000:g}"
            warn_caller(
                f"sampling_interval={self.sampling_interval:g} s is long for the first period of the structure, "
                f"{2 * np.pi / slowest:.3g} s: the commands lag behind the vibration by half of the interval. "
                f"sampling_interval= is in seconds: {advice}"
            )

    def rules(self, structure: Structure) -> ControlRules:
        """Return the properties of the control that decide the source of a kernel."""
        sensors = 2 if self.regulator is None else self.regulator.kinds(structure.dofs)
        sensors = len(OF_DOFS) if self._reads("acceleration") else sensors
        written = None if self.controller is None else self.controller.written
        return ControlRules(
            actuators=tuple(each.rules(structure) for each in self.actuators),
            written=written,
            memory=0 if written is None else len(written.memory),
            states=0 if self.regulator is None else self.regulator.states,
            has_regulator=self.regulator is not None,
            sensors=sensors,
            is_noisy=self.is_noisy,
            is_rounded=any(value > 0 for value in self.resolution.values()),
            delay=self.delay_in_samples,
            senses_ground=self._reads("ground_velocity"),
            fails_at_limits=self.on_limit == "fail",
            is_limited=any(each.stroke < NO_LIMIT for each in self.actuators),
        )

    def packed(self, structure: Structure) -> dict[str, np.ndarray]:
        """Return the arrays that kernels read, by the fields of the struct Load."""
        from warpdyn.engine.controllers.device_functions import NAMES, WIDTH

        rules = self.rules(structure)
        limits = np.array([each.command_limits for each in self.actuators])
        found = {
            "command_low": limits[:, 0],
            "command_high": limits[:, 1],
            "stroke_limit": np.array([each.stroke for each in self.actuators]),
        }
        for name, given in (("sensor_noise", self.noise), ("sensor_resolution", self.resolution)):
            values = [given.get(kind, 0.0) for kind in OF_DOFS[: rules.sensors] for _ in range(structure.dofs)]
            found[name] = np.array(values + [given.get("force", 0.0)] * len(self.actuators))
        if self.regulator is not None:
            gain, shape = self.regulator.gain, (len(self.actuators), rules.sensors * structure.dofs)
            whole = np.zeros(shape)
            whole[:, : gain.shape[1]] = gain
            found["regulator_gain"] = whole.ravel()
            for name, matrix in self.regulator.observer.items():
                whole = np.zeros((rules.states, shape[1])) if name == "correction" else matrix.copy()
                whole[:, : matrix.shape[1]] = matrix
                found[name if name == "estimate_gain" else f"estimate_{name}"] = whole.ravel()
        if self.controller is not None:
            found["controller_coefficients"] = np.append(self.controller.coefficients(), 0.0)
        if rules.has_parameters:
            rows = np.zeros((len(self.actuators), WIDTH))
            for row, each in zip(rows, self.actuators, strict=True):
                if isinstance(each, MRDamper):
                    row[:] = [getattr(each, name) for name in NAMES]
                elif isinstance(each, Actuator):
                    row[: len(each.lag)] = each.lag
            found["damper_parameters"] = rows.ravel()
        if rules.is_magnetorheological:
            found["first_voltage"] = np.array([getattr(each, "first_voltage", 0.0) for each in self.actuators])
        return found

    def stable_step(self, structure: Structure) -> float:
        """Return the longest step [s] that is stable for dampers and lagging actuators; infinity without them."""
        mass = state_space(structure, ()).mass
        rate = 0.0
        for each in self.actuators:
            place = each.influence(structure)
            rate += each.fastest_rate(float(place @ np.linalg.solve(mass, place)))
        return STEADY / rate if rate > 0 else np.inf

    def samplings_per_interval(self, interval: np.ndarray) -> np.ndarray:
        """Return the sampling instants in the sampling step of each motion, shape [motion]; 1 or a fraction if fewer.

        Args:
            interval: Sampling steps of the motions [s], shape [motion].

        Raises:
            ValueError: If a sampling step is neither a multiple nor a whole fraction of the sampling interval.
        """
        ratio = interval / self.sampling_interval
        larger = np.maximum(ratio, 1 / ratio)
        bad = np.abs(larger - np.round(larger)) > WHOLE * larger
        if bad.any():
            step = float(interval[bad][0])
            best = step * max(1, round(self.sampling_interval / step))
            raise ValueError(
                f"sampling_interval={self.sampling_interval:g} s is neither a multiple nor a whole fraction of the "
                f"step of a motion, {step:g} s: give sampling_interval={best:g}, or resample the motion"
            )
        return np.where(ratio > 1, np.round(ratio), 1 / np.round(1 / np.minimum(ratio, 1)))

    def description(self) -> dict[str, Any]:
        """Return the control as a dictionary, for the JSON of the scene."""
        return {"type": "Control", **{name: getattr(self, name) for name in self.__dataclass_fields__}}


def _in_seconds(delay: float, interval: float) -> str:
    """Return advice for a delay that may be in ms: the next multiple of the sampling interval in s."""
    if delay < LEAST_MILLISECONDS:
        return ""
    meant = max(1, math.ceil(delay / 1000 / interval - WHOLE)) * interval
    return f". delay= is in seconds: if {delay:g} is in ms, give delay={meant:g}"
