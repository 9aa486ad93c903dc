"""Peak drifts and computing times of a five-storey building under 44 records, with OpenSeesPy and with warpdyn.

    python docs/coming_from/scripts/with_openseespy.py

It needs warpdyn with the extra ".[test]", which brings OpenSeesPy. It writes results/openseespy*.csv and .json and
figures/openseespy.png, and takes half a minute.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator
from provenance import FIGURES, provenance, write_csv, write_json

import warpdyn as wd

sys.path.insert(0, str(Path(__file__).parents[3] / "studies"))
from peers.opensees_newmark import load_opensees
from peers.storey_laws import LAWS

ops = load_opensees()

# [building]
MASS, HEIGHT = 2.0e5, 3.2  # kg, m
STIFFNESS = np.array([3.0e8, 2.8e8, 2.4e8, 1.9e8, 1.3e8])  # N/m
YIELD_FORCE = np.array([2.4e6, 2.2e6, 1.8e6, 1.4e6, 0.8e6])  # N
HARDENING_RATIO, DAMPING_RATIO = 0.03, 0.05
STEP = 0.005  # s


# [opensees]
def by_opensees(motion: wd.GroundMotion, frequencies: np.ndarray, substeps: int, folder: str) -> np.ndarray:
    """Return the peak storey drifts [m] of the building under a record."""
    ops.wipe()
    ops.model("basic", "-ndm", 1, "-ndf", 1)
    ops.node(0, 0.0)
    ops.fix(0, 1)
    for i in range(5):
        ops.node(i + 1, 0.0, "-mass", MASS)
        ops.uniaxialMaterial("Steel01", i + 1, YIELD_FORCE[i], STIFFNESS[i], HARDENING_RATIO)
        ops.element("zeroLength", i + 1, i, i + 1, "-mat", i + 1, "-dir", 1, "-doRayleigh", 1)
    first, second = frequencies[:2]
    of_mass = 2 * DAMPING_RATIO * first * second / (first + second)
    of_initial_stiffness = 2 * DAMPING_RATIO / (first + second)
    ops.rayleigh(of_mass, 0.0, of_initial_stiffness, 0.0)
    ops.timeSeries("Path", 1, "-dt", motion.step, "-values", *motion.values)
    ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("ProfileSPD")
    ops.test("NormDispIncr", 1e-8, 20)
    ops.algorithm("Newton")
    ops.integrator("Newmark", 0.5, 0.25)
    ops.analysis("Transient")
    envelope = str(Path(folder) / "drifts.out")
    ops.recorder("EnvelopeElement", "-file", envelope, "-precision", 12, "-eleRange", 1, 5, "deformation")
    if ops.analyze(substeps * (len(motion.values) - 1), motion.step / substeps):
        raise RuntimeError(f"{motion.name}: no convergence")
    ops.wipe()  # writes the envelope: minimum, maximum and largest absolute value
    return np.loadtxt(envelope)[2]


# [warpdyn]
def building() -> wd.ShearBuilding:
    """Return the building."""
    return wd.ShearBuilding(
        mass=MASS,  # kg, the same on every floor
        stiffness=STIFFNESS,  # N/m, from the ground up
        height=HEIGHT,  # m
        law="bilinear",  # or law="Steel01"
        yield_force=YIELD_FORCE,  # N
        hardening_ratio=HARDENING_RATIO,
        damping="rayleigh",
        damping_ratio=DAMPING_RATIO,
    )


def by_warpdyn(motions: list[wd.GroundMotion], structures: int = 1) -> np.ndarray:
    """Return the peak storey drifts [m] under all records, shape [sample, storey]."""
    cloud = wd.Cloud(motions, wd.SpectralAcceleration(0.6))
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1))} if structures > 1 else {}
    scene = wd.Scene(building(), cloud, scatter, recorders=("drift",), tail=0.0)
    run = wd.simulate(scene, structures=structures, seed=1, longest_step=STEP)
    return run["peak_storey_drift"].values


# [end]
REPEATS = 5


def processor_seconds(call: Callable[[], np.ndarray]) -> tuple[float, np.ndarray]:
    """Return the processor time of a call (all threads), and its result."""
    started = time.process_time()
    result = call()
    return time.process_time() - started, result


def main() -> None:
    """Run both programs, and write the results."""
    motions = [wd.GroundMotion(1.5 * motion.values, motion.step, motion.name) for motion in wd.records.far_field()]
    frequencies = building().modal()["circular_frequency"].values
    substeps = [max(1, round(motion.step / STEP)) for motion in motions]
    steps = sum(n * (len(motion.values) - 1) for n, motion in zip(substeps, motions, strict=True))
    by_warpdyn(motions), by_warpdyn(motions, 100)  # compiles the kernels

    def all_by_opensees(finer: int = 1) -> np.ndarray:
        pairs = zip(motions, substeps, strict=True)
        with tempfile.TemporaryDirectory() as folder:
            return np.array([by_opensees(motion, frequencies, finer * n, folder) for motion, n in pairs])

    timed: dict[str, list[float]] = {"OpenSeesPy": [], "warpdyn": [], "warpdyn, 4,400 histories": []}
    for _ in range(REPEATS):  # alternating, so that other load of the machine affects both
        seconds, ours = processor_seconds(lambda: by_warpdyn(motions))
        timed["warpdyn"].append(seconds)
        timed["warpdyn, 4,400 histories"].append(processor_seconds(lambda: by_warpdyn(motions, 100))[0])
        seconds, theirs = processor_seconds(all_by_opensees)
        timed["OpenSeesPy"].append(seconds)
    converged = all_by_opensees(8)
    least = {name: min(values) for name, values in timed.items()}
    rows = [
        ["OpenSeesPy", 44, f"{least['OpenSeesPy']:.2f}", f"{1000 * least['OpenSeesPy'] / 44:.2f}", "1"],
        *(
            [name, count, f"{least[key]:.3f}", f"{1000 * least[key] / count:.3f}",
             f"{least['OpenSeesPy'] / 44 / (least[key] / count):.0f}"]
            for name, key, count in (("warpdyn", "warpdyn", 44), ("warpdyn", "warpdyn, 4,400 histories", 4400))
        ),
    ]  # fmt: skip
    write_csv(
        "openseespy_seconds",
        ["tool", "histories", "processor time [s]", "a history [ms]", "histories in the time of one of OpenSeesPy's"],
        rows,
    )
    apart = {
        "warpdyn, from OpenSees at 5 ms": _apart(ours, theirs),
        "warpdyn, from converged OpenSees": _apart(ours, converged),
        "OpenSees at 5 ms, from converged OpenSees": _apart(theirs, converged),
    }
    header = ["peak storey drifts", "median", "95 % quantile", "largest"]
    write_csv("openseespy_peaks", header, [[name, *(f"{100 * v:.3f} %" for v in p)] for name, p in apart.items()])
    write_csv(
        "openseespy_laws", ["law", "uniaxialMaterial", "forces apart by", "parameters: warpdyn's = OpenSees'"], _laws()
    )
    ductility = theirs / (YIELD_FORCE / STIFFNESS)
    write_json(
        "openseespy",
        {
            "measured_with": provenance("openseespy"),
            "integration_steps_of_all_records": steps,
            "largest_ductility": float(ductility.max()),
            "median_of_the_largest_ductility_of_a_record": float(np.median(ductility.max(axis=1))),
            "processor_seconds": timed,
        },
    )
    _draw(ours, theirs)


def _apart(values: np.ndarray, reference: np.ndarray) -> list[float]:
    """Return the median, 95 % quantile and maximum of the differences of histories, divided by their largest peak."""
    apart = np.abs(values - reference).max(axis=1) / reference.max(axis=1)
    return np.percentile(apart, (50, 95, 100)).tolist()


def _laws() -> list[list[str]]:
    """Return a row for each storey law: its name, OpenSees' name, and the largest difference of forces in cycles."""
    stiffness, yield_force, refined = 1.0e7, 1.0e5, 40
    yield_drift = yield_force / stiffness
    turns = yield_drift * np.array([0, *(s * d for d in (0.5, 1, 2, 3, 4, 6, 8, 10) for s in (1, -1)), 0])
    legs = [np.linspace(a, b, 50 * refined + 1)[1:] for a, b in pairwise(turns)]
    drift = np.concatenate(legs)
    rows = []
    for name, law in wd.laws.LAWS.items():
        if name not in LAWS:
            continue
        row, given = LAWS[name], LAWS[name].parameters(yield_drift)
        strength = {} if name == "elastic" else {"yield_force": yield_force}
        storey = wd.ShearBuilding(1.0, stiffness, 3.0, law=name, **strength, **given)
        ours = wd.storey_hysteresis(storey, drift)["storey_force"].values[:, 0]
        ops.wipe()
        ops.model("basic", "-ndm", 1, "-ndf", 1)
        ops.uniaxialMaterial(row.material, 1, *row.numbers(stiffness, yield_force, given))
        ops.testUniaxialMaterial(1)
        theirs = np.empty_like(ours)
        for i, value in enumerate(drift):
            ops.setStrain(float(value))
            theirs[i] = ops.getStress()
        names = ", ".join(f"`{key}` = {p.opensees}" for key, p in law.parameters.items() if p.opensees)
        apart = f"{np.abs(ours - theirs).max() / yield_force:.1g}"
        rows.append([f"`{name}`", row.material, apart, names])
    return rows


