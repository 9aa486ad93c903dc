"""Links, devices, foreign files and permissions where a file is to be written, and writers of each kind of file."""

import os
import socket
import stat
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import warpdyn as wd
from warpdyn.foundations.files.unfinished import Unfinished
from warpdyn.foundations.files.zarr_stores import complete, lay_out, write_region

IS_ROOT = hasattr(os, "geteuid") and os.geteuid() == 0
NOBODY = 65534
HEX = "0123456789abcdef" * 2
PRECIOUS = b"precious"


def make_dataset(scale=1.0):
    values = scale * np.arange(4.0)
    return xr.Dataset({"drift": ("sample", values, {"units": "m"})}, {"sample": range(4)}, {"source": "warpdyn"})


def write_store(path, scale):
    """Write a small store as runs do."""
    pytest.importorskip("zarr")
    with Unfinished(path, ".zarr") as unfinished:
        unfinished.kept.mkdir(exist_ok=True)
        unfinished.is_journaled = True
        store = unfinished.kept / "statistics.zarr"
        lay_out(store, make_dataset().isel(sample=slice(0)), 4, 2)
        for first in (0, 2):
            rows = make_dataset(scale).isel(sample=slice(first, first + 2))
            write_region(store, first, {"drift": rows["drift"].values, "sample": rows["sample"].values})
        complete(store, xr.Dataset(attrs={"source": "warpdyn"}))
        unfinished.move_in_store(store)


WRITERS = {
    "table.csv": lambda path, scale: wd.write_table(make_dataset(scale), path),
    "table.parquet": lambda path, scale: wd.write_table(make_dataset(scale), path),
    "run.nc": lambda path, scale: wd.write(make_dataset(scale), path),
    "run.zarr": write_store,
}
IN_FOLDERS = ("run.nc", "run.zarr")  # which are written in a hidden folder
OF_TEXT = ("table.csv", "table.parquet")


def values_in(path):
    """Return the values of what was written."""
    if path.suffix == ".csv":
        return np.loadtxt(path, delimiter=",", skiprows=1)[:, 1]
    if path.suffix == ".parquet":
        return pytest.importorskip("pandas").read_parquet(path)["drift_m"].to_numpy()
    with xr.open_dataset(path) if path.suffix == ".nc" else xr.open_zarr(path) as read:
        return read["drift"].values


def entries(folder):
    """Return all that is below a folder: kinds, modes, owners, what links lead to and what files hold."""
    found = {}
    for path in sorted(folder.rglob("*")):
        about = os.lstat(path)
        held = None
        if path.is_symlink():
            held = os.readlink(path)
        elif path.is_file():
            held = path.read_bytes()
        found[str(path.relative_to(folder))] = about.st_mode, about.st_uid, about.st_ino, held
    return found


def precious(path):
    """Make a folder with a file that is nobody's business."""
    path.mkdir(parents=True)
    (path / "notes.txt").write_bytes(PRECIOUS)
    return path


def hidden(path):
    """Return the hidden folder of a file, as a killed process of warpdyn left it."""
    folder = path.with_name(f".{path.name}.unfinished")
    folder.mkdir()
    (folder / "lock").touch()
    return folder


def older(path):
    path.parent.mkdir(exist_ok=True)
    WRITERS[path.name](path, 2.0)
    return path


def moved_away(path):
    """Write an older file beside, and return its path."""
    older(path)
    target = path.with_name(f"older{path.suffix}")
    path.rename(target)
    return target


def link_to_older(path):
    path.symlink_to(moved_away(path))


def link_to_older_by_two_links(path):
    target = moved_away(path)
    path.with_name("second").symlink_to(target)
    path.symlink_to("second")


def hard_link(path):
    older(path)
    copy = path.with_name(f"backup{path.suffix}")
    if path.is_dir():
        for each in path.rglob("*"):
            to = copy / each.relative_to(path)
            to.parent.mkdir(parents=True, exist_ok=True)
            if each.is_file():
                os.link(each, to)
    else:
        os.link(path, copy)


def with_mode(mode):
    return lambda path: older(path).chmod(mode | (mode & 0o444) >> 2 if path.is_dir() else mode)


def of_nobody(path):
    older(path)
    for each in (path, *path.rglob("*")):
        os.chown(each, NOBODY, NOBODY)


def device(path):
    os.mknod(path, stat.S_IFCHR | 0o666, os.makedev(1, 3))


def listening(path):
    with socket.socket(socket.AF_UNIX) as found:
        here = os.getcwd()
        os.chdir(path.parent)  # names of sockets are short
        try:
            found.bind(path.name)
        finally:
            os.chdir(here)


def loop(path):
    path.symlink_to("second")
    path.with_name("second").symlink_to(path.name)


def foreign_store(path):
    (path / "drift").mkdir(parents=True)
    (path / ".zattrs").write_text('{"source": "another program"}')


def inside_store(make):
    return lambda path: make(older(path) / "drift")


def folder_is(make):
    return lambda path: make(path.with_name(f".{path.name}.unfinished"))


def in_folder(make):
    return lambda path: make(hidden(path))


def left_by_text(name, make):
    return lambda path: make(path.with_name(name.format(name=path.name, hex=HEX)))


def linked(path, name="elsewhere"):
    """Link to a folder with a file."""
    path.symlink_to(precious(path.parent / name))


def linked_file(path):
    elsewhere = path.parent / "elsewhere.txt"
    elsewhere.write_bytes(PRECIOUS)
    path.symlink_to(elsewhere)


