"""Calibration: posterior distribution of parameters from measured loops or response histories, and the evidence."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from warpdyn.campaigns.inference.likelihood import Likelihood
from warpdyn.campaigns.inference.loops import LoopMisfit
from warpdyn.campaigns.inference.measured import MeasuredLoop, MeasuredResponse
from warpdyn.campaigns.inference.models import calibrated_scene, calibrated_storey
from warpdyn.campaigns.inference.plausible import warn_of_implausible_measurement
from warpdyn.campaigns.inference.posterior import NOISE, OFFSET, PARAMETERS, QUANTILES, flat_columns, summarised
from warpdyn.campaigns.inference.priors import Prior, check_prior
from warpdyn.campaigns.inference.responses import ResponseMisfit
from warpdyn.campaigns.inference.tempering import MOST_SWEEPS, Tempered, temper
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.engine.laws.law import Law
from warpdyn.foundations.core.checks import check_kind, shortened, whole_number
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.scene.distributions.distribution import Distribution
from warpdyn.model.scene.distributions.numerical import as_distribution
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.shear_building import ShearBuilding

FEWEST_CANDIDATES, MOST_CANDIDATES = 100, 2**22
CANDIDATES_PER_VARIABLE = 20  # fewer cannot determine the covariance that proposals follow
LARGEST_ERROR = 0.5  # of the log evidence; above, a warning recommends more candidates
Priors = Mapping[str, Any]


@suggests_names
def calibrate(
    model: Scene | ShearBuilding | Law | type[Law] | str,
    measured: MeasuredLoop | MeasuredResponse,
    priors: Priors | None = None,
    *,
    noise: ArrayLike | Distribution,
    offset: Distribution | None = None,
    candidates: int = 4096,
    seed: int = 0,
    integration: Integration | None = None,
    execution: Execution | None = None,
) -> xr.Dataset:
    """Estimate parameters from a measured loop or response (Bayesian calibration), with the evidence of the model.

    Tempered sequential Monte Carlo (transitional Markov chain Monte Carlo, TMCMC) moves all candidates from the prior
    to the posterior; each step of all Markov chains is one launch. The differences between measurement and model are
    independent and normal, with one standard deviation (`noise`) for all points and sensors. Measurement errors and
    model errors are not distinguished: if the differences are correlated in time, the posterior is too narrow.

    Candidates whose parameters contradict each other, or whose integration fails, have the likelihood 0.

    Source: Ching and Chen (2007), Journal of Engineering Mechanics 133(7), with normalised weights of the covariance.

    Args:
        model: For a MeasuredLoop: a storey law (name, class, or an object whose values are fixed), or a ShearBuilding
            of one storey, for a storey with devices. For a MeasuredResponse: a Scene of one structure under one motion
            or load, whose random scatter and correlation are the prior.
        measured: The measurement.
        priors: Prior of each parameter, by name [units of the parameter]: a distribution, or a number for a fixed
            parameter of a law. A law needs "stiffness" [N/m] and its parameters. Not for a Scene.
        noise: Standard deviation of the noise [units of the measurement], or its prior distribution if it is unknown.
        offset: Prior of the constant offset of each sensor [units of the measurement]; None: no offset.
        candidates: Number of candidates, at least 100 and 20 per variable. The Monte Carlo error decreases with its
            square root.
        seed: Seed of every random draw.
        integration: How histories are integrated; its step must divide the sampling step of the sensors. None: RK4 with
            at least 20 steps in the shortest period of the structure.
        execution: Where candidates are computed; None: the defaults of `simulate`.

    Returns:
        Posterior samples of each parameter, along `sample` (and `storey` if the prior differs by storey), with equal
        `weight`, `log_likelihood` and, if unknown, `noise_standard_deviation` and `sensor_offset`. `log_evidence` with
        `log_evidence_standard_error`. Along `parameter`: mean, standard deviation, Monte Carlo error of the mean and
        quantiles. Along `stage`: `tempering_exponent`, `acceptance` [1], `effective_sample_size`, `metropolis_steps`
        and `log_mean_weight`. `allowed_prior_share` is the share of the prior with a likelihood above 0, and
        `likelihood_evaluations` the number of computed candidates.

    Raises:
        TypeError: If `model` and `measured` do not fit each other, or a prior is not a distribution.
        ValueError: If a parameter is unknown or missing, a prior exceeds the bounds of its parameter, a sensor is on a
            floor that does not exist, there are too few candidates, or the likelihood of all of them is 0.

    Example:
        >>> drift = 0.02 * np.sin(np.linspace(0, 4 * np.pi, 81))
        >>> storey = wd.ShearBuilding(1.0, 3e7, 3.0, law="bilinear", yield_force=2e5, hardening_ratio=0.05)
        >>> force = wd.storey_hysteresis(storey, drift)["storey_force"].values[:, 0]
        >>> loop = wd.MeasuredLoop(drift, force + np.random.default_rng(1).normal(0, 4e3, 81))
        >>> priors = {"stiffness": wd.Lognormal(2e7, 0.5), "yield_force": wd.Lognormal(1.5e5, 0.5)}
        >>> priors |= {"hardening_ratio": wd.Uniform(0.0, 0.2)}
        >>> posterior = wd.calibrate("bilinear", loop, priors, noise=wd.Lognormal(5e3, 1.0), candidates=500)
        >>> bool(abs(posterior["yield_force"].mean() / 2e5 - 1) < 0.02)
        True
    """
    where = execution or Execution()
    if integration is not None:
        check_kind("calibrate", "wd.Integration", integration, Integration, argument="integration")
    check_kind("calibrate", "wd.Execution", where, Execution, argument="execution")
    check_kind(
        "calibrate",
        "a MeasuredLoop or a MeasuredResponse",
        measured,
        (MeasuredLoop, MeasuredResponse),  # type: ignore[arg-type]
        "give wd.MeasuredLoop(drift, force) or wd.MeasuredResponse(values, step)",
        argument="measured",
    )
    misfit: LoopMisfit | ResponseMisfit
    scene: Scene | None = None
    if isinstance(measured, MeasuredResponse):
        scene = calibrated_scene(model, priors)
        prior = Prior(scene.structure, scene.scatter, scene.correlation)
        misfit = ResponseMisfit(scene, prior, measured, where, integration)
    else:
        storey, scatter = calibrated_storey(model, priors)
        prior = Prior(storey, scatter, {})
        misfit = LoopMisfit(storey, measured, where)
    likelihood = Likelihood(prior, misfit, misfit.count, measured.channels, noise, offset)
    count = checked_candidates(candidates, likelihood.variables)
    random = np.random.default_rng(whole_number("seed", seed, 0))
    with interruptible():
        warn_of_implausible_measurement(measured, scene, prior, misfit)
        found = temper(likelihood, likelihood.variables, count, random)
    return _calibrated_dataset(found, likelihood, measured, seed)


@suggests_names
def sample_posterior(
    log_likelihood: Callable[[dict[str, np.ndarray]], ArrayLike],
    priors: Mapping[str, Distribution],
    *,
    candidates: int = 4096,
    seed: int = 0,
) -> xr.Dataset:
    """Draw samples of a posterior by tempered sequential Monte Carlo, for a likelihood that the caller computes.

    Use `calibrate` for measured loops and response histories. This function is for other data, such as measured
    frequencies and mode shapes.

    Args:
        log_likelihood: Function of all candidates, {parameter: values of shape [candidate]}, that returns the natural
            logarithms of their likelihoods [1], shape [candidate]; -inf for impossible candidates.
        priors: Prior distribution of each parameter.
        candidates: Number of candidates, at least 100 and 20 per parameter.
        seed: Seed of every random draw.

    Returns:
        As for `calibrate`, without noise and offsets.

    Raises:
        TypeError: If `log_likelihood` is not a function, or a prior is not a continuous distribution.
        ValueError: If the function returns another shape, NaN or +inf, or there are too few candidates.

    Example:
        >>> def frequencies(p):  # one measured frequency of 2.1 Hz with a standard deviation of 0.05 Hz
        ...     return -0.5 * ((np.sqrt(p["stiffness"] / 1e5) / (2 * np.pi) - 2.1) / 0.05) ** 2
        >>> found = wd.sample_posterior(frequencies, {"stiffness": wd.Lognormal(1.5e7, 0.3)}, candidates=500)
        >>> bool(abs(found["stiffness"].mean() / 1.74e7 - 1) < 0.01)
        True
    """
    if not callable(log_likelihood):
        raise TypeError(f"log_likelihood must be a function of the candidates, got {shortened(log_likelihood)}")
    if not isinstance(priors, Mapping) or not priors:
        raise TypeError(f"priors must map names to distributions, got {shortened(priors)}")
    distributions = {name: as_distribution(each) for name, each in priors.items()}
    for name, each in distributions.items():
        check_prior(name, each)
    count = checked_candidates(candidates, len(distributions))

    def values_of(normals: np.ndarray) -> dict[str, np.ndarray]:
        drawn = zip(distributions.items(), normals.T, strict=True)
        return {name: np.asarray(each.from_standard_normal(column)) for (name, each), column in drawn}

    def checked(normals: np.ndarray) -> np.ndarray:
        found = np.asarray(log_likelihood(values_of(normals)), dtype=np.float64)
        if found.shape != (len(normals),):
            raise ValueError(f"log_likelihood returned the shape {found.shape} for {len(normals)} candidates")
        if np.isnan(found).any() or (found == np.inf).any():
            raise ValueError(
                "log_likelihood returned NaN or +inf; return -inf for impossible candidates, and check the function"
            )
        return found

    random = np.random.default_rng(whole_number("seed", seed, 0))
    with interruptible():
        found = temper(checked, len(distributions), count, random)
    samples = values_of(found.normals)
    variables = {name: ("sample", each, {"long_name": name}) for name, each in samples.items()}
    return posterior_dataset(found, variables, list(variables), "sample_posterior", {"seed": seed})


def checked_candidates(candidates: int, variables: int) -> int:
    """Return the number of candidates; raise a ValueError if it is too small for the number of variables."""
    count = whole_number("candidates", candidates, FEWEST_CANDIDATES, MOST_CANDIDATES)
    if count < (least := CANDIDATES_PER_VARIABLE * variables):
        raise ValueError(
            f"candidates is {count}, but {variables} variables need at least {least}, from whose covariance proposals "
            f"are drawn: give candidates={least} or more"
        )
    return count


def _calibrated_dataset(
    found: Tempered, likelihood: Likelihood, measured: MeasuredLoop | MeasuredResponse, seed: int
) -> xr.Dataset:
    """Return the result of `calibrate`."""
    prior, units = likelihood.prior, measured.units
    variables = parameter_variables(prior, found.normals[:, : prior.variables])
    names = list(variables)
    if likelihood.has_noise:
        words = {"units": units, "long_name": "standard deviation of the noise"}
        variables[NOISE] = ("sample", likelihood.noise_of(found.normals), words)
    if likelihood.offset is not None:
        words = {"units": units, "long_name": "offset of the sensor"}
        variables[OFFSET] = (("sample", "sensor"), likelihood.offset_of(found.normals), words)
    attributes = {"seed": seed, "measurement": measured.identity, "model": repr(prior.structure)}
    return posterior_dataset(found, variables, names, "calibrate", attributes)


def parameter_variables(prior: Prior, normals: np.ndarray) -> dict[str, tuple]:
    """Return the variables of a dataset with the parameters of samples, from their variables [sample, variable]."""
    found: dict[str, tuple] = {}
    for name, each in prior.shown(prior.values(normals)).items():
        parameter = prior.structure.parameter_table[name]
        dims = ("sample", prior.structure.dim_of(name)) if each.ndim == 2 else ("sample",)
        found[name] = (dims, each, {"units": parameter.units, "long_name": parameter.long_name})
    return found


def posterior_dataset(
    found: Tempered, variables: Mapping[str, tuple], names: list[str], function: str, attributes: Mapping[str, Any]
) -> xr.Dataset:
    """Return samples, evidence, summary and stages of a tempered posterior as a dataset; warn of an inaccurate one."""
    count = len(found.normals)
    weights, error = np.full(count, 1.0 / count), float(np.sqrt(found.evidence_variance))
    of_stages = {
        "tempering_exponent": (found.exponent, "power of the likelihood in the target of the stage"),
        "acceptance": (found.acceptance, "share of accepted proposals"),
        "effective_sample_size": (found.effective, "effective sample size before resampling"),
        "metropolis_steps": (found.sweeps, "Metropolis steps of each candidate"),
        "log_mean_weight": (found.log_mean_weight, "logarithm of the mean weight, whose sum is the log evidence"),
        "remaining_correlation": (found.forgotten, "largest correlation of start and end of the Markov chains"),
    }
    columns = flat_columns({name: each[1] for name, each in variables.items()})
    slow = [
        stage for stage, sweeps in enumerate(found.sweeps) if sweeps >= MOST_SWEEPS and found.forgotten[stage] > 0.5
    ]
    if slow:
        warn_caller(
            f"{function}: in stage {slow[0] + 1} of {len(found.sweeps)} the candidates moved slowly (correlation "
            f"{found.forgotten[slow[0]]:.2f} of start and end after {MOST_SWEEPS} steps), so that parameters may have "
            "more values than the samples show: increase candidates, or fix parameters that the measurement does not "
            "determine"
        )
    if error > LARGEST_ERROR:
        warn_caller(
            f"{function}: the Monte Carlo error of the log evidence is {error:.2g}, too large to compare models: "
            f"increase candidates= (now {count})"
        )
    return xr.Dataset(
        {
            **variables,
            "weight": ("sample", weights, {"units": "1", "long_name": "weight of the sample; the sum is 1"}),
            "log_likelihood": (
                "sample",
                found.log_likelihood,
                {"units": "1", "long_name": "logarithm of the likelihood"},
            ),
            "log_evidence": ((), found.log_evidence, {"units": "1", "long_name": "logarithm of the evidence"}),
            "log_evidence_standard_error": ((), error, {"units": "1", "long_name": "Monte Carlo standard error"}),
            "allowed_prior_share": (
                (),
                found.allowed_share,
                {"units": "1", "long_name": "share of possible candidates"},
            ),
            "likelihood_evaluations": (
                (),
                found.evaluations,
                {"units": "1", "long_name": "number of computed candidates"},
            ),
            **{
                name: ("stage", np.asarray(each), {"units": "1", "long_name": words})
                for name, (each, words) in of_stages.items()
            },
            **summarised(columns, weights, found.ancestors),
        },
        coords={"parameter": ("parameter", list(columns)), "quantile": ("quantile", list(QUANTILES))},
        attrs=trace("posterior samples", function) | {PARAMETERS: " ".join(names), **attributes},
    )
