"""Physical effects in storeys in addition to laws and damping, such as P-Delta; and drift capacities.

Each effect is a row of PHYSICS. To add an effect, write its row here, and a kernel part with the row's name in
`warpdyn/engine/kernels/parts/`. A building has an effect if its parameters are given; kernels of buildings without the
effect do not contain it.
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
    """A force between floors that is not part of a storey law.

    Args:
        parameters: Parameters of the effect, one value per storey; a building has all of these parameters or none.
        stiffness: Function from parameter values to the effect's stiffness [N/m], which is added to the storey's,
            shape [..., storey]. The force must be linear in the drift, because exact methods use only this stiffness.
        packed: Function from parameter values to the arrays that the kernel part reads, each of shape [..., storey].
        problem: Function from parameter values to an error message if they are inconsistent, or None.
    """

    parameters: Mapping[str, Parameter]
    stiffness: Callable[[Values], np.ndarray]
    packed: Callable[[Values], dict[str, np.ndarray]]
    problem: Callable[[Values], str | None]


def storey_weight_over_height(parameters: Values) -> np.ndarray:
    """Return the load W that each storey carries, divided by the storey height h [N/m], shape [..., storey].

    P-Delta: a storey of height h that carries the load W is pushed outward by W / h times its drift, like a parallel
    spring of negative stiffness -W / h (Chopra, Dynamics of Structures, section 22.1).

    Args:
        parameters: Parameter values of shear buildings, including `gravity_load`, each of shape [..., storey].
    """
    from_the_top = parameters["gravity_load"][..., ::-1]
    return np.cumsum(from_the_top, axis=-1)[..., ::-1] / parameters["height"]


def _buckling_problem(parameters: Values) -> str | None:
    """Return an error message about the first storey that buckles under its gravity load, or None."""
    stiffness, leaning = parameters["stiffness"], storey_weight_over_height(parameters)
    bad = stiffness - leaning <= 0
    if not bad.any():
        return None
    place = first_place(bad)
    bounds, loads = (per_height * parameters["height"] for per_height in (stiffness, leaning))
    bound, carried = (np.broadcast_to(values, bad.shape)[place] for values in (bounds, loads))
    return (
        f"gravity_load adds up to {carried:g} N on {place_of(place)}, which buckles: the sum of the loads above the "
        f"storey must be below its stiffness times its height, {bound:g} N"
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
    """Return the names of the rows of PHYSICS whose parameters a building has."""
    return tuple(row for row, physics in PHYSICS.items() if physics.parameters.keys() & names.keys())


def effective_stiffness(parameters: Values, stiffness: np.ndarray | None = None) -> np.ndarray:
    """Return the storey stiffness (None: initial) plus the stiffness of PHYSICS [N/m], shape [..., storey]."""
    stiffness = parameters["stiffness"] if stiffness is None else stiffness
    for row in physics_of(parameters):
        stiffness = stiffness + PHYSICS[row].stiffness(parameters)
    return stiffness


def physics_problem(parameters: Values) -> str | None:
    """Return the first error message of a PHYSICS row about inconsistent parameters, or None."""
    problems = (PHYSICS[row].problem(parameters) for row in physics_of(parameters))
    return next((problem for problem in problems if problem), None)


# A building may have both; the storey collapses at the smaller drift.
DRIFT_CAPACITIES = {
    "drift_capacity": Parameter("m", "storey drift at collapse", low=0.0, low_open=True),
    "drift_ratio_capacity": Parameter("1", "storey drift ratio at collapse", low=0.0, low_open=True),
}
# Default for buildings with a gravity load: at this drift ratio a storey has fallen.
COLLAPSE_DRIFT_RATIO_UNDER_GRAVITY = 0.5


def capacities_of(names: Mapping[str, object]) -> dict[str, Parameter]:
    """Return the rows of DRIFT_CAPACITIES whose names are in `names`."""
    return {name: parameter for name, parameter in DRIFT_CAPACITIES.items() if name in names}


def inverse_drift_capacity(parameters: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return 1 / (drift at which the storey collapses) [1/m], shape [..., storey].

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
