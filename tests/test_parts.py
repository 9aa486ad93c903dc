"""The parts of kernels: what they declare, and that each kernel's text holds only what its scene names."""

import functools
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from law_rows import rules_of

import warpdyn as wd
from warpdyn.engine.kernels import build, composition, registry, source
from warpdyn.engine.kernels.composing.user_recorders import USERS
from warpdyn.engine.kernels.output_table import RECORDERS
from warpdyn.engine.kernels.plan import Plan, structs

EVERY = tuple(sorted(RECORDERS["chain"]))
PLAIN = Plan("chain", 5, rules_of("bilinear"), "rayleigh", "base_acceleration", ("drift",), "rk4", "float32")


def text_of(plan, is_gpu=False):
    return build.composed(build.fitted(plan, is_gpu)).text


@pytest.mark.parametrize(
    "part", registry.all_parts(), ids=lambda part: part.__name__.removeprefix("warpdyn.engine.kernels.")
)
def test_every_part_is_described(part):
    assert part.__doc__


def test_a_plain_building_has_a_short_text():
    structure = wd.ShearBuilding(
        np.full(5, 1e5), 8e7, 3.0, law="bilinear", yield_force=4e5, hardening_ratio=0.05, damping="rayleigh",
        damping_ratio=0.05,
    )  # fmt: skip
    scene = wd.Scene(structure, wd.GroundMotion(np.ones(100), 0.01), recorders=("drift",))
    text = source(scene, method="rk4", device="cpu")
    assert text == text_of(PLAIN)
    # For speed, ten lines hand the state below a storey on, and fifteen find where the step of a lane changes.
    assert text.count("\n") <= 180
    # Nothing is there of what it does not name.
    assert "peak_drift" in text
    for name in ("energy", "peak_acceleration", "weight_over_height", "section", "trial", "initial_memory", "HAS_"):
        assert name not in text, name


PLANS = [
    replace(PLAIN, recorders=EVERY),
    replace(PLAIN, recorders=EVERY, method="dormand_prince54", physics=("p_delta",), viscous_dampers="power"),
    replace(PLAIN, recorders=EVERY, method="velocity_verlet", law=rules_of("peak_oriented"), load="harmonic_force"),
    replace(PLAIN, recorders=(*EVERY, "state"), law=rules_of("bouc_wen"), damping="rayleigh_tangent", resumes=True),
    replace(PLAIN, recorders=EVERY, dofs=50, law=rules_of("hysteretic"), load="force_history", physics=("p_delta",)),
    replace(
        PLAIN,
        recorders=EVERY,
        method="newmark_average",
        law=rules_of("pinching4"),
        damping="modal",
        load="kanai_tajimi",
    ),
    replace(PLAIN, recorders=EVERY, method="exact", law=rules_of("elastic"), damping="general"),
    Plan(
        "dense",
        3,
        rules_of("elastic"),
        "matrix",
        "base_acceleration",
        ("acceleration", "displacement", "energy"),
        "rk4",
        "float64",
    ),
]


@pytest.mark.parametrize("is_gpu", [False, True])
@pytest.mark.parametrize("plan", PLANS, ids=lambda plan: f"{plan.method}-{plan.law}-{plan.load}")
def test_texts_are_laid_out_like_the_rest(plan, is_gpu):
    text = text_of(plan, is_gpu)
    assert max(map(len, text.splitlines())) <= 120
    assert "slot(" not in text
    assert "\n\n\n" not in text
    assert not any(line != line.rstrip() for line in text.splitlines())


def test_recorders_are_read_without_warp():
    # As a module of the package, whose own face needs it.
    code = """
import sys, types
package = types.ModuleType("warpdyn")
package.__path__ = [sys.argv[1]]
sys.modules["warpdyn"] = package
from warpdyn.engine.kernels.registry import recorders
assert "drift" in recorders()["chain"]
assert "warp" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code, wd.__path__[0]], check=True)


def test_arguments_are_what_parts_declare():
    types = structs("float32", tuple(USERS.values()))  # other tests of this process may define recorders
    assert set(vars(types)) == {"Control", "History", "Load", "Output", "Samples", "Structure"}
    outputs = {name for rows in RECORDERS.values() for variables in rows.values() for name in variables}
    assert outputs < set(types.Output.vars)
    assert types.Output.vars["peak_storey_drift"].type.ndim == 2


def small_scene(excitation=None):
    building = wd.ShearBuilding(1.0, 100.0, 3.0, law="bilinear", yield_force=1.0, hardening_ratio=0.1)
    return wd.Scene(building, excitation or wd.FreeVibration(1.0, velocity=0.1), recorders=("drift",))


def test_a_sequence_shows_the_kernel_of_its_first_event():
    motion = wd.GroundMotion(np.ones(10), 0.01)
    sequence = wd.EventSequence({"main shock": motion, "aftershock": motion})
    assert "final_displacement" in source(small_scene(sequence), device="cpu")
    assert "final_displacement" not in source(small_scene(motion), device="cpu")


CITY = wd.Portfolio({"house": wd.Archetype(wd.ShearBuilding(1.0, 100.0, 3.0), 2)})
MOTION = wd.GroundMotion(np.ones(10), 0.01)


@pytest.mark.parametrize(
    ("scene", "settings", "message"),
    [
        ("scene", {}, r"source\(\) takes a Scene"),
        (wd.Scene(CITY, wd.OneMotionPerStructure([MOTION])), {}, "one structure, got a Portfolio"),
        (small_scene(), {"method": "rk5"}, "unknown method 'rk5'"),
        (small_scene(), {"dtype": "float16"}, "unknown dtype 'float16'"),
        (small_scene(), {"method": "exact"}, "'exact' does not fit storeys of law 'bilinear'"),
    ],
)
def test_no_kernel_is_shown_that_would_not_run(scene, settings, message):
    with pytest.raises((TypeError, ValueError), match=message):
        source(scene, device="cpu", **settings)


def test_flags_of_the_user_come_first(monkeypatch):
    own = "-fpch-instantiate-templates -ffp-contract=fast -mprefer-vector-width=512"
    for configured, first in ((None, "-march=native "), ("", ""), ("-march=x86-64-v3", "-march=x86-64-v3 ")):
        monkeypatch.setattr(wp.config, "cpu_compiler_flags", configured)
        assert build.options(PLAIN)["cpu_compiler_flags"] == first + own


def test_threads_build_one_kernel(monkeypatch):
    # Python 3.11 fails where two threads parse at once.
    built = []
    monkeypatch.setattr(build, "_composed_kernel", functools.cache(build._composed_kernel.__wrapped__))
    monkeypatch.setattr(
        build, "kernel_of", lambda *given, **named: built.append(given) or composition.kernel_of(*given, **named)
    )
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # so that all begin before one has ended
    try:
        with ThreadPoolExecutor(8) as pool:
            kernels = list(pool.map(build.build_kernel, [PLAIN] * 8))
    finally:
        sys.setswitchinterval(interval)
    assert len(built) == 1
    assert all(kernel is kernels[0] for kernel in kernels)


def test_unoptimised_tests_build_kernels_of_their_own(request):
    shipped = build.build_kernel(PLAIN)
    request.getfixturevalue("unoptimised")
    assert build.build_kernel(PLAIN) is not shipped
