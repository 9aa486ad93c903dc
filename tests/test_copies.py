"""Copies and pickles of what scenes are made of hold the same values, and run to the same bits."""

import copy
import pickle

import numpy as np
import pytest
from sound_calls import LIMITS, OF_BUILDING, motions, without_runs

import warpdyn as wd
from warpdyn.foundations.core.description import fingerprint
from warpdyn.foundations.core.frozen_values import FrozenMapping

COPIES = {"copy": copy.copy, "deepcopy": copy.deepcopy, "pickle": lambda value: pickle.loads(pickle.dumps(value))}
pytestmark = pytest.mark.filterwarnings("ignore:implausible|nothing is scattered")


@pytest.fixture(scope="module")
def values(tmp_path_factory):
    """Return an object of every public class of `sound_calls`."""
    calls = without_runs(tmp_path_factory.mktemp("files"))
    made = {name: function(**arguments) for name, (function, arguments) in calls.items() if isinstance(function, type)}
    building = wd.ShearBuilding(**OF_BUILDING)
    made["isolated"] = building.on_isolators("elastic", 1e5, 0.4, stiffness=4e6)
    made["mixed laws"] = wd.ShearBuilding(
        1e5, [4e7, 3e7], 3.0, law=[wd.laws.Bilinear(yield_force=3e5, hardening_ratio=0.05), "elastic"]
    )
    return made | {
        name: function(**arguments)
        for name, (function, arguments) in calls.items()
        if ".from_" in name and name[0].isupper()
    }


@pytest.mark.fast
@pytest.mark.parametrize("how", COPIES)
def test_values_are_the_same(values, how):
    assert len(values) > 50
    for name, value in values.items():
        again = COPIES[how](value)
        assert type(again) is type(value), name
        if hasattr(value, "__dict__") and not isinstance(value, list):
            assert fingerprint(again) == fingerprint(value), name


@pytest.mark.fast
@pytest.mark.parametrize("how", COPIES)
def test_values_stay_read_only(how):
    """A record's peak is computed once: its samples must not change afterwards, in a copy neither."""
    motion = motions()[0]
    building = wd.ShearBuilding(**OF_BUILDING)
    hazard = wd.HazardCurve([0.1, 1.0], [1e-2, 1e-4])
    for array in (
        COPIES[how](motion).acceleration,
        COPIES[how](building).parameters["mass"],
        COPIES[how](wd.GivenValues([1.0, 2.0])).values,
        COPIES[how](hazard).intensity,
        COPIES[how](wd.LinearSystem([1.0], [[0.1]], [[10.0]])).parameters["mass"],
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
    with pytest.raises(TypeError):
        COPIES[how](building).parameters["mass"] = 3.0


@pytest.mark.parametrize("how", COPIES)
def test_runs_are_the_same(how):
    building, waves = wd.ShearBuilding(**OF_BUILDING), motions()
    stripes = wd.Stripes(waves, [0.2, 0.6], wd.PeakGroundAcceleration())
    scatter = {"yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2))}
    scene = wd.Scene(building, stripes, scatter, recorders=("drift",))
    again = COPIES[how](scene)
    assert again.to_json() == scene.to_json()
    one, other = (wd.simulate(each, structures=2, seed=3, device="cpu") for each in (scene, again))
    np.testing.assert_array_equal(one["peak_storey_drift"], other["peak_storey_drift"])
    assert COPIES[how](wd.DamageCounts(LIMITS)).limits == LIMITS


@pytest.mark.fast
def test_a_frozen_mapping_is_a_mapping():
    mapping = FrozenMapping({"a": np.ones(2), "b": 3})
    assert dict(mapping) == {"a": mapping["a"], "b": 3}
    assert mapping | {"b": 4} == {"a": mapping["a"], "b": 4}
    assert {"c": 5} | mapping == {"c": 5, "a": mapping["a"], "b": 3}
    assert repr(FrozenMapping({"b": 3})) == "{'b': 3}"
