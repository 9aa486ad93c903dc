"""Kernels are put together as text: parts in the slots of a skeleton, and no more than what a plan wants."""

import ast
import inspect
import textwrap
import traceback
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

from warpdyn.engine.kernels.composing import syntax
from warpdyn.engine.kernels.composing.source_text import folded, spliced, without_unread
from warpdyn.engine.kernels.composition import compose, kernel_of
from warpdyn.engine.kernels.slots import Slot

row = wp.types.vector(length=2, dtype=wp.float32)
factor = wp.constant(wp.float32(3.0))


def fill(values: wp.array2d(dtype=wp.float32)):
    """Fill rows."""
    block = wp.tid()
    total = row()
    slot("declare")  # of the parts
    for j in range(LANES):
        # What is there already.
        total[j] = values[block, j]
        if IS_LOUD and total[j] > wp.float32(1.0):
            total[j] += wp.float32(100.0)
        slot("add")

        slot("at", i=1)
    for j in range(LANES):
        values[block, j] = total[j]


class first:
    """Adds what it counts."""

    def wanted(plan):
        return True

    def names(plan):
        return {"LANES": 2, "IS_LOUD": plan.loud}

    def declare():
        counted = row()  # how often

    def add():
        """The docstring is no statement."""
        # Twice.
        counted[j] += factor
        if SECOND:
            total[j] += counted[j]
        else:
            total[j] -= counted[j]


class second:
    def wanted(plan):
        return plan.second

    def add():
        total[j] *= wp.float32(10.0)

    def at():
        total[i] += wp.float32(0.5)


# Variables that parts may change in each slot.
TABLE = {
    "declare": Slot("kernel", "Declare."),
    "add": Slot("lane", "Add to the lane.", (), ("total",)),
    "at": Slot("storey", "Add to a lane.", (), ("total",)),
}


def text_of(**plan):
    return compose(fill, SimpleNamespace(**plan), (first, second), TABLE).text


QUIET = '''def fill(values: wp.array2d(dtype=wp.float32)):
    """Fill rows."""
    block = wp.tid()
    total = row()
    counted = row()  # how often
    for j in range(LANES):
        # What is there already.
        total[j] = values[block, j]
        # Twice.
        counted[j] += factor
        total[j] -= counted[j]
    for j in range(LANES):
        values[block, j] = total[j]
'''
LOUD = '''def fill(values: wp.array2d(dtype=wp.float32)):
    """Fill rows."""
    block = wp.tid()
    total = row()
    counted = row()  # how often
    for j in range(LANES):
        # What is there already.
        total[j] = values[block, j]
        if total[j] > wp.float32(1.0):
            total[j] += wp.float32(100.0)
        # Twice.
        counted[j] += factor
        total[j] += counted[j]
        total[j] *= wp.float32(10.0)

        total[1] += wp.float32(0.5)
    for j in range(LANES):
        values[block, j] = total[j]
'''


def test_only_wanted_parts_are_there():
    assert text_of(loud=False, second=False) == QUIET
    assert text_of(loud=True, second=True) == LOUD


def test_a_composed_kernel_runs_and_shows_its_source():
    composed = compose(fill, SimpleNamespace(loud=False, second=False), (first, second), TABLE)
    assert set(composed.names) == {"LANES", "row", "factor", "wp"}
    kernel = kernel_of(composed, {"max_unroll": 1})
    assert inspect.getsource(kernel.func) == QUIET
    values = wp.array(np.array([[1.0, 2.0], [4.0, 8.0]], np.float32), device="cpu")
    wp.launch(kernel, dim=2, inputs=[values], device="cpu")
    np.testing.assert_array_equal(values.numpy(), [[-2, -1], [1, 5]])
    with pytest.raises(Exception) as raised:  # noqa: PT011 - what warp raises outside of a kernel
        kernel.func(None)
    assert "block = wp.tid()" in "".join(traceback.format_exception(raised.value))


def test_parts_that_disagree_are_told():
    class other:
        def wanted(plan):
            return True

        def names(plan):
            return {"LANES": 4}

    with pytest.raises(
        ValueError, match="gives LANES the value 4, but another part or the skeleton gives 2: rename it in part"
    ):
        compose(fill, SimpleNamespace(loud=False), (first, other), TABLE)


def lines(text):
    return textwrap.dedent(text).strip() + "\n"


