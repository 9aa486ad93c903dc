"""Live display: its frames are those of simulate and NumPy, and the run never waits for it."""

from __future__ import annotations

import json
import socket
import threading
import time
import urllib.error
import urllib.request

import numpy as np
import pytest
from test_live import HOW, LIMITS, MOTION, STEP, live, scene

import warpdyn as wd
from warpdyn.interfaces.live_display.display import PERIOD
from warpdyn.interfaces.live_display.frames import MOST_STATES
from warpdyn.interfaces.live_display.series import MOST_TIMES, Series, envelope, numbers
from warpdyn.interfaces.live_display.server import MOST_REQUESTS

PATIENCE = 60.0  # s, the longest wait for a frame


def get(url: str, **headers: str) -> tuple[str, bytes, dict[str, str]]:
    request = urllib.request.Request(url, headers=headers)
    with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
        return answer.headers.get("ETag", "").strip('"'), answer.read(), dict(answer.headers)


def frame_of(display: wd.LiveDisplay, until: float, known: str = "") -> tuple[str, dict]:
    """Return the name and the content of the first frame at a time of the motion [s] or later."""
    limit = time.monotonic() + PATIENCE
    while time.monotonic() < limit:
        known, body, _ = get(f"{display.url}frame?after={known}")
        frame = json.loads(body) if body else {"time": -1.0}
        if frame["time"] >= until - 1e-9:
            return known, frame
    raise AssertionError(f"no frame of {until} s within {PATIENCE} s")


@pytest.fixture(scope="module")
def run():
    return wd.simulate(scene(), structures=20, histories=wd.Histories([3, 7]), **HOW)


def test_frames_show_the_motion_the_drifts_the_damage_and_the_loop(run):
    ensemble, shares = live(), []
    with wd.LiveDisplay(ensemble, sample=3, storey=2) as display:
        assert frame_of(display, 0.0)[1]["state"] == "waiting"
        for first in range(0, 400, 25):
            answer = ensemble.push(MOTION.acceleration[first : first + 25], start=first * STEP)
            shares.append(answer["damage_probability"].values)
        _, frame = frame_of(display, 3.99)
    drifts = run["peak_storey_drift_ratio"].values  # with the free vibration, which the scene does not exceed
    peaks = answer["peak_storey_drift_ratio"].values
    assert np.all(peaks <= drifts)
    np.testing.assert_allclose(frame["drift"]["quantiles"], np.quantile(peaks, [0.05, 0.5, 0.95], axis=0), atol=1e-5)
    assert frame["drift"]["floors"] == [0.0, 3.0, 6.0]
    assert frame["drift"]["limits"] == {name: pytest.approx(limit, rel=1e-3) for name, limit in LIMITS.items()}
    assert frame["drift"]["collapsed"] == int((answer["status"] == 1).sum()) > 0
    assert frame["shares"]["states"] == ["none", "slight", "moderate"]
    np.testing.assert_allclose(np.transpose(frame["shares"]["values"]), shares, atol=1e-4)  # also between frames
    np.testing.assert_allclose(frame["shares"]["times"], STEP * (np.arange(25, 401, 25) - 1), atol=1e-3)
    np.testing.assert_allclose(frame["motion"]["low"], MOTION.acceleration, atol=1e-3)
    history = run.isel(history=0, time=slice(399))
    drift = np.diff(history["displacement"].values, axis=1)[:, 0]
    np.testing.assert_allclose(frame["loop"]["x"], 1e3 * drift, atol=2e-4 * 1e3 * np.abs(drift).max())
    force = history["storey_force"].values[:, 1]
    np.testing.assert_allclose(frame["loop"]["y"], force / 1e3, atol=2e-4 * np.abs(force).max() / 1e3)
    assert (frame["state"], frame["packets"], frame["samples"], frame["loop"]["has_collapsed"]) == (
        "running",
        16,
        20,
        False,
    )
    assert frame["loop"]["title"] == "sample 3, storey 2"


