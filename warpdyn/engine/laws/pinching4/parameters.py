"""Four-point storeys with pinching and damage (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

GEM's vulnerability toolkit has such storeys with reloading ratios of 0.5 and 0.25 and an unloading ratio of 0.05, the
defaults here, and no damage or that of `GEM_DAMAGE`. Forces and drifts are alike both ways. Use is the energy spent
over the energy under the backbone times the energy factor, or the number of cycles.

An exponent of 0, which GEM's toolkit gives for all damage, makes damage a switch: whatever is not 0, to the power of 0,
is 1, so that the first drift beyond the backbone's first part, or the first energy spent, does all of it at once, and
the last digit decides when. Single records then come out up to 40 % apart in float32, in float64 and in OpenSees at two
steps; a warning says so, and shares of many records still hold. Exponents of 1 make damage grow.

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

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.backbone import backbone_problem, corners, ductility, falls, force_ratio
from warpdyn.engine.laws.bounds import first_bad, first_place, place_of
from warpdyn.engine.laws.law import YIELD_FORCE, Law, Layout, Values, parameter, shared
from warpdyn.engine.laws.parameter import Parameter

NEVER = 1e16  # yield drifts
DAMAGE = {
    "stiffness": "loss of unloading stiffness",
    "reloading": "growth of the drift aimed at",
    "strength": "loss of strength",
}
#: The damage that GEM's vulnerability toolkit gives Pinching4, by parameter: `Pinching4(..., **GEM_DAMAGE)`.
GEM_DAMAGE = {
    "stiffness_damage_by_use": 0.1,
    "stiffness_damage_drift_exponent": 0.0,
    "stiffness_damage_use_exponent": 0.0,
    "stiffness_damage_limit": 0.2,
    "reloading_damage_by_use": 0.1,
    "reloading_damage_drift_exponent": 0.0,
    "reloading_damage_use_exponent": 0.0,
    "reloading_damage_limit": 0.2,
    "strength_damage_by_use": 0.4,
    "strength_damage_drift_exponent": 0.0,
    "strength_damage_use_exponent": 0.4,
    "strength_damage_limit": 0.9,
}
_BY_DRIFT = {
    kind: Parameter("1", f"{name} at the last drift of the backbone", low=0.0) for kind, name in DAMAGE.items()
}
_BY_USE = {kind: Parameter("1", f"{name} by all energy, or a cycle", low=0.0) for kind, name in DAMAGE.items()}
_DRIFT_EXPONENT = {kind: Parameter("1", f"power of drift in {name}", low=0.0) for kind, name in DAMAGE.items()}
_USE_EXPONENT = {kind: Parameter("1", f"power of energy or cycles in {name}", low=0.0) for kind, name in DAMAGE.items()}
_LIMIT = {
    kind: Parameter(
        "1", f"largest {name}", low=0.0, high=np.inf if kind == "reloading" else 1.0, high_open=kind != "reloading"
    )
    for kind, name in DAMAGE.items()
}


class Coefficient(Layout):
    """What the device functions read, in yield drifts and yield forces; with damage all, else the first twelve."""

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    SECOND_LENGTH = enum.auto()  # of the backbone's second part
    THIRD_LENGTH = enum.auto()
    FOURTH_LENGTH = enum.auto()
    SECOND_SLOPE = enum.auto()
    THIRD_SLOPE = enum.auto()
    FOURTH_SLOPE = enum.auto()
    RELOADING_DRIFT = enum.auto()
    RELOADING_FORCE = enum.auto()
    UNLOADED_FORCE = enum.auto()  # of peaks up to the third corner
    UNLOADED_FORCE_BEYOND = enum.auto()  # of peaks beyond it
    STIFFNESS_DAMAGE_LIMIT = enum.auto()
    STIFFNESS_DAMAGE_BY_DRIFT = enum.auto()
    STIFFNESS_DAMAGE_BY_USE = enum.auto()
    STIFFNESS_DAMAGE_DRIFT_EXPONENT = enum.auto()
    STIFFNESS_DAMAGE_USE_EXPONENT = enum.auto()
    RELOADING_DAMAGE_LIMIT = enum.auto()
    RELOADING_DAMAGE_BY_DRIFT = enum.auto()
    RELOADING_DAMAGE_BY_USE = enum.auto()
    RELOADING_DAMAGE_DRIFT_EXPONENT = enum.auto()
    RELOADING_DAMAGE_USE_EXPONENT = enum.auto()
    STRENGTH_DAMAGE_LIMIT = enum.auto()
    STRENGTH_DAMAGE_BY_DRIFT = enum.auto()
    STRENGTH_DAMAGE_BY_USE = enum.auto()
    STRENGTH_DAMAGE_DRIFT_EXPONENT = enum.auto()
    STRENGTH_DAMAGE_USE_EXPONENT = enum.auto()
    INVERSE_LAST_DUCTILITY = enum.auto()
    INVERSE_ENERGY = enum.auto()  # of what may be spent


class Pinching4(Law):
    """A four-point storey with pinching and damage (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

    `warpdyn.engine.laws.pinching4.parameters` says where OpenSees differs. The defaults are those of GEM's
    vulnerability toolkit, without damage. Exponents of 0, as GEM's, make damage a switch that rounding throws: a
    warning says so.

    Example:
        >>> law = wd.laws.Pinching4(
        ...     yield_force=1e6,
        ...     ductility_2=3,
        ...     force_ratio_2=1.3,
        ...     ductility_3=6,
        ...     force_ratio_3=1.4,
        ...     ductility_4=12,
        ...     force_ratio_4=0.4,
        ... )
        >>> law.reloading_drift, law.reloading_force, law.unloading_force
        (0.5, 0.25, 0.05)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE, opensees="ePf1")
    ductility_2: ArrayLike = shared(ductility(2), opensees="ePd2 over ePd1")
    force_ratio_2: ArrayLike = shared(force_ratio(2), opensees="ePf2 over ePf1")
    ductility_3: ArrayLike = shared(ductility(3), opensees="ePd3 over ePd1")
    force_ratio_3: ArrayLike = shared(force_ratio(3), opensees="ePf3 over ePf1")
    ductility_4: ArrayLike = shared(ductility(4), opensees="ePd4 over ePd1")
    force_ratio_4: ArrayLike = shared(force_ratio(4), opensees="ePf4 over ePf1")
    reloading_drift: ArrayLike = parameter(
        "1",
        "drift where reloading stiffens over that aimed at",
        low=0.0,
        high=1.0,
        high_open=True,
        default=0.5,
        opensees="rDispP",
    )
    reloading_force: ArrayLike = parameter(
        "1", "force where reloading stiffens over that aimed at", low=0.0, high=1.0, default=0.25, opensees="rForceP"
    )
    unloading_force: ArrayLike = parameter(
        "1",
        "force unloaded to over that at the third corner, or fourth",
        low=-1.0,
        high=1.0,
        default=0.05,
        opensees="uForceP",
    )
    stiffness_damage_by_drift: ArrayLike = shared(_BY_DRIFT["stiffness"], default=0.0, opensees="gK1")
    stiffness_damage_by_use: ArrayLike = shared(_BY_USE["stiffness"], default=0.0, opensees="gK2")
    stiffness_damage_drift_exponent: ArrayLike = shared(_DRIFT_EXPONENT["stiffness"], default=1.0, opensees="gK3")
    stiffness_damage_use_exponent: ArrayLike = shared(_USE_EXPONENT["stiffness"], default=1.0, opensees="gK4")
    stiffness_damage_limit: ArrayLike = shared(_LIMIT["stiffness"], default=0.0, opensees="gKLim")
    reloading_damage_by_drift: ArrayLike = shared(_BY_DRIFT["reloading"], default=0.0, opensees="gD1")
    reloading_damage_by_use: ArrayLike = shared(_BY_USE["reloading"], default=0.0, opensees="gD2")
    reloading_damage_drift_exponent: ArrayLike = shared(_DRIFT_EXPONENT["reloading"], default=1.0, opensees="gD3")
    reloading_damage_use_exponent: ArrayLike = shared(_USE_EXPONENT["reloading"], default=1.0, opensees="gD4")
    reloading_damage_limit: ArrayLike = shared(_LIMIT["reloading"], default=0.0, opensees="gDLim")
    strength_damage_by_drift: ArrayLike = shared(_BY_DRIFT["strength"], default=0.0, opensees="gF1")
    strength_damage_by_use: ArrayLike = shared(_BY_USE["strength"], default=0.0, opensees="gF2")
    strength_damage_drift_exponent: ArrayLike = shared(_DRIFT_EXPONENT["strength"], default=1.0, opensees="gF3")
    strength_damage_use_exponent: ArrayLike = shared(_USE_EXPONENT["strength"], default=1.0, opensees="gF4")
    strength_damage_limit: ArrayLike = shared(_LIMIT["strength"], default=0.0, opensees="gFLim")
    energy_factor: ArrayLike = parameter(
        "1",
        "energy that can be spent over that under the backbone",
        low=0.0,
        low_open=True,
        default=10.0,
        opensees="gE",
    )
    counts_cycles: ArrayLike = parameter(
        "1", "whether damage goes by cycles (1) or energy (0)", low=0, high=1, default=0.0, opensees="dmgType"
    )

    opensees = ("Pinching4",)
    rows = {
        "pinching4": Coefficient.names(Coefficient.STIFFNESS_DAMAGE_LIMIT),
        "pinching4_energy_damage": Coefficient.names(),
        "pinching4_cycle_damage": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        if not any(np.any(p[f"{kind}_damage_limit"] > 0) for kind in DAMAGE):
            return "pinching4"
        return f"pinching4_{'cycle' if np.any(p['counts_cycles'] > 0) else 'energy'}_damage"

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Damage takes effect at reversals, and where it goes by cycles, each reversal is a part of one."""
        return cls.spring(p) != "pinching4"

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        return cls.counts_reversals(p) or falls(p, 4)

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        drift, force = corners(p, 4)
        length, rise = (np.diff(values, axis=0) for values in (drift, force))
        slope = rise / length
        values = {
            "inverse_yield_drift": p["stiffness"] / p["yield_force"],
            "yield_force": p["yield_force"],
            "second_length": length[0],
            "third_length": length[1],
            "fourth_length": np.where(slope[2] > 0, NEVER, length[2]),
            "second_slope": slope[0],
            "third_slope": slope[1],
            "fourth_slope": slope[2],
            "reloading_drift": p["reloading_drift"],
            "reloading_force": p["reloading_force"],
            "unloaded_force": p["unloading_force"] * force[2],
            "unloaded_force_beyond": p["unloading_force"] * force[3],
        }
        if row == "pinching4":
            return values
        energy = 0.5 + sum(
            (f + g) / 2 * (e - d) for d, e, f, g in zip(drift, drift[1:], force, force[1:], strict=False)
        )
        damage = {name: p[name] for name in Coefficient.names() if "_damage_" in name}
        inverse = {"inverse_last_ductility": 1 / drift[3], "inverse_energy": 1 / (p["energy_factor"] * energy)}
        return values | damage | inverse

    @staticmethod
    def problem(p: Values) -> str | None:
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

    @staticmethod
    def caution(p: Values) -> str | None:
        switches = []
        for kind in DAMAGE:
            for by in ("drift", "use"):
                name = f"{kind}_damage_{by}_exponent"
                acts = (p[f"{kind}_damage_by_{by}"] > 0) & (p[f"{kind}_damage_limit"] > 0)
                if np.any(acts & (p[name] == 0)):
                    switches.append(name)
        if not switches:
            return None
        return (
            f"{', '.join(switches)} of 0 make{'s' * (len(switches) == 1)} Pinching4's damage a switch that rounding "
            "throws: single records may be off by tens of percent, with any step and in OpenSees too, though shares of "
            "many records hold; an exponent of 1 makes damage grow"
        )


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
