"""Mistakes in users' classes of laws and devices that have no effect, or a wrong one, without a check."""

import pickle
import subprocess
import sys

import cloudpickle
import numpy as np
import pytest
from written_laws import Kinematic, Slider

import warpdyn as wd
from warpdyn.engine.laws import DEVICES, LAWS

pytestmark = pytest.mark.fast

HEAD = "from typing import Any\nimport numpy as np\nimport warp as wp\nimport warpdyn as wd\n\n"


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    """Forget the classes that a test defines."""
    before = {**LAWS}, {**DEVICES}
    yield
    for table, kept in zip((LAWS, DEVICES), before, strict=True):
        table.clear()
        table.update(kept)


def defined(tmp_path, text, name="Mine", file="mine.py"):
    """Return the class that a text defines, from a file."""
    path = tmp_path / file
    path.write_text(HEAD + text)
    namespace = {"__name__": "mine"}
    exec(compile(path.read_text(), str(path), "exec"), namespace)
    return namespace[name]


SHARING = """
class Mine(wd.laws.Device):
    yield_force: float = wd.laws.parameter("N", "force at which the damper yields", low=0.0)
    damper_stiffness: float = wd.laws.parameter("N m-1", "stiffness of the damper", low=0.0, low_open=True)
    memory = ("slip",)

    @staticmethod
    def stiffest(p):
        return p["damper_stiffness"]

    @staticmethod
    def derived(p):
        return {"yield_drift": p["yield_force"] / p["damper_stiffness"]}

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        slip = wp.clamp(memory.slip, drift - c.yield_drift, drift + c.yield_drift)
        return c.damper_stiffness * (drift - slip), slip
"""


def test_a_law_and_a_device_may_not_share_a_parameter(tmp_path):
    damper = defined(tmp_path, SHARING)
    values = {"yield_force": 2e5, "hardening_ratio": 0.05}
    given = [
        {"law": "bilinear", "devices": ("mine",), "damper_stiffness": 1e7, **values},
        {"law": wd.laws.Bilinear(**values), "devices": (damper(yield_force=1e5, damper_stiffness=1e7),)},
        {"law": ["elastic", wd.laws.Bilinear(**values)], "devices": (damper(yield_force=1e5, damper_stiffness=1e7),)},
    ]
    for each in given:
        with pytest.raises(
            ValueError, match=r"law 'bilinear' and device 'mine' share the parameter 'yield_force', and"
        ) as found:
            wd.ShearBuilding([1e5, 1e5], 4e7, 3.0, **each)
        assert str(found.value).endswith("rename the parameter in class Mine")
    # Other names: law and device keep their own values.
    building = wd.ShearBuilding(
        1e5, 4e7, 3.0, law=Kinematic(**values), devices=(Slider(slider_force=1e5, slider_stiffness=1e7),)
    )
    force = wd.storey_hysteresis(building, [0.0, 0.1])["storey_force"].values[1, 0]
    assert force == pytest.approx(2e5 + 0.05 * 4e7 * (0.1 - 2e5 / 4e7) + 1e5, rel=1e-12)


@pytest.mark.parametrize("name", ["drift_ratio_capacity", "law", "damping"])
def test_a_parameter_may_not_have_the_name_of_an_argument_of_buildings(tmp_path, name):
    with pytest.raises(TypeError, match=f"parameter '{name}' has the name of a property of buildings"):
        defined(tmp_path, SHARING.replace("yield_force", name))


OPTIONAL = {
    "stiffest": "stifest",
    "derived": "derive",
    "problem": "problems",
    "caution": "cautions",
    "counts_reversals": "count_reversals",
    "is_sensitive": "is_senstive",
    "is_linear": "is_liner",
    "is_linear_until_yield": "is_linear_until_yeild",
    "memory": "memmory",
    "relaxes": "relaxs",
    "exceptions": "exeptions",
    "elastic_energy": "elastic_energie",
    "tangent": "tangents",
    "opensees": "openses",
}
PLAIN = """
class Mine(wd.laws.Law):
    {}

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.stiffness * drift
"""


