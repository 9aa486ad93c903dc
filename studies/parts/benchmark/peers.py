"""Measurement of the run times of peers (other programs) for the study benchmark, each in a separate process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from parts.benchmark.cases import LABELS, NO_DEVICE, build_peer_case, draw_ensemble, spread_out
from parts.benchmark.kernels import COMMON_SAMPLES, measured

STUDIES = Path(__file__).parents[2]  # folder that contains the package `peers`
Found = dict[str, Any]  # result of a peer for a case, with the keys status, note, seconds and peaks
BLANK = {"seconds": np.nan, "dof_steps_per_second": np.nan, "peak_drift_difference": np.nan}


def measure_peers(cases: Sequence[dict[str, Any]], seconds: float) -> list[dict[str, Any]]:
    """Measure the run times of the peers, and return one row per case; a failed case has a note with the reason.

    Args:
        cases: The cases. Peers on the CPU use one core each and run at the same time as peers on a GPU.
        seconds: Time after which the process of a peer is stopped [s].
    """
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for case in cases:
        groups.setdefault((case["device"], case["peer"]), []).append(case)
    by_device: dict[str, list[tuple[str, str]]] = {}
    for group in groups:
        by_device.setdefault(group[0], []).append(group)
    found: dict[tuple[str, str], list[Found]] = {}
    with tqdm(total=len(groups), desc="peers", unit="peer", disable=None) as progress:

        def take_turns(own: list[tuple[str, str]]) -> None:
            for device, peer in own:
                found[device, peer] = _measure_peer(peer, device, groups[device, peer], seconds)
                progress.update()

        with ThreadPoolExecutor(len(by_device)) as pool:
            list(pool.map(take_turns, by_device.values()))
    # Reference drifts are integrated on all cores, so this is done after all peers have been timed.
    return [_row(*pair) for group, own in groups.items() for pair in zip(own, found[group], strict=True)]


def _measure_peer(peer: str, device: str, cases: list[dict[str, Any]], seconds: float) -> list[Found]:
    """Run the process of one peer (another program), and return the results that it wrote, one per case."""
    if device == NO_DEVICE:
        return [{"status": "missing", "note": "it needs a device that this run does not have"}] * len(cases)
    with tempfile.TemporaryDirectory(prefix="benchmark") as name:
        folder = Path(name)
        for number, case in enumerate(cases):
            ensemble = draw_ensemble(case["storeys"], case["samples"], case["steps"])
            chosen = spread_out(case["samples"], case["run_samples"])
            build_peer_case(ensemble, case, chosen).write(folder / f"case-{number:03d}.npz")
        ended = _run(peer, device, cases[0]["threads"], folder, seconds)
        return [_read(folder / f"measured-{number:03d}.npz", ended) for number in range(len(cases))]


def _read(path: Path, ended: str) -> Found:
    if not path.exists():
        return {"status": "failed", "note": ended or "it left no result"}
    with np.load(path) as file:
        found = {name: values if values.ndim else values.item() for name, values in file.items()}
    # Only the drifts of the common samples are kept.
    found["peaks"] = found["peaks"][spread_out(len(found["peaks"]), COMMON_SAMPLES)] if len(found["peaks"]) else None
    return found


def _row(case: dict[str, Any], found: Found) -> dict[str, Any]:
    """Return a case with the result of a peer (another program) as a row of the dataset."""
    if found["status"] != "measured":
        return case | BLANK | {"status": found["status"], "note": found["note"]}
    return measured(case, found["seconds"], found["peaks"], found["note"])


def _run(peer: str, device: str, threads: int, folder: Path, seconds: float) -> str:
    """Run the process of a peer (another program); return a text on how it failed, "" if it succeeded."""
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(filter(None, [str(STUDIES), os.environ.get("PYTHONPATH")])),
        "XLA_PYTHON_CLIENT_PREALLOCATE": "false",  # otherwise JAX reserves most of the GPU's memory
    }
    if device == "cpu":
        environment["JAX_PLATFORMS"] = "cpu"
    module = f"peers.{peer}" if peer in LABELS else peer
    command = [sys.executable, "-m", "peers", module, str(threads), str(folder)]
    log = folder / "log"
    with log.open("wb") as output:  # not a pipe, because subprocesses of the peer could keep it open
        process = subprocess.Popen(
            command, env=environment, stdout=output, stderr=output, cwd=folder, start_new_session=True
        )
        try:
            code = process.wait(timeout=seconds)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)  # also stops compilers and workers that it started
            process.wait()
            return f"stopped after {seconds:g} s"
    if code == 0:
        return ""
    said = log.read_text(errors="replace").strip().splitlines()
    return f"its process ended with {code}" + (f": {said[-1]}" if said else "")
