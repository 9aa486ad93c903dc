"""Naming conventions of public record sets: no vertical record is read as horizontal, and all pairs are found."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import record_files
from record_conventions import CONVENTIONS, SEVERAL_SENSORS

import warpdyn as wd

pytestmark = pytest.mark.fast

NAMED = [each for each in CONVENTIONS if not each.only_header]
WITH_HEADER = [each for each in CONVENTIONS if each.header]


def write(folder: Path, names: list[str], titles: list[str]) -> None:
    for i, (name, title) in enumerate(zip(names, titles, strict=True)):
        values = "".join(f"{0.01 * np.sin(0.3 * j + i):15.7E}\n" for j in range(8))
        content = f"PEER\n{title}\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS=  8, DT=  .0100 SEC\n{values}"
        (folder / name).write_text(content, encoding="utf-8")


def found(folder: Path, unit: str | None = None) -> tuple[list[list[str]], list[str]]:
    """Return the names of the files of each pair, and those of the vertical records."""
    with warnings.catch_warnings(action="error"):
        horizontal = wd.records.read_directory(folder, "*", unit=unit)
        vertical = wd.records.read_directory(folder, "*", components="vertical", unit=unit)
    return [sorted(Path(motion.source).name for motion in pair) for pair in wd.records.pairs(horizontal)], sorted(
        Path(motion.source).name for motion in vertical
    )


def test_number_of_conventions():
    assert len(CONVENTIONS) >= 80
    assert len({each.what for each in CONVENTIONS}) == len(CONVENTIONS)


@pytest.mark.parametrize("convention", NAMED, ids=lambda each: each.what)
def test_components_from_names(tmp_path, convention):
    first, second, vertical = convention.files()
    write(tmp_path, [first, second, vertical], ["no component"] * 3)
    assert found(tmp_path) == ([sorted([first, second])], [vertical])


@pytest.mark.parametrize("convention", NAMED, ids=lambda each: each.what)
def test_components_from_names_of_text_files(tmp_path, convention):
    """The names of all files are compared, as those of AT2 files are."""
    names = convention.files()
    for i, name in enumerate(names):
        (tmp_path / name).write_text(record_files.table(10 * np.sin(0.3 * np.arange(8) + i)))
    assert found(tmp_path, unit="gal") == ([sorted(names[:2])], [names[2]])


@pytest.mark.parametrize("convention", WITH_HEADER, ids=lambda each: each.what)
def test_components_from_headers(tmp_path, convention):
    first, second, vertical = convention.files()
    write(tmp_path, [first, second, vertical], convention.titles())
    assert found(tmp_path) == ([sorted([first, second])], [vertical])


@pytest.mark.parametrize("what", SEVERAL_SENSORS)
def test_several_sensors_at_one_station(tmp_path, what):
    pairs, vertical = SEVERAL_SENSORS[what]
    names = [*(name for pair in pairs for name in pair), *vertical]
    write(tmp_path, names, ["no component"] * len(names))
    assert found(tmp_path) == (sorted(sorted(pair) for pair in pairs), sorted(vertical))


def test_all_conventions_in_one_folder(tmp_path):
    """Names of other conventions in the same folder do not mislead."""
    conventions = [each for each in NAMED if not each.template.startswith("{}.")]
    sets = [each.files() for each in conventions]
    names = [name for files in sets for name in files]
    assert len(set(names)) == len(names)
    write(tmp_path, names, ["no component"] * len(names))
    both, vertical = found(tmp_path)
    assert vertical == sorted(files[2] for files in sets)
    assert sorted(both) == sorted(sorted(files[:2]) for files in sets)
