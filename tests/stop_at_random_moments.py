"""Stop runs at random moments, by kill, SIGTERM and Ctrl-C, and fill small disks; run by hand.

    python tests/stop_at_random_moments.py [moments] [seed]

After every stop the earlier file must be there with its bytes, and no process may live for 2 s more than it takes to
end by itself, which is seconds on a busy machine; after the next run nothing but the file may be left, and it must hold
the bits of a run that was never stopped. On a tmpfs of 1 to 20 MB (mounting one takes root)
runs must end in an OSError that names the file, and leave nothing.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import netCDF4
import xarray as xr

PROGRAM = Path(__file__).with_name("interrupted.py")
SIZES = {"write": 60, "simulate": 1500, "portfolio": 1500}
# Structures on a disk of so many MB at most, which they fill or not.
LARGER, DISKS = {"write": 60, "simulate": 12000, "portfolio": 12000}, {"write": 20, "simulate": 5, "portfolio": 5}
LONGEST_END = 2.0  # s, beyond the time from the last line of a run that is not stopped to its end


def start(what: str, path: Path, size: int | None = None) -> subprocess.Popen[str]:
    """Start a program and wait until it begins what is to be stopped."""
    command = [sys.executable, str(PROGRAM), what, str(path), str(size or SIZES[what])]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "begun\n"
    return process


def bits(path: Path) -> dict[str, bytes]:
    """Return the values of a file by name."""
    with xr.open_dataset(path) as read:
        return {
            str(name): variable.values.astype(variable.dtype).tobytes() for name, variable in read.variables.items()
        }


def stop_once(what: str, number: signal.Signals, moment: float, truth: dict[str, bytes], found: Counter) -> None:
    """Stop a program once and let the next one finish; count what happened."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.nc"
        with netCDF4.Dataset(path, "w") as file:  # an earlier file of the same run, so that it may be replaced
            file.source = "warpdyn"
            file.fingerprint = truth_fingerprint.get(what, "")
        before = path.read_bytes()
        process = start(what, path)
        time.sleep(moment)
        process.send_signal(number)
        sent = time.perf_counter()
        try:
            _, told = process.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            found["HANG"] += 1
            return
        late = time.perf_counter() - sent
        found[f"ended late ({late:.1f} s)" if late > LONGEST_END + own_end[what] else "ended in time"] += 1
        found["longest end [ms]"] = max(found["longest end [ms]"], round(1000 * late))
        replaced = path.read_bytes() != before
        if replaced and bits(path) != truth:
            found["EARLIER FILE LOST"] += 1
        found["file replaced, complete" if replaced else "earlier file intact"] += 1
        found[f"exit status {process.returncode}"] += 1
        again = start(what, path)
        _, told = again.communicate(timeout=120)
        found["went on from blocks"] += "goes on from" in told or "finished by an earlier run" in told
        if again.returncode != 0:
            found["NEXT RUN FAILED"] += 1
            print(told)
            return
        left = sorted(each.name for each in Path(folder).iterdir())
        found["NOT SWEPT " + str(left) if left != ["run.nc"] else "nothing left"] += 1
        found["same bits" if bits(path) == truth else "OTHER BITS"] += 1


def fill_disk(what: str, megabytes: int, found: Counter) -> None:
    """Run a program on a small disk."""
    with tempfile.TemporaryDirectory() as folder:
        mount = ["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", folder]
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            found["no tmpfs could be mounted"] += 1
            return
        try:
            process = start(what, Path(folder) / "run.nc", LARGER[what])
            _, told = process.communicate(timeout=120)
            left = sorted(each.name for each in Path(folder).iterdir())
            if process.returncode == 0:
                found["fits"] += 1
                return
            last = told.strip().splitlines()[-1]
            named = "OSError" in last and "run.nc" in last and "No space left" in last
            found["OSError that names the file" if named else f"NOT NAMED: {last[:150]}"] += 1
            found["nothing left on the disk" if not left else f"LEFT ON THE DISK {left}"] += 1
        finally:
            subprocess.run(["umount", folder], check=True)


truth_fingerprint: dict[str, str] = {}
own_end: dict[str, float] = {}  # seconds from the last line of a run to its end


def main() -> None:
    """Stop and fill, and print what was found."""
    # A shell has what it runs in the background ignore Ctrl-C, and so would the programs.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    moments, seed = (int(text) for text in [*sys.argv[1:], *["200", "0"][len(sys.argv) - 1 :]])
    generator = random.Random(seed)
    truth, seconds = {}, {}
    for what in SIZES:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "run.nc"
            start(what, path).communicate()  # compiles
            process, began = start(what, path), time.perf_counter()
            assert process.stdout is not None
            assert process.stdout.readline() == "done\n"
            seconds[what] = time.perf_counter() - began
            process.communicate()
            own_end[what] = time.perf_counter() - began - seconds[what]
            truth[what] = bits(path)
            with xr.open_dataset(path) as read:
                truth_fingerprint[what] = read.attrs.get("fingerprint", "")
    print({what: f"{value:.2f} s, ends in {own_end[what]:.2f} s" for what, value in seconds.items()}, flush=True)
    found: dict[str, Counter] = {}
    signals = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
    for each in range(moments):
        what, number = list(SIZES)[each % 3], signals[each // 3 % 3]
        counts = found.setdefault(f"{what}, {number.name}", Counter())
        stop_once(what, number, generator.uniform(0, seconds[what]), truth[what], counts)
    for each in range(moments // 10):
        what = list(SIZES)[each % 3]
        fill_disk(what, generator.randint(1, DISKS[what]), found.setdefault(f"{what}, small disk", Counter()))
    bad = 0
    for name, counts in found.items():
        print(f"{name:<22}", ", ".join(f"{text}: {count}" for text, count in sorted(counts.items())))
        bad += sum(count for text, count in counts.items() if text.split(":")[0].split("[")[0].strip().isupper())
        bad += sum(count for text, count in counts.items() if text.startswith("ended late"))
    print(f"{bad} failures at {moments} moments")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
