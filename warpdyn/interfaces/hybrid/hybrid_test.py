"""The computed part of a hybrid test: a linear structure that is integrated step by step with measured forces."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np
import xarray as xr

from warpdyn.foundations.core.checks import check_kind, real_number, shortened, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.files.netcdf import trace
from warpdyn.interfaces.hybrid.protocol import (
    DATA_SIZE,
    Action,
    least_data_size,
    receive_values,
    send_header,
    send_values,
)
from warpdyn.model.control.actuators import Place, rows_at
from warpdyn.model.control.state_space import StateSpace, check_structure, state_space
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.structures.structure import Structure

METHOD = "newmark_explicit"
LARGEST_STEP = 2.0  # product of circular frequency and step at which the method becomes unstable
VARIABLES = {
    "displacement": ("dof", "m", "displacement relative to the base"),
    "velocity": ("dof", "m s-1", "velocity relative to the base"),
    "acceleration": ("dof", "m s-2", "acceleration relative to the base"),
    "command": ("interface", "m", "displacement that was sent to the substructure"),
    "measured_force": ("interface", "N", "force that the substructure returned"),
    "exchange_time": (None, "s", "time from sending the displacement to receiving the force"),
}


class HybridTestError(ConnectionError):
    """An error that ends a hybrid test; the attribute `result` contains the dataset of the completed steps."""

    def __init__(self, message: str, result: xr.Dataset) -> None:
        super().__init__(message)
        self.result = result


@with_suggestions
class HybridTest:
    """A hybrid test: warpdyn integrates a structure, and an external substructure measures the force at its interface.

    In each step warpdyn sends the displacement of the interface, receives the force of the substructure, and completes
    the step. The method is Newmark's explicit method (beta = 0, gamma = 1/2), which needs one exchange per step and is
    stable if the step is below 2 divided by the highest circular frequency, with the stiffness of the substructure. A
    force that arrives late acts as negative damping: see `wd.control.delay_margin`.

    Messages have the layout of OpenFresco's generic elements: see the how-to on hybrid tests.

    Args:
        structure: The computed part: a ShearBuilding or a LumpedStructure with linear springs.
        places: Place of the substructure, as `place` of `wd.control.Actuator`; a list for several interfaces. Positive
            displacements of an interface stretch the substructure; a positive force resists them.
        address: Host and port of the substructure.
        step: Step [s].
        timeout: Longest wait for a connection or an answer [s].
        time_scale: Wall-clock time divided by time of the structure [1]: 1 for a real-time test, 0 for no clock: then a
            step starts as soon as the last one ends, and no deadline is missed.
        displacement_limit: Largest displacement at an interface [m]; the test stops before it is sent. Always give it
            for a physical specimen: the displacements of an unstable test grow without bound.
        force_limit: Largest measured force [N]; the test stops if it is exceeded.
        data_size: Number of values in a message.

    Raises:
        ValueError, TypeError: If an argument is invalid, or the structure is not linear.

    Example:
        >>> frame = wd.ShearBuilding(1e5, 4e7, 3.0, damping="rayleigh", damping_ratio=0.05)
        >>> with wd.hybrid.Substructure(lambda u, v, a, t: 4e5 * u) as specimen:
        ...     test = wd.hybrid.HybridTest(frame, 1, specimen.address, step=0.005)
        ...     result = test.run(motions[0], duration=0.5)
        >>> result["measured_force"].dims
        ('time', 'interface')
    """

    def __init__(
        self,
        structure: Structure,
        places: Place | Sequence[Place],
        address: tuple[str, int],
        *,
        step: float,
        timeout: float = 5.0,
        time_scale: float = 0.0,
        displacement_limit: float | None = None,
        force_limit: float | None = None,
        data_size: int = DATA_SIZE,
    ) -> None:
        check_structure(structure, "can be the computed part of a hybrid test")
        if not structure.forgets:
            raise ValueError(
                f"the computed part of a hybrid test must be linear, but it has the law {structure.law!r}: put the "
                "nonlinear part into the substructure"
            )
        self.structure = structure
        self.places = tuple(places) if isinstance(places, list | tuple) else (places,)
        if not self.places:
            raise ValueError("places is empty: give the place of the substructure, such as places=1")
        is_address = isinstance(address, tuple | list) and len(address) == 2 and isinstance(address[0], str)
        if not is_address:
            raise TypeError(f'address must be host and port, such as ("127.0.0.1", 8090), got {shortened(address)}')
        self.address = address[0], whole_number("port", address[1], 1, 65535)
        self.step = real_number("step [s]", step, above=0)
        self.timeout = real_number("timeout [s]", timeout, above=0)
        self.time_scale = real_number("time_scale", time_scale, least=0)
        self.limits = [
            np.inf if value is None else real_number(name, value, above=0)
            for name, value in (("displacement_limit [m]", displacement_limit), ("force_limit [N]", force_limit))
        ]
        self.data_size = whole_number("data_size", data_size, least_data_size(len(self.places)))
        self.system: StateSpace = state_space(structure, ())
        self.directions = np.zeros((len(self.places), structure.dofs))
        for row, place in enumerate(self.places):
            for dof, factor in rows_at(structure, place):
                self.directions[row, dof] = factor
        highest = np.sqrt(np.linalg.eigvals(np.linalg.solve(self.system.mass, self.system.stiffness)).real.max())
        if highest * self.step >= LARGEST_STEP:
            raise ValueError(
                f"step={self.step:g} s is not stable: the highest circular frequency of the computed part is "
                f"{highest:.4g} rad/s, so that the step must be below {LARGEST_STEP / highest:.3g} s"
            )

    def run(self, motion: GroundMotion, *, duration: float | None = None) -> xr.Dataset:
        """Run the test under a ground motion, from rest, and return the response.

        Args:
            motion: The ground motion; it is linear between its samples, and 0 after its end.
            duration: Duration of the test [s]; None: that of the motion.

        Returns:
            Dataset along `time` with displacements, velocities, accelerations, the displacements sent, the forces
            measured and the times of the exchanges. Attributes: `method`, `missed_deadlines`, `longest_exchange` [s].

        Raises:
            HybridTestError: If the connection fails or is lost, an answer is late by more than the timeout, a force or
                displacement is not finite, or a limit is exceeded. Its attribute `result` contains the completed steps.
        """
        check_kind("run", "a GroundMotion", motion, GroundMotion)
        length = motion.step * (motion.values.size - 1)
        end = length if duration is None else real_number("duration [s]", duration, above=0)
        steps = round(end / self.step)
        times = self.step * np.arange(steps + 1)
        ground = np.interp(times, motion.step * np.arange(motion.values.size), motion.values, right=0.0)
        record = _Record(self, times)
        link = self._connected(record)
        with link:
            try:
                self._integrate(link, ground, record)
            finally:
                self._end(link)
        found = record.dataset(steps + 1)
        if record.missed:
            warn_caller(
                f"{record.missed} of {steps} deadlines were missed; the longest exchange took "
                f"{record.longest:.3g} s, and a step lasts {self.step * self.time_scale:.3g} s: give a longer step, or "
                "a larger time_scale"
            )
        return found

    def _connected(self, record: _Record) -> socket.socket:
        try:
            link = socket.create_connection(self.address, timeout=self.timeout)
        except OSError as error:
            host, port = self.address
            record.fail(
                f"no connection to the substructure at {host}:{port} ({error}): start the substructure before the "
                "test, and check address="
            )
        try:
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            link.settimeout(self.timeout)
            send_header(link, len(self.places), self.data_size)
        except OSError as error:
            link.close()
            record.fail(f"the connection to the substructure was lost before the first step ({error})")
        return link

    def _end(self, link: socket.socket) -> None:
        with contextlib.suppress(OSError):  # if the connection is lost already, another error reports it
            send_values(link, np.array([float(Action.END)]), self.data_size)

    def _integrate(self, link: socket.socket, ground: np.ndarray, record: _Record) -> None:
        system, step, rows = self.system, self.step, self.directions
        pull = -system.mass @ system.ground[len(system.mass) :]  # force per unit base acceleration, times -1
        solved = np.linalg.inv(system.mass + step / 2 * system.damping)
        displacement, velocity = (np.zeros(self.structure.dofs) for _ in range(2))
        start = time.perf_counter()
        force, passed = self._exchange(link, 0, np.zeros((3, len(rows))), record)
        resisting = rows.T @ force + system.stiffness @ displacement + system.damping @ velocity
        acceleration = np.linalg.solve(system.mass, -pull * ground[0] - resisting)
        record.add(0, displacement, velocity, acceleration, rows @ displacement, force, passed)
        for place in range(1, len(ground)):
            displacement = displacement + step * velocity + step**2 / 2 * acceleration
            predicted = velocity + step / 2 * acceleration
            sent = rows @ np.stack([displacement, predicted, acceleration], axis=1)
            force, passed = self._exchange(link, place, sent.T, record)
            resisting = rows.T @ force + system.stiffness @ displacement + system.damping @ predicted
            acceleration = solved @ (-pull * ground[place] - resisting)
            velocity = predicted + step / 2 * acceleration
            record.add(place, displacement, velocity, acceleration, sent[:, 0], force, passed)
            if self.time_scale > 0:
                due = start + place * step * self.time_scale
                late = time.perf_counter() - due
                record.missed += late > 0
                if late < 0:
                    time.sleep(-late)

    def _exchange(self, link: socket.socket, place: int, sent: np.ndarray, record: _Record) -> tuple[np.ndarray, float]:
        """Send displacements, velocities and accelerations; return the measured forces and the time it took [s]."""
        if not np.isfinite(sent).all():
            record.fail(
                "the motion of an interface is not finite, so that it was not sent: the test is unstable. Give a "
                "displacement_limit, and a shorter step",
                place,
            )
        largest = np.abs(sent[0]).max()
        if largest > self.limits[0]:
            record.fail(
                f"the displacement at an interface would be {largest:.4g} m, beyond displacement_limit="
                f"{self.limits[0]:g} m: it was not sent",
                place,
            )
        begun = time.perf_counter()
        try:
            request = np.concatenate([[float(Action.SET_TRIAL)], sent.ravel(), [place * self.step]])
            send_values(link, request, self.data_size)
            send_values(link, np.array([float(Action.GET_FORCE)]), self.data_size)
            force = receive_values(link, self.data_size)[: len(self.places)].copy()
            passed = time.perf_counter() - begun
            send_values(link, np.array([float(Action.COMMIT)]), self.data_size)
        except TimeoutError:
            record.fail(
                f"the substructure did not answer within timeout={self.timeout:g} s: it hangs, or the message size "
                "differs (data_size=)",
                place,
            )
        except OSError as error:
            record.fail(f"the connection to the substructure was lost ({error})", place)
        if not np.isfinite(force).all():
            record.fail(f"the substructure returned a force that is not finite ({force})", place)
        if np.abs(force).max() > self.limits[1]:
            record.fail(f"the force {np.abs(force).max():.4g} N is beyond force_limit={self.limits[1]:g} N", place)
        return force, passed


class _Record:
    """The histories of a hybrid test."""

    def __init__(self, test: HybridTest, times: np.ndarray) -> None:
        self.test, self.times, self.missed, self.done = test, times, 0, 0
        widths = {"dof": test.structure.dofs, "interface": len(test.places), None: 1}
        self.values = {name: np.full((times.size, widths[row[0]]), np.nan) for name, row in VARIABLES.items()}

    @property
    def longest(self) -> float:
        """Longest time of an exchange [s]."""
        taken = self.values["exchange_time"][: self.done]
        return float(taken.max()) if taken.size else 0.0

    def add(self, place: int, *values: Any) -> None:
        """Add the values of a step, in the order of VARIABLES."""
        for row, value in zip(self.values.values(), values, strict=True):
            row[place] = value
        self.done = place + 1

    def fail(self, reason: str, place: int | None = None) -> NoReturn:
        """Raise the error that ends the test, with the completed steps."""
        at = "" if place is None else f"step {place} of {self.times.size - 1} (t = {self.times[place]:.6g} s): "
        after = "" if place is None else "; error.result contains the completed steps"
        raise HybridTestError(f"{at}{reason}{after}", self.dataset(self.done))

    def dataset(self, count: int) -> xr.Dataset:
        """Return the dataset of the first `count` times."""
        numbered = self.test.structure.numbered(())
        variables: dict[str, Any] = {}
        for name, (dim, units, text) in VARIABLES.items():
            values = self.values[name][:count]
            described = {"units": units, "long_name": text}
            variables[name] = ("time", values[:, 0], described) if dim is None else (("time", dim), values, described)
        attributes = {
            **trace("warpdyn hybrid test", "HybridTest.run"),
            "method": METHOD,
            "step": self.test.step,
            "time_scale": self.test.time_scale,
            "missed_deadlines": int(self.missed),
            "longest_exchange": self.longest,
        }
        coordinates: dict[str, Any] = {"time": ("time", self.times[:count], {"units": "s", "long_name": "time"})}
        if "dof" in numbered:
            coordinates["dof"] = numbered["dof"]
        return xr.Dataset(variables, coordinates, attributes)
