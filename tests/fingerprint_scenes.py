"""Fingerprints of the engine: methods, dampings, loads, recorders, numbers of storeys, and settings of a run."""

from __future__ import annotations

import re

import numpy as np
import xarray as xr
from fingerprint_face import (
    STEP,
    chain,
    dense,
    elastic,
    factor,
    fingerprint,
    folder,
    histories,
    individual,
    listed,
    make_plan,
    make_scene,
    motion,
    outcome,
    run,
    spread,
    stripes,
    value,
    wave,
)

import warpdyn as wd
from warpdyn.engine.methods import METHODS

IN_FLOAT32 = ("rk4", "velocity_verlet", "dormand_prince54", "central_difference_lagged", "newmark_average", "exact")
NO_TANGENT = [name for name, row in METHODS.items() if row.kind == "explicit"]  # methods that tangent damping takes
CHAIN_RECORDERS = ("drift", "time_of_peak", "acceleration", "base_shear", "residual", "energy")
DENSE_RECORDERS = ("displacement", "acceleration", "energy")


# Methods, each on yielding storeys, elastic ones and a full system, in both precisions.

for name in METHODS:
    for dtype in ("float64", "float32") if name in IN_FLOAT32 else ("float64",):

        @fingerprint(f"method/{name}/{dtype}", name, dtype)
        def by_method(method: str, dtype: str) -> dict[str, xr.Dataset]:
            parts = {"dense": run(make_scene(dense(3), stripes(0.2, 0.5), tail=0.4), 2, method=method, dtype=dtype)}
            make = elastic if method == "exact" else chain
            scene = make_scene(make(2), stripes(0.2, 0.9), scatter=spread("mass", "stiffness"), tail=0.4)
            return parts | {"chain": run(scene, 5, seed=4, method=method, dtype=dtype)}


@fingerprint("method/adaptive tolerances")
def tolerances() -> dict[str, xr.Dataset]:
    scene = make_scene(chain(2), stripes(0.2, 0.9), scatter=spread("mass", "stiffness"), tail=0.4)
    settings = {"method": "dormand_prince54", "seed": 4}
    parts = {f"{tolerance:g}": run(scene, 5, tolerance=tolerance, **settings) for tolerance in (1e-4, 1e-8)}
    return parts | {"histories": run(scene, 2, histories=histories(1, 6), **settings)}


# Dampings.

OF_DAMPING = {
    "none": {"damping_ratio": None},
    "storey": {"damping_ratio": None, "damping_coefficient": [900.0, 0.0, 600.0]},
    "rayleigh": {"damping_modes": (1, 3)},
    "rayleigh_tangent": {},
    "mass_proportional": {},
    "stiffness_proportional": {},
    "modal": {},
}
for name, parameters in OF_DAMPING.items():
    for method in ("rk4", "newmark_average", "exact"):
        if method in NO_TANGENT or name != "rayleigh_tangent":

            @fingerprint(f"damping/{name}/{method}", name, parameters, method)
            def damped(damping: str, parameters: dict, method: str) -> xr.Dataset:
                building = (elastic if method == "exact" else chain)(3, damping=damping, **parameters)
                ratio = {} if damping in ("none", "storey") else {"damping_ratio": value(wd.Uniform(0.02, 0.08))}
                scene = make_scene(building, stripes(0.2, 0.8), scatter=spread("stiffness") | ratio, tail=0.6)
                return run(scene, 3, seed=6, method=method)


@fingerprint("damping/of some storeys")
def damped_storeys() -> xr.Dataset:
    return run(make_scene(chain(3, damped_storeys=(2, 3)), stripes(0.5)), method="rk4")


@fingerprint("damping/of a full system that couples no modes")
def uncoupled() -> dict[str, xr.Dataset]:
    system = dense(3)
    mass, stiffness = (system.parameters[name] for name in ("mass", "stiffness"))
    scene = make_scene(wd.LinearSystem(mass, 0.3 * mass + 2e-3 * stiffness, stiffness), stripes(0.2, 0.8), tail=0.6)
    return {method: run(scene, 3, method=method) for method in ("rk4", "newmark_average", "hht_alpha", "exact")}


# Loads, on yielding storeys and full systems, with explicit, implicit and exact methods.

