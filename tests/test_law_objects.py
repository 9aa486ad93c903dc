"""How laws and devices are given: as objects, by name, by OpenSees' name, with the values that they refuse."""

import json
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from law_contract import ELEMENTS, STIFFNESS, STOREYS, drawn_storeys

import warpdyn as wd
from warpdyn import laws
from warpdyn.engine.laws import DEVICES, LAWS
from warpdyn.foundations.core.description import to_json

pytestmark = pytest.mark.fast
EVERY = pytest.mark.parametrize("name", ELEMENTS)


@EVERY
def test_an_object_its_name_and_its_description_make_one_building(name):
    element = ELEMENTS[name]
    row = next(iter(element.rows), None)
    if row is None:  # a viscous damper, which has no spring
        values = {key: 0.5 for key in element.parameters}
    else:
        values = {key: value[0] for key, value in drawn_storeys(name, row).items() if key != "stiffness"}
    keyword = "law" if name in LAWS else "devices"

    def building(given, **parameters):
        given = given if keyword == "law" else (given,)
        return wd.ShearBuilding(np.ones(STOREYS), STIFFNESS, 3.0, **{keyword: given}, **parameters)

    typed, named = building(element(**values)), building(name, **values)
    assert to_json(typed) == to_json(named) == to_json(building(element, **values))
    assert element(**values) == element(**values)
    assert hash(element(**values)) == hash(element(**values))
    described = json.loads(to_json(named))
    kept = {key: described[key] for key in values}
    assert to_json(building(name, **kept)) == to_json(named)
    for key in values:
        with pytest.raises(ValueError, match=f"{key} is given twice"):
            building(element(**values), **{key: 1.0})


@EVERY
def test_opensees_names(name):
    element = ELEMENTS[name]
    table = LAWS if name in LAWS else DEVICES
    values = {} if not element.rows else {
        key: value[0] for key, value in drawn_storeys(name, next(iter(element.rows))).items() if key != "stiffness"
    }  # fmt: skip
    for theirs in element.opensees:
        meant = [other for other, each in table.items() if theirs in each.opensees]
        given = {"law": theirs} if name in LAWS else {"devices": (theirs,)}
        if len(meant) > 1:
            with pytest.raises(ValueError, match=f"'{theirs}' may mean several laws or devices.*{name}"):
                wd.ShearBuilding(np.ones(STOREYS), STIFFNESS, 3.0, **given)
        elif values:
            building = wd.ShearBuilding(np.ones(STOREYS), STIFFNESS, 3.0, **given, **values)
            assert name in (*building.storey_laws, *building.devices)


@EVERY
def test_near_misses_of_parameters_are_suggested(name):
    element = ELEMENTS[name]
    for key in element.parameters:
        with pytest.raises(TypeError, match=f"did you mean '{key}'"):
            element(**{key[:-1] + "_" + key[-1]: 1.0})


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ({"law": "bilnear"}, "did you mean 'bilinear'"),
        ({"law": "Bouc-Wen"}, "did you mean 'bouc_wen'"),
        ({"law": "steel02"}, "did you mean 'Steel02'"),
        ({"law": "bilinear", "yield_froce": 1.0, "hardening_ratio": 0.1}, "did you mean 'yield_force'"),
        ({"law": "bilinear", "Fy": 1.0, "hardening_ratio": 0.1}, "did you mean 'yield_force'"),
        ({"devices": ("FrictionDamper",)}, "did you mean 'friction_damper'"),
        ({"law": "viscous_damper"}, r"a device: devices=\('viscous_damper',\)"),
        ({"law": "ElasticPPGap"}, r"a device: devices=\('one_sided_gap',\)"),
        ({"devices": ("Steel01",)}, "a storey law: law='bilinear'"),
        # OpenSees' commands give the first yield point, which ratios of ours are over.
        ({"law": "Pinching4", "ePf1": 1.0}, "did you mean 'yield_force'"),
        ({"law": "Pinching4", "ePd1": 1.0}, "did you mean 'yield_force'"),
        ({"law": "Pinching4", "ePd2": 1.0}, "did you mean 'ductility_2'"),
        ({"law": "hysteretic", "s1p": 1.0}, "did you mean 'yield_force'"),
        ({"law": "hysteretic", "e1p": 1.0}, "did you mean 'yield_force'"),
        ({"law": "trilinear", "s1": 1.0}, "did you mean 'yield_force'"),
        ({"law": "quadrilinear", "e1": 1.0}, "did you mean 'yield_force'"),
        ({"law": "quadrilinear", "s3": 1.0}, "did you mean 'force_ratio_3'"),
        ({"law": "takeda", "s1": 1.0}, "did you mean 'cracking_ratio'"),
        ({"law": "takeda", "s2": 1.0}, "did you mean 'yield_force'"),
    ],
)
def test_near_misses_of_names_are_suggested(given, meant):
    with pytest.raises(ValueError, match=meant):
        wd.ShearBuilding(1.0, 1.0, 1.0, **given)


