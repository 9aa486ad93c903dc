"""Statistics of runs in regions: those of one process to the bit, whatever stops the run, and no tables of samples."""

import os
import random
import re
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from reduced_runs import CITY, CITY_LIMITS, LIMITS, MARKS, scene_of, simulate, statistics_of
from test_regions import failing, interrupted_after, small_regions  # noqa: F401  (a fixture by its name)

import warpdyn as wd
from warpdyn.campaigns.reductions.population import Population
from warpdyn.campaigns.reductions.reduction import Reduction
from warpdyn.campaigns.running.regions import job as jobs
from warpdyn.campaigns.running.regions.report import Report

pytestmark = MARKS
DRIFT = "peak_storey_drift_ratio"
VALUES = np.linspace(1e5, 3e6, CITY.buildings)
OF_ONE = [
    wd.DamageCounts(LIMITS, over=("structure", "motion"), each_place=True),
    wd.DemandMoments(DRIFT, over="motion", each_place=True),
    wd.LargestDemand("input_energy"),
    wd.DemandHistogram(
        DRIFT, [0.004, 0.01], quantiles=[0.5], over=("cell", "structure"), labels={"cell": [4, 7, 4] * 7}
    ),
]
OF_CITY = [
    wd.DamageCounts(CITY_LIMITS, over=("building", "motion")),
    wd.DamageLoss(CITY_LIMITS, {"slight": 0.05, "complete": (0.8, 0.2)}, VALUES, over="archetype"),
    wd.DemandMoments(DRIFT, over=("motion", "building")),
]
RUNS = {
    "crossed": OF_ONE,
    "one motion": OF_ONE,
    "sequence": [wd.DamageCounts(LIMITS, over=("event", "structure")), wd.DemandMoments(DRIFT, over="event")],
    "city cloud": OF_CITY,
    "city at sites": OF_CITY,
}


# What is written differs by the ending, not by the design.
ENDINGS = [(design, "nc") for design in RUNS] + [
    pytest.param(design, "zarr", marks=() if design == "city at sites" else pytest.mark.thorough) for design in RUNS
]


@pytest.mark.parametrize(("design", "suffix"), ENDINGS)
@pytest.mark.usefixtures("small_regions")
def test_statistics_of_regions_are_those_of_one_process(design, suffix, tmp_path, monkeypatch):
    if suffix == "zarr":
        pytest.importorskip("zarr")
    scene, path = scene_of(design), tmp_path / f"run.{suffix}"
    expected = simulate(scene, statistics=RUNS[design])
    regions = interrupted_after(0, monkeypatch)
    found = simulate(scene, statistics=RUNS[design], path=path)
    assert len(regions) > 2
    assert statistics_of(found).identical(statistics_of(expected))
    assert set(found.attrs) == set(expected.attrs)
    assert found.attrs["fingerprint"] == expected.attrs["fingerprint"]
    assert os.listdir(tmp_path) == [path.name]
    with xr.open_dataset(path) if suffix == "nc" else xr.open_zarr(path) as read:
        assert "sample" not in read.dims
        assert statistics_of(read).equals(statistics_of(expected))


