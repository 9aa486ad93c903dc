"""Packets of live ensembles: their order, gaps, repetitions, clock drift, resampling and sources."""

from __future__ import annotations

import datetime
import socket
import sys
import threading
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

import warpdyn as wd
from warpdyn.campaigns.live.packets.receiver import Receiver
from warpdyn.campaigns.live.packets.track import Track

STEP, SIGNAL = 0.01, np.random.default_rng(1).normal(size=2000)
Packet, Refused = wd.packets.Packet, wd.packets.RefusedPacket


def receiver(components: int = 1, packet_step: float = STEP, patience: float = 0.5, longest_gap: float = 0.0):
    return Receiver((Track(packet_step, patience, longest_gap),) * components, packet_step, STEP, 1.0)


def part(first: int, last: int, drift: float = 0.0, **changes: object) -> Packet:
    return Packet(SIGNAL[first:last], 5.0 + first * STEP + drift, **changes)


def received(packets, into: Receiver | None = None) -> tuple[np.ndarray, Receiver]:
    into, parts = into or receiver(), []
    for packet in packets:
        values, into = into.accept(packet).take()
        parts.append(values)
    return np.concatenate(parts), into


def test_any_order_and_repetition_of_packets_gives_the_signal():
    random = np.random.default_rng(2)
    for _ in range(200):
        cuts = np.unique([0, *random.integers(1, 300, 12), 300])
        pieces = list(pairwise(cuts.tolist()))
        pieces += [pieces[i] for i in random.integers(0, len(pieces), 3)]
        start, *rest = sorted(pieces, key=lambda piece: piece[0] + 40 * random.random())
        if start[0]:
            start, rest = (0, start[1]), rest
        values, last = received((part(*piece) for piece in [start, *rest]), receiver(patience=3.0))
        np.testing.assert_array_equal(values[:, 0], SIGNAL[:300])
        assert (last.gap, last.end) == (0, pytest.approx(8.0))


def test_packets_without_time_stamps_follow_one_another():
    values, _ = received([Packet(SIGNAL[:7]), Packet(SIGNAL[7:8]), Packet(SIGNAL[8:90])])
    np.testing.assert_array_equal(values[:, 0], SIGNAL[:90])


def test_a_packet_without_time_stamp_follows_the_latest_sample_after_a_gap():
    _, waiting = received([part(0, 50), part(75, 80), Packet(SIGNAL[80:90])])
    values, _ = received([part(50, 75)], waiting)
    np.testing.assert_array_equal(values[:, 0], SIGNAL[50:90])


def test_numbers_of_late_repeated_and_overlapping_packets():
    pieces = [(0, 10), (0, 10), (20, 30), (12, 15), (5, 12), (15, 20), (28, 40)]
    values, last = received(part(*piece) for piece in pieces)
    np.testing.assert_array_equal(values[:, 0], SIGNAL[:40])
    assert last.counts == Counter(duplicate_packets=1, late_packets=1, overlapping_samples=7, gaps_closed=2)


def test_a_short_gap_is_interpolated_after_the_patience_and_a_long_one_is_refused():
    pieces = [(0, 100), (104, 150)]
    _, waiting = received((part(*piece) for piece in pieces), receiver(longest_gap=0.05))
    assert waiting.gap == pytest.approx(0.04)
    values, last = received([part(150, 200)], waiting)
    np.testing.assert_allclose(values[:4, 0], np.interp(range(100, 104), [99, 104], SIGNAL[[99, 104]]), rtol=1e-13)
    np.testing.assert_array_equal(values[4:, 0], SIGNAL[104:200])
    assert last.counts["interpolated_samples"] == 4
    _, waiting = received(part(*piece) for piece in pieces)
    with pytest.raises(Refused, match=r"0\.04 s of the motion are missing after 6\.0+ s .* live\.bridge\(\)"):
        waiting.accept(part(150, 200))
    values, _ = received([part(100, 104), part(150, 200)], waiting)  # the refused packet changed nothing
    np.testing.assert_array_equal(values[:, 0], SIGNAL[100:200])
    bridged, _ = waiting.bridge().take()
    np.testing.assert_array_equal(bridged[4:, 0], SIGNAL[104:150])


def test_a_slow_clock_drift_is_measured_and_a_wrong_step_is_refused():
    drifting = (part(first, first + 20, drift=2e-4 * first * STEP) for first in range(0, 2000, 20))
    values, last = received(drifting)
    np.testing.assert_array_equal(values[:, 0], SIGNAL)
    assert last.drift == pytest.approx(2e-4 * 1980 * STEP, rel=1e-6)
    with pytest.raises(Refused, match=r"the sampling step is 0\.0102 s and not 0\.01 s"):
        received(part(first, first + 5, drift=0.02 * first * STEP) for first in range(0, 2000, 5))


@pytest.mark.parametrize(
    ("packet", "message"),
    [
        (Packet([0.1, np.nan]), r"acceleration\[1, 0\] is nan \(1 of 2 values are not finite\)"),
        (Packet(np.ma.array([0.1, 0.2], mask=[0, 1])), "masked.*stream.split"),
        (Packet([]), r"it is empty \(acceleration=\[\]\): push packets"),
        (Packet(None), "it is empty"),
        (Packet([0.1], start=1e5 + 6), r"it starts 100000 s after the next expected sample"),
        (Packet([[0.1, 0.2]]), r"the motion has 1 component: give values of shape \[time\]"),
        (Packet(["a"]), "must be numbers"),
        (Packet([981.0]), r"its peak is 981 m/s2 \(100 g\).*cm/s2"),
        (Packet([0.1], step=0.02), "sampling_step=0.02 to wd.Live"),
        (Packet([0.1], component=1), "component must be from 0 to 0"),
        (Packet([0.1], start=6.0045), "0.45 steps after the next expected sample"),
        (Packet([0.1], start=-90.0), "its time goes back by 96 s, but only the last 1 s can be compared"),
        (Packet([0.1], start=5.5), "1 of 1 samples that have arrived before have other values"),
    ],
)
def test_an_unusable_packet_is_refused(packet, message):
    _, before = received([part(0, 100)])
    with pytest.raises(Refused, match=message):
        before.accept(packet)


