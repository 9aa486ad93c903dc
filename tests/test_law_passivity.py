"""Every storey law with parameters drawn within its bounds: finite, no stiffer than said, and no source of energy."""

import numpy as np
import pytest
from storey_draws import YIELD_DRIFT, YIELD_FORCE, drawn_building, random_paths

import warpdyn as wd
from warpdyn.engine.laws import LAWS

pytestmark = pytest.mark.fast

STOREYS, TURNS, STEPS = 60, 24, 300
YIELD_ENERGY = YIELD_FORCE * YIELD_DRIFT
# Largest allowed fall of the dissipated energy, in Fy dy: errors of steps that cut corners. Of other laws the work
# alone is checked, because their stored energy depends on rules that are decided at the next reversal.
FALLS = {
    "elastic": 1e-9,
    "bilinear": 1e-9,
    "bouc_wen": 2e-2,
    "lead_rubber_bearing": 1e-9,
    "friction_pendulum": 1e-9,
    "elastic_perfectly_plastic": 1e-9,
    "trilinear": 1e-9,
    "quadrilinear": 1e-9,
    "peak_oriented": 2e-3,
    "hysteretic": 0.1,
}
# Peak-oriented storeys that lost stiffness may reload more steeply than they unload, and return a little more energy.
REPAYING = ("ibarra_medina_krawinkler_peak_oriented", "ibarra_medina_krawinkler_pinching")
# Without damage: if a reversal removes most of the strength, a storey may return energy that was stored before.
NO_DAMAGE = {
    f"{kind}_damage_{name}": 0.0
    for kind in ("stiffness", "reloading", "strength")
    for name in ("limit", "by_drift", "by_use")
}


def found(law, seed):
    """Return a building of drawn storeys, and drifts, steps of drift and of force [step, storey], and the energy."""
    rng = np.random.default_rng(seed)
    building = drawn_building(law, STOREYS, rng, **(NO_DAMAGE if law == "pinching4" else {}))
    drift = random_paths(STOREYS, TURNS, STEPS, rng)
    result = wd.storey_hysteresis(building, drift)
    return building, drift, result.storey_force.values, result.dissipated_energy.values


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("law", LAWS)
def test_drawn_storeys(law, seed):
    building, drift, force, dissipated = found(law, seed)
    assert np.isfinite(force).all()
    assert np.isfinite(dissipated).all()
    assert (np.ptp(force, axis=0) > 0).all()
    steps, rises = np.diff(drift, axis=0), np.diff(force, axis=0)
    stiffest = LAWS[law].stiffest({name: np.atleast_1d(value) for name, value in building.parameters.items()})
    beyond = rises * np.sign(steps) - stiffest * np.abs(steps)
    beyond[force[1:] == 0] = 0  # a storey that is exhausted loses its force at once
    assert beyond.max() < 1e-3 * YIELD_FORCE, "stiffer than said"
    work = np.cumsum((force[1:] + force[:-1]) / 2 * steps, axis=0) + force[0] * drift[0] / 2
    least = 0.5 if law in REPAYING else 2e-3  # the trapezoidal rule's
    assert work.min() > -least * YIELD_ENERGY, "gives more energy than was put in"
    if law in FALLS:
        fall = np.maximum.accumulate(dissipated) - dissipated
        assert fall.max() < FALLS[law] * YIELD_ENERGY, "dissipated energy falls"
