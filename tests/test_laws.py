"""The declared largest tangent stiffness of laws, compared with driven storeys."""

from itertools import pairwise

import numpy as np
import pytest

from warpdyn.engine.laws import LAWS

pytestmark = pytest.mark.fast

STIFFNESS, YIELD_FORCE = 250.0, 2.0
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
CYCLES = YIELD_DRIFT * np.array([0, 6, -6, 0.5, -2, 30, -30])
DRIFT_STEP = YIELD_DRIFT / 1000


def elastic(drift, parameters):
    return STIFFNESS * drift


def bilinear(drift, parameters):
    """A hardening spring parallel to one that slides."""
    hardening, force, forces = parameters["hardening_ratio"], 0.0, []
    stiffness, strength = (1 - hardening) * STIFFNESS, (1 - hardening) * YIELD_FORCE
    for increment in np.diff(drift, prepend=drift[0]):
        force = min(max(force + stiffness * increment, -strength), strength)
        forces.append(force)
    return np.array(forces) + hardening * STIFFNESS * drift


def bouc_wen(drift, parameters):
    """Wen's equation, along the drift by Heun's rule."""
    hardening, beta, gamma, n = (parameters[key] for key in ("hardening_ratio", "beta", "gamma", "exponent"))

    def slope(z, direction):
        return (1 - abs(z) ** n * (beta * np.sign(z * direction) + gamma)) / YIELD_DRIFT

    z, memory = 0.0, []
    for increment in np.diff(drift, prepend=drift[0]):
        first = slope(z, np.sign(increment))
        z += increment * (first + slope(z + increment * first, np.sign(increment))) / 2
        memory.append(z)
    return hardening * STIFFNESS * drift + (1 - hardening) * YIELD_FORCE * np.array(memory)


@pytest.mark.parametrize(
    ("law", "drive", "parameters"),
    [
        ("elastic", elastic, {}),
        ("bilinear", bilinear, {"hardening_ratio": 0.1}),
        ("bouc_wen", bouc_wen, {"hardening_ratio": 0.1, "beta": 0.5, "gamma": 0.5, "exponent": 1.0}),
        ("bouc_wen", bouc_wen, {"hardening_ratio": 0.1, "beta": 0.7, "gamma": 0.3, "exponent": 2.0}),
        ("bouc_wen", bouc_wen, {"hardening_ratio": 0.0, "beta": 0.6, "gamma": -0.4, "exponent": 1.3}),
        ("bouc_wen", bouc_wen, {"hardening_ratio": 0.3, "beta": 2.0, "gamma": 0.1, "exponent": 5.0}),
    ],
)
def test_stiffest_is_the_largest_tangent_of_a_driven_storey(law, drive, parameters):
    legs = [np.linspace(a, b, round(abs(b - a) / DRIFT_STEP), endpoint=False) for a, b in pairwise(CYCLES)]
    drift = np.concatenate(legs)
    force = drive(drift, parameters)
    tangent = np.diff(force) / np.diff(drift)
    given = {"stiffness": STIFFNESS, "yield_force": YIELD_FORCE, **parameters}
    stiffest = LAWS[law].stiffest({name: np.full((1, 1), value) for name, value in given.items()})
    # Tangents are those of chords a 1000th of the yield drift long, a little less than at their stiff end.
    assert stiffest.shape == (1, 1)
    assert tangent.max() == pytest.approx(stiffest[0, 0], rel=3e-3)
    assert tangent.max() <= stiffest[0, 0] * (1 + 1e-9)
