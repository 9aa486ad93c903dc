"""Stripes of pairs of motions: geometric mean, larger component, RotD50 and RotD100 against NumPy and SciPy."""

import numpy as np
import pytest
from scipy import signal

import warpdyn as wd
from warpdyn.model.ground_motions.measures.names import measure_named

pytestmark = pytest.mark.fast
STEP, COUNT, PERIOD, DAMPING = 0.01, 500, 0.6, 0.05
GRAVITY = 9.80665


def components(seed):
    random = np.random.default_rng(seed)
    time = STEP * np.arange(COUNT)
    rows = random.normal(size=(2, COUNT)) * np.exp(-(((time - 2) / 1) ** 2))
    rows[1] = 0.4 * rows[1] + 0.5 * rows[0]
    return rows


def pair(seed):
    x, y = (wd.GroundMotion(row, STEP, f"{seed}{axis}") for row, axis in zip(components(seed), "xy", strict=True))
    return wd.PairOfMotions(x, y, name=f"pair {seed}")


def histories(rows):
    """Return pseudo-accelerations of both components by SciPy, exact at 20 times in each step."""
    w = 2 * np.pi / PERIOD
    times = STEP / 20 * np.arange(20 * COUNT + 2000)
    system = signal.lti([-1.0], [1.0, 2 * DAMPING * w, w**2])
    fine = [np.interp(times, STEP * np.arange(COUNT), row, right=0.0) for row in rows]
    return np.array([w**2 * signal.lsim(system, each, times)[1] for each in fine])


def rotated(rows):
    x, y = histories(rows)
    return np.array([np.abs(np.cos(t) * x + np.sin(t) * y).max() for t in np.radians(np.arange(180))])


SPECTRAL = wd.SpectralAcceleration(PERIOD, DAMPING)
MEASURES = {
    "geometric mean of Sa": (wd.GeometricMean(SPECTRAL), lambda rows: np.sqrt(rotated(rows)[0] * rotated(rows)[90])),
    "geometric mean by default": (SPECTRAL, lambda rows: np.sqrt(rotated(rows)[0] * rotated(rows)[90])),
    "larger Sa": (wd.LargerComponent(SPECTRAL), lambda rows: max(rotated(rows)[0], rotated(rows)[90])),
    "larger PGA": (wd.LargerComponent(wd.PeakGroundAcceleration()), lambda rows: np.abs(rows).max()),
    "RotD50": (wd.RotatedSpectralAcceleration(PERIOD, DAMPING), lambda rows: np.percentile(rotated(rows), 50)),
    "RotD100": (wd.RotatedSpectralAcceleration(PERIOD, DAMPING, 100), lambda rows: rotated(rows).max()),
}


@pytest.mark.parametrize("name", MEASURES)
def test_stripes_scale_both_components_to_the_level(name):
    measure, due = MEASURES[name]
    stripes = wd.Stripes([pair(1), pair(2), pair(3)], [0.1, 0.3], measure)
    assignment = stripes.assign(np.arange(1), 0)
    for motion, level, scale in zip(assignment.motion, assignment.im_level, assignment.scale, strict=True):
        # A peak between two times of SciPy's histories is missed by at most 1e-4 of its size.
        assert due(scale * components(motion + 1)) == pytest.approx(level * GRAVITY, rel=1e-4), name


def test_the_larger_component_is_that_of_lists_of_motions_too():
    rows = components(5)
    motions = [
        wd.GroundMotion(row, STEP, axis, record="r", component=axis) for row, axis in zip(rows, "NE", strict=True)
    ]
    larger = wd.LargerComponent(wd.PeakGroundAcceleration())
    assert larger.values(motions) == pytest.approx([np.abs(rows).max()] * 2, rel=1e-15)
    assert larger.values(motions)[0] > wd.GeometricMean(wd.PeakGroundAcceleration()).values(motions)[0]
    with pytest.raises(ValueError, match="needs both components of motion 'N'"):
        larger.value(motions[0])
    with pytest.raises(TypeError, match="measure must be an intensity measure of one component"):
        wd.LargerComponent(larger)


