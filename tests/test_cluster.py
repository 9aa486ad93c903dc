"""Runs on a Dask cluster of two processes: the bits of one process, whatever dies; refusals before anything runs."""

import os
import random
import signal
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
import xarray as xr
from test_portfolio import SCATTER, STRIPES, chain
from test_regions import check_same
from test_sequence_runs import DRAWN, STRIPED
from test_sequences import make_building as make_shaken_building
from test_simulate import make_scene

import warpdyn as wd
from warpdyn.campaigns.running import run as runs

distributed = pytest.importorskip("distributed")

TWO_ARCHETYPES = {"low": wd.Archetype(chain(1), 40, SCATTER), "high": wd.Archetype(chain(3), 30, SCATTER)}
PORTFOLIO = wd.Scene(wd.Portfolio(TWO_ARCHETYPES), STRIPES, tail=1.0, collapse_drift_ratio=0.05)
SEQUENCE = wd.Scene(make_shaken_building(), STRIPED, DRAWN)
# Some dozens of milliseconds a region, of which there are 15.
LONG = {"structures": 240, "seed": 5, "step": 1e-4, "device": "cpu"}

pytestmark = [
    pytest.mark.as_shipped,  # as workers have them, which know nothing of the tests' quick kernels
    pytest.mark.filterwarnings("ignore:a tail of"),
    pytest.mark.meant_as_given(
        *("damping_ratio", "first_period", "first_period_over_height", "no_damping", "storey_height"),
        *("yield_base_shear_coefficient", "yield_drift_ratio", "collapse_drift_ratio", "force_over_weight"),
    ),
]


