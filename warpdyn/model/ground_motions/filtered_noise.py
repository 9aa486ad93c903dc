"""Random ground motions: filtered white noise times an envelope; every sample has a different motion.

Motions are generated at nodes (equally spaced times) and are linear between nodes. Kernels generate a motion during
integration and do not store it; `FilteredNoise.motion` returns the motion of one sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from warpdyn.foundations.core.checks import check_memory, finite_numbers, real_number, whole_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.random_numbers import Purpose, normals
from warpdyn.model.ground_motions.excitation import THE_NOISE, SingleLoad, Timeline, substeps_of
from warpdyn.model.ground_motions.motions import GroundMotion

MOST_INTERVALS = 2**30  # kernels count nodes in 32-bit integers, with two blocks of random numbers per node
BYTES_OF_A_NODE = 200  # memory for random numbers of up to four states, their counters, and the path
LARGEST_FREQUENCY = 1e9  # rad/s; the fourth power of this frequency is finite
QUADRATURE = np.polynomial.legendre.leggauss(12)  # nodes and weights of Gauss-Legendre quadrature


@dataclass(frozen=True, eq=False)
class Recursion:
    """A stationary Gaussian process at nodes, computed as x1 = growth x0 + kick n with standard normal values n.

    x0 and x1 are the state vectors at successive nodes. The acceleration is the scalar product of `output` and x.

    Args:
        growth: Transition matrix of the state from one node to the next, shape [state, state].
        kick: Triangular factor of the covariance that is added between two nodes, shape [state, state].
        start: Triangular factor of the stationary covariance, which gives the first state, shape [state, state].
        output: Acceleration per unit of each state variable, shape [state].
    """

    growth: np.ndarray
    kick: np.ndarray
    start: np.ndarray
    output: np.ndarray


class _Spectrum:
    """Base class of spectra of the ground acceleration."""

    intensity: float
    load: ClassVar[str]  # name of the load in LOADS of the kernels

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:  # type: ignore[attr-defined] # each spectrum is a dataclass
            unit = " [m2/s3]" if name == "intensity" else " [rad/s]" if name.endswith("frequency") else ""
            real_number(f"{type(self).__name__}.{name}{unit}", getattr(self, name), above=0)

    def spectral_density(self, circular_frequency: ArrayLike) -> np.ndarray:
        """Return the two-sided spectral density [m2/s3] at circular frequencies [rad/s].

        Args:
            circular_frequency: Circular frequencies [rad/s], any shape.

        Raises:
            ValueError: If a frequency is not a finite number, or is above 1e9 rad/s.
        """
        values = finite_numbers("circular_frequency [rad/s]", circular_frequency)
        if np.any(np.abs(values) > LARGEST_FREQUENCY):
            raise ValueError(
                f"circular_frequency must be at most {LARGEST_FREQUENCY:g} rad/s, got {np.abs(values).max():g}"
            )
        return self._density(values)

    def _density(self, frequency: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    def system(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return A, B and c of the state equation x' = A x + B noise; the acceleration is c x."""
        raise NotImplementedError

    def recursion(self, interval: float) -> Recursion:
        """Return the process at nodes with this interval [s]; its statistics are exact for any interval."""
        return _recursion(self.intensity, *self.system(), interval)


@with_suggestions
@dataclass(frozen=True)
class WhiteNoise(_Spectrum):
    """White noise, approximated by a motion that is linear between nodes.

    Values at nodes are independent, with variance 2 pi intensity / interval. The spectral density is
    the intensity times sinc(frequency interval)^4, so that it equals the intensity at frequencies well below
    1 / interval.

    Args:
        intensity: Two-sided spectral density over circular frequency [m2/s3].

    Raises:
        ValueError: If the intensity is not finite and above 0.

    Example:
        >>> wd.FilteredNoise(wd.WhiteNoise(0.01), duration=10.0, interval=0.02).intervals
        500
    """

    intensity: float

    load = "white_noise"

    def _density(self, frequency: np.ndarray) -> np.ndarray:
        return np.full(frequency.shape, float(self.intensity))

    def recursion(self, interval: float) -> Recursion:
        """Return the process at nodes with this interval [s]: independent values at all nodes."""
        deviation = np.array([[np.sqrt(2 * np.pi * self.intensity / interval)]])
        return Recursion(np.zeros((1, 1)), deviation, deviation, np.ones(1))


