"""OpenQuake's tables in CSV files: functions of each taxonomy (taxonomy mapping), and consequences of damage states."""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

from warpdyn.foundations.core.checks import check_kind, checked_text, one_of, real_number, shortened
from warpdyn.foundations.files.text import check_names, check_separator, read_csv_text
from warpdyn.interfaces.exchange import nrml
from warpdyn.interfaces.exchange.text_files import check_same_table, checked_path, write_text

TAXONOMIES, CONSEQUENCES = "write_taxonomy_mapping", "write_consequences"
# Kinds of consequences. Their values are fractions of the replacement value, of the buildings or of the occupants.
KINDS = ("losses", "collapsed", "non_operational", "injured", "fatalities", "homeless")
SHAKING = ("groundshaking", "earthquake")  # names of the same peril in OpenQuake: since 2025, and until 2025
SUM_TOLERANCE = 1e-7  # allowed difference between a sum of weights and 1; pmf.PRECISION in OpenQuake's engine


def write_taxonomy_mapping(
    mapping: Mapping[str, str | Mapping[str, float]], path: str | os.PathLike, *, overwrite: bool = False
) -> Path:
    """Write OpenQuake's taxonomy mapping: for each taxonomy of an exposure, the ids of its functions with weights.

    The ids are those of fragility or vulnerability functions in an NRML file.

    Args:
        mapping: For each taxonomy, the id of its function, or a mapping of several ids to weights [1] whose sum is 1.
        path: Path of the file that is written; its name ends in ".csv".
        overwrite: If True, replace an existing file of any content. If False, replace only a table with the same
            columns.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If weights are not above 0 or their sum is not 1, or OpenQuake does not accept a name.
        TypeError: If `mapping` is not a mapping.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> path = wd.write_taxonomy_mapping({"CR/LFM": {"C1M_H": 0.7, "C1M_L": 0.3}, "W": "W1"}, "mapping.csv")
        >>> wd.read_taxonomy_mapping(path)["CR/LFM"]
        {'C1M_H': 0.7, 'C1M_L': 0.3}
    """
    path = checked_path(TAXONOMIES, path, ".csv")
    check_kind(TAXONOMIES, "a mapping of taxonomies to ids of functions", mapping, Mapping)
    if not mapping:
        raise ValueError(
            f"{TAXONOMIES}() needs at least one taxonomy, but the mapping is empty: give {{'CR/H:5': 'CR_H5'}}"
        )
    heads = ("taxonomy", "risk_id", "weight")
    rows: list[Sequence[object]] = [heads]
    for taxonomy, given in mapping.items():
        nrml.check_taxonomy(TAXONOMIES, taxonomy)
        if not isinstance(given, str | Mapping):
            raise TypeError(
                f"{TAXONOMIES}: the value for taxonomy {taxonomy!r} must be the id of a function or a mapping of ids "
                f"to weights, got {shortened(given)}: give 'CR_H5' or {{'CR_H5': 0.7, 'CR_H6': 0.3}}"
            )
        weights = given if isinstance(given, Mapping) else {given: 1.0}
        for risk_id, weight in weights.items():
            nrml.check_taxonomy(TAXONOMIES, risk_id, f"id of taxonomy {taxonomy!r}")
            weight = real_number(f"{TAXONOMIES}: weight of {risk_id!r} for taxonomy {taxonomy!r}", weight, above=0)
            rows.append((taxonomy, risk_id, repr(weight)))
        total = sum(weights.values())
        if abs(total - 1) > SUM_TOLERANCE:
            raise ValueError(
                f"{TAXONOMIES}: the sum of the weights of taxonomy {taxonomy!r} is {total:.9g}; it must be 1: divide "
                "the weights by their sum"
            )
    check_same_table(TAXONOMIES, path, heads, overwrite)
    return write_text(path, _csv_text(rows))


