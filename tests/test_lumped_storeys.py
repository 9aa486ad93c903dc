"""Kernels of lumped structures that loop over equal storeys, and multistep methods of lumped structures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from lumped_case import Case, pair, pulse
from lumped_cases import CASES, torsional_building

import warpdyn as wd
from warpdyn.campaigns.integration.lumped.dynamics import LumpedDynamics
from warpdyn.engine.device.warp_exchange import number_at
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.lumped import division
from warpdyn.engine.kernels.lumped.pattern import Table
from warpdyn.engine.kernels.lumped.storeys import storeys_of
from warpdyn.engine.kernels.plan import Plan
from warpdyn.engine.methods.table import METHODS

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
ON_GPU = pytest.mark.skipif(not wp.get_cuda_device_count(), reason="this computer has no GPU")
BILINEAR = {"law": "bilinear", "yield_force": 9e5, "hardening_ratio": 0.05}


def frames(storeys: int) -> list[wd.PlanFrame]:
    """Return four frames, one of them at an angle, with a stiffness per storey."""
    factor = np.linspace(1.0, 0.5, storeys)
    return [
        wd.PlanFrame("A", (0.0, 5.0), "x", 6e7 * factor, **BILINEAR),
        wd.PlanFrame("B", (0.0, -5.0), "x", 5e7 * factor, **BILINEAR),
        wd.PlanFrame("C", (-9.0, 0.0), "y", 9e7 * factor, **BILINEAR),
        wd.PlanFrame("D", (9.0, 0.0), 1.8, 3e7 * factor, **BILINEAR),
    ]


def building(storeys: int, **more: object) -> wd.TorsionalBuilding:
    masses = [1.5e5] * (storeys - 1) + [1.2e5]
    return wd.TorsionalBuilding(
        masses, [[-10.0, 10.0], [-6.0, 6.0]], frames(storeys), damping="rayleigh", damping_ratio=0.05, **more
    )


def pattern_of(structure: wd.LumpedStructure):
    return LumpedDynamics(structure, {}).pattern


def test_storeys_are_found_in_any_order_of_degrees_of_freedom_and_springs():
    found = storeys_of(pattern_of(building(4)))
    assert found.dofs == tuple((3 * floor, 3 * floor + 1, 3 * floor + 2) for floor in range(4))
    assert found.springs == tuple((floor, floor + 4, floor + 8, floor + 12) for floor in range(4))  # frame by frame
    assert found.outputs == tuple(tuple(range(4 * floor, 4 * floor + 4)) for floor in range(4))
    assert all(found.relative)
    # All displacements in x first, then those in y; springs along x, y and a diagonal, from the roof down.
    masses = {f"{axis}{floor}": 1e5 for axis in "xy" for floor in range(5)}
    springs = []
    for floor in range(4, -1, -1):
        for name, axes in (("along", "x"), ("across", "y"), ("diagonal", "xy")):
            direction = {f"{axis}{floor}": 1.0 for axis in axes}
            direction |= {f"{axis}{floor - 1}": -1.0 for axis in axes} if floor else {}
            springs.append(wd.Spring(f"{name} {floor}", direction, stiffness=4e7))
    found = storeys_of(pattern_of(wd.LumpedStructure(masses, springs, influence=dict.fromkeys(masses, 1.0))))
    assert found.dofs == tuple((floor, floor + 5) for floor in range(5))
    assert found.springs == tuple(tuple(range(3 * (4 - floor), 3 * (5 - floor))) for floor in range(5))


def test_an_absolute_displacement_is_not_taken_for_a_relative_one():
    # A column pin-ended at each floor: its deformation depends on the rotations of both floors, with one sign.
    masses = {f"{name}{floor}": mass for floor in range(3) for name, mass in (("u", 1e5), ("r", 1e6))}
    springs = []
    for floor in range(3):
        shear = {f"u{floor}": 1.0, f"r{floor}": -1.5} | (
            {f"u{floor - 1}": -1.0, f"r{floor - 1}": -1.5} if floor else {}
        )
        bending = {f"r{floor}": 1.0} | ({f"r{floor - 1}": -1.0} if floor else {})
        springs += [
            wd.Spring(f"shear {floor}", shear, stiffness=4e7),
            wd.Spring(f"bending {floor}", bending, stiffness=9e8),
        ]
    influence = {f"u{floor}": 1.0 for floor in range(3)}
    structure = wd.LumpedStructure(masses, springs, influence=influence, damping="modal", damping_ratio=0.05)
    found = storeys_of(replace(pattern_of(structure), damping=Table()))
    assert found.relative == (True, False)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_only_equal_storeys_are_taken_for_storeys(case):
    # Of the reference cases only the building of three storeys, and two equal oscillators, consist of equal storeys.
    found = storeys_of(pattern_of(case().structure))
    names = {"torsional_building": 3}
    if case.__name__ in names:
        assert found.count == names[case.__name__]
    elif found is not None:
        springs = [spring for row in found.springs for spring in row]
        assert sorted(springs) == list(range(len(springs)))


def test_gravity_needs_statements_for_each_degree_of_freedom():
    assert storeys_of(pattern_of(building(3, storey_height=3.0, gravity_load="weight"))) is None


@pytest.mark.parametrize(
    ("method", "step", "bound"), [("stoermer", 5e-4, 5e-5), ("leapfrog", 2.5e-4, 5e-5), ("rk4", 5e-4, 5e-5)]
)
def test_peaks_of_another_program(method, step, bound):
    # L02: event-exact solutions by Taylor series, which Newmark's method and OpenSees confirm.
    case: Case = torsional_building()
    recorders = ("displacement", "spring", "acceleration")  # of storeys: the kernel loops over them
    scene = wd.Scene(case.structure, case.motion, tail=case.tail, recorders=recorders)
    run = wd.simulate(scene, step=step, method=method, dtype="float64", device="cpu")
    for name, places in case.peaks.items():
        dim = run[name].dims[1]
        for place, due in places.items():
            assert run[name].sel({dim: place}).item() == pytest.approx(due, rel=bound), (name, place)


def shaken(storeys: int = 4, recorders: tuple[str, ...] = ("spring", "output", "residual")) -> wd.Scene:
    motions = [
        pair(pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5)),
        pair(pulse(6.0, 0.5, 0.4, 9.5), pulse(3.0, 0.7, 0.5, 9.5)),
    ]
    scatter = {
        "eccentricity_x": wd.RandomValue(wd.Uniform(-1.0, 1.0)),
        "stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
    }
    return wd.Scene(building(storeys), wd.Cloud(motions), scatter, recorders=recorders)


@pytest.mark.parametrize("method", ["rk4", "velocity_verlet", "stoermer", "leapfrog"])
def test_both_kernels_give_the_same_results(method, monkeypatch):
    # A consistency check of the two ways to write the same equations; L02 above compares one with another program.
    settings = {"structures": 5, "method": method, "step": 0.005, "dtype": "float64", "device": "cpu"}
    walked = wd.simulate(shaken(), **settings)
    monkeypatch.setattr(build, "divided_storeys", lambda plan: None)
    listed = wd.simulate(shaken(), **settings)
    for name in ("peak_spring_deformation", "peak_spring_force", "peak_output", "residual_deformation"):
        np.testing.assert_allclose(
            walked[name], listed[name], rtol=1e-9, atol=1e-12 * float(np.abs(listed[name]).max())
        )
    assert (walked["status"] == listed["status"]).all()


@ON_GPU
@pytest.mark.parametrize("method", ["rk4", "velocity_verlet", "stoermer", "leapfrog"])
@pytest.mark.parametrize("sections", [2, 4])
def test_threads_that_share_a_sample_give_the_results_of_a_processor(method, sections, monkeypatch):
    monkeypatch.setattr(build, "sections_of_storeys", lambda plan: sections)
    settings = {"structures": 5, "method": method, "step": 0.005, "dtype": "float64"}
    runs = [wd.simulate(shaken(), device=device, **settings) for device in ("cpu", "cuda:0")]
    for name in ("peak_spring_deformation", "peak_spring_force", "peak_output", "residual_deformation"):
        np.testing.assert_allclose(
            runs[1][name], runs[0][name], rtol=1e-9, atol=1e-12 * float(np.abs(runs[0][name]).max())
        )


@pytest.mark.parametrize("storeys", [2, 3, 5, 7, 10, 16, 20])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_threads_hold_whole_storeys(storeys, dtype):
    dynamics = LumpedDynamics(building(storeys), {})
    plan = Plan(
        "lumped", 3 * storeys, dynamics.law, dynamics.damping, "base_acceleration", ("spring",), "rk4", dtype,
        pattern=dynamics.pattern,
    )  # fmt: skip
    fitted = build.fitted(plan, True)
    assert storeys % fitted.sections == 0
    assert fitted.sections > 1
    for samples in (1, 31, 1000):
        threads = fitted.threads_of(samples)
        assert threads % 32 == 0
        assert threads // 32 * (32 // fitted.sections) >= samples
    for other in ({"recorders": ("energy",)}, {"collapses": True}, {"resumes": True}, {"load": "harmonic_force"}):
        assert division.divided_storeys(replace(plan, **other)) is None
        assert build.fitted(replace(plan, **other), True).sections == 1


def test_numbers_of_springs():
    listed = number_at([7, -3, 12])

    @wp.kernel(module="unique", enable_backward=False)
    def read(result: wp.array(dtype=wp.int32)):
        result[wp.tid()] = listed(wp.tid())

    result = wp.zeros(3, dtype=wp.int32, device="cpu")
    wp.launch(read, dim=3, inputs=[result], device="cpu")
    assert result.numpy().tolist() == [7, -3, 12]


@pytest.mark.parametrize("method", ["stoermer", "leapfrog"])
def test_a_step_is_too_long_if_the_damped_highest_mode_grows(method):
    # Growth of the highest mode by the printed formulas of the method, put into a polynomial (see test_growth).
    masses, stiffness, damping = np.array([1e5, 1e5]), np.array([[8e7, -4e7], [-4e7, 4e7]]), 0.004
    highest = np.sqrt(np.linalg.eigvalsh(stiffness / masses[0])[-1])
    zeta = damping * highest / 2

    def growth(x):
        if method == "stoermer":
            terms = x**2 * np.polymul([1, 0], [13 / 12, -1 / 6, 1 / 12])
            terms = np.polyadd(terms, 2 * zeta * x * np.polymul([1, -1], [23 / 12, -4 / 3, 5 / 12]))
            return np.abs(np.roots(np.polyadd(np.polymul([1, 0, 0], [1, -2, 1]), terms))).max()
        viscous = 2 * zeta * x * np.polymul([1, -1], [3 / 2, -1 / 2])
        terms = np.polyadd(x**2 * np.array([1, 0, 0]), viscous)
        return np.abs(np.roots(np.polyadd(np.polymul([1, 0], [1, -2, 1]), terms))).max()

    xs = np.linspace(0.5, 2.0, 4001)
    limit = xs[np.argmax([growth(x) > 1 + 1e-9 for x in xs])] / highest
    springs = [
        wd.Spring("1", {"1": 1.0}, stiffness=4e7, damping_coefficient=damping * 4e7),
        wd.Spring("2", {"1": -1.0, "2": 1.0}, stiffness=4e7, damping_coefficient=damping * 4e7),
    ]
    structure = wd.LumpedStructure({"1": 1e5, "2": 1e5}, springs)
    dynamics = LumpedDynamics(structure, {})
    values = {name: value[None] for name, value in structure.nominal_values.items()}
    found = dynamics.vibration_of(values, METHODS[method]).stable_step[0]
    assert found == pytest.approx(limit, rel=1e-3)
    assert found < 2 / highest * (1 - 0.5 * zeta)  # damping shortens it


def test_energies_of_multistep_methods_balance():
    case = torsional_building()
    errors = []
    for step in (0.002, 0.001):
        scene = wd.Scene(case.structure, case.motion, recorders=("energy",))
        run = wd.simulate(scene, step=step, method="stoermer", dtype="float64", device="cpu")
        errors.append(abs(run["energy_balance_error"].item()))
    assert errors[0] < 2e-3
    assert errors[1] < 0.5 * errors[0]
