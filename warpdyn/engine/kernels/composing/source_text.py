"""Rewrite the source text of functions into the source of a kernel.

Slots (statements such as `slot("add_load")`) are replaced by statements of kernel parts; branches that never run and
variables that are never read are removed. Comments and line breaks are kept. A comment belongs to the statement below
it and is removed with this statement.
"""

from __future__ import annotations

import ast
import functools
import inspect
import linecache
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import FunctionType, ModuleType
from typing import Any

from warpdyn.engine.kernels.composing.syntax import syntax_tree

HAVE_EFFECTS = {"output", "history"}  # a statement that names one of these is never removed
COMPOUND = ("body", "orelse")  # fields of a statement that contain other statements
Pairs = tuple[tuple[str, str], ...]  # names and their replacements; the first pair of a name is used
SLOT = re.compile(r'^( *)slot\("(\w+)"((?:, \w+=\w+)*)\)(?:  #.*)?$')


@functools.cache
def source_of(function: Callable) -> str:
    """Return the source text of a function, without the indentation that all of its lines share."""
    kept = getattr(function, "__source__", None) or _body_source(function)
    if kept:
        return str(kept)
    linecache.checkcache(function.__code__.co_filename)  # a user may have edited the file in this process
    return textwrap.dedent(inspect.getsource(function))


def _body_source(function: Callable) -> str | None:
    """Return the source text of an argument-free function of warpdyn, whose end is found by indentation; else None.

    The search by indentation is 10 times as fast as `inspect.getsource`. None is returned for a user's function,
    because it may contain lines with less indentation, such as comments.
    """
    if not function.__module__.startswith("warpdyn."):
        return None
    code = getattr(function, "__code__", None)
    lines = linecache.getlines(code.co_filename)[code.co_firstlineno - 1 :] if code is not None else []
    if not lines or not re.match(r" *def \w+\(\):$", lines[0]):
        return None
    margin = len(lines[0]) - len(lines[0].lstrip())
    inside = (line.isspace() or line.startswith(" " * (margin + 1)) for line in lines[1:])
    end = next((number for number, is_inside in enumerate(inside, 1) if not is_inside), len(lines))
    return textwrap.dedent("".join(lines[:end]).rstrip() + "\n")


@functools.cache
def parsed(text: str) -> ast.FunctionDef:
    """Return the syntax tree of the source text of a function."""
    [definition] = syntax_tree(text).body
    return definition


def slots_of(function: Callable) -> set[str]:
    """Return the names of the slots in the source text of a function."""
    return {slot[2] for slot in map(SLOT.match, source_of(function).splitlines()) if slot}


def name_of(part: Any) -> str:
    """Return the name of a kernel part or skeleton: the last component of its module's name, or its class name."""
    return getattr(part, "part_name", None) or part.__name__.rpartition(".")[2]


def place_of(part: Any, name: str) -> str:
    """Return a text for messages: the name of a kernel part, and the file and line that set its variable `name`."""
    lines, first = inspect.getsourcelines(part)
    pattern = re.compile(rf"\s*{name}\b.*=")
    line = next((at for at, text in enumerate(lines, max(first, 1)) if pattern.match(text)), max(first, 1))
    return f"part {name_of(part)!r} ({inspect.getsourcefile(part)}, line {line})"


def namespace_of(part: Any) -> Mapping[str, Any]:
    """Return the global names and their values that the functions of a kernel part can read."""
    if isinstance(part, ModuleType):
        return vars(part)
    return next((function.__globals__ for function in bodies_of(part).values()), {})


@functools.cache
def bodies_of(part: Any) -> Mapping[str, FunctionType]:
    """Return {slot: function} for the functions of a part whose bodies fill slots of a kernel."""
    functions = {name: each for name, each in vars(part).items() if isinstance(each, FunctionType)}
    own = part.__name__ if isinstance(part, ModuleType) else part.__module__
    return {name: each for name, each in functions.items() if each.__module__ == own and not each.__code__.co_argcount}