def in_one_process(scene, statistics, **settings):
    """Return a run's statistics without a path, which does not divide it into regions."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Reduction, "partial", None)  # which would fail, were it called
        return wd.simulate(scene, statistics=statistics, **settings)


@pytest.mark.parametrize("design", ["crossed", "city cloud"])
@pytest.mark.usefixtures("small_regions")
def test_a_run_that_was_stopped_goes_on_and_counts_nothing_twice(design, tmp_path, monkeypatch, caplog):
    scene, path = scene_of(design), tmp_path / "run.nc"
    expected, settings = simulate(scene, statistics=RUNS[design]), {"statistics": RUNS[design], "path": path}
    for more in (2, 1):  # stopped twice
        with monkeypatch.context() as patched:
            interrupted_after(more, patched)
            with pytest.raises(KeyboardInterrupt) as stopped:
                simulate(scene, **settings)
    assert any("repeat the same call to" in note for note in stopped.value.__notes__)
    assert os.listdir(tmp_path) == [".run.nc.unfinished"]
    other = [wd.DamageCounts(CITY_LIMITS if design.startswith("city") else LIMITS)]
    with pytest.raises(FileExistsError, match="contains another run that is not finished"):
        simulate(scene, statistics=other, path=path)
    reports = sorted(tmp_path.rglob("*.npz"))
    assert len(reports) == 3
    reports[0].write_bytes(reports[0].read_bytes()[:-30])  # of which a kill cut the end: its region is run again
    with monkeypatch.context() as patched:
        done = interrupted_after(0, patched)
        found = simulate(scene, **settings)
    assert re.search(r"resumes after the \d+ of \d+ structures", caplog.text)
    assert statistics_of(found).identical(statistics_of(expected))
    whole = interrupted_after(0, monkeypatch)
    simulate(scene, statistics=RUNS[design], path=tmp_path / "other.nc")
    assert len(done) == len(whole) - 2
    assert sorted(os.listdir(tmp_path)) == ["other.nc", "run.nc"]


@pytest.mark.filterwarnings("ignore:.*of 60 samples")
@pytest.mark.meant_as_given("initial_velocity", "random_factor", "no_damping", "storey_height")
@pytest.mark.parametrize("size", [7, *(pytest.param(each, marks=pytest.mark.thorough) for each in (1, 17, 59))])
def test_regions_with_failures_are_counted_once(size, failing, tmp_path, monkeypatch):  # noqa: F811  (the fixture)
    scene, settings = failing
    statistics = [
        wd.DemandMoments("peak_storey_drift"),
        wd.DamageCounts({"slight": 0.5}, "peak_storey_drift", over="structure"),
    ]
    expected = in_one_process(scene, statistics, **settings)
    assert 0 < int(expected["failed_samples"].sum()) < 60
    monkeypatch.setattr(jobs, "LEAST_CPU_REGION", 1)
    monkeypatch.setattr(jobs, "REGIONS_PER_WORKER", 1)
    monkeypatch.setattr(jobs, "CPU_BLOCK", size)
    taken = interrupted_after(0, monkeypatch)
    found = wd.simulate(scene, statistics=statistics, path=tmp_path / "run.nc", **settings)
    assert taken == list(range(-(-60 // max(12, size // 12 * 12))))
    assert statistics_of(found).identical(statistics_of(expected))


@pytest.mark.usefixtures("small_regions")
def test_a_region_that_is_added_is_no_longer_held(tmp_path, monkeypatch):
    taken, save = [], Report.save

    def keep(self, path):
        taken.append(self)
        save(self, path)

    monkeypatch.setattr(Report, "save", keep)
    found = simulate(scene_of("city cloud"), statistics=OF_CITY, path=tmp_path / "run.nc")
    assert not list(tmp_path.rglob("*.npz"))  # they go when the run is done
    assert not any(report.rows for report in taken)
    assert sum(stop - start for start, stop in (report.structures for report in taken)) == CITY.buildings
    assert all(not report.statistics for report in taken)  # nothing is held of a region that is added
    assert int(found["damage_count_by_building_motion"].sum() + found["failed_samples"].sum()) == 3 * CITY.buildings


def test_parts_hold_the_cells_of_their_structures_alone():
    numbers = np.array([3, 7, 8])
    with Reduction(OF_CITY[:1], Population(scene_of("city cloud"), CITY.buildings), 1) as reduction:
        part = reduction.of_structures(numbers)
        drift = np.full((9, 3), 1.0)
        part.add(numbers, {"status": np.zeros(9, np.int8), DRIFT: drift})
        partial = part.partial()
        np.testing.assert_array_equal(
            partial["0/cells"], np.ravel_multi_index(np.ix_(numbers, range(3)), (25, 3)).ravel()
        )
        assert partial["0/counts"].dtype == np.uint8
        assert partial["0/counts"].shape == (1, 9, 7)  # three states, and four kinds of failure
        reduction.include(partial)
        counts = reduction.variables()[0]["damage_count_by_building_motion"][1]
    assert counts[numbers, :, 2].tolist() == [[1] * 3] * 3
    assert counts.sum() == 9


@pytest.mark.usefixtures("small_regions")
def test_what_cannot_run_leaves_what_stands_there(tmp_path):
    path, scene = tmp_path / "run.nc", scene_of("crossed")
    first = simulate(scene, statistics=OF_ONE[0], path=path)
    with pytest.raises(FileExistsError, match="contains another run"):
        simulate(scene, statistics=OF_ONE[1], path=path)
    with pytest.raises(ValueError, match="unknown over 'archetype'"):
        simulate(scene, statistics=wd.DamageCounts(LIMITS, over="archetype"), path=path, overwrite=True)
    with xr.open_dataset(path) as read:
        assert statistics_of(read).equals(statistics_of(first))
    other = simulate(scene, statistics=OF_ONE[1], path=path, overwrite=True)
    with xr.open_dataset(path) as read:
        assert statistics_of(read).equals(statistics_of(other))
    assert os.listdir(tmp_path) == ["run.nc"]


PROGRAM = """
import sys, warnings
from test_region_statistics import OF_ONE
from reduced_runs import scene_of
import warpdyn as wd
from warpdyn.campaigns.integration import stability_guard
from warpdyn.campaigns.running.regions import job

warnings.simplefilter("ignore")
stability_guard.SAMPLES_OF_A_RANGE = 1
job.LEAST_CPU_REGION, job.CPU_BLOCK = 1, 45
print("begun", flush=True)
wd.simulate(scene_of("cloud"), structures=3000, statistics=OF_MANY, device="cpu", seed=3, path=sys.argv[1])
""".replace("OF_MANY", "[wd.DamageCounts({'slight': 0.004}, over='structure'), OF_ONE[1]]")


@pytest.mark.thorough
def test_a_process_that_is_killed_at_random_moments_loses_and_doubles_nothing(tmp_path):
    def start(path):
        environment = os.environ | {"PYTHONPATH": os.pathsep.join([os.path.dirname(__file__), *sys.path])}
        return subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment
        )

    whole = start(tmp_path / "whole.nc")
    _, told = whole.communicate()
    assert whole.returncode == 0, told.decode()[-2000:]
    draw, went_on = random.Random(5), 0
    for moment in range(5):
        path, stopped = tmp_path / f"run{moment}.nc", 0
        while True:
            process = start(path)
            process.stdout.readline()
            try:
                _, told = process.communicate(timeout=draw.uniform(0.5, 3.0) if stopped < 2 else None)
            except subprocess.TimeoutExpired:
                process.kill()
                process.communicate()
                stopped += 1
                continue
            break
        assert process.returncode == 0, told.decode()[-2000:]
        went_on += b"resumes after" in told
        with xr.open_dataset(path) as found, xr.open_dataset(tmp_path / "whole.nc") as expected:
            assert statistics_of(found).identical(statistics_of(expected))
        path.unlink()
    assert went_on  # or the moments were all before the first region, and this shows nothing
    assert os.listdir(tmp_path) == ["whole.nc"]
