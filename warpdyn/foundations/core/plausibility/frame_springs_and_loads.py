"""Plausibility checks of gravity loads, springs, supports and offsets of plane frames; part of the table of checks."""

from __future__ import annotations

import math
from collections.abc import Mapping

from warpdyn.foundations.core.plausibility.check import LENGTH, Check, given_in, with_units

_KN, _KN_M = {"kN": 1e3, "MN": 1e6}, {"kN m/rad": 1e3, "MN m/rad": 1e6}

CHECKS_OF_SPRINGS_AND_LOADS: Mapping[str, Check] = {
    # Joints, panels and walls have up to about 0.6 between two nodes; eccentric members may have more.
    "frame_offset": Check(
        *("rigid end offset over the distance of the nodes of the member", "1", 0.0, 1.0),
        with_units("offsets", LENGTH)
        | {"the offsets of both ends may exceed the length of the member, or have a wrong sign": lambda v: v < 10},
        typical=0.05,
    ),
    # Leaning columns carry what the frame does not carry, mostly 50 to 99 % of the weight of the masses.
    "leaning_gravity_load": Check(
        "gravity loads of leaning columns over the weight of the masses that the other members do not carry,",
        *("1", 0.01, math.inf),
        with_units("gravity_load of leaning columns", _KN),
        typical=1.0,
    ),
    # Joints of a perimeter frame have 1 to 10 % of the load of a leaning column.
    "gravity_over_leaning": Check(
        *("gravity loads of joints and beams over those of leaning columns", "1", 1e-3, math.inf),
        with_units("gravity_load of joints or beams", {"kN or kN/m": 1e3, "MN or MN/m": 1e6}),
        typical=0.1,
    ),
    # A light steel member has a weight of 60 N/m.
    "member_gravity_load": Check(
        *("median gravity_load of the members", "N/m", 50.0, math.inf),
        given_in({"kN/m": 1e3, "t/m": 9806.65}),
        typical=2e4,
    ),
    # Only frames without masses are checked. The joints of a light roof carry 1 kN.
    "node_gravity_load": Check(
        *("largest gravity_load of a node", "N", 100.0, math.inf),
        given_in({"kN": 1e3, "tonnes": 9806.65}),
        typical=3e4,
    ),
    # Semi-rigid connections and hinges have 0.1 or more; nominally pinned ones, which have less, are not checked if
    # other ends are stiffer. There is no upper bound, because stiff springs are rigid on purpose.
    "end_spring": Check(
        *("rotational spring over 6 E I / L of the member", "1", 0.015, math.inf),
        with_units("spring_start or spring_end", _KN_M),
        typical=10.0,
    ),
    "support_rotation_spring": Check(
        *("rotational spring of the support over the sum of 6 E I / L of its members", "1", 2e-3, math.inf),
        with_units("rz", _KN_M) | {"give 'pinned' for a support without a moment": None},
        typical=2.0,
    ),
    # Foundations settle by a few centimetres.
    "support_settlement": Check(
        *("settlement of the springs of supports under gravity", "m", 0.0, 0.5),
        with_units("uy", {"kN/m": 1e3, "MN/m": 1e6}, -1),
        typical=0.01,
    ),
    # The period of the rigid structure on its springs is 2 pi (displacement / g)**0.5: 25 m are 10 s.
    "support_sway": Check(
        *("horizontal displacement of the springs of supports under the weight of the masses", "m", 0.0, 25.0),
        with_units("ux", {"kN/m": 1e3, "MN/m": 1e6}, -1),
        typical=0.5,
    ),
    # Loads of structures lead to 1e-6 (axial forces) to 1e-2. Unit loads are not checked.
    "static_displacement": Check(
        *("largest displacement under the static loads over the size of the frame", "1", 3e-7, math.inf),
        with_units("loads", {"kN, kN m or kN/m": 1e3, "MN, MN m or MN/m": 1e6}),
        typical=1e-5,
    ),
    # A shaker has 1e-3.
    "static_load_over_weight": Check(
        *("sum of the static loads over the weight of the masses of the frame", "1", 3e-4, math.inf),
        with_units("loads", {"kN, kN m or kN/m": 1e3, "MN, MN m or MN/m": 1e6}),
        typical=0.1,
    ),
}
