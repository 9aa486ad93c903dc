"""Wrong frames are refused before a run; the message names node, member, section or argument."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import warpdyn as wd
from warpdyn.foundations.core.plausibility.frames import CHECKS_OF_FRAMES

pytestmark = pytest.mark.fast


def arguments() -> dict:
    return {
        "nodes": {"A": (0.0, 0.0), "B": (0.0, 4.0), "C": (6.0, 4.0), "D": (6.0, 0.0)},
        "members": {"left": ("A", "B", "c"), "beam": ("B", "C", "b"), "right": ("D", "C", "c")},
        "sections": {
            "c": {"elastic_modulus": 2e11, "area": 0.0118, "second_moment": 1.49e-4},
            "b": {"elastic_modulus": 2e11, "area": 0.0084, "second_moment": 2.31e-4},
        },
        "supports": {"A": "fixed", "D": "fixed"},
        "diaphragms": {"floor": ["B", "C"]},
        "masses": {"floor": 70e3},
    }


def changed(**more) -> dict:
    found = arguments()
    for name, value in more.items():
        if isinstance(value, dict) and isinstance(found.get(name), dict):
            found[name] = found[name] | value
        else:
            found[name] = value
    return found


def beam(**more) -> dict:
    return {"beam": {"start": "B", "end": "C", "section": "b"} | more}


STEEL = {"elastic_modulus": 2e11, "area": 0.01}
MISTAKES = {  # changed arguments, message
    "duplicate nodes": ({"nodes": {"E": (0.0, 4.0)}}, "'B' and 'E' are at the same place"),
    "unconnected node": ({"nodes": {"E": (9.0, 4.0)}}, "node 'E' is not connected"),
    "unknown node": ({"members": {"beam": ("B", "X", "b")}}, "member 'beam' names the unknown node 'X'"),
    "unknown section": ({"members": {"beam": ("B", "C", "beams")}}, "names the unknown section 'beams'"),
    "no length": ({"members": {"beam": ("B", "B", "b")}}, "starts and ends at node 'B'"),
    "offsets too long": ({"members": beam(offset_start_x=3.0, offset_end_x=-3.0)}, "no length between its rigid"),
    "no modulus": ({"sections": {"b": {"area": 1.0}}}, "section 'b' has no elastic_modulus \\[Pa\\]"),
    "no area": ({"sections": {"b": {"elastic_modulus": 1.0}}}, "section 'b' has no area \\[m2\\]"),
    "no second moment": (
        {"sections": {"b": STEEL}},
        "member 'beam' is a beam, but its section 'b' has no second_moment",
    ),
    "negative area": ({"sections": {"b": STEEL | {"area": -1.0}}}, "area of section 'b' \\[m2\\] must be"),
    "half of a shear stiffness": (
        {"sections": {"b": STEEL | {"second_moment": 1e-4, "shear_area": 0.01}}},
        "section 'b' has no shear_modulus",
    ),
    "unknown column": ({"sections": {"b": STEEL | {"second_momnet": 1e-4}}}, "did you mean 'second_moment'"),
    "unknown kind": ({"members": beam(kind="brace")}, "unknown members: kind of member 'beam'"),
    "release of a truss": ({"members": beam(kind="truss", release="both")}, "'beam' is a truss, which has no moments"),
    "release and spring": ({"members": beam(release="start", spring_start=1e8)}, "a release and a spring at its start"),
    "no support": ({"supports": None}, "the frame has no support"),
    "unknown support": ({"supports": {"A": "fixd"}}, "did you mean 'fixed'"),
    "support of an unknown node": ({"supports": {"Z": "fixed"}}, "supports names the unknown node 'Z'"),
    "unknown direction": ({"supports": {"A": {"uz": True}}}, "node 'A' names 'uz'"),
    "negative support spring": ({"supports": {"A": {"ux": -1.0}}}, "stiffness ux of node 'A'"),
    "inclined diaphragm": ({"diaphragms": {"floor": ["A", "C"]}}, "at different heights"),
    "node in two diaphragms": ({"diaphragms": {"roof": ["B"]}}, "node 'B' is listed in 'floor' and in 'roof'"),
    "diaphragm of unknown node": ({"diaphragms": {"roof": ["Q"]}}, "'roof' names the unknown node 'Q'"),
    "diaphragm with the name of a node": ({"diaphragms": {"B": ["B"], "floor": ["C"]}}, "also the name of a node"),
    "mass of an unknown floor": ({"masses": {"flor": 1.0}}, "did you mean 'floor'"),
    "negative mass": ({"masses": {"floor": -1.0}}, "masses: ux of 'floor'"),
    "vertical mass of a diaphragm": ({"masses": {"floor": {"uy": 1.0}}}, "names the direction 'uy'"),
    "unknown mass of members": ({"member_mass": "lumpd"}, "did you mean 'lumped'"),
    "unknown geometric stiffness": ({"geometric_stiffness": "p-delta"}, "unknown geometric_stiffness"),
    "not a table": ({"nodes": [1, 2]}, "nodes must be a dictionary"),
    "empty table": ({"members": pd.DataFrame()}, "members is empty"),
    "too many values": ({"nodes": {"A": (0, 0, "fixed", "x", 1, 2, 3)}}, "node 'A' has 7 values"),
    "text for a number": ({"nodes": {"A": (0, "high")}}, "y of node 'A' must be a number"),
    "infinite coordinate": ({"nodes": {"A": (0, np.inf)}}, "y of node 'A'"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_wrong_frame_is_refused(name):
    more, message = MISTAKES[name]
    with pytest.raises((ValueError, TypeError), match=message):
        wd.Frame(**changed(**more))


MECHANISMS = {  # changed arguments; node and direction of the free motion
    "pinned portal with a released beam": (
        {"members": beam(release="both"), "supports": {"A": "pinned", "D": "pinned"}},
        "diaphragm 'floor' can move horizontally",
    ),
    "roller": (
        {"members": beam(release="both"), "diaphragms": None, "masses": None, "supports": {"A": "roller"}},
        "node '[AB]' can move horizontally",
    ),
    "hanging bar": (
        {"nodes": {"E": (12.0, 4.0)}, "members": {"bar": ("C", "E", "b", "truss")}},
        "node 'E' can move vertically",
    ),
    "released cantilever": (
        {
            "nodes": {"E": (12.0, 4.0)},
            "members": {"arm": {"start": "C", "end": "E", "section": "b", "release": "start"}},
        },
        "node 'E' can move (vertically|by rotation)",
    ),
    "floating part": (
        {"nodes": {"E": (12.0, 4.0), "F": (15.0, 4.0)}, "members": {"float": ("E", "F", "b")}},
        "node '[EF]' can move",
    ),
    "spherical leaning column": (
        {"nodes": {"L0": (9.0, 0.0), "L1": (9.0, 4.0)}, "supports": {"L0": "pinned"}}
        | {"members": {"L": ("L0", "L1", "b", "truss")}},
        "node 'L1' can move horizontally",
    ),
}


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_mechanism_is_refused_with_node_and_direction(name):
    more, message = MECHANISMS[name]
    with pytest.raises(ValueError, match=f"mechanism: {message}"):
        wd.Frame(**changed(**more))


def test_wrong_loads_are_refused():
    frame = wd.Frame(**changed(members=beam(release="both")))
    for loads, message in (
        ({"Q": {"fx": 1.0}}, "unknown node or diaphragm 'Q'"),
        ({"B": {"fz": 1.0}}, "unknown column 'fz'"),
        ({"floor": {"fy": 1.0}}, "'floor' can only have the horizontal force"),
        ({"B": {"fy": "a lot"}}, "fy of node 'B' must be a number"),
        ({"B": {"fx": np.nan}}, "fx of node 'B' .* must be a finite number"),
    ):
        with pytest.raises((ValueError, TypeError), match=message):
            frame.static(loads)
    for loads, message in (
        ({"beem": {"qy": 1.0}}, "did you mean 'beam'"),
        ({"beam": {"q": 1.0}}, "unknown key 'q'"),
        ({"beam": {"py": 1.0}}, "has no place: give at="),
        ({"beam": {"qy": np.nan}}, "qy of 'beam' .* must be a finite number"),
        ({"beam": {"py": 1.0, "at": 7.0}}, "outside its length of 6 m"),
        ([1], "member_loads must be a dictionary"),
    ):
        with pytest.raises((ValueError, TypeError), match=message):
            frame.static(member_loads=loads)
    for settlements, message in (
        ({"B": {"uy": 0.01}}, "'B' is not fixed in 'uy'"),
        ({"Q": {"uy": 0.01}}, "unknown node 'Q'"),
        ({"A": {"uy": np.inf}}, "uy of node 'A' must be a finite number"),
    ):
        with pytest.raises(ValueError, match=message):
            frame.static(settlements=settlements)
    truss = wd.Frame(
        {"A": (0, 0), "B": (4, 0), "C": (2, 1.5)},
        {"1": ("A", "B", "s", "truss"), "2": ("A", "C", "s", "truss"), "3": ("B", "C", "s", "truss")},
        {"s": STEEL},
        supports={"A": "pinned", "B": "roller"},
    )
    with pytest.raises(ValueError, match="node 'C' has a moment mz"):
        truss.static({"C": {"mz": 1.0}})


@pytest.mark.meant_as_given("frame_gravity_over_weight")
def test_gravity_above_the_buckling_load_is_refused():
    heavy = {"B": (0.0, 4.0, "none", "none", 0.0, 2e7), "C": (6.0, 4.0, "none", "none", 0.0, 2e7)}
    frame = wd.Frame(**changed(nodes=heavy))
    factor = frame.buckling_factors()[0]
    assert 0 < factor < 1
    for call in (
        lambda: frame.static(gravity=True, p_delta=True),
        lambda: frame.modal(p_delta=True),
        lambda: frame.lumped(p_delta=True),
    ):
        with pytest.raises(ValueError, match=f"times the buckling load .*buckling factor {factor:.4g}"):
            call()
    frame.lumped()
    light = wd.Frame(**arguments())
    for call in (light.buckling_factors, lambda: light.lumped(p_delta=True), lambda: light.modal(p_delta=True)):
        with pytest.raises(ValueError, match="no gravity loads"):
            call()
    with pytest.raises(ValueError, match="compress no member"):
        light.buckling_factors({"B": {"fx": 0.0}})


def test_random_frames_that_buckle_under_gravity_are_refused():
    loads = {"B": (0.0, 4.0, "none", "none", 0.0, 7e6), "C": (6.0, 4.0, "none", "none", 0.0, 7e6)}
    structure = wd.Frame(**changed(nodes=loads)).lumped(p_delta=True, damping="modal", damping_ratio=0.02)
    motion = wd.GroundMotion(np.sin(np.arange(200) / 10), 0.01)
    scatter = {"second_moment": wd.GivenValues([[1.49e-4, 2.31e-4, 1.49e-4], [5e-5, 2.31e-4, 5e-5]])}
    with pytest.raises(ValueError, match=r"structure 1 buckles .*'floor'.* is 0.336 times .*'left'"):
        wd.simulate(wd.Scene(structure, motion, scatter), structures=2, device="cpu")


def test_wrong_reductions_are_refused():
    frame = wd.Frame(**arguments())
    for more, message in (
        ({"dofs": ["flor"]}, "did you mean 'floor'"),
        ({"dofs": ["A ux"]}, "'A ux' is not a free degree of freedom \\(it is fixed"),
        ({"dofs": ["floor", "floor"]}, "listed twice"),
        ({"dofs": "floor"}, "dofs must be a list"),
        ({"dofs": ["B rz"]}, "'floor' has the mass 70000 and is not kept"),
        ({"dofs": ["floor", "B rz"]}, "degree of freedom 'B rz' has no mass"),
        ({"reduction": "guyn"}, "did you mean 'guyan'"),
        ({"reduction": "guyan"}, "needs dofs="),
        ({"modes": 2}, "modes=2 needs reduction='craig_bampton'"),
        ({"dofs": ["floor"], "reduction": "craig_bampton", "modes": 1}, "modes must be 1 to 0"),
        ({"outputs": ["moment"]}, "unknown outputs 'moment'"),
        ({"outputs": "drift"}, "outputs must be a list"),
        ({"members": ["beem"]}, "did you mean 'beam'"),
        ({"members": ["left", "beam", "left"]}, "members: 'left' is listed twice"),
        ({"members": [], "outputs": ["member_force"]}, "members is empty"),
        ({"members": "beam"}, "members must be a list of names"),
        ({"drift_capacity": -1.0}, "drift_capacity must be a finite number above 0"),
        ({"vertical": True}, "vertical=True needs vertical masses"),
        ({"p_delta": "yes"}, "p_delta must be True or False"),
        ({"damping": "modal"}, "damping_ratio"),
    ):
        with pytest.raises((ValueError, TypeError), match=message):
            frame.lumped(**more)
    massless = wd.Frame(**changed(masses=None))
    for call in (massless.lumped, massless.modal):
        with pytest.raises(ValueError, match="the frame has no mass"):
            call()
    without = wd.Frame(**changed(diaphragms=None, masses=None) | {"masses": {"B": 1e4}})
    with pytest.raises(ValueError, match="drift_capacity needs storeys"):
        without.lumped(drift_capacity=0.02)


def test_wrong_scatter_and_wrong_results_are_refused():
    frame = wd.Frame(**arguments())
    structure = frame.lumped(damping="modal", damping_ratio=0.02)
    motion = wd.GroundMotion(np.sin(np.arange(200) / 10), 0.01)
    factor = wd.RandomFactor(wd.Lognormal(1.0, 0.1))
    for scatter, message in (
        ({"stiffness": factor}, "scatter elastic_modulus, area or second_moment instead"),
        ({"second_moment": wd.RandomFactor(wd.Lognormal(1.0, 0.1), per="spring")}, "use per='member'"),
        ({"second_momnet": factor}, "did you mean 'second_moment'"),
        ({"area": wd.GivenValues([[1.0, 1.0]])}, "it must be \\[structure, 3\\]"),
    ):
        with pytest.raises(ValueError, match=message):
            wd.Scene(structure, motion, scatter)
    with pytest.raises(ValueError, match="area"):
        wd.simulate(wd.Scene(structure, motion, {"area": wd.GivenValues([[1.0, -1.0, 1.0]])}), device="cpu")
    with pytest.raises(TypeError, match="demand_capacity"):
        frame.demand_capacity(None)
    run = wd.simulate(wd.Scene(structure, motion), device="cpu")
    with pytest.raises(ValueError, match="the run has no forces of members"):
        frame.demand_capacity(run)


NODES = "node;x;y\nA;0,0;0,0\nB;0,0;4,0\nC;6,0;4,0\nD;6,0;0,0\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (NODES, r"^nodes: .*nodes\.csv: its columns are separated by ';' \(semicolons\) instead of commas"),
        (NODES.replace(",", "."), r"^nodes: .*nodes\.csv: its columns are separated by ';'"),
        (
            NODES.replace(";", ","),
            r"^nodes: .*line 2 has 5 values, but there are 3 columns.* decimal points, not commas",
        ),
        ("<html><body>not found</body></html>\n", r"^nodes: .*it is not CSV: it begins with '<html>.*as a web page"),
        ('node,x,y\nA,"0,0","0,0"\n', r"nodes: x of node 'A' must be a number .* has a decimal comma: save the file"),
    ],
)
def test_tables_with_semicolons_and_decimal_commas_say_how_they_are_read(text, message, tmp_path):
    path = tmp_path / "nodes.csv"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        wd.Frame(**changed(nodes=path))
    table = pd.read_csv(path, sep=";", decimal=",")
    if len(table.columns) > 1 and table["x"].dtype.kind == "f":
        wd.Frame(**changed(nodes=table))


def test_a_table_that_was_read_as_one_column_says_how_it_is_read(tmp_path):
    path = tmp_path / "nodes.csv"
    path.write_text(NODES.replace(",", "."))
    with pytest.raises(ValueError, match=r"nodes: the table has the only column 'node;x;y'.* sep=';'"):
        wd.Frame(**changed(nodes=pd.read_csv(path)))


def in_units(length: float = 1.0, force: float = 1.0, mass: float = 1.0, pressure: float = 1.0) -> dict:
    """Return the portal with gravity loads; arguments are numbers of another unit in one SI unit."""
    found = arguments()
    found["nodes"] = {name: (x * length, y * length) for name, (x, y) in found["nodes"].items()}
    found["nodes"]["B"] = {"x": 0.0, "y": 4.0 * length, "gravity_load": 6e5 * force}
    for row in found["sections"].values():
        row["elastic_modulus"] *= pressure
        row["area"] *= length**2
        row["second_moment"] *= length**4
    found["masses"] = {"floor": 70e3 * mass}
    return found


@pytest.mark.parametrize(
    ("units", "meant"),
    {
        "mm": ({"length": 1e3}, "length of the member 'left' is 4000 m .*: if given in mm, it would be 4 m"),
        "mm4": (
            {"length": 1e3},
            "radius of gyration of the section.*: with area in mm2 and second_moment in mm4",
        ),
        "MPa": ({"pressure": 1e-6}, "elastic_modulus of the section 'c' .*: if given in MPa or N/mm2, .* 2e.11 Pa"),
        "GPa": ({"pressure": 1e-9}, "elastic_modulus of the section 'c' .*: if given in GPa or kN/mm2, .* 2e.11 Pa"),
        "kPa": ({"force": 1e-3, "mass": 1e-3, "pressure": 1e-3}, "elastic_modulus .*: if given in kPa or kN/m2"),
        "kN": ({"force": 1e-3}, "masses of the frame times g over its gravity loads .*: with gravity_load given in kN"),
        "t": ({"mass": 1e-3}, "gravity loads of the frame over its masses times g .*: with masses given in tonnes"),
    }.values(),
)
def test_other_units_are_warned_of(units, meant):
    with pytest.warns(UserWarning, match=meant) as caught:
        frame = wd.Frame(**in_units(**units))
    assert len(caught) == 1
    assert caught[0].filename == __file__
    wd.fishbone(frame)  # does not repeat the warning
    with wd.meant_as_given(*CHECKS_OF_FRAMES):
        wd.Frame(**in_units(**units))


TRUSS = {"A": (0.0, 0.0), "B": (4.0, 0.0), "C": {"x": 2.0, "y": 1.5, "gravity_load": 2e4, "mass": 2e4 / 9.81}}


@pytest.mark.parametrize(
    ("area", "node", "meant"),
    [
        (
            2e3,
            {},
            "area.*0.5 / length, of the inclined truss '2' is 17.8885 .*with area given in mm2, it would be 0.0179",
        ),
        (20.0, {}, "of the inclined truss '2' is 1.78885 .*with area given in cm2, it would be 0.0179"),
        (2e-3, {"mass": 2e4}, "loads may be given in kg, or masses as weights in N"),
        (2e-3, {"gravity_load": 2e4 / 9.81}, "loads may be given in kg, or masses as weights in N"),
        (2e-3, {"gravity_load": 2e4 * 9.81}, "loads may be multiplied by g twice, or masses be divided by g"),
    ],
)
def test_trusses_in_other_units_are_warned_of(area, node, meant):
    def truss(area, **node):
        bars = {"1": ("A", "B", "s", "truss"), "2": ("A", "C", "s", "truss"), "3": ("B", "C", "s", "truss")}
        nodes = TRUSS | {"C": TRUSS["C"] | node}
        sections = {"s": {"elastic_modulus": 2e11, "area": area}}
        return wd.Frame(nodes, bars, sections, supports={"A": "pinned", "B": "roller"})

    truss(2e-3)
    with pytest.warns(UserWarning, match=meant) as caught:
        truss(area, **node)
    assert len(caught) == 1


@pytest.mark.parametrize(
    ("section", "load", "meant"),
    [
        ({"shear_modulus": 8e4, "shear_area": 0.005}, 6e5, "with shear_modulus given in MPa or N/mm2, it would be 0.4"),
        ({"shear_modulus": 8e10, "shear_area": 5e3}, 6e5, "with shear_area given in mm2, it would be 0.595"),
        (
            {"moment_capacity": 300.0},
            6e5,
            "'b' .moment_capacity. is .*with the capacity given in kN or kN m, .* 0.0010",
        ),
        ({"axial_capacity": 2e3}, 6e5, "'b' .axial_capacity. is .*with the capacity given in kN or kN m, .* 0.0011"),
        ({}, -6e5, "sum of the gravity loads of the frame is -600000 N .*remove the minus signs"),
    ],
)
def test_implausible_sections_and_loads_are_warned_of(section, load, meant):
    given = in_units()
    given["sections"]["b"] |= section
    given["nodes"]["B"]["gravity_load"] = load
    with pytest.warns(UserWarning, match=meant) as caught:
        wd.Frame(**given)
    assert len(caught) == 1


def test_frames_in_si_units_and_dimensionless_frames_are_not_warned_of():
    wd.Frame(**in_units())
    dimensionless = in_units(length=1e3)
    for row in dimensionless["sections"].values():
        row["elastic_modulus"] = 1.0
    wd.Frame(**dimensionless)


def test_nan_is_missing_only_in_an_empty_cell_of_a_table():
    columns = beam(start="A", end="B", section="c")["beam"]
    members = {"left": columns, "right": columns | {"start": "D", "end": "C"}} | beam(spring_start=np.nan)
    with pytest.raises(ValueError, match=r"spring_start of member 'beam' .* must be a finite number of at least 0"):
        wd.Frame(**changed(members=members))
    frame = wd.Frame(**arguments() | {"members": pd.DataFrame.from_dict(members, orient="index")})
    assert frame.description()["members"].get("beam", {}).get("spring_start", np.inf) == np.inf
    assert (frame.static({"floor": {"fx": 1e4}})["displacement"] != 0).any()
