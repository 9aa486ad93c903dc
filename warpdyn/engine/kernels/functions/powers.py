"""Energies as integrals of power over time: trapezoidal rule with end corrections, of order 4.

The integral of f over a step h is h (f0 + f1) / 2 + h^2 (f0' - f1') / 12 (Davis and Rabinowitz, Methods of Numerical
Integration, 2.9). Each state contributes to the step before it and to the step after it; a load may jump between them.
The formulas are for one mode with unit mass: q'' + damping q' + stiffness q = load.
"""

from typing import Any

import warp as wp


@wp.func
def supplied_share(
    behind: Any,
    ahead: Any,
    load_behind: Any,
    load_ahead: Any,
    rise_behind: Any,
    rise_ahead: Any,
    speed: Any,
    inner: Any,
):
    """Return a state's share of the work of a load, whose power is load q'.

    Args:
        behind: The step behind [s].
        ahead: The step ahead [s].
        load_behind: The load at this state at the end of the step behind.
        load_ahead: The load at this state at the start of the step ahead.
        rise_behind: Rate of the load at this state times the step behind.
        rise_ahead: Rate of the load at this state times the step ahead.
        speed: q'.
        inner: -damping q' - stiffness q: the acceleration without the load.
    """
    half = type(speed)(0.5)
    twelve = type(speed)(12.0)
    level = half * (ahead * load_ahead + behind * load_behind)
    bend = (ahead * rise_ahead - behind * rise_behind) / twelve
    kink = (ahead * ahead * load_ahead - behind * behind * load_behind) / twelve
    jump = (ahead * ahead * load_ahead * load_ahead - behind * behind * load_behind * load_behind) / twelve
    return speed * (level + bend) + inner * kink + jump


@wp.func
def lost_share(behind: Any, ahead: Any, load_behind: Any, load_ahead: Any, speed: Any, inner: Any, resisting: Any):
    """Return a state's share of the energy of dampers, with the power q' times their force; arguments as above.

    Args:
        resisting: The dampers' force: damping q'; for coupled modes the sum over all modes.
    """
    half = type(speed)(0.5)
    slope = ahead * ahead * (inner + load_ahead) - behind * behind * (inner + load_behind)
    return resisting * (half * (ahead + behind) * speed + slope / type(speed)(6.0))