@pytest.fixture(scope="module")
def cluster():
    """Two processes of one thread each."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as found:
        yield found


@pytest.fixture
def client(cluster):
    """Return a client of the cluster, whose regions have 96 samples."""
    with distributed.Client(cluster) as found:
        for attempt in range(20):
            try:
                found.wait_for_workers(2, timeout=60)
            except TimeoutError:  # Dask gives up a worker that was killed while it began
                cluster.scale(0)
                cluster.scale(2)
                found.wait_for_workers(2, timeout=60)
            try:
                found.run(make_regions_small)
                break
            except OSError:  # a worker that was killed a moment ago still counts as one
                if attempt == 19:
                    raise
                time.sleep(0.2)
        yield found


def make_regions_small(samples=96):
    """Run by a worker before runs are laid out."""
    from warpdyn.campaigns.integration import stability_guard
    from warpdyn.campaigns.running.regions import job

    stability_guard.SAMPLES_OF_A_RANGE = 1
    job.LEAST_CPU_REGION, job.CPU_BLOCK = 1, samples


@pytest.fixture(scope="module")
def long_run():
    return wd.simulate(make_scene(), **LONG)


@pytest.mark.parametrize("kind", ["memory", "store"])
def test_a_run_of_two_processes_has_the_bits_of_one(kind, client, long_run, tmp_path):
    path = tmp_path / "run.zarr" if kind == "store" else None
    run = wd.simulate(make_scene(), cluster=client, path=path, **LONG)
    check_same(run, long_run)
    if path is None:
        assert run["status"]._in_memory
    else:
        with xr.open_zarr(path) as read:
            assert len(read.chunksizes["sample"]) == 15
            check_same(read, long_run)
        assert os.listdir(tmp_path) == ["run.zarr"]


COUNTED = [
    wd.DamageCounts({"slight": 0.003, "complete": 0.01}, over=("structure", "motion")),
    wd.DemandMoments("peak_storey_drift_ratio", over="motion"),
]


@pytest.mark.parametrize("kind", [None, "run.nc", "run.zarr"])
def test_statistics_of_two_processes_are_those_of_one(kind, client, tmp_path):
    expected = wd.simulate(make_scene(), statistics=COUNTED, **LONG)
    path, taken = None if kind is None else tmp_path / kind, []
    with told_of_regions(taken.append):
        check_statistics(wd.simulate(make_scene(), statistics=COUNTED, cluster=client, path=path, **LONG), expected)
    assert sorted(taken) == list(range(15))
    assert os.listdir(tmp_path) == ([] if kind is None else [kind])
    limits = {name: {"slight": 0.002, "complete": 0.005} for name in TWO_ARCHETYPES}
    asked = [wd.DamageCounts(limits, over="building"), wd.DemandMoments("peak_storey_drift_ratio", over="archetype")]
    settings = {"seed": 2, "device": "cpu", "statistics": asked}
    check_statistics(wd.simulate(PORTFOLIO, cluster=client, **settings), wd.simulate(PORTFOLIO, **settings))


def check_statistics(found, expected):
    """Check that statistics have the same bits and labels."""
    assert xr.Dataset(found.data_vars, found.coords).identical(xr.Dataset(expected.data_vars, expected.coords))


@pytest.mark.thorough
@pytest.mark.parametrize("moment", range(12))
def test_statistics_when_workers_are_killed_count_every_region_once(moment, cluster, client, tmp_path):
    draw, killed, taken, timers = random.Random(100 + moment), [], [], []
    expected = wd.simulate(make_scene(), statistics=COUNTED, **LONG)

    def kill():
        killed.append(draw.choice([each.pid for each in cluster.workers.values() if each.pid not in (None, *killed)]))
        os.kill(killed[-1], signal.SIGKILL)

    def tell(place):
        taken.append(place)
        if len(taken) == 1 + moment % 6:
            timers.append(threading.Timer(draw.uniform(0.0, 0.1), kill))
            timers[-1].start()

    path = tmp_path / "run.nc" if moment % 2 else None
    with told_of_regions(tell):
        found = wd.simulate(make_scene(), statistics=COUNTED, cluster=client, path=path, **LONG)
    timers[0].join()
    assert len(killed) == 1
    assert sorted(taken) == list(range(15))  # none lost, none counted twice
    check_statistics(found, expected)


def test_a_portfolio_runs_group_beside_group(client):
    settings = {"seed": 2, "device": "cpu"}
    check_same(wd.simulate(PORTFOLIO, cluster=client, **settings), wd.simulate(PORTFOLIO, **settings))


@pytest.mark.thorough
def test_a_sequence_is_run_with_its_histories_and_estimates(client, tmp_path):
    settings = {"structures": 9, "seed": 2, "device": "cpu", "checked_share": 0.1}
    held = wd.simulate(SEQUENCE, **settings)
    check_same(wd.simulate(SEQUENCE, cluster=client, path=tmp_path / "run.zarr", **settings), held)
    settings = {"structures": 30, "histories": wd.Histories((3, 177, 90)), "sample_error": 0.05, "device": "cpu"}
    check_same(wd.simulate(make_scene(), cluster=client, **settings), wd.simulate(make_scene(), **settings))
    settings = {"structures": 30, "target_error": 0.01, "method": "rk4", "device": "cpu"}
    run = wd.simulate(make_scene(), cluster=client, **settings)
    chosen = {name: run.attrs[name] for name in ("method", "dtype", "longest_step")}
    again = wd.simulate(make_scene(), structures=30, device="cpu", **chosen)
    np.testing.assert_array_equal(run["peak_storey_drift"], again["peak_storey_drift"])


MOMENTS = [pytest.param(moment, marks=[] if moment < 2 else pytest.mark.thorough) for moment in range(20)]


@pytest.mark.parametrize("moment", MOMENTS)
def test_a_worker_that_is_killed_costs_its_regions_alone(moment, cluster, client, long_run, tmp_path):
    draw = random.Random(moment)
    killed, taken, timers = [], [], []
    # After so many regions; at the third case of four both workers die, one soon after the other.
    places = [draw.randrange(12)] * (2 if moment % 4 == 2 else 1)

    def kill():
        pids = [worker.pid for worker in cluster.workers.values() if worker.pid not in (None, *killed)]
        killed.append(draw.choice(pids))
        os.kill(killed[-1], signal.SIGKILL)

    def tell(place):
        taken.append(place)
        for _ in places if len(taken) == places[0] + 1 else ():
            timers.append(threading.Timer(draw.uniform(0.0, 0.1), kill))
            timers[-1].start()

    kind = {} if moment % 2 else {"path": tmp_path / "run.zarr"}
    with told_of_regions(tell):
        run = wd.simulate(make_scene(), cluster=client, **kind, **LONG)
    for timer in timers:
        timer.join()
    assert len(killed) == len(places)
    assert sorted(taken) == list(range(15))  # none lost, none counted twice
    check_same(run, long_run)


@contextmanager
def told_of_regions(tell):
    """Call a function with the number of each region that comes in."""
    take = runs.Run.take

    def telling(self, sink, part, place, report):
        tell(place)
        take(self, sink, part, place, report)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(runs.Run, "take", telling)
        yield


def regions_under_way(dask_worker):
    """Return how many tasks a worker's threads are at, those that were cancelled among them."""
    return len(dask_worker.state.executing)