def _draw(ours: np.ndarray, theirs: np.ndarray) -> None:
    """Draw the peak drift ratios of one program against the other, and the profile of their medians."""
    figure = Figure(figsize=(8.5, 3.8), layout="constrained")
    scatter, profile = figure.subplots(1, 2, width_ratios=(1.2, 1))
    a, b = 100 * theirs / HEIGHT, 100 * ours / HEIGHT
    for storey in range(5):
        scatter.plot(a[:, storey], b[:, storey], ".", ms=5, label=f"storey {storey + 1}")
    ends = np.array([a.min(), a.max()])
    scatter.plot(ends, ends, "k", lw=0.6)
    scatter.set(xscale="log", yscale="log", xlabel="peak storey drift ratio, OpenSeesPy [%]")
    scatter.set_ylabel("peak storey drift ratio, warpdyn [%]")
    for axis in (scatter.xaxis, scatter.yaxis):
        axis.set_major_locator(FixedLocator([0.1, 0.2, 0.5, 1, 2, 5]))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter("{x:g}")
    scatter.legend(fontsize=8)
    for fraction, style in ((16, ":"), (50, "-"), (84, "--")):
        profile.plot(np.percentile(a, fraction, axis=0), range(1, 6), "C0" + style, lw=4, alpha=0.4)
        profile.plot(np.percentile(b, fraction, axis=0), range(1, 6), "k" + style, lw=1)
    profile.set(xlabel="peak storey drift ratio [%]", ylabel="storey", yticks=range(1, 6), xlim=(0, None))
    profile.set_title("16, 50 and 84 % of the records", fontsize=9)
    FIGURES.mkdir(exist_ok=True)
    figure.savefig(FIGURES / "openseespy.png", dpi=110)


if __name__ == "__main__":
    main()
