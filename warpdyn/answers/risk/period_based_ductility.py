"""Period-based ductility of a building by FEMA P-695, from its pushover curve."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from warpdyn.answers.fragility.curve_variables import variable
from warpdyn.foundations.core.checks import check_dataset, check_kind, finite_numbers, real_number
from warpdyn.foundations.core.description import to_json
from warpdyn.foundations.core.near_misses import suggests_names
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.shear_building import ShearBuilding

SOURCE = "FEMA P-695 (2009), equations 6-6 to 6-8"
FIRST_MODE = "first_mode"  # the pattern of the pushover
LONGEST_PERIOD = 100.0  # s
REMAINING = 0.8  # share of the largest base shear at the ultimate displacement (a loss of strength of 20 %)


@suggests_names
def period_based_ductility(building: ShearBuilding, pushed: xr.Dataset, *, period: float | None = None) -> xr.Dataset:
    """Return the period-based ductility mu_T of FEMA P-695, which `collapse_margin` and `spectral_shape_factor` take.

    mu_T is the ultimate roof displacement divided by the effective yield displacement (equation 6-6). The ultimate roof
    displacement is that at which the base shear has fallen to 80 % of its largest value. The effective yield
    displacement is C0 (V_max / W) (g / 4 pi^2) max(T, T1)^2 (equation 6-7), with the weight W of all floors, the first
    period T1 of the building, and C0 = phi_roof sum(m phi) / sum(m phi^2) of the first mode phi (equation 6-8).

    If the pushover ended before this point because no equilibrium exists at larger roof displacements (snap-back, see
    `pushover`), its last roof displacement is the ultimate one, and the attribute `ultimate_displacement_from` reports
    this.

    Args:
        building: The building.
        pushed: Its pushover curve: the result of `pushover(building, roof_displacement)` with one monotonic push and
            the pattern "first_mode".
        period: Period T of the code [s], C_u T_a of ASCE 7; None: the first period of the building.

    Returns:
        `period_based_ductility` [1], `ultimate_roof_displacement` and `effective_yield_displacement` [m],
        `peak_base_shear` [N], `weight` [N], `roof_coefficient` C0 [1] and `first_period` [s].

    Raises:
        ValueError: If the base shear has not fallen to 80 % of its largest value at the end of the given path, the roof
            displacement decreases, the base shear is never above 0 or not finite, `pushed` is the curve of another
            building or has another pattern, the building has isolators or a tuned mass damper, or `period` is out of
            its range.
        TypeError: If `building` is not a ShearBuilding or `pushed` is not a Dataset.

    Example:
        >>> falling = dict(plastic_drift_to_capping=0.04, post_capping_drift=0.2, capping_force_ratio=1.1)
        >>> law = wd.laws.IbarraMedinaKrawinklerBilinear(yield_force=5e5, **falling)
        >>> frame = wd.ShearBuilding(mass=1e5, stiffness=[4e7, 4e7], height=3.0, law=law)
        >>> pushed = wd.pushover(frame, np.linspace(0.0, 0.15, 151))
        >>> float(wd.period_based_ductility(frame, pushed)["period_based_ductility"].round(1))
        4.7
    """
    check_kind("period_based_ductility", "a ShearBuilding", building, ShearBuilding, argument="building")
    if not building.own_storeys.all():
        raise ValueError(
            "period_based_ductility: the building has isolators or a tuned mass damper, whose mass and displacement "
            "are not those of floors in FEMA P-695: give the building without them, and its pushover"
        )
    advice = "give the result of pushover(building, roof_displacement)"
    check_dataset("period_based_ductility", pushed, "roof_displacement", "base_shear", advice=advice, argument="pushed")
    first = building.modal().isel(mode=0)
    first_period = float(first["period"])
    longest = first_period if period is None else max(first_period, real_number("period [s]", period, above=0))
    if longest > LONGEST_PERIOD:
        raise ValueError(f"period [s] must be at most {LONGEST_PERIOD:g}, got {longest:g}")
    shape, mass = first["shape"].values, building.parameters["mass"]
    coefficient = float(shape[-1] * (mass @ shape) / (mass @ shape**2))
    if pushed.attrs.get("building", to_json(building)) != to_json(building):
        raise ValueError(
            "period_based_ductility: pushed is the pushover of another building: give pushover(building, ...)"
        )
    pattern = pushed.attrs.get("pattern", FIRST_MODE)
    if pattern != FIRST_MODE:
        raise ValueError(
            f"period_based_ductility: the loads of the pushover have the pattern {pattern!r}, but the coefficient C0 "
            f"is that of the first mode: call pushover(building, roof_displacement, pattern={FIRST_MODE!r})"
        )
    displacement, shear = (finite_numbers(name, pushed[name].values) for name in ("roof_displacement", "base_shear"))
    peak, ultimate, how = _ultimate(displacement, shear, str(pushed.attrs.get("stopped_because", "")))
    weight = STANDARD_GRAVITY * float(mass.sum())
    effective = coefficient * peak / weight * STANDARD_GRAVITY / (4 * np.pi**2) * longest**2
    variables: dict[str, Any] = {
        "period_based_ductility": variable((), ultimate / effective, "period-based ductility"),
        "ultimate_roof_displacement": variable((), ultimate, "ultimate roof displacement", units="m"),
        "effective_yield_displacement": variable((), effective, "effective yield roof displacement", units="m"),
        "peak_base_shear": variable((), peak, "largest base shear of the pushover", units="N"),
        "weight": variable((), weight, "weight of all floors", units="N"),
        "roof_coefficient": variable((), coefficient, "coefficient C0 of the first mode"),
        "first_period": variable((), first_period, "first period of the building", units="s"),
    }
    return xr.Dataset(variables, attrs={"source": SOURCE, "ultimate_displacement_from": how})


def _ultimate(displacement: np.ndarray, shear: np.ndarray, stopped: str) -> tuple[float, float, str]:
    """Return the largest base shear [N], the ultimate roof displacement [m], and from what the latter was read."""
    if np.any(np.diff(displacement) < 0):
        raise ValueError(
            "period_based_ductility: the roof displacement of the pushover decreases: push the building monotonically, "
            "pushover(building, np.linspace(0.0, largest, 400))"
        )
    place = int(shear.argmax())
    peak = float(shear[place])
    if not peak > 0:
        raise ValueError(
            f"period_based_ductility: the largest base shear of the pushover is {peak:g} N, so the building carries no "
            "lateral load: reduce gravity_load, or push it to positive roof displacements"
        )
    below = np.flatnonzero(shear[place:] <= REMAINING * peak)
    if below.size:
        after = place + int(below[0])
        between = [after, after - 1]  # the base shear increases from the first to the second
        ultimate = float(np.interp(REMAINING * peak, shear[between], displacement[between]))
        return peak, ultimate, f"{REMAINING:.0%} of the largest base shear"
    if stopped:
        return peak, float(displacement[-1]), "end of the curve, beyond which no equilibrium exists (snap-back)"
    raise ValueError(
        f"period_based_ductility: at the last roof displacement, {displacement[-1]:g} m, the base shear is still "
        f"{shear[-1] / peak:.0%} of its largest value: push the building until it falls below {REMAINING:.0%}; "
        "if the storey law does not lose strength, choose one that does, such as wd.laws.IbarraMedinaKrawinklerBilinear"
    )
