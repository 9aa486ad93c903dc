"""A run in blocks: how it is divided among blocks, devices and threads changes nothing; its memory stays bounded."""

import os
import re
import subprocess
import sys
import threading
import warnings
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from test_simulate import MOTIONS, SEEDED, assert_same_bits, make_scene

import warpdyn as wd
from warpdyn.campaigns.integration import stability_guard as guard
from warpdyn.campaigns.integration.run import build_run
from warpdyn.campaigns.integration.settings import Execution, Integration
from warpdyn.campaigns.running import blocks
from warpdyn.campaigns.running.labels import columns_of
from warpdyn.engine.device.running_time import seconds_covered, seconds_in_kernels
from warpdyn.engine.kernels import queues as devices
from warpdyn.foundations.core import checks
from warpdyn.foundations.core.thread_pool import in_parts
from warpdyn.model.scene.scatter import SAMPLING

pytestmark = pytest.mark.meant_as_given(
    "first_period", "initial_velocity", "no_damping", "random_factor", "storey_height", "yield_base_shear_coefficient"
)

TWO = ("cpu", "cpu")  # stand for two GPUs: the division does not know what its devices are


@pytest.fixture
def divided(monkeypatch):
    """Divide runs into blocks of at most so many samples, among so many devices; tell the blocks there were."""
    found = []

    def divide(*arguments, **options):
        found[:] = original(*arguments, **options)
        return found

    def into(samples, on=("cpu",)):
        monkeypatch.setattr(blocks, "CPU_BLOCK", samples)
        monkeypatch.setattr("warpdyn.campaigns.integration.settings.checked_devices", lambda device: on)
        return found

    original = blocks.divide
    monkeypatch.setattr("warpdyn.campaigns.running.regions.region.divide", divide)
    return into


DESIGNS = {
    "stripes": {},
    "sobol": {"sampling": "sobol"},
    "latin hypercube": {"sampling": "latin_hypercube"},
    "cloud": {"excitation": wd.Cloud(MOTIONS)},
    "motion drawn": {"excitation": wd.OneMotionPerStructure(MOTIONS)},
    "motion given": {
        "excitation": wd.OneMotionPerStructure(MOTIONS, motion=[0, 2, 1, 1, 0, 2, 2], scale=np.linspace(0.5, 2, 7))
    },
    "motions at sites": {
        "excitation": wd.MotionsAtSites(
            MOTIONS, [[[0, 1]], [[2, 0]]], [[[1.0, 2.0]], [[0.5, 0.7]]], np.eye(7, 2, dtype=int)
        )
    },
    "listed": {"scatter": {"mass": wd.GivenValues(np.linspace(1e3, 2e3, 7))}},
    "no scatter": {"scatter": {}},
}


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_no_division_changes_a_bit(design, dtype, divided):
    scene, settings = make_scene(**DESIGNS[design]), {"structures": 7, "seed": 5, "dtype": dtype, "device": "cpu"}
    each = scene.excitation.samples_per_structure
    found = divided(2**20)
    whole = wd.simulate(scene, threads=1, **settings)
    assert [len(block) for block in found] == [7]
    for size, on, sizes in ((each, ["cpu"], [1] * 7), (3 * each, ["cpu"], [3, 2, 2]), (4 * each, TWO, [4, 3])):
        found = divided(size, on)
        assert_same_bits(whole, wd.simulate(scene, threads=2, **settings))
        assert [len(block) for block in found] == sizes


@pytest.mark.parametrize("sampling", SAMPLING)
def test_no_part_of_a_block_changes_a_bit(sampling, monkeypatch):
    scene = make_scene(sampling=sampling)
    run = build_run(scene, 50, Integration(), Execution(device="cpu", threads=3))

    def prepared():
        block, vibration = run.events(np.arange(50), devices.CpuQueue(3))[0]
        block.pack()
        arrays = [*block.drawn.values(), *block._packed.structures.values(), *vars(vibration).values()]
        return [np.ascontiguousarray(array).tobytes() for array in arrays]

    whole = prepared()
    monkeypatch.setattr(in_parts, "__defaults__", (7,))
    monkeypatch.setattr("warpdyn.foundations.core.thread_pool.STRUCTURES_AT_A_TIME", 7)
    assert prepared() == whole


