"""Contacts: laws of springs between two structures, or between a structure and an obstacle, such as pounding buildings.

A contact acts while the deformation of its spring exceeds `clearance`; the difference is the penetration d, and d' its
rate. Let e be the coefficient of restitution: the ratio of the relative speeds after and before the impact of two free
masses. Linear contacts without dissipation, or with dissipation by different slopes: device `one_sided_gap`.

The mass of the impact is m = m1 m2 / (m1 + m2) of two masses m1 and m2, and m1 for a mass m1 and an obstacle at rest.

A `PreloadedContact` has no clearance: a preload presses two bodies together, such as a footing and the soil.

A contact needs the rate of deformation, so that a spring of a `LumpedStructure` can have it, but not a storey.

Sources: Anagnostopoulos (1988), Jankowski (2005), Muthukumar and DesRoches (2006), and Ye, Li and Zhu (2009), all in
Earthquake Engineering and Structural Dynamics. The formulas are those of the documentation
of OpenSees' materials Hertzdamp and JankowskiImpact.
"""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import ArrayLike

from warpdyn.engine.laws.contacts.contact import Contact
from warpdyn.engine.laws.devices.parameters import CLEARANCE, CONTACT_STIFFNESS
from warpdyn.engine.laws.law import Layout, Values, parameter, shared
from warpdyn.engine.laws.parameter import Parameter

HERTZ_STIFFNESS = Parameter("N m-1.5", "Hertz stiffness of the contact", low=0.0)
RESTITUTION = Parameter(
    *("1", "coefficient of restitution of the contact"), low=0.0, high=1.0, low_open=True, often_in_percent=True
)
MASS = Parameter("kg", "mass of the impact, m1 m2 / (m1 + m2)", low=0.0, low_open=True)
PENETRATION = Parameter("m", "penetration for which the default step is chosen", low=0.0, low_open=True)
SPEED = Parameter("m s-1", "approach speed below which the damping no longer increases", low=0.0, low_open=True)
EXPECTED, SLOWEST = 0.05, 0.01  # m, m/s
# Acceleration [m/s2], 1 g, by which bodies that touched slowly are pressed together; for steps of Hertz-damp contacts.
PRESSING = 9.81


class Coefficient(Layout):
    """The first coefficients of all contacts."""

    CLEARANCE = enum.auto()
    STIFFNESS = enum.auto()
    DAMPING = enum.auto()  # N s/m; of Hertz-damp contacts 1: factor of d' / v; of Jankowski's N s/m^1.25
    LEAST_SPEED = enum.auto()  # Hertz-damp contacts


UNDAMPED = Coefficient.names(Coefficient.DAMPING)
DAMPED = Coefficient.names(Coefficient.LEAST_SPEED)


def viscous_ratio(restitution: np.ndarray) -> np.ndarray:
    """Return the damping ratio of a Kelvin-Voigt contact whose free impact has this coefficient of restitution."""
    logarithm = np.log(restitution)
    return -logarithm / np.sqrt(np.pi**2 + logarithm**2)


def jankowski_ratio(restitution: np.ndarray) -> np.ndarray:
    """Return the damping ratio of a Jankowski contact with this coefficient of restitution."""
    e = restitution
    found: np.ndarray = 4.5 * np.sqrt(5) * (1 - e**2) / (e * (e * (9 * np.pi - 16) + 16))
    return found


def ye_li_zhu_factor(restitution: np.ndarray) -> np.ndarray:
    """Return the factor of d' / v of a Hertz-damp contact after Ye, Li and Zhu (2009)."""
    return 8 * (1 - restitution) / (5 * restitution)


def muthukumar_des_roches_factor(restitution: np.ndarray) -> np.ndarray:
    """Return the factor of d' / v of a Hertz-damp contact after Muthukumar and DesRoches (2006)."""
    return 0.75 * (1 - restitution**2)


class KelvinVoigtContact(Contact):
    """A spring and a dashpot without tension: F = max(0, k d + c d'), c = 2 xi sqrt(k m).

    xi = -ln e / sqrt(pi^2 + ln^2 e) (Anagnostopoulos 1988) is exact for a contact with tension. Without tension, the
    rebound is a little faster: e = 0.65 gives 0.675, e = 0.4 gives 0.472.

    The force jumps to c d' at the first touch. Therefore errors are proportional to the step, not to its square.

    Example:
        >>> wd.laws.KelvinVoigtContact(clearance=0.02, contact_stiffness=93.5e6, restitution=0.65, impact_mass=127e3)
        KelvinVoigtContact(clearance=0.02, contact_stiffness=93500000.0, restitution=0.65, impact_mass=127000.0)
    """

    clearance: ArrayLike = shared(CLEARANCE)
    contact_stiffness: ArrayLike = shared(CONTACT_STIFFNESS)
    restitution: ArrayLike = shared(RESTITUTION)
    impact_mass: ArrayLike = shared(MASS)

    rows = {"kelvin_voigt_contact": DAMPED}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return {
            "clearance": p["clearance"],
            "stiffness": p["contact_stiffness"],
            "damping": 2 * viscous_ratio(p["restitution"]) * np.sqrt(p["contact_stiffness"] * p["impact_mass"]),
        }

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return p["contact_stiffness"]

    @classmethod
    def steepest_damping(cls, p: Values) -> np.ndarray:
        return cls.named_coefficients(p, "")["damping"]


