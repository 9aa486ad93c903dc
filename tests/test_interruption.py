"""Ctrl-C, SIGTERM and kills: no deadlock, what stood there stays, nothing half-written is left, full disks named."""

import errno
import os
import select
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from interrupted import dataset
from stop_at_random_moments import main as stop_at_random_moments
from xarray.backends.locks import CombinedLock

import warpdyn as wd
from warpdyn.foundations.core.interruption import interruptible, stop_if_asked
from warpdyn.foundations.core.thread_pool import in_background, in_parts
from warpdyn.foundations.files import netcdf

pytestmark = pytest.mark.fast


def test_signals_act_only_at_the_places_that_look_for_them():
    reached = []

    def work(number, *, looks):
        reached.clear()
        with interruptible(), interruptible():
            signal.raise_signal(number)
            reached.append("after the signal")
            if looks:
                stop_if_asked()
            reached.append("the end")

    for number, kind in ((signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)):
        before = signal.getsignal(number)
        with pytest.raises(kind) as caught:
            work(number, looks=True)
        assert reached == ["after the signal"]
        assert signal.getsignal(number) is before
        assert number == signal.SIGINT or caught.value.code == 128 + number
        with pytest.raises(kind):
            work(number, looks=False)
        assert reached[-1] == "the end"  # a signal that came late is not lost
    stop_if_asked()  # nothing is left to act


def test_handlers_of_the_program_are_called():
    seen = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: seen.append(number))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with interruptible():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGTERM)
            assert not seen
            stop_if_asked()
            assert seen == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)
        signal.signal(signal.SIGINT, signal.default_int_handler)


def _ask(numbers, seen, *, looks):
    """Raise signals within `interruptible`, and look for them or not."""
    with interruptible():
        for number in numbers:
            signal.raise_signal(number)
        seen.append("asked")
        if looks:
            stop_if_asked()


def test_a_signal_while_handlers_are_put_back_leaves_nothing_stuck(monkeypatch):
    seen = []
    own = signal.signal(signal.SIGTERM, lambda number, frame: seen.append(number))
    handlers = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)]
    original = signal.signal

    def put_back(number, handler):
        original(number, handler)
        if handler is handlers[0]:  # Ctrl-C works again, and comes at once
            signal.raise_signal(signal.SIGINT)

    try:
        with pytest.raises(KeyboardInterrupt), interruptible():
            monkeypatch.setattr(signal, "signal", put_back)
        monkeypatch.undo()
        signal.raise_signal(signal.SIGTERM)
        assert seen == [signal.SIGTERM]  # at once, and not noted for ever
        with pytest.raises(KeyboardInterrupt):
            _ask([signal.SIGINT], seen, looks=True)
        assert seen[1:] == ["asked"]  # Ctrl-C waits again
        assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)] == handlers
    finally:
        signal.signal(signal.SIGTERM, own)


@pytest.mark.parametrize("looks", [True, False])
def test_of_several_signals_none_is_lost(looks):
    seen = []
    own = signal.signal(signal.SIGTERM, lambda number, frame: seen.append(number))
    try:
        with pytest.raises(KeyboardInterrupt):
            _ask([signal.SIGINT, signal.SIGTERM, signal.SIGINT], seen, looks=looks)
        assert seen == ["asked", signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, own)
    stop_if_asked()  # nothing is left to act


def test_other_threads_write_too(tmp_path):
    thread = threading.Thread(target=wd.write, args=(dataset(10), tmp_path / "run.nc"))
    thread.start()
    thread.join()
    assert (tmp_path / "run.nc").exists()


def test_waiting_for_threads_ends_at_once():
    def interrupt():
        time.sleep(0.05)
        signal.raise_signal(signal.SIGINT)

    told = []
    began = time.perf_counter()
    threading.Thread(target=interrupt).start()
    with interruptible(), pytest.raises(KeyboardInterrupt):
        in_parts(lambda part: time.sleep(0.02), 1000, 2, at_a_time=1)
    threading.Thread(target=interrupt).start()
    with interruptible(), pytest.raises(KeyboardInterrupt):
        in_background(lambda: time.sleep(3.0), 0.1, lambda: told.append("waiting"))
    assert time.perf_counter() - began < 2.0
    assert in_background(lambda: time.sleep(0.3) or 5, 0.1, lambda: told.append("told")) == 5
    assert told[-1] == "told"
    with pytest.raises(ZeroDivisionError):
        in_background(lambda: 1 / 0, 1.0, lambda: None)


