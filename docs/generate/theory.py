"""Parts of the theory manual that follow from the code: parameters and loops of laws, coefficients of methods."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import xarray as xr

from generate.laws import element_of, memory, opensees
from generate.tables import rows_of, table, write
from generate.theory_figures import FIGURES
from generate.theory_loops import LOOPS, alternative_text, draw_loop
from generate.theory_symbols import parameter_list
from warpdyn.engine.laws import DEVICES, LAWS
from warpdyn.engine.methods.kinds import ExplicitMethod, ImplicitMethod
from warpdyn.engine.methods.stability_limits import relaxation_limit, stability_limit
from warpdyn.engine.methods.table import METHODS

NO_SPRING = ("viscous_damper",)  # devices without a storey force of a drift


def write_parts(docs: Path) -> None:
    """Write the parts into docs/theory/generated.

    Raises:
        ValueError: If a law or device has no figure, or a parameter has no symbol.
    """
    out = docs / "theory" / "generated"
    out.mkdir(parents=True, exist_ok=True)
    if missing := set(LOOPS) ^ (LAWS | DEVICES).keys():
        raise ValueError(f"docs/generate/theory_loops.py lacks laws, or has laws that do not exist: {sorted(missing)}")
    kept = docs / "reference" / "laws" / "cycles.nc"
    with xr.open_dataset(kept) as file:
        curves = file.load()
    for name in LOOPS:
        write(out / f"_{name}.md", head_of_law(name))
        if is_outdated(out / f"loop_{name}.svg", [kept, *(docs / "generate").glob("theory_*.py")]):
            draw_loop(name, curves, out / f"loop_{name}.svg")
    for name, draw in FIGURES.items():
        if is_outdated(out / f"{name}.svg", list((docs / "generate").glob("theory_*.py"))):
            draw(out / f"{name}.svg")
    write(out / "_explicit.md", explicit_table())
    write(out / "_implicit.md", implicit_table())
    write(out / "_limits.md", limit_table(docs / "reference" / "laws" / "measured.csv"))


def is_outdated(path: Path, sources: list[Path]) -> bool:
    """Return whether a file is missing, or older than a file that it is made from."""
    return not path.is_file() or path.stat().st_mtime < max(source.stat().st_mtime for source in sources)


def head_of_law(name: str) -> str:
    """Return the part of a law's section that follows from its class: links, parameters, figure."""
    element = element_of(name)
    reference = f"[`{element.__name__}`](../reference/laws/generated/{name}.md)"
    counted = "none" if name in NO_SPRING else memory(element)
    facts = f"Reference: {reference}. OpenSees: {opensees(element)}. Memory values per storey: {counted}."
    figure = f"![{alternative_text(name)}](generated/loop_{name}.svg)"
    return f"{facts}\n\n**Parameters:** {parameter_list(name, element)}\n\n{figure}\n"


def fraction(value: float) -> str:
    """Return a coefficient of a method as a fraction."""
    exact = Fraction(value).limit_denominator(400_000)
    return str(exact) if abs(float(exact) - value) < 1e-12 else f"{value:.6g}"


def _row(values: tuple[float, ...]) -> str:
    return ", ".join(fraction(value) for value in values)


def explicit_table() -> str:
    """Return the coefficients of explicit methods: c, rows of A, b, and weights of displacements."""
    lines = []
    for name, method in METHODS.items():
        if not isinstance(method, ExplicitMethod):
            continue
        stages = range(1, method.stages)
        rows = "; ".join(f"a{i + 1} = ({_row(method.a[i][:i])})" for i in stages) or "none"
        weights = f"b = ({_row(method.b)})"
        if method.b_displacement is not None and method.a_displacement is not None:
            rows += "; " + "; ".join(f"ā{i + 1} = ({_row(method.a_displacement[i][:i])})" for i in stages)
            weights += f"; b̄ = ({_row(method.b_displacement)})"
        if method.error is not None:
            weights += f"; e = ({_row(method.error)})"
        lines.append((f"`{name}`", _row(method.c), rows.strip("; "), weights))
    return table(("method", "times c", "rows of A", "weights"), lines)


def implicit_table() -> str:
    """Return the parameters of implicit methods."""
    lines = [
        (
            f"`{name}`",
            *(fraction(value) for value in (each.beta, each.gamma, each.force_lag, each.mass_lag, each.extension)),
        )
        for name, each in METHODS.items()
        if isinstance(each, ImplicitMethod)
    ]
    return table(("method", r"$\beta$", r"$\gamma$", r"$\alpha_f$", r"$\alpha_m$", r"$\theta$"), lines)


def limit_table(measured: Path) -> str:
    """Return orders and stability limits of all methods, and errors of bilinear storeys from a table of a study."""
    errors = {row["method"]: row["median_error"] for row in rows_of(measured)[1] if row["law"] == "bilinear"}
    lines = []
    for name, method in METHODS.items():
        order = "exact" if method.kind == "exact" else str(method.order)
        limits = [_shown(np.inf if method.kind == "exact" else stability_limit(method, z)) for z in (0, 0.05, 0.5)]
        error = f"{float(errors[name]):.2%}" if name in errors else ""
        lines.append((f"`{name}`", order, *limits, _shown(relaxation_limit(method)), error))
    head = ("method", "order", "ωh, ζ = 0", "ωh, ζ = 0.05", "ωh, ζ = 0.5", "h times rate", "median error")
    return table(head, lines)


def _shown(limit: float) -> str:
    return f"{limit:.4g}" if np.isfinite(limit) else "none"
