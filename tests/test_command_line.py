"""The command `warpdyn`: runs with the bits of `simulate`, invalid input, and existing files."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.interfaces.command_line.program import main

SCENE = wd.Scene(
    wd.ShearBuilding(
        1e5, [4e7, 3e7], 3.0, law=wd.laws.Bilinear(yield_force=[3e5, 2e5], hardening_ratio=0.05),
        damping="rayleigh", damping_ratio=0.05,
    ),
    wd.HarmonicForce([5e4, 5e4], 1.5, 3.0),
    {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))},
    recorders=("drift",),
)  # fmt: skip
OF_A_RUN = ["--structures", "3", "--device", "cpu", "--step", "0.005"]


@pytest.fixture
def scene_file(tmp_path) -> Path:
    path = tmp_path / "scene.json"
    path.write_text(SCENE.to_json())
    return path


def refused(capsys, *arguments: object) -> str:
    """Return what the command prints as it refuses its input, with exit status 2 and without a traceback."""
    assert main([str(each) for each in arguments]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    return printed.err


def test_a_run_of_a_file_has_the_bits_of_simulate_and_a_report(scene_file, tmp_path, capsys):
    out = tmp_path / "run.nc"
    assert main(["run", str(scene_file), "--out", str(out), "--seed", "7", "--histories", "0", "2", *OF_A_RUN]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("3 samples: 3 ok\n")
    assert printed.endswith(f"written: {out}\n")
    histories = wd.Histories([0, 2])
    same = wd.simulate(SCENE, structures=3, seed=7, step=0.005, device="cpu", histories=histories)
    with xr.open_dataset(out) as run:
        for name in ("peak_storey_drift", "displacement", "yield_force"):
            np.testing.assert_array_equal(run[name].values, same[name].values)
    page = tmp_path / "run.html"
    assert main(["report", str(out), "--out", str(page), "--title", "Two storeys"]) == 0
    assert "<title>Two storeys</title>" in page.read_text()


def test_motions_are_read_from_files_and_directories(tmp_path, capsys):
    folder = tmp_path / "records"
    folder.mkdir()
    values = np.sin(np.arange(300) / 9) * np.exp(-np.arange(300) / 100)
    for name in ("one", "two"):
        (folder / f"{name}.txt").write_text("\n".join(f"{i * 0.01:.2f} {v:.6f}" for i, v in enumerate(values)))
        values = -0.5 * values
    motions = [wd.records.read(folder / f"{name}.txt", unit="g")[0] for name in ("one", "two")]
    scene = wd.Scene(SCENE.structure, wd.Cloud(motions), recorders=("drift",))
    file, out = tmp_path / "scene.json", tmp_path / "run.nc"
    file.write_text(scene.to_json())
    error = refused(capsys, "run", file, "--out", out)
    assert "the scene needs 2 ground motions, which the JSON does not contain: add --motions" in error
    error = refused(capsys, "run", file, "--out", out, "--motions", folder / "one.txt", "--motion-unit", "g")
    assert "does not contain the samples of motion 'two'" in error
    assert "give --motions with files that contain a motion" in error
    assert main(["run", str(file), "--out", str(out), "--motions", str(folder), "--motion-unit", "g"]) == 0
    with xr.open_dataset(out) as run:
        assert run["motion_name"].values.tolist() == [motion.name for motion in motions]
    labelled = xr.DataArray(
        [motion.values for motion in motions],
        {"record": ["one", "two"], "time": np.arange(300) * 0.01},
        name="acceleration",
        attrs={"units": "m/s2"},
    )
    wd.write(labelled.to_dataset(), tmp_path / "records.nc")
    out.unlink()
    assert main(["run", str(file), "--out", str(out), "--motions", str(tmp_path / "records.nc")]) == 0


def test_pairs_of_motions_are_read_from_the_records_of_their_components(tmp_path, capsys):
    folder = tmp_path / "records"
    folder.mkdir()
    for name, count in {"RSN1_QUAKE_N00E": 300, "RSN1_QUAKE_N90E": 260}.items():
        values = np.sin(np.arange(count) / (count / 30)) * np.exp(-np.arange(count) / 100)
        (folder / f"{name}.txt").write_text("\n".join(f"{i * 0.01:.2f} {v:.6f}" for i, v in enumerate(values)))
    read = [wd.records.read(path, unit="g")[0] for path in sorted(folder.iterdir())]
    pair = wd.PairOfMotions(read[0], read[1].lengthened(300), name="both")
    springs = [wd.Spring(f"k{dof}", {dof: 1.0}, stiffness=2e7, damping_coefficient=1e5) for dof in "xy"]
    deck = wd.LumpedStructure({"x": 1e5, "y": 1e5}, springs, influence=[{"x": 1.0}, {"y": 1.0}])
    scene = wd.Scene(deck, wd.Cloud([pair]), recorders=("displacement",))
    file, out = tmp_path / "scene.json", tmp_path / "run.nc"
    file.write_text(scene.to_json())
    given = ["--device", "cpu", "--motion-unit", "g", "--motions"]
    assert "the scene needs 2 ground motions" in refused(capsys, "run", file, "--out", out)
    error = refused(capsys, "run", file, "--out", out, *given, folder / "RSN1_QUAKE_N00E.txt")
    assert f"does not contain the samples of motion {read[1].name!r}" in error
    assert main(["run", str(file), "--out", str(out), *given, str(folder)]) == 0
    same = wd.simulate(scene, device="cpu")
    with xr.open_dataset(out) as run:
        np.testing.assert_array_equal(run["peak_displacement"], same["peak_displacement"])
        assert run["motion_name"].values.tolist() == ["both"]


def test_existing_files_stay_as_they_are(scene_file, tmp_path, capsys):
    other, page = tmp_path / "other.nc", tmp_path / "page.html"
    other.write_bytes(b"not a run of warpdyn")
    page.write_text("another page")
    assert "warpdyn did not write the existing file" in refused(capsys, "run", scene_file, "--out", other, *OF_A_RUN)
    assert "did not write" in refused(capsys, "run", scene_file, "--out", other, "--overwrite", *OF_A_RUN)
    assert other.read_bytes() == b"not a run of warpdyn"
    run = tmp_path / "run.nc"
    assert main(["run", str(scene_file), "--out", str(run), *OF_A_RUN]) == 0
    first = run.read_bytes()
    capsys.readouterr()
    # Another seed is another run: it replaces the first only if it is asked to.
    error = refused(capsys, "run", scene_file, "--out", run, "--seed", "1", *OF_A_RUN)
    assert "--overwrite" in error
    assert "overwrite=True" not in error
    assert run.read_bytes() == first
    assert "replace it by --overwrite" in refused(capsys, "report", run, "--out", page)
    assert page.read_text() == "another page"
    assert "must end in '.html'" in refused(capsys, "report", run, "--out", run)
    assert run.read_bytes() == first
    assert main(["report", str(run), "--out", str(page), "--overwrite"]) == 0
    assert main(["run", str(scene_file), "--out", str(run), "--seed", "1", "--overwrite", *OF_A_RUN]) == 0
    with xr.open_dataset(run) as second:
        assert second.attrs["seed"] == 1


def broken(name: str, told: dict) -> str:
    """Return the text of a broken scene."""
    if name == "cut":
        return json.dumps(told)[:-40]
    if name == "list":
        return "[1, 2]"
    if name == "nested":
        return "[" * 100_000
    if name == "law":
        told["structure"]["law"] = "no_law"
    elif name == "null":
        told["structure"] = None
    elif name == "numbers":
        told["structure"]["mass"] = "heavy"
    elif name == "motion":
        told["excitation"] = {"name": "a", "step": "x", "samples": 3}
    elif name == "key":
        told["sttructure"] = told.pop("structure")
    return json.dumps(told)


@pytest.mark.fast
@pytest.mark.parametrize("name", ["cut", "list", "nested", "law", "null", "numbers", "motion", "key"])
def test_a_broken_scene_is_refused_with_its_file(name, tmp_path, capsys):
    path = tmp_path / "scene.json"
    path.write_text(broken(name, json.loads(SCENE.to_json())))
    error = refused(capsys, "run", path, "--out", tmp_path / "run.nc")
    assert error.startswith(f"warpdyn run: error: {path}: ")
    assert "from_json" not in error
    assert not (tmp_path / "run.nc").exists()


@pytest.mark.fast
def test_every_part_of_a_scene_that_is_lost_gives_a_message(tmp_path, capsys):
    """Each value of the JSON is replaced in turn; the scene is accepted, or refused with its file."""

    def places(told: object) -> list[tuple]:
        inner = told.items() if isinstance(told, dict) else enumerate(told) if isinstance(told, list) else ()
        return [(), *((key, *rest) for key, each in inner for rest in places(each))]

    path = tmp_path / "scene.json"
    whole = json.loads(SCENE.to_json())
    for place in places(whole)[1:]:
        for other in (None, "x", [], {}, -1):
            told = json.loads(json.dumps(whole))
            inner = told
            for key in place[:-1]:
                inner = inner[key]
            inner[place[-1]] = other
            path.write_text(json.dumps(told))
            # The run itself is refused afterwards, because of its device.
            error = refused(capsys, "run", path, "--out", tmp_path / "run.nc", "--device", "gpu9")
            assert error.startswith("warpdyn run: error: "), (place, other)


@pytest.mark.fast
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "absent.json", "--out", "run.nc"], "absent.json: there is no such file"),
        (["run", ".", "--out", "run.nc"], ".: this is a directory"),
        (["run", "scene.json", "--out", "run.txt"], "must end in .nc or .zarr, got run.txt"),
        (["run", "scene.json", "--out", "absent/run.nc", "--structures", "2"], "absent"),
        (["run", "scene.json", "--out", "run.nc", "--device", "gpu9"], "has no device 'gpu9'; available: cpu"),
        (["run", "scene.json", "--out", "run.nc", "--device", "cpu", "cpu"], "several different GPUs"),
        (["run", "scene.json", "--out", "run.nc", "--method", "rk5", "--structures", "2"], "unknown method 'rk5'"),
        (["run", "scene.json", "--out", "run.nc", "--structures", "0"], "at least 1"),
        (["run", "scene.json", "--out", "run.nc", "--structures", "many"], "--structures: invalid int value: 'many'"),
        (["run", "scene.json", "--out", "run.nc", "--histories", "9", "--structures", "2"], "samples 0 to 1"),
        (["run", "scene.json", "--out", "run.nc", "--motions", "absent.AT2"], "absent.AT2: there is no such file"),
        (["run", "image.json", "--out", "run.nc"], "image.json is not a text file"),
        (["run", "scene.json"], "the following arguments are required: --out"),
        (["report", "absent.nc", "--out", "a.html"], "absent.nc: there is no such file"),
        (["report", "scene.json", "--out", "a.html"], "scene.json cannot be read as a netCDF file"),
        (["report", ".", "--out", "a.html"], ". is a directory"),
        (["report", "other.nc", "--out", "a.html"], "the dataset has no scene"),
        (["self-test", "--device", "gpu9"], "has no device 'gpu9'"),
        (["selftest"], "invalid choice: 'selftest'"),
        ([], "the following arguments are required: COMMAND"),
    ],
)
def test_invalid_input_is_refused(arguments, words, scene_file, capsys, monkeypatch):
    monkeypatch.chdir(scene_file.parent)
    Path("image.json").write_bytes(b"\x89PNG\xff")
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf("other.nc")
    before = {path: path.read_bytes() for path in Path().iterdir()}
    assert words in refused(capsys, *arguments)
    assert {path: path.read_bytes() for path in Path().iterdir() if path.is_file()} == before


@pytest.mark.fast
def test_the_version_and_the_help_are_printed(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"warpdyn {wd.__version__}\n"
    assert main(["run", "--help"]) == 0
    assert "--target-error" in capsys.readouterr().out


def test_warnings_and_errors_of_a_process_have_the_name_of_the_command(scene_file, tmp_path):
    """Without --structures one structure is drawn, with a warning; and `python -m warpdyn` is the command."""
    command = [sys.executable, "-m", "warpdyn", "run", str(scene_file), "--device", "cpu", "--step", "0.005", "--out"]
    done = subprocess.run([*command, str(tmp_path / "run.nc")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("warpdyn run: warning: ")
    failed = subprocess.run([*command, "run.txt"], capture_output=True, text=True, check=False)
    assert (failed.returncode, failed.stdout) == (2, "")
    assert (
        failed.stderr == "warpdyn run: error: the name of --out must end in .nc or .zarr, got run.txt: give "
        "--out run.nc (netCDF) or --out run.zarr\n"
    )


def test_the_commands_of_the_page_run(tmp_path, monkeypatch):
    page = (Path(__file__).parents[1] / "docs/how_to/command_line.md").read_text()
    (program,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    commands = [shlex.split(line) for line in re.findall(r"```sh\nwarpdyn (.*?)\n```", page)]
    assert [command[0] for command in commands] == ["self-test", "run", "run", "report"]
    monkeypatch.chdir(tmp_path)
    exec(program, {})
    del commands[2]  # its records are not part of the page
    assert [main(command) for command in commands] == [0, 0, 0]
    with xr.open_dataset("run.nc") as run:
        assert run.sizes["sample"] == 100
    assert "<title>Two storeys</title>" in Path("report.html").read_text()
