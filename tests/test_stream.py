"""A run that is written as it goes: the file is what the run in memory would have been, whole or not there at all."""

import errno
import json
import os
import re

import netCDF4
import numpy as np
import pytest
import xarray as xr
from test_regions import interrupted_after, small_regions  # noqa: F401  (a fixture by its name)
from test_simulate import MOTIONS, assert_same_bits, make_oscillator, make_scene

import warpdyn as wd
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.running import blocks, pipeline
from warpdyn.campaigns.running.outputs import Outputs
from warpdyn.campaigns.running.regions.checkpoint import Checkpoint, fingerprint_of
from warpdyn.campaigns.running.regions.job import machines_of
from warpdyn.engine.kernels import queues as devices
from warpdyn.foundations.files import netcdf
from warpdyn.foundations.files.unfinished import Unfinished

pytestmark = pytest.mark.meant_as_given("storey_height")

CHANGES = {"history", "seconds_sampling", "seconds_integrating", "seconds_in_kernels"}  # attributes of the clock
SYSTEM = wd.LinearSystem([2.0, 1.0], np.zeros((2, 2)), [[300.0, -100.0], [-100.0, 100.0]])
SCENES = {
    "stripes": (make_scene(), {"checked_share": 0.5, "histories": wd.Histories((1, 0))}),
    "individual": (make_scene(excitation=wd.OneMotionPerStructure(MOTIONS)), {"dtype": "float64"}),
    "without inputs": (make_scene(), {"keep_inputs": False}),
    "adaptive": (make_scene(scatter={}), {"method": "dormand_prince54"}),
    "system": (
        wd.Scene(SYSTEM, wd.FreeVibration(1.0, velocity=0.1), {"mass": wd.RandomFactor(wd.Lognormal(1, 0.1))}),
        {},
    ),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.usefixtures("small_regions")
def test_the_file_is_what_the_run_in_memory_is(name, tmp_path, monkeypatch):
    monkeypatch.setattr(blocks, "CPU_BLOCK", 10)
    scene, settings = SCENES[name]
    settings = {"structures": 7, "seed": 3, "device": "cpu", **settings}
    held = wd.simulate(scene, **settings)
    with wd.simulate(scene, path=tmp_path / "run.nc", **settings) as read:
        assert os.listdir(tmp_path) == ["run.nc"]
        assert set(read.attrs) == set(held.attrs)
        for each in held.attrs.keys() - CHANGES:
            np.testing.assert_array_equal(read.attrs[each], held.attrs[each], err_msg=each)
        assert set(read.coords) == set(held.coords)
        for each in held.variables:
            xr.testing.assert_identical(read[each].load().drop_attrs(), held[each].drop_attrs())
            assert read[each].dtype.kind == held[each].dtype.kind
            assert read[each].dtype.itemsize == held[each].dtype.itemsize or read[each].dtype.kind == "U"
            mine, theirs = ({key: str(value) for key, value in run[each].attrs.items()} for run in (held, read))
            assert theirs == mine, each
        text = wd.summary(read)
    assert f"{held.sizes['sample']} samples" in text
    # And what is written from memory reads the same.
    with xr.open_dataset(wd.write(held, tmp_path / "again.nc")) as again:
        xr.testing.assert_identical(again.load(), held)


def test_values_are_read_when_they_are_asked_for(tmp_path):
    with wd.simulate(make_scene(), structures=3, path=str(tmp_path / "run.nc")) as run:
        assert not run["peak_storey_drift"]._in_memory
        assert np.isfinite(run["peak_storey_drift"].values).all()


def fail_in_the_second_region(monkeypatch, error):
    launches = []

    def launch(*arguments, **options):
        launches.append(arguments)
        if len(launches) == 2:
            raise error
        return original(*arguments, **options)

    original = devices.CpuQueue.launch
    monkeypatch.setattr(devices.CpuQueue, "launch", launch)


def fail_at_the_end(monkeypatch, error):
    def replace(source, target):
        if target.name == "run.nc":
            raise error
        return original(source, target)

    original = os.replace
    monkeypatch.setattr(os, "replace", replace)


@pytest.mark.parametrize("fail", [fail_in_the_second_region, fail_at_the_end])
@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("out of memory"), OSError("disk full")])
@pytest.mark.parametrize("existed", [True, False])
def test_nothing_is_left_of_an_unfinished_run(fail, error, existed, tmp_path, small_regions, monkeypatch):  # noqa: F811
    path = tmp_path / "run.nc"
    if existed:
        wd.write(xr.Dataset({"x": 1.0}), path)
    before = path.read_bytes() if existed else None
    fail(monkeypatch, error)
    settings = {"structures": 4, "path": path, "overwrite": existed, "device": "cpu"}
    with pytest.raises(type(error)):
        wd.simulate(make_scene(), **settings)
    # What stops a run, a full disk too, leaves its finished regions, so that it goes on from there.
    kept = [".run.nc.unfinished"]
    assert sorted(os.listdir(tmp_path)) == kept + (["run.nc"] if existed else [])
    if existed:
        assert path.read_bytes() == before
    monkeypatch.undo()
    wd.simulate(make_scene(), **settings).close()
    assert os.listdir(tmp_path) == ["run.nc"]


