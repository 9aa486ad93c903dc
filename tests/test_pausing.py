"""Kernels that can pause: the variables that they store, and their text."""

from __future__ import annotations

import ast
import re
from dataclasses import replace

import numpy as np
import pytest
from law_rows import rules_of
from test_live_families import controlled, hinged_fishbone, hinged_frame

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of, plan_of, plans_of_events
from warpdyn.engine.kernels.build import as_in_live, composed, fitted, history_plan, pausing_of
from warpdyn.engine.kernels.composing.source_text import names_of
from warpdyn.engine.kernels.composing.syntax import syntax_tree
from warpdyn.engine.kernels.pausing.liveness import interval_loop, live_names, set_in
from warpdyn.engine.kernels.pausing.paused_text import RESTARTED
from warpdyn.engine.kernels.plan import Plan, whole_run

TEXT = """
def integrate(n: int, output: Output):
    u = matrix()
    rest = row()
    total = dtype(0.0)
    scratch = dtype(0.0)
    last = int(0)
    kept = dtype(0.0)
    for interval in range(0, n + 1):
        scratch = total + 1.0
        if scratch > 2.0:
            last = interval
            break
        kept = scratch
        for i in range(3):
            c = vector()
            c[0] = kept
            u[i, 0] += c[0] * rest[0]
        total += scratch
        while total > 9.0:
            total -= kept
    output.u[0] = u[0, 0] + dtype(last)
"""


def test_variables_that_live_across_the_loop():
    [function] = ast.parse(TEXT).body
    place = interval_loop(function)
    assert place == 6
    live = live_names(function, place)
    changed = set_in([function.body[place]])
    assert live & changed == {"u", "total", "last"}  # not scratch, kept and c, which each iteration sets first
    assert {"rest", "n", "output"} <= live


def chain(**changes: object) -> Plan:
    given = {"family": "chain", "dofs": 3, "law": rules_of("bilinear"), "damping": "rayleigh", "method": "rk4"}
    return Plan(**given | {"load": "base_acceleration", "recorders": ("drift",), "dtype": "float32"} | changes)


def of_scene(scene: wd.Scene) -> Plan:
    return plan_of(scene, dynamics_of(scene), "rk4", "float32", is_gpu=False)


PLANS = {
    "rk4": chain(),
    "collapse and energy": chain(recorders=("drift", "energy", "residual"), collapses=True, law=rules_of("takeda")),
    "rate law in float64": chain(law=rules_of("bouc_wen"), dtype="float64"),
    "adaptive": chain(method="dormand_prince54", law=rules_of("elastic")),
    "nystroem": chain(method="nystroem4"),
    "stoermer": chain(method="stoermer", collapses=True),
    "implicit": chain(method="newmark_average", law=rules_of("pinching4")),
    "exact": chain(method="exact", damping="classical", law=rules_of("elastic")),
    "white noise": chain(load="white_noise"),
    "threads share a sample on a GPU": chain(dofs=5, law=rules_of("pinching4"), collapses=True, dtype="float64"),
    "dense": chain(family="dense", law=rules_of("elastic"), damping="matrix", recorders=("displacement",)),
    "frame with hinges": of_scene(hinged_frame()),
    "fish-bone with hinges": of_scene(hinged_fishbone()),
    "control and floor spectra": of_scene(controlled()),
}
# Variables that kernels which pause do not store, although an iteration seems to read them before it sets them: they
# are set in the first stage of a step or the first iteration of a search, or are 0 between two intervals.
SET_IN_FIRST_STAGE = {
    *("above", "fastest", "h", "un", "upper", "vn", "work_in", "work_viscous", "zn"),
    *("correction", "mode", "rise", "slope", "unbalanced"),
}


