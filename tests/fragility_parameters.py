"""Fragility curves by their parameters, in the form in which `fragility` returns them."""

import numpy as np
import xarray as xr


def curves(states, replicates=None, units="g", measure=""):
    """Return curves of damage states, `{name: (median, dispersion)}`, with bootstrap replicates where they are given.

    Args:
        states: Median [units] and dispersion of each damage state.
        replicates: Medians and dispersions, each of shape [replicate, damage_state].
        units: Units of the medians.
        measure: Name of the intensity measure.
    """
    median, dispersion = np.array(list(states.values()), dtype=float).T
    variables = {
        "fragility_median": ("damage_state", median, {"units": units}),
        "fragility_dispersion": ("damage_state", dispersion),
    }
    if replicates is not None:
        along = "replicate", "damage_state"
        variables |= {"replicate_median": (along, replicates[0]), "replicate_dispersion": (along, replicates[1])}
    return xr.Dataset(variables, {"damage_state": list(states)}, {"intensity_measure": measure})
