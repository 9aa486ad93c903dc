"""Particle filter of constant parameters without process noise: moves integrate candidates again from the start.

Without process noise, the parameters of a particle determine its whole response. After resampling, Metropolis steps
whose target is the posterior of all measurements up to the present time move the particles, so that the estimates are
exact except for the Monte Carlo error (iterated batch importance sampling: Chopin 2002, Biometrika 89).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from warpdyn.campaigns.inference.filters.filtering import LEAST_SHARE, Estimates
from warpdyn.campaigns.inference.filters.unknowns import Unknowns
from warpdyn.campaigns.inference.likelihood import Likelihood
from warpdyn.campaigns.inference.measured import FEWEST_POINTS, MeasuredResponse
from warpdyn.campaigns.inference.priors import Prior
from warpdyn.campaigns.inference.resampling import effective_sample_size, normalised
from warpdyn.campaigns.inference.responses import ResponseMisfit
from warpdyn.campaigns.inference.tempering import Proposals, Tempered, stage
from warpdyn.campaigns.integration.settings import Execution
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.scene.scene import Scene


class DataTempering:
    """Particles that follow the posterior of constant parameters from one measured time to the next.

    Args:
        scene: The scene: one structure under one motion.
        unknowns: Parameters and offsets, with a prior of the parameters.
        measured: The measured response.
        noise: Standard deviation of the measurement noise.
        execution: Device and threads.
        count: Number of particles.
        random: Generator of random numbers.
    """

    def __init__(
        self,
        scene: Scene,
        unknowns: Unknowns,
        measured: MeasuredResponse,
        noise: float,
        execution: Execution,
        count: int,
        random: np.random.Generator,
    ) -> None:
        assert unknowns.prior is not None
        self.scene, self.unknowns, self.measured, self.noise = scene, unknowns, measured, noise
        self.prior: Prior = unknowns.prior
        self.execution = execution
        self.proposals = Proposals(unknowns.variables, random)
        normals = random.standard_normal((count, unknowns.variables))
        self.particles = Tempered(normals, np.zeros(count), np.arange(count))

    def run(self) -> tuple[Estimates, np.ndarray, np.ndarray]:
        """Filter all measurements; return the estimates, and the variables and weights of the particles."""
        found, particles, first = Estimates(), self.particles, self.measured.first
        log_weights = np.where(self._allowed(particles.normals), 0.0, -np.inf)
        logs = self._logs(particles.normals)
        weights = normalised(log_weights)[0]
        for time in range(len(logs[0])):
            log_weights = log_weights + logs[:, time]
            weights, log_mean = normalised(log_weights)
            if not np.isfinite(log_mean):
                raise ValueError(
                    f"the likelihood of all {len(weights)} particles is 0 at time "
                    f"{(first + time) * self.measured.step:g} "
                    "s: the noise is too small, or the prior excludes the measured response. Correct noise= or the "
                    "prior"
                )
            found.unknowns.append(self.unknowns.summary(particles.normals, weights))
            found.effective.append(effective_sample_size(weights))
            found.log_evidence.append(particles.log_evidence + log_mean)
            found.distance.append(np.nan)
            enough = found.effective[-1] >= LEAST_SHARE * len(weights) or time + 1 < FEWEST_POINTS
            found.resampled.append(not enough)
            if enough:
                continue
            particles.log_likelihood = logs[:, : time + 1].sum(axis=1)
            stage(particles, log_weights, 1.0, self.proposals, self._likelihood(first + time + 1))
            log_weights, logs = np.zeros(len(weights)), self._logs(particles.normals)
            weights = np.full(len(weights), 1.0 / len(weights))
        return found, particles.normals, weights

    def _allowed(self, normals: np.ndarray) -> np.ndarray:
        """Return which particles have possible parameters."""
        return self.prior.allowed(self.prior.values(normals[:, : self.prior.variables]))

    def _logs(self, normals: np.ndarray) -> np.ndarray:
        """Return the logarithms of the likelihood of the measurements at each time, shape [particle, time]."""
        rows = np.flatnonzero(self._allowed(normals))
        values = self.prior.values(normals[rows, : self.prior.variables])
        misfit = ResponseMisfit(self.scene, self.prior, self.measured, self.execution, None)
        histories = misfit.histories(values)[:, self.measured.first :]
        offsets = self.unknowns.offsets(normals[rows])[:, None]
        difference = (self.measured.values[self.measured.first :] - histories - offsets) / self.noise
        constant = 0.5 * np.log(2 * np.pi) + np.log(self.noise)
        logs = np.full((len(normals), histories.shape[1]), -np.inf)
        with np.errstate(over="ignore", invalid="ignore"):
            found = -np.sum(0.5 * np.square(difference) + constant, axis=2)
        logs[rows] = np.where(np.isfinite(found), found, -np.inf)
        return logs

    def _likelihood(self, count: int) -> Likelihood:
        """Return the likelihood of the first `count` measurements, whose motion ends with them."""
        measured = replace(self.measured, values=self.measured.values[:count])
        known: Any = self.scene.excitation
        motion = known.motions[0]
        most = int(np.ceil((count - 1) * measured.step / motion.step * (1 - 1e-9))) + 1
        shorter = GroundMotion(np.asarray(motion.values)[: max(most, 2)], motion.step, motion.name)
        scene = replace(self.scene, excitation=replace(known, motions=(shorter,)), tail=None)
        misfit = ResponseMisfit(scene, self.prior, measured, self.execution, None)
        return Likelihood(self.prior, misfit, misfit.count, measured.channels, self.noise, self.unknowns.offset)
