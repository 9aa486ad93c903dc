"""Every law with every method compiles and runs, on the cases of combination_cases.py, and agrees with itself.

What is told apart here is what the combined rows say, not how exact they are, which each law's and method's own tests
tell of optimised kernels: these are compiled without, in half the time.
"""

from itertools import combinations, product

import numpy as np
import pytest
from combination_cases import (
    ALONE,
    CONSTRAINED,
    COVERING,
    DEFAULT,
    FACTORS,
    FACTORS_OF_MANY,
    FEW,
    MANY,
    NOISE,
    RECORDED_IN,
    RECORDERS,
    REMAINING,
    ROW_OF_LAW,
    SAMPLES,
    SM90,
    SOURCES,
    USUAL_DAMPING,
    in_turn,
    is_default_on_sm90,
    is_rolled,
    launches_of,
    load_in_turn,
    make_excitation,
    make_structure,
    may_meet,
    name_of,
    pairs_of,
    sm90_plan,
    springs_of_laws,
)
from combined_rows import COMBINED, SOME, combined_structure
from law_rows import SPRINGS, forces_of, rules_of
from method_sources import source_of, thorough_unless

import warpdyn as wd
from warpdyn.campaigns.running import pipeline
from warpdyn.campaigns.running.regions import job
from warpdyn.engine.kernels import build
from warpdyn.engine.kernels.loads import LOADS
from warpdyn.engine.kernels.output_table import HISTORY
from warpdyn.engine.kernels.plan import DTYPES
from warpdyn.engine.kernels.queues import CpuQueue
from warpdyn.engine.methods.table import LINEAR, METHODS, fitting_methods
from warpdyn.foundations.core.output_variables import DIVERGED

pytestmark = [pytest.mark.usefixtures("unoptimised"), pytest.mark.as_shipped, pytest.mark.meant_as_given("no_damping")]


@pytest.fixture
def launched(monkeypatch):
    """Collect the plans launched, after checking that their outputs still say nothing."""
    plans, blanks = [], []

    def blank(queue, rows, dtype):
        blanks.append(rows)
        return original_blank(queue, rows, dtype)

    def launch(queue, launches, *rest, **options):
        for name, values in blanks.pop().items():
            if name == "status":
                assert np.all(values == DIVERGED)
            else:
                assert np.all(np.isnan(values) if values.dtype.kind == "f" else values == -1), name
        [plan] = {each.plan for each in launches}
        plans.append(plan)
        original_launch(queue, launches, *rest, **options)

    original_blank, original_launch = CpuQueue.blank, CpuQueue.launch
    monkeypatch.setattr(CpuQueue, "blank", blank)
    monkeypatch.setattr(CpuQueue, "launch", launch)
    return plans


def values_of(case):
    """Return a case as values of FACTORS and of FACTORS_OF_MANY."""
    family, dofs, damping, spring, load, method, dtype = case
    source, load = source_of(method), "noise" if load in NOISE else load
    names = ("structure", "law", "source", "damping", "load", "dtype", "recorded", "kind")
    return dict(
        zip(names, ((family, dofs), spring, source, damping, load, dtype, RECORDED_IN[case], source[0]), strict=True)
    )


def test_all_pairs_that_may_meet_do():
    rows = [values_of(case) for case in COVERING]
    met = set().union(*(pairs_of({name: row[name] for name in FACTORS}) for row in rows if row["law"] in FEW))
    constrained = [dict(zip(CONSTRAINED, values, strict=True)) for values in product(*map(FACTORS.get, CONSTRAINED))]
    allowed = [row for row in constrained if may_meet(row)]
    due = set().union(*map(pairs_of, allowed))
    values = {name: {row[name] for row in allowed} if name in CONSTRAINED else set(FACTORS[name]) for name in FACTORS}
    assert values == {name: set(table) for name, table in FACTORS.items()}  # nothing is kept out altogether
    for one, other in combinations(FACTORS, 2):
        if not {one, other} <= set(CONSTRAINED):
            due |= {((one, a), (other, b)) for a, b in product(values[one], values[other])}
    assert not due - met
    of_many = set().union(
        *(pairs_of({name: row[name] for name in FACTORS_OF_MANY}) for row in rows if row["law"] in MANY)
    )
    for one, other in combinations(FACTORS_OF_MANY, 2):
        assert {((one, a), (other, b)) for a, b in product(FACTORS_OF_MANY[one], FACTORS_OF_MANY[other])} <= of_many
    for name in ("source", "damping", "load"):
        assert {row[name] for row in rows if row["law"] in MANY} >= set(FACTORS[name]) - {SOURCES[-1], "matrix"}


