"""Updates of ensemble Kalman filters and of the unscented Kalman filter."""

from __future__ import annotations

import numpy as np


def stochastic_update(
    members: np.ndarray, predicted: np.ndarray, measured: np.ndarray, noise: np.ndarray, perturbations: np.ndarray
) -> np.ndarray:
    """Return the members after an update with perturbed observations (Evensen 1994; Burgers and others 1998).

    x_j += G (y + e_j - h(x_j)) with the gain G = X S' (S S' + R)^-1. X and S are the anomalies of the members and of
    their predictions, divided by sqrt(N - 1).

    Args:
        members: Members, shape [member, variable].
        predicted: Predicted measurements of the members, shape [member, sensor].
        measured: Measured values, shape [sensor].
        noise: Covariance of the noise, shape [sensor, sensor].
        perturbations: Random errors with this covariance, shape [member, sensor].
    """
    gain = _gain(members, predicted, noise)
    return members + (measured + perturbations - predicted) @ gain.T


def square_root_update(
    members: np.ndarray, predicted: np.ndarray, measured: np.ndarray, noise: np.ndarray
) -> np.ndarray:
    """Return the members after a deterministic update with the symmetric square root (ensemble transform filter).

    The mean moves by G (y - mean of h), and the anomalies become X (I + S' R^-1 S)^(-1/2). The symmetric root keeps the
    mean, and gives exactly the covariance of the Kalman filter (Tippett and others 2003, Monthly Weather Review 131).
    Arguments as for `stochastic_update`.
    """
    anomalies, of_sensors = _anomalies(members), _anomalies(predicted)
    # (I + S' R^-1 S)^(-1/2) = I - V (1 - (1 + s)^(-1/2)) V' with the singular values s and vectors V of S' R^(-1/2).
    root = np.linalg.inv(np.linalg.cholesky(noise))
    left, singular, _ = np.linalg.svd(of_sensors @ root.T, full_matrices=False)
    shrinking = 1 - 1 / np.sqrt(1 + singular**2)
    reduced = anomalies - left @ (shrinking[:, None] * (left.T @ anomalies))
    mean = members.mean(axis=0) + _gain(members, predicted, noise) @ (measured - predicted.mean(axis=0))
    return mean + np.sqrt(len(members) - 1) * reduced


def _anomalies(values: np.ndarray) -> np.ndarray:
    """Return values minus their mean, divided by sqrt(N - 1), shape [member, value]."""
    return (values - values.mean(axis=0)) / np.sqrt(len(values) - 1)


def _gain(members: np.ndarray, predicted: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Return the gain X S' (S S' + R)^-1, shape [variable, sensor]."""
    of_sensors = _anomalies(predicted)
    crossed = _anomalies(members).T @ of_sensors
    return np.linalg.solve(of_sensors.T @ of_sensors + noise, crossed.T).T


def sigma_points(mean: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the 2 n points mean +- columns of sqrt(n covariance), with equal weights, shape [point, variable].

    This is the unscented transform with a central weight of 0 (Julier and Uhlmann 2004, Proceedings of the IEEE 92).
    """
    root = covariance_root((covariance + covariance.T) / 2, len(mean))
    return np.concatenate([mean + root.T, mean - root.T])


def covariance_root(covariance: np.ndarray, factor: float = 1.0) -> np.ndarray:
    """Return a matrix R with R R' = factor times a covariance matrix; rounding errors below 0 count as 0."""
    values, vectors = np.linalg.eigh(covariance)
    root: np.ndarray = vectors * np.sqrt(np.maximum(values, 0.0) * factor)
    return root


def unscented_update(
    points: np.ndarray, covariance: np.ndarray, predicted: np.ndarray, measured: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and covariance after the measurement.

    Args:
        points: Sigma points with equal weights, shape [point, variable].
        covariance: Covariance of the variables, shape [variable, variable].
        predicted: Predicted measurements of the points, shape [point, sensor].
        measured: Measured values, shape [sensor].
        noise: Covariance of the noise, shape [sensor, sensor].
    """
    centred, of_sensors = points - points.mean(axis=0), predicted - predicted.mean(axis=0)
    innovation = of_sensors.T @ of_sensors / len(points) + noise
    gain = np.linalg.solve(innovation, of_sensors.T @ centred / len(points)).T
    mean = points.mean(axis=0) + gain @ (measured - predicted.mean(axis=0))
    return mean, covariance - gain @ innovation @ gain.T


def innovation_density(
    predicted: np.ndarray, measured: np.ndarray, noise: np.ndarray, divisor: int
) -> tuple[float, float]:
    """Return the logarithm of the normal density of a measurement before the update, and its squared distance.

    Args:
        predicted: Predicted measurements, shape [member, sensor].
        measured: Measured values, shape [sensor].
        noise: Covariance of the noise, shape [sensor, sensor].
        divisor: Divisor of the sums of squares: N - 1 for random members, N for sigma points.
    """
    centred = predicted - predicted.mean(axis=0)
    covariance = centred.T @ centred / divisor + noise
    difference = measured - predicted.mean(axis=0)
    distance = float(difference @ np.linalg.solve(covariance, difference))
    return -0.5 * (distance + float(np.linalg.slogdet(2 * np.pi * covariance)[1])), distance
