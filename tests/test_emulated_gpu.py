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
from emulated_gpu.cases import PEAKS

FOLDER = Path(__file__).parent / "emulated_gpu"
COMPILER = shutil.which("cc")
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


def results(case, folder, storeys=3):
    """Return the outputs of both kernels: (expected, found)."""
    with np.load(folder / f"{case}.npz") as file:
        assert set(file["sections"].tolist()) == {storeys}  # a thread for each storey
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


def test_threads_without_a_storey_are_not_needed_and_single_precision_suffices(folder):
    expected, found = results("two storeys, float32", folder, storeys=2)
    np.testing.assert_array_equal(found["status"], expected["status"])
    for name in PEAKS:
        # The largest error of a moment is 5e-5 of the largest moment, in each step; drifts are rounded.
        assert np.abs(found[name] - expected[name]).max() < 1e-3 * np.abs(expected[name]).max(), name


def test_bits_of_a_sample_do_not_depend_on_others_of_its_warp(folder):
    with np.load(folder / "bilinear.npz") as file:
        for name in PEAKS:
            np.testing.assert_array_equal(file[f"{name} alone"], file[f"{name} True"], err_msg=name)


def test_a_frame_without_a_solution_is_reported(folder):
    _, found = results("one solution", folder)
    assert found["status"].tolist() == [0, *[NOT_CONVERGED] * 3]
    assert found["spring_without_equilibrium"][0] == -1
    assert (found["spring_without_equilibrium"][1:] >= 0).all()