def hard_linked(path):
    elsewhere = path.parent.parent / "elsewhere.txt"
    elsewhere.write_bytes(PRECIOUS)
    os.link(elsewhere, path)


def held(folder):
    (folder / "kept").mkdir()
    return folder / "kept"


def of_another_user(folder):
    for each in (folder / "lock", folder):
        os.chown(each, NOBODY, NOBODY)


def write_notes(path):
    path.write_bytes(PRECIOUS)


NEEDS_ROOT = {"a device", "a file of another user", "hidden folder of another user"}
# What is there; whether it is written (True) or refused (False); for which writers, all by default.
ARRANGEMENTS = {
    "nothing": (lambda path: None, True, WRITERS),
    "an older one": (older, True, WRITERS),
    "a link to an older one": (link_to_older, True, WRITERS),
    "a link to a link": (link_to_older_by_two_links, True, WRITERS),
    "a link to nothing": (lambda path: path.symlink_to(path.with_name(f"new{path.suffix}")), True, WRITERS),
    "links to each other": (loop, False, WRITERS),
    "a link to /dev/null": (lambda path: path.symlink_to("/dev/null"), False, WRITERS),
    "a link to a folder": (linked, False, WRITERS),
    "a folder": (precious, False, WRITERS),
    "a pipe": (os.mkfifo, False, WRITERS),
    "a link to a pipe": (lambda path: (os.mkfifo(path.with_name("pipe")), path.symlink_to("pipe")), False, WRITERS),
    "a socket": (listening, False, WRITERS),
    "a device": (device, False, WRITERS),
    "a hard link": (hard_link, True, WRITERS),
    "mode 0600": (with_mode(0o600), True, WRITERS),
    "mode 0664": (with_mode(0o664), True, WRITERS),
    "mode 0444": (with_mode(0o444), False, OF_TEXT + IN_FOLDERS[:1]),
    "mode 0555": (lambda path: older(path).chmod(0o555), False, IN_FOLDERS),
    "a file of another user": (of_nobody, True, WRITERS),
    "a foreign file": (write_notes, False, IN_FOLDERS),
    "a foreign store": (foreign_store, False, IN_FOLDERS),
    "a store with notes": (inside_store(lambda folder: write_notes(folder / "notes.txt")), False, IN_FOLDERS[1:]),
    "a store with a link": (inside_store(lambda folder: linked_file(folder / "2")), False, IN_FOLDERS[1:]),
    "a store with a linked folder": (inside_store(lambda folder: linked(folder / "a", "b")), False, IN_FOLDERS[1:]),
    "a store with a pipe": (inside_store(lambda folder: os.mkfifo(folder / "3")), False, IN_FOLDERS[1:]),
    "hidden folder is a link": (folder_is(linked), False, IN_FOLDERS),
    "hidden folder links to a file": (folder_is(linked_file), False, IN_FOLDERS),
    "hidden folder links to nothing": (folder_is(lambda path: path.symlink_to("nothing")), False, IN_FOLDERS),
    "hidden folder is a file": (folder_is(write_notes), False, IN_FOLDERS),
    "hidden folder is a pipe": (folder_is(os.mkfifo), False, IN_FOLDERS),
    "hidden folder is foreign": (folder_is(precious), False, IN_FOLDERS),
    "hidden folder is empty": (folder_is(Path.mkdir), True, IN_FOLDERS),
    "hidden folder of a killed process": (
        in_folder(lambda folder: write_notes(folder / f".run.{HEX}.part")),
        True,
        IN_FOLDERS,
    ),
    "hidden folder with notes": (in_folder(lambda folder: write_notes(folder / "notes.txt")), False, IN_FOLDERS),
    "hidden folder with a folder": (in_folder(lambda folder: precious(folder / "deeper")), False, IN_FOLDERS),
    "hidden folder with a link": (in_folder(lambda folder: linked_file(folder / "part.nc")), False, IN_FOLDERS),
    "hidden folder with a hard link": (in_folder(lambda folder: hard_linked(folder / "part.nc")), True, IN_FOLDERS),
    "kept is a link": (in_folder(lambda folder: linked(folder / "kept", "a")), False, IN_FOLDERS),
    "kept holds notes": (in_folder(lambda folder: write_notes(held(folder) / "notes")), False, IN_FOLDERS),
    "kept holds a link": (in_folder(lambda folder: linked_file(held(folder) / "0-4.0.npz")), False, IN_FOLDERS),
    "replaced is a link": (in_folder(lambda folder: linked(folder / "replaced", "a")), False, IN_FOLDERS),
    "lock is a link": (folder_is(lambda path: (path.mkdir(), linked_file(path / "lock"))), False, IN_FOLDERS),
    "lock is a pipe": (folder_is(lambda path: (path.mkdir(), os.mkfifo(path / "lock"))), False, IN_FOLDERS),
    "hidden folder of another user": (in_folder(of_another_user), False, IN_FOLDERS),
    "unfinished file is a link": (left_by_text(".{name}.{hex}.part", linked_file), True, OF_TEXT),
    "unfinished file is a folder": (left_by_text(".{name}.{hex}.part", precious), True, OF_TEXT),
    "unfinished file is a pipe": (left_by_text(".{name}.{hex}.part", os.mkfifo), True, OF_TEXT),
    "unfinished file of another name": (left_by_text(".other.{hex}.part", write_notes), True, OF_TEXT),
    "almost an unfinished file": (left_by_text(".{name}.1.part", write_notes), True, OF_TEXT),
}
