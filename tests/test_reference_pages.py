"""Tables that the documentation keeps: they are of all methods, laws and tests of today."""

from __future__ import annotations

import ast
import csv
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from validation import KEPT, Measured, kept_rows

from warpdyn.engine.laws import LAWS
from warpdyn.engine.methods.stability_limits import stability_limit
from warpdyn.engine.methods.table import METHODS, StoreyForces, fitting_methods

sys.path.insert(0, str(ROOT / "docs"))
from generate.validation import SUBJECTS

pytestmark = pytest.mark.fast
ITSELF = "test_a_figure_beyond_its_bound_fails_and_so_does_another_claim"
REFERENCE = ROOT / "docs" / "reference"
LINEAR_CHAIN = StoreyForces(is_linear=True)


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(line for line in path.read_text().splitlines() if not line.startswith("#")))


def test_measured_stability_limits_are_of_all_methods_that_have_one() -> None:
    rows = rows_of(REFERENCE / "methods" / "stability_limits.csv")
    # The study measures a chain.
    of_chains = {name: METHODS[name] for name in fitting_methods(LINEAR_CHAIN)}
    stepped = {name: each for name, each in of_chains.items() if not each.is_adaptive and each.kind != "exact"}
    limited = {name for name, each in stepped.items() if np.isfinite(stability_limit(each, 0.05))}
    assert {row["method"] for row in rows} == limited
    for row in rows:
        for ratio in row.keys() - {"method"}:
            theory = stability_limit(METHODS[row["method"]], float(ratio))
            # 0.003 % is what the study comes to; where every step grows, it sees that only above 0.02.
            assert float(row[ratio]) == pytest.approx(theory, rel=3e-5, abs=0.02 if theory == 0 else 0)


def test_errors_and_times_are_of_all_laws_and_all_methods() -> None:
    rows = rows_of(REFERENCE / "laws" / "measured.csv")
    isolators = {"lead_rubber_bearing", "friction_pendulum"}  # bilinear by another name
    assert {row["law"] for row in rows} == LAWS.keys() - isolators
    of_chains = fitting_methods(LINEAR_CHAIN)
    stepped = {name for name in of_chains if not METHODS[name].is_adaptive} - {"exact"}
    assert {row["method"] for row in rows if row["law"] == "bilinear"} == stepped


def test_the_validation_report_is_of_todays_tests() -> None:
    using = set()
    for path in (ROOT / "tests").glob("test_*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            calls = (each.func for each in ast.walk(node) if isinstance(each, ast.Call))
            if isinstance(node, ast.FunctionDef) and any(isinstance(f, ast.Name) and f.id == "measured" for f in calls):
                using.add(f"{path.name}::{node.name}")
    assert {row["test"] for row in kept_rows().values()} == using - {f"{Path(__file__).name}::{ITSELF}"}
    subjects = {f"{name}.py" for names in SUBJECTS.values() for name in names}
    assert {row["test"].split("::")[0] for row in kept_rows().values()} <= subjects
    for row in kept_rows().values():
        assert 0 <= float(row["value"]) <= float(row["bound"]), row


def test_a_figure_beyond_its_bound_fails_and_so_does_another_claim(tmp_path: Path) -> None:
    claim, row = next((claim, row) for claim, row in kept_rows().items() if float(row["bound"]) > 0)
    truth, units, bound = row["truth"], row["units"], float(row["bound"])
    measured = Measured(row["test"], None)
    measured(claim, truth=truth, value=bound, bound=bound, units=units)
    for value in (1.01 * bound, np.nan, -bound):
        with pytest.raises(AssertionError, match=r"is above|no size"):
            measured(claim, truth=truth, value=value, bound=bound, units=units)
    for other in ({"truth": "another"}, {"bound": 2 * bound}):
        with pytest.raises(AssertionError, match="is another"):
            measured(claim, **{"truth": truth, "value": 0, "bound": bound, "units": units} | other)
    with pytest.raises(AssertionError, match="lacks 'no such claim'"):
        measured("no such claim", truth=truth, value=0, bound=bound)
    written = tmp_path / "lines"
    Measured(row["test"], str(written))("no such claim", truth=truth, value=0, bound=bound)
    assert len(written.read_text().splitlines()) == 1
    assert KEPT.is_file()