class KelvinVoigtContactWithTension(KelvinVoigtContact):
    """A spring and a dashpot that act until the penetration is 0: F = k d + c d' (OpenSees: ViscoelasticGap).

    As `KelvinVoigtContact`, but the force is a small tension at the end of the contact. The coefficient of restitution
    of a free impact is exact.

    Example:
        >>> wd.laws.KelvinVoigtContactWithTension(
        ...     clearance=0.02, contact_stiffness=93.5e6, restitution=0.65, impact_mass=127e3
        ... ).restitution
        0.65
    """

    rows = {"kelvin_voigt_contact_with_tension": DAMPED}


class HertzContact(Contact):
    """A contact without dissipation: F = kh d^1.5.

    Example:
        >>> wd.laws.HertzContact(clearance=0.02, hertz_stiffness=2.75e9)
        HertzContact(clearance=0.02, hertz_stiffness=2750000000.0)
    """

    clearance: ArrayLike = shared(CLEARANCE)
    hertz_stiffness: ArrayLike = shared(HERTZ_STIFFNESS)
    expected_penetration: ArrayLike = shared(PENETRATION, default=EXPECTED)

    rows = {"hertz_contact": UNDAMPED}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return {"clearance": p["clearance"], "stiffness": p["hertz_stiffness"]}

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return _hertz_slope(p)


class JankowskiContact(Contact):
    """A contact that is damped only while it approaches (Jankowski 2005; OpenSees: JankowskiImpact).

    F = kh d^1.5 + 2 xi sqrt(kh sqrt(d) m) d' if d' > 0, and kh d^1.5 if d' <= 0, with
    xi = 9 sqrt(5) / 2 (1 - e^2) / (e (e (9 pi - 16) + 16)). e = 0.65 gives 0.647, e = 0.4 gives 0.393.

    Example:
        >>> contact = wd.laws.JankowskiContact(
        ...     clearance=0.02, hertz_stiffness=2.75e9, restitution=0.65, impact_mass=127e3
        ... )
        >>> contact.hertz_stiffness
        2750000000.0
    """

    clearance: ArrayLike = shared(CLEARANCE)
    hertz_stiffness: ArrayLike = shared(HERTZ_STIFFNESS)
    restitution: ArrayLike = shared(RESTITUTION)
    impact_mass: ArrayLike = shared(MASS)
    expected_penetration: ArrayLike = shared(PENETRATION, default=EXPECTED)

    opensees = ("JankowskiImpact",)
    rows = {"jankowski_contact": DAMPED}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return {
            "clearance": p["clearance"],
            "stiffness": p["hertz_stiffness"],
            "damping": 2 * jankowski_ratio(p["restitution"]) * np.sqrt(p["hertz_stiffness"] * p["impact_mass"]),
        }

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return _hertz_slope(p)

    @classmethod
    def steepest_damping(cls, p: Values) -> np.ndarray:
        return cls.named_coefficients(p, "")["damping"] * p["expected_penetration"] ** 0.25


