"""Fingerprints of every number that warpdyn computes of some fixed scenes, to show that a change of code changed none.

    python tests/fingerprints.py take FILE.json       the hash of every variable of every scene
    python tests/fingerprints.py compare FILE.json    runs them again; lists what differs, with exit status 1
    python tests/fingerprints.py values FILE.npz      the numbers themselves, of scenes in double precision
    python tests/fingerprints.py near FILE.npz        runs them again; lists what is off by more than a tolerance

Hashes are of one processor, one version of warp and one kind of device: kernels are compiled for the processor.
`--portable` compiles them for any x86-64, without fused products, to come closer to one another across machines.
All is done in one process. Scenes are in `fingerprint_laws.py`, `fingerprint_scenes.py` and
`fingerprint_analyses.py`; what they call is spelt in `fingerprint_face.py`, with the table of renamed variables.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import sys
import time
import traceback
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import xarray as xr

NOT_HASHED = ("seconds", "version")  # variables whose names hold one of these
OWN_SCALE = ("energy_balance_error", "estimated_relative_error")  # shares by themselves: their errors are absolute
PORTABLE = "-ffp-contract=off"  # and no -march: kernels for plain x86-64
# What linear algebra would otherwise choose by the number of cores, and by the kind of processor.
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1"}
PORTABLE_ENVIRONMENT = ENVIRONMENT | {"OPENBLAS_CORETYPE": "Prescott"}
ABOUT = "about"  # the entry of a file that is no scene


def load_scenes(portable: bool, device: str) -> dict:
    """Return all scenes by name; warpdyn is imported here, since it reads the compiler's flags as it is."""
    import warp as wp

    wp.config.quiet = True
    if portable:
        wp.config.cpu_compiler_flags = PORTABLE
    import fingerprint_analyses  # noqa: F401
    import fingerprint_face
    import fingerprint_laws  # noqa: F401
    import fingerprint_scenes  # noqa: F401

    fingerprint_face.USED["device"] = device
    return fingerprint_face.SCENES


def renamed(text: str) -> str:
    from fingerprint_face import RENAMED

    return RENAMED.get(text, text)


def is_added(name: str) -> bool:
    from fingerprint_face import ADDED

    return name in ADDED


def parts_of(result: object, name: str = "") -> Iterator[tuple[str, np.ndarray]]:
    """Go through all arrays of what a scene returned, with their names as they were before any renaming."""
    if isinstance(result, xr.Dataset):
        step = {"attribute step": result.attrs["step"]} if "step" in result.attrs else {}
        for key, values in (dict(result.variables) | step).items():
            if not (is_added(str(key)) or any(word in str(key) for word in NOT_HASHED)):
                yield f"{name}{renamed(str(key))}", np.asarray(getattr(values, "values", values))
    elif isinstance(result, Mapping):
        for key, part in result.items():
            is_whole = isinstance(part, xr.Dataset | Mapping)
            yield from parts_of(part, f"{name}{key}: " if is_whole else f"{name}{key}")
    else:
        yield name or "result", np.asarray(result)


def run_scenes(scenes: dict, only: list[str]) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Run scenes, all or those whose names begin with one of these, and say how far it is."""
    chosen = [name for name in scenes if not only or any(name.startswith(start) for start in only)]
    started = time.perf_counter()
    for number, name in enumerate(chosen, 1):
        before = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # many scenes are meant to be warned of
            try:
                found = dict(parts_of(scenes[name]()))
            except Exception:
                print(f"{name} cannot be run:\n{traceback.format_exc()}", flush=True)
                found = {}
        now = time.perf_counter()
        told = f"{number} of {len(chosen)}, {now - started:.0f} s: {name} took {now - before:.1f} s"
        print(told, file=sys.stderr, flush=True)
        yield name, found


def digest(values: np.ndarray) -> str:
    """Return the hash of an array's type, shape and bytes; of text that of its words, whatever their width."""
    if values.dtype.kind in "UOST":
        words = [renamed(str(word)) for word in values.ravel().tolist()]
        return hashlib.sha256(json.dumps(["text", values.shape, words]).encode()).hexdigest()
    head = f"{values.dtype.str} {values.shape} ".encode()
    return hashlib.sha256(head + np.ascontiguousarray(values).tobytes()).hexdigest()


def about(device: str, portable: bool) -> dict[str, object]:
    """Return what hashes may depend on beside the code."""
    import scipy
    import warp as wp

    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    told = {key.strip(): text.strip() for key, _, text in (line.partition(":") for line in lines)}
    return {
        "processor": told.get("model name", platform.processor()),
        "processor_flags": " ".join(sorted(told.get("flags", "").split())),
        "compiler_flags": wp.config.cpu_compiler_flags,
        "portable": portable,
        "device": device,
        "device_name": wp.get_device(device).name,
        "warp": wp.__version__,
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "python": platform.python_version(),
    }


def take(file: Path, scenes: dict, options: argparse.Namespace) -> int:
    found = {name: {key: digest(values) for key, values in parts.items()} for name, parts in ran(scenes, options)}
    found[ABOUT] = about(options.device, options.portable)
    file.write_text(json.dumps(found, indent=1) + "\n")
    print(f"{len(found) - 1} scenes, {sum(map(len, found.values())) - len(found[ABOUT])} variables")
    return 0 if all(found.values()) else 1


