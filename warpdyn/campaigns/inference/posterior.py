"""Datasets of posterior samples: their summary, their use as a scatter, and the comparison of models by evidence."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from warpdyn.campaigns.inference.resampling import family_variance, systematic
from warpdyn.foundations.core.checks import check_dataset, whole_number
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.scene.scatter import GivenValues

PARAMETERS = "calibrated_parameters"  # attribute with the names of the parameters of the structure
NOISE, OFFSET = "noise_standard_deviation", "sensor_offset"
QUANTILES = (0.05, 0.5, 0.95)
RELEVANT = 3.0  # difference of log evidences in standard errors, above which the order of models is certain


def summarised(
    columns: Mapping[str, np.ndarray], weights: np.ndarray, ancestors: np.ndarray | None
) -> dict[str, tuple]:
    """Return variables with mean, standard deviation, Monte Carlo error and quantiles of parameters.

    Args:
        columns: Values of each parameter, shape [sample].
        weights: Weights with sum 1, shape [sample].
        ancestors: First ancestor of each sample, for the Monte Carlo error; None: no error.
    """
    values = np.stack(list(columns.values()), axis=1)
    mean = weights @ values
    deviation = np.sqrt(weights @ np.square(values - mean))
    quantiles = weighted_quantiles(values, weights)
    found: dict[str, tuple] = {
        "posterior_mean": ("parameter", mean, {"long_name": "posterior mean, in the units of the parameter"}),
        "posterior_standard_deviation": (
            "parameter",
            deviation,
            {"long_name": "posterior standard deviation, in the units of the parameter"},
        ),
        "posterior_quantile": (
            ("quantile", "parameter"),
            quantiles,
            {"long_name": "posterior quantile, in the units of the parameter"},
        ),
    }
    if ancestors is not None:
        error = np.sqrt(family_variance(weights, ancestors, values))
        words = {"long_name": "Monte Carlo standard error of the posterior mean, in the units of the parameter"}
        found["posterior_mean_standard_error"] = ("parameter", error, words)
    return found


def weighted_quantiles(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the QUANTILES of values [sample, value] with weights of sum 1, shape [quantile, value]."""
    order = np.argsort(values, axis=0)
    sums, columns = np.cumsum(weights[order], axis=0), np.arange(values.shape[1])
    places = [np.minimum((sums < level).sum(axis=0), len(values) - 1) for level in QUANTILES]
    return np.stack([values[order[place, columns], columns] for place in places])


