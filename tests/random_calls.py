"""Call public functions with one or two arguments replaced by hostile values, and count what comes of it.

By hand: `python tests/random_calls.py --calls 6000`. A call is accepted, refused by an error that names a replaced
argument, or refused in another way, which is a fault, as are calls that end the process, take more than
PATIENCE seconds or more memory than MEMORY. `--accepted` lists what was accepted, to be judged by a reader.
"""

from __future__ import annotations

import argparse
import contextlib
import datetime
import io
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from sound_calls import Call, without_runs
from sound_calls_of_runs import with_runs

import warpdyn as wd

PATIENCE, MEMORY = 20, 6 * 2**30  # seconds of a call; bytes of address space beyond that of a process at rest
HOSTILE: dict[str, Callable[[], Any]] = {
    "None": lambda: None,
    "True": lambda: True,
    "False": lambda: False,
    "numpy bool": lambda: np.True_,
    "text": lambda: "nonsense",
    "empty text": lambda: "",
    "number as text": lambda: "0.05",
    "bytes": lambda: b"0.05",
    "nan": lambda: float("nan"),
    "inf": lambda: float("inf"),
    "-1": lambda: -1,
    "0": lambda: 0,
    "0.5": lambda: 0.5,
    "10**9": lambda: 10**9,
    "10**400": lambda: 10**400,
    "1e308": lambda: 1e308,
    "1e-308": lambda: 1e-308,
    "complex": lambda: 1 + 2j,
    "complex array": lambda: np.array([1 + 2j, 3 + 0j]),
    "numpy float": lambda: np.float32(0.5),
    "numpy integer": lambda: np.int64(3),
    "0-d array": lambda: np.array(0.5),
    "empty list": list,
    "empty array": lambda: np.zeros(0),
    "one value": lambda: [0.5],
    "ragged": lambda: [[1.0, 2.0], [3.0]],
    "3-d array": lambda: np.ones((2, 2, 2)),
    "list with nan": lambda: [1.0, float("nan")],
    "list with None": lambda: [1.0, None],
    "list of bools": lambda: [True, False],
    "list of text": lambda: ["1", "2"],
    "object array": lambda: np.array([1.0, "a", None], dtype=object),
    "masked array": lambda: np.ma.masked_array([1.0, 2.0], [False, True]),
    "masked number": lambda: np.ma.masked,
    "dates": lambda: np.array(["2020-01-01", "2020-01-02"], dtype="datetime64[D]"),
    "structured array": lambda: np.zeros(2, dtype=[("a", float), ("b", float)]),
    "dict": lambda: {"a": 1},
    "empty dict": dict,
    "set": lambda: {1.0, 2.0},
    "class": lambda: wd.GroundMotion,
    "building class": lambda: wd.ShearBuilding,
    "function": lambda: len,
    "object": object,
    "path": lambda: Path("/nonexistent/file"),
    "folder": lambda: Path("/"),
    "datetime": lambda: datetime.datetime(2020, 1, 1),
    "generator": lambda: (x for x in (1.0, 2.0)),
    "range of 10**9": lambda: range(10**9),
    "DataArray": lambda: xr.DataArray(np.ones((2, 2)), dims=("x", "y")),
    "empty Dataset": xr.Dataset,
    "a motion": lambda: wd.GroundMotion([0.0, 1.0, 0.0], 0.01),
}


def elements_of(value: Any) -> list[Any]:
    """Return the keys or places of a container whose elements may be replaced."""
    if isinstance(value, dict):
        return list(value)
    return list(range(len(value))) if isinstance(value, list | tuple) else []


def spoilt(call: Call, random: np.random.Generator) -> tuple[dict[str, Any], list[str], list[str]]:
    """Return arguments of which one or two are hostile, with their names and what they were replaced by."""
    arguments = dict(call[1])
    names = [
        str(name) for name in random.choice(list(arguments), min(len(arguments), 1 + (random.random() < 0.2)), False)
    ]
    kinds = []
    for name in names:
        kind = list(HOSTILE)[random.integers(len(HOSTILE))]
        places = elements_of(arguments[name])
        if places and random.random() < 0.3:
            place = places[random.integers(len(places))]
            changed = dict(arguments[name]) if isinstance(arguments[name], dict) else list(arguments[name])
            changed[place] = HOSTILE[kind]()
            arguments[name] = type(arguments[name])(changed)
            kinds.append(f"element {kind}")
        else:
            arguments[name] = HOSTILE[kind]()
            kinds.append(kind)
    return arguments, names, kinds


def names_argument(text: str, names: list[str]) -> bool:
    """Return whether a message contains the name of an argument; a list may be told by one of its elements."""
    words = re.sub(r"[^a-z0-9]+", " ", text.lower())
    stems = [re.sub("(ies|s)$", "", name.lower().replace("_", " ")) for name in names]
    return any(re.search(rf"\b{stem}", words) for stem in stems)


class TookTooLong(BaseException):
    """Raised by the alarm."""


def _stop(number: int, frame: FrameType | None) -> None:
    raise TookTooLong


