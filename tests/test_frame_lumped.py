"""Histories and ensembles of reduced frames: linear response, random sections, drifts and member forces."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from frame_cases import braced, eight_storey, fishbone, four_storey, portal, two_storey
from linear_response import peak, response
from lumped_cases import pulse

import warpdyn as wd

pytestmark = pytest.mark.meant_as_given("no_damping", "damping_ratio", "first_period", "strongest_motion")
SETTINGS = {"dtype": "float64", "device": "cpu", "method": "rk4"}
FORCES = ("drift", "base_shear", "member_force")


def pulse_of_reference(amplitude: float, period: float, decay: float) -> wd.GroundMotion:
    time = 0.01 * np.arange(1001)
    return wd.GroundMotion(amplitude * np.sin(2 * np.pi * time / period) * np.exp(-decay * time), 0.01, "pulse")


def with_rayleigh(frame: wd.Frame, a0: float, a1: float, **more) -> wd.LumpedStructure:
    """Return the reduced frame with P-Delta and C = a0 M + a1 K, K without P-Delta."""
    plain = frame.lumped()
    one = {name: each[None] for name, each in plain.parameters.items()}
    damping = a0 * plain.mass_matrices(one)[0] + a1 * plain.stiffness_matrices(one)[0]
    return frame.lumped(p_delta=True, damping_matrix=damping, **more)


# Elastic histories of the reference set (RK4 with Newton's method; OpenSeesPy differs by 1e-5): model, pulse
# (amplitude, period, decay), storey drift ratios, floor accelerations [m/s2], and an output with its peak [N] or [N m].
HISTORIES = {
    "portal, pulse 1": (portal, (1.0, 0.8, 0.4), (0.005514826,), (2.445448,), ("C1_1 moment start", 200060.2)),
    "portal, pulse 2": (portal, (1.5, 2.0, 0.35), (0.004028469,), (1.782325,), ("C1_1 moment start", 146139.9)),
    "two storeys, pulse 1": (
        two_storey,
        (0.3, 0.8, 0.4),
        (0.003655348, 0.003969304),
        (0.9388362, 1.784754),
        ("C1_1 moment start", 1061917.0),
    ),
    "two storeys, pulse 2": (
        two_storey,
        (1.0, 2.0, 0.35),
        (0.003521576, 0.003571964),
        (1.209197, 1.496375),
        ("C1_1 moment start", 1039736.0),
    ),
    "braced, pulse 1": (
        braced,
        (0.3, 0.8, 0.4),
        (0.002476024, 0.002554989, 0.002504061),
        (0.7047645, 1.357339, 1.98305),
        ("D1 axial", 1031082.0),
    ),
    "four storeys, pulse 2": (
        four_storey,
        (0.5, 2.0, 0.35),
        (0.002956537, 0.004315571, 0.004318431, 0.003745216),
        (0.4880238, 0.7507992, 0.9975142, 1.246686),
        None,  # gravity bends the inner columns in the reference
    ),
    "eight storeys, pulse 2": (
        eight_storey,
        (0.5, 2.0, 0.35),
        (0.004737367, 0.006942548, 0.00749763, 0.00750829, 0.00773984, 0.0071916, 0.007743201, 0.006380692),
        (0.4293888, 0.4356052, 0.6068791, 0.8475794, 1.081772, 1.292486, 1.54054, 1.769897),
        None,
    ),
    "fish-bone, pulse 2": (
        fishbone,
        (0.5, 2.0, 0.35),
        (
            *(0.00421408, 0.006063322, 0.006141363, 0.005914381, 0.006119808),
            *(0.005817425, 0.005071249, 0.004746294, 0.003717862, 0.002211465),
        ),
        (0.4264223, 0.4289108, 0.6394287, 0.8459622, 1.062978, 1.272249, 1.45738, 1.633844, 1.774917, 1.860286),
        ("B2 moment start", 1942582.0),
    ),
}
COEFFICIENTS = {  # a0 [1/s] and a1 [s]
    portal: (0.53126396, 0.0047057587),
    two_storey: (0.24275322, 0.0010723528),
    four_storey: (0.16159482, 0.0011970561),
    eight_storey: (0.093807135, 0.0024288369),
    braced: (0.26679765, 0.00093328278),
    fishbone: (0.16120573, 0.0031166502),
}


@pytest.mark.parametrize("name", HISTORIES)
def test_elastic_histories_are_those_of_the_nonlinear_reference_programs(name):
    make, pulse_values, drifts, accelerations, force = HISTORIES[name]
    frame = make()
    members = [force[0].split()[0]] if force else []
    outputs = FORCES if force else ("drift",)
    structure = with_rayleigh(frame, *COEFFICIENTS[make], outputs=outputs, members=members)
    run = wd.simulate(wd.Scene(structure, pulse_of_reference(*pulse_values), tail=10.0), step=0.001, **SETTINGS)
    names = [f"drift {storey + 1}" for storey in range(len(drifts))]
    np.testing.assert_allclose(run["peak_output"].sel(output=names)[0], drifts, rtol=2e-5)
    np.testing.assert_allclose(run["peak_acceleration"][0], accelerations, rtol=2e-5)
    if force:
        assert run["peak_output"].sel(output=force[0]).item() == pytest.approx(force[1], rel=2e-5)
    heights = [height for _, _, height in frame.storey_drifts.values()]
    deformation = run["peak_spring_deformation"][0] / heights
    np.testing.assert_allclose(deformation, run["peak_output"].sel(output=names)[0], rtol=1e-12)


def test_random_sections_are_those_of_frames_with_these_sections():
    frame = two_storey()
    random = np.random.default_rng(3)
    shape = (3, len(frame.members))
    given = {
        "second_moment": frame.nominal.inertia * random.uniform(0.7, 1.3, shape),
        "area": frame.nominal.area * random.uniform(0.7, 1.3, shape),
        "elastic_modulus": frame.nominal.modulus * random.uniform(0.8, 1.2, shape),
        "mass": np.array([2.4e5, 2.3e5]) * random.uniform(0.8, 1.2, (3, 2)),
    }
    scatter = {name: wd.GivenValues(values) for name, values in given.items()}
    motion = pulse(1.0, 0.7, 0.4)
    options = {"p_delta": True, "outputs": FORCES, "damping": "rayleigh", "damping_ratio": 0.03}
    run = wd.simulate(wd.Scene(frame.lumped(**options), motion, scatter), step=0.01, **SETTINGS)
    described = frame.description()
    for sample in range(3):
        sections = {}
        members = {}
        for place, (name, row) in enumerate(frame.members.items()):
            sections[name] = {
                "elastic_modulus": given["elastic_modulus"][sample, place],
                "area": given["area"][sample, place],
                "second_moment": given["second_moment"][sample, place],
            }
            members[name] = described["members"][name] | {"section": name}
            assert row["section"] in frame.sections
        masses = {f"floor {floor + 1}": given["mass"][sample, floor] for floor in range(2)}
        other = wd.Frame(**(described | {"sections": sections, "members": members, "masses": masses}))
        # The axial forces under gravity are those of the nominal frame in all samples.
        assert np.abs(other.gravity - frame.gravity).max() < 2e-3 * np.abs(frame.gravity).max()
        vars(other)["gravity"] = frame.gravity
        due = wd.simulate(wd.Scene(other.lumped(**options), motion), step=0.01, **SETTINGS)
        names = due["output"].values
        np.testing.assert_allclose(run["peak_output"].sel(output=names)[sample], due["peak_output"][0], rtol=1e-8)
        np.testing.assert_allclose(run["peak_acceleration"][sample], due["peak_acceleration"][0], rtol=1e-8)
    assert run["second_moment"].dims == ("sample", "member")
    assert run["member"].values.tolist() == list(frame.members)


@pytest.mark.parametrize("reduction", ["guyan", "craig_bampton"])
def test_random_sections_of_reduced_frames_and_their_load(reduction):
    nodes = {"A": (0, 0), "B": (0, 4), "C": (6, 4), "D": (6, 0), "E": (0, 8), "F": (6, 8)}
    members = {"1": ("A", "B", "c"), "2": ("D", "C", "c"), "3": ("B", "C", "b")}
    members |= {"4": ("B", "E", "c"), "5": ("C", "F", "c"), "6": ("E", "F", "b")}
    sections = {
        "c": {"elastic_modulus": 2e11, "area": 0.012, "second_moment": 1.5e-4, "mass_per_length": 5000.0},
        "b": {"elastic_modulus": 2e11, "area": 0.009, "second_moment": 2.5e-4, "mass_per_length": 9000.0},
    }
    frame = wd.Frame(nodes, members, sections, supports={"A": "fixed", "D": "fixed"}, member_mass="consistent")
    options = {"reduction": reduction, "modes": 2 if reduction == "craig_bampton" else 0, "damping": "modal"}
    structure = frame.lumped(["B ux", "E ux"], damping_ratio=0.02, outputs=("member_force",), **options)
    motion = pulse(1.0, 0.7, 0.4)
    scatter = {
        "second_moment": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="member"),
        "mass": wd.RandomFactor(wd.Lognormal(1.0, 0.2)),
    }
    run = wd.simulate(wd.Scene(structure, motion, scatter), structures=2, seed=1, step=0.001, **SETTINGS)
    assert len(np.unique(run["second_moment"])) == 12
    for sample in range(2):
        one = {name: each[None] for name, each in structure.parameters.items()}
        one |= {"second_moment": run["second_moment"].values[sample : sample + 1]}
        one |= {"mass": run["mass"].values[sample : sample + 1]}
        mass, stiffness = structure.mass_matrices(one)[0], structure.stiffness_matrices(one)[0]
        damping = structure.damping_matrices(one, np.zeros((2, 1)))[0]
        load = structure.load_masses(one)[0] @ structure.influence
        found = response(mass, damping, stiffness, load, motion.acceleration)
        for dof in (0, 1):
            due = peak(found["time"], found["u"][:, dof], found["v"][:, dof])[0]
            assert run["peak_displacement"].values[sample, dof] == pytest.approx(due, rel=1e-5)
        row = structure.output_matrices(one)[0][list(structure.outputs).index("1 moment start")]
        due = peak(found["time"], found["u"] @ row, found["v"] @ row)[0]
        assert run["peak_output"].sel(output="1 moment start")[sample].item() == pytest.approx(due, rel=1e-5)


def test_scatter_of_the_members_of_one_section_and_units_of_outputs():
    frame = two_storey()
    structure = frame.lumped(damping="modal", damping_ratio=0.02, outputs=FORCES)
    factor = wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="member", only=("B1_1", "C2_1"))
    run = wd.simulate(wd.Scene(structure, pulse(1.0, 0.7, 0.4), {"area": factor}), structures=3, seed=1, device="cpu")
    varied = (run["area"].max("sample") > run["area"].min("sample")).to_series()
    assert {*varied.index[varied]} == {"C2_1", "B1_1"}
    units = dict(zip(run["output"].values, run["output_unit"].values, strict=True))
    assert (units["drift 2"], units["base shear"], units["B1_1 moment end"], units["C2_1 axial"]) == (
        "1",
        "N",
        "N m",
        "N",
    )
    with pytest.raises(ValueError, match="neither a member nor a section"):
        wd.Scene(structure, pulse(1.0, 0.7, 0.4), {"area": wd.RandomFactor(wd.Lognormal(1.0, 0.2), only=("B9",))})


def test_fragility_and_collapse_of_random_frames():
    frame = two_storey()
    structure = frame.lumped(p_delta=True, damping="modal", damping_ratio=0.02, drift_capacity=0.04)
    motions = [wd.GroundMotion(pulse(1.0, period, 0.4).acceleration, 0.01, f"{period}") for period in (0.6, 0.8, 1.0)]
    stripes = wd.Stripes(motions, [0.01, 0.03, 0.1, 0.2, 0.4], wd.PeakGroundAcceleration())
    scatter = {
        "elastic_modulus": wd.RandomFactor(wd.Lognormal(1.0, 0.1)),
        "mass": wd.RandomFactor(wd.Lognormal(1, 0.1)),
    }
    run = wd.simulate(wd.Scene(structure, stripes, scatter), structures=8, seed=2, device="cpu")
    collapsed = run["status"].values == 1
    drift = run["peak_output"].sel(output=["drift 1", "drift 2"]).max("output").values
    assert collapsed.any()
    assert (drift[~collapsed] <= 0.04 * (1 + 1e-5)).all()
    curves = wd.fragility(
        run.sel(output=["drift 1", "drift 2"]), {"slight": 0.005, "moderate": 0.02}, demand="peak_output"
    )
    assert (np.diff(curves["fragility_median"].values) > 0).all()


def test_envelopes_and_demand_capacity_ratios():
    capacities = {"moment_capacity": 4e5, "axial_capacity": 2e6, "shear_capacity": 5e5}
    base = portal().description()
    sections = {name: row | (capacities if "elastic_modulus" in row else {}) for name, row in base["sections"].items()}
    frame = wd.Frame(**(base | {"sections": sections}))
    structure = frame.lumped(damping="modal", damping_ratio=0.05, outputs=("member_force",), members=["C1_1", "B1_1"])
    run = wd.simulate(wd.Scene(structure, pulse_of_reference(1.0, 0.8, 0.4)), step=0.005, **SETTINGS)
    ratios = frame.demand_capacity(run)
    assert ratios["member"].values.tolist() == ["C1_1", "B1_1"]
    found = ratios["moment_ratio"].sel(member="C1_1")[0].item()
    ends = [run["peak_output"].sel(output=f"C1_1 moment {end}").item() for end in ("start", "end")]
    assert found == pytest.approx(max(ends) / 4e5, rel=1e-9)
    column = ratios.sel(member="C1_1").isel(sample=0)
    axial = run["peak_output"].sel(output="C1_1 axial").item()
    assert column["axial_demand"].item() == pytest.approx(axial + 50e3, rel=1e-9)  # 50 kN of gravity
    assert column["interaction_ratio"].item() == pytest.approx(column["axial_ratio"].item() + found, rel=1e-12)
    still = frame.static(gravity=True)
    loaded = frame.static({"floor 1": {"fx": 1e4}})
    for results, more, due in (  # gravity counts once
        (still, {}, 586.7e3),
        (still, {"gravity": False}, 586.7e3),
        (loaded, {}, 586.7e3),
        (loaded, {"gravity": False}, 0.0),
    ):
        found = frame.demand_capacity(results, **more)["axial_demand"].sel(member="L1").item()
        assert found == pytest.approx(due, rel=1e-9, abs=1e-6)
    unknown = still.drop_attrs()
    with pytest.raises(ValueError, match="'includes_gravity' of the results is missing"):
        frame.demand_capacity(unknown)
    assert frame.demand_capacity(unknown, gravity=False)["axial_demand"].sel(member="L1").item() > 5e5
    beam = frame.static(member_loads={"B1_1": {"qy": -20e3}})
    assert frame.demand_capacity(beam, gravity=False)["shear_demand"].sel(member="B1_1").item() == pytest.approx(60e3)


def test_a_run_repeats_from_its_scene_and_tables_may_be_pandas(tmp_path):
    frame = two_storey()
    described = frame.description()
    tables = {
        name: pd.DataFrame.from_dict(described[name], orient="index").rename_axis(name.removesuffix("s"))
        for name in ("nodes", "members", "sections")
    }
    same = wd.Frame(**(described | tables))
    assert same.description() == described
    for name, table in tables.items():
        table.to_csv(tmp_path / f"{name}.csv")
    files = {name: tmp_path / f"{name}.csv" for name in tables}
    assert wd.Frame(**(described | files)).description() == described
    structure = frame.lumped(p_delta=True, damping="rayleigh", damping_ratio=0.02, damping_modes=(1, 2))
    motion = pulse(1.0, 0.7, 0.4)
    scatter = {"second_moment": wd.RandomFactor(wd.Lognormal(1.0, 0.2), per="member")}
    run = wd.simulate(wd.Scene(structure, motion, scatter), structures=2, seed=3, device="cpu")
    scene = wd.Scene.from_json(run.attrs["scene"], motion)
    assert scene.to_json() == run.attrs["scene"]
    again = wd.simulate(scene, structures=2, seed=3, device="cpu")
    assert again["peak_output"].equals(run["peak_output"])


def test_vertical_masses_give_a_second_component_of_the_base_motion():
    frame = wd.Frame(
        {"A": (0, 0), "B": (0, 3)},
        {"1": ("A", "B", "s")},
        {"s": {"elastic_modulus": 3e10, "area": 0.16, "second_moment": 2e-3}},
        supports={"A": "fixed"},
        masses={"B": 2e4},
    )
    structure = frame.lumped(damping="modal", damping_ratio=0.05, vertical=True)
    assert structure.dof_names == ("B ux", "B uy")
    assert structure.components == 2
    lateral, vertical = 3 * 3e10 * 2e-3 / 27, 3e10 * 0.16 / 3
    np.testing.assert_allclose(np.diag(structure.matrices["stiffness_matrix"]), [lateral, vertical], rtol=1e-12)
    run = wd.simulate(wd.Scene(structure, wd.PairOfMotions(pulse(1, 0.7, 0.4), pulse(2, 0.3, 0.4))), **SETTINGS)
    assert (run["peak_displacement"] > 0).all()
    angle = {"incidence_angle": wd.RandomValue(wd.Uniform(0.0, 1.0))}
    with pytest.raises(ValueError, match="a plane frame has no angle of incidence"):
        wd.Scene(structure, wd.PairOfMotions(pulse(1, 0.7, 0.4), pulse(2, 0.3, 0.4)), angle)


def test_equipment_on_a_frame_and_its_scene():
    structure = two_storey().lumped(p_delta=True, damping="modal", damping_ratio=0.02, drift_capacity=0.1)
    equipped = wd.with_equipment(structure, "floor 2", 2e3, tuned_to_mode=1, damping_ratio=0.01)
    motion = pulse(1.0, 0.7, 0.4)
    run = wd.simulate(wd.Scene(equipped, motion), device="cpu")
    assert run["spring"].values.tolist() == ["storey 1", "storey 2", "equipment"]
    assert equipped.springs[0].deformation_capacity == pytest.approx(0.1 * 180 * 0.0254)
    again = wd.simulate(wd.Scene.from_json(run.attrs["scene"], motion), device="cpu")
    for name in ("peak_output", "peak_spring_deformation"):
        assert again[name].equals(run[name])


def test_blocks_of_structures_that_threads_draw_have_their_own_matrices():
    frame = portal()
    structure = frame.lumped(damping="modal", damping_ratio=0.05)
    scatter = {"second_moment": wd.RandomFactor(wd.Lognormal(1.0, 0.3), per="member")}
    motion = pulse(1.0, 0.7, 0.4)
    whole = wd.simulate(wd.Scene(structure, motion, scatter), structures=3000, seed=1, step=0.01, device="cpu")
    values = whole["second_moment"].values.astype(float)
    found = structure.elastic_matrices({"second_moment": values})[:, 0, 0]
    for sample in (0, 1499, 2999):
        alone = structure.elastic_matrices({"second_moment": values[sample : sample + 1]})[0, 0, 0]
        assert found[sample] == pytest.approx(alone, rel=1e-12)
    some = np.array([0, 700, 1500, 2222, 2999])
    given = {"second_moment": wd.GivenValues(values[some])}
    due = wd.simulate(wd.Scene(structure, motion, given), structures=5, step=0.01, device="cpu")
    np.testing.assert_allclose(whole["peak_output"][some], due["peak_output"], rtol=2e-5)


def test_runge_kutta_has_order_four_on_elastic_frames():
    frame = two_storey()
    structure = with_rayleigh(frame, *COEFFICIENTS[two_storey])
    motion = pulse_of_reference(1.0, 0.8, 0.4)
    matrices = structure.central_matrices(structure.parameters)
    load = matrices["mass"] @ structure.influence
    exact = response(matrices["mass"], matrices["damping"], matrices["stiffness"], load, motion.acceleration, parts=1)
    errors = []
    for step in (0.01, 0.005, 0.0025):
        kept = wd.Histories([0], every=1)
        run = wd.simulate(wd.Scene(structure, motion, tail=0.0), step=step, histories=kept, **SETTINGS)
        found = run["displacement"].sel(dof="floor 2")[0].values[:: round(0.01 / step)]
        due = exact["u"][: found.size, 1]
        errors.append(np.abs(found - due).max() / np.abs(due).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert ((orders > 3.9) & (orders < 4.1)).all(), (errors, orders)
    assert errors[1] < 1e-6
