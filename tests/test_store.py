"""Writing: a file that is there is whole, and what stood there before survives a failure; errors name the path."""

import errno
import os

import netCDF4
import numpy as np
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.foundations.files.unfinished import Unfinished, check_writable

pytestmark = pytest.mark.fast


def make_dataset(scale=1.0):
    return xr.Dataset(
        {
            "drift": (("sample",), scale * np.array([0.1, np.nan, -0.0]), {"units": "m", "long_name": "drift"}),
            "status": (("sample",), np.array([0, 2, 1], np.int8), {"flag_values": np.arange(4, dtype=np.int8)}),
            "motion_name": (("motion",), np.array(["A", "long name"]), {"units": "1"}),
        },
        attrs={"title": "test", "step": np.array([0.1, 0.2]), "seed": 3},
    )


def unwritable_dataset():
    return make_dataset(2.0).assign_attrs(scene=None)  # netCDF has no None


def test_what_is_read_is_what_was_written(tmp_path):
    path = wd.write(make_dataset(), tmp_path / "run.nc")
    assert path == tmp_path / "run.nc"
    with xr.open_dataset(path) as read:
        assert read.attrs.pop("history").endswith("warpdyn.write")  # by which warpdyn knows its own
        xr.testing.assert_identical(read.load(), make_dataset())
        assert np.signbit(read["drift"].values[2])
        assert read["drift"].dtype == np.float64
        assert read["status"].dtype == np.int8
    assert os.listdir(path.parent) == ["run.nc"]
    assert path.read_bytes()[1:4] == b"HDF"  # netCDF-4


