"""P-Delta: the second-order effect of gravity loads on a chain of storeys.

A storey of height h that carries the load W is pushed outward by the force W / h times its drift, as if a spring of
negative stiffness -W / h acted beside its own (Chopra, Dynamics of Structures, section 22.1; linear P-Delta columns).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from warpdyn.laws.bounds import first_place, place_of

Values = Mapping[str, np.ndarray]


def storey_weight_over_height(parameters: Values) -> np.ndarray:
    """Return the load that each storey carries over its height [N/m], shape [..., storey].

    Args:
        parameters: Parameters of shear buildings, `gravity_load` among them, each [..., storey].
    """
    from_the_top = parameters["gravity_load"][..., ::-1]
    return np.cumsum(from_the_top, axis=-1)[..., ::-1] / parameters["height"]


def stiffness_under_gravity(parameters: Values, stiffness: np.ndarray | None = None) -> np.ndarray:
    """Return the initial, or another, storey stiffness less that of P-Delta [N/m], shape [..., storey]."""
    stiffness = parameters["stiffness"] if stiffness is None else stiffness
    return stiffness - storey_weight_over_height(parameters) if "gravity_load" in parameters else stiffness


def buckling_problem(parameters: Values) -> str | None:
    """Return an error message on the first storey that buckles under its gravity load, or None."""
    if "gravity_load" not in parameters or np.all(stiffness_under_gravity(parameters) > 0):
        return None
    bad = stiffness_under_gravity(parameters) <= 0
    place = first_place(bad)
    bounds, loads = (
        per_height * parameters["height"]
        for per_height in (parameters["stiffness"], storey_weight_over_height(parameters))
    )
    bound, carried = (np.broadcast_to(values, bad.shape)[place] for values in (bounds, loads))
    return (
        f"gravity_load adds up to {carried:g} N on {place_of(place)}, which buckles: from the top down it must stay "
        f"below stiffness times height there, {bound:g} N"
    )