def test_every_row_is_among_the_cases():
    # A row that no scene leads to, or for which this file has no load, would go untested in silence.
    assert set(springs_of_laws()) == set(SPRINGS) == {*FEW, *MANY}
    for load in LOADS:
        make_excitation(load, 2)
    # Every law with every method that fits it in every dtype, by `pytest -m thorough`.
    cases = [*COVERING, *REMAINING]
    fitting = {
        (spring, name) for spring, (law, _) in springs_of_laws().items() for name in fitting_methods(forces_of(law))
    }
    product_of_all = {(*pair, dtype) for pair, dtype in product(fitting, DTYPES)}
    assert {(case[3], *case[5:]) for case in cases if case[0] == "chain"} == product_of_all
    assert {case[5:] for case in cases if case[0] == "dense"} == set(product(fitting_methods(LINEAR), DTYPES))
    assert len(set(cases)) == len(cases)
    assert {case[5] for case in DEFAULT if case[0] == "chain"} == set(METHODS) - {"leapfrog"}  # lumped structures only
    assert {case[4] for case in DEFAULT} == set(LOADS)
    for family in ("chain", "dense"):
        alone = {ALONE[case] for case in DEFAULT if case[0] == family and "alone" in RECORDED_IN[case]}
        assert alone == set(RECORDERS[family])
    on_gpu = [sm90_plan(case) for case in SM90 if is_default_on_sm90(case)]
    assert {source_of(plan.method) for plan in on_gpu} == set(SOURCES)
    assert {case[5] for case in SM90} == set(METHODS) - {"leapfrog"}
    for column, table in {"law": {*FEW, *ROW_OF_LAW.values()}, "load": LOADS, "dtype": DTYPES}.items():
        assert set(table) <= {str(getattr(plan, column)) for plan in on_gpu}, column


