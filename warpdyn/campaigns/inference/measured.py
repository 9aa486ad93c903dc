"""Measurements: force-displacement loops and response histories, checked when they are given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.foundations.core.checks import finite_numbers, one_of, real_number, whole_number
from warpdyn.foundations.core.description import fingerprint
from warpdyn.foundations.core.frozen_values import FrozenArrays
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.files.packaged import packaged_rows

FEWEST_POINTS = 3  # of a measurement
# Quantities of a response history: units, and the name of the units in messages.
QUANTITIES = {"acceleration": "m s-2", "velocity": "m s-1", "displacement": "m", "storey_force": "N"}


def _measured_row(name: str, values: ArrayLike, units: str) -> np.ndarray:
    row = finite_numbers(name, values, units)
    if row.ndim != 1 or row.size < FEWEST_POINTS:
        raise ValueError(f"{name} must be a row of at least {FEWEST_POINTS} values, got shape {row.shape}")
    row.flags.writeable = False
    return row


def _check_first(first: int, count: int) -> int:
    if (number := whole_number("first", first, 0)) > count - FEWEST_POINTS:
        raise ValueError(
            f"first is {number}, but the measurement has {count} points, so that fewer than {FEWEST_POINTS} would "
            "count: give a smaller first"
        )
    return number


@with_suggestions
@dataclass(frozen=True, eq=False)
class MeasuredLoop(FrozenArrays):
    """A measured force-displacement loop (hysteresis loop) of a cyclic test.

    Args:
        drift: Drift of the storey or specimen [m], shape [point], in the order of the test. The specimen is undeformed
            and without force at a drift of 0, and the drift changes linearly from 0 to the first point, and from point
            to point, so that the points must contain the reversals.
        force: Force [N], shape [point].
        velocity: Velocity [m/s], shape [point], for a storey with a viscous damper; None: slow test.
        first: Index of the first point that counts. Earlier points are part of the path only: give the end of the
            first cycle, if the specimen was deformed before the test.

    Raises:
        ValueError: If a value is not finite, the lengths differ, there are fewer than 3 points, or the drift or the
            force is constant.

    Example:
        >>> loop = wd.MeasuredLoop([0.0, 0.01, 0.0, -0.01, 0.0], [0.0, 2e5, -1e5, -2e5, 1e5])
        >>> loop
        MeasuredLoop(5 points, drift to 0.01 m, force to 2e+05 N)
    """

    drift: Any
    force: Any
    velocity: Any = None
    first: int = 0

    def __post_init__(self) -> None:
        drift, force = (
            _measured_row("MeasuredLoop.drift", self.drift, "m"),
            _measured_row("MeasuredLoop.force", self.force, "N"),
        )
        rows = {"force": force}
        if self.velocity is not None:
            rows["velocity"] = _measured_row("MeasuredLoop.velocity", self.velocity, "m s-1")
            object.__setattr__(self, "velocity", rows["velocity"])
        for name, values in rows.items():
            if values.size != drift.size:
                raise ValueError(
                    f"MeasuredLoop.{name} has {values.size} values and drift has {drift.size}: give one {name} "
                    "per drift"
                )
        for name, values in {"drift": drift, "force": force}.items():
            if np.ptp(values) == 0:
                raise ValueError(
                    f"MeasuredLoop.{name} is {values[0]:g} at every point: a loop needs values that change"
                )
        object.__setattr__(self, "drift", drift)
        object.__setattr__(self, "force", force)
        object.__setattr__(self, "first", _check_first(self.first, drift.size))

    @classmethod
    def example(cls) -> MeasuredLoop:
        """Return the loop of a cyclic test of a reinforced-concrete column, 548 points.

        Cantilever of 1.6 m, section 0.4 m x 0.4 m, axial load 744 kN. Source: Soesianawati, Park and Priestley (1986),
        University of Canterbury, report 86-10; PEER Structural Performance Database, as in SimCenter's quoFEM.

        Example:
            >>> wd.MeasuredLoop.example()
            MeasuredLoop(548 points, drift to 0.0784 m, force to 2e+05 N)
        """
        table = np.array([[float(each) for each in row.values()] for row in packaged_rows("measured_column.csv")])
        return cls(table[:, 0], 1e3 * table[:, 1], first=1)  # the first point is that at rest

    def __repr__(self) -> str:
        drift, force = np.abs(self.drift).max(), np.abs(self.force).max()
        return f"MeasuredLoop({self.drift.size} points, drift to {drift:.3g} m, force to {force:.3g} N)"

    @property
    def identity(self) -> str:
        """Text that differs for measurements whose values, path or first point differ."""
        hashed = fingerprint(self.drift, self.force[self.first :], self.velocity)[:16]
        return f"{self!r} from point {self.first}, digest {hashed}"

    @property
    def units(self) -> str:
        """Units of the measured values."""
        return "N"

    @property
    def channels(self) -> int:
        """Number of measured rows: 1, the force."""
        return 1


@with_suggestions
@dataclass(frozen=True, eq=False)
class MeasuredResponse(FrozenArrays):
    """Measured response histories of floors, such as the records of accelerometers.

    Args:
        values: Measured values [units of the quantity, SI], shape [time, sensor], or [time] of a single sensor. The
            first value belongs to time 0, the start of the excitation.
        step: Sampling step [s].
        quantity: "acceleration" (absolute, as accelerometers measure it), "velocity" or "displacement" (relative to the
            base), or "storey_force".
        floors: Floor of each sensor, counted from 1 (degrees of freedom of a LumpedStructure; storeys for
            "storey_force"); None: sensor i is on floor i, with a sensor on every floor.
        first: Index of the first time that counts.

    Raises:
        ValueError: If a value is not finite, the step is not above 0, a floor is below 1 or occurs twice, or the
            numbers of sensors and floors differ.
        TypeError: If `floors` is not a list.

    Example:
        >>> wd.MeasuredResponse(np.sin(np.arange(500) / 10), step=0.02, floors=[2])
        MeasuredResponse(acceleration of floors 2, 500 times every 0.02 s)
    """

    values: Any
    step: float
    quantity: str = "acceleration"
    floors: Sequence[int] | None = None
    first: int = 0
    is_on_all_floors: bool = field(default=False, init=False, repr=False)

    def __post_init__(self) -> None:
        one_of("quantity", self.quantity, QUANTITIES)
        values = finite_numbers("MeasuredResponse.values", self.values, QUANTITIES[self.quantity])
        values = values[:, None] if values.ndim == 1 else values
        if values.ndim != 2 or len(values) < FEWEST_POINTS or not values.shape[1]:
            raise ValueError(
                f"MeasuredResponse.values must have shape [time, sensor] with at least {FEWEST_POINTS} times, "
                f"got shape {np.shape(self.values)}"
            )
        sensors = values.shape[1]
        object.__setattr__(self, "is_on_all_floors", self.floors is None)
        floors = range(1, sensors + 1) if self.floors is None else self.floors
        if not isinstance(floors, list | tuple | range | np.ndarray):
            raise TypeError(f"floors must be a list of floors, such as [1, 3], got {floors!r}")
        places = tuple(whole_number("floors", each, 1) for each in floors)
        if len(places) != sensors:
            raise ValueError(
                f"floors names {len(places)} floors, but values has {sensors} columns: give the floor of each column"
            )
        if len(set(places)) < len(places):
            raise ValueError(f"floors names a floor twice: {list(places)}. Remove one of the columns, or average them")
        values.flags.writeable = False
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "floors", places)
        object.__setattr__(self, "step", real_number("MeasuredResponse.step [s]", self.step, above=0))
        object.__setattr__(self, "first", _check_first(self.first, len(values)))

    def __repr__(self) -> str:
        floors = ", ".join(map(str, self.floors or ()))
        return f"MeasuredResponse({self.quantity} of floors {floors}, {len(self.values)} times every {self.step:g} s)"

    @property
    def identity(self) -> str:
        """Text that differs for measurements whose values, sensors, step or first time differ."""
        hashed = fingerprint(self.values[self.first :], self.floors, self.quantity, self.step)[:16]
        return f"{self!r} from time {self.first}, digest {hashed}"

    @property
    def units(self) -> str:
        """Units of the measured values."""
        return QUANTITIES[self.quantity]

    @property
    def channels(self) -> int:
        """Number of sensors."""
        return int(self.values.shape[1])

    @property
    def places(self) -> np.ndarray:
        """Index of the floor of each sensor, counted from 0, shape [sensor]."""
        return np.array(self.floors) - 1