def spliced(text: str, parts: Sequence[Any], written: Pairs = ()) -> str:
    """Return a source text in which each slot is replaced by the bodies of the functions that fill it.

    Args:
        text: Source text of a skeleton.
        parts: The parts of the kernel, in the order of their statements in a slot.
        written: Names that are replaced by other text, as pairs (name, text).
    """
    bodies = [bodies_of(part) for part in parts]

    def filled(lines: Sequence[str], margin: str, written: Pairs) -> Iterator[str]:
        for line in lines:
            slot = SLOT.match(line)
            if slot is None:
                yield margin + line
                continue
            own = (*(tuple(each.split("=")) for each in slot[3].split(", ") if each), *written)
            inside = [each[slot[2]] for each in bodies if slot[2] in each]
            for body in inside:
                yield from filled(_body(body, own), margin + slot[1], own)
            if not inside:  # an empty branch needs a statement; `folded` removes it
                yield f"{margin}{slot[1]}pass"

    return "\n".join(filled(with_names(text, written).splitlines(), "", written)) + "\n"


def folded(text: str, known: Mapping[str, Any]) -> str:
    """Return a source text without empty loops, and without branches that never run; `known` is {condition: its value}.

    A `while` whose condition is known to be true runs once: its body replaces it.
    """
    return _Rewriter(text, known).text()


def without_unread(text: str) -> str:
    """Return a source text without assignments to variables that are never read."""
    while True:
        rewriter = _Rewriter(text, {})
        rewriter.unread = _unread(rewriter.function)
        before, text = text, rewriter.text()
        # A variable may have been read only in the head of a loop or branch that is now empty.
        if text == before or not rewriter.has_emptied:
            return text


def with_names(text: str, written: Pairs) -> str:
    """Return a source text in which names are replaced by other text; `written` contains pairs (name, text).

    Lines after the first of a replacement get the indentation of the name's line.
    """
    if not any(re.search(rf"\b{name}\b", text) for name, _ in written):
        return text
    first = dict(reversed(written))
    lines = text.splitlines()
    names = (name for name in names_of(syntax_tree(text)) if name.id in first)
    for node in sorted(names, key=lambda node: -node.col_offset):
        line = lines[node.lineno - 1]
        indent = line[: len(line) - len(line.lstrip())]
        own = first[node.id].replace("\n", f"\n{indent}")
        lines[node.lineno - 1] = f"{line[: node.col_offset]}{own}{line[node.end_col_offset :]}"
    return "\n".join(lines) + "\n"


@functools.cache
def _body(function: FunctionType, written: Pairs) -> list[str]:
    """Return the lines of a function's body without its docstring; names in `written` are replaced by other text."""
    text = with_names(_one_statement_per_line(source_of(function)), written)
    definition = parsed(text)
    lines = text.splitlines()
    first = definition.body[0].end_lineno if ast.get_docstring(definition) else _header_end(lines, definition.lineno)
    return textwrap.dedent("\n".join(lines[first : definition.end_lineno])).splitlines()


def _one_statement_per_line(text: str) -> str:
    """Return the source text of a function with one statement per line.

    If a line has several statements, such as `if x: y = 1`, the text is written anew from its syntax tree.
    """
    definition = parsed(text)
    lines = text.splitlines()
    for statement in _statements_in(definition.body):
        if lines[statement.lineno - 1].encode()[: statement.col_offset].strip():
            return ast.unparse(definition) + "\n"
    return text


def _header_end(lines: Sequence[str], line: int) -> int:
    """Return the last line number of the header of a compound statement, such as `if` or `for`.

    `line` is a line number within this header.
    """
    while not lines[line - 1].partition("  #")[0].rstrip().endswith(":"):
        line += 1
    return line


def names_of(syntax: object) -> Iterator[ast.Name]:
    """Yield the name nodes in a syntax tree; this is 3 times as fast as `ast.walk`, which yields all nodes."""
    waiting = [syntax]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Name):
            yield node
        elif isinstance(node, list):
            waiting += node
        elif isinstance(node, ast.AST):
            waiting += [getattr(node, field) for field in node._fields]