@with_suggestions
@dataclass(frozen=True)
class KanaiTajimi(_Spectrum):
    """White noise that is filtered by an oscillator, which represents the ground (Kanai 1957, Tajimi 1960).

    The motion is the absolute acceleration of the oscillator u'' + 2 zeta_g w_g u' + w_g^2 u = -noise.

    Args:
        intensity: Two-sided spectral density of the noise over circular frequency [m2/s3].
        ground_frequency: Circular frequency of the ground w_g [rad/s].
        ground_damping_ratio: Damping ratio of the ground zeta_g [1].

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> spectrum = wd.KanaiTajimi(0.01, ground_frequency=15.0, ground_damping_ratio=0.6)
        >>> spectrum.spectral_density(np.array([0.0, 15.0])).round(4)
        array([0.01  , 0.0169])
    """

    intensity: float
    ground_frequency: float
    ground_damping_ratio: float

    load = "kanai_tajimi"

    def _density(self, frequency: np.ndarray) -> np.ndarray:
        ratio = (frequency / self.ground_frequency) ** 2
        viscous = 4 * self.ground_damping_ratio**2 * ratio
        return self.intensity * (1 + viscous) / ((1 - ratio) ** 2 + viscous)

    def system(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return A, B and c of the state equation x' = A x + B noise, with x = (u, u'); the acceleration is c x."""
        stiff, viscous = self.ground_frequency**2, 2 * self.ground_damping_ratio * self.ground_frequency
        return np.array([[0.0, 1.0], [-stiff, -viscous]]), np.array([0.0, -1.0]), np.array([-stiff, -viscous])


@with_suggestions
@dataclass(frozen=True)
class CloughPenzien(_Spectrum):
    """The Kanai-Tajimi motion after a high-pass filter, so that its displacement stays finite.

    The motion is the acceleration w'' of w'' + 2 zeta_f w_f w' + w_f^2 w = a, where a is the acceleration of
    KanaiTajimi (Clough and Penzien, Dynamics of Structures, 2nd ed. 1993, 28-2).

    Args:
        intensity: Two-sided spectral density of the noise over circular frequency [m2/s3].
        ground_frequency: Circular frequency of the ground [rad/s].
        ground_damping_ratio: Damping ratio of the ground [1].
        filter_frequency: Circular frequency w_f [rad/s] below which the motion is filtered out.
        filter_damping_ratio: Damping ratio zeta_f of the second filter [1].

    Raises:
        ValueError: If a value is not finite and above 0.

    Example:
        >>> ground, low_cut = (15.0, 0.6), (1.5, 0.6)  # rad/s, damping ratio
        >>> spectrum = wd.CloughPenzien(0.01, *ground, *low_cut)
        >>> spectrum.spectral_density(np.array([0.0, 15.0])).round(4)
        array([0.   , 0.017])
    """

    intensity: float
    ground_frequency: float
    ground_damping_ratio: float
    filter_frequency: float
    filter_damping_ratio: float

    load = "clough_penzien"

    @property
    def ground(self) -> KanaiTajimi:
        """The first filter (oscillator of the ground) as a KanaiTajimi spectrum."""
        return KanaiTajimi(self.intensity, self.ground_frequency, self.ground_damping_ratio)

    def _density(self, frequency: np.ndarray) -> np.ndarray:
        ratio = (frequency / self.filter_frequency) ** 2
        passed = ratio**2 / ((1 - ratio) ** 2 + 4 * self.filter_damping_ratio**2 * ratio)
        return self.ground._density(frequency) * passed

    def system(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return A, B and c of x' = A x + B noise, with x = (u, u', w, w'); the acceleration is c x."""
        of_ground, noise, acceleration = self.ground.system()
        stiff, viscous = self.filter_frequency**2, 2 * self.filter_damping_ratio * self.filter_frequency
        output = np.concatenate([acceleration, [-stiff, -viscous]])
        matrix = np.zeros((4, 4))
        matrix[:2, :2], matrix[2, 3], matrix[3] = of_ground, 1.0, output
        return matrix, np.concatenate([noise, np.zeros(2)]), output


