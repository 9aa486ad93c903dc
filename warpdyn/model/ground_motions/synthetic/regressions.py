"""Parameters of synthetic motions for an earthquake scenario: Rezaeian and Der Kiureghian (2010)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.special import betaincinv, gammaincinv, ndtr

from warpdyn.foundations.core.checks import one_of, real_number, whole_number
from warpdyn.foundations.core.near_misses import suggests_names, with_suggestions
from warpdyn.foundations.core.random_numbers import Purpose, normals
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.synthetic.modulation import gamma_modulation
from warpdyn.model.ground_motions.synthetic.motions import (
    COLUMNS,
    SHARE_OF_PERIOD,
    checked_step,
    fastest_frequencies,
    synthetic_motions,
)

MECHANISMS = {"strike_slip": 0.0, "reverse": 1.0}
LEAST_SHAPE = 1.0  # the modulating function starts at 0 only for larger shapes
ATTEMPTS = 1000  # draws of a motion before an error
MOST_MOTIONS = 2**24

# Marginal distributions of the parameters. ln of the energy integral [g2 s]: mean and standard deviation.
LN_ARIAS = -4.8255, 1.4318
# Beta distributions: exponents, and bounds [s, s, 1].
DURATION, MIDDLE, DAMPING = (1.1314, 2.4474, 5.0, 45.0), (1.5792, 3.6405, 0.5, 40.0), (1.4250, 5.7208, 0.02, 1.0)
FREQUENCY = 4.0982, 1.4330  # gamma distribution: shape, and scale [Hz]
SLOPE = 4.8512, 6.7729, 17.095  # density c exp(a x) below 0 and c exp(-b x) above: c, a, b [s/Hz]
SLOPE_BOUNDS = -2.0, 0.5  # Hz/s
# Regressions of the standard normal values of the parameters: constant, and coefficients of magnitude, mechanism,
# distance and Vs30; standard deviations within and between events.
COEFFICIENTS = np.array(
    [
        (-2.2962, 2.9440, -0.0707, -1.3564, -0.2654, 0.5937, 0.2738),
        (-6.1946, 0.9703, -0.7034, 0.0087, -0.0007, 0.5688, 0.4574),
        (-5.0105, 0.6625, -0.3450, 0.0139, -0.0002, 0.4145, 0.5114),
        (2.2525, -0.2586, -0.0808, -0.0084, 0.0000, 0.7228, 0.6918),
        (-2.4886, 0.3440, 0.0441, 0.0026, -0.0001, 0.9529, 0.1286),
        (-0.2583, 0.1293, -0.4772, -0.0115, 0.0004, 0.7601, 0.6815),
    ]
)
CORRELATION = np.array(
    [
        (1.0000, -0.3555, 0.0066, -0.1545, 0.1341, -0.0078),
        (-0.3555, 1.0000, 0.6729, -0.1303, -0.1576, -0.1958),
        (0.0066, 0.6729, 1.0000, -0.2761, -0.1977, -0.2188),
        (-0.1545, -0.1303, -0.2761, 1.0000, -0.2034, 0.2814),
        (0.1341, -0.1576, -0.1977, -0.2034, 1.0000, -0.0137),
        (-0.0078, -0.1958, -0.2188, 0.2814, -0.0137, 1.0000),
    ]
)
FACTOR = np.linalg.cholesky(CORRELATION)


@with_suggestions
@dataclass(frozen=True)
class RezaeianDerKiureghian:
    """Synthetic ground motions of one horizontal component for an earthquake scenario.

    White noise passes a filter whose frequency changes with time, is multiplied by a modulating function, and passes a
    high-pass filter. Six parameters of each motion are drawn from regressions on magnitude, distance, Vs30 and
    mechanism, with correlated errors. Their medians of Sa are 1.0 to 1.3 times those of Boore et al. (2014) up to 1 s,
    and 1.4 to 2.1 times beyond it (M 6.5, 20 km, 760 m/s).

    Sources: Rezaeian and Der Kiureghian (2010), "Simulation of synthetic ground motions for specified earthquake and
    site characteristics", Earthquake Engineering & Structural Dynamics 39(10); the coefficients are those of the
    Broadband Platform of SCEC.

    Args:
        magnitude: Moment magnitude [1].
        distance: Closest distance to the rupture [km].
        vs30: Time-averaged shear-wave velocity of the upper 30 m [m/s].
        mechanism: "strike_slip" or "reverse".
        arias_intercept: Constant of the regression of the Arias intensity [1]. Sources differ: -2.2962 is the constant
            of the Broadband Platform; with -1.844 and `arias_factor=np.pi / 2`, medians of Sa are 1.08 to 1.12 times
            those of the default.
        arias_factor: The regression gives this factor [1] times the integral of the squared acceleration in g [g2 s].

    Raises:
        ValueError: If a value is out of range, or the mechanism is unknown.

    Example:
        >>> scenario = wd.RezaeianDerKiureghian(magnitude=6.5, distance=20.0, vs30=760.0)
        >>> scenario.median_parameters().round(3).to_dict("records")[0]["duration"]
        13.826
        >>> motions = scenario.motions(4, seed=1)
        >>> [motion.name for motion in motions]
        ['synthetic 0', 'synthetic 1', 'synthetic 2', 'synthetic 3']
    """

    magnitude: float
    distance: float
    vs30: float
    mechanism: str = "strike_slip"
    arias_intercept: float = -2.2962
    arias_factor: float = 1.0

    def __post_init__(self) -> None:
        for name, unit in (("magnitude", ""), ("distance", " [km]"), ("vs30", " [m/s]"), ("arias_factor", "")):
            value = real_number(f"RezaeianDerKiureghian.{name}{unit}", getattr(self, name), above=0)
            object.__setattr__(self, name, value)
        real_number("RezaeianDerKiureghian.arias_intercept", self.arias_intercept)
        if not 4 <= self.magnitude <= 9:
            raise ValueError(f"RezaeianDerKiureghian.magnitude must be from 4 to 9, got {self.magnitude:g}")
        if not 100 <= self.vs30 <= 3000:
            raise ValueError(f"RezaeianDerKiureghian.vs30 must be from 100 to 3000 m/s, got {self.vs30:g}")
        if self.distance > 300:
            raise ValueError(
                f"RezaeianDerKiureghian.distance must be at most 300 km, got {self.distance:g}: give kilometres"
            )
        one_of("mechanism", self.mechanism, MECHANISMS)

    @property
    def _means(self) -> np.ndarray:
        """Means of the standard normal values of the parameters, shape [parameter]."""
        plain = np.array([1.0, self.magnitude, MECHANISMS[self.mechanism], self.distance, self.vs30])
        logarithmic = np.array([1.0, self.magnitude / 7, plain[2], np.log(self.distance / 25), np.log(self.vs30 / 750)])
        means = COEFFICIENTS[:, :5] @ plain
        of_arias = np.concatenate([[self.arias_intercept], COEFFICIENTS[0, 1:5]])
        means[0] = of_arias @ logarithmic
        return means

    def median_parameters(self) -> pd.DataFrame:
        """Return the parameters without errors of the regressions; columns as in `parameters`, one row."""
        return _parameter_table(self._physical(self._means[None, :]), np.array([0]))

    @suggests_names
    def parameters(self, number: int, seed: int = 0, first: int = 0) -> pd.DataFrame:
        """Return random parameters of motions; a row depends only on the seed and on its index (up to rounding).

        Parameter sets for which the modulating function does not start at zero are drawn again (3 % of them for M 6.5
        and 20 km).

        Args:
            number: Number of motions.
            seed: Seed of the random numbers.
            first: Index of the first motion.

        Returns:
            Table with the columns that `synthetic_motions` takes, and the indices of the motions as index.

        Raises:
            ValueError: If an argument is out of range.

        Example:
            >>> scenario = wd.RezaeianDerKiureghian(6.5, 20.0, 760.0)
            >>> scenario.parameters(3, seed=1, first=1).index.tolist()
            [1, 2, 3]
        """
        number = whole_number("RezaeianDerKiureghian.parameters: number", number, 1, MOST_MOTIONS)
        first = whole_number("RezaeianDerKiureghian.parameters: first", first, 0, 2**40)
        seed = whole_number("RezaeianDerKiureghian.parameters: seed", seed, 0)
        means, sigma = self._means, np.hypot(COEFFICIENTS[:, 5], COEFFICIENTS[:, 6])
        index = first + np.arange(number)
        found, left = np.empty((number, len(COLUMNS))), np.arange(number)
        for attempt in range(ATTEMPTS):
            counter = 3 * attempt + np.arange(3)
            drawn = normals(seed, index[left][:, None], Purpose.SYNTHETIC_PARAMETERS, counter).reshape(left.size, 6)
            values = self._physical(means + sigma * (drawn @ FACTOR.T))
            shape, _ = gamma_modulation(values[:, 1], values[:, 2])
            good = shape > LEAST_SHAPE
            found[left[good]] = values[good]
            left = left[~good]
            if not left.size:
                return _parameter_table(found, index)
        raise ValueError(
            f"RezaeianDerKiureghian: no modulating function was found for {left.size} motions after {ATTEMPTS} draws: "
            "the scenario is too far from the records of the regressions; change magnitude= or distance="
        )

    @suggests_names
    def motions(
        self, number: int, seed: int = 0, first: int = 0, step: float = 0.01, *, device: str | None = None
    ) -> list[GroundMotion]:
        """Return synthetic motions; a motion depends only on the seed and on its index (up to rounding).

        Args:
            number: Number of motions.
            seed: Seed of the random numbers.
            first: Index of the first motion.
            step: Sampling step [s], at least 1e-4 s. A motion with high filter frequencies has a shorter step, divided
                by 2, 3, ..., so that it is at most 1/4 of the shortest period of the filter.
            device: Device that generates the motions: "cpu" or "cuda:0"; None: the first GPU, or the CPU if there is
                no GPU.

        Raises:
            ValueError: If an argument is out of range, or there is no such device.

        Example:
            >>> motions = wd.RezaeianDerKiureghian(7.0, 15.0, 400.0, "reverse").motions(8, seed=3)
            >>> design = wd.OneMotionPerStructure(motions, motion=range(8))  # one motion per structure
        """
        step = checked_step("RezaeianDerKiureghian.motions", step)
        table = self.parameters(number, seed, first)
        columns = {name: table[name].to_numpy() for name in table}
        fastest = fastest_frequencies(columns, *gamma_modulation(columns["duration"], columns["middle"]))
        parts = np.maximum(np.ceil(step * fastest / SHARE_OF_PERIOD), 1).astype(int)
        found: dict[int, GroundMotion] = {}
        for part in np.unique(parts):
            chosen = np.flatnonzero(parts == part)
            made = synthetic_motions(table.iloc[chosen], seed, step / part, device=device)
            found |= zip(chosen.tolist(), made, strict=True)
        return [found[place] for place in range(len(table))]

    def _physical(self, normal: np.ndarray) -> np.ndarray:
        """Return the parameters of COLUMNS for standard normal values, shape [motion, parameter]."""
        share = ndtr(normal)
        integral = np.exp(LN_ARIAS[0] + LN_ARIAS[1] * normal[:, 0]) / self.arias_factor  # g2 s
        columns = [np.pi / 2 * STANDARD_GRAVITY * integral]
        columns += [_beta(share[:, 1], *DURATION), _beta(share[:, 2], *MIDDLE)]
        columns += [FREQUENCY[1] * gammaincinv(FREQUENCY[0], share[:, 3])]
        columns += [_two_sided_exponential(share[:, 4]), _beta(share[:, 5], *DAMPING)]
        return np.stack(columns, axis=1)


def _parameter_table(values: np.ndarray, index: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(values, columns=list(COLUMNS), index=pd.Index(index, name="motion"))


def _beta(share: np.ndarray, a: float, b: float, low: float, high: float) -> np.ndarray:
    return low + (high - low) * betaincinv(a, b, share)


def _two_sided_exponential(share: np.ndarray) -> np.ndarray:
    """Return quantiles of the slope of the filter frequency [Hz/s], within its bounds."""
    c, a, b = SLOPE
    low, high = SLOPE_BOUNDS
    below = c / a * (1 - np.exp(a * low))
    above = c / b * (1 - np.exp(-b * high))
    mass = share * (below + above)  # the densities of the source integrate to 1 within rounding
    falling = np.log(a / c * np.minimum(mass, below) + np.exp(a * low)) / a
    rising = -np.log1p(-b / c * np.maximum(mass - below, 0.0)) / b
    return np.where(mass < below, falling, rising)
