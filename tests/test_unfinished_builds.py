"""Compiling: room in the kernel cache is checked before, and a kill leaves neither files nor processes behind."""

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import warp as wp

from warpdyn.engine.kernels import kernel_cache, unfinished_builds
from warpdyn.engine.kernels.unfinished_builds import NOTE, check_room, folder_of_this_process, noted

pytestmark = [pytest.mark.fast, pytest.mark.skipif(os.name != "posix", reason="locks and limits of POSIX")]


@wp.kernel(module="unique", enable_backward=False)
def thrice(values: wp.array(dtype=float)):
    values[wp.tid()] = 3.0 * values[wp.tid()]


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_a_full_disk_is_an_error_before_the_compiler_runs(number, tmp_path, monkeypatch):
    def full(*arguments):
        raise OSError(number, os.strerror(number))

    wp.init()  # which adds the version to the folder of the cache
    monkeypatch.setattr(os, "posix_fallocate", full)
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path))
    monkeypatch.setattr(wp.Module, "load", lambda *arguments, **options: pytest.fail("the compiler was reached"))
    with pytest.raises(
        OSError, match=rf"kernel cache {tmp_path} has too little free space .* MB are free .*export WARP_CACHE_PATH="
    ) as caught:
        kernel_cache.load_module(thrice.module, "cpu", 1)
    assert caught.value.errno == errno.ENOSPC
    assert not list(tmp_path.iterdir())


def test_a_disk_with_room_and_a_cache_that_is_not_there_pass(tmp_path):
    check_room(tmp_path / "not" / "there")
    assert not list(tmp_path.iterdir())


FULL = """
import resource, sys
import warp as wp
from test_unfinished_builds import thrice
from warpdyn.engine.kernels import kernel_cache
wp.init()
resource.setrlimit(resource.RLIMIT_FSIZE, (2**20, 2**20))  # a disk that takes files of 1 MB
try:
    kernel_cache.load_module(thrice.module, "cpu", 1)
except OSError as error:
    print("caught", error)
"""


def test_the_process_goes_on_after_a_full_disk(tmp_path):
    """A compiler that finds the disk full while it writes a binary ends the process: "LLVM ERROR: IO failure"."""
    environment = os.environ | {
        "WARP_CACHE_PATH": str(tmp_path),
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path]),
    }
    done = subprocess.run([sys.executable, "-c", FULL], env=environment, capture_output=True, text=True, check=False)
    assert "caught [Errno 28] cannot compile a kernel" in done.stdout, done.stderr
    assert done.returncode == 0


def left_by(cache, name):
    """Make what a process leaves that is killed while it compiles."""
    build = cache / f"{name}_p1_t2"
    build.mkdir(parents=True)
    (build / f"{name}.cpp").write_text("half of it")
    note = cache / f"{build.name}{NOTE}"
    note.touch()
    return build, note


def test_what_a_killed_compilation_left_goes_and_the_rest_stays(tmp_path):
    build, note = left_by(tmp_path, "wp_one")
    headers = tmp_path / "precompiled_headers_0123"
    headers.mkdir()
    unfinished, whole = headers / "builtin-1.pch.tmp", headers / "builtin.pch"
    unfinished.touch()
    whole.touch()
    foreign = tmp_path / "wp_other_p1_t2"  # of a program that is not warpdyn
    foreign.mkdir()
    (tmp_path / "precious").mkdir()
    (tmp_path / f"wp_linked_p1_t2{NOTE}").touch()
    (tmp_path / "wp_linked_p1_t2").symlink_to("precious")
    (tmp_path / "precious" / "notes").touch()
    with noted(tmp_path / "wp_two"):
        assert not any(path.exists() for path in (build, note, unfinished))
        assert all(path.exists() for path in (whole, foreign, tmp_path / "precious" / "notes"))
        assert (tmp_path / "wp_linked_p1_t2").is_symlink()
        [own] = tmp_path.glob(f"wp_two*{NOTE}")
        # Another thread or process that compiles meanwhile leaves this one's files alone.
        unfinished.touch()
        os.close(os.open(own, os.O_RDWR))
        unfinished_builds._sweep(tmp_path)
        assert own.exists()
        assert unfinished.exists()
    assert not list(tmp_path.glob(f"*{NOTE}"))


def test_temporary_folders_of_killed_processes_go(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    living = folder_of_this_process()
    dead = tmp_path / "warpdyn_kernels_dead"
    dead.mkdir()
    (dead / "lock").touch()
    (dead / "kernel.o").touch()
    foreign = tmp_path / "warpdyn_kernels_of_somebody"
    foreign.mkdir()
    folder_of_this_process()
    assert living.exists()
    assert foreign.exists()
    assert not dead.exists()


WORKERS = """
import os, time
from loky import ProcessPoolExecutor
from warpdyn.engine.kernels import compilation

if __name__ == "__main__":
    settings = compilation._settings(), os.getpid()
    processes = ProcessPoolExecutor(2, initializer=compilation._configure, initargs=settings)
    own = processes.submit(os.getpid).result()
    for _ in range(4):
        processes.submit(time.sleep, 600)
    print(own, flush=True)
    time.sleep(600)
"""


def test_processes_that_compile_end_with_the_one_that_started_them(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(WORKERS)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True, env=environment) as process:
        worker = next(int(line) for line in process.stdout if line.strip().isdigit())
        group = {worker, *children(process.pid)}
        os.kill(process.pid, signal.SIGKILL)
        until = time.monotonic() + 10.0
        while (left := {each for each in group if is_alive(each)}) and time.monotonic() < until:
            time.sleep(0.1)
        for each in left:
            os.kill(each, signal.SIGKILL)
    assert not left


def children(pid):
    """Return the processes that a process has started, where the system tells."""
    try:
        return map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text().split())
    except OSError:
        return ()


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return Path("/proc").is_dir() is False
