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
from warpdyn.laws import LAWS
from warpdyn.structures.hazus import DESIGN_LEVELS, building_class, building_types

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
