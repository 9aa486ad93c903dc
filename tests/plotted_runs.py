"""A run on stripes as `simulate` returns it, made by hand: its drifts and collapses are known."""

import numpy as np
import xarray as xr

from warpdyn.foundations.core.output_variables import STATUS_MEANINGS

LEVELS = np.array([0.2, 0.4, 0.8, 1.6])
CAPACITY = 0.1  # drift ratio at which samples collapse
# Of 10 motions: how many collapse at each level. The median is undefined at the last, the 84 % fractile at the third.
COLLAPSES = (0, 1, 5, 6)
MOTIONS = 10
STOREYS = 3


def found_capacities() -> xr.Dataset:
    """Return capacities of 1 structure under 3 motions, which pass the limits 1 and 2 % at levels in proportion.

    The last motion collapses between the limits of its curve, and the first is not brought to collapse.
    """
    capacity = np.array([[[0.5, 1.0, np.inf], [1.0, 2.0, 2.5], [1.5, 1.9, 1.9]]])
    motion, level = np.repeat(np.arange(3), 4), np.array([0.25, 0.5, 1, 4, 0.5, 1, 2, 2.6, 0.75, 1.5, 1.8, 2.0])
    drift = np.array([0.005, 0.01, 0.02, 0.06, 0.005, 0.01, 0.02, np.nan, 0.005, 0.01, 0.018, np.nan])
    dims = ("structure", "motion", "damage_state")
    return xr.Dataset(
        {
            "capacity": (dims, capacity, {"units": "g"}),
            "damage_limit": ("damage_state", [0.01, 0.02, np.inf], {"demand": "peak_storey_drift_ratio", "units": "1"}),
            "im_level": ("sample", level, {"units": "g"}),
            "peak_storey_drift_ratio": ("sample", drift),
            "status": ("sample", np.isnan(drift).astype(np.int8)),
            "structure_index": ("sample", 0 * motion),
            "motion_index": ("sample", motion),
        },
        {"damage_state": ["slight", "extensive", "collapse"]},
        {"intensity_measure": "PGA"},
    )


def striped_run() -> xr.Dataset:
    """Return the run: motion m drifts by (m + 1) % of the level in g in its first storey, less in those above."""
    motion, level = np.repeat(np.arange(MOTIONS), LEVELS.size), np.tile(LEVELS, MOTIONS)
    collapsed = motion >= MOTIONS - np.tile(COLLAPSES, MOTIONS)
    drift = np.minimum(0.01 * (motion + 1) * level, 0.9 * CAPACITY)
    drift[collapsed] = CAPACITY
    ratio = drift[:, None] * np.array([1.0, 0.6, 0.3])
    residual = np.where(collapsed[:, None], np.nan, -0.1 * ratio)
    codes = {"flag_values": np.arange(len(STATUS_MEANINGS)), "flag_meanings": " ".join(STATUS_MEANINGS)}
    im = {"long_name": "PGA of the scaled motion", "intensity_measure": "PGA", "units": "g", "design": "stripes"}
    time = np.linspace(0, 2, 201)
    displacement = 0.05 * np.sin(3 * time)[None, :, None] * np.array([1.0, 1.6, 1.9])
    displacement = np.repeat(displacement, 2, axis=0)
    displacement[1, 120:] = np.nan  # the last sample, which collapses at 1.195 s
    return xr.Dataset(
        {
            "status": ("sample", collapsed.astype(np.int8), codes),
            "integration_step": ("sample", np.full(motion.size, 0.01)),
            "peak_storey_drift_ratio": (("sample", "storey"), ratio),
            "residual_drift_ratio": (("sample", "storey"), residual),
            "time_of_collapse": ("sample", np.where(collapsed, 1.195, np.nan)),
            "storey_of_collapse": ("sample", np.where(collapsed, 1, -1)),
            "motion_name": ("motion", np.array([f"record {i}" for i in range(MOTIONS)])),
            "displacement": (("history", "time", "dof"), displacement),
            "storey_force": (("history", "time", "storey"), 1e7 * displacement),
        },
        {
            "sample": np.arange(motion.size),
            "storey": np.arange(1, STOREYS + 1),
            "time": time,
            "structure": ("sample", 0 * motion),
            "motion_index": ("sample", motion),
            "im_level": ("sample", level, im),
            "history_sample": ("history", [0, motion.size - 1]),
        },
        {"method": "rk4", "dtype": "float64", "device": "cpu", "seconds_integrating": 0.1},
    )
