"""Warp's kernel cache: a damaged kernel, or a folder that cannot be written, gives a warning and a new compilation."""

import os
import re
import shutil
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.kernels import kernel_cache
from warpdyn.foundations.core import messages

pytestmark = pytest.mark.fast
PACKAGE = Path(kernel_cache.__file__).parents[1]


@wp.kernel(module="unique", enable_backward=False)
def twice(values: wp.array(dtype=float)):
    values[wp.tid()] = 2.0 * values[wp.tid()]


@contextmanager
def kernels_in(folder):
    """Keep kernels in a folder."""
    wp.init()
    headers = kernel_cache._folder_of_headers()  # which take seconds to precompile, and are those of all tests
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel_cache, "_folder_of_headers", lambda: headers)
        patch.setattr(wp.config, "kernel_cache_dir", str(folder))
        twice.module.unload()
        yield
        twice.module.unload()


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """Return a cache with the kernel."""
    folder = tmp_path_factory.mktemp("compiled")
    with kernels_in(folder):
        load_anew()
    return folder


@pytest.fixture
def cache(compiled, tmp_path):
    """Keep kernels in a folder of this test's, which has the kernel."""
    shutil.copytree(compiled, tmp_path, dirs_exist_ok=True)
    with kernels_in(tmp_path):
        yield tmp_path


def load_anew():
    """Load the kernel as another process would, and check what it computes."""
    twice.module.unload()
    kernel_cache.load_module(twice.module, "cpu", 1)
    values = wp.array(np.arange(4.0), dtype=float, device="cpu")
    wp.launch(twice, dim=4, inputs=[values], device="cpu")
    assert values.numpy().tolist() == [0, 2, 4, 6]


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 255
    path.write_bytes(content)


DAMAGES = {
    "cut": cut,
    "empty": lambda path: path.write_bytes(b""),
    "flipped bits": flip,
    "removed": Path.unlink,
    "a folder": lambda path: (path.unlink(), path.mkdir()),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("ending", [".o", ".meta", ".json"])
def test_what_is_damaged_is_named_and_compiled_again(damage, ending, cache):
    load_anew()
    folder = kernel_cache.folder_of(twice.module, 1)
    [path] = [path for path in folder.iterdir() if path.suffix == ending]
    DAMAGES[damage](path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load_anew()
    told = [str(each.message) for each in caught]
    if (ending, damage) == (".json", "removed"):
        assert not told  # as caches were before there were seals: what they hold is taken
    else:
        assert len(told) == 1
        assert told[0].startswith(f"the kernel cache is damaged in {folder} (")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_anew()  # it is whole again


@pytest.mark.parametrize("damage", ["cut", "empty", "a folder"])
def test_what_no_seal_guards_is_compiled_again_where_it_cannot_be_loaded(damage, cache):
    load_anew()
    folder = kernel_cache.folder_of(twice.module, 1)
    (folder / kernel_cache.SEAL).unlink()
    for path in folder.glob("*.o"):
        DAMAGES[damage](path)
    with pytest.warns(UserWarning, match="the kernel cache is damaged in .*: the kernel is compiled again"):
        load_anew()


def test_every_kernel_is_loaded_with_these_checks():
    """Warp would load a module by itself where it is launched, and fail on what is damaged each time."""
    launching = [path for path in PACKAGE.rglob("*.py") if "wp.launch(" in path.read_text()]
    assert len(launching) >= 4
    for path in launching:
        text = path.read_text()
        assert re.search(r"\b(loaded|load_kernel)\(", text), path
        assert not re.search(r"module\.load\(|force_load", text), path


def test_kernels_are_loaded_once_also_by_threads(cache, monkeypatch):
    times = []
    load_module = kernel_cache.load_module
    monkeypatch.setattr(kernel_cache, "load_module", lambda *given: (times.append(given), load_module(*given)))
    kernel_cache._loaded.discard((twice.module, "cpu"))
    with ThreadPoolExecutor(3) as pool:
        assert list(pool.map(kernel_cache.loaded, [twice] * 3)) == [twice] * 3
    assert len(times) == 1
    kernel_cache._loaded.discard((twice.module, "cpu"))


def test_a_cache_that_cannot_be_written_is_named(cache, monkeypatch):
    (cache / "file").write_text("no folder")
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(cache / "file" / "kernels"))
    with pytest.warns(UserWarning, match=r"the kernel cache .*kernels cannot be written .*export WARP_CACHE_PATH="):
        load_anew()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_anew()


@pytest.mark.parametrize("is_terminal", [True, False])
def test_what_takes_long_is_said_on_a_terminal(is_terminal, monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr.isatty", lambda: is_terminal)
    messages.say("compiling kernel of a test ...")
    assert ("compiling kernel of a test ..." in capsys.readouterr().err) == is_terminal


def test_headers_are_precompiled_once(cache, monkeypatch):
    """Another thread takes those that are in the cache, as another process does; damaged ones are made again."""
    folder, own = cache / "headers", dict(wp._src.context.runtime._pch_dirs)
    monkeypatch.setattr(kernel_cache, "_folder_of_headers", lambda: folder)

    def compile_anew():
        shutil.rmtree(cache / twice.module.get_module_identifier(1), ignore_errors=True)
        with ThreadPoolExecutor(1) as thread:
            thread.submit(load_anew).result()
        [headers] = folder.glob("*.pch")
        return headers, headers.stat().st_mtime_ns

    headers, made = compile_anew()
    assert compile_anew() == (headers, made)
    flip(headers)  # which would end the process where the compiler trusted it
    monkeypatch.setattr(kernel_cache, "_headers_checked", set())
    with (
        pytest.warns(UserWarning, match=r"damaged in .*headers"),
        kernel_cache._kept_headers("cpu", cache / "not compiled"),
    ):
        assert not headers.exists()
    assert wp._src.context.runtime._pch_dirs == own  # Warp's own folders stand where they stood


@pytest.mark.parametrize("has_driver", [False, True])
def test_only_the_notice_of_a_missing_driver_is_hidden(has_driver, monkeypatch, capfd):
    monkeypatch.setattr(kernel_cache, "_has_driver", lambda: has_driver)
    notice = "Warp CUDA warning: Could not find or load the NVIDIA CUDA driver. GPU execution will not be available.\n"
    error = "Warp CUDA error: Failed to get driver entry point\n"
    with kernel_cache._hidden_notice():
        os.write(2, (notice + error).encode())
    os.write(2, b"after\n")
    assert capfd.readouterr().err == (notice if has_driver else "") + error + "after\n"


def test_lines_are_written_even_if_warp_cannot_be_initialised(monkeypatch, capfd):
    monkeypatch.setattr(kernel_cache, "_has_driver", lambda: False)

    def fail():
        with kernel_cache._hidden_notice():
            os.write(2, b"Warp error\n")
            raise OSError("no folder")

    with pytest.raises(OSError, match="no folder"):
        fail()
    assert capfd.readouterr().err == "Warp error\n"


FIRST_CALLS = {
    "initialise": "from warpdyn.engine.kernels.kernel_cache import initialise; initialise()",
    "pushover": "import warpdyn as wd; wd.pushover(wd.ShearBuilding(1e5, 4e7, 3.0), [0.0, 0.01])",
    "hysteresis": "import warpdyn as wd; wd.storey_hysteresis(wd.ShearBuilding(1e5, 4e7, 3.0), [0.0, 0.01])",
}


@pytest.mark.parametrize("code", FIRST_CALLS.values(), ids=FIRST_CALLS)
def test_a_new_process_writes_nothing_about_a_missing_driver(code):
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert kernel_cache.NO_DRIVER.decode() not in result.stderr