def test_all_missing_parameters_are_named_with_what_needs_them():
    with pytest.raises(ValueError, match=r"ductility_2 .*are missing: law 'hysteretic' needs them\. Give ductility_2="):
        wd.ShearBuilding(1.0, 1.0, 1.0, law="Hysteretic", yield_force=1.0)
    with pytest.raises(
        ValueError, match=r"damping_ratio .* missing: damping 'rayleigh' needs it\. Give damping_ratio=$"
    ):
        wd.ShearBuilding(1.0, 1.0, 1.0, damping="rayleigh")
    with pytest.raises(ValueError, match=r"mass .* is missing: a building needs it\. Give mass=$"):
        wd.ShearBuilding(None, 1.0, 1.0)


def test_laws_of_several_storeys_bring_their_parameters():
    building = wd.ShearBuilding(
        [2e3, 1e3, 1e3], 4e5, 3.0,
        law=[laws.Bilinear(yield_force=4e3, hardening_ratio=0.05), "bouc_wen", laws.Elastic()],
        devices=(laws.FrictionDamper(slip_force=[0.0, 1e3, 0.0], brace_stiffness=1e5),),
        yield_force=2e3, hardening_ratio=[np.nan, 0.1, np.nan],
    )  # fmt: skip
    np.testing.assert_array_equal(building.parameters["yield_force"], [4e3, 2e3, np.nan])
    np.testing.assert_array_equal(building.parameters["hardening_ratio"], [0.05, 0.1, np.nan])
    np.testing.assert_array_equal(building.parameters["beta"], [np.nan, 0.5, np.nan])
    np.testing.assert_array_equal(building.parameters["slip_force"], [0, 1e3, 0])
    assert building.storey_laws == ("bilinear", "bouc_wen", "elastic")


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ([laws.Bilinear(yield_force=[1.0, 2.0], hardening_ratio=0.1), "elastic"], "must be one value, got 2"),
        ([laws.Bilinear(yield_force=1.0, hardening_ratio=0.1), "bilinear"], "yield_force is missing at storey 2"),
        ([laws.Bilinear(yield_force=1.0, hardening_ratio=0.1), 3], "unknown storey law 3"),
        (laws.Gap(clearance=1.0, contact_stiffness=1.0), "unknown storey law Gap"),
        (laws.Bilinear(yield_force=[1.0, 2.0, 3.0], hardening_ratio=0.1), "mass has 2 values and yield_force has 3"),
    ],
)
def test_laws_that_do_not_fit(given, error):
    with pytest.raises(ValueError, match=error):
        wd.ShearBuilding([1.0, 1.0], 1.0, 1.0, law=given)


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"yield_force": -1.0, "hardening_ratio": 0.1}, "yield_force is -1; it must be finite and above 0"),
        ({"yield_force": [1.0, 0.0], "hardening_ratio": 0.1}, "yield_force is 0 at storey 2"),
        ({"yield_force": "much", "hardening_ratio": 0.1}, "yield_force must be numbers"),
        ({"yield_force": [[1.0]], "hardening_ratio": 0.1}, "one value or one per storey"),
    ],
)
def test_values_out_of_bounds_are_refused_at_once(values, error):
    with pytest.raises(ValueError, match=error):
        laws.Bilinear(**values)


def test_laws_do_not_import_warp():
    program = """
        import sys, types
        package = types.ModuleType("warpdyn")  # without what the whole library imports
        package.__path__ = [sys.argv[1]]
        sys.modules["warpdyn"] = package
        import warpdyn.engine.laws, warpdyn.engine.laws.lookup, warpdyn.engine.laws.springs
        print("warp" in sys.modules)
    """
    path = wd.__path__[0]
    ran = subprocess.run([sys.executable, "-c", textwrap.dedent(program), path], capture_output=True, text=True)
    assert ran.stdout.strip() == "False", ran.stderr
