"""Storeys after Ibarra, Medina and Krawinkler (2005), as modified by Lignos and Krawinkler (2011).

A backbone, the same both ways, rises from yield to a capping point, falls to the residual force and ends at the
ultimate drift, where the storey loses its strength. Energy deteriorates it: each time the force changes its sign, the
backbone of the side it changes to loses the shares D (E_i / (Lambda Fy - E))^c of its yield force and hardening slope
and of the force of its capping line, and its farthest peak moves on by such a share; each time the storey turns back,
the unloading stiffness loses a share, without D. E is the energy taken so far, E_i that since the last change of sign;
each of the four has a Lambda of its own, a drift. 0 means none, of Lambda and of the ultimate drift.

The rules are those of OpenSees' IMKBilin, IMKPeakOriented and IMKPinching (of 2022 and 2023), so that the unloading
stiffness of a bilinear storey that has come to its residual force is half the initial one, and one that has lost its
strength one way has the residual force the other way; the others lose all at once. OpenSees' names, beside ours: Ke
stiffness, Up plastic_drift_to_capping, Upc post_capping_drift (from the capping point to where its line would come to
no force), Uu ultimate_drift, Fy yield_force, FmaxFy capping_force_ratio, ResF residual_force_ratio; LAMBDA_S
strength_deterioration_drift, LAMBDA_C post_capping_deterioration_drift, LAMBDA_A reloading_deterioration_drift,
LAMBDA_K unloading_deterioration_drift; c_S, c_C, c_A and c_K deterioration_exponent, D_pos and D_neg
deterioration_rate; kappaF pinching_force_ratio, kappaD pinching_drift_ratio.

Ours differ on purpose:

- Once more energy was spent than was left of Lambda Fy, the storey is exhausted and its force is gone, as Ibarra and
  others have it. OpenSees' go on for ever, and deteriorate no more, if a single excursion takes E beyond Lambda Fy.
- A storey never reloads more steeply than at its initial stiffness. OpenSees' forces jump where the peak that they go
  for lies close to where the force changed its sign, or behind it.
- The residual force bounds a backbone everywhere. With OpenSees' IMKPeakOriented and IMKPinching it does so beyond the
  capping point alone, and the force jumps where deterioration has taken hardening below it.
- Without deterioration, Lambda is 0; OpenSees needs a large one. An excursion that has given back more than it took
  deteriorates nothing; OpenSees raises the negative energy to the exponent, which with 1.5 gives no number at all.
- A storey that turns back from its backbone gives back no more than was put in since the force last changed its sign:
  where the unloading stiffness is about exhausted it is as low as that allows. In OpenSees it comes close to zero, and
  the storey pushes on for hundreds of yield drifts.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.bounds import first_place, place_of
from warpdyn.laws.law import YIELD_FORCE, Law, Parameter, Values

_BACKBONE = {
    "yield_force": YIELD_FORCE,
    "plastic_drift_to_capping": Parameter("m", "drift from yield to the capping point", low=0.0, low_open=True),
    "post_capping_drift": Parameter("m", "drift from the capping point to no force", low=0.0, low_open=True),
    "capping_force_ratio": Parameter("1", "ratio of the force at the capping point to the yield force", low=1.0),
    "residual_force_ratio": Parameter(
        "1", "ratio of residual to yield force", low=0.0, high=1.0, high_open=True, default=0.0
    ),
    "ultimate_drift": Parameter("m", "drift at which all strength is lost, 0 for none", low=0.0, default=0.0),
}
_RULE = {
    "deterioration_exponent": Parameter("1", "exponent c of deterioration", low=1.0, default=1.0),
    "deterioration_rate": Parameter("1", "rate D of deterioration", low=0.0, low_open=True, high=1.0, default=1.0),
}


def _capacity(of: str) -> Parameter:
    return Parameter(
        "m", f"energy over yield force that exhausts the {of}, 0 for no deterioration", low=0.0, default=0.0
    )


_DETERIORATION = {
    "strength_deterioration_drift": _capacity("yield force"),
    "post_capping_deterioration_drift": _capacity("post-capping strength"),
    "unloading_deterioration_drift": _capacity("unloading stiffness"),
}
_RELOADING = {"reloading_deterioration_drift": _capacity("reloading stiffness")}
_PINCHING = {
    "pinching_force_ratio": Parameter("1", "ratio of the pinching point's force to that of no pinching", 0.0, 1.0),
    "pinching_drift_ratio": Parameter("1", "share of the plastic drift before the pinching point", 0.0, 1.0),
}


def _coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    """Return what the kernels read, in units of yield drift and force."""
    rate = p["stiffness"] / p["yield_force"]

    def capacity(name: str) -> np.ndarray:
        return np.where(p[name] > 0, p[name] * rate, np.inf)

    peak, to_capping, residual = (
        p["capping_force_ratio"],
        p["plastic_drift_to_capping"] * rate,
        p["residual_force_ratio"],
    )
    falling = peak / (p["post_capping_drift"] * rate)
    capping = peak + falling * (1 + to_capping)
    if "bilinear" in spring:  # its capping line falls the less the weaker the storey is
        falling = falling / (1 - residual)
    values = rate, p["yield_force"], (peak - 1) / to_capping, falling, capping, residual, capacity("ultimate_drift")
    values += tuple(capacity(name) for name in _DETERIORATION)
    values += (p["deterioration_rate"],)
    values += tuple(capacity(name) for name in _RELOADING if name in p)
    if "pinching" in spring:
        values += p["pinching_force_ratio"], 1 - p["pinching_drift_ratio"]
    return (*values, p["deterioration_exponent"]) if spring.endswith("_power") else values


def _problem(p: Values) -> str | None:
    """Return what is wrong between the parameters of a backbone."""
    p = dict(zip(p, np.broadcast_arrays(*p.values()), strict=True))
    yield_drift = p["yield_force"] / p["stiffness"]
    rise = 1 + p["plastic_drift_to_capping"] / yield_drift
    low = (p["ultimate_drift"] > 0) & (p["ultimate_drift"] <= yield_drift)
    for name, bad, bound, words in (
        (
            "capping_force_ratio",
            p["capping_force_ratio"] >= rise,
            rise,
            "below {:g}, or hardening is no less than elastic",
        ),
        ("ultimate_drift", low, yield_drift, "0 for none, or above the yield drift of {:g} m"),
    ):
        if np.any(bad):
            place = first_place(bad)
            return f"{name} is {p[name][place]:g} ({place_of(place)}); it must be {words.format(bound[place])}"
    return None


def _law(kind: str, parameters: dict[str, Parameter]) -> Law:
    def spring(p: Values) -> str:
        """The exponent 1 has a kernel without powers, of which CPUs take one at a time."""
        is_linear = np.all(p["deterioration_exponent"] == 1)
        return f"ibarra_medina_krawinkler_{kind}" + ("" if is_linear else "_power")

    return Law(_BACKBONE | parameters | _RULE, spring, _coefficients, _problem)


IBARRA_MEDINA_KRAWINKLER_BILINEAR = _law("bilinear", _DETERIORATION)
IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED = _law("peak_oriented", _DETERIORATION | _RELOADING)
IBARRA_MEDINA_KRAWINKLER_PINCHING = _law("pinching", _DETERIORATION | _RELOADING | _PINCHING)

LAWS = {
    "ibarra_medina_krawinkler_bilinear": IBARRA_MEDINA_KRAWINKLER_BILINEAR,
    "ibarra_medina_krawinkler_peak_oriented": IBARRA_MEDINA_KRAWINKLER_PEAK_ORIENTED,
    "ibarra_medina_krawinkler_pinching": IBARRA_MEDINA_KRAWINKLER_PINCHING,
}
