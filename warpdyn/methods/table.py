"""The time integration methods, one row each in METHODS."""

from __future__ import annotations

import re
from typing import Any

from warpdyn.core.checks import one_of
from warpdyn.methods.kinds import ExactMethod, ExplicitMethod, ImplicitMethod, Method


def _dissipative(name: str, force_lag: float, mass_lag: float) -> ImplicitMethod:
    """Return the second-order method with the most damping of high frequencies for these lags (Chung and Hulbert)."""
    difference = force_lag - mass_lag
    return ImplicitMethod(name, 2, (1 + difference) ** 2 / 4, 0.5 + difference, mass_lag, force_lag)


# Dormand and Prince 1980; the seventh stage is at the step's end and is used for the error estimate alone.
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
_SPECTRAL_RADIUS = 0.8  # of generalised-alpha at infinite frequency

RATE_LAWS = ("bouc_wen", "baber_noori")  # whose memory follows the velocity

METHODS: dict[str, Method] = {
    method.name: method
    for method in (
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
        # Nystroem 1925, for forces that depend on the velocity too; with Newmark's beta = 0 as its simplest relatives.
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
        # The velocity in the damping force is the last step's difference of displacements: order 1 where there is any.
        ExplicitMethod("central_difference_lagged", 1, ((0,),), (1,), (0,), ((0,),), (1,), starts_halfway=True),
        ImplicitMethod("central_difference", 2, beta=0),
        ImplicitMethod("newmark_average", 2, beta=1 / 4),
        ImplicitMethod("newmark_linear", 2, beta=1 / 6),
        _dissipative("hht_alpha", force_lag=0.1, mass_lag=0),
        _dissipative(
            "generalised_alpha",
            force_lag=_SPECTRAL_RADIUS / (_SPECTRAL_RADIUS + 1),
            mass_lag=(2 * _SPECTRAL_RADIUS - 1) / (_SPECTRAL_RADIUS + 1),
        ),
        ImplicitMethod("wilson_theta", 2, beta=1 / 6, extension=1.4),
        ExactMethod("exact"),
    )
}


def fitting_methods(law: str, damping: str = "none") -> tuple[str, ...]:
    """Return the methods that can integrate structures of a storey law and a damping.

    The exact method needs a linear law. Lagged central difference does not fit a law whose memory follows the velocity:
    its force would lag behind the drift, which supplies energy until yielding bounds the motion. Damping in proportion
    to the tangent stiffness jumps where a storey yields, so that an implicit step may have no equilibrium.
    """
    unfit = set() if law == "elastic" else {"exact"}
    if set(RATE_LAWS) & set(re.split(r"[|+]", law)):
        unfit |= {name for name, method in METHODS.items() if method.kind == "explicit" and method.starts_halfway}
    if damping == "rayleigh_tangent":
        unfit |= {name for name, method in METHODS.items() if method.kind == "implicit"}
    return tuple(name for name in METHODS if name not in unfit)


def check_fits(method: Any, law: str, damping: str = "none") -> None:
    """Raise an error unless a method exists and fits a law and a damping; the message lists those that do."""
    one_of("method", method, METHODS)
    fitting = fitting_methods(law, damping)
    if method in fitting:
        return
    if method in fitting_methods(law):
        raise ValueError(
            f"method {method!r} does not fit damping {damping!r} (a step may have no balance where a storey yields); "
            f"these fit: {', '.join(fitting)}"
        )
    linear = "it needs a linear structure, whose viscous dampers have the exponent 1"
    reason = linear if METHODS[method].kind == "exact" else "its velocities lag behind"
    raise ValueError(
        f"method {method!r} does not fit storeys of law {law!r} ({reason}); these fit: {', '.join(fitting)}"
    )