def read_taxonomy_mapping(path: str | os.PathLike) -> dict[str, dict[str, float]]:
    """Read OpenQuake's taxonomy mapping: the ids of the functions of each taxonomy, with weights.

    If several rows have the same taxonomy and function, as in mappings that GEM published, their weights are added.
    OpenQuake does the same.

    Args:
        path: Path of the CSV file, with the columns `taxonomy`, `risk_id` (`conversion` in old files) and optionally
            `weight`.

    Returns:
        For each taxonomy, a mapping from the id of each function to its weight [1]; the weight is 1 without the column
        `weight`.

    Raises:
        ValueError: If a column is missing, OpenQuake does not accept a name, a weight is not a number above 0, or the
            sum of the weights of a taxonomy is not 1. The error names the file.
        FileNotFoundError: If the file does not exist.
        TypeError: If `path` is not a path.

    Example:
        >>> path = wd.write_taxonomy_mapping({"CR/LFM": {"C1M_H": 0.7, "C1M_L": 0.3}, "W": "W1"}, "mapping.csv")
        >>> wd.read_taxonomy_mapping(path)["W"]
        {'W1': 1.0}
    """
    found: dict[str, dict[str, float]] = {}
    for row in _csv_rows("read_taxonomy_mapping", path, ("taxonomy",)):
        taxonomy, risk_id = row["taxonomy"], row.get("risk_id") or row.get("conversion")
        if not risk_id:
            raise ValueError(f"{path}: taxonomy {taxonomy!r} has no risk_id: complete its row")
        nrml.check_taxonomy(str(path), taxonomy)
        nrml.check_taxonomy(str(path), risk_id, f"risk_id of taxonomy {taxonomy!r}")
        weight = 1.0
        if "weight" in row:
            weight = _csv_number(path, f"weight of {risk_id!r} for taxonomy {taxonomy!r}", row["weight"], above=0)
        own = found.setdefault(taxonomy, {})
        own[risk_id] = own.get(risk_id, 0.0) + weight
    if not found:
        raise ValueError(f"{path} has no rows below the names of the columns: add at least one row")
    for taxonomy, weights in found.items():
        if abs(sum(weights.values()) - 1) > SUM_TOLERANCE:
            raise ValueError(
                f"{path}: the sum of the weights of taxonomy {taxonomy!r} is {sum(weights.values()):.9g}; "
                "it must be 1: correct the weights"
            )
    return found


def write_consequences(
    consequences: Mapping[str, Mapping[str, float | Sequence[float]]],
    path: str | os.PathLike,
    *,
    consequence: str = "losses",
    loss_type: str = "structural",
    overwrite: bool = False,
) -> Path:
    """Write the consequences of each damage state, such as loss ratios, for OpenQuake's damage calculations.

    Args:
        consequences: For each id of a function, a mapping from each damage state, the lightest first, to a fraction
            [1]. It is a fraction of the replacement value ("losses"), of the buildings ("collapsed", "non_operational")
            or of the people ("injured", "fatalities", "homeless"). If a pair is given, such as mean and coefficient of
            variation, only the first number is written.
        path: Path of the file that is written; its name ends in ".csv".
        consequence: Kind of the consequence: "losses", "collapsed", "non_operational", "injured", "fatalities" or
            "homeless".
        loss_type: "structural", "nonstructural", "contents" or another loss type of OpenQuake.
        overwrite: If True, replace an existing file of any content. If False, replace only a table with the same
            columns.

    Returns:
        Path of the written file.

    Raises:
        ValueError: If a fraction is not from 0 to 1 or decreases from one state to the next, if two ids have different
            states, or if OpenQuake does not accept a name.
        TypeError: If `consequences` is not a mapping of ids to mappings of damage states to fractions.
        OSError: If the file cannot be written, or exists with other content and `overwrite` is False.

    Example:
        >>> wd.write_consequences({"C1M_H": wd.hazus_loss_ratios("RES3")}, "consequences.csv").name
        'consequences.csv'
    """
    path = checked_path(CONSEQUENCES, path, ".csv")
    check_kind(CONSEQUENCES, "a mapping of ids to shares by damage state", consequences, Mapping)
    one_of("consequence", consequence, KINDS)
    one_of("loss_type", loss_type, nrml.LOSS_TYPES)
    if not consequences:
        raise ValueError(
            f"{CONSEQUENCES}() needs at least one id, but the mapping is empty: give "
            "{'CR_H5': {'slight': 0.1, ...}}"
        )
    states: list[str] = []
    rows: list[Sequence[object]] = []
    for risk_id, shares in consequences.items():
        nrml.check_taxonomy(CONSEQUENCES, risk_id, "id")
        check_kind(CONSEQUENCES, f"shares by damage state for {risk_id!r}", shares, Mapping)
        own = list(shares)
        nrml.check_state_names(CONSEQUENCES, own)
        if not own:
            raise ValueError(f"{CONSEQUENCES}: {risk_id!r} has no damage states: give {{'slight': 0.1, ...}}")
        if states and own != states:
            raise ValueError(
                f"{CONSEQUENCES}: the damage states of {risk_id!r} are {', '.join(own)}, but the first id has "
                f"{', '.join(states)}; all ids of a file need the same states: write two files"
            )
        states = own
        values = [_share(risk_id, state, shares[state]) for state in states]
        _check_order(f"{CONSEQUENCES}: {risk_id!r}", dict(zip(states, values, strict=True)))
        rows.append((risk_id, consequence, loss_type, *(repr(value) for value in values)))
    heads = ("risk_id", "consequence", "loss_type", *states)
    check_same_table(CONSEQUENCES, path, heads, overwrite)
    return write_text(path, _csv_text([heads, *rows]))