def test_pairs_are_made_from_records_with_zeros_after_the_shorter_component():
    rows, step = components(5), {"step": STEP, "record": "r"}
    first = wd.GroundMotion(rows[0], name="a", component="N", **step)
    second = wd.GroundMotion(rows[1][:450], name="b", component="E", **step)
    up = wd.GroundMotion(rows[1], name="c", component="UP", **step)
    others = [
        wd.GroundMotion(row, STEP, axis, record="s", component=axis) for row, axis in zip(rows, "EN", strict=True)
    ]
    found = wd.PairOfMotions.from_records([first, up, *others, second])
    assert [each.name for each in found] == ["r", "s"]
    np.testing.assert_array_equal(found[0].y.acceleration, rows[0])
    np.testing.assert_array_equal(found[0].x.acceleration, [*rows[1][:450], *np.zeros(50)])
    assert [each.component for each in found[1].components] == ["E", "N"]
    with pytest.raises(ValueError, match="must have 2 horizontal components, has 1"):
        wd.PairOfMotions.from_records([first])
    with pytest.raises(ValueError, match=r"numbers must be equal: call PairOfMotions\.from_records\(motions\)"):
        wd.PairOfMotions(first, second)
    other_step = wd.GroundMotion(rows[1], 0.02, "b", record="r", component="E")
    with pytest.raises(ValueError, match="x has a step of"):
        wd.PairOfMotions.from_records([first, other_step])


@pytest.mark.parametrize(
    ("labels", "azimuths"),
    [
        (("N", "E"), (0, 90)),
        (("E", "N"), (90, 0)),
        (("NS", "EW"), (0, 90)),
        (("000", "270"), (0, 270)),
        (("180", "270"), (180, 270)),
        (("N30E", "N60W"), (30, 300)),
        (("HNN", "HNE"), (0, 90)),
    ],
)
def test_pairs_from_records_turn_anticlockwise_seen_from_above(labels, azimuths):
    """A motion along one line acts in x only, if the structure's x axis is turned to this line."""
    along, line = components(3)[0], 60.0  # of the line: degrees clockwise from north
    recorded = [
        wd.GroundMotion(along * np.cos(np.radians(line - azimuth)), STEP, label, record="r", component=label)
        for label, azimuth in zip(labels, azimuths, strict=True)
    ]
    (pair,) = wd.PairOfMotions.from_records(recorded)
    of_x = azimuths[labels.index(pair.x.component)]
    turned = pair.turned(of_x - line)  # an anticlockwise angle decreases the azimuth
    np.testing.assert_allclose(turned.x.acceleration, along, atol=1e-12)
    np.testing.assert_allclose(turned.y.acceleration, 0.0, atol=1e-12)


def test_pairs_without_azimuths_keep_the_order_of_the_records():
    first, second = (
        wd.GroundMotion(row, STEP, label, record="r", component=label)
        for row, label in zip(components(3), "TL", strict=True)
    )
    (pair,) = wd.PairOfMotions.from_records([first, second])
    assert [each.component for each in pair.components] == ["T", "L"]


@pytest.mark.parametrize("name", ["larger component of PGA", "Larger component Sa(0.5 s, 5 %)"])
def test_the_larger_component_has_a_name(name):
    found = measure_named(name)
    assert isinstance(found, wd.LargerComponent)
    assert measure_named(found.name) == found
    assert measure_named("larger component of nonsense") is None


def test_scenes_with_the_larger_component_are_built_again_from_json():
    deck = wd.LumpedStructure(
        {"x": 1e5, "y": 1e5},
        [wd.Spring(f"k{dof}", {dof: 1.0}, stiffness=2e7) for dof in "xy"],
        influence=[{"x": 1.0}, {"y": 1.0}],
        damping="modal",
        damping_ratio=0.05,
    )
    stripes = wd.Stripes([pair(1)], [0.1], wd.LargerComponent(SPECTRAL))
    scene = wd.Scene(deck, stripes)
    again = wd.Scene.from_json(scene.to_json(), [pair(1)])
    assert again.excitation.measure == stripes.measure


@pytest.mark.parametrize(
    "measure", [wd.SpectralAcceleration(PERIOD), wd.AverageSpectralAcceleration([PERIOD]), wd.PeakGroundAcceleration()]
)
def test_a_measure_of_one_component_takes_the_components_of_a_pair(measure):
    both = pair(1)
    with pytest.raises(
        TypeError, match=r"must be a GroundMotion, got PairOfMotions.* measure\.values\(pair\.components"
    ):
        measure.values([both])
    np.testing.assert_array_equal(measure.values(both.components), [measure.value(both.x), measure.value(both.y)])
