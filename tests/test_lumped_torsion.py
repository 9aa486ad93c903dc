"""Matrices of buildings that twist: reference cases, invariance, and refused arguments."""

from __future__ import annotations

import numpy as np
import pytest
from linear_response import peak, pulse, response
from scipy.linalg import eigh

from warpdyn.model.structures.lumped.torsion import TorsionalMatrices, torsional_matrices
from warpdyn.model.structures.modal import modal_damping_matrix

pytestmark = pytest.mark.fast
RIGHT = np.pi / 2


def frequencies(matrices: TorsionalMatrices, stiffness: np.ndarray) -> np.ndarray:
    return np.sqrt(eigh(matrices.stiffness(stiffness), matrices.mass, eigvals_only=True))


def rayleigh(omega: np.ndarray, first: int, second: int, ratio: float) -> tuple[float, float]:
    a1 = 2 * ratio / (omega[first] + omega[second])
    return omega[first] * omega[second] * a1, a1


def one_storey() -> tuple[TorsionalMatrices, np.ndarray]:
    """Return a deck on one frame across and two frames along, and the stiffnesses of the frames."""
    plan = [[-4.572, 4.572], [-3.048, 3.048]]
    frames = [(0.4572, 0.0, RIGHT), (0.0, 3.048, 0.0), (0.0, -3.048, 0.0)]
    return torsional_matrices([27215.5422], plan, frames), np.array([1094542.72, 583756.117, 583756.117])


def test_one_storey_has_the_reference_frequencies() -> None:
    matrices, stiffness = one_storey()
    assert matrices.mass[2, 2] == pytest.approx(273910.716, rel=2e-9)
    assert frequencies(matrices, stiffness) == pytest.approx([5.876126, 6.549712, 6.791378], rel=1e-7)


def test_one_storey_has_the_reference_response() -> None:
    matrices, k = one_storey()
    stiffness = matrices.stiffness(k)
    damping = modal_damping_matrix(np.diag(matrices.mass), stiffness, 0.05)
    motion = pulse(3.0, 1.0, 0.5, 10.0)
    found = response(matrices.mass, damping, stiffness, matrices.mass @ matrices.influence[:, 1], motion)
    time, u, v = found["time"], found["u"], found["v"]
    assert peak(time, u[:, 1], v[:, 1]) == pytest.approx((0.1832691, 1.9901), rel=4e-5)
    assert peak(time, u[:, 1], v[:, 1])[0] == pytest.approx(0.1832691, rel=3e-7)
    assert peak(time, u[:, 2], v[:, 2])[0] == pytest.approx(0.04548127, rel=3e-7)
    deformations, rates = u @ matrices.directions[0].T, v @ matrices.directions[0].T
    assert peak(time, deformations[:, 0], rates[:, 0])[0] == pytest.approx(0.1802158, rel=3e-7)
    for frame in (1, 2):
        assert peak(time, deformations[:, frame], rates[:, frame])[0] == pytest.approx(0.1386269, rel=4e-7)
    total = found["a"][:, 1] + found["ground"][:, 0]
    assert peak(time, total, np.gradient(total, time))[0] == pytest.approx(7.309982, rel=1e-6)
    assert np.abs(u[:, 0]).max() < 1e-15  # the eccentricity couples uy and theta only


FRAMES = [(0.0, 5.0, 0.0), (0.0, -5.0, 0.0), (-9.0, 0.0, RIGHT), (0.0, 0.0, RIGHT), (9.0, 0.0, RIGHT)]


def three_storeys() -> tuple[TorsionalMatrices, np.ndarray, np.ndarray]:
    """Return the matrices of three storeys, and stiffness and yield force of the frames, shape [storey, frame]."""
    matrices = torsional_matrices([150e3, 150e3, 120e3], [[-10.0, 10.0], [-6.0, 6.0]], FRAMES)
    factor = np.array([[1.0], [0.85], [0.65]])
    stiffness = factor * np.array([60e6, 40e6, 90e6, 30e6, 30e6])
    return matrices, stiffness, factor * np.array([900e3, 600e3, 1200e3, 400e3, 400e3])


def test_three_storeys_have_the_reference_frequencies() -> None:
    matrices, stiffness, _ = three_storeys()
    omega = frequencies(matrices, stiffness)
    expected = [11.30993, 12.27073, 20.34943, 28.77817, 31.22293, 41.31271, 44.82231, 51.77922, 74.33204]
    assert omega == pytest.approx(expected, rel=5e-7)
    assert rayleigh(omega, 0, 4, 0.05) == pytest.approx((0.830250214, 0.0023511235), rel=2e-9)


