"""Compile kernels into Warp's kernel cache; detect damaged files in it by digests, and compile damaged kernels again.

The cache also contains precompiled headers, which Warp would otherwise compile in each process.
"""

import ctypes
import hashlib
import json
import os
import shutil
import tempfile
import threading
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import warp as wp

from warpdyn.engine.kernels.unfinished_builds import check_room, folder_of_this_process, noted
from warpdyn.foundations.core.messages import say, warn_caller
from warpdyn.foundations.core.thread_pool import in_background
from warpdyn.foundations.files.part_files import whole_file

SEAL = "warpdyn.json"  # file in the folder of a module with the digests of the other files
THREADS_OF_A_BLOCK = 128
SECONDS_UNTIL_MESSAGE = 1.0  # if a compilation takes longer, a message is printed

COMPILED = {"cpu": (".o",), "cuda": (".ptx", ".cubin")}  # file name extensions of compiled kernels
SEALED = (*COMPILED["cpu"], *COMPILED["cuda"], ".meta", ".pch")

CUDA_DRIVER = "nvcuda.dll" if os.name == "nt" else "libcuda.so.1"
NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"  # part of the line that Warp prints if there is no driver

# Streams of a GPU share its queues, by default eight: a short rerun would wait for the histories of other blocks. CUDA
# reads this number when Warp is initialised, which the first array does.
os.environ.setdefault("CUDA_DEVICE_MAX_CONNECTIONS", "32")
_initialising = threading.Lock()
_headers_checked: set[Path] = set()  # folders of headers that this process has verified
_loaded: set[tuple[wp.Module, str]] = set()
_loading: defaultdict[wp.Module, threading.Lock] = defaultdict(threading.Lock)


def block_size(device: str) -> int:
    """Return the number of threads per thread block on a device: 1 on a CPU, THREADS_OF_A_BLOCK on a GPU."""
    return 1 if device == "cpu" else THREADS_OF_A_BLOCK


@cache
def initialise() -> None:
    """Initialise Warp; if the folder of the kernel cache cannot be created, use a temporary folder of this process."""
    with _initialising:
        try:
            with _hidden_notice():
                wp.init()
        except OSError as error:
            _move_elsewhere(error)
            wp.init()


@contextmanager
def _hidden_notice() -> Iterator[None]:
    """Hide Warp's line about a missing CUDA driver, which is normal without a GPU; write its other lines afterwards.

    Warp writes the line to file descriptor 2 (standard error) in `wp.init`. If there is a driver, this function does
    not change the descriptor.
    """
    if _has_driver():
        yield
        return
    try:
        lines, stderr = tempfile.TemporaryFile(), os.dup(2)  # noqa: SIM115  (closed below)
    except OSError:  # no folder for temporary files, or the descriptor is closed
        yield
        return
    with lines:
        os.dup2(lines.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)
            lines.seek(0)
            os.write(2, b"".join(line for line in lines if NO_DRIVER not in line))


def _has_driver() -> bool:
    """Return whether the operating system finds a CUDA driver."""
    try:
        ctypes.CDLL(CUDA_DRIVER)
    except OSError:
        return False
    return True


def folder_of(module: wp.Module, block_size: int) -> Path:
    """Return the folder in the kernel cache that contains the compiled files of a Warp module."""
    initialise()  # sets the cache's folder
    return Path(wp.config.kernel_cache_dir) / module.get_module_identifier(block_size)


def is_compiled_in(folder: Path, device: str) -> bool:
    """Return whether a module's folder in the kernel cache contains compiled code for the CPU or the GPU `device`."""
    return any(path.suffix in COMPILED["cpu" if device == "cpu" else "cuda"] for path in folder.glob("*"))


def loaded(kernel: wp.Kernel, device: str = "cpu", description: str = "") -> wp.Kernel:
    """Compile a kernel for a device if the cache does not contain it, load it, and return it.

    A compilation of more than SECONDS_UNTIL_MESSAGE prints a message. Ctrl-C interrupts the call, but the compilation
    continues. Several threads may call this function at once.

    Args:
        kernel: The kernel.
        device: The device, such as "cpu" or "cuda:0".
        description: Name of the kernel in the message; by default its key.
    """
    key = kernel.module, device
    if key not in _loaded:

        def load() -> None:
            with _loading[kernel.module]:
                if key not in _loaded:
                    load_module(kernel.module, device, block_size(device))
                    _loaded.add(key)

        message = f"compiling kernel {description or f'{kernel.key} for {device}'} ..."
        in_background(load, SECONDS_UNTIL_MESSAGE, lambda: say(message))
    return kernel


def load_module(module: wp.Module, device: str, block_size: int) -> None:
    """Load a Warp module, compiled for a device; if its files in the cache are damaged, warn and compile it again.

    Warp does not detect a file that is incomplete, for example after a full disk: it loads the file, or fails each
    time.

    Args:
        module: The module.
        device: The device.
        block_size: Number of threads per thread block.

    Raises:
        OSError: If the module must be compiled, and the disk of the cache has too little free space.
    """
    folder = folder_of(module, block_size)
    if folder.is_dir() and _is_damaged(folder):
        _discard(folder, "files differ from what was compiled")
    if not is_compiled_in(folder, device):
        check_room(folder.parent)
    try:
        _load(module, device, block_size)
    except Exception as error:  # Warp raises the class Exception, not a subclass
        if not folder.is_dir():
            raise
        _discard(folder, f"{type(error).__name__}: {error}")
        check_room(folder.parent)
        module.mark_modified()
        _load(module, device, block_size)
    _seal(folder_of(module, block_size))


