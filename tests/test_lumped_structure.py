"""Lumped structures against results of other programs, closed forms, chains of storeys, and changes of coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from lumped_case import Case, pulse
from lumped_cases import CASES, deck_about
from scipy.integrate import solve_ivp

import warpdyn as wd

# Structures of the cases are round, and some are undamped or yield a lot.
pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]


def run_of(case: Case, step: float = 0.0005, **settings: object):
    scene = wd.Scene(case.structure, case.motion, tail=case.tail)
    return wd.simulate(scene, step=step, dtype="float64", device="cpu", **settings)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_peaks_and_frequencies_of_another_program(case):
    case = case()
    frequencies = case.structure.modal()["circular_frequency"].values
    for own, due in zip(frequencies, case.circular_frequencies, strict=False):
        assert own == pytest.approx(due, rel=1e-6)
    for own, due in zip(2 * np.pi / frequencies, case.periods, strict=False):
        assert own == pytest.approx(due, rel=1e-6)
    run = run_of(case, histories=wd.Histories([0], every=100))
    assert run["status"].item() == 0
    assert abs(run["energy_balance_error"].item()) < 2e-8
    found, due = [], []
    for name, places in case.peaks.items():
        dim = run[name].dims[1]
        found += [run[name].sel({dim: place}).item() for place in places]
        due += places.values()
    np.testing.assert_allclose(found, due, rtol=case.bound)
    last = run["displacement"].isel(history=0, time=-1)
    largest = max(case.peaks["peak_displacement"].values())
    for place, value in case.last.items():
        assert last.sel(dof=place).item() == pytest.approx(value, abs=2e-4 * largest)


def test_modal_frequencies_are_those_of_a_closed_form():
    # One storey whose frame A is off the centre: x alone, and two coupled modes of y and theta.
    case = CASES[0]()
    mass, inertia = case.structure.parameters["mass"][[1, 2]]
    a, b, arm, half = 1094542.72, 583756.117, 0.4572, 3.048
    kyy, kyt, ktt = a / mass, a * arm / np.sqrt(mass * inertia), (a * arm**2 + 2 * b * half**2) / inertia
    middle, swing = (kyy + ktt) / 2, np.hypot((kyy - ktt) / 2, kyt)
    due = np.sqrt(np.sort([2 * b / mass, middle - swing, middle + swing]))
    np.testing.assert_allclose(case.structure.modal()["circular_frequency"], due, rtol=1e-12)


def chain_and_lumped(law: str, **parameters: float):
    """Return a ShearBuilding and the same building as a LumpedStructure."""
    mass, stiffness, damped = [1e5, 1.2e5, 0.8e5], [4e7, 3e7, 2e7], {"damping": "rayleigh", "damping_ratio": 0.05}
    chain = wd.ShearBuilding(mass, stiffness, 3.0, law=law, **damped, **parameters)
    springs = [
        wd.Spring(str(i), {str(i): 1.0} | ({str(i - 1): -1.0} if i else {}), law=law, stiffness=each, **parameters)
        for i, each in enumerate(stiffness)
    ]
    return chain, wd.LumpedStructure({str(i): each for i, each in enumerate(mass)}, springs, **damped)


METHODS = ("rk4", "heun", "kutta3", "three_eighths", "dormand_prince5", "velocity_verlet", "nystroem4")
LAWS = {
    "elastic": {},
    "bilinear": {"yield_force": 3e5, "hardening_ratio": 0.05},
    "bouc_wen": {"yield_force": 3e5, "hardening_ratio": 0.05},
    "peak_oriented": {"yield_force": 3e5, "hardening_ratio": 0.05},
    "menegotto_pinto": {"yield_force": 3e5, "hardening_ratio": 0.05},
}


@pytest.mark.parametrize(
    ("law", "method"),
    [
        *((law, "rk4") for law in LAWS),
        *(("bilinear", each) for each in METHODS[1:]),
        ("bouc_wen", "dormand_prince5"),
        ("bouc_wen", "heun"),
        ("peak_oriented", "heun"),
    ],
)
@pytest.mark.usefixtures("unoptimised")  # one run is compared with another
def test_a_chain_of_springs_is_a_shear_building(law, method):
    chain, lumped = chain_and_lumped(law, **LAWS[law])
    motion = pulse(5.0, 0.6, 0.3, 4.0)
    settings = {"step": 0.005, "dtype": "float64", "device": "cpu", "method": method}
    recorders = ("acceleration", "energy", "residual")
    one = wd.simulate(wd.Scene(chain, motion, recorders=(*recorders, "drift")), **settings)
    other = wd.simulate(wd.Scene(lumped, motion, recorders=(*recorders, "spring")), **settings)
    names = {"peak_spring_deformation": "peak_storey_drift", "peak_acceleration": "peak_floor_acceleration"}
    for name, due in names.items():
        np.testing.assert_allclose(other[name], one[due], rtol=1e-10)
    residual = 3.0 * one["residual_drift_ratio"]  # m; storeys are 3 m high
    largest = one["peak_storey_drift"].max().item()
    np.testing.assert_allclose(other["residual_deformation"], residual, atol=1e-10 * largest)
    for name in ("input_energy", "viscous_energy", "hysteretic_energy"):
        np.testing.assert_allclose(other[name], one[name], atol=1e-12 * one["input_energy"].item())
    assert other["energy_balance_error"].item() == pytest.approx(one["energy_balance_error"].item(), abs=1e-12)


def test_degrees_of_freedom_at_another_point_give_the_same_response():
    runs = [run_of(deck_about(*place), 0.001) for place in ((0.0, 0.0), (10.0, 6.0), (3.0, -2.0))]
    for run in runs[1:]:
        for name in ("peak_output", "peak_spring_deformation", "peak_spring_force"):
            np.testing.assert_allclose(run[name], runs[0][name], rtol=1e-9)
    for name in ("circular_frequency", "effective_mass"):
        one, other = (deck_about(*place).structure.modal()[name] for place in ((0.0, 0.0), (3.0, -2.0)))
        np.testing.assert_allclose(other, one, rtol=1e-9)


def test_drawn_structures_are_those_with_these_values():
    building, motion = CASES[1]().structure, CASES[1]().motion
    scatter = {
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="spring"),
        "yield_force": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="spring", storey_correlation=0.5),
        "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.05), per="dof"),
        "damping_ratio": wd.RandomValue(wd.Uniform(0.02, 0.06)),
    }
    settings = {"dtype": "float64", "device": "cpu"}
    scene = wd.Scene(building, motion, scatter, recorders=("spring", "displacement"), tail=1.0)
    run = wd.simulate(scene, structures=20, **settings)
    assert run["stiffness"].dims == ("sample", "spring")
    assert run["mass"].dims == ("sample", "dof")
    for number in (0, 19):
        drawn = run.isel(sample=number)
        springs = [
            wd.Spring(
                spring.name,
                spring.direction,
                law="bilinear",
                stiffness=drawn["stiffness"].sel(spring=spring.name).item(),
                yield_force=drawn["yield_force"].sel(spring=spring.name).item(),
                hardening_ratio=0.05,
            )
            for spring in building.springs
        ]
        one = wd.LumpedStructure(
            {name: drawn["mass"].sel(dof=name).item() for name in building.dof_names},
            springs,
            influence=[{name: 1.0 for name in building.dof_names if name[0] == axis} for axis in "xy"],
            damping="rayleigh",
            damping_ratio=drawn["damping_ratio"].item(),
            damping_modes=(1, 5),
        )
        scene = wd.Scene(one, motion, recorders=("spring", "displacement"), tail=1.0)
        alone = wd.simulate(scene, step=drawn["integration_step"].item(), **settings)
        for name in ("peak_spring_deformation", "peak_displacement"):
            np.testing.assert_allclose(alone[name][0], drawn[name], rtol=1e-9)


def test_collapse_is_that_of_a_shear_building():
    chain, _ = chain_and_lumped("bilinear", **LAWS["bilinear"])
    capacities = [0.05, 0.04, 0.02]
    chain = wd.ShearBuilding(**chain.parameters, law="bilinear", damping="rayleigh", drift_capacity=capacities)
    springs = [
        wd.Spring(
            str(i),
            {str(i): 1.0} | ({str(i - 1): -1.0} if i else {}),
            law=wd.laws.Bilinear(**LAWS["bilinear"]),
            stiffness=chain.parameters["stiffness"][i],
            deformation_capacity=capacity,
        )
        for i, capacity in enumerate(capacities)
    ]
    mass = {str(i): each for i, each in enumerate(chain.parameters["mass"])}
    lumped = wd.LumpedStructure(mass, springs, damping="rayleigh", damping_ratio=0.05)
    motions = [pulse(amplitude, 0.6, 0.3, 6.0) for amplitude in np.linspace(1.0, 12.0, 20)]
    settings = {"dtype": "float64", "device": "cpu", "method": "rk4"}
    one = wd.simulate(
        wd.Scene(chain, wd.Cloud(motions), recorders=("drift", "acceleration", "residual"), tail=1.0), **settings
    )
    other = wd.simulate(
        wd.Scene(lumped, wd.Cloud(motions), recorders=("spring", "acceleration", "residual"), tail=1.0), **settings
    )
    np.testing.assert_array_equal(other["status"], one["status"])
    assert 0 < (one["status"] == 1).sum() < 20
    np.testing.assert_allclose(other["time_of_collapse"], one["time_of_collapse"], rtol=1e-9)
    storey = one["storey_of_collapse"].values
    np.testing.assert_array_equal(other["spring_of_collapse"], np.where(storey > 0, storey - 1, -1))
    np.testing.assert_allclose(other["peak_spring_deformation"], one["peak_storey_drift"], rtol=1e-9)
    np.testing.assert_allclose(other["peak_acceleration"], one["peak_floor_acceleration"], rtol=1e-9)
    np.testing.assert_allclose(other["residual_deformation"], 3.0 * one["residual_drift_ratio"], atol=1e-10)


@pytest.mark.parametrize("law", ["bilinear", "bouc_wen", "peak_oriented"])
@pytest.mark.usefixtures("unoptimised")  # one run is compared with another
def test_an_event_begins_with_the_state_after_the_last_one(law):
    chain, lumped = chain_and_lumped(law, **LAWS[law])
    events = {"first": pulse(5.0, 0.6, 0.3, 4.0), "second": pulse(-6.0, 0.7, 0.3, 4.0)}
    settings = {"dtype": "float64", "device": "cpu", "method": "rk4"}
    sequence = wd.EventSequence(events)
    one = wd.simulate(wd.Scene(chain, sequence, recorders=("drift",), tail=1.0), **settings)
    other = wd.simulate(wd.Scene(lumped, sequence, recorders=("spring",), tail=1.0), **settings)
    assert one["peak_storey_drift"].dims == ("sample", "event", "storey")
    np.testing.assert_allclose(other["peak_spring_deformation"], one["peak_storey_drift"], rtol=1e-10)


LOADS = {
    "harmonic": wd.HarmonicForce([1e5, 0.0, 2e5], 9.0, 4.0),
    "forces": wd.ForceHistory(1e5 * np.sin(np.outer(0.01 * np.arange(300), [7.0, 8.0, 9.0])), 0.01),
    "free vibration": wd.FreeVibration(3.0, displacement=[0.01, 0.03, 0.04], velocity=[0.1, 0.0, 0.0]),
    "noise": wd.FilteredNoise(wd.KanaiTajimi(0.01, 15.0, 0.6), 5.0, 0.01),
}


@pytest.mark.meant_as_given("initial_drift_ratio", "drift_ratio_of_force")
@pytest.mark.parametrize("load", LOADS.values(), ids=list(LOADS))
@pytest.mark.parametrize("law", ["bilinear", "bouc_wen"])
@pytest.mark.usefixtures("unoptimised")  # one run is compared with another
def test_other_loads_act_as_on_a_shear_building(law, load):
    chain, lumped = chain_and_lumped(law, **LAWS[law])
    settings = {"step": 0.002, "dtype": "float64", "device": "cpu", "method": "rk4", "seed": 5}
    one = wd.simulate(wd.Scene(chain, load, recorders=("drift",)), **settings)
    other = wd.simulate(wd.Scene(lumped, load, recorders=("spring",)), **settings)
    np.testing.assert_allclose(other["peak_spring_deformation"], one["peak_storey_drift"], rtol=1e-10)


def test_peaks_from_a_later_time_on_are_those_of_a_shear_building():
    chain, lumped = chain_and_lumped("bilinear", **LAWS["bilinear"])
    settings = {"step": 0.005, "dtype": "float64", "device": "cpu", "method": "rk4"}
    motion = pulse(5.0, 0.6, 0.3, 6.0)
    one = wd.simulate(wd.Scene(chain, motion, recorders=("drift", "acceleration"), record_from=3.0), **settings)
    recorders = ("spring", "acceleration", "displacement")
    other = wd.simulate(wd.Scene(lumped, motion, recorders=recorders, record_from=3.0), **settings)
    np.testing.assert_allclose(other["peak_spring_deformation"], one["peak_storey_drift"], rtol=1e-10)
    np.testing.assert_allclose(other["peak_acceleration"], one["peak_floor_acceleration"], rtol=1e-10)
    assert (other["time_of_peak_displacement"] >= 3.0).all()


@pytest.mark.meant_as_given("scale_factor", "first_period")
def test_a_state_that_is_not_finite_is_diverged_and_an_unstable_step_is_divided():
    lumped = wd.LumpedStructure(
        {"x": 1.0}, [wd.Spring("s", {"x": 1.0}, stiffness=1e4)], damping="modal", damping_ratio=0.05
    )
    motion = pulse(1.0, 0.6, 0.3, 4.0)
    scene = wd.Scene(lumped, motion, recorders=("spring",))
    with pytest.warns(UserWarning, match="beyond the stability limit"):
        divided = wd.simulate(scene, step=0.05, dtype="float64", device="cpu", resample=True)
    assert divided["status"].item() == 0
    assert divided["integration_step"].item() < 0.0283  # 2.83 / w of rk4
    with pytest.warns(UserWarning, match="unstable_step"):
        flagged = wd.simulate(scene, step=0.05, dtype="float64", device="cpu", resample=True, on_unstable="flag")
    assert flagged["status"].item() == 3
    strong = wd.Scene(lumped, wd.OneMotionPerStructure([pulse(9.0, 0.6, 0.3, 4.0)], [0], 1e38), recorders=("spring",))
    with pytest.warns(UserWarning, match="diverged"):
        run = wd.simulate(strong, dtype="float32", device="cpu")
    assert run["status"].item() == 2
    assert np.isnan(run["peak_spring_deformation"]).all()


def test_samples_do_not_depend_on_the_samples_of_their_thread():
    case = CASES[1]()
    motions = [wd.PairOfMotions(pulse(a, 0.9, 0.6), pulse(a, 0.6, 0.5)) for a in np.linspace(1.0, 9.0, 21)]
    settings = {"step": 0.005, "device": "cpu"}
    run = wd.simulate(wd.Scene(case.structure, wd.Cloud(motions), recorders=("spring",), tail=0.0), **settings)
    for number in (0, 7, 20):
        one = wd.simulate(wd.Scene(case.structure, motions[number], recorders=("spring",), tail=0.0), **settings)
        for name in ("peak_spring_deformation", "peak_spring_force"):
            np.testing.assert_array_equal(run[name][number], one[name][0])


def test_a_large_full_matrix_is_a_linear_system():
    # 20 degrees of freedom with full matrices: kernels multiply them in loops, instead of one statement for each row.
    random, names = np.random.default_rng(1), [str(i) for i in range(20)]
    roots = random.normal(size=(3, 20, 20))
    mass, damping, stiffness = (root @ root.T + 20.0 * np.eye(20) for root in roots)
    springs = [wd.Spring(name, {name: 1.0}, stiffness=1.0) for name in names]
    matrices = {"mass_matrix": mass, "stiffness_matrix": 100.0 * stiffness, "damping_matrix": damping}
    lumped = wd.LumpedStructure(dict.fromkeys(names, 1.0), springs, **matrices)
    linear = wd.LinearSystem(mass + np.eye(20), damping, 100.0 * stiffness + np.eye(20))
    settings = {"step": 0.005, "dtype": "float64", "device": "cpu", "method": "rk4"}
    recorders = ("displacement", "acceleration", "energy")
    one, other = (
        wd.simulate(wd.Scene(each, pulse(5.0, 0.6, 0.3, 4.0), recorders=recorders, tail=1.0), **settings)
        for each in (linear, lumped)
    )
    for name in ("peak_displacement", "peak_acceleration", "input_energy", "viscous_energy"):
        np.testing.assert_allclose(other[name], one[name], rtol=1e-10)
    assert abs(other["energy_balance_error"].item()) < 1e-6


@pytest.mark.parametrize(("brace", "dashpot"), [(1e7, 2e5), (1e9, 2e5), (1e7, 2e3)])
def test_a_maxwell_spring_relaxes(brace, dashpot):
    """The force of a damper with a brace: f' = k_b (v - f / c); it may relax faster than any mode vibrates."""
    mass, stiffness, step = 1e5, 1e7, 0.02
    time = step * np.arange(400)
    base = 3.0 * np.sin(6.0 * time) * np.exp(-0.2 * time)
    springs = [
        wd.Spring("frame", {"x": 1.0}, stiffness=stiffness),
        wd.Spring("damper", {"x": 1.0}, law="maxwell_damper", brace_stiffness=brace, damper_coefficient=dashpot),
    ]
    structure = wd.LumpedStructure({"x": mass}, springs)
    run = wd.simulate(wd.Scene(structure, wd.GroundMotion(base, step, "m"), tail=0.0), dtype="float64", device="cpu")

    def slope(t, state):
        u, v, force = state
        return [v, -(stiffness * u + force) / mass - np.interp(t, time, base), brace * (v - force / dashpot)]

    exact = solve_ivp(slope, (0, time[-1]), [0.0, 0.0, 0.0], method="LSODA", rtol=1e-9, atol=1e-12, max_step=0.01)
    assert run["status"].item() == 0
    assert run["integration_step"].item() * brace / dashpot < 2.8  # the limit of RK4 for z' = -z
    assert run["peak_spring_deformation"][0, 0].item() == pytest.approx(np.abs(exact.y[0]).max(), rel=1e-3)
