"""A page for every storey law, isolator and device: from its class, its module's help, and measurements of studies."""

from __future__ import annotations

import inspect
import json
import re
import sys
from pathlib import Path

import xarray as xr

from generate.law_pictures import draw_law, draw_maxwell_damper, draw_viscous_damper
from generate.tables import prose, rows_of, table, write
from warpdyn.engine.laws import DEVICES, LAWS, StoreyElement
from warpdyn.engine.laws.spring import Spring
from warpdyn.engine.laws.springs import spring_row
from warpdyn.engine.methods.defaults import default_method

STIFFNESS, YIELD_FORCE = 1.0e7, 1.0e5  # N/m, N: the storeys of cycles.nc
# Devices without force in quasi-static cycles, with their parameters in the programs of their pages.
DAMPERS = {
    "viscous_damper": {"damper_coefficient": 1.0e5, "velocity_exponent": 0.4},
    "maxwell_damper": {"damper_coefficient": 1.0e5, "velocity_exponent": 0.4, "brace_stiffness": 4.0e6},
}
EXPONENTS = (1.0, 0.4, 0.2)  # viscous dampers in the picture
ISOLATORS = ("lead_rubber_bearing", "friction_pendulum")


def write_pages(docs: Path) -> None:
    """Write the pages, their pictures and the tables of the index into docs/reference/laws/generated.

    Raises:
        ValueError: If the index lacks a law or device, or has one that does not exist.
    """
    folder = docs / "reference" / "laws"
    out = folder / "generated"
    measured = rows_of(folder / "measured.csv")
    held = rows_of(docs / "verification" / "measured.csv")[1]
    with xr.open_dataset(folder / "cycles.nc") as kept:
        curves = kept.load()
    # The toctree lists the laws in the order of the page.
    names = re.findall(r"^generated/(\w+)$", (folder / "index.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    if missing := set(names) ^ (LAWS | DEVICES).keys():
        raise ValueError(f"docs/reference/laws/index.md lacks laws, or lists laws that do not exist: {sorted(missing)}")
    for name in names:
        write(out / f"{name}.md", page(name, curves, measured, held))
        picture(name, curves, out / f"{name}.png", folder / "cycles.nc")
    write(out / "_storey.md", index_table([name for name in names if name in LAWS and name not in ISOLATORS]))
    write(out / "_isolators.md", index_table(list(ISOLATORS)))
    write(out / "_devices.md", index_table([name for name in names if name in DEVICES]))


def element_of(name: str) -> type[StoreyElement]:
    """Return the class of a law or device."""
    return LAWS[name] if name in LAWS else DEVICES[name]


def parameters_of(name: str, curves: xr.Dataset) -> dict[str, float]:
    """Return the parameters of a law's curves."""
    if name in DAMPERS:
        return DAMPERS[name]
    return json.loads(str(curves.sel(element=name)["parameters"].item()))


def picture(name: str, curves: xr.Dataset, path: Path, kept: Path) -> None:
    """Draw the picture of a page, unless it is newer than its sources."""
    sources = [kept, Path(__file__).parent / "law_pictures.py"]
    if path.is_file() and path.stat().st_mtime > max(source.stat().st_mtime for source in sources):
        return
    if name == "viscous_damper":
        draw_viscous_damper(EXPONENTS, path)
    elif name == "maxwell_damper":
        draw_maxwell_damper(EXPONENTS, path)
    else:
        parameters = parameters_of(name, curves)
        draw_law(curves.sel(element=name), YIELD_FORCE / STIFFNESS, parameters, path)


def index_table(names: list[str]) -> str:
    """Return the table of a group of laws: name, description, OpenSees' name, memory."""
    rows = []
    for name in names:
        element = element_of(name)
        rows.append((f"[`{name}`](generated/{name}.md)<br>{summary(element)}", opensees(element), memory(element)))
    return table(("law", "OpenSees", "memory"), rows)


def summary(element: type[StoreyElement]) -> str:
    """Return the first sentence of a class's docstring, without sources and OpenSees' name."""
    sentence = inspect.cleandoc(element.__doc__ or "").split("\n\n")[0].replace("\n", " ")
    return sentence.split(" (")[0].removesuffix(".")


def opensees(element: type[StoreyElement]) -> str:
    """Return OpenSees' names of an element, or the material that its docstring names."""
    named = element.opensees or re.findall(r"OpenSees(?::|')\s+([A-Z]\w+)", element.__doc__ or "")[:1]
    return ", ".join(f"`{name}`" for name in named) or "none"


def springs_of(element: type[StoreyElement]) -> list[Spring]:
    """Return the device functions of all variants."""
    return [spring_row(variant) for variant in element.variants.values()]


def memory(element: type[StoreyElement]) -> str:
    """Return the number of memory values per storey, for all variants of the device functions."""
    counts = sorted({spring.memory for spring in springs_of(element)})
    return " or ".join(map(str, counts)) if len(counts) < 3 else f"{counts[0]} to {counts[-1]}"


def page(name: str, curves: xr.Dataset, measured: tuple[str, list[dict[str, str]]], held: list[dict[str, str]]) -> str:
    """Return the page of a law or device in Markdown."""
    element = element_of(name)
    head, _, _ = inspect.cleandoc(element.__doc__ or "").partition("\n\nArgs:")
    kind = "devices" if name in DEVICES else "law"
    shown = "the free vibration of the storey" if name in DAMPERS else "the storey's force against its drift"
    parts = [
        f"# {element.__name__}",
        prose(_without_help(head.split("\n\nExample:")[0])),
        f"Give a `wd.ShearBuilding` the argument `{kind}={(name,) if name in DEVICES else name!r}`, or an object of "
        f"{{py:class}}`warpdyn.engine.laws.{element.__name__}`. {_kind_of_memory(element)} Equations: "
        f"{{ref}}`theory manual <theory-law-{name}>`.",
        f"![Force of {name} under cycles of growing drift and in one push](./{name}.png)",
        _caption(name),
        "## Parameters",
        _parameter_table(element),
        *_rules(element),
        *_held_to(name, held),
        *_speed(name, measured),
        "## Example",
        f"```python\n{snippet(name, parameters_of(name, curves))}```",
        f"The file `loops.png` shows {shown}. Next: [all laws](../index.md), "
        "[integration methods](../../methods/index.md).",
    ]
    return "\n\n".join(parts) + "\n"


def _without_help(text: str) -> str:
    """Return a docstring whose references to the help of its module are replaced by references to the page."""
    listed = r"[Tt]he help of\s+its\s+module\s+lists\s+the\s+rules\s+and\s+the\s+differences\s+from\s+OpenSees\."
    text = re.sub(listed, "The rules and the differences from OpenSees are listed below.", text)
    text = re.sub(r"`warpdyn\.laws\.\w+\.parameters`[^.]*\.\s*", "", text)
    return re.sub(r"([Tt])he help of\s+its\s+module\s+has\s", r"\1he section on rules has ", text)


def _kind_of_memory(element: type[StoreyElement]) -> str:
    springs = springs_of(element)
    if not springs:
        return "It has no memory: its force depends on the velocity of the storey."
    if not any(spring.memory for spring in springs):
        return "It has no memory."
    if any(spring.rate is not None for spring in springs):
        return f"The memory of a storey ({_values(element)}) has a rate, which is integrated together with the motion."
    return f"The memory of a storey ({_values(element)}) follows from its drift at the end of each step."


def _values(element: type[StoreyElement]) -> str:
    count = memory(element)
    return "one value" if count == "1" else f"{count} values"


def _caption(name: str) -> str:
    if name == "viscous_damper":
        return "Forces are divided by the force at 1 m/s; the three curves have different velocity exponents."
    if name == "maxwell_damper":
        return (
            "Forces in harmonic motion and at a constant velocity, divided by the force of the damper at 1 m/s; the "
            "three curves have different velocity exponents."
        )
    if name in DEVICES:
        drawn = "It shows the device alone, without its storey; drifts are divided by 10 mm and forces by 100 kN."
    else:
        drawn = "The storey has a stiffness of 10 kN/mm and yields at a force of 100 kN and a drift of 10 mm."
    return f"The picture uses the parameters of the program at the end of this page. {drawn}"


BOUNDS_BY_OTHERS = {"gamma": "above -beta, at most beta"}  # bounds by other parameters


def _parameter_table(element: type[StoreyElement]) -> str:
    rows = []
    for name, known in element.parameters.items():
        bounds = known.allowed.removeprefix("finite and ").removeprefix("finite") or "any"
        bounds = BOUNDS_BY_OTHERS.get(name, bounds)
        default = (known.optional or "must be given") if known.default is None else f"{known.default:g}"
        rows.append((f"`{name}`<br>{known.long_name}", f"`{known.units}`", bounds, default, known.opensees or "none"))
    if not rows:
        return "The only parameter is the storey's `stiffness` [N/m], a parameter of the building."
    words = (
        ""
        if issubclass(element, tuple(DEVICES.values()))
        else ("\nThe initial stiffness is the storey's `stiffness` [N/m], a parameter of the building.\n")
    )
    return table(("parameter", "units", "allowed", "default", "OpenSees"), rows) + words


def _rules(element: type[StoreyElement]) -> list[str]:
    """Return the module's help after its first sentence: rules, and differences from OpenSees."""
    text = inspect.cleandoc(sys.modules[element.__module__].__doc__ or "")
    _, _, further = text.partition("\n\n")
    return ["## Rules, and differences from OpenSees", prose(further)] if further else []


def _held_to(name: str, held: list[dict[str, str]]) -> list[str]:
    """Return the results of the summary of checks on the law's forces."""
    rows = [row for row in held if row["claim"].startswith("forces of") and f"`{name}`" in row["claim"]]
    if not rows:
        return []
    lines = [
        f"- {row['claim']}: error {float(row['value']):.2g} (bound {float(row['bound']):.2g}), compared with "
        f"{row['truth']}."
        for row in rows
    ]
    report = "[summary of checks](../../../verification/checks.md)"
    return ["## Verification", f"From the {report}, which describes the measurements:\n\n" + "\n".join(lines)]


def _speed(name: str, measured: tuple[str, list[dict[str, str]]]) -> list[str]:
    where, rows = measured
    own = [row for row in rows if row["law"] == name]
    if not own:
        return []
    words = (
        "Errors of peak storey drifts, and integration time divided by that of `rk4` with bilinear storeys. All "
        "methods have the same steps: at most 1/100 of the first period of a five-storey building, and a whole number "
        f"in each step of the records. Measured by `studies/law_methods.py`: {where}."
    )
    lines = [
        (
            f"`{row['method']}`",
            f"{float(row['median_error']):.2%}",
            f"{float(row['error_95']):.2%}",
            row["time_over_bilinear_rk4"],
        )
        for row in own
    ]
    head = ("method", "median error", "95 % quantile", "time")
    found = default_method(LAWS[name].forces, ("rayleigh",))
    default = (
        f"Without `method=`, `simulate` uses `{found.method}` on a CPU with Rayleigh damping of 5 % or more: "
        f"{found.reason} (`data/default_methods.csv`, by `studies/default_methods.py`). With less damping, `rk4`."
    )
    return ["## Speed and error of methods", words, table(head, lines), default]


def snippet(name: str, parameters: dict[str, float]) -> str:
    """Return a program that draws cycles of a storey with a law, or of an elastic storey with a device."""
    given = ", ".join(f"{key}={value!r}" for key, value in parameters.items())
    element = f"wd.laws.{element_of(name).__name__}({given})"
    if len(element) > 60:
        lines = "".join(f"    {key}={value!r},\n" for key, value in parameters.items())
        element = f"wd.laws.{element_of(name).__name__}(\n{lines})"
    if name in DAMPERS:
        run = (
            "swing = wd.FreeVibration(3.0, displacement=0.05)  # s, m\n"
            "run = wd.simulate(wd.Scene(storey, swing), histories=wd.Histories())\n"
            'wd.plots.histories(run).savefig("loops.png")\n'
        )
    else:
        run = (
            "turns = [0.0, 0.01, -0.01, 0.04, -0.04, 0.08, -0.08, 0.0]  # m\n"
            "drift = np.interp(np.arange(0, 7, 0.001), np.arange(8), turns)\n"
            "loops = wd.storey_hysteresis(storey, drift)\n"
            'wd.plots.hysteresis(loops).savefig("loops.png")\n'
        )
    numpy = "" if name in DAMPERS else "import numpy as np\n\n"
    argument = "devices=(element,)" if name in DEVICES else "law=element"
    return (
        f"{numpy}import warpdyn as wd\n\nelement = {element}\n"
        "# Mass [kg], stiffness [N/m] and height [m]:\n"
        f"storey = wd.ShearBuilding(mass=1.0e5, stiffness=1.0e7, height=3.0, {argument})\n{run}"
    )