Spectrum = WhiteNoise | KanaiTajimi | CloughPenzien


@with_suggestions
@dataclass(frozen=True)
class JenningsEnvelope:
    """An envelope that rises, is constant, and decays (Jennings, Housner and Tsai 1968).

    The envelope is (t / rise)^2 up to the time `rise`, then 1 for the time `strong`, then exp(-decay (t - rise -
    strong)).

    Args:
        rise: Duration of the rise [s]; 0: the motion starts at full strength.
        strong: Duration of the strong part [s].
        decay: Rate of decay after the strong part [1/s].

    Raises:
        ValueError: If a value is not finite or below 0.

    Example:
        >>> envelope = wd.JenningsEnvelope(rise=2.0, strong=4.0, decay=0.5)
        >>> envelope.at(np.array([1.0, 3.0, 8.0])).round(3)
        array([0.25 , 1.   , 0.368])
    """

    rise: float
    strong: float
    decay: float

    def __post_init__(self) -> None:
        for name in ("rise", "strong", "decay"):
            real_number(f"JenningsEnvelope.{name}", getattr(self, name), least=0)

    def at(self, time: ArrayLike) -> np.ndarray:
        """Return the values of the envelope [1] at the given times [s].

        Args:
            time: Times from the start of the motion [s], any shape; the envelope is 0 at negative times.

        Raises:
            ValueError: If a time is not a finite number.
        """
        times = finite_numbers("time [s]", time)
        rising = (times / self.rise) ** 2 if self.rise else np.ones_like(times)
        after = np.maximum(times - self.rise - self.strong, 0.0)
        shape = np.where(times < self.rise, rising, np.exp(-self.decay * after))
        return np.where(times < 0, 0.0, shape)


