"""Search for the lowest level at which a demand exceeds each limit: increasing levels first, then narrower brackets."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from warpdyn.campaigns.incremental.pairs import Pairs

# The lowest level of a pair is START times the level at which its elastic response would reach the first limit. If the
# demand at this level is above LOW_ENOUGH times the limit, lower levels are run too.
START, LOW_ENOUGH = 0.3, 0.6
# In one launch, the levels of a pair rise by a factor of about RISE, in at most MOST_LEVELS levels. If few pairs are
# left, more levels are run: a launch with up to FULL_LAUNCH histories takes no longer than a smaller one.
RISE, MOST_LEVELS, FULL_LAUNCH = 1.5, 4, {"cpu": 2**4, "cuda": 2**16}
# A bracket is first narrowed by interpolation, INTERPOLATIONS times. If this is not enough, because a demand may jump,
# the bracket is divided into at most MOST_PARTS parts. Example: from a ratio of 1.1 to a tolerance of 2 %, five parts
# need four histories, which is the cost of two divisions into three parts.
INTERPOLATIONS, MOST_PARTS = 2, 5
ROUNDING = 0.98  # width of a new bracket, divided by the tolerance


@dataclass(eq=False)
class Levels:
    """The intensity levels at which pairs (of a structure and a motion) were evaluated, with their demands.

    Args:
        pairs: Number of pairs.

    Attributes:
        level: Level of each evaluation, shape [pair, slot]; infinite in empty slots.
        demand: Demand at the level, shape [pair, slot]; infinite after a collapse, NaN if the history failed.
        is_run: Whether the history was integrated, instead of scaled from an elastic response, shape [pair, slot].
        used: Number of used slots of each pair, shape [pair].
    """

    pairs: int
    level: np.ndarray = field(init=False)
    demand: np.ndarray = field(init=False)
    is_run: np.ndarray = field(init=False)
    used: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.level = np.full((self.pairs, 0), np.inf)
        self.demand = np.full((self.pairs, 0), np.nan)
        self.is_run = np.zeros((self.pairs, 0), dtype=bool)
        self.used = np.zeros(self.pairs, dtype=np.int64)

    def add(self, pair: np.ndarray, level: np.ndarray, demand: np.ndarray, is_run: np.ndarray) -> None:
        """Add evaluations (pair, level, demand, is_run), shape [evaluation]; each pair's evaluations are contiguous."""
        begins = np.flatnonzero(np.append(True, np.diff(pair) != 0)) if pair.size else np.arange(0)
        counts = np.diff(np.append(begins, pair.size))
        slot = self.used[pair] + np.arange(pair.size) - np.repeat(begins, counts)
        missing = int(slot.max(initial=-1)) + 1 - self.level.shape[1]
        if missing > 0:
            padding = ((0, 0), (0, missing))
            self.level = np.pad(self.level, padding, constant_values=np.inf)
            self.demand = np.pad(self.demand, padding, constant_values=np.nan)
            self.is_run = np.pad(self.is_run, padding)
        self.level[pair, slot], self.demand[pair, slot], self.is_run[pair, slot] = level, demand, is_run
        self.used[pair[begins]] += counts

    def brackets(self, rows: np.ndarray, limit: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the lowest level that exceeds each limit and the highest level below it, with their demands.

        Args:
            rows: Indices of the pairs, shape [row].
            limit: The limits [units of the demand], shape [damage_state].

        Returns:
            Lower level, upper level, demand at the lower level, demand at the upper level, each of shape [row,
            damage_state]. If there is no lower level, it is 0 with the demand 0. If no level exceeds the limit, the
            upper level is infinite.
        """
        level, demand = self.level[rows], self.demand[rows]
        found = np.empty((4, rows.size, limit.size))
        place = np.arange(rows.size)
        for state, value in enumerate(limit):
            # An infinite limit is exceeded only by collapse.
            passes = demand > value if np.isfinite(value) else np.isposinf(demand)
            above = np.where(passes, level, np.inf)
            first = above.argmin(axis=1)
            upper = above[place, first]
            below = np.where(level < upper[:, None], level, 0.0)
            last = below.argmax(axis=1)
            lower = below[place, last]
            found[0, :, state], found[1, :, state] = lower, upper
            found[2, :, state] = np.where(lower > 0, demand[place, last], 0.0)
            found[3, :, state] = np.where(np.isfinite(upper), demand[place, first], np.nan)
        return found[0], found[1], found[2], found[3]

    def near_peaks(self, rows: np.ndarray, limit: np.ndarray, upper: np.ndarray, narrowest: float) -> np.ndarray:
        """Return levels near which a demand may exceed a limit and fall below it again, shape [row, any].

        Unused elements are NaN. The levels are halfway to the neighbours of two kinds of levels:

        - peaks: the demand is larger than at both neighbouring levels, and would exceed the limit if it grew further in
          proportion to the level;
        - shoulders: above the level the demand grows less than half as steeply as below it, and would exceed the limit
          halfway to the next level if it grew as steeply as below.

        Args:
            rows: Indices of the pairs, shape [row].
            limit: The limits [units of the demand], shape [damage_state].
            upper: Lowest level that exceeds each limit, shape [row, damage_state].
            narrowest: Logarithm of the smallest ratio of two levels between which another level is run.
        """
        order = np.argsort(self.level[rows], axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = np.log(np.take_along_axis(self.level[rows], order, axis=1))
            y = np.log(np.take_along_axis(self.demand[rows], order, axis=1))
            reach = np.diff(x, axis=1)
            rise = np.diff(y, axis=1)
            left, right, top = reach[:, :-1], reach[:, 1:], y[:, 1:-1]
            before, after = rise[:, :-1] / left, rise[:, 1:] / right
            is_peak = (before >= 0) & (after < 0)
            flattens = (before > 0) & (after < before / 2)
            near_peak, near_shoulder = np.zeros_like(is_peak), np.zeros_like(is_peak)
            for state, value in enumerate(np.log(limit)):
                within = (top <= value) & (x[:, 2:] < np.log(upper[:, [state]]))
                near_peak |= within & is_peak & (top + np.maximum(left, right) > value)
                near_shoulder |= within & flattens & (top + before * right / 2 > value)
            middle = x[:, 1:-1]
            below = np.where(near_peak & (left > narrowest), middle - left / 2, np.nan)
            above = np.where((near_peak | near_shoulder) & (right > narrowest), middle + right / 2, np.nan)
        return np.exp(np.concatenate([below, above], axis=1))


@dataclass(eq=False)
class Search:
    """Search for the capacities of all pairs (of a structure and a motion) at the same time.

    Args:
        pairs: The pairs.
        limit: Limits of the damage states, increasing, shape [damage_state]; infinite: exceeded only by collapse.
        highest: Highest level.
        ratio: Ratio of neighbouring levels.
        tolerance: Largest relative width of a bracket [1].

    Attributes:
        levels: All levels that were evaluated.
        failed: Whether a history of the pair failed below the lowest level that exceeds the last limit, shape [pair].
        levels_at_a_time: Smallest number of levels of a pair in one launch.
    """

    pairs: Pairs
    limit: np.ndarray
    highest: float
    ratio: float
    tolerance: float
    levels: Levels = field(init=False)
    failed: np.ndarray = field(init=False)
    levels_at_a_time: int = field(init=False)

    def __post_init__(self) -> None:
        pairs = self.pairs
        self.levels_at_a_time = int(np.clip(round(np.log(RISE) / np.log(self.ratio)), 1, MOST_LEVELS))
        self.levels, everything = Levels(pairs.count), np.arange(pairs.count)
        self.failed = np.isnan(pairs.first_demand)
        first = np.full(pairs.count, pairs.first_level)
        self.levels.add(everything, first, pairs.first_demand, np.ones(pairs.count, dtype=bool))

    def run(self) -> None:
        """Evaluate increasing levels of every pair, and then narrow every bracket to the tolerance."""
        self._increase()
        self._narrow()

    def _evaluate(self, pair: np.ndarray, level: np.ndarray) -> None:
        """Evaluate pairs (increasing indices, shape [evaluation]) at given levels in one launch; keep the demands."""
        demand = self.pairs.demands(pair, level)
        self.levels.add(pair, level, demand, level > self.pairs.elastic_level[pair])
        bad = np.isnan(demand)
        if bad.any():
            # Failures above a pair's last capacity do not count, because other pairs of the launch decide which levels
            # are run there.
            last = self.levels.brackets(pair[bad], self.limit[-1:])[1][:, 0]
            self.failed[pair[bad][level[bad] < last]] = True

    def _levels(self, pair: np.ndarray, number: np.ndarray) -> np.ndarray:
        """Return levels of pairs from level numbers, which are counted downwards from the highest level (number 0).

        The first step of each pair is a random share of a full step, so that the brackets of different pairs have
        different ends. The uncertainty of capacities within their brackets then averages out, even for wide brackets.
        """
        steps = np.where(number > 0, number - 1 + self.pairs.first_step[pair], 0.0)
        return self.highest * self.ratio**-steps

    def _numbers_below(self, level: np.ndarray) -> np.ndarray:
        """Return, for each pair, the number of its highest level that is not above the given level, shape [pair]."""
        steps = np.log(self.highest / level) / np.log(self.ratio) - 1e-9
        return np.where(steps > 0, np.maximum(np.ceil(steps - self.pairs.first_step), 0) + 1, 0).astype(np.int64)

    def _increase(self) -> None:
        """Evaluate increasing levels of each pair, up to the lowest level that exceeds the last limit."""
        pairs = self.pairs
        finite = self.limit[np.isfinite(self.limit)]
        with np.errstate(invalid="ignore"):
            first, last = (
                pairs.elastic_level_of(finite[end]) if finite.size else pairs.collapse_level for end in (0, -1)
            )
        lowest = self._numbers_below(np.clip(np.nan_to_num(START * first), pairs.first_level, self.highest))
        # The first launch contains the levels up to the one at which the elastic response would reach the last limit.
        until = np.minimum(self._numbers_below(np.clip(np.nan_to_num(last), pairs.first_level, self.highest)), lowest)
        following = lowest.copy()
        active = np.flatnonzero(~self.failed)
        count = (lowest - until + 1)[active]
        kind = "cpu" if pairs.whole.queue.device == "cpu" else "cuda"
        while active.size:
            pair = np.repeat(active, count)
            rise = np.arange(pair.size) - np.repeat(np.cumsum(count) - count, count)
            self._evaluate(pair, self._levels(pair, following[pair] - rise))
            following[active] -= count
            upper = self.levels.brackets(active, self.limit[-1:])[1][:, 0]
            active = active[np.isinf(upper) & (following[active] >= 0) & ~self.failed[active]]
            most = max(self.levels_at_a_time, FULL_LAUNCH[kind] // max(active.size, 1))
            count = np.minimum(most, following[active] + 1)
        self._decrease(lowest)

    def _decrease(self, lowest: np.ndarray) -> None:
        """Evaluate lower levels of each pair whose demand at its lowest level is near or above the first limit."""
        active = np.flatnonzero(~self.failed)
        # If the first limit is infinite (exceeded only by collapse), only collapsed samples need lower levels.
        near = LOW_ENOUGH * self.limit[:1] if np.isfinite(self.limit[0]) else self.limit[:1]
        count = self.levels_at_a_time
        while active.size:
            upper = self.levels.brackets(active, near)[1][:, 0]
            lowest_level = self._levels(active, lowest[active])
            active = active[(upper <= lowest_level * (1 + 1e-9)) & ~self.failed[active]]
            active = active[self._levels(active, lowest[active]) > self.pairs.first_level]
            pair = np.repeat(active, count)
            lower = self._levels(pair, lowest[pair] + np.tile(np.arange(1, count + 1), active.size))
            kept = lower > self.pairs.first_level
            if kept.any():
                self._evaluate(pair[kept], lower[kept])
            lowest[active] += count

    def _narrow(self) -> None:
        """Evaluate levels within each bracket until every bracket is as narrow as the tolerance."""
        active = np.flatnonzero(~self.failed)
        attempt = 0
        while active.size:
            lower, upper, below, above = self.levels.brackets(active, self.limit)
            is_open = np.isfinite(upper) & (lower > 0)
            with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
                is_open &= upper / lower > (1 + self.tolerance) * (1 + 1e-9)  # a bracket of exactly this ratio is done
                level = self._between(lower, upper, below, above, by_interpolation=attempt < INTERPOLATIONS)
            level[:, ~is_open] = np.nan
            near = self.levels.near_peaks(active, self.limit, upper, np.log1p(self.tolerance))
            # Sort the levels of each pair; a level that two damage states need is run once.
            level = np.sort(np.concatenate([*level, near], axis=1), axis=1)
            with np.errstate(invalid="ignore"):
                level[:, 1:][np.diff(level, axis=1) <= 1e-9 * level[:, 1:]] = np.nan
            row, column = np.nonzero(np.isfinite(level))
            if row.size:
                self._evaluate(active[row], level[row, column])
            active = active[np.unique(row)]
            active = active[~self.failed[active]]
            attempt += 1

    def _between(
        self, lower: np.ndarray, upper: np.ndarray, below: np.ndarray, above: np.ndarray, *, by_interpolation: bool
    ) -> np.ndarray:
        """Return levels to run within each bracket, shape [any, pair, damage_state]; NaN in unused elements.

        Interpolation: a power law of the demand against the intensity is fitted to both ends of the bracket. Two
        levels, one tolerance apart, enclose the intensity at which it reaches the limit of the demand. Division: levels
        divide the bracket into equal parts on a logarithmic scale. Division is used if the sample collapsed at an end
        of the bracket, or if `by_interpolation` is False.

        Args:
            lower, upper: Ends of the brackets, shape [pair, damage_state].
            below, above: Demands at these ends.
            by_interpolation: Whether interpolation is used if possible.
        """
        width = np.log1p(self.tolerance) * ROUNDING
        low, high = np.log(lower), np.log(upper)
        parts = np.clip(np.ceil((high - low) / width), 2, MOST_PARTS)
        number = np.arange(1, MOST_PARTS).reshape(-1, *[1] * low.ndim)
        found = np.where(number < parts, low + (high - low) * number / parts, np.nan)
        if by_interpolation:
            share = np.clip(np.log(self.limit / below) / np.log(above / below), 0, 1)
            centre = low + share * (high - low)
            first, second = centre - width / 2, centre + width / 2
            from_low, to_high = first <= low, second >= high
            is_smooth = np.isfinite(centre) & np.isfinite(above)
            found[:, is_smooth] = np.nan
            first = np.where(from_low, np.nan, np.where(to_high, high - width, first))
            second = np.where(to_high, np.nan, np.where(from_low, low + width, second))
            found[0] = np.where(is_smooth, first, found[0])
            found[1] = np.where(is_smooth, second, found[1])
        return np.exp(found)
