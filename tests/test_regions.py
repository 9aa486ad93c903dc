"""Runs region by region into a Zarr store: what plain xarray reads of it is what the run in memory is, to the bit."""

import os
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from test_portfolio import CITY, STRIPES
from test_sequence_runs import DRAWN, STRIPED
from test_sequences import make_building as make_shaken_building
from test_simulate import MOTIONS, assert_same_bits, make_oscillator, make_scene

import warpdyn as wd
from warpdyn.campaigns.integration import stability_guard
from warpdyn.campaigns.integration.stability_guard import StabilityFindings
from warpdyn.campaigns.running import blocks, run as runs
from warpdyn.campaigns.running.regions import job as jobs, report as reports
from warpdyn.campaigns.running.regions.report import Report, merged, state_of

pytest.importorskip("zarr")

CLOCK = {"history", "seconds_sampling", "seconds_integrating", "seconds_in_kernels"}  # attributes of the clock
CITY_SCENE = wd.Scene(wd.Portfolio(CITY.archetypes), STRIPES, tail=1.0, collapse_drift_ratio=0.05)
AIMED = {"target_error": 0.01, "method": "rk4", "structures": 9}
SCENES = {
    "stripes": (make_scene(), {"structures": 9, "checked_share": 0.5, "histories": wd.Histories((1, 40, 17, 0))}),
    "sequence": (wd.Scene(make_shaken_building(), STRIPED, DRAWN), {"structures": 5, "checked_share": 0.2}),
    "hypercube": (make_scene(sampling="latin_hypercube"), {"structures": 9, "dtype": "float64"}),
    "sobol": (make_scene(sampling="sobol"), {"structures": 9, "keep_inputs": False, "sample_error": 0.05}),
    "own structures": (make_scene(excitation=wd.OneMotionPerStructure(MOTIONS)), {"structures": 9}),
}
WITH_PORTFOLIO = SCENES | {"portfolio": (CITY_SCENE, {"checked_share": 0.5})}

pytestmark = [
    pytest.mark.filterwarnings("ignore:The balance properties of Sobol", "ignore:a tail of"),
    pytest.mark.meant_as_given(
        *("damping_ratio", "first_period", "first_period_over_height", "no_damping", "storey_height"),
        *("yield_base_shear_coefficient", "yield_drift_ratio", "collapse_drift_ratio", "force_over_weight"),
    ),
]


@pytest.fixture
def small_regions(monkeypatch):
    """Give regions a dozen samples at most, and each structure a limit on its reruns of its own."""
    monkeypatch.setattr(stability_guard, "SAMPLES_OF_A_RANGE", 1)
    monkeypatch.setattr(jobs, "LEAST_CPU_REGION", 1)
    monkeypatch.setattr(jobs, "CPU_BLOCK", 12)


def check_same(read, held):
    """Check that a run that was read from a store, or gathered from workers, is the one in memory, labels included."""
    read = read.load()
    assert_same_bits(held, read)
    assert set(read.coords) == set(held.coords)
    assert set(read.attrs) == set(held.attrs)
    for name in held.attrs.keys() - CLOCK:
        np.testing.assert_array_equal(read.attrs[name], held.attrs[name], err_msg=name)
    for name in held.variables:
        assert read[name].dims == held[name].dims, name
        assert read[name].dtype.itemsize == held[name].dtype.itemsize or read[name].dtype.kind == "U", name
        assert set(read[name].attrs) == set(held[name].attrs), name
        for key, value in held[name].attrs.items():
            np.testing.assert_array_equal(read[name].attrs[key], value, err_msg=f"{name} {key}")


@pytest.mark.parametrize("name", [*SCENES, pytest.param("portfolio", marks=pytest.mark.thorough)])
def test_the_store_is_what_the_run_in_memory_is(name, tmp_path, small_regions):
    scene, settings = WITH_PORTFOLIO[name]
    settings = {"seed": 3, "device": "cpu", **settings}
    held = wd.simulate(scene, **settings)
    returned = wd.simulate(scene, path=tmp_path / "run.zarr", **settings)
    assert os.listdir(tmp_path) == ["run.zarr"]
    assert not returned["status"]._in_memory
    check_same(returned, held)
    with xr.open_zarr(tmp_path / "run.zarr", consolidated=True) as read:
        chunks = read.chunksizes["sample"]
        check_same(read, held)
        assert len(chunks) > 1 or name == "portfolio"
        assert len(set(chunks[:-1])) <= 1  # regions are of equal size but the last
        assert wd.summary(read).splitlines()[0] == wd.summary(held).splitlines()[0]
        with xr.open_dataset(wd.write(read, tmp_path / "run.nc")) as written:
            assert_same_bits(held, written)


