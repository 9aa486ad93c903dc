"""Keep composed source texts of kernels in the kernel cache, so that a new process need not compose them again.

Composing a text and checking its parts takes about 0.15 s, reading a kept text 1 ms. A text is found by all that
determines it: the source files of this package, the Python version, and the values that the plan gives to the parts.
The checks of the parts depend on the same, so that the parts of a kept text have passed them.
"""

import functools
import hashlib
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import warp as wp

from warpdyn.engine.kernels.kernel_cache import initialise
from warpdyn.foundations.files.part_files import whole_file

FOLDER = "composed_texts"  # folder in the kernel cache


class Text(NamedTuple):
    """The source text of a kernel, all names in it, and the names that it reads without assigning to them."""

    text: str
    named: frozenset[str]
    needed: frozenset[str]


def kept_text(determined_by: object, compose: Callable[[], Text]) -> Text:
    """Return a text from the kernel cache; if the cache does not contain it, or it is damaged, compose and keep it.

    Args:
        determined_by: All that determines the text, in addition to the source files of this package; it is known by
            its `repr`.
        compose: Returns the text.
    """
    initialise()  # sets the folder of the kernel cache
    key = hashlib.sha256(f"{sys.version} {_digest_of_sources()} {determined_by!r}".encode()).hexdigest()
    path = Path(wp.config.kernel_cache_dir) / FOLDER / f"{key[:32]}.json"
    try:
        digest, content = path.read_text().split("\n")
        if digest == hashlib.sha256(content.encode()).hexdigest():
            text, named, needed = json.loads(content)
            return Text(text, frozenset(named), frozenset(needed))
    except (OSError, ValueError):
        pass
    found = compose()
    content = json.dumps([found.text, sorted(found.named), sorted(found.needed)])
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(path) as part:
            part.write_text(f"{hashlib.sha256(content.encode()).hexdigest()}\n{content}")
    except OSError:
        pass  # a cache that cannot be written is used without kept texts
    return found


@functools.cache
def _digest_of_sources() -> str:
    """Return the digest of all source files of the package that contains the parts, the slots and the checks."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(f"{path.name} {path.stat().st_size} ".encode() + path.read_bytes())
    return digest.hexdigest()