def test_calls_one_after_another_share_a_thread():
    # Each thread that compiles would precompile Warp's headers again.
    threads = {in_background(threading.current_thread, 1.0, lambda: None) for _ in range(20)}
    assert len(threads) == 1
    # A call within a call has a thread of its own, and so has one while another that was interrupted still runs.
    nested = in_background(lambda: in_background(threading.current_thread, 1.0, lambda: None), 1.0, lambda: None)
    assert nested not in threads
    released = threading.Event()
    threading.Timer(0.05, signal.raise_signal, [signal.SIGINT]).start()
    with interruptible(), pytest.raises(KeyboardInterrupt):
        in_background(lambda: released.wait(10.0), 1.0, lambda: None)
    assert in_background(lambda: 5, 1.0, lambda: None) == 5
    released.set()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows does not fork")
def test_a_forked_process_has_threads_of_its_own():
    in_background(lambda: None, 1.0, lambda: None)
    reads, writes = os.pipe()
    child = os.fork()
    if not child:
        os.write(writes, bytes([in_background(lambda: 7, 1.0, lambda: None)]))
        os._exit(0)
    try:
        assert select.select([reads], [], [], 20.0)[0], "the child waits for a thread that it does not have"
        assert os.read(reads, 1) == bytes([7])
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        os.close(reads)
        os.close(writes)


# Ctrl-C at 12 moments of wd.write: one that landed in a lock of xarray's file manager waited for it for ever.
MOMENTS = """
import os, signal, sys, threading, time
from interrupted import dataset
from stop_at_random_moments import main as stop_at_random_moments
import warpdyn as wd

held, path = dataset(60_000), sys.argv[1]
wd.write(held, path)
started = time.perf_counter()
wd.write(held, path)
seconds = time.perf_counter() - started
for moment in range(12):
    threading.Timer(seconds * (moment + 0.5) / 12, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    try:
        wd.write(held, path)
        time.sleep(10 + 2 * seconds)
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""


def test_control_c_in_writing_never_hangs(tmp_path):
    path = tmp_path / "run.nc"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    command = [sys.executable, "-c", MOMENTS, str(path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.split() == ["interrupted"] * 12, done.stderr
    assert os.listdir(tmp_path) == ["run.nc"]
    with xr.open_dataset(path) as read:
        xr.testing.assert_equal(read.load(), dataset(60_000))


def test_control_c_within_a_lock_waits_for_it(tmp_path, monkeypatch):
    """The very place: xarray's lock is taken, and the `with` statement does not know yet."""
    original = CombinedLock.__enter__  # which some versions of xarray have do what `acquire` does

    def enter(self):
        taken = original(self)
        signal.raise_signal(signal.SIGINT)
        return taken

    monkeypatch.setattr(CombinedLock, "__enter__", enter)
    with pytest.raises(KeyboardInterrupt):
        wd.write(dataset(10), tmp_path / "run.nc")
    monkeypatch.undo()
    with xr.open_dataset(tmp_path / "run.nc") as read:
        assert read.sizes["sample"] == 10


@pytest.mark.parametrize("samples", [10, 40_000])  # written at once, and in parts
def test_a_full_disk_is_named_and_nothing_is_left(samples, tmp_path, monkeypatch):
    path = wd.write(dataset(20), tmp_path / "run.nc")
    before = path.read_bytes()

    def fail(*arguments, **options):
        (tmp_path / ".run.nc.unfinished" / "part.nc").write_bytes(b"half of it")
        raise RuntimeError("NetCDF: HDF error")  # what the library says of a full disk

    monkeypatch.setattr(xr.Dataset, "to_netcdf", fail)
    with pytest.raises(OSError, match=r"cannot write .*run\.nc: No space left on device") as caught:
        wd.write(dataset(samples), path)
    assert caught.value.errno == errno.ENOSPC
    assert os.listdir(tmp_path) == ["run.nc"]
    assert path.read_bytes() == before


def test_what_is_written_in_parts_is_what_is_written_at_once(tmp_path, monkeypatch):
    monkeypatch.setattr(netcdf, "ROWS_AT_A_TIME", 7000)
    held = dataset(20_000)
    held["status"] = ("sample", np.arange(20_000).astype(np.int8))
    held["name"] = ("storey", np.array(["first", "2nd", "third"]))
    held.attrs["source"] = "warpdyn"
    wd.write(held, tmp_path / "parts.nc")
    with xr.open_dataset(tmp_path / "parts.nc") as lazy:  # from a file that is open
        wd.write(lazy, tmp_path / "again.nc")
    coded = held.copy()
    coded["status"].encoding["scale_factor"] = 2.0  # which xarray alone writes
    wd.write(coded, tmp_path / "coded.nc")
    for name in ("parts.nc", "again.nc", "coded.nc"):
        with xr.open_dataset(tmp_path / name) as read:
            if name != "coded.nc":
                xr.testing.assert_identical(read.load(), held)
            np.testing.assert_array_equal(read["demand_3"], held["demand_3"])
            np.testing.assert_array_equal(read["status"], held["status"])


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="processes are found in /proc")
def test_kills_at_random_moments_leave_nothing():
    """The script kills all writers; here are two that compile nothing."""
    assert stop_at_random_moments(4, 1, ["write", "table"]) == 0
