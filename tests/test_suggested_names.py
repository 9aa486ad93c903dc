"""Arguments that a class or a function does not take are refused with the name that was meant."""

import numpy as np
import pandas as pd
import pytest
from sound_calls import LIMITS, OF_BUILDING, motions

import warpdyn as wd

pytestmark = [pytest.mark.fast, pytest.mark.filterwarnings("ignore:implausible")]
BUILDING = wd.ShearBuilding(**OF_BUILDING)
CLOUD = wd.Cloud(motions())
SCENE = wd.Scene(BUILDING, CLOUD)
PLACES = pd.DataFrame({"id": ["a"], "longitude": [1.0], "latitude": [2.0], "structure_type": ["W1"]})
INVENTORY = wd.inventories.from_table(PLACES.assign(storeys=[1], year=[1990]))
CURVE = [0.03, 0.3], [2e6, 3e6]


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (
            lambda: wd.Scene(BUILDING, CLOUD, recorder=("drift",)),
            r"Scene\(\) has no argument 'recorder' \(did you mean 're",
        ),
        (lambda: wd.GroundMotion([0.0, 1.0], 0.01, nam="a"), r"no argument 'nam' \(did you mean 'name'\?\)"),
        (lambda: wd.Histories([0], evry=2), r"no argument 'evry' \(did you mean 'every'\?\)"),
        (lambda: wd.fragility(None, limit={}), r"no argument 'limit' \(did you mean 'limits'\?\)"),
        (
            lambda: wd.ShearBuilding.from_hazus("C1M", "high", stories=5),
            r"from_hazus\(\) needs storeys: it has no argument 'stories' \(did you mean 'storeys'\?\)",
        ),
        (
            lambda: wd.ShearBuilding.from_capacity(*CURVE, stories=4, mass=2e5, height=3.0),
            r"from_capacity\(\) needs storeys: it has no argument 'stories' \(did you mean 'storeys'",
        ),
        (lambda: wd.ShearBuilding(mas=1e5, stiffness=4e7, height=3.0), r"needs mass: it has no argument 'mas' \(did"),
        (lambda: wd.LinearSystem([1.0], stiffnes=[[1.0]], damping=[[0.0]]), r"'stiffnes' \(did you mean 'stiffness'"),
        (lambda: wd.ShearBuilding.from_hazus("C1M", "high"), r"from_hazus\(\) needs storeys; it takes"),
        (lambda: wd.simulate(SCENE, method="newmark"), "did you mean 'newmark_average' or 'newmark_linear'"),
        (lambda: wd.simulate(SCENE, method="hht"), r"did you mean 'hht_alpha'"),
        (
            lambda: wd.ShearBuilding(1e5, 4e7, 3.0, law="steel01"),
            r"unknown storey law 'steel01' \(did you mean 'Steel01'",
        ),
        (
            lambda: wd.inventories.portfolio(INVENTORY, unknown="drop"),
            "unknown choice for unknown= 'drop'; allowed: 'r",
        ),
        (
            lambda: wd.inventories.portfolio(INVENTORY, wd.inventories.HazusRule),
            r"archetype_of is the class HazusRule itself: give archetype_of=HazusRule\(\)",
        ),
        (
            lambda: wd.simulate(wd.Scene(BUILDING, CLOUD, {"damping_ratio": wd.GivenValues([-0.1, 0.1])})),
            "the given damping_ratio is -0.1 at structure 0; .*; correct its GivenValues",
        ),
        (lambda: wd.Archetype("x", "y"), "building must be a ShearBuilding or a LumpedStructure with storeys, got str"),
        (lambda: wd.HazardCurve([0.1, 1.0], [1e-2, 1e-4], units="gg"), "unknown units 'gg' of a hazard curve.*'m s-2'"),
        (lambda: wd.GroundMotion([0.0, 1.0], 0.01, component=3), "GroundMotion.component must be text, got 3"),
        (lambda: wd.DamageCounts(LIMITS, events=5), "events must be the event of each motion"),
        (lambda: wd.FreeVibration(2.0, velocity=[]), "velocity must be a row of values"),
        (
            lambda: wd.laws.Takeda(yield_force=[], hardening_ratio=0.1),
            "yield_force must be one value or one per storey",
        ),
        (lambda: wd.GroundMotion(np.ma.masked_array([0.0, 1.3], [0, 1]), 0.01), "is masked, so its value is unknown"),
    ],
)
def test_what_was_meant_is_told(call, told):
    with pytest.raises((TypeError, ValueError), match=told):
        call()


def test_names_that_are_right_are_taken():
    assert wd.HazardCurve([0.1, 1.0], [1e-2, 1e-4], measure="PGV", units="cm/s").units == "m s-1"
    assert wd.HazardCurve([0.1, 1.0], [1e-2, 1e-4], measure="my measure", units="m s-2").units == "m s-2"
    assert wd.ShearBuilding.from_hazus("C1M", "high", storeys=5).storeys == 5
