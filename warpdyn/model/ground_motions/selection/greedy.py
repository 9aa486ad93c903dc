"""Algorithms of the selection: simulated spectra, the records nearest to them, and greedy improvement.

Sources: Jayaram, Lin and Baker (2011), "A computationally efficient ground-motion selection algorithm for matching a
target response spectrum mean and variance", Earthquake Spectra 27(3); Baker and Lee (2018), "An improved algorithm for
selecting ground motions to match a conditional spectrum", Journal of Earthquake Engineering 22(4).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

from warpdyn.model.ground_motions.selection.target import TargetSpectrum

TRIALS = 20  # sets of simulated spectra; the best set is used
GRID = 0.1  # spacing of the scale factors that are tried if the target is unconditional


@dataclass(frozen=True)
class Problem:
    """Candidates of a selection and their error measure.

    Args:
        spectra: ln Sa of the candidates as recorded, with Sa in g, shape [candidate, period].
        factors: Scale factor of each candidate, if the target prescribes it, shape [candidate]; else None.
        scale: Smallest and largest scale factor.
        events: Index of the event of each candidate, shape [candidate].
        most_per_event: Largest number of selected records of one event.
        target: The target.
        weights: Weights of the errors of mean, standard deviation and skewness.
        statistic: "moments" or "kolmogorov_smirnov".
    """

    spectra: np.ndarray
    factors: np.ndarray | None
    scale: tuple[float, float]
    events: np.ndarray
    most_per_event: int
    target: TargetSpectrum
    weights: tuple[float, float, float]
    statistic: str

    @property
    def grid(self) -> np.ndarray:
        """Scale factors that are tried if the target is unconditional: the bounds, and multiples of GRID between."""
        low, high = self.scale
        if low == high:
            return np.array([low])
        steps = np.arange(np.ceil(low / GRID - 1e-9), np.floor(high / GRID + 1e-9) + 1) * GRID
        factors = np.unique(np.concatenate([[low], steps, [high]]))
        return factors[factors > 0]

    def is_free(self, chosen: np.ndarray) -> np.ndarray:
        """Return whether each candidate may be added to a set: it is not in the set, and its event is not full."""
        free = np.ones(len(self.spectra), bool)
        free[chosen] = False
        counts = np.bincount(self.events[chosen], minlength=int(self.events.max()) + 1)
        return free & (counts[self.events] < self.most_per_event)


def simulated_spectra(
    target: TargetSpectrum, number: int, weights: tuple[float, float, float], random: np.random.Generator
) -> np.ndarray:
    """Return spectra of the target distribution by Latin hypercube sampling, shape [number, period].

    Of TRIALS sets, the set whose mean, standard deviation and skewness are nearest to those of the target is returned.
    """
    factor, sigma = target.factor, target.dispersion
    best, least = np.empty((0, 0)), np.inf
    for _ in range(TRIALS):
        spectra = random.standard_normal((number, sigma.size)) @ factor.T
        # Keep the ranks, and replace the values by one value in each of `number` equally probable intervals.
        ranks = spectra.argsort(axis=0).argsort(axis=0)
        spectra = sigma * ndtri((ranks + random.random(spectra.shape)) / number)
        error = weights[0] * np.sum(spectra.mean(axis=0) ** 2) + weights[1] * np.sum((spectra.std(axis=0) - sigma) ** 2)
        varying = sigma > 0
        if varying.any() and number > 2:
            error += weights[2] * np.sum(_skewness(spectra[:, varying]) ** 2)
        if error < least:
            best, least = spectra, error
    return target.mean + best


def _skewness(values: np.ndarray) -> np.ndarray:
    """Return the skewness of each column."""
    centred = values - values.mean(axis=0)
    return np.mean(centred**3, axis=0) / np.mean(centred**2, axis=0) ** 1.5


def nearest_records(problem: Problem, simulated: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the index and scale factor of the record nearest to each simulated spectrum; no record is used twice."""
    chosen: list[int] = []
    factors: list[float] = []
    low, high = problem.scale
    for spectrum in simulated:
        if problem.factors is not None:
            scale = problem.factors
        else:  # the least-squares factor of spectral accelerations
            recorded = np.exp(problem.spectra)
            scale = recorded @ np.exp(spectrum) / np.sum(recorded**2, axis=1)
            scale = np.clip(scale, low, high) if low == high else scale
        distance = np.sum((problem.spectra + np.log(scale)[:, None] - spectrum) ** 2, axis=1)
        allowed = problem.is_free(np.array(chosen, int)) & (scale >= low * (1 - 1e-12)) & (scale <= high * (1 + 1e-12))
        if not allowed.any():  # no least-squares factor is within the bounds: use the nearest bound
            scale = np.clip(scale, low, high)
            distance = np.sum((problem.spectra + np.log(scale)[:, None] - spectrum) ** 2, axis=1)
            allowed = problem.is_free(np.array(chosen, int))
        best = int(np.argmin(np.where(allowed, distance, np.inf)))
        chosen.append(best)
        factors.append(float(scale[best]))
    return np.array(chosen), np.array(factors)


