"""`certify`: checks of a storey law, damper or stop."""

from __future__ import annotations

import numpy as np

from warpdyn.campaigns.running.certification.checks import (
    Checks,
    oscillator_checks,
    path_checks,
    precision_checks,
    work,
)
from warpdyn.campaigns.running.certification.paths import Storeys
from warpdyn.campaigns.running.certification.report import Certificate
from warpdyn.engine.laws import BIAXIAL_LAWS, CONTACTS, Device, Law
from warpdyn.engine.laws.biaxial.law import BiaxialLaw
from warpdyn.engine.laws.contacts.contact import Contact
from warpdyn.foundations.core.checks import real_number

YIELD_DRIFT, STIFFNESS = 0.01, 1.0e7  # [m], [N/m]: defaults if the parameters of a law do not determine them
PATHS = 12  # number of random paths if each parameter has one value


def certify(
    law: Law | Device, *, stiffness: float | None = None, drift: float | None = None, device: str | None = None
) -> Certificate:
    """Return a report of checks of a storey law, damper or stop: continuity, passivity, energy, convergence.

    The other checks compare rates with the declared bounds, and forces in float32 and on a GPU with those in float64 on
    the CPU.

    Args:
        law: The storey law, damper or stop with its parameters; all values of each parameter are checked.
        stiffness: Storey stiffness [N/m]. None: the yield force divided by 0.01 m; 1e7 if there is no yield force.
        drift: Scale of the drift paths [m], such as the yield drift; the largest drift is 16 times as large. None: the
            first force among the parameters, divided by the stiffness; without a force, the largest length among them.
        device: GPU whose forces are compared with those of the CPU, such as "cuda:0". None: the first GPU, if the
            machine has one.

    Returns:
        A report. Printed, it is a table of checks; `passed` is True if all checks passed; `figure()` plots hysteresis
        loops, energies and convergence. No error is raised if a check fails.

    Raises:
        TypeError: If `law` is not an object of the class of a law, damper or stop.
        ValueError: If its parameters contradict each other.

    Example:
        >>> wd.laws.certify(wd.laws.Bilinear(yield_force=1e5, hardening_ratio=0.05)).passed
        True
    """
    if not isinstance(law, Law | Device):
        given = law if isinstance(law, type) else type(law)
        if (isinstance(law, str) and law in BIAXIAL_LAWS) or issubclass(given, BiaxialLaw):
            advice = "compare the result of wd.BiaxialSpring(...).forces_along(path) with a test instead"
        elif (isinstance(law, str) and law in CONTACTS) or issubclass(given, Contact):
            advice = "it needs the rate of deformation, and has no test: simulate the impact of two masses instead"
        else:
            advice = "give an object such as wd.laws.Elastic()"
        raise TypeError(f"certify() takes a storey law with its parameters, got {law!r}: {advice}")
    storeys = _storeys(law, stiffness, drift)
    return certificate(repr(law), storeys, device)


def certificate(name: str, storeys: Storeys, device: str | None = None) -> Certificate:
    """Run all checks on storeys with one law, and return the report. Checks with one storey use the first storey.

    Args:
        name: The law as text.
        storeys: Storeys with the law, their parameters and the scale of their drift paths.
        device: GPU to compare with the CPU; None: the first GPU, if the machine has one.
    """
    checks = Checks(storeys.element)
    path_checks(storeys, checks)
    precision_checks(storeys, checks, device)
    steps, errors = oscillator_checks(storeys, checks)
    shown = storeys.answers(storeys.cycles())
    drawn = (shown["drift"], shown["force"], work(shown), shown["recoverable"])
    drift, force, done, elastic = (values[:, 0] for values in drawn)
    return Certificate(name, tuple(checks.found), drift, force, done, elastic, steps, errors)


def _storeys(law: Law | Device, stiffness: float | None, drift: float | None) -> Storeys:
    """Return storeys with the parameters of a law, and the drift scale of their paths; arguments: see `certify`."""
    values = {name: np.atleast_1d(value) for name, value in law.values().items()}
    forces = [values[name].max() for name, known in law.parameters.items() if known.units == "N"]
    lengths = [values[name].max() for name, known in law.parameters.items() if known.units == "m"]
    if stiffness is None:
        stiffness = forces[0] / YIELD_DRIFT if forces and not law.is_device else STIFFNESS
    stiffness = real_number("stiffness", stiffness, above=0)
    count = max([PATHS, *(value.size for value in values.values())])
    count = count if all(count % value.size == 0 for value in values.values()) else max(v.size for v in values.values())
    p = {name: np.resize(value, (1, count)).astype(float) for name, value in values.items()}
    p["stiffness"] = np.full((1, count), stiffness)
    if problem := law.problem(p):
        raise ValueError(f"{problem}; the stiffness is {stiffness:g} N/m: give certify(..., stiffness=...)")
    if drift is None:
        stiffest = float(np.max(law.stiffest(p)))
        of_force = forces[0] / (stiffest if law.is_device else stiffness) if forces and stiffest > 0 else YIELD_DRIFT
        drift = of_force if forces or not lengths else max(lengths)
    return Storeys(type(law), p, real_number("drift", drift, above=0))
