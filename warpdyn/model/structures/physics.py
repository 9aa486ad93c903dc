"""Physical effects in storeys that are not part of laws or damping, such as P-Delta; and drift capacities.

Each effect is a row of PHYSICS. To add an effect, add a row to PHYSICS and, in `warpdyn/engine/kernels/parts/`, a
kernel part (a piece of kernel code) with the name of the row. A building has an effect if its parameters are given.
Kernels of buildings without the effect do not contain its code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from warpdyn.engine.laws import Parameter
from warpdyn.engine.laws.bounds import first_place, place_of

Values = Mapping[str, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Physics:
    """A physical effect: a force between neighbouring floors that is not part of a storey law.

    Args:
        parameters: Parameters of the effect, one value per storey. A building has either all or none of them.
        stiffness: Function that returns the stiffness of the effect [N/m], shape [..., storey], from parameter values.
            It is added to the storey stiffness. The force must be linear in the drift, because methods that are exact
            for linear systems use only this stiffness.
        packed: Function that returns the arrays that the kernel part reads, each of shape [..., storey], from
            parameter values.
        problem: Function that returns an error message if parameter values are inconsistent, otherwise None.
    """

    parameters: Mapping[str, Parameter]
    stiffness: Callable[[Values], np.ndarray]
    packed: Callable[[Values], dict[str, np.ndarray]]
    problem: Callable[[Values], str | None]


def storey_weight_over_height(parameters: Values) -> np.ndarray:
    """Return the vertical load on each storey, divided by the storey height [N/m], shape [..., storey].

    P-Delta effect: the load W on a storey of height h pushes the storey outward by W / h times its drift, like a
    parallel spring of negative stiffness -W / h (Chopra, Dynamics of Structures, section 22.1).

    Args:
        parameters: Parameter values of shear buildings, including `gravity_load`, each of shape [..., storey].
    """
    from_the_top = parameters["gravity_load"][..., ::-1]
    return np.cumsum(from_the_top, axis=-1)[..., ::-1] / parameters["height"]


def _buckling_problem(parameters: Values) -> str | None:
    """Return an error message that names the first storey that buckles under its gravity load; None: no storey does."""
    stiffness, leaning = parameters["stiffness"], storey_weight_over_height(parameters)
    bad = stiffness - leaning <= 0
    if not bad.any():
        return None
    place = first_place(bad)
    bounds, loads = (per_height * parameters["height"] for per_height in (stiffness, leaning))
    bound, carried = (np.broadcast_to(values, bad.shape)[place] for values in (bounds, loads))
    return (
        f"gravity_load adds up to {carried:g} N on {place_of(place)}, which buckles: the sum of the loads above the "
        f"storey must be below its stiffness times its height, {bound:g} N: reduce gravity_load= or increase stiffness="
    )


PHYSICS = {
    "p_delta": Physics(
        parameters={"gravity_load": Parameter("N", "vertical load of the floor that leans with the building", low=0.0)},
        stiffness=lambda values: -storey_weight_over_height(values),
        packed=lambda values: {"storey_weight_over_height": storey_weight_over_height(values)},
        problem=_buckling_problem,
    ),
}


def physics_of(names: Mapping[str, object]) -> tuple[str, ...]:
    """Return the names of the physical effects (rows of PHYSICS) whose parameters are among the parameter names."""
    return tuple(row for row, physics in PHYSICS.items() if physics.parameters.keys() & names.keys())


def effective_stiffness(parameters: Values, stiffness: np.ndarray | None = None) -> np.ndarray:
    """Return storey stiffness plus the stiffness of physical effects such as P-Delta [N/m], shape [..., storey].

    Args:
        parameters: Parameter values of shear buildings.
        stiffness: Storey stiffness [N/m]; None: the initial stiffness.
    """
    stiffness = parameters["stiffness"] if stiffness is None else stiffness
    for row in physics_of(parameters):
        stiffness = stiffness + PHYSICS[row].stiffness(parameters)
    return stiffness


def physics_problem(parameters: Values) -> str | None:
    """Return an error message if the parameters of a physical effect (row of PHYSICS) are inconsistent; else None."""
    problems = (PHYSICS[row].problem(parameters) for row in physics_of(parameters))
    return next((problem for problem in problems if problem), None)


# Capacities of a storey. If a building has both, the storey collapses at the smaller drift.
DRIFT_CAPACITIES = {
    "drift_capacity": Parameter("m", "storey drift at collapse", low=0.0, low_open=True),
    "drift_ratio_capacity": Parameter("1", "storey drift ratio at collapse", low=0.0, low_open=True),
}
# Default for buildings with a gravity load: a storey with this drift ratio has collapsed.
COLLAPSE_DRIFT_RATIO_UNDER_GRAVITY = 0.5


def capacities_of(names: Mapping[str, object]) -> dict[str, Parameter]:
    """Return the drift capacities (rows of DRIFT_CAPACITIES) whose names are among the parameter names `names`."""
    return {name: parameter for name, parameter in DRIFT_CAPACITIES.items() if name in names}


def inverse_drift_capacity(parameters: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return 1 / (drift at which a storey collapses) [1/m], shape [..., storey].

    Args:
        parameters: Parameter values of shear buildings, including one or both of DRIFT_CAPACITIES, each of shape
            [..., storey].
    """
    inverse = []
    if "drift_capacity" in parameters:
        inverse.append(1 / parameters["drift_capacity"])
    if "drift_ratio_capacity" in parameters:
        inverse.append(1 / (parameters["drift_ratio_capacity"] * parameters["height"]))
    return np.max(np.stack(inverse), axis=0)
