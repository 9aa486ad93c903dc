"""Compose the source text of a kernel from a skeleton and the parts that a scene needs.

A skeleton is a function that is never called. Its text is a time loop with statements `slot("name")`. Such a statement
is replaced, at its indentation, by the bodies of the functions `name` of all parts that the kernel needs, one after
another. These bodies become statements of the kernel and share its variables; the functions themselves are never
called. `slot("name", i=0)` writes 0 for the variable `i` in these bodies and in the slots inside them. Parts, and the
module of a skeleton, may contain slots.

A part is a module in one of FOLDERS, or a class. It contains

- `wanted(plan)`: whether the kernel of a plan contains the part;
- a function without arguments for each slot that it fills, with the name of the slot (slots.py lists all slots);
- `names(plan)`, optional: a dictionary of constants, types and device functions that depend on the plan. If a value is
  a string, it replaces the name in the text (a string of several lines replaces a whole statement). Names that do not
  depend on the plan are imported or defined in the module of the part;
- `order`, optional: a number that sorts the parts of a folder within a slot (default 0; parts with equal numbers are
  sorted by name). Folders have the order of FOLDERS;
- `BORROWS`, optional: variables of other parts that the part reads or changes: {part: names};
- `FIELDS`, optional: fields of the kernel's arguments that the part needs: {struct: {field: type}}.

Names in capitals are conditions whose value is known: names of `names`; the name of each part (P_DELTA: true if the
kernel contains the part); the name of each skeleton (EXPLICIT_CHAIN); and HAS_ with the name of a slot (HAS_ADD_LOAD:
true if a part of the kernel fills the slot). Branches of an `if` that never run are removed; so are loops over empty
ranges. A `while` whose condition is known to be true runs once.

Finally, assignments to variables that are never read are removed, with their declarations; so are empty loops and
branches. Therefore a function that is called in an assignment must have no side effects, unless `output` or `history`
is among its arguments.
"""

import ast
import functools
import hashlib
import linecache
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import warp as wp

from warpdyn.engine.kernels.composing.kept_texts import Text, kept_text
from warpdyn.engine.kernels.composing.part_checks import BUILTINS, check_parts, refuse_unknown
from warpdyn.engine.kernels.composing.recorder_checks import check_recorder
from warpdyn.engine.kernels.composing.source_text import (
    Pairs,
    bodies_of,
    folded,
    name_of,
    names_of,
    namespace_of,
    source_of,
    spliced,
    without_unread,
)
from warpdyn.engine.kernels.composing.syntax import syntax_tree
from warpdyn.engine.kernels.composing.user_recorders import Recorder, users_of
from warpdyn.engine.kernels.registry import all_parts, fields, names_in
from warpdyn.engine.kernels.slots import SLOTS, Slot


class Composed(NamedTuple):
    """The source text of a kernel, and the objects to which its names refer: {name: constant, type or function}."""

    text: str
    names: dict[str, Any]


