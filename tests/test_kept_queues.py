"""Memory that a run on GPUs leaves for the next run; the CPU plays two GPUs."""

import pytest
from test_gpu_queue import pretended  # noqa: F401  a fixture
from test_simulate import assert_same_bits, make_scene

import warpdyn as wd
from warpdyn.campaigns.running.regions import job, kept_queues
from warpdyn.engine.kernels import queues as devices

pytestmark = pytest.mark.meant_as_given(
    "collapse_drift_ratio", "first_period", "initial_velocity", "random_factor", "storey_height"
)


def test_a_run_uses_the_memory_of_the_last_run(pretended, monkeypatch):  # noqa: F811
    scene, given = make_scene(), []
    open_queues = devices.open_queues

    def opened(names, cores, kept):
        given.append(list(kept))
        return open_queues(names, cores, kept)

    monkeypatch.setattr(job, "open_queues", opened)
    settings = {"device": "cuda", "dtype": "float64", "structures": 20}
    first, second = (wd.simulate(scene, **settings) for _ in range(2))
    assert [bool(kept) for kept in given] == [False, True]
    assert given[1][0].held  # arrays
    assert_same_bits(first, second)
    with monkeypatch.context() as patched:  # a run that fails leaves nothing
        patched.setattr(devices.CudaQueue, "read_into", lambda *given: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            wd.simulate(scene, **settings)
    assert given[2]
    wd.simulate(scene, **settings)
    assert not given[3]
    assert kept_queues._kept
    wd.simulate(scene, **settings, memory=2**27)  # limited memory: frees the queues of the last run and leaves none
    assert not given[4]
    assert not kept_queues._kept
    wd.simulate(scene, **settings)
    assert not given[5]
    monkeypatch.setattr(kept_queues, "SHARE_OF_A_GPU", 0.0)  # more memory than is kept
    wd.simulate(scene, **settings)
    wd.simulate(scene, **settings)
    assert given[6]
    assert not given[7]
