"""The main job, run once by the README's own command and read by several tests; a fixture that compiles quickly."""

from __future__ import annotations

import gc
import importlib
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

import pytest
import warp as wp
import xarray as xr
from hypothesis import HealthCheck, settings
from validation import Measured

import warpdyn as wd
from warpdyn.engine.kernels import build, compilation
from warpdyn.engine.kernels.composing.user_recorders import TABLE, USERS

ROOT = Path(__file__).parents[1]
# A shell's background jobs, and what they start, ignore Ctrl-C, which tests send.
signal.signal(signal.SIGINT, signal.default_int_handler)
built_for = wp.config.optimization_level  # the level of optimisation that cached kernels were built for
PATIENCE = 300  # seconds that the main job of `.ci/run` may still take
# The files that take longest, by `--durations=0`, begin first, in this order, and those that compile next to nothing
# begin last: a long one that began last would leave the other cores idle.
LONGEST = """
    lumped_structure verification_problems combinations lumped_implicit readme combinations_sm90 written_laws cluster
    hinged_fishbone_laws recording_start law_contract contacts biaxial_springs p695_fragility docstring_examples
    storeys_of_lumped_structures hinged_fishbone_use rounding hinged_fishbone gpu_queue parameter_pages frame_lumped
    regions law_asymmetric p_delta frame_opensees preparation_of_damping blocks certify hinged_frame resultant_outputs
    implicit_search linear filtered_noise lumped_storeys lone_samples builders_pounding_row devices maxwell_damper
    accuracy_speed isolation_study propagators portfolio preparation_of_laws simcenter_study lumped_scatter
    builders_torsion torsion_study hosted_notebook
"""
# Composing kernels makes objects by the million, few of them in cycles: looking for cycles less often saves a twelfth
# of the processor time.
gc.set_threshold(50_000, 20, 50)
# Hypothesis times its examples and fails a test whose examples come slowly: what a busy machine or a slow one does.
settings.register_profile("warpdyn", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("warpdyn")


def documented_commands() -> list[str]:
    """Return the commands in the shell blocks and in the text of the README, and of the page of studies."""
    text = "".join((ROOT / page).read_text() for page in ("README.md", "docs/how_to/studies.md"))
    blocks = re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL)
    inline = re.findall(r"`(\S*python studies/[^`]+)`", text)
    return [line for block in blocks for line in block.splitlines() if line.strip()] + inline


def run_study(
    command: str, out: Path, *, is_limited: bool = True, has_device: bool = True
) -> subprocess.CompletedProcess[str]:
    """Run the `python studies/...` part of a command on the CPU with this interpreter; results are written to `out`.

    With `is_limited` it has the private memory that a small machine has; pyarrow alone reserves a gigabyte of it.
    `has_device` is whether the study has the argument `--device`.
    """
    script = re.search(r"python (studies/\S+\.py) --out (\S+)(.*)$", command)
    device = ["--device", "cpu"] if has_device else []
    arguments = [sys.executable, script[1], "--out", str(out), *device, *script[3].split()]
    environment = os.environ | {"MPLBACKEND": "agg", "PYTHONWARNINGS": "error:implausible input"}
    environment["ARROW_DEFAULT_MEMORY_POOL"] = "system"  # pandas imports pyarrow, whose own pool reserves a gigabyte
    limit = _limit_memory if is_limited else None
    return subprocess.run(
        arguments, cwd=ROOT, capture_output=True, text=True, env=environment, check=False, preexec_fn=limit
    )


def _limit_memory() -> None:
    """Limit a study's private memory to 1.5 GiB, which a small machine has."""
    resource.setrlimit(resource.RLIMIT_DATA, (3 * 2**29, 3 * 2**29))


