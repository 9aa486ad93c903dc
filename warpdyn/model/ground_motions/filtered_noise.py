"""Random ground motions: filtered white noise under an envelope, a different one for every sample.

The kernels generate a motion node by node while they integrate and never store it; `FilteredNoise.motion` generates it
for one sample. It is linear between nodes, as a record is between its values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from warpdyn.foundations.core.checks import check_memory, finite_numbers, real_number, whole_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.foundations.core.random_numbers import Purpose, normals
from warpdyn.model.ground_motions.excitation import THE_NOISE, SingleLoad, Timeline, substeps_of
from warpdyn.model.ground_motions.motions import GroundMotion

MOST_INTERVALS = 2**30  # nodes are counted in 32 bits, with two blocks of random numbers each
BYTES_OF_A_NODE = 200  # random numbers of up to four states with their counters, and the path
LARGEST_FREQUENCY = 1e9  # rad/s; squares of squares stay finite
QUADRATURE = np.polynomial.legendre.leggauss(12)


@dataclass(frozen=True, eq=False)
class Recursion:
    """A stationary Gaussian process from node to node: x1 = growth x0 + kick n, with the acceleration `output` x.

    Args:
        growth: Matrix that takes the state over an interval, shape [state, state].
        kick: Triangular factor of the covariance that an interval adds, multiplied by standard normals n, shape
            [state, state].
        start: Triangular factor of the stationary covariance, for the first node, shape [state, state].
        output: Acceleration by state, shape [state].
    """

    growth: np.ndarray
    kick: np.ndarray
    start: np.ndarray
    output: np.ndarray


@with_suggestions
@dataclass(frozen=True)
class WhiteNoise:
    """White noise, as far as a motion that is linear between nodes can represent it.

    Values at nodes are independent, with variance 2 pi intensity / interval. The spectral density equals the intensity
    well below the frequency 1 / interval, and falls off towards it as sinc(frequency interval)^4.

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

    def __post_init__(self) -> None:
        real_number("WhiteNoise.intensity [m2/s3]", self.intensity, above=0)

    def spectral_density(self, circular_frequency: ArrayLike) -> np.ndarray:
        """Return the two-sided spectral density [m2/s3] at circular frequencies [rad/s].

        Args:
            circular_frequency: Circular frequencies [rad/s], any shape.

        Raises:
            ValueError: If a frequency is not a finite number.
        """
        return np.full(np.shape(_frequencies(circular_frequency)), float(self.intensity))

    def recursion(self, interval: float) -> Recursion:
        """Return the process from node to node, at a given interval [s]."""
        deviation = np.array([[np.sqrt(2 * np.pi * self.intensity / interval)]])
        return Recursion(np.zeros((1, 1)), deviation, deviation, np.ones(1))


@with_suggestions
@dataclass(frozen=True)
class KanaiTajimi:
    """White noise filtered by an oscillator that stands for the ground (Kanai 1957, Tajimi 1960).

    The motion is the absolute acceleration of u'' + 2 zeta_g w_g u' + w_g^2 u = -noise.

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

    def __post_init__(self) -> None:
        _check_positive(self)

    def spectral_density(self, circular_frequency: ArrayLike) -> np.ndarray:
        """Return the two-sided spectral density [m2/s3] at circular frequencies [rad/s].

        Args:
            circular_frequency: Circular frequencies [rad/s], any shape.

        Raises:
            ValueError: If a frequency is not a finite number.
        """
        ratio = (_frequencies(circular_frequency) / self.ground_frequency) ** 2
        viscous = 4 * self.ground_damping_ratio**2 * ratio
        return self.intensity * (1 + viscous) / ((1 - ratio) ** 2 + viscous)

    def system(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return A, B and c of x' = A x + B noise and the acceleration c x, where x is (u, u')."""
        stiff, viscous = self.ground_frequency**2, 2 * self.ground_damping_ratio * self.ground_frequency
        return np.array([[0.0, 1.0], [-stiff, -viscous]]), np.array([0.0, -1.0]), np.array([-stiff, -viscous])

    def recursion(self, interval: float) -> Recursion:
        """Return the process from node to node, an interval [s] apart: exact, however long that is."""
        return _recursion(self.intensity, *self.system(), interval)


@with_suggestions
@dataclass(frozen=True)
class CloughPenzien:
    """The Kanai-Tajimi motion without its lowest frequencies, so that its displacement stays finite.

    The motion is w'' of w'' + 2 zeta_f w_f w' + w_f^2 w = the acceleration of KanaiTajimi (Clough and Penzien,
    Dynamics of Structures, 2nd ed. 1993, 28-2).

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

    def __post_init__(self) -> None:
        _check_positive(self)

    @property
    def ground(self) -> KanaiTajimi:
        """The first filter."""
        return KanaiTajimi(self.intensity, self.ground_frequency, self.ground_damping_ratio)

    def spectral_density(self, circular_frequency: ArrayLike) -> np.ndarray:
        """Return the two-sided spectral density [m2/s3] at circular frequencies [rad/s].

        Args:
            circular_frequency: Circular frequencies [rad/s], any shape.

        Raises:
            ValueError: If a frequency is not a finite number.
        """
        ratio = (_frequencies(circular_frequency) / self.filter_frequency) ** 2
        passed = ratio**2 / ((1 - ratio) ** 2 + 4 * self.filter_damping_ratio**2 * ratio)
        return self.ground.spectral_density(circular_frequency) * passed

    def system(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return A, B and c of x' = A x + B noise and the acceleration c x, where x is (u, u', w, w')."""
        of_ground, noise, acceleration = self.ground.system()
        stiff, viscous = self.filter_frequency**2, 2 * self.filter_damping_ratio * self.filter_frequency
        output = np.concatenate([acceleration, [-stiff, -viscous]])
        matrix = np.zeros((4, 4))
        matrix[:2, :2], matrix[2, 3], matrix[3] = of_ground, 1.0, output
        return matrix, np.concatenate([noise, np.zeros(2)]), output

    def recursion(self, interval: float) -> Recursion:
        """Return the process from node to node, an interval [s] apart: exact, however long that is."""
        return _recursion(self.intensity, *self.system(), interval)


