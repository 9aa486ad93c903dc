"""Queues of GPUs, played on the CPU: streams whose work is done only when somebody waits for it.

A missing wait is found, because the work for which it should have waited is not done, and so is memory that is used
again too early. In a second play all streams but the first of a queue do their work at once, if they need not wait.
"""

import threading
import time
from collections import deque
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp
from test_simulate import MOTIONS, assert_same_bits, make_scene

import warpdyn as wd
from warpdyn.campaigns.integration import model
from warpdyn.campaigns.reductions import workers as reducing
from warpdyn.campaigns.running import blocks
from warpdyn.campaigns.running.regions import job, kept_queues
from warpdyn.engine.kernels import arguments, build, kernel_cache, queues as devices

pytestmark = pytest.mark.meant_as_given(
    "collapse_drift_ratio",
    "first_period",
    "initial_velocity",
    "random_factor",
    "storey_height",
    "yield_base_shear_coefficient",
)


class Event:
    def __init__(self, device=None, enable_timing=False):
        self.stream, self.time = None, None

    @property
    def is_complete(self):
        """Work goes on while somebody waits."""
        if self.time is None:
            self.stream.go_on()
        return self.time is not None


class Wait:
    def __init__(self, event):
        self.event = event


class Stream:
    """Work in its order, put off as long as can be or, if it hurries, done as soon as can be."""

    def __init__(self, hurries=False, priority=0):
        self.work, self.hurries, self.priority = deque(), hurries, priority

    def add(self, work):
        with AT_A_TIME:
            self.work.append(work)
            while self.hurries and self.work and not self.must_wait():
                self.go_on()

    def must_wait(self):
        return isinstance(self.work[0], Wait) and self.work[0].event.time is None

    def record_event(self, event=None):
        event = Event() if event is None else event
        event.stream, event.time = self, None
        self.add(event)
        return event

    def wait_event(self, event):
        self.add(Wait(event))

    def go_on(self):
        with AT_A_TIME:
            if not self.work:  # another thread has done it
                return
            work = self.work.popleft()
            if isinstance(work, Wait):
                reach(work.event)
            elif isinstance(work, Event):
                work.time = time.perf_counter()
            else:
                work()


def reach(event):
    """Do what was queued before an event."""
    while event.time is None:
        event.stream.go_on()


AT_A_TIME = threading.RLock()  # one thread plays the streams


class Pretended:
    """Warp with GPUs whose memory is the processor's."""

    Event = Event
    scoped = threading.local()  # Warp's current stream is one for all threads: nothing may depend on another thread's

    def __init__(self, count, hurries):
        self.count, self.hurries, self.streams, self.launches, self.pinned = count, hurries, 0, [], []

    def Stream(self, device, priority=0):
        self.streams += 1  # of a queue: the first one makes the copies
        return Stream(self.hurries and self.streams != 1, priority)

    def __getattr__(self, name):
        return getattr(wp, name)

    def get_cuda_device_count(self):
        return self.count

    def get_device(self, device):
        return SimpleNamespace(name=f"pretended {device}", is_cuda=True)

    def get_stream(self, device):
        return Stream()

    @contextmanager
    def ScopedStream(self, stream):
        before = current_stream()
        Pretended.scoped.stream = stream
        yield
        Pretended.scoped.stream = before

    def array(self, values, device, **options):
        return wp.array(values, device="cpu", **options)

    def empty(self, size, dtype, device, pinned=False):
        array = wp.empty(size, dtype=dtype, device="cpu")
        array.numpy().fill(0)  # a kernel that comes too early shall go wrong, not crash
        if pinned:
            self.pinned.append(array)  # which keeps its address
        return array

    def copy(self, there, here, stream=None):
        if current_stream() is not None:
            stream = current_stream()
        elif not any(array.ptr == here.ptr for array in self.pinned):  # it is read at once
            here = wp.array(here.numpy().copy(), dtype=here.dtype, device="cpu")
        stream.add(lambda: wp.copy(there, here))

    def launch(self, kernel, dim, inputs, device="cpu", stream=None, block_dim=1):
        if stream is None:
            wp.launch(kernel, dim=dim, inputs=inputs, device=device)
            return
        self.launches.append((stream, kernel.key))
        stream.add(lambda: wp.launch(kernel, dim=dim, inputs=inputs, device="cpu"))

    def synchronize_event(self, event):
        reach(event)

    def synchronize_stream(self, stream):
        while stream.work:
            stream.go_on()

    def synchronize_device(self, device):
        pass

    def get_event_elapsed_time(self, start, end, synchronize):
        assert end.time is not None
        reach(start)
        return 1e3 * (end.time - start.time)


