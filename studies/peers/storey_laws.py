"""Storey laws with parameters of typical buildings, in the forms that warpdyn and OpenSees need."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from peers.case import HARDENING_RATIO

Parameters = dict[str, float]
Numbers = list[float | str]


@dataclass(frozen=True)
class StoreyLaw:
    """One storey law, with parameters for warpdyn and for the corresponding material of OpenSees.

    Args:
        words: Short description of the law.
        parameters: Function that returns warpdyn's parameters, except stiffness and yield force, for a yield drift [m].
        material: Name of the uniaxial material in OpenSees.
        numbers: Function that returns the parameters of the material in its order, for stiffness [N/m], yield force [N]
            and warpdyn's parameters.
    """

    words: str
    parameters: Callable[[float], Parameters]
    material: str
    numbers: Callable[[float, float, Parameters], Numbers]


def _both_sides(stiffness: float, force: float, p: Parameters, corners: int) -> Numbers:
    """Return force [N] and drift [m] of each corner of the backbone, on the positive and then the negative side."""
    side = [force, force / stiffness]
    for i in range(2, corners + 1):
        side += [p[f"force_ratio_{i}"] * force, p[f"ductility_{i}"] * force / stiffness]
    return [*side, *(-value for value in side)]


def _polygon(stiffness: float, force: float, p: Parameters, corners: int) -> Numbers:
    """Return drift [m] and force [N] of each corner of the backbone, and of a point far beyond the last corner."""
    points = [(1.0, 1.0), *((p[f"ductility_{i}"], p[f"force_ratio_{i}"]) for i in range(2, corners + 1))]
    points.append((points[-1][0] + 1000, points[-1][1] + 1000 * p["hardening_ratio"]))
    return [value for d, f in points for value in (d * force / stiffness, f * force)]


def _clough(stiffness: float, force: float, p: Parameters) -> Numbers:
    """Return the parameters of OpenSees' Hysteretic for Clough's law.

    The last two of the three points are on the hardening line; reloading aims at the peak.
    """
    side = [force, force / stiffness]
    for ductility in (2, 1000):
        side += [force * (1 + p["hardening_ratio"] * (ductility - 1)), ductility * force / stiffness]
    return [*side, *(-value for value in side), 1.0, 1.0, 0.0, 0.0, p.get("unloading_exponent", 0.0)]


def _hysteretic(stiffness: float, force: float, p: Parameters) -> Numbers:
    names = ("pinching_drift", "pinching_force", "damage_by_ductility", "damage_by_energy", "unloading_exponent")
    return [*_both_sides(stiffness, force, p, 3), *(p[name] for name in names)]


def _pinching4(stiffness: float, force: float, p: Parameters) -> Numbers:
    pinching = [p[name] for name in ("reloading_drift", "reloading_force", "unloading_force")]
    names = ("by_drift", "by_use", "drift_exponent", "use_exponent", "limit")
    damage = [p[f"{kind}_damage_{name}"] for kind in ("stiffness", "reloading", "strength") for name in names]
    return [*_both_sides(stiffness, force, p, 4), *pinching, *pinching, *damage, p["energy_factor"], "energy"]


def _ibarra_medina_krawinkler(stiffness: float, force: float, p: Parameters) -> Numbers:
    side = [p["plastic_drift_to_capping"], p["post_capping_drift"], 1e9]
    side += [force, p["capping_force_ratio"], p["residual_force_ratio"]]
    modes = [m for m in ("strength", "post_capping", "reloading", "unloading") if f"{m}_deterioration_drift" in p]
    energies = [p[f"{mode}_deterioration_drift"] for mode in modes]
    pinching = [p[name] for name in ("pinching_force_ratio", "pinching_drift_ratio") if name in p]
    return [stiffness, *side, *side, *energies, *[1.0] * len(modes), 1.0, 1.0, *pinching]


def _saws(stiffness: float, force: float, p: Parameters) -> Numbers:
    ratios = [p["hardening_ratio"], -p["softening_ratio"], 1.0, p["pinching_stiffness_ratio"]]
    reloading = [p["reloading_exponent"], p["reloading_drift_ratio"]]
    return [force, p["pinching_force_ratio"] * force, p["drift_at_peak_force"], stiffness, *ratios, *reloading]


def _bouc_wen(stiffness: float, force: float, p: Parameters) -> Numbers:
    """Return the parameters of OpenSees' BoucWen, in which z has the unit of a drift."""
    rate = 0.5 * stiffness / force
    return [p["hardening_ratio"], stiffness, 1.0, rate, rate, 1.0, 0.0, 0.0, 0.0]


