"""Units of acceleration, and what headers and names of columns state about quantity, unit, step and samples."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd

pytestmark = pytest.mark.fast

TIME = 0.01 * np.arange(200)
VALUES = np.sin(7 * TIME) * np.exp(-TIME)
G = 9.80665  # m/s2, by definition
FACTORS = {
    1.0: "m/s2 m/s^2 m/s**2 m/s² M/S2 m/sec2 m/sec/sec m/s/s m.s-2 m·s⁻² m*s^-2 m~s-2 m~s\u22122 m/(s^2) m/s^{2} ms-2",
    0.01: "cm/s2 cm/sec^2 CM/SEC/SEC cm/s/s cm.s-2 cm~s-2 cm/sec² gal Gal GALS cm/s**2 cm/sec/sec.",
    0.001: "mm/s2 mm/s/s mm/sec^2 mm~s-2",
    1e-9: "nm/s2 nm/s**2 nm/s/s",
    0.0254: "in/s2 in/sec^2 inch/s2 IN/SEC/SEC inches/s2",
    0.3048: "ft/s2 ft/sec/sec feet/s2 ft/s²",
    G: "g G g's gravity",
    0.01 * G: "%g %G %~g percent~g %~of~g",
    0.001 * G: "mg milli-g",
    0.1 * G: "G/10",
}
SPELLINGS = [(spelling.replace("~", " "), factor) for factor, row in FACTORS.items() for spelling in row.split()]


@pytest.mark.parametrize(("spelling", "factor"), SPELLINGS)
def test_units(spelling, factor):
    motion = wd.records.from_array([0.0, 1.0], 0.01, spelling)
    assert motion.peak_ground_acceleration == pytest.approx(factor, rel=2.3e-16)  # one rounding


def test_words_for_units():
    assert wd.records.from_array([0.0, 1.0], 0.01, "meter per second squared").peak_ground_acceleration == 1.0


@pytest.mark.parametrize(
    "unit", ["m/s", "cm/s", "m", "cm", "m/s3", "m2/s2", "counts", "V", "kg", "s", "", "gee", "/s2"]
)
def test_what_is_no_unit_of_acceleration(unit):
    with pytest.raises(
        ValueError, match=r"unknown unit .*, allowed are 'm/s2', .*'gal', 'g', '%g', 'mg', 'in/s2', 'ft"
    ):
        wd.records.from_array([0.0, 1.0], 0.01, unit)


def write(folder: Path, header: str, *columns: np.ndarray, mark: str = ",", name: str = "quake.csv") -> Path:
    rows = zip(*(columns or (TIME, VALUES)), strict=True)
    (folder / name).write_text(header + "".join(mark.join(f"{each:.6f}" for each in row) + "\n" for row in rows))
    return folder / name


@pytest.mark.parametrize(
    ("header", "unit", "message"),
    [
        ("time,acc(gal)\n", "m/s2", r"'acc\(gal\)', says gal, but unit='m/s2' .* factor of 100: give unit='gal'"),
        ("t;a [cm/s²]\n", "g", r"'a \[cm/s²\]', says cm/s2, but unit='g'"),
        ("time,acceleration_ms2\n", "g", "says ms2, but unit='g'"),
        ("time,acc_g\n", "m/s2", "says g, but unit='m/s2'"),
        ("Time (s)  Acceleration (in/s2)\n", "cm/s2", "says in/s2, but unit='cm/s2'"),
        ("time,Acc. in g\n", "gal", "says g, but unit='gal'"),
        ("# units: cm/s^2\n", "m/s2", r"the header says cm/s\^2, but unit='m/s2'"),
        ("# acceleration in g\n", "m/s2", "the header says g, but unit='m/s2'"),
        ("#AmplitudeUnit:  gal. DCoffset(corr)\n", "m/s2", "the header says gal"),
        ("Time [s],Velocity [m/s]\n", "m/s2", "says velocity in m/s, not acceleration"),
        ("Time [s]  Velocity [m/s]\n", "m/s2", "says velocity in m/s, not acceleration"),
        ("time,disp_cm\n", "cm/s2", "says displacement in cm, not acceleration"),
        ("time,vel\n", "g", "'vel', says velocity, not acceleration"),
        ("time,counts\n", "g", "says counts, not acceleration"),
        ("frequency (Hz),Fourier (Hz)\n", "g", "says frequency in hz, not acceleration"),
        ("VELOCITY TIME SERIES IN UNITS OF CM/S\n", "cm/s2", "the header says velocity in cm/s, not acceleration"),
        ("# Data type: displacement\n", "cm/s2", "the header says displacement, not acceleration"),
    ],
)  # fmt: skip
def test_headers_that_contradict_the_arguments(tmp_path, header, unit, message):
    mark = ";" if ";" in header else "," if "," in header else " "
    with pytest.raises(ValueError, match=message):
        wd.records.read_text(write(tmp_path, header, mark=mark), unit=unit)


@pytest.mark.parametrize(
    ("header", "unit"),
    [
        ("time,acc(gal)\n", "cm/s2"),
        ("Time [s],Acceleration [m/s²]\n", "m/s2"),
        ("Time (s) Acceleration (cm/sec/sec)\n", "gal"),
        ("# PGA = 0.34 g\n# Vs30 = 300 m/s, shear wave velocity\ntime,acc\n", "m/s2"),
        ("# Peak velocity (cm/s): 12, peak acceleration (g): 0.3\nt,a\n", "m/s2"),
        ("# units: g, cm/s and cm for acceleration, velocity and displacement\nt,a\n", "g"),
        ("recorded by us\nt,NS\n", "gal"),
        ("# dt = 0.01 s, npts = 200\nt,a\n", "g"),
        ("# sampling rate 100 Hz\nt,a\n", "g"),
    ],
)
def test_headers_that_agree(tmp_path, header, unit):
    mark = "," if "," in header.splitlines()[-1] else " "
    with warnings.catch_warnings(action="error"):
        motion = wd.records.read_text(write(tmp_path, header, mark=mark), unit=unit)
    assert motion.acceleration.size == 200


def test_a_column_of_several(tmp_path):
    file = write(tmp_path, "Time(s) Acc(g) Vel(cm/s)\n", TIME, VALUES, 0.5 * VALUES, mark=" ")
    assert wd.records.read_text(file, unit="g", time_column=0, acceleration_column=1).acceleration.size == 200
    with pytest.raises(ValueError, match=r"'Vel\(cm/s\)', says velocity in cm/s"):
        wd.records.read_text(file, unit="g", time_column=0, acceleration_column=2)


@pytest.mark.parametrize("values", [TIME, TIME + 5.0, np.arange(200.0), np.arange(1, 201) / 128])
def test_times_are_no_accelerations(tmp_path, values):
    with pytest.raises(
        ValueError, match=r"column 0, which is read as acceleration, increases evenly by .*times or a cou"
    ):
        wd.records.read_text(write(tmp_path, "", values), unit="g", step=0.01)
    file = write(tmp_path, "time,acc\n", values, VALUES)
    with pytest.raises(ValueError, match=r"'time', says time, not acceleration"):
        wd.records.read_text(file, unit="g", step=0.01, acceleration_column=0)


@pytest.mark.parametrize(
    ("first", "step", "message"),
    [
        ("0.010000\n", 0.01, r"quake.csv:1: '0\.010000' is the step, not a sample: give header_lines=1"),
        (".01\n", 0.01, r"'\.01' is the step"),
        ("200\n", 0.01, "'200' is the number of samples, not a sample"),
        ("200\n0.01\n", 0.01, "'200' is the number of samples, not a sample"),
    ],
)
def test_the_step_is_no_sample(tmp_path, first, step, message):
    file = write(tmp_path, first, VALUES)
    with pytest.raises(ValueError, match=message):
        wd.records.read_text(file, unit="g", step=step)
    motion = wd.records.read_text(file, unit="g", step=step, header_lines=first.count("\n"))
    np.testing.assert_allclose(motion.acceleration, G * np.round(VALUES, 6), rtol=2.3e-16, atol=0)


def test_a_first_value_that_may_be_the_step(tmp_path):
    with pytest.warns(UserWarning, match=r"'0\.005000' may be the step \[s\], although step=0\.01 is given"):
        wd.records.read_text(write(tmp_path, "0.005000\n", 1e-4 * VALUES), unit="g", step=0.01)


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (
            "# dt = 0.005 s\n",
            r"the header says 'dt = 0\.005 s', but the step is 0\.01 s: give step=0\.005",
        ),
        ("# time step: 5 ms\n", "give step=0.005"),
        ("# Sampling rate (Hz): 200\n", "give step=0.005"),
        ("# npts = 300\n", "the header says 300 samples, but 200 follow"),
    ],
)
def test_steps_and_counts_that_contradict_the_header(tmp_path, header, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read_text(write(tmp_path, header, VALUES), unit="g", step=0.01)
    with pytest.raises(ValueError, match=message):
        wd.records.read_text(write(tmp_path, header), unit="g")


def test_a_missing_step_is_suggested(tmp_path):
    with pytest.raises(ValueError, match=r"step= \[s\] must be given: the header says 'dt = 0\.01', so step=0\.01"):
        wd.records.read_text(write(tmp_path, "# dt = 0.01\n", VALUES), unit="g")


def test_components_of_columns(tmp_path):
    file = write(tmp_path, "t,acc_NS (gal),acc_UD (gal)\n", TIME, VALUES, 0.5 * VALUES)
    for column, component in (("acc_NS (gal)", "NS"), ("acc_UD (gal)", "UD")):
        motion = wd.records.read_text(file, unit="gal", time_column="t", acceleration_column=column)
        assert (motion.record, motion.component) == ("quake", component)
    motion = wd.records.read_text(write(tmp_path, "# Component: N26W\n", name="a.txt"), unit="g")
    assert (motion.record, motion.component) == ("a", "N26W")
    motion = wd.records.read_text(write(tmp_path, "", name="kobe_EW.txt"), unit="g")
    assert (motion.record, motion.component) == ("kobe", "EW")
    motion = wd.records.read_text(write(tmp_path, "", name="kobe.txt"), unit="g")
    assert (motion.record, motion.component) == ("", "")


def test_datasets_of_velocities():
    data = xr.DataArray(VALUES, {"time": TIME}, dims="time", name="ground_velocity", attrs={"units": "g"})
    with pytest.raises(ValueError, match="'ground_velocity' says velocity, not acceleration"):
        wd.records.from_dataset(data)
    data = data.rename("motion").assign_attrs(long_name="Displacement of the ground")
    with pytest.raises(ValueError, match="says displacement, not acceleration"):
        wd.records.from_dataset(data)
