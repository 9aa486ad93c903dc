"""The variables that a run can record: each recorder, the variables it fills, and their labels in the dataset.

Demands are evaluated at every step, not between steps; forces and accelerations are those of the equation of motion.
"""

from __future__ import annotations

from dataclasses import dataclass

# Value of the attribute `design` of im_level for stripes; other designs have another value.
STRIPED = "stripes"

# Values of the status variable, with their flag_meanings.
STATUS_MEANINGS = ("ok", "collapsed", "diverged", "unstable_step", "not_converged")
# A drift beyond this many storey heights is a numerical blow-up that has not become infinite yet, not a collapse.
LARGEST_DRIFT_RATIO = 1e3
OK, COLLAPSED, DIVERGED, UNSTABLE_STEP, NOT_CONVERGED = range(5)


@dataclass(frozen=True)
class Variable:
    """One variable of a dataset.

    Args:
        dims: Its dimension beside `sample`: (), ("storey",), ("floor",) or ("dof",).
        units: UDUNITS string.
        long_name: In words.
        scale: Other variables of the dataset that its error is divided by where they are larger.
        is_demand: Whether it is a demand, whose error is estimated.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    scale: tuple[str, ...] = ()
    is_demand: bool = True


ENERGY = {
    "input_energy": Variable((), "J", "energy put in by the load"),
    "viscous_energy": Variable(
        (), "J", "energy dissipated by viscous damping", scale=("input_energy", "viscous_energy")
    ),
    "energy_balance_error": Variable((), "1", "unaccounted energy over the largest energy supplied", is_demand=False),
}

# Family -> recorder -> the kernel's outputs, named as the dataset names them.
RECORDERS: dict[str, dict[str, dict[str, Variable]]] = {
    "chain": {
        "drift": {
            "peak_storey_drift": Variable(("storey",), "m", "peak absolute storey drift"),
            "storey_of_peak_drift": Variable((), "1", "storey of the largest storey drift ratio", is_demand=False),
        },
        "time_of_peak": {
            "time_of_peak_drift": Variable((), "s", "time of the largest storey drift ratio", is_demand=False),
        },
        "acceleration": {
            "peak_floor_acceleration": Variable(("floor",), "m s-2", "peak absolute floor acceleration"),
        },
        "base_shear": {"peak_base_shear": Variable((), "N", "peak restoring force of the first storey")},
        "residual": {
            "residual_drift_ratio": Variable(
                ("storey",),
                "1",
                "storey drift ratio, Hann-weighted mean over the end of the run",
                scale=("peak_storey_drift_ratio",),
            ),
        },
        "energy": {
            **ENERGY,
            "hysteretic_energy": Variable(
                ("storey",),
                "J",
                "energy dissipated by the storey's hysteresis",
                scale=("input_energy", "viscous_energy"),
            ),
        },
    },
    "dense": {
        "displacement": {
            "peak_displacement": Variable(("dof",), "m", "peak absolute displacement relative to the base"),
            "time_of_peak_displacement": Variable(("dof",), "s", "time of the peak displacement", is_demand=False),
        },
        "acceleration": {
            "peak_acceleration": Variable(("dof",), "m s-2", "peak absolute acceleration"),
        },
        "energy": ENERGY,
    },
}

# Variables that an adaptive method adds for each sample.
ADAPTIVE = {
    "accepted_steps": Variable((), "1", "integration steps taken"),
    "rejected_steps": Variable((), "1", "integration steps tried and found too long"),
}

# The recorder of the final state, from which the next event of a sequence starts; it is not in the dataset.
STATE = "state"

# Variables of a whole history, named as in the kernels' History struct.
HISTORY = {
    "displacement": Variable(("dof",), "m", "displacement relative to the base"),
    "velocity": Variable(("dof",), "m s-1", "velocity relative to the base"),
    "acceleration": Variable(("dof",), "m s-2", "absolute acceleration"),
    "storey_force": Variable(("storey",), "N", "storey restoring force"),
}


def recorded(family: str, recorders: tuple[str, ...], is_adaptive: bool) -> dict[str, Variable]:
    """Return the variables that some recorders fill, by name, with those that an adaptive method adds."""
    variables = {
        name: variable for row in recorders if row != STATE for name, variable in RECORDERS[family][row].items()
    }
    return variables | (ADAPTIVE if is_adaptive else {})
