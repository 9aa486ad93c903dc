"""Check the parts of a kernel against the table of slots; errors name the part, the file and the line.

A part is a module or class whose functions contribute statements to a kernel, at places called slots. Without these
checks, a misspelt slot would leave outputs at zero, and a variable of a part could overwrite a variable of the kernel.
"""

from __future__ import annotations

import ast
import builtins
import functools
from collections.abc import Collection, Iterable, Mapping, Sequence
from difflib import get_close_matches
from types import FunctionType
from typing import Any, NoReturn

from warpdyn.engine.kernels.composing.names import STRUCTS, Body, facts_of, names_in_function
from warpdyn.engine.kernels.composing.source_text import (
    bodies_of,
    name_of,
    namespace_of,
    place_of,
    slots_of,
    source_of,
)
from warpdyn.engine.kernels.registry import skeletons
from warpdyn.engine.kernels.slots import COMMON, INDICES, SCRATCH, Slot

OTHER_NAME = "choose another name"
BUILTINS = frozenset(dir(builtins)) | {"wp", "slot", "first"} | STRUCTS.keys() | set(STRUCTS.values())


def check_parts(
    home: Any,
    wanted: Sequence[Any],
    parts: tuple[Any, ...],
    slots: Mapping[str, Slot],
    constants: Collection[str],
    fields: Mapping[str, Collection[str]],
    family: str,
) -> None:
    """Check the functions and fields of the parts of a kernel, and the variables that they read and change.

    Args:
        home: The module of the skeleton, which contains the time loop.
        wanted: The parts of the kernel.
        parts: All parts.
        slots: The table of slots.
        constants: Names to which the parts and the skeleton assign a value for this plan.
        fields: The fields of the structs that are arguments of the kernel.
        family: The family of the structure, "chain", "lumped" or "dense".

    Raises:
        ValueError: If a part breaks a rule.
    """
    table = frozenset(slots.items())
    for part in wanted:
        _check_alone(part, home, parts, table)
        _check_fields(part, home, fields)
    _check_together(home, wanted, slots, constants)
    _check_outputs(home, wanted, family)


def refuse_unknown(name: str, wanted: Iterable[Any], known: Mapping[str, Any]) -> NoReturn:
    """Raise a ValueError that names the part, the file and the line in which an undefined name of a kernel is read.

    Args:
        name: The undefined name.
        wanted: The parts of the kernel.
        known: Values of the names in capitals (conditions and constants).
    """
    flags = {each: bool(value) for each, value in known.items()}
    for part in wanted:
        for slot, function in bodies_of(part).items():
            line = names_in_function(function, flags).reads.get(name)
            if line is not None:
                refuse(
                    part,
                    slot,
                    line,
                    f"reads {name!r}, which this kernel does not have: define it in names(plan) of the part, or read "
                    "it only within an if of the part that defines it",
                )
    raise ValueError(
        f"the skeleton reads {name!r}, which nothing defines: define it in the skeleton, or in "
        "a part that every kernel has"
    )


