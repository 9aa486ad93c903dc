"""Reference cases of lumped structures: dampers, equipment, and geometric stiffness; see lumped_cases.py."""

from __future__ import annotations

import numpy as np
from lumped_case import Case, pair, pulse

import warpdyn as wd


def inerter() -> Case:
    """L16: a tuned mass damper with an inerter to the ground, which is in the mass matrix, but not in the load."""
    m, mu, beta = 1000e3, 0.02, 0.1
    stiffness = m * np.pi**2
    springs = [
        wd.Spring(
            "structure", {"structure": 1.0}, stiffness=stiffness, damping_coefficient=2 * 0.02 * np.sqrt(stiffness * m)
        ),
        wd.Spring(
            "absorber",
            {"absorber": 1.0, "structure": -1.0},
            stiffness=980073.636,
            damping_coefficient=113864.491,
        ),
    ]
    structure = wd.LumpedStructure(
        {"structure": m, "absorber": mu * m}, springs, mass_matrix=np.diag([0.0, beta * m]), load_mass=[m, mu * m]
    )
    time = 0.01 * np.arange(2001)
    motion = wd.GroundMotion(np.sin(np.pi * time) * np.exp(-0.1 * time), 0.01)
    peaks = {
        "peak_displacement": {"structure": 0.2707331, "absorber": 0.6747053},
        "peak_spring_deformation": {"absorber": 0.702425},
        "peak_acceleration": {"structure": 2.676774},
    }
    return Case(structure, motion, peaks, tail=10.0)


def under_gravity(has_gravity: bool) -> Case:
    """L17: four storeys in two directions, with and without geometric stiffness."""
    names = [f"{axis}{floor}" for axis in "xy" for floor in (1, 2, 3, 4)]
    stiffness = {"x": (40e6, 36e6, 30e6, 22e6), "y": (30e6, 26e6, 20e6, 14e6)}
    loads = (7845320.0, 5883990.0, 3922660.0, 1961330.0)
    springs, elastic, geometric = [], np.zeros((8, 8)), np.zeros((8, 8))
    for axis in "xy":
        for storey in range(4):
            direction = {f"{axis}{storey + 1}": 1.0} | ({f"{axis}{storey}": -1.0} if storey else {})
            springs.append(wd.Spring(f"{axis}{storey + 1}", direction, stiffness=stiffness[axis][storey]))
            row = np.array([direction.get(name, 0.0) for name in names])
            elastic += stiffness[axis][storey] * np.outer(row, row)
            geometric += loads[storey] / 3.5 * np.outer(row, row)
    building = wd.LumpedStructure(
        dict.fromkeys(names, 200e3),
        springs,
        influence=[{name: 1.0 for name in names if name[0] == axis} for axis in "xy"],
        damping_matrix=0.332081581 * 200e3 * np.eye(8) + 0.00602235802 * elastic,
        geometric_stiffness=geometric if has_gravity else None,
    )
    both = pair(pulse(3.0, 1.4, 0.3, 12.0), pulse(2.5, 1.8, 0.3, 12.0))
    if has_gravity:
        values, periods = (0.6025265, 0.6063173, 6826340.0, 4838696.0), (1.680147, 1.401823, 0.6540418, 0.5329355)
    else:
        values, periods = (0.5852287, 0.5641508, 6563455.0, 4448684.0), (1.626036, 1.369144, 0.6363156, 0.5229164)
    peaks = {
        "peak_displacement": {"x4": values[0], "y4": values[1]},
        "peak_spring_force": {"x1": values[2], "y1": values[3]},
    }
    return Case(building, both, peaks, periods=periods)


def with_p_delta() -> Case:
    return under_gravity(True)


def without_p_delta() -> Case:
    return under_gravity(False)


def equipment(share: float, values: tuple[float, ...]) -> Case:
    """L18: equipment on the second floor, tuned to the first mode of a building with modal damping."""
    mass, stiffness = 100e3, 50e6
    bare = np.array([[2.0, -1.0], [-1.0, 1.0]]) * stiffness
    squared, shape = np.linalg.eigh(bare / mass)
    damping = np.zeros((3, 3))
    damping[:2, :2] = mass * shape @ np.diag(2 * 0.05 * np.sqrt(squared)) @ shape.T
    light, omega = share * mass, np.sqrt(squared[0])
    springs = [
        wd.Spring("1", {"1": 1.0}, stiffness=stiffness),
        wd.Spring("2", {"2": 1.0, "1": -1.0}, stiffness=stiffness),
        wd.Spring(
            "equipment",
            {"equipment": 1.0, "2": -1.0},
            stiffness=light * omega**2,
            damping_coefficient=2 * 0.01 * light * omega,
        ),
    ]
    building = wd.LumpedStructure({"1": mass, "2": mass, "equipment": light}, springs, damping_matrix=damping)
    peaks = {
        "peak_displacement": {"2": values[0]},
        "peak_acceleration": {"2": values[1], "equipment": values[2]},
        "peak_spring_deformation": {"equipment": values[3]},
    }
    return Case(building, pulse(2.0, 0.5, 0.4, 12.0), peaks)


def light_equipment() -> Case:
    return equipment(0.001, (0.04878774, 9.179218, 99.86774, 0.5228149))


def heavier_equipment() -> Case:
    return equipment(0.01, (0.04555644, 8.434299, 81.55977, 0.4269732))
