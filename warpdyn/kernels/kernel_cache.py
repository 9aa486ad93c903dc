"""Warp's kernel cache: what is read from it is what was written, and what is damaged in it is compiled again."""

import atexit
import hashlib
import json
import os
import shutil
import tempfile
import threading
from collections import defaultdict
from pathlib import Path

import warp as wp

from warpdyn.core.messages import say, warn_caller
from warpdyn.core.thread_pool import in_background

SEAL = "warpdyn.json"  # digests of the files of a module, beside them
THREADS_OF_A_BLOCK = 128
COMPILATION_IS_TOLD = 1.0  # seconds after which a compilation is told of

_loaded: set[tuple[wp.Module, str]] = set()
_loading: defaultdict[wp.Module, threading.Lock] = defaultdict(threading.Lock)


def block_size(device: str) -> int:
    """Return how many threads a block has on a device."""
    return 1 if device == "cpu" else THREADS_OF_A_BLOCK


def initialise() -> None:
    """Initialise Warp, with a folder for this process alone if the cache's cannot be made."""
    try:
        wp.init()
    except OSError as error:
        _move_elsewhere(error)
        wp.init()


def folder_of(module: wp.Module, block_size: int) -> Path:
    """Return the folder of a module in the kernel cache."""
    initialise()  # which sets the cache's folder
    return Path(wp.config.kernel_cache_dir) / module.get_module_identifier(block_size)


def loaded(kernel: wp.Kernel, device: str = "cpu", description: str = "") -> wp.Kernel:
    """Return a kernel that is compiled and loaded for a device; say so where compiling takes long, and let Ctrl-C act.

    Threads may load kernels side by side, also one that is still compiled for a call that was interrupted.

    Args:
        kernel: The kernel.
        device: The device, such as "cpu" or "cuda:0".
        description: What the kernel is called where it is told of; its own name by default.
    """
    key = kernel.module, device
    if key not in _loaded:

        def load() -> None:
            with _loading[kernel.module]:
                if key not in _loaded:
                    load_module(kernel.module, device, block_size(device))
                    _loaded.add(key)

        told = f"compiling kernel {description or f'{kernel.key} for {device}'} ..."
        in_background(load, COMPILATION_IS_TOLD, lambda: say(told))
    return kernel


def load_module(module: wp.Module, device: str, block_size: int) -> None:
    """Load a module, compiled for a device; if its files in the cache are damaged, compile it again and say so.

    Warp would load what a full disk or a broken transfer left of a file, or refuse it each time.

    Args:
        module: The module.
        device: The device.
        block_size: Threads of a block.
    """
    folder = folder_of(module, block_size)
    if folder.is_dir() and _is_damaged(folder):
        _discard(folder, "files differ from what was compiled")
    try:
        _load(module, device, block_size)
    except Exception as error:  # Warp raises Exception itself
        if not folder.is_dir():
            raise
        _discard(folder, f"{type(error).__name__}: {error}")
        module.mark_modified()
        _load(module, device, block_size)
    _seal(folder_of(module, block_size))


def _load(module: wp.Module, device: str, block_size: int) -> None:
    """Load a module; compile into a folder for this process alone if the cache cannot be written."""
    try:
        module.load(wp.get_device(device), block_dim=block_size)
    except OSError as error:
        if _takes_files(Path(wp.config.kernel_cache_dir)):
            raise
        _move_elsewhere(error)
        module.mark_modified()
        module.load(wp.get_device(device), block_dim=block_size)


def _move_elsewhere(error: OSError) -> None:
    """Have this process compile its kernels into a temporary folder, and say so."""
    cache = wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH", "of this user")
    wp.config.kernel_cache_dir = tempfile.mkdtemp(prefix="warpdyn_kernels_")
    atexit.register(shutil.rmtree, wp.config.kernel_cache_dir, ignore_errors=True)
    warn_caller(
        f"the kernel cache {cache} cannot be written ({error}): kernels are compiled anew in this process, into "
        f"{wp.config.kernel_cache_dir}; set WARP_CACHE_PATH to a folder that can be written"
    )


def _takes_files(folder: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"x")
    except OSError:
        return False
    return True


def _discard(folder: Path, reason: str) -> None:
    warn_caller(f"the kernel cache is damaged in {folder} ({reason}): the kernel is compiled again")
    if folder.is_dir():
        shutil.rmtree(folder, ignore_errors=True)


def _is_damaged(folder: Path) -> bool:
    """Return whether a file differs from what was sealed; files that another process adds are not sealed yet."""
    try:
        sealed = json.loads((folder / SEAL).read_text())
    except FileNotFoundError:
        return False
    except (OSError, ValueError):
        return True
    found = _digests(folder)
    return not isinstance(sealed, dict) or any(found.get(name) != digest for name, digest in sealed.items())


def _seal(folder: Path) -> None:
    """Write the digests of a module's files beside them; devices that are compiled for later add files."""
    try:
        text = json.dumps(_digests(folder))
        if (folder / SEAL).is_file() and (folder / SEAL).read_text() == text:
            return
        part = folder / f"{SEAL}.{os.getpid()}"
        part.write_text(text)
        os.replace(part, folder / SEAL)
    except OSError:
        pass  # a cache that cannot be written is read as it is


def _digests(folder: Path) -> dict[str, str]:
    """Return the digests of a module's binaries and their descriptions, by name."""
    files = (path for path in sorted(folder.iterdir()) if path.suffix in (".o", ".ptx", ".cubin", ".meta"))
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files if path.is_file()}
