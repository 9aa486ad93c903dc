"""Four-point storeys with pinching and damage (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

GEM's vulnerability toolkit has such storeys with reloading ratios of 0.5 and 0.25 and an unloading ratio of 0.05, the
defaults here, and no damage. With yield drift dy = `yield_force` / `stiffness`, OpenSees' names are: ePf1, ePd1 =
`yield_force`, dy; ePf2 to ePf4 = `force_ratio_2` to `force_ratio_4` times the yield force; ePd2 to ePd4 =
`ductility_2` to `ductility_4` times dy; the same with a minus sign for eNf1 to eNd4; rDispP = `reloading_drift`,
rForceP = `reloading_force`, uForceP = `unloading_force`; gK for `stiffness_damage`, gD for `reloading_damage`, gF for
`strength_damage`, each 1 = `_by_drift`, 2 = `_by_use`, 3 = `_drift_exponent`, 4 = `_use_exponent`, Lim = `_limit`;
gE = `energy_factor`; dmgType "energy" or "cycle" by `counts_cycles` 0 or 1. Use is the energy spent over the energy
under the backbone times the energy factor, or the number of cycles.

These differ from OpenSees on purpose:

- A level part of the backbone is level. OpenSees takes the line of the next part that is not.
- Beyond its last corner a backbone that does not rise is level. In OpenSees it rises by 1e-7 of its force a last drift.
- The unloading ratio must be below the reloading one. Elsewhere OpenSees reloads to the force of the last corner.
- No part of a path is stiffer than the first part of the backbone. In OpenSees those from small turns can be.
- The unloading ratio has a lower bound: cycles to a peak of a lower force than the corner's would give energy.
- A turn takes effect at once. OpenSees takes the old loss of stiffness and strength in part for one more step.
- A storey that lost its force for good has none. OpenSees divides 0 by 0 there, and where `reloading_drift` is 1.
"""

from __future__ import annotations

import numpy as np

from warpdyn.laws.backbone import backbone_problem, corner_parameters, corners
from warpdyn.laws.bounds import first_bad, first_place, place_of
from warpdyn.laws.law import YIELD_FORCE, Law, Parameter, Values

NEVER = 1e16  # yield drifts
DAMAGE = {
    "stiffness": "loss of unloading stiffness",
    "reloading": "growth of the drift aimed at",
    "strength": "loss of strength",
}


def _damage_parameters(kind: str) -> dict[str, Parameter]:
    name, limit = DAMAGE[kind], {} if kind == "reloading" else {"high": 1.0, "high_open": True}
    return {
        f"{kind}_damage_by_drift": Parameter("1", f"{name} at the last drift of the backbone", low=0.0, default=0.0),
        f"{kind}_damage_by_use": Parameter("1", f"{name} by all energy, or a cycle", low=0.0, default=0.0),
        f"{kind}_damage_drift_exponent": Parameter("1", f"power of drift in {name}", low=0.0, default=1.0),
        f"{kind}_damage_use_exponent": Parameter("1", f"power of energy or cycles in {name}", low=0.0, default=1.0),
        f"{kind}_damage_limit": Parameter("1", f"largest {name}", low=0.0, default=0.0, **limit),
    }


def _pinching4_spring(p: Values) -> str:
    if not any(np.any(p[f"{kind}_damage_limit"] > 0) for kind in DAMAGE):
        return "pinching4"
    return f"pinching4_{'cycle' if np.any(p['counts_cycles'] > 0) else 'energy'}_damage"


def _pinching4_coefficients(p: Values, spring: str) -> tuple[np.ndarray, ...]:
    drift, force = corners(p, 4)
    length, rise = (np.diff(values, axis=0) for values in (drift, force))
    slope = rise / length
    values = (
        p["stiffness"] / p["yield_force"],
        p["yield_force"],
        *length[:2],
        np.where(slope[2] > 0, NEVER, length[2]),
        *slope,
        p["reloading_drift"],
        p["reloading_force"],
        p["unloading_force"] * force[2],
        p["unloading_force"] * force[3],
    )
    if spring == "pinching4":
        return values
    energy = 0.5 + sum((f + g) / 2 * (e - d) for d, e, f, g in zip(drift, drift[1:], force, force[1:], strict=False))
    names = ("limit", "by_drift", "by_use", "drift_exponent", "use_exponent")
    damage = [p[f"{kind}_damage_{name}"] for kind in DAMAGE for name in names]
    return (*values, *damage, 1 / drift[3], 1 / (p["energy_factor"] * energy))