@pytest.mark.parametrize("is_gpu", [False, True], ids=["cpu", "gpu"])
@pytest.mark.parametrize("name", PLANS)
def test_a_kernel_that_can_pause_has_all_statements_of_the_kernel(name, is_gpu):
    plan = fitted(PLANS[name], is_gpu)
    whole, found = composed(plan).text.splitlines(), pausing_of(replace(plan, pauses=True))
    lines = found.composed.text.splitlines()
    added = [line for line in lines if "paused." in line]
    changed = [line for line in whole if line not in lines]
    # Only the arguments, the bounds of the loop and the index of the first sample of the motion differ.
    first = "base_at_end[j] = loads.values", "base_at_end[j] = element(loads.values, next_value[j] + interval * stride"
    known = ("def ", "first: int", "for interval in range(", *first)
    assert [line for line in changed if not line.strip().startswith(known)] == []
    # The first sample is before the packet: on a GPU, the memory there once held NaN, and the run diverged.
    assert not [line for line in lines if line.strip().startswith(first) and "wp.max(" not in line]
    names = {each.name for each in found.carried}
    assert len(names) == len(found.carried)
    for each in found.carried:
        assert sum(bool(re.match(rf" +{each.name}(\[.*\])? = paused", line)) for line in added) == 1  # loaded once
        assert sum(bool(re.search(rf"paused.* = {each.name}(\[|$)", line)) for line in added) == 1  # stored once
    assert composed(replace(plan, pauses=True)) is found.composed
    # Threads that share a sample have the same `block`, but each of them stores the variables of its storeys.
    assert (plan.sections > 1) == (is_gpu and name.startswith("threads share"))
    stored = (re.search(r"paused\.real\[[^,]*, (.*?)( \+ j)?\]", line) for line in added)
    columns = {each.group(1) for each in stored if each}
    assert columns == {"(first + wp.tid()) * LANES" if plan.sections > 1 else "block * LANES"}


@pytest.mark.parametrize(("law", "pauses"), [("bilinear", False), ("bouc_wen", False), ("takeda", True)])
def test_simulate_uses_the_kernel_that_can_pause_for_laws_with_many_rules_on_a_gpu(law, pauses):
    plan = chain(law=rules_of(law))
    assert as_in_live(fitted(plan, True), is_gpu=True).pauses == pauses
    assert not as_in_live(fitted(plan, False), is_gpu=False).pauses
    first, later = plans_of_events(replace(plan, pauses=True), 2)
    assert not first.pauses
    assert not later.pauses
    assert not history_plan(replace(plan, pauses=True)).pauses
    [paused] = whole_run(replace(plan, pauses=True))
    assert (paused.first, paused.stores) == (0, 0)
    assert whole_run(plan) == []


def test_the_rows_of_variables_do_not_overlap():
    found = pausing_of(replace(fitted(PLANS["collapse and energy"], False), pauses=True))
    for array in ("real", "real64", "whole"):
        rows = [np.arange(each.first, each.first + each.rows) for each in found.carried if each.array == array]
        rows = np.concatenate([np.zeros(0, int), *rows])
        assert len(set(rows.tolist())) == rows.size
        assert found.rows(array) == max(1, rows.size)


def read_before_set(statements: list[ast.stmt], known: set[str]) -> set[str]:
    """Return names that statements may read before they set them or an element of them; `known` grows by those set.

    Bodies of loops count as executed, and a variable counts as set by an `if` if both branches set it.
    """
    found = set()
    for statement in statements:
        if isinstance(statement, ast.If):
            found |= read_in(statement.test) - known
            branches = [set(known), set(known)]
            for body, after in zip((statement.body, statement.orelse), branches, strict=True):
                found |= read_before_set(body, after)
            known |= branches[0] & branches[1]
        elif isinstance(statement, ast.For | ast.While):
            found |= read_in(statement.iter if isinstance(statement, ast.For) else statement.test) - known
            found |= read_before_set(statement.body, known)
        else:
            found |= read_in(statement) - known
            known |= set_in([statement])
    return found


def read_in(syntax: ast.AST) -> set[str]:
    """Return the names that an expression or a simple statement reads, without the target of `x[i] = 1`."""
    stores = [node for node in ast.walk(syntax) if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store)]
    roots = {id(name) for node in stores for name in names_of(node) if name.id in set_in([syntax])}
    read = {name.id for name in names_of(syntax) if isinstance(name.ctx, ast.Load) and id(name) not in roots}
    return read | (set_in([syntax]) if isinstance(syntax, ast.AugAssign) else set())


@pytest.mark.parametrize("is_gpu", [False, True], ids=["cpu", "gpu"])
@pytest.mark.parametrize("name", PLANS)
def test_variables_that_are_not_stored_are_set_before_they_are_read(name, is_gpu):
    plan = fitted(PLANS[name], is_gpu)
    [function] = syntax_tree(composed(plan).text).body
    place = interval_loop(function)
    loop = function.body[place]
    wanted = live_names(function, place) & set_in([loop]) & set_in(function.body[:place])
    stored = {each.name for each in pausing_of(replace(plan, pauses=True)).carried}
    left = wanted - stored - RESTARTED.keys()
    assert read_before_set([loop], set()) & left <= SET_IN_FIRST_STAGE
    assert ("spring_force" in stored) == ("hinges" in name)