def test_a_followed_sample_has_the_bits_of_the_histories_of_simulate(run):
    """Sample 7 collapses; its history ends there. More samples arrive than memory was reserved for."""
    from warpdyn.campaigns.live.followed_sample import FollowedSample

    for place, sample in enumerate((3, 7)):
        followed = FollowedSample(live().paused.ensemble, sample, 400)
        followed._reserve(60)
        parts = [followed.follow(MOTION.values[:end], "displacement", "storey_force") for end in (50, 51, 200, 400)]
        for name, found in zip(("displacement", "storey_force"), zip(*parts, strict=True), strict=True):
            due = run[name].values[place, :399]
            np.testing.assert_array_equal(np.concatenate(found).astype(due.dtype), due)
            assert np.isnan(due[-1]).all() == (sample == 7)


def test_a_display_that_begins_late_shows_the_loop_from_the_start_of_the_record(tmp_path):
    first = live()
    first.push(MOTION.acceleration[:100])
    saved = wd.save_state(first, tmp_path / "state.nc")
    with wd.LiveDisplay(first) as early:
        _, due = frame_of(early, 0.99)
    loaded = live()
    with wd.LiveDisplay(loaded) as display:
        wd.load_state(loaded, saved)
        loaded.push(MOTION.acceleration[100:102])
        _, frame = frame_of(display, 1.01)
    assert due["shares"]["times"] == [0.99]
    assert frame["loop"]["x"][:99] == pytest.approx(due["loop"]["x"], rel=1e-3, abs=1e-3)
    assert len(frame["loop"]["x"]) == 101


def test_a_loop_ends_at_the_collapse_of_its_sample(run):
    ensemble, known = live(), ""
    assert int(run["status"][7]) == 1
    with wd.LiveDisplay(ensemble, sample=7) as display:
        for end in (100, 101):  # seconds after the collapse
            ensemble.push(MOTION.acceleration[100 * (end - 100) : end])
            known, frame = frame_of(display, STEP * (end - 1), known)
            assert frame["loop"]["has_collapsed"]
            assert STEP * len(frame["loop"]["x"]) == pytest.approx(float(run["time_of_collapse"][7]), abs=2 * STEP)


def test_answers_without_samples_are_shown_if_they_contain_the_quantiles():
    quantiles = (0.16, 0.95, 0.5, 0.05)
    with pytest.raises(ValueError, match=r"give quantiles=\(0.05, 0.5, 0.95\) to wd.Live, or keep_samples=True"):
        wd.LiveDisplay(live(keep_samples=False))
    frames = []
    for ensemble in (live(), live(keep_samples=False, quantiles=quantiles)):
        with wd.LiveDisplay(ensemble, sample=None) as display:
            ensemble.push(MOTION.acceleration)
            frames.append(frame_of(display, 3.99)[1]["drift"])
    due, found = frames
    assert due["collapsed"] > 0
    np.testing.assert_allclose(found.pop("quantiles"), due.pop("quantiles"), atol=1e-5)  # 5 digits
    assert found == due


def test_the_loop_needs_no_new_thread(monkeypatch):
    """At the end of Python, before the display is closed, a pool of threads accepts no more tasks."""
    from warpdyn.campaigns.live.followed_sample import FollowedSample

    followed = FollowedSample(live().paused.ensemble, 3, 400)
    monkeypatch.setattr("concurrent.futures.ThreadPoolExecutor.submit", None)
    [displacement] = followed.follow(np.concatenate([MOTION.values, np.zeros(5000)]), "displacement")
    assert displacement.shape == (5399, 2)


def test_a_motion_that_ends_and_a_display_without_loop_and_damage_states():
    ensemble = wd.Live(scene(), 2, **HOW)
    with wd.LiveDisplay(ensemble, sample=None) as display:
        ensemble.push(MOTION.acceleration[:50])
        ensemble.finish()
        known, frame = frame_of(display, 0.49)
        while frame["state"] != "finished":
            known, frame = frame_of(display, 0.49, known)
        assert not {"loop", "shares"} & set(frame)
    assert repr(display).endswith("closed)")
    display.close()  # again: does nothing


