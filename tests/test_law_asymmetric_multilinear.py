"""Asymmetric trilinear and quadrilinear storeys: OpenSees' springs in parallel, and their corners."""

import numpy as np
import pytest
from opensees import finer, growing, material_forces, ratcheting, wandering
from storey_steps import steps

import warpdyn as wd

STIFFNESS, YIELD_FORCE = 2.0e7, 1.0e5  # a storey that yields at 5 mm
YIELD_DRIFT = YIELD_FORCE / STIFFNESS
PROTOCOLS = {
    "growing": growing(YIELD_DRIFT * np.array([0.5, 1, 2, 4, 6, 8, 12]), 50),
    "random": wandering(10 * YIELD_DRIFT, 60, 37, seed=1),
    "ratcheting": ratcheting(8 * YIELD_DRIFT, 12, 3 * YIELD_DRIFT, 41),
}

MULTILINEAR = {  # law, positive side, negative side; springs in parallel: stiffness ratio, drifts at yield over 5 mm
    "trilinear": (
        {"ductility_2": 3.0, "force_ratio_2": 1.8},
        {"yield_force": 1.5e5, "ductility_2": 2.0, "force_ratio_2": 1.2},
        # Lost at 1 and 3: 0.6 and 0.35 of the stiffness; below at 1.5 and 3: 0.8 and 0.15.
        [(0.6, 1.0, 1.5), (0.2, 3.0, 1.5), (0.15, 3.0, 3.0)],
    ),
    "quadrilinear": (
        {"ductility_2": 2.0, "force_ratio_2": 1.5, "ductility_3": 5.0, "force_ratio_3": 1.8},
        {"yield_force": 0.5e5, "ductility_2": 3.0, "force_ratio_2": 1.6, "ductility_3": 6.0, "force_ratio_3": 2.2},
        # Lost at 1, 2 and 5: 0.5, 0.4 and 0.05; below at 0.5, 1.5 and 3: 0.7, 0.1 and 0.15.
        [(0.5, 1.0, 0.5), (0.2, 2.0, 0.5), (0.1, 2.0, 1.5), (0.1, 2.0, 3.0), (0.05, 5.0, 3.0)],
    ),
}


def storey_of(name):
    side, other, _springs = MULTILINEAR[name]
    values = side | {f"{key}_negative": value for key, value in other.items()}
    law = {"law": name, "yield_force": YIELD_FORCE, "hardening_ratio": 0.05}
    return wd.ShearBuilding(1.0, STIFFNESS, 3.0, **law, **values)


@pytest.mark.fast
@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("name", MULTILINEAR)
def test_multilinear_is_springs_of_opensees_in_parallel(name, protocol):
    springs = MULTILINEAR[name][2]
    building = storey_of(name)
    drift = PROTOCOLS[protocol]
    theirs = 0.05 * STIFFNESS * drift
    for ratio, above, below in springs:
        numbers = [ratio * STIFFNESS, above * YIELD_DRIFT, -below * YIELD_DRIFT]
        theirs = theirs + material_forces("ElasticPP", numbers, drift)
    np.testing.assert_allclose(
        wd.storey_hysteresis(building, drift)["storey_force"].values[:, 0], theirs, rtol=0, atol=1e-9 * YIELD_FORCE
    )
    found = wd.storey_hysteresis(building, finer(drift, 20))["dissipated_energy"].values[:, 0]
    assert np.diff(found).min() > -1e-3 * YIELD_FORCE * YIELD_DRIFT
    double = steps(building, drift)
    np.testing.assert_allclose(double.trial_force, double.force, rtol=0, atol=1e-12 * YIELD_FORCE)
    assert (np.abs(double.tangent - double.chord) < 1e-5 * STIFFNESS).mean() > 0.98


@pytest.mark.fast
@pytest.mark.parametrize("name", MULTILINEAR)
def test_one_push_of_a_multilinear_storey_passes_its_corners(name):
    side, other, _springs = MULTILINEAR[name]
    building = storey_of(name)
    for sign, own in ((1, {"yield_force": YIELD_FORCE} | side), (-1, other)):
        force = own["yield_force"]
        corners = [(own.get(f"ductility_{k}", 1.0), own.get(f"force_ratio_{k}", 1.0)) for k in (1, 2, 3)]
        corners = [pair for pair in corners if pair != (1.0, 1.0)] + [(1.0, 1.0)]
        for ductility, ratio in corners:
            push = np.linspace(0, sign * ductility * force / STIFFNESS, 11)
            found = wd.storey_hysteresis(building, push)["storey_force"].values[-1, 0]
            assert found == pytest.approx(sign * ratio * force, rel=1e-12)