@pytest.mark.parametrize("case", [thorough_unless(case in DEFAULT, case, id=name_of(case)) for case in RECORDED_IN])
def test_combination(case, launched, monkeypatch):
    family, dofs, damping, spring, load, method, dtype = case
    if is_rolled(case):
        monkeypatch.setattr(build, "CPU_UNROLL", 1)
        monkeypatch.setattr(build, "CPU_LONG_UNROLL", 1)
        monkeypatch.setattr(build, "CHAIN_OF_BRANCHES", 1)
    # The runs that check the reliability of samples launch the same kernels again.
    monkeypatch.setattr(pipeline, "is_checked", lambda model: False)
    monkeypatch.setattr(job, "is_checked", lambda model: False)
    structure, excitation = make_structure(family, dofs, damping, spring), make_excitation(load, dofs)
    alone, kernels = ALONE[case], RECORDED_IN[case]

    def run_of(recorders, **kept):
        scene = wd.Scene(structure, excitation, recorders=recorders, tail=1.2)
        # Pinching is quick: two stages a step follow it at half the step alone.
        step = 0.0025 if spring.startswith("baber_noori_pinching") else 0.005
        settings = {"structures": SAMPLES, "method": method, "dtype": dtype, "step": step, "on_unstable": "raise"}
        return wd.simulate(scene, device="cpu", **settings, **kept)

    runs = {}
    if "all" in kernels:
        kept = {"histories": wd.Histories((0, SAMPLES - 1))} if "histories" in kernels else {}
        runs["all"] = run_of(None, **kept)
    if "alone" in kernels:
        runs["alone"] = run_of((alone,))
    # Samples whose float32 is too coarse run again in float64.
    assert [plan for plan in launched if plan.dtype == dtype] == launches_of(case)
    for run in runs.values():
        assert np.all(run["status"].values == 0)
        for name, variable in run.data_vars.items():
            if variable.dtype.kind in "fi":
                assert np.all(np.isfinite(variable.values)), name
                if "sample" in variable.dims and load not in NOISE:
                    # The samples are one structure under one load: every lane gives the same bits, repeats included.
                    assert np.all(variable.values == variable.values[0]), name
    recorded = {name for rows in RECORDERS[family].values() for name in rows} - {"residual_drift"}
    own = {name for name in RECORDERS[family][alone]} - {"residual_drift"}
    if "alone" in kernels:
        assert own <= set(runs["alone"].data_vars)
    if "all" not in kernels:
        return
    together = runs["all"]
    assert recorded <= set(together.data_vars)
    if load in NOISE:  # a motion each
        assert np.unique(together["input_energy"].values).size == SAMPLES
    # A recorder sees the same motion whatever else is recorded, but for the order of roundings: 1e-3 (float32) covers
    # the growth of one rounding over the run's 200 steps through a yielding spring.
    close = {"rtol": 1e-3, "atol": 1e-4} if dtype == "float32" else {"rtol": 1e-10, "atol": 1e-12}
    if "alone" in kernels:
        for name in recorded & set(runs["alone"].data_vars):
            np.testing.assert_allclose(runs["alone"][name], together[name], **close, err_msg=name)
    if "histories" not in kernels:
        return
    # And the histories are of the motion whose peaks were recorded.
    assert set(HISTORY if family == "chain" else list(HISTORY)[:3]) <= set(together.data_vars)
    moved = together["displacement"].values
    name = "peak_storey_drift" if family == "chain" else "peak_displacement"
    peak = np.abs(np.diff(moved, axis=2, prepend=0) if family == "chain" else moved).max(axis=1)
    # An adaptive method sees peaks at the parts of steps too, which histories do not keep: up to (w h)^2 / 8 more.
    rtol = 2e-3 if METHODS[method].is_adaptive else close["rtol"]
    np.testing.assert_allclose(peak, together[name].values[[0, -1]], rtol=rtol, atol=0)


DEVICES = [
    (row, in_turn(USUAL_DAMPING, i + j // 2), load_in_turn(i + j, j), method, in_turn(DTYPES, (i + j) // 2))
    for (i, row), (j, method) in product(enumerate(COMBINED), enumerate(SOME))
    if (i + j) % 2 == 0
]


def is_shown(case):
    """Return whether a case is its row's: of an explicit and an implicit method in turn, those in turn."""
    place = list(COMBINED).index(case[0])
    kind = in_turn(("explicit", "implicit"), place)
    alike = [each for each in DEVICES if each[0] == case[0] and source_of(each[3])[0] == kind]
    return case == in_turn(alike, place // 2)


@pytest.mark.parametrize("case", [thorough_unless(is_shown(case), case, id=name_of(case)) for case in DEVICES])
def test_devices(case, launched):
    row, damping, load, method, dtype = case
    structure = combined_structure(row, damping)
    scene = wd.Scene(structure, make_excitation(load, structure.storeys), tail=1.2)
    settings = {"structures": SAMPLES, "method": method, "dtype": dtype, "step": 0.0025, "device": "cpu"}
    run = wd.simulate(scene, **settings)
    assert launched[0].law == rules_of(row)
    assert launched[0].viscous_dampers == ("power" if "viscous_damper" in structure.devices else "none")
    assert np.all(run["status"].values == 0)
    assert np.isfinite(run["peak_storey_drift_ratio"]).all()
    # The energy that devices take closes the balance: of second order at corners, and of float32 sums.
    assert np.abs(run["energy_balance_error"]).max() < 5e-3
    if "slip" in row or "gap" in row or damping != "none":
        lost = run["hysteretic_energy"].sum("storey") + run["viscous_energy"]
        assert (lost > 0).all()