def test_a_file_is_replaced_whole(tmp_path):
    wd.write(make_dataset(), tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as before:  # held open, as a notebook does
        wd.write(make_dataset(2.0), str(tmp_path / "run.nc"))
        np.testing.assert_array_equal(before["drift"], make_dataset()["drift"])
    with xr.open_dataset(tmp_path / "run.nc") as after:
        np.testing.assert_array_equal(after["drift"], make_dataset(2.0)["drift"])
    assert os.listdir(tmp_path) == ["run.nc"]


def fail_in_the_dataset(monkeypatch):
    return unwritable_dataset(), "attr 'scene'"


def fail_half_way(monkeypatch):
    """Write part of a file, then fail as a full disk does."""

    def to_netcdf(self, path, **options):
        with open(path, "wb") as file:
            file.write(b"half of it")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(xr.Dataset, "to_netcdf", to_netcdf)
    return make_dataset(2.0), "No space left"


def fail_at_the_end(monkeypatch):
    def replace(source, target):
        assert os.path.getsize(source) > 0
        raise OSError(errno.EACCES, "moved away")

    monkeypatch.setattr(os, "replace", replace)
    return make_dataset(2.0), "moved away"


@pytest.mark.parametrize("fail", [fail_in_the_dataset, fail_half_way, fail_at_the_end])
@pytest.mark.parametrize("existed", [True, False])
def test_a_failure_leaves_what_was_there(fail, existed, tmp_path, monkeypatch):
    path = tmp_path / "run.nc"
    if existed:
        wd.write(make_dataset(), path)
    before = path.read_bytes() if existed else None
    dataset, reason = fail(monkeypatch)
    with pytest.raises((OSError, TypeError), match=reason):
        wd.write(dataset, path)
    assert os.listdir(tmp_path) == (["run.nc"] if existed else [])
    if existed:
        assert path.read_bytes() == before


@pytest.mark.parametrize("attempt", [check_writable, lambda path: wd.write(make_dataset(), path)])
def test_no_place_to_write(attempt, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    (tmp_path / "results").mkdir()
    with pytest.raises(FileNotFoundError, match=r"cannot write .*file.run\.nc: there is no folder .*create it first"):
        attempt(tmp_path / "file" / "run.nc")
    with pytest.raises(FileNotFoundError, match=r"there is no folder .*did you mean 'results'\?"):
        attempt(tmp_path / "reslts" / "deeper" / "run.nc")
    for name in ("run.csv", "run", "run.nc4"):
        with pytest.raises(ValueError, match=r"cannot write .*: .* a name that ends in '\.nc'"):
            attempt(tmp_path / name)
    with pytest.raises(ValueError, match=r"ends in '\.nc'; write_table writes tables"):
        attempt(tmp_path / "run.csv")
    with pytest.raises(IsADirectoryError, match=r"cannot write .*: it is a directory; name a file in it"):
        attempt(tmp_path)
    assert (tmp_path / "file").read_text() == "not a folder"
    assert sorted(os.listdir(tmp_path)) == ["file", "results"]


@pytest.mark.parametrize("attempt", [check_writable, lambda path: wd.write(make_dataset(), path)])
def test_what_is_not_warpdyn_s_is_not_replaced(attempt, tmp_path):
    text, foreign = tmp_path / "text.nc", tmp_path / "foreign.nc"
    text.write_text("precious")
    make_dataset().to_netcdf(foreign, engine="netcdf4")
    for path in (text, foreign):
        before = path.read_bytes()
        with pytest.raises(
            FileExistsError, match=rf"cannot write .*{path.name}: warpdyn did not write .*; move it away"
        ):
            attempt(path)
        assert path.read_bytes() == before
    assert sorted(os.listdir(tmp_path)) == ["foreign.nc", "text.nc"]
    # What stands in the history of a dataset stays there.
    signed = wd.write(make_dataset().assign_attrs(history="drawn by hand"), tmp_path / "run.nc")
    with xr.open_dataset(signed) as read:
        first, second = read.attrs["history"].splitlines()
    assert first == "drawn by hand"
    assert second.endswith("warpdyn.write")
    assert attempt(signed) == signed


def test_one_process_writes_a_file_at_a_time(tmp_path):
    with Unfinished(tmp_path / "run.nc") as first:
        first.part.write_text("half of it")
        with pytest.raises(BlockingIOError, match=r"cannot write .*run\.nc: another process is writing it"):
            wd.write(make_dataset(), tmp_path / "run.nc")
        assert first.part.exists()
    assert os.listdir(tmp_path) == []


def test_the_next_one_sweeps_what_a_kill_left(tmp_path):
    folder = tmp_path / ".run.nc.unfinished"
    (folder / "replaced").mkdir(parents=True)
    for left in ("part.nc", "lock", "replaced/0.0"):
        (folder / left).write_text("half of it")
    wd.write(make_dataset(), tmp_path / "run.nc")
    assert os.listdir(tmp_path) == ["run.nc"]


def test_no_permission(tmp_path, monkeypatch):
    """What the system refuses is told; root is refused nothing, so the refusals are played."""
    path = tmp_path / "run.nc"
    wd.write(make_dataset(), path)
    before = path.read_bytes()
    with monkeypatch.context() as patch:
        patch.setattr(os, "access", lambda *arguments: False)
        with pytest.raises(PermissionError, match=r"cannot write .*run\.nc: .*read-only; allow writing"):
            check_writable(path)

    def refuse(*arguments, **options):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr("pathlib.Path.mkdir", refuse)
    with pytest.raises(PermissionError, match=r"cannot write .*run\.nc: Permission denied"):
        wd.write(make_dataset(2.0), path)
    assert path.read_bytes() == before


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_read_only_folder_and_file(tmp_path):
    path = tmp_path / "run.nc"
    wd.write(make_dataset(), path)
    path.chmod(0o444)
    with pytest.raises(PermissionError, match=r"cannot write .*read-only"):
        check_writable(path)
    tmp_path.chmod(0o555)
    try:
        with pytest.raises(PermissionError, match=r"cannot write .*Permission denied"):
            check_writable(tmp_path / "other.nc")
    finally:
        tmp_path.chmod(0o755)


def test_asking_leaves_no_trace(tmp_path):
    path = tmp_path / "run.nc"
    assert check_writable(str(path)) == path
    assert os.listdir(tmp_path) == []


def test_only_files_are_written(tmp_path):
    with pytest.raises(OSError, match="the path is not a file"):
        check_writable("/dev/null")
    with pytest.raises(TypeError, match="path must name a file, got 5"):
        check_writable(5)
    link, target = tmp_path / "link.nc", tmp_path / "target.nc"
    link.symlink_to(target)
    assert wd.write(xr.Dataset({"x": 1.0}), link) == target
    assert link.is_symlink()
    assert target.is_file()


def test_files_are_as_cf_has_them(tmp_path):
    count = 40_000  # more than a chunk: written part by part
    level = {"units": "g", "long_name": "level"}
    many = xr.Dataset(
        {"drift": ("sample", np.random.default_rng(0).random(count)), "mass": ("sample", np.full(count, 2e5))},
        {
            "im_level": ("sample", np.repeat([0.1, np.nan], count // 2), level),
            "stripe": ("stripe", [0.1, 0.2], level),
            "motion_name": ("motion", np.array(["A", "B"])),
        },
    )
    few = many.isel(sample=slice(19_000, 21_000))
    for dataset in (many, few):
        path = wd.write(dataset, tmp_path / "run.nc")
        with netCDF4.Dataset(path) as file:
            for name in dataset.coords:
                assert "_FillValue" not in file[name].ncattrs(), name
            assert file["mass"].filters()["zlib"]  # which is the same throughout
            assert not file["drift"].filters()["zlib"]  # which is random
        with xr.open_dataset(path) as read:
            xr.testing.assert_equal(read.load(), dataset)
            # What was read and cut is written as small as what was made, not in the chunks of the first file.
            read.isel(sample=slice(0, 2000)).load().pipe(wd.write, tmp_path / "cut.nc")
        assert (tmp_path / "cut.nc").stat().st_size < 60_000
        path.unlink()