SEQUENCE = wd.EventSequence({"first": wd.Cloud(MOTIONS[:2]), "second": wd.Cloud(MOTIONS[1:])})
RESUMED = {
    "reruns, errors and histories": (make_scene(), {"checked_share": 0.5, "histories": wd.Histories((1, 13))}),
    "chosen method": (make_scene(), {"target_error": 0.05, "method": "rk4", "dtype": "float32"}),
    "events": (make_scene(excitation=SEQUENCE, recorders=("drift",)), {}),
}


@pytest.mark.parametrize("name", RESUMED)
@pytest.mark.usefixtures("small_regions")
def test_a_run_that_was_stopped_goes_on_with_the_same_bits(name, tmp_path, monkeypatch, caplog):
    scene, settings = RESUMED[name]
    settings = {"structures": 7, "seed": 3, "device": "cpu", **settings}
    with monkeypatch.context() as patched:
        regions = interrupted_after(0, patched)
        held = wd.simulate(scene, path=tmp_path / "whole.nc", **settings).load()
    with monkeypatch.context() as patched:
        interrupted_after(2, patched)
        with pytest.raises(KeyboardInterrupt) as caught:
            wd.simulate(scene, path=tmp_path / "run.nc", **settings)
    assert any("repeat the same call to" in note for note in caught.value.__notes__)
    with pytest.raises(FileExistsError, match="contains another run that is not finished"):
        wd.simulate(scene, path=tmp_path / "run.nc", **settings | {"seed": 4})
    with pytest.raises(ValueError, match="method"):  # what cannot run leaves what stands there
        wd.simulate(scene, path=tmp_path / "run.nc", **settings | {"method": "none"})
    finished = interrupted_after(0, monkeypatch)
    with wd.simulate(scene, path=tmp_path / "run.nc", **settings) as read:
        assert finished == regions[2:]
        assert re.search(r"run\.nc: resumes after the \d of 7 structures", caplog.text)
        assert_same_bits(held, read.load())
        assert set(read.attrs) == set(held.attrs)
    assert ".run.nc.unfinished" not in os.listdir(tmp_path)


@pytest.mark.usefixtures("small_regions")
def test_a_run_that_goes_on_warns_of_what_the_first_call_ran_again_in_float64(tmp_path, monkeypatch):
    monkeypatch.setattr(pipeline, "rerun_in_float64", lambda *arguments: 1)  # of every block
    settings = {"structures": 7, "seed": 3, "device": "cpu", "path": tmp_path / "run.nc"}
    with monkeypatch.context() as patched:
        interrupted_after(1, patched)
        with pytest.raises(KeyboardInterrupt):
            wd.simulate(make_scene(), **settings)
    with pytest.warns(UserWarning, match="7 of 42 samples have displacements too large for float32"):
        wd.simulate(make_scene(), **settings).close()


@pytest.mark.fast
@pytest.mark.parametrize("text", ["", "[1]", "5", "{", '{"fingerprint": 1}', '{"fingerprint": "same"}', "\xff"])
def test_a_damaged_header_of_a_checkpoint_counts_as_missing(text, tmp_path):
    with Unfinished(tmp_path / "run.nc") as unfinished:
        unfinished.kept.mkdir()
        (unfinished.kept / "run.json").write_bytes(text.encode("latin-1"))
        checkpoint = Checkpoint(unfinished, "same", overwrite=False)
        assert checkpoint.settled == {}
        assert json.loads((unfinished.kept / "run.json").read_text()) == {"fingerprint": "same", "settled": {}}


@pytest.mark.fast
def test_the_fingerprint_is_of_values_and_not_of_their_types():
    def digest(seed=0, structures=2, kept=0.5, **arguments):
        integration = Integration(**arguments)
        kept_of_it, machines = Outputs(sample_error=kept), machines_of(Execution(device="cpu"))
        return fingerprint_of(make_scene(), structures, integration, machines, kept_of_it.identity, seed)

    plain = digest(step=0.01)
    for alike in (
        {"method": "rk4"},
        {"step": np.float64(0.01)},
        {"seed": np.int64(0)},
        {"structures": np.int32(2)},
        {"kept": np.float32(0.5)},
    ):
        assert digest(**{"step": 0.01} | alike) == plain, alike
    assert digest(step=1) == digest(step=1.0)
    for other in ({"method": "heun"}, {"dtype": "float64"}, {"step": 0.02}, {"seed": 1}, {"kept": 0.25}):
        assert digest(**{"step": 0.01} | other) != plain, other
    with_target = [digest(target_error=0.05, method=method) for method in (None, "rk4")]
    assert with_target[0] != with_target[1]  # of which the pilot may choose another method


