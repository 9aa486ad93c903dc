"""Storey laws force by force against the OpenSees materials of the same rules, along three protocols."""

import numpy as np
import pytest
from opensees import finer, growing, material_forces, ratcheting, wandering
from validation import difference

import warpdyn as wd

pytestmark = pytest.mark.fast

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8]), 50),
    "random": wandering(8 * YIELD_DRIFT, 40, 37, seed=1),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 40),
}


def forces(law, drift, **parameters):
    building = wd.ShearBuilding(1.0, STIFFNESS, 3.0, law=law, **parameters)
    return wd.storey_hysteresis(building, drift).storey_force.values[:, 0]


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_bilinear(protocol, measured):
    drift = PROTOCOLS[protocol]
    ours = forces("bilinear", drift, yield_force=YIELD_FORCE, hardening_ratio=0.05)
    theirs = material_forces("Steel01", [YIELD_FORCE, STIFFNESS, 0.05], drift)
    assert np.ptp(theirs) > 2 * YIELD_FORCE
    measured(
        "forces of bilinear storeys along growing, random and ratcheting drifts, over the yield force",
        truth="OpenSees' Steel01",
        value=difference(ours, theirs) / YIELD_FORCE,
        bound=1e-9,  # the same rules, rounded otherwise
    )


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_bouc_wen(protocol, measured):
    drift = PROTOCOLS[protocol]
    # Ours goes along a step by RK4, which feels the kink at z = 0: a third of a yield drift is too long for it.
    ours = forces("bouc_wen", finer(drift, 4), yield_force=YIELD_FORCE, hardening_ratio=0.05)[3::4]
    rate = 0.5 / YIELD_DRIFT  # OpenSees' z is a deformation
    given = [0.05, STIFFNESS, 1.0, rate, rate, 1.0, 0.0, 0.0, 0.0]  # alpha, k, n, gamma, beta, A, no degradation
    # OpenSees goes along a step by Euler's backward rule, of first order: its steps are made a 400th of the protocol's.
    theirs = material_forces("BoucWen", given, finer(drift, 400))[399::400]
    assert np.ptp(theirs) > 1.9 * YIELD_FORCE
    measured(
        "forces of Bouc-Wen storeys along growing, random and ratcheting drifts, over the yield force",
        truth="OpenSees' BoucWen in steps a hundredth as long",
        value=difference(ours, theirs) / YIELD_FORCE,
        bound=1e-3,
    )
