"""Warp's kernel cache: what is read from it is what was written, and what is damaged in it is compiled again.

It holds precompiled headers, too, which Warp itself would make anew in every process.
"""

import hashlib
import json
import os
import shutil
import tempfile
import threading
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace

import warp as wp

from warpdyn.engine.kernels.unfinished_builds import check_room, folder_of_this_process, noted
from warpdyn.foundations.core.messages import say, warn_caller
from warpdyn.foundations.core.thread_pool import in_background
from warpdyn.foundations.files.part_files import whole_file

SEAL = "warpdyn.json"  # digests of the files of a module, beside them
THREADS_OF_A_BLOCK = 128
COMPILATION_IS_TOLD = 1.0  # seconds after which a compilation is told of

COMPILED = {"cpu": (".o",), "cuda": (".ptx", ".cubin")}  # endings of binaries
SEALED = (*COMPILED["cpu"], *COMPILED["cuda"], ".meta", ".pch")

_headers_checked: set[Path] = set()  # folders of headers that this process has found undamaged
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


def is_compiled_in(folder: Path, device: str) -> bool:
    """Return whether a folder of the kernel cache holds a binary for a kind of device."""
    return any(path.suffix in COMPILED["cpu" if device == "cpu" else "cuda"] for path in folder.glob("*"))


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

    Raises:
        OSError: If it is to be compiled, and the disk of the cache has too little room.
    """
    folder = folder_of(module, block_size)
    if folder.is_dir() and _is_damaged(folder):
        _discard(folder, "files differ from what was compiled")
    if not is_compiled_in(folder, device):
        check_room(folder.parent)
    try:
        _load(module, device, block_size)
    except Exception as error:  # Warp raises Exception itself
        if not folder.is_dir():
            raise
        _discard(folder, f"{type(error).__name__}: {error}")
        check_room(folder.parent)
        module.mark_modified()
        _load(module, device, block_size)
    _seal(folder_of(module, block_size))


def _load(module: wp.Module, device: str, block_size: int) -> None:
    """Load a module; compile into a folder for this process alone if the cache cannot be written."""
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
    """Let the calling thread take precompiled headers from the kernel cache while it compiles, and leave them there.

    Warp precompiles its headers anew in each thread of each process that compiles for a processor, for nearly two
    seconds, as long as a large kernel takes. Each file is moved into its place when it is complete. The compiler
    refuses one whose headers have changed, and a version of Warp that keeps them otherwise goes on as it does.

    Args:
        device: Device that is compiled for; only a processor's headers are kept.
        folder: Folder of the module; nothing is to be compiled where it holds what was.
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
    except OSError:  # Warp's own attempt to write beside it tells of this
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
    """Return the folder of precompiled headers of this installation of Warp; they fit no other one."""
    header = Path(wp.__file__).parent / "native" / "builtin.h"
    about = header.stat()
    installation = hashlib.sha256(f"{header} {about.st_size} {about.st_mtime_ns}".encode()).hexdigest()[:16]
    return Path(wp.config.kernel_cache_dir) / f"precompiled_headers_{installation}"


def _move_elsewhere(error: OSError) -> None:
    """Have this process compile its kernels into a temporary folder, and say so."""
    cache = wp.config.kernel_cache_dir or os.environ.get("WARP_CACHE_PATH", "of this user")
    wp.config.kernel_cache_dir = str(folder_of_this_process())
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
        with whole_file(folder / SEAL) as part:
            part.write_text(text)
    except OSError:
        pass  # a cache that cannot be written is read as it is


def _digests(folder: Path) -> dict[str, str]:
    """Return the digests of binaries and their descriptions, by name."""
    files = (path for path in sorted(folder.iterdir()) if path.suffix in SEALED)
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files if path.is_file()}
