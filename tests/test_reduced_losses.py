"""Losses that are named before a run, against the damage states of the full table and `portfolio_losses`."""

import numpy as np
import pytest
import xarray as xr
from labels import check_labels
from reduced_runs import (
    CITY,
    CITY_LIMITS,
    LIMITS,
    MARKS,
    assert_made_of,
    scene_of,
    simulate,
    small_blocks,
    statistics_of,
    with_failures,
)

import warpdyn as wd

pytestmark = MARKS
RATIOS = {"slight": (0.05, 0.5), "complete": (0.8, 0.2)}
OF_CITY = {name: RATIOS if place else {"slight": 0.02, "complete": 1.0} for place, name in enumerate(CITY.archetypes)}
VALUES = np.linspace(1e5, 3e6, CITY.buildings)


def losses_of(run, chosen):
    """Return the loss of each chosen sample that did not fail, and its variance by the scatter of the ratio."""
    found = []
    for sample in chosen:
        status, building = int(run["status"][sample]), int(run["building"][sample])
        if status > 1:
            continue
        name = str(run["archetype"].values[run["archetype_index"].values[sample]])
        drift = np.nanmax(run["peak_storey_drift_ratio"].values[sample].astype(np.float64)) if status == 0 else np.inf
        reached = [state for state, limit in CITY_LIMITS[name].items() if drift > limit]
        mean, variation = np.broadcast_to(OF_CITY[name][reached[-1]], 2) if reached else (0.0, 0.0)
        if reached and np.ndim(OF_CITY[name][reached[-1]]) == 0:
            variation = 0.0
        found.append((VALUES[building] * mean, (VALUES[building] * mean * variation) ** 2))
    return np.array(found).reshape(-1, 2).T


@pytest.mark.parametrize(
    ("design", "over"), [("crossed", ("motion", "stripe")), ("one motion", ("cell",)), ("cloud", ("building",))]
)
def test_losses_are_those_of_the_full_table(design, over, monkeypatch):
    with_failures(monkeypatch, 0.009)
    scene = scene_of(design, CITY)
    labels = {"cell": np.arange(CITY.buildings) // 7} if "cell" in over else {}
    asked = wd.DamageLoss(CITY_LIMITS, OF_CITY, VALUES, over=over, labels=labels)
    run, found = simulate(scene), simulate(scene, statistics=asked)
    suffix = "_by_" + "_".join(over)
    assert float(found[f"loss_sum{suffix}"].sum()) > 0

    def check(got, event, chosen):
        loss, scatter = losses_of(event, chosen)
        assert got[f"counted_count{suffix}"] == loss.size
        assert got[f"failed_count{suffix}"].sum() == chosen.size - loss.size
        # Sums of a few dozen numbers of like size.
        np.testing.assert_allclose(got[f"loss_sum{suffix}"], loss.sum(), rtol=1e-12)
        np.testing.assert_allclose(got[f"loss_mean{suffix}"], loss.mean(), rtol=1e-12)
        np.testing.assert_allclose(got[f"loss_scatter_variance{suffix}"], scatter.sum(), rtol=1e-12)
        # Where all losses are equal, numpy's squares about a rounded mean are 1e-32 of theirs.
        least = 1e-30 * loss.max() ** 2
        np.testing.assert_allclose(got[f"loss_variance{suffix}"], loss.var(ddof=1), rtol=1e-12, atol=least)

    assert_made_of(found, run, over, labels, check)
    check_labels(found)
    small_blocks(monkeypatch, 40)
    for threads in (1, 2):
        again = simulate(scene, statistics=asked, threads=threads)
        assert statistics_of(again).identical(statistics_of(found)), threads


def test_losses_of_events_are_those_of_portfolio_losses():
    # Buildings of an archetype are of equal value there; the worst motion of an event counts in both.
    scene, events = scene_of("cloud", CITY), ["b", "a", "b"]
    limits = {name: {state: limit / 8 for state, limit in own.items()} for name, own in CITY_LIMITS.items()}
    values = {name: 1e6 * (2 + place) for place, name in enumerate(CITY.archetypes)}
    each = np.repeat([values[name] / count for name, count in zip(values, CITY.counts, strict=True)], CITY.counts)
    shares = wd.damage_shares(simulate(scene), limits, events=events)
    expected = wd.portfolio_losses(shares, OF_CITY, values)
    assert float(expected["loss"].min()) > 0
    found = simulate(scene, statistics=wd.DamageLoss(limits, OF_CITY, each, over="event", events=events))
    loss = found["loss_sum_by_event"].sel(event=expected["event"])
    xr.testing.assert_allclose(loss.drop_attrs(), expected["loss"].drop_attrs(), rtol=1e-12)
    deviation = found["loss_scatter_variance_by_event"].sel(event=expected["event"]) ** 0.5
    np.testing.assert_allclose(deviation, expected["loss_deviation"], rtol=1e-12)


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"loss_ratios": {"slight": 0.1}}, "DamageLoss: loss_ratios must name the damage states"),
        ({"loss_ratios": {"slight": 2.0, "moderate": 3.0, "complete": 100.0}}, "at most 1"),
        ({"replacement_values": [1.0, 2.0]}, r"one for each of the 21 structures, at least 0; got shape \(2,\)"),
        ({"replacement_values": -1.0}, "at least 0; got 1 below 0, such as -1"),
    ],
)
def test_losses_that_do_not_fit_are_refused(how, message):
    ratios = {"slight": 0.1, "moderate": 0.2, "complete": 1.0}
    asked = wd.DamageLoss(LIMITS, **({"loss_ratios": ratios} | how))
    with pytest.raises(ValueError, match=message):
        wd.simulate(scene_of("crossed"), structures=21, device="cpu", statistics=asked)