NOISE = {"duration": 1.4, "interval": STEP, "envelope": wd.JenningsEnvelope(0.3, 0.5, 2.0)}
FORCE = 1000.0 * np.outer(wave(7, 1.5), [0.5, 1.0])
LOADS = {
    "ground motion": (motion(3, 6.0), 1),
    "cloud": (wd.Cloud([motion(3), motion(4, 7.0, 50)], wd.SpectralAcceleration(0.5)), 3),
    "individual": (individual([motion(3), motion(4)], motion=[0, 1, 1, 0], scale=[1.0, 0.5, 2.0, 3.0]), 4),
    "individual drawn": (individual([motion(3), motion(4)], scale=1.3, measure=wd.AriasIntensity()), 6),
    "stripes of spectral acceleration": (
        wd.Stripes([motion(3), motion(4)], [0.3, 1.0], wd.AverageSpectralAcceleration([0.3, 0.5, 0.8])),
        2,
    ),
    "harmonic force": (wd.HarmonicForce([600.0, 400.0], 11.0, 1.5, 0.3), 3),
    "force history": (wd.ForceHistory(np.round(FORCE, 3), STEP), 3),
    "white noise": (wd.FilteredNoise(wd.WhiteNoise(0.02), 1.4, STEP), 4),
    "kanai_tajimi": (wd.FilteredNoise(wd.KanaiTajimi(0.02, 15.0, 0.6), **NOISE), 4),
    "clough_penzien": (wd.FilteredNoise(wd.CloughPenzien(0.02, 15.0, 0.6, 1.5, 0.6), **NOISE), 4),
    "free vibration": (wd.FreeVibration(1.5, velocity=[0.2, 0.3]), 3),
    "free vibration from a displacement": (wd.FreeVibration(1.5, displacement=[0.002, 0.003]), 3),
}
for name, (load, count) in LOADS.items():
    for method in ("rk4", "newmark_average", "exact"):

        @fingerprint(f"load/{name}/{method}", load, count, method)
        def loaded(load: object, count: int, method: str) -> dict[str, xr.Dataset]:
            is_linear = method == "exact" or getattr(load, "displacement", np.zeros(1)).any()
            scene = make_scene((elastic if is_linear else chain)(2), load, scatter=spread("stiffness"), tail=None)
            parts = {"chain": run(scene, count, seed=8, method=method)}
            factors = {name: factor(wd.Lognormal(1.0, 0.1)) for name in ("mass", "damping", "stiffness")}
            if method != "newmark_average":
                parts["dense"] = run(make_scene(dense(2), load, scatter=factors), count, seed=8, method=method)
            return parts


@fingerprint("load/motions of the noise")
def noise_itself() -> dict[str, np.ndarray]:
    loads = {name: load for name, (load, _) in LOADS.items() if isinstance(load, wd.FilteredNoise)}
    return {f"{name} {i}": load.motion(i, seed=8).acceleration for name, load in loads.items() for i in (0, 5)}


# Recorders by themselves and together; numbers of storeys.

for recorders in (*((name,) for name in CHAIN_RECORDERS), CHAIN_RECORDERS, ("drift", "residual"), ("energy", "drift")):
    for method, dtype in (("rk4", "float32"), ("newmark_linear", "float64")):

        @fingerprint(f"recorders/{'+'.join(recorders)}/{method}", recorders, method, dtype)
        def recorded(recorders: tuple[str, ...], method: str, dtype: str) -> xr.Dataset:
            scene = make_scene(chain(2), stripes(0.2, 0.9), recorders, scatter=spread("stiffness"))
            return run(scene, 5, seed=4, method=method, dtype=dtype)


for name in DENSE_RECORDERS:

    @fingerprint(f"recorders/{name} of a full system", name)
    def recorded_of_a_system(name: str) -> dict[str, xr.Dataset]:
        scene = make_scene(dense(2), stripes(0.2), (name,))
        return {method: run(scene, 2, method=method) for method in ("rk4", "exact")}


for storeys in (1, 2, 3, 5, 9, 20):
    for dtype, method in (("float64", "rk4"), ("float32", "velocity_verlet")):

        @fingerprint(f"storeys/{storeys}/{method} {dtype}", storeys, dtype, method)
        def storeyed(storeys: int, dtype: str, method: str) -> xr.Dataset:
            building = chain(storeys, yield_force=np.linspace(1500.0, 800.0, storeys) * storeys**0.5)
            scatter = spread("stiffness", "yield_force")
            recorders = None if storeys < 9 else ("drift", "residual", "energy")
            scene = make_scene(building, stripes(0.3, 1.0), recorders, scatter=scatter, tail=0.4)
            return run(scene, 5, seed=1, dtype=dtype, method=method)


@fingerprint("storeys/20/newmark_average", "newmark_average", chain)
@fingerprint("storeys/20/exact", "exact", elastic)
def tall(method: str, make) -> xr.Dataset:
    return run(make_scene(make(20), stripes(0.3), ("drift", "energy"), tail=0.4), method=method)


# Settings of a run.


def yielding(**rest: object) -> wd.Scene:
    scatter = spread("mass", "stiffness", "yield_force")
    return make_scene(chain(2), stripes(0.2, 0.9), **({"scatter": scatter, "tail": 0.4} | rest))


