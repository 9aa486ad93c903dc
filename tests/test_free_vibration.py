"""What is left at the end: residual drift of structures that never yielded, and the last state of a run."""

import numpy as np
import pytest

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given(
    "first_period", "initial_velocity", "no_damping", "record_step", "storey_height", "strongest_motion"
)

SHAKE = wd.GroundMotion(np.random.default_rng(3).normal(size=300), 0.02)


@pytest.mark.parametrize("ratio", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("period", [0.05, 0.07, 1.0])
def test_no_residual_drift_without_yielding(period, ratio):
    """Whatever the period, its scatter, the damping and the record's step: a tenth of a per cent of the peak."""
    building = wd.ShearBuilding(1.0, (2 * np.pi / period) ** 2, 1.0, damping="modal", damping_ratio=ratio)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1, 0.3))}
    if ratio:
        scatter["damping_ratio"] = wd.RandomFactor(wd.Lognormal(1, 0.4))
    run = wd.simulate(wd.Scene(building, SHAKE, scatter=scatter), structures=20, dtype="float64")
    assert np.all(np.abs(run.residual_drift_ratio) < 1e-3 * run.peak_storey_drift_ratio)


def test_tails_do_not_depend_on_the_other_structures():
    building = wd.ShearBuilding([2e3, 1e3], 4e5, 3.0, damping="rayleigh", damping_ratio=0.05)
    scene = wd.Scene(building, SHAKE, scatter={"stiffness": wd.RandomFactor(wd.Lognormal(1, 1.0))})
    few, many = (wd.simulate(scene, structures=n, dtype="float64", step=0.002) for n in (3, 40))
    for name in few.data_vars:
        if "sample" in few[name].dims:
            np.testing.assert_array_equal(few[name], many[name].isel(sample=slice(3)), err_msg=name)


def test_short_tail_is_told():
    building = wd.ShearBuilding(1.0, 40.0, 1.0)
    with pytest.warns(UserWarning, match="tail of 0 s is shorter than the first period"):
        wd.simulate(wd.Scene(building, SHAKE, tail=0.0), step=0.02)


@pytest.mark.parametrize("kind", ["chain", "dense"])
def test_forces_of_the_last_state_are_seen(kind):
    """A quarter of a free oscillation: the force and the acceleration are largest at the very end."""
    omega = 10.0
    structure = wd.ShearBuilding(1.0, 100.0, 1.0) if kind == "chain" else wd.LinearSystem([[1.0]], [[0.0]], [[100.0]])
    scene = wd.Scene(structure, wd.FreeVibration(np.pi / 2 / omega, velocity=1.0))
    run = wd.simulate(scene, structures=3, step=np.pi / 2 / omega / 100, dtype="float64")
    name = "peak_floor_acceleration" if kind == "chain" else "peak_acceleration"
    # RK4 over 100 steps of 0.0157 rad: 100 x^5 / 120, about 1e-9.
    np.testing.assert_allclose(run[name].values.ravel(), omega, rtol=1e-8)
    if kind == "chain":
        np.testing.assert_allclose(run.peak_base_shear, 10.0, rtol=1e-8)


@pytest.mark.meant_as_given("drift_ratio_of_force")
def test_force_history_without_a_tail_ends_under_its_last_force():
    """A force that grows until the end holds the mass back there: M u'' = F - k u, and not -k u."""
    scene = wd.Scene(
        wd.ShearBuilding(1.0, 1e-6, 1.0), wd.ForceHistory([[0.0], [2.0]], 1.0), tail=0.0, recorders=("acceleration",)
    )
    run = wd.simulate(scene, step=0.01, dtype="float64")
    assert run.peak_floor_acceleration.item() == pytest.approx(2.0, rel=1e-6)


def test_residual_of_a_single_step():
    """One step of free flight: the mean over it is what it ends with."""
    scene = wd.Scene(wd.ShearBuilding(1.0, 1e-6, 2.0), wd.FreeVibration(0.01, velocity=1.0))
    run = wd.simulate(scene, step=0.01, dtype="float64")
    assert run.residual_drift_ratio.item() == pytest.approx(0.005, rel=1e-9)


def test_nothing_supplied_has_no_energy_error():
    still = wd.GroundMotion(np.zeros(10), 0.02)
    run = wd.simulate(wd.Scene(wd.ShearBuilding(1.0, 40.0, 1.0), still))
    assert run.energy_balance_error.item() == 0
    assert run.status.item() == 0


def test_energy_out_of_balance_is_told():
    """Four steps a period are stable but far from accurate."""
    building = wd.ShearBuilding(1.0, (2 * np.pi / 0.08) ** 2, 1.0)
    with pytest.warns(UserWarning, match="energy balance of 1 of 1 samples is off by more than 2 %"):
        wd.simulate(wd.Scene(building, SHAKE), step=0.02)


def test_default_step_follows_what_replaces_the_nominal_value():
    building = wd.ShearBuilding(1.0, 40.0, 1.0)
    stiff = wd.simulate(wd.Scene(building, SHAKE, scatter={"stiffness": wd.GivenValues([4e5])}))
    assert stiff.attrs["step"] == pytest.approx(2 * np.pi / np.sqrt(4e5) / 100, rel=0.1)


def test_a_tail_that_is_not_run_is_told() -> None:
    building = wd.ShearBuilding(2e4, 2e7, 3.0, damping="rayleigh", damping_ratio=0.05)
    with pytest.warns(UserWarning, match=r"the tail of 2 s is ignored: a FreeVibration has its own duration"):
        wd.Scene(building, wd.FreeVibration(1.0, velocity=0.1), tail=2.0)