def current_stream():
    return getattr(Pretended.scoped, "stream", None)


@pytest.fixture(params=["late", "early"])
def pretended(request, monkeypatch):
    """Pretend that there are two GPUs."""
    shim = Pretended(2, hurries=request.param == "early")
    monkeypatch.setattr(build, "GPU_UNROLL", 2)  # kernels compile sooner, and what is shown is how they are queued
    monkeypatch.setattr(devices, "WAIT_FOR_GPU", 0.0)  # each look at these does some of their work
    monkeypatch.setattr(devices, "wp", shim)
    monkeypatch.setattr(arguments, "wp", shim)
    monkeypatch.setattr(job, "wp", shim)
    monkeypatch.setattr(reducing, "wp", shim)
    for module in (devices, reducing):
        monkeypatch.setattr(module, "loaded", lambda kernel, device="cpu": kernel_cache.loaded(kernel))
    monkeypatch.setattr(kept_queues, "_kept", {})
    opened = devices.CudaQueue.__init__

    def open_queue(*given):
        shim.streams = 0
        opened(*given)

    monkeypatch.setattr(devices.CudaQueue, "__init__", open_queue)
    monkeypatch.setattr(devices, "load_kernel", lambda plan, device: build.load_kernel(plan, "cpu"))
    for module in ("integration.settings", "running.blocks", "running.regions.kept_queues"):
        monkeypatch.setattr(f"warpdyn.campaigns.{module}.free_memory", lambda device: 2**34)
    return shim


def assert_close(first, second):
    """Check that two runs agree but for the order of roundings, which differs between kernels of other lanes."""
    assert set(first.variables) == set(second.variables)
    for name in first.variables:
        if first[name].dtype.kind == "f":
            np.testing.assert_allclose(first[name], second[name], rtol=1e-9, atol=1e-9, err_msg=name)
        else:
            np.testing.assert_array_equal(first[name], second[name], err_msg=name)


def blocks_of(monkeypatch, samples):
    """Let a GPU's blocks hold so many samples, however short their histories."""
    for name in ("GPU_BLOCK", "LARGEST_GPU_BLOCK"):
        monkeypatch.setattr(blocks, name, samples)


def tell(work, threads):
    """Return the work, which adds its thread to those that did it."""

    def told(*arguments, **options):
        threads.add(threading.get_ident())
        return work(*arguments, **options)

    return told


KEPT = wd.Histories((7, 1, 133))
SETTINGS = {"structures": 23, "seed": 2, "method": "rk4", "dtype": "float64", "checked_share": 0.3, "histories": KEPT}


def test_gpus_give_what_the_processor_gives(pretended, monkeypatch, tmp_path):
    scene = make_scene()
    whole = wd.simulate(scene, device="cpu", **SETTINGS)
    one = wd.simulate(scene, device="cuda:0", **SETTINGS)
    assert_close(one, whole)
    # More blocks than can be under way: memory is used again and again, by blocks of other sizes, too.
    blocks_of(monkeypatch, 12)
    for device in ("cuda:1", "cuda", ["cuda:1", "cuda:0"]):
        pretended.launches.clear()
        divided = wd.simulate(scene, device=device, **SETTINGS)
        assert_same_bits(one, divided)
        assert divided.attrs["seconds_in_kernels"] > 0
        histories = [kernel for _, kernel in pretended.launches if "integrate" in kernel]
        assert len(histories) > 12 * 3  # motions of three kinds of steps in each block
    assert divided.attrs["device"] == "cuda:1 (pretended cuda:1), cuda:0 (pretended cuda:0)"
    with wd.simulate(scene, device="cuda", path=tmp_path / "run.nc", **SETTINGS) as read:
        assert_same_bits(one, read.load())


