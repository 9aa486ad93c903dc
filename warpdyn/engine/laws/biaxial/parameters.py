"""Biaxial laws: coupled yielding and friction of isolators.

The force vector is F = Q z + k2 u, with the deformation vector u [m], the stiffness k2 after yield and the hysteretic
strength Q = (k - k2) uy. The yield displacement uy is the yield force divided by the initial stiffness k. The vector z
is the common state; its length is at most 1. The laws differ in the equation of z:

- `IsotropicBoucWen` (OpenSees: ElastomericBearingBoucWen3d):
  uy z' = u' - z |z|^(n - 2) (z.u') (gamma + beta sgn(z.u')). A rotation of the axes does not change it.
- `ParkWenAng` (Park, Wen and Ang 1986; 3D-BASIS, Nagarajaiah et al. 1991), with n = 2: the products are formed for each
  component, uy z' = u' - z (beta |ux' zx| + gamma ux' zx + beta |uy' zy| + gamma uy' zy). A rotation of the axes
  changes it; along a circle its force differs by up to 5 % from that of the isotropic form.
- `CircularYield`: elastic, z' = u' / uy, while |z| < 1; on the circle |z| = 1, uy z' = u' - z (z.u') while z.u' > 0.
- `FrictionSlider` (Constantinou, Mokha and Reinhorn 1990): F = mu W z + (W / R) u with the friction coefficient
  mu = fast - (fast - slow) exp(-a |u'|); z follows the isotropic law with n = 2 and beta = gamma = 1/2.

Along a circle of radius r, `CircularYield` and `IsotropicBoucWen` with beta = gamma reach the same steady state: z is
uy / r in the radial direction and sqrt(1 - (uy / r)^2) along the path.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.biaxial.law import BiaxialLaw
from warpdyn.engine.laws.bouc_wen.parameters import BoucWen
from warpdyn.engine.laws.bounds import first_place, place_of
from warpdyn.engine.laws.isolators.parameters import FrictionPendulum
from warpdyn.engine.laws.law import YIELD_FORCE, Layout, Values, parameter, shared
from warpdyn.engine.laws.parameter import Parameter

POST_YIELD = Parameter("N m-1", "stiffness after yield", low=0.0)
BETA, GAMMA = BoucWen.parameters["beta"], BoucWen.parameters["gamma"]
PENDULUM = FrictionPendulum.parameters


class Coefficient(Layout):
    """Coefficients of the device functions; the first three are those of all laws."""

    POST_YIELD_STIFFNESS = enum.auto()
    STRENGTH = enum.auto()  # Q; of a slider its weight
    INVERSE_YIELD_DISPLACEMENT = enum.auto()
    BETA = enum.auto()
    GAMMA = enum.auto()
    POWER = enum.auto()  # (n - 2) / 2


class SliderCoefficient(Layout):
    """Coefficients of a friction slider."""

    POST_YIELD_STIFFNESS = enum.auto()
    STRENGTH = enum.auto()
    INVERSE_YIELD_DISPLACEMENT = enum.auto()
    FAST = enum.auto()
    FAST_LESS_SLOW = enum.auto()
    RATE = enum.auto()  # a [s/m]


def _of_yielding(p: Values) -> dict[str, np.ndarray]:
    """Return the first three coefficients of laws with a yield force."""
    displacement = p["yield_force"] / p["stiffness"]
    return {
        "post_yield_stiffness": p["post_yield_stiffness"],
        "strength": (p["stiffness"] - p["post_yield_stiffness"]) * displacement,
        "inverse_yield_displacement": 1 / displacement,
    }


def _stiffness_problem(p: Values, name: str, after: np.ndarray) -> str | None:
    """Return a sentence on a stiffness after yield that is not below the initial stiffness, or None."""
    after, stiffness = np.broadcast_arrays(after, p["stiffness"])
    bad = after >= stiffness
    if not bad.any():
        return None
    place = first_place(bad)
    return (
        f"{name} is {after[place]:g} N/m ({place_of(place)}); it must be below the stiffness, {stiffness[place]:g} N/m"
    )


class ParkWenAng(BiaxialLaw):
    """Biaxial Bouc-Wen, form of Park, Wen and Ang (1986), exponent 2; a rotation of the axes changes the forces.

    The help of its module contains the equations of all biaxial laws.

    Example:
        >>> wd.laws.ParkWenAng(yield_force=1.9e5, post_yield_stiffness=1e6, beta=0.1, gamma=0.9)
        ParkWenAng(yield_force=190000.0, post_yield_stiffness=1000000.0, beta=0.1, gamma=0.9)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE)
    post_yield_stiffness: ArrayLike = shared(POST_YIELD)
    beta: ArrayLike = shared(BETA, default=0.5)
    gamma: ArrayLike = parameter("1", "Bouc-Wen gamma, above -beta", default=0.5)

    has_rate = True
    rows = {"park_wen_ang": Coefficient.names(Coefficient.POWER)}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _of_yielding(p) | {"beta": p["beta"], "gamma": p["gamma"]}

    @staticmethod
    def problem(p: Values) -> str | None:
        """Return a sentence on stiffnesses, or on beta and gamma, that contradict each other, or None."""
        beta, gamma = np.broadcast_arrays(p["beta"], p["gamma"])
        bad = gamma <= -beta
        if bad.any():
            place = first_place(bad)
            return (
                f"gamma is {gamma[place]:g} and beta is {beta[place]:g} ({place_of(place)}); gamma must be above "
                "-beta, or the force grows without bound"
            )
        return _stiffness_problem(p, "post_yield_stiffness", p["post_yield_stiffness"])

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        """Return the stiffness at the start of unloading, where it is largest if beta is above gamma."""
        beta, gamma = p["beta"], p["gamma"]
        more = np.maximum(beta - gamma, 0.0) / (beta + gamma)
        return p["stiffness"] + (p["stiffness"] - p["post_yield_stiffness"]) * more


