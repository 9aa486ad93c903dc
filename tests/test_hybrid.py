"""Hybrid tests over a socket on the loopback interface, against responses that were computed without warpdyn."""

import socket
import threading
import time
from collections import deque

import numpy as np
import pytest
from validation import difference

import warpdyn as wd

TURN, MASS = 2 * np.pi, 1e3
STIFFNESS = MASS * TURN**2
# An oscillator of 1 Hz with 60 % of its stiffness in the external substructure.
COMPUTED = wd.ShearBuilding(MASS, 0.4 * STIFFNESS, 3.0, damping="storey", damping_coefficient=0.04 * TURN * MASS)
TIME = np.arange(0.0, 20.005, 0.01)
MOTION = wd.GroundMotion(2.0 * np.sin(TURN * 1.1 * TIME) * np.exp(-0.2 * TIME), 0.01, "decaying sine")
STEP = 0.0025
# Delay of the measured force -> peak, displacements at 2, 5, 10 and 20 s; the response without delay is exact.
RESPONSES = {
    0.0: (0.256777494, [0.16849508, 0.027348922, 0.0053182495, 0.0023723854]),
    0.01: (0.334125295, [0.19531113, 0.097574283, 0.063929933, 0.074605366]),
}


def late_spring(delay):
    """Return the force of a spring whose displacement is measured late [s]."""
    waiting = deque([0.0] * round(delay / STEP))

    def force(displacement, velocity, acceleration, time):
        waiting.append(float(displacement[0]))
        return 0.6 * STIFFNESS * waiting.popleft()

    return force


@pytest.mark.parametrize("delay", RESPONSES)
def test_oscillator_with_a_late_substructure(delay, measured):
    with wd.hybrid.Substructure(late_spring(delay)) as specimen:
        result = wd.hybrid.HybridTest(COMPUTED, 1, specimen.address, step=STEP, data_size=16).run(MOTION)
    peak, due = RESPONSES[delay]
    displacement = result["displacement"].values[:, 0]
    found = displacement[[round(at / STEP) for at in (2.0, 5.0, 10.0, 20.0)]]
    value = max(difference(found, due), abs(np.abs(displacement).max() - peak)) / peak
    measured(
        "hybrid test over a socket, force without and with a delay of 10 ms",
        truth="the delay differential equation, integrated without warpdyn with steps of 0.25 ms",
        value=value,
        bound=2e-3,
    )
    assert specimen.error is None
    assert specimen.commits == result.sizes["time"]
    assert result.attrs["missed_deadlines"] == 0


def test_the_method_has_order_2():
    errors = []
    for step in (0.01, 0.005):
        with wd.hybrid.Substructure(lambda u, v, a, t: 0.6 * STIFFNESS * u) as specimen:
            result = wd.hybrid.HybridTest(COMPUTED, 1, specimen.address, step=step, data_size=16).run(
                MOTION, duration=5.0
            )
        errors.append(abs(result["displacement"].values[-1, 0] - RESPONSES[0.0][1][1]))
    assert 1.8 <= np.log2(errors[0] / errors[1]) <= 2.2


