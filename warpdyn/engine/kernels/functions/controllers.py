"""The struct of measured values that a controller receives, and the device function of a controller."""

# No `from __future__ import annotations`: Warp needs the types of annotations, not their text.

import functools
from typing import Any

import warp as wp

from warpdyn.engine.controllers.rules import OF_DOFS
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.laws.written.device_functions import built_functions
from warpdyn.engine.laws.written.measured import MEASURED
from warpdyn.engine.laws.written.source import Written


@functools.cache
def measured_struct(dofs: int, dtype: str) -> Any:
    """Return the Warp struct of measured values for a number of degrees of freedom: the names of MEASURED."""
    scalar = DTYPES[dtype]
    vector = wp.types.vector(length=dofs, dtype=scalar)
    types = {name: vector if name in OF_DOFS else scalar for name in MEASURED}
    return wp.struct(type(f"Measured_{dofs}_{dtype}", (), {"__annotations__": types, "__module__": __name__}))


@functools.cache
def measured_function(dofs: int, sensors: int, actuators: int, dtype: str) -> wp.Function:
    """Return the Warp function that collects the measured values of an actuator in the struct of `measured_struct`.

    Args:
        dofs: Number of degrees of freedom.
        sensors: Number of kinds of sensors of degrees of freedom: 2, or 3 with accelerations.
        actuators: Number of actuators.
        dtype: Number type of the kernel.
    """
    Values = measured_struct(dofs, dtype)
    scalar = DTYPES[dtype]
    Sensed = wp.types.vector(length=sensors * dofs + actuators, dtype=scalar)
    N, OF_DOFS_ALL, HAS_ACCELERATION = dofs, sensors * dofs, sensors == len(OF_DOFS)

    def measured_of(
        time: scalar,
        desired: scalar,
        drift: scalar,
        rate: scalar,
        upper_velocity: scalar,
        ground_velocity: scalar,
        actuator: int,
        sensed: Sensed,
    ):
        values = Values()
        values.time = time
        values.desired = desired
        values.drift = drift
        values.rate = rate
        values.upper_velocity = upper_velocity
        values.ground_velocity = ground_velocity
        values.force = sensed[OF_DOFS_ALL + actuator]
        for k in range(N):
            values.displacement[k] = sensed[k]
            values.velocity[k] = sensed[N + k]
            if wp.static(HAS_ACCELERATION):
                values.acceleration[k] = sensed[2 * N + k]
        return values

    measured_of.__qualname__ = f"measured_of_{dofs}_{sensors}_{actuators}_{dtype}"
    return wp.func(measured_of)


@functools.cache
def command_function(written: Written) -> wp.Function:
    """Return the Warp function that computes the command of an actuator."""
    return built_functions(f"controller_{written.digest}", written)["command"]