def test_the_run_never_waits_for_the_display(monkeypatch):
    """The first frame is not ready before the last packet is answered, and a browser does not read its answer."""
    ensemble, released = live(), threading.Event()
    with wd.LiveDisplay(ensemble, sample=None) as display:
        of = display._frames.of
        monkeypatch.setattr(display._frames, "of", lambda answer: released.wait(PATIENCE) and of(answer))
        deaf = socket.create_connection(("127.0.0.1", int(display.url.split("/")[2].split(":")[1])))
        deaf.sendall(f"GET /{display.url.split('/')[3]}/frame HTTP/1.0\r\nHost: localhost\r\n\r\n".encode())
        for first in range(0, 400, 10):
            ensemble.push(MOTION.acceleration[first : first + 10])
        assert not released.is_set()
        released.set()
        _, frame = frame_of(display, 3.99)
        assert len(frame["shares"]["times"]) == 40
        deaf.close()
    assert not ensemble.observers
    assert not [each for each in threading.enumerate() if each is display._thread]


def test_frames_come_ten_times_per_second_and_a_failure_ends_only_the_display(monkeypatch):
    ensemble = live()
    display = wd.LiveDisplay(ensemble)
    calls = []
    of = display._frames.of
    monkeypatch.setattr(display._frames, "of", lambda answer: calls.append(time.perf_counter()) or of(answer))
    known = ""
    for first in range(0, 100, 2):
        ensemble.push(MOTION.acceleration[first : first + 2])
        time.sleep(0.01)
    apart = np.diff(calls)
    assert len(calls) >= 2
    assert apart.min() > 0.9 * PERIOD  # never more often
    monkeypatch.setattr(display._frames, "of", lambda answer: 1 / 0)
    ensemble.push(MOTION.acceleration[100:102])
    frame = {"state": ""}
    while frame["state"] != "failed":
        known, body, _ = get(f"{display.url}frame?after={known}")
        frame = json.loads(body) if body else frame
    ensemble.push(MOTION.acceleration[102:104])
    with pytest.warns(UserWarning, match=r"the live display has failed \(ZeroDivisionError.*not affected"):
        display.close()


def test_only_browsers_of_this_computer_get_the_page():
    with wd.LiveDisplay(live(), sample=None) as display:
        port = display.url.split("/")[2].split(":")[1]
        _, page, headers = get(display.url)
        assert b"<canvas" in page
        assert b"http" not in page.replace(b"http-equiv", b"")  # loads nothing else
        assert headers["Content-Security-Policy"].startswith("default-src 'none'")
        assert headers["Content-Security-Policy"].endswith("frame-ancestors 'none'")
        assert get(display.url.replace("127.0.0.1", "localhost"))[1] == page
        for address in (f"http://localhost:{port}/", f"http://localhost:{port}/frame", f"{display.url[:-2]}/"):
            with pytest.raises(urllib.error.HTTPError, match="404"):  # without the token, or with another one
                get(address)
        with pytest.raises(urllib.error.HTTPError, match="403"):
            get(display.url, Host="example.org")
        with pytest.raises(urllib.error.HTTPError, match="404"):
            get(f"{display.url}other")
        with socket.create_connection(("127.0.0.1", int(port))) as client:
            client.sendall(b"GET http://[/ HTTP/1.0\r\nHost: localhost\r\n\r\n")  # not a valid address
            assert b" 404 " in client.recv(100)
        with pytest.raises(ValueError, match=rf"port {port} is not free .*port=0"):
            wd.LiveDisplay(live(), sample=None, port=int(port))
        waiting = [socket.create_connection(("127.0.0.1", int(port)), timeout=PATIENCE) for _ in range(MOST_REQUESTS)]
        with socket.create_connection(("127.0.0.1", int(port)), timeout=PATIENCE) as one_more:
            assert one_more.recv(1) == b""  # closed at once
        for each in waiting:
            each.close()
    with pytest.raises(OSError, match=r"refused|reset|timed out"):
        socket.create_connection(("127.0.0.1", int(port)), timeout=1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sample": 20}, "sample must be a whole number of at least 0 and at most 19, got 20"),
        ({"sample": -1}, "sample must be a whole number of at least 0"),
        ({"storey": 0}, "storey must be a whole number of at least 1"),
        ({"storey": 3}, "at most 2, got 3"),
        ({"storey": "roof"}, "storey must be a whole number"),
        ({"port": 70000}, "port must be a whole number of at least 0 and at most 65535"),
    ],
)
def test_wrong_arguments_are_refused(arguments, message):
    ensemble = live()
    with pytest.raises(ValueError, match=message):
        wd.LiveDisplay(ensemble, **arguments)
    assert not ensemble.observers


