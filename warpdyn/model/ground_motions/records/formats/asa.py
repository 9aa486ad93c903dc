"""Reader of the "Archivo Estandar de Aceleracion" 2.0 (ASA) of Mexico."""

from __future__ import annotations

import re
from os import PathLike

import numpy as np

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components import orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import (
    Layout,
    RecordText,
    block,
    check_end,
    layout_of_lines,
)
from warpdyn.model.ground_motions.records.parsing.header_checks import (
    check_duration,
    check_printed_peak,
    stated_count,
    stated_step,
)
from warpdyn.model.ground_motions.records.units import unit_factor

_TITLE = re.compile(r"archivo\s+estandar\s+de\s+aceleracion", re.IGNORECASE)
_DATA = re.compile(r"\s*datos\s+de\s+aceleracion", re.IGNORECASE)
_RULE = re.compile(r"[-+=\s]{20,}")


def is_asa(first_lines: list[str]) -> bool:
    """Return whether a file begins as an ASA file does."""
    return any(_TITLE.search(line) for line in first_lines[:12])


def read_asa(path: str | PathLike) -> list[GroundMotion]:
    """Read the channels of an ASA 2.0 file: a header of "NAME : value", then a column per channel.

    Source: Sociedad Mexicana de Ingenieria Sismica, "Base Mexicana de Datos de Sismos Fuertes", standard format 2.0.

    Args:
        path: The file; its name and the channels' components name the motions.

    Raises:
        ValueError: If the header lacks a line, the unit is not that of an acceleration, the number, duration or peak of
            the values is not that of the header, or the file is cut.
    """
    record = RecordText.of(path)
    data = next((i for i, line in enumerate(record.lines) if _DATA.match(line)), None)
    if data is None:
        raise ValueError(f"{path}: truncated: this ASA file has no line 'DATOS DE ACELERACION'")
    header: dict[str, tuple[str, str]] = {}
    for i, line in enumerate(record.lines[:data]):
        name, colon, value = line.partition(":")
        if colon and name.strip():
            header.setdefault(re.sub(r"\W+", " ", name).strip().upper(), (value.strip(), record.place(i)))
    channels = stated_count_of_channels(*_line(header, "NUMERO DE CANALES", path))
    unit, place = _line(header, "UNIDADES DE LOS DATOS", path)
    factor = unit_factor(unit.split("(")[0], place)
    layout = Layout.of(_line(header, "FORMATO DATOS", path)[0])

    first = data + 1
    while first < len(record.lines) and not re.match(r"\s*[-+]?\d*\.\d", record.lines[first]):
        first += 1
    record.line(first, "its values")
    count = _counts(header, channels, path)
    layout = layout or layout_of_lines(record, first)
    if layout.per_line != channels:
        raise ValueError(
            f"{_line(header, 'FORMATO DATOS', path)[1]}: {layout.per_line} columns, but the header states {channels} "
            "channels"
        )
    values, after = block(record, first, channels * count, layout)
    check_end(record, after)
    table = values.reshape(count, channels)
    station = _line(header, "CLAVE DE LA ESTACION", path)[0]
    start = " ".join(header.get(name, ("", ""))[0] for name in _of_start(header))
    motions = []
    for i in range(channels):
        step = stated_step(*_of_channel(header, "INTERVALO DE MUESTREO", i, path))
        rate = _of_channel(header, "VEL DE MUESTREO", i, path, is_needed=False)
        if rate[0] and abs(stated_step(*rate, is_rate=True) - step) > 0.01 * step:
            raise ValueError(f"{rate[1]}: {rate[0]} samples per second, but the step is {step:g} s: one is damaged")
        duration = _of_channel(header, "DURACION DEL REGISTRO", i, path, is_needed=False)
        if duration[0]:
            check_duration(count, step, *duration, precision=0.01 * step)
        peak = _of_channel(header, "ACEL MAX Gal", i, path, is_needed=False)
        if peak[0]:
            check_printed_peak(100 * factor * table[:, i], *peak, precision=10.0 ** -(layout.decimals or 0))
        label = orientation(_of_channel(header, "ORIENTACION", i, path)[0].split(";")[0])
        component = label.label if label.kind != "unknown" else ""
        name = f"{record.stem} {component}".strip()
        motions.append(
            GroundMotion(factor * np.array(table[:, i]), step, name, str(path), f"{station} {start}".strip(), component)
        )
    return motions


def stated_count_of_channels(text: str, place: str) -> int:
    """Return how many channels a header states."""
    if not re.fullmatch(r"\d{1,2}", text, re.ASCII) or not 1 <= int(text) <= 12:
        raise ValueError(f"{place}: the number of channels must be a whole number from 1 to 12, got {text!r}")
    return int(text)


def _line(header: dict[str, tuple[str, str]], name: str, path: str | PathLike) -> tuple[str, str]:
    """Return the value of the first line of the header whose name begins so, and its place."""
    found = next((value for key, value in header.items() if key.startswith(name.upper())), None)
    if found is None:
        raise ValueError(f"{path}: the header of this ASA file lacks the line {name!r}")
    return found


def _of_start(header: dict[str, tuple[str, str]]) -> list[str]:
    """Return the names of the lines with the date of the earthquake and the time of the first sample."""
    return [key for key in header if key.startswith(("FECHA DEL SISMO", "HORA DE LA PRIMERA MUESTRA"))]


def _of_channel(
    header: dict[str, tuple[str, str]], name: str, i: int, path: str | PathLike, *, is_needed: bool = True
) -> tuple[str, str]:
    """Return what a line such as "/0.005/0.005/0.005" states about a channel, and its place; two lines state 12."""
    lines = [value for key, value in header.items() if key.startswith(name.upper())]
    texts = [(each.strip(), place) for text, place in lines for each in text.split("/")[1:]]
    if i < len(texts) and (texts[i][0] or not is_needed):
        return texts[i]
    if is_needed:
        raise ValueError(f"{path}: the header of this ASA file states no {name!r} of channel {i + 1}")
    return "", ""


def _counts(header: dict[str, tuple[str, str]], channels: int, path: str | PathLike) -> int:
    """Return the number of values of all channels, or raise a ValueError if they differ."""
    stated = [stated_count(*_of_channel(header, "NUM TOTAL DE MUESTRAS", i, path)) for i in range(channels)]
    if len(set(stated)) > 1:
        place = _line(header, "NUM TOTAL DE MUESTRAS", path)[1]
        raise ValueError(f"{place}: the channels have different numbers of values, {stated}: this is not supported")
    return stated[0]
