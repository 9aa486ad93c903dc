"""Checkpoint of a run with `path=`: one file per finished region, so that a run that was killed can resume.

The folder contains `run.json` and a file with checksums for each finished region, a range of structures. `run.json` has
a hash of everything that decides the results of the run, and what was found before the first region, such as limits of
recorders. A region whose file is missing or damaged is run again; its results are identical, bit by bit.
"""

from __future__ import annotations

import json
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from warpdyn.foundations.core.description import fingerprint
from warpdyn.foundations.files.part_files import whole_file
from warpdyn.foundations.files.unfinished import Unfinished, attributes_of
from warpdyn.foundations.files.versions import version_of

FINGERPRINT = "fingerprint"  # attribute of a dataset: the digest of all that decides the bits of its run
DECIDING = ("warpdyn", "warp-lang", "numpy", "scipy")  # packages whose versions decide the bits of a run


@cache
def versions() -> tuple[str | None, ...]:
    """Return the versions of DECIDING in this process, read once; None for a package that is not installed."""
    return tuple(version_of(name) for name in DECIDING)


def fingerprint_of(*decides: object) -> str:
    """Return the digest of all that decides the bits of a run: the arguments, and the versions of DECIDING."""
    return fingerprint(*decides, *versions())


class Checkpoint:
    """The folder of the finished regions of a run.

    Args:
        unfinished: Where the file or the store of the run is written.
        digest: Fingerprint of the run.
        overwrite: Whether another run at the path, finished or not, is replaced.

    Attributes:
        settled: Decisions of an earlier call for each group: the size of regions, and the method that a pilot chose,
            which may choose another one next time.

    Raises:
        FileExistsError: If another run is at the path, and `overwrite` is not set.
    """

    def __init__(self, unfinished: Unfinished, digest: str, overwrite: bool) -> None:
        self.path, self.folder, self.unfinished, self._digest = unfinished.path, unfinished.kept, unfinished, digest
        refused = "of another scene, seed or arguments); give another path, or overwrite=True to replace it"
        if self.path.exists() and not overwrite and attributes_of(self.path).get(FINGERPRINT) != digest:
            raise FileExistsError(f"cannot write {self.path}: it contains another run ({refused}")
        self._header = self.folder / "run.json"
        header = _read_header(self._header)
        if header and header[FINGERPRINT] != digest and not overwrite:
            raise FileExistsError(
                f"cannot write {self.path}: {self.folder} contains another run that is not finished ({refused}"
            )
        if header.get(FINGERPRINT) != digest:
            unfinished.forget()
            header = {FINGERPRINT: digest, "settled": {}}
        self.settled: dict[str, Any] = header["settled"]
        unfinished.is_journaled = True
        with unfinished.named_errors():
            self.folder.mkdir(exist_ok=True)
        self.settle({})

    def settle(self, values: dict[str, Any]) -> None:
        """Keep values for a call that resumes the run."""
        self.settled |= values
        with self.unfinished.named_errors(), whole_file(self._header) as part:
            part.write_text(json.dumps({FINGERPRINT: self._digest, "settled": self.settled}))


def region_file(folder: Path, group: int, structures: range) -> Path:
    """Return the file of a finished region."""
    return folder / f"{group}-{structures.start}-{structures.stop}.npz"


def _read_header(path: Path) -> dict[str, Any]:
    """Return the content of `run.json`; empty if it is missing or damaged."""
    with suppress(OSError, ValueError):
        header = json.loads(path.read_text())
        if isinstance(header, dict) and isinstance(header.get(FINGERPRINT), str):
            return header if isinstance(header.get("settled"), dict) else {}
    return {}
