"""The study of all storey laws: every law is in it, its forces are those of the OpenSees materials that it names."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT, documented_commands
from matplotlib.image import imread
from opensees import material_forces
from reference_pages import check_page
from validation import Measured, difference

from warpdyn.engine.laws import DEVICES, LAWS

STOREY_LAWS = [name for name in LAWS if name not in ("lead_rubber_bearing", "friction_pendulum")]  # those are isolators


@pytest.fixture(scope="module")
def study() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "studies")
        yield importlib.import_module("laws")


@pytest.fixture(scope="module")
def result(study: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> tuple[xr.Dataset, Path]:
    out = tmp_path_factory.mktemp("laws")
    (command,) = (c for c in documented_commands() if "studies/laws.py" in c)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [*command.split()[1:-1], str(out)])
        study.main()
    with xr.open_dataset(out / "laws.nc") as dataset:
        return dataset.load(), out


def test_every_law_that_yields_is_in_it(study: ModuleType, result: tuple[xr.Dataset, Path]) -> None:
    assert set(study.LAWS) == set(STOREY_LAWS)
    assert set(result[0]["law"].values) == set(STOREY_LAWS) - {"elastic"}
    page = (ROOT / "docs/how_to/buildings.md").read_text()
    for name, law in study.LAWS.items():
        assert f"| `{name}` | {law.words} | {law.material} |" in page
    assert np.ptp(imread(result[1] / "laws.png")[..., :3]) > 0.5


@pytest.mark.parametrize("law", [name for name in STOREY_LAWS if name != "elastic"])
def test_forces_are_those_of_opensees(
    study: ModuleType, result: tuple[xr.Dataset, Path], law: str, measured: Measured
) -> None:
    own, stiffness, strength = study.LAWS[law], study.STIFFNESS, study.YIELD_FORCE
    found = result[0].sel(law=law)
    numbers = own.numbers(stiffness, strength, own.parameters(study.YIELD_DRIFT))
    theirs = material_forces(own.material, numbers, found["storey_drift"].values)
    # The same rules, but that OpenSees goes along a smooth law by Euler's backward rule: a hundredth of a yield drift
    # a step leaves 3 %. IMKBilin's rounding is single precision's.
    tolerance = {"bouc_wen": 0.04, "baber_noori": 0.04}.get(law, 1e-6)
    measured(
        f"forces of storeys of law `{law}` along cycles of growing drift, over the yield force",
        truth=f"OpenSees' {own.material}",
        value=difference(found["storey_force"], theirs) / strength,
        bound=tolerance,
    )


def test_energy_is_the_integral_of_the_force(study: ModuleType, result: tuple[xr.Dataset, Path]) -> None:
    dataset = result[0]
    drift, force = dataset["storey_drift"].values, dataset["storey_force"].values
    work = np.trapezoid(force, drift, axis=1)
    # What is still stored in the end, at no drift: up to 1.7 yield forces times yield drifts, of a quadrilinear storey.
    stored = work - dataset["dissipated_energy"].values[:, -1]
    assert (stored > -1e-6 * work).all()
    assert (stored < 2 * study.YIELD_FORCE * study.YIELD_DRIFT).all()


@pytest.mark.parametrize("name", LAWS | DEVICES)
def test_a_page_of_the_reference_shows_todays_element(name: str, tmp_path: Path, unoptimised: None) -> None:
    check_page(name, tmp_path)
