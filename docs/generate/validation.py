"""Tables of the summary of checks, one per subject, from the errors of tests that `studies/validation.py` collected."""

from __future__ import annotations

from pathlib import Path

from generate.tables import rows_of, table, write

# Subject -> files of tests.
SUBJECTS = {
    "Exact solutions": ("test_exact", "test_exact_bilinear", "test_exact_bouc_wen"),
    "Linear response": ("test_linear", "test_modal", "test_vibration"),
    "Orders, period errors and stability of methods": ("test_order", "test_methods", "test_growth"),
    "Storey laws, isolators and devices": (
        "test_law_study",
        "test_laws_opensees",
        "test_law_asymmetric",
        "test_law_saws",
        "test_law_self_centring",
        "test_devices",
        "test_maxwell_damper",
    ),
    "Yielding buildings, gravity and pushover": (
        "test_nonlinear",
        "test_histories_opensees",
        "test_pushover",
        "test_p_delta",
    ),
    "Energy": ("test_energy",),
    "Control and hybrid tests": ("test_control", "test_control_analysis", "test_control_dampers", "test_hybrid"),
    "Response spectra": ("test_response_spectra",),
    "Record selection and synthetic motions": (
        "test_conditional_spectrum",
        "test_record_selection",
        "test_synthetic_motions",
    ),
    "Random numbers, random motions and statistics of a run": (
        "test_philox",
        "test_filtered_noise",
        "test_random_fields",
        "test_reduced_demands",
    ),
    "Fragility curves and their intervals": ("test_lognormal_fit", "test_estimators", "test_fragility"),
    "Annual rates": ("test_annual_rates",),
}


def write_tables(docs: Path) -> None:
    """Write the tables into docs/verification/generated.

    Raises:
        ValueError: If a test of the table belongs to no subject.
    """
    where, rows = rows_of(docs / "verification" / "measured.csv")
    subject = {file: name for name, files in SUBJECTS.items() for file in files}
    missing = {row["test"] for row in rows if row["test"].split(".py")[0] not in subject}
    if missing:
        raise ValueError(f"tests of the summary of checks without a subject in docs/generate/validation.py: {missing}")
    parts = []
    for name in SUBJECTS:
        own = [row for row in rows if subject[row["test"].split(".py")[0]] == name]
        parts += [
            f"## {name}",
            table(("claim, and its test", "compared with", "measured", "bound"), map(_cells, own)),
        ]
    tests = len({row["test"] for row in rows})
    cases = sum(int(row["cases"]) for row in rows)
    words = f"{len(rows)} claims of {tests} tests, {cases} comparisons, measured with {where}."
    write(docs / "verification" / "generated" / "_checks.md", "\n\n".join([words, *parts]) + "\n")


def _cells(row: dict[str, str]) -> tuple[str, ...]:
    units = "" if row["units"] == "1" else f" {row['units']}"
    # A number and its units stay on one line, even if the number has a minus sign.
    figures = (f"<span class='text-nowrap'>{float(row[key]):.2g}{units}</span>" for key in ("value", "bound"))
    test = row["test"].split("::")[1].replace("_", "_<wbr>")  # allows line breaks in a narrow column
    return f"{row['claim']}<br><code>{test}</code>", row["truth"], *figures
