"""Tables of the recorders, and of the output variables that each recorder writes.

A recorder is a part of a kernel that writes results, such as peak drifts. Response quantities are evaluated at every
step, not between steps. Forces and accelerations satisfy the equation of motion.
"""

from __future__ import annotations

from warpdyn.engine.kernels.recorders.control import OF_ACTUATORS, OF_CONTROL as OF_CONTROL
from warpdyn.engine.kernels.recorders.history import HISTORY as HISTORY, OF_SPRINGS as OF_SPRINGS
from warpdyn.engine.kernels.registry import recorders
from warpdyn.engine.kernels.stepping.steps import ADAPTIVE
from warpdyn.foundations.core.output_variables import Variable

# Family of the structure ("chain", "lumped" or "dense") -> recorder -> name in the dataset -> variable.
RECORDERS = recorders()
# Variables of whole histories by name.
HISTORIES = HISTORY | OF_SPRINGS | OF_CONTROL
# Why and when a control failed: kept if the demands of the sample are NaN.
OF_FAILURES = ("control_failure", "time_of_control_failure")
STOREY_OF_COLLAPSE = Variable(
    (), "1", "storey that collapsed first, counted from 1; -1 where none did", is_demand=False, is_whole=True
)
# Variables that `parts/collapse.py` writes. They are here because that module imports Warp, which a Scene does not
# need.
COLLAPSE = {
    "time_of_collapse": Variable(
        (), "s", "time at which a storey drift passed its capacity, or end of a run in which it falls", is_demand=False
    ),
    "storey_of_collapse": STOREY_OF_COLLAPSE,
}
COLLAPSE_OF_SPRINGS = {  # `lumped/spring_collapse.py`
    "time_of_collapse": Variable(
        (), "s", "time at which the deformation of a spring passed its capacity", is_demand=False
    ),
    "spring_of_collapse": Variable(
        (),
        "1",
        "index along spring of the spring that passed its capacity first; -1 where none did",
        is_demand=False,
        is_whole=True,
    ),
}
OF_ROTATIONS = {  # `hinges/hinge_search.py`, `grids/drift_increments.py`
    "spring_without_equilibrium": Variable(
        (),
        "1",
        "index along spring of the hinge with the largest unbalanced moment in the first state without equilibrium; "
        "-1 where all states had one",
        is_demand=False,
        is_whole=True,
    ),
}
# The recorder of the final state, with which the next event of a sequence starts; the dataset does not contain it.
STATE = "state"


def recorded(
    family: str,
    recorders: tuple[str, ...],
    *,
    is_adaptive: bool,
    collapses: bool,
    has_line: bool = False,
    has_storeys: bool = False,
    is_controlled: bool = False,
) -> dict[str, Variable]:
    """Return all output variables of a run as {name: variable}.

    The dictionary contains the variables of the recorders, those of collapses if `collapses` is true, those of an
    adaptive method if `is_adaptive` is true, those of the rotations of a column line if `has_line` is true, and those
    of actuators if `is_controlled` is true. The final state (recorder STATE) is omitted, because the dataset does not
    contain it. If a lumped structure `has_storeys`, collapses have the storey of collapse.
    """
    variables = {
        name: variable for row in recorders if row != STATE for name, variable in RECORDERS[family][row].items()
    }
    of_collapse = COLLAPSE
    if family == "lumped":
        of_collapse = COLLAPSE_OF_SPRINGS | ({"storey_of_collapse": STOREY_OF_COLLAPSE} if has_storeys else {})
    variables |= OF_ROTATIONS if has_line else {}
    variables |= OF_ACTUATORS if is_controlled else {}
    return variables | (of_collapse if collapses else {}) | (ADAPTIVE if is_adaptive else {})
