"""The examples of docstrings, which go on from the package's own, run and show what they say."""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import pytest
from docstring_files import write_files

import warpdyn as wd

PACKAGE = Path(wd.__file__).parent


def elements_with_examples() -> Iterator[tuple[str, Any]]:
    """Give every class, function and method of the package whose docstring has an example, by its full name."""
    for path in sorted(PACKAGE.rglob("*.py")):
        if ">>>" in (text := path.read_text()):
            module = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")
            yield from _elements_of(ast.parse(text), module, importlib.import_module(module))


def _elements_of(tree: ast.AST, name: str, owner: Any) -> Iterator[tuple[str, Any]]:
    """Give those of a module or a class."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            full, element = f"{name}.{node.name}", getattr(owner, node.name)
            if ">>>" in (ast.get_docstring(node) or ""):
                yield full, element
            yield from _elements_of(node, full, element) if isinstance(node, ast.ClassDef) else ()


EXAMPLES = dict(elements_with_examples())
NOT_IN_TEST_EXTRA = ("obspy",)  # packages that examples import, and the tests' installation need not have


def run(element: Any, name: str, namespace: dict[str, Any]) -> dict[str, Any]:
    """Run the example of a docstring in a copy of a namespace, and return what it leaves there."""
    (example,) = doctest.DocTestFinder(recurse=False).find(element, name, module=False, globs=namespace)
    assert example.examples
    report: list[str] = []
    doctest.DocTestRunner().run(example, out=report.append, clear_globs=False)
    assert not report, "".join(report)
    return example.globs


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the files that examples read."""
    path = tmp_path_factory.mktemp("examples")
    write_files(path)
    return path


@pytest.fixture(scope="module")
def namespace() -> dict[str, Any]:
    """Return what the example of the package leaves, which all others go on from."""
    return run(wd, "warpdyn", {})


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.usefixtures("forgotten_recorders")
def test_an_example(name, namespace, folder, monkeypatch):
    for package in NOT_IN_TEST_EXTRA:
        if f"import {package}\n" in inspect.getdoc(EXAMPLES[name]):
            pytest.importorskip(package)
    monkeypatch.chdir(folder)
    matplotlib.use("agg")
    element = EXAMPLES[name]
    # What is called by its name alone is no public name; its example is of names of its module.
    is_called_alone = re.search(rf">>> (.*[ (])?{element.__name__}\(", inspect.getdoc(element))
    run(element, name, dict(vars(sys.modules[element.__module__])) if is_called_alone else namespace)
    plt.close("all")


def test_an_example_that_shows_something_else_fails():
    def doubled(number: int) -> int:
        """Return twice a number.

        Example:
            >>> 2 * 3
            5
        """
        return 2 * number

    with pytest.raises(AssertionError, match=r"Expected:\s+5\s+Got:\s+6"):
        run(doubled, "doubled", {})
