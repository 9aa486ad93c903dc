"""Speed of torsional buildings with bilinear walls: share of hand-written programs, and several numbers of storeys.

    python studies/torsional_speed.py --out results --device cuda:0 --samples 262144

Ten storeys have 30 degrees of freedom and 40 walls. The hand-written programs are studies/peers/torsional_building.*;
they are compiled and run in the same run as warpdyn. On a CPU, both use one thread. The study prints, and writes to
torsional_speed.csv, the rates in steps times degrees of freedom per second, and for a GPU the registers of a thread and
its bytes of local memory (of an H100 or H200). The figure torsional_speed.png shows the rates against the number of
degrees of freedom. In each run of warpdyn, the kernels' time is the least of three.
"""

from __future__ import annotations

import csv
import tempfile
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import warp as wp
from matplotlib.figure import Figure
from parts.command_line import read_arguments, save_figures
from parts.cubin import usage
from peers import torsional_building as peer

import warpdyn as wd
from warpdyn.campaigns.integration.model import dynamics_of, plan_of
from warpdyn.engine.kernels import build

STOREYS = (3, 5, 10, 21)  # 9, 15, 30 and 63 degrees of freedom
METHODS = {"rk4": "rk4 by storey", "leapfrog": "verlet by thread", "stoermer": "verlet by thread"}
CPU_SAMPLES = 512


def scene_of(storeys: int) -> wd.Scene:
    """Return buildings with random stiffness under one motion with 32 scales."""
    pair = wd.PairOfMotions(
        wd.GroundMotion(peer.motion(0.0, 1.0), peer.STEP, "x"), wd.GroundMotion(peer.motion(1.3, 0.8), peer.STEP, "y")
    )
    levels = wd.Stripes([pair], list(np.geomspace(0.5, 4.0, 32)), wd.PeakGroundAcceleration())
    scatter = {"stiffness": wd.RandomFactor(wd.Lognormal(1.0, 0.25))}
    return wd.Scene(peer.structure(storeys), levels, scatter, recorders=("spring",))


def rate(scene: wd.Scene, method: str, samples: int, device: str) -> float:
    """Return steps times degrees of freedom per second of the kernels, float32."""
    threads = {"threads": 1} if device == "cpu" else {}
    settings = {"structures": max(1, samples // 32), "method": method, "step": peer.STEP, "device": device, **threads}
    runs = [wd.simulate(scene, on_unstable="flag", **settings) for _ in range(3)]
    seconds = min(float(run.attrs["seconds_in_kernels"]) for run in runs)
    return runs[0].sizes["sample"] * peer.STEPS * scene.structure.dofs / seconds


def registers(scene: wd.Scene, method: str) -> dict[str, int]:
    """Return the registers of a thread of the GPU's kernel, its local memory [bytes], and the threads of a sample."""
    plan = plan_of(scene, dynamics_of(scene), method, "float32", is_gpu=True)
    kernel = build.build_kernel(build.undivided(replace(plan)))
    with tempfile.TemporaryDirectory() as folder:
        wp.compile_aot_module(kernel.module, arch=90, module_dir=folder, use_ptx=False)
        [binary] = Path(folder).glob("*.cubin")
        found = usage(binary)
    return {"threads_per_sample": plan.sections, "registers": found.registers, "local_bytes": found.local}


def measured(samples: int, device: str) -> list[dict[str, object]]:
    """Return one row for each program, method and number of storeys."""
    on_cpu = device == "cpu"
    rows: list[dict[str, object]] = []
    work = peer.STEPS * 3 * peer.STOREYS

    def add(program: str, method: str, storeys: int, value: float, **more: object) -> None:
        rows.append({"program": program, "method": method, "dofs": 3 * storeys, "dof_steps_per_second": value, **more})
        print(f"{program}, {method}, {3 * storeys} DOF: {value:.3g} DOF-steps/s {more or ''}", flush=True)

    ensemble = peer.Ensemble.drawn(CPU_SAMPLES if on_cpu else samples)
    count = ensemble.scale.size
    for method in ("verlet", "rk4") if on_cpu else peer.KERNELS:
        found = peer.by_cpp(ensemble, method) if on_cpu else peer.by_cuda(ensemble, method)
        add("hand-written", method, peer.STOREYS, count * work / found.seconds, note=found.note)
    best = {str(row["method"]): float(str(row["dof_steps_per_second"])) for row in rows}
    for storeys in STOREYS:
        scene = scene_of(storeys)
        for method, other in METHODS.items():
            value = rate(scene, method, count, device)
            more: dict[str, object] = {} if on_cpu else dict(registers(scene, method))
            if storeys == peer.STOREYS:
                more["share_of_hand_written"] = round(value / best[other.split()[0] if on_cpu else other], 3)
            add("warpdyn", method, storeys, value, **more)
    return rows


def draw(rows: list[dict[str, object]], device: str) -> Figure:
    """Draw the rates against the number of degrees of freedom."""
    figure, panel = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for method in METHODS:
        own = [row for row in rows if (row["program"], row["method"]) == ("warpdyn", method)]
        panel.loglog([row["dofs"] for row in own], [row["dof_steps_per_second"] for row in own], "o-", label=method)
    for row in rows:
        if row["program"] == "hand-written":
            panel.plot(row["dofs"], row["dof_steps_per_second"], "k+", ms=10)
            panel.annotate(str(row["method"]), (row["dofs"], row["dof_steps_per_second"]), fontsize=8)
    panel.set(xlabel="degrees of freedom", ylabel="steps times degrees of freedom per second")
    panel.grid(alpha=0.3, which="both")
    panel.legend()
    figure.suptitle(f"Torsional buildings with bilinear walls ({device}; +: hand-written programs)")
    return figure


def main() -> None:
    """Run the study from the command line: measure, print, write torsional_speed.csv and draw torsional_speed.png."""
    arguments = read_arguments(__doc__, 2**18, "samples on a GPU")
    arguments.out.mkdir(parents=True, exist_ok=True)
    device = arguments.device or ("cuda:0" if wp.get_cuda_device_count() else "cpu")
    rows = measured(arguments.samples, device)
    with (arguments.out / "torsional_speed.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, list(dict.fromkeys(name for row in rows for name in row)))
        writer.writeheader()
        writer.writerows(rows)
    save_figures({"torsional_speed": draw(rows, device)}, arguments.out)


if __name__ == "__main__":
    main()
