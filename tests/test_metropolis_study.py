"""The study of a metropolis: what it keeps of each building, of each event and of the map says the same."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from conftest import ROOT, documented_commands, run_study
from matplotlib.image import imread

import warpdyn as wd

BUILDINGS, EVENTS = 60, 25


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("metropolis")
    (command,) = (c for c in documented_commands() if "studies/metropolis.py" in c)
    done = run_study(f"{command} --buildings {BUILDINGS}", out, is_limited=False)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def region() -> object:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "studies")
        yield importlib.import_module("parts.metropolis.region")


def test_buildings_and_events_have_the_same_losses(study: Path) -> None:
    buildings = pd.read_parquet(study / "metropolis_buildings.parquet")
    assert buildings["id"].tolist() == [str(number) for number in range(BUILDINGS)]  # in the order of the inventory
    probabilities = buildings.filter(like="probability_")
    # One event is one of 25, so that probabilities are whole numbers of these.
    counts = probabilities.to_numpy() * EVENTS
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)
    np.testing.assert_array_equal(np.round(counts).sum(axis=1), EVENTS)
    with xr.open_dataset(study / "metropolis.nc") as city:
        assert city.sizes["event"] == EVENTS
        # Sums of 1,500 losses in another order, and probabilities that are rounded.
        np.testing.assert_allclose(EVENTS * buildings["expected_loss"].sum(), city["loss"].sum(), rtol=1e-12)
        assert (city["exceedance_probability"] < 1).all()
        for state in city["damage_state"].values:
            share = city["damage_share"].sel(damage_state=state).mean("event")
            assert float(share) == pytest.approx(buildings[f"probability_{state}"].mean(), abs=1e-12)
    assert imread(study / "metropolis.png").std() > 0.05


def test_median_accelerations_are_those_of_joyner_and_boore(region: object) -> None:
    inventory = region.build_inventory(200, 0)
    median = region.median_field(inventory)
    # On the fault's trace of magnitude 7: 10^(-1.02 + 1.743 - log10(7.3) - 0.0186) = 0.69 g, by hand.
    assert float(median.max()) == pytest.approx(0.69, abs=0.05)  # the nearest grid point lies some km off
    assert (median.values <= 0.694).all()
    at = median.isel(earthquake=0)
    far = int(np.argmin(at.values))
    shrink = np.cos(np.radians(37.9))
    step = np.linspace(region.FAULT[:-1], region.FAULT[1:], 2001).reshape(-1, 2)  # points along the trace
    away = 111.19 * np.hypot(
        shrink * (step[:, 0] - float(at["longitude"][far])), step[:, 1] - float(at["latitude"][far])
    )
    r = np.hypot(away.min(), 7.3)
    by_hand = 10 ** (-1.02 + 0.249 * 7 - np.log10(r) - 0.00255 * r)
    # The cosine of the middle latitude is taken a tenth of a degree elsewhere, which moves a distance by .2 %.
    assert float(at[far]) == pytest.approx(by_hand, rel=0.01)


def test_buildings_are_of_their_time(region: object) -> None:
    inventory = region.build_inventory(200, 0)
    assert inventory["structure_type"].value_counts().idxmax() == "W1"
    assert (inventory.loc[inventory["structure_type"].isin(["S3", "PC1", "MH"]), "year"] >= 1941).all()


@pytest.mark.meant_as_given("no_damping")
@pytest.mark.parametrize("kind", ["C1H", "C2H", "S1H"])
def test_tall_buildings_have_the_strength_and_period_of_hazus(region: object, kind: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "studies")
        tall = importlib.import_module("parts.metropolis.tall")
    tower, chain = tall.flexural_shear(kind, "high", 12), wd.ShearBuilding.from_hazus(kind, "high", 12)
    hinge, *frames = tower.parameters["yield_force"]
    mass, height = chain.parameters["mass"], chain.parameters["height"]
    levels = np.cumsum(height)
    # Overturning moment of the triangular loads at yield, by equilibrium of the floor forces.
    overturning = chain.parameters["yield_force"][0] * (mass @ levels**2) / (mass @ levels)
    assert hinge + frames @ height == pytest.approx(overturning, rel=1e-9)
    assert tower.fundamental_period == pytest.approx(chain.fundamental_period, rel=0.02)
    archetypes, limits = tall.tall_archetypes()
    assert f"{kind} pre 12" in archetypes
    assert limits[f"{kind} high 12"] == wd.hazus_drift_limits(kind, "high")