def test_a_block_each_for_every_device(divided):
    found = divided(2**20, ("cpu",) * 3)
    wd.simulate(make_scene(), structures=7, device="cpu")
    assert [list(block) for block in found] == [[0, 1, 2], [3, 4], [5, 6]]


def test_what_is_run_again_or_kept_does_not_depend_on_the_division(divided):
    settings = {"structures": 9, "checked_share": 0.6, "histories": wd.Histories((50, 3, 26), 2), "device": "cpu"}
    scene = make_scene()
    divided(2**20)
    whole = wd.simulate(scene, **settings)
    assert "of 33 samples" in whole["estimated_relative_error"].attrs["comment"]
    for size, on in ((6, ["cpu"]), (20, TWO)):
        divided(size, on)
        assert_same_bits(whole, wd.simulate(scene, **settings))


def test_how_often_failures_are_run_again_does_not_depend_on_the_division(divided, monkeypatch):
    # Bouc-Wen storeys that need a 4th to a 64th of the step, and a budget that does not serve them all.
    monkeypatch.setattr(guard, "ALWAYS_AFFORDED", 16 * 16 * 80)  # each sample has 80 steps, in rows of 16
    building = wd.ShearBuilding(
        1e9, 1e3, 1.0, law="bouc_wen", yield_force=2.0, hardening_ratio=0.0, exponent=2.0, damping="none"
    )
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1, 1.2))}
    scene = wd.Scene(building, wd.FreeVibration(4.0, velocity=1.0), scatter=scatter)
    settings = {"structures": 60, "step": 0.05, "dtype": "float64", "device": "cpu"}
    divided(2**20)
    with pytest.warns(UserWarning, match="of 60 samples are flagged unstable_step"):
        whole = wd.simulate(scene, **settings)
    assert 0 < np.count_nonzero(whole["status"]) < 60
    assert len(np.unique(whole["integration_step"])) >= 4
    for size, on in ((1, ["cpu"]), (17, TWO)):
        divided(size, on)
        with pytest.warns(UserWarning, match="of 60 samples are flagged unstable_step"):
            assert_same_bits(whole, wd.simulate(scene, **settings))


def test_a_run_warns_once_whatever_its_blocks(divided):
    building = wd.ShearBuilding([2e3, 1e3], [6e5, 4e5], [3.5, 3.0])
    scene = wd.Scene(building, wd.Cloud(MOTIONS), {"mass": wd.RandomFactor(wd.Lognormal(0.02, 0.5))}, tail=0.01)
    told = []
    for size in (2**20, 3):
        divided(size)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            wd.simulate(scene, structures=8, step=0.01, resample=True, on_unstable="flag", device="cpu")
        told.append([str(warning.message) for warning in caught])
        assert {warning.filename for warning in caught} == {__file__}
    assert told[0] == told[1]
    kinds = ("stability limit of .* of 24 samples", "energy balance of .* of 24 samples", "tail of 0.01 s is shorter")
    for kind in kinds:
        assert sum(bool(re.search(kind, text)) for text in told[0]) == 1, told[0]


def test_an_unstable_sample_is_refused_before_any_block_runs(divided, monkeypatch):
    def refuse(*arguments, **named):
        pytest.fail("a kernel was reached")

    divided(1)
    monkeypatch.setattr(devices.CpuQueue, "launch", refuse)
    oscillators = {"mass": wd.GivenValues([1.0, 1.0, 1e-6, 1.0, 1e-7])}
    scene = wd.Scene(wd.ShearBuilding(1.0, 1.0, 1.0), wd.FreeVibration(4.0, velocity=1.0), oscillators)
    with pytest.raises(ValueError, match=r"limit of 2 of 5 samples, the first of them sample 2: first period 0\.00628"):
        wd.simulate(scene, structures=5, step=0.5, on_unstable="raise", device="cpu")


