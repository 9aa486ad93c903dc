"""Fish-bone frames with bilinear hinges against a separate C++ program."""

from __future__ import annotations

import numpy as np
import pytest

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given(
    "no_damping", "damping_ratio", "first_period", "strongest_motion", "peak_ground_acceleration"
)

# Peak drifts [m] of storeys 1, 5 and 10 of three frames with bilinear hinges, rigid connections of columns and a base
# hinge, from a separate C++ program (central difference at 0.000625 s, float64; Newton's method to 1e-7 of a yield
# moment). OpenSeesPy agrees with its results at 0.00125 s within 0.1 %.
FRAMES_OF_PROGRAM = (
    (0.01940357, 0.03275566, 0.03119794),
    (0.02918518, 0.1059695, 0.08971011),
    (0.02526341, 0.04866628, 0.07215459),
)


def uniform(sample: int, entry: int) -> float:
    """Return the uniform number in [-1, 1) of that program."""
    word = 2**32
    x = (sample * 0x9E3779B9 % word) ^ ((entry + 1) * 0x85EBCA6B % word)
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
        x = (x ^ (x >> shift)) * factor % word
    return ((x ^ (x >> 16)) >> 8) * (2.0 / 16777216.0) - 1.0


def frame_of_program(sample: int) -> tuple[wd.HingedFishbone, float]:
    """Return a frame of that program, and the factor on its motion.

    Its rotational springs at floors are bilinear (stiffness k, hardening ratio b). Here a half-beam of stiffness 4 k in
    series with a hinge of 4 k / 3 has the stiffness k; the hinge's hardening ratio follows from b k in series, too.
    """
    height, modulus = 3.5, 2e11
    nodes, members, sections, supports = {"J0": (0.0, 0.0)}, {}, {}, {"J0": "fixed"}
    diaphragms, masses, hinges = {}, {}, {}
    for storey in range(1, 11):
        bending = 6.5e8 * (1 - 0.05 * (storey - 1)) * np.exp(0.2 * uniform(sample, 100 + storey - 1))
        stiffness = 4.86e8 * (1 - 0.03 * (storey - 1)) * np.exp(0.2 * uniform(sample, 200 + storey))
        strength = 4e6 * (1 - storey * storey / 121.0) * np.exp(0.25 * uniform(sample, 300 + storey))
        mass = 1.2e5 * np.exp(0.1 * uniform(sample, storey - 1))
        joint, far, line = f"J{storey}", f"R{storey}", f"L{storey}"
        nodes |= {joint: (0.0, height * storey), far: (3.0, height * storey)}
        nodes[line] = {"x": 6.0, "y": height * storey, "gravity_load": 9.81 * mass}
        nodes.setdefault("L0", (6.0, 0.0))
        supports |= {joint: "roller", far: "roller", "L0": "pinned"}
        sections[f"C{storey}"] = {"elastic_modulus": modulus, "area": 1.0, "second_moment": bending / modulus}
        beam = 4 * stiffness
        sections[f"B{storey}"] = {"elastic_modulus": modulus, "area": 1.0, "second_moment": beam * 3.0 / (3 * modulus)}
        column = {"start": f"J{storey - 1}", "end": joint, "section": f"C{storey}"}
        if storey == 1:
            column["spring_start"] = 60 * bending / height
            base = 4e6 * np.exp(0.25 * uniform(sample, 300))
            hinges["C1", "start"] = {"law": "bilinear", "yield_force": base, "hardening_ratio": 0.002}
        hinge = stiffness * beam / (beam - stiffness)
        yielding = 0.02 * stiffness * beam / (beam - 0.02 * stiffness)
        hinges[f"B{storey}", "start"] = {
            "law": "bilinear",
            "yield_force": strength,
            "hardening_ratio": yielding / hinge,
        }
        members[f"C{storey}"] = column
        members[f"B{storey}"] = {"start": joint, "end": far, "section": f"B{storey}", "spring_start": hinge}
        members[f"L{storey}"] = {"start": f"L{storey - 1}", "end": line, "section": "leaning", "kind": "truss"}
        diaphragms[f"floor {storey}"], masses[f"floor {storey}"] = [joint, far, line], mass
    sections["leaning"] = {"elastic_modulus": modulus, "area": 1.0}
    frame = wd.Frame(nodes, members, sections, supports=supports, diaphragms=diaphragms, masses=masses)
    damping = 0.2356 * np.diag(list(masses.values()))
    structure = wd.HingedFishbone(frame, hinges, damping_matrix=damping)
    return structure, float(np.exp(0.6 * uniform(sample, 400)))


def motion_of_program(factor: float) -> wd.GroundMotion:
    time = 0.000625 * np.arange(16000)
    waves = sum(
        np.sin(2 * np.pi * f * time + k * k) for k, f in enumerate((0.5, 0.8, 1.2, 1.7, 2.3, 3.1, 4.3, 6.1), start=1)
    )
    values = 0.6 * np.minimum(1, time) * np.exp(-0.15 * np.maximum(0, time - 6)) * waves
    return wd.GroundMotion(factor * values, 0.000625, "motion of the program")


@pytest.mark.parametrize("sample", range(3))
@pytest.mark.parametrize(("method", "dtype"), [("leapfrog", "float32"), ("rk4", "float64")])
def test_bilinear_hinges_equal_those_of_a_separate_program(sample, method, dtype):
    structure, factor = frame_of_program(sample)
    scene = wd.Scene(structure, wd.Cloud([motion_of_program(factor)]), recorders=("spring",))
    result = wd.simulate(scene, device="cpu", method=method, dtype=dtype)
    assert result["status"].values.tolist() == [0]
    found = result["peak_spring_deformation"].values[0, [0, 4, 9]]
    np.testing.assert_allclose(found, FRAMES_OF_PROGRAM[sample], rtol=1e-3)
