"""Laws that users write in a class body: results, features, pickling, and faults that are refused."""

import json
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import written_laws
from law_rows import spring_row
from written_laws import Cubic, Kinematic, RingSpring, Slider, Wen

import warpdyn as wd
from warpdyn.engine.laws import DEVICES, LAWS
from warpdyn.engine.methods.table import METHODS, check_fits, fitting_methods
from warpdyn.foundations.core.description import fingerprint, to_json

STIFFNESS, YIELD_FORCE = 4e7, 2e5
VALUES = {"yield_force": YIELD_FORCE, "hardening_ratio": 0.05}
PAIRS = {"follow": (Kinematic, wd.laws.Bilinear), "rate": (Wen, wd.laws.BoucWen)}
MOTION = wd.GroundMotion(2.5 * np.sin(np.arange(400) * 0.3) * np.random.default_rng(1).normal(size=400), 0.02)
SHOWN = ("rk4", "newmark_average", "dormand_prince54")
pytestmark = pytest.mark.meant_as_given("strongest_motion", "no_damping")


@pytest.fixture
def registered(monkeypatch):
    """Register the laws of this test as their definition does, and forget them and new ones afterwards."""
    for table, kinds in ((LAWS, (Kinematic, Wen, RingSpring, Cubic)), (DEVICES, (Slider,))):
        for name in set(table):
            monkeypatch.setitem(table, name, table[name])
        for kind in kinds:
            monkeypatch.setitem(table, kind.name, kind)
    before = {**LAWS}, {**DEVICES}
    yield
    for table, kept in zip((LAWS, DEVICES), before, strict=True):
        for name in table.keys() - kept.keys():
            del table[name]


def building(law, storeys=3, **given):
    damping = {"damping": "rayleigh", "damping_ratio": 0.03} | given
    return wd.ShearBuilding([1e5] * storeys, STIFFNESS, 3.0, law=law, **damping)


def peaks(structure, **settings):
    scene = wd.Scene(structure, MOTION, recorders=("drift", "energy"), tail=0.0)
    return wd.simulate(scene, device="cpu", dtype="float64", step=0.01, **settings)


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("method", [pytest.param(m, marks=() if m in SHOWN else pytest.mark.thorough) for m in METHODS])
def test_a_written_law_equals_the_same_law_of_warpdyn(kind, method):
    own, builtin = PAIRS[kind]
    if method not in fitting_methods(own.forces):
        pytest.skip("the method does not fit")
    # The difference quotient of the tangent changes where iterations end, far below the error of a step.
    rtol = 1e-6 if METHODS[method].kind == "implicit" else 1e-9
    ours, theirs = (peaks(building(law(**VALUES)), method=method) for law in (own, builtin))
    for name in ("peak_storey_drift_ratio", "hysteretic_energy"):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=rtol)
    assert ours["status"].values.tolist() == [0]
    assert (ours["hysteretic_energy"] > 100).all()


def test_a_ring_spring_is_within_its_published_bounds():
    # The rules of friction springs, in Python: force within lines through the preload, of both slopes.
    p = {"preload": 7e4, "loading_ratio": 0.04, "unloading_ratio": 0.35}
    drift = np.interp(np.arange(0, 8, 0.02), np.arange(9), [0, 0.03, 0.01, 0.04, -0.02, 0.015, -0.05, 0.02, 0])
    force, expected = 0.0, []
    for before, now in zip([0.0, *drift[:-1]], drift, strict=True):
        line = p["preload"] + p["loading_ratio"] * STIFFNESS * abs(now)
        upper, lower = (min(STIFFNESS * abs(now), each) for each in (line, p["unloading_ratio"] * line))
        side = -1.0 if now < 0 else 1.0
        force = side * min(max(side * (force + STIFFNESS * (now - before)), lower), upper)
        expected.append(force)
    found = wd.storey_hysteresis(building(RingSpring(**p), 1), drift)["storey_force"].values[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)