def test_a_pilot_chooses_once_for_a_run_that_goes_on(tmp_path, small_regions, monkeypatch):
    interrupted_after(2, monkeypatch)
    with pytest.raises(KeyboardInterrupt):
        wd.simulate(make_scene(), path=tmp_path / "run.zarr", device="cpu", **AIMED)
    monkeypatch.undo()
    monkeypatch.setattr(runs, "choose", None)  # which would fail, were it called
    run = wd.simulate(make_scene(), path=tmp_path / "run.zarr", device="cpu", **AIMED)
    chosen = {name: run.attrs[name] for name in ("method", "dtype", "longest_step")}
    again = wd.simulate(make_scene(), structures=9, device="cpu", **chosen)
    np.testing.assert_array_equal(run["peak_storey_drift"], again["peak_storey_drift"])


def interrupted_after(regions, monkeypatch):
    """Press Ctrl-C after some regions."""
    taken, take = [], runs.Run.take

    def counting(self, sink, part, place, report):
        take(self, sink, part, place, report)
        taken.append(place)
        if len(taken) == regions:
            raise KeyboardInterrupt

    monkeypatch.setattr(runs.Run, "take", counting)
    return taken


@pytest.mark.parametrize("name", ["stripes", pytest.param("portfolio", marks=pytest.mark.thorough)])
def test_a_run_that_was_stopped_goes_on_from_its_regions(name, tmp_path, small_regions, monkeypatch, caplog):
    scene, settings = WITH_PORTFOLIO[name]
    settings = {"seed": 3, "device": "cpu", **settings}
    held = wd.simulate(scene, **settings)
    with monkeypatch.context() as patched:
        interrupted_after(3, patched)
        with pytest.raises(KeyboardInterrupt) as stopped:
            wd.simulate(scene, path=tmp_path / "run.zarr", **settings)
    assert any("repeat the same call to" in note for note in stopped.value.__notes__)
    assert os.listdir(tmp_path) == [".run.zarr.unfinished"]
    with pytest.raises(FileExistsError, match="contains another run that is not finished"):
        wd.simulate(scene, path=tmp_path / "run.zarr", **(settings | {"seed": 4}))
    # A report that is cut short says nothing: its region is run again.
    found = sorted(tmp_path.rglob("*.npz"))
    assert len(found) == 3
    found[0].write_bytes(found[0].read_bytes()[:-30])
    with monkeypatch.context() as patched:
        done = interrupted_after(0, patched)
        check_same(wd.simulate(scene, path=tmp_path / "run.zarr", **settings), held)
    assert re.search(r"resumes after the \d+ of \d+ structures", caplog.text)
    whole = interrupted_after(0, monkeypatch)
    wd.simulate(scene, path=tmp_path / "other.zarr", **settings)
    assert len(done) == len(whole) - 2
    assert sorted(os.listdir(tmp_path)) == ["other.zarr", "run.zarr"]


@pytest.mark.thorough
def test_a_portfolio_goes_on_from_its_finished_groups(tmp_path, small_regions, monkeypatch, caplog):
    settings = {"seed": 3, "device": "cpu"}
    held = wd.simulate(CITY_SCENE, **settings)
    with monkeypatch.context() as patched:
        patched.setattr("warpdyn.campaigns.portfolio.labels.lay_out", interrupt)
        with pytest.raises(KeyboardInterrupt):
            wd.simulate(CITY_SCENE, path=tmp_path / "run.zarr", **settings)
    done = interrupted_after(0, monkeypatch)
    check_same(wd.simulate(CITY_SCENE, path=tmp_path / "run.zarr", **settings), held)
    assert not done
    assert "resumes after the 25 of 25 structures" in caplog.text
    assert os.listdir(tmp_path) == ["run.zarr"]


def interrupt(*arguments):
    raise KeyboardInterrupt


def test_what_stands_there_is_replaced_only_if_asked(tmp_path, small_regions):
    path, settings = tmp_path / "run.zarr", {"structures": 9, "device": "cpu"}
    first = wd.simulate(make_scene(), path=path, **settings).load()
    with pytest.raises(FileExistsError, match=r"contains another run .*overwrite=True"):
        wd.simulate(make_scene(), path=path, seed=1, **settings)
    with pytest.raises(FileExistsError, match="contains another run"):
        wd.simulate(make_scene(tail=0.2), path=path, **settings)
    check_same(xr.open_zarr(path), first)
    check_same(wd.simulate(make_scene(), path=path, **settings), first)  # the same run may stand there
    other = wd.simulate(make_scene(), path=path, seed=1, overwrite=True, **settings)
    check_same(other, wd.simulate(make_scene(), seed=1, **settings))
    assert os.listdir(tmp_path) == ["run.zarr"]