@with_suggestions
@dataclass(frozen=True)
class FilteredNoise(SingleLoad):
    """One random ground motion per structure: a stationary Gaussian process times an envelope.

    The motion of a sample depends only on the seed and the index of the sample: it is the same for any integration
    step, method and device. After the duration, the acceleration is zero and the structure vibrates freely.

    Each structure has a different motion. To compare structures under the same random motions, use a `Cloud` of the
    results of `motion`: `Cloud([noise.motion(i, seed=1) for i in range(32)])`.

    Args:
        spectrum: WhiteNoise, KanaiTajimi or CloughPenzien.
        duration: Duration of the motion [s].
        interval: Time between nodes [s]; the duration must be a multiple of it.
        envelope: A JenningsEnvelope; None: stationary motion.

    Raises:
        ValueError, TypeError: If a value is out of its range, or the interval does not divide the duration.

    Example:
        >>> noise = wd.FilteredNoise(wd.KanaiTajimi(0.01, 15.0, 0.6), 10.0, 0.02, wd.JenningsEnvelope(2.0, 4.0, 0.5))
        >>> noise.motion(sample=0, seed=1).duration  # motion of the first sample in a run with this seed
        10.0
    """

    spectrum: Spectrum
    duration: float
    interval: float
    envelope: JenningsEnvelope | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.spectrum, Spectrum):
            raise TypeError(f"spectrum must be WhiteNoise, KanaiTajimi or CloughPenzien, got {self.spectrum!r}")
        if self.envelope is not None and not isinstance(self.envelope, JenningsEnvelope):
            raise TypeError(f"envelope must be a JenningsEnvelope or None, got {self.envelope!r}")
        for name in ("duration", "interval"):
            value = real_number(f"FilteredNoise.{name} [s]", getattr(self, name), above=0)
            object.__setattr__(self, name, value)
        count = np.round(self.duration / self.interval)
        if count < 1 or abs(self.duration / self.interval - count) > 1e-6 * count:
            fewest = max(1, int(self.duration / self.interval))
            raise ValueError(
                f"interval {self.interval:g} s does not divide the duration, {self.duration:g} s: give "
                f"interval={self.duration / fewest:g} or interval={self.duration / (fewest + 1):g}"
            )
        if count > MOST_INTERVALS:
            raise ValueError(
                f"interval {self.interval:g} s divides the duration into more than {MOST_INTERVALS} intervals: give a "
                "longer interval="
            )

    @property
    def kernel_load(self) -> str:
        """Name of the excitation's kind of load, a key of LOADS in the kernels."""
        return self.spectrum.load

    def timeline(self, step: float | None, target: float, *, resample: bool) -> Timeline:
        """Return the time grid: integration steps that divide the interval between nodes."""
        count = substeps_of(self.interval, step, target, THE_NOISE)
        return Timeline((), np.array([self.interval]), np.array([count]), np.array([self.intervals]))

    def pack_values(self, timeline: Timeline) -> dict[str, np.ndarray]:
        """Return the arrays that kernels read: the process and the envelope at nodes, joined to one row."""
        process = self.spectrum.recursion(self.interval)
        parts = [process.growth, process.kick, process.start, process.output, self.envelope_at_nodes()]
        return {"noise": np.concatenate([part.ravel() for part in parts])}

    @property
    def intervals(self) -> int:
        """Number of intervals between nodes in the duration."""
        return round(self.duration / self.interval)

    def envelope_at_nodes(self) -> np.ndarray:
        """Return the envelope at every node [1], shape [node]."""
        nodes = self.intervals + 1
        what = f"duration={self.duration:g} s in intervals of {self.interval:g} s"
        check_memory(what, BYTES_OF_A_NODE * nodes, "give a shorter duration= or a longer interval=")
        time = self.interval * np.arange(nodes)
        return np.ones_like(time) if self.envelope is None else self.envelope.at(time)

    def motion(self, sample: int, seed: int = 0) -> GroundMotion:
        """Return the ground motion of one sample of a run.

        Args:
            sample: Index of the sample.
            seed: Seed of the run.

        Raises:
            ValueError: If `sample` or `seed` is not a whole number of at least 0.
        """
        sample, seed = whole_number("sample", sample, 0), whole_number("seed", seed, 0)
        envelope = self.envelope_at_nodes()
        process = self.spectrum.recursion(self.interval)
        states = process.output.size
        blocks = -(-states // 2)
        counters = np.arange(blocks * (self.intervals + 1)).reshape(-1, blocks)
        drawn = normals(seed, sample, Purpose.GROUND_MOTION, counters).reshape(len(counters), -1)[:, :states]
        path = np.empty_like(drawn)
        path[0] = process.start @ drawn[0]
        for node in range(1, len(path)):
            path[node] = process.growth @ path[node - 1] + process.kick @ drawn[node]
        acceleration = envelope * (path @ process.output)
        return GroundMotion(acceleration, self.interval, f"filtered noise {sample}", f"seed {seed}")


def _recursion(
    intensity: float, matrix: np.ndarray, noise: np.ndarray, output: np.ndarray, interval: float
) -> Recursion:
    """Return the process x' = A x + B noise at nodes as a recursion from node to node.

    The covariance that is added in an interval is 2 pi intensity times the integral of e^{As} B B^T e^{A^T s}. Its
    triangular factor is computed by QR decompositions, because a Cholesky decomposition of the covariance is inaccurate
    if the interval is short. First, the factor for a fraction of the interval is integrated by quadrature. Then the
    time is doubled repeatedly: up to the interval, and further until the process is stationary.
    """
    fastest = np.abs(np.linalg.eigvals(matrix)).max() * interval
    halvings = max(0, int(np.ceil(np.log2(fastest))))
    part = interval / 2**halvings
    times, weights = part * (QUADRATURE[0] + 1) / 2, part * QUADRATURE[1] / 2
    density = 2 * np.pi * intensity * weights
    factor = _triangular(np.array([np.sqrt(w) * expm(matrix * t) @ noise for t, w in zip(times, density, strict=True)]))
    growth = expm(matrix * part)
    for _ in range(halvings):
        growth, factor = growth @ growth, _triangular(np.vstack([factor.T, (growth @ factor).T]))
    left, start = growth, factor
    while np.abs(left).max() > np.finfo(float).eps ** 2:
        left, start = left @ left, _triangular(np.vstack([start.T, (left @ start).T]))
    return Recursion(growth, factor, start, output)


def _triangular(rows: np.ndarray) -> np.ndarray:
    """Return the lower triangular matrix L with L L^T = rows^T rows."""
    factor = np.asarray(np.linalg.qr(rows, mode="r")).T
    return factor * np.where(np.diag(factor) < 0, -1.0, 1.0)