def test_several_interfaces_and_the_protocol():
    """A client of another program sees the layout of the messages: 11 integers, then arrays of one size."""
    seen = {}

    def serve(server):
        link, _ = server.accept()
        with link:
            header = np.frombuffer(link.recv(44, socket.MSG_WAITALL), "<i4")
            seen["header"] = header.tolist()
            size = 8 * int(header[-1])
            seen["actions"], seen["trial"] = [], None
            while True:
                message = np.frombuffer(link.recv(size, socket.MSG_WAITALL), "<f8")
                seen["actions"].append(int(message[0]))
                if message[0] == 3:
                    seen["trial"] = message
                if message[0] == 10:
                    answer = np.zeros(int(header[-1]))
                    answer[:2] = 1e6 * seen["trial"][1:3]
                    link.sendall(answer.tobytes())
                if message[0] == 99:
                    return

    building = wd.ShearBuilding([1e4, 1e4], 1e6, 3.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        thread = threading.Thread(target=serve, args=(server,))
        thread.start()
        test = wd.hybrid.HybridTest(building, [1, {2: 1.0}], server.getsockname(), step=0.01, data_size=32)
        result = test.run(MOTION, duration=0.05)
        thread.join(timeout=5)
    assert seen["header"] == [2, 2, 2, 0, 1, 2, 2, 2, 2, 1, 32]
    assert seen["actions"] == [3, 10, 5] * 6 + [99]
    np.testing.assert_allclose(seen["trial"][1:3], result["command"].values[-1])
    assert seen["trial"][7] == pytest.approx(0.05)
    np.testing.assert_allclose(result["command"].values[-1], result["displacement"].values[-1])
    np.testing.assert_allclose(result["measured_force"].values, 1e6 * result["command"].values)


def test_missed_deadlines_are_counted():
    def slow(u, v, a, t):
        if 0.095 < t < 0.125:
            time.sleep(0.2)
        return 0.6 * STIFFNESS * u

    with wd.hybrid.Substructure(slow) as specimen:
        test = wd.hybrid.HybridTest(COMPUTED, 1, specimen.address, step=0.01, time_scale=10.0)
        with pytest.warns(UserWarning, match=r"of 20 deadlines were missed; the longest exchange took 0\.2"):
            result = test.run(MOTION, duration=0.2)
    assert result.attrs["missed_deadlines"] >= 3
    assert result.attrs["longest_exchange"] >= 0.2


def test_lost_connections_and_limits():
    def run(force, **limits):
        with wd.hybrid.Substructure(force) as specimen:
            wd.hybrid.HybridTest(COMPUTED, 1, specimen.address, step=0.01, timeout=0.5, **limits).run(MOTION)

    def breaks(u, v, a, t):
        if t > 0.5:
            raise RuntimeError("the specimen broke")
        return 0.6 * STIFFNESS * u

    with pytest.raises(wd.hybrid.HybridTestError, match=r"step 51 of 2000 .* connection .* was lost") as caught:
        run(breaks)
    assert caught.value.result.sizes["time"] == 51
    with pytest.raises(wd.hybrid.HybridTestError, match=r"did not answer within timeout=0.5 s"):
        run(lambda u, v, a, t: time.sleep(1.0) if t > 0.1 else 0.0)
    with pytest.raises(wd.hybrid.HybridTestError, match="returned a force that is not finite"):
        run(lambda u, v, a, t: np.nan if t > 0.1 else 0.0)
    with pytest.raises(wd.hybrid.HybridTestError, match=r"beyond displacement_limit=0.01 m: it was not sent"):
        run(lambda u, v, a, t: 0.6 * STIFFNESS * u, displacement_limit=0.01)
    with pytest.raises(wd.hybrid.HybridTestError, match="is beyond force_limit=100 N"):
        run(lambda u, v, a, t: 0.6 * STIFFNESS * u, force_limit=100.0)
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    with pytest.raises(wd.hybrid.HybridTestError, match=r"no connection .* start the substructure before the test"):
        wd.hybrid.HybridTest(COMPUTED, 1, ("127.0.0.1", port), step=0.01, timeout=0.5).run(MOTION)


def test_an_unstable_test_ends_before_values_that_are_not_finite_are_sent():
    light = wd.ShearBuilding(1e-3, 1.0, 3.0)
    with wd.hybrid.Substructure(lambda u, v, a, t: 1e308 if t > 0.1 else 0.0) as specimen:
        test = wd.hybrid.HybridTest(light, 1, specimen.address, step=0.01, data_size=16)
        with (
            np.errstate(over="ignore", invalid="ignore"),
            pytest.raises(wd.hybrid.HybridTestError, match=r"step 12 .* is not finite, so that it was not sent"),
        ):
            test.run(MOTION)
    assert specimen.error is None


def test_a_connection_that_is_lost_before_the_first_step_is_reported(monkeypatch):
    links = []

    def lost(link, *_):
        links.append(link)
        raise BrokenPipeError("broken pipe")

    monkeypatch.setattr("warpdyn.interfaces.hybrid.hybrid_test.send_header", lost)
    with socket.create_server(("127.0.0.1", 0)) as server:
        test = wd.hybrid.HybridTest(COMPUTED, 1, server.getsockname(), step=0.01)
        with pytest.raises(wd.hybrid.HybridTestError, match=r"lost before the first step .broken pipe"):
            test.run(MOTION)
    assert links[0].fileno() == -1


def test_wrong_arguments_are_refused():
    with pytest.raises(TypeError, match="can be the computed part of a hybrid test, got int"):
        wd.hybrid.HybridTest(1, 1, ("127.0.0.1", 8090), step=0.01)
    address = ("127.0.0.1", 8090)
    with pytest.raises(ValueError, match=r"step=1 s is not stable: .* must be below"):
        wd.hybrid.HybridTest(COMPUTED, 1, address, step=1.0)
    with pytest.raises(ValueError, match="storey 2, but the building has storeys 1 to 1"):
        wd.hybrid.HybridTest(COMPUTED, 2, address, step=0.01)
    with pytest.raises(TypeError, match="address must be host and port"):
        wd.hybrid.HybridTest(COMPUTED, 1, "localhost", step=0.01)
    yielding = wd.ShearBuilding(MASS, STIFFNESS, 3.0, law="bilinear", yield_force=1e3, hardening_ratio=0.1)
    with pytest.raises(ValueError, match="must be linear, but it has the law 'bilinear'"):
        wd.hybrid.HybridTest(yielding, 1, address, step=0.01)
    with pytest.raises(ValueError, match="data_size must be a whole number of at least 5"):
        wd.hybrid.HybridTest(COMPUTED, 1, address, step=0.01, data_size=4)
