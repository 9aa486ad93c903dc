"""Tables of the pages on methods: from the registry METHODS, and from measurements by studies."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from generate.tables import rows_of, table, write
from warpdyn.engine.laws import LAWS
from warpdyn.engine.methods.kinds import ImplicitMethod, Method
from warpdyn.engine.methods.stability_limits import relaxation_limit, stability_limit
from warpdyn.engine.methods.table import METHODS, fitting_methods

FAMILIES = {
    "runge_kutta": ("heun", "midpoint", "kutta3", "ssprk3", "rk4", "three_eighths", "dormand_prince5"),
    "adaptive": ("dormand_prince54",),
    "nystroem_and_verlet": ("stoermer", "leapfrog", "velocity_verlet", "nystroem4", "central_difference_lagged"),
    "implicit": (
        "central_difference",
        "newmark_average",
        "newmark_linear",
        "hht_alpha",
        "generalised_alpha",
        "wilson_theta",
    ),
    "exact": ("exact",),
}
LEAST_SEEN = 0.02  # smallest w h at which the study can detect growth


def write_tables(docs: Path) -> None:
    """Write the tables into docs/reference/methods/generated.

    Raises:
        ValueError: If a method of METHODS is on no page.
    """
    missing = METHODS.keys() ^ {name for names in FAMILIES.values() for name in names}
    if missing:
        raise ValueError(
            f"methods without a page in docs/reference/methods, or pages without a method: {sorted(missing)}"
        )
    out = docs / "reference" / "methods" / "generated"
    write(out / "_all.md", facts(METHODS, link=True))
    for family, names in FAMILIES.items():
        write(out / f"_{family}.md", f"{facts(names)}\n{formulas(names)}")
    write(out / "_limits.md", limits(docs / "reference" / "methods" / "stability_limits.csv"))
    write(out / "_speed.md", speed(docs / "reference" / "laws" / "measured.csv"))


def facts(names: Iterable[str], *, link: bool = False) -> str:
    """Return order, stages, stability limits and unsupported scenes of methods."""
    family = {name: page for page, names in FAMILIES.items() for name in names}
    rows = []
    for name in names:
        method = METHODS[name]
        shown = f"[`{name}`](./{family[name]}.md)" if link else f"`{name}`"
        order = "exact" if method.kind == "exact" else str(method.order)
        rows.append((shown, order, _stages(method), _limit(method, 0.05), _memory_limit(method), _refused(name)))
    head = ("method", "order", "stages", "largest ωh at 5 % damping")
    return table((*head, "largest step times rate of a smooth law", "does not support"), rows)


def formulas(names: Iterable[str]) -> str:
    """Return a sentence with links to the formulas of methods in the theory manual."""
    links = ", ".join(f"{{ref}}`{name} <theory-method-{name}>`" for name in names)
    return f"Formulas in the theory manual: {links}.\n"


def _stages(method: Method) -> str:
    if method.kind == "exact":
        return "none"
    return "implicit" if isinstance(method, ImplicitMethod) else str(method.stages)


def _limit(method: Method, ratio: float) -> str:
    limit = np.inf if method.kind == "exact" else stability_limit(method, ratio)
    return f"{limit:.4g}" if np.isfinite(limit) else "none"


def _memory_limit(method: Method) -> str:
    limit = np.inf if method.kind == "exact" else relaxation_limit(method)
    return f"{limit:.3g}" if np.isfinite(limit) else "none"


def _refused(name: str) -> str:
    """Return the laws and kinds of damping that a method does not support, from the checks of a scene."""
    laws = [law for law in LAWS if name not in fitting_methods(LAWS[law].forces)]
    if len(laws) > len(LAWS) / 2:
        return "nonlinear structures, `EventSequence`"
    words = ["storeys of " + ", ".join(f"`{law}`" for law in laws)] if laws else []
    if name not in fitting_methods(LAWS["bilinear"].forces, "rayleigh_tangent"):
        words.append("damping `rayleigh_tangent`")
    return "; ".join(words) or "nothing"


def limits(path: Path) -> str:
    """Return the measured stability limits, with the theoretical ones in brackets, by damping ratio."""
    where, rows = rows_of(path)
    ratios = [key for key in rows[0] if key != "method"]
    lines = []
    for row in rows:
        cells = []
        for ratio in ratios:
            theory = stability_limit(METHODS[row["method"]], float(ratio))
            measured = f"below {LEAST_SEEN}" if theory == 0 else f"{float(row[ratio]):.4f}"
            cells.append(f"{measured} ({theory:.4f})")
        lines.append((f"`{row['method']}`", *cells))
    head = ("method", *(f"damping {float(ratio):.0%}" for ratio in ratios))
    return f"{table(head, lines)}\nMeasured (in brackets: theory), by `studies/stability.py`: {where}.\n"


def speed(path: Path) -> str:
    """Return the errors and times of all methods on bilinear storeys."""
    where, rows = rows_of(path)
    lines = [
        (
            f"`{row['method']}`",
            f"{float(row['median_error']):.2%}",
            f"{float(row['error_95']):.2%}",
            row["time_over_bilinear_rk4"],
        )
        for row in rows
        if row["law"] == "bilinear"
    ]
    head = ("method", "median error of peak drifts", "95 % quantile of the error", "time over that of `rk4`")
    return f"{table(head, lines)}\nMeasured by `studies/law_methods.py`: {where}.\n"
