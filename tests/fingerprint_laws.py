"""Fingerprints of storey laws: slow paths, pushes and histories of every law, its variants, devices and mixtures."""

from __future__ import annotations

import numpy as np
import xarray as xr
from fingerprint_face import (
    DAMPED,
    chain,
    elastic,
    fingerprint,
    histories,
    make_scene,
    motion,
    outcome,
    part_of_storeys,
    run,
    spread,
    stripes,
)

import warpdyn as wd
from warpdyn.engine.laws import LAWS

STRENGTH = {"yield_force": 1500.0}
HARDENING = STRENGTH | {"hardening_ratio": 0.05}
BOUC_WEN = HARDENING | {"beta": 0.6, "gamma": 0.4}
DEGRADING = BOUC_WEN | {"growth_loss": 0.005, "strength_loss": 0.02, "stiffness_loss": 0.03}
PINCHED = DEGRADING | {
    "total_slip": 0.7,
    "pinching_rate": 0.2,
    "pinching_spread": 0.2,
    "pinching_spread_rate": 0.01,
    "pinching_coupling": 0.4,
    "pinching_level": 0.1,
}
CAPPED = STRENGTH | {
    "plastic_drift_to_capping": 0.015,
    "post_capping_drift": 0.08,
    "capping_force_ratio": 1.15,
    "residual_force_ratio": 0.2,
    "strength_deterioration_drift": 0.25,
    "post_capping_deterioration_drift": 0.25,
    "unloading_deterioration_drift": 0.4,
    "deterioration_rate": 0.9,
}
RELOADING = CAPPED | {"reloading_deterioration_drift": 0.3}
SLIPPING = RELOADING | {"pinching_force_ratio": 0.4, "pinching_drift_ratio": 0.5}
POWER, BROKEN = {"deterioration_exponent": 1.5}, {"ultimate_drift": 0.03}
CRACKED = HARDENING | {"cracking_ratio": 0.4, "cracked_stiffness_ratio": 0.5}
CORNERS = STRENGTH | {"ductility_2": 2.5, "force_ratio_2": 1.4, "ductility_3": 7.0, "force_ratio_3": 1.7}
FALLING = CORNERS | {"force_ratio_3": 1.1}
FOUR_POINTS = CORNERS | {"ductility_4": 12.0, "force_ratio_4": 0.8}
DAMAGED = FOUR_POINTS | {
    f"{kind}_damage_{name}": amount
    for kind in ("stiffness", "reloading", "strength")
    for name, amount in {
        "by_drift": 0.2,
        "by_use": 0.3,
        "drift_exponent": 0.8,
        "use_exponent": 1.2,
        "limit": 0.5,
    }.items()
}
BY_CYCLE = {f"{kind}_damage_by_use": 0.03 for kind in ("stiffness", "reloading", "strength")} | {"counts_cycles": 1.0}
IMK = "ibarra_medina_krawinkler"
SLIDING = {"friction_coefficient": 0.1, "radius": 0.5, "weight": 1.5e4}
# Every law, and every variant of it that has code of its own: the law, and its parameters.
LAW_CASES: dict[str, tuple[str, dict[str, float]]] = {
    "elastic": ("elastic", {}),
    "bilinear": ("bilinear", HARDENING),
    "elastic_perfectly_plastic": ("elastic_perfectly_plastic", STRENGTH),
    "trilinear": ("trilinear", HARDENING | {"ductility_2": 3.0, "force_ratio_2": 1.5}),
    "quadrilinear": ("quadrilinear", CORNERS | {"hardening_ratio": 0.02}),
    "trilinear_asymmetric": (
        "trilinear",
        HARDENING | {"ductility_2": 3.0, "force_ratio_2": 1.5, "yield_force_negative": 1200.0},
    ),
    "quadrilinear_asymmetric": ("quadrilinear", CORNERS | {"hardening_ratio": 0.02, "ductility_2_negative": 3.0}),
    "bouc_wen_1_elastic_unloading": ("bouc_wen", HARDENING),
    "bouc_wen_1": ("bouc_wen", BOUC_WEN),
    "bouc_wen_2": ("bouc_wen", BOUC_WEN | {"exponent": 2.0}),
    "bouc_wen_power": ("bouc_wen", BOUC_WEN | {"exponent": 1.4}),
    "baber_noori_1": ("baber_noori", DEGRADING),
    "baber_noori_power": ("baber_noori", DEGRADING | {"exponent": 1.5}),
    "baber_noori_pinching_1": ("baber_noori", PINCHED),
    "baber_noori_pinching_power": ("baber_noori", PINCHED | {"exponent": 1.5}),
    "self_centring": ("self_centring", HARDENING | {"flag_height": 0.7}),
    "self_centring_with_limits": (
        "self_centring",
        HARDENING | {"flag_height": 0.7, "slip_drift": 0.015, "bearing_drift": 0.02, "bearing_stiffness_ratio": 0.5},
    ),
    "menegotto_pinto": ("menegotto_pinto", HARDENING),
    "menegotto_pinto_isotropic": (
        "menegotto_pinto",
        HARDENING | {"isotropic_hardening": 0.05, "isotropic_hardening_ductility": 2.0},
    ),
    "peak_oriented": ("peak_oriented", HARDENING),
    "peak_oriented_cracked": ("peak_oriented", CRACKED),
    "takeda": ("takeda", HARDENING),
    "takeda_cracked": ("takeda", CRACKED | {"unloading_exponent": 0.3}),
    "hysteretic": ("hysteretic", FALLING),
    "hysteretic_pinching_damage": (
        "hysteretic",
        FALLING | {"pinching_drift": 0.6, "pinching_force": 0.3, "damage_by_ductility": 0.01, "damage_by_energy": 0.02},
    ),
    "hysteretic_softer_unloading": (
        "hysteretic",
        FALLING | {"pinching_drift": 0.7, "pinching_force": 0.4, "damage_by_energy": 0.02, "unloading_exponent": 0.5},
    ),
    "hysteretic_asymmetric": (
        "hysteretic",
        FALLING | {"yield_force_negative": 1200.0, "stiffness_ratio_negative": 0.8, "unloading_exponent": 0.3},
    ),
    "pinching4": ("pinching4", FOUR_POINTS),
    "pinching4_asymmetric": ("pinching4", FOUR_POINTS | {"yield_force_negative": 1200.0}),
    "pinching4_energy_damage_asymmetric": ("pinching4", DAMAGED | {"yield_force_negative": 1200.0}),
    "pinching4_cycle_damage_asymmetric": ("pinching4", DAMAGED | BY_CYCLE | {"yield_force_negative": 1200.0}),
    "pinching4_energy_damage": ("pinching4", DAMAGED),
    "pinching4_cycle_damage": ("pinching4", DAMAGED | BY_CYCLE),
    "saws": (
        "saws",
        STRENGTH
        | {
            "pinching_force_ratio": 0.2,
            "drift_at_peak_force": 0.025,
            "hardening_ratio": 0.04,
            "softening_ratio": 0.05,
            "pinching_stiffness_ratio": 0.02,
        },
    ),
    f"{IMK}_bilinear": (f"{IMK}_bilinear", CAPPED),
    f"{IMK}_bilinear_asymmetric": (f"{IMK}_bilinear", CAPPED | {"yield_force_negative": 1200.0}),
    f"{IMK}_peak_oriented_asymmetric": (f"{IMK}_peak_oriented", RELOADING | {"yield_force_negative": 1200.0}),
    f"{IMK}_pinching_asymmetric": (f"{IMK}_pinching", SLIPPING | {"yield_force_negative": 1200.0}),
    f"{IMK}_bilinear_power": (f"{IMK}_bilinear", CAPPED | POWER | BROKEN),
    f"{IMK}_peak_oriented": (f"{IMK}_peak_oriented", RELOADING | BROKEN),
    f"{IMK}_peak_oriented_power": (f"{IMK}_peak_oriented", RELOADING | POWER),
    f"{IMK}_pinching": (f"{IMK}_pinching", SLIPPING),
    f"{IMK}_pinching_power": (f"{IMK}_pinching", SLIPPING | POWER | BROKEN),
    "lead_rubber_bearing": ("lead_rubber_bearing", STRENGTH | {"post_yield_stiffness": 4e4}),
    "friction_pendulum": ("friction_pendulum", SLIDING),
}
if missing := set(LAWS) - {law for law, _ in LAW_CASES.values()}:
    raise ValueError(f"no fingerprints of the laws {sorted(missing)}")
