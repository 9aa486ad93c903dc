"""Hand-written C++ and CUDA for torsional buildings of ten storeys: the same ensemble for them and for warpdyn.

The programs integrate the same buildings as warpdyn's kernels of a `LumpedStructure` with the recorder of springs, but
record only deformations (warpdyn also records forces) and support nothing else: one law, one number of storeys and
walls, equal lengths of all runs, steps equal to those of the motion. The times are those of the integration alone, with
all data in the memory of the device.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

import warpdyn as wd
from peers.case import TIMED_FOR, Measured, least_seconds
from peers.compiled import REAL, load
from peers.cpp_vectors import FLAGS as CPP_FLAGS
from peers.cuda_registers import FLAGS as CUDA_FLAGS

STOREYS, OWN_WALLS = 10, 4
MASS, GYRATION = 4e5, 325.0 / 3.0  # kg, and the squared radius of gyration in m2
PLACES = np.array([-9.0, 9.0, -13.0, 13.0])  # m: y of the walls along x, x of the walls along y
HARDENING_RATIO, MASS_DAMPING, STIFFNESS_DAMPING = 0.03, 0.5236, 0.002653  # 1, 1/s and s
STEP, STEPS = 0.005, 2000
FREQUENCIES = (0.5, 0.8, 1.2, 1.7, 2.3, 3.1, 4.3, 6.1)  # Hz
KERNELS = {"verlet by thread": 0, "verlet by storey": 1, "rk4 by storey": 2}


def motion(phase: float, factor: float) -> np.ndarray:
    """Return a base acceleration [m/s2] of eight sines, which rises in 1 s and decays after 6 s, shape [step + 1]."""
    time = STEP * np.arange(STEPS + 1)
    sines = [np.sin(2 * np.pi * f * time + k * (k + phase)) for k, f in enumerate(FREQUENCIES, 1)]
    return factor * 0.6 * np.minimum(1, time) * np.exp(-0.15 * np.maximum(0, time - 6)) * np.sum(sines, axis=0)


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Random buildings: stiffness [N/m] and strength [N] of the walls, shape [sample, wall]; scale, shape [sample]."""

    stiffness: np.ndarray
    strength: np.ndarray
    scale: np.ndarray

    @classmethod
    def drawn(cls, samples: int, seed: int = 0) -> Ensemble:
        """Return random buildings, whose walls and motions differ."""
        random, storey = np.random.default_rng(seed), np.arange(STOREYS)
        shape = (samples, STOREYS, OWN_WALLS)
        stiffness = 3.5e8 * (1 - 0.06 * storey)[:, None] * np.exp(0.25 * random.uniform(-1, 1, shape))
        strength = 2.5e6 * (1 - storey * (storey + 1) / 110)[:, None] * np.exp(0.2 * random.uniform(-1, 1, shape))
        scale = np.exp(0.6 * random.uniform(-1, 1, samples))
        return cls(stiffness.reshape(samples, -1), strength.reshape(samples, -1), scale)

    def arrays(self, dtype: str) -> list[np.ndarray]:
        """Return the arrays that the programs read; the last index is the sample."""
        count = self.scale.size
        arms = np.where(np.arange(OWN_WALLS) < 2, -1.0, 1.0) * PLACES
        ground = np.stack([motion(0.0, 1.0), motion(1.3, 0.8)], axis=1)
        tables = (
            self.stiffness.T,
            (self.strength / self.stiffness).T,
            np.full((STOREYS, count), 1 / MASS),
            np.repeat(arms[:, None], count, axis=1),
            self.scale,
            ground,
        )
        return [np.ascontiguousarray(each, dtype=dtype) for each in tables]

    def scene(self, damping: str = "rayleigh") -> wd.Scene:
        """Return the scene with the same buildings, under the motion without its scale.

        The strength is divided by the scale, so that all deformations are those of the program divided by the scale.

        Args:
            damping: "rayleigh", with factors of each building, or "none", with the dashpots of the programs only.
        """
        motions = wd.PairOfMotions(
            wd.GroundMotion(motion(0.0, 1.0), STEP, "x"), wd.GroundMotion(motion(1.3, 0.8), STEP, "y")
        )
        scatter = {
            "stiffness": wd.GivenValues(self.stiffness),
            "yield_force": wd.GivenValues(self.strength / self.scale[:, None]),
        }
        if damping == "none":
            scatter["damping_coefficient"] = wd.GivenValues(STIFFNESS_DAMPING * self.stiffness)
        return wd.Scene(structure(STOREYS, damping), motions, scatter, recorders=("spring",))


