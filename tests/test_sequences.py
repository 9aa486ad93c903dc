"""Sequences: events in turn are one run under the motions joined together, and OpenSees has the same of them."""

from dataclasses import replace

import numpy as np
import pytest
from opensees import chain_drifts

import warpdyn as wd

STEP, TAIL = 0.01, 0.3


def make_motion(values, seed, size=4.0):
    wave = np.random.default_rng(seed).standard_normal(values) * np.hanning(values)  # begins and ends with 0
    return wd.GroundMotion(size * wave, STEP, name=f"noise {seed}")


def scaled(motion, factor):
    return replace(motion, acceleration=factor * motion.acceleration)


MAIN, AFTER, LATER = make_motion(301, 1), make_motion(201, 2, 3.0), make_motion(151, 3)
DEGRADING = {  # drifts in m
    "plastic_drift_to_capping": 0.03,
    "post_capping_drift": 0.2,
    "capping_force_ratio": 1.1,
    "residual_force_ratio": 0.2,
    "ultimate_drift": 0.0,
    "strength_deterioration_drift": 0.5,
    "post_capping_deterioration_drift": 0.5,
    "unloading_deterioration_drift": 0.5,
    "reloading_deterioration_drift": 0.5,
    "deterioration_rate": 1.0,
}
FOUR_POINTS = {"ductility_2": 2.0, "force_ratio_2": 1.4, "ductility_3": 8.0, "force_ratio_3": 1.8}
LAWS = {
    "elastic": {},
    "bilinear": {"hardening_ratio": 0.05},
    "bouc_wen": {"hardening_ratio": 0.05},
    "ibarra_medina_krawinkler_peak_oriented": DEGRADING,
    "pinching4": FOUR_POINTS | {"ductility_4": 20.0, "force_ratio_4": 1.0},
}


def make_building(law="bilinear", **changes):
    strength = {} if law == "elastic" else {"yield_force": [4e3, 2e3]}
    damping = {"damping": "storey", "damping_coefficient": 2e3}
    values = {"mass": [2e3, 1e3], "stiffness": [6e5, 4e5], "height": [3.5, 3.0]}
    return wd.ShearBuilding(law=law, **(values | strength | LAWS[law] | damping | changes))


def joined(*motions, tail):
    """Return motions one after the other, each with a rest."""
    rest = np.zeros(round(tail / STEP) - 1)
    parts = [part for motion in motions for part in (motion.acceleration, rest)]
    return wd.GroundMotion(np.concatenate(parts[:-1]), STEP)


def both(building, method, dtype, tail=TAIL, motions=(MAIN, AFTER)):
    """Return a sequence of motions, and one run under the motions joined together, of one sample each."""
    settings = {"step": 0.005, "method": method, "dtype": dtype, "device": "cpu"}
    events = wd.EventSequence({f"event {number}": motion for number, motion in enumerate(motions)})
    runs = (
        wd.simulate(wd.Scene(building, load, tail=tail), **settings) for load in (events, joined(*motions, tail=tail))
    )
    return tuple(run.isel(sample=0) for run in runs)


# What it rounds to, amplified by a yielding building; implicit methods solve anew for the acceleration at the start.
CASES = [("bouc_wen", "rk4", "float64", 1e-12)]
CASES += [
    ("pinching4", "newmark_average", "float64", 1e-9),
    pytest.param("bilinear", "newmark_average", "float64", 1e-9, marks=pytest.mark.thorough),
    pytest.param("bilinear", "rk4", "float64", 1e-12, marks=pytest.mark.thorough),
    pytest.param("pinching4", "rk4", "float64", 1e-12, marks=pytest.mark.thorough),
    pytest.param("bouc_wen", "newmark_average", "float64", 1e-9, marks=pytest.mark.thorough),
    pytest.param("ibarra_medina_krawinkler_peak_oriented", "rk4", "float32", 1e-5, marks=pytest.mark.thorough),
    pytest.param("bouc_wen", "kutta3", "float64", 1e-12, marks=pytest.mark.thorough),
    pytest.param("bouc_wen", "dormand_prince5", "float64", 1e-12, marks=pytest.mark.thorough),
    ("bilinear", "dormand_prince54", "float64", 1e-4),  # its steps begin anew with each event
    pytest.param("bilinear", "central_difference_lagged", "float64", 1e-12, marks=pytest.mark.thorough),
]


@pytest.mark.usefixtures("unoptimised")  # one run is held to another
@pytest.mark.filterwarnings("ignore:a tail of:UserWarning", "ignore:.*energy balance:UserWarning")
@pytest.mark.parametrize(("law", "method", "dtype", "rtol"), CASES)
def test_events_in_turn_are_one_run_under_the_joined_motions(law, method, dtype, rtol):
    # Too short for rest: what the first event leaves still moves.
    events, whole = both(make_building(law), method, dtype)
    assert (events["status"] == 0).all()
    for name in ("peak_storey_drift", "peak_floor_acceleration", "peak_base_shear"):
        np.testing.assert_allclose(events[name].max("event"), whole[name], rtol=rtol, err_msg=name)
    worst = events["peak_storey_drift_ratio"].max("storey").values
    began = [0.0, len(MAIN.values) * STEP - STEP + TAIL][worst.argmax()]
    time = events["time_of_peak_drift"].values[worst.argmax()] + began
    np.testing.assert_allclose(time, whole["time_of_peak_drift"], atol=1.01 * STEP if rtol > 1e-5 else 1e-5)
    residual = events["residual_drift_ratio"].values[1]
    np.testing.assert_allclose(residual, whole["residual_drift_ratio"], rtol=0, atol=rtol * worst.max())
    assert np.abs(residual).max() > 0.05 * worst.max()
    supplied = abs(float(whole["input_energy"]))
    for name in ("input_energy", "viscous_energy", "hysteretic_energy"):
        total = events[name].values.sum(axis=0)
        np.testing.assert_allclose(total, whole[name], rtol=0, atol=10 * rtol * supplied, err_msg=name)


