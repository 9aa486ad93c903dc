"""Damage record files at random, and count what their readers make of it.

By hand: `python tests/record_mutations.py --mutations 100000`. A damaged file is refused, read with a warning, read as
the same record, or read as another one without a word. The last is counted apart where nothing in the file could tell:
where digits or signs are replaced, or lines exchanged, so that it is a sound file of another record (`is_sound`, which
uses no reader).
"""

from __future__ import annotations

import argparse
import re
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import network_files
import numpy as np
import record_files
from network_soundness import SOUND

import warpdyn as wd

READERS: dict[str, tuple[Callable[[np.ndarray], str], Callable[[Path], list[wd.GroundMotion]]]] = {
    "at2": (lambda values: record_files.at2(values / 100), lambda path: [wd.records.read_at2(path)]),
    "text": (record_files.text, lambda path: [wd.records.read_text(path, unit="gal")]),
    "table": (record_files.table, lambda path: [wd.records.read_text(path, unit="gal", step=0.01)]),
    "esm": (record_files.esm, lambda path: [wd.records.read_esm(path)]),
    "cosmos": (record_files.cosmos, lambda path: wd.records.read_cosmos(path, "all")),
    "knet": (network_files.knet, lambda path: wd.records.read(path)),
    "csmip_v1": (lambda values: network_files.csmip_v1(values / 1000), lambda path: wd.records.read(path)),
    "csmip_v2": (network_files.csmip_v2, lambda path: wd.records.read(path)),
    "bhrc": (lambda values: network_files.bhrc(values / 100), lambda path: wd.records.read(path)),
    "smc": (network_files.smc, lambda path: wd.records.read(path)),
    "geonet": (lambda values: network_files.geonet(10 * values), lambda path: wd.records.read(path)),
    "asa": (lambda values: network_files.asa(_table(values)), lambda path: wd.records.read(path)),
    "afad": (lambda values: network_files.afad(_table(values)), lambda path: wd.records.read(path)),
    "cwa": (lambda values: network_files.cwa(_table(values)), lambda path: wd.records.read(path)),
    "running": (network_files.running, lambda path: wd.records.read(path, unit="gal", step=0.01)),
}


def _table(values: np.ndarray) -> np.ndarray:
    return np.round(np.column_stack([values, values[::-1] / 2, -0.8 * values]), 4)


CHARACTERS = "0123456789.-+EeDd ,;\tGx\n"


def mutate(text: str, random: np.random.Generator) -> tuple[str, str]:
    """Return what is done to a file, and the damaged file."""
    lines = text.split("\n")
    at, line = int(random.integers(len(text))), int(random.integers(len(lines)))
    other = int(random.integers(len(lines)))
    character = CHARACTERS[random.integers(len(CHARACTERS))]
    kinds: dict[str, Callable[[], str]] = {
        "delete a character": lambda: text[:at] + text[at + 1 :],
        "insert a character": lambda: text[:at] + character + text[at:],
        "replace a character": lambda: text[:at] + character + text[at + 1 :],
        "swap two characters": lambda: text[:at] + text[at : at + 2][::-1] + text[at + 2 :],
        "delete a few characters": lambda: text[:at] + text[at + int(random.integers(2, 9)) :],
        "delete a line": lambda: "\n".join(lines[:line] + lines[line + 1 :]),
        "double a line": lambda: "\n".join([*lines[:line], lines[line], *lines[line:]]),
        "swap two lines": lambda: "\n".join(
            lines[other] if i == line else lines[line] if i == other else each for i, each in enumerate(lines)
        ),
        "cut the end": lambda: text[:at],
        "cut the last value": lambda: text.rstrip()[: -int(random.integers(1, 9))],
        "delete a point": lambda: _without(text, ".", random),
        "delete a sign": lambda: _without(text, "-", random),
    }
    name = list(kinds)[random.integers(len(kinds))]
    return name, kinds[name]()


def _without(text: str, character: str, random: np.random.Generator) -> str:
    places = [match.start() for match in re.finditer(re.escape(character), text)]
    place = places[random.integers(len(places))]
    return text[:place] + text[place + 1 :]


def body_of(name: str, text: str) -> list[str]:
    """Return the lines behind the header, by the formats' descriptions."""
    lines = text.split("\n")
    if name == "cosmos":
        start = next((i for i, line in enumerate(lines) if " pts, approx" in line), len(lines) - 1)
        return lines[start + 1 : -2]
    return lines[{"at2": 4, "text": 1, "table": 0, "esm": 64}[name] :]


