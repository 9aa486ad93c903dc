"""Exceptions of `certify`: checks for which a law of warpdyn has a wider bound, with the reasons."""

from __future__ import annotations

import math
from collections.abc import Mapping

from warpdyn.engine.laws.law import StoreyElement
from warpdyn.foundations.core.near_misses import did_you_mean

#: The names of all checks; for some laws, only some of the checks are made.
CHECKS = (
    "values that are not finite",
    "initial stiffness",
    "linearity",
    "continuity of the force",
    "stiffness bound",
    "tangent",
    "kept force",
    "force of a trial step",
    "memory of a trial step",
    "memory on a line",
    "tangent on a line",
    "negative elastic energy",
    "passivity",
    "dissipation",
    "step independence",
    "rate independence",
    "float32 against float64",
    "GPU against CPU",
    "energy balance",
    "convergence order of rk4",
)
DAMAGE = "damage and unloading stiffness change with the path, and so does the energy that unloading would return"
TURN = "the energy that unloading would return depends on rules that are decided at the next reversal"
ENERGY = "dissipated energy, by which damage grows, is summed over steps"
CROSSING = "the unloading rule is decided in the step in which the force changes its sign"
PATH = "damage and overlapping corners change the path of unloading, and so does the energy that unloading would return"
REST = "a step through zero force towards a side without stiffness keeps some force, which decreases with the step"
STRENGTH = "where a reversal removes most of the strength, elastic energy that was stored before is returned"
DROP = "known defect: with strong hardening, a reversal during unloading drops the force by up to 0.6 % of the largest"
COLLAPSED = "a storey that loses its strength amplifies the error of the step in which a branch begins"

#: Exceptions by the name of the law: each check with its wider bound and the reason.
EXCEPTIONS: dict[str, dict[str, tuple[float, str]]] = {
    "baber_noori": {"dissipation": (500.0, DAMAGE)},
    "hysteretic": {"dissipation": (0.05, REST), "step independence": (0.05, ENERGY)},
    "ibarra_medina_krawinkler_bilinear": {"dissipation": (5.0, DAMAGE), "step independence": (0.01, ENERGY)},
    "ibarra_medina_krawinkler_peak_oriented": {"dissipation": (5.0, DAMAGE), "step independence": (0.01, ENERGY)},
    "ibarra_medina_krawinkler_pinching": {
        "dissipation": (5.0, DAMAGE),
        "step independence": (0.01, ENERGY),
        "convergence order of rk4": (0.3, COLLAPSED),
    },
    "menegotto_pinto": {"dissipation": (0.2, TURN)},
    "takeda": {
        "continuity of the force": (2.0, DROP),
        "dissipation": (0.2, TURN),
        "step independence": (0.01, CROSSING),
    },
    "pinching4": {
        "dissipation": (10.0, PATH),
        "step independence": (0.01, ENERGY),
        "passivity": (0.2, STRENGTH),
    },
}


def checked_exceptions(element: type[StoreyElement]) -> Mapping[str, tuple[float, str]]:
    """Return the checked exceptions that the class of a law, damper or stop declares: bound and reason by check name.

    Raises:
        ValueError: If the name of a check is unknown, a bound is not finite, or a reason is missing.
    """
    of_class = f"exceptions of {element.__name__}"
    for name, exception in element.exceptions.items():
        if name not in CHECKS:
            hint = did_you_mean(name, CHECKS)
            raise ValueError(f"{of_class}: {name!r} is not a check of certify{hint}; checks: {', '.join(CHECKS)}")
        bound, reason = exception if isinstance(exception, tuple) and len(exception) == 2 else (math.nan, "")
        if not (isinstance(bound, int | float) and math.isfinite(bound) and isinstance(reason, str) and reason.strip()):
            raise ValueError(
                f"{of_class}: {name!r} is {exception!r}; give a finite bound and a reason, such as "
                f'exceptions = {{{name!r}: (0.05, "why the bound is wider")}}'
            )
    return element.exceptions
