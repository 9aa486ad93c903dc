"""Streams of obspy: units, counts, velocities, records and pairs. Tests with files run where obspy is installed."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

import warpdyn as wd

pytestmark = pytest.mark.fast

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
Dir.              E-W
Scale Factor      3920(gal)/6182761
Max. Acc. (gal)   {peak:.3f}
Last Correction   2030/01/01 12:00:00
Memo.
"""
COUNTS = np.random.default_rng(2).integers(-99999, 99999, 100)
GAL = COUNTS * 3920 / 6182761


class Stats(dict):
    """A dictionary with attributes, like obspy's Stats."""

    __getattr__ = dict.__getitem__


def trace(channel: str = "HNE", data: np.ndarray | None = None, start: float = 0.0, **stats: object) -> SimpleNamespace:
    values = np.sin(0.1 * np.arange(300)) if data is None else data
    told = {"delta": 0.01, "calib": 1.0, "network": "XX", "station": "STA1", "location": "", "channel": channel}
    told |= {"starttime": start, "endtime": start + 0.01 * (len(values) - 1)} | stats
    return SimpleNamespace(stats=Stats(told), data=values, id=f"XX.STA1.{told['location']}.{channel}")


@pytest.fixture
def knet(tmp_path):
    pytest.importorskip("obspy")
    file = tmp_path / "AKT0133001011201.EW"
    body = "\n".join("".join(f"{value:9d}" for value in row) for row in COUNTS.reshape(-1, 10))
    file.write_text(KNET.format(peak=np.abs(GAL - GAL.mean()).max()) + body + "\n")
    return file


def test_knet_is_in_si_units(knet):
    import obspy

    for unit in (None, "m/s2", "m/s²"):
        (motion,) = wd.records.from_obspy(obspy.read(knet), unit=unit)
        # The product of two factors is rounded twice, in another order.
        np.testing.assert_allclose(motion.acceleration, GAL / 100, rtol=1e-15)
    for unit in ("gal", "cm/s2", "g"):
        with pytest.raises(ValueError, match=rf"in m/s2, by the K-NET file's scale factor, but unit='{unit}' is given"):
            wd.records.from_obspy(obspy.read(knet), unit=unit)


def test_knet_is_not_calibrated_twice(knet):
    import obspy

    with pytest.raises(ValueError, match="the calibration was applied already: leave out apply_calib=True"):
        wd.records.from_obspy(obspy.read(knet, apply_calib=True))
    stream = obspy.read(knet, apply_calib=True)
    stream[0].stats.calib = 1.0
    np.testing.assert_allclose(wd.records.from_obspy(stream)[0].acceleration, GAL / 100, rtol=1e-15)


def test_removed_responses():
    """The response of obspy's example stream, removed by obspy."""
    obspy = pytest.importorskip("obspy")
    for output, message in (("VEL", "velocities"), ("DISP", "displacements")):
        stream = obspy.read().remove_response(obspy.read_inventory(), output=output)
        for unit in (None, "m/s2"):
            with pytest.raises(ValueError, match=f"its values are {message}, not accelerations"):
                wd.records.from_obspy(stream, unit)
    stream = obspy.read().remove_response(obspy.read_inventory(), output="ACC")
    motions = wd.records.from_obspy(stream)
    np.testing.assert_array_equal(motions[0].acceleration, stream[0].data)
    with pytest.raises(ValueError, match=r"by remove_response\(output='ACC'\), but unit='gal' is given"):
        wd.records.from_obspy(stream, "gal")


def test_miniseed_contains_counts(tmp_path):
    obspy = pytest.importorskip("obspy")
    header = {"station": "STA1", "channel": "HNE", "delta": 0.01}
    obspy.Stream([obspy.Trace(COUNTS.astype(np.int32), header)]).write(str(tmp_path / "a.mseed"), format="MSEED")
    with pytest.raises(ValueError, match=r"whole numbers \(type int32\), so they are counts of the digitizer"):
        wd.records.from_obspy(obspy.read(tmp_path / "a.mseed"), "gal")


def test_sac_says_what_it_contains(tmp_path):
    obspy = pytest.importorskip("obspy")
    header = {"station": "STA1", "channel": "HNE", "delta": 0.01}
    obspy.Stream([obspy.Trace(GAL.astype(np.float32), header)]).write(str(tmp_path / "a.sac"), format="SAC")
    stream = obspy.read(tmp_path / "a.sac")
    # SAC stores float32.
    np.testing.assert_allclose(wd.records.from_obspy(stream, "gal")[0].acceleration, GAL / 100, rtol=1.2e-7)
    for code, quantity in ((6, "displacements"), (7, "velocities"), (50, "volts")):
        stream[0].stats.sac.idep = code
        with pytest.raises(ValueError, match=f"its values are {quantity}, not accelerations"):
            wd.records.from_obspy(stream, "gal")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (trace(processing=["integrate(method='cumtrapz')"]), "its values are integrals"),
        (trace(_format="GSE2", calib=0.09), "the calibration of GSE2 gives displacements at one period"),
        (trace(data=COUNTS), "counts of the digitizer"),
    ],
)
def test_other_quantities_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        wd.records.from_obspy([given], "m/s2")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (trace(data=COUNTS.astype(float)), "all its values are whole numbers, so they may be counts"),
        (trace(channel="BHE"), "channel BHE is a seismometer, which measures velocity"),
        (trace(response="a response"), "the response of the instrument was not removed"),
    ],
)
def test_values_that_may_be_no_accelerations(given, message):
    with pytest.warns(UserWarning, match=message):
        wd.records.from_obspy([given], "m/s2")


def test_an_accelerometer_warns_of_nothing():
    with warnings.catch_warnings(action="error"):
        wd.records.from_obspy([trace("HNE"), trace("HNN", start=0.004), trace("HNZ")], "m/s2")
        wd.records.from_obspy([trace("BHE", processing=["remove_response(output='ACC')"])], "m/s2")


@pytest.mark.filterwarnings("ignore:.*seismometer")
def test_pairs_of_two_instruments_and_two_events():
    """Components that start a few milliseconds apart are one record; BHE and HNE, two locations and events are not."""
    traces = [
        trace(f"{sensor}{axis}", start=event + 0.003 * i, location=location)
        for event in (0.0, 500.0)
        for sensor, location in (("HN", "00"), ("HN", "10"), ("BH", "00"))
        for i, axis in enumerate("ENZ")
    ]
    both = wd.records.pairs(wd.records.from_obspy(traces, "m/s2"))
    assert len(both) == 6
    assert [(first.component, second.component) for first, second in both[:1]] == [("HNE", "HNN")]
    for first, second in both:
        assert first.name[:-1] == second.name[:-1]
        assert first.record == second.record


def test_components_that_do_not_start_together():
    with pytest.warns(UserWarning, match=r"HNN starts 0\.5 s after another component .*: use stream\.trim"):
        motions = wd.records.from_obspy([trace("HNE"), trace("HNN", start=0.5)], "m/s2")
    assert len(wd.records.pairs(motions)) == 1
