"""Counts, sizes and steps are checked before anything is allocated, whatever memory a machine has."""

import resource

import numpy as np
import pytest
import xarray as xr
from sound_calls import LIMITS, OF_BUILDING, WAVE, motions

import warpdyn as wd
from warpdyn.campaigns.integration.sampler import Sampler
from warpdyn.engine.kernels import build, queues
from warpdyn.foundations.core import checks

pytestmark = [pytest.mark.fast, pytest.mark.filterwarnings("ignore:implausible|nothing is scattered")]
BUILDING = wd.ShearBuilding(**OF_BUILDING)
CLOUD = wd.Cloud(motions())
SCATTER = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
SCENE = wd.Scene(BUILDING, CLOUD, SCATTER, recorders=("drift",))
NOISE = wd.FilteredNoise(wd.WhiteNoise(0.01), 10.0, 0.01)
FIELD = xr.DataArray(
    np.ones((1, 2)),
    {"longitude": ("point", [0.0, 0.1]), "latitude": ("point", [0.0, 0.0]), "earthquake": ["a"]},
    ("earthquake", "point"),
    "PGA",
    {"units": "g"},
)
MODEL = wd.sites.JayaramBaker2009(0.0)


@pytest.fixture(autouse=True)
def no_kernel(monkeypatch):
    """Fail where a kernel would be built; a machine of 2 GB is simulated."""

    def refuse(*arguments, **named):
        pytest.fail("a kernel was reached")

    monkeypatch.setattr(queues.CpuQueue, "launch", refuse)
    monkeypatch.setattr(build, "build_kernel", refuse)
    monkeypatch.setattr(checks, "free_memory", lambda: 2 * 10**9)


def latin_hypercube():
    return wd.Scene(BUILDING, CLOUD, SCATTER, recorders=("drift",), sampling="latin_hypercube")


