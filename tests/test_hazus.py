"""Chains of the Hazus building types: the published building, the manual's numbers, and every type at every level."""

from __future__ import annotations

import importlib
import importlib.metadata
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import warpdyn as wd
from warpdyn.engine.laws import LAWS
from warpdyn.model.structures.hazus import DESIGN_LEVELS, building_class, building_types

pytestmark = pytest.mark.fast

CLASSES = [(each, level) for each in building_types() for level in DESIGN_LEVELS]


def test_published_building_to_every_digit() -> None:
    building = wd.ShearBuilding.from_hazus("C1M", "high", 5)
    strength = [8964693.22, 8367047.01, 7171754.58, 5378815.93, 2988231.07]
    assert building.parameters["stiffness"].round(3).tolist() == [866317029.186] * 5
    assert building.parameters["yield_force"].round(2).tolist() == strength
    assert building.parameters["mass"].tolist() == [1.0e6] * 5
    assert building.fundamental_period == pytest.approx(0.75, rel=1e-14)


def test_main_job_has_the_published_building(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "studies")
    study = importlib.import_module("p695_fragility")
    values = study.BUILDING.parameters
    assert values["stiffness"].round(3).tolist() == [866317029.186] * 5
    assert values["hardening_ratio"].tolist() == [0.133025] * 5
    assert values["damping_ratio"] == 0.07
    assert study.BUILDING.damping_modes == (1, 3)
    assert study.DRIFT_LIMITS == {"slight": 0.0033, "moderate": 0.0067, "extensive": 0.02, "complete": 0.0533}


def test_strengths_grow_with_the_area_and_the_period_does_not() -> None:
    small, large = (wd.ShearBuilding.from_hazus("W2", "low", 3, floor_area=area) for area in (250.0, 1000.0))
    np.testing.assert_allclose(4 * small.parameters["yield_force"], large.parameters["yield_force"], rtol=1e-14)
    assert small.fundamental_period == pytest.approx(large.fundamental_period, rel=1e-13)


# Dy [inch], Ay [g], Du [inch], Au [g] of the code building capacity curves in the technical manual.
MANUAL = {
    ("W1", "high"): (0.48, 0.400, 11.51, 1.200),
    ("W1", "moderate"): (0.36, 0.300, 6.48, 0.900),
    ("W2", "high"): (0.63, 0.400, 12.53, 1.000),
    ("S1L", "high"): (0.61, 0.250, 14.67, 0.749),
    ("C1M", "high"): (1.15, 0.208, 18.44, 0.624),
}


@pytest.mark.parametrize(("kind", "level"), MANUAL)
def test_capacity_curves_are_the_manuals(kind: str, level: str) -> None:
    dy, ay, du, au = MANUAL[kind, level]
    row = building_class(kind, level)
    assert row["yield_spectral_acceleration_g"] == ay
    assert row["hardening_ratio"] == pytest.approx((au - ay) / (du - dy) * dy / ay, rel=1e-5)  # six digits
    assert row["overstrength_ratio"] == pytest.approx(au / ay, rel=2e-3)  # the manual rounds Au


@pytest.mark.parametrize(("kind", "level"), CLASSES)
def test_every_type_at_every_level_stands(kind: str, level: str) -> None:
    row = building_class(kind, level)
    limits = wd.hazus_drift_limits(kind, level)
    assert list(limits) == ["slight", "moderate", "extensive", "complete"]
    assert (np.diff(list(limits.values())) > 0).all()
    for storeys in {int(row["min_storeys"]), int(row["max_storeys"])}:
        building = wd.ShearBuilding.from_hazus(kind, level, storeys)
        assert building.storeys == storeys
        # The closed form for the period, and the share of the mass that the first mode of a uniform chain has: Lu's
        # cubic is within 2e-4 of it.
        assert building.fundamental_period == pytest.approx(storeys * row["period_per_storey_s"], rel=1e-11)
        shape = np.sin(np.arange(1, storeys + 1) * np.pi / (2 * storeys + 1))
        share = shape.sum() ** 2 / (shape @ shape) / storeys
        weight = building.parameters["mass"].sum() * 9.8
        base_shear = building.parameters["yield_force"][0]
        assert base_shear == pytest.approx(row["yield_spectral_acceleration_g"] * share * weight, rel=2e-4)
        assert (np.diff(building.parameters["yield_force"]) < 0).all()


def test_there_are_36_types_and_stronger_codes_are_stronger() -> None:
    assert len(building_types()) == 36
    assert len(CLASSES) == 144
    for kind in building_types():
        rows = [building_class(kind, level) for level in DESIGN_LEVELS]
        for name in ("yield_spectral_acceleration_g", "drift_slight", "drift_complete"):
            assert (np.diff([row[name] for row in rows]) <= 0).all(), (kind, name)


@pytest.mark.parametrize("law", ["elastic", "bilinear", "bouc_wen"])
def test_laws_take_what_they_have(law: str) -> None:
    building = wd.ShearBuilding.from_hazus("S3", "pre", 1, law=law)
    expected = {"yield_force", "hardening_ratio"} & set(LAWS[law].parameters)
    assert expected <= set(building.parameters)
    assert building.law == law


def test_given_parameters_replace_the_types() -> None:
    building = wd.ShearBuilding.from_hazus(
        "C2L", "moderate", 2, height=[4.0, 3.0], hardening_ratio=0.02, damping="none"
    )
    assert building.parameters["height"].tolist() == [4.0, 3.0]
    assert building.parameters["hardening_ratio"].tolist() == [0.02, 0.02]
    assert building.damping == "none"


