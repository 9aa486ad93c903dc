"""The theory manual has a section for every law, method and kind of damping; its equations are those of the code."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import theory_degrading
import theory_equations
import xarray as xr
from conftest import ROOT
from scipy.optimize import brentq

from warpdyn.answers.fragility.estimators.table import ESTIMATORS
from warpdyn.engine.laws import DEVICES, LAWS, FrictionPendulum
from warpdyn.engine.methods.kinds import ExplicitMethod, ImplicitMethod
from warpdyn.engine.methods.stability_limits import stability_limit
from warpdyn.engine.methods.table import METHODS
from warpdyn.foundations.core.units import STANDARD_GRAVITY
from warpdyn.model.structures.damping import DAMPING

pytestmark = pytest.mark.fast
DOCS = ROOT / "docs"
MANUAL = sorted((DOCS / "theory").glob("*.md"))
EQUATION = re.compile(r"\$\$(.+?)\$\$|(?<![\\$`])\$([^$\n]+?)\$", flags=re.DOTALL)
ROUNDING = 5.01e-4  # of the forces in cycles.nc, over the yield force
BY_FORMULA = {"viscous_damper", "maxwell_damper"}  # devices without quasi-static curves
CURVES = theory_equations.LAWS | theory_degrading.LAWS


@pytest.fixture
def pages(monkeypatch: pytest.MonkeyPatch) -> Callable:
    """Return a function that imports a module of docs/generate."""
    monkeypatch.syspath_prepend(DOCS)
    return lambda name: importlib.import_module(f"generate.{name}")


def sections(kind: str) -> dict[str, str]:
    """Return the text of each section with an anchor `theory-KIND-NAME`; anchors above one heading share its text."""
    found: dict[str, str] = {}
    for page in MANUAL:
        waiting: list[str] = []
        text = page.read_text(encoding="utf-8")
        for part in re.split(r"^(?=\(theory-)", text, flags=re.MULTILINE)[1:]:
            anchor, rest = part.split("\n", 1)
            waiting.append(anchor)
            if rest.strip():
                assert rest.lstrip().startswith("#"), anchor
                found |= {
                    name.removeprefix(f"(theory-{kind}-").removesuffix(")="): rest
                    for name in waiting
                    if name.startswith(f"(theory-{kind}-")
                }
                waiting = []
    return found


def test_every_law_and_device_has_a_section_with_equations() -> None:
    found = sections("law")
    assert found.keys() == (LAWS | DEVICES).keys()
    for name, text in found.items():
        assert f"{{include}} generated/_{name}.md" in text, name
        assert "$$" in text, name


def test_every_method_and_kind_of_damping_has_a_section() -> None:
    assert sections("method").keys() == METHODS.keys()
    assert sections("damping").keys() == DAMPING.keys()
    for name, text in sections("method").items():
        assert "$$" in text or name == "nystroem4", name  # it has the formulas of the section before
        assert name in text.replace(r"\_", "_"), name


def test_every_estimator_is_named() -> None:
    text = (DOCS / "theory" / "fragility.md").read_text(encoding="utf-8")
    assert [name for name in ESTIMATORS if f'estimator="{name}"' not in text] == []


def test_every_parameter_has_a_symbol_and_every_law_a_figure(pages: Callable) -> None:
    theory, loops = pages("theory"), pages("theory_loops")
    assert loops.LOOPS.keys() == (LAWS | DEVICES).keys()
    for name, element in (LAWS | DEVICES).items():
        head = theory.head_of_law(name)
        missing = [parameter for parameter in element.parameters if f"`{parameter}`" not in head]
        assert missing == [], name
        assert f"laws/generated/{name}.md" in head
    with pytest.raises(ValueError, match="no symbol"):
        pages("theory_symbols").symbol("bilinear", "no_such_parameter")


def test_reference_pages_link_to_the_manual(pages: Callable) -> None:
    laws, methods = pages("laws"), pages("methods")
    with xr.open_dataset(DOCS / "reference" / "laws" / "cycles.nc") as kept:
        curves = kept.load()
    for name in LAWS | DEVICES:
        assert f"<theory-law-{name}>" in laws.page(name, curves, ("", []), []), name
    links = "".join(methods.formulas(names) for names in methods.FAMILIES.values())
    assert [name for name in METHODS if f"<theory-method-{name}>" not in links] == []


def test_equations_of_all_pages_are_mathml(pages: Callable) -> None:
    mathml, found = pages("equations").mathml, 0
    for page in DOCS.rglob("*.md"):
        if "generated" in page.parts and page.parent.parent.name != "theory":
            continue
        text = re.sub(r"```\w*\n.*?```|`[^`\n]+`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        for block, inline in EQUATION.findall(text):
            equation = block or inline
            assert mathml(equation, is_block=bool(block)).startswith("<math"), (page, equation)
            # docutils reads the digits of \\frac12 as one number.
            assert re.search(r"\\(t?frac|sqrt) *[^{\[ ]", equation) is None, (page, equation)
            found += 1
    assert found > 300


def test_laws_without_an_independent_curve_are_dampers() -> None:
    assert (LAWS | DEVICES).keys() - CURVES.keys() == BY_FORMULA


@pytest.mark.parametrize("name", list(CURVES))
def test_printed_equations_give_the_forces_of_the_device_functions(name: str) -> None:
    with xr.open_dataset(DOCS / "reference" / "laws" / "cycles.nc") as kept:
        own = kept.load().sel(element=name)
    parameters = json.loads(str(own["parameters"].item()))
    for drift, force in (("ductility", "force"), ("pushed_ductility", "pushed_force")):
        found = CURVES[name](own[drift].values.copy(), parameters)
        np.testing.assert_allclose(found, own[force].values, rtol=0, atol=ROUNDING)


def motion(x: float, zeta: float) -> Callable[[float, float], float]:
    """Return the acceleration of an oscillator with w h = x and a step of 1."""
    return lambda u, v: -2 * zeta * x * v - x * x * u


def rk4(u: float, v: float, a: Callable) -> tuple[float, float]:
    a1 = a(u, v)
    a2 = a(u + v / 2, v + a1 / 2)
    a3 = a(u + v / 2 + a1 / 4, v + a2 / 2)
    a4 = a(u + v + a2 / 2, v + a3)
    return u + v + (a1 + a2 + a3) / 6, v + (a1 + 2 * a2 + 2 * a3 + a4) / 6


def velocity_verlet(u: float, v: float, a: Callable) -> tuple[float, float]:
    after = u + v + a(u, v) / 2
    return after, v + (a(u, v) + a(after, v + a(u, v))) / 2


def lagged(u: float, v: float, a: Callable) -> tuple[float, float]:
    half = v + a(u, v)
    return u + half, half


def tableau(name: str) -> Callable:
    """Return a step by the printed formula of Runge-Kutta and Nystroem methods."""
    method = METHODS[name]
    assert isinstance(method, ExplicitMethod)
    a, b = np.array(method.a), np.array(method.b)
    of_u, end_u = (a @ a, b @ a) if method.a_displacement is None else (method.a_displacement, method.b_displacement)

    def step(u: float, v: float, force: Callable) -> tuple[float, float]:
        found = np.zeros(b.size)
        for i, c in enumerate(method.c):
            found[i] = force(u + c * v + np.dot(of_u[i], found), v + np.dot(a[i], found))
        return u + v + np.dot(end_u, found), v + np.dot(b, found)

    return step


STEPS = {"rk4": rk4, "velocity_verlet": velocity_verlet, "central_difference_lagged": lagged} | {
    f"tableau of {name}": tableau(name) for name, each in METHODS.items() if isinstance(each, ExplicitMethod)
}


@pytest.mark.parametrize("name", list(STEPS))
@pytest.mark.parametrize(("x", "zeta"), [(0.3, 0.0), (1.1, 0.05), (2.0, 0.4)])
def test_printed_steps_are_those_of_the_explicit_methods(name: str, x: float, zeta: float) -> None:
    a, method = motion(x, zeta), METHODS[name.removeprefix("tableau of ")]
    matrix = np.array([STEPS[name](1.0, 0.0, a), STEPS[name](0.0, 1.0, a)]).T
    np.testing.assert_allclose(matrix, method.amplification(np.array(x), np.array(zeta)), rtol=0, atol=1e-12)


@pytest.mark.parametrize("x", [0.1, 0.9, 1.6])
def test_printed_forms_of_stoermer_are_equal(x: float) -> None:
    path = [1.0, 0.97, 0.9]
    accelerations = [-x * x * u for u in path]
    y = path[2] - accelerations[1] / 12
    w = y - (path[1] - accelerations[0] / 12)
    for _ in range(20):
        accelerations.append(-x * x * path[-1]) if len(accelerations) < len(path) else None
        now, before, earlier = accelerations[-1], accelerations[-2], accelerations[-3]
        published = 2 * path[-1] - path[-2] + 13 / 12 * now - before / 6 + earlier / 12
        w += now
        y += w
        path.append(y + now / 12)
        assert path[-1] == pytest.approx(published, rel=1e-9, abs=1e-12)
    growth = np.linalg.eigvals(METHODS["stoermer"].amplification(np.array(x), np.array(0.0)))
    polynomial = [1, -2 + 13 / 12 * x * x, 1 - x * x / 6, x * x / 12]  # of the published form
    for root in np.roots(polynomial):
        assert np.abs(growth - root).min() < 1e-7


@pytest.mark.parametrize("name", [name for name, each in METHODS.items() if isinstance(each, ImplicitMethod)])
def test_printed_step_is_that_of_the_implicit_methods(name: str) -> None:
    each, x, zeta = METHODS[name], 1.3, 0.2
    assert isinstance(each, ImplicitMethod)
    t = each.extension

    def unbalanced(delta: float, u: float, v: float, a: float) -> float:
        reached = u + t * v + t * t * (a / 2 + each.beta * delta), v + t * (a + each.gamma * delta)
        forces = (1 - each.force_lag) * motion(x, zeta)(*reached) + each.force_lag * motion(x, zeta)(u, v)
        return a + (1 - each.mass_lag) * delta - forces

    columns = []
    for u, v, a in np.eye(3):
        offset = unbalanced(0.0, u, v, a)
        change = -offset / (unbalanced(1.0, u, v, a) - offset) / t
        columns.append((u + v + a / 2 + each.beta * change, v + a + each.gamma * change, a + change))
    expected = each.amplification(np.array(x), np.array(zeta))
    np.testing.assert_allclose(np.array(columns).T, expected, rtol=0, atol=1e-12)


def test_stability_limits_by_a_root_finder() -> None:
    def growth(x: float) -> float:
        q = 1j * x
        return abs(1 + q + q**2 / 2 + q**3 / 6 + q**4 / 24) - 1

    assert brentq(growth, 2.5, 3.0) == pytest.approx(2 * np.sqrt(2), rel=1e-9)
    exact = {"rk4": 2 * np.sqrt(2), "velocity_verlet": 2.0, "stoermer": np.sqrt(3), "newmark_linear": 2 * np.sqrt(3)}
    for name, limit in exact.items():
        assert stability_limit(METHODS[name], 0.0) == pytest.approx(limit, rel=1e-6)


def test_period_of_a_pendulum_depends_only_on_its_radius() -> None:
    mass, radius = 3.0e5, 2.2
    given = {"stiffness": 1e9, "friction_coefficient": 0.05, "radius": radius, "weight": mass * STANDARD_GRAVITY}
    found = FrictionPendulum.named_coefficients({name: np.array([value]) for name, value in given.items()}, "bilinear")
    period = 2 * np.pi * np.sqrt(mass / found["hardening_stiffness"][0])
    assert period == pytest.approx(2 * np.pi * np.sqrt(radius / STANDARD_GRAVITY), rel=1e-12)
    friction = found["yielding_stiffness"] * found["yield_drift"]
    assert friction[0] == pytest.approx(0.05 * given["weight"], rel=1e-12)


def test_pages_are_short_enough_to_read() -> None:
    assert MANUAL
    for page in MANUAL:
        lines = page.read_text(encoding="utf-8").splitlines()
        assert len(lines) <= 400, page
        headings = [int(i) for i in np.flatnonzero([line.startswith("#") for line in lines])]
        assert max(b - a for a, b in pairwise([*headings, len(lines)])) <= 100, page


def test_the_index_lists_every_page() -> None:
    text = (DOCS / "theory" / "index.md").read_text(encoding="utf-8")
    assert [page.name for page in MANUAL if page.name != "index.md" and f"({page.name})" not in text] == []


def test_generated_parts_are_written(tmp_path: Path, pages: Callable) -> None:
    theory = pages("theory")
    text = (
        theory.explicit_table()
        + theory.implicit_table()
        + theory.limit_table(DOCS / "reference" / "laws" / "measured.csv")
    )
    assert [name for name in METHODS if f"`{name}`" not in text] == []
    for name, draw in pages("theory_figures").FIGURES.items():
        draw(tmp_path / f"{name}.svg")
        shown = any(f"generated/{name}.svg)" in page.read_text(encoding="utf-8").replace("\n", "") for page in MANUAL)
        assert shown, name
        assert (tmp_path / f"{name}.svg").stat().st_size > 5000
