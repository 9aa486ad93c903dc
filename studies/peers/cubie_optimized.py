"""CuBIE as in cubie_maxima, after `optimize` has chosen launch, memory and unrolling options by timing on the GPU."""

from __future__ import annotations

from peers.case import Case, Measured
from peers.cubie_maxima import parameters_of, solver_of, timed


def measure(case: Case) -> Measured:
    """Optimise the options for a case, integrate it, and return the time of the kernel and the peak drifts."""
    with solver_of(case) as solver:
        solver.optimize(parameters=parameters_of(case), duration=case.steps * case.step, verbose=False)
        return timed(solver, case)
