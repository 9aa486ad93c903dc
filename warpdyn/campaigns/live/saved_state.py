"""Saved states of live ensembles: a netCDF file from which a new process continues with the same bits."""

from __future__ import annotations

import hashlib
import json
import os
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import warp as wp
import xarray as xr

from warpdyn.campaigns.live.live import Live
from warpdyn.campaigns.live.packets.receiver import Receiver
from warpdyn.campaigns.live.packets.track import Segment, Track
from warpdyn.campaigns.running.regions.checkpoint import versions
from warpdyn.campaigns.running.regions.job import machines_of
from warpdyn.engine.kernels.plan import options
from warpdyn.foundations.core.checks import check_kind
from warpdyn.foundations.core.description import fingerprint
from warpdyn.foundations.core.interruption import interruptible
from warpdyn.foundations.files.netcdf import trace, write_at_once
from warpdyn.foundations.files.unfinished import Unfinished

KIND = "state of a live ensemble"  # attribute `kind` of the file
# Attributes that are equal in the saved state and in the Live that continues -> remedy if one differs.
MUST_AGREE = {
    "scene": "it was saved from another scene (structure, scatter, recorders, motion or title): give the same Scene",
    "settings": "it was saved from another Live (structures, seed, unit, sampling_step, patience, longest_gap, method, "
    "step or number type): give the same arguments to wd.Live",
    "versions": "it was saved by other versions of warpdyn, Warp, NumPy or SciPy, whose results may differ in the last "
    "bits: install the same versions, or begin again from the record",
    "machines": "it was saved on another kind of processor, which rounds differently: continue there, or begin again "
    "from the record",
    "kernels": "it was saved by kernels with another source text: continue with the same version of warpdyn, or begin "
    "again from the record",
}


def save_state(live: Live, path: str | os.PathLike) -> Path:
    """Save the state of a live ensemble in a netCDF file.

    The file has its name only when it is complete: if the process is killed meanwhile, an earlier state at this path
    remains.

    Args:
        live: The live ensemble.
        path: The file, in an existing folder; its name must end in ".nc".

    Returns:
        The absolute path of the file.

    Raises:
        OSError: If the file cannot be written, or warpdyn did not write the file at this path.
        ValueError: If the name does not end in ".nc", or the motion is finished.
        TypeError: If `live` is not a Live.

    Example:
        >>> scene = wd.Scene(building, motions[0], scatter)
        >>> live = wd.Live(scene, structures=3)
        >>> answer = live.push(motions[0].acceleration[:200])
        >>> path = wd.save_state(live, "state.nc")
        >>> later = wd.load_state(wd.Live(scene, structures=3), path)  # also in another process
        >>> later.time == live.time
        True
    """
    check_kind("save_state", "a Live", live, Live)
    live.paused.check_whole()
    if live.is_finished:
        raise ValueError("the motion of this Live is finished, so that nothing remains to be continued: write the run")
    described, arrays = _packed(live.arriving.receiver)
    variables: dict[str, tuple] = {
        "record": (("sample_of_record", "component"), live.record, {"units": "m s-2", "long_name": "motion so far"}),
        "arrived": (("value",), arrays, {"units": "m s-2", "long_name": "samples that the receiver keeps"}),
    }
    for number, group in enumerate(live.paused.groups):
        for name, array in group.state.items():
            dims = (f"row_{number}_{name}", f"column_{number}")
            variables[f"state_{number}_{name}"] = (dims, array.numpy(), {"long_name": f"stored values, {name}"})
    described |= {"intervals": live.paused.intervals, "counted": {"refused": live.arriving.refused}}
    attributes = trace(live.scene.title, "save_state") | {"kind": KIND, "receiver": json.dumps(described)}
    attributes["checksum"] = _checksum(attributes["receiver"], {name: row[1] for name, row in variables.items()})
    dataset = xr.Dataset(variables, attrs=attributes | _identity(live))
    for variable in dataset.variables.values():
        variable.encoding["_FillValue"] = None  # NaN of failed samples are values
    with interruptible(), Unfinished(path) as unfinished:
        write_at_once(dataset, unfinished)
    return unfinished.path


