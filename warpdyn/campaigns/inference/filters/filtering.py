"""Ensemble Kalman, unscented Kalman and particle filters of an integrated ensemble."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from warpdyn.campaigns.inference.filters.kalman import (
    covariance_root,
    innovation_density,
    sigma_points,
    square_root_update,
    stochastic_update,
    unscented_update,
)
from warpdyn.campaigns.inference.filters.states import StructureStates
from warpdyn.campaigns.inference.filters.unknowns import Unknowns
from warpdyn.campaigns.inference.measured import MeasuredResponse
from warpdyn.campaigns.inference.resampling import effective_sample_size, normalised, systematic
from warpdyn.foundations.core.interruption import stop_if_asked

LEAST_SHARE = 0.5  # of the members; a smaller effective sample size causes resampling


@dataclass
class Settings:
    """Numbers of a filter.

    Args:
        noise: Standard deviation of the measurement noise [units of the measurement].
        velocity_noise: Standard deviation of the process noise of each velocity per sampling step [m/s].
        initial_displacement: Standard deviation of each displacement at time 0 [m].
        initial_velocity: Standard deviation of each velocity at time 0 [m/s].
        inflation: Factor on the anomalies of an ensemble Kalman filter after each update [1].
        discount: Discount factor of Liu and West for the rejuvenation of parameters [1].
    """

    noise: float
    velocity_noise: float
    initial_displacement: float
    initial_velocity: float
    inflation: float
    discount: float


@dataclass
class Estimates:
    """Estimates at the measured times that count, one entry per time.

    Attributes:
        unknowns: Mean, standard deviation and quantiles of the unknown constants, shape [5, unknown].
        states: Mean and standard deviation of the states, shape [2, state].
        effective: Effective sample size before resampling.
        resampled: Whether the members were resampled.
        log_evidence: Logarithm of the evidence of the measurements up to this time.
        distance: Squared normalised innovation; NaN for particle filters.
    """

    unknowns: list[np.ndarray] = field(default_factory=list)
    states: list[np.ndarray] = field(default_factory=list)
    effective: list[float] = field(default_factory=list)
    resampled: list[bool] = field(default_factory=list)
    log_evidence: list[float] = field(default_factory=list)
    distance: list[float] = field(default_factory=list)


class Filter:
    """Base class: members that are integrated from time to time and corrected by each measurement.

    Args:
        states: The integrated structures.
        unknowns: The unknown constants.
        normals: Standard normal variables of the unknown constants of the members, shape [member, variable].
        measured: The measured response.
        settings: Numbers of the filter.
        random: Generator of random numbers.
    """

    def __init__(
        self,
        states: StructureStates,
        unknowns: Unknowns,
        normals: np.ndarray,
        measured: MeasuredResponse,
        settings: Settings,
        random: np.random.Generator,
    ) -> None:
        self.structures, self.unknowns, self.normals, self.measured = states, unknowns, normals, measured
        self.settings, self.random = settings, random
        self.weights = np.full(len(normals), 1.0 / len(normals))
        self.noise = settings.noise**2 * np.eye(measured.channels)
        self.found, self.evidence = Estimates(), 0.0
        self.start()

    @property
    def _spread(self) -> np.ndarray:
        """Standard deviations of the states at time 0, shape [state]."""
        dofs, states = self.structures.dofs, self.structures.states().shape[1]
        spread = np.zeros(states)
        spread[:dofs], spread[dofs : 2 * dofs] = self.settings.initial_displacement, self.settings.initial_velocity
        return spread

    @property
    def _process(self) -> np.ndarray:
        """Standard deviations of the process noise of the states, shape [state]."""
        dofs, states = self.structures.dofs, self.structures.states().shape[1]
        spread = np.zeros(states)
        spread[dofs : 2 * dofs] = self.settings.velocity_noise
        return spread

    def start(self) -> None:
        """Set the states at time 0."""
        if self._spread.any():
            states = self.structures.states()
            self.structures.set_states(states + self._spread * self.random.standard_normal(states.shape))

    def run(self) -> Estimates:
        """Filter all measurements; return the estimates."""
        for time in range(len(self.measured.values)):
            stop_if_asked()
            if time > 0:
                self.predict()
            if time < self.measured.first:
                continue
            predicted = self.structures.predicted() + self.unknowns.offsets(self.normals)
            self.update(predicted, self.measured.values[time])
            self.found.log_evidence.append(self.evidence)
            self.keep()
        return self.found

    def predict(self) -> None:
        """Integrate to the next time, and add process noise."""
        self.structures.advance()
        if self._process.any():
            states = self.structures.states()
            self.structures.set_states(states + self._process * self.random.standard_normal(states.shape))

    def update(self, predicted: np.ndarray, measured: np.ndarray) -> None:
        """Correct members or weights by the measured values, shape [sensor]."""
        raise NotImplementedError

    def keep(self) -> None:
        """Append estimates of the present time."""
        states = self.structures.states()
        self.found.states.append(_moments(states, self.weights))
        self.found.unknowns.append(self.unknowns.summary(self.normals, self.weights))

    def joined(self) -> np.ndarray:
        """Return the variables of unknown constants and the states of all members, shape [member, variable]."""
        return np.concatenate([self.normals, self.structures.states()], axis=1)

    def set_joined(self, members: np.ndarray) -> None:
        """Replace unknown constants and states of all members, in the form of `joined`."""
        count, of_parameters = self.normals.shape[1], self.unknowns.of_parameters
        normals = members[:, :count].copy()
        normals[:, :of_parameters] = self.structures.set_parameters(
            normals[:, :of_parameters], self.normals[:, :of_parameters]
        )
        self.normals = normals
        self.structures.set_states(members[:, count:])


class StochasticKalman(Filter):
    """Ensemble Kalman filter with perturbed observations."""

    def update(self, predicted: np.ndarray, measured: np.ndarray) -> None:
        """Correct the members by the measured values."""
        density, distance = innovation_density(predicted, measured, self.noise, len(predicted) - 1)
        self.evidence += density
        members = self.corrected(self.joined(), predicted, measured)
        mean = members.mean(axis=0)
        self.set_joined(mean + self.settings.inflation * (members - mean))
        self.found.effective.append(float(len(members)))
        self.found.resampled.append(False)
        self.found.distance.append(distance)

    def corrected(self, members: np.ndarray, predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """Return the members after the update, shape [member, variable]."""
        errors = self.settings.noise * self.random.standard_normal(predicted.shape)
        errors -= errors.mean(axis=0)
        return stochastic_update(members, predicted, measured, self.noise, errors)


class SquareRootKalman(StochasticKalman):
    """Ensemble Kalman filter with the deterministic update by the symmetric square root."""

    def corrected(self, members: np.ndarray, predicted: np.ndarray, measured: np.ndarray) -> np.ndarray:
        """Return the members after the update, shape [member, variable]."""
        return square_root_update(members, predicted, measured, self.noise)


class UnscentedKalman(Filter):
    """Unscented Kalman filter: the members are the sigma points of mean and covariance of constants and states."""

    def start(self) -> None:
        """Set mean and covariance at time 0, and the members to their sigma points."""
        states = self.structures.states()
        self.mean = np.concatenate([np.zeros(self.normals.shape[1]), states[0]])
        self.covariance = np.diag(np.concatenate([np.ones(self.normals.shape[1]), self._spread**2]))
        self.set_joined(sigma_points(self.mean, self.covariance))

    def predict(self) -> None:
        """Integrate the sigma points to the next time, and add process noise to the covariance."""
        self.structures.advance()
        points = self.joined()
        self.mean = points.mean(axis=0)
        centred = points - self.mean
        process = np.concatenate([np.zeros(self.normals.shape[1]), self._process**2])
        self.covariance = centred.T @ centred / len(points) + np.diag(process)
        if process.any():
            self.set_joined(sigma_points(self.mean, self.covariance))

    def update(self, predicted: np.ndarray, measured: np.ndarray) -> None:
        """Correct mean and covariance by the measured values, and set the members to their sigma points."""
        density, distance = innovation_density(predicted, measured, self.noise, len(predicted))
        self.evidence += density
        self.mean, self.covariance = unscented_update(self.joined(), self.covariance, predicted, measured, self.noise)
        self.set_joined(sigma_points(self.mean, self.covariance))
        self.found.effective.append(float(len(predicted)))
        self.found.resampled.append(False)
        self.found.distance.append(distance)


class ParticleFilter(Filter):
    """Particle filter: systematic resampling, and rejuvenation of the parameters by the kernel of Liu and West (2001).

    The rejuvenation theta = a theta_j + (1 - a) mean + N(0, h^2 V) follows the weighted covariance V of the parameters
    and, with a^2 + h^2 = 1, keeps their mean and covariance.
    """

    def update(self, predicted: np.ndarray, measured: np.ndarray) -> None:
        """Multiply the weights by the likelihood of the measured values; resample if few members have weight."""
        squares = np.sum(np.square((measured - predicted) / self.settings.noise), axis=1)
        constant = measured.size * (0.5 * np.log(2 * np.pi) + np.log(self.settings.noise))
        with np.errstate(divide="ignore"):
            logs = np.log(self.weights * len(self.weights)) - 0.5 * squares - constant
        self.weights, log_mean = normalised(logs)
        self.evidence += log_mean
        self.found.effective.append(effective_sample_size(self.weights))
        self.found.distance.append(np.nan)
        self.found.resampled.append(self.found.effective[-1] < LEAST_SHARE * len(self.weights))

    def keep(self) -> None:
        """Append estimates of the present time, and then resample."""
        super().keep()
        if not self.found.resampled[-1]:
            return
        mean = self.weights @ self.normals
        centred = self.normals - mean
        covariance = (self.weights[:, None] * centred).T @ centred
        chosen = systematic(self.weights, float(self.random.random()))
        self.structures.resample(chosen)
        self.normals = self.normals[chosen]
        self.weights = np.full(len(chosen), 1.0 / len(chosen))
        if not self.normals.size:
            return
        shrinking = (3 * self.settings.discount - 1) / (2 * self.settings.discount)
        root = covariance_root(covariance, 1 - shrinking**2)
        moved = shrinking * self.normals + (1 - shrinking) * mean
        moved += self.random.standard_normal(self.normals.shape) @ root.T
        count = self.unknowns.of_parameters
        moved[:, :count] = self.structures.set_parameters(moved[:, :count], self.normals[:, :count])
        self.normals = moved


def _moments(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return mean and standard deviation of values [member, value] with weights of sum 1, shape [2, value]."""
    mean = weights @ values
    return np.stack([mean, np.sqrt(weights @ np.square(values - mean))])
