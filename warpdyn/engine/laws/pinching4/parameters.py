"""Four-point storeys with pinching and damage (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

The defaults are those of GEM's vulnerability toolkit: reloading ratios of 0.5 and 0.25, an unloading ratio of 0.05, and
no damage; `GEM_DAMAGE` contains the damage parameters of the toolkit. The negative side has the parameters of the
positive side, except for the parameters whose names end in `_negative`; the initial stiffness is the same. Damage
depends on the largest ductility and on either the number of cycles, or the dissipated energy divided by the energy
capacity (the energy factor times the energy under the larger backbone).

GEM's toolkit has exponents of 0 for all damage. Such damage is a switch, because every number except 0 to the power of
0 is 1: all damage occurs at once, at the first drift beyond the first segment of the backbone or with the first
dissipated energy, and rounding decides when. Results of single records differ by up to 40 % between float32, float64
and OpenSees with two different steps; fractions of many records are reliable. A warning reports this. With exponents of
1, damage grows gradually.

Differences from OpenSees:

- A horizontal segment of the backbone stays horizontal. OpenSees continues the line of the next segment that is not
  horizontal.
- Beyond its last corner a backbone that does not rise is horizontal. In OpenSees its slope there is 1e-7 times the
  force over the drift of the last corner.
- The unloading ratio must be below the reloading ratio. Otherwise OpenSees reloads to the force of the last corner.
- No segment of a path is stiffer than the first segment of the backbone. In OpenSees paths from small turns can be
  stiffer.
- The unloading ratio has a lower bound. Without it, cycles to a peak with a force below that of the corner would
  generate energy.
- A turn takes effect at once. OpenSees uses the old loss of stiffness and strength in part for one more step.
- A storey that has lost its force stays without force. OpenSees divides 0 by 0 there, and if `reloading_drift` is 1.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.backbone import (
    backbone_problem,
    corners,
    ductility,
    falls,
    force_ratio,
    has_negative_side,
    named_as_negative,
    negative_side,
)
from warpdyn.engine.laws.bounds import first_bad, first_place, place_of
from warpdyn.engine.laws.law import YIELD_FORCE, Law, Layout, Values, negative, parameter, shared
from warpdyn.engine.laws.parameter import Parameter

NEVER = 1e16  # yield drifts
DAMAGE = {
    "stiffness": "loss of unloading stiffness",
    "reloading": "growth of the reloading target drift",
    "strength": "loss of strength",
}
#: Damage parameters of Pinching4 in GEM's vulnerability toolkit, by name: `Pinching4(..., **GEM_DAMAGE)`.
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
_BY_USE = {
    kind: Parameter("1", f"{name} at exhausted energy capacity, or per cycle", low=0.0) for kind, name in DAMAGE.items()
}
_DRIFT_EXPONENT = {kind: Parameter("1", f"power of drift in {name}", low=0.0) for kind, name in DAMAGE.items()}
_USE_EXPONENT = {kind: Parameter("1", f"power of energy or cycles in {name}", low=0.0) for kind, name in DAMAGE.items()}
_LIMIT = {
    kind: Parameter(
        "1", f"largest {name}", low=0.0, high=np.inf if kind == "reloading" else 1.0, high_open=kind != "reloading"
    )
    for kind, name in DAMAGE.items()
}


class Negative(Layout):
    """Coefficients of the negative side, in units of yield drift and yield force of the positive side.

    If the sides of a storey differ, its other coefficients come first, then these.
    """

    YIELD_FORCE = enum.auto()
    SECOND_LENGTH = enum.auto()
    THIRD_LENGTH = enum.auto()
    FOURTH_LENGTH = enum.auto()
    SECOND_SLOPE = enum.auto()
    THIRD_SLOPE = enum.auto()
    FOURTH_SLOPE = enum.auto()
    RELOADING_DRIFT = enum.auto()
    RELOADING_FORCE = enum.auto()
    UNLOADED_FORCE = enum.auto()
    UNLOADED_FORCE_BEYOND = enum.auto()


class Coefficient(Layout):
    """Coefficients of the device functions, in units of yield drift and yield force of the positive side.

    Storeys without damage need only the first twelve coefficients.
    """

    INVERSE_YIELD_DRIFT = enum.auto()
    YIELD_FORCE = enum.auto()
    SECOND_LENGTH = enum.auto()  # length of the second segment of the backbone
    THIRD_LENGTH = enum.auto()
    FOURTH_LENGTH = enum.auto()
    SECOND_SLOPE = enum.auto()
    THIRD_SLOPE = enum.auto()
    FOURTH_SLOPE = enum.auto()
    RELOADING_DRIFT = enum.auto()
    RELOADING_FORCE = enum.auto()
    UNLOADED_FORCE = enum.auto()  # force at the end of unloading, for peaks up to the third corner
    UNLOADED_FORCE_BEYOND = enum.auto()  # force at the end of unloading, for peaks beyond the third corner
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
    INVERSE_ENERGY = enum.auto()  # 1 / energy capacity


_NEGATIVE = tuple(f"{name}_negative" for name in Negative.names())
RELOADING_DRIFT = Parameter(
    "1", "drift at which reloading stiffens over the target drift", low=0.0, high=1.0, high_open=True, opensees="rDispP"
)
RELOADING_FORCE = Parameter(
    "1", "force at which reloading stiffens over the target force", low=0.0, high=1.0, opensees="rForceP"
)
UNLOADING_FORCE = Parameter(
    "1",
    "force at the end of unloading over the force at the third or fourth corner",
    low=-1.0,
    high=1.0,
    opensees="uForceP",
)


def _has_damage(p: Values) -> bool:
    """Return whether any storey has damage: whether a damage limit is above 0."""
    return any(np.any(p[f"{kind}_damage_limit"] > 0) for kind in DAMAGE)


class Pinching4(Law):
    """A four-point storey with pinching and damage (Lowes, Mitra and Altoontash 2003; OpenSees: Pinching4).

    The docstring of the module `pinching4.parameters` lists the rules and the differences from OpenSees. The defaults
    are those of GEM's vulnerability toolkit, without damage. If damage exponents are 0, as in GEM's toolkit, damage
    occurs suddenly, and a warning reports this.

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
    reloading_drift: ArrayLike = shared(RELOADING_DRIFT, default=0.5)
    reloading_force: ArrayLike = shared(RELOADING_FORCE, default=0.25)
    unloading_force: ArrayLike = shared(UNLOADING_FORCE, default=0.05)
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
        "energy capacity over the energy under the backbone",
        low=0.0,
        low_open=True,
        default=10.0,
        opensees="gE",
    )
    counts_cycles: ArrayLike = parameter(
        "1", "whether damage depends on cycles (1) or energy (0)", low=0, high=1, default=0.0, opensees="dmgType"
    )

    yield_force_negative: ArrayLike = negative(YIELD_FORCE, "yield_force", opensees="eNf1")
    ductility_2_negative: ArrayLike = negative(ductility(2), "ductility_2", opensees="eNd2 over eNd1")
    force_ratio_2_negative: ArrayLike = negative(force_ratio(2), "force_ratio_2", opensees="eNf2 over eNf1")
    ductility_3_negative: ArrayLike = negative(ductility(3), "ductility_3", opensees="eNd3 over eNd1")
    force_ratio_3_negative: ArrayLike = negative(force_ratio(3), "force_ratio_3", opensees="eNf3 over eNf1")
    ductility_4_negative: ArrayLike = negative(ductility(4), "ductility_4", opensees="eNd4 over eNd1")
    force_ratio_4_negative: ArrayLike = negative(force_ratio(4), "force_ratio_4", opensees="eNf4 over eNf1")
    reloading_drift_negative: ArrayLike = negative(RELOADING_DRIFT, "reloading_drift", opensees="rDispN")
    reloading_force_negative: ArrayLike = negative(RELOADING_FORCE, "reloading_force", opensees="rForceN")
    unloading_force_negative: ArrayLike = negative(UNLOADING_FORCE, "unloading_force", opensees="uForceN")

    opensees = ("Pinching4",)
    corners = 4
    rows = {
        "pinching4": Coefficient.names(Coefficient.STIFFNESS_DAMAGE_LIMIT),
        "pinching4_energy_damage": Coefficient.names(),
        "pinching4_cycle_damage": Coefficient.names(),
        "pinching4_asymmetric": Coefficient.names(Coefficient.STIFFNESS_DAMAGE_LIMIT) + _NEGATIVE,
        "pinching4_energy_damage_asymmetric": Coefficient.names() + _NEGATIVE,
        "pinching4_cycle_damage_asymmetric": Coefficient.names() + _NEGATIVE,
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        side = "_asymmetric" * has_negative_side(p)
        if not _has_damage(p):
            return f"pinching4{side}"
        return f"pinching4_{'cycle' if np.any(p['counts_cycles'] > 0) else 'energy'}_damage{side}"

    @classmethod
    def counts_reversals(cls, p: Values) -> bool:
        """Return whether the storeys have damage: it increases at each reversal of the drift."""
        return _has_damage(p)

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        return cls.counts_reversals(p) or falls(p, 4) or falls(negative_side(p), 4)

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        side, energy, last = _side(p)
        values = {
            "inverse_yield_drift": p["stiffness"] / p["yield_force"],
            "yield_force": p["yield_force"],
            **side,
            "reloading_drift": p["reloading_drift"],
            "reloading_force": p["reloading_force"],
        }
        of_negative: dict[str, np.ndarray] = {}
        if row.endswith("_asymmetric"):
            below = negative_side(p)
            force = below["yield_force"] / p["yield_force"]
            other, energy_below, last_below = _side(below)
            # The initial stiffness is the same, so yield drift and yield force of this side have the same ratio to the
            # positive side.
            of_negative = {
                name: np.minimum(value * force, NEVER) if not name.endswith("_slope") else value
                for name, value in other.items()
            }
            of_negative |= {"yield_force": force, "reloading_drift": below["reloading_drift"]}
            of_negative |= {"reloading_force": below["reloading_force"]}
            energy = np.maximum(energy, energy_below * force**2)
            last = np.maximum(last, last_below * force)
        if "damage" in row:
            values |= {name: p[name] for name in Coefficient.names() if "_damage_" in name}
            values |= {"inverse_last_ductility": 1 / last, "inverse_energy": 1 / (p["energy_factor"] * energy)}
        return values | {f"{name}_negative": value for name, value in of_negative.items()}

    @staticmethod
    def problem(p: Values) -> str | None:
        if problem := _side_problem(p) or named_as_negative(_side_problem(negative_side(p)), p):
            return problem
        for kind in DAMAGE:
            for name in ("by_drift", "by_use"):
                factor, limit = np.broadcast_arrays(p[f"{kind}_damage_{name}"], p[f"{kind}_damage_limit"])
                if np.any(bad := (factor > 0) & (limit == 0)):
                    return (
                        f"{kind}_damage_{name} is {factor[first_place(bad)]:g} where {kind}_damage_limit is 0 "
                        f"({place_of(first_place(bad))}), so it has no effect: give a limit above 0"
                    )
        counts = p["counts_cycles"]
        if np.any(bad := ~np.isin(counts, (0, 1))) or np.any(bad := counts != np.ravel(counts)[0]):
            value, where = counts[first_place(bad)], place_of(first_place(bad))
            return f"counts_cycles is {value:g} ({where}); give 0 in all storeys or 1 in all storeys"
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
        zero, one = (" and ".join(f"{name}={value}" for name in switches) for value in (0, 1))
        return (
            f"with {zero}, Pinching4's damage starts with a jump, and rounding decides when: drifts of single records "
            "may be off by tens of percent, with any step and in OpenSees too. Use fractions of many records, or give "
            f"{one}, with which damage grows gradually"
        )


def _side(p: Values) -> tuple[dict[str, np.ndarray], np.ndarray, np.ndarray]:
    """Return the coefficients of one side {name: array}, the energy under its backbone, and its last drift.

    Drifts and forces are divided by the yield drift and yield force of this side; the last drift is that of the last
    corner of the backbone.
    """
    drift, force = corners(p, 4)
    length, rise = (np.diff(np.stack(values), axis=0) for values in (drift, force))
    slope = rise / length
    values = {
        "second_length": length[0],
        "third_length": length[1],
        "fourth_length": np.where(slope[2] > 0, NEVER, length[2]),
        "second_slope": slope[0],
        "third_slope": slope[1],
        "fourth_slope": slope[2],
        "unloaded_force": p["unloading_force"] * force[2],
        "unloaded_force_beyond": p["unloading_force"] * force[3],
    }
    energy = 0.5 + sum((f + g) / 2 * (e - d) for d, e, f, g in zip(drift, drift[1:], force, force[1:], strict=False))
    return values, energy, drift[3]


def _side_problem(p: Values) -> str | None:
    """Return a sentence about parameters of one side that contradict each other, or None."""
    if problem := backbone_problem(p, 4) or _unloading_problem(p):
        return problem
    reloading, unloading = np.broadcast_arrays(p["reloading_force"], p["unloading_force"])
    if np.any(bad := unloading >= reloading):
        place = first_place(bad)
        return (
            f"unloading_force is {unloading[place]:g} ({place_of(place)}); it must be below reloading_force, "
            f"{reloading[place]:g}"
        )
    return None


def _unloading_problem(p: Values) -> str | None:
    """Return a sentence about an unloading force that is so low that cycles would generate energy, or None.

    Consider a cycle between -x and x, in yield drifts, with the backbone force f at x. If the storey reloads with the
    unloading stiffness, it dissipates 2 (u + r f) (x - f); u is the force at which unloading ends and r the ratio of
    the reloading force to f. Cycles that reload more softly dissipate more.
    """
    _, (first, second, third, fourth) = corners(p, 4)
    ratio = np.ones_like(first)
    for weakest, corner in ((np.minimum(np.minimum(first, second), third), third), (np.minimum(third, fourth), fourth)):
        ratio = np.minimum(ratio, np.divide(weakest, corner, out=np.ones_like(ratio), where=corner > 0))
    least = -p["reloading_force"] * ratio
    bad = p["unloading_force"] < least * (1 + 1e-9)
    reason = "or cycles would generate energy (-reloading_force times the least ratio of a peak's to a corner's force)"
    return first_bad(bad, "unloading_force", p["unloading_force"], "at least", least, reason)
