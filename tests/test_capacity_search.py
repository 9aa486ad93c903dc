"""The search for capacities on demand curves that are known: no kernel runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from warpdyn.campaigns.incremental.search import Levels, Search

pytestmark = pytest.mark.fast

FIRST, HIGHEST, TOLERANCE = 1e-3, 8.0, 0.02
LIMIT = np.array([0.01, 0.03, np.inf])


class Curves:
    """Pairs whose demands are functions of the level: each is linear at the first level."""

    first_level, exponent = FIRST, 1.0

    def __init__(self, functions, collapse_level=2.0):
        self.functions, self.count = functions, len(functions)
        self.first_demand = np.array([float(f(np.float64(FIRST))) for f in functions])
        self.elastic_level, self.first_step = np.zeros(self.count), np.ones(self.count)
        self.collapse_level = np.full(self.count, collapse_level)
        self.whole = SimpleNamespace(queue=SimpleNamespace(device="cpu"))
        self.histories = 0
        self.asked = [[] for _ in functions]

    def elastic_level_of(self, limit):
        return self.first_level * limit / self.first_demand

    def demands(self, pair, level):
        self.histories += pair.size
        for each, value in zip(pair, level, strict=True):
            self.asked[each].append(value)
        return np.array([self.functions[each](value) for each, value in zip(pair, level, strict=True)])


def searched(*functions, ratio=1.1, limit=LIMIT, **rest):
    curves = Curves(functions, **rest)
    search = Search(curves, np.asarray(limit), HIGHEST, ratio, TOLERANCE)
    search.run()
    lower, upper, *_ = search.levels.brackets(np.arange(curves.count), search.limit)
    return curves, search, lower, upper


def softening(x):
    """Collapses at 1.5, and passes 0.01 at 1 / 3 and 0.03 at 1: a power law of the exponent 1 below 0.01."""
    return np.inf if x > 1.5 else 0.03 * x


def test_a_smooth_curve_and_its_collapse_are_bracketed_within_the_tolerance():
    curves, _, lower, upper = searched(softening)
    for found, true in enumerate((1 / 3, 1.0, 1.5)):
        assert lower[0, found] <= true <= upper[0, found]
        assert upper[0, found] / lower[0, found] - 1 <= TOLERANCE
    assert len(curves.asked[0]) == len(set(curves.asked[0])), "no level is run twice"


def test_a_smooth_curve_takes_two_levels_a_state_beyond_its_ladder():
    curves, _, _, _ = searched(*[lambda x: 0.03 * x] * 20, limit=[0.01, 0.03])
    ladder = np.ceil(np.log(1 / 0.1) / np.log(1.1)) + 1  # from 0.3 of the first passage to the second
    assert curves.histories / curves.count <= ladder + 2 * 2 + 4  # the last launch may climb four rungs too far


@pytest.mark.parametrize("jump", [0.2, 0.6, 0.9])
def test_a_jump_across_several_limits_is_one_bracket_of_all(jump):
    _, _, lower, upper = searched(lambda x: 0.001 * x if x <= jump else np.inf)
    assert np.all((lower <= jump) & (jump <= upper) & (upper / lower - 1 <= TOLERANCE))


def test_every_bracket_holds_the_first_passage_of_waving_curves():
    # Waves of a period of a factor 1.6 to 3 in the level: the ladder's ratio of 1.1 sees each of their peaks.
    random = np.random.default_rng(5)
    functions = [
        lambda x, a=a, w=w, p=p: 0.03 * x * (1 + a * (np.sin(w * np.log(x) + p) - np.sin(w * np.log(FIRST) + p)))
        for a, w, p in zip(random.uniform(0, 0.3, 60), random.uniform(6, 13, 60), random.uniform(0, 6, 60), strict=True)
    ]
    _, search, lower, upper = searched(*functions, limit=[0.01, 0.03])
    fine = np.geomspace(0.02, HIGHEST, 40_000)
    returned = 0
    for row, function in enumerate(functions):
        for state, limit in enumerate(search.limit):
            passes = function(fine) > limit
            true = fine[passes.argmax()]
            returned += np.any(np.diff(passes.astype(int)) < 0)
            assert lower[row, state] <= true * (1 + 1e-3), (row, state)
            assert upper[row, state] >= true * (1 - 1e-3), (row, state)
    assert returned > 20, "many of the curves come back within a limit, so that a later passage could be taken"


def test_a_passage_between_two_rungs_is_found_beside_the_peak():
    # It rises above the limit by 1 % only, over a tenth of a rung's width: both rungs beside it are within the limit.
    peak = HIGHEST * 1.1**-25 * 1.1**0.5

    def bump(x):
        return 0.025 * x / peak if x < 0.5 * peak else 0.0303 - 0.1 * np.log(x / peak) ** 2 + 0.01 * max(x - 1.3, 0)

    _, _, lower, upper = searched(bump, limit=[0.03])
    edge = peak * np.exp(-np.sqrt(0.0003 / 0.1))
    assert lower[0, 0] <= edge <= upper[0, 0]


def test_a_passage_before_the_highest_of_the_rungs_is_found():
    rung = HIGHEST * 1.1**-25
    x = np.log(rung) + np.log([1e-5, 1.1**-1, 1.0, 1.05, 1.1, 1.1**2, 2.0])
    y = np.log([0.0288e-5 * 1.1, 0.0288, 0.0290, 0.0305, 0.0292, 0.025, 0.05])
    _, _, lower, upper = searched(lambda level: float(np.exp(np.interp(np.log(level), x, y))), limit=[0.03])
    true = rung * np.exp(np.log(0.03 / 0.0290) / (np.log(0.0305 / 0.0290) / np.log(1.05)))
    assert lower[0, 0] <= true <= upper[0, 0]


def test_a_passage_between_two_rungs_that_both_rise_is_found():
    # Between the two it passes the limit and returns; the upper one is the higher, but hardly.
    rung = HIGHEST * 1.1**-25
    x = np.log(rung) + np.log([1e-5, 1.0, 1.05, 1.1, 3.0])
    y = np.log([0.0292e-5, 0.0292, 0.0305, 0.0297, 0.0297 * 3.0 / 1.1])
    _, _, lower, upper = searched(lambda level: float(np.exp(np.interp(np.log(level), x, y))), limit=[0.03])
    true = rung * np.exp(np.log(0.03 / 0.0292) / (np.log(0.0305 / 0.0292) / np.log(1.05)))
    assert lower[0, 0] <= true <= upper[0, 0]


def test_a_limit_that_is_never_passed_is_censored_at_the_highest_level():
    curves, _, lower, upper = searched(lambda x: 0.02 * (1 - np.exp(-x)), limit=[0.01, 0.03])
    assert upper[0, 1] == np.inf
    assert lower[0, 1] == HIGHEST
    assert lower[0, 0] <= np.log(2) <= upper[0, 0]
    assert max(curves.asked[0]) == HIGHEST


def test_a_demand_far_above_the_elastic_one_is_searched_below_the_first_rung():
    # Ten times the elastic demand from 0.02 on: the first rung, by the elastic response at 0.1, is beyond the passage.
    _, _, lower, upper = searched(lambda x: 0.03 * x * (1 if x <= 0.02 else 20), limit=[0.01, 0.3])
    assert lower[0, 0] <= 0.02 <= upper[0, 0]
    assert upper[0, 0] / lower[0, 0] - 1 <= TOLERANCE


def test_an_early_passage_below_the_first_rung_is_found():
    def early(x):
        return 0.03 * x if x <= 0.02 else 0.0105 if x < 0.03 else 0.007 if x < 0.05 else 0.5

    _, _, lower, upper = searched(early, limit=[0.01])
    assert lower[0, 0] <= 0.02 <= upper[0, 0]


def test_a_failed_history_fails_its_pair_alone():
    curves, search, lower, _ = searched(softening, lambda x: np.nan if x > 0.5 else 0.03 * x, softening)
    assert search.failed.tolist() == [False, True, False]
    assert np.isfinite(lower[[0, 2]]).all()
    assert len(curves.asked[1]) < 30


def test_elastic_levels_are_scaled_and_not_counted_as_run():
    levels = Levels(2)
    levels.add(np.array([0, 0, 1]), np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0]), np.array([False, True, True]))
    levels.add(np.array([1]), np.array([0.1]), np.array([1.0]), np.array([True]))
    assert levels.used.tolist() == [2, 2]
    assert levels.is_run.tolist() == [[False, True], [True, True]]
    lower, upper, below, above = levels.brackets(np.arange(2), np.array([1.5]))
    assert lower[:, 0].tolist() == [0.1, 0.1]
    assert upper[:, 0].tolist() == [0.2, 0.3]
    assert below[:, 0].tolist() == [1.0, 1.0]
    assert above[:, 0].tolist() == [2.0, 3.0]


def test_pairs_have_ladders_of_their_own_up_to_the_same_highest_level():
    first_step = np.array([0.25, 0.75])
    curves = Curves([softening] * 2)
    curves.first_step = first_step
    search = Search(curves, LIMIT, HIGHEST, 1.5, 0.5)
    search.run()
    lower, upper, *_ = search.levels.brackets(np.arange(2), LIMIT)
    true = np.array([1 / 3, 1.0, 1.5])
    assert np.all((lower <= true) & (true <= upper) & (upper / lower <= 1.5 * (1 + 1e-9)))
    np.testing.assert_allclose(np.log(HIGHEST / upper) / np.log(1.5) % 1, np.tile(first_step[:, None], 3), atol=1e-9)
    # A limit that is not passed is looked for at the highest level too.
    never = Curves([lambda x: 0.001 * x] * 2)
    never.first_step = first_step
    Search(never, LIMIT, HIGHEST, 1.5, 0.5).run()
    assert [max(asked) for asked in never.asked] == [HIGHEST, HIGHEST]


def test_a_failure_beyond_the_last_passage_leaves_a_pair_as_it_is_beside_many():
    def fails_late(x):
        return np.nan if x > 2.5 else 0.03 * x

    def fails_early(x):
        return np.nan if 0.5 < x < 0.7 else 0.03 * x

    # Alone, a pair has room for rungs beyond 2.5; beside others it climbs by four at a time.
    _, alone, *of_one = searched(fails_late, limit=[0.01, 0.03])
    _, many, *of_many = searched(*[fails_late] * 20, fails_early, limit=[0.01, 0.03])
    assert np.isnan(alone.levels.demand[0][np.isfinite(alone.levels.level[0])]).any()
    assert not alone.failed.any()
    assert many.failed.tolist() == [False] * 20 + [True]
    for one, each in zip(of_one, of_many, strict=True):
        np.testing.assert_array_equal(one[0], each[0])
