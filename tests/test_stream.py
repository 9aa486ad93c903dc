"""A run that is written as it goes: the file is what the run in memory would have been, whole or not there at all."""

import os

import netCDF4
import numpy as np
import pytest
import xarray as xr
from test_simulate import MOTIONS, make_oscillator, make_scene

import warpdyn as wd
from warpdyn.core import netcdf
from warpdyn.kernels import queues as devices
from warpdyn.running import blocks

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
            assert str(read[each].attrs) == str(held[each].attrs), each
        text = wd.summary(read)
    assert f"{held.sizes['sample']} samples" in text
    # And what is written from memory reads the same.
    with xr.open_dataset(wd.write(held, tmp_path / "again.nc")) as again:
        xr.testing.assert_identical(again.load(), held)


def test_values_are_read_when_they_are_asked_for(tmp_path):
    with wd.simulate(make_scene(), structures=3, path=str(tmp_path / "run.nc")) as run:
        assert not run["peak_storey_drift"]._in_memory
        assert np.isfinite(run["peak_storey_drift"].values).all()


def fail_in_the_second_block(monkeypatch, error):
    monkeypatch.setattr(blocks, "CPU_BLOCK", 6)
    launches = []

    def launch(*arguments, **options):
        launches.append(arguments)
        if len(launches) == 2:
            raise error
        return original(*arguments, **options)

    original = devices.CpuQueue.launch
    monkeypatch.setattr(devices.CpuQueue, "launch", launch)


def fail_at_the_end(monkeypatch, error):
    def replace(*arguments):
        raise error

    monkeypatch.setattr(os, "replace", replace)


@pytest.mark.parametrize("fail", [fail_in_the_second_block, fail_at_the_end])
@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("out of memory"), OSError("disk full")])
@pytest.mark.parametrize("existed", [True, False])
def test_nothing_is_left_of_an_unfinished_run(fail, error, existed, tmp_path, monkeypatch):
    path = tmp_path / "run.nc"
    if existed:
        wd.write(xr.Dataset({"x": 1.0}), path)
    before = path.read_bytes() if existed else None
    fail(monkeypatch, error)
    with pytest.raises(type(error)):
        wd.simulate(make_scene(), structures=4, path=path, device="cpu")
    assert os.listdir(tmp_path) == (["run.nc"] if existed else [])
    if existed:
        assert path.read_bytes() == before


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
            assert all(variable.chunking()[0] == 1000 for variable in along)
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