@pytest.mark.parametrize(("kind", "level"), [("C1M", "high"), ("W1", "moderate"), ("S1M", "pre"), ("URML", "low")])
def test_hysteretic_storeys_are_those_of_mdof_lu(kind: str, level: str) -> None:
    """s1, e1, s2, e2, s3 and e3 of OpenSees' Hysteretic, as SimCenter's MDOF-LU writes them, with pinching and beta."""
    row = building_class(kind, level)
    storeys = int(row["min_storeys"])
    p = wd.ShearBuilding.from_hazus(kind, level, storeys, law="hysteretic").parameters
    sy, k0, eta, alpha = p["yield_force"], p["stiffness"], row["hardening_ratio"], row["overstrength_ratio"]
    e2 = sy / k0 + (alpha - 1) * sy / eta / k0
    np.testing.assert_allclose(p["ductility_2"] * sy / k0, e2, rtol=1e-12)
    np.testing.assert_allclose(p["ductility_3"] * sy / k0, np.where(e2 >= 1, 10 * e2, 1.0), rtol=1e-12)
    np.testing.assert_allclose([p["force_ratio_2"], p["force_ratio_3"]], alpha, rtol=1e-14)
    # gamma and a_k of its table.
    gamma, a_k = {"C1M": (0.5, 0.4), "W1": (0.6, 0.1), "S1M": (1.0, 0.0), "URML": (0.3, 0.1)}[kind]
    assert set(p["pinching_drift"]) == set(p["pinching_force"]) == {gamma}
    assert set(p["unloading_exponent"]) == {a_k}


def test_simcenters_example_of_two_storeys() -> None:
    """A W1 of its manual, by OpenSees' input: 6.33037e6 N at 0.822315 m after 2.11012e6 N at 0.0342929 m."""
    building = wd.ShearBuilding.from_hazus("W1", "high", 2, floor_area=284.190, law="hysteretic")
    p = building.parameters
    at_yield = p["yield_force"] / p["stiffness"]
    # Its stiffness has a random factor; strengths and the shape of the backbone do not.
    np.testing.assert_allclose(p["yield_force"], [2.11012e6, 1.40675e6], rtol=1e-5)
    np.testing.assert_allclose(p["force_ratio_2"] * p["yield_force"], [6.33037e6, 4.22025e6], rtol=1e-5)
    np.testing.assert_allclose(p["ductility_2"], [0.822315 / 0.0342929, 0.54821 / 0.0228619], rtol=1e-5)
    assert (at_yield[0] / at_yield[1]) == pytest.approx(0.0342929 / 0.0228619, rel=1e-5)
    assert p["pinching_drift"].tolist() == [0.8, 0.8]
    assert p["unloading_exponent"].tolist() == [0.1, 0.1]


@pytest.mark.parametrize("law", ["hysteretic", "trilinear", "quadrilinear", "pinching4"])
def test_the_ultimate_strength_caps_the_pushed_building(law: str) -> None:
    building = wd.ShearBuilding.from_hazus("C1M", "high", 5, law=law)
    p, row = building.parameters, building_class("C1M", "high")
    at_yield = (p["yield_force"] / p["stiffness"]).sum()
    at_ultimate = at_yield * (1 + (3 - 1) / row["hardening_ratio"])
    roof = np.linspace(0, 2 * at_ultimate, 60)[1:]
    base = p["yield_force"][0]
    expected = np.interp(roof, [0, at_yield, at_ultimate], [0, base, 3 * base])
    np.testing.assert_allclose(wd.pushover(building, roof, pattern="triangular")["base_shear"], expected, rtol=1e-7)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("C1", "high", 5), "unknown Hazus building type 'C1'.*; allowed: 'W1', 'W2', 'S1L'"),
        (
            ("C1M", "higher", 5),
            "unknown design level 'higher' .did you mean 'high'..; allowed: 'high', 'moderate', 'low', 'pre'",
        ),
        (("C1M", "high", 3), "Hazus type C1M has 4 to 7 storeys, got 3"),
        (("C1M", "high", 8), "Hazus type C1M has 4 to 7 storeys, got 8"),
        (("C1M", "high", 5.0), "storeys must be a whole number"),
    ],
)
def test_bad_input_is_named(arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        wd.ShearBuilding.from_hazus(*arguments)
    with pytest.raises(ValueError, match="floor_area must be a finite number above 0"):
        wd.ShearBuilding.from_hazus("C1M", "high", 5, floor_area=0.0)


def test_installed_package_brings_the_table(tmp_path: Path) -> None:
    """Away from the checkout there is only what the installation copied."""
    # The warpdyn.egg-info that building leaves beside the sources is found first from there, and is no installation.
    everywhere = importlib.metadata.distributions(name="warpdyn")
    installed = [each for each in everywhere if Path(each.locate_file("")).resolve() != ROOT.resolve()]
    if not installed:
        pytest.skip("warpdyn is not installed here")
    origin = json.loads(installed[0].read_text("direct_url.json") or "{}")
    if origin.get("dir_info", {}).get("editable"):
        pytest.skip("an editable installation copies nothing")
    command = [sys.executable, "-c", "import warpdyn as wd; print(wd.__file__, wd.hazus_drift_limits('C1M', 'high'))"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    assert "0.0533" in done.stdout
    assert str(ROOT / "warpdyn") not in done.stdout


@pytest.mark.parametrize("damping", ["rayleigh_tangent", "mass_proportional", "stiffness_proportional", "modal"])
def test_every_damping_ratio_is_that_of_the_type(damping):
    given, usual = (wd.ShearBuilding.from_hazus("C1M", "high", 5, damping=kind) for kind in (damping, "rayleigh"))
    assert given.parameters["damping_ratio"] == usual.parameters["damping_ratio"]
