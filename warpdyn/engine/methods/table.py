"""The table METHODS of all time integration methods, and functions that decide which methods support a structure."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

from warpdyn.engine.methods.kinds import ExactMethod, ExplicitMethod, ImplicitMethod, Method, MultistepMethod
from warpdyn.foundations.core.checks import one_of


def _dissipative(name: str, force_lag: float, mass_lag: float) -> ImplicitMethod:
    """Return the second-order method of Chung and Hulbert that damps high frequencies most strongly for these lags."""
    difference = force_lag - mass_lag
    return ImplicitMethod(name, 2, (1 + difference) ** 2 / 4, 0.5 + difference, mass_lag, force_lag)


# Dormand and Prince 1980; the seventh stage, at the end of the step, is used only for the error estimate.
_DORMAND_PRINCE_A = (
    (0, 0, 0, 0, 0, 0, 0),
    (1 / 5, 0, 0, 0, 0, 0, 0),
    (3 / 40, 9 / 40, 0, 0, 0, 0, 0),
    (44 / 45, -56 / 15, 32 / 9, 0, 0, 0, 0),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0, 0, 0),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0, 0),
    (35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 0),
)
_DORMAND_PRINCE_C = (0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1)
_DORMAND_PRINCE_ERROR = (71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)
_RK4_A = ((0, 0, 0, 0), (0.5, 0, 0, 0), (0, 0.5, 0, 0), (0, 0, 1, 0))
_RK4_B, _RK4_C = (1 / 6, 1 / 3, 1 / 3, 1 / 6), (0, 0.5, 0.5, 1)


@dataclass(frozen=True)
class StoreyForces:
    """Properties of the storey forces of a structure that decide which integration methods support the structure.

    Args:
        names: Names of the storey laws, dampers and stops.
        is_linear: Whether all forces are linear.
        has_rate: Whether the memory of a law follows a differential equation.
        relaxes: Whether a force changes with time at a constant drift.
        is_chain: Whether the forces are those of storeys, and not of full matrices or of springs between any degrees of
            freedom.
        is_lumped: Whether the forces are those of springs between any degrees of freedom.
        couples_rates: Whether the memory of a spring with two components follows a differential equation.
        refuses_implicit: Why implicit methods do not support the forces of a lumped structure; "" if they do.
    """

    names: tuple[str, ...] = ("elastic",)
    is_linear: bool = False
    has_rate: bool = False
    relaxes: bool = False
    is_chain: bool = True
    is_lumped: bool = False
    couples_rates: bool = False
    refuses_implicit: str = ""

    def __str__(self) -> str:
        return ", ".join(self.names)


LINEAR = StoreyForces(is_linear=True, is_chain=False)  # linear system with full matrices


def _hht_alpha(name: str, alpha: float) -> ImplicitMethod:
    return _dissipative(name, force_lag=-alpha, mass_lag=0)


def _generalised_alpha(name: str, radius: float) -> ImplicitMethod:
    return _dissipative(name, force_lag=radius / (radius + 1), mass_lag=(2 * radius - 1) / (radius + 1))


def _wilson_theta(name: str, theta: float) -> ImplicitMethod:
    return ImplicitMethod(name, 2, beta=1 / 6, extension=theta)


@dataclass(frozen=True)
class Choice:
    """A parameter that the name of a method may contain, as in "hht_alpha(alpha=-0.3)".

    Args:
        parameter: Name of the parameter.
        usual: Default value.
        low: Smallest value.
        high: Largest value.
        method: Function of the name and the value that returns the method.
    """

    parameter: str
    usual: float
    low: float
    high: float
    method: Callable[[str, float], ImplicitMethod]


# Outside of these bounds a method amplifies some oscillations at any step (Hilber, Hughes and Taylor 1977; Chung and
# Hulbert 1993; Wilson 1973: the smallest theta is 1.366).
CHOICES = {
    "hht_alpha": Choice("alpha", -0.1, -1 / 3, 0.0, _hht_alpha),
    "generalised_alpha": Choice("spectral_radius", 0.8, 0.0, 1.0, _generalised_alpha),
    "wilson_theta": Choice("theta", 1.4, 1.37, 2.0, _wilson_theta),
}


class Methods(dict[str, Method]):
    """The dictionary {name: method}; a name may contain a parameter, as in `METHODS["hht_alpha(alpha=-0.3)"]`."""

    def __contains__(self, name: object) -> bool:
        return super().__contains__(name) or (isinstance(name, str) and _with_parameter(name) is not None)

    def __missing__(self, name: str) -> Method:
        found = _with_parameter(name)
        if found is None:
            raise KeyError(name)
        return found


@cache
def _with_parameter(name: str) -> Method | None:
    """Return the method for a name with a parameter, such as "hht_alpha(alpha=-0.3)"; None for other names."""
    form = re.fullmatch(r"(\w+)\((\w+)=([^()=]+)\)", name)
    if form is None or form[1] not in CHOICES:
        _refuse_other_forms(name)
        return None
    choice = CHOICES[form[1]]
    if form[2] != choice.parameter:
        raise ValueError(
            f"method {form[1]!r} has the parameter {choice.parameter}, not {form[2]!r}: {_example(form[1])}"
        )
    try:
        value = float(form[3])
    except ValueError:
        value = math.nan
    if not choice.low - 1e-12 <= value <= choice.high + 1e-12:
        raise ValueError(
            f"{choice.parameter} of method {form[1]!r} must be a number from {choice.low:.4g} to {choice.high:.4g}, "
            f"got {form[3]}: {_example(form[1])}"
        )
    return choice.method(name, value)


def _refuse_other_forms(name: str) -> None:
    """Raise a ValueError with an example if the name of a method contains a parameter in a wrong form."""
    word = name.partition("(")[0].strip()
    if "(" in name and word in CHOICES:
        raise ValueError(
            f"unknown method {name!r}: give the parameter of {word!r} without blanks, as in {_example(word)}"
        )
    if "(" in name and dict.__contains__(METHODS, word):
        raise ValueError(f"unknown method {name!r}: {word!r} has no parameter, give method={word!r}")


def _example(name: str) -> str:
    return f'method="{name}({CHOICES[name].parameter}={CHOICES[name].usual:g})"'


_ROWS: tuple[Method, ...] = (
    ExplicitMethod("heun", 2, ((0, 0), (1, 0)), (0.5, 0.5), (0, 1)),
    ExplicitMethod("midpoint", 2, ((0, 0), (0.5, 0)), (0, 1), (0, 0.5)),
    ExplicitMethod("kutta3", 3, ((0, 0, 0), (0.5, 0, 0), (-1, 2, 0)), (1 / 6, 2 / 3, 1 / 6), (0, 0.5, 1)),
    ExplicitMethod("ssprk3", 3, ((0, 0, 0), (1, 0, 0), (0.25, 0.25, 0)), (1 / 6, 1 / 6, 2 / 3), (0, 1, 0.5)),
    ExplicitMethod("rk4", 4, _RK4_A, _RK4_B, _RK4_C),  # Kutta 1901
    ExplicitMethod(
        "three_eighths",
        4,
        ((0, 0, 0, 0), (1 / 3, 0, 0, 0), (-1 / 3, 1, 0, 0), (1, -1, 1, 0)),
        (1 / 8, 3 / 8, 3 / 8, 1 / 8),
        (0, 1 / 3, 2 / 3, 1),
    ),
    ExplicitMethod(
        "dormand_prince5",
        5,
        tuple(row[:6] for row in _DORMAND_PRINCE_A[:6]),
        _DORMAND_PRINCE_A[6][:6],
        _DORMAND_PRINCE_C[:6],
    ),
    ExplicitMethod(
        "dormand_prince54",
        5,
        _DORMAND_PRINCE_A,
        _DORMAND_PRINCE_A[6],
        _DORMAND_PRINCE_C,
        error=_DORMAND_PRINCE_ERROR,
    ),
    # Nystroem 1925, for forces that also depend on the velocity; and methods with Newmark's beta = 0.
    ExplicitMethod(
        "nystroem4",
        4,
        _RK4_A,
        _RK4_B,
        _RK4_C,
        ((0, 0, 0, 0), (1 / 8, 0, 0, 0), (1 / 8, 0, 0, 0), (0, 0, 1 / 2, 0)),
        (1 / 6, 1 / 6, 1 / 6, 0),
    ),
    ExplicitMethod("velocity_verlet", 2, ((0, 0), (1, 0)), (0.5, 0.5), (0, 1), ((0, 0), (0.5, 0)), (0.5, 0)),
    # The damping force uses the velocity of the last step, so the method is of order 1 if there is damping.
    ExplicitMethod("central_difference_lagged", 1, ((0,),), (1,), (0,), ((0,),), (1,), starts_halfway=True),
    MultistepMethod("stoermer", 3, 1 / 12, (23 / 12, -16 / 12, 5 / 12)),
    # Velocity Verlet with one evaluation: dashpots use the velocity that the last acceleration predicts.
    MultistepMethod("leapfrog", 2, 0.0, (3 / 2, -1 / 2, 0.0)),
    ImplicitMethod("central_difference", 2, beta=0),
    ImplicitMethod("newmark_average", 2, beta=1 / 4),
    ImplicitMethod("newmark_linear", 2, beta=1 / 6),
    *(choice.method(name, choice.usual) for name, choice in CHOICES.items()),
    ExactMethod("exact"),
)
METHODS = Methods((method.name, method) for method in _ROWS)


def fitting_methods(forces: StoreyForces, damping: str = "none") -> tuple[str, ...]:
    """Return the names of the methods that support these storey forces and this kind of damping.

    - The exact method supports only linear forces.
    - `central_difference_lagged` does not support rate laws: their force would lag behind the drift, which supplies
      energy to the motion.
    - Multistep methods need storeys or springs; they integrate the memory of a law over the increment of the drift,
      which biaxial springs with a rate do not support.
    - Lumped structures support implicit methods, and explicit methods with fixed steps whose velocities do not lag
      behind; only they support `leapfrog`. Implicit methods do not support all of their springs (`refuses_implicit`).
    - Implicit methods do not support damping proportional to the tangent stiffness, which jumps when a storey yields,
      so that a step may have no equilibrium.
    - Implicit methods integrate the memory of a law over the increment of the drift, without regard to time; they do
      not support forces that change with time at a constant drift.
    """
    unfit = set() if forces.is_linear else {"exact"}
    if forces.has_rate:
        unfit |= {name for name, method in METHODS.items() if method.kind == "explicit" and method.starts_halfway}
    if forces.is_lumped:
        unfit |= {name for name, method in METHODS.items() if not _fits_lumped(method)}
    else:
        unfit |= {"leapfrog"}
    if forces.refuses_implicit:
        unfit |= {name for name, method in METHODS.items() if method.kind == "implicit"}
    if forces.relaxes or forces.couples_rates or not (forces.is_chain or forces.is_lumped):
        unfit |= {name for name, method in METHODS.items() if isinstance(method, MultistepMethod)}
    if damping == "rayleigh_tangent" or forces.relaxes:
        unfit |= {name for name, method in METHODS.items() if method.kind == "implicit"}
    return tuple(name for name in METHODS if name not in unfit)


def _fits_lumped(method: Method) -> bool:
    if isinstance(method, MultistepMethod | ImplicitMethod):
        return True
    return isinstance(method, ExplicitMethod) and not (method.is_adaptive or method.starts_halfway)


def check_fits(method: Any, forces: StoreyForces, damping: str = "none") -> None:
    """Raise a ValueError if a method is unknown, or if it does not support the storey forces or the kind of damping."""
    one_of("method", method, METHODS)
    fitting, row = fitting_methods(forces, damping), method.partition("(")[0]
    if row in fitting:
        return
    if forces.is_lumped:
        is_refused = METHODS[method].kind == "implicit" and forces.refuses_implicit
        what = f"this LumpedStructure: {forces.refuses_implicit}" if is_refused else "a LumpedStructure"
        raise ValueError(f"method {method!r} does not support {what}; these do: {', '.join(fitting)}")
    if row in fitting_methods(forces):
        raise ValueError(
            f"method {method!r} does not fit damping {damping!r} (a step may have no equilibrium if a storey "
            f"yields); choose method= from these: {', '.join(fitting)}"
        )
    linear = "it needs a linear structure, whose viscous dampers have the exponent 1"
    reasons = {"exact": linear, "implicit": "it cannot integrate a force that relaxes with time"}
    reason = reasons.get(METHODS[method].kind, "its velocities lag half a step behind")
    if isinstance(METHODS[method], MultistepMethod):
        needed = "LumpedStructure" if forces.is_chain else "ShearBuilding or a LumpedStructure"
        reason = reasons["implicit"] if forces.relaxes else f"it needs a {needed}"
    raise ValueError(
        f"method {method!r} does not fit storeys of law {str(forces)!r} ({reason}); choose method= from these: "
        f"{', '.join(fitting)}"
    )