@functools.cache
def _check_alone(part: Any, home: Any, parts: tuple[Any, ...], table: frozenset[tuple[str, Slot]]) -> None:
    """Check one part of a kernel alone: its functions must fill known slots and use only variables allowed there.

    Args:
        part: The part.
        home: The module of the skeleton.
        parts: All parts.
        table: The table of slots, as pairs (name, slot).

    Raises:
        ValueError: If a name breaks a rule; the message names the part, the file and the line.
    """
    slots = dict(table)
    facts = facts_of(part, name_of(home))
    for name, body in facts.items():
        if name not in slots:
            meant = _meant(name, slots)
            refuse(part, name, 0, f"is not a slot{meant}: rename it, or give it an argument if it is another function")
        for inner, line in body.slots.items():
            if inner not in slots:
                refuse(
                    part,
                    name,
                    line,
                    f"has the slot {inner!r}, which is not in SLOTS{_meant(inner, slots)}: rename or add it",
                )
        for fault, line in body.faults.items():
            refuse(part, name, line, fault)
    of_skeleton = _variables(home)
    of_slots = {variable for slot in slots.values() for variable in slot.reads + slot.writes}
    protected = of_skeleton | of_slots | COMMON.keys() | BUILTINS
    set_anywhere = {variable for body in facts.values() for variable in body.assigned}
    changeable = _own_variables(part, slots) | _borrowed(part, parts)
    known = _constants(parts, frozenset(slots)) | namespace_of(part).keys() | COMMON.keys() | changeable | set_anywhere
    for name, body in facts.items():
        if name == "declare":
            for variable in body.assigned.keys() & of_skeleton - set(SCRATCH):
                refuse(
                    part,
                    name,
                    body.assigned[variable],
                    f"declares {variable!r}, a variable of the skeleton; {OTHER_NAME}",
                )
            continue
        slot, index = slots[name], set(INDICES[slots[name].index])
        given = {variable for inner in body.slots for variable in slots[inner].reads + slots[inner].writes}
        may_read = known | given | index | set(slot.reads + slot.writes) | body.loops.keys()
        may_change = changeable | given | set(slot.writes)
        kept = f"a variable of the kernel that this slot may not change (it may change {_listed(slot.writes)})"
        for variable, line in body.reads.items():
            if variable not in may_read:
                listed = _listed((*INDICES[slot.index], *slot.reads, *slot.writes))
                why = f"which has no value in this slot; choose from {listed}, and COMMON in slots.py"
                if variable not in protected:
                    why = f"which is not defined{_meant(variable, may_read)}: set it first, or declare it in declare()"
                refuse(part, name, line, f"reads {variable!r}, {why}")
        for variable, line in body.changed.items():
            if variable in may_change or variable in set_anywhere - protected:
                continue
            if variable not in protected:
                kept = f"which is not declared; write `{variable} = matrix()` (a value per storey and lane) or "
                kept += f"`{variable} = row()` (a value per lane) in declare()"
            else:
                kept += "; declare another variable in declare()"
            refuse(part, name, line, f"changes {variable!r}, {kept}")
        for variable, line in (body.assigned | body.loops).items():
            if variable in index - set(slot.writes):
                refuse(part, name, line, f"sets {variable!r}, a loop variable of the slot; {OTHER_NAME}")
        for variable, line in body.assigned.items():
            if variable in protected - may_change - set(SCRATCH):
                refuse(part, name, line, f"sets {variable!r}, {kept}; {OTHER_NAME}")


def _check_fields(part: Any, home: Any, fields: Mapping[str, Collection[str]]) -> None:
    """Check that each struct field that a part reads or writes, such as `output.status`, exists."""
    for slot, body in facts_of(part, name_of(home)).items():
        for (argument, field), line in body.fields.items():
            known = fields.get(STRUCTS[argument], ())
            if field not in known:
                meant = _meant(field, known)
                refuse(
                    part,
                    slot,
                    line,
                    f"names {argument}.{field}, which does not exist{meant}: correct the name, or declare it in FIELDS",
                )


def _check_together(home: Any, wanted: Sequence[Any], slots: Mapping[str, Slot], constants: Collection[str]) -> None:
    """Check that no part of a kernel assigns to a variable of another part, unless it borrows the variable.

    A declared variable must also not have the name of a constant, which it would replace in all parts.
    """
    owner: dict[str, Any] = {}
    around: dict[str, list[tuple[Any, Body]]] = {}
    facts = {part: facts_of(part, name_of(home)) for part in wanted}
    for part, bodies in facts.items():
        for variable, line in bodies["declare"].assigned.items() if "declare" in bodies else ():
            if variable in owner:
                other = name_of(owner[variable])
                refuse(part, "declare", line, f"declares {variable!r}, as part {other!r} does; {OTHER_NAME}")
            if variable in constants:
                refuse(part, "declare", line, f"declares {variable!r}, a constant of the kernel; {OTHER_NAME}")
            owner[variable] = part
        for body in bodies.values():
            for inner in body.slots:
                around.setdefault(inner, []).append((part, body))
    for part, bodies in facts.items():
        borrowed = {variable for names in getattr(part, "BORROWS", {}).values() for variable in names}
        for name, body in bodies.items():
            if name == "declare":
                continue
            given = {variable for inner in body.slots for variable in slots[inner].writes}
            for variable in body.assigned.keys() - borrowed - given - set(slots[name].writes):
                fault, lender = "", owner.get(variable, part)
                if isinstance(lender, type) and not isinstance(part, type):  # the mistake is in the user's class
                    line = facts[lender]["declare"].assigned[variable]
                    refuse(
                        lender,
                        "declare",
                        line,
                        f"declares {variable!r}, which part {name_of(part)!r} sets; {OTHER_NAME}",
                    )
                if lender is not part:
                    fault = f"which part {name_of(lender)!r} declares"
                elif variable in constants:
                    fault = "a constant of the kernel"
                elif variable not in SCRATCH:
                    others = [each for each, outer in around.get(name, ()) if variable in outer.assigned]
                    fault = f"which part {name_of(others[0])!r} uses around this slot" if others else ""
                if fault:
                    refuse(part, name, body.assigned[variable], f"sets {variable!r}, {fault}; {OTHER_NAME}")