def _load(module: wp.Module, device: str, block_size: int) -> None:
    """Load a Warp module; if the cache folder is not writable, compile it into a temporary folder of this process."""
    folder = folder_of(module, block_size)
    try:
        with nullcontext() if is_compiled_in(folder, device) else noted(folder), _kept_headers(device, folder):
            module.load(wp.get_device(device), block_dim=block_size)
    except OSError as error:
        if _takes_files(Path(wp.config.kernel_cache_dir)):
            raise
        _move_elsewhere(error)
        check_room(Path(wp.config.kernel_cache_dir))
        module.mark_modified()
        module.load(wp.get_device(device), block_dim=block_size)


@contextmanager
def _kept_headers(device: str, folder: Path) -> Iterator[None]:
    """Keep precompiled headers in the kernel cache while the calling thread compiles, for later threads and processes.

    Without the kept headers, Warp precompiles its headers in each thread of each process that compiles for a CPU, which
    takes nearly 2 s, as long as a large kernel. A file gets its final name when it is complete. The compiler refuses a
    precompiled header if the original headers have changed. If the installed version of Warp does not support kept
    headers, it compiles as usual.

    Args:
        device: Device to compile for; nothing is done for a GPU.
        folder: Folder of the module; nothing is done if it contains the compiled kernel.
    """
    of_threads = getattr(getattr(wp._src.context, "runtime", None), "_pch_dirs", None)
    if device != "cpu" or is_compiled_in(folder, device) or not isinstance(of_threads, dict):
        yield
        return
    headers = _folder_of_headers()
    if headers not in _headers_checked and headers.is_dir() and _is_damaged(headers):
        _discard(headers, "files differ from what was compiled")
    try:
        headers.mkdir(parents=True, exist_ok=True)
    except OSError:  # the folder cannot be written: Warp will report this
        yield
        return
    thread, before = threading.get_ident(), {path.name for path in headers.iterdir()}
    own = of_threads.get(thread)
    of_threads[thread] = SimpleNamespace(name=str(headers))
    try:
        yield
    finally:
        of_threads.pop(thread)
        if own is not None:
            of_threads[thread] = own
    if {path.name for path in headers.iterdir()} - before:
        _seal(headers)
    _headers_checked.add(headers)


def _folder_of_headers() -> Path:
    """Return the folder of precompiled headers in the kernel cache; each installation of Warp has its own folder."""
    header = Path(wp.__file__).parent / "native" / "builtin.h"
    about = header.stat()
    installation = hashlib.sha256(f"{header} {about.st_size} {about.st_mtime_ns}".encode()).hexdigest()[:16]
    return Path(wp.config.kernel_cache_dir) / f"precompiled_headers_{installation}"


def _move_elsewhere(error: OSError) -> None:
    """Warn that the kernel cache is not writable, and compile kernels of this process into a temporary folder."""
    cache = wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH", "of this user")
    wp.config.kernel_cache_dir = str(folder_of_this_process())
    warn_caller(
        f"the kernel cache {cache} cannot be written ({error}): this process compiles all kernels again, into "
        f"{wp.config.kernel_cache_dir}. Choose another folder before Python starts: export WARP_CACHE_PATH=/a/folder"
    )


def _takes_files(folder: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"x")
    except OSError:
        return False
    return True


def _discard(folder: Path, reason: str) -> None:
    warn_caller(
        f"the kernel cache is damaged in {folder} ({reason}): the kernel is compiled again, and no action is needed. "
        "If this happens repeatedly, check the disk, or choose another folder: export WARP_CACHE_PATH=/a/folder"
    )
    if folder.is_dir():
        shutil.rmtree(folder, ignore_errors=True)


def _is_damaged(folder: Path) -> bool:
    """Return whether a file in a module's folder differs from the digest that `_seal` has written.

    Files without a digest are ignored, because another process may just have written them.
    """
    try:
        sealed = json.loads((folder / SEAL).read_text())
    except FileNotFoundError:
        return False
    except (OSError, ValueError):
        return True
    found = _digests(folder)
    return not isinstance(sealed, dict) or any(found.get(name) != digest for name, digest in sealed.items())


def _seal(folder: Path) -> None:
    """Write the digests of the files in a module's folder to the file SEAL; kernels for other devices may follow."""
    try:
        text = json.dumps(_digests(folder))
        if (folder / SEAL).is_file() and (folder / SEAL).read_text() == text:
            return
        with whole_file(folder / SEAL) as part:
            part.write_text(text)
    except OSError:
        pass  # a cache that cannot be written is used without digests


def _digests(folder: Path) -> dict[str, str]:
    """Return the SHA-256 digests {file name: digest} of the compiled files and of Warp's descriptions in a folder."""
    files = (path for path in sorted(folder.iterdir()) if path.suffix in SEALED)
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files if path.is_file()}
