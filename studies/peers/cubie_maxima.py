"""CuBIE: its RK4 with a fixed step, one sample per thread, and running maxima of the drifts; it needs a GPU.

The chain is given as equations, from which CuBIE generates CUDA code. The base motion is a driver that is interpolated
linearly. The drifts are observables, and their largest magnitude is updated at every step. The constants of the law are
compiled into the code. The time is measured by CuBIE's events around its kernel, with inputs and outputs on the device,
and with the settings that CuBIE chooses for the hardware.
"""

from __future__ import annotations

import time

import numpy as np
from cubie import Solver, create_ODE_system
from cubie.array_interpolator import DriverSamples

from peers.case import HARDENING_RATIO, YIELD_DRIFT, Case, Measured, least_seconds


def measure(case: Case) -> Measured:
    """Integrate a case, and return the time of the kernel and the peak drifts."""
    with solver_of(case) as solver:
        return timed(solver, case)


def parameters_of(case: Case) -> dict[str, np.ndarray]:
    """Return the parameters that differ between samples, by name, each of shape [sample]."""
    stiffness, damping, inverse_mass, scale, _ = case.arrays()
    parameters = {"scale": scale}
    for i in range(case.storeys):
        parameters |= {f"k{i}": stiffness[:, i], f"c{i}": damping[:, i], f"inverse_mass{i}": inverse_mass[:, i]}
    return parameters


def solver_of(case: Case) -> Solver:
    """Return the solver of CuBIE for the equations of a case."""
    *_, acceleration = case.arrays()
    state = [f"{name}{i}" for i in range(case.storeys) for name in ("uvz" if case.law == "bouc_wen" else "uv")]
    drifts = [f"drift{i}" for i in range(case.storeys)]
    parameters = {name: float(values[0]) for name, values in parameters_of(case).items()}
    system = create_ODE_system(
        _equations(case),
        precision=np.dtype(case.dtype).type,
        states=dict.fromkeys(state, 0.0),
        observables=drifts,
        parameters=parameters,
        drivers=["ground"],
        swept_parameters=list(parameters),
    )
    return Solver(
        system,
        algorithm="rk4",
        dt=case.step,
        step_controller="fixed",
        output_types=["max_magnitude"],
        save_variables=[],
        summarise_variables=drifts,
        sample_summaries_every=case.step,
        summarise_every=case.steps * case.step,
        drivers=DriverSamples({"ground": acceleration}, driver_sample_period=case.step, t0=0.0),
        order=1,  # linear interpolation of the motion
        wrap=False,
        boundary_condition="natural",
        time_logging_level="silent",  # events are recorded, but nothing is printed
    )


def _equations(case: Case) -> list[str]:
    lines = []
    for i in range(case.storeys):
        lines.append(f"drift{i} = u{i}" + (f" - u{i - 1}" if i else ""))
        lines.append(f"rate{i} = v{i}" + (f" - v{i - 1}" if i else ""))
        spring = f"drift{i}"
        if case.law == "bouc_wen":
            spring = f"({HARDENING_RATIO} * drift{i} + {(1 - HARDENING_RATIO) * YIELD_DRIFT} * z{i})"
            lines.append(f"dz{i} = {1 / YIELD_DRIFT} * (rate{i} - 0.5 * (abs(rate{i}) * z{i} + rate{i} * abs(z{i})))")
        lines.append(f"force{i} = k{i} * {spring} + c{i} * rate{i}")
    for i in range(case.storeys):
        above = f"force{i + 1} - " if i + 1 < case.storeys else "-"
        lines += [f"du{i} = v{i}", f"dv{i} = ({above}force{i}) * inverse_mass{i} - scale * ground"]
    return lines


def timed(solver: Solver, case: Case) -> Measured:
    """Return the shortest time of the kernel of a solver, and the peak drifts."""
    duration = case.steps * case.step
    result = solver.solve(parameters=parameters_of(case), duration=duration)
    peaks = np.array(result.as_numpy["summaries_array"][0].T)

    def run() -> float:
        # Inputs are those of the previous solve, which are still on the device.
        given = (solver.device_initial_values, solver.device_parameters)
        solver.solve(*given, duration=duration, on_device=True).stream.synchronize()
        events = [event for event in solver.kernel._cuda_events if event.name.startswith("kernel_chunk")]
        return sum(event.elapsed_time_ms() for event in events) / 1e3

    started = time.perf_counter()
    run()
    clock = time.perf_counter() - started
    return Measured(least_seconds(run), peaks, f"{clock:.4f} s by the clock around a solve")