def test_a_law_without_memory():
    drift = np.array([0.0, 0.01, -0.02])
    force = wd.storey_hysteresis(building(Cubic(softening=[1e10, 0.0]), 2), drift)["storey_force"].values
    np.testing.assert_allclose(force[:, 0], STIFFNESS * drift - 1e10 * drift**3, rtol=1e-14)
    np.testing.assert_allclose(force[:, 1], STIFFNESS * drift, rtol=1e-14)


FEATURES = {
    "a law for each storey": {"law": lambda law: (law(**VALUES), wd.laws.Takeda(**VALUES), law(**VALUES))},
    "p_delta": {"gravity_load": 1e6},
    "drift capacity": {"drift_ratio_capacity": 0.01},
    "tangent damping": {"damping": "rayleigh_tangent"},
    "devices": {"devices": (wd.laws.Gap(clearance=0.01, contact_stiffness=1e8),)},
}


@pytest.mark.parametrize("feature", FEATURES)
def test_features_of_scenes(feature):
    given = dict(FEATURES[feature])
    laws = given.pop("law", lambda law: law(**VALUES))
    ours, theirs = (peaks(building(laws(law), **given)) for law in PAIRS["follow"])
    np.testing.assert_array_equal(ours["status"], theirs["status"])
    # Within the step in which a yielding storey turns back, the difference quotient is that of unloading.
    rtol = 1e-4 if feature == "tangent damping" else 1e-6
    np.testing.assert_allclose(ours["peak_storey_drift_ratio"], theirs["peak_storey_drift_ratio"], rtol=rtol)


def test_a_written_device_equals_the_same_device_of_warpdyn():
    ours = peaks(building("elastic", devices=(Slider(slider_force=1e5, slider_stiffness=3e7),)))
    theirs = peaks(building("elastic", devices=(wd.laws.FrictionDamper(slip_force=1e5, brace_stiffness=3e7),)))
    # Their elastic energy is that of the brace, too: F^2 / 2 k is exact for a slider.
    for name in ("peak_storey_drift_ratio", "hysteretic_energy"):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=1e-9)


def test_pushover_and_plan():
    roof = np.linspace(0, 0.05, 11)
    ours, theirs = (wd.pushover(building(law(**VALUES)), roof)["base_shear"] for law in PAIRS["follow"])
    np.testing.assert_allclose(ours, theirs, rtol=1e-6)
    scene = wd.Scene(building(Kinematic(**VALUES)), MOTION, tail=0.0)
    assert wd.plan(scene, target_error=0.05, device="cpu", method="rk4").method == "rk4"


def test_events_portfolio_scatter_and_statistics(registered):
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}

    def runs(law):
        sequence = wd.EventSequence({"first": wd.Cloud([MOTION]), "second": wd.Cloud([MOTION])})
        yield wd.simulate(
            wd.Scene(building(law), sequence, scatter, tail=1.0), structures=4, method="rk4", device="cpu"
        )
        portfolio = wd.Portfolio({"a": wd.Archetype(building(law), 2, scatter), "b": wd.Archetype(building(law, 2), 1)})
        yield wd.simulate(wd.Scene(portfolio, MOTION, tail=0.0), method="rk4", device="cpu")

    for ours, theirs in zip(runs(Kinematic(**VALUES)), runs(wd.laws.Bilinear(**VALUES)), strict=True):
        np.testing.assert_allclose(ours["peak_storey_drift_ratio"], theirs["peak_storey_drift_ratio"], rtol=1e-4)


@pytest.mark.meant_as_given("yield_drift_ratio", "yield_base_shear_coefficient", "strongest_motion")
def test_a_too_long_step_is_detected():
    for law in PAIRS["rate"]:
        weak = building(law(yield_force=2e2, hardening_ratio=0.3), 1)
        scene = wd.Scene(weak, MOTION, tail=0.0)
        found = wd.simulate(scene, device="cpu", method="rk4", step=0.02, on_unstable="flag")
        assert (
            found["status"].values[0]
            == found["status"].attrs["flag_values"][
                found["status"].attrs["flag_meanings"].split().index("unstable_step")
            ]
        )


