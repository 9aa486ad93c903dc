"""OpenSeesPy in one process: zeroLength elements with the material of a storey law and linear dampers.

There is one model per sample. The analysis uses Newmark's linear acceleration method with Newton iterations and a
banded solver, which was the fastest of the solvers tried. Drifts come from OpenSees' envelope recorder. The BoucWen
material of OpenSees integrates z by the backward Euler method, which has order 1. With a step of 5 ms, which suffices
for RK4, its peak drifts differ by up to 4 %; with an eighth of this step they are within 1 %. Therefore OpenSees is
measured with an eighth of the step. The time is the processor time of `analyze` in one thread, without the time for
building models.
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

# On some systems, the package does not find the libraries that it contains, so they are loaded before it.
BUNDLED = ("libquadmath.so.0", "libgfortran.so.4", "libblas.so.3", "liblapack.so.3")
TOLERANCE, ITERATIONS = 1e-8, 20  # tolerance of the displacement increments [m], and largest number of iterations


def measure(case: Case) -> Measured:
    """Analyse all samples of a case one after the other; return the total time and the peak drifts."""
    ops = load_opensees()
    seconds, peaks = 0.0, np.full((case.samples, case.storeys), np.nan)
    with tempfile.TemporaryDirectory() as folder:
        envelope = os.path.join(folder, "drifts")
        for sample, (structure, scale) in enumerate(zip(case.structure, case.scale, strict=True)):
            _build(ops, case, int(structure), float(scale), envelope)
            started = time.process_time()
            failed = ops.analyze(case.steps, case.step)
            seconds += time.process_time() - started
            ops.wipe()  # writes the file of the envelope recorder
            if failed:
                raise RuntimeError(
                    f"OpenSees' analyze() returned {failed} for sample {sample} at a step of {case.step:g} s: it did "
                    "not converge; choose a shorter step for the case"
                )
            largest = np.loadtxt(envelope, ndmin=2)[2]  # rows: minimum, maximum, largest magnitude
            peaks[sample] = largest.reshape(case.storeys, -1)[:, 0]  # both materials of a storey have the same drift
    return Measured(seconds, peaks, "one run, one process")


def load_opensees() -> ModuleType:
    """Import and return the module `openseespy.opensees`; raise an ImportError if it cannot be imported."""
    package = importlib.util.find_spec("openseespylinux")
    if package is not None and package.origin is not None:
        for name in BUNDLED:
            library = Path(package.origin).parent / "lib" / name
            if library.exists():
                ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    try:
        import openseespy.opensees as ops
    except RuntimeError as error:  # the package raises it if the import fails for any reason
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