FOLDED = [
    (
        """
        if A:
            # Kept.
            x = f(1)
        else:
            x = f(2)
        """,
        """
        # Kept.
        x = f(1)
        """,
    ),
    (
        """
        # This goes too.
        if B:
            x = f(1)
        y = f(
            2,  # as it stands
        )
        """,
        """
        y = f(
            2,  # as it stands
        )
        """,
    ),
    (
        """
        if y > 0:
            x = f(1)
        elif B:
            x = f(2)
        elif y < 0:
            x = f(3)
        elif A:
            x = f(4)
        else:
            x = f(5)
        """,
        """
        if y > 0:
            x = f(1)
        elif y < 0:
            x = f(3)
        else:
            x = f(4)
        """,
    ),
    (
        """
        if B:
            x = f(1)
        elif y < 0:
            x = f(2)
        else:
            if A:
                x = f(3)
        """,
        """
        if y < 0:
            x = f(2)
        else:
            x = f(3)
        """,
    ),
    (
        """
        if A and (y > 0 or B) and not B:
            x = f(1)
        if (
            B
            or y > 0  # two
            or (y < 0 and A and z < 0)
        ):
            x = f(2)
        if N > 2 or y > 0:
            x = f(3)
        """,
        """
        if y > 0:
            x = f(1)
        if y > 0 or (y < 0 and z < 0):
            x = f(2)
        x = f(3)
        """,
    ),
    (
        """
        for m in range(1, ONE):
            x = f(m)
        for i in range(N):
            # Not a word is left.
            for m in range(NONE):
                x = f(m)
            if y > 0:
                if B:
                    x = f(i)
        z = f(1)
        """,
        """
        z = f(1)
        """,
    ),
    (
        """
        x[a if A else b] = f(3) if B else (f(4) if y > 0 else z)
        """,
        """
        x[a] = f(4) if y > 0 else z
        """,
    ),
    (
        """
        if y > 0:
            if B:
                x = f(1)
        else:
            x = f(2)
        """,
        """
        if y > 0:
            pass
        else:
            x = f(2)
        """,
    ),
]
HEADER = "def work(y, z, f):\n"


@pytest.mark.parametrize(("given", "due"), FOLDED)
def test_known_values_are_folded_away(given, due):
    def work(text):
        return HEADER + "".join(f"    {line}\n" for line in lines(text).splitlines())

    assert folded(work(given), {"A": True, "B": False, "N": 3, "ONE": 1, "NONE": 0}) == work(due)


def test_what_nobody_reads_is_left_out():
    text = """
    def work(values, output):
        '''Work.'''
        kept = f(1)
        # Neither is read, but by the other.
        one = f(2)
        other = f(3)
        for i in range(3):
            one[i] += other[i]
            other[i] = one[i] + kept
        first, second = f(4)
        third, fourth = f(5)
        effect = f(output)
        f(second, kept)
        if kept > 0:
            # A branch of nothing.
            fifth = kept
    """
    due = """
    def work(values, output):
        '''Work.'''
        kept = f(1)
        first, second = f(4)
        effect = f(output)
        f(second, kept)
    """
    assert without_unread(lines(text)) == lines(due)


def test_slots_in_parts_are_filled_too():
    class outer:
        def at():
            x = f(i)
            slot("inner")

    class inner:
        def inner():
            y = f(x)

    text = lines("""
    def work(f):
        for i in range(2):
            slot("at", i=0)
    """)
    assert spliced(text, (outer, inner)) == lines("""
    def work(f):
        for i in range(2):
            x = f(0)
            y = f(x)
    """)


def test_names_are_written_as_the_nearest_slot_says():
    class outer:
        def at():
            x = f(i, length)
            slot("inner", i=other)

    class inner:
        def inner():
            y = f(i, length)

    text = lines("""
    def work(f, other):
        slot("at", i=0)
        z = f(length)
    """)
    assert spliced(text, (outer, inner), (("length", "width"), ("other", "third"))) == lines("""
    def work(f, other):
        x = f(0, width)
        y = f(third, width)
        z = f(width)
    """)


@pytest.mark.parametrize("mistakes", [2, syntax.ATTEMPTS])
def test_a_text_is_parsed_again_after_a_mistake_of_python(monkeypatch, mistakes):
    parse, attempts = ast.parse, []

    def parse_at_last(text):
        attempts.append(text)
        if len(attempts) <= mistakes:
            raise SystemError("AST constructor recursion depth mismatch (before=216, after=233)")
        return parse(text)

    monkeypatch.setattr(syntax, "ast", SimpleNamespace(parse=parse_at_last))
    if mistakes < syntax.ATTEMPTS:
        assert ast.unparse(syntax.syntax_tree("a = 1")) == "a = 1"
        assert len(attempts) == mistakes + 1
    else:
        with pytest.raises(SystemError, match="recursion depth"):
            syntax.syntax_tree("a = 1")
