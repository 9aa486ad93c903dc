"""Data assimilation: parameters and states of a structure from measured floor responses, time by time."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from warpdyn.campaigns.inference.calibrate import parameter_variables
from warpdyn.campaigns.inference.filters.data_tempering import DataTempering
from warpdyn.campaigns.inference.filters.filtering import (
    Estimates,
    Filter,
    ParticleFilter,
    Settings,
    SquareRootKalman,
    StochasticKalman,
    UnscentedKalman,
)
from warpdyn.campaigns.inference.filters.kalman import covariance_root
from warpdyn.campaigns.inference.filters.states import StructureStates
from warpdyn.campaigns.inference.filters.unknowns import Unknowns
from warpdyn.campaigns.inference.measured import MeasuredResponse
from warpdyn.campaigns.inference.plausible import warn_of_implausible_measurement
from warpdyn.campaigns.inference.posterior import OFFSET, PARAMETERS, QUANTILES
from warpdyn.campaigns.inference.priors import Prior, check_prior
from warpdyn.campaigns.inference.responses import ResponseMisfit, check_response
from warpdyn.campaigns.integration.settings import Execution
from warpdyn.foundations.core.checks import check_kind, one_of, real_number, whole_number
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.core.messages import warn_caller
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.files.netcdf import trace
from warpdyn.model.scene.distributions.distribution import Distribution
from warpdyn.model.scene.distributions.numerical import as_distribution
from warpdyn.model.scene.scene import Scene
from warpdyn.model.structures.shear_building import ShearBuilding

FILTERS: dict[str, type[Filter]] = {
    "particle": ParticleFilter,
    "ensemble_kalman": StochasticKalman,
    "square_root_kalman": SquareRootKalman,
    "unscented_kalman": UnscentedKalman,
}
FEWEST_MEMBERS, MOST_MEMBERS = 50, 2**20
LEAST_EFFECTIVE = 10.0  # a smaller effective sample size is degenerate
LARGEST_INNOVATION = 3.0  # mean squared normalised innovation per sensor; 1 for a consistent filter


@suggests_names
def assimilate(
    scene: Scene,
    measured: MeasuredResponse,
    *,
    noise: float,
    method: str = "particle",
    offset: Distribution | None = None,
    velocity_noise: float = 0.0,
    initial_displacement: float = 0.0,
    initial_velocity: float = 0.0,
    members: int = 1000,
    inflation: float = 1.0,
    discount: float = 0.98,
    seed: int = 0,
    execution: Execution | None = None,
) -> xr.Dataset:
    """Estimate parameters and states of a building from its measured response, time by time (data assimilation).

    Filters: "particle" resamples systematically if the effective sample size is below half of the members. Without
    process noise and with a known initial state, it then moves the particles by Metropolis steps of the whole record,
    which are exact. Otherwise it moves parameters by the kernel of Liu and West (2001), which is approximate.
    "ensemble_kalman" (perturbed observations) and "square_root_kalman" (deterministic update) correct parameters and
    states linearly; so does "unscented_kalman", with sigma points. They correct the memory of rate laws (Bouc-Wen,
    Baber-Noori) only.

    Args:
        scene: The scene: a ShearBuilding under one ground motion. Its random scatter is the prior of unknown
            parameters; without scatter, only states are estimated.
        measured: The measured response of floors.
        noise: Standard deviation of the measurement noise of each sensor [units of the measurement].
        method: Name of the filter.
        offset: Prior of the constant offset of each sensor [units of the measurement]; None: no offset.
        velocity_noise: Standard deviation of the process noise that is added to each floor velocity after each
            sampling step [m/s].
        initial_displacement: Standard deviation of the initial displacement of each floor [m].
        initial_velocity: Standard deviation of the initial velocity of each floor [m/s].
        members: Number of particles or members. The unscented filter has 2 per unknown; its result has this number of
            samples of its final normal distribution.
        inflation: Factor on the deviations of ensemble Kalman filters from their mean after each measurement [1].
        discount: Discount factor of Liu and West [1], 0.9 to below 1: the smaller, the more parameters move.
        seed: Seed of every random draw.
        execution: Device and threads; None: the defaults of `simulate`.

    Returns:
        Along `time` (the measured times that count): `parameter_mean`, `parameter_standard_deviation` and
        `parameter_quantile` of each unknown constant; `displacement` and `velocity` of the floors (means) with
        `_standard_deviation`, except for exact particle moves; `effective_sample_size` before resampling, `resampled`,
        `log_evidence` of the measurements up to each time, and `innovation` (squared normalised innovation of Kalman
        filters). The samples of the parameters at the last time with their `weight`, for `posterior_scatter`.

    Raises:
        TypeError: If an argument is of another class.
        ValueError: If a sensor is on a floor that does not exist, nothing is unknown, there are too few members, a
            number is out of its range, or a filter that changes states gets a scene with control.

    Example:
        >>> time = np.arange(0, 3, 0.02)
        >>> motion = wd.GroundMotion(2 * np.sin(6 * time), 0.02, "sine")
        >>> storey = wd.ShearBuilding(1e5, 4e6, 3.0, damping="storey", damping_coefficient=4e4)
        >>> scene = wd.Scene(storey, motion, {"stiffness": wd.RandomFactor(wd.Lognormal(1.1, 0.2))})
        >>> truth = wd.simulate(wd.Scene(storey, motion), histories=wd.Histories(), step=0.01, dtype="float64")
        >>> floor = truth["acceleration"].sel(time=time, method="nearest").values[0]
        >>> measured = wd.MeasuredResponse(floor + np.random.default_rng(1).normal(0, 0.1, floor.shape), 0.02)
        >>> found = wd.assimilate(scene, measured, noise=0.1, method="unscented_kalman", velocity_noise=1e-3)
        >>> bool(abs(found["parameter_mean"][-1, 0] / 4e6 - 1) < 0.03)
        True
    """
    one_of("method", method, FILTERS)
    check_kind("assimilate", "a Scene", scene, Scene, argument="scene")
    check_kind(
        "assimilate",
        "a MeasuredResponse",
        measured,
        MeasuredResponse,
        "give wd.MeasuredResponse(values, step)",
        argument="measured",
    )
    where = execution or Execution()
    check_kind("assimilate", "wd.Execution", where, Execution, argument="execution")
    _check_scene(scene, measured)
    settings = Settings(
        noise=real_number("noise", noise, above=0),
        velocity_noise=real_number("velocity_noise [m/s]", velocity_noise, least=0),
        initial_displacement=real_number("initial_displacement [m]", initial_displacement, least=0),
        initial_velocity=real_number("initial_velocity [m/s]", initial_velocity, least=0),
        inflation=real_number("inflation", inflation, least=1),
        discount=real_number("discount", discount, least=0.9),
    )
    if settings.discount >= 1:
        raise ValueError(f"discount must be below 1, got {discount}: with 1, parameters do not move")
    prior = Prior(scene.structure, scene.scatter, scene.correlation) if scene.scatter else None
    prior_of_offset = None if offset is None else as_distribution(offset)
    if prior_of_offset is not None:
        check_prior("offset", prior_of_offset)
    unknowns = Unknowns(prior, prior_of_offset, measured.channels)
    is_random = any((settings.velocity_noise, settings.initial_displacement, settings.initial_velocity))
    if not unknowns.variables and not is_random:
        raise ValueError(
            "assimilate: nothing is unknown: give scatter= to the Scene, or velocity_noise=, initial_displacement= or "
            "initial_velocity="
        )
    is_exact = method == "particle" and not is_random and prior is not None
    if scene.control is not None and not is_exact:
        raise ValueError(
            "assimilate: this filter changes states between two samples, but not those of the sensors and the "
            "controller: give a scene without control=, or method='particle' without velocity_noise=, "
            "initial_displacement= and initial_velocity="
        )
    count = _checked_members(members, method, unknowns.variables + 2 * scene.structure.dofs)
    random = np.random.default_rng(whole_number("seed", seed, 0))
    with interruptible():
        starts_at_rest = not (settings.initial_displacement or settings.initial_velocity)
        misfit = None
        if prior is not None and starts_at_rest:  # otherwise the free vibration may be larger than that of the motion
            misfit = ResponseMisfit(scene, prior, measured, where, None)
        warn_of_implausible_measurement(measured, scene, prior, misfit)
        if is_exact:
            found, normals, weights = DataTempering(
                scene, unknowns, measured, settings.noise, where, count, random
            ).run()
        else:
            found, normals, weights = _filtered(scene, unknowns, measured, settings, where, method, count, random)
    _warn_of_divergence(found, measured, count, method)
    kind = {"particle": "metropolis" if is_exact else "liu_west"}.get(method, "none")
    attributes = {"method": method, "rejuvenation": kind, "seed": seed, "measurement": measured.identity}
    return _filtered_dataset(found, unknowns, normals, weights, measured, scene, attributes)


def _check_scene(scene: Scene, measured: MeasuredResponse) -> None:
    """Raise an error unless the scene is one ShearBuilding under one ground motion that fits the measurement."""
    if not isinstance(scene.structure, ShearBuilding) or not getattr(scene.excitation, "motions", ()):
        raise TypeError(
            "assimilate() takes a Scene of a ShearBuilding under one ground motion, got "
            f"{scene!r}: give wd.Scene(building, motion, scatter); calibrate() takes other structures and loads"
        )
    check_response("assimilate", scene, measured)


def _checked_members(members: int, method: str, variables: int) -> int:
    """Return the number of members; raise a ValueError if it is too small."""
    count = whole_number("members", members, FEWEST_MEMBERS, MOST_MEMBERS)
    if method in ("ensemble_kalman", "square_root_kalman") and count <= 2 * variables:
        raise ValueError(
            f"members is {count}, but {variables} unknown states and parameters need more than {2 * variables}, "
            f"so that the covariance of the ensemble is not singular: give members={10 * variables}"
        )
    return count


def _filtered(
    scene: Scene,
    unknowns: Unknowns,
    measured: MeasuredResponse,
    settings: Settings,
    execution: Execution,
    method: str,
    count: int,
    random: np.random.Generator,
) -> tuple[Estimates, np.ndarray, np.ndarray]:
    """Return the estimates of a filter of an integrated ensemble, and its final variables and weights."""
    kind = FILTERS[method]

    def structures(normals: np.ndarray) -> StructureStates:
        return StructureStates(scene, unknowns.prior, measured, normals[:, : unknowns.of_parameters], execution)

    if kind is UnscentedKalman:
        middle = np.zeros((2, unknowns.variables))
        points = 2 * (unknowns.variables + structures(middle).states().shape[1])
        normals = np.zeros((points, unknowns.variables))
        one = UnscentedKalman(structures(normals), unknowns, normals, measured, settings, random)
        found = one.run()
        size = unknowns.variables
        root = covariance_root(one.covariance[:size, :size])
        drawn = one.mean[:size] + random.standard_normal((count, size)) @ root.T
        return found, drawn, np.full(count, 1.0 / count)
    normals = _possible(unknowns, count, random)
    several = kind(structures(normals), unknowns, normals, measured, settings, random)
    return several.run(), several.normals, several.weights


def _possible(unknowns: Unknowns, count: int, random: np.random.Generator) -> np.ndarray:
    """Return variables of members from the prior, without impossible combinations of parameters."""
    normals = random.standard_normal((count, unknowns.variables))
    if unknowns.prior is None:
        return normals
    for _ in range(100):
        size = unknowns.of_parameters
        outside = ~unknowns.prior.allowed(unknowns.prior.values(normals[:, :size]))
        if not outside.any():
            return normals
        normals[outside] = random.standard_normal((int(outside.sum()), unknowns.variables))
    raise ValueError(
        "assimilate: the parameters of the prior contradict each other in almost all members: correct the scatter"
    )


def _warn_of_divergence(found: Estimates, measured: MeasuredResponse, count: int, method: str) -> None:
    """Warn of a degenerate ensemble, or of innovations that are larger than the filter expects."""
    least = int(np.argmin(found.effective))
    time = (measured.first + least) * measured.step
    if method == "particle" and found.effective[least] < LEAST_EFFECTIVE:
        warn_caller(
            f"assimilate: the ensemble is degenerate: at time {time:g} s the effective sample size is "
            f"{found.effective[least]:.3g} of {count} particles, so that the estimates rest on few particles. Increase "
            "members=, noise= or velocity_noise=, or narrow the prior"
        )
    innovation = float(np.mean(found.distance)) / measured.channels
    if innovation > LARGEST_INNOVATION:
        warn_caller(
            f"assimilate: the measurements differ from the predictions by {np.sqrt(innovation):.2g} times the expected "
            "deviation (root mean square), so that the filter has diverged or the model does not fit. Increase "
            "velocity_noise=, inflation= or noise=, or correct the model and the units"
        )


def _filtered_dataset(
    found: Estimates,
    unknowns: Unknowns,
    normals: np.ndarray,
    weights: np.ndarray,
    measured: MeasuredResponse,
    scene: Scene,
    attributes: dict[str, Any],
) -> xr.Dataset:
    """Return the result of `assimilate`."""
    time = (measured.first + np.arange(len(found.effective))) * measured.step
    variables: dict[str, tuple] = {"weight": ("sample", weights, {"units": "1", "long_name": "weight of the sample"})}
    names: list[str] = []
    if unknowns.prior is not None:
        of_parameters = parameter_variables(unknowns.prior, normals[:, : unknowns.of_parameters])
        names = list(of_parameters)
        variables |= of_parameters
    if unknowns.offset is not None:
        words = {"units": measured.units, "long_name": "offset of the sensor"}
        variables[OFFSET] = (("sample", "sensor"), unknowns.offsets(normals), words)
    summary = np.stack(found.unknowns)
    unit = "in the units of the parameter"
    variables |= {
        "parameter_mean": (("time", "parameter"), summary[:, 0], {"long_name": f"posterior mean, {unit}"}),
        "parameter_standard_deviation": (
            ("time", "parameter"),
            summary[:, 1],
            {"long_name": f"posterior standard deviation, {unit}"},
        ),
        "parameter_quantile": (
            ("time", "quantile", "parameter"),
            summary[:, 2:],
            {"long_name": f"posterior quantile, {unit}"},
        ),
    }
    if found.states:
        states, dofs = np.stack(found.states), scene.structure.dofs
        for place, (name, units) in enumerate({"displacement": "m", "velocity": "m s-1"}.items()):
            columns = slice(place * dofs, (place + 1) * dofs)
            words = {"units": units, "long_name": f"posterior mean of the {name} relative to the base"}
            variables[name] = (("time", "dof"), states[:, 0, columns], words)
            words = {"units": units, "long_name": f"posterior standard deviation of the {name}"}
            variables[f"{name}_standard_deviation"] = (("time", "dof"), states[:, 1, columns], words)
    of_time = {
        "effective_sample_size": (found.effective, "effective sample size before resampling"),
        "resampled": (np.array(found.resampled, dtype=np.int8), "1 if the particles were resampled after this time"),
        "log_evidence": (found.log_evidence, "logarithm of the evidence of the measurements up to this time"),
        "innovation": (found.distance, "squared normalised innovation, summed over the sensors"),
    }
    for name, (values, text) in of_time.items():
        variables[name] = ("time", np.asarray(values), {"units": "1", "long_name": text})
    columns_of_parameters = list(unknowns.columns(normals[:1]))
    return xr.Dataset(
        variables,
        coords={
            "time": ("time", time, {"units": "s", "long_name": "time", "standard_name": "time"}),
            "parameter": ("parameter", np.array(columns_of_parameters, dtype=str)),
            "quantile": ("quantile", list(QUANTILES)),
        },
        attrs=trace("parameters and states from measured responses", "assimilate")
        | {PARAMETERS: " ".join(names), **attributes},
    )