@pytest.mark.fast
def test_what_is_not_warpdyns_is_never_replaced(tmp_path):
    xr.Dataset({"a": ("x", [1.0])}).to_zarr(tmp_path / "theirs.zarr", zarr_format=2)
    (tmp_path / "folder.zarr").mkdir()
    (tmp_path / "file.zarr").write_text("")
    for name, said in {
        "theirs": "warpdyn did not write",
        "folder": "warpdyn did not write",
        "file": "not a folder",
    }.items():
        with pytest.raises(OSError, match=said):
            wd.simulate(make_scene(), path=tmp_path / f"{name}.zarr", overwrite=True)
    with pytest.raises(OSError, match="there is no folder"):
        wd.simulate(make_scene(), path=tmp_path / "nowhere" / "run.zarr")
    assert sorted(os.listdir(tmp_path)) == ["file.zarr", "folder.zarr", "theirs.zarr"]


@pytest.fixture
def failing(monkeypatch):
    """Return a run of storeys that need a 4th to a 64th of the step, with a budget that does not serve them all."""
    monkeypatch.setattr(stability_guard, "SAMPLES_OF_A_RANGE", 12)
    monkeypatch.setattr(stability_guard, "ALWAYS_AFFORDED", 16 * 16 * 80)  # 80 steps each, in rows of 16
    law = {"law": "bouc_wen", "yield_force": 2.0, "hardening_ratio": 0.0, "exponent": 2.0, "damping": "none"}
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1, 1.2))}
    scene = wd.Scene(wd.ShearBuilding(1e9, 1e3, 1.0, **law), wd.FreeVibration(4.0, velocity=1.0), scatter=scatter)
    settings = {"structures": 60, "step": 0.05, "dtype": "float64", "device": "cpu", "checked_share": 0.5}
    return scene, settings


