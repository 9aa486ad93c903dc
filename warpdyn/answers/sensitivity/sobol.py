"""Sobol indices: shares of the variance of a demand or fragility median that are due to each random parameter."""

from __future__ import annotations

import warnings
from collections.abc import Mapping

import numpy as np
import xarray as xr
from scipy.special import ndtri

from warpdyn.answers.fragility.lognormal_fit import check_confidence
from warpdyn.answers.sensitivity.inputs import inputs_of
from warpdyn.answers.sensitivity.structure_outputs import outputs_of
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.reductions.limits import DRIFT, Limit
from warpdyn.campaigns.running.simulate import simulate
from warpdyn.foundations.core.checks import check_memory, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.random_numbers import Purpose
from warpdyn.model.scene.scene import Scene
from warpdyn.model.scene.sobol_points import SobolPoints

LEAST_BASE = 32  # fewer structures of each set give indices far outside 0 to 1
SAME = 1e-12  # outputs whose relative differences are smaller are equal except for rounding
RESAMPLES = 999  # bootstrap replicates of an interval
LEAST_POINT = 2.0**-54  # a point at exactly 0 would give an infinite normal value


@suggests_names
def sobol_indices(
    scene: Scene,
    *,
    demand: str = DRIFT,
    limits: Mapping[str, Limit] | None = None,
    base_structures: int = 512,
    confidence: float = 0.95,
    seed: int = 0,
    integration: Integration | None = None,
    execution: Execution | None = None,
) -> xr.Dataset:
    """Run a scene and return the first-order and total Sobol indices of its random parameters.

    The first-order index of a parameter is the share of the variance of the output that the parameter explains alone;
    the total index also includes its interactions with other parameters. The output of a structure is its mean demand
    over all motions, at each level, or, with `limits`, its fragility median for each damage state. Records are fixed:
    their variability is not part of the variance.

    A parameter with `per="storey"` and without storey correlation is one input per storey; with storey correlation it
    is one input. The scene is run for two sets A and B of `base_structures` structures from one Sobol sequence, and for
    A with one input from B at a time: base_structures * (inputs + 2) structures, each under every motion.

    Sources: Saltelli et al. (2010), "Variance based sensitivity analysis of model output", Computer Physics
    Communications 181 (first-order estimator, design); Jansen (1999), Computer Physics Communications 117 (total
    index); as implemented in scipy.stats.sobol_indices. Intervals: bias-corrected and
    accelerated (BCa) bootstrap over the base structures.

    Args:
        scene: The scene: one structure with random parameters, under a Cloud, Stripes or one motion.
        demand: Name of the demand; the worst storey or floor counts.
        limits: Limit of each damage state, from the lightest to the heaviest [units of the demand], for the indices of
            fragility medians; the scene needs Stripes. None: indices of the demand.
        base_structures: Number of structures of each set, a power of 2, at least 32.
        confidence: Probability that the intervals cover the true value [1].
        seed: Seed of the Sobol sequence and of the bootstrap.
        integration: How samples are integrated; None: the defaults of `simulate`.
        execution: Where samples are integrated; None: the defaults of `simulate`.

    Returns:
        `first_order(input)` and `total(input)` [1], each with `_lower` and `_upper`, and with the dimension `stripe`
        for a demand on stripes or `damage_state` for medians; `output_mean` and `output_deviation`, mean and standard
        deviation of the output over structures [units of the demand, or of the intensity]. Sampling errors can make a
        small index negative. An input without any effect has indices and bounds of 0.

    Raises:
        TypeError: If `scene` is not a Scene of one structure under a Cloud, Stripes or one motion.
        ValueError: If parameters are correlated or given, no parameter is random, `base_structures` is below 32 or not
            a power of 2, the output is the same for all structures, samples failed, samples collapsed and `limits` is
            None, or a structure has no fragility curve.

    Example:
        >>> shares = wd.sobol_indices(scene, base_structures=32, seed=1)
        >>> shares["total"].sel(input="yield_force", stripe=1.4).round(1).item()  # the only random parameter
        1.0
    """
    check_confidence(confidence)
    seed, count = whole_number("seed", seed, 0), whole_number("base_structures", base_structures, LEAST_BASE)
    if count & (count - 1):
        down = 2 ** (count.bit_length() - 1)
        raise ValueError(
            f"base_structures must be a power of 2, because a Sobol sequence is balanced only then, got {count}: give "
            f"{down} or {2 * down}"
        )
    inputs = inputs_of("sobol_indices", scene)
    from scipy import stats  # its import takes 0.3 s

    variables, structures = inputs.variables, count * (len(inputs.names) + 2)
    check_memory(f"sobol_indices of {structures:,} structures", 32.0 * variables * structures, "reduce base_structures")
    sequence = SobolPoints(2 * variables, np.random.default_rng([seed, Purpose.POINTS]), count)
    points = sequence.at(np.arange(count))
    normals = ndtri(np.clip(points.T, LEAST_POINT, 1 - 2.0**-53))
    first, second = normals[:variables], normals[variables:]
    mixed = []
    for rows in inputs.rows:
        mixed.append(first.copy())
        mixed[-1][rows] = second[rows]
    given = inputs.scene_of(inputs.factor @ np.concatenate([first, second, *mixed], axis=1))
    run = simulate(given, seed=seed, integration=integration, execution=execution)
    outputs = outputs_of("sobol_indices", run, demand, limits)
    values = outputs.values.reshape(len(inputs.names) + 2, count, -1)
    deviation = values[:2].reshape(2 * count, -1).std(axis=0)
    constant = np.ptp(values[:2], axis=(0, 1)) <= SAME * np.abs(values[:2]).max(axis=(0, 1))
    if constant.any():
        raise ValueError(
            f"sobol_indices: the output{outputs.named(int(constant.argmax()))} is the same for all structures, so "
            "that it has no variance: check the scatter and the demand"
        )
    of_parts = {"f_A": values[0].T, "f_B": values[1].T, "f_AB": np.moveaxis(values[2:], -1, 1)}
    found = stats.sobol_indices(func=of_parts, n=count, rng=np.random.default_rng([seed, Purpose.POINTS, 1]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of inputs without effect, whose resamples are all 0
        spread = found.bootstrap(confidence_level=confidence, n_resamples=RESAMPLES)
    has_no_effect = (values[2:] == values[0]).all(axis=1).T  # shape [output, input]
    shape = (values.shape[-1], len(inputs.names))
    unknown = np.isnan(np.reshape(spread.total_order.confidence_interval.low, shape)) & ~has_no_effect
    if unknown.any():
        which = ", ".join(repr(name) for name, each in zip(inputs.names, unknown.any(axis=0), strict=True) if each)
        warn_caller(
            f"sobol_indices: the bootstrap found no interval of {which}, whose effect occurs in few structures: give "
            f"base_structures={2 * count}"
        )
    result = {}
    for name, attribute, words in (
        ("first_order", "first_order", "first-order Sobol index"),
        ("total", "total_order", "total Sobol index"),
    ):
        interval = getattr(spread, attribute).confidence_interval
        for suffix, each, end in (
            ("", getattr(found, attribute), ""),
            ("_lower", np.where(has_no_effect, 0.0, np.reshape(interval.low, shape)), ", lower bound"),
            ("_upper", np.where(has_no_effect, 0.0, np.reshape(interval.high, shape)), ", upper bound"),
        ):
            result[name + suffix] = outputs.dataset_of(np.reshape(each, shape).T, "input", name=words + end)
    of_output = {"units": outputs.attributes["units"]}
    name = outputs.attributes["long_name"]
    result |= {
        "output_mean": outputs.dataset_of(
            values[:2].reshape(2 * count, -1).mean(axis=0), name=f"mean over structures of the {name}", **of_output
        ),
        "output_deviation": outputs.dataset_of(
            deviation, name=f"standard deviation over structures of the {name}", **of_output
        ),
    }
    return xr.Dataset(
        result,
        {"input": ("input", np.array(inputs.names), {"long_name": "random parameter"}), **outputs.coordinates},
        {
            "analysis": "sobol_indices",
            "demand": demand,
            "base_structures": count,
            "structures": structures,
            "confidence": float(confidence),
            "seed": seed,
            "interval_method": "BCa bootstrap over base structures; records are fixed",
        },
    )
