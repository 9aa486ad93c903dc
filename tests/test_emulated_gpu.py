"""Kernels whose threads share samples on a GPU, run on a CPU: 32 calls of a kernel take the place of a warp.

The kernel of a CPU, whose threads have whole samples, gives the expected results. Both solve the same equations, but by
other algorithms: relaxation or cyclic reduction instead of a banded matrix, and for bilinear hinges other searches.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parent / "emulated_gpu"
COMPILER = shutil.which("cc")
PEAKS = ("peak_output", "peak_spring_deformation", "peak_spring_force", "peak_acceleration")
NOT_CONVERGED = 4
pytestmark = pytest.mark.skipif(
    COMPILER is None or not sys.platform.startswith("linux"), reason="needs a C compiler and Linux"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the folder with the outputs of all cases."""
    folder = tmp_path_factory.mktemp("emulated_gpu")
    library = folder / "warp.so"
    subprocess.run([COMPILER, "-O2", "-shared", "-fPIC", "-o", library, FOLDER / "warp.c"], check=True)
    # The text of these kernels contains addresses of their process.
    environment = os.environ | {"WARP_CACHE_PATH": str(folder / "kernels")}
    program = [sys.executable, FOLDER / "run.py", library, folder]
    subprocess.run(program, check=True, env=environment, timeout=600)
    return folder


def results(case, folder):
    """Return the outputs of both kernels: (expected, found)."""
    with np.load(folder / f"{case}.npz") as file:
        assert file["sections"].tolist() == [3] * file["sections"].size != []  # a thread for each storey
        names = [name.removesuffix(" True") for name in file.files if name.endswith(" True")]
        return tuple({name: file[f"{name} {is_gpu}"] for name in names} for is_gpu in (False, True))


@pytest.mark.parametrize(
    "case", ["bilinear", "perfectly plastic", "rigid hinges", "one branch after the other", "capped", "fish-bone"]
)
def test_threads_that_share_a_sample_give_the_results_of_a_thread(case, folder):
    expected, found = results(case, folder)
    np.testing.assert_array_equal(found["status"], expected["status"])
    assert expected["status"].tolist()[0] == 0
    assert expected["status"].tolist()[-1] == 1  # collapsed
    for name in ("spring_of_collapse", "storey_of_collapse"):
        np.testing.assert_array_equal(found[name], expected[name], err_msg=name)
    # The largest error of a moment is 1e-9 of the largest moment, in each step.
    np.testing.assert_allclose(found["time_of_collapse"], expected["time_of_collapse"], rtol=1e-7)
    for name in PEAKS:
        error = np.abs(found[name] - expected[name]) / np.abs(expected[name]).max(axis=0)
        assert error.max() < 1e-6, name


def test_a_frame_without_a_solution_is_reported(folder):
    _, found = results("one solution", folder)
    assert found["status"].tolist() == [0, *[NOT_CONVERGED] * 3]
    assert found["spring_without_equilibrium"][0] == -1
    assert (found["spring_without_equilibrium"][1:] >= 0).all()