def _baber_noori(stiffness: float, force: float, p: Parameters) -> Numbers:
    drift = force / stiffness
    pinching = [p["pinching_level"], p["total_slip"], p["pinching_rate"] / (force * drift)]
    pinching += [p["pinching_spread"] * drift, p["pinching_spread_rate"] / force, p["pinching_coupling"]]
    return [p["hardening_ratio"], stiffness, 1.0, 0.5 / drift, 0.5 / drift, 1.0, *pinching, 1e-8, 50]


_CORNERS_2 = {"ductility_2": 3.0, "force_ratio_2": 1.4, "hardening_ratio": HARDENING_RATIO}
_CORNERS_3 = _CORNERS_2 | {"ductility_2": 2.0, "force_ratio_2": 1.5, "ductility_3": 5.0, "force_ratio_3": 1.8}
_MENEGOTTO_PINTO = {
    "hardening_ratio": HARDENING_RATIO,
    "transition_curvature": 18.0,
    "curvature_reduction": 0.925,
    "curvature_reduction_ductility": 0.15,
    "isotropic_hardening": 0.02,
    "isotropic_hardening_ductility": 2.0,
}
_HYSTERETIC = {
    "ductility_2": 4.0,
    "force_ratio_2": 1.2,
    "ductility_3": 10.0,
    "force_ratio_3": 0.5,
    "pinching_drift": 0.6,
    "pinching_force": 0.4,
    "damage_by_ductility": 0.01,
    "damage_by_energy": 0.02,
    "unloading_exponent": 0.4,
}
_PINCHING4 = {
    "ductility_2": 4.0,
    "force_ratio_2": 1.2,
    "ductility_3": 6.0,
    "force_ratio_3": 1.25,
    "ductility_4": 12.0,
    "force_ratio_4": 0.3,
    "reloading_drift": 0.5,
    "reloading_force": 0.25,
    "unloading_force": 0.05,
    "energy_factor": 10.0,
}
for _kind, _values in {
    "stiffness": (0.3, 0.1, 0.8, 0.6, 0.5),
    "reloading": (0.1, 0.1, 0.8, 0.6, 0.3),
    "strength": (0.1, 0.2, 1.0, 0.6, 0.4),
}.items():
    for _name, _value in zip(("by_drift", "by_use", "drift_exponent", "use_exponent", "limit"), _values, strict=True):
        _PINCHING4[f"{_kind}_damage_{_name}"] = _value
_BABER_NOORI = {
    "hardening_ratio": HARDENING_RATIO,
    "total_slip": 0.9,
    "pinching_rate": 0.05,
    "pinching_spread": 0.15,
    "pinching_spread_rate": 0.002,
    "pinching_coupling": 0.3,
    "pinching_level": 0.1,
}

_SAWS = {
    "pinching_force_ratio": 0.2,
    "hardening_ratio": 0.04,
    "softening_ratio": 0.05,
    "pinching_stiffness_ratio": 0.02,
    "reloading_exponent": 0.6,
    "reloading_drift_ratio": 1.3,
}


def _lasting(yield_drift: float, *modes: str) -> Parameters:
    """Return a backbone with capping at ductility 5, and an energy capacity of 150 yield drifts times yield force."""
    drifts = {"plastic_drift_to_capping": 4 * yield_drift, "post_capping_drift": 15 * yield_drift}
    drifts |= {f"{mode}_deterioration_drift": 150 * yield_drift for mode in ("strength", "post_capping", *modes)}
    return {"capping_force_ratio": 1.15, "residual_force_ratio": 0.2} | drifts


