"""Functions that all studies use: command-line arguments, the path of the result, and writing of figures."""

from __future__ import annotations

import argparse
import atexit
import gc
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from warpdyn.foundations.files.unfinished import check_writable

if TYPE_CHECKING:  # importing matplotlib takes 0.3 s and is not needed before results are written
    from matplotlib.figure import Figure

# Packages and kernels create hundreds of thousands of objects that exist until the program ends. Python's garbage
# collector searches them less often here. It does not search them at the end, which would take 0.3 s.
gc.set_threshold(50_000, 20, 50)
atexit.register(gc.freeze)


def read_arguments(
    description: str | None,
    count: int,
    meaning: str,
    counted: str = "samples",
    switches: Mapping[str, str] | None = None,
) -> argparse.Namespace:
    """Return the command-line arguments `out`, `device`, `samples` (or another count) and `seed`.

    Args:
        description: Description of the study that `--help` prints.
        count: Default value of the count.
        meaning: Description of the count that `--help` prints.
        counted: Name of the argument for the count, such as "structures".
        switches: Name of each argument without a value, such as "fast" -> its description.
    """
    parser = parser_of(description)
    parser.add_argument("--device", help="cpu or cuda:0 [the first GPU, or the CPU]")
    parser.add_argument(f"--{counted}", type=int, default=count, help=f"{meaning} [%(default)s]")
    parser.add_argument("--seed", type=int, default=0, help="seed of every random draw [%(default)s]")
    for name, words in (switches or {}).items():
        parser.add_argument(f"--{name}", action="store_true", help=words)
    return parser.parse_args()


def parser_of(description: str | None) -> argparse.ArgumentParser:
    """Return a parser with the argument `out`; `description` is what `--help` prints."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("results"), help="folder for the results [%(default)s]")
    return parser


def file_in(folder: Path, name: str) -> Path:
    """Create the folder for the results, and return the path of a file in it, after checking that it can be written."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SystemExit(f"cannot write {folder / name}: {error}; choose another folder by --out") from error
    return check_writable(folder / name)


def save_figures(figures: Mapping[str, Figure], folder: Path) -> None:
    """Write each figure to a PNG file in the folder; the keys are the names of the files."""
    for name, figure in figures.items():
        figure.savefig(folder / f"{name}.png", dpi=150)