def _check_outputs(home: Any, wanted: Sequence[Any], family: str) -> None:
    """Check that each recorder writes all of its output variables, in slots that exist in the kernel."""
    facts = {part: facts_of(part, name_of(home)) for part in wanted}
    reached, waiting = set[str](), set().union(*(slots_of(each) for each in functions_with_slots(home)))
    while waiting:
        reached |= waiting
        bodies = [bodies[slot] for bodies in facts.values() for slot in waiting if slot in bodies]
        waiting = {inner for body in bodies for inner in body.slots} - reached
    for part, bodies in facts.items():
        present = [body for slot, body in bodies.items() if slot in reached]
        written = {field for body in present for argument, field in body.fields if argument == "output"}
        if not any("output" in body.reads for body in present):  # a function that gets all outputs may write them
            for variable in getattr(part, "VARIABLES", {}).get(family, {}).keys() - written:
                slot = next(iter(bodies), "")
                refuse(
                    part,
                    slot,
                    0,
                    f"and the other functions do not write output.{variable} in a slot of the skeleton "
                    f"{name_of(home)!r}; write it in finish_storey() or write()",
                )


def refuse(part: Any, slot: str, line: int, fault: str) -> NoReturn:
    """Raise a ValueError that names a part, its file and the line, and states the mistake `fault`.

    `line` is counted from the `def` line of the function for `slot`, which is line 1.
    """
    function = bodies_of(part)[slot]
    at = function.__code__.co_firstlineno + max(0, line - 1)
    raise ValueError(f"part {name_of(part)!r} ({function.__code__.co_filename}, line {at}): {slot}() {fault}")


def _meant(name: str, known: Iterable[str]) -> str:
    close = get_close_matches(name, known, 1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "no variable"


def _own_variables(part: Any, slots: Mapping[str, Slot]) -> set[str]:
    """Return the variables that a kernel part declares, and those that exist only in slots inside its own functions."""
    facts = facts_of(part, "")
    inside = {inner for body in facts.values() for inner in body.slots}
    named = {inner: set(slot.reads + slot.writes) for inner, slot in slots.items()}
    own = set().union(*(names for inner, names in named.items() if inner in inside))
    own -= set().union(*(names for inner, names in named.items() if inner not in inside))
    return own | (facts["declare"].assigned.keys() if "declare" in facts else set())


def _borrowed(part: Any, parts: Sequence[Any]) -> set[str]:
    """Return the variables of other parts that a kernel part may change, because its attribute BORROWS names them."""
    borrows: Mapping[str, Sequence[str]] = getattr(part, "BORROWS", {})
    by_name = {name_of(each): each for each in parts}
    for other, names in borrows.items():
        if other not in by_name:
            raise ValueError(
                f"{place_of(part, 'BORROWS')}: BORROWS names part {other!r}, which does not exist in this kernel; it "
                f"has {', '.join(sorted(by_name))}"
            )
        for name in names:
            if not any(name in body.assigned for body in facts_of(by_name[other], "").values()):
                raise ValueError(
                    f"{place_of(part, 'BORROWS')}: BORROWS names {name!r}, which part {other!r} does not "
                    "declare: declare it there, or remove it"
                )
    return {name for names in borrows.values() for name in names}


def functions_with_slots(home: Any) -> list[FunctionType]:
    """Return those functions in the module of a skeleton that contain slots, such as the skeleton itself."""
    functions = [each for each in namespace_of(home).values() if isinstance(each, FunctionType)]
    return [each for each in functions if each.__module__ == home.__name__ and slots_of(each)]


@functools.cache
def _variables(home: Any) -> frozenset[str]:
    """Return the names of all variables to which the functions with slots in a skeleton's module assign."""
    bodies = [names_in_function(function, {}) for function in functions_with_slots(home)]
    return frozenset(name for body in bodies for name in body.assigned)


@functools.cache
def _constants(parts: tuple[Any, ...], slots: frozenset[str]) -> frozenset[str]:
    """Return all names of constants and conditions that parts and skeletons may read."""
    found = {f"HAS_{slot.upper()}" for slot in slots}
    for each in (*parts, *skeletons()):
        found.add(name_of(each).upper())
        if hasattr(each, "names"):
            nodes = ast.walk(ast.parse(source_of(each.names)))
            literals = [node.value for node in nodes if isinstance(node, ast.Constant)]
            found |= {literal for literal in literals if isinstance(literal, str) and literal.isidentifier()}
    return BUILTINS | found
