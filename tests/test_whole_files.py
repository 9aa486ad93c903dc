"""Files are complete when they appear, even with several writers; all modules write them in the same way."""

import ast
import os
import stat
import struct
import threading
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.foundations.files.part_files import whole_file
from warpdyn.foundations.files.targets import ACL

pytestmark = [pytest.mark.fast, pytest.mark.skipif(os.name != "posix", reason="modes of POSIX")]

PACKAGE = Path(wd.__file__).parent


def make_table(value, rows=20_000):
    return xr.Dataset({"drift": ("sample", np.full(rows, value))}, {"sample": np.arange(rows)}, {"source": "warpdyn"})


@pytest.mark.parametrize("name", ["table.csv", "table.parquet"])
def test_threads_that_write_one_file_do_not_mix_it(name, tmp_path):
    errors = []

    def write(value):
        try:
            for _ in range(3):
                wd.write_table(make_table(value), tmp_path / name)
        except OSError as error:
            errors.append(error)

    threads = [threading.Thread(target=write, args=(float(number),)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert os.listdir(tmp_path) == [name]
    pandas = pytest.importorskip("pandas")
    read = pandas.read_csv if name.endswith("csv") else pandas.read_parquet
    values = read(tmp_path / name)["drift"].to_numpy()
    assert values.shape == (20_000,)
    assert len(np.unique(values)) == 1


def test_the_content_is_on_the_disk_before_the_file_has_its_place(tmp_path, monkeypatch):
    """Otherwise a power failure could leave an empty file with the final name."""
    happened = []
    for name in ("fsync", "replace"):
        original = getattr(os, name)

        def noting(*arguments, name=name, original=original):
            kind = "folder" if name == "fsync" and stat.S_ISDIR(os.fstat(arguments[0]).st_mode) else "file"
            happened.append(f"{name} {kind}")
            return original(*arguments)

        monkeypatch.setattr(os, name, noting)
    with whole_file(tmp_path / "file.txt") as part:
        part.write_text("whole")
    assert happened == ["fsync file", "replace file", "fsync folder"]


def test_a_file_that_is_being_written_is_as_private_as_the_older_one(tmp_path):
    path = tmp_path / "file.txt"
    path.touch()
    path.chmod(0o640)
    with whole_file(path) as part:
        assert stat.S_IMODE(part.stat().st_mode) & 0o077 == 0
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    run = wd.write(make_table(0.0), tmp_path / "run.nc")
    run.chmod(0o600)
    with wd_unfinished(run) as folder:
        assert stat.S_IMODE(folder.folder.stat().st_mode) == 0o700


def wd_unfinished(path):
    from warpdyn.foundations.files.unfinished import Unfinished

    return Unfinished(path)


def test_new_files_have_the_mode_of_the_process(tmp_path):
    before = os.umask(0o027)
    try:
        wd.write_table(make_table(0.0), tmp_path / "table.csv")
        wd.write(make_table(0.0), tmp_path / "run.nc")
    finally:
        os.umask(before)
    for path in tmp_path.iterdir():
        assert stat.S_IMODE(path.stat().st_mode) == 0o640


@pytest.mark.skipif(not hasattr(os, "setxattr"), reason="access control lists of Linux")
@pytest.mark.parametrize("name", ["table.csv", "run.nc"])
def test_an_access_control_list_is_kept(name, tmp_path):
    write = wd.write if name == "run.nc" else wd.write_table
    path = write(make_table(0.0), tmp_path / name)
    # Version 2; tag, permissions and number: owner rw, user 1234 r, group -, mask r, others -.
    unset = 0xFFFFFFFF
    listed = [(1, 6, unset), (2, 4, 1234), (4, 0, unset), (16, 4, unset), (32, 0, unset)]
    acl = struct.pack("<I", 2) + b"".join(struct.pack("<HHI", *each) for each in listed)
    try:
        os.setxattr(path, ACL, acl)
    except OSError as error:
        pytest.skip(f"the file system has no access control lists: {error}")
    write(make_table(1.0), path)
    assert os.getxattr(path, ACL) == acl


@pytest.mark.parametrize("length", [200, 250])
def test_long_names_are_written(length, tmp_path):
    path = tmp_path / ("ä" * (length // 2 - 4) + ".csv")
    wd.write_table(make_table(0.0, 3), path)
    assert os.listdir(tmp_path) == [path.name]


# Calls that make, move or remove files, and the modules that may do so: those of `files`, and three that manage Warp's
# folder of compiled kernels.
WRITING = {"replace", "rename", "unlink", "truncate", "rmtree", "mkdtemp", "to_netcdf", "to_zarr", "savez"}
ALLOWED = {
    "engine/kernels/kernel_cache.py",
    "engine/kernels/unfinished_builds.py",
    "engine/kernels/composing/kept_texts.py",
    "campaigns/running/regions/checkpoint.py",
    "campaigns/running/sinks.py",
}


def test_all_files_are_written_in_one_way():
    for path in PACKAGE.rglob("*.py"):
        name = path.relative_to(PACKAGE).as_posix()
        if name.startswith("foundations/files/") or name in ALLOWED:
            continue
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            owner = node.func.value
            is_module = isinstance(owner, ast.Name) and owner.id in ("os", "shutil", "tempfile", "np")
            if is_module or node.func.attr in ("unlink", "to_netcdf", "to_zarr"):
                assert node.func.attr not in WRITING, f"{name}:{node.lineno} calls {ast.unparse(node.func)}"


def test_files_are_opened_for_writing_only_under_temporary_names():
    """`open(name, "w")` and `write_text` are called only within `write_in_place` or `whole_file`."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call):
                function = ast.unparse(node.func)
                modes = [each.value for each in node.args[1:] if isinstance(each, ast.Constant)]
                if (function == "open" and any("w" in str(mode) or "a" in str(mode) for mode in modes)) or (
                    function.endswith((".write_text", ".write_bytes"))
                ):
                    found.add(path.relative_to(PACKAGE).as_posix())
    assert found == {
        "interfaces/exchange/regional/geojson.py",
        "interfaces/exchange/regional/openquake_damages.py",
        "interfaces/exchange/tables.py",
        "interfaces/exchange/text_files.py",
        "engine/kernels/kernel_cache.py",
        "engine/kernels/composing/kept_texts.py",
        "campaigns/running/regions/checkpoint.py",
    }