@pytest.mark.parametrize("start", ["2026-01-01T00:00:00+00:00", np.datetime64("2026-01-01"), datetime.datetime.now()])
def test_a_date_as_start_is_refused_with_the_way_to_seconds(start):
    with pytest.raises(TypeError, match=r"must be a number of seconds, such as POSIX time.*timestamp\(\)"):
        Packet([0.1], start)
    assert (np.datetime64("1970-01-02") - np.datetime64(0, "s")) / np.timedelta64(1, "s") == 86400


def test_a_server_that_does_not_answer_is_named():
    with socket.create_server(("localhost", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(ConnectionRefusedError, match=f"cannot connect to localhost:{port} .*start the server first"):
        next(wd.packets.from_socket("localhost", port))


def test_components_that_arrive_separately_are_joined_from_their_common_start():
    other = -SIGNAL
    packets = [
        part(0, 50, component=0),
        Packet(other[10:30], 5.0 + 10 * STEP, component=1),
        Packet(other[30:60], 5.0 + 30 * STEP, component=1),
        part(50, 80, component=0),
    ]
    values, last = received(packets, receiver(2))
    np.testing.assert_array_equal(values, np.stack([SIGNAL[10:60], other[10:60]], axis=1))
    assert last.begin == pytest.approx(5.1)
    with pytest.raises(Refused, match=r"0\.4 steps between two samples"):
        received([part(0, 50, component=0), Packet(other[:9], 5.004, component=1)], receiver(2))


@pytest.mark.parametrize("packet_step", [0.005, 0.02, 0.007, 0.013])
def test_resampled_packets_are_the_resampled_record(packet_step):
    record = wd.GroundMotion(SIGNAL[:701], packet_step)
    random, at, packets = np.random.default_rng(3), 0, []
    while at < 701:
        count = random.integers(1, 30)
        packets.append(Packet(record.acceleration[at : at + count], at * packet_step))
        at += count
    values, last = received(packets, receiver(packet_step=packet_step))
    due = record.resampled(STEP).acceleration
    np.testing.assert_array_equal(values[:, 0], due[: len(values)])
    assert len(due) - len(values) == last.ends_between_samples


def test_a_socket_delivers_all_digits():
    with socket.create_server(("localhost", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                for first in range(0, 300, 30):
                    connection.sendall(wd.packets.to_line(part(first, first + 30)))
                connection.sendall(b'{"accelerations": [1]}\n')

        threading.Thread(target=serve).start()
        packets, into = wd.packets.from_socket("localhost", server.getsockname()[1], timeout=10.0), receiver()
        values, _ = received((next(packets) for _ in range(10)), into)
        with pytest.raises(Refused, match=r"is not a packet.*one line of JSON"):
            next(packets)
    np.testing.assert_array_equal(values[:, 0], SIGNAL[:300])
    with pytest.raises(TypeError, match=r"give the host first, then the port"):
        next(wd.packets.from_socket(5000, "localhost"))


def test_a_missing_obspy_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "obspy.clients.seedlink.easyseedlink", None)
    packets = wd.packets.from_seedlink("localhost:18000", "XX", "TEST", "HNZ")
    with pytest.raises(ImportError, match=r'pip install "obspy>=1.4"'):
        next(packets)


def traces(channel: str = "HNZ", kind: type = np.int32, gap: int = 0):
    """Return the signal as counts in three traces of two components that arrive in turn."""
    obspy = pytest.importorskip("obspy")
    counts, start = np.round(1e4 * SIGNAL[:900]).astype(kind), obspy.UTCDateTime(1_700_000_000)
    found = []
    for first in range(0, 900, 300):
        at = first + (gap if first else 0)
        header = {"network": "XX", "station": "TEST", "channel": channel, "delta": STEP, "starttime": start + at * STEP}
        found.append(obspy.Trace(counts[at : first + 300], header))
    return found, counts


def test_traces_of_obspy_become_packets():
    found, counts = traces()
    packets = list(wd.packets.from_obspy(found, sensitivity=1e4))
    values, last = received(packets)
    np.testing.assert_array_equal(values[:, 0], counts / 1e4)
    assert last.begin == 1_700_000_000
    with pytest.raises(Refused, match="counts of the digitizer: give sensitivity="):
        list(wd.packets.from_obspy(found))
    with pytest.raises(Refused, match="ends in 0 of the components"):
        list(wd.packets.from_obspy(found, components=("E", "N"), sensitivity=1e4))
    north, _ = traces("HNN")
    assert [each.component for each in wd.packets.from_obspy(north, components=("E", "N"), sensitivity=1e4)] == [1] * 3


def test_a_gap_in_the_data_of_a_seedlink_server_is_found():
    found, counts = traces(gap=7)
    from seedlink_server import serve

    server = f"localhost:{serve(found)}"
    packets = wd.packets.from_seedlink(server, "XX", "TEST", "HNZ", sensitivity=1e4, timeout=20.0)
    values, last = received(packets, receiver(patience=10.0))
    np.testing.assert_array_equal(values[:, 0], counts[:300] / 1e4)
    assert last.gap == pytest.approx(7 * STEP)
