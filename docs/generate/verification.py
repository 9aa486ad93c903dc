"""Pages of the verification manual: one per problem of tests/verification, with the results that a study stored."""

from __future__ import annotations

import functools
import importlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from generate.tables import table, write
from generate.theory import is_outdated
from generate.verification_figures import draw_curve
from generate.verification_sketches import draw_sketch

ROOT = Path(__file__).parents[2]


def write_pages(docs: Path) -> None:
    """Write a page and figures for each problem, and the tables of the first page.

    Raises:
        ValueError: If the stored results are not those of the problems.
    """
    problems = importlib.import_module("verification").PROBLEMS
    kept = docs / "verification" / "results.json"
    results = json.loads(kept.read_text(encoding="utf-8"))
    out = docs / "verification" / "generated"
    if results.keys() - {"machine"} != {problem.number for problem in problems}:
        raise ValueError(
            "results.json has other problems: run `python studies/verification.py --out docs/verification`"
        )
    sources = [kept, *(docs / "generate").glob("verification*.py"), *(ROOT / "tests" / "verification").glob("*.py")]
    for problem in problems:
        own = results[problem.number]
        name = problem.number.lower()
        write(out / f"{name}.md", page(problem, own, docs))
        if is_outdated(out / f"{name}_sketch.svg", sources):
            draw_sketch(*problem.sketch, out / f"{name}_sketch.svg")
        for i, figure in enumerate(problem.axes):
            if is_outdated(out / f"{name}_{i + 1}.svg", sources):
                draw_curve(problem, figure, own["curves"][figure], out / f"{name}_{i + 1}.svg")
    write(out / "_list.md", problem_list(problems, results))


def largest(own: dict[str, Any]) -> float:
    """Return the largest absolute difference of a problem."""
    return max(abs(value) for value in own["differences"])


def difference(problem: Any, value: float) -> str:
    """Return a difference in words."""
    if problem.scale == "error":
        return f"{value:.2f} standard errors"
    return "0" if value == 0 else f"{value:.1e}"


def verdict(problem: Any, own: dict[str, Any]) -> str:
    """Return whether all rows are within their tolerances."""
    allowed = [problem.tolerance if row.tolerance is None else row.tolerance for row in problem.rows]
    return "pass" if all(abs(d) <= a for d, a in zip(own["differences"], allowed, strict=True)) else "**fail**"


def problem_list(problems: Any, results: dict[str, Any]) -> str:
    """Return the tables of all problems, one per group."""
    groups: dict[str, list[tuple[str, ...]]] = {}
    for problem in problems:
        own = results[problem.number]
        link = f"[{problem.number}](generated/{problem.number.lower()}.md)"
        line = (link, problem.title, problem.kind, short(problem.source), difference(problem, largest(own)))
        groups.setdefault(problem.group, []).append((*line, verdict(problem, own)))
    head = ("problem", "title", "kind of check", "source", "largest difference", "verdict")
    rows = sum(len(problem.rows) for problem in problems)
    passed = sum(verdict(problem, results[problem.number]) == "pass" for problem in problems)
    words = f"{len(problems)} problems with {rows} compared values, {passed} within their tolerances. Computed with "
    parts = [f"{words}{results['machine']}, in double precision on the CPU."]
    return "\n\n".join([*parts, *(f"### {name}\n\n{table(head, lines)}" for name, lines in groups.items())]) + "\n"


def short(source: str) -> str:
    """Return the beginning of a source, up to its first detail."""
    ends = [i for mark in ("; ", ". ", ": ", " (", ", figures", ", section") if (i := source.find(mark)) > 12]
    return source[: min(ends, default=len(source))].rstrip(".")


def number(value: float | None, digits: int = 8) -> str:
    """Return a number, or a dash."""
    return "-" if value is None else f"{value:.{digits}g}".replace("e-0", "e-").replace("e+0", "e")


def page(problem: Any, own: dict[str, Any], docs: Path) -> str:
    """Return the page of a problem."""
    name = problem.number.lower()
    inputs = table(("input", "value", "unit"), problem.inputs)
    rows = []
    for row, independent, found, off in zip(
        problem.rows, own["independent"], own["found"], own["differences"], strict=True
    ):
        allowed = problem.tolerance if row.tolerance is None else row.tolerance
        judged = "pass" if abs(off) <= allowed else "**fail**"
        shown = f"{off:.2f}" if problem.scale == "error" else difference(problem, off)
        cells = (number(row.printed), number(independent), number(found), shown, f"{allowed:g}", judged)
        rows.append((row.name, "" if row.unit == "1" else row.unit, *cells))
    head = ("quantity", "unit", "printed", "independent", "warpdyn", "difference", "tolerance", "verdict")
    scale = {
        "value": "Differences are relative to the independent value.",
        "largest": "Differences are relative to the largest independent value with the same unit.",
        "error": "Differences are in standard errors of the independent result.",
    }[problem.scale]
    figures = [
        f"![{figure} by both methods, problem {problem.number}]({name}_{i + 1}.svg)"
        for i, figure in enumerate(problem.axes)
    ]
    worst = difference(problem, largest(own))
    parts = [
        f"# {problem.number} {problem.title}",
        f"**Kind of check:** {problem.kind}. **Largest difference:** {worst}. **Verdict:** {verdict(problem, own)}.",
        f"## Problem\n\n{problem.statement}",
        f"![Sketch of problem {problem.number}: {problem.title}]({name}_sketch.svg)",
        inputs,
        f"## Independent result\n\n{problem.source}",
        f"## Results\n\n{table(head, rows)}",
        f"{scale} The verdict compares warpdyn with the independent value, never with the printed one. "
        f"Tolerance: {problem.reason}",
        *figures,
    ]
    if problem.notes:
        parts.append(f"## Remarks\n\n{problem.notes}")
    parts.append(f"## Script\n\nwarpdyn:\n\n{script(problem.computed, docs)}")
    parts.append(f"Independent result:\n\n{script(problem.reference, docs)}")
    command = f"python -m pytest -n 0 tests/test_verification_problems.py -k {problem.number}"
    parts.append(f"Run the comparison: `{command}`.")
    return "\n\n".join(parts) + "\n"


def script(function: Callable, docs: Path) -> str:
    """Return the directive that shows a function from its file."""
    while isinstance(function, functools.partial):
        function = function.func
    function = getattr(function, "__wrapped__", function)
    module = importlib.import_module(function.__module__)
    path = os.path.relpath(str(module.__file__), docs / "verification" / "generated")
    return f"```{{literalinclude}} {path}\n:pyobject: {function.__name__}\n:language: python\n```"
