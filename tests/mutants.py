"""Mutation testing: change one operator or number of the package at a time, and see whether a test fails.

    python tests/mutants.py list [--count 150] [--seed 1]            the mutants that `run` tries
    python tests/mutants.py baseline RESULTS.jsonl                   tests that fail without a mutant, to leave them out
    python tests/mutants.py run RESULTS.jsonl [--processes 2] ...     tries those that the file does not contain yet

A mutant is killed if a test fails, and survives if all tests pass. The tests run in three stages, until one fails: the
files that import the changed module or call one of its public names, then all fast tests, then (with `--all`) the rest.
Mutants that cannot change any result are listed in EQUIVALENT, each with its proof.
"""

from __future__ import annotations

import argparse
import ast
import copy
import itertools
import json
import os
import queue
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = (
    "answers/fragility",
    "answers/risk",
    "campaigns/reductions",
    "engine/laws",
    "engine/kernels",
    "model/ground_motions",
    "model/scene",
)
MOST_TEST_FILES = 12  # in the first stage
PATIENCE = 900  # a stage that takes longer counts as failed: a mutant may loop for ever [s]
RESULTS_OF_TESTS = (0, 1, 2, 5)  # exit status of pytest: passed, failed, error of collection, no test selected
# Functions whose result is text for people, which tests need not repeat word by word.
TEXT_ONLY = re.compile(r"__repr__|_repr_html_|description|warn|message|html|sentence|tell")

COMPARISONS = {ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq}
ARITHMETIC = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
FUNCTIONS = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any"}

# Mutants that change no result: file, original, changed -> proof. Original and changed are expressions, or whole lines
# if the file contains the expression in other places, too.
EQUIVALENT: dict[tuple[str, str, str], str] = {
    (
        "warpdyn/answers/fragility/maximum_likelihood/newton.py",
        "least = value - 1e-13 * np.abs(value)",
        "least = value - 1.25e-13 * np.abs(value)",
    ): "the functions are concave with one maximum, and the search ends by the length of the step; a bound above the "
    "rounding of the value decides only whether a step that changes nothing but rounding is halved",
    (
        "warpdyn/answers/fragility/lognormal_fit.py",
        "_BLOCK = 1 << 14  # number of rows fitted at a time, which limits the memory and fits in the cache",
        "_BLOCK = 1 << 15  # number of rows fitted at a time, which limits the memory and fits in the cache",
    ): "rows are fitted independently of each other, so the number of rows at a time changes only memory and time",
    (
        "warpdyn/campaigns/reductions/workers.py",
        "self.stream = wp.Stream(device, priority=-1)",
        "self.stream = wp.Stream(device, priority=-2)",
    ): "Warp clamps the priority to -1 and 0",
    (
        "warpdyn/campaigns/reductions/workers.py",
        "return order, np.append(start, order.size).astype(np.int32), 1",
        "return order, np.append(start, order.size).astype(np.int32), 2",
    ): "a thread adds two units of a group one after the other instead of one; their sums are exact in any order",
    (
        "warpdyn/engine/kernels/parts/straight_branches.py",
        "leaving = int(0)",
        "leaving = int(1)",
    ): "leaving only skips a loop that selects, for each lane that has not left its branch, the values that it has",
    (
        "warpdyn/model/ground_motions/records/formats/running_values.py",
        "common, alike = Counter(ends).most_common(1)[0]",
        "common, alike = Counter(ends).most_common(2)[0]",
    ): "the first of the two most common elements is the most common one",
    (
        "warpdyn/model/ground_motions/filtered_noise.py",
        "np.abs(left).max() > np.finfo(float).eps ** 2",
        "(np.abs(left).max() >= np.finfo(float).eps ** 2)",
    ): "one doubling more, if the growth is exactly eps^2, adds eps^4 of the covariance, less than its rounding",
    (
        "warpdyn/model/ground_motions/response_spectra.py",
        "is_sharp = share > 0.1",
        "is_sharp = share > 0.125",
    ): "the bound holds for each share above 0; it decides only which oscillators search all steps for a peak",
    (
        "warpdyn/model/scene/plausibility.py",
        "MOST_GIVEN = 1024  # structures of GivenValues that are checked, evenly spread",
        "MOST_GIVEN = 1025  # structures of GivenValues that are checked, evenly spread",
    ): "a bound of the work for warnings that may be any number: of a longer list, one structure more is checked",
}


@dataclass(frozen=True)
class Mutant:
    """One change of the package: where it is, and the expression before and after."""

    path: str
    line: int
    start: int
    end: int
    before: str
    after: str

    @property
    def proof(self) -> str | None:
        """Proof that the mutant changes no result, from EQUIVALENT; None if there is none."""
        source = (ROOT / self.path).read_bytes()
        first = source.rfind(b"\n", 0, self.start) + 1
        last = source.find(b"\n", self.end)
        changed = source[first : self.start] + self.after.encode() + source[self.end : last]
        line = source[first:last].decode().strip(), changed.decode().strip()
        return EQUIVALENT.get((self.path, self.before, self.after)) or EQUIVALENT.get((self.path, *line))

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.before}  ->  {self.after}"