def _check_order(what: str, shares: Mapping[str, float]) -> None:
    """Raise a ValueError if the fraction of a damage state is below the fraction of the next lighter state."""
    for (lighter, one), (heavier, other) in pairwise(shares.items()):
        if other < one:
            raise ValueError(
                f"{what}: the share falls from {one:g} for {lighter!r} to {other:g} for {heavier!r}; sort the damage "
                "states with the lightest first"
            )


def _share(risk_id: str, state: str, given: object) -> float:
    what = f"{CONSEQUENCES}: share of {state!r} for {risk_id!r}"
    if isinstance(given, Sequence) and not isinstance(given, str):
        if not 1 <= len(given) <= 2:
            raise ValueError(
                f"{what} must be a number, or a pair of mean and coefficient of variation, got {given!r}: give 0.1 or "
                "(0.1, 0.3)"
            )
        given = given[0]
    value = real_number(what, given, least=0)
    if value > 1:
        raise ValueError(f"{what} is {value:g}; it must be at most 1 (2 % is 0.02): divide percentages by 100")
    return value


def read_consequences(
    path: str | os.PathLike, *, consequence: str = "losses", loss_type: str = "structural"
) -> dict[str, dict[str, float]]:
    """Read one kind of consequence of each damage state, such as loss ratios, from a CSV file of OpenQuake.

    Args:
        path: Path of the CSV file, with the columns `risk_id` (`taxonomy` in old files), `consequence`, optionally
            `loss_type` and `peril`, and one column per damage state. Only rows with the peril "groundshaking" (until
            2025 "earthquake"), or without a peril, are read.
        consequence: Kind of consequence that is read, such as "losses".
        loss_type: Loss type that is read, such as "structural", which is also the loss type of a file without this
            column.

    Returns:
        For each id of a function, a mapping from each damage state to its fraction [1]; `write_consequences` accepts
        it.

    Raises:
        ValueError: If a column is missing, if a fraction is not a number from 0 to 1 or decreases from one state to the
            next, or if the file lacks the consequence or contains an id twice. The error names the file.
        FileNotFoundError: If the file does not exist.
        TypeError: If `path` is not a path.

    Example:
        >>> path = wd.write_consequences({"C1M_H": wd.hazus_loss_ratios("RES3")}, "consequences.csv")
        >>> wd.read_consequences(path)["C1M_H"]["complete"]
        1.0
    """
    for name, word in {"consequence": consequence, "loss_type": loss_type}.items():
        checked_text(f"read_consequences: {name}", word)
    found: dict[str, dict[str, float]] = {}
    named = {"risk_id", "taxonomy", "consequence", "loss_type", "peril"}
    others: dict[str, None] = {}  # names of the consequences that are not read, in the order of the file
    for row in _csv_rows("read_consequences", path, ("consequence",)):
        peril = row.get("peril") or SHAKING[0]
        of_row = row["consequence"], row.get("loss_type") or "structural"
        if of_row != (consequence, loss_type) or peril.lower() not in SHAKING:
            others[f"{of_row[0]} for {of_row[1]}" + (f" by {peril}" if peril.lower() not in SHAKING else "")] = None
            continue
        risk_id = row.get("risk_id") or row.get("taxonomy")
        if not risk_id:
            raise ValueError(f"{path}: a row has no risk_id: complete or remove this row")
        if risk_id in found:
            raise ValueError(f"{path}: {risk_id!r} has {consequence} for {loss_type} twice: remove one of these rows")
        states = [name for name in row if name not in named]
        if not states:
            raise ValueError(
                f"{path} has no column for a damage state; it has {', '.join(row)}. Add a column per damage state, "
                "such as slight"
            )
        found[risk_id] = {state: _csv_number(path, f"{state} of {risk_id!r}", row[state], most=1) for state in states}
        _check_order(f"{path}: {risk_id!r}", found[risk_id])
    if not found:
        raise ValueError(
            f"{path} has no consequence {consequence!r} for loss type {loss_type!r} by earthquakes; it has "
            f"{'; '.join(others) or 'no rows'}. Choose one of these by consequence= and loss_type="
        )
    return found