@fingerprint("settings/on_unstable")
def unstable() -> dict[str, object]:
    """Some of these are beyond the limit of a step of 20 ms; Bouc-Wen storeys have one of their own besides."""
    stiff = {"stiffness": listed(4e5 * np.array([1.0, 10.0, 40.0, 120.0]))}
    scene = make_scene(elastic(2), stripes(0.2), scatter=stiff, tail=0.4)
    parts = {how: run(scene, 4, step=STEP, on_unstable=how) for how in ("substep", "flag")}
    parts["raise"] = outcome(lambda: run(scene, 4, step=STEP, on_unstable="raise"))
    parts["raise in vain"] = run(scene, 4, step=STEP / 16, on_unstable="raise")
    sliding = chain(1, law="bouc_wen", yield_force=40.0, exponent=2.0)
    free = make_scene(sliding, wd.FreeVibration(1.0, velocity=1.0))
    return parts | {f"law {how}": run(free, step=STEP, on_unstable=how) for how in ("substep", "flag")}


@fingerprint("settings/blow-ups")
def blow_ups() -> dict[str, xr.Dataset]:
    force = make_scene(elastic(1), wd.HarmonicForce([1e38], 20.0, 20.0), collapse_drift_ratio=1e-3)
    critical = elastic(60, damping="modal", damping_ratio=0.95, stiffness=4e6)
    base = make_scene(critical, wd.GroundMotion(np.round(np.sin(np.arange(20)), 9), 1.0), ("drift",), tail=0.0)
    implicit = {"step": 1.0, "method": "newmark_average"}
    return {
        "diverged": run(force, 2, dtype="float32", on_unstable="flag"),
        "not converged": run(base, on_unstable="flag", **implicit),
        "converged": run(base, **implicit),
    }


@fingerprint("settings/steps")
def steps() -> dict[str, xr.Dataset]:
    return {
        "step": run(yielding(), 3, step=STEP / 5),
        "longest_step": run(yielding(), 3, longest_step=0.0033),
        "resample": run(yielding(), 3, step=0.003, resample=True),
        "force resampled": run(make_scene(chain(2), LOADS["force history"][0]), 2, step=0.003, resample=True),
    }


@fingerprint("settings/estimates", "float32", "rk4")
@fingerprint("settings/estimates in float64", "float64", "newmark_average")
def estimates(dtype: str, method: str) -> dict[str, object]:
    found = run(yielding(), 12, checked_share=0.7, dtype=dtype, method=method)
    text = re.sub(r"[\d.e+-]+ s integrating| on \S+,", "", wd.summary(found))
    full = make_scene(dense(2), stripes(0.2, 0.5))
    return {"run": found, "summary": text, "dense": run(full, 20, checked_share=1.0, dtype=dtype)}


@fingerprint("settings/plans")
def plans() -> dict[str, object]:
    """Which of several methods is the cheapest is a matter of time: only those of one method are compared."""
    scene = yielding(recorders=("drift", "energy"))
    parts: dict[str, object] = {}
    for method, error in (("rk4", 0.01), ("velocity_verlet", 0.003)):
        choice = make_plan(scene, error, 4, method=method)
        parts[f"{method} table"] = choice.table.drop_vars("seconds_per_sample")
        parts[f"{method} chosen"] = f"{choice.method} {choice.dtype} {choice.longest_step!r}"
        carried = {name: number for name, number in choice.carried.items() if "time" not in name}
        parts[f"{method} carried"] = carried
    parts["run"] = run(scene, 4, target_error=0.01, method="rk4", dtype=None)
    return parts


@fingerprint("settings/blocks, threads and files")
def divided() -> dict[str, xr.Dataset]:
    scene, settings = yielding(), {"seed": 4, "dtype": "float32"}
    parts = {f"threads {threads}": run(scene, 12, threads=threads, **settings) for threads in (1, 2, None)}
    parts["blocks"] = run(scene, 12, memory=LITTLE_MEMORY, **settings)
    parts["no inputs"] = run(scene, 3, keep_inputs=False, **settings)
    with folder() as path:
        with run(scene, 12, memory=LITTLE_MEMORY, path=path / "run.nc", **settings) as found:
            parts["file"] = found.load()
        with xr.open_dataset(path / "run.nc") as found:
            parts["file read"] = found.load()
        wd.write(parts["no inputs"], path / "written.nc")
        with xr.open_dataset(path / "written.nc") as found:
            parts["written"] = found.load()
    return parts


LITTLE_MEMORY = 67_120_000  # bytes: enough for a few structures at a time


@fingerprint("settings/histories", "chain", "rk4", "float32")
@fingerprint("settings/histories of implicit steps", "chain", "hht_alpha", "float64")
@fingerprint("settings/histories of a full system", "dense", "exact", "float64")
def whole(family: str, method: str, dtype: str) -> xr.Dataset:
    structure = chain(3) if family == "chain" else dense(3)
    scene = make_scene(structure, wd.Cloud([motion(1), motion(2, 5.0, 50)]), tail=0.5)
    return run(scene, 3, method=method, dtype=dtype, histories=histories(4, 0, 3, every=3))
