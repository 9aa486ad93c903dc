"""The study of a city's damage: its mix, its shares counted again one by one, and its figure."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import ROOT, documented_commands, run_study
from matplotlib.image import imread

import warpdyn as wd
from warpdyn.model.ground_motions.records import far_field

BUILDINGS = 40  # of one to three storeys, at which the compiler has little to do
# Hazus Technical Manual: median drift ratios of slight to complete damage.
LIMITS = {"W1 high 1": (0.004, 0.012, 0.04, 0.1), "W1 moderate 1": (0.004, 0.0099, 0.0306, 0.075)}


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    out = tmp_path_factory.mktemp("portfolio")
    (command,) = (c for c in documented_commands() if "studies/portfolio.py" in c)
    done = run_study(f"{command} --buildings {BUILDINGS}", out, is_limited=False)  # pandas loads pyarrow
    assert done.returncode == 0, done.stderr
    assert "histories" not in done.stderr  # no progress bar where there is no terminal
    return out, done.stdout


@pytest.fixture(scope="module")
def module() -> object:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "studies")
        yield importlib.import_module("portfolio")


@pytest.mark.as_shipped
def test_shares_are_those_counted_one_by_one(study: tuple[Path, str], module: object) -> None:
    # The same histories once more, every one of which is kept here.
    city, limits_of_city = module.build_city(BUILDINGS)
    scene = wd.Scene(city, wd.Cloud(far_field()), recorders=("drift",))
    run = wd.simulate(scene, device="cpu", keep_inputs=False)
    assert run.sizes["sample"] == BUILDINGS * 44
    assert (run["status"] == 0).all()
    motions = run["motion_name"].values.astype(str)
    with xr.open_dataset(study[0] / "portfolio.nc") as result:
        assert result.sizes["event"] == 22
        assert result["failed_buildings"].sum() == 0
        np.testing.assert_allclose(result["damage_share"].sum("damage_state"), 1)
        for name, limits in LIMITS.items():
            assert tuple(limits_of_city[name].values()) == limits
            place = result["archetype"].values.tolist().index(name)
            for event in result["event"].values[[0, 9, 21]]:
                number = event.split()[0]
                pair = [i for i, motion in enumerate(motions) if motion.split()[0] in (f"{number}a", f"{number}b")]
                assert len(pair) == 2
                counts = np.zeros(5)
                for building in np.unique(run["building"].values[run["archetype_index"].values == place]):
                    own = (run["building"].values == building) & np.isin(run["motion_index"].values, pair)
                    worst = np.nanmax(run["peak_storey_drift_ratio"].values[own])
                    counts[sum(worst > limit for limit in limits)] += 1
                share = result["archetype_damage_share"].sel(archetype=name, event=event)
                np.testing.assert_allclose(share, counts / counts.sum(), err_msg=f"{name} {event}")
        # What the page of studies says of the error, and the study prints.
        error = result["estimated_relative_error"].sel(demand="peak_storey_drift")
        assert 1e-5 < float(error.sel(error_statistic="95 %")) < 0.002
    groups, failed = re.search(r"(\d+) groups, (\d+) samples failed", study[1]).groups()
    assert int(groups) <= 8
    assert int(failed) == 0
    assert "of the peak drifts of any group err by less than" in study[1]


def test_the_city_is_of_the_buildings_its_table_says(module: object) -> None:
    city, limits = module.build_city(10_000)
    assert city.buildings == 10_000
    assert set(limits) == set(city.archetypes)
    assert sum(share for share, _ in module.CITY.values()) == pytest.approx(100)
    for levels in module.LEVELS.values():
        assert sum(levels.values()) == pytest.approx(100)
    counts = dict(zip(city.archetypes, city.counts, strict=True))
    assert counts["W1 high 1"] == 3150
    assert sum(count for name, count in counts.items() if name.startswith("W1 ")) == 7000
    assert len({archetype.building.storeys for archetype in city.archetypes.values()}) == 9
    assert {name.split()[1] for name in city.archetypes} == {"high", "moderate", "pre"}
    assert module.shared_out(10, [1, 1, 1]) == [4, 3, 3]
    assert module.pairs_of(["1a Northridge 1994 MUL009", "12b San Fernando 1971 X"]) == [
        "1 Northridge 1994",
        "12 San Fernando 1971",
    ]


def test_the_figure_is_drawn_and_the_table_printed(study: tuple[Path, str]) -> None:
    pixels = imread(study[0] / "portfolio.png")
    assert min(pixels.shape[:2]) > 400
    assert np.mean(pixels[..., :3].min(axis=2) < 0.9) > 0.2
    assert "22 Friuli 1976" in study[1]
    assert f"{BUILDINGS * 44:,} histories" in study[1]