def mutated(node: ast.expr) -> ast.expr | None:
    """Return an expression with its operator or its number changed, or None if there is no such change."""
    changed = copy.deepcopy(node)
    if isinstance(changed, ast.Compare) and type(changed.ops[0]) in COMPARISONS:
        changed.ops[0] = COMPARISONS[type(changed.ops[0])]()
    elif isinstance(changed, ast.BinOp) and type(changed.op) in ARITHMETIC:
        is_text = any(
            isinstance(each, ast.Constant | ast.JoinedStr | ast.List | ast.Tuple) and not _is_number(each)
            for each in (changed.left, changed.right)
        )
        if is_text:
            return None
        changed.op = ARITHMETIC[type(changed.op)]()
    elif isinstance(changed, ast.BoolOp):
        changed.op = ast.Or() if isinstance(changed.op, ast.And) else ast.And()
    elif isinstance(changed, ast.UnaryOp) and not _is_number(changed.operand):
        return changed.operand
    elif isinstance(changed, ast.Call) and isinstance(changed.func, ast.Attribute) and changed.func.attr in FUNCTIONS:
        changed.func.attr = FUNCTIONS[changed.func.attr]
    elif _is_number(changed):
        changed.value = changed.value + 1 if isinstance(changed.value, int) else changed.value * 1.25 or 0.25
    else:
        return None
    return changed


def _is_number(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool)


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Yield the possible mutants of a file, with the offsets [bytes] of what they replace."""
    source = path.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node in _changeable(ast.parse(source)):
        changed = mutated(node)
        if changed is None or node.end_lineno is None or node.end_col_offset is None:
            continue
        first, last = starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset
        before = source[first:last].decode()
        after = f"({ast.unparse(changed)})" if not isinstance(changed, ast.Constant) else ast.unparse(changed)
        yield Mutant(str(path.relative_to(ROOT)), node.lineno, first, last, before, after)


def _changeable(tree: ast.AST) -> Iterator[ast.expr]:
    """Yield expressions outside of annotations, text, error messages and functions that only make text."""
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "decorator_list", "type_params"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.FunctionDef) and TEXT_ONLY.search(child.name):
                continue
            if isinstance(child, ast.Raise | ast.JoinedStr) or not isinstance(child, ast.AST):
                continue
            if isinstance(child, ast.expr):
                yield child
            yield from _changeable(child)


def chosen(count: int, seed: int) -> list[Mutant]:
    """Return mutants drawn at random, as many of each package, and at most one of a line."""
    draw, found = random.Random(seed), list[Mutant]()
    for number, package in enumerate(PACKAGES):
        share = count * (number + 1) // len(PACKAGES) - count * number // len(PACKAGES)
        files = sorted((ROOT / "warpdyn" / package).rglob("*.py"))
        possible = [mutant for path in files for mutant in mutants_of(path)]
        by_line = {(mutant.path, mutant.line): mutant for mutant in draw.sample(possible, len(possible))}
        found += draw.sample(list(by_line.values()), share)
    return found


def tests_of(mutant: Mutant) -> list[str]:
    """Return the test files that import the mutant's module or use a public name of it, the most specific first."""
    module = mutant.path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
    stub = (ROOT / "warpdyn" / "__init__.pyi").read_text()
    relative = module.removeprefix("warpdyn")
    names = re.findall(rf"^from {re.escape(relative)} import (.*)$", stub, re.MULTILINE)
    public = [name for line in names for name in re.findall(r"\w+ as (\w+)", line)]
    package = module.rpartition(".")[0]
    scores: list[tuple[int, str]] = []
    for path in sorted((ROOT / "tests").glob("test_*.py")):
        text = path.read_text()
        score = 10 * len(re.findall(rf"\b{re.escape(module)}\b", text))
        score += sum(2 * len(re.findall(rf"\bwd\.{name}\b", text)) for name in public)
        score += len(re.findall(rf"\b{re.escape(package)}\.", text))
        score += 3 * (module.split(".")[-2] in path.stem or module.split(".")[-1] in path.stem)
        if score:
            scores.append((-score, f"tests/{path.name}"))
    return [name for _, name in sorted(scores)[:MOST_TEST_FILES]]


def failing(results: Path) -> Path:
    """Return the file with the tests that fail without a mutant, such as tests that need a package that is missing."""
    return results.with_suffix(".failing")