class IsotropicBoucWen(ParkWenAng):
    """Biaxial Bouc-Wen, isotropic form (OpenSees: ElastomericBearingBoucWen3d); the axes may have any direction.

    The help of its module contains the equations of all biaxial laws.

    Example:
        >>> wd.laws.IsotropicBoucWen(yield_force=1.9e5, post_yield_stiffness=1e6)
        IsotropicBoucWen(yield_force=190000.0, post_yield_stiffness=1000000.0)
    """

    exponent: ArrayLike = parameter("1", "Bouc-Wen exponent n", low=1.0, default=2.0)

    opensees = ("ElastomericBearingBoucWen3d",)
    rows = {
        "isotropic_bouc_wen_2": Coefficient.names(Coefficient.POWER),
        "isotropic_bouc_wen": Coefficient.names(),
    }

    @classmethod
    def spring(cls, p: Values) -> str:
        """Return the variant without a power if the exponent is 2 in all springs."""
        return "isotropic_bouc_wen_2" if np.all(p["exponent"] == 2) else "isotropic_bouc_wen"

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        found = ParkWenAng.named_coefficients(p, row)
        return found if row == "isotropic_bouc_wen_2" else found | {"power": (p["exponent"] - 2) / 2}


class CircularYield(BiaxialLaw):
    """Elastic until the hysteretic force reaches a circle, then plastic (OpenSees: ElastomericBearingPlasticity3d).

    The help of its module contains the equations of all biaxial laws. A straight path within a step is followed
    exactly, so that errors are proportional to the square of the step.

    Example:
        >>> wd.laws.CircularYield(yield_force=1.9e5, post_yield_stiffness=1e6)
        CircularYield(yield_force=190000.0, post_yield_stiffness=1000000.0)
    """

    yield_force: ArrayLike = shared(YIELD_FORCE)
    post_yield_stiffness: ArrayLike = shared(POST_YIELD)

    opensees = ("ElastomericBearingPlasticity3d",)
    rows = {"circular_yield": Coefficient.names(Coefficient.BETA)}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return _of_yielding(p)

    @staticmethod
    def problem(p: Values) -> str | None:
        return _stiffness_problem(p, "post_yield_stiffness", p["post_yield_stiffness"])


class FrictionSlider(BiaxialLaw):
    """A spherical slider whose friction increases with the speed (Constantinou, Mokha and Reinhorn 1990).

    mu = fast_friction - (fast_friction - slow_friction) exp(-rate_parameter v), where v is the resultant speed
    (OpenSees: frictionModel VelDependent). `stiffness` is that before sliding, at rest; it decides the yield
    displacement slow_friction weight / (stiffness - weight / radius), usually about 1 mm. The shorter the yield
    displacement, the shorter the step.

    Example:
        >>> slider = wd.laws.FrictionSlider(
        ...     fast_friction=0.08, slow_friction=0.03, rate_parameter=50.0, radius=2.0, weight=9.8e5
        ... )
        >>> slider.rate_parameter
        50.0
    """

    fast_friction: ArrayLike = shared(PENDULUM["friction_coefficient"], opensees="muFast")
    slow_friction: ArrayLike = parameter(
        *("1", "friction coefficient at rest"), low=0.0, high=1.0, low_open=True, high_open=True, opensees="muSlow"
    )
    rate_parameter: ArrayLike = parameter(
        "s m-1", "rate at which the friction increases with the speed", low=0.0, opensees="transRate"
    )
    radius: ArrayLike = shared(PENDULUM["radius"])
    weight: ArrayLike = shared(PENDULUM["weight"])

    has_rate = True
    rows = {"friction_slider": SliderCoefficient.names()}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        pendulum = p["weight"] / p["radius"]
        return {
            "post_yield_stiffness": pendulum,
            "strength": p["weight"],
            "inverse_yield_displacement": (p["stiffness"] - pendulum) / (p["slow_friction"] * p["weight"]),
            "fast": p["fast_friction"],
            "fast_less_slow": p["fast_friction"] - p["slow_friction"],
            "rate": p["rate_parameter"],
        }

    @staticmethod
    def problem(p: Values) -> str | None:
        """Return a sentence on friction coefficients or stiffnesses that contradict each other, or None."""
        fast, slow = np.broadcast_arrays(p["fast_friction"], p["slow_friction"])
        bad = fast < slow
        if bad.any():
            place = first_place(bad)
            return (
                f"fast_friction is {fast[place]:g} and slow_friction is {slow[place]:g} ({place_of(place)}); the "
                "friction at a high speed must be at least that at rest"
            )
        return _stiffness_problem(p, "weight over radius", p["weight"] / p["radius"])

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        pendulum = p["weight"] / p["radius"]
        return pendulum + (p["stiffness"] - pendulum) * p["fast_friction"] / p["slow_friction"]

    @classmethod
    def steepest_damping(cls, p: Values) -> np.ndarray:
        return p["weight"] * (p["fast_friction"] - p["slow_friction"]) * p["rate_parameter"]
