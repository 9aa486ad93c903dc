"""Stability of linear closed loops: eigenvalues of continuous and sampled control, and the delay margin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.model.control.actuators import Actuator
from warpdyn.model.control.control import Control
from warpdyn.model.control.regulators import Regulator, sampled_system
from warpdyn.model.control.state_space import StateSpace, state_space
from warpdyn.model.structures.structure import Structure

ON_AXIS = 1e-8  # real part of an eigenvalue on the imaginary axis, relative to the largest eigenvalue


def closed_loop_eigenvalues(
    structure: Structure,
    actuators: Sequence[Any],
    regulator: Regulator,
    parameters: Mapping[str, ArrayLike] | None = None,
) -> np.ndarray:
    """Return the eigenvalues [1/s] of a structure with continuous state feedback, shape [state], by size.

    The structure is stable if all real parts are negative. The damping ratio of a pair is minus its real part divided
    by its absolute value.

    Args:
        structure: A ShearBuilding or a LumpedStructure; its initial stiffness counts.
        actuators: The actuators.
        regulator: A regulator of displacements and velocities, without an observer.
        parameters: As in `state_space`.

    Raises:
        ValueError: If the regulator has an observer or measures accelerations.

    Example:
        >>> regulator = wd.control.lqr(building, [wd.control.Actuator(1)], force_weight=1e-8)
        >>> bool((wd.control.closed_loop_eigenvalues(building, [wd.control.Actuator(1)], regulator).real < 0).all())
        True
    """
    system = state_space(structure, actuators, parameters)
    gain = _state_gain(system, regulator)
    dynamics, driven, _ = _with_lags(system, actuators)
    found = np.linalg.eigvals(dynamics - driven @ _widened(gain, len(dynamics)))
    return found[np.lexsort((found.imag, np.abs(found).round(9)))]


def delay_margin(
    structure: Structure,
    actuators: Sequence[Any],
    regulator: Regulator,
    parameters: Mapping[str, ArrayLike] | None = None,
) -> float:
    """Return the delay [s] at which continuous state feedback of one actuator becomes unstable.

    The margin is the least of (phase margin) / (frequency) over all frequencies at which the loop gain is 1. It is
    infinity if no delay makes the loop unstable, and 0 if the loop is unstable without delay.

    Args:
        structure, actuators, regulator, parameters: As in `closed_loop_eigenvalues`, with one actuator.

    Raises:
        ValueError: If there are several actuators, or as in `closed_loop_eigenvalues`.

    Example:
        >>> regulator = wd.control.lqr(building, [wd.control.Actuator(1)], force_weight=1e-8)
        >>> wd.control.delay_margin(building, [wd.control.Actuator(1)], regulator) > 0
        True
    """
    system = state_space(structure, actuators, parameters)
    if system.input.shape[1] != 1:
        raise ValueError(
            f"a delay margin needs one actuator, got {system.input.shape[1]}: use sampled_eigenvalues with "
            "several delays"
        )
    gain = _state_gain(system, regulator)
    a, b, of_lags = _with_lags(system, actuators)
    gain = _widened(gain, len(a))
    if np.linalg.eigvals(a - b @ gain).real.max() >= 0:
        return 0.0
    if not gain.any():
        return np.inf
    # The gain is 1 where this Hamiltonian matrix has an eigenvalue on the imaginary axis. Velocities are scaled by a
    # frequency, and the forces by the size of the gain, so that the entries are of similar size.
    dofs = len(system.mass)
    scale = np.sqrt(np.abs(np.linalg.eigvals(system.dynamics)).max())
    units = np.concatenate([np.full(dofs, 1.0 / scale), np.full(dofs, scale)])
    force = scale / np.linalg.norm(system.input / units[:, None])
    if of_lags:  # units of the force and, of second order, of its rate
        units = np.append(units, force * np.array([1.0, np.sqrt(of_lags[0].lag[0])])[: len(of_lags[0].lag)])
    a, b, gain = a * np.outer(1 / units, units), b / units[:, None], gain * units
    factor = np.sqrt(np.linalg.norm(gain) / np.linalg.norm(b))
    b, gain = b * factor, gain / factor
    hamiltonian = np.block([[a, b @ b.T], [-gain.T @ gain, -a.T]])
    found = np.linalg.eigvals(hamiltonian)
    size = np.abs(found).max()
    frequencies = found.imag[(np.abs(found.real) <= ON_AXIS * size) & (found.imag > 0)]
    margins = []
    for frequency in frequencies:
        loop = (gain @ np.linalg.solve(1j * frequency * np.eye(len(a)) - a, b)).item()
        margins.append(np.angle(-loop) % (2 * np.pi) / frequency)
    return float(min(margins, default=np.inf))


def sampled_eigenvalues(
    structure: Structure, control: Control, parameters: Mapping[str, ArrayLike] | None = None
) -> np.ndarray:
    """Return the eigenvalues [1] of one sampling interval of a linear closed loop, largest absolute value first.

    The loop has the sampling, the delay and the observer of the control; it is stable if all absolute values are below
    1. Noise, rounding and limits do not count.

    Args:
        structure: A ShearBuilding or a LumpedStructure; its initial stiffness counts.
        control: A control with a regulator and actuators of the class `Actuator`, without a controller.
        parameters: As in `state_space`.

    Raises:
        ValueError: If the control is not linear.

    Example:
        >>> damper = [wd.control.Actuator(1)]
        >>> regulator = wd.control.lqr(building, damper, force_weight=1e-8)
        >>> control = wd.control.Control(damper, regulator=regulator, sampling_interval=0.02)
        >>> bool(abs(wd.control.sampled_eigenvalues(building, control)[0]) < 1)
        True
    """
    regulator = control.regulator
    if regulator is None or control.controller is not None or any(each.kind != "force" for each in control.actuators):
        raise ValueError(
            "only a linear loop has eigenvalues: the control needs a regulator, no controller, and actuators of the "
            "class Actuator. For others, simulate the loop"
        )
    system = state_space(structure, control.actuators, parameters)
    dynamics, input_, _ = _with_lags(system, control.actuators)
    growth, driven = sampled_system(system._replace(dynamics=dynamics, input=input_), control.sampling_interval)
    states, forces = driven.shape
    of_structure = len(system.dynamics)
    sensors = regulator.kinds(of_structure // 2) * (of_structure // 2)
    rows, direct = np.eye(of_structure, states), np.zeros((of_structure, forces))
    if sensors > of_structure:  # accelerations are measured while the force of the last interval still acts
        dofs = slice(of_structure // 2, of_structure)
        rows, direct = np.vstack([rows, dynamics[dofs]]), np.vstack([direct, input_[dofs]])
    observer, delay = regulator.states, control.delay_in_samples
    # State of the loop: structure, observer, the acting command of the last interval, and queued commands.
    size = states + observer + forces * (1 + delay)
    loop = np.zeros((size, size))
    x, s, acting = (
        slice(0, states),
        slice(states, states + observer),
        slice(states + observer, states + observer + forces),
    )

    def queue(place: int) -> slice:
        first = states + observer + forces * (1 + place)
        return slice(first, first + forces)

    asked = np.zeros((forces, size))
    asked[:, x], asked[:, acting] = -regulator.gain @ rows, -regulator.gain @ direct
    if regulator.estimate_gain is not None:
        asked[:, s] = -regulator.estimate_gain
    now = asked
    if delay:
        now = np.zeros((forces, size))
        now[:, queue(0)] = np.eye(forces)
        for place in range(delay - 1):
            loop[queue(place), queue(place + 1)] = np.eye(forces)
        loop[queue(delay - 1)] = asked
    loop[x, x] = growth
    loop[x] += driven @ now
    loop[acting] = now
    if regulator.growth is not None and regulator.correction is not None and regulator.input is not None:
        loop[s, s] = regulator.growth
        loop[s, x] += regulator.correction @ rows
        loop[s, acting] += regulator.correction @ direct
        loop[s] += regulator.input @ now
    found = np.linalg.eigvals(loop)
    return found[np.argsort(-np.abs(found))]


def _with_lags(system: StateSpace, actuators: Sequence[Any]) -> tuple[np.ndarray, np.ndarray, list[Actuator]]:
    """Return A and B with the forces of lagging actuators (and, of second order, their rates) as further states.

    Args:
        system: The structure, whose inputs are the forces.
        actuators: The actuators.

    Returns:
        A, shape [state, state]; B, whose inputs are the commands, shape [state, actuator]; the lagging actuators.
    """
    lagging = [each for each in actuators if isinstance(each, Actuator) and each.lag]
    first = len(system.dynamics)
    size = first + sum(len(each.lag) for each in lagging)
    dynamics, driven = np.zeros((size, size)), np.zeros((size, system.input.shape[1]))
    dynamics[:first, :first], driven[:first] = system.dynamics, system.input
    for place, each in enumerate(actuators):
        if each not in lagging:
            continue
        dynamics[: len(system.dynamics), first], driven[:, place] = system.input[:, place], 0.0
        last = first + len(each.lag) - 1
        driven[last, place], dynamics[last, first] = each.lag[0], -each.lag[0]
        if len(each.lag) == 2:
            dynamics[first, last], dynamics[last, last] = 1.0, -each.lag[1]
        first = last + 1
    return dynamics, driven, lagging


def _widened(gain: np.ndarray, states: int) -> np.ndarray:
    """Return a gain of the states of the structure as a gain of all states, 0 for those of actuators."""
    return np.pad(gain, ((0, 0), (0, states - gain.shape[1])))


def _state_gain(system: StateSpace, regulator: Regulator) -> np.ndarray:
    """Return the gain of displacements and velocities; raise a ValueError if the regulator uses other values."""
    states = len(system.dynamics)
    if regulator.states or regulator.kinds(states // 2) != 2:
        raise ValueError(
            "continuous state feedback needs a regulator of displacements and velocities without an observer, as `lqr` "
            "returns it: use sampled_eigenvalues"
        )
    if regulator.actuators != system.input.shape[1]:
        raise ValueError(f"the regulator has {regulator.actuators} actuators, but {system.input.shape[1]} are given")
    return regulator.gain
