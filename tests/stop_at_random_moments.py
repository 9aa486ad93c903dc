"""Kill all writers at random moments, damage what they kept, and fill small disks; run by hand.

    python tests/stop_at_random_moments.py [kills] [seed] [writer ...]

The writers are a dataset, a table, runs into netCDF and Zarr, of one building and of a portfolio, statistics, a cluster
of two workers, and the compilation of kernels by processes. After every kill (SIGKILL)

- the earlier file must be there with its bytes;
- no process that the program started may live for longer than 10 s;
- a file of what is kept for the next run is removed, cut short or filled with zeros, half of the time;
- the next run must leave nothing but its file, with the bits of a run that was never stopped.

A tenth as many runs are stopped by SIGTERM and Ctrl-C, and must end within 2 s more than they take by themselves. A
twentieth as many run on a tmpfs of 1 to 20 MB (mounting one takes root): they must end in an OSError that names the
file, and go on when there is room.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import suppress
from itertools import chain, count, islice
from pathlib import Path

import xarray as xr

PROGRAM = Path(__file__).with_name("interrupted.py")
FILES = {"table": "run.csv", "zarr": "run.zarr", "cluster": "run.zarr", "city": "run.zarr", "compile": "cache"}
SIZES = {"write": 60, "table": 2, "simulate": 600, "portfolio": 500, "zarr": 200, "statistics": 400, "city": 60}
SIZES |= {"cluster": 1000, "compile": 3}
SELDOM = {"cluster": 4, "compile": 2}  # rounds of the other writers for each kill of these, which take long
# Structures on a disk of so many MB at most, which they fill or not.
LARGER, DISKS = {"write": 60, "simulate": 12000, "portfolio": 12000}, {"write": 20, "simulate": 5, "portfolio": 5}
LONGEST_END = 2.0  # s, beyond the time from the last line of a run that is not stopped to its end
LONGEST_ORPHAN = 10.0  # s
PRINTED = ("out", "err")  # files of what programs print


def file_of(what: str) -> str:
    """Return the name of what a writer writes."""
    return FILES.get(what, "run.nc")


class Program:
    """A program in a process of a server, which has imported all it needs; what it starts is found by its session."""

    _server: subprocess.Popen[str] | None = None

    def __init__(self, what: str, path: Path, size: int | None = None) -> None:
        if Program._server is None:
            command = [sys.executable, str(PROGRAM), "serve"]
            Program._server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.folder = path.parent
        (self.folder / "out").unlink(missing_ok=True)
        Program._server.stdin.write(f"{what}\t{path}\t{size or SIZES[what]}\n")  # type: ignore[union-attr]
        Program._server.stdin.flush()  # type: ignore[union-attr]
        self.pid = int(self._answer())

    @classmethod
    def end_server(cls) -> None:
        """End the server."""
        if cls._server is not None:
            cls._server.communicate()
            cls._server = None

    def wait_for(self, line: str) -> None:
        """Wait until it has printed a line."""
        while f"{line}\n" not in self.printed("out"):
            assert is_alive(self.pid), self.printed("err")
            time.sleep(0.005)

    def end(self) -> int:
        """Wait until it has ended, and return its exit status."""
        return int(self._answer())

    def printed(self, name: str) -> str:
        """Return what it has printed to "out" or "err"."""
        path = self.folder / name
        return path.read_text() if path.exists() else ""

    def _answer(self) -> str:
        while (line := Program._server.stdout.readline().strip()) and not line.lstrip("-").isdigit():  # type: ignore[union-attr]
            pass  # what Warp says
        return line


def start(what: str, path: Path, size: int | None = None) -> Program:
    """Start a program and wait until it begins what is to be stopped."""
    program = Program(what, path, size)
    program.wait_for("begun")
    return program


def is_alive(pid: int) -> bool:
    """Return whether a process is there and has not ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


