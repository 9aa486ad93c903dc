"""Patterns that make English text hard to read, with what to write instead; `test_language.py` applies them.

    python tests/language.py [FILE or FOLDER ...]      lists the matches

Checked are docstrings, comments and literal text of Python files, and the text of Markdown files.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
UNITS = (
    "building|case|claim|column|damage state|damping ratio|degree of freedom|element|event|floor|history|law|level|"
    "machine|method|minute|motion|node|pair|panel|process|record|region|row|sample|second|site|state|step|storey|"
    "structure|thread|worker|year"
)

# What a machine can find, and what to write instead.
PATTERNS: dict[str, str] = {
    r"\bof which\b": "start a new sentence",
    r"\bof (its|their|one's|your|our|his) own\b": "drop it, or name the owner: each sample's own step",
    r"\bone's own\b": "name the owner",
    r"\blikewise\b": "repeat the verb",
    r"\bso (many|often)\b": "give the number, or the name of the constant",
    r"\bbut for\b": "except",
    r"\bas of (?!\d|version|(?-i:[A-Z]))": "repeat the short list, or link to it",
    r"\b(is|are|was|were|be|been) told\b": "is reported; a warning names it",
    r"\btold (of|by|from)\b": "reported",
    r"\btells? (of|what|which|why|how|whether|where|when)\b": "reports, shows, states",
    r"\b(says?|said) (of|what|which|why|how|whether|where|when|so)\b": "states, reports, shows",
    r"\b(is|are|was|were) (?-i:none)\b": "is missing, is not a ..., is meaningless",
    r"(?<!there )\b(is|are|was|were) no (?!longer\b|more\b|less\b|\w+er than\b)[A-Za-z]": "is not a ...",
    r"\bNone for (none|no)\b": "None: no ...",
    r"\bwhere there (is|are|was|were) (none|no)\b": "if there is no ...",
    r"\bfor none\b": "name what is missing",
    r"\bstands? (in|beside|at|for|there|between|after|before|above|below|alone|under|on|of|by|with)\b": "is in, means",
    r"\bleave (it|them|out|one) (out|one|of|it)\b": "Remove NAME: name the argument",
    rf"\b(one|ones|values?|numbers?|rows?|columns?|panels?|steps?|coefficients?|threads?|times)"
    rf" an? ({UNITS})\b(?! (time|half|third|quarter)\b)": "per",
    r"(?:^|(?<=[.;:!?] )|(?<=\n\n))What (?![^.]*\?)": "start with a noun, a function or an actor",
    r"\b(is|are|be) what\b": "name the thing",
    r"\b(rungs?|ladders?(?![:=])|climb|climbs|climbed|climbing|glides?|resurrections?|foothold)\b": "technical term",
    r"\brooms? (for|above|below|of|that|before|imports?)\b|\bof (the )?rooms\b": "space; package",
    r"\bwhat `?[\w.]+(\([^)]*\))?`? (returned|returns|gave|wrote|writes|has written)\b": "the result of ...",
    r"\btells? (the|its|their|a|an|no|nothing|more|less|apart|as much|it)\b": "reports, shows, states; estimates",
    r"\bsays? (it|nothing|by)\b": "states, shows",
    r"(?<!by )\bhand(s|ed)? (back|on|over)\b": "returns, passes",
    r"\bgo(es|ing)? on\b": "continues, resumes",
    r"\bsome (\d|ten|twenty|thirty|hundreds?|thousands?|millions?|tenths|dozens?)": "about; a few",
    r"\bthe more so\b": "increasingly",
    r"\bat hand\b|\bside by side\b(?! (with|in|by))": "available; together, in parallel",
    r"\bby another hand\b": "independent",
    r"\bfor want of\b": "because there is no ...",
    r"\blet go of\b": "released, freed",
    r"\bcomes? to (?!an end|rest)": "equals, reaches",
    r"(?<!-)\bbeside\b": "next to, in addition to, with",
    r"\bin however\b": "even with the shortest ...",
    r"\bthereof\b|\bwhereof\b|\bwhereby\b": "start a new sentence",
    r"\bin turn\b": "one after another, alternately",
    r"\bby themselves\b": "separately, independently",
    r"\bby (itself)\b": "alone, separately",
    r"\bsuch as are\b": "that are",
    r"\bis held to\b|\bare held to\b": "must satisfy, is compared with",
    r"\bhad (?:it|they|there) (?:not )?(?:been|were)\b": "if it had been",
    r"\bwere (it|they|there)\b": "if it were",
    r"\b(hardly|scarcely) more\b": "give the number",
    r"\bcame before\b|\bcame after\b": "name the thing",
    r"\bas it (is|stands)\b": "unchanged",
    r"\bas they (are|stand)\b": "unchanged",
    r"\bwhatever\b(?! the)": "name the cases",
    r"\bnowhere\b|\bnowise\b|\bnaught\b|\bnought\b": "not",
    r"\bshall\b|\bwhom\b|\bwhilst\b|\bupon\b|\bamong(st)? those\b": "plain word",
}
_COMPILED = [
    (re.compile(pattern, re.IGNORECASE if "What" not in pattern and "None" not in pattern else 0), advice)
    for pattern, advice in PATTERNS.items()
]
# Python's own tokens would take 20 times as long.
_LITERAL_OR_COMMENT = re.compile(
    r'''"""(?:\\.|[^\\])*?"""|\'\'\'(?:\\.|[^\\])*?\'\'\'|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'|\#[^\n]*''', re.DOTALL
)


class Match(NamedTuple):
    """One match of a pattern: the file, the line, the words found, and the advice."""

    path: Path
    line: int
    words: str
    advice: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.words!r}: {self.advice}"


def texts_of_python(source: str) -> Iterator[tuple[int, str]]:
    """Yield the first line and the text of each comment block and each literal with a space, f-strings included."""
    comments: list[tuple[int, str]] = []
    line, last = 1, 0
    for found in _LITERAL_OR_COMMENT.finditer(source):
        if found[0].startswith("#"):
            line, last = line + source.count("\n", last, found.start()), found.start()
            text = found[0].lstrip("#: ")
            if comments and comments[-1][0] + comments[-1][1].count("\n") == line - 1:
                comments[-1] = (comments[-1][0], f"{comments[-1][1]}\n{text}")
            else:
                comments.append((line, text))
    yield from comments
    nodes: list[ast.AST] = [ast.parse(source)]
    for node in nodes:  # as `ast.walk`, in half of its time
        for value in vars(node).values():
            nodes += [each for each in (value if isinstance(value, list) else [value]) if isinstance(each, ast.AST)]
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            yield node.lineno, node.value


def texts_of_markdown(source: str) -> Iterator[tuple[int, str]]:
    """Yield the first line and the text of each paragraph outside of blocks of code."""
    is_code, start, lines = False, 1, list[str]()
    for number, line in enumerate([*source.splitlines(), ""], 1):
        is_fence = line.lstrip().startswith(("```", "~~~", ":::"))
        if is_fence and line.lstrip().startswith("```"):
            is_code = not is_code
        if is_fence or is_code or not line.strip():
            if lines:
                yield start, "\n".join(lines)
            lines = []
            continue
        if not lines:
            start = number
        lines.append(line)


def matches_in(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield the line (from 0), the words and the advice of each match in a text."""
    without_code = re.sub(r"`[^`\n]*`", lambda found: "`" + "x" * (len(found[0]) - 2) + "`", text)
    # Join the lines of each paragraph, and keep the position of each letter in the text.
    parts, positions, last = list[str](), list[range](), 0
    for end in re.finditer(r"(?<!\n)\n(?!\n)[ \t]*", without_code):
        parts += [without_code[last : end.start()], " "]
        positions.append(range(last, end.start() + 1))
        last = end.end()
    flat = "".join([*parts, without_code[last:]])
    positions.append(range(last, len(text) + 1))
    for pattern, advice in _COMPILED:
        for found in pattern.finditer(flat):
            place = next(islice(chain(*positions), found.start(), None))
            yield text[:place].count("\n"), found[0].strip(), advice


def matches_of(path: Path) -> Iterator[Match]:
    """Yield the matches in a Python or Markdown file."""
    source = path.read_text(encoding="utf-8")
    for first, text in texts_of_python(source) if path.suffix == ".py" else texts_of_markdown(source):
        for line, words, advice in matches_in(text):
            yield Match(path, first + line, words, advice)


def files_in(paths: list[Path]) -> list[Path]:
    """Return the Python and Markdown files of some files and folders, without pages that the site's build generates."""
    found = [each for path in paths for each in ([path] if path.is_file() else sorted(path.rglob("*")))]
    texts = [each for each in found if each.suffix in (".py", ".md") and each.name != "language.py"]
    return [each for each in texts if "generated" not in each.parts]


if __name__ == "__main__":
    total = 0
    for file in files_in(
        [Path(each) for each in sys.argv[1:]] or [ROOT / "warpdyn", ROOT / "docs", ROOT / "README.md"]
    ):
        for match in matches_of(file):
            print(match)
            total += 1
    print(f"{total} matches", file=sys.stderr)
    sys.exit(total > 0)