def ran(scenes: dict, options: argparse.Namespace) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Go through the scenes that are asked for; keep the numbers, too, if that is asked for."""
    kept = {}
    for name, parts in run_scenes(scenes, options.only):
        if options.values is not None:
            kept |= {f"{name} | {key}": array for key, array in numbers(parts).items()}
        yield name, parts
    if options.values is not None:
        np.savez_compressed(options.values, **{ABOUT: json.dumps(about(options.device, options.portable))}, **kept)
        print(f"{len(kept)} variables of numbers")


def compare(file: Path, scenes: dict, options: argparse.Namespace) -> int:
    kept = json.loads(file.read_text())
    for key, was in kept.pop(ABOUT).items():
        if (now := about(options.device, options.portable)[key]) != was:
            print(f"note: {key} was {was!r} and is {now!r}")
    if options.only:
        kept = {name: rows for name, rows in kept.items() if any(name.startswith(start) for start in options.only)}
    problems, count = [], 0
    for name, parts in ran(scenes, options):
        found, old = {key: digest(values) for key, values in parts.items()}, kept.pop(name, None)
        if old is None:
            problems += shown([f"new scene: {name}"])
            continue
        count += len(old)
        of_scene = [f"missing: {name}: {key}" for key in old.keys() - found.keys()]
        of_scene += [f"new: {name}: {key}" for key in found.keys() - old.keys()]
        of_scene += [f"differs: {name}: {key}" for key in old.keys() & found.keys() if old[key] != found[key]]
        problems += shown(of_scene)
    return told(problems + shown([f"missing scene: {name}" for name in kept]), count)


def values(file: Path, scenes: dict, options: argparse.Namespace) -> int:
    options.values = file
    return 0 if all([bool(parts) for _, parts in ran(scenes, options)]) else 1


def numbers(parts: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the numbers of a scene, none if some of them are in single precision."""
    if any(array.dtype == np.float32 for array in parts.values()):
        return {}
    return {key: array for key, array in parts.items() if array.dtype.kind in "biuf"}


def near(file: Path, scenes: dict, options: argparse.Namespace) -> int:
    with np.load(file) as stored:
        kept = {key: stored[key] for key in stored.files if key != ABOUT}
    problems, count, worst = [], 0, 0.0
    for name, parts in ran(scenes, options):
        old = {key: kept.pop(key) for key in list(kept) if key.partition(" | ")[0] == name}
        old = {key.partition(" | ")[2]: array for key, array in old.items()}
        found = numbers(parts)
        of_scene = [f"missing: {name}: {key}" for key in old.keys() - found.keys()]
        of_scene += [f"new: {name}: {key}" for key in found.keys() - old.keys()]
        for key in old.keys() & found.keys():
            count += 1
            error = error_of(found[key], old[key], is_share=key.endswith(OWN_SCALE))
            worst = max(worst, error if np.isfinite(error) else 0.0)
            if not error <= options.tolerance:
                of_scene.append(f"differs by {error:.3g}: {name}: {key}")
        problems += shown(of_scene)
    if not options.only:
        problems += shown([f"missing: {key}" for key in kept])
    print(f"largest finite error {worst:.3g}")
    return told(problems, count)


def error_of(new: np.ndarray, old: np.ndarray, is_share: bool) -> float:
    """Return the largest error over the largest absolute value; infinite where shapes, NaN or whole numbers differ."""
    if new.dtype != old.dtype or new.shape != old.shape:
        return np.inf
    if new.dtype.kind != "f":
        return 0.0 if np.array_equal(new, old) else np.inf
    finite = np.isfinite(old)
    if not np.array_equal(new[~finite], old[~finite], equal_nan=True) or not np.isfinite(new[finite]).all():
        return np.inf
    largest = np.abs(old[finite]).max(initial=0.0)
    error = np.abs(new[finite] - old[finite]).max(initial=0.0)
    return float(error / max(largest, 1.0 if is_share else 0.0)) if error else 0.0


def shown(problems: list[str]) -> list[str]:
    """Print problems as they are found, and return them."""
    for problem in sorted(problems):
        print(problem, flush=True)
    return problems


def told(problems: list[str], count: int) -> int:
    print(
        f"{len(problems)} differences, {count} variables compared"
        if problems
        else f"no difference in {count} variables"
    )
    return 1 if problems else 0


def main() -> int:
    actions = {"take": take, "compare": compare, "values": values, "near": near}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=actions)
    parser.add_argument("file", type=Path)
    parser.add_argument("--device", help="cpu (by default) or cuda:0; what compares takes the file's by default")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="scenes whose names begin so")
    parser.add_argument("--portable", action="store_true", help="kernels for any x86-64, without fused products")
    parser.add_argument("--values", type=Path, metavar="FILE.npz", help="of take and compare: keep the numbers, too")
    parser.add_argument("--tolerance", type=float, default=1e-12, help="of near: over the largest value of a variable")
    options = parser.parse_args()
    if options.action in ("compare", "near"):  # as the file was taken
        if options.action == "compare":
            was = json.loads(options.file.read_text())[ABOUT]
        else:
            with np.load(options.file) as stored:
                was = json.loads(str(stored[ABOUT]))
        options.device, options.portable = options.device or was["device"], options.portable or was["portable"]
    options.device = options.device or "cpu"
    environment = PORTABLE_ENVIRONMENT if options.portable else ENVIRONMENT
    if any(os.environ.get(name) != text for name, text in environment.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | environment)  # numpy is there already
    return actions[options.action](options.file, load_scenes(options.portable, options.device), options)


if __name__ == "__main__":
    sys.exit(main())
