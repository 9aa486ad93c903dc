"""What storeys of Ibarra, Medina and Krawinkler give back where their unloading stiffness is about exhausted."""

import numpy as np
import pytest
from test_law_ibarra_medina_krawinkler import (
    STIFFNESS,
    YIELD_DRIFT,
    YIELD_FORCE,
    every_kind,
    hysteresis,
    opensees_forces,
)

pytestmark = pytest.mark.fast


@every_kind
def test_no_excursion_gives_back_more_than_was_put_in(kind):
    out, back = np.arange(1, 801) * YIELD_DRIFT / 100, np.arange(799, -4001, -1) * YIELD_DRIFT / 100
    drift = np.append(out, back)
    force, _ = hysteresis(kind, out)
    put_in = np.sum((force + np.append(0, force[:-1])) / 2) * YIELD_DRIFT / 100
    spent = put_in - force[-1] ** 2 / 2 / STIFFNESS
    # A share of 0.998 of the unloading stiffness goes as it turns.
    lambda_drift = {"unloading_deterioration_drift": (1 + 1 / 0.998) * spent / YIELD_FORCE}
    force, dissipated = hysteresis(kind, drift, **lambda_drift)
    end = np.flatnonzero(force[800:] <= 0)[0] + 800
    assert drift[end] == pytest.approx(drift[799] - 2 * put_in / force[799], abs=0.011 * YIELD_DRIFT)
    line = force[799] - force[799] ** 2 / 2 / put_in * (drift[799] - drift[800:end])
    np.testing.assert_allclose(force[800:end], line, rtol=0, atol=1e-9 * YIELD_FORCE)
    assert dissipated.min() > -1e-9 * YIELD_FORCE * YIELD_DRIFT
    # OpenSees pushes on by more than ten times what was put in, if it is let.
    far = np.append(out, np.arange(7.99, -300, -0.01) * YIELD_DRIFT)
    theirs = opensees_forces(kind, far, **lambda_drift)
    assert np.trapezoid(theirs, far) < -10 * put_in