def test_implicit_methods_do_not_fit_a_force_that_relaxes():
    forces = replace(Wen.forces, relaxes=True)
    kinds = {METHODS[name].kind for name in fitting_methods(forces)}
    assert kinds == {"explicit"}
    with pytest.raises(ValueError, match=r"'newmark_average' does not fit storeys of law 'wen' .*a force that relaxes"):
        check_fits("newmark_average", forces)


def test_names_classes_and_objects(registered):
    named = building("kinematic", **VALUES)
    assert to_json(named) == to_json(building(Kinematic(**VALUES))) == to_json(building(Kinematic, **VALUES))
    assert "slider" in wd.laws.DEVICES


def definition(name, factor="1.0", base="wd.laws.Law"):
    """Return the text of a law whose stiffness has a factor."""
    return f"""
from typing import Any
import warp as wp
import warpdyn as wd

class {name}({base}):
    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return {factor} * c.stiffness * drift
"""


def defined(tmp_path, *given, file="mine.py", **named):
    """Return the class that a file defines."""
    path = tmp_path / file
    path.write_text(definition(*given, **named))
    namespace = {"__name__": "mine"}
    exec(compile(path.read_text(), str(path), "exec"), namespace)
    return namespace[given[0]]


def test_a_redefinition_replaces_the_law(tmp_path, registered):
    first = defined(tmp_path, "Mine", "1.0", file="first.py")
    assert wd.laws.LAWS["mine"] is first
    old = building("mine", 1)
    again = defined(tmp_path, "Mine", "1.0", file="again.py")
    assert again.variants == first.variants  # the same kernel
    second = defined(tmp_path, "Mine", "0.5", file="second.py")
    new = building("mine", 1)
    forces = [wd.storey_hysteresis(each, [0.0, 0.01])["storey_force"].values[1, 0] for each in (old, new)]
    np.testing.assert_allclose(forces, [4e5, 2e5])
    assert building(first(), 1).storey_law.laws == (first,)
    assert fingerprint(old) == fingerprint(building(again(), 1)) != fingerprint(new)
    assert second.written in json.loads(to_json(new))["written_laws"]["mine"]


def test_a_description_needs_the_class(registered, monkeypatch):
    scene = wd.Scene(building("kinematic", **VALUES), MOTION)
    text = to_json(scene)
    again = wd.Scene.from_json(text, MOTION)
    assert to_json(again.structure) == to_json(scene.structure)
    monkeypatch.setattr(Kinematic, "written", "another text")
    with pytest.warns(UserWarning, match="the class of 'kinematic' has changed"):
        wd.Scene.from_json(text, MOTION)
    monkeypatch.delitem(LAWS, "kinematic")
    with pytest.raises(ValueError, match="'kinematic', which is not part of warpdyn: define its class first"):
        wd.Scene.from_json(text, MOTION)


WORKER = """
import pickle, sys
import numpy as np, warpdyn as wd
from warpdyn.engine.kernels.build import build_kernel
plan, building = pickle.load(open(sys.argv[1], "rb"))
print(build_kernel(plan).module.get_module_identifier(1))
print(wd.storey_hysteresis(building, [0.0, 0.01, -0.02])["storey_force"].values[:, 0].tolist())
"""


def test_processes_receive_the_law(tmp_path):
    """A class of __main__ is pickled by value; a plan holds the text of its functions."""
    program = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parent)!r})
import cloudpickle, numpy as np
text = open({written_laws.__file__!r}).read()
exec(compile(text, {written_laws.__file__!r}, "exec"))
from warpdyn.campaigns.integration.model import dynamics_of, plan_of
from warpdyn.engine.kernels.build import build_kernel
assert Wen.__module__ == "__main__"
own = wd.ShearBuilding([1e5] * 2, 4e7, 3.0, law=[Wen(yield_force=2e5, hardening_ratio=0.05), RingSpring(preload=1e5,
    loading_ratio=0.1)], devices=(Slider(slider_force=1e5, slider_stiffness=3e7),), damping="storey",
    damping_coefficient=1e5)