def compose(
    skeleton: Callable, plan: Any, parts: Sequence[Any] | None = None, slots: Mapping[str, Slot] = SLOTS
) -> Composed:
    """Return the source text of the kernel of a plan, and the objects to which its names refer.

    The module docstring explains skeletons, parts and slots.

    Args:
        skeleton: The skeleton, a function with the time loop.
        plan: The properties that decide which parts the kernel contains.
        parts: Parts to choose from; None: all parts.
        slots: The table of slots: {name of the slot: slot}.

    Raises:
        ValueError: If a part breaks a rule; the message names the part, the file and the line.
    """
    is_own = parts is None and slots is SLOTS
    parts = all_parts() if parts is None else tuple(parts)
    wanted = [part for part in parts if part.wanted(plan)]
    home = sys.modules[skeleton.__module__]
    values: dict[str, Any] = {name_of(part).upper(): part in wanted for part in parts}
    values |= {name.upper(): name == name_of(home) for name in names_in("skeletons")}
    for each in (home, *wanted):
        if hasattr(each, "names"):
            _add(values, each, each.names(plan))
    constants = tuple(values)
    filled = {slot for part in wanted for slot in bodies_of(part)}
    values |= {f"HAS_{slot.upper()}": slot in filled for slot in slots}
    known = {name: value for name, value in values.items() if name.isupper() and isinstance(value, bool | int)}
    written = {name: value for name, value in values.items() if isinstance(value, str)}

    def checked() -> Text:
        known_fields = fields(users_of(getattr(plan, "recorders", ())))
        check_parts(home, wanted, parts, slots, constants, known_fields, getattr(plan, "family", ""))
        for part in wanted:
            if isinstance(part, type) and issubclass(part, Recorder):
                check_recorder(part, home, wanted, values, plan.family)
        return _text(skeleton, (home, *wanted), tuple(known.items()), tuple(written.items()))

    if is_own and not any(isinstance(part, type) for part in wanted):  # a class may be a recorder in a user's script
        holders = [each.__name__ for each in (home, *wanted)]
        determined_by = skeleton.__name__, holders, known, written, constants, getattr(plan, "family", "")
        text, named, needed = kept_text(determined_by, checked)
    else:
        text, named, needed = checked()
    of_modules: dict[str, Any] = {}
    for each in (home, *wanted):
        held, bodies = namespace_of(each), bodies_of(each)
        _add(of_modules, each, {name: held[name] for name in named & held.keys() - values.keys() - bodies.keys()})
    names = {name: value for name, value in (of_modules | values).items() if name in named}
    for name in sorted(needed - names.keys() - BUILTINS):
        refuse_unknown(name, wanted, known)
    return Composed(text, names)


@functools.cache  # plans that differ only in types have the same text
def _text(
    skeleton: Callable,
    holders: tuple[Any, ...],
    known: tuple[tuple[str, Any], ...],
    written: Pairs,
) -> Text:
    """Return the source text of a kernel, all names in it, and the names that it reads without assigning to them.

    Args:
        skeleton: The skeleton, a function with the time loop.
        holders: The module of the skeleton and the wanted parts, whose functions fill the slots.
        known: Names in capitals with known values, as pairs (name, value).
        written: Names that are replaced by other text, as pairs (name, text).
    """
    text = spliced(source_of(skeleton), holders, written)
    text = without_unread(folded(text, dict(known)))
    [function] = syntax_tree(text).body
    found = list(names_of(function))
    set_here = {name.id for name in found if isinstance(name.ctx, ast.Store)}
    named = frozenset(name.id for name in found)
    return Text(text, named, named - set_here - {argument.arg for argument in function.args.args})


def kernel_of(
    composed: Composed,
    options: Mapping[str, Any],
    known_block: int | tuple[int, int] | None = None,
    *,
    is_lean: bool = False,
) -> wp.Kernel:
    """Return the Warp kernel of a source text, in a Warp module with these options.

    Args:
        composed: The source text, and the objects to which its names refer.
        options: Options of the Warp module.
        known_block: Threads per block that the GPU's compiler may assume, or these and the number of blocks that run
            at once on a multiprocessor; None: no assumption.
        is_lean: Whether a GPU thread processes one index of a launch, without Warp's loop over further indices.
    """
    digest = hashlib.sha256(composed.text.encode()).hexdigest()[:16]
    name = composed.text.partition("(")[0].removeprefix("def ")
    file = f"<{name} {digest}>"
    # Tracebacks, inspect and Warp read the source from linecache. Without a modification time Python does not look for
    # a file on disk.
    linecache.cache[file] = (len(composed.text), None, composed.text.splitlines(keepends=True), file)
    namespace = {"wp": wp, **composed.names, "__name__": __name__}
    exec(compile(composed.text, file, "exec"), namespace)
    return wp.kernel(
        namespace[name],
        module="unique",
        enable_backward=False,
        module_options=dict(options),
        launch_bounds=known_block,
        grid_stride=False if is_lean else None,
    )


def _add(values: dict[str, Any], part: Any, more: Mapping[str, Any]) -> None:
    """Add the named values of a kernel part to a dictionary; raise a ValueError if a name already has another value."""
    for name, value in more.items():
        if name in values and values[name] is not value and values[name] != value:
            raise ValueError(
                f"part {name_of(part)!r} of a kernel gives {name} the value {value!r}, but another part or the "
                f"skeleton gives {values[name]!r}: rename it in part {name_of(part)!r}"
            )
        values[name] = value