@pytest.mark.filterwarnings("ignore:.*of 60 samples")
@pytest.mark.meant_as_given("initial_velocity", "random_factor", "no_damping", "storey_height")
@pytest.mark.parametrize("size", [20, *(pytest.param(each, marks=pytest.mark.thorough) for each in (1, 12, 59))])
def test_how_often_failures_are_run_again_does_not_depend_on_regions(size, failing, tmp_path, monkeypatch):
    scene, settings = failing
    whole = wd.simulate(scene, **settings)
    assert 0 < np.count_nonzero(whole["status"]) < 60
    monkeypatch.setattr(jobs, "LEAST_CPU_REGION", 1)
    monkeypatch.setattr(jobs, "REGIONS_PER_WORKER", 1)
    monkeypatch.setattr(jobs, "CPU_BLOCK", size)
    monkeypatch.setattr(blocks, "CPU_BLOCK", 7)  # which ends within a range of structures
    taken = interrupted_after(0, monkeypatch)
    check_same(wd.simulate(scene, path=tmp_path / "run.zarr", **settings), whole)
    # Regions have whole ranges of 12 structures, and each is run once.
    assert taken == list(range(-(-60 // max(12, size // 12 * 12))))


@pytest.mark.filterwarnings("ignore:.*of 60 samples")
@pytest.mark.meant_as_given("initial_velocity", "random_factor", "no_damping", "storey_height")
def test_failures_outside_of_a_range_change_nothing(failing):
    scene, settings = failing
    forces = np.asarray(wd.simulate(scene, **settings)["yield_force"]).ravel()
    found = {}
    for name, others in (("failing", forces), ("sound", np.full(60, 1e3))):
        yield_force = np.where(np.arange(60) // 12 == 2, forces, others)[:, None]
        given = replace(scene, scatter={"yield_force": wd.GivenValues(yield_force)})
        found[name] = wd.simulate(given, **settings | {"checked_share": None})
    in_range, outside = found["sound"]["status"][24:36], found["sound"]["status"][:24]
    assert 0 < np.count_nonzero(in_range) < 12
    assert not outside.any()
    assert found["failing"]["status"][:24].any()
    one, other = (run.isel(sample=slice(24, 36)) for run in found.values())
    assert_same_bits(one, other)


@pytest.mark.parametrize("on_unstable", ["flag", "raise"])
def test_messages_are_those_of_the_run(on_unstable, tmp_path, small_regions):
    building = wd.ShearBuilding([2e3, 1e3], [6e5, 4e5], [3.5, 3.0])
    scene = wd.Scene(building, wd.Cloud(MOTIONS), {"mass": wd.RandomFactor(wd.Lognormal(0.02, 0.5))}, tail=0.01)
    settings = {"structures": 8, "step": 0.01, "resample": True, "on_unstable": on_unstable, "device": "cpu"}
    told = []
    for more in ({}, {"path": tmp_path / "run.zarr"}):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                wd.simulate(scene, **settings, **more)
            except ValueError as error:
                caught = [*(str(each.message) for each in caught), str(error)]
            else:
                assert {each.filename for each in caught} == {__file__}
                caught = [str(each.message) for each in caught]
        told.append(caught)
    assert told[0] == told[1]
    assert any(re.search("stability limit of .* of 24 samples", text) for text in told[0])
    assert not (tmp_path / ".run.zarr.unfinished").exists()


def test_a_job_is_prepared_once(tmp_path, monkeypatch):
    prepared, init = [], jobs.Prepared.__init__
    monkeypatch.setattr(jobs.Prepared, "__init__", lambda self, job: (prepared.append(job.group), init(self, job))[1])
    wd.simulate(make_scene(), structures=2, path=tmp_path / "run.nc", device="cpu").close()
    assert prepared == [0]


@pytest.mark.fast
def test_all_that_findings_hold_is_merged():
    names = {*stability_guard.SUMS, *stability_guard.LEAST, *stability_guard.MOST, *stability_guard.FIRST}
    assert names | {*reports.OF_THE_RUN, "failed"} == set(vars(StabilityFindings(1, "rk4")))
    one, other, empty = (StabilityFindings(9, "rk4", "main") for _ in range(3))
    one.beyond, one.first, one.least, one.most, one.failed[2] = 3, "sample 1", 0.1, 2.0, 5
    other.beyond, other.first, other.least, other.never, other.failed[2] = 4, "sample 7", 0.05, 6, 1
    both = merged(empty, [state_of(one), state_of(other)])
    assert (both.beyond, both.first, both.least, both.most, both.never, both.failed[2]) == (
        7,
        "sample 1",
        0.05,
        2,
        6,
        6,
    )


@pytest.mark.fast
def test_a_report_is_read_as_it_was_written(tmp_path, failing):
    path = tmp_path / "report.npz"
    scalars = {"structures": (3, 5), "longest_period": 0.5, "seconds": {"sampling": 1.0}}
    errors = [[], [{"drift": np.array([0.1, np.nan])}]]
    report = Report(
        **scalars,
        findings=[state_of(StabilityFindings(9, "rk4"))],
        errors=errors,
        outcomes=(np.arange(2), np.array([4, 8])),
        messages=["beware"],
        rows={"drift": np.array([0.5, 0.25])},
    )
    report.save(path)
    read = Report.load(path)
    assert {name: getattr(read, name) for name in scalars} == scalars
    assert read.findings == report.findings  # with its infinite values
    assert read.messages == ["beware"]
    np.testing.assert_array_equal(read.errors[1][0]["drift"], [0.1, np.nan])
    np.testing.assert_array_equal(read.outcomes[1], [4, 8])
    assert os.listdir(tmp_path) == ["report.npz"]
    assert not read.rows  # they are read when they are needed
    np.testing.assert_array_equal(reports.rows_in(path, ["drift"], tmp_path)["drift"], [0.5, 0.25])
    assert Report.load(tmp_path / "none.npz") is None


@pytest.mark.fast
def test_what_cannot_be_is_said_before_anything_runs(tmp_path, monkeypatch):
    path = tmp_path / "run.zarr"
    with pytest.raises(ValueError, match="sample 400, but the run has samples 0 to 11"):
        wd.simulate(make_scene(), structures=2, path=path, histories=wd.Histories([400]), device="cpu")
    with pytest.raises(ValueError, match="memory must be at least"):
        wd.simulate(make_scene(), structures=2, path=path, memory=1000, device="cpu")
    with pytest.raises(TypeError, match=r"cluster must be a dask.distributed Client"):
        wd.simulate(make_scene(), cluster="tcp://127.0.0.1:8786")
    with pytest.raises(ValueError, match=r"path must be a Zarr store with cluster=, as 'run.zarr', got 'run.nc'"):
        wd.simulate(make_scene(), cluster=object(), path="run.nc")
    monkeypatch.setitem(__import__("sys").modules, "zarr", None)
    with pytest.raises(ImportError, match='pip install "distributed>='):
        wd.simulate(make_scene(), structures=2, path=path, device="cpu")
    assert not os.listdir(tmp_path)


def test_a_worker_of_another_version_that_comes_late_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(runs, "versions", lambda: ("0.0.1", "1", "2", "3"))
    with pytest.raises(
        RuntimeError, match=r"a worker that joined the run has warpdyn .* and not warpdyn 0\.0\.1, warp"
    ):
        wd.simulate(wd.Scene(make_oscillator(), wd.FreeVibration(1.0, velocity=1.0)), path=tmp_path / "run.zarr")
