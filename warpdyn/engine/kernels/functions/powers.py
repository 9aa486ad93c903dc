"""Energies as integrals of power over time: trapezoidal rule with end corrections, of order 4.

The integral of f over a step h is h (f0 + f1) / 2 + h^2 (f0' - f1') / 12 (Davis and Rabinowitz, Methods of Numerical
Integration, 2.9). The state between two steps contributes to both steps; a load may jump at this state. The formulas
are for one mode with unit mass: q'' + damping q' + stiffness q = load.
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
    """Return the contribution of one state to the energy per modal mass [J/kg] that a load supplies.

    The power of the load is load * q'.

    Args:
        behind: Length of the step before this state [s].
        ahead: Length of the step after this state [s].
        load_behind: The load at this state at the end of the step before.
        load_ahead: The load at this state at the start of the step after.
        rise_behind: Rate of change of the load in the step before, times the length of this step.
        rise_ahead: Rate of change of the load in the step after, times the length of this step.
        speed: q', the modal velocity.
        inner: -damping q' - stiffness q, the modal acceleration without the load.
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
    """Return the contribution of one state to the energy per modal mass [J/kg] that dampers dissipate.

    The power of the dampers is q' times their force. The other arguments are those of `supplied_share`.

    Args:
        resisting: The force of the dampers: damping q'; for coupled modes, the sum over all modes.
    """
    half = type(speed)(0.5)
    slope = ahead * ahead * (inner + load_ahead) - behind * behind * (inner + load_behind)
    return resisting * (half * (ahead + behind) * speed + slope / type(speed)(6.0))
