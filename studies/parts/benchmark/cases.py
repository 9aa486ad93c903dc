"""Cases of the study benchmark, and the ensemble that warpdyn and other programs (peers) integrate."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from peers.case import HEIGHT, YIELD_DRIFT, Case
from peers.storey_laws import LAWS as STOREY_LAWS
from scipy.signal import cont2discrete, lfilter

import warpdyn as wd
from warpdyn.foundations.core.units import STANDARD_GRAVITY

STOREYS = (1, 3, 5, 10, 20, 40, 60)
LAWS = ("elastic", "bilinear", "bouc_wen")
BOTH = ("float32", "float64")
STEP = 0.005  # step of the base motion and of its integration [s]; a case may divide it into substeps
LAW_METHODS = ("rk4", "velocity_verlet")  # methods for the comparison of all laws
KERNEL_METHODS = ("rk4", "stoermer")  # methods for which there is also hand-written code
NO_DEVICE = "none"  # device of a peer that needs a kind of device that is not measured
RECORDERS = {"drift": ("drift",), "all": None}

# Extent of the measurements. On one CPU thread, `dof_steps` determines the number of samples; on a GPU, `samples` does.
FULL: dict[str, Any] = {
    "storeys": STOREYS,
    "laws": LAWS,
    "every_law": tuple(STOREY_LAWS),
    "dtypes": BOTH,
    "steps": 2000,
    "dof_steps": 5e7,
    "samples": 2**18,
    "scaling_samples": tuple(2**k for k in range(8, 21)),
    "thread_samples": 2**16,
    "histories": {"cpu": (10_000,), "cuda": (10_000, 528_000)},
    "peer_seconds": 150,
}
QUICK = FULL | {
    "storeys": (3,),
    "laws": ("bouc_wen",),
    "every_law": ("bilinear",),
    "dtypes": ("float32",),
    "steps": 200,
    "dof_steps": 1e6,
    "samples": 2**12,
    "scaling_samples": (2**8, 2**10),
    "thread_samples": 2**10,
    "histories": {"cpu": (1_000,), "cuda": (1_000,)},
}

# Other programs that are measured. A peer runs the samples of warpdyn, or the number `samples` in its row.
PEERS: list[dict[str, Any]] = [
    {"peer": "cpp_vectors", "device": "cpu", "laws": LAWS, "dtypes": BOTH},
    {"peer": "cpp_stoermer", "device": "cpu", "laws": LAWS, "dtypes": BOTH, "method": "stoermer"},
    {"peer": "numba_threads", "device": "cpu", "storeys": (1, 5, 20)},
    {"peer": "jax_scan", "device": "cpu", "storeys": (5,), "samples": 1024},
    {"peer": "jax_scan_unrolled", "device": "cpu", "storeys": (5,), "samples": 1024},
    {"peer": "diffrax_tsit5", "device": "cpu", "storeys": (5,), "samples": 128},
    {"peer": "diffrax_steps", "device": "cpu", "storeys": (5,), "samples": 128},
    {"peer": "opensees_newmark", "device": "cpu", "storeys": (1, 5, 10, 20), "samples": 8, "substeps": 8},
    {"peer": "cuda_registers", "device": "cuda", "laws": LAWS, "dtypes": BOTH},
    {"peer": "cuda_registers", "device": "cuda", "laws": LAWS, "recorders": "all"},
    {"peer": "cuda_stoermer", "device": "cuda", "laws": LAWS, "storeys": (1, 3, 5, 10, 20), "method": "stoermer"},
    {"peer": "numba_gpu", "device": "cuda", "storeys": (1, 5, 10, 20)},
    {"peer": "jax_scan", "device": "cuda", "storeys": (5,)},
    {"peer": "jax_scan_unrolled", "device": "cuda", "storeys": (5,)},
    {"peer": "diffrax_tsit5", "device": "cuda", "storeys": (5,), "samples": 2**16},
    {"peer": "diffrax_steps", "device": "cuda", "storeys": (5,)},
    {"peer": "cubie_maxima", "device": "cuda", "storeys": (5, 10)},
    {"peer": "cubie_optimized", "device": "cuda", "storeys": (5,)},
]
LABELS = {
    "warpdyn": "warpdyn",
    "cpp_vectors": "C++ by hand",
    "cuda_registers": "CUDA by hand",
    "cpp_stoermer": "C++ by hand, Störmer",
    "cuda_stoermer": "CUDA by hand, Störmer",
    "numba_threads": "numba, by rows of samples",
    "numba_gpu": "numba-cuda by hand",
    "jax_scan": "JAX, vmap of a scan",
    "jax_scan_unrolled": "JAX, storeys unrolled",
    "diffrax_tsit5": "diffrax, diffeqsolve",
    "diffrax_steps": "diffrax, stepped in a scan",
    "opensees_newmark": "OpenSeesPy",
    "cubie_maxima": "CuBIE",
    "cubie_optimized": "CuBIE, optimised",
}


def kernel_cases(devices: list[str], size: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cases of warpdyn: every law, number of storeys, dtype and device.

    All cases use RK4. Peak drifts are also measured with Stoermer's method, and all recorders only in float32. A CPU
    uses one thread.
    """
    cases = []
    for device in devices:
        for dtype, recorders in product(size["dtypes"], RECORDERS):
            if recorders == "drift" or dtype == "float32":
                for law, storeys in product(size["laws"], size["storeys"]):
                    cases.append(_case(device, law, storeys, dtype, size) | {"recorders": recorders})
    cases += [case | {"method": "stoermer"} for case in cases if case["recorders"] == "drift"]
    # Cases with the shorter steps that a peer needs for the same accuracy.
    for row in (row for row in PEERS if "substeps" in row and row["device"] in devices):
        for case in _peer_cases(row, row["device"], size):
            cases.append(case | {"peer": "warpdyn", "run_samples": case["samples"]})
    return [{"part": "kernels", "peer": "warpdyn"} | case for case in cases]