@pytest.mark.filterwarnings("ignore:a tail of:UserWarning")
@pytest.mark.parametrize("method", [pytest.param("rk4", marks=pytest.mark.thorough), "newmark_average"])
def test_energy_closes_in_every_event(method):
    # The second event starts with what is stored and moves, under gravity that has pushed already: it gives back what
    # is told here to be far more than the balance may be off. (Hysteretic energies are held to one run's above.)
    building = make_building(gravity_load=[1e4, 5e3])
    load = wd.EventSequence({"event 0": MAIN, "event 1": LATER})
    settings = {"step": 0.0025, "method": method, "dtype": "float64", "device": "cpu"}
    events = wd.simulate(wd.Scene(building, load, tail=TAIL), **settings).isel(sample=0)
    assert (np.abs(events["energy_balance_error"]) < 2e-3).all()
    assert (events["hysteretic_energy"].sum("storey") > 0.02 * events["input_energy"]).all()
    changed = events["input_energy"] - events["viscous_energy"] - events["hysteretic_energy"].sum("storey")
    assert (np.abs(changed) > 0.01 * events["input_energy"]).all()


STEEL = [("Steel01", [4e3, 6e5, 0.05]), ("Steel01", [2e3, 4e5, 0.05])]


def pinching4(strength, stiffness):
    side = [1, 1, 1.4, 2.0, 1.8, 8.0, 1.0, 20.0] * np.tile([strength, strength / stiffness], 4)
    undamaged = [0.0, 0.0, 1.0, 1.0, 0.0]
    numbers = [*side, *-side, *[0.5, 0.25, 0.05] * 2, *undamaged * 3, 10.0]
    return "Pinching4", [*map(float, numbers), "energy"]


OPENSEES = {"bilinear": STEEL, "pinching4": [pinching4(4e3, 6e5), pinching4(2e3, 4e5)]}


@pytest.mark.meant_as_given("peak_ground_acceleration")
@pytest.mark.parametrize("law", ["bilinear", pytest.param("pinching4", marks=pytest.mark.thorough)])
def test_each_event_is_as_in_opensees(law):
    # Dampers that leave nothing moving after six seconds. The steps of both leave 1.4e-4 at most.
    coefficient, tail = 8e3, 6.0
    building = make_building(law, damping_coefficient=coefficient)
    motions = scaled(MAIN, 1.5), scaled(AFTER, 3.0)
    load = wd.EventSequence({"mainshock": motions[0], "aftershock": motions[1]})
    run = wd.simulate(wd.Scene(building, load, tail=tail), step=0.001, dtype="float64", device="cpu").isel(sample=0)
    whole, substeps = joined(*motions, tail=tail).acceleration, 20
    ends = np.cumsum([len(motion.values) - 1 + round(tail / STEP) for motion in motions])
    drift = chain_drifts(
        [2e3, 1e3], OPENSEES[law], (0.0, [coefficient] * 2), [0.0, 0.0], whole, STEP, int(ends[-1]), substeps
    )
    parts = drift[: ends[0] * substeps + 1], drift[ends[0] * substeps :]
    for event, part in enumerate(parts):
        own, theirs = run.isel(event=event), np.abs(part).max(axis=0)
        assert theirs.max() > 2 * 4e3 / 6e5  # a ductility of two
        np.testing.assert_allclose(own["peak_storey_drift"], theirs, rtol=0, atol=5e-4 * theirs.max())
        residual = own["residual_drift_ratio"] * building.parameters["height"]
        np.testing.assert_allclose(residual, part[-1], rtol=0, atol=5e-4 * theirs.max())
        assert np.abs(part[-1]).max() > 0.05 * theirs.max()


@pytest.mark.usefixtures("unoptimised")
def test_an_elastic_building_at_rest_forgets_the_mainshock():
    building = make_building("elastic", damping_coefficient=8e3)
    settings = {"step": 0.005, "dtype": "float64", "device": "cpu"}
    tail = 20.0  # over which the slowest mode, of 8 % damping, decays to 1e-9
    run = wd.simulate(wd.Scene(building, wd.EventSequence({"a": MAIN, "b": AFTER}), tail=tail), **settings)
    for event, motion in enumerate((MAIN, AFTER)):
        alone = wd.simulate(wd.Scene(building, motion, tail=tail), **settings)
        for name in ("peak_storey_drift", "peak_floor_acceleration", "input_energy", "time_of_peak_drift"):
            np.testing.assert_allclose(run[name][:, event], alone[name], rtol=1e-7, err_msg=name)