class _HertzDampContact(Contact):
    """Common code of Hertz-damp contacts."""

    clearance: ArrayLike = shared(CLEARANCE)
    hertz_stiffness: ArrayLike = shared(HERTZ_STIFFNESS)
    restitution: ArrayLike = shared(RESTITUTION)
    least_approach_speed: ArrayLike = shared(SPEED, default=SLOWEST)
    expected_penetration: ArrayLike = shared(PENETRATION, default=EXPECTED)

    rows = {"hertz_damp_contact": Coefficient.names()}

    @classmethod
    def damping_factor(cls, restitution: np.ndarray) -> np.ndarray:
        """Return the factor of d' / v [1]."""
        raise NotImplementedError

    @classmethod
    def named_coefficients(cls, p: Values, row: str) -> dict[str, np.ndarray]:
        return {
            "clearance": p["clearance"],
            "stiffness": p["hertz_stiffness"],
            "damping": cls.damping_factor(p["restitution"]),
            "least_speed": p["least_approach_speed"],
        }

    @staticmethod
    def stiffest(p: Values) -> np.ndarray:
        return _hertz_slope(p)

    @classmethod
    def steepest_damping(cls, p: Values) -> np.ndarray:
        factor, stiffness, depth = cls.damping_factor(p["restitution"]), p["hertz_stiffness"], p["expected_penetration"]
        # The dashpot is the largest if bodies that touch slowly are pressed together later. Without a mass, nothing
        # limits the penetration that the pressing force causes, except the expected one.
        deepest: np.ndarray = factor * stiffness * depth**1.5 / p["least_approach_speed"]
        if "mass" not in p:
            return deepest
        # A free impact has the expected penetration if its speed is v = sqrt(4 kh d^2.5 / (5 m)).
        of_impact = factor * np.sqrt(1.25 * stiffness * p["mass"]) * depth**0.25
        of_pressing = factor * p["mass"] * PRESSING / p["least_approach_speed"]
        return np.minimum(deepest, np.maximum(of_impact, of_pressing))


class YeLiZhuContact(_HertzDampContact):
    """A Hertz-damp contact (Ye, Li and Zhu 2009; OpenSees: Hertzdamp with their factor).

    F = kh d^1.5 max(0, 1 + 8 (1 - e) / (5 e) d' / v), where v is the relative speed at the first touch. e = 0.65 gives
    0.630, e = 0.4 gives 0.363.

    Example:
        >>> wd.laws.YeLiZhuContact(clearance=0.02, hertz_stiffness=2.75e9, restitution=0.65)
        YeLiZhuContact(clearance=0.02, hertz_stiffness=2750000000.0, restitution=0.65)
    """

    opensees = ("Hertzdamp",)

    @classmethod
    def damping_factor(cls, restitution: np.ndarray) -> np.ndarray:
        return ye_li_zhu_factor(restitution)


class MuthukumarDesRochesContact(_HertzDampContact):
    """A Hertz-damp contact with the factor of Lankarani and Nikravesh (Muthukumar and DesRoches 2006).

    F = kh d^1.5 max(0, 1 + 3 (1 - e^2) / 4 d' / v), where v is the relative speed at the first touch. It dissipates
    less energy than it should: e = 0.9 gives 0.913, e = 0.65 gives 0.775. For e below 0.9 use `YeLiZhuContact`.

    Example:
        >>> wd.laws.MuthukumarDesRochesContact(clearance=0.02, hertz_stiffness=2.75e9, restitution=0.9)
        MuthukumarDesRochesContact(clearance=0.02, hertz_stiffness=2750000000.0, restitution=0.9)
    """

    @classmethod
    def damping_factor(cls, restitution: np.ndarray) -> np.ndarray:
        return muthukumar_des_roches_factor(restitution)


class PreloadedContact(Contact):
    """A spring and a dashpot without tension, pressed together by a preload N: F = min(k d + c d', N).

    The deformation d is positive in separation, and 0 under the preload; k is the stiffness of the spring. F is the
    change of the contact force: the contact is pressed together by N - F, which is 0 after the lift-off at d = N / k.
    Two bodies that lift off have no stiffness and no dashpot until they touch again. The force is continuous, so that
    errors are proportional to the square of the step.

    Example:
        >>> wd.Spring("edge", {"heave": 1.0, "rocking": 5.0}, law=wd.laws.PreloadedContact(preload=2e6), stiffness=1e9)
        Spring('edge', {'heave': 1.0, 'rocking': 5.0}, law='preloaded_contact', stiffness=1000000000.0)
    """

    preload: ArrayLike = parameter("N", "compression of the contact at rest", low=0.0, low_open=True)
    contact_damping: ArrayLike = parameter("N s m-1", "coefficient of the contact's dashpot", low=0.0, default=0.0)

    is_device = False  # the stiffness of the spring is that of the contact
    rows = {"preloaded_contact": DAMPED}

    @staticmethod
    def named_coefficients(p: Values, row: str) -> dict[str, np.ndarray]:
        return {
            "clearance": p["preload"] / p["stiffness"],
            "stiffness": p["stiffness"],
            "damping": p["contact_damping"],
        }

    @classmethod
    def is_sensitive(cls, p: Values) -> bool:
        """Return False: the contact rebounds softly, without an impact."""
        return False

    @classmethod
    def steepest_damping(cls, p: Values) -> np.ndarray:
        return p["contact_damping"]


def _hertz_slope(p: Values) -> np.ndarray:
    """Return the slope of kh d^1.5 at the expected penetration [N/m]."""
    return 1.5 * p["hertz_stiffness"] * np.sqrt(p["expected_penetration"])