# One of each kind of memory meets more methods, and keeps histories.
FURTHER = ("bilinear", "bouc_wen_2", "takeda", "pinching4_energy_damage", "menegotto_pinto", f"{IMK}_pinching")


def storeys_of(law: str, parameters: dict[str, float], storeys: int = 2, **rest: object) -> wd.ShearBuilding:
    return elastic(storeys, law=law, **(parameters | rest))


def slow_path() -> np.ndarray:
    """Return drifts [m] of growing cycles, of small loops within, and of a ratchet, in steps of 0.5 mm at most."""
    turns = [0.003, -0.003, 0.008, -0.008, 0.004, 0.006, 0.0, -0.012, 0.015, 0.013, 0.014, -0.005, 0.001, -0.02]
    turns += [0.02, 0.0, 0.028, 0.01, 0.034, 0.016, 0.04, -0.03, 0.03, -0.045, 0.05, 0.0]
    parts = []
    for start, end in zip([0.0, *turns], turns, strict=False):
        count = int(np.ceil(abs(end - start) / 0.0005 - 1e-9))
        parts.append(start + (end - start) * np.arange(1, count + 1) / count)
    return np.round(np.concatenate(parts), 9)


def along_slow_path(law: str, parameters: dict[str, float], **rest: object) -> xr.Dataset:
    return wd.storey_hysteresis(storeys_of(law, parameters, **rest), slow_path())


