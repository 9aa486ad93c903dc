"""Integrals of fragility curves of any shape over hazard curves, by Gauss-Legendre quadrature.

The annual rate of a damage state is the integral over u = ln(intensity) of P(u) k lambda(u), with the fragility curve
P, the hazard curve lambda and its slope k. Panels end at the points of the hazard curve and at the kinks of the
fragility curve, so the integrand is smooth on each panel. On panels as wide as one dispersion, 16 nodes are exact to
rounding: the nearest poles (those of loglogistic curves) are sqrt(3) dispersions away.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from warpdyn.answers.risk.hazard_curves import HazardCurve

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)
_STEEPEST = 8.0  # largest decrease of ln(hazard rate) on a panel
_WIDEST = 1.0  # largest width of a panel in ln(intensity)
_AT_A_TIME = 1 << 21  # number of probabilities that are in memory at the same time


@dataclass(frozen=True, eq=False)
class NumericalShape:
    """A shape of fragility curves that is integrated numerically; each curve has a median and a dispersion.

    Args:
        name: Name of the shape.
        curve: Function of intensities, shape [point], and of medians and dispersions, shape [..., damage_state, 1],
            that returns the probability of exceedance.
        reach: Range in which the curves rise, in dispersions from the median, shape [2, damage_state]. Below this
            range, the probability is given by `tail`; above it, the probability is constant.
        drawn: Range in which curves are drawn, in dispersions from the median, shape [2, damage_state].
        width: Smallest length over which the curves change, in dispersions; infinite for straight lines between kinks.
        tail: Below the reach, the probability is proportional to intensity^(tail / dispersion); infinite: the
            probability is 0 there.
        kinks: Intensities at which the curves have kinks.
        first_line: Intensity up to which curves are a straight line from (0, 0); 0: there is no such line. The part of
            the line below the first point of the hazard curve is not counted, because the extrapolated hazard would
            give an unbounded rate there.
    """

    name: str
    curve: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
    reach: np.ndarray
    drawn: np.ndarray
    width: float = 1.0
    tail: float = np.inf
    kinks: np.ndarray = field(default_factory=lambda: np.zeros(0))
    first_line: float = 0.0

    method = "Gauss-Legendre quadrature of the fragility curve over the hazard curve, a power law between its points"

    def usual(self, median: np.ndarray, dispersion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the lowest and the highest intensity at which curves are drawn, each of shape [damage_state]."""
        low, high = median * np.exp(self.drawn * dispersion)
        return low, high

    def probability(self, intensity: np.ndarray, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
        """Return the probability of exceedance, shape [..., damage_state, point], at intensities of shape [point]."""
        return self.curve(np.asarray(intensity, dtype=np.float64), median[..., None], dispersion[..., None])

    def rates(
        self, hazard: HazardCurve, median: np.ndarray, dispersion: np.ndarray, *, ordered: bool = False
    ) -> np.ndarray:
        """Return the annual rates of the damage states [1/year], shape [..., damage_state].

        Args:
            hazard: The hazard curve.
            median: Medians [units of the hazard], shape [..., damage_state].
            dispersion: Dispersions [1], of the same shape.
            ordered: Whether crossing curves are corrected, so that a heavier state is at most as likely as a lighter
                one at every intensity.

        Returns:
            The rates. A rate is infinite if, towards intensity 0, the extrapolated hazard rises faster than the
            probability falls.
        """
        within, below, above = self._by_bin(hazard, hazard.intensity[[0, -1]], median, dispersion, ordered)
        return within.sum(axis=-1) + below + above

    def rates_by_bin(
        self, hazard: HazardCurve, edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return annual rates [1/year] from intensities within each bin, [..., bin], below all bins and above them."""
        return self._by_bin(hazard, edges, median, dispersion, False)

    def _by_bin(
        self, hazard: HazardCurve, edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray, ordered: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        shape, states = median.shape, median.shape[-1]
        middle, spread = median.reshape(-1, states), dispersion.reshape(-1, states)
        parts = np.full((len(middle), states, edges.size + 1), np.nan)
        # If a state has no curve in a replicate, its rate is NaN; until then the curve of another state is used.
        known = np.isfinite(middle) & np.isfinite(spread)
        first = np.argmax(known, axis=1)[:, None]
        middle, spread = (np.where(known, part, np.take_along_axis(part, first, 1)) for part in (middle, spread))
        # Rows with similar dispersions are integrated together, on the same panels.
        rows = np.flatnonzero(known.any(axis=1))
        rows = rows[np.argsort(spread[rows].min(axis=1))]
        while rows.size:
            panels = self._panels(hazard, edges, middle[rows[:1]], spread[rows[:1]])
            size = max(1, _AT_A_TIME // (panels.size * _NODES.size * states))
            some, rows = rows[:size], rows[size:]
            panels = self._panels(hazard, edges, middle[some], spread[some])
            parts[some] = self._integrated(hazard, edges, panels, middle[some], spread[some], known[some], ordered)
        parts = parts.reshape(*shape, edges.size + 1)
        return parts[..., 1:-1], parts[..., 0], parts[..., -1]

    def _panels(self, hazard: HazardCurve, edges: np.ndarray, median: np.ndarray, dispersion: np.ndarray) -> np.ndarray:
        """Return the ends of the integration panels in ln(intensity), for all rows of medians and dispersions."""
        points = np.log(hazard.intensity)
        reach = np.log(median) + self.reach[:, None] * dispersion
        low, high = reach[0].min(), reach[1].max()
        if self.first_line > 0:
            low = np.log(min(hazard.intensity[0], self.first_line))
        log_edges = np.log(edges)
        low, high = min(low, log_edges[0]) if not self.first_line else low, max(high, log_edges[-1])
        ends = np.concatenate([[low, high], points, log_edges, np.log(self.kinks[self.kinks > 0])])
        ends = np.unique(ends[(ends >= low) & (ends <= high)])
        segment = np.clip(np.searchsorted(points, ends[:-1], side="right") - 1, 0, points.size - 2)
        widest = min(_WIDEST, self.width * float(dispersion.min()))
        pieces = np.maximum(np.diff(ends) / widest, np.diff(ends) * hazard.slopes[segment] / _STEEPEST)
        count = np.maximum(np.ceil(pieces), 1).astype(int)
        return np.concatenate(
            [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], count, strict=True)]
            + [ends[-1:]]
        )

    def _integrated(
        self,
        hazard: HazardCurve,
        edges: np.ndarray,
        panels: np.ndarray,
        median: np.ndarray,
        dispersion: np.ndarray,
        known: np.ndarray,
        ordered: bool,
    ) -> np.ndarray:
        """Return annual rates from intensities below, within and above the bins, shape [row, damage_state, bin + 2]."""
        half = 0.5 * np.diff(panels)
        nodes = (0.5 * (panels[:-1] + panels[1:]))[:, None] + half[:, None] * _NODES
        points = np.log(hazard.intensity)
        segment = np.clip(np.searchsorted(points, panels[:-1], side="right") - 1, 0, points.size - 2)
        slope = hazard.slopes[segment][:, None]
        # Use the hazard slope of the whole panel, because rounding may move a panel's end across a hazard point.
        occurring = slope * hazard.annual_rate[segment][:, None] * np.exp(-slope * (nodes - points[segment][:, None]))
        at_nodes = np.append(nodes.ravel(), panels[[0, -1]])
        probable = np.where(known[..., None], self.probability(np.exp(at_nodes), median, dispersion), np.nan)
        if ordered:
            probable = np.minimum.accumulate(probable, axis=-2)
        probable, at_ends = probable[..., :-2], probable[..., -2:]
        weighted = (probable * (occurring * half[:, None] * _WEIGHTS).ravel()).reshape(*median.shape, -1, _NODES.size)
        of_panels = weighted.sum(axis=-1)
        bins = np.searchsorted(np.log(edges), 0.5 * (panels[:-1] + panels[1:]))
        parts = np.stack([of_panels[..., bins == part].sum(axis=-1) for part in range(edges.size + 1)], axis=-1)
        parts[..., -1] += at_ends[..., 1] * hazard.rate_of(np.exp(panels[-1]))
        if np.isfinite(self.tail):
            rise = hazard.slopes[0]
            with np.errstate(divide="ignore"):
                rest = at_ends[..., 0] * hazard.rate_of(np.exp(panels[0])) * rise / (self.tail / dispersion - rise)
            parts[..., 0] += np.where(self.tail / dispersion > rise, rest, np.inf)
        return parts
