"""What a stopped run has kept and is damaged before the run goes on: it is run again, and the results have its bits."""

import errno
import os
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from test_regions import interrupted_after, small_regions
from test_simulate import assert_same_bits, make_scene

import warpdyn as wd
from warpdyn.foundations.files import checksums
from warpdyn.foundations.files.checksums import are_whole, load_arrays, save_arrays

pytestmark = pytest.mark.meant_as_given("storey_height", "first_period", "yield_base_shear_coefficient")

SETTINGS = {"structures": 9, "seed": 3, "device": "cpu"}
MOMENTS = [wd.DemandMoments("peak_storey_drift_ratio"), wd.LargestDemand("peak_storey_drift_ratio")]
RUNS = {"run.nc": {}, "run.zarr": {}, "statistics.nc": {"statistics": MOMENTS}}


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 255
    path.write_bytes(content)


DAMAGES = {
    "removed": Path.unlink,
    "empty": lambda path: path.write_bytes(b""),
    "cut": cut,
    "zeroed": lambda path: path.write_bytes(bytes(path.stat().st_size)),
    "flipped": flip,
}
# Kinds of kept files, by a pattern of their paths in the folder `kept`: a chunk of a demand, of a coordinate and of an
# input, metadata, a report or a block, and the account of the run.
KINDS = {
    "run.nc": [r"0-\d+-\d+\.npz", r"run\.json"],
    "run.zarr": [
        r".*/peak_storey_drift/0\.0",
        r".*/im_level/0",
        r".*/mass/1\.0",
        r".*/mass/\.zarray",
        r".*/storey/0",
        r"[^/]*\.zarr/\.z(group|attrs)",
        r"0-\d+-\d+\.npz",
        r"run\.json",
    ],
    "statistics.nc": [r"0-\d+-\d+\.npz", r"run\.json"],
}


def simulate(path, **more):
    return wd.simulate(make_scene(), path=path, **SETTINGS, **RUNS[path.name], **more)


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """Return a folder for each run that was stopped after some blocks or regions, and what the whole run returns."""
    found = {}
    with pytest.MonkeyPatch.context() as patched:
        small_regions.__wrapped__(patched)
        for name in RUNS:
            if name == "run.zarr":
                pytest.importorskip("zarr")
            folder = tmp_path_factory.mktemp("stopped")
            whole = simulate(folder / name).load()
            whole.close()
            (shutil.rmtree if name.endswith(".zarr") else os.remove)(folder / name)
            with pytest.MonkeyPatch.context() as stopping:
                interrupted_after(2, stopping)
                with pytest.raises(KeyboardInterrupt):
                    simulate(folder / name)
            found[name] = folder, whole
    return found


def cases():
    """Yield all kinds with all damages; by default chunks of a demand with each, and others with one."""
    for name, kinds in KINDS.items():
        for place, kind in enumerate(kinds):
            for damage in DAMAGES:
                by_default = "drift" in kind or damage == list(DAMAGES)[place % len(DAMAGES)]
                yield pytest.param(name, kind, damage, marks=() if by_default else pytest.mark.thorough)


@pytest.mark.parametrize(("name", "kind", "damage"), list(cases()))
def test_what_is_damaged_is_run_again(name, kind, damage, stopped, tmp_path, small_regions, monkeypatch):
    base, whole = stopped[name]
    shutil.copytree(base, tmp_path, dirs_exist_ok=True)
    kept = tmp_path / f".{name}.unfinished" / "kept"
    files = [path for path in sorted(kept.rglob("*")) if re.fullmatch(kind, path.relative_to(kept).as_posix())]
    DAMAGES[damage](files[0])
    found = simulate(tmp_path / name)
    assert os.listdir(tmp_path) == [name]
    if name == "statistics.nc":
        assert all(found[each].equals(whole[each]) for each in whole.variables)
    else:
        assert_same_bits(whole, found.load())
    found.close()


@pytest.mark.parametrize("name", ["run.nc", "run.zarr"])
def test_only_what_is_damaged_is_run_again(name, stopped, tmp_path, small_regions, monkeypatch, caplog):
    shutil.copytree(stopped[name][0], tmp_path, dirs_exist_ok=True)
    kept = tmp_path / f".{name}.unfinished" / "kept"
    done = sorted(kept.glob("*.npz"))
    assert len(done) == 2
    (done[-1] if name == "run.nc" else next(kept.rglob("peak_storey_drift/1.0"))).write_bytes(b"")
    simulate(tmp_path / name).close()
    assert "resumes after the 2 of 9 structures" in caplog.text  # 2 of the 4 that were done


def test_a_chunk_that_was_never_written_is_not_read(stopped, tmp_path, small_regions, monkeypatch):
    shutil.copytree(stopped["run.zarr"][0], tmp_path, dirs_exist_ok=True)
    [store] = tmp_path.rglob("*.zarr")
    assert not (store / "status" / "0").exists()  # all are ok, 0, as chunks are that have no file
    shutil.copy(next(store.rglob("im_level/0")), store / "status" / "0")
    assert_same_bits(stopped["run.zarr"][1], simulate(tmp_path / "run.zarr").load())


@pytest.mark.parametrize("part", ["region", "file"])
def test_a_full_disk_keeps_the_regions_that_are_done(part, tmp_path, small_regions, monkeypatch, caplog):
    whole = simulate(tmp_path / "run.nc").load()
    whole.close()
    os.remove(tmp_path / "run.nc")
    with monkeypatch.context() as patched:
        if part == "region":
            saved, save = [], checksums.save_arrays

            def saving(path, arrays):
                saved.append(path)
                if len(saved) == 3:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                save(path, arrays)

            patched.setattr("warpdyn.campaigns.running.regions.report.save_arrays", saving)
        else:

            def fail(*arguments, **options):
                raise RuntimeError("NetCDF: HDF error")  # what the library says of a full disk

            patched.setattr("warpdyn.foundations.files.netcdf.GrowingFile.finish", _failing_finish(fail))
        with pytest.raises(OSError, match=r"cannot write .*run\.nc: No space left") as caught:
            simulate(tmp_path / "run.nc")
    assert any("repeat the same call to" in note for note in caught.value.__notes__)
    assert os.listdir(tmp_path) == [".run.nc.unfinished"]
    with simulate(tmp_path / "run.nc") as found:
        assert re.search(r"resumes after the \d of 9 structures", caplog.text)
        assert_same_bits(whole, found.load())
    assert os.listdir(tmp_path) == ["run.nc"]


def _failing_finish(fail):
    def finish(self, rest):
        with self.unfinished.named_errors():
            fail()

    return finish


@pytest.mark.fast
def test_damaged_arrays_are_never_read(tmp_path):
    path = tmp_path / "arrays.npz"
    given = {"header": "{}", "a/0": np.arange(20.0), "flags": np.arange(3, dtype=np.int8), "none": np.zeros((0, 3))}
    save_arrays(path, given)
    content, read = path.read_bytes(), load_arrays(path)
    assert read.keys() == given.keys()
    for name, values in given.items():
        np.testing.assert_array_equal(read[name], values)
    undetected = 0
    for place in range(0, len(content), 3):
        flipped = bytearray(content)
        flipped[place] ^= 255
        for damaged in (flipped, content[:place], content[:place] + bytes(len(content) - place)):
            path.write_bytes(damaged)
            found = load_arrays(path)
            assert found is None or all(np.array_equal(found[name], read[name]) for name in read)
            undetected += found is not None
    assert undetected < len(content) / 6  # of dates and other fields that decide nothing
    assert not are_whole(tmp_path / "missing.npz")
    assert not are_whole(tmp_path)
