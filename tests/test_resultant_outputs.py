"""Outputs that are resultants, and intensity measures of the larger component, against NumPy over whole histories."""

import numpy as np
import pytest

import warpdyn as wd

pytestmark = [pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")]
TIME = 0.01 * np.arange(500)
SETTINGS = {"device": "cpu", "step": 0.005}


def motion(period, size=3.0):
    return wd.GroundMotion(size * np.sin(2 * np.pi * TIME / period) * np.exp(-0.3 * TIME), 0.01, f"{period} s")


PAIR = wd.PairOfMotions(motion(0.4), motion(0.55, 2.0))
LAW = {"law": "bilinear", "hardening_ratio": 0.05}
FRAMES = [
    wd.PlanFrame("f", (0.0, -5.0), "x", 5e7, yield_force=3e5, **LAW),
    wd.PlanFrame("b", (0.0, 5.0), "x", 5e7, yield_force=3e5, **LAW),
    wd.PlanFrame("w", (-9.0, 0.0), "y", 9e7, yield_force=5e5, **LAW),
    wd.PlanFrame("g", (9.0, 0.0), "y", 3e7, yield_force=2e5, **LAW),
]
PLAN = [[-10.0, 10.0], [-6.0, 6.0]]


def building(**more):
    return wd.TorsionalBuilding([1.5e5, 1.2e5], PLAN, FRAMES, damping="rayleigh", damping_ratio=0.05, **more)


@pytest.mark.parametrize(("dtype", "error"), [("float64", 1e-12), ("float32", 1e-5)])
def test_corner_drifts_are_the_roots_of_sums_of_squares_over_the_history(dtype, error):
    structure = building(corner_drifts=True)
    run = wd.simulate(wd.Scene(structure, PAIR), histories=wd.Histories(), dtype=dtype, **SETTINGS)
    q = {str(dof): row for dof, row in zip(run["dof"].values, run["displacement"][0].values.T, strict=True)}
    q |= {f"{name}0": 0.0 for name in ("ux", "uy", "theta")}
    peaks = run["peak_output"].isel(sample=0)
    assert peaks.sizes["output"] == 2 * (4 + 4)
    for storey in (1, 2):
        for x in PLAN[0]:
            for y in PLAN[1]:
                turn = q[f"theta{storey}"] - q[f"theta{storey - 1}"]
                in_x = q[f"ux{storey}"] - q[f"ux{storey - 1}"] - y * turn
                in_y = q[f"uy{storey}"] - q[f"uy{storey - 1}"] + x * turn
                due = np.sqrt(in_x**2 + in_y**2).max()
                assert peaks.sel(output=f"{storey} at x={x:g}, y={y:g}").item() == pytest.approx(due, rel=error)
                assert peaks.sel(output=f"x{storey} at y={y:g}").item() == pytest.approx(np.abs(in_x).max(), rel=error)
                # The resultant is less than the SRSS of the two peaks, which occur at different times.
                assert due < 0.999 * np.hypot(np.abs(in_x).max(), np.abs(in_y).max())


def three_dofs(**more):
    springs = [wd.Spring(f"k{dof}", {dof: 1.0}, stiffness=5e7 * (1 + i)) for i, dof in enumerate("abc")]
    influence = [{"a": 1.0, "c": 0.6}, {"b": 1.0, "c": 0.8}]
    return wd.LumpedStructure(dict.fromkeys("abc", 2e5), springs, influence=influence, **more)


def test_resultants_of_three_rows_between_other_outputs():
    outputs = {
        "first": [{"a": 1.0}, {"b": 2.0}, {"c": -1.0, "a": 0.5}],
        "second": {"b": 1.0},
        "third": [{"c": 1.0}, {"b": 1.0}],
        "fourth": [{"c": 1.0}],
    }
    structure = three_dofs(outputs=outputs)
    run = wd.simulate(wd.Scene(structure, PAIR), histories=wd.Histories(), dtype="float64", **SETTINGS)
    a, b, c = run["displacement"][0].values.T
    due = [
        np.sqrt(a**2 + 4 * b**2 + (0.5 * a - c) ** 2).max(),
        np.abs(b).max(),
        np.hypot(b, c).max(),
        np.abs(c).max(),
    ]
    np.testing.assert_allclose(run["peak_output"][0], due, rtol=1e-12)
    assert run["output"].values.tolist() == list(outputs)
    again = wd.simulate(wd.Scene.from_json(run.attrs["scene"], [PAIR]), dtype="float64", **SETTINGS)
    np.testing.assert_array_equal(again["peak_output"], run["peak_output"])
    equipped = wd.with_equipment(structure, "a", 1e-3, period=0.2, damping_ratio=0.05)
    with_more = wd.simulate(wd.Scene(equipped, PAIR), dtype="float64", **SETTINGS)
    np.testing.assert_allclose(with_more["peak_output"][0], due, rtol=1e-6)


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        ({"r": []}, "output 'r' is an empty list"),
        ({"r": [{"a": 1.0}, {"z": 1.0}]}, "output 'r' names the unknown degree of freedom 'z'"),
        ({"r": [{"a": 1.0}, {"b": 0.0}]}, "output 'r' depends on no degree of freedom"),
        ({"r": [{"a": 1.0}, 3.0]}, "output 'r' must be a dictionary"),
    ],
)
def test_wrong_resultants_are_refused(outputs, message):
    with pytest.raises((ValueError, TypeError), match=message):
        three_dofs(outputs=outputs)
    with pytest.raises((TypeError, ValueError), match="corner_drifts"):
        building(corner_drifts="yes")


def test_histories_of_a_structure_that_collapses_end_there():
    frames = [wd.PlanFrame(f.name, f.position, f.direction, f.stiffness, law="bilinear", yield_force=1e5,
                           hardening_ratio=0.02, deformation_capacity=0.02) for f in FRAMES]  # fmt: skip
    weak = wd.TorsionalBuilding([1.5e5, 1.2e5], PLAN, frames, damping="rayleigh", damping_ratio=0.05)
    run = wd.simulate(wd.Scene(weak, PAIR), histories=wd.Histories(), **SETTINGS)
    assert run["status"].item() == 1
    spring, end = run["spring_of_collapse"].item(), run["time_of_collapse"].item()
    history = run["spring_deformation"][0, :, spring]
    known = history.dropna("time")
    assert 0 < end <= known["time"].max() < end + 0.0051
    assert abs(known[-1]) > 0.02 > np.abs(known[:-1]).max()


@pytest.mark.parametrize("method", ["rk4", "heun", "dormand_prince5", "velocity_verlet", "stoermer"])
@pytest.mark.parametrize("corner_drifts", [False, True])
def test_peaks_of_outputs_are_those_of_accepted_states_with_every_kind_of_method(method, corner_drifts):
    """Kernels without resultants loop over equal storeys; multistep methods have no stages."""
    structure = building(corner_drifts=corner_drifts)
    scene = wd.Scene(structure, PAIR, recorders=("output",))
    run = wd.simulate(scene, histories=wd.Histories(), method=method, dtype="float64", **SETTINGS)
    q = run["displacement"][0].transpose("time", "dof").values
    outputs = {name: [[row.get(dof, 0.0) for dof in structure.dof_names] for row in rows] for name, rows in
               structure.outputs.items()}  # fmt: skip
    due = [np.linalg.norm(q @ np.array(rows).T, axis=1).max() for rows in outputs.values()]
    np.testing.assert_allclose(run["peak_output"][0], due, rtol=1e-10)
