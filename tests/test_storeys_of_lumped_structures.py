"""Storey drift ratios and collapse of lumped structures, and portfolios of them, against SciPy and hand computation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.signal import lsim

import warpdyn as wd

pytestmark = [
    pytest.mark.meant_as_given(
        *("no_damping", "first_period", "strongest_motion", "collapse_drift_ratio", "drift_limit"),
        *(
            "random_factor",
            "random_value",
            "yield_base_shear_coefficient",
            "springs_yield_over_weight",
            "spring_deformation_capacity",
        ),
    )
]
STEP, STEPS = 0.002, 3000
MASS, HEIGHTS, EI, GA, DAMPING = 4e5, np.array([4.0, *[3.0] * 11]), 6e10, 5e8, 0.05
EXACT = {"dtype": "float64", "step": STEP, "device": "cpu"}


def noise(seed: int, strength: float = 2.0) -> wd.GroundMotion:
    random = np.random.default_rng(seed)
    times = np.arange(0, STEPS * STEP / 2, 0.02)
    values = np.concatenate([random.normal(size=times.size) * np.hanning(times.size) * strength, np.zeros(times.size)])
    fine = np.interp(np.arange(STEPS) * STEP, np.arange(values.size) * 0.02, values)
    return wd.GroundMotion(fine, STEP, name=f"noise {seed}")


MOTIONS = [noise(seed) for seed in range(3)]


def tower(**changed: object) -> wd.FlexuralShearBuilding:
    given = {"bending_stiffness": EI, "shear_stiffness": GA, "damping": "modal", "damping_ratio": DAMPING}
    return wd.FlexuralShearBuilding([MASS] * 12, HEIGHTS, **given | changed)


def stick(ei: float = EI, ga: float = GA) -> np.ndarray:
    """Return the condensed stiffness matrix of the stick, assembled here from beams and shear springs."""
    floors = HEIGHTS.size
    whole = np.zeros((2 * floors + 2, 2 * floors + 2))
    for storey, h in enumerate(HEIGHTS):
        beam = np.array(
            [
                [12, 6 * h, -12, 6 * h],
                [6 * h, 4 * h * h, -6 * h, 2 * h * h],
                [-12, -6 * h, 12, -6 * h],
                [6 * h, 2 * h * h, -6 * h, 4 * h * h],
            ]
        )
        here = np.arange(2 * storey, 2 * storey + 4)
        whole[np.ix_(here, here)] += ei / h**3 * beam
        whole[np.ix_(here[::2], here[::2])] += ga / h * np.array([[1, -1], [-1, 1]])
    free = whole[2:, 2:]
    moved, turned = slice(0, None, 2), slice(1, None, 2)
    return free[moved, moved] - free[moved, turned] @ np.linalg.solve(free[turned, turned], free[turned, moved])


def response(stiffness: np.ndarray, motion: wd.GroundMotion, ratio: float = DAMPING) -> np.ndarray:
    """Return the displacements of equal masses with modal damping by SciPy, [time, floor], exact at each sample."""
    squared, shapes = eigh(stiffness, MASS * np.eye(len(stiffness)))
    found = np.zeros((motion.values.size, len(stiffness)))
    times = np.arange(motion.values.size) * motion.step
    for omega, shape in zip(np.sqrt(squared), shapes.T, strict=True):
        mode = ([[0.0, 1.0], [-(omega**2), -2 * ratio * omega]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
        load = -(shape @ np.full(len(stiffness), MASS)) * motion.values
        found += np.outer(lsim(mode, load, times)[1], shape)
    return found


def drift_ratios(stiffness: np.ndarray, motion: wd.GroundMotion, ratio: float = DAMPING) -> np.ndarray:
    """Return the storey drift ratios by SciPy, shape [time, storey]."""
    return np.diff(response(stiffness, motion, ratio), axis=1, prepend=0.0) / HEIGHTS


def test_peak_drift_ratios_of_a_flexural_shear_building_are_those_of_scipy():
    scene = wd.Scene(tower(), wd.Cloud(MOTIONS), recorders=("drift",), tail=0.0)
    run = wd.simulate(scene, **EXACT)
    for sample, motion in enumerate(MOTIONS):
        peaks = np.abs(drift_ratios(stick(), motion)).max(axis=0)
        np.testing.assert_allclose(run["peak_storey_drift_ratio"][sample], peaks, rtol=2e-4)
        np.testing.assert_allclose(run["peak_storey_drift"][sample], peaks * HEIGHTS, rtol=2e-4)
        assert run["storey_of_peak_drift"][sample] == peaks.argmax() + 1
    assert run["storey"].values.tolist() == list(range(1, 13))
    assert "peak_spring_deformation" not in run
    again = wd.Scene.from_json(run.attrs["scene"], MOTIONS)
    assert again.structure.storeys == 12
    np.testing.assert_array_equal(
        wd.simulate(again, **EXACT)["peak_storey_drift_ratio"], run["peak_storey_drift_ratio"]
    )


@pytest.mark.parametrize("method", ["rk4", "velocity_verlet", "stoermer"])
def test_a_flexural_shear_building_collapses_at_the_drift_ratio(method):
    ratios = np.abs(drift_ratios(stick(), MOTIONS[0]))
    limit = 0.8 * float(ratios.max())
    first = int((ratios.max(axis=1) > limit).argmax())
    storey = int(ratios[first].argmax())
    before, after = ratios[first - 1, storey], ratios[first, storey]
    moment = (first - 1 + (limit - before) / (after - before)) * STEP
    scene = wd.Scene(tower(), MOTIONS[0], recorders=("drift",), collapse_drift_ratio=limit)
    run = wd.simulate(scene, **EXACT, method=method)
    assert run["status"].item() == 1
    assert run["storey_of_collapse"].item() == storey + 1
    assert run["spring_of_collapse"].item() == storey
    assert run["time_of_collapse"].item() == pytest.approx(moment, abs=STEP / 2)
    peaks = ratios[:first].max(axis=0)
    peaks[storey] = limit
    np.testing.assert_allclose(run["peak_storey_drift_ratio"][0], peaks, rtol=5e-3)
    assert run["peak_storey_drift_ratio"].values.max() == pytest.approx(limit, rel=1e-6)
    higher = wd.Scene(tower(), MOTIONS[0], recorders=("drift",), collapse_drift_ratio=1.1 * float(ratios.max()))
    assert wd.simulate(higher, **EXACT, method=method)["storey_of_collapse"].item() == -1


def test_the_smaller_of_both_capacities_decides():
    ratios = np.abs(drift_ratios(stick(), MOTIONS[0]))
    worst, limit = int(ratios.max(axis=0).argmax()), float(ratios.max())
    capacity = np.full(12, 10.0)
    capacity[worst] = 0.5 * limit * HEIGHTS[worst]  # m
    scene = wd.Scene(tower(deformation_capacity=capacity), MOTIONS[0], collapse_drift_ratio=0.9 * limit)
    run = wd.simulate(scene, **EXACT)
    assert run["storey_of_collapse"].item() == worst + 1
    assert run["peak_storey_drift_ratio"].values[0, worst] == pytest.approx(0.5 * limit, rel=1e-5)


def test_the_drift_of_a_torsional_storey_is_that_of_its_farthest_frame():
    # One storey; the frames in x at y = -5 and 7 m have the drifts u + 5 theta and u - 7 theta.
    frames = [
        wd.PlanFrame("a", (0.0, -5.0), "x", 6e7),
        wd.PlanFrame("b", (0.0, 7.0), "x", 2e7),
        wd.PlanFrame("c", (-8.0, 0.0), "y", 4e7),
        wd.PlanFrame("d", (8.0, 0.0), "y", 4e7),
    ]
    plan = [[-10.0, 10.0], [-8.0, 8.0]]
    mass, inertia, height = 2e5, 2e5 * (20**2 + 16**2) / 12, 3.5
    building = wd.TorsionalBuilding([mass], plan, frames, base_motion="x", storey_height=height, damping="none")
    run = wd.simulate(wd.Scene(building, MOTIONS[1], recorders=("drift",), tail=0.0), **EXACT)
    rows = np.array([[1.0, 0.0, 5.0], [1.0, 0.0, -7.0], [0.0, 1.0, -8.0], [0.0, 1.0, 8.0]])
    stiffness = rows.T @ (np.array([6e7, 2e7, 4e7, 4e7])[:, None] * rows)
    squared, shapes = eigh(stiffness, np.diag([mass, mass, inertia]))
    times, found = np.arange(STEPS) * STEP, np.zeros((STEPS, 3))
    for omega2, shape in zip(squared, shapes.T, strict=True):
        mode = ([[0.0, 1.0], [-omega2, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
        found += np.outer(lsim(mode, -shape[0] * mass * MOTIONS[1].values, times)[1], shape)
    expected = np.abs(found @ rows.T).max() / height
    assert run["peak_storey_drift_ratio"].item() == pytest.approx(expected, rel=2e-4)
    without = wd.TorsionalBuilding([mass], plan, frames, base_motion="x", damping="none")
    with pytest.raises(ValueError, match=r"recorder 'drift' needs storeys.*TorsionalBuilding with storey_height="):
        wd.Scene(without, MOTIONS[1], recorders=("drift",))


def yielding(storeys: int = 3) -> wd.ShearBuilding:
    return wd.ShearBuilding(
        *(1e5, [6e7, 5e7, 4e7][:storeys], [4.0, 3.0, 3.0][:storeys]),
        law="bilinear",
        yield_force=[6e5, 5e5, 3e5][:storeys],
        hardening_ratio=0.03,
        damping="rayleigh",
        damping_ratio=0.05,
    )


@pytest.mark.parametrize("limit", [None, 0.004])
def test_drift_ratios_and_collapses_of_a_chain_are_those_of_the_shear_building(limit):
    design = wd.Cloud([noise(seed, 4.0) for seed in range(6)])
    runs = [
        wd.simulate(wd.Scene(one, design, recorders=("drift",), collapse_drift_ratio=limit), **EXACT, method="rk4")
        for one in (yielding(), wd.lumped_chain(yielding()))
    ]
    for name in ("peak_storey_drift_ratio", "peak_storey_drift", "storey_of_peak_drift", "status"):
        np.testing.assert_allclose(runs[1][name], runs[0][name], rtol=1e-6, err_msg=name)
    if limit is not None:
        assert set(runs[0]["status"].values) == {0, 1}
        np.testing.assert_array_equal(runs[1]["storey_of_collapse"], runs[0]["storey_of_collapse"])
        np.testing.assert_allclose(runs[1]["time_of_collapse"], runs[0]["time_of_collapse"], rtol=1e-6)


@pytest.mark.parametrize("storeys", [1, 3])
def test_capacities_by_drift_ratio_are_those_of_the_shear_building(storeys):
    design = wd.Cloud(MOTIONS)
    found = [
        wd.capacities(
            wd.Scene(one, design, recorders=("drift",), collapse_drift_ratio=0.05),
            {"slight": 0.003, "complete": np.inf},
            **EXACT,
            method="rk4",
        )["capacity"]
        for one in (yielding(storeys), wd.lumped_chain(yielding(storeys)))
    ]
    np.testing.assert_allclose(found[1], found[0], rtol=0.02)  # the tolerance of the search is 1 %


def test_storeys_remain_on_a_flexible_foundation_without_its_rocking():
    springs = wd.FoundationSprings(1.8e9, 7.6e10, sway_dashpot=6.5e7, rocking_dashpot=2.1e8)
    on_soil = wd.structure_on_soil(tower(), springs, foundation_mass=5e5, rocking_inertia=2e7)
    run = wd.simulate(wd.Scene(on_soil, MOTIONS[2]), **EXACT, histories=wd.Histories([0], every=1))
    q = run["displacement"].isel(history=0)
    base, turned = q.sel(dof="sway").values, q.sel(dof="rocking").values
    floors = np.stack([q.sel(dof=f"u{floor}").values for floor in range(1, 13)], axis=1)
    relative = floors - base[:, None] - turned[:, None] * np.cumsum(HEIGHTS)
    expected = np.abs(np.diff(relative, axis=1, prepend=0.0)).max(axis=0) / HEIGHTS
    np.testing.assert_allclose(run["peak_storey_drift_ratio"][0], expected, rtol=1e-6)


def test_damage_and_losses_of_a_mixed_portfolio_are_those_of_scipy(tmp_path):
    ratios = (0.02, 0.08)  # damping of two towers
    stiff = wd.ShearBuilding(1e5, 8e7, 3.0, damping="modal", damping_ratio=0.05)
    given = {"damping_ratio": wd.GivenValues(list(ratios))}
    archetypes = {
        "low": wd.Archetype(stiff, 3),
        "tall": wd.Archetype(tower(force_outputs=False), scatter=given),
        "slender": wd.Archetype(tower(shear_stiffness=0.3 * GA)),
    }
    scene = wd.Scene(wd.Portfolio(archetypes), wd.Cloud(MOTIONS), recorders=("drift",), tail=0.0)
    run = wd.simulate(scene, **EXACT)
    towers = [np.abs(drift_ratios(stick(), motion, ratio)).max() for ratio in ratios for motion in MOTIONS]
    towers += [np.abs(drift_ratios(stick(ga=0.3 * GA), motion)).max() for motion in MOTIONS]
    largest = run["peak_storey_drift_ratio"].max("storey").values
    np.testing.assert_allclose(largest[9:], towers, rtol=2e-4)
    assert np.isnan(run["peak_storey_drift_ratio"][0, 1:]).all()
    assert run["storeys_of_archetype"].values.tolist() == [1, 12, 12]
    assert not {"spring", "dof"} & set(run.dims)
    one_dof = ([[0.0, 1.0], [-800.0, -0.1 * np.sqrt(800.0)]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    times = np.arange(STEPS) * STEP
    low = [np.abs(lsim(one_dof, -motion.values, times)[1]).max() / 3.0 for motion in MOTIONS]
    np.testing.assert_allclose(largest[:9], low * 3, rtol=2e-4)

    expected = np.array([*low * 3, *towers]).reshape(6, 3)  # [building, motion]
    bounds = [float(np.quantile(expected[3:], share)) for share in (0.3, 0.7)]
    limits = {name: {"slight": bounds[0], "complete": bounds[1]} for name in archetypes}
    asked = [
        wd.DamageCounts(limits, over="building"),
        wd.DamageLoss(limits, {"slight": 0.1, "complete": 1.0}, np.arange(1.0, 7.0), over="motion"),
    ]
    counted = wd.simulate(scene, **EXACT, statistics=asked)
    state = (expected[..., None] > bounds).sum(axis=-1)
    np.testing.assert_array_equal(
        counted["damage_count_by_building"], [[(row == each).sum() for each in range(3)] for row in state]
    )
    cost = np.array([0.0, 0.1, 1.0])[state] * np.arange(1.0, 7.0)[:, None]
    np.testing.assert_allclose(wd.event_losses(counted)["loss"], cost.sum(axis=0))
    shares = wd.damage_shares(run, limits)["damage_share"]
    np.testing.assert_allclose(shares, [[(row == each).mean() for each in range(3)] for row in state.T])

    stored = wd.simulate(scene, **EXACT, path=tmp_path / "run.nc")
    np.testing.assert_array_equal(stored["peak_storey_drift_ratio"], run["peak_storey_drift_ratio"])
    again = wd.simulate(wd.Scene.from_json(run.attrs["scene"], MOTIONS), **EXACT)
    np.testing.assert_array_equal(again["peak_storey_drift_ratio"], run["peak_storey_drift_ratio"])
    alone = wd.Scene(wd.Portfolio({"tall": archetypes["tall"]}), scene.excitation, recorders=("drift",), tail=0.0)
    np.testing.assert_array_equal(
        wd.simulate(alone, **EXACT)["peak_storey_drift_ratio"], run["peak_storey_drift_ratio"][9:15]
    )


def test_peaks_are_recorded_from_a_later_time_on_and_in_each_event():
    ratios = np.abs(drift_ratios(stick(), MOTIONS[0]))
    late = 1.3 * float(ratios.max(axis=1).argmax()) * STEP
    late = round(late / STEP) * STEP
    scene = wd.Scene(tower(), MOTIONS[0], recorders=("drift",), tail=0.0, record_from=late)
    peaks = ratios[round(late / STEP) :].max(axis=0)
    np.testing.assert_allclose(wd.simulate(scene, **EXACT)["peak_storey_drift_ratio"][0], peaks, rtol=5e-4)
    quiet = wd.GroundMotion(np.zeros(5000), STEP, name="quiet")
    sequence = wd.EventSequence({"first": MOTIONS[0], "second": quiet})
    run = wd.simulate(wd.Scene(tower(), sequence, recorders=("drift",), tail=0.0), **EXACT)
    found = run["peak_storey_drift_ratio"].isel(sample=0)
    np.testing.assert_allclose(found.sel(event="first"), ratios.max(axis=0), rtol=2e-4)
    assert (found.sel(event="second") < 0.5 * found.sel(event="first")).all()


def test_storeys_of_biaxial_springs_are_refused():
    law = wd.laws.CircularYield(yield_force=4e5, post_yield_stiffness=2e6)
    bearing = wd.BiaxialSpring("bearing", {"x": 1.0}, {"y": 1.0}, law=law, stiffness=4e7)
    for name in ("bearing", "bearing y"):
        with pytest.raises(
            ValueError, match=rf"spring '{name}' of storey 1 is biaxial.*outputs=.*deformation_capacity"
        ):
            wd.LumpedStructure({"x": 4e5, "y": 4e5}, [bearing], storey_height=0.5, storey_springs=[name])
    advised = {"drift 1": [{"x": 1 / 0.5}, {"y": 1 / 0.5}]}
    slab = wd.LumpedStructure({"x": 4e5, "y": 4e5}, [bearing], influence=[{"x": 1.0}, {"y": 1.0}], outputs=advised)
    pair = wd.PairOfMotions(noise(7, 6.0), noise(7, 5.0))
    scene = wd.Scene(slab, pair, recorders=("output", "displacement"))
    run = wd.simulate(scene, **EXACT, histories=wd.Histories([0]))
    resultant = np.hypot(*run["displacement"].values[0].T).max() / 0.5
    assert run["peak_output"].item() == pytest.approx(resultant, rel=1e-9)
    assert resultant > 1.01 * np.abs(run["displacement"].values[0]).max() / 0.5


def test_storeys_come_from_json():
    frames = [
        wd.PlanFrame("a", (0.0, -5.0), "x", [6e7, 5e7]),
        wd.PlanFrame("b", (0.0, 5.0), "x", [6e7, 5e7]),
        wd.PlanFrame("c", (0.0, 0.0), "y", 4e7),
    ]
    twisting = wd.TorsionalBuilding(
        [1e5, 1e5], [[-8.0, 8.0], [-6.0, 6.0]], frames, base_motion="x", storey_height=[4.0, 3.0]
    )
    again = wd.Scene.from_json(wd.Scene(twisting, MOTIONS[0]).to_json(), MOTIONS).structure
    assert again.storey_springs == twisting.storey_springs == ((0, 2, 4), (1, 3, 5))
    assert again.parameters["height"].tolist() == [4.0, 3.0]


def test_a_flat_list_of_the_frames_of_one_storey_is_refused():
    sides = {"south": ("x", -4.0), "west": ("y", -6.0), "north": ("x", 4.0), "east": ("y", 6.0)}
    springs = [wd.Spring(name, {axis: 1.0, "theta": arm}, stiffness=1e7) for name, (axis, arm) in sides.items()]
    given = {"mass": {"x": 1e5, "y": 1e5, "theta": 3e6}, "springs": springs, "influence": {"x": 1.0}}
    one = wd.LumpedStructure(**given, storey_height=3.0, storey_springs=[[*sides]])
    assert one.storeys == 1
    for flat in (["south", "north", "west", "east"], [*sides]):
        with pytest.raises(ValueError, match=r"connect the same degrees of freedom \('x', 'theta'\).* one storey"):
            wd.LumpedStructure(**given, storey_height=3.0, storey_springs=flat)


SPRINGS = [wd.Spring("k", {"x": 1.0}, stiffness=1e6), wd.Spring("turn", {"theta": 1.0}, stiffness=1e6)]


def deck(**changed: object) -> wd.LumpedStructure:
    return wd.LumpedStructure({"x": 1e3, "theta": 1e3}, SPRINGS, influence={"x": 1.0}, **changed)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"storey_height": 3.0}, "storey_springs is missing"),
        ({"storey_springs": ["k"]}, "storey_height is missing"),
        ({"storey_height": 3.0, "storey_springs": "k"}, "storey_springs must list the springs of each storey"),
        ({"storey_height": 3.0, "storey_springs": []}, "storey_springs must list the springs of each storey"),
        ({"storey_height": 3.0, "storey_springs": [[]]}, "storey 1 must have the name of a spring"),
        (
            {"storey_height": 3.0, "storey_springs": ["turns"]},
            "storey 1 names 'turns', but no spring.*did you mean 'turn'",
        ),
        ({"storey_height": 3.0, "storey_springs": ["turn"]}, "spring 'turn' of storey 1 is a rotation"),
        ({"storey_height": 3.0, "storey_springs": ["k", "k"]}, "'k' is given in storey 1 and in storey 2"),
        ({"storey_height": [3.0, 3.0], "storey_springs": ["k"]}, "storey_height must be one value or one per storey"),
        ({"storey_height": -3.0, "storey_springs": ["k"]}, "storey_height is -3 m; it must be above 0"),
    ],
)
def test_wrong_storeys_are_refused(changed, message):
    with pytest.raises((ValueError, TypeError), match=message):
        deck(**changed)


def test_portfolios_refuse_structures_without_storeys_and_other_recorders():
    with pytest.raises(ValueError, match="a LumpedStructure in a portfolio needs storeys"):
        wd.Archetype(deck())
    two = [{"x": 1.0}, {"theta": 0.1}]
    with pytest.raises(ValueError, match="2 components of base motion"):
        wd.Archetype(
            wd.LumpedStructure(
                {"x": 1e3, "theta": 1e3}, SPRINGS, influence=two, storey_height=3.0, storey_springs=["k"]
            )
        )
    with pytest.raises(ValueError, match=r"scatter\['height'\]: the storey heights .* cannot be random"):
        wd.Archetype(tower(), scatter={"height": wd.RandomFactor(wd.Lognormal(1.0, 0.1))})
    town = wd.Portfolio({"low": wd.Archetype(yielding()), "tall": wd.Archetype(tower())})
    with pytest.raises(ValueError, match=r"archetype 'tall': .* records storey drifts only.*recorders=\('drift',\)"):
        wd.simulate(wd.Scene(town, wd.Cloud(MOTIONS)), device="cpu")
    with pytest.raises(ValueError, match="collapse_drift_ratio needs storeys"):
        wd.Scene(deck(), MOTIONS[0], collapse_drift_ratio=0.1)
    wrong = {"mass": wd.RandomValue(wd.Normal(-1.0, 1e-3))}
    bad = wd.Portfolio({"tall": wd.Archetype(tower(), 2, wrong)})
    with pytest.raises(ValueError, match="archetype 'tall': the drawn mass is -"):
        wd.simulate(wd.Scene(bad, wd.Cloud(MOTIONS), recorders=("drift",)), device="cpu")
