"""The problems of the verification manual: every value within its tolerance, pages that are those of today's code."""

from __future__ import annotations

import ast
import functools
import importlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from verification import PROBLEMS, Problem, judge
from verification.problem import CLOSED, OPENSEES, PUBLISHED, SCIPY, STORED, Outcome, Row, scales_of

KEPT = ROOT / "docs" / "verification" / "results.json"
ADVICE = "run `python studies/verification.py --out docs/verification`"
FOLDER = ROOT / "tests" / "verification"


@functools.cache
def kept() -> dict:
    return json.loads(KEPT.read_text(encoding="utf-8"))


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda problem: problem.number)
def test_values_are_within_their_tolerances(problem: Problem) -> None:
    found = judge(problem)
    rows = zip(problem.rows, found.independent, found.found, found.differences, found.tolerances, strict=True)
    wrong = [f"{row.name}: {own} for {due} ({off:.2e})" for row, due, own, off, most in rows if not abs(off) <= most]
    assert not wrong, wrong
    assert found.is_passed
    # The pages show these results: stored differences have three digits, and another processor rounds otherwise.
    stored = kept()[problem.number]
    most = 0.05 * found.tolerances + 1e-11
    assert np.all(np.abs(found.differences - np.array(stored["differences"])) <= most), ADVICE
    size = np.maximum(np.abs(found.independent), 1e-300)
    # Values below 1e-3 may be differences of large numbers, such as an error of 2e-5 um of displacements of 1e4 um.
    close = np.minimum(1e-7 * size + 1e-10, 1e-5 * size)
    assert np.all(np.abs(found.independent - np.array(stored["independent"])) <= close), ADVICE
    assert stored["curves"].keys() == found.curves.keys(), ADVICE


def test_the_stored_results_are_of_these_problems() -> None:
    assert list(kept()) == ["machine", *(problem.number for problem in PROBLEMS)]
    for problem in PROBLEMS:
        stored = kept()[problem.number]
        assert len(stored["independent"]) == len(stored["found"]) == len(problem.rows), problem.number


def test_problems_are_numbered_and_described() -> None:
    assert [problem.number for problem in PROBLEMS] == [f"V{i + 1:02}" for i in range(len(PROBLEMS))]
    assert len(PROBLEMS) >= 35
    for problem in PROBLEMS:
        assert problem.kind in (CLOSED, PUBLISHED, OPENSEES, SCIPY, STORED), problem.number
        for text in (problem.source, problem.statement, problem.reason):
            assert text.endswith((".", "x2.2]", ")")), (problem.number, text)
        assert len({row.name for row in problem.rows}) == len(problem.rows), problem.number
        assert 0 < problem.tolerance <= (4 if problem.scale == "error" else 2e-4), problem.number
        assert all(len(line) == 3 for line in problem.inputs), problem.number


def test_tolerances_of_methods_are_far_below_the_wrong_printed_numbers() -> None:
    # A verdict by a wrong printed number would fail: so it is not the printed number that is compared.
    seen = 0
    for problem in PROBLEMS:
        for row, due in zip(problem.rows, kept()[problem.number]["independent"], strict=True):
            if row.printed is not None and due and abs(row.printed / due - 1) > 0.01:
                seen += problem.tolerance < 1e-3
    assert seen > 20


def test_every_tolerance_is_small_beside_its_value() -> None:
    for problem in PROBLEMS:
        if problem.scale == "error":
            continue
        independent = np.array(kept()[problem.number]["independent"])
        allowed = [problem.tolerance if row.tolerance is None else row.tolerance for row in problem.rows]
        allowed *= scales_of(problem, independent, None)
        # A row whose tolerance is of the size of its value would pass for any value; values of 0 have no size.
        assert np.all((allowed <= 0.01 * np.abs(independent)) | (independent == 0)), problem.number


