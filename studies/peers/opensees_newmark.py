"""OpenSeesPy in one process: zeroLength elements of a storey law's material and linear dampers, one model per sample.

Newmark's linear acceleration method with Newton iterations and a banded solver, the fastest of those tried; drifts
from OpenSees' own envelope recorder. Its BoucWen material integrates z by the backward Euler method, of first order:
with the step that suffices for RK4, 5 ms, its peak drifts are up to 4 % off, and within 1 % at an eighth of it, which
is why this peer is measured there. The time is the processor time of `analyze` in one thread, without building models.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import tempfile
import time
from pathlib import Path
from types import ModuleType

import numpy as np

from peers.case import YIELD_DRIFT, Case, Measured
from peers.storey_laws import LAWS

# The package finds its own libraries only where the system has some of them; loaded first, it always does.
BUNDLED = ("libquadmath.so.0", "libgfortran.so.4", "libblas.so.3", "liblapack.so.3")
TOLERANCE, ITERATIONS = 1e-8, 20  # of the displacement increments [m]


def measure(case: Case) -> Measured:
    """Return the time of all analyses, one after the other, and the peak drifts."""
    ops = load_opensees()
    seconds, peaks = 0.0, np.full((case.samples, case.storeys), np.nan)
    with tempfile.TemporaryDirectory() as folder:
        envelope = os.path.join(folder, "drifts")
        for sample, (structure, scale) in enumerate(zip(case.structure, case.scale, strict=True)):
            _build(ops, case, int(structure), float(scale), envelope)
            started = time.process_time()
            failed = ops.analyze(case.steps, case.step)
            seconds += time.process_time() - started
            ops.wipe()  # writes the envelope
            if failed:
                raise RuntimeError(
                    f"OpenSees' analyze() returned {failed} for sample {sample} at a step of {case.step:g} s: it did "
                    "not converge; choose a shorter step for the case"
                )
            largest = np.loadtxt(envelope, ndmin=2)[2]  # after the least and the largest: the largest absolute
            peaks[sample] = largest.reshape(case.storeys, -1)[:, 0]  # one for each of a storey's materials, all alike
    return Measured(seconds, peaks, "one run, one process")


def load_opensees() -> ModuleType:
    """Return the module `openseespy.opensees`, or raise an ImportError."""
    package = importlib.util.find_spec("openseespylinux")
    if package is not None and package.origin is not None:
        for name in BUNDLED:
            library = Path(package.origin).parent / "lib" / name
            if library.exists():
                ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    try:
        import openseespy.opensees as ops
    except RuntimeError as error:  # what it raises for any failure to import
        raise ImportError(str(error)) from error
    return ops


def _build(ops: ModuleType, case: Case, structure: int, scale: float, envelope: str) -> None:
    law = LAWS[case.law]
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(0, 0.0)
    ops.fix(0, 1)
    for i in range(case.storeys):
        spring, damper = 2 * i + 1, 2 * i + 2
        stiffness = float(case.stiffness[structure, i])
        ops.node(i + 1, 0.0, "-mass", float(case.mass[structure, i]))
        numbers = law.numbers(stiffness, stiffness * YIELD_DRIFT, law.parameters(YIELD_DRIFT))
        ops.uniaxialMaterial(law.material, spring, *numbers)
        ops.uniaxialMaterial("Elastic", damper, 0.0, float(case.damping_coefficient[structure, i]))
        ops.element("zeroLength", i + 1, i, i + 1, "-mat", spring, damper, "-dir", 1, 1)
    ops.timeSeries("Path", 1, "-dt", case.step, "-values", *case.acceleration.tolist(), "-factor", scale)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.recorder("EnvelopeElement", "-file", envelope, "-precision", 12, "-eleRange", 1, case.storeys, "deformation")
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("BandSPD")
    ops.test("NormDispIncr", TOLERANCE, ITERATIONS)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 1 / 6)
    ops.analysis("Transient")
