"""OpenSees as a reference: its materials along given deformations, and chains under a base motion."""

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
    """Return the forces of a uniaxial material along deformations, each of which is committed.

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


def chain_drifts(
    mass: Sequence[float],
    materials: Sequence[tuple[str, Sequence[float | str]]],
    damping: tuple[float, Sequence[float]],
    weight_over_height: Sequence[float],
    acceleration: np.ndarray,
    step: float,
    intervals: int,
    substeps: int,
    devices: Sequence[Sequence[tuple[str, Sequence[float]]]] = (),
    of_tangent: float = 0.0,
) -> np.ndarray:
    """Return the storey drifts [m] of a chain under a base acceleration, shape [interval x substeps + 1, storey].

    Average acceleration with Newton's iteration; rows are NaN from where it no longer converges.

    Args:
        mass: Floor masses [kg].
        materials: Uniaxial material and its parameters, of each storey.
        damping: Factor of the mass [1/s], and dashpots of the storeys [N s/m].
        weight_over_height: Gravity load that a storey carries over its height [N/m]: P-Delta; 0 for none.
        acceleration: Base acceleration [m/s2], linear between its samples, 0 after them.
        step: Between its samples [s].
        intervals: Samples to run for.
        substeps: Integration steps in each.
        devices: Uniaxial materials and their parameters that stand beside each storey.
        of_tangent: Factor of the tangent stiffness of all that stands in a storey [s].
    """
    ops = opensees()
    storeys = len(mass)
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(0, 0.0)
    ops.fix(0, 1)
    for i, (material, parameters) in enumerate(materials):
        tags = [3 * i + 1, 3 * i + 2, 3 * i + 3]
        ops.node(i + 1, 0.0, "-mass", float(mass[i]))
        ops.uniaxialMaterial(material, tags[0], *parameters)
        ops.uniaxialMaterial("Elastic", tags[1], 0.0, float(damping[1][i]))
        ops.uniaxialMaterial("Elastic", tags[2], -float(weight_over_height[i]))
        for place, (name, values) in enumerate(devices[i] if devices else ()):
            tags.append(3 * storeys + 100 * (i + 1) + place)
            ops.uniaxialMaterial(name, tags[-1], *values)
        # Only where it is asked for: with it, OpenSees finds no balance beside a damper of a power of the velocity.
        rayleigh = ("-doRayleigh", 1) if of_tangent else ()
        ops.element("zeroLength", i + 1, i, i + 1, "-mat", *tags, "-dir", *[1] * len(tags), *rayleigh)
    values = np.concatenate([acceleration, np.zeros(2)])
    ops.timeSeries("Path", 1, "-dt", step, "-values", *values.tolist())
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.rayleigh(float(damping[0]), float(of_tangent), 0.0, 0.0)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandGeneral")  # P-Delta may leave a matrix that is not positive definite
    ops.test("NormDispIncr", 1e-10, 50)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    drifts = np.full((intervals * substeps + 1, storeys), np.nan)
    drifts[0] = 0.0
    for row in range(1, len(drifts)):
        if ops.analyze(1, step / substeps):
            break
        drifts[row] = np.diff([0.0, *(ops.nodeDisp(i + 1, 1) for i in range(storeys))])
        if not np.isfinite(drifts[row]).all():
            break
    ops.wipe()
    return drifts
