"""Analysis of one building under one pair of motions in OpenSeesPy with the settings of SimCenter's R2D.

The analysis follows the scripts that the application OpenSees-Simulation writes for models of MDOF-LU with the settings
of the examples E2 and E3 of R2D (NHERI-SimCenter/R2DExamples; E3 is a magnitude 7 earthquake on the Hayward fault):

- Nodes have six degrees of freedom; four of them are fixed.
- Each storey is a zeroLength element with the material Hysteretic in both directions.
- The integrator is Newmark's average acceleration. Newton's method iterates until unbalanced forces are below 0.01 N.
  The solver is Umfpack. If the iteration fails, shorter steps are used.
- Rayleigh damping is defined for the first and the last mode. The elements are defined without -doRayleigh, so its
  stiffness term has no effect, and the damping is proportional to the mass.

The step is the step of the record, or 2 pi / (20 w^2) if that is shorter. The script divides by the eigenvalue w^2,
although 1/20 of the first period, 2 pi / (20 w), may be intended. Therefore low buildings have several times as many
steps and smaller errors. `Way.divides_by_frequency` selects 1/20 of the period.

In this study all analyses run in one process. The workflow of R2D starts OpenSees for each building and pair of
motions, and writes and reads JSON and a script; the time of these is not included.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType

import numpy as np

import warpdyn as wd
from parts.simcenter.buildings import MultiStoreyModel

STEPS_A_PERIOD = 20  # number of steps per first period
FIRST_SERIES = 101  # tag of the first time series in OpenSees
SUBLEVELS, SUBSTEPS = 2, 10  # a step whose iteration fails is divided into 10 substeps, on at most 2 levels
THIRD_DRIFT = 1.0  # drift of the third corner of the material in MDOF-LU, if the second corner is before it [m]


@dataclass(frozen=True)
class Way:
    """Settings of an analysis of the model in OpenSees.

    Args:
        writes_files: If True, peaks are written to files, as R2D requests: accelerations and displacements of every
            floor, and drifts of every storey.
        freedoms: Number of degrees of freedom of a node: 6 as in R2D, or the 2 that are not fixed.
        system: Solver of linear equations in OpenSees.
        constraints: Constraint handler in OpenSees.
        divides_by_frequency: If True, the step is at most a twentieth of the first period; if False, it is that of R2D.
        longest_step: Upper bound of the step [s].
    """

    writes_files: bool = True
    freedoms: int = 6
    system: str = "Umfpack"
    constraints: str = "Transformation"
    divides_by_frequency: bool = False
    longest_step: float = np.inf


@dataclass(frozen=True, eq=False)
class Analysed:
    """Result of the analysis of one building under one pair of motions.

    Args:
        seconds: Processor time for building the model, the analysis and the writing of files [s].
        steps: Number of steps of the analysis.
        is_finished: True if OpenSees reached the end of the motions.
        peak_drift_ratio: Largest drift ratio of each storey [1], shape [component, storey]. None if no files were
            written, or if the analysis failed before the end.
    """

    seconds: float
    steps: int
    is_finished: bool
    peak_drift_ratio: np.ndarray | None


def analyse(ops: ModuleType, model: MultiStoreyModel, pair: Sequence[wd.GroundMotion], way: Way) -> Analysed:
    """Analyse one building under a pair of motions with equal steps in OpenSees; return its time and peak drifts."""
    storeys, interval = len(model.yield_force), pair[0].step
    values = max(len(motion.values) for motion in pair)
    with tempfile.TemporaryDirectory() as folder:
        started = time.process_time()
        _build(ops, model, way.freedoms)
        for direction, motion in enumerate(pair):
            series = FIRST_SERIES + direction
            ops.timeSeries("Path", series, "-dt", interval, "-values", *motion.values.tolist())
            ops.pattern("UniformExcitation", series, direction + 1, "-accel", series)
        if way.writes_files:
            _record(ops, storeys, folder)
        ops.numberer("RCM")
        ops.constraints(way.constraints)
        ops.system(way.system)
        ops.integrator("Newmark", 0.5, 0.25)
        ops.test("NormUnbalance", 1e-2, 10)
        ops.algorithm("Newton")
        ops.analysis("Transient")
        # Each frequency occurs twice, once per direction. The indices select the first and the last mode.
        eigenvalue = np.array(ops.eigen(2 * storeys - 1))[[0, -1]]
        first, last = np.sqrt(eigenvalue).tolist()
        common = 2 * model.damping_ratio / (first + last)
        ops.rayleigh(common * first * last, common, 0.0, 0.0)
        longest = 2 * np.pi / STEPS_A_PERIOD / (first if way.divides_by_frequency else first**2)
        step = min(interval, longest, way.longest_step)
        steps = int(values * interval / step)
        is_finished = _advance(ops, steps, step, SUBLEVELS)
        ops.wipe()  # writes the recorded values
        seconds = time.process_time() - started
        peaks = None
        if way.writes_files and is_finished:
            # The three rows contain the minimum, the maximum and the largest magnitude of both directions.
            found = [np.loadtxt(os.path.join(folder, f"drift.{i}"), ndmin=2)[2] for i in range(1, storeys + 1)]
            peaks = np.transpose(found) / model.height
    return Analysed(seconds, steps, is_finished, peaks)


def _build(ops: ModuleType, model: MultiStoreyModel, freedoms: int) -> None:
    ops.wipe()
    ops.model("basic", "-ndm", 3 if freedoms == 6 else 2, "-ndf", freedoms)
    masses = [model.mass, model.mass, 0.0, 0.0, 0.0, model.mass / 1e10][:freedoms]
    # All nodes are at the origin: only OpenSees' recorder of drifts needs heights, and zeroLength elements warn of
    # them.
    place = [0.0] * (3 if freedoms == 6 else 2)
    ops.node(1, *place)
    ops.fix(1, *[1] * freedoms)
    for i, (force, drift, ultimate, at) in enumerate(
        zip(
            *(values.tolist() for values in (model.yield_force, model.yield_drift)),
            *(values.tolist() for values in (model.ultimate_force, model.ultimate_drift)),
            strict=True,
        )
    ):
        ops.node(i + 2, *place, "-mass", *masses)
        if freedoms == 6:
            ops.fix(i + 2, 0, 0, 1, 1, 1, 1)
        side = [force, drift, ultimate, at, ultimate, THIRD_DRIFT if at < THIRD_DRIFT else 10 * at]
        reloading = [model.pinching, model.pinching, 0.0, 0.0, model.unloading_exponent]
        ops.uniaxialMaterial("Hysteretic", i + 1, *side, *(-value for value in side), *reloading)
        ops.element("zeroLength", i + 1, i + 1, i + 2, "-mat", i + 1, i + 1, "-dir", 1, 2)


def _advance(ops: ModuleType, steps: int, step: float, levels: int) -> bool:
    """Run a number of steps, and divide failed steps on at most `levels` levels; return whether all steps succeeded.

    R2D requests this by `analysis Transient -numSubLevels 2 -numSubSteps 10`, which OpenSeesPy ignores.
    """
    end = ops.getTime() + steps * step
    while (left := round((end - ops.getTime()) / step)) > 0:
        if ops.analyze(left, step) == 0:
            return True
        if levels == 0 or not _advance(ops, SUBSTEPS, step / SUBSTEPS, levels - 1):
            return False
    return True


def _record(ops: ModuleType, storeys: int, folder: str) -> None:
    """Define recorders that write the files that R2D requests.

    OpenSeesPy 3.7 does not find the nodes of R2D's recorder EnvelopeDrift, so drifts are recorded by the elements.
    """
    series = ["-timeSeries", FIRST_SERIES, FIRST_SERIES + 1]
    for floor in range(storeys + 1):
        at = ["-node", floor + 1, "-dof", 1, 2]
        ops.recorder("EnvelopeNode", "-file", os.path.join(folder, f"acceleration.{floor}"), *series, *at, "accel")
        if floor:
            ops.recorder("EnvelopeNode", "-file", os.path.join(folder, f"displacement.{floor}"), *at, "disp")
            drift = os.path.join(folder, f"drift.{floor}")
            ops.recorder("EnvelopeElement", "-file", drift, "-precision", 12, "-ele", floor, "deformation")
