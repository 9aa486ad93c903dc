"""What powers add up to over time, known at steps' ends alone: the trapezoidal rule with end corrections, of order 4.

The integral over a step h is h (f0 + f1) / 2 + h^2 (f0' - f1') / 12 (Davis and Rabinowitz, Methods of Numerical
Integration, 2.9). Each state gives its share of the step behind it and of the step ahead; a load may jump between them.
All is of one mode and unit mass: q'' + damping q' + stiffness q = load.
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
        load_behind: The load at this state, as the step behind has it.
        load_ahead: The same as the step ahead has it.
        rise_behind: What the load gains over the step behind at its rate at this state.
        rise_ahead: The same over the step ahead.
        speed: q'.
        inner: -damping q' - stiffness q: the acceleration but for the load.
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
    """Return a state's share of what dampers take, whose power is q' times their force; arguments as above.

    Args:
        resisting: The dampers' force: damping q', with modes that couple its sum over all of them.
    """
    half = type(speed)(0.5)
    slope = ahead * ahead * (inner + load_ahead) - behind * behind * (inner + load_behind)
    return resisting * (half * (ahead + behind) * speed + slope / type(speed)(6.0))
