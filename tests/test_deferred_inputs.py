"""Inputs that are computed when they are read: the same values as arrays of the host, in every way of reading."""

import pickle

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.campaigns.preparation import preparation
from warpdyn.campaigns.running.regions import deferred

STRUCTURES = 12
INPUTS = ("stiffness", "height", "structure", "motion_index", "scale_factor_of_motion", "im_level")


@pytest.fixture(scope="module")
def runs():
    """Return the run of a scene with arrays on the host, and with inputs that are deferred."""
    generator = np.random.default_rng(1)
    motions = [wd.GroundMotion(2 * generator.normal(size=50), 0.01, f"motion {number}") for number in range(3)]
    building = wd.ShearBuilding(
        mass=[2e4] * 3, stiffness=[2e7] * 3, height=[3.0] * 3, damping="rayleigh", damping_ratio=0.05
    )
    spread = {
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.4), per="storey"),
        "height": wd.RandomValue(wd.Uniform(2.5, 3.5)),
    }
    design = wd.Stripes(motions, [0.1, 0.4], wd.PeakGroundAcceleration())
    scene = wd.Scene(building, design, spread, recorders=("drift",))
    by_host = wd.simulate(scene, structures=STRUCTURES, device="cpu")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(preparation, "is_large_on_gpu", lambda run: True)
        return by_host, wd.simulate(scene, structures=STRUCTURES, device="cpu")


@pytest.fixture
def by_host(runs):
    return runs[0]


@pytest.fixture
def by_device(runs):
    return runs[1].copy()


@pytest.fixture
def filled(monkeypatch):
    """Return the names of the inputs that were computed, call by call."""
    calls = []
    fill = deferred.fill_inputs
    monkeypatch.setattr(deferred, "fill_inputs", lambda known, rows: calls.append(set(rows)) or fill(known, rows))
    return calls


def test_inputs_have_the_values_and_labels_of_the_host(by_host, by_device):
    assert [*by_device.variables] == [*by_host.variables]
    for name in INPUTS:
        assert not by_device[name].variable._in_memory
        assert by_device[name].dtype == by_host[name].dtype
        xr.testing.assert_identical(by_device[name].variable, by_host[name].variable)


@pytest.mark.parametrize(
    "samples", [5, -1, slice(7, 40), slice(None, None, 5), slice(None, None, -1), [3, 70, 4, 4], []], ids=str
)
def test_some_samples_are_read_alone(runs, filled, samples):
    by_host, by_device = runs
    for name in INPUTS:
        part = by_device[name].isel(sample=samples)
        np.testing.assert_array_equal(part.values, by_host[name].isel(sample=samples).values)
    by_storey = {"sample": samples, "storey": [2, 0]}
    np.testing.assert_array_equal(by_device["stiffness"].isel(by_storey), by_host["stiffness"].isel(by_storey))


def test_inputs_are_computed_once_and_scattered_parameters_together(by_device, filled):
    run = xr.Dataset({name: by_device[name].variable.copy() for name in INPUTS})
    for _ in range(2):
        for name in INPUTS:
            run[name].values  # noqa: B018
    assert sorted(map(sorted, filled)) == sorted([["height", "stiffness"], *([name] for name in INPUTS[2:])])


def test_inputs_can_be_pickled_written_and_changed(by_host, by_device, tmp_path):
    xr.testing.assert_identical(pickle.loads(pickle.dumps(by_device))["stiffness"], by_host["stiffness"])
    by_device.to_netcdf(tmp_path / "run.nc", engine="netcdf4")
    with xr.open_dataset(tmp_path / "run.nc") as read:
        np.testing.assert_array_equal(read["stiffness"], by_host["stiffness"])
    changed = by_device.copy(deep=True)
    changed["stiffness"][0] = 1.0
    assert changed["stiffness"].values[0].tolist() == [1.0] * 3
    np.testing.assert_array_equal(by_device["stiffness"], by_host["stiffness"])


def test_analyses_read_them(by_host, by_device):
    curves = [wd.fragility(run, {"slight": 0.001}) for run in (by_host, by_device)]
    xr.testing.assert_allclose(curves[1], curves[0], rtol=1e-6)
