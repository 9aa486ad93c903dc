"""Scatter of some storeys only, such as the building's without its isolators or its tuned mass damper."""

from __future__ import annotations

import numpy as np
import pytest
from prepared_structures import by_host, check_rows, prepared

import warpdyn as wd
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.model.scene.scatter import combined

MOTION = wd.GroundMotion(np.random.default_rng(1).normal(size=300), 0.02, "noise")
SPREAD = wd.Lognormal(1.0, 0.2)


def damped() -> wd.ShearBuilding:
    """Return a building of two storeys with a tuned mass damper, its storey 3."""
    building = wd.ShearBuilding([2e5, 2e5], [4e8, 3e8], 3.2, damping="stiffness_proportional", damping_ratio=0.02)
    return building.with_tuned_mass_damper(mass_ratio=0.05)


def simulated(scatter: dict, structures: int | None = 6):
    return wd.simulate(wd.Scene(damped(), MOTION, scatter), structures=structures, seed=1, dtype="float64")


def test_the_damper_keeps_its_stiffness_and_the_building_gets_the_draws_of_all_storeys():
    nominal = damped().parameters["stiffness"]
    own, every = (
        simulated({"stiffness": spread}) for spread in (wd.RandomFactor(SPREAD, only=(1, 2)), wd.RandomFactor(SPREAD))
    )
    assert (own["stiffness"].values[:, 2] == nominal[2]).all()
    assert (own["stiffness"].values[:, :2] == every["stiffness"].values[:, :2]).all()
    assert np.ptp(own["stiffness"].values[:, 0] / nominal[0]) > 0.2
    listed = simulated({"stiffness": wd.GivenValues(own["stiffness"].values)}, None)
    assert (own["peak_storey_drift"].values == listed["peak_storey_drift"].values).all()
    # A damper that keeps its stiffness is not tuned to the building any more.
    assert np.abs(own["peak_storey_drift"] / every["peak_storey_drift"] - 1).max() > 0.05


@pytest.mark.fast
def test_draws_per_storey_and_random_values_apply_to_the_storeys_between_both_numbers():
    each = wd.RandomFactor(SPREAD, per="storey", storey_correlation=0.5, only=(2, 3))
    nominal, normals = np.array([1.0, 2.0, 4.0, 8.0]), np.array([[0.0, 1.0], [1.0, -1.0], [2.0, 0.5], [3.0, 0.0]])
    between = np.array([False, True, True, False])
    drawn = combined(nominal, each, normals, np.arange(2), between)
    factors = np.exp(0.2 * normals)
    np.testing.assert_allclose(drawn[1:3], nominal[1:3, None] * factors[1:3], rtol=1e-15)
    assert (drawn[[0, 3]] == nominal[[0, 3], None]).all()
    last = wd.RandomValue(wd.Uniform(5.0, 6.0), only=4)
    building = wd.ShearBuilding([2e4] * 4, [2e7] * 4, 3.0)
    assert each.varied("stiffness", building).tolist() == between.tolist()
    value = combined(nominal, last, normals[:1], np.arange(2), last.varied("stiffness", building))
    assert (value[:3] == nominal[:3, None]).all()
    assert ((value[3] > 5.0) & (value[3] < 6.0)).all()


@pytest.mark.fast
def test_a_scene_is_rebuilt_with_its_storeys():
    spread = wd.RandomFactor(SPREAD, only=range(1, 3))
    scene = wd.Scene(damped(), MOTION, {"stiffness": spread})
    run = wd.simulate(scene, structures=2, seed=1)
    assert wd.Scene.from_json(run.attrs["scene"], [MOTION]).scatter == {"stiffness": spread}
    assert spread.only == (1, 2)
    plain = wd.simulate(wd.Scene(damped(), MOTION, {"stiffness": wd.RandomFactor(SPREAD)}), structures=2, seed=1)
    assert '"only"' not in plain.attrs["scene"]


def test_kernels_that_prepare_structures_leave_out_the_same_storeys():
    scatter = {
        "stiffness": wd.RandomFactor(SPREAD, per="storey", only=(2, 3)),
        "mass": wd.RandomValue(wd.Lognormal(2e4, 0.2), only=[1]),
    }
    building = wd.ShearBuilding([2e4] * 3, [2e7] * 3, 3.0, damping="rayleigh", damping_ratio=0.05)
    how, where = Integration(method="rk4", dtype="float64"), Execution(device="cpu")
    run = build_run(wd.Scene(building, MOTION, scatter, recorders=("drift",)), 40, how, where, seed=3)
    expected, vibration = by_host(run)
    fields, found, refused, _ = prepared(run, 0, 40)
    assert refused == 0
    check_rows((fields, found), (expected, vibration), rounding=1e-13)  # as in test_preparation


@pytest.mark.fast
@pytest.mark.parametrize(
    ("name", "spread", "message"),
    [
        ("stiffness", {"only": range(1, 5)}, "only= contains storey 4, but the structure has 3 storeys"),
        ("stiffness", {"only": range(2, 2)}, "only must be storeys, such as"),
        ("stiffness", {"only": (0, 1)}, "only must be a whole number of at least 1, got 0"),
        ("stiffness", {"only": (1, "soil")}, "only must be storeys, such as"),
        ("stiffness", {"only": "soil"}, "only= names 'soil', but a ShearBuilding has storeys with numbers"),
        ("damping_ratio", {"only": (1, 2)}, "damping_ratio has no value per storey: remove only="),
    ],
)
def test_unfit_storeys_are_refused(name, spread, message):
    with pytest.raises((TypeError, ValueError), match=message):
        wd.Scene(damped(), MOTION, {name: wd.RandomFactor(SPREAD, **spread)})


@pytest.mark.fast
def test_one_value_for_the_building_and_its_damper_is_refused():
    message = "one value would replace the values of the building's storeys and those of storey 3"
    with pytest.raises(ValueError, match=f"{message}.*GivenValues of shape .structure, 3."):
        wd.Scene(damped(), MOTION, {"damper_coefficient": wd.GivenValues([1e4, 2e4])})
    with pytest.raises(ValueError, match=f"{message}.*only="):
        wd.Scene(damped(), MOTION, {"stiffness": wd.RandomValue(wd.Lognormal(3e8, 0.2))})
    # The friction of pendulums is no parameter of the building's storeys, so one value per structure is clear.
    building = wd.ShearBuilding([2e5, 2e5], [4e8, 3e8], 3.2, damping="stiffness_proportional", damping_ratio=0.02)
    isolated = building.on_isolators(
        "friction_pendulum", 2e5, 0.5, stiffness=4e8, friction_coefficient=0.06, radius=2.0
    )
    run = wd.simulate(wd.Scene(isolated, MOTION, {"friction_coefficient": wd.GivenValues([0.04, 0.08])}))
    expected = np.float32([[0.04, np.nan, np.nan], [0.08, np.nan, np.nan]])
    np.testing.assert_array_equal(run["friction_coefficient"], expected)