def outcome(call: Call, arguments: dict[str, Any], names: list[str]) -> tuple[str, str]:
    """Return the class of what comes of a call, and what it says."""
    given = [str(arguments[name]) for name in names if name in ("path", "fields", "sites")]
    with warnings.catch_warnings(record=True) as told, contextlib.redirect_stderr(io.StringIO()):
        warnings.simplefilter("always")
        signal.signal(signal.SIGALRM, _stop)
        signal.alarm(PATIENCE)
        try:
            found = call[0](**arguments)
        except (ValueError, TypeError, OSError, MemoryError) as error:
            text = str(error)
            kind = type(error).__name__
            ours = ("builtins", "warpdyn.foundations.core.checks")
            bare = type(error) is MemoryError or type(error).__module__ not in ours
            # An error of a file names the file.
            is_of_file = any(each and each in text for each in given)
            if (names_argument(text, names) or is_of_file) and not bare:
                return "refused by name", f"{kind}: {text}"
            return "refused without the name", f"{kind}: {text}"
        except TookTooLong:
            return "took too long", ""
        except BaseException as error:  # whatever it is, it is counted
            return "another error", f"{type(error).__name__}: {error}"
        finally:
            signal.alarm(0)
            close_figures()
    text = repr(found)[:150] if not isinstance(found, xr.Dataset) else "a Dataset"
    # A warning of Python's or NumPy's own is no answer to a user.
    if any("warpdyn" not in str(each.filename) and issubclass(each.category, RuntimeWarning) for each in told):
        return "accepted with a stray warning", str(told[0].message)
    return ("accepted with a warning", str(told[0].message)) if told else ("accepted", text)


def close_figures() -> None:
    """Close what plots drew."""
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")


def trials(calls: dict[str, Call], first: int, last: int) -> Iterator[dict[str, Any]]:
    """Make some of the calls; each is a function of its number alone."""
    for number in range(first, last):
        random = np.random.default_rng([34, number])
        name = list(calls)[number % len(calls)]
        arguments, names, kinds = spoilt(calls[name], random)
        yield {"number": number, "call": name, "arguments": names, "kinds": kinds, "begins": True}
        kind, text = outcome(calls[name], arguments, names)
        yield {"number": number, "call": name, "arguments": names, "kinds": kinds, "outcome": kind, "text": text}


def work(first: int, last: int, only: str) -> None:
    """Make calls in this process, and print a line of JSON before and after each."""
    mpl.use("agg")
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    sys.stdout = io.StringIO()
    with tempfile.TemporaryDirectory() as folder:
        calls = without_runs(Path(folder)) | with_runs(Path(folder))
        calls = {name: call for name, call in calls.items() if re.search(only, name)}
        os.chdir(folder)
        with open("/proc/self/status") as lines:
            rest = 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmSize"))
        resource.setrlimit(resource.RLIMIT_AS, (rest + MEMORY, rest + MEMORY))
        for name, (function, arguments) in calls.items() if first == 0 else ():
            with contextlib.suppress(Exception):
                function(**arguments)
                continue
            raise AssertionError(f"the sound call of {name} is refused")
        for found in trials(calls, first, last):
            answers.write(json.dumps(found) + "\n")


def all_outcomes(count: int, only: str) -> Iterator[dict[str, Any]]:
    """Yield what comes of all calls; a process that ends is replaced by another one, behind the call that ended it."""
    first = 0
    while first < count:
        command = [sys.executable, __file__, "--worker", f"{first}", f"{count}", "--only", only]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as worker:
            begun = None
            assert worker.stdout is not None
            for line in worker.stdout:
                found = json.loads(line)
                begun = found if "begins" in found else None
                if begun is None:
                    yield found
                first = found["number"] + 1
        if begun is not None:
            yield begun | {"outcome": "ended the process", "text": f"exit status {worker.returncode}"}
        elif worker.returncode:
            raise RuntimeError(f"a worker ended with exit status {worker.returncode} before its first call")


def main() -> None:
    """Count the outcomes of many calls, and print those that are faults."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--calls", type=int, default=6000)
    parser.add_argument("--only", default="", help="regular expression of the functions' names")
    parser.add_argument("--accepted", action="store_true", help="print what was accepted, too")
    parser.add_argument("--worker", type=int, nargs=2)
    arguments = parser.parse_args()
    if arguments.worker:
        work(*arguments.worker, arguments.only)
        return
    counts: Counter[str] = Counter()
    functions = set()
    for found in all_outcomes(arguments.calls, arguments.only):
        counts[found["outcome"]] += 1
        functions.add(found["call"])
        is_sound = found["outcome"] in ("refused by name", "accepted", "accepted with a warning")
        if not is_sound or (arguments.accepted and found["outcome"].startswith("accepted")):
            given = ", ".join(f"{name}={kind}" for name, kind in zip(found["arguments"], found["kinds"], strict=True))
            print(f"{found['outcome']:28} {found['call']}({given}): {found['text'][:300]}", flush=True)
    print(f"{sum(counts.values())} calls of {len(functions)} functions: {dict(counts)}")


if __name__ == "__main__":
    main()