def bilinear_response(
    matrices: TorsionalMatrices,
    stiffness: np.ndarray,
    yield_force: np.ndarray,
    motion: np.ndarray,
    hardening: float,
    modes: tuple[int, int],
    duration: float,
    step: float = 1e-4,
) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements and spring forces by central differences, with kinematic hardening of the springs."""
    b = matrices.directions.reshape(-1, len(matrices.mass))
    k, fy = np.ravel(stiffness), np.ravel(yield_force)
    elastic = b.T @ (k[:, None] * b)
    a0, a1 = rayleigh(np.sqrt(eigh(elastic, matrices.mass, eigvals_only=True)), *modes, 0.05)
    damping = a0 * matrices.mass + a1 * elastic
    inverse = np.linalg.inv(matrices.mass / step**2 + damping / (2 * step))
    back = damping / (2 * step) - matrices.mass / step**2
    times = step * np.arange(round(duration / step) + 1)
    samples = 0.01 * np.arange(len(motion))
    ground = np.column_stack([np.interp(times, samples, each) for each in motion.T])
    load = -ground @ (matrices.mass @ matrices.influence).T
    u, before = np.zeros((2, len(matrices.mass)))
    plastic = np.zeros(len(k))
    displacements, forces = np.zeros((len(times), len(u))), np.zeros((len(times), len(k)))
    for i in range(len(times)):
        elastic_part = b @ u - plastic
        yielded = np.clip(elastic_part, -fy / k, fy / k)
        plastic += elastic_part - yielded
        force = hardening * k * (b @ u) + (1 - hardening) * k * yielded
        displacements[i], forces[i] = u, force
        after = inverse @ (load[i] - b.T @ force + 2 / step**2 * (matrices.mass @ u) + back @ before)
        before, u = u, after
    return displacements, forces


def largest(values: np.ndarray) -> float:
    return float(np.abs(values).max())


def test_three_yielding_storeys_have_the_reference_response() -> None:
    matrices, stiffness, yield_force = three_storeys()
    motion = np.column_stack([pulse(5.0, 0.9, 0.6), pulse(4.0, 0.6, 0.5)])
    u, forces = bilinear_response(matrices, stiffness, yield_force, motion, 0.05, (0, 4), 8.0)
    peaks = [largest(u[:, dof]) for dof in (6, 7, 8)]
    assert peaks == pytest.approx([0.08927797, 0.04588134, 0.005485471], rel=2e-5)
    deformations = u @ matrices.directions[0].T
    found = [largest(deformations[:, frame]) for frame in (0, 2, 4)]
    assert found == pytest.approx([0.07317494, 0.01222826, 0.05619458], rel=2e-5)
    assert largest(forces[:, 4]) == pytest.approx(464291.9, rel=2e-5)
    assert largest(forces[:, 0] + forces[:, 1]) == pytest.approx(1737631, rel=2e-5)
    assert largest(forces[:, 2:5].sum(axis=1)) == pytest.approx(1723424, rel=2e-5)
    last = [0.00974664, -0.00127953, -0.000112164, 0.0170116, 0.001187, 0.000185108, 0.0159521, 0.000203238]
    assert u[-1] == pytest.approx([*last, 0.000126062], abs=3e-6)


def deck(at_corner: bool) -> tuple[TorsionalMatrices, np.ndarray, np.ndarray]:
    """Return one deck with coordinates from a corner, or from the centre of mass; with stiffness and yield force."""
    shift = np.array([0.0, 0.0]) if at_corner else np.array([10.0, 6.0])
    frames = [(5.0, 11.0, 0.0), (5.0, 1.0, 0.0), (1.0, 3.0, RIGHT), (19.0, 3.0, RIGHT)]
    moved = [(x - shift[0], y - shift[1], angle) for x, y, angle in frames]
    plan = np.array([[0.0, 20.0], [0.0, 12.0]]) - shift[:, None]
    matrices = torsional_matrices([150e3], plan, moved)
    return matrices, np.array([60e6, 40e6, 90e6, 30e6]), np.array([900e3, 600e3, 1200e3, 400e3])


def test_a_deck_has_the_same_response_for_any_reference_point() -> None:
    motion = np.column_stack([pulse(9.0, 0.35, 0.6), pulse(8.0, 0.3, 0.5)])
    at_corner, stiffness, yield_force = deck(True)
    m, inertia = 150e3, 150e3 * (20**2 + 12**2) / 12
    expected = [[m, 0, -6 * m], [0, m, 10 * m], [-6 * m, 10 * m, inertia + 136 * m]]
    assert at_corner.mass == pytest.approx(np.array(expected), rel=1e-14)
    omega = frequencies(at_corner, stiffness)
    assert omega == pytest.approx([23.51723, 25.98215, 45.11755], rel=3e-7)
    assert rayleigh(omega, 0, 2, 0.05) == pytest.approx((1.54592165, 0.0014569872), rel=3e-9)
    u, _ = bilinear_response(at_corner, stiffness, yield_force, motion, 0.05, (0, 2), 6.0)
    assert [largest(u[:, i]) for i in range(3)] == pytest.approx([0.04477649, 0.01004903, 0.002839879], rel=2e-5)
    centre = u @ np.array([[1, 0, -6], [0, 1, 10]]).T
    assert [largest(each) for each in centre.T] == pytest.approx([0.03248537, 0.02139396], rel=2e-5)
    assert largest(u @ at_corner.directions[0, 3]) == pytest.approx(0.04603151, rel=2e-5)
    at_centre, _, _ = deck(False)
    assert at_centre.mass == pytest.approx(np.diag([m, m, inertia]), abs=1e-9)
    other, _ = bilinear_response(at_centre, stiffness, yield_force, motion, 0.05, (0, 2), 6.0)
    assert other[:, :2] == pytest.approx(centre, abs=1e-10)
    assert other[:, 2] == pytest.approx(u[:, 2], abs=1e-11)


def test_frequencies_do_not_change_when_the_plan_is_turned_or_moved() -> None:
    matrices, stiffness, _ = three_storeys()
    omega = frequencies(matrices, stiffness)
    # A quarter turn: x becomes y, y becomes -x.
    turned = [(-y, x, angle + RIGHT) for x, y, angle in FRAMES]
    of_turned = torsional_matrices([150e3, 150e3, 120e3], [[-6.0, 6.0], [-10.0, 10.0]], turned)
    assert frequencies(of_turned, stiffness) == pytest.approx(omega, rel=1e-12)
    moved = [(x + 30.0, y - 20.0, angle) for x, y, angle in FRAMES]
    of_moved = torsional_matrices([150e3, 150e3, 120e3], [[20.0, 40.0], [-26.0, -14.0]], moved)
    assert frequencies(of_moved, stiffness) == pytest.approx(omega, rel=1e-9)


def test_a_symmetric_building_is_two_chains_and_a_twisting_one() -> None:
    frames = [(0.0, 5.0, 0.0), (0.0, -5.0, 0.0), (8.0, 0.0, RIGHT), (-8.0, 0.0, RIGHT)]
    matrices = torsional_matrices([1e5], [[-10.0, 10.0], [-6.0, 6.0]], frames)
    stiffness = matrices.stiffness([3e7, 3e7, 2e7, 2e7])
    assert stiffness == pytest.approx(np.diag([6e7, 4e7, 2 * 3e7 * 25 + 2 * 2e7 * 64]), abs=1e-6)
    # A rigid displacement of all floors deforms the first storey only.
    two = torsional_matrices([1e5, 2e5], [[-10.0, 10.0], [-6.0, 6.0]], frames)
    assert two.directions[1] @ two.influence == pytest.approx(np.zeros((4, 2)))
    assert two.influence.T @ two.mass @ two.influence == pytest.approx(np.diag([3e5, 3e5]))
    assert (two.directions[0] @ two.influence).tolist() == [[1, 0], [1, 0], [0, 1], [0, 1]]


def test_a_frame_at_an_angle_and_an_eccentric_mass() -> None:
    matrices = torsional_matrices(
        [1e5], [[-10.0, 10.0], [-6.0, 6.0]], [(3.0, 4.0, np.radians(30))], mass_centre=[1.0, -2.0], inertia=5e6
    )
    c, s = np.sqrt(3) / 2, 0.5
    assert matrices.directions[0, 0] == pytest.approx([c, s, 3 * s - 4 * c], rel=1e-14)
    expected = [[1e5, 0, 2e5], [0, 1e5, 1e5], [2e5, 1e5, 5e6 + 5e5]]
    assert matrices.mass == pytest.approx(np.array(expected), rel=1e-14)


PLAN = [[-10.0, 10.0], [-6.0, 6.0]]
ONE = [(0.0, 0.0, 0.0)]
WRONG = [
    (lambda: torsional_matrices([1e5], PLAN, [(0.0, 7.0, 0.0)]), r"frames\[0\] has y = 7 m, outside the plan"),
    (lambda: torsional_matrices([1e5], PLAN, ONE, mass_centre=[11.0, 0.0]), "mass_centre of floor 1 has x = 11 m"),
    (lambda: torsional_matrices([1e5], PLAN, [(0.0, 5.0, 90.0)]), r"is 90 rad; give radians: np.radians\(90\)"),
    (lambda: torsional_matrices([1e5], PLAN, [(0.0, 5.0)]), r"frames\[0\] must be x \[m\], y \[m\] and angle"),
    (lambda: torsional_matrices([1e5], PLAN, []), "frames is empty"),
    (lambda: torsional_matrices([1e5, 0.0], PLAN, ONE), "floor_mass of floor 2 is 0 kg; it must be above 0"),
    (lambda: torsional_matrices(1e5, PLAN, ONE), "floor_mass must be a list with one value per floor"),
    (lambda: torsional_matrices([1e5], [20.0, 12.0], ONE), r"plan must be \[\[x from, x to\]"),
    (lambda: torsional_matrices([1e5], PLAN, ONE, mass_centre=[[0, 0], [1, 1]]), "mass_centre must be x, y"),
    (lambda: torsional_matrices([1e5], PLAN, ONE, inertia=-1.0), "inertia must be above 0"),
    (lambda: torsional_matrices([1e5], PLAN, ONE).stiffness([1e7, 1e7]), r"frame_stiffness must have shape \(1,\)"),
]


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_invalid_arguments_are_refused(call, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