def baseline(results: Path, processes: int) -> None:
    """Run each test file without a mutant, and write the names of the tests that fail."""

    def failed(path: Path, core: int) -> list[str]:
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-n0",
            "-m",
            "not thorough",
            "-p",
            "no:cacheprovider",
            str(path),
        ]
        pinned = ["taskset", "-c", str(core), *command]
        done = subprocess.run(pinned, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode not in RESULTS_OF_TESTS:
            raise RuntimeError(f"pytest ran no test: {done.stdout[-1000:]}{done.stderr[-1000:]}")
        return re.findall(r"^(?:FAILED|ERROR) (\S.*?)(?: - .*)?$", done.stdout, re.MULTILINE)

    cores = itertools.cycle(sorted(os.sched_getaffinity(0))[:processes])
    with ThreadPoolExecutor(processes) as pool:
        found = pool.map(failed, sorted((ROOT / "tests").glob("test_*.py")), cores)
        names = [name for each in found for name in each]
    failing(results).write_text("\n".join(sorted(set(names))))
    print(f"{len(names)} tests are left out")


def left_out(results: Path) -> list[str]:
    """Return pytest's arguments that leave out the tests that fail without a mutant."""
    names = failing(results).read_text().splitlines() if failing(results).exists() else []
    return [f"--deselect={name}" if "::" in name else f"--ignore={name}" for name in names]


def tried(mutant: Mutant, *, runs_all: bool, without: list[str], core: int) -> dict[str, object]:
    """Return the fate of a mutant: "killed" with the stage and the failed test, or "survived".

    Args:
        mutant: The mutant.
        runs_all: Whether the slow tests run, too.
        without: Arguments that leave out tests.
        core: Processor core on which its tests run.
    """
    with tempfile.TemporaryDirectory() as folder:
        copied = Path(folder) / "copy"
        shutil.copytree(
            ROOT, copied, ignore=shutil.ignore_patterns(".git", "results", "build", ".venv", ".dev", "__pycache__")
        )
        target = copied / mutant.path
        source = target.read_bytes()
        target.write_bytes(source[: mutant.start] + mutant.after.encode() + source[mutant.end :])
        stages = {"own": tests_of(mutant), "fast": ["-m", "fast"]} | ({"all": ["-m", "not fast"]} if runs_all else {})
        for stage, arguments in stages.items():
            if not arguments:
                continue
            command = [
                sys.executable,
                "-m",
                "pytest",
                "-x",
                "-q",
                "-n0",
                "-p",
                "no:cacheprovider",
                *without,
                *arguments,
            ]
            paths = os.pathsep.join([str(copied), *filter(None, [os.environ.get("PYTHONPATH")])])
            environment = os.environ | {"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"}
            try:
                done = subprocess.run(
                    ["taskset", "-c", str(core), *command],
                    cwd=copied,
                    env=environment,
                    capture_output=True,
                    text=True,
                    timeout=PATIENCE,
                    check=False,
                )
            except subprocess.TimeoutExpired:
                return {"result": "killed", "stage": stage, "by": "timeout"}
            if done.returncode not in RESULTS_OF_TESTS:
                raise RuntimeError(f"pytest ran no test: {done.stdout[-1000:]}{done.stderr[-1000:]}")
            if done.returncode in (1, 2):
                failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
                return {"result": "killed", "stage": stage, "by": failed[0] if failed else done.stdout[-300:]}
    return {"result": "survived"}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=("list", "baseline", "run"))
    parser.add_argument("results", nargs="?", type=Path)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--all", action="store_true", help="run the slow tests, too, before a mutant survives")
    arguments = parser.parse_args()
    mutants = chosen(arguments.count, arguments.seed)
    if arguments.action == "list":
        print(*mutants, sep="\n")
        return 0
    if arguments.results is None:
        parser.error(f"give a file for the results: python tests/mutants.py {arguments.action} RESULTS.jsonl")
    if arguments.action == "baseline":
        baseline(arguments.results, arguments.processes)
        return 0
    found: dict[str, dict[str, object]] = {}
    if arguments.results.exists():
        found = {each["mutant"]: each for each in map(json.loads, arguments.results.read_text().splitlines())}

    cores, without = queue.SimpleQueue[int](), left_out(arguments.results)
    for core in sorted(os.sched_getaffinity(0))[: arguments.processes]:
        cores.put(core)

    def attempt(mutant: Mutant) -> None:
        core = cores.get()
        fate = tried(mutant, runs_all=arguments.all, without=without, core=core)
        cores.put(core)
        result = {"mutant": str(mutant), **fate, **asdict(mutant)}
        with arguments.results.open("a") as file:
            file.write(json.dumps(result) + "\n")
        print(result["result"], result.get("stage", ""), mutant, flush=True)
        found[str(mutant)] = result

    with ThreadPoolExecutor(arguments.processes) as pool:
        list(pool.map(attempt, [mutant for mutant in mutants if str(mutant) not in found]))
    results = [found[str(mutant)] for mutant in mutants]
    survived = [mutant for mutant, each in zip(mutants, results, strict=True) if each["result"] == "survived"]
    unproven = [each for each in survived if each.proof is None]
    print(f"{len(mutants)} mutants: {len(mutants) - len(survived)} killed, {len(survived) - len(unproven)} equivalent")
    print(*(f"survived: {each}" for each in unproven), sep="\n")
    return int(len(unproven) > 0.05 * len(mutants))


if __name__ == "__main__":
    sys.exit(main())
