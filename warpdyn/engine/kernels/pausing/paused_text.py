"""Rewrite the source text of a kernel so that it can pause between two intervals of the motion.

The kernel gets one more argument, `paused`. If its `first` interval is not 0, the variables that live across the
interval loop are loaded from arrays before the loop. The loop ends before the interval `last`. With `stores`, the
kernel then stores these variables in the arrays and returns; otherwise it writes its outputs. All other statements are
those of the kernel that does not pause, so that both compute the same bits.
"""

import ast
from collections.abc import Collection
from itertools import groupby
from typing import Any, NamedTuple

import warp as wp

from warpdyn.engine.kernels.composing.syntax import syntax_tree
from warpdyn.engine.kernels.composition import Composed
from warpdyn.engine.kernels.pausing.liveness import PHASE, interval_loop, live_names, set_in

# Field of the struct Paused -> its type, as in the FIELDS of parts. The arrays have one column per lane (sample that a
# thread integrates) and one row per value.
FIELDS = {
    "first": "int32",
    "last": "int32",
    "stores": "int32",
    "real": "float[,]",
    "real64": "float64[,]",
    "whole": "int32[,]",
}
ARRAYS = {wp.int32: "whole", wp.float64: "real64", wp.float32: "real"}
# Variables that depend on the end of the run, which may not be known yet: {name: value at the first interval}. The
# skeletons compute them again in the first interval.
RESTARTED = {"next_change": "paused.first", "changed": "paused.first", PHASE: "paused.first"}
# Vectors and matrices that each step sets before it reads them, or that are 0 between two intervals and at the
# start: {part or skeleton that declares them: names}; "": of any part. They must not be stored: if the compiler sees
# that they live on, it may fuse other products and sums, which changes the last bits of other variables.
SCRATCH = {
    "": "a0 above acceleration applied base da dx elastic fastest felt foot ground ground_begin ground_change h here "
    "lower memory_rate momentum momentum_along momentum_of moved own_u own_v power_elastic power_in power_viscous "
    "ratio_now sampled_value shaken share_in_mean spring_force to_displacement to_memory to_velocity un upper value "
    "viscous vn work_in work_viscous zn",
    "adaptivity": "done excess part safe_absorbed safe_in safe_viscous whole_step",
    "elimination": "above_eliminated below_found carried eliminated",
    "implicit_chain": "below_before below_now rise",
    "joint_springs": "allowed_gap chord_moment inverse_pivot largest_gap reduced seeks",
    "search": "correction force_size mode rounded slope slope_end slope_next unbalanced unbalanced_last",
}
# Names in SCRATCH that a part reads in the first stage of a step, before it sets them: {part: names}. They are stored.
KEPT = {"massless_rotations": "spring_force", "joint_springs": "spring_force"}
# Column of a thread in the arrays of the struct Paused, if a thread integrates whole samples, and if several threads
# share a sample, so that `block` is the same in all of them.
COLUMN, COLUMN_OF_SECTION = "block * LANES", "(first + wp.tid()) * LANES"
HELD = "stands[0] == dtype(0.0)"  # condition under which a kernel with one sample per thread leaves its loop early


class Carried(NamedTuple):
    """A variable that lives across the interval loop of a kernel.

    Args:
        name: Its name in the source text.
        array: Field of the struct Paused that stores it: "real", "real64" or "whole".
        first: First row of the variable in this array.
        rows: Number of its rows, such as one per storey; 1 for a scalar.
        by_lane: Whether it has a value for each lane; otherwise it belongs to the whole thread.
        has_rows: Whether it is a matrix, whose first index is the row.
    """

    name: str
    array: str
    first: int
    rows: int
    by_lane: bool
    has_rows: bool


class Pausing(NamedTuple):
    """The source of a kernel that can pause, and the variables that it loads and stores."""

    composed: Composed
    carried: tuple[Carried, ...]

    def rows(self, array: str) -> int:
        """Return the number of rows of an array of the struct Paused, at least 1."""
        return max(1, sum(each.rows for each in self.carried if each.array == array))


def pausing(
    composed: Composed, parts: Collection[str], struct: Any, lanes: int, real: Any, sections: int = 1
) -> Pausing:
    """Return the source of a kernel that can pause, from that of the kernel that runs to the end.

    Args:
        composed: Source text of the kernel, and the objects to which its names refer.
        parts: Names of the parts of the kernel and of its skeleton.
        struct: Warp struct of the argument `paused`, with the fields FIELDS.
        lanes: Number of samples that a thread integrates at once.
        real: Number type of the kernel, wp.float32 or wp.float64.
        sections: Number of threads that share a sample. Each of them stores its own variables.

    Raises:
        ValueError: If a variable that lives across the interval loop has an unknown type.
    """
    text = composed.text
    [function] = syntax_tree(text).body
    place = interval_loop(function)
    before, loop = function.body[:place], function.body[place]
    wanted = live_names(function, place) & set_in([loop]) & set_in(before)
    scratch = {name for part, names in SCRATCH.items() if part in {"", *parts} for name in names.split()}
    scratch -= {name for part, names in KEPT.items() if part in parts for name in names.split()}
    kinds = _types(before, composed.names)
    carried = _carried_variables(sorted(wanted - RESTARTED.keys() - scratch), kinds, lanes, real)
    lines = _with_safe_reads(text.splitlines(), [*before, loop])
    head, tail = lines[: loop.lineno - 1], lines[loop.end_lineno :]
    inside = lines[loop.lineno - 1 : loop.end_lineno]
    head = [_with_argument(line) for line in head]
    column = COLUMN if sections == 1 else COLUMN_OF_SECTION
    loads = ["    if paused.first > 0:", *_moved(carried, "{variable} = {stored}", column)] if carried else []
    loads += [f"    {name} = {value}" for name, value in RESTARTED.items() if name in wanted]
    if isinstance(loop, ast.While):
        loads += ["    intervals = wp.min(intervals, paused.last)"]
        if "stands" in wanted:  # the sample has collapsed before
            loads += ["    if paused.first > 0:", f"        if {HELD}:", "            intervals = int(0)"]
    else:
        bounds = loop.iter
        until = ast.unparse(bounds.args[-1])
        inside[0] = f"    for interval in range(paused.first, wp.min(paused.last, {until})):"
    stores = ["    if paused.stores > 0:", *_moved(carried, "{stored} = {variable}", column), "        return"]
    new = "\n".join([*head, *loads, *inside, *stores, *tail]) + "\n"
    return Pausing(Composed(new, composed.names | {"Paused": struct}), carried)


