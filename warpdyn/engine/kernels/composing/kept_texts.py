"""Keep composed source texts of kernels in the kernel cache, so that a new process need not compose them again.

Composing a text and checking its parts takes about 0.15 s, reading a kept text 1 ms. A text is found by all that
determines it: the source files of this package, the Python version, and the values that the plan gives to the parts.
The checks of the parts depend on the same, so that the parts of a kept text have passed them.

The name of a file begins with the digest of the source files and the Python version. When a text is added, files of
other versions that are older than OLDEST are removed. Younger ones remain, because two versions may share the cache.
"""

import functools
import hashlib
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import warp as wp

from warpdyn.engine.kernels.kernel_cache import initialise
from warpdyn.foundations.files.part_files import whole_file

FOLDER = "composed_texts"  # folder in the kernel cache
OLDEST = 7 * 86400.0  # age of a text of another version at which it is removed [s]
LENGTH_OF_VERSION = 16  # characters of the digest in file names


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
    version = _version()
    key = hashlib.sha256(f"{version} {determined_by!r}".encode()).hexdigest()
    path = Path(wp.config.kernel_cache_dir) / FOLDER / f"{version[:LENGTH_OF_VERSION]}_{key[:32]}.json"
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
        _remove_old_versions(path.parent)
    except OSError:
        pass  # a cache that cannot be written is used without kept texts
    return found


@functools.cache
def _remove_old_versions(folder: Path) -> None:
    """Remove the files of other versions that are older than OLDEST from a folder, once in a process."""
    oldest = time.time() - OLDEST
    for path in folder.glob("*.json"):
        if not path.name.startswith(_version()[:LENGTH_OF_VERSION]) and path.stat().st_mtime < oldest:
            path.unlink(missing_ok=True)


@functools.cache
def _version() -> str:
    """Return the digest of the Python version and all source files of the package of parts, slots and checks."""
    digest = hashlib.sha256(sys.version.encode())
    for path in sorted(Path(__file__).parents[1].rglob("*.py")):
        digest.update(f"{path.name} {path.stat().st_size} ".encode() + path.read_bytes())
    return digest.hexdigest()