def test_a_live_that_cannot_be_shown_is_refused():
    with pytest.raises(TypeError, match="a Live"):
        wd.LiveDisplay(scene())
    ensemble = wd.Live(scene(), 1, **HOW)
    ensemble.scene = scene(recorders=("acceleration",))
    with pytest.raises(ValueError, match='add "drift" to its recorders'):
        wd.LiveDisplay(ensemble)
    ensemble.scene = scene()
    ensemble.push(MOTION.acceleration[:2])
    ensemble.finish()
    with pytest.raises(ValueError, match=r"finished: make the display before finish\(\)"):
        wd.LiveDisplay(ensemble)


def test_series_are_thinned_and_numbers_are_short():
    series = Series()
    for time_ in range(20 * MOST_TIMES):
        series.append(float(time_), np.array([time_]))
        assert len(series.times) <= 2 * MOST_TIMES + 1
        assert series.times[-1] == time_
    assert series.times[0] == 0.0
    assert [float(value[0]) for value in series.values] == series.times
    assert np.diff(series.times[:-1]).max() < 20 * 3
    values = np.random.default_rng(1).normal(size=5 * MOST_TIMES)
    width, low, high = envelope(values)
    assert (low.min(), high.max(), low[0]) == (values.min(), values.max(), values[:width].min())
    assert len(low) <= MOST_TIMES < MOST_STATES
    assert envelope(np.zeros(0))[1].size == 0
    assert numbers(np.array([1234.5678, np.nan, -0.00001])) == [1234.6, None, 0.0]
    assert (numbers(np.array(0.0123456)), numbers(np.array(np.nan))) == (0.012346, None)
    assert numbers(np.array([1234.5678, np.nan, np.inf, -2.0])) == [1234.6, None, None, -2.0]


@pytest.mark.thorough
def test_the_loop_of_a_spring_of_a_lumped_structure():
    law = wd.laws.Bilinear(yield_force=2e5, hardening_ratio=0.05)
    frames = [
        wd.PlanFrame("a", (0.0, -5.0), "x", 3e7, law=law),
        wd.PlanFrame("b", (0.0, 7.0), "x", 1e7, law=law),
        wd.PlanFrame("c", (-8.0, 0.0), "y", 4e7, law=law),
    ]
    plan = [[-10.0, 10.0], [-8.0, 8.0]]
    damped = {"damping": "modal", "damping_ratio": 0.03}
    building = wd.TorsionalBuilding([2e5], plan, frames, base_motion="x", storey_height=3.5, **damped)
    lumped = wd.Scene(building, MOTION, recorders=("drift",))
    names = building.names_along("spring")
    run = wd.simulate(lumped, histories=wd.Histories(), **HOW)
    ensemble = wd.Live(lumped, 1, **HOW)
    with pytest.raises(ValueError, match=r"unknown storey \(the name of a spring\)"):
        wd.LiveDisplay(ensemble, storey="roof")
    with wd.LiveDisplay(ensemble, storey=names[1]) as display:
        ensemble.push(MOTION.acceleration)
        _, frame = frame_of(display, 3.99)
    assert frame["loop"]["title"] == f"sample 0, spring {names[1]}"
    assert frame["loop"]["labels"] == ["deformation [mm]", "force [kN]"]
    for axis, name, factor in (("x", "spring_deformation", 1e3), ("y", "spring_force", 1e-3)):
        due = factor * run[name].isel(history=0, time=slice(399)).values[:, 1]
        np.testing.assert_allclose(frame["loop"][axis], due, atol=2e-4 * np.abs(due).max())