def improved(
    problem: Problem,
    chosen: np.ndarray,
    factors: np.ndarray,
    passes: int,
    is_good: Callable[[np.ndarray], bool] = lambda spectra: False,
) -> tuple[np.ndarray, np.ndarray]:
    """Return a selection after greedy improvement: each record is replaced by the best candidate, one after the other.

    Args:
        problem: Candidates and error measure.
        chosen: Indices of the selected candidates.
        factors: Their scale factors.
        passes: Largest number of passes over all places.
        is_good: Function of the scaled spectra ln Sa, shape [record, period], that ends the passes.

    Returns:
        Indices and scale factors after the passes.
    """
    chosen, factors = chosen.copy(), factors.copy()
    error_of = _moment_errors if problem.statistic == "moments" else _kolmogorov_smirnov
    grid = problem.grid if problem.factors is None else np.empty(0)
    for _ in range(passes):
        for place in range(chosen.size):
            others = np.delete(chosen, place)
            rest = problem.spectra[others] + np.log(np.delete(factors, place))[:, None]
            allowed = np.flatnonzero(problem.is_free(others))
            candidates = problem.spectra[allowed]
            if problem.factors is not None:
                scale = problem.factors[allowed]
                error = error_of(problem, rest, candidates + np.log(scale)[:, None])
            else:
                scale, error = np.full(allowed.size, grid[0]), np.full(allowed.size, np.inf)
                for factor in grid:
                    of_factor = error_of(problem, rest, candidates + np.log(factor))
                    is_better = of_factor < error
                    scale[is_better], error[is_better] = factor, of_factor[is_better]
            best = int(np.argmin(error))
            chosen[place], factors[place] = allowed[best], scale[best]
        if is_good(problem.spectra[chosen] + np.log(factors)[:, None]):
            break
    return chosen, factors


def _moment_errors(problem: Problem, rest: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """Return the sum of squared errors of mean and standard deviation with each candidate, shape [candidate]."""
    # Differences from the target mean, so that the variance loses no digits.
    centre, sigma, number = problem.target.mean, problem.target.dispersion, len(rest) + 1
    apart, others = candidates - centre, rest - centre
    mean = (others.sum(axis=0) + apart) / number
    squares = (np.sum(others**2, axis=0) + apart**2) / number
    # In stage two, the standard deviation divides by n if the factor is prescribed, and by n - 1 if it is searched.
    correction = 1.0 if problem.factors is not None or number < 2 else number / (number - 1)
    deviation = np.sqrt(np.maximum(correction * (squares - mean**2), 0.0))
    return problem.weights[0] * np.sum(mean**2, axis=1) + problem.weights[1] * np.sum((deviation - sigma) ** 2, axis=1)


def _kolmogorov_smirnov(problem: Problem, rest: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """Return the sum over periods of the Kolmogorov-Smirnov statistic with each candidate, shape [candidate].

    The statistic is computed at number + 1 points: the smallest value against 0, and sorted value i against i / number.
    """
    number, total = len(rest) + 1, np.zeros(len(candidates))
    place = np.arange(1, number + 1) / number
    for k, (mean, sigma) in enumerate(zip(problem.target.mean, problem.target.dispersion, strict=True)):
        if sigma == 0:
            continue
        others = np.sort(ndtr((rest[:, k] - mean) / sigma))
        value = ndtr((candidates[:, k] - mean) / sigma)
        at = np.searchsorted(others, value)
        before = np.concatenate([[0.0], np.maximum.accumulate(np.abs(others - place[:-1]))])
        after = np.concatenate([np.maximum.accumulate(np.abs(others - place[1:])[::-1])[::-1], [0.0]])
        smallest = np.minimum(value, others[0]) if others.size else value
        total += np.maximum.reduce([before[at], np.abs(value - place[at]), after[at], smallest])
    return total


def largest_errors(target: TargetSpectrum, spectra: np.ndarray) -> tuple[float, float]:
    """Return the largest relative errors of median and standard deviation (dividing by n - 1) over the periods.

    Standard deviations are compared at periods where that of the target is not zero.
    """
    median = float(np.max(np.abs(np.expm1(spectra.mean(axis=0) - target.mean))))
    varying = (target.dispersion > 0) & ~target.fixed
    if not varying.any() or len(spectra) < 2:
        return median, 0.0
    ratio = spectra[:, varying].std(axis=0, ddof=1) / target.dispersion[varying]
    return median, float(np.max(np.abs(ratio - 1)))
