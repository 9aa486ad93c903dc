"""The command-line program `warpdyn` with its subcommands; `main` runs it and returns the exit status."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

import warpdyn as wd

PASSED, FAILED, INVALID, INTERRUPTED = 0, 1, 2, 130  # exit statuses
_RECORDS = "files or directories with the ground motions of the scene, or far_field or near_field (FEMA P-695)"
# Left: how error messages name an argument of a Python function. Right: the option of the command that replaces it.
_OPTIONS = {"overwrite=True": "--overwrite", "histories=": "--histories"}
_DEVICES = "cpu, cuda (all GPUs), or cuda:0"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command `warpdyn` and return its exit status: 0, 1 (failed), 2 (invalid input) or 130 (interrupted).

    Args:
        arguments: Command-line arguments without the name of the program; None: the arguments of this process.
    """
    parser = _parser()
    try:
        given = parser.parse_args(arguments)
    except SystemExit as ended:  # argparse has printed the help, the version or an error
        return int(ended.code or 0)
    name = f"warpdyn {given.command}"
    with warnings.catch_warnings():
        warnings.showwarning = lambda message, *_, **__: print(f"{name}: warning: {message}", file=sys.stderr)
        try:
            return int(given.function(given))
        except (ValueError, TypeError, OSError, ImportError) as error:
            print(f"{name}: error: {_of_command(error)}", file=sys.stderr)
            return INVALID
        except RuntimeError as error:
            print(f"{name}: failed: {_of_command(error)}", file=sys.stderr)
            return FAILED
        except KeyboardInterrupt:
            resume = "; the same command continues the run" if given.command == "run" else ""
            print(f"{name}: interrupted{resume}", file=sys.stderr)
            return INTERRUPTED


def _of_command(error: Exception) -> str:
    """Return an error message in which names of Python arguments are replaced by the options of the command."""
    text = str(error) or type(error).__name__
    for argument, option in _OPTIONS.items():
        text = text.replace(argument, option)
    return text


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="warpdyn",
        description="Nonlinear response-history analyses of ensembles of structures.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"warpdyn {wd.__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    test = commands.add_parser(
        "self-test", help="compare a small ensemble on each device with exact results", allow_abbrev=False
    )
    test.add_argument("--device", nargs="+", metavar="NAME", help=f"{_DEVICES}; default: all devices")
    test.set_defaults(function=_self_test)

    run = commands.add_parser("run", help="run the scene in a JSON file", allow_abbrev=False)
    run.add_argument("scene", type=Path, help="file with the text of Scene.to_json()")
    run.add_argument("--out", required=True, metavar="RUN", help="netCDF file (run.nc) or Zarr store (run.zarr)")
    run.add_argument("--motions", nargs="+", default=[], metavar="FILE", help=_RECORDS)
    run.add_argument("--motion-unit", metavar="UNIT", help="unit of record files that do not contain it, such as g")
    run.add_argument(
        "--motion-step", type=float, metavar="SECONDS", help="step of record files that do not contain it [s]"
    )
    run.add_argument("--structures", type=int, metavar="N", help="number of structures to draw")
    run.add_argument("--seed", type=int, default=0, metavar="N", help="seed of the random draws; default: 0")
    run.add_argument("--method", metavar="NAME", help="integration method, such as rk4")
    run.add_argument("--step", type=float, metavar="SECONDS", help="integration step [s]")
    run.add_argument("--dtype", metavar="TYPE", help="float32 or float64")
    run.add_argument("--target-error", type=float, metavar="ERROR", help="relative error of peak drifts, such as 0.01")
    run.add_argument("--checked-share", type=float, metavar="SHARE", help="share of samples to check, such as 0.1")
    run.add_argument(
        "--histories", type=int, nargs="+", metavar="SAMPLE", help="samples whose whole histories are kept"
    )
    run.add_argument("--device", nargs="+", metavar="NAME", help=f"{_DEVICES}; default: the first GPU, or cpu")
    run.add_argument("--threads", type=int, metavar="N", help="CPU threads; default: all cores")
    run.add_argument("--overwrite", action="store_true", help="replace another run of warpdyn at RUN")
    run.set_defaults(function=_run)

    report = commands.add_parser("report", help="write a report of a run as one HTML file", allow_abbrev=False)
    report.add_argument("run", type=Path, help="file of a run: run.nc or run.zarr")
    report.add_argument("--out", required=True, metavar="REPORT", help="HTML file")
    report.add_argument("--title", help="title of the page; default: the title of the run")
    report.add_argument("--overwrite", action="store_true", help="replace a file that is not a report of warpdyn")
    report.set_defaults(function=_report)
    return parser


def _self_test(given: argparse.Namespace) -> int:
    from warpdyn.interfaces.command_line.self_test import self_test

    return self_test(given.device)


def _run(given: argparse.Namespace) -> int:
    from warpdyn.interfaces.command_line.scene_files import read_scene

    if not given.out.endswith((".nc", ".zarr")):
        raise ValueError(
            f"the name of --out must end in .nc or .zarr, got {given.out}: give --out run.nc (netCDF) or --out run.zarr"
        )
    scene = read_scene(given.scene, given.motions, given.motion_unit, given.motion_step)
    device = given.device[0] if given.device and len(given.device) == 1 else given.device
    run = wd.simulate(
        scene,
        structures=given.structures,
        seed=given.seed,
        method=given.method,
        step=given.step,
        dtype=given.dtype,
        target_error=given.target_error,
        checked_share=given.checked_share,
        histories=None if given.histories is None else wd.Histories(given.histories),
        device=device,
        threads=given.threads,
        path=given.out,
        overwrite=given.overwrite,
    )
    with run:
        print(wd.summary(run))
    print(f"written: {given.out}")
    return PASSED


def _report(given: argparse.Namespace) -> int:
    from warpdyn.interfaces.command_line.scene_files import read_dataset

    with read_dataset(given.run) as run:
        try:
            path = wd.report(run, given.out, title=given.title, overwrite=given.overwrite)
        except ValueError as error:
            raise ValueError(f"{error} (file {given.run})") from error
    print(f"written: {path}")
    return PASSED