def pushed(law: str, parameters: dict[str, float], pattern: str = "first_mode", **rest: object) -> object:
    there = np.round(np.linspace(0.0, 0.024, 49), 6)[1:]
    path = np.concatenate([there, there[::-1] - 0.0005, -there[:20]])
    return outcome(lambda: wd.pushover(storeys_of(law, parameters, **rest), path, pattern=pattern))


def shaken(law: str, parameters: dict[str, float], storeys: int = 2, rest: dict | None = None, **settings: object):
    """Return a run of three drawn buildings under two motions at three levels: more than a row of lanes."""
    strength = [name for name in ("yield_force",) if name in parameters]
    building = storeys_of(law, parameters, storeys, **(rest or {}))
    scene = make_scene(
        building, stripes(0.1, 0.4, 1.0), scatter=spread("stiffness", *strength), collapse_drift_ratio=0.03, tail=0.6
    )
    return run(scene, 3, seed=3, **settings)


for name, case in LAW_CASES.items():
    fingerprint(f"path/{name}", *case)(along_slow_path)
    fingerprint(f"push/{name}", *case)(pushed)
    fingerprint(f"law/{name}/rk4", *case)(shaken)
    fingerprint(f"law/{name}/newmark_average", *case, method="newmark_average")(shaken)
    if name in FURTHER:
        fingerprint(f"law/{name}/velocity_verlet float32", *case, method="velocity_verlet", dtype="float32")(shaken)
        fingerprint(f"law/{name}/histories", *case, histories=histories(2, 7, 17, every=2))(shaken)
    if name in ("bilinear", "bouc_wen_2", "pinching4"):
        modal = {"damping": "modal"}
        fingerprint(f"law/{name}/five storeys float32", *case, storeys=5, rest=modal, dtype="float32")(shaken)


FRICTION = {"devices": ("friction_damper",), "slip_force": [800.0, 0.0], "brace_stiffness": 8e5}
FRICTION_OF_THREE = {"devices": ("friction_damper",), "slip_force": [0.0, 0.0, 500.0], "brace_stiffness": 4e5}
GAP = {"devices": ("gap",), "clearance": 0.006, "contact_stiffness": 1.5e6, "restitution": 0.7}
ONE_SIDED = GAP | {"devices": ("one_sided_gap",), "restitution": [1.0, 0.6]}
LINEAR_DAMPER = {"devices": ("viscous_damper",), "damper_coefficient": [0.0, 3e3]}
POWER_DAMPER = LINEAR_DAMPER | {"velocity_exponent": 0.4, "linear_velocity": 0.02}
EVERY_DEVICE = FRICTION | GAP | POWER_DAMPER | {"devices": ("friction_damper", "gap", "viscous_damper")}
DEVICES = {
    "friction_damper": ("bilinear", HARDENING, FRICTION),
    "friction_damper beside elastic": ("elastic", {}, FRICTION),
    "friction_damper beside bouc_wen": ("bouc_wen", BOUC_WEN, FRICTION),
    "gap": ("bilinear", HARDENING, GAP),
    "one_sided_gap": ("takeda", HARDENING, ONE_SIDED),
    "viscous_damper linear": ("bilinear", HARDENING, LINEAR_DAMPER),
    "viscous_damper power": ("bilinear", HARDENING, POWER_DAMPER),
    "every device": ("peak_oriented", CRACKED, EVERY_DEVICE),
}


@fingerprint("path/mixed laws", "path")
@fingerprint("push/mixed laws", "push")
@fingerprint("law/mixed/rk4", "rk4")
@fingerprint("law/mixed/newmark_linear", "newmark_linear")
def mixed(what: str) -> object:
    """Three storeys of three laws, two of which share parameters, one with a device."""
    laws = ["elastic", "bilinear", "takeda"]
    building = chain(3, law=laws, yield_force=[np.nan, 1500.0, 900.0], unloading_exponent=0.3, **FRICTION_OF_THREE)
    if what == "path":
        return wd.storey_hysteresis(building, slow_path())
    if what == "push":
        return outcome(lambda: wd.pushover(building, np.linspace(0.0005, 0.03, 60), pattern="triangular"))
    scene = make_scene(building, stripes(0.3, 0.8), scatter=spread("yield_force"), tail=0.6)
    return run(scene, 3, seed=2, method=what)