def imports_of(path: Path) -> set[str]:
    """Return the modules that a file imports; modules of the folder `verification` by their bare names."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add((node.module or "").split(".")[0])
    return found


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*_truth.py")), ids=lambda path: path.stem)
def test_independent_results_do_not_use_warpdyn(path: Path) -> None:
    waiting, seen = [path], set()
    while waiting:
        each = waiting.pop()
        seen.add(each.stem)
        used = imports_of(each)
        assert "warpdyn" not in used, each
        near = [folder / f"{name}.py" for name in used - seen for folder in (FOLDER, ROOT / "tests")]
        waiting += [file for file in near if file.is_file()]


def unwrapped(function: Callable) -> Callable:
    return unwrapped(function.func) if isinstance(function, functools.partial) else function


def test_each_problem_takes_its_independent_result_from_a_module_without_warpdyn() -> None:
    for problem in PROBLEMS:
        reference, computed = unwrapped(problem.reference), unwrapped(problem.computed)
        assert reference.__module__.endswith("_truth"), problem.number
        assert not computed.__module__.endswith("_truth"), problem.number
        assert reference.__doc__, problem.number
        assert computed.__doc__, problem.number


def problem_of(reference: Outcome, computed: Outcome, rows: list[Row], **changes: object) -> Problem:
    changes = {"tolerance": 1e-6, "scale": "value", "axes": {}, "marks": {}} | changes
    return replace(PROBLEMS[0], rows=rows, reference=lambda: reference, computed=lambda: computed, **changes)


def test_a_difference_beyond_the_tolerance_and_nan_fail() -> None:
    rows = [Row("u", "m", 5.0), Row("v", "m", None, 1e-3)]
    for values, passes in (
        ([1.0, 100.0], True),
        ([1 + 2e-6, 100.0], False),
        ([1.0, 100.05], True),
        ([1.0, 100.2], False),
    ):
        assert judge(problem_of(Outcome([1.0, 100.0]), Outcome(values), rows)).is_passed is passes, values
    assert judge(problem_of(Outcome([1.0, 1.0]), Outcome([np.nan, 1.0]), rows)).is_passed is False
    found = judge(problem_of(Outcome([1.0, 100.0]), Outcome([1.0 + 1e-5, 100.0]), rows, scale="largest"))
    np.testing.assert_allclose(found.differences, [1e-7, 0], atol=1e-12)  # both are in metres
    found = judge(problem_of(Outcome([1.0, 2.0, 0.1, 0.2]), Outcome([1.1, 2.8]), rows, scale="error", tolerance=4.0))
    np.testing.assert_allclose(found.differences, [1, 4])
    with pytest.raises(AssertionError, match="V01"):
        judge(problem_of(Outcome([1.0]), Outcome([1.0, 1.0]), rows))


def test_pages_have_all_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    pages = importlib.import_module("generate.verification")
    for problem in PROBLEMS:
        text = pages.page(problem, kept()[problem.number], ROOT / "docs")
        for heading in ("## Problem", "## Independent result", "## Results", "## Script"):
            assert heading in text, problem.number
        assert text.count("literalinclude") == 2, problem.number
        assert "**fail**" not in text, problem.number
        name = problem.number.lower()
        assert [f"({name}_{i + 1}.svg)" in text for i in range(len(problem.axes))] == [True] * len(problem.axes)
    worse = kept()["V01"] | {"differences": [1.0, *kept()["V01"]["differences"][1:]]}
    assert "**fail**" in pages.page(PROBLEMS[0], worse, ROOT / "docs")
    text = pages.problem_list(PROBLEMS, kept())
    assert all(f"[{problem.number}]" in text for problem in PROBLEMS)


def test_every_sketch_can_be_drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    sketches = importlib.import_module("generate.verification_sketches")
    for name in {problem.sketch[0] for problem in PROBLEMS}:
        own = next(problem.sketch for problem in PROBLEMS if problem.sketch[0] == name)
        sketches.draw_sketch(*own, tmp_path / f"{name}.svg")
        assert (tmp_path / f"{name}.svg").stat().st_size > 3000, name