@pytest.mark.parametrize("name", OPTIONAL)
def test_a_misspelt_optional_name_is_refused(tmp_path, name):
    misspelt = OPTIONAL[name]
    for statement in (f"{misspelt} = 1", f"@staticmethod\n    def {misspelt}(p):\n        return None"):
        message = (
            f"law Mine: {misspelt} is not a name that warpdyn reads, so that it has no effect: rename it to '{name}'"
        )
        with pytest.raises(TypeError, match=message):
            defined(tmp_path, PLAIN.format(statement))
    device_function = f"@wp.func\n    def {misspelt}(drift: Any, memory: Any, c: Any):\n        return drift"
    with pytest.raises(TypeError, match=f"rename it to '{name}'"):
        defined(tmp_path, PLAIN.format(device_function))


@pytest.mark.parametrize("name", ["name", "has_rate", "forces"])
def test_a_name_that_is_computed_is_refused(tmp_path, name):
    with pytest.raises(TypeError, match=f"law Mine: {name} is computed by warpdyn, .*remove {name}"):
        defined(tmp_path, PLAIN.format(f"{name} = 'special'"))


def test_other_names_are_allowed(tmp_path):
    body = """
    rates: float = wd.laws.parameter("1", "a parameter", default=0.5)
    _derive = 2.0
    catalogue = "Smith (2020)"

    @staticmethod
    def problems(p):
        return None

    @classmethod
    def problem(cls, p):
        return cls.problems(p)

    @wp.func
    def scaled(drift: Any, c: Any):
        return c.rates * c.stiffness * drift

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return scaled(drift, c)
"""
    text = "class Mine(wd.laws.Law):" + body
    law = defined(tmp_path, text)
    force = wd.storey_hysteresis(wd.ShearBuilding(1e5, 4e7, 3.0, law=law()), [0.0, 0.01])["storey_force"].values[1, 0]
    assert force == pytest.approx(0.5 * 4e7 * 0.01, rel=1e-12)


def test_functions_on_one_line(tmp_path):
    text = """
class Mine(wd.laws.Law):
    memory = ("plastic",)
    @staticmethod
    def derived(p): half = p["stiffness"] / 2; return {"half": half}
    @wp.func
    def force(drift: Any, memory: Any, c: Any): return c.half * drift  # half of the stiffness
    @wp.func
    def return_mapping(drift: Any, memory: Any, c: Any): twice = 2.0 * drift; return twice
"""
    building = wd.ShearBuilding(1e5, 4e7, 3.0, law=defined(tmp_path, text)())
    force = wd.storey_hysteresis(building, [0.0, 0.01])["storey_force"].values[1, 0]
    assert force == pytest.approx(2e7 * 0.01, rel=1e-12)


DERIVED = """
class Mine(wd.laws.Law):
    @staticmethod
    def derived(p):
        return {{"half": {}}}

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.half * drift
"""
WRONG_SHAPES = ("p['stiffness'][:, 0] / 2", "p['stiffness'].sum(axis=-1)", "np.ones((1, 1, 1))", "np.ones((1, 2))")


@pytest.mark.parametrize("value", WRONG_SHAPES)
def test_coefficients_of_a_wrong_shape_are_refused(tmp_path, value):
    with pytest.raises(TypeError, match=r"law Mine: derived returns 'half' of shape \(.*one per structure and storey"):
        defined(tmp_path, DERIVED.format(value))


def test_a_shape_that_is_wrong_only_for_several_structures_is_refused(tmp_path):
    # The class is checked with one structure; a run has as many structures as the building has storeys.
    law = defined(
        tmp_path, DERIVED.format("p['stiffness'] / 2 if len(p['stiffness']) == 1 else p['stiffness'][:, 0] / 2")
    )
    p = {"stiffness": np.array([[1e7, 2e7], [3e7, 4e7]])}
    with pytest.raises(TypeError, match=r"derived returns 'half' of shape \(2,\).*here shape \(2, 2\)"):
        law.coefficients(p, law.spring(p))
    building = wd.ShearBuilding([1e5, 1e5], [1e7, 2e7], 3.0, law=law(), damping="rayleigh", damping_ratio=0.05)
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    motion = wd.GroundMotion(np.sin(np.arange(100.0) * 0.1), 0.02)
    with pytest.raises(TypeError, match=r"derived returns 'half' of shape \(2,\)"):
        wd.simulate(wd.Scene(building, motion, scatter), structures=2, device="cpu")