Spectrum = WhiteNoise | KanaiTajimi | CloughPenzien


@with_suggestions
@dataclass(frozen=True)
class JenningsEnvelope:
    """An envelope (t / rise)^2, then 1, then exp(-decay (t - rise - strong)) (Jennings, Housner and Tsai 1968).

    Args:
        rise: Length of the rise [s], 0 for none.
        strong: Length of the strong part [s].
        decay: Rate of decay after it [1/s].

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
        """Return the envelope at some times [s].

        Args:
            time: Times from the beginning of the motion [s], any shape; before it the envelope is 0.

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
    """One random base motion a structure: a stationary Gaussian process times an envelope, at rest after its end.

    A sample's motion depends on the seed and the sample's index alone: it is the same at any step, with any method and
    on any device. Free vibration follows the motion as it follows a record.

    Args:
        spectrum: WhiteNoise, KanaiTajimi or CloughPenzien.
        duration: Length of the motion [s].
        interval: Time between the nodes that are generated [s], which divides the duration.
        envelope: A JenningsEnvelope; None for a stationary motion.

    Raises:
        ValueError, TypeError: If a value is out of its range, or the interval does not divide the duration.

    Example:
        >>> noise = wd.FilteredNoise(wd.KanaiTajimi(0.01, 15.0, 0.6), 10.0, 0.02, wd.JenningsEnvelope(2.0, 4.0, 0.5))
        >>> noise.motion(sample=0, seed=1).duration  # the first sample's motion in a run of this seed
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
                f"interval {self.interval:g} s does not divide the duration, {self.duration:g} s: "
                f"{self.duration / fewest:g} s and {self.duration / (fewest + 1):g} s do"
            )
        if count > MOST_INTERVALS:
            raise ValueError(f"interval {self.interval:g} s divides the duration into more than {MOST_INTERVALS} parts")

    @property
    def kernel_load(self) -> str:
        """Row of the kernels' LOADS."""
        return self.spectrum.load

    def timeline(self, step: float | None, target: float, *, resample: bool) -> Timeline:
        """Return a grid of steps that divide the interval between nodes."""
        count = substeps_of(self.interval, step, target, THE_NOISE)
        return Timeline((), np.array([self.interval]), np.array([count]), np.array([self.intervals]))

    def pack_values(self, timeline: Timeline) -> dict[str, np.ndarray]:
        """Return the process, row by row, and the envelope."""
        process = self.spectrum.recursion(self.interval)
        parts = [process.growth, process.kick, process.start, process.output, self.envelope_at_nodes()]
        return {"noise": np.concatenate([part.ravel() for part in parts])}

    @property
    def intervals(self) -> int:
        """Intervals between nodes."""
        return round(self.duration / self.interval)

    def envelope_at_nodes(self) -> np.ndarray:
        """Return the envelope at every node, shape [node]."""
        nodes = self.intervals + 1
        what = f"duration={self.duration:g} s in intervals of {self.interval:g} s"
        check_memory(what, BYTES_OF_A_NODE * nodes, "take a shorter duration or longer intervals")
        time = self.interval * np.arange(nodes)
        return np.ones_like(time) if self.envelope is None else self.envelope.at(time)

    def motion(self, sample: int, seed: int = 0) -> GroundMotion:
        """Return the base motion of one sample of a run, given by its index and the run's seed.

        Args:
            sample: Index of the sample.
            seed: Seed of the run.

        Raises:
            ValueError: If one of them is no whole number from 0.
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


def _frequencies(circular_frequency: ArrayLike) -> np.ndarray:
    """Return circular frequencies [rad/s]; the square of a larger one than 1e9 has no use and may overflow."""
    values = finite_numbers("circular_frequency [rad/s]", circular_frequency)
    if np.any(np.abs(values) > LARGEST_FREQUENCY):
        raise ValueError(f"circular_frequency must be at most {LARGEST_FREQUENCY:g} rad/s")
    return values


def _check_positive(spectrum: KanaiTajimi | CloughPenzien) -> None:
    for name in spectrum.__dataclass_fields__:
        unit = " [m2/s3]" if name == "intensity" else " [rad/s]" if name.endswith("frequency") else ""
        real_number(f"{type(spectrum).__name__}.{name}{unit}", getattr(spectrum, name), above=0)


def _recursion(
    intensity: float, matrix: np.ndarray, noise: np.ndarray, output: np.ndarray, interval: float
) -> Recursion:
    """Return x' = A x + B noise from node to node.

    The covariance that an interval adds is the integral of e^{As} B B^T e^{A^T s} times 2 pi intensity. Its factor is
    computed by QR without forming the covariance, since Cholesky would lose digits in short intervals: by quadrature
    over a part of the interval; the part is then doubled up to the interval, and on to the stationary state.
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
    """Return the lower factor L of L L^T = rows^T rows."""
    factor = np.asarray(np.linalg.qr(rows, mode="r")).T
    return factor * np.where(np.diag(factor) < 0, -1.0, 1.0)
