"""ESM, COSMOS and obspy: what the files say comes back, and what is wrong with them is said."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import record_files

import warpdyn as wd

pytestmark = pytest.mark.fast

VALUES = np.round(np.random.default_rng(5).normal(scale=40, size=203), 5)
PEAK = VALUES[np.argmax(np.abs(VALUES))]  # as a header states it


def write(folder: Path, content: str) -> Path:
    file = folder / "record.txt"
    file.write_text(content)
    return file


def test_esm(tmp_path):
    motion = wd.records.read_esm(write(tmp_path, record_files.esm(VALUES)))
    np.testing.assert_allclose(motion.acceleration, 0.01 * VALUES, rtol=2.3e-16)
    assert (motion.step, motion.record, motion.component) == (0.005, "XX STA1 X-1", "HNN")
    assert motion.name == "record"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (record_files.esm(VALUES, DATA_TYPE="VELOCITY"), "DATA_TYPE must be ACCELERATION, got 'VELOCITY'"),
        (record_files.esm(VALUES, UNITS="cm/s"), r"txt:11: unknown unit 'cm/s'"),
        (record_files.esm(VALUES, NDATA="204"), r"txt:8: truncated: 203 values follow, not the 204"),
        (record_files.esm(VALUES, NDATA="x"), r"txt:8: the number of values must be a whole number"),
        (
            record_files.esm(VALUES, **{"PGA_CM/S^2": "1.0"}),
            r"txt:12: the header states a peak of 1, but the largest value is",
        ),
        (record_files.esm(VALUES).replace("NDATA", "NDAT"), "the header of this ESM file lacks the line 'NDATA'"),
        (record_files.esm(VALUES).replace("STREAM:", "STREAM"), r"txt:10: expected 'NAME: value', got 'STREAM HNN'"),
        (record_files.esm(VALUES)[:300], "an ESM file has 64 header lines"),
        (record_files.esm(VALUES)[:-4], "truncated within its last value"),
        (record_files.esm(VALUES).replace(f"{VALUES[7]:.6f}", f"{VALUES[7]:.5f}"), "txt:72: .* in another form"),
    ],
)
def test_bad_esm(tmp_path, content, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read_esm(write(tmp_path, content))


def test_cosmos(tmp_path):
    """Channels one after the other; a value of ten characters leaves no blank between it and the one before."""
    other = VALUES.copy()
    other[3] = -345.67891
    channels = [record_files.cosmos(values, azimuth=a) for values, a in ((VALUES, 90), (other, 360), (other, 400))]
    file = write(tmp_path, "".join(channels))
    first, second = wd.records.read_cosmos(file)
    np.testing.assert_allclose(first.acceleration, 0.01 * VALUES, rtol=2.3e-16)
    np.testing.assert_allclose(second.acceleration, 0.01 * other, rtol=2.3e-16)
    assert (first.step, first.name, first.component, second.component) == (0.005, "record 090", "090", "360")
    assert wd.records.pairs([first, second]) == [(first, second)]
    assert [motion.component for motion in wd.records.read_cosmos(file, "vertical")] == ["UP"]
    assert len(wd.records.read_cosmos(file, "all")) == 3


@pytest.mark.parametrize(
    ("line", "spelling"),
    [
        ("units=cm/sec2(04),Format=(8F10.5)", "units=cm/sec2. (04)Format=(8f10.5)"),
        ("End-of-data for Chan  1 acceleration", "/&  ----------  End of data for channel  1  ----------"),
    ],
)
def test_cosmos_of_several_agencies(tmp_path, line, spelling):
    content = record_files.cosmos(VALUES)
    assert line in content
    (motion,) = wd.records.read_cosmos(write(tmp_path, content.replace(line, spelling)))
    assert motion.acceleration.size == 203


def test_cosmos_with_velocities(tmp_path):
    """Velocities of the same channel, which may follow, are passed over."""
    whole = record_files.cosmos(VALUES)
    start, end = whole.index("     203 acceleration"), whole.index("End-of-data")
    velocities = whole[start:end].replace("acceleration", "velocity").replace("cm/sec2(04)", "cm/sec(05)")
    (motion,) = wd.records.read_cosmos(write(tmp_path, whole[:end] + velocities + whole[end:]))
    assert motion.acceleration.size == 203


def test_cosmos_may_state_no_peak(tmp_path):
    content = record_files.cosmos(VALUES).replace(f"{PEAK:15.6f}", f"{-999.0:15.6f}")
    (motion,) = wd.records.read_cosmos(write(tmp_path, content))
    np.testing.assert_allclose(100 * motion.acceleration, VALUES, rtol=0, atol=0.5e-5)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (record_files.cosmos(VALUES, unit="counts(50)"), r"txt:48: 'counts' \(50\) is not a unit of acceleration"),
        (record_files.cosmos(VALUES, unit="g(04)"), r"txt:48: unit 'g' is not that of its code \(4\), 'cm/s2'"),
        (record_files.cosmos(VALUES, azimuth=400), r"no component of this file \('UP'\) is horizontal"),
        (record_files.cosmos(VALUES).replace("(Format v01.20 with", "(Format"), r"txt:1: expected '\(Format v01.20"),
        (record_files.cosmos(VALUES).replace("Real-header", "Rael-header"), "txt:25: expected '100 Real-header values"),
        (record_files.cosmos(VALUES).replace("       5.000000", "     -50.000000"), "has no step: its value 62"),
        (record_files.cosmos(VALUES).replace("       5.000000", "      50.000000"), "not the 1 s that this line"),
        (record_files.cosmos(VALUES)[:-60], "truncated: .* not the 203 that|may be truncated|before 'End-of-data'"),
        (record_files.cosmos(VALUES)[:4000], "truncated"),
        (record_files.cosmos(VALUES)[:1000], "follow, not the 100 that"),
        (
            record_files.cosmos(VALUES).replace(f"{VALUES[50]:10.5f}", f"{VALUES[50]:10.4f}"),
            "with 5 digits after the point",
        ),
        (record_files.cosmos(VALUES).replace(f"{PEAK:15.6f}", f"{1.1 * PEAK:15.6f}"), "states a peak of"),
        # Lines of 8 values follow line 48, so the value with index 50 is the third one of line 55.
        (
            record_files.cosmos(np.where(np.arange(203) == 50, 9999.0, VALUES)),
            r"txt:55: the value 9999 \(1 time in the file\) marks a missing value",
        ),
    ],
)
def test_bad_cosmos(tmp_path, content, message):
    with pytest.raises(ValueError, match=message):
        wd.records.read_cosmos(write(tmp_path, content))


class Stats(dict):
    """A dictionary with attributes, like obspy's Stats."""

    __getattr__ = dict.__getitem__