def test_numbers_and_columns_are_coefficients(tmp_path):
    for value in ("2e7", "p['stiffness'] / 2", "p['stiffness'].max(axis=-1, keepdims=True) / 2", "[[2e7]]"):
        building = wd.ShearBuilding([1e5, 1e5], 4e7, 3.0, law=defined(tmp_path, DERIVED.format(value))())
        force = wd.storey_hysteresis(building, [0.0, 0.01])["storey_force"].values[1]
        np.testing.assert_allclose(force, 2e7 * 0.01, rtol=1e-12)


SENT = """
FACTOR = 0.5

class Mine(wd.laws.Law):
    part: float = wd.laws.parameter("1", "a part of the stiffness", default=1.0)

    @staticmethod
    def derived(p):
        return {"softened": FACTOR * p["part"] * p["stiffness"]}

    @wp.func
    def follow(drift: Any, memory: Any, c: Any):
        return c.softened * drift
"""
ELSEWHERE = """
import pickle, sys
import cloudpickle, warpdyn as wd
building, law = pickle.load(open(sys.argv[1], "rb"))
assert type(law) is building.storey_law.laws[0]
print(wd.storey_hysteresis(building, [0.0, 0.01])["storey_force"].values[1].tolist())
cloudpickle.dump((building, law), open(sys.argv[1], "wb"))
"""


def test_a_process_keeps_its_class_when_it_reads_its_own_pickle(tmp_path):
    law = defined(tmp_path, SENT)  # of a module that cannot be imported, as in a notebook
    attributes = dict(vars(law))
    building = wd.ShearBuilding([1e5, 1e5], 4e7, 3.0, law=[law(part=0.2), "elastic"])
    scene = wd.Scene(building, wd.GroundMotion([0.0, 1.0], 0.02))
    found = [pickle.loads(cloudpickle.dumps(scene)).structure, pickle.loads(cloudpickle.dumps(building))]
    assert pickle.loads(cloudpickle.dumps(law(part=0.2))) == law(part=0.2)
    # Also if the pickle has been in another process.
    path = tmp_path / "building.pkl"
    path.write_bytes(pickle.dumps((building, law(part=0.2))))
    there = subprocess.run([sys.executable, "-c", ELSEWHERE, path], capture_output=True, text=True, check=False)
    assert there.stdout == "[40000.0, 400000.0]\n", there.stderr
    returned, of_law = pickle.loads(path.read_bytes())
    assert of_law == law(part=0.2)
    for each in (*found, returned):
        assert each.storey_law.laws == building.storey_law.laws
        assert each.storey_laws == ("mine", "elastic")
    assert dict(vars(law)) == attributes
    assert all(vars(law)[name] is value for name, value in attributes.items())
    softer = type("Softer", (law,), {"__module__": "mine", "problem": staticmethod(lambda p: None)})
    assert softer.rows[next(iter(softer.rows))] == law.rows[next(iter(law.rows))]


def test_a_class_of_another_process_follows_its_constants(tmp_path):
    """A notebook that changes a constant and sends the class again has new results in the other process, too."""
    script = tmp_path / "script.py"
    script.write_text(
        HEAD
        + "import cloudpickle, sys\n"
        + SENT
        + """
building = wd.ShearBuilding(1e5, 4e7, 3.0, law=Mine())
for name, FACTOR in zip(sys.argv[1:], (0.5, 0.25)):
    cloudpickle.dump(building, open(name, "wb"))
"""
    )
    names = [tmp_path / "first.pkl", tmp_path / "second.pkl"]
    ran = subprocess.run([sys.executable, script, *names], capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stderr
    for name, factor in zip(names, (0.5, 0.25), strict=True):
        found = pickle.loads(name.read_bytes())
        force = wd.storey_hysteresis(found, [0.0, 0.01])["storey_force"].values[1, 0]
        assert force == pytest.approx(factor * 4e7 * 0.01, rel=1e-12)


def test_a_users_device_is_not_put_into_an_added_storey():
    slider = Slider(slider_force=1e5, slider_stiffness=3e7)
    building = wd.ShearBuilding([1e5, 1e5], 4e7, 3.0, devices=(slider,), damping="rayleigh", damping_ratio=0.05)
    message = r"device 'slider' would also act in the added storey, .*write the added storey into ShearBuilding itself"
    with pytest.raises(ValueError, match=message):
        building.on_isolators("elastic", 1e5, 0.4, stiffness=1e6)
    with pytest.raises(ValueError, match=message):
        building.with_tuned_mass_damper(0.02)