def _unloading_problem(p: Values) -> str | None:
    """Return what is wrong with forces unloaded to below zero: symmetric cycles of some drift would give energy.

    A cycle between -x and x, where the backbone's force is f, that reloads as stiffly as it unloads spends twice
    (u + r f) (x - f) in units of yield, with the force u unloaded to and the ratio r of the force reloaded to. One that
    reloads over a longer way spends more.
    """
    _, (first, second, third, fourth) = corners(p, 4)
    ratio = np.ones_like(first)
    for weakest, corner in ((np.minimum(np.minimum(first, second), third), third), (np.minimum(third, fourth), fourth)):
        ratio = np.minimum(ratio, np.divide(weakest, corner, out=np.ones_like(ratio), where=corner > 0))
    least = -p["reloading_force"] * ratio
    bad = p["unloading_force"] < least * (1 + 1e-9)
    reason = "or cycles would give energy: that is -reloading_force times the least force of a peak over the corner's"
    return first_bad(bad, "unloading_force", p["unloading_force"], "at least", least, reason)


def _pinching4_problem(p: Values) -> str | None:
    if problem := backbone_problem(p, 4):
        return problem
    if problem := _unloading_problem(p):
        return problem
    reloading, unloading = np.broadcast_arrays(p["reloading_force"], p["unloading_force"])
    if np.any(bad := unloading >= reloading):
        place = first_place(bad)
        return (
            f"unloading_force is {unloading[place]:g} ({place_of(place)}); it must be below reloading_force, "
            f"{reloading[place]:g}"
        )
    for kind in DAMAGE:
        for name in ("by_drift", "by_use"):
            factor, limit = np.broadcast_arrays(p[f"{kind}_damage_{name}"], p[f"{kind}_damage_limit"])
            if np.any(bad := (factor > 0) & (limit == 0)):
                return (
                    f"{kind}_damage_{name} is {factor[first_place(bad)]:g} where {kind}_damage_limit is 0 "
                    f"({place_of(first_place(bad))}); a limit above 0 lets it act"
                )
    counts = p["counts_cycles"]
    if np.any(bad := ~np.isin(counts, (0, 1))) or np.any(bad := counts != np.ravel(counts)[0]):
        value, where = counts[first_place(bad)], place_of(first_place(bad))
        return f"counts_cycles is {value:g} ({where}); it must be 0 or 1, alike in all storeys"
    return None


PINCHING4 = Law(
    {
        "yield_force": YIELD_FORCE,
        **corner_parameters(2),
        **corner_parameters(3),
        **corner_parameters(4),
        "reloading_drift": Parameter(
            "1",
            "drift where reloading stiffens over that aimed at",
            low=0.0,
            high=1.0,
            high_open=True,
            default=0.5,
        ),
        "reloading_force": Parameter(
            "1", "force where reloading stiffens over that aimed at", low=0.0, high=1.0, default=0.25
        ),
        "unloading_force": Parameter(
            "1",
            "force unloaded to over that at the third corner, or fourth",
            low=-1.0,
            high=1.0,
            default=0.05,
        ),
        **_damage_parameters("stiffness"),
        **_damage_parameters("reloading"),
        **_damage_parameters("strength"),
        "energy_factor": Parameter(
            "1", "energy that can be spent over that under the backbone", low=0.0, low_open=True, default=10.0
        ),
        "counts_cycles": Parameter("1", "whether damage goes by cycles (1) or energy (0)", low=0, high=1, default=0.0),
    },
    _pinching4_spring,
    _pinching4_coefficients,
    _pinching4_problem,
)

LAWS = {
    "pinching4": PINCHING4,
}
