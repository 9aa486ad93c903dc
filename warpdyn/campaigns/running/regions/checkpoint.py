"""Checkpoint of a run with `path=`: one file per finished region, so that a killed run can resume.

A region is a range of structures. The folder of the checkpoint contains `run.json` and, for each finished region, a
file with checksums. `run.json` contains a hash of everything that decides the results of the run, and values that were
found before the first region, such as the size of the regions. A region whose file is missing or damaged is run again;
its results are bit-identical.
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

FINGERPRINT = "fingerprint"  # attribute of a dataset: digest of all settings that decide the bits of its run
DECIDING = ("warpdyn", "warp-lang", "numpy", "scipy")  # packages whose versions may change the bits of a run


@cache
def versions() -> tuple[str | None, ...]:
    """Return the installed versions of the packages DECIDING, read once; None for a package that is not installed."""
    return tuple(version_of(name) for name in DECIDING)


def fingerprint_of(*decides: object) -> str:
    """Return a digest (text) of the arguments and of the versions of the packages DECIDING; it identifies a run."""
    return fingerprint(*decides, *versions())


class Checkpoint:
    """Checkpoint of a run: the folder with the files of its finished regions (ranges of structures).

    Args:
        unfinished: Temporary place where the file or the store of the run is written.
        digest: Fingerprint of the run.
        overwrite: Whether to replace another run, finished or not, that exists at the path.

    Attributes:
        settled: Decisions of an earlier, interrupted call, by group of structures: the size of its regions, and the
            settings that its pilot run chose. A resumed run reuses them, because a new pilot may choose differently.

    Raises:
        FileExistsError: If another run exists at the path, and `overwrite` is False.
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
        """Write values to `run.json`, from which a call that resumes the run reads them."""
        self.settled |= values
        with self.unfinished.named_errors(), whole_file(self._header) as part:
            part.write_text(json.dumps({FINGERPRINT: self._digest, "settled": self.settled}))


def region_file(folder: Path, group: int, structures: range) -> Path:
    """Return the path of a finished region's file in a checkpoint folder."""
    return folder / f"{group}-{structures.start}-{structures.stop}.npz"


def _read_header(path: Path) -> dict[str, Any]:
    """Return the content of `run.json`; empty if it is missing or damaged."""
    with suppress(OSError, ValueError):
        header = json.loads(path.read_text())
        if isinstance(header, dict) and isinstance(header.get(FINGERPRINT), str):
            return header if isinstance(header.get("settled"), dict) else {}
    return {}