def test_failures_are_run_again_beside_other_blocks(pretended, monkeypatch):
    building = wd.ShearBuilding(
        1e9, 1e3, 1.0, law="bouc_wen", yield_force=2.0, hardening_ratio=0.0, exponent=2.0, damping="none"
    )
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1, 1.2))}
    scene = wd.Scene(building, wd.FreeVibration(4.0, velocity=1.0), scatter=scatter)
    settings = {"structures": 40, "step": 0.05, "dtype": "float64"}
    whole = wd.simulate(scene, device="cpu", **settings)
    assert len(np.unique(whole["integration_step"])) >= 4
    blocks_of(monkeypatch, 7)
    assert_close(wd.simulate(scene, device="cuda", **settings), whole)
    # Fills and reruns do not wait for the histories of other blocks.
    priorities = {(stream.priority, "fill" in kernel) for stream, kernel in pretended.launches}
    assert priorities == {(devices.URGENT, True), (devices.URGENT, False), (0, False)}
    settings["statistics"] = wd.DemandMoments("peak_storey_drift_ratio", over="structure")
    found = wd.simulate(scene, device="cuda", **settings)
    np.testing.assert_allclose(
        found["peak_storey_drift_ratio_mean_by_structure"], whole["peak_storey_drift_ratio"].max("storey"), rtol=1e-9
    )


def threads_that_end():
    """Return how many threads there are beside those that load kernels, which stay and wait for the next."""
    return sum(not thread.daemon for thread in threading.enumerate())


def test_what_fails_in_a_block_prepared_ahead_is_raised(pretended, monkeypatch):
    blocks_of(monkeypatch, 1)
    scatter = {"mass": wd.GivenValues([[1.0], [1.0], [1.0], [1.0], [-1.0], [1.0], [1.0], [1.0]])}
    scene = wd.Scene(wd.ShearBuilding(1.0, 1.0, 1.0), wd.FreeVibration(1.0, velocity=1.0), scatter)
    before = threads_that_end()
    with pytest.raises(ValueError, match="given mass is -1 at structure 4, storey 1"):
        wd.simulate(scene, structures=8, device="cuda:0")
    assert threads_that_end() == before


def test_blocks_are_queued_before_the_first_is_waited_for(pretended, monkeypatch):
    blocks_of(monkeypatch, 30)
    order = []

    def spy(name):
        original = getattr(devices.CudaQueue, name)

        def told(*arguments, **options):
            order.append(name)
            return original(*arguments, **options)

        monkeypatch.setattr(devices.CudaQueue, name, told)

    spy("launch")
    spy("read_into")
    started = {threading.get_ident()}
    monkeypatch.setattr(pretended, "launch", tell(pretended.launch, started))
    wd.simulate(make_scene(), structures=50, device="cuda:0")
    assert started == {threading.get_ident()}  # warp's launches from several threads crash
    blocks_there = order.count("launch")
    assert blocks_there == 10
    ahead = devices.BLOCKS_ON_A_GPU
    steady = ["read_into", "launch"] * (blocks_there - ahead)
    assert order == ["launch"] * ahead + steady + ["read_into"] * ahead


def test_events_of_a_sequence_go_through_gpus_in_turn(pretended, monkeypatch):
    events = {
        "mainshock": wd.Cloud(MOTIONS),
        "aftershock": wd.Stripes(MOTIONS[:2], [0.2, 0.6], wd.PeakGroundAcceleration()),
    }
    scene = make_scene(excitation=wd.EventSequence(events), collapse_drift_ratio=0.004)
    settings = {"structures": 11, "seed": 2, "method": "rk4", "dtype": "float64", "checked_share": 0.3}
    whole = wd.simulate(scene, device="cpu", **settings)
    assert len(np.unique(whole["status"])) == 2
    one = wd.simulate(scene, device="cuda:0", **settings)
    assert_close(one, whole)
    blocks_of(monkeypatch, 50)
    assert_same_bits(one, wd.simulate(scene, device=["cuda:1", "cuda:0"], **settings))


@pytest.mark.parametrize("device", ["cuda:1", "cuda"])
def test_statistics_are_made_where_samples_were_integrated(pretended, device, monkeypatch):
    scene = make_scene()
    asked = [
        wd.DamageCounts({"slight": 0.002, "severe": 0.01}, over=("motion", "structure_group")),
        wd.DamageCounts({"slight": 0.002, "severe": 0.01}, each_place=True),
        wd.DamageCounts({"slight": 0.002, "severe": 0.01}, number=np.arange(1.0, 24.0), over="motion"),
        wd.DamageLoss({"slight": 0.002, "severe": 0.01}, {"slight": 0.1, "severe": 0.9}, over="structure"),
        wd.DemandMoments("peak_storey_drift_ratio", over="motion", each_place=True),
        wd.DemandHistogram("peak_storey_drift_ratio", [0.001, 0.003, 0.01], over="structure"),
    ]
    settings = {"structures": 23, "seed": 2, "statistics": asked, "method": "rk4", "dtype": "float64"}
    on_processor = wd.simulate(scene, device="cpu", **settings)
    blocks_of(monkeypatch, 12)
    found = wd.simulate(scene, device=device, **settings)
    assert_close(found, on_processor)
    estimated = wd.simulate(scene, device=device, checked_share=0.3, **settings)
    assert_close(estimated[list(found.data_vars)], found)
    assert int(found["damage_count_by_motion_structure_group"].sum()) == 23 * scene.excitation.samples_per_structure
    # Of 1 to 23 buildings: 276.
    assert float(found["number_of_buildings_by_motion"].sum()) == 276 * scene.excitation.samples_per_structure