scene = wd.Scene(own, wd.GroundMotion(np.sin(np.arange(50.0)), 0.02))
plan = plan_of(scene, dynamics_of(scene), "rk4", "float32", is_gpu=False)
cloudpickle.dump((plan, own), open({str(tmp_path / "law.pkl")!r}, "wb"))
print(build_kernel(plan).module.get_module_identifier(1))
print(wd.storey_hysteresis(own, [0.0, 0.01, -0.02])["storey_force"].values[:, 0].tolist())
"""
    here, there = (
        subprocess.run([sys.executable, "-W", "ignore", *each], capture_output=True, text=True, check=False)
        for each in (["-c", program], ["-c", WORKER, str(tmp_path / "law.pkl")])
    )
    assert here.stdout, here.stderr
    assert there.stdout == here.stdout, there.stderr


CLUSTER = """
import sys
sys.path.insert(0, {folder!r})
exec(compile(open({file!r}).read(), {file!r}, "exec"))  # as in a notebook: classes of __main__
import distributed, numpy as np
assert Kinematic.__module__ == "__main__"
wave = 2.5 * np.sin(np.arange(200) * 0.3)
own = wd.ShearBuilding([1e5] * 2, 4e7, 3.0, law=Kinematic(yield_force=2e5, hardening_ratio=0.05), damping="rayleigh",
    damping_ratio=0.03)
