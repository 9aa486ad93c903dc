"""Problems on filters (data assimilation)."""

from __future__ import annotations

import numpy as np

import warpdyn as wd

from . import filters_truth as truth
from .problem import CLOSED, Outcome, Problem, Row


def unscented() -> Outcome:
    """`assimilate` with the unscented Kalman filter."""
    building = wd.ShearBuilding(truth.MASS, truth.STIFFNESS, 3.0, damping="storey", damping_coefficient=truth.DAMPING)
    scene = wd.Scene(building, wd.GroundMotion(truth.base_acceleration(), truth.STEP, "sine"))
    found = wd.assimilate(
        scene,
        wd.MeasuredResponse(truth.record(), truth.STEP, first=1),
        noise=truth.NOISE,
        method="unscented_kalman",
        velocity_noise=truth.PROCESS,
        initial_displacement=truth.PRIOR[0],
        initial_velocity=truth.PRIOR[1],
        members=50,
    )
    last = found.isel(time=-1)
    names = ("displacement", "velocity", "displacement_standard_deviation", "velocity_standard_deviation")
    values = np.concatenate([last[name].values for name in names])
    curve = found["time"].values, found["displacement"].values[:, 1]
    return Outcome([*values, float(last["log_evidence"])], {"posterior mean of the roof displacement": curve})


PROBLEMS = [
    Problem(
        "V78",
        "Kalman filter of a linear building",
        "Filters",
        CLOSED,
        "Kalman (1960), Journal of Basic Engineering 82; exact transition over a step by the matrix exponential.",
        "A building with two storeys is measured by an accelerometer on each floor. The unscented filter integrates 16 "
        "sigma points of displacements and velocities; for a linear building it must be the Kalman filter.",
        (
            ("masses", "200, 150", "t"),
            ("storey stiffnesses", "120, 90", "MN/m"),
            ("storey dashpots", "400, 300", "kN s/m"),
            ("motion", "3 sin(2 pi 1.5 t) exp(-0.3 t), 26 samples every 0.02 s", "m/s²"),
            ("noise of the sensors", "0.05", "m/s²"),
            ("process noise of each velocity per step", "0.002", "m/s"),
            ("prior deviations", "0.01 m, 0.1 m/s", ""),
            ("method", "rk4, at least 20 steps in the shortest period", ""),
        ),
        [
            *(Row(f"{name} of floor {floor}", unit) for name, unit in (("u", "m"), ("v", "m/s")) for floor in (1, 2)),
            *(
                Row(f"deviation of {name} of floor {floor}", unit)
                for name, unit in (("u", "m"), ("v", "m/s"))
                for floor in (1, 2)
            ),
            Row("log-likelihood of the record", "1"),
        ],
        ("chain", {"masses": 2, "motion": True}),
        truth.kalman,
        unscented,
        5e-5,
        "RK4 with 20 steps per period: its relative error is 2e-5 per period in the response of the second mode.",
        scale="value",
        axes={"posterior mean of the roof displacement": ("time [s]", "displacement [m]")},
    ),
]