def trace(**changes) -> SimpleNamespace:
    stats = {"delta": 0.01, "calib": 2.0, "network": "BO", "station": "AKT013", "location": "", "channel": "EW"}
    return SimpleNamespace(
        stats=Stats(stats | {"starttime": "2011-03-11T05:46:48Z"} | changes.pop("stats", {})),
        data=changes.get("data", np.array([1, -2, 3], dtype=np.int32)),
        id="BO.AKT013..EW",
    )


def test_stream():
    (motion,) = wd.records.from_obspy([trace(stats={"knet": {}})])
    assert motion.acceleration.tolist() == [2.0, -4.0, 6.0]
    assert (motion.step, motion.name, motion.component) == (0.01, "BO.AKT013..EW", "EW")
    assert wd.records.from_obspy([trace()], "gal")[0].acceleration.tolist() == [0.02, -0.04, 0.06]
    with pytest.raises(ValueError, match=r"trace BO.AKT013..EW: the unit is unknown, .* give unit="):
        wd.records.from_obspy([trace()])
    with pytest.raises(ValueError, match=r"trace BO.AKT013..EW has gaps"):
        wd.records.from_obspy([trace(data=np.ma.array([1.0, 2.0, 3.0], mask=[False, True, False]))], "g")
    with pytest.raises(ValueError, match="the stream has no traces"):
        wd.records.from_obspy([])
    with pytest.raises(TypeError, match=r"takes an obspy Stream, .* got a sequence with an object of type str"):
        wd.records.from_obspy("AKT0131103111446.EW")


KNET = """Origin Time       2030/01/01 12:00:00
Lat.              38.103
Long.             142.860
Depth. (km)       24
Mag.              9.0
Station Code      AKT013
Station Lat.      39.8216
Station Long.     140.5702
Station Height(m) 35
Record Time       2030/01/01 12:01:00
Sampling Freq(Hz) 100Hz
Duration Time(s)  1
Dir.              {direction}
Scale Factor      3920(gal)/6182761
Max. Acc. (gal)   1.0
Last Correction   2030/01/01 12:01:00
Memo.
"""


def test_knet_through_obspy(tmp_path):
    """Counts times 3920 gal / 6182761; only where obspy is installed."""
    obspy = pytest.importorskip("obspy")
    counts = np.random.default_rng(2).integers(-9999, 9999, 100)
    stream = obspy.Stream()
    for direction, suffix in (("N-S", "NS"), ("E-W", "EW"), ("U-D", "UD")):
        body = "\n".join("".join(f"{value:9d}" for value in row) for row in counts.reshape(-1, 10))
        file = tmp_path / f"AKT0133001011201.{suffix}"
        file.write_text(KNET.format(direction=direction) + body + "\n")
        stream += obspy.read(file)
    motions = wd.records.from_obspy(stream)
    np.testing.assert_allclose(motions[0].acceleration, counts * 3920 / 6182761 / 100, rtol=1e-15)
    assert motions[0].step == 0.01
    assert len(wd.records.pairs(motions)) == 1


def test_esm_with_a_lost_leading_digit(tmp_path):
    """ESM prints a zero before the point, so '.127190' is a damaged '5.127190'."""
    text = record_files.esm(np.where(np.abs(VALUES) < 1, 2.5, VALUES))
    large = next(line for line in text.split("\n")[64:] if len(line.lstrip("-").split(".")[0]) == 1)
    damaged = text.replace(
        f"\n{large}\n", "\n" + ("-" if large[0] == "-" else "") + large[large.index(".") :] + "\n", 1
    )
    with pytest.raises(ValueError, match="has no digit before its point, which ESM always prints: a digit is lost"):
        wd.records.read_esm(write(tmp_path, damaged))