@fingerprint("law/mixed of five/central_difference", "central_difference", "float32")
@fingerprint("law/mixed of five/dormand_prince54", "dormand_prince54", "float64")
def mixed_of_five(method: str, dtype: str) -> xr.Dataset:
    """Laws of many values beside those of few, storey by storey."""
    cases = ["bouc_wen_2", "pinching4", f"{IMK}_bilinear", "menegotto_pinto", "hysteretic"]
    parameters = {name: number for case in cases for name, number in LAW_CASES[case][1].items()}
    building = elastic(5, law=[LAW_CASES[case][0] for case in cases], **parameters)
    return run(make_scene(building, stripes(0.4, 1.0), tail=0.6), 1, method=method, dtype=dtype)


for name, (law, parameters, device) in DEVICES.items():
    fingerprint(f"path/{name}", law, parameters, **device)(along_slow_path)
    fingerprint(f"push/{name}", law, parameters, "uniform", **device)(pushed)
    for method, dtype in (("rk4", "float64"), ("newmark_average", "float32")):
        fingerprint(f"device/{name}/{method} {dtype}", law, parameters, rest=device, method=method, dtype=dtype)(shaken)


@fingerprint("isolators/lead_rubber_bearing", "lead_rubber_bearing", yield_force=900.0, post_yield_stiffness=1.2e4)
@fingerprint("isolators/friction_pendulum", "friction_pendulum", friction_coefficient=0.03, radius=0.6)
@fingerprint("isolators/bouc_wen", "bouc_wen", yield_force=900.0, hardening_ratio=0.1)
@fingerprint("isolators/elastic exact", "elastic", method="exact")
def isolated(law: str, method: str = "rk4", **parameters: float) -> dict[str, object]:
    building = elastic(2) if method == "exact" else chain(2)
    isolated = building.on_isolators(law, 1e3, 0.06, stiffness=1.2e5, damper_coefficient=500.0, **parameters)
    scatter = spread("stiffness", *parameters.keys() & {"yield_force"})
    scene = make_scene(isolated, stripes(0.2, 0.6, 1.5), scatter=scatter, collapse_drift_ratio=0.1, tail=1.0)
    found = run(scene, 3, method=method)
    return {"whole": found, "own storeys": part_of_storeys(found, 2, 3), "modes": isolated.modal()}


@fingerprint("tuned mass damper/yielding", chain, "rk4")
@fingerprint("tuned mass damper/linear", elastic, "exact")
def tuned(make, method: str) -> xr.Dataset:
    building = make(2, damping_ratio=0.02).with_tuned_mass_damper(0.05)
    return run(make_scene(building, stripes(0.1, 0.3), tail=1.0), method=method, histories=histories(0, 3))


@fingerprint("tuned mass damper/detuned")
def detuned() -> xr.Dataset:
    building = chain(2, damping="storey", damping_ratio=None, damping_coefficient=800.0)
    building = building.with_tuned_mass_damper(0.1, 0.8, 0.15, displacement_capacity=0.5)
    return run(make_scene(building, motion(5)), method="newmark_average")


@fingerprint("p_delta/explicit", "rk4", "float64")
@fingerprint("p_delta/float32", "rk4", "float32")
@fingerprint("p_delta/implicit", "newmark_average", "float64")
@fingerprint("p_delta/adaptive", "dormand_prince54", "float64")
def leaning(method: str, dtype: str) -> dict[str, object]:
    """Storeys that gravity brings down, with no drift limit: some stand, some are pushed over."""
    building = chain(2, hardening_ratio=0.02, gravity_load=[2e4, 3e4])
    scene = make_scene(building, stripes(0.1, 0.5, 1.5, 3.0), scatter=spread("stiffness", "gravity_load"), tail=1.5)
    roof = np.round(np.linspace(0.001, 0.12, 120), 6)
    pushed = outcome(lambda: wd.pushover(building, roof, pattern="triangular"))
    return {"run": run(scene, 3, method=method, dtype=dtype), "push": pushed, "modes": building.modal()}


@fingerprint("p_delta/exact")
def leaning_elastic() -> xr.Dataset:
    return run(make_scene(elastic(3, gravity_load=2e4, **DAMPED), stripes(0.2)), method="exact")
