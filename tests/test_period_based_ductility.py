"""Period-based ductility of FEMA P-695 against closed forms of one storey, and equations 6-6 to 6-8 by hand."""

from __future__ import annotations

import numpy as np
import pytest

import warpdyn as wd

pytestmark = pytest.mark.fast

MASS, STIFFNESS, YIELD = 2e5, 4e7, 6e5  # kg, N/m, N
CAPPING, POST, RATIO = 0.06, 0.30, 1.1  # m, m, 1
LAW = wd.laws.IbarraMedinaKrawinklerBilinear(
    yield_force=YIELD, plastic_drift_to_capping=CAPPING, post_capping_drift=POST, capping_force_ratio=RATIO
)


def storey(**load):
    return wd.ShearBuilding(MASS, STIFFNESS, 3.0, law=LAW, **load)


@pytest.mark.parametrize("load", [0.0, 1.5e6], ids=["without P-Delta", "P-Delta"])
def test_one_storey_has_the_closed_form(load):
    building = storey(**({"gravity_load": load} if load else {}))
    pushed = wd.pushover(building, np.linspace(0.0, 0.25, 5001))
    found = wd.period_based_ductility(building, pushed)
    # Yield, capping and falling branch of the spring, minus P-Delta load / height times the displacement.
    slope = load / 3.0
    capped = YIELD / STIFFNESS + CAPPING
    peak = RATIO * YIELD - slope * capped
    falling = RATIO * YIELD / POST + slope
    ultimate = capped + 0.2 * peak / falling
    period = 2 * np.pi * np.sqrt(MASS / (STIFFNESS - slope))
    effective = peak / MASS / (2 * np.pi / period) ** 2
    expected = {"ultimate_roof_displacement": ultimate, "effective_yield_displacement": effective}
    expected |= {"period_based_ductility": ultimate / effective, "peak_base_shear": peak, "roof_coefficient": 1.0}
    expected |= {"weight": 9.80665 * MASS, "first_period": period}
    for name, value in expected.items():
        assert float(found[name]) == pytest.approx(value, rel=1e-3), name  # steps of 0.05 mm at the capping point
    longer = wd.period_based_ductility(building, pushed, period=2 * period)
    assert float(longer["period_based_ductility"]) == pytest.approx(float(found["period_based_ductility"]) / 4)
    shorter = wd.period_based_ductility(building, pushed, period=0.5 * period)
    assert float(shorter["period_based_ductility"]) == float(found["period_based_ductility"])


def test_several_storeys_by_hand():
    mass, stiffness = np.array([3e5, 2e5, 1e5]), np.array([6e7, 5e7, 4e7])
    law = wd.laws.IbarraMedinaKrawinklerBilinear(
        yield_force=[9e5, 8e5, 6e5], plastic_drift_to_capping=0.05, post_capping_drift=0.6, capping_force_ratio=1.1
    )
    building = wd.ShearBuilding(mass, stiffness, 3.0, law=law)
    pushed = wd.pushover(building, np.linspace(0.0, 0.4, 401))
    found = wd.period_based_ductility(building, pushed)
    stiff = np.diag(stiffness + np.append(stiffness[1:], 0)) - np.diag(stiffness[1:], 1) - np.diag(stiffness[1:], -1)
    squared, modes = np.linalg.eig(np.diag(1 / mass) @ stiff)
    first = modes[:, squared.argmin()]
    coefficient = first[-1] * (mass @ first) / (mass @ first**2)
    displacement, shear = pushed["roof_displacement"].values, pushed["base_shear"].values
    after = shear.argmax()
    ultimate = np.interp(-0.8 * shear.max(), -shear[after:], displacement[after:])
    assert shear[-1] < 0.8 * shear.max()
    effective = coefficient * shear.max() / mass.sum() / squared.min()  # C0 (V/W) g (T / 2 pi)^2
    assert float(found["roof_coefficient"]) == pytest.approx(coefficient, rel=1e-9)
    assert float(found["period_based_ductility"]) == pytest.approx(ultimate / effective, rel=1e-9)
    assert found.attrs["ultimate_displacement_from"] == "80% of the largest base shear"


def test_a_curve_that_ends_in_snap_back_has_its_last_displacement():
    """The first storey, which has a falling branch without end, softens faster than the two above it unload."""
    chain = wd.ShearBuilding(2e5, 1e8, 3.0, law="bilinear", yield_force=[1.0e6, 1.2e6, 1.3e6], hardening_ratio=0.1)
    chain.parameters = chain.parameters | {"hardening_ratio": np.array([-2.0, 0.0, 0.0])}  # as in test_pushover
    with pytest.warns(UserWarning, match="the curve ends before the given path does"):
        pushed = wd.pushover(chain, np.linspace(0.0, 0.1, 101))
    found = wd.period_based_ductility(chain, pushed)
    assert float(found["ultimate_roof_displacement"]) == float(pushed["roof_displacement"][-1])
    assert float(found["peak_base_shear"]) == float(pushed["base_shear"][-1])
    assert "snap-back" in found.attrs["ultimate_displacement_from"]


def test_unfit_curves_are_refused():
    building = storey()
    with pytest.raises(ValueError, match=r"base shear is still .* push the building until it falls below 80%"):
        wd.period_based_ductility(building, wd.pushover(building, np.linspace(0.0, 0.05, 51)))
    with pytest.raises(ValueError, match="roof displacement of the pushover decreases"):
        wd.period_based_ductility(building, wd.pushover(building, [0.0, 0.05, 0.02]))
    with pytest.raises(ValueError, match="carries no lateral load"):
        wd.period_based_ductility(building, wd.pushover(building, [0.0, 0.0]))
    with pytest.raises(ValueError, match=r"period \[s\] must be a finite number above 0"):
        wd.period_based_ductility(building, wd.pushover(building, np.linspace(0.0, 0.25, 51)), period=0.0)
    whole = wd.pushover(building, np.linspace(0.0, 0.25, 51))
    with pytest.raises(ValueError, match="pushed is the pushover of another building"):
        wd.period_based_ductility(storey(gravity_load=1e6), whole)
    with pytest.raises(ValueError, match=r"period \[s\] must be at most 100, got 1e\+308"):
        wd.period_based_ductility(building, whole, period=1e308)
    for pattern, name in (("uniform", "uniform"), ([1.0], "given")):
        other = wd.pushover(building, np.linspace(0.0, 0.25, 51), pattern=pattern)
        with pytest.raises(ValueError, match=rf"pattern '{name}', but .* pushover\(building, .*pattern='first_mode'\)"):
            wd.period_based_ductility(building, other)
    protected = storey().with_tuned_mass_damper(0.05)
    with pytest.raises(ValueError, match=r"has isolators or a tuned mass damper.*give the building without them"):
        wd.period_based_ductility(protected, whole)
    whole["base_shear"][5] = np.nan
    with pytest.raises(ValueError, match=r"base_shear.*nan"):
        wd.period_based_ductility(building, whole)
    with pytest.raises(TypeError, match="takes a ShearBuilding"):
        wd.period_based_ductility(2.0, wd.pushover(building, [0.0, 0.01]))
    with pytest.raises(TypeError, match="takes a Dataset"):
        wd.period_based_ductility(building, 2.0)