def test_a_run_that_ctrl_c_stopped_goes_on(client, long_run, tmp_path, caplog):
    path, taken = tmp_path / "run.zarr", []
    with told_of_regions(lambda place: os.kill(os.getpid(), signal.SIGINT)), pytest.raises(KeyboardInterrupt):
        wd.simulate(make_scene(), cluster=client, path=path, **LONG)
    assert not path.exists()
    for _ in range(100):  # what was running ends, although it is cancelled; nothing else begins
        if not any(client.run(regions_under_way).values()):
            break
        time.sleep(0.1)
    assert not any(client.run(regions_under_way).values())
    done = len(list(tmp_path.rglob("*.npz")))
    assert 0 < done < 15
    client.run(make_regions_small, 192)  # as another number of workers might divide it
    with told_of_regions(taken.append):
        run = wd.simulate(make_scene(), cluster=client, path=path, **LONG)
    assert len(taken) == 15 - done
    assert f"resumes after the {16 * done} of 240 structures" in caplog.text
    check_same(run, long_run)
    with pytest.raises(FileExistsError, match="contains another run"):
        wd.simulate(make_scene(), cluster=client, path=path, **(LONG | {"seed": 6}))
    check_same(xr.open_zarr(path), long_run)


def say_older(name=None):
    """Have a worker believe that it has an older version of a package, or again what it has."""
    import importlib.metadata as metadata

    import warpdyn

    warpdyn.own = getattr(warpdyn, "own", warpdyn.__version__)
    warpdyn.__version__ = "0.0.1" if name == "warpdyn" else warpdyn.own
    metadata.own = getattr(metadata, "own", metadata.version)
    metadata.version = metadata.own if name is None else lambda each: "0.0.1" if each == name else metadata.own(each)


@pytest.mark.parametrize("package", ["warpdyn", "warp-lang", "numpy", "scipy"])
def test_workers_of_another_version_are_refused_by_name(package, client, tmp_path):
    other = min(client.scheduler_info()["workers"])
    client.run(say_older, package, workers=[other])
    try:
        with pytest.raises(RuntimeError, match=rf"{other}: .*{package} 0\.0\.1"):
            wd.simulate(make_scene(), structures=3, cluster=client, path=tmp_path / "run.zarr")
    finally:
        client.run(say_older)
    assert not os.listdir(tmp_path)


def test_what_workers_cannot_do_is_said_before_anything_runs(client, tmp_path, monkeypatch):
    scene, path = make_scene(), tmp_path / "run.zarr"
    with pytest.raises(ValueError, match=r"2 workers \(tcp.*\): this computer has no device 'cuda:7'"):
        wd.simulate(scene, structures=3, cluster=client, device="cuda:7", path=path)
    with pytest.raises(ValueError, match="device must be one device with cluster="):
        wd.simulate(scene, structures=3, cluster=client, device=["cuda:0", "cuda:1"])
    with pytest.raises(ValueError, match="sample 400, but the run has samples 0 to 17"):
        wd.simulate(scene, structures=3, cluster=client, histories=wd.Histories([400]), path=path)
    monkeypatch.setattr("warpdyn.foundations.core.checks.free_memory", lambda: 100)
    with pytest.raises(MemoryError, match=r'give path="run\.zarr"'):
        wd.simulate(scene, structures=3, cluster=client)
    with pytest.raises(TypeError, match=r"as Client\(LocalCluster\(\)\), got LocalCluster"):
        wd.simulate(scene, structures=3, cluster=client.cluster)
    closed = distributed.Client(client.cluster)
    closed.close()
    with pytest.raises(ValueError, match="it is closed"):
        wd.simulate(scene, structures=3, cluster=closed)
    # A folder that workers do not see: they run as another user, or on another machine.
    client.run(look_elsewhere)
    try:
        with pytest.raises(OSError, match="on a disk that all workers share"):
            wd.simulate(scene, structures=3, cluster=client, path=path)
    finally:
        client.run(look_elsewhere, True)
    assert not os.listdir(tmp_path)


def look_elsewhere(again=False):
    """Have a worker be denied every folder, or see them again."""
    os.own = getattr(os, "own", os.access)
    os.access = os.own if again else lambda path, mode: False


def test_an_error_of_a_region_ends_the_run(client, tmp_path):
    # Some structure is drawn out of its bounds.
    scene = make_scene(scatter={"mass": wd.RandomValue(wd.Normal(2e3, 1000.0))})
    with pytest.raises(ValueError, match="the drawn mass"):
        wd.simulate(scene, structures=120, cluster=client, path=tmp_path / "run.zarr", device="cpu")
    assert not (tmp_path / "run.zarr").exists()