def _statements_in(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield each statement and all statements inside it, such as those in the body of a loop."""
    for statement in body:
        yield statement
        for field in COMPOUND:
            yield from _statements_in(getattr(statement, field, ()))


def _root(target: ast.expr) -> str | None:
    """Return the name of the variable that an assignment changes, such as "x" for the target `x[i]`.

    None: the target is not a variable, such as `output.status`.
    """
    while isinstance(target, ast.Subscript):
        target = target.value
    return target.id if isinstance(target, ast.Name) else None


def _changed(statement: ast.stmt) -> list[str | None]:
    """Return the names of the variables that an assignment changes, with None for other targets.

    For statements that are not assignments, the list is empty.
    """
    if isinstance(statement, ast.AugAssign):
        return [_root(statement.target)]
    if not isinstance(statement, ast.Assign):
        return []
    targets = [each for target in statement.targets for each in getattr(target, "elts", [target])]
    return [_root(target) for target in targets]


def _unread(function: ast.FunctionDef) -> set[str]:
    """Return the names of variables that are assigned but never affect an output or a branch (dead variables)."""
    sets: dict[str, list[set[str]]] = {}
    needed = {argument.arg for argument in function.args.args}
    for statement in _statements_in(function.body):
        held = [value for field, value in ast.iter_fields(statement) if field not in COMPOUND]
        named = {name.id for name in names_of(held)}
        changed = _changed(statement)
        if changed and None not in changed and not named & HAVE_EFFECTS:
            for name in changed:
                sets.setdefault(name, []).append(named)
        else:
            needed |= named
    waiting = list(needed)
    while waiting:
        for named in sets.pop(waiting.pop(), ()):
            waiting += named - needed
            needed |= named
    return set(sets) - needed


class _Rewriter:
    """Rewrites the source text of a function without branches that never run and variables that are never read."""

    def __init__(self, text: str, known: Mapping[str, Any]) -> None:
        self.lines, self.known = text.splitlines(), known
        self.unread: set[str] = set()
        self.has_emptied = False  # whether a loop or a branch was removed because it was empty
        self.function = syntax_tree(text).body[0]

    def text(self) -> str:
        """Return the source text of the function without branches that never run and variables that are never read."""
        first = _header_end(self.lines, self.function.lineno)
        body = [line for line in self._block(self.function.body, first, 0)]
        kept = [line for at, line in enumerate(body) if line or (at and body[at - 1] and at < len(body) - 1)]
        return "\n".join(self.lines[:first] + kept) + "\n"

    def _block(self, body: list[ast.stmt], header: int, shift: int) -> Iterator[str]:
        """Yield the rewritten lines of the statements below line `header`, moved `shift` columns to the left."""
        last = header
        for statement in body:
            above = self.lines[last : statement.lineno - 1]
            found = list(self._statement(statement, shift))
            if not found:  # also remove the comment and the blank line above the statement
                while above and above[-1].lstrip().startswith("#"):
                    above.pop()
                while above and not above[-1]:
                    above.pop()
            yield from self._moved(above, shift)
            yield from found
            last = statement.end_lineno

    def _statement(self, statement: ast.stmt, shift: int) -> Iterator[str]:
        if isinstance(statement, ast.If):
            yield from self._branches(statement, shift, "if")
        elif isinstance(statement, ast.For | ast.While):
            head = statement.iter if isinstance(statement, ast.For) else statement.test
            first = _header_end(self.lines, head.end_lineno)
            if isinstance(statement, ast.While) and self._settled(head) is True:
                outward = shift + statement.body[0].col_offset - statement.col_offset
                yield from self._block(statement.body, first, outward)
                return
            inside = [] if self._is_empty_range(statement) else list(self._block(statement.body, first, shift))
            if any(inside):
                yield from self._moved(self._simple(head, statement.lineno, first), shift)
                yield from inside
            else:
                self.has_emptied = True
        elif not isinstance(statement, ast.Pass) and not (set(_changed(statement)) & self.unread):
            yield from self._moved(self._simple(statement, statement.lineno, statement.end_lineno), shift)

    def _branches(self, statement: ast.If, shift: int, word: str) -> Iterator[str]:
        """Yield the lines that remain of an `if` statement (`word` is "if") or of its `elif` (`word` is "elif")."""
        test = self._settled(statement.test)
        first = _header_end(self.lines, statement.test.end_lineno)
        otherwise, is_elif, other_first = statement.orelse, False, 0
        if otherwise:
            other_first = statement.body[-1].end_lineno + 1
            while not self.lines[other_first - 1].lstrip().startswith(("else:", "elif ", "elif(")):
                other_first += 1
            is_elif = self.lines[other_first - 1].lstrip().startswith("elif")
        indent = " " * (statement.col_offset - shift)
        # If only one branch remains, its lines move to the column of the `if`; below an `elif` they follow an `else`.
        outward = shift + statement.body[0].col_offset - statement.col_offset if word == "if" else shift
        if test is True:
            yield from [f"{indent}else:"] if word == "elif" else []
            yield from self._block(statement.body, first, outward)
            return
        rest: list[str] = []
        if is_elif:
            rest = list(self._branches(otherwise[0], shift, word if test is False else "elif"))
        elif otherwise:
            rest = list(self._block(otherwise, other_first, outward if test is False else shift))
            if rest and (word == "elif" or test is not False):
                rest.insert(0, f"{indent}else:")
        if test is False:
            yield from rest
            return
        inside = list(self._block(statement.body, first, shift))
        if inside or rest:
            text = self.lines[statement.lineno - 1 : first]
            if test != ast.unparse(statement.test) or word != text[0].split()[0]:
                text = [f"{' ' * statement.col_offset}{word} {test}:"]
            yield from self._moved(text, shift)
            yield from inside or [f"{indent}    pass"]
            yield from rest
        if not inside:
            self.has_emptied = True

    def _settled(self, test: ast.expr) -> bool | str:
        """Return the value of a condition if it is known; else return its text without the operands that are known."""
        named = {name.id for name in names_of(test)}
        if named <= self.known.keys() and not any(isinstance(node, ast.Call) for node in ast.walk(test)):
            return bool(eval(ast.unparse(test), {}, dict(self.known)))
        if isinstance(test, ast.IfExp) and isinstance(self._settled(test.test), bool):
            return self._settled(test.body if self._settled(test.test) else test.orelse)
        if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
            inner = self._settled(test.operand)
            return not inner if isinstance(inner, bool) else ast.unparse(test)
        if not isinstance(test, ast.BoolOp):
            return ast.unparse(test)
        decides = isinstance(test.op, ast.Or)  # an operand with this value decides the condition
        found = [self._settled(operand) for operand in test.values]
        if decides in [each for each in found if isinstance(each, bool)]:
            return decides
        left = [each for each in found if isinstance(each, str)]
        if not left:
            return not decides
        if len(left) == 1:
            return left[0]
        word = " or " if decides else " and "
        return word.join(f"({each})" if " or " in each or " and " in each else each for each in left)

    def _is_empty_range(self, statement: ast.stmt) -> bool:
        if not isinstance(statement, ast.For):
            return False
        bounds = statement.iter
        named = {name.id for name in names_of(bounds)} - {"range"}
        return named <= self.known.keys() and not eval(ast.unparse(bounds), {"range": range}, dict(self.known))

    def _simple(self, inside: ast.AST, first: int, last: int) -> list[str]:
        """Return lines of a statement, with `a if CONDITION else b` replaced by a or b if the condition is known."""
        lines = self.lines[first - 1 : last]
        if not self.known or not any(" if " in line for line in lines):
            return lines
        choices = [node for node in ast.walk(inside) if isinstance(node, ast.IfExp)]
        for node in sorted(choices, key=lambda node: (-node.lineno, -node.col_offset)):
            test = self._settled(node.test)
            if isinstance(test, bool) and node.lineno == node.end_lineno:
                line, taken = lines[node.lineno - first], node.body if test else node.orelse
                lines[node.lineno - first] = (
                    f"{line[: node.col_offset]}{ast.unparse(taken)}{line[node.end_col_offset :]}"
                )
        return lines

    def _moved(self, lines: Sequence[str], shift: int) -> Iterator[str]:
        for line in lines:
            yield line.lstrip() if line[:shift].strip() else line[shift:]
