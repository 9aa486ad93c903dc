"""Kernels that can pause: the variables that they store, and their text."""

from __future__ import annotations

import ast
import re
from dataclasses import replace

import numpy as np
import pytest
from law_rows import rules_of

from warpdyn.engine.kernels.build import composed, fitted, pausing_of
from warpdyn.engine.kernels.pausing.liveness import interval_loop, live_names, set_in
from warpdyn.engine.kernels.plan import Plan

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
    "dense": chain(family="dense", law=rules_of("elastic"), damping="matrix", recorders=("displacement",)),
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
    known = ("def ", "first: int", "for interval in range(", "base_at_end[j] = loads.values")
    assert [line for line in changed if not line.strip().startswith(known)] == []
    names = {each.name for each in found.carried}
    assert len(names) == len(found.carried)
    for each in found.carried:
        assert sum(bool(re.match(rf" +{each.name}(\[.*\])? = paused", line)) for line in added) == 1  # loaded once
        assert sum(bool(re.search(rf"paused.* = {each.name}(\[|$)", line)) for line in added) == 1  # stored once
    assert composed(replace(plan, pauses=True)) is found.composed


def test_the_rows_of_variables_do_not_overlap():
    found = pausing_of(replace(fitted(PLANS["collapse and energy"], False), pauses=True))
    for array in ("real", "real64", "whole"):
        rows = [np.arange(each.first, each.first + each.rows) for each in found.carried if each.array == array]
        rows = np.concatenate([np.zeros(0, int), *rows])
        assert len(set(rows.tolist())) == rows.size
        assert found.rows(array) == max(1, rows.size)