def started_by(session: int) -> list[int]:
    """Return the living processes of a session."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, of_session = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(of_session) == session and state not in "ZX":
            found.append(int(folder.name))
    return found


def wait_for_orphans(session: int, found: Counter) -> None:
    """Wait until the processes of a session have ended; count those that do not within their time."""
    began = time.perf_counter()
    while (left := started_by(session)) and time.perf_counter() - began < LONGEST_ORPHAN:
        time.sleep(0.1)
    seconds = time.perf_counter() - began
    found["longest orphan [ms]"] = max(found["longest orphan [ms]"], round(1000 * seconds))
    for each in left:
        found["ORPHAN"] += 1
        os.kill(each, signal.SIGKILL)


def bits(path: Path) -> dict[str, bytes]:
    """Return the values of a file by name; of other files than datasets their bytes, and nothing of kernels."""
    if path.name == "cache":
        return {}
    if path.suffix == ".csv":
        return {"": path.read_bytes()}
    with xr.open_zarr(path) if path.suffix == ".zarr" else xr.open_dataset(path) as read:
        return {
            str(name): variable.values.astype(variable.dtype).tobytes() for name, variable in read.variables.items()
        }


def damage(kept: Path, draw: random.Random) -> str:
    """Remove, cut or clear a file of those that a run goes on from; return what was done."""
    files = sorted(path for path in kept.rglob("*") if path.is_file() and path.name != "lock")
    if not files:
        return "nothing kept"
    path, how = draw.choice(files), draw.choice(["removed", "cut", "zeroed"])
    if how == "removed":
        path.unlink()
    elif how == "cut":
        path.write_bytes(path.read_bytes()[: draw.randrange(max(1, path.stat().st_size))])
    else:
        path.write_bytes(bytes(path.stat().st_size))
    return f"kept file {how}"


def left_beside(what: str, path: Path) -> list[str]:
    """Return what is in the folder of a file, or in a kernel cache, that is not to be there."""
    if what == "compile":
        return [
            each.name for each in path.rglob("*") if "_p" in each.name and "_t" in each.name.rpartition("_p")[2]
        ] + [each.name for each in path.rglob("*") if each.suffix in (".tmp", ".compiling", ".part")]
    inside = [each.name for each in path.rglob("*") if path.suffix == ".zarr" and each.suffix in (".partial", ".part")]
    return sorted(each.name for each in path.parent.iterdir() if each != path and each.name not in PRINTED) + inside


def stop_once(
    what: str,
    number: signal.Signals,
    moment: float,
    earlier: Path,
    truth: dict[str, bytes],
    draw: random.Random,
    found: Counter,
) -> None:
    """Stop a program once and let the next one finish; count what happened."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "place" / file_of(what)
        path.parent.mkdir()
        if what != "compile":
            subprocess.run(["cp", "-a", earlier, path], check=True)  # the same run, so that it may be replaced
        program = start(what, path)
        time.sleep(moment)
        with suppress(ProcessLookupError):
            os.kill(program.pid, number)
        sent = time.perf_counter()
        program.end()
        late = time.perf_counter() - sent
        if number != signal.SIGKILL:
            found["ended late" if late > LONGEST_END + own_end[what] else "ended in time"] += 1
            found["longest end [ms]"] = max(found["longest end [ms]"], round(1000 * late))
        found["killed before its end"] += "done" not in program.printed("out")
        wait_for_orphans(program.pid, found)
        if what != "compile" and bits(path) != truth:
            found["EARLIER FILE LOST"] += 1
        if draw.random() < 0.5:
            found[damage(path.with_name(f".{path.name}.unfinished") / "kept", draw)] += 1
        again = start(what, path)
        status, told = again.end(), again.printed("err")
        found["went on"] += "resumes after" in told
        if status != 0:
            found["NEXT RUN FAILED"] += 1
            print(what, told, flush=True)
            return
        wait_for_orphans(again.pid, found)
        left = left_beside(what, path)
        found["nothing left" if not left else f"LEFT {left}"] += 1
        found["same bits" if bits(path) == truth else "OTHER BITS"] += 1