def test_what_is_wrong_in_a_later_block_is_told_by_the_run_s_own_numbers(divided):
    divided(2)
    scatter = {"mass": wd.GivenValues([[1.0], [1.0], [1.0], [-1.0]])}
    scene = wd.Scene(wd.ShearBuilding(1.0, 1.0, 1.0), wd.FreeVibration(1.0, velocity=1.0), scatter)
    with pytest.raises(ValueError, match="given mass is -1 at structure 3, storey 1"):
        wd.simulate(scene, structures=4, device="cpu")


@pytest.mark.parametrize("threads", [1, 3])
def test_threads_are_as_many_as_asked_for(threads, monkeypatch):
    working, most, everyone = set(), [], set()

    def launch(*arguments, **options):
        working.add(threading.get_ident())
        most.append(len(working))
        everyone.add(threading.get_ident())
        original(*arguments, **options)
        working.discard(threading.get_ident())

    original = wp.launch
    monkeypatch.setattr(wp, "launch", launch)
    wd.simulate(make_scene(), structures=200, device="cpu", threads=threads)
    assert max(most) <= threads
    # This thread itself draws a few structures, while no other works.
    assert 0 < len(everyone - {threading.get_ident()}) <= threads


def test_slices_hold_all_rows_of_lanes_once_and_equal_work():
    random = np.random.default_rng(0)
    steps = [np.sort(random.integers(100, 10_000, count))[::-1] for count in (5000, 37, 1)]
    intervals = np.concatenate(steps)
    samples = np.split(np.arange(intervals.size), np.cumsum([each.size for each in steps])[:-1])
    launches = [devices.Launch(None, (None,) * 4, order.size, 1, order, intervals) for order in samples]
    lanes, threads = 16, 4
    parts = devices.slices(launches, lanes, threads)
    covered = {id(launch): [] for launch in launches}
    work, longest = [], []
    for launch, first, last in parts:
        own = next(each for each, known in zip(steps, launches, strict=True) if known is launch)
        covered[id(launch)] += range(first, last)
        work.append(own[first * lanes : last * lanes : lanes].sum())
        longest.append(own[first * lanes])
    for launch in launches:
        assert sorted(covered[id(launch)]) == list(range(-(-launch.order.size // lanes)))
    assert len(parts) >= threads * devices.SLICES_PER_THREAD
    # No slice of the large launch has much more work than its share; they are divided at whole rows.
    share = sum(each[::lanes].sum() for each in steps) / (threads * devices.SLICES_PER_THREAD)
    assert max(work) < share + 10_000
    assert longest == sorted(longest, reverse=True)


def test_time_in_kernels_counts_what_overlaps_once():
    assert seconds_covered([(5.0, 6.0), (0.0, 2.0), (1.0, 3.0), (1.5, 1.75), (6.0, 6.5)]) == 4.5
    queues = [devices.CpuQueue(1) for _ in range(3)]
    for queue, device, spans in zip(queues, "aba", ([(0, 1)], [(0, 3)], [(0.5, 2)]), strict=True):
        queue.device, queue.spans = device, spans
    assert seconds_in_kernels(queues) == 3
    run = wd.simulate(make_scene(), structures=50, device="cpu")
    assert 0 < run.attrs["seconds_in_kernels"] <= run.attrs["seconds_integrating"]


def test_devices_by_name(monkeypatch):
    monkeypatch.setattr(wp, "get_cuda_device_count", lambda: 3)
    assert devices.checked_devices(None) == ("cuda:0",)
    assert devices.checked_devices("cuda") == ("cuda:0", "cuda:1", "cuda:2")
    assert devices.checked_devices("cuda:2") == ("cuda:2",)
    assert devices.checked_devices(["cuda:1", "cuda:0"]) == ("cuda:1", "cuda:0")
    assert devices.checked_devices(("cpu",)) == ("cpu",)
    for wrong in (["cuda:0", "cuda:0"], ["cpu", "cuda:0"], []):
        with pytest.raises(ValueError, match="several different GPUs"):
            devices.checked_devices(wrong)
    with pytest.raises(ValueError, match="no device 'cuda:3'; available: cpu, cuda:0, cuda:1, cuda:2"):
        devices.checked_devices("cuda:3")
    monkeypatch.setattr(wp, "get_cuda_device_count", lambda: 0)
    assert devices.checked_devices(None) == ("cpu",)
    with pytest.raises(ValueError, match="no device 'cuda'; available: cpu"):
        devices.checked_devices("cuda")


def test_blocks_on_gpus_fit_the_devices_and_their_memory(monkeypatch):
    monkeypatch.setattr("warpdyn.campaigns.integration.settings.checked_devices", lambda device: ("cuda:0", "cuda:1"))
    for module in ("integration.settings", "running.blocks"):
        monkeypatch.setattr(f"warpdyn.campaigns.{module}.free_memory", lambda device: 2**40)

    def sizes(samples, memory=None):
        run = build_run(make_scene(), samples, Integration(), Execution())
        return [6 * len(block) for block in blocks.divide(run, columns_of(run.model, True), memory)]

    assert sizes(100) == [300, 300]
    assert len(sizes(200_000)) == 4  # two on each device, to hide the work on the host: 1.2 million short histories
    assert len(sizes(50_000)) == 2  # which fill a device with 2^18 of them and more
    monkeypatch.setattr(blocks, "WORK_OF_A_GPU_BLOCK", 1)  # as of long ones
    assert len(sizes(200_000)) == 10  # in blocks of at most 2^17, as many on each device
    few = sizes(200_000, memory=10**8)
    assert len(few) > 10
    assert max(few) - min(few) <= 2**12  # a range of structures, whose reruns share a limit


def test_a_dataset_too_large_for_memory_is_refused_at_once(monkeypatch, tmp_path):
    def refuse(*arguments, **named):
        pytest.fail("a kernel was reached")

    with monkeypatch.context() as patch:
        patch.setattr(checks, "free_memory", lambda: 10**10)
        patch.setattr(devices.CpuQueue, "launch", refuse)
        scene = wd.Scene(make_scene().structure, wd.FreeVibration(1.0, velocity=0.1), SEEDED)
        with pytest.raises(MemoryError, match=r"1,000,000,000 samples .* needs \d+ GB .*10 GB are free: give path="):
            wd.simulate(scene, structures=10**9, device="cpu")
    # A file takes what does not fit.
    monkeypatch.setattr(checks, "free_memory", lambda: 1000)
    with pytest.raises(MemoryError, match="give path="):
        wd.simulate(make_scene(), structures=3, device="cpu")
    with wd.simulate(make_scene(), structures=3, device="cpu", path=tmp_path / "run.nc") as run:
        assert run.sizes["sample"] == 18


def test_inputs_are_left_out_if_asked():
    scene = make_scene(scatter=SEEDED | {"height": wd.RandomFactor(wd.Lognormal(1, 0.1))})
    kept, bare = (wd.simulate(scene, structures=2, keep_inputs=keep) for keep in (True, False))
    assert set(kept.variables) - set(bare.variables) == {"mass", "yield_force", "height"}
    assert_same_bits(kept.drop_vars(["mass", "yield_force", "height"]), bare)  # the ratios know their heights


PEAK = """
import sys
import numpy as np
import warpdyn as wd

def peak():
    # Of this program alone: getrusage() begins at what the process that started it had.
    with open("/proc/self/status") as lines:
        return 1024 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:"))

motion = wd.GroundMotion(np.sin(np.arange(20.0)), 0.02)
building = wd.ShearBuilding([1e5] * 5, 1e8, 3.0, law="bouc_wen", yield_force=1e6, hardening_ratio=0.1,
                            damping="rayleigh", damping_ratio=0.05)
scatter = {name: wd.RandomFactor(wd.Lognormal(1, 0.1), per="storey") for name in ("mass", "stiffness")}
design = {
    "individual": lambda: wd.OneMotionPerStructure([motion]),
    "stripes": lambda: wd.Stripes([motion], np.linspace(0.1, 1, 500), wd.PeakGroundAcceleration()),
}[sys.argv[1]]()
scene = wd.Scene(building, design, scatter, tail=0.0)
settings = {"path": sys.argv[2], "overwrite": True, "device": "cpu", "step": 0.02, "checked_share": 0.01}
wd.simulate(scene, structures=1, **settings).close()
base = peak()
for memory in (int(sys.argv[4]), None):
    wd.simulate(scene, structures=int(sys.argv[3]), memory=memory, **settings).close()
    print(peak() - base)
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="this system does not tell a process's peak")
@pytest.mark.parametrize(
    ("design", "structures", "limit"),
    [pytest.param("individual", 400_000, 120 * 10**6, marks=pytest.mark.thorough), ("stripes", 1200, 70 * 10**6)],
)
def test_memory_stays_below_its_limit(design, structures, limit, tmp_path):
    def peaks(structures):
        arguments = [sys.executable, "-c", PEAK, design, str(tmp_path / "run.nc"), str(structures), str(limit)]
        done = subprocess.run(arguments, capture_output=True, text=True, check=True, env=os.environ.copy())
        return map(int, done.stdout.split()[-2:])

    peaks(1)  # what compiling takes must not hide what running takes
    limited, unlimited = peaks(structures)
    assert limited < limit
    assert unlimited > 1.5 * limit  # so much it takes if nothing holds it


class ReachedError(Exception):
    pass


@pytest.fixture
def unlaunched(monkeypatch):
    """Stop each run where its first kernel would be launched."""

    def launch(*arguments, **options):
        raise ReachedError

    monkeypatch.setattr(devices.CpuQueue, "launch", launch)


def test_what_takes_long_is_told_before_it(unlaunched, caplog):
    system = wd.Scene(make_scene().structure, wd.FreeVibration(1000.0, velocity=0.1))
    with pytest.raises(ReachedError):
        wd.simulate(system, structures=10, step=0.01, device="cpu", threads=1)
    assert not caplog.text
    # 2e5 samples x 1e5 steps x 2 storeys x 5 ns = 200 s on one thread, and a tail of none; 4e5 take 400 s.
    with pytest.raises(ReachedError):
        wd.simulate(system, structures=400_000, step=0.01, device="cpu", threads=1)
    assert re.search(r"400,000 samples take 4e\+10 steps of 2 degrees of freedom: .* 7 minutes on cpu", caplog.text)


@pytest.mark.meant_as_given("record_step", "first_period_over_height", "strongest_motion")
def test_a_step_that_cannot_be_meant_does_not_start_a_billion_steps_silently(unlaunched):
    building = wd.ShearBuilding(1.0, 40.0, 1.0)
    told = r"sample 0 takes .* steps of .* check that the step of the motion is in seconds"
    long, longer = (
        wd.Scene(building, wd.GroundMotion([0.0, 1.0, 0.0], step), recorders=("drift",), tail=0.0)
        for step in (1e5, 1e6)
    )
    for scene, step in ((long, {}), (longer, {"longest_step": 0.01})):
        with pytest.warns(UserWarning, match=told), pytest.raises(ReachedError):
            wd.simulate(scene, device="cpu", **step)
    with pytest.raises(ValueError, match=f"{told}.* If they are right, give longest_step="):
        wd.simulate(longer, device="cpu")


@pytest.mark.meant_as_given("hertz_stiffness")
def test_a_contact_that_is_far_too_stiff_is_refused_before_its_steps(unlaunched):
    law = wd.laws.HertzContact(clearance=0.02, hertz_stiffness=1e20)
    springs = [wd.Spring("a", {"x": 1.0}, stiffness=1e7), wd.Spring("stop", {"x": 1.0}, law=law)]
    structure = wd.LumpedStructure({"x": 1e5}, springs, damping="modal", damping_ratio=0.05)
    scene = wd.Scene(structure, wd.FreeVibration(10.0, velocity=0.5))
    with pytest.raises(ValueError, match=r"steps of .* s, over 10 s: check .* stiffnesses of storeys, springs and con"):
        wd.simulate(scene, device="cpu")
