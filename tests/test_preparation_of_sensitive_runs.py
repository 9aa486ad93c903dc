"""Runs of sensitive buildings that kernels prepare: the host runs some samples again, as if it had prepared them."""

import itertools

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.campaigns.accuracy import precision, reliability
from warpdyn.campaigns.preparation import preparation

STRUCTURES, DIVISIONS = 40, 20
HYSTERETIC = wd.laws.Hysteretic(
    yield_force=1e5, ductility_2=3, force_ratio_2=1.1, ductility_3=8, force_ratio_3=0.4, damage_by_energy=0.05
)


@pytest.fixture
def by_kernels(monkeypatch):
    """Prepare all runs by kernels from now on; tell the blocks there were."""
    found, begin = [], preparation.Preparation.begin

    def prepare():
        monkeypatch.setattr(preparation, "is_large_on_gpu", lambda run: True)
        monkeypatch.setattr(
            preparation.Preparation, "begin", lambda self, *block: found.append(block[0]) or begin(self, *block)
        )
        return found

    return prepare


def scene_of(law, levels):
    """Return buildings that yield far at the last of some levels."""
    building = wd.ShearBuilding(
        mass=[2e4] * 2, stiffness=[2e7] * 2, height=[3.0] * 2, law=law, damping="rayleigh", damping_ratio=0.05
    )
    time = np.arange(100) * 0.02
    waves = sum(np.sin(2 * np.pi * frequency * time) for frequency in (0.9, 1.7, 2.9, 4.3))
    motions = [wd.GroundMotion(np.hanning(time.size) * waves, 0.02, "waves")]
    spread = {
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.3)),
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.4), per="storey"),
    }
    return wd.Scene(
        building,
        wd.Stripes(motions, [0.3, 0.9][-levels:], wd.PeakGroundAcceleration()),
        spread,
        recorders=("drift",),
        tail=0.2,
    )


@pytest.mark.parametrize("levels", [1, 2])
def test_runs_agree_with_the_host_in_every_division(levels, by_kernels, monkeypatch):
    # Some samples are run again in float64, and some are unreliable.
    monkeypatch.setattr(precision, "MOST_YIELD_DRIFTS", 20.0)
    monkeypatch.setattr(reliability, "LARGEST_CHANGE", 0.002)
    scene = scene_of(HYSTERETIC, levels)
    settings = {"structures": STRUCTURES, "device": "cpu", "dtype": "float32", "step": 0.02}
    with pytest.warns(UserWarning, match="were run again in float64") as by_host_warned:
        by_host = wd.simulate(scene, **settings)
    found = by_kernels()
    with pytest.warns(UserWarning, match="were run again in float64") as warned:
        whole = wd.simulate(scene, **settings)
    assert [str(each.message) for each in warned] == [str(each.message) for each in by_host_warned]
    assert [*map(len, found)] == [STRUCTURES]
    for name in ("status", "unreliable", "structure", "motion_index"):
        np.testing.assert_array_equal(whole[name], by_host[name])
    assert 0 < np.count_nonzero(whole["unreliable"] == 1) < whole.sizes["sample"]
    # Coefficients in float64 differ by rounding, by which few coefficients in float32 change their last bit.
    np.testing.assert_allclose(whole["peak_storey_drift"], by_host["peak_storey_drift"], rtol=1e-4)
    generator = np.random.default_rng(3)
    for _ in range(DIVISIONS):
        edges = [0, *np.flatnonzero(generator.random(STRUCTURES - 1) < 0.15) + 1, STRUCTURES]
        parts = [range(*map(int, edge)) for edge in itertools.pairwise(edges)]
        monkeypatch.setattr("warpdyn.campaigns.running.regions.region.divide", lambda *_, parts=parts, **named: parts)
        found.clear()
        divided = wd.simulate(scene, **settings)
        assert found == parts
        for name in whole.variables:
            assert whole[name].values.tobytes() == divided[name].values.tobytes(), name
