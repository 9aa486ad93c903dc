"""Compilation of the hand-written C++ and CUDA sources into shared libraries, when they are first needed."""

from __future__ import annotations

import atexit
import ctypes
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from peers.case import HARDENING_RATIO, YIELD_DRIFT, Case, Missing

REAL = {"float32": "float", "float64": "double"}


_FOLDER = Path(tempfile.mkdtemp(prefix="shear_chain"))  # created here, before several threads compile
atexit.register(shutil.rmtree, _FOLDER, ignore_errors=True)


@functools.cache
def load(compiler: str, flags: tuple[str, ...], source: str, **macros: str | int) -> ctypes.CDLL:
    """Compile a source file in this folder, and return the shared library.

    Raises:
        Missing: If the compiler is not installed.
        RuntimeError: If the compilation fails; the message ends with the output of the compiler.
    """
    path = shutil.which(compiler)
    if path is None:
        raise Missing(f"{compiler} is not on the PATH; install it, or add its folder to PATH")
    target = _FOLDER / ("-".join(map(str, (source, *macros.values()))) + ".so")
    defined = [f"-D{name}={value}" for name, value in macros.items()]
    object_file = target.with_suffix(".o")
    compile_source = [path, *flags, "-c", *defined, "-o", str(object_file), str(Path(__file__).with_name(source))]
    # Linked without the flags: a library that is linked with -ffast-math changes the processor's state for the thread
    # that loads it. From then on its numbers below the least normal one are 0, in NumPy and in all other code, too.
    for command in (compile_source, [path, "-shared", "-o", str(target), str(object_file)]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(
                f"{compiler} cannot compile {source}; correct the source or its flags: {done.stderr.strip()[-500:]}"
            )
    return ctypes.CDLL(str(target))


def macros_of(case: Case) -> dict[str, str | int | float]:
    """Return the macros with which all sources are compiled for a case, by name."""
    return {
        "STOREYS": case.storeys,
        "REAL": REAL[case.dtype],
        "BOUC_WEN": int(case.law == "bouc_wen"),
        "BILINEAR": int(case.law == "bilinear"),
        "EVERY_RECORDER": int(case.recorders == "all"),
        "HARDENING_RATIO": HARDENING_RATIO,
        "YIELD_DRIFT": YIELD_DRIFT,
    }


def multistep_arrays(case: Case) -> list[np.ndarray]:
    """Return the arrays that the sources of Stoermer's method read, in the dtype of the case.

    Order: stiffness, damping coefficient, inverse mass, yield drift and hardening ratio, shape [storey, sample]; scale
    and mass-proportional damping (0), shape [sample]; base acceleration, shape [step + 1].
    """
    *tables, scale, acceleration = case.arrays()
    tables = [table.T for table in tables]
    constants = [np.full_like(tables[0], value) for value in (YIELD_DRIFT, HARDENING_RATIO)]
    arrays = (*tables, *constants, scale, np.zeros_like(scale), acceleration)
    return [np.ascontiguousarray(array) for array in arrays]