def peer_cases(devices: list[str], size: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cases of all other programs (peers); if there are several GPUs, a peer uses the first."""
    kinds = {device.split(":")[0]: device for device in reversed(devices)}
    return [
        {"part": "kernels"} | case | {"method": row.get("method", "")}  # "": its own method, compared with RK4
        for row in PEERS
        for case in _peer_cases(row, kinds.get(row["device"], NO_DEVICE), size)
    ]


def law_cases(device: str, size: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cases of every law in five storeys: warpdyn, and on a CPU also OpenSeesPy at the same step.

    warpdyn runs RK4 and velocity_verlet. The latter has the same order as the method of OpenSees and evaluates a law
    once per step.
    """
    cases = []
    for law in size["every_law"]:
        case = _case(device, law, 5, "float32", size) | {"part": "laws", "recorders": "drift", "substeps": 8}
        samples = max(256, case["samples"] // 8)
        case |= {"samples": samples, "run_samples": samples}
        cases += [case | {"peer": "warpdyn", "method": method} for method in LAW_METHODS]
        if device == "cpu":
            cases.append(case | {"peer": "opensees_newmark", "run_samples": 4, "method": "newmark_linear"})
    return cases


def scaling_case(device: str, samples: int, size: dict[str, Any]) -> dict[str, Any]:
    """Return a case with the given number of samples, for the measurement of scaling."""
    case = _case(device, "bouc_wen", 5 if 5 in size["storeys"] else size["storeys"][0], "float32", size)
    return case | {"peer": "warpdyn", "recorders": "drift", "samples": samples, "run_samples": samples}


def _peer_cases(row: dict[str, Any], device: str, size: dict[str, Any]) -> list[dict[str, Any]]:
    wanted = row.get("storeys", size["storeys"])
    storeys = [n for n in size["storeys"] if n in wanted] or size["storeys"]
    laws = [law for law in row.get("laws", ("bouc_wen",)) if law in size["laws"]]
    dtypes = [dtype for dtype in row.get("dtypes", ("float32",)) if dtype in size["dtypes"]]
    cases = []
    for dtype, law, n in product(dtypes, laws, storeys):
        case = _case(device, law, n, dtype, size) | {"peer": row["peer"], "substeps": row.get("substeps", 1)}
        case |= {"recorders": row.get("recorders", "drift")}
        cases.append(case | {"run_samples": min(case["samples"], row.get("samples", case["samples"]))})
    return cases


def _case(device: str, law: str, storeys: int, dtype: str, size: dict[str, Any]) -> dict[str, Any]:
    if device == "cpu":
        wanted = size["dof_steps"] / (size["steps"] * storeys)
        samples = 2 ** max(8, round(np.log2(wanted)))
    else:
        samples = size["samples"]
    return {
        "device": device,
        "threads": int(device == "cpu"),
        "gpus": int(device != "cpu"),
        "law": law,
        "storeys": storeys,
        "dtype": dtype,
        "steps": size["steps"],
        "substeps": 1,
        "method": "rk4",
        "samples": samples,
        "run_samples": samples,
    }


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Different structures, each under one base motion at many levels; samples are sorted by structure, then by level.

    Args:
        motion: The base motion of all samples.
        levels: Peak ground acceleration of each level [g], shape [level].
        stiffness, damping_coefficient, mass: Parameters [N/m, N s/m, kg], each of shape [structure, storey].
    """

    motion: wd.GroundMotion
    levels: np.ndarray
    stiffness: np.ndarray
    damping_coefficient: np.ndarray
    mass: np.ndarray

    @property
    def structure(self) -> np.ndarray:
        """Index of the structure of each sample, shape [sample]."""
        return np.repeat(np.arange(len(self.mass)), self.levels.size)

    @property
    def scale(self) -> np.ndarray:
        """Factor by which the base motion of each sample is multiplied [1], shape [sample]."""
        factors = self.levels * STANDARD_GRAVITY / self.motion.peak_ground_acceleration
        return np.tile(factors, len(self.mass))


def draw_ensemble(storeys: int, samples: int, steps: int) -> Ensemble:
    """Return an ensemble of at least `samples` samples; the same arguments always give the same ensemble."""
    generator = np.random.default_rng([storeys, samples, steps])
    # At most 256 different structures are drawn, because drawing tall structures takes long; their levels differ, too.
    structures = min(256 if storeys <= 20 else 64, samples)

    def scattered(middle: float, spread: float) -> np.ndarray:
        return middle * np.exp(spread * generator.uniform(-1, 1, (structures, storeys)))

    # White noise is filtered by the ground of Kanai and Tajimi, with 15 rad/s and 60 % of critical damping.
    ground = ([2 * 0.6 * 15, 15.0**2], [1.0, 2 * 0.6 * 15, 15.0**2])
    numerator, denominator, _ = cont2discrete(ground, STEP)
    noise = lfilter(numerator.ravel(), denominator, generator.normal(size=steps + 1))
    levels = np.geomspace(0.05, 1.0, -(-samples // structures)) if samples > structures else np.array([0.3])
    return Ensemble(
        wd.GroundMotion(noise / np.abs(noise).max(), STEP, "filtered noise"),
        levels,
        scattered(2.0e7, 0.3),
        scattered(5.0e4, 0.3),
        scattered(2.0e4, 0.15),
    )


def build_scene(ensemble: Ensemble, law: str, recorders: str, chosen: np.ndarray | None = None) -> wd.Scene:
    """Return the scene for warpdyn of an ensemble, or of chosen samples of it, each as a separate structure."""
    structures = slice(None) if chosen is None else ensemble.structure[chosen]
    names = ("stiffness", "damping_coefficient", "mass")
    values = {name: getattr(ensemble, name)[structures] for name in names}
    own = {}
    if law != "elastic":
        values["yield_force"] = YIELD_DRIFT * values["stiffness"]
        own = {"yield_force": values["yield_force"][0], **STOREY_LAWS[law].parameters(YIELD_DRIFT)}
    first = {name: values[name][0] for name in names}
    building = wd.ShearBuilding(**first, height=HEIGHT, law=law, damping="storey", **own)
    if chosen is None:
        design = wd.Stripes([ensemble.motion], ensemble.levels, wd.PeakGroundAcceleration())
    else:
        design = wd.OneMotionPerStructure([ensemble.motion], np.zeros(chosen.size, int), ensemble.scale[chosen])
    scatter = {name: wd.GivenValues(array) for name, array in values.items()}
    return wd.Scene(building, design, scatter=scatter, recorders=RECORDERS[recorders], tail=0.0, title="benchmark")


def build_peer_case(ensemble: Ensemble, case: dict[str, Any], chosen: np.ndarray) -> Case:
    """Return chosen samples of an ensemble as a `Case`, the input of the other programs (peers)."""
    motion = ensemble.motion.acceleration
    place = np.arange((motion.size - 1) * case["substeps"] + 1) / case["substeps"]
    return Case(
        law=case["law"],
        dtype=case["dtype"],
        device=case["device"],
        step=STEP / case["substeps"],
        acceleration=np.interp(place, np.arange(motion.size), motion),
        stiffness=ensemble.stiffness,
        damping_coefficient=ensemble.damping_coefficient,
        mass=ensemble.mass,
        structure=ensemble.structure[chosen],
        scale=ensemble.scale[chosen],
        recorders=case["recorders"],
    )


def spread_out(samples: int, count: int) -> np.ndarray:
    """Return `count` indices of samples at equal distances, which include the first and the last sample."""
    return np.unique(np.linspace(0, samples - 1, min(count, samples)).round().astype(int))