scene = wd.Scene(own, wd.GroundMotion(wave, 0.02), {{"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}})
here = wd.simulate(scene, structures=40, device="cpu")
with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
    with distributed.Client(cluster) as client:
        there = wd.simulate(scene, structures=40, cluster=client)
ours, theirs = (run["peak_storey_drift_ratio"] for run in (here, there))
print(np.array_equal(ours, theirs), float(ours.max()) > 0.005)
"""


def test_a_law_of_a_notebook_runs_on_a_dask_cluster():
    pytest.importorskip("distributed")
    program = CLUSTER.format(folder=str(Path(__file__).parent), file=written_laws.__file__)
    ran = subprocess.run([sys.executable, "-W", "ignore", "-c", program], capture_output=True, text=True, check=False)
    assert ran.stdout.split() == ["True", "True"], ran.stderr


def test_plans_can_be_compared_and_pickled():
    variant = Kinematic.variants[next(iter(Kinematic.variants))]
    assert pickle.loads(pickle.dumps(variant)) == variant
    assert spring_row(pickle.loads(pickle.dumps(variant))) is spring_row(variant)


HEAD = "from typing import Any\nimport numpy as np\nimport warp as wp\nimport warpdyn as wd\n"
GOOD = """
    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.stiffness * drift
"""


def law(body, name="Mine", kind="Law"):
    return f"class {name}(wd.laws.{kind}):{body}"


def function(*lines, name="follow", arguments="drift: Any, memory: Any, c: Any", memory=""):
    text = "".join(f"\n        {line}" for line in lines)
    return f"{memory}\n    @wp.func\n    def {name}({arguments}):{text}\n"


SLIP = "\n    memory = ('slip',)"
STRENGTH = "\n    strength: float = wd.laws.parameter({})"
FAULTS = {
    "no force": (law(STRENGTH.format("'N', 'strength'")), "its force is missing: define follow"),
    "wrong arguments": (
        law(function("return c.stiffness * d", arguments="d: Any, memory: Any, c: Any")),
        r"follow must have the arguments \(drift, memory, c\), got \(d, memory, c\)",
    ),
    "wrong number of memory values": (
        law(function("return c.stiffness * drift, drift, drift", memory=SLIP)),
        r"follow returns 3 values, but must return 2: force, slip \(line 9\)",
    ),
    "unknown coefficient": (law(function("return c.stifness * drift")), "unknown coefficient 'stifness' .*'stiffness'"),
    "unknown memory value": (
        law(function("return c.stiffness * drift, memory.slp", memory=SLIP)), "unknown memory value 'slp' .*'slip'"
    ),
    "non-finite default": (law(STRENGTH.format("'N', 'strength', default=np.nan") + GOOD), "strength': .*finite.* nan"),
    "default out of its bounds": (
        law(STRENGTH.format("'N', 'strength', low=1.0, default=0.5") + GOOD), "default 0.5, which is not .*at least 1"
    ),
    "name of a built-in law": (law(GOOD, "Bilinear"), "warpdyn has a law 'bilinear' already: give .* another name"),
    "name of a built-in device": (law(GOOD, "Gap"), "warpdyn has a device 'gap' already"),
    "reversed bounds": (
        law(STRENGTH.format("'N', 'strength', low=2.0, high=1.0") + GOOD), "low is 2 and high is 1; give low below high"
    ),
    "no unit": (law(STRENGTH.format("'', 'strength'") + GOOD), "'strength' has no unit: give a unit"),
    "a default without a parameter": (law("\n    strength: float = 2.0" + GOOD), "strength is not a parameter: write"),
    "undeclared name": (law(function("return c.stiffness * drift * factor")), "reads factor, which is not defined"),
    "numpy in a kernel": (law(function("return c.stiffness * np.sin(drift)")), r"np.sin .*use wp.sin"),
    "assigns to the drift": (law(function("drift = 2.0 * drift", "return drift")), "assigns to its argument drift"),
    "assigns to a coefficient": (
        law(function("c.stiffness = 1.0", "return c.stiffness * drift")), "changes c.stiffness: compute .* in derived"
    ),
    "assigns to the memory": (
        law(function("memory.slip = drift", "return drift, drift", memory=SLIP)), "changes memory.slip: return the new"
    ),
    "memory is a string": (
        law(function("return drift, drift", memory="\n    memory = ('slip')")), "memory must be a tuple .* got 'slip'"
    ),
    "a path without return": (law(function("if drift > 0:", "    return drift")), "does not return a value on ev"),
    "two ways to follow": (
        law(GOOD + function("return velocity", name="rate", arguments="velocity: Any, memory: Any, c: Any")),
        "follow already returns force and memory: remove rate",
    ),
    "a device without a stiffness": (law(GOOD, kind="Device"), "device Mine: .*define stiffest"),
    "an unknown parameter in derived": (
        law("\n    @staticmethod\n    def derived(p):\n        return {'a': p['strenght']}\n" + GOOD),
        "derived reads the unknown parameter 'strenght'",
    ),
}  # fmt: skip


@pytest.mark.fast
@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_refused_when_the_class_is_defined(fault, tmp_path):
    text, message = FAULTS[fault]
    path = tmp_path / "mine.py"
    path.write_text(HEAD + text)
    before = {**LAWS}, {**DEVICES}
    with pytest.raises(TypeError, match=message) as found:
        exec(compile(path.read_text(), str(path), "exec"), {"__name__": "mine"})
    assert str(found.value).startswith(("law ", "device "))
    assert before == ({**LAWS}, {**DEVICES})


def test_functions_outside_of_the_class_and_numbers_are_taken_along(tmp_path, registered):
    path = tmp_path / "mine.py"
    path.write_text(
        HEAD + "SHARE = 0.5\n\n\n@wp.func\ndef half(x: Any):\n    return SHARE * x\n\n\n"
        + law(function("total = 0.0", "for i in range(2):", "    total += half(c.stiffness * drift)", "return total"))
    )  # fmt: skip
    namespace = {"__name__": "mine"}
    exec(compile(path.read_text(), str(path), "exec"), namespace)
    force = wd.storey_hysteresis(building(namespace["Mine"](), 1), [0.0, 0.01])["storey_force"].values[1, 0]
    assert force == pytest.approx(STIFFNESS * 0.01)
    assert "0.5" in namespace["Mine"].written
