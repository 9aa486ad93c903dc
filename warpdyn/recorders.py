"""What is kept of a run, as data: each recorder, the variables it fills and how the dataset labels them.

Demands are seen at every step, not between; forces and accelerations as the equation of motion has them there.
"""

from __future__ import annotations

from dataclasses import dataclass

# What the attribute `design` of im_level says of stripes; of other designs it says something else.
STRIPED = "stripes"

# Values of the status variable, with their flag_meanings.
STATUS_MEANINGS = ("ok", "collapsed", "diverged", "unstable_step")
OK, COLLAPSED, DIVERGED, UNSTABLE_STEP = range(4)


@dataclass(frozen=True)
class Variable:
    """One variable of a dataset.

    Args:
        dims: Its dimension beside `sample`: (), ("storey",), ("floor",) or ("dof",).
        units: UDUNITS string.
        long_name: In words.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str


ENERGY = {
    "input_energy": Variable((), "J", "energy put in by the load"),
    "viscous_energy": Variable((), "J", "energy dissipated by viscous damping"),
    "energy_balance_error": Variable((), "1", "unaccounted energy over the largest energy supplied"),
}

# Family -> recorder -> the kernel's outputs, named as the dataset names them.
RECORDERS: dict[str, dict[str, dict[str, Variable]]] = {
    "chain": {
        "drift": {
            "peak_storey_drift": Variable(("storey",), "m", "peak absolute storey drift"),
            "time_of_peak_drift": Variable((), "s", "time of the largest storey drift ratio"),
            "storey_of_peak_drift": Variable((), "1", "storey of the largest storey drift ratio"),
        },
        "acceleration": {
            "peak_floor_acceleration": Variable(("floor",), "m s-2", "peak absolute floor acceleration"),
        },
        "base_shear": {"peak_base_shear": Variable((), "N", "peak restoring force of the first storey")},
        "residual": {
            "residual_drift_ratio": Variable(
                ("storey",), "1", "storey drift ratio, Hann-weighted mean over the end of the run"
            ),
        },
        "energy": {
            **ENERGY,
            "hysteretic_energy": Variable(("storey",), "J", "energy dissipated by the storey's hysteresis"),
        },
    },
    "dense": {
        "displacement": {
            "peak_displacement": Variable(("dof",), "m", "peak absolute displacement relative to the base"),
            "time_of_peak_displacement": Variable(("dof",), "s", "time of the peak displacement"),
        },
        "acceleration": {
            "peak_acceleration": Variable(("dof",), "m s-2", "peak absolute acceleration"),
        },
        "energy": ENERGY,
    },
}

# What a whole history holds, named as the kernels' History struct names it.
HISTORY = {
    "displacement": Variable(("dof",), "m", "displacement relative to the base"),
    "velocity": Variable(("dof",), "m s-1", "velocity relative to the base"),
    "acceleration": Variable(("dof",), "m s-2", "absolute acceleration"),
    "storey_force": Variable(("storey",), "N", "storey restoring force"),
}
