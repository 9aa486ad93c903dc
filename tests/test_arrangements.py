"""Each arrangement of links, devices, foreign files and permissions with each writer leaves all else untouched."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest
from arrangements import ARRANGEMENTS, HEX, IS_ROOT, NEEDS_ROOT, NOBODY, OF_TEXT, WRITERS, entries, older, values_in

from warpdyn.foundations.files.part_files import PartFile

pytestmark = [pytest.mark.fast, pytest.mark.skipif(os.name != "posix", reason="links and modes of POSIX")]

CASES = [(name, writer) for name, (_, _, writers) in ARRANGEMENTS.items() for writer in writers]


def test_there_are_many_arrangements():
    assert len(CASES) >= 60


@pytest.mark.parametrize(("name", "writer"), CASES)
def test_nothing_else_is_touched(name, writer, tmp_path):
    if name in NEEDS_ROOT and not IS_ROOT:
        pytest.skip("only root makes devices and files of other users")
    path = tmp_path / "folder" / writer
    path.parent.mkdir()
    arrange, is_written, _ = ARRANGEMENTS[name]
    arrange(path)
    target, before = Path(os.path.realpath(path)), entries(tmp_path)
    about = os.lstat(target) if is_written and target.exists() else None
    if not is_written:
        with pytest.raises((OSError, ValueError), match=r"cannot write .*(run|table)\."):
            WRITERS[writer](path, 1.0)
        assert entries(tmp_path) == before
        return
    WRITERS[writer](path, 1.0)
    np.testing.assert_array_equal(values_in(target), np.arange(4.0))
    after, own = entries(tmp_path), str(target.relative_to(tmp_path))
    ours = {each for each in before.keys() | after.keys() if each == own or each.startswith(f"{own}/")}
    ours |= {each for each in before if each.startswith(f"folder/.{writer}.unfinished")}  # which is gone
    assert {each: after[each] for each in after.keys() - ours} == {each: before[each] for each in before.keys() - ours}
    if about is not None:
        found = os.lstat(target)
        assert (found.st_mode, found.st_uid, found.st_gid) == (about.st_mode, about.st_uid, about.st_gid)


@pytest.mark.skipif(not IS_ROOT, reason="only root becomes another user")
def test_a_file_of_another_user_that_anyone_may_write_is_not_replaced():
    # Beside the folders of tests, which another user cannot enter.
    with tempfile.TemporaryDirectory(prefix="warpdyn_test_") as shared:
        paths = [older(Path(shared, "folder", writer)) for writer in WRITERS]
        for each in (Path(shared), *Path(shared).rglob("*")):
            each.chmod(0o777)
        before = entries(Path(shared, "folder"))
        program = f"""
import os, sys
sys.path[:0] = {[str(Path(__file__).parent), *sys.path]!r}
from arrangements import WRITERS, Path, older
for writer in WRITERS:
    older(Path({str(shared)!r}, "first", writer))  # which imports all that is needed
os.setgid({NOBODY}); os.setuid({NOBODY})
for path in {[str(path) for path in paths]!r}:
    try:
        WRITERS[Path(path).name](Path(path), 1.0)
    except PermissionError as error:
        print(error)
"""
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
        assert done.stdout.count("belongs to another user") == len(WRITERS), done.stdout + done.stderr
        assert entries(Path(shared, "folder")) == before


@pytest.mark.parametrize("writer", OF_TEXT)
def test_what_a_killed_writer_left_goes_and_what_another_one_writes_stays(writer, tmp_path):
    path = tmp_path / writer
    left = tmp_path / f".{writer}.{HEX}.part"
    left.write_text("half of it")
    living = PartFile(path, is_locked=True)
    WRITERS[writer](path, 1.0)
    assert sorted(tmp_path.iterdir()) == sorted([living.path, path])
    living.discard()
    assert os.listdir(tmp_path) == [writer]
