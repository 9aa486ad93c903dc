"""What a run with `path=` has integrated, block by block, so that a run that was killed goes on from there.

Results of the kernels are kept, with the steps and reruns that they took; all else is computed from them again, in the
same order, so that a run which goes on has the bits of one that was never interrupted.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from warpdyn.campaigns.integration.dynamics import Arrays
from warpdyn.campaigns.integration.ensemble import Ensemble
from warpdyn.campaigns.integration.stability_guard import Reruns
from warpdyn.foundations.core.description import fingerprint
from warpdyn.foundations.core.messages import tell
from warpdyn.foundations.files.checksums import are_whole, is_sealed, load_arrays, save_arrays
from warpdyn.foundations.files.part_files import whole_file
from warpdyn.foundations.files.removal import remove_tree
from warpdyn.foundations.files.unfinished import Unfinished, attributes_of
from warpdyn.foundations.files.versions import version_of

FINGERPRINT = "fingerprint"  # the attribute of a dataset that says which run made it


def fingerprint_of(*decides: object) -> str:
    """Return the digest of all that decides the bits of a run: what is given, and the versions of what computes."""
    return fingerprint(*decides, *_versions())


@cache
def _versions() -> tuple[str | None, ...]:
    """Return the versions of what computes; they are read from files, once."""
    return tuple(version_of(name) for name in ("warpdyn", "warp-lang", "numpy", "scipy"))


class Journal:
    """The finished blocks of a run, one file for each block and event.

    Args:
        unfinished: Where the file of the run is written.
        digest: What `fingerprint_of` returned of the run.
        overwrite: Whether another run may stand there, finished or not.

    Attributes:
        settled: What an earlier call has chosen, by name, for values that another call might choose otherwise.

    Raises:
        FileExistsError: If another run stands there, and `overwrite` is not set.
    """

    def __init__(self, unfinished: Unfinished, digest: str, overwrite: bool) -> None:
        self.path, self.folder, self._unfinished = unfinished.path, unfinished.kept, unfinished
        advice = "give another path, or overwrite=True to replace it"
        if self.path.exists() and not overwrite and attributes_of(self.path).get(FINGERPRINT) != digest:
            raise FileExistsError(
                f"cannot write {self.path}: another run stands there (of another scene, seed or arguments); {advice}"
            )
        self._header = self.folder / "run.json"
        header = _read_header(self._header)
        if header and header[FINGERPRINT] != digest and not overwrite:
            raise FileExistsError(
                f"cannot write {self.path}: another run that is not finished stands there (of another scene, seed or "
                f"arguments); {advice}"
            )
        if header.get(FINGERPRINT) != digest:
            unfinished.forget()
            header = {FINGERPRINT: digest, "settled": {}}
        self.settled: dict[str, Any] = header["settled"]
        self._digest = digest
        unfinished.is_journaled = True
        with unfinished.named_errors():
            self.folder.mkdir(exist_ok=True)
        self._write_header()

    def settle(self, **values: object) -> None:
        """Keep values for a call that goes on from here."""
        self.settled |= values
        self._write_header()

    def _write_header(self) -> None:
        with self._unfinished.named_errors(), whole_file(self._header) as part:
            part.write_text(json.dumps({FINGERPRINT: self._digest, "settled": self.settled}))

    def blocks(self, events: int, structures: int) -> list[range]:
        """Return the structures of the blocks that are finished, from the first structure on, and say how many."""
        ends = {}
        for path in self.folder.glob(f"*.{events - 1}.npz"):
            first, last = map(int, path.name.split(".")[0].split("-"))
            if self.has(range(first, last), events):
                ends[first] = last
        found: list[range] = []
        first = 0
        while first in ends:
            found.append(range(first, ends[first]))
            first = ends[first]
        if found:
            tell(f"{self.path}: goes on from the {first} of {structures} structures that an earlier run has finished")
        return found

    def has(self, structures: range, events: int) -> bool:
        """Return whether a block is finished, and the checksums of its files agree."""
        return all(are_whole(self._file(structures.start, structures.stop, event)) for event in range(events))

    def keep(
        self, structures: range, event: int, run: Ensemble, found: Arrays, reruns: Reruns, in_float64: int
    ) -> None:
        """Keep an event of a block: the outputs of its samples, their steps, and the reruns until then.

        Args:
            structures: The block's structures.
            event: Index of the event.
            run: All samples of the event.
            found: Outputs of those that were integrated, sample first.
            reruns: Reruns of failed samples until then.
            in_float64: Number of the block's samples that were run again in float64, which is told at the end.
        """
        columns = dict(zip(("intervals", "substeps", "step", "residual_steps"), run.schedule.columns, strict=True))
        arrays = {f"output_{name}": found[name] for name in run.model.shapes} | columns
        counts: dict[str, Any] = {"reruns": json.dumps(reruns.state), "in_float64": in_float64}
        with self._unfinished.named_errors():
            save_arrays(self._file(structures.start, structures.stop, event), counts | arrays)

    def restore(self, structures: range, event: int, run: Ensemble, found: Arrays, reruns: Reruns) -> int:
        """Fill in what `keep` kept; return how many samples were run again in float64."""
        path = self._file(structures.start, structures.stop, event)
        kept = load_arrays(path)
        try:
            if kept is None:
                raise KeyError(path)
            for name in run.model.shapes:
                np.copyto(found[name], kept[f"output_{name}"])
            columns = [kept[name] for name in ("intervals", "substeps", "step", "residual_steps")]
            reruns.state = json.loads(str(kept["reruns"]))
            in_float64 = int(kept["in_float64"])
        except (KeyError, ValueError) as error:
            raise OSError(
                f"{path} was damaged while the run of {self.path} read it: make the same call again, which runs the "
                "structures of this file again"
            ) from error
        run.schedule = replace(
            run.schedule, run_intervals=columns[0], substeps=columns[1], step=columns[2], residual_steps=columns[3]
        )
        return in_float64

    def _file(self, first: int, last: int, event: int) -> Path:
        return self.folder / f"{first}-{last}.{event}.npz"


def is_finished(path: Path, digest: str) -> bool:
    """Return whether an earlier call has finished a group of a portfolio; one that is damaged is removed.

    Args:
        path: The file or the Zarr store of the group, in the folder of a run that is kept.
        digest: Fingerprint of the run of the group.
    """
    if is_sealed(path) and attributes_of(path).get(FINGERPRINT) == digest:
        return True
    if path.is_dir():
        remove_tree(path)
    else:
        path.unlink(missing_ok=True)
    return False


def _read_header(path: Path) -> dict[str, Any]:
    """Return what `run.json` holds; nothing if it is missing or damaged."""
    with suppress(OSError, ValueError):
        header = json.loads(path.read_text())
        if isinstance(header, dict) and isinstance(header.get(FINGERPRINT), str):
            return header if isinstance(header.get("settled"), dict) else {}
    return {}