@pytest.mark.parametrize("part", ["run.json", "npz"])
def test_a_disk_that_is_full_before_the_first_region_is_kept_is_named(part, tmp_path, monkeypatch):
    original = os.replace

    def replace(source, target):
        if str(target).endswith(part):
            raise OSError(errno.ENOSPC, "No space left on device")
        original(source, target)

    monkeypatch.setattr(os, "replace", replace)
    with pytest.raises(OSError, match=r"cannot write .*run\.nc: No space left on device") as caught:
        wd.simulate(make_scene(), structures=4, path=tmp_path / "run.nc", device="cpu")
    assert caught.value.errno == errno.ENOSPC
    assert os.listdir(tmp_path) == []


def test_another_run_is_not_replaced_unless_asked(tmp_path):
    path, settings = tmp_path / "run.nc", {"structures": 2, "device": "cpu"}
    wd.simulate(make_scene(), path=path, **settings).close()
    before = path.read_bytes()
    for other in (settings | {"seed": 1}, settings | {"dtype": "float64"}, settings | {"structures": 3}):
        with pytest.raises(FileExistsError, match=r"contains another run .*overwrite=True"):
            wd.simulate(make_scene(), path=path, **other)
    with pytest.raises(FileExistsError, match="contains another run"):
        wd.simulate(make_scene(tail=0.2), path=path, **settings)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["run.nc"]
    wd.simulate(make_scene(), path=path, **settings).close()  # the same run is run again
    wd.simulate(make_scene(), path=path, seed=1, overwrite=True, **settings).close()
    with pytest.raises(TypeError, match="overwrite must be True or False"):
        wd.simulate(make_scene(), path=path, overwrite="yes", **settings)


def test_no_place_to_write_is_said_before_the_run(tmp_path, monkeypatch):
    def refuse(*arguments, **named):
        pytest.fail("a kernel was reached")

    monkeypatch.setattr(devices.CpuQueue, "launch", refuse)
    with pytest.raises(IsADirectoryError, match="it is a directory"):
        wd.simulate(make_scene(), path=tmp_path, device="cpu")


def test_chunks_lie_along_the_samples_and_are_compressed_where_it_pays(tmp_path, monkeypatch):
    monkeypatch.setattr(netcdf, "CHUNK", 1000)
    monkeypatch.setattr(blocks, "CPU_BLOCK", 1500)  # blocks that do not end where chunks do
    levels = np.linspace(0.1, 1, 20)
    scene = make_scene(excitation=wd.Stripes(MOTIONS, levels, wd.PeakGroundAcceleration()))
    run = wd.simulate(scene, structures=80, path=tmp_path / "run.nc", device="cpu")
    wd.write(run, tmp_path / "again.nc")
    run.close()
    compressed = {}
    for name in ("run.nc", "again.nc"):
        with netCDF4.Dataset(tmp_path / name) as file:
            along = [variable for variable in file.variables.values() if variable.dimensions[:1] == ("sample",)]
            assert {variable.name: variable.chunking()[0] for variable in along} == {
                variable.name: 1000 for variable in along
            }
            assert file["peak_storey_drift"].chunking() == [1000, 2]
            compressed[name] = {variable.name for variable in along if variable.filters()["zlib"]}
    assert compressed["run.nc"] == compressed["again.nc"]
    assert {"sample", "structure", "motion_index", "im_level", "status", "mass", "yield_force"} <= compressed["run.nc"]
    assert not {"peak_storey_drift", "input_energy", "residual_drift_ratio"} & compressed["run.nc"]


def test_a_long_run_is_there_to_the_last_sample(tmp_path, monkeypatch):
    # Free vibration from rest at v0 peaks at v0 / w: every sample's own answer, found again in its place in the file.
    monkeypatch.setattr(blocks, "CPU_BLOCK", 3000)
    stiffness = np.linspace(50, 200, 40_000)[:, None]
    scene = wd.Scene(make_oscillator(), wd.FreeVibration(1.0, velocity=0.3), {"stiffness": wd.GivenValues(stiffness)})
    with wd.simulate(scene, structures=40_000, method="exact", step=0.001, path=tmp_path / "run.nc") as run:
        assert run["sample"].values.tolist() == list(range(40_000))
        # A peak between two steps is missed by (w h)^2 / 8, at most 2.5e-5 of it.
        np.testing.assert_allclose(run["peak_storey_drift"][:, 0], 0.3 / np.sqrt(stiffness[:, 0]), rtol=5e-5)