def is_sound(name: str, text: str, whole: str) -> bool:
    """Return whether a damaged file has the layout of an undamaged one, so that it does not show the damage.

    All lines have the layout of the format (its own fixed width, or its number of decimals), in their number, and
    header and body do not contradict each other in what they tell twice.
    """
    if name in SOUND:
        return _is_sound_or_cut(name, text)
    layouts = {
        "at2": r"( +-?\.\d{7}E[+-]\d\d){1,5}",
        "text": r"\d+\.\d{3},-?\d+\.\d{6}",
        "table": r"(?=.{24}$) *\d+\.\d{3} *-?\d+\.\d{6}",
        "esm": r"-?\d+\.\d{6}",
        "cosmos": r"(?=(?:.{10})+$)( *-?\d+\.\d{5})+",
    }
    # A blank line is not damage: some programs write blank lines.
    body, sound = ([line for line in body_of(name, each.rstrip("\n")) if line.strip()] for each in (text, whole))
    if not all(re.fullmatch(layouts[name], line) for line in body):
        return False
    if name == "at2" and any((end.end()) % 16 for line in body for end in re.finditer(r"E[+-]\d\d", line)):
        return False
    if name in ("text", "table"):  # its times must be even; nothing marks the end
        times = [float(re.split(r"[,\s]+", line.strip())[0]) for line in body]
        return bool(np.allclose(np.diff(times), times[1] - times[0], atol=0.02 * abs(times[1] - times[0])))
    if [len(re.findall(r"\.", line)) for line in body] != [len(re.findall(r"\.", line)) for line in sound]:
        return False
    if name in ("esm", "cosmos"):
        peak = max(abs(float(token)) for line in body for token in re.findall(r"-?\d+\.\d+", line))
        told = re.search(r"PGA_CM/S\^2: (\S+)", text) if name == "esm" else None
        before = max(abs(float(token)) for line in sound for token in re.findall(r"-?\d+\.\d+", line))
        if abs(peak - abs(float(told[1]) if told else before)) > 1e-3 * before:
            return False
    return True


def _is_sound_or_cut(name: str, text: str) -> bool:
    """Return whether a file of a network is sound; a header that is cut too early for the checks is not."""
    try:
        return SOUND[name](text)
    except (IndexError, ValueError, KeyError, ZeroDivisionError):
        return False


def outcome(name: str, text: str, whole: str, path: Path) -> str:
    """Return the class of what a reader makes of a damaged file."""
    path.write_text(whole)
    read = READERS[name][1]
    expected = read(path)
    path.write_text(text)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            found = read(path)
        except ValueError:
            return "refused"
    same = len(found) == len(expected) and all(
        a.step == b.step and np.array_equal(a.acceleration, b.acceleration)
        for a, b in zip(found, expected, strict=True)
    )
    if same:
        return "the same record"
    if told:
        return "another record, with a warning"
    return "another record, sound in itself" if is_sound(name, text, whole) else "another record, silently"


def main() -> None:
    """Count the classes of many mutations of each format, and print the first silent ones."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--mutations", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--formats", nargs="+", choices=READERS, default=list(READERS))
    arguments = parser.parse_args()
    random = np.random.default_rng(arguments.seed)
    counts: dict[str, Counter[str]] = {name: Counter() for name in READERS}
    silent: Counter[tuple[str, str]] = Counter()
    examples: dict[tuple[str, str], str] = {}
    with tempfile.TemporaryDirectory() as folder:
        for i in range(arguments.mutations):
            name = arguments.formats[i % len(arguments.formats)]
            whole = READERS[name][0](np.round(random.normal(scale=40, size=60), 5))
            kind, text = mutate(whole, random)
            result = outcome(name, text, whole, Path(folder) / "record.txt")
            counts[name][result] += 1
            if result == "another record, silently":
                silent[name, kind] += 1
                changed = next(
                    (pair for pair in zip(whole.split("\n"), text.split("\n"), strict=False) if pair[0] != pair[1]),
                    None,
                )
                examples.setdefault((name, kind), repr(changed))
    total = sum(counts.values(), Counter())
    for name, count in (*counts.items(), ("all", total)):
        print(f"{name:8}", ", ".join(f"{result}: {number}" for result, number in sorted(count.items())))
    detectable = sum(total[key] for key in ("refused", "another record, with a warning", "another record, silently"))
    print(f"silent among detectable: {total['another record, silently']} of {detectable}")
    for key, number in silent.most_common():
        print(number, *key, examples[key])


if __name__ == "__main__":
    main()