def structure(storeys: int, damping: str = "rayleigh") -> wd.LumpedStructure:
    """Return the building with a number of storeys, median walls and damping "rayleigh" or, with dashpots, "none"."""
    masses, springs, influence = {}, [], [{}, {}]
    for i in range(storeys):
        masses |= {f"x{i}": MASS, f"y{i}": MASS, f"r{i}": MASS * GYRATION}
        influence[0][f"x{i}"] = influence[1][f"y{i}"] = 1.0
        for w, place in enumerate(PLACES):
            axis, arm = ("x", -place) if w < 2 else ("y", place)
            direction = {f"{axis}{i}": 1.0, f"r{i}": arm}
            direction |= {f"{axis}{i - 1}": -1.0, f"r{i - 1}": -arm} if i else {}
            share = (i + 1) / (storeys + 1) * i / storeys
            strength = {"yield_force": 2.5e6 * (1 - share), "hardening_ratio": HARDENING_RATIO}
            stiffness = 3.5e8 * (1 - 0.6 * i / storeys)
            dashpot = {} if damping == "rayleigh" else {"damping_coefficient": STIFFNESS_DAMPING * stiffness}
            springs.append(wd.Spring(f"{w}-{i}", direction, law="bilinear", stiffness=stiffness, **strength, **dashpot))
    # The first three modes are similar: x, y and rotation. The programs have 5 % in the first and in the next of them.
    ratio = {"damping_ratio": 0.05, "damping_modes": (1, 7)} if damping == "rayleigh" else {}
    return wd.LumpedStructure(masses, springs, influence=influence, damping=damping, **ratio)


def _constants(mass_damping: float) -> ctypes.Array:
    return (ctypes.c_double * 4)(mass_damping, STIFFNESS_DAMPING, HARDENING_RATIO, 1 / GYRATION)


def by_cpp(
    ensemble: Ensemble,
    method: str,
    dtype: str = "float32",
    *,
    lanes: int = 16,
    mass_damping: float = MASS_DAMPING,
) -> Measured:
    """Integrate by C++ on one thread; peak deformations [m], shape [sample, wall].

    Args:
        ensemble: The buildings; their number is a multiple of `lanes`.
        method: "verlet" or "rk4".
        dtype: "float32" or "float64".
        lanes: Samples per vector.
        mass_damping: Factor of the mass in Rayleigh's damping [1/s].
    """
    function = load("g++", CPP_FLAGS, "torsional_building.cpp", REAL=REAL[dtype], LANES=lanes).torsional_building
    function.restype = ctypes.c_double
    arrays, samples = ensemble.arrays(dtype), ensemble.scale.size
    peaks = np.full((STOREYS * OWN_WALLS, samples), np.nan, dtype)
    pointers = [ctypes.c_void_p(each.ctypes.data) for each in (*arrays, peaks)]

    def run() -> float:
        settings = (_constants(mass_damping), STEPS, ctypes.c_double(STEP), samples, int(method == "rk4"))
        return float(function(*pointers[:-1], *settings, pointers[-1]))

    return Measured(least_seconds(run), peaks.T)


def by_cuda(ensemble: Ensemble, kernel: str, mass_damping: float = MASS_DAMPING) -> Measured:
    """Integrate on a GPU by a kernel of KERNELS; peak deformations [m], shape [sample, wall]."""
    library, arrays = load("nvcc", CUDA_FLAGS, "torsional_building.cu"), ensemble.arrays("float32")
    samples = ensemble.scale.size
    peaks = np.full((STOREYS * OWN_WALLS, samples), np.nan, np.float32)
    seconds, registers, local = ctypes.c_double(), ctypes.c_int(), ctypes.c_int()
    error = library.torsional_building(
        *(ctypes.c_void_p(each.ctypes.data) for each in arrays),
        _constants(mass_damping),
        STEPS,
        ctypes.c_double(STEP),
        samples,
        KERNELS[kernel],
        ctypes.c_double(TIMED_FOR),
        ctypes.c_void_p(peaks.ctypes.data),
        ctypes.byref(seconds),
        ctypes.byref(registers),
        ctypes.byref(local),
    )
    if error:
        library.error_text.restype = ctypes.c_char_p
        raise RuntimeError(f"CUDA: {library.error_text(error).decode()}")
    return Measured(seconds.value, peaks.T, f"{registers.value} registers, {local.value} bytes of local memory")
