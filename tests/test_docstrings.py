"""Docstrings of public names: a sentence, arguments with units, errors, an example."""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import pytest
from public_names import CALLABLE, CALLED, EVERY, problems

import warpdyn as wd

pytestmark = pytest.mark.fast
SOURCES = sorted(Path(wd.__file__).parent.rglob("*.py"))


@pytest.mark.parametrize("name", CALLED)
def test_a_public_name_is_documented(name):
    assert problems(name, CALLED[name]) == []


@pytest.mark.parametrize("name", [name for name in EVERY if name not in CALLABLE])
def test_a_public_constant_has_a_comment_that_sphinx_reads(name):
    described = re.compile(rf"^#: [A-Z].*\.\n(#: .*\n)*{name.rpartition('.')[2]}\b", re.MULTILINE)
    assert any(described.search(path.read_text()) for path in SOURCES)


def pushed(building: wd.ShearBuilding, drift: float, *, pattern: str = "uniform") -> float:
    """Return the base shear of a building that is pushed.

    Args:
        building: The building.
        drift: Roof drift [m], shape [step].
        pattern: "uniform".

    Raises:
        ValueError: If the drift is below 0, or the pattern unknown.

    Example:
        >>> pushed(building, 0.1)
    """
    _check(drift)
    return drift


def _check(drift: float) -> None:
    if drift < 0:
        raise ValueError("below 0")


LACKING = {
    "no docstring": (r"(?s).*", "", ["begins", "example", "building", "drift", "pattern", "ValueError"]),
    "a fragment": ("pushed\\.", "pushed", ["begins"]),
    "no example": (r"(?s)\n\nExample:.*", "", ["example"]),
    "an example in words": (">>> ", "", ["example"]),
    "an argument that is not described": ("    building: The building.\n", "", ["building"]),
    "a renamed argument": ("pattern:", "loads:", ["pattern", "loads"]),
    "no unit": (r" \[m\]", "", ["unit for drift"]),
    "a shape, which is no unit": (r"\[m\], shape \[step\]", "[step, storey]", ["unit for drift"]),
    "no errors": (r"(?s)Raises:.*(?=Example)", "", ["raises ValueError"]),
    "another error": ("ValueError: If", "TypeError: If", ["raises ValueError"]),
}


@pytest.mark.parametrize("what", LACKING)
def test_what_a_docstring_lacks_is_found(what: str, monkeypatch: Any) -> None:
    pattern, other, words = LACKING[what]
    monkeypatch.setattr(pushed, "__module__", "warpdyn.test")  # errors are sought in functions of warpdyn alone
    monkeypatch.setattr(_check, "__module__", "warpdyn.test")
    assert problems("pushed", pushed) == []
    text = re.sub(pattern, other, inspect.getdoc(pushed), count=1)
    monkeypatch.setattr(pushed, "__doc__", text)
    found = problems("pushed", pushed)
    assert len(found) == len(words), found
    assert all(word in sentence for word, sentence in zip(words, found, strict=True)), found