def _with_argument(line: str) -> str:
    """Return a line of the kernel's header with the argument `paused` after the last argument."""
    return line.replace("history: History", "history: History, paused: Paused")


def _with_safe_reads(lines: list[str], statements: list[ast.stmt]) -> list[str]:
    """Return the lines with indices of the motion's samples that are not negative in these statements.

    The samples of a packet begin at a later interval, so that the index of the first sample of the record is negative.
    The value at this index is not used: loaded variables replace those that depend on it, or, after the motion, it is
    multiplied by 0. But memory outside of an array may contain NaN.
    """
    lines = list(lines)
    places = [
        node.slice if isinstance(node, ast.Subscript) else node.args[1]
        for statement in statements
        for node in ast.walk(statement)
        if (isinstance(node, ast.Subscript) and ast.unparse(node.value) == "loads.values")
        or (isinstance(node, ast.Call) and _repeats_first(node))
    ]
    for place in sorted(places, key=lambda place: -place.col_offset):
        line = lines[place.lineno - 1]
        start, end = place.col_offset, place.end_col_offset
        lines[place.lineno - 1] = f"{line[:start]}wp.max({line[start:end]}, 0){line[end:]}"
    return lines


def _repeats_first(call: ast.Call) -> bool:
    """Return whether this call reads the first sample of the motion in all intervals after the motion."""
    return ast.unparse(call.func) == "element" and "stride" in ast.unparse(call.args[1])


def _types(before: list[ast.stmt], names: dict[str, Any]) -> dict[str, Any]:
    """Return the types of the variables that statements before the loop declare, such as `u = matrix()`."""
    found: dict[str, Any] = {}
    for statement in before:
        if not (isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Call)):
            continue
        [target] = statement.targets
        maker = statement.value.func
        if isinstance(target, ast.Name) and isinstance(maker, ast.Name):
            kind = int if maker.id == "int" else names.get(maker.id)
            if kind is not None:
                found.setdefault(target.id, kind)
    return found


def _carried_variables(variables: list[str], kinds: dict[str, Any], lanes: int, real: Any) -> tuple[Carried, ...]:
    """Return the rows of the variables in the arrays of the struct Paused.

    Args:
        variables: Names of the variables.
        kinds: Their types: {name: type}.
        lanes: Number of samples of a thread.
        real: Number type of the kernel.
    """
    used = dict.fromkeys(("real", "real64", "whole"), 0)
    found = []
    for name in variables:
        kind = kinds.get(name)
        shape = getattr(kind, "_shape_", ())
        scalar = wp.int32 if kind is int else getattr(kind, "_wp_scalar_type_", kind)
        array = "real" if scalar is real else ARRAYS.get(scalar)
        if array is None or len(shape) > 2 or (len(shape) == 2 and shape[1] != lanes):
            raise ValueError(
                f"variable {name!r} lives across the interval loop, but its type {kind!r} cannot be stored in a "
                "checkpoint: declare it as row(), row64(), indices(), matrix(), int(0) or dtype(0.0) before the loop"
            )
        by_lane = bool(shape) and shape[-1] == lanes
        rows = shape[0] if len(shape) == 2 or (shape and not by_lane) else 1
        found.append(Carried(name, array, used[array], rows, by_lane, len(shape) == 2 or (shape and not by_lane)))
        used[array] += rows
    return tuple(found)


def _moved(carried: tuple[Carried, ...], statement: str, first_column: str) -> list[str]:
    """Return the lines that copy variables from or to the arrays of the struct Paused, in loops over rows and lanes."""
    lines = []
    for (rows, by_lane, has_rows), each in groupby(sorted(carried, key=_loop_of), key=_loop_of):
        margin, column = " " * 8, first_column
        index = []
        if has_rows:
            lines.append(f"{margin}for i in range({rows}):")
            margin += " " * 4
            index.append("i")
        if by_lane:
            lines.append(f"{margin}for j in range(LANES):")
            margin += " " * 4
            index.append("j")
            column += " + j"
        for variable in each:
            row = f"{variable.first} + i" if has_rows else f"{variable.first}"
            named = f"{variable.name}[{', '.join(index)}]" if index else variable.name
            stored = f"paused.{variable.array}[{row}, {column}]"
            lines.append(margin + statement.format(variable=named, stored=stored))
    return lines


def _loop_of(variable: Carried) -> tuple[int, bool, bool]:
    return variable.rows, variable.by_lane, variable.has_rows
