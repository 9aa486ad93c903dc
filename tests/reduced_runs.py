"""Runs whose statistics are compared with numpy's of their full table, and that comparison's parts."""

import numpy as np
import pytest
import xarray as xr
from test_portfolio import DAMPED, chain
from test_simulate import MOTIONS, SEEDED, make_building

import warpdyn as wd

# Of tests that compare such runs, which mean their scenes as they are. They share a dozen kernels and run so many
# histories that unoptimised ones would take several times as long as compiling does.
MARKS = pytest.mark.meant_as_given(
    "first_period", "yield_base_shear_coefficient", "drift_limit", "intensity_level", "scale_factor"
)
LEVELS = [0.8, 1.6, 3.2]
PGA = wd.PeakGroundAcceleration()
DESIGNS = {
    "crossed": wd.Stripes(MOTIONS, LEVELS, PGA),
    "nested": wd.Stripes(MOTIONS, LEVELS, PGA, structures_per_motion=7),
    "cloud": wd.Cloud(MOTIONS),
    "one motion": wd.OneMotionPerStructure(MOTIONS, scale=3.2),
    "sequence": wd.EventSequence(
        {"first": wd.Stripes(MOTIONS, LEVELS, PGA), "second": wd.Stripes(MOTIONS, [1.2], PGA)}
    ),
}
STRUCTURES = 21
LIMITS = {"slight": 0.004, "moderate": 0.008, "complete": 0.014}
SCATTER = {
    "mass": wd.RandomFactor(wd.Lognormal(1, 0.3)),
    "yield_force": wd.RandomFactor(wd.Lognormal(1, 0.3)),
}
CITY = wd.Portfolio(
    {
        "low": wd.Archetype(chain(1), 13, SCATTER),
        "middle": wd.Archetype(chain(2), 5, SCATTER),
        "high": wd.Archetype(chain(3, 5e5, hardening_ratio=0.1), 4, SCATTER),
        "other": wd.Archetype(chain(2, 7e5, **DAMPED), 3, SCATTER),
    }
)
CITY_LIMITS = {
    name: {"slight": 0.004 + 0.001 * place, "complete": 0.011 - 0.001 * place}
    for place, name in enumerate(CITY.archetypes)
}
# Motions that differ from building to building and from draw to draw.
SITES = np.random.default_rng(2).integers(0, 2, (CITY.buildings, 3))
DESIGNS["at sites"] = wd.MotionsAtSites(MOTIONS, [[[0], [1]], [[2], [1]]], 4.0, site=SITES)
RECORDERS = ("drift", "acceleration", "residual", "energy")


def city_of(first):
    """Return a city with so many buildings of its first archetype."""
    name, archetype = next(iter(CITY.archetypes.items()))
    return wd.Portfolio({**CITY.archetypes, name: wd.Archetype(archetype.building, first, archetype.scatter)})


def scene_of(design, structure=None):
    """Return the scene of a design, of one structure or of the city, in which some samples collapse.

    Args:
        design: A design, or the name of one in DESIGNS, after "city " for the city.
        structure: The structure, if it is another one.
    """
    if isinstance(design, str) and design.startswith("city "):
        design, structure = design.removeprefix("city "), CITY
    given = {"scatter": SEEDED} if structure is None else {}
    structure = make_building() if structure is None else structure
    excitation = DESIGNS[design] if isinstance(design, str) else design
    return wd.Scene(structure, excitation, recorders=RECORDERS, tail=1.2, collapse_drift_ratio=0.02, **given)


def simulate(scene, **settings):
    """Run a scene on the CPU."""
    given = scene.structure.is_many or scene.structures_given
    return wd.simulate(scene, structures=None if given else STRUCTURES, device="cpu", seed=3, **settings)


def events_of(run):
    """Return the events of a run by name, each as an ordinary run; of one event by the name None."""
    if "event" not in run.dims:
        return {None: run}
    return {name: wd.select_event(run, name) for name in run["event"].values.tolist()}


def keys_of(run, over, labels):
    """Return the label along each dimension of every sample."""
    structure = run["building" if "building" in run.coords else "structure"].values
    known = {"structure": structure, "building": structure, "motion": run["motion_index"].values}
    known |= {name: np.asarray(values)[structure] for name, values in labels.items()}
    if "archetype_index" in run.coords:
        known["archetype"] = run["archetype"].values[run["archetype_index"].values]
    if "im_level" in run.coords:
        known["stripe"] = run["im_level"].values
    return [known[name] for name in over if name != "event"]


def assert_made_of(table, run, over, labels, of_samples):
    """Check that each cell of a table is what a function makes of its samples, given by their numbers, in the full run.

    Args:
        table: What is checked, with the coordinates of its cells.
        run: The full run.
        over: Dimensions of the cells.
        labels: Labels of structures.
        of_samples: Function of a run and the indices of some samples to the row that they make.
    """
    cells = 0
    for name, event in events_of(run).items():
        of_event = table if name is None else table.sel(event=name)
        dims = [dim for dim in over if dim != "event"]
        keys = keys_of(event, over, labels)
        for place in np.ndindex(*(of_event.sizes[dim] for dim in dims)):
            chosen = np.ones(event.sizes["sample"], dtype=bool)
            for dim, number, key in zip(dims, place, keys, strict=True):
                chosen &= key == table[dim].values[number]
            got = of_event.isel(dict(zip(dims, place, strict=True)))
            of_samples(got, event, np.flatnonzero(chosen))
            cells += 1
    assert cells == np.prod([table.sizes[dim] for dim in over], dtype=int)


def with_failures(monkeypatch, share):
    """Make a share of the samples diverge, the same ones however the run is divided."""
    from warpdyn.campaigns.running import pipeline

    genuine = pipeline.rerun_in_float64

    def fails(whole, standing, outputs):
        done = genuine(whole, standing, outputs)
        outputs["status"][np.random.default_rng(1).random(10**6)[whole.sample[standing]] < share] = 2
        return done

    monkeypatch.setattr(pipeline, "rerun_in_float64", fails)


def small_blocks(monkeypatch, samples):
    """Divide runs into blocks of so many samples, and let threads share blocks however small."""
    from warpdyn.campaigns.reductions import tally
    from warpdyn.campaigns.running import blocks

    monkeypatch.setattr(blocks, "CPU_BLOCK", samples)
    monkeypatch.setattr(tally, "LEAST_SAMPLES", 1)


def statistics_of(dataset):
    """Return the variables and coordinates of a dataset without its attributes, which tell of times."""
    return xr.Dataset(dict(dataset.data_vars), dataset.coords)
