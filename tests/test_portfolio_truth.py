"""A mixed portfolio against the event-exact response of each of its buildings: every row is of whom it says it is."""

import numpy as np
import pytest
from matrices import chain_matrix

import warpdyn as wd
from warpdyn.truth import bilinear_chain_response

STEP = 0.02
MOTIONS = [
    wd.GroundMotion(size * np.hanning(201) * np.random.default_rng(seed).normal(size=201), STEP, f"m{seed}")
    for seed, size in ((1, 3.0), (2, 6.0))
]


def chain(storeys, hardening_ratio):
    kinds = {"law": "bilinear", "yield_force": 1.0, "hardening_ratio": hardening_ratio}
    return wd.ShearBuilding(1.0, np.ones(storeys), 3.0, **kinds, damping="storey", damping_coefficient=0.0)


def table(storeys, buildings, seed):
    """Return masses, stiffnesses, strengths and dashpots of single buildings, shape [building, storey]."""
    random = np.random.default_rng(seed)
    size = (buildings, storeys)
    return {
        "mass": random.uniform(1.5e3, 2.5e3, size),
        "stiffness": random.uniform(5e5, 9e5, size),
        "yield_force": random.uniform(2e3, 5e3, size),
        "damping_coefficient": random.uniform(1e3, 4e3, size),
    }


@pytest.mark.parametrize("to_file", [False, True])
def test_every_building_has_its_own_exact_response(tmp_path, to_file):
    # Two archetypes of two storeys, of one group, with others between them; those of one storey yield perfectly.
    kinds = {"two": (2, 0.05, 3), "one": (1, 0.0, 2), "more": (2, 0.1, 2), "three": (3, 0.05, 2)}
    tables = {name: table(storeys, count, seed) for seed, (name, (storeys, _, count)) in enumerate(kinds.items())}
    archetypes = {
        name: wd.Archetype(chain(*kinds[name][:2]), scatter={key: wd.GivenValues(row) for key, row in values.items()})
        for name, values in tables.items()
    }
    settings = {"step": 0.0005, "dtype": "float64", "device": "cpu"}
    settings |= {"path": tmp_path / "run.nc"} if to_file else {}
    scene = wd.Scene(wd.Portfolio(archetypes), wd.Cloud(MOTIONS), recorders=("drift", "energy"), tail=0.0)
    run = wd.simulate(scene, **settings)
    assert run.attrs["groups"] == 3
    buildings = [(name, place) for name, (*_, count) in kinds.items() for place in range(count)]
    assert run.sizes["sample"] == len(buildings) * len(MOTIONS)
    yielded = 0
    for sample in range(run.sizes["sample"]):
        own = run.isel(sample=sample)
        name, place = buildings[int(own["building"])]
        assert run["archetype"].values[int(own["archetype_index"])] == name
        values = {key: row[place] for key, row in tables[name].items()}
        motion, storeys = MOTIONS[int(own["motion_index"])], kinds[name][0]
        exact = bilinear_chain_response(
            values["mass"],
            values["stiffness"],
            values["yield_force"],
            kinds[name][1],
            chain_matrix(values["damping_coefficient"]),
            -motion.acceleration[:, None] * values["mass"],
            STEP,
        )
        # Peaks are seen at steps: they miss (w h)^2 / 8 at most, 1e-4 at the highest frequency here, 50 rad/s, and
        # yielding costs less than that at this step. Energies have no such error.
        drift, energy = own["peak_storey_drift"].values, own["hysteretic_energy"].values
        np.testing.assert_allclose(drift[:storeys], exact.peak_storey_drift, rtol=2e-4)
        total = exact.hysteretic_energy[-1].sum()
        np.testing.assert_allclose(energy[:storeys], exact.hysteretic_energy[-1], rtol=0, atol=1e-3 * total)
        assert np.isnan(drift[storeys:]).all()
        yielded += bool((exact.peak_storey_drift > 2 * values["yield_force"] / values["stiffness"]).any())
    assert yielded > len(buildings)
    run.close()