def _csv_text(rows: Sequence[Sequence[object]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def _csv_rows(function: str, path: str | os.PathLike, needed: Sequence[str]) -> list[dict[str, str]]:
    """Return the rows of a CSV file as mappings from column names to texts; a missing column raises an error."""
    text = io.StringIO(read_csv_text(function, path), newline="")
    reader = csv.DictReader(text, skipinitialspace=True, strict=True)
    try:
        reader.fieldnames = [name.strip() for name in reader.fieldnames or ()]
        _check_header(path, reader.fieldnames)
        for name in needed:
            if name not in (reader.fieldnames or ()):
                raise ValueError(
                    f"{path} has no column {name!r}; it has {', '.join(reader.fieldnames or ()) or 'no columns'}. "
                    "Rename or add the column"
                )
        rows = list(reader)
    except csv.Error as error:
        raise ValueError(
            f"{function}: {path} is not CSV: line {reader.line_num}: {error}. Export it again, or correct the line"
        ) from None
    for place, row in enumerate(rows, 2):
        if None in row or None in row.values():
            raise ValueError(
                f"{path}, line {place}: {'more' if None in row else 'fewer'} values than columns: correct this line"
            )
    return [{name: value.strip() for name, value in row.items()} for row in rows]


def _check_header(path: object, names: Sequence[str]) -> None:
    """Raise a ValueError unless the column names of a CSV file are separated by commas and differ from each other."""
    try:
        check_separator(",".join(names) if len(names) > 1 else "".join(names))
        check_names(names)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _csv_number(path: object, what: str, word: str, *, above: float | None = None, most: float | None = None) -> float:
    """Return the number in a cell of a CSV file.

    Raises:
        ValueError: If the text is not a finite number, or the number is not above `above`, or not from 0 to `most`.
    """
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    good = math.isfinite(value) and (above is None or value > above) and (most is None or 0 <= value <= most)
    if not good:
        bound = (
            f" above {above:g}" if above is not None else "" if most is None else f" from 0 to {most:g} (2 % is 0.02)"
        )
        raise ValueError(f"{path}: {what} must be a finite number{bound}, got {word!r}: correct the file")
    return value
