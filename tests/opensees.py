"""OpenSees as an oracle: its materials taken along given deformations."""

from __future__ import annotations

import ctypes
import functools
import importlib.util
import itertools
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import numpy as np

# openseespy brings them, and does not find them by itself where the system has none of its own.
BUNDLED = ("libquadmath.so.0", "libgfortran.so.4", "libblas.so.3", "liblapack.so.3")


@functools.cache
def opensees() -> ModuleType:
    """Return the module, with the libraries that it needs."""
    package = importlib.util.find_spec("openseespylinux")
    if package is not None and package.origin is not None:
        for library in (Path(package.origin).parent / "lib" / name for name in BUNDLED):
            if library.exists():
                ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    import openseespy.opensees

    return openseespy.opensees


def material_forces(material: str, parameters: Sequence[float | str], deformation: np.ndarray) -> np.ndarray:
    """Return the forces of a uniaxial material taken along deformations, each committed.

    Args:
        material: OpenSees name of the uniaxial material.
        parameters: Its parameters in OpenSees' order, without the tag.
        deformation: Deformations to go through, from 0, shape [step].
    """
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.uniaxialMaterial(material, 1, *parameters)
    ops.testUniaxialMaterial(1)
    forces = np.full(len(deformation), np.nan)
    for step, value in enumerate(deformation):
        ops.setStrain(float(value))
        forces[step] = ops.getStress()
    ops.wipe()
    return forces


def growing(amplitudes: Sequence[float], steps: int) -> np.ndarray:
    """Return a path through cycles of growing amplitudes, so many steps from peak to peak; it begins at 0."""
    turns = [0.0, *(sign * amplitude for amplitude in amplitudes for sign in (1, -1)), 0.0]
    return _through(turns, steps)


def wandering(largest: float, turns: int, steps: int, seed: int) -> np.ndarray:
    """Return a path through random turning points within plus and minus the largest; it begins at 0."""
    random = np.random.default_rng(seed)
    return _through([0.0, *random.uniform(-largest, largest, turns)], steps)


def ratcheting(largest: float, cycles: int, swing: float, steps: int) -> np.ndarray:
    """Return a path of cycles of one swing whose middle goes from 0 to the largest."""
    middle = np.linspace(0, largest, cycles)
    return _through([0.0, *(m + sign * swing for m in middle for sign in (1, -1))], steps)


def finer(path: np.ndarray, times: int) -> np.ndarray:
    """Return a path in so many times the steps; every `times`-th of them is one of its own."""
    return _through([0.0, *path], times)


def _through(turns: Sequence[float], steps: int) -> np.ndarray:
    parts = [np.linspace(a, b, steps + 1)[1:] for a, b in itertools.pairwise(turns)]
    return np.concatenate(parts)