@pytest.fixture(scope="session")
def main_job(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return the folder of results and the terminal output of the README's first command.

    `.ci/run` names the folder in which it has run that command on this commit, or still does.
    """
    handed = os.environ.get("WARPDYN_MAIN_JOB")
    if handed is not None:
        folder, status, log = Path(handed, "results"), Path(f"{handed}.status"), Path(f"{handed}.log")
        until = time.monotonic() + PATIENCE
        while not status.is_file():
            assert time.monotonic() < until, f"{status} was not written in {PATIENCE} s: has the main job ended?"
            time.sleep(1)
        assert status.read_text().strip() == "0", log.read_text()
        with xr.open_dataset(folder / "p695_fragility.nc") as run:
            on_cpu = run.attrs["device"].startswith("cpu")
        if on_cpu:  # what these tests are about
            return folder, log.read_text()
    out = tmp_path_factory.mktemp("main_job")
    done = run_study(documented_commands()[0], out)
    assert done.returncode == 0, done.stderr
    return out, done.stdout


def _forget_kernels_of_another_level() -> None:
    """Clear the caches of kernels if they were built for another level of optimisation than the present one.

    Tests of one level that follow each other share their kernels: to compose one takes Python a tenth of a second.
    """
    global built_for
    if wp.config.optimization_level == built_for:
        return
    built_for = wp.config.optimization_level
    for name, module in list(sys.modules.items()):
        if name.startswith("warpdyn.engine.kernels."):
            for each, factory in vars(module).items():
                if each.endswith("_kernel") and hasattr(factory, "cache_clear"):
                    factory.cache_clear()


def pytest_configure(config: pytest.Config) -> None:
    """Keep the order of the files below; pytest-xdist would begin with those that have most tests."""
    config.option.loadscopereorder = False


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let the study of the summary of checks ask for the figures that tests measure."""
    parser.addoption("--validation", metavar="FILE", help="run what uses `measured` alone, and write its figures")


@pytest.fixture
def measured(request: pytest.FixtureRequest) -> Measured:
    """Return the function that holds a figure to its bound, and keeps it for the summary of checks."""
    test = f"{request.path.name}::{request.node.originalname}"
    is_thorough = request.node.get_closest_marker("thorough") is not None
    return Measured(test, request.config.getoption("--validation"), is_thorough=is_thorough)


@pytest.fixture
def unoptimised() -> Iterator[None]:
    """Compile a test's kernels without optimisation, in half the time.

    For what combines parts and compares runs with each other. A value that is read where it was not set, which an
    optimiser may happen to put right, shows here.
    """
    shipped = wp.config.optimization_level
    wp.config.optimization_level = 0
    _forget_kernels_of_another_level()
    yield
    wp.config.optimization_level = shipped


@pytest.fixture
def forgotten_recorders() -> Iterator[None]:
    """Remove the recorders that a test defines, so that later tests of the process have warpdyn's recorders only."""
    yield
    for name in USERS:
        for rows in TABLE.values():
            rows.pop(name, None)
    USERS.clear()


@contextmanager
def quick_kernels() -> Iterator[None]:
    """Compile kernels sooner: at level 1 of optimisation; a processor's loops over storeys and stages stay loops.

    Level 2, as a processor's kernels are shipped, takes a fifth longer to compile and saves the tests nothing. A GPU's
    are shipped at level 3.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wp.config, "optimization_level", 1)
        for name in ("CPU_UNROLL", "CPU_LONG_UNROLL", "CPU_WIDE_UNROLL", "CHAIN_OF_BRANCHES"):
            patch.setattr(build, name, 1)
        yield


@pytest.fixture
def new_kernels() -> Iterator[None]:
    """Forget the kernels of equal plans before and after a test that changes a constant."""
    build._composed_kernel.cache_clear()
    yield
    build._composed_kernel.cache_clear()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Run a test and its fixtures with quickly compiled kernels, unless it is marked `as_shipped`.

    Its scenes may be implausible in what its marks `meant_as_given` name.
    """
    names = [name for mark in item.iter_markers("meant_as_given") for name in mark.args]
    with (
        wd.meant_as_given(*names) if names else nullcontext(),
        nullcontext() if item.get_closest_marker("as_shipped") else quick_kernels(),
    ):
        if "unoptimised" not in getattr(item, "fixturenames", ()):
            _forget_kernels_of_another_level()  # before fixtures of a wider scope build theirs
        return (yield)


@pytest.fixture(autouse=True, scope="session")
def compile_here() -> None:
    """Compile each kernel where it is first launched: each processor core already runs one process of tests."""
    compilation.MOST_PROCESSES = 1


def pytest_collection(session: pytest.Session) -> None:
    """Let every second process of a whole run import the test files in reverse order, before it collects them.

    The processes begin at the same time, and each would rewrite the assertions of all files, which takes 12 s. In this
    way each rewrites half of them, and reads the other half from the byte code that the other process has written.
    """
    worker = getattr(session.config, "workerinput", {}).get("workerid", "gw0")
    tests = Path(__file__).parent
    if int(worker.removeprefix("gw")) % 2 and [Path(each).resolve() for each in session.config.args] == [tests]:
        for file in sorted(tests.glob("test_*.py"), reverse=True):
            with suppress(Exception, pytest.skip.Exception):  # reported when the file is collected
                importlib.import_module(file.stem)


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Keep the garbage collector from going through all tests again and again: they stay until the end."""
    gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Let `-m fast` leave out the thorough cases of a file that is marked `fast`, and `--validation` other tests.

    Files come in the order of their duration, as far as it is known.
    """
    compiling = {item.path for item in items if not item.get_closest_marker("fast")}
    places = {f"test_{name}": place for place, name in enumerate(LONGEST.split())}
    items.sort(key=lambda item: (item.path not in compiling, places.get(item.path.stem, len(places))))
    if config.getoption("--validation"):
        items[:] = [item for item in items if "measured" in getattr(item, "fixturenames", ())]
    if config.option.markexpr == "fast":
        config.hook.pytest_deselected(items=[item for item in items if item.get_closest_marker("thorough")])
        items[:] = [item for item in items if not item.get_closest_marker("thorough")]