def test_histories_of_several_steps_are_launched_one_after_the_other(pretended):
    # Samples of other steps are a launch of their own, whose inputs are sent from the same memory on the host.
    building = wd.ShearBuilding(2e3, 6e5, 3.0, damping="storey", damping_coefficient=2e3)
    scene = wd.Scene(building, wd.Cloud(MOTIONS[1:]))  # of 5 and 10 ms
    settings = {"longest_step": 0.01, "dtype": "float64", "histories": wd.Histories((0, 1), every=2)}
    whole = wd.simulate(scene, device="cpu", **settings)
    assert len(np.unique(whole["integration_step"])) == 2
    assert_close(wd.simulate(scene, device="cuda:0", **settings), whole)


@pytest.mark.meant_as_given("no_damping")
@pytest.mark.parametrize("is_interpolated", [True, False])
def test_samples_with_divided_steps_run_beside_those_of_one_step(is_interpolated, pretended, monkeypatch):
    # Motions have a value for each step, unless these values take too much memory: then another kernel divides steps.
    if not is_interpolated:
        monkeypatch.setattr(model, "MOST_VALUES", 1)
    building = wd.ShearBuilding(
        1e3, 1e3, 3.0, law="bouc_wen", yield_force=2.0, hardening_ratio=0.0, exponent=2.0, damping="none"
    )
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1, 1.2)), "mass": wd.RandomFactor(wd.Lognormal(1, 0.8))}
    scene = wd.Scene(building, wd.Cloud([MOTIONS[0]]), scatter=scatter, tail=0.2)
    settings = {"structures": 40, "longest_step": 0.02, "method": "rk4", "dtype": "float64"}
    whole = wd.simulate(scene, device="cpu", **settings)
    assert len(np.unique(whole["integration_step"])) > 1
    plans = set()
    original = devices.load_kernel
    monkeypatch.setattr(devices, "load_kernel", lambda plan, device: plans.add(plan) or original(plan, device))
    blocks_of(monkeypatch, 13)
    assert_close(wd.simulate(scene, device="cuda", **settings), whole)
    assert {plan.undivided for plan in plans} == ({True} if is_interpolated else {True, False})


def test_groups_of_a_portfolio_share_the_places_on_a_gpu(pretended, monkeypatch):
    # Three groups, the later ones with more storeys and fewer samples, whose statistics are made beside the next one.
    damped = {"damping": "rayleigh", "damping_ratio": 0.05}
    buildings = {f"{storeys}": wd.ShearBuilding(2e3, [6e5] * storeys, 3.0, **damped) for storeys in (1, 2, 3)}
    spread = {"mass": wd.RandomFactor(wd.Lognormal(1, 0.3))}
    counts = {"1": 40, "2": 25, "3": 7}
    city = wd.Portfolio({name: wd.Archetype(buildings[name], count, spread) for name, count in counts.items()})
    scene = wd.Scene(city, wd.Cloud(MOTIONS))
    limits = {name: {"slight": 0.002, "severe": 0.01} for name in counts}
    asked = [wd.DamageCounts(limits, over="building"), wd.DemandMoments("peak_storey_drift_ratio", over="motion")]
    blocks_of(monkeypatch, 30)
    opened = []
    open_queues = devices.open_queues
    monkeypatch.setattr(job, "open_queues", lambda *given: opened.append(given) or open_queues(*given))
    for statistics in (asked, None):
        settings = {"seed": 2, "dtype": "float64", "statistics": statistics}
        found = wd.simulate(scene, device="cuda", **settings)
        assert_close(found, wd.simulate(scene, device="cpu", **settings))
        assert found.attrs["groups"] == 3
    assert len(opened) == 4  # once a run