def flat_columns(values: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the values of each scalar parameter, shape [sample]: those of storey 2 are named "stiffness[2]"."""
    columns: dict[str, np.ndarray] = {}
    for name, each in values.items():
        if each.ndim == 1:
            columns[name] = each
            continue
        for place in range(each.shape[1]):
            if not np.isnan(each[:, place]).any():
                columns[f"{name}[{place + 1}]"] = each[:, place]
    return columns


@suggests_names
def posterior_scatter(posterior: xr.Dataset, *, structures: int | None = None, seed: int = 0) -> dict[str, GivenValues]:
    """Return posterior samples as the scatter of a scene, one structure per sample.

    Args:
        posterior: Result of `calibrate` or `assimilate`.
        structures: Number of structures, drawn by systematic resampling in a random order; None: all samples of
            `calibrate`, which have equal weights, or as many resampled samples of a weighted result.
        seed: Seed of the resampling.

    Returns:
        GivenValues of each calibrated parameter of the structure, by name. Noise and offsets of sensors are omitted.

    Raises:
        TypeError: If `posterior` is not a Dataset.
        ValueError: If the dataset has no calibrated parameters, or `structures` is larger than the number of samples.

    Example:
        >>> loop = wd.MeasuredLoop([0.0, 0.01, 0.0, -0.01, 0.0], [0.0, 2.1e5, -0.9e5, -2.1e5, 0.9e5])
        >>> priors = {"stiffness": wd.Lognormal(3e7, 0.3), "yield_force": wd.Lognormal(2e5, 0.3)}
        >>> law = wd.laws.Bilinear(yield_force=2e5, hardening_ratio=0.05)
        >>> posterior = wd.calibrate(law, loop, priors, noise=1e4, candidates=200)
        >>> wd.posterior_scatter(posterior, structures=50)
        {'stiffness': GivenValues(of 50 structures), 'yield_force': GivenValues(of 50 structures)}
    """
    check_dataset("posterior_scatter", posterior, "weight", PARAMETERS, advice="give the result of calibrate()")
    names = str(posterior.attrs[PARAMETERS]).split()
    weights = posterior["weight"].values
    wanted = weights.size if structures is None else whole_number("structures", structures, 1)
    if wanted > weights.size:
        raise ValueError(
            f"structures is {wanted}, but the posterior has {weights.size} samples, and repeated samples add nothing: "
            f"calibrate with candidates={wanted}, or give fewer structures"
        )
    rows = np.arange(weights.size)
    if structures is not None or np.ptp(weights) > 1e-12 * weights.max():
        random = np.random.default_rng(whole_number("seed", seed, 0))
        shuffled = random.permutation(weights.size)
        rows = shuffled[systematic(weights[shuffled], random.random(), wanted)]
    return {name: GivenValues(posterior[name].values[rows]) for name in names}


@suggests_names
def compare_evidence(posteriors: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Compare models, such as storey laws, by their evidence for the same measurement.

    The posterior probability of a model is its evidence divided by the sum of the evidences: all models have the same
    prior probability. The evidence depends on the priors: wider priors of the parameters reduce it.

    Source: Kass and Raftery (1995), "Bayes factors", Journal of the American Statistical Association 90.

    Args:
        posteriors: Results of `calibrate` for the same measurement, by the name of the model. Results of `assimilate`
            are refused, because their evidences have no estimate of the error.

    Returns:
        For each `model`, in the order of the evidence: `log_evidence` and `log_evidence_standard_error`,
        `log_bayes_factor` relative to the best model, its Monte Carlo standard error, and `probability` [1].

    Raises:
        TypeError: If `posteriors` is not a mapping of results.
        ValueError: If there are fewer than two models, their measurements differ, or a result is that of `assimilate`.

    Example:
        >>> loop = wd.MeasuredLoop([0.0, 0.01, 0.0, -0.01, 0.0], [0.0, 2.1e5, -0.9e5, -2.1e5, 0.9e5])
        >>> priors = {"stiffness": wd.Lognormal(3e7, 0.3)}
        >>> yielding = priors | {"yield_force": wd.Lognormal(2e5, 0.3), "hardening_ratio": 0.05}
        >>> found = wd.compare_evidence({
        ...     "elastic": wd.calibrate("elastic", loop, priors, noise=1e4, candidates=200),
        ...     "bilinear": wd.calibrate("bilinear", loop, yielding, noise=1e4, candidates=200),
        ... })
        >>> found["model"].values.tolist()
        ['bilinear', 'elastic']
    """
    if not isinstance(posteriors, Mapping):
        raise TypeError(
            "compare_evidence() takes results of calibrate() by name, such as {'bilinear': first, 'bouc_wen': second}, "
            f"got {type(posteriors).__name__}"
        )
    if len(posteriors) < 2:
        raise ValueError("compare_evidence() needs at least two models: the evidence of one model has no scale")
    for name, each in posteriors.items():
        check_dataset(
            "compare_evidence", each, "log_evidence", "measurement", advice="give results of calibrate()", argument=name
        )
        if each["log_evidence"].ndim:
            raise ValueError(
                f"compare_evidence: {name} is a result of assimilate(), whose evidence has no estimate of its error: "
                "give results of calibrate(), or subtract log_evidence.isel(time=-1) of two results for the same times"
            )
    measurements = {name: each.attrs["measurement"] for name, each in posteriors.items()}
    if len(set(measurements.values())) > 1:
        raise ValueError(
            f"compare_evidence: the models were calibrated to different measurements ({measurements}), so that their "
            "evidences cannot be compared: calibrate all models to the same points"
        )
    evidence = np.array([float(each["log_evidence"]) for each in posteriors.values()])
    error = np.array([float(each["log_evidence_standard_error"]) for each in posteriors.values()])
    order = np.argsort(-evidence)
    evidence, error = evidence[order], error[order]
    factor = evidence - evidence[0]
    of_factor = np.where(np.arange(order.size) == 0, 0.0, np.hypot(error, error[0]))
    if factor[1] > -RELEVANT * of_factor[1]:
        warn_caller(
            f"the log evidences of the two best models differ by {-factor[1]:.3g} with a Monte Carlo standard error of "
            f"{of_factor[1]:.2g}, so that their order is uncertain: increase candidates= of calibrate()"
        )
    probability = np.exp(factor) / np.exp(factor).sum()
    return xr.Dataset(
        {
            "log_evidence": ("model", evidence, {"units": "1", "long_name": "logarithm of the evidence"}),
            "log_evidence_standard_error": ("model", error, {"units": "1", "long_name": "Monte Carlo standard error"}),
            "log_bayes_factor": (
                "model",
                factor,
                {"units": "1", "long_name": "logarithm of the Bayes factor to the best"},
            ),
            "log_bayes_factor_standard_error": (
                "model",
                of_factor,
                {"units": "1", "long_name": "Monte Carlo standard error of the logarithm of the Bayes factor"},
            ),
            "probability": ("model", probability, {"units": "1", "long_name": "posterior probability of the model"}),
        },
        coords={"model": ("model", np.array(list(posteriors))[order], {"long_name": "model"})},
        attrs=trace("models compared by their evidence", "compare_evidence"),
    )