def load_state(live: Live, path: str | os.PathLike) -> Live:
    """Let a live ensemble continue from a saved state, and return it.

    Args:
        live: A Live with the scene and the arguments of the one that was saved.
        path: File of `save_state`.

    Raises:
        ValueError: If the file contains no state, or the state of another scene, other arguments, other versions or
            another kind of processor, or has changed since it was saved, or the Live has received packets. The Live is
            then unchanged.
        OSError: If the file cannot be read.
        TypeError: If `live` is not a Live.

    Example:
        >>> scene = wd.Scene(building, motions[0], scatter)
        >>> path = wd.save_state(wd.Live(scene, structures=3), "start.nc")
        >>> wd.load_state(wd.Live(scene, structures=3), path).time
        0.0
    """
    check_kind("load_state", "a Live", live, Live)
    if live.paused.is_whole and live.arriving.receiver.packets:
        raise ValueError(
            "load_state: this Live has already received packets, which would be lost: give a new Live with the same "
            "arguments"
        )
    with _opened(path) as file:
        file.set_auto_mask(False)
        found = {name: file.getncattr(name) for name in file.ncattrs()}
        if found.get("kind") != KIND:
            raise ValueError(f"{path} does not contain the state of a Live: give a file of wd.save_state")
        for name, value in _identity(live).items():
            if found.get(name) != value:
                raise ValueError(f"{path}: the state cannot be used here: {MUST_AGREE[name]}")
        arrays = {name: np.asarray(variable[:]) for name, variable in file.variables.items()}
    if found.get("checksum") != _checksum(found.get("receiver", ""), arrays):
        raise ValueError(
            f"{path}: the file has changed since save_state wrote it (its checksum differs), so that results would be "
            "wrong: use another state, or begin again from the record"
        )
    described = json.loads(found["receiver"])
    states = [
        {name: arrays[f"state_{number}_{name}"] for name in group.state}
        for number, group in enumerate(live.paused.groups)
    ]
    record, arrived = arrays["record"], arrays["arrived"]
    for group, state in zip(live.paused.groups, states, strict=True):
        for name, array in group.state.items():
            array.assign(state[name])
    live.paused.is_whole = True
    live.paused.intervals = described["intervals"]
    live.arriving.restore(
        _unpacked(live.arriving.receiver, described, arrived), np.asarray(record), described["counted"]
    )
    return live


def _checksum(described: str, arrays: Mapping[str, np.ndarray]) -> str:
    """Return the SHA-256 digest of the description of the receiver and of the arrays of a state."""
    digest = hashlib.sha256(described.encode())
    for name in sorted(arrays):
        digest.update(f"{name} {arrays[name].shape} {arrays[name].dtype.str}".encode())
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


def _opened(path: str | os.PathLike) -> netCDF4.Dataset:
    """Return an open netCDF file; raise a ValueError if it is another kind of file."""
    try:
        return netCDF4.Dataset(os.fspath(path))
    except OSError as error:
        if error.errno is None or error.errno > 0:  # errors of netCDF are negative
            raise
        raise ValueError(f"{path} is not a netCDF file ({error.strerror}): give a file of wd.save_state") from error


def _identity(live: Live) -> dict[str, str]:
    """Return hashes of all that must agree between a saved state and the Live that continues, by attribute."""
    receiver = live.arriving.receiver
    of_packets = receiver.packet_step, receiver.factor, receiver.tracks[0].patience, receiver.tracks[0].longest_gap
    compiled = wp.config.optimization_level
    texts = [
        (group.pausing.composed.text, group.plan.lanes, group.count, options(group.plan), compiled)
        for group in live.paused.groups
    ]
    parts = {
        "scene": live.scene,
        "settings": (live.structures, live.seed, live.integration, *of_packets),
        "versions": versions(),
        "machines": machines_of(live.execution),
        "kernels": texts,
    }
    return {name: fingerprint(value) for name, value in parts.items()}


def _packed(receiver: Receiver) -> tuple[dict[str, object], np.ndarray]:
    """Return the state of a receiver: what JSON can describe, and all samples in one row."""
    tracks, values = [], []
    for track in receiver.tracks:
        segments = [track.recent, *track.waiting]
        tracks.append(
            {
                "begin": track.begin,
                "expected": track.expected,
                "segments": [(each.first, len(each.values)) for each in segments],
                "fresh": [len(each) for each in track.fresh],
                "counts": dict(track.counts),
            }
        )
        values += [each.values for each in segments] + list(track.fresh)
    last = np.zeros(0) if receiver.last is None else np.ravel(receiver.last)
    described = {"tracks": tracks, "taken": receiver.taken, "begin": receiver.begin, "packets": receiver.packets}
    return described | {"has_last": receiver.last is not None}, np.concatenate([*values, last])


def _unpacked(receiver: Receiver, described: dict, values: np.ndarray) -> Receiver:
    """Return the receiver that `_packed` described."""
    parts = iter(np.split(values, np.cumsum(list(_lengths(described)))))
    tracks: list[Track] = []
    for track, own in zip(receiver.tracks, described["tracks"], strict=True):
        recent, *waiting = [Segment(first, next(parts)) for first, _ in own["segments"]]
        fresh = tuple(next(parts) for _ in own["fresh"])
        times = {"begin": own["begin"], "expected": own["expected"]}
        counts = Counter(own["counts"])
        tracks.append(replace(track, recent=recent, waiting=tuple(waiting), fresh=fresh, counts=counts, **times))
    last = next(parts)[None] if described["has_last"] else None
    known = {name: described[name] for name in ("taken", "begin", "packets")}
    return replace(receiver, tracks=tuple(tracks), last=last, **known)


def _lengths(described: dict) -> Iterator[int]:
    """Yield the lengths of the rows of samples that `_packed` joined, except the last row."""
    for own in described["tracks"]:
        yield from (length for _, length in own["segments"])
        yield from own["fresh"]