LAWS = {
    "elastic": StoreyLaw("linear", lambda d: {}, "Elastic", lambda k, f, p: [k]),
    "elastic_perfectly_plastic": StoreyLaw(
        "yields at a constant force", lambda d: {}, "ElasticPP", lambda k, f, p: [k, f / k]
    ),
    "bilinear": StoreyLaw(
        "kinematic hardening",
        lambda d: {"hardening_ratio": HARDENING_RATIO},
        "Steel01",
        lambda k, f, p: [f, k, p["hardening_ratio"]],
    ),
    "trilinear": StoreyLaw(
        "backbone with two corners, kinematic hardening",
        lambda d: dict(_CORNERS_2),
        "MultiLinear",
        lambda k, f, p: _polygon(k, f, p, 2),
    ),
    "quadrilinear": StoreyLaw(
        "backbone with three corners, kinematic hardening",
        lambda d: dict(_CORNERS_3),
        "MultiLinear",
        lambda k, f, p: _polygon(k, f, p, 3),
    ),
    "self_centring": StoreyLaw(
        "flag-shaped loops, no residual drift",
        lambda d: {"hardening_ratio": HARDENING_RATIO, "flag_height": 0.6},
        "FlagShape",
        lambda k, f, p: [k, f, p["hardening_ratio"] * k, p["flag_height"] / 2],
    ),
    "menegotto_pinto": StoreyLaw(
        "steel: curved transitions, isotropic hardening",
        lambda d: dict(_MENEGOTTO_PINTO),
        "Steel02",
        lambda k, f, p: [f, k, *list(p.values())[:4], *list(p.values())[4:] * 2],
    ),
    "bouc_wen": StoreyLaw("smooth hysteresis", lambda d: {"hardening_ratio": HARDENING_RATIO}, "BoucWen", _bouc_wen),
    "baber_noori": StoreyLaw(
        "Bouc-Wen with degradation and pinching by dissipated energy",
        lambda d: dict(_BABER_NOORI),
        "BWBN",
        _baber_noori,
    ),
    "peak_oriented": StoreyLaw(
        "Clough: reloads towards the peak", lambda d: {"hardening_ratio": HARDENING_RATIO}, "Hysteretic", _clough
    ),
    "takeda": StoreyLaw(
        "as `peak_oriented`, with softer unloading beyond yield",
        lambda d: {"hardening_ratio": HARDENING_RATIO, "unloading_exponent": 0.4},
        "Hysteretic",
        _clough,
    ),
    "hysteretic": StoreyLaw(
        "trilinear, pinching, damage by ductility and energy", lambda d: dict(_HYSTERETIC), "Hysteretic", _hysteretic
    ),
    "pinching4": StoreyLaw(
        "four points, pinching, damage of stiffness, strength and reloading",
        lambda d: dict(_PINCHING4),
        "Pinching4",
        _pinching4,
    ),
    "saws": StoreyLaw(
        "wood-frame walls: curved envelope, pinching, softening",
        lambda d: _SAWS | {"drift_at_peak_force": 7.9 * d},
        "SAWS",
        _saws,
    ),
    "ibarra_medina_krawinkler_bilinear": StoreyLaw(
        "capping, residual force, cyclic deterioration",
        lambda d: _lasting(d, "unloading"),
        "IMKBilin",
        _ibarra_medina_krawinkler,
    ),
    "ibarra_medina_krawinkler_peak_oriented": StoreyLaw(
        "as the bilinear one, reloads towards the peak",
        lambda d: _lasting(d, "unloading", "reloading"),
        "IMKPeakOriented",
        _ibarra_medina_krawinkler,
    ),
    "ibarra_medina_krawinkler_pinching": StoreyLaw(
        "as the peak-oriented one, with pinching",
        lambda d: _lasting(d, "unloading", "reloading") | {"pinching_force_ratio": 0.3, "pinching_drift_ratio": 0.5},
        "IMKPinching",
        _ibarra_medina_krawinkler,
    ),
}