CASES = {
    "histories of a range": (lambda: wd.Histories(range(10**9)), "histories.samples asks for 1,000,000,000 histories"),
    "histories of a list": (lambda: wd.Histories([0] * (2**20 + 1)), "histories.samples asks for 1,048,577"),
    "structures of capacities": (
        # 4 motions and 2 limits, 64 bytes each
        lambda: wd.capacities(SCENE, LIMITS, structures=10**9),
        r"capacities\(\) of structures=1000000000 under 4 motions needs 512 GB of memory, but only 2 GB are free",
    ),
    "structures of a run": (lambda: wd.simulate(SCENE, structures=10**9), "1000000000 structures have more than"),
    "structures of a table": (lambda: wd.simulate(SCENE, structures=5 * 10**8), "structures times motions.* needs "),
    "structures of a Latin hypercube": (
        lambda: wd.simulate(latin_hypercube(), structures=5 * 10**8),
        "Latin hypercube of structures=500000000 needs 12 GB",
    ),
    "corner of a filter": (
        lambda: wd.records.band_pass(motions()[0], 1e-6, 20.0),
        r"lowest=1e-06 Hz makes 6e\+08 samples",  # 2 pads of 1.5 orders of 4, over 1e-6 Hz and 0.02 s
    ),
    "order of a filter": (lambda: wd.records.band_pass(motions()[0], 0.5, 20.0, 10**9), "order must be .* at most 20"),
    "step of a motion": (lambda: motions()[0].resampled(1e-12), r"step 1e-12 s makes 3.98e\+12 samples"),
    "step of zero": (lambda: motions()[0].resampled(0.0), "step .* above 0"),
    "step of a force": (lambda: wd.ForceHistory([[0.0], [1.0]], 1.0).resampled(1e-12), "step 1e-12 s makes"),
    "step of a run": (lambda: wd.simulate(SCENE, step=1e-12, resample=True), "step 1e-12 s makes|than .* steps"),
    "longest step of a run": (lambda: wd.simulate(SCENE, longest_step=1e-12), "longer step|more than"),
    "duration of a harmonic force": (
        lambda: wd.simulate(wd.Scene(BUILDING, wd.HarmonicForce([0.0, 1e4], 20.0, 1e300))),
        "the duration, 1e.300 s, would need",
    ),
    "duration of a free vibration": (
        lambda: wd.simulate(wd.Scene(BUILDING, wd.FreeVibration(1e12, velocity=0.1))),
        "the duration, 1e.12 s, would need",
    ),
    "tail": (lambda: wd.simulate(wd.Scene(BUILDING, CLOUD, tail=1e12)), "give a longer step= or a smaller Scene"),
    "duration of noise": (lambda: wd.FilteredNoise(wd.WhiteNoise(0.01), 1e12, 0.01), "interval .* divides the"),
    "nodes of noise": (
        lambda: wd.FilteredNoise(wd.WhiteNoise(0.01), 1e7, 0.01).motion(0),
        r"duration=1e\+07 s in intervals of 0.01 s needs 200 GB",  # 10^9 nodes
    ),
    "threads": (lambda: wd.simulate(SCENE, threads=10**9), "threads must be .* at most 4096"),
    "threads of spectra": (lambda: wd.response_spectra(motions(), [1.0], threads=10**9), "threads must be .* at most"),
    "replicates": (lambda: wd.fragility(xr.Dataset(), LIMITS, replicates=10**9), "replicates .* at most 1000000"),
    "levels": (lambda: wd.levels_for(SCENE, LIMITS, count=10**9), "count must be .* at most 1000"),
    "storeys of periods": (
        lambda: wd.ShearBuilding.from_periods([0.6], 10**9, 2e5, 3.0),
        "storeys must be .* at most 60",
    ),
    "storeys of a capacity curve": (
        lambda: wd.ShearBuilding.from_capacity([0.03, 0.3], [2e6, 3e6], 10**9, 2e5, 3.0),
        "storeys must be .* at most 60",
    ),
    "buildings of an archetype": (lambda: wd.Archetype(BUILDING, 10**10), "count must be .* at most 2147483647"),
    "buildings of a portfolio": (
        lambda: wd.Portfolio({name: wd.Archetype(BUILDING, 2 * 10**9) for name in "ab"}),
        "archetypes have 4,000,000,000 buildings",
    ),
    "fields": (
        lambda: wd.sites.correlated_fields(FIELD, MODEL, between=0.3, within=0.5, draws=10**9),
        "draws=1000000000 fields of 1 earthquakes at 2 points needs 80 GB",
    ),
    "residuals": (
        lambda: wd.sites.within_event_residuals([0.0, 0.1], [0.0, 0.0], MODEL, 10**9),
        "draws=1000000000 fields at 2 points needs 48 GB",
    ),
    "values of a range": (lambda: wd.GroundMotion(range(10**9), 0.01), "acceleration must have at most"),
    "parameters of a range": (lambda: wd.GivenValues(range(10**9)), "GivenValues.values must have at most"),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_size_is_refused_by_name(case):
    call, message = CASES[case]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(ValueError, match=message):
        call()
    # Of 10^9 values each takes 1 byte at least; the rest of a test takes some megabytes.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # kB


def test_memory_counts_histories(monkeypatch):
    """10 histories of some 400 steps of 2 storeys, with the variables of a chain, in 24 bytes a value."""
    monkeypatch.undo()
    with pytest.raises(
        ValueError, match=r"histories= of 10 samples .* needs .* MB of memory, but memory=\d+ .* allows"
    ):
        wd.simulate(
            wd.Scene(BUILDING, wd.Cloud([wd.GroundMotion(np.tile(WAVE, 100), 0.02)] * 10), recorders=("drift",)),
            histories=wd.Histories(range(10)),
            memory=66 * 2**20 + 2**20,
            device="cpu",
        )


def test_what_fits_is_not_refused():
    assert wd.Histories(range(1000)).samples[-1] == 999
    assert motions()[0].resampled(1e-4).step == 1e-4
    assert Sampler(BUILDING, SCATTER, {}, "latin_hypercube", 1000, 0).draw(np.arange(3))["yield_force"].shape == (3, 2)
    assert NOISE.motion(0).duration == 10.0