def fill_disk(what: str, megabytes: int, found: Counter) -> None:
    """Run a program on a small disk; what it kept is gone on when there is room."""
    with tempfile.TemporaryDirectory() as folder:
        mount = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", folder]
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            found["no tmpfs could be mounted"] += 1
            return
        try:
            path = Path(folder) / "run.nc"
            program = start(what, path, LARGER[what])
            status, told = program.end(), program.printed("err")
            if status == 0:
                found["fits"] += 1
                return
            errors = [line for line in told.splitlines() if line.startswith("OSError")]
            named = errors and "run.nc" in errors[-1] and "No space left" in errors[-1]
            found["OSError that names the file" if named else f"NOT NAMED: {told[-300:]}"] += 1
            left = sorted(each.name for each in Path(folder).iterdir() if each.name not in PRINTED)
            found["blocks kept" if left else "nothing left"] += 1
            if left not in ([], [".run.nc.unfinished"]):
                found[f"LEFT {left}"] += 1
            subprocess.run(["mount", "-o", "remount,size=400m", folder], check=True)
            again = start(what, path, LARGER[what])
            again.end()
            found["went on"] += "resumes after" in again.printed("err")
            found["done with more room" if path.exists() else "NOT DONE WITH MORE ROOM"] += 1
        finally:
            subprocess.run(["umount", folder], check=True)


own_end: dict[str, float] = {}  # seconds from the last line of a run to its end


def time_run(what: str, path: Path) -> float:
    """Run a program, and return the seconds until its last line."""
    start(what, path).end()  # compiles
    program, began = start(what, path), time.perf_counter()
    program.wait_for("done")
    seconds = time.perf_counter() - began
    program.end()
    own_end[what] = time.perf_counter() - began - seconds
    return seconds


def main(kills: int, seed: int, writers: list[str]) -> int:
    """Kill, stop and fill; print what was found, and return the number of failures."""
    draw = random.Random(seed)
    found: dict[str, Counter] = {}
    with tempfile.TemporaryDirectory() as folder:
        truth, seconds, earlier = {}, {}, {}
        for what in writers:
            earlier[what] = Path(folder) / what / file_of(what)
            earlier[what].parent.mkdir()
            seconds[what] = 6.0 if what == "compile" else time_run(what, earlier[what])
            truth[what] = {} if what == "compile" else bits(earlier[what])
        print({what: f"{value:.2f} s" for what, value in seconds.items()}, flush=True)

        def stop(what: str, number: signal.Signals) -> None:
            counts = found.setdefault(f"{what}, {number.name}", Counter())
            stop_once(what, number, draw.uniform(0, seconds[what]), earlier[what], truth[what], draw, counts)

        rounds = ([what for what in writers if round % SELDOM.get(what, 1) == 0] for round in count())
        for what in islice(chain.from_iterable(rounds), kills):
            stop(what, signal.SIGKILL)
        classic = [what for what in writers if what in LARGER]
        for each in range(kills // 10 if classic else 0):
            stop(classic[each % len(classic)], (signal.SIGTERM, signal.SIGINT)[each // len(classic) % 2])
        for each in range(kills // 20 if classic else 0):
            what = classic[each % len(classic)]
            fill_disk(what, draw.randint(1, DISKS[what]), found.setdefault(f"{what}, small disk", Counter()))
    bad = 0
    for name, counts in found.items():
        print(f"{name:<22}", ", ".join(f"{text}: {count}" for text, count in sorted(counts.items())))
        bad += sum(count for text, count in counts.items() if text[:4].isupper() or text == "ended late")
    print(f"{bad} failures at {kills} kills")
    Program.end_server()
    return bad


if __name__ == "__main__":
    # A shell has what it runs in the background ignore Ctrl-C, and so would the programs.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    numbers = [int(text) for text in sys.argv[1:3]]
    sys.exit(bool(main(*[*numbers, *[200, 0][len(numbers) :]], sys.argv[3:] or list(SIZES))))
