"""Reader of the "Archivo Estandar de Aceleracion" 2.0 (ASA) of Mexico."""

from __future__ import annotations

import re
from os import PathLike

from warpdyn.model.ground_motions.motions import GroundMotion
from warpdyn.model.ground_motions.records.components.orientations import orientation
from warpdyn.model.ground_motions.records.parsing.fixed_width import (
    Header,
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
from warpdyn.model.ground_motions.records.parsing.not_a_record import damaged
from warpdyn.model.ground_motions.records.units import unit_factor

_TITLE = re.compile(r"archivo\s+estandar\s+de\s+aceleracion", re.IGNORECASE)
_DATA = re.compile(r"\s*datos\s+de\s+aceleracion", re.IGNORECASE)


def is_asa(first_lines: list[str]) -> bool:
    """Return whether a file has the format ASA, judging by its first lines."""
    return any(_TITLE.search(line) for line in first_lines[:12])


def read_asa(path: str | PathLike) -> list[GroundMotion]:
    """Return the motions in an ASA 2.0 file: a header of "NAME : value", then one column per channel.

    Source: Sociedad Mexicana de Ingenieria Sismica, "Base Mexicana de Datos de Sismos Fuertes", standard format 2.0.
    """
    record = RecordText.of(path)
    data = next((i for i, line in enumerate(record.lines) if _DATA.match(line)), None)
    if data is None:
        raise damaged(f"{path}: truncated: this ASA file has no line 'DATOS DE ACELERACION'")
    header = record.header("ASA", data, lambda name: re.sub(r"\W+", " ", name).strip().upper())
    stated, place = header.starting("NUMERO DE CANALES")
    if not re.fullmatch(r"\d{1,2}", stated, re.ASCII) or not 1 <= int(stated) <= 12:
        raise damaged(f"{place}: the number of channels must be a whole number from 1 to 12, got {stated!r}")
    channels = int(stated)
    unit, place = header.starting("UNIDADES DE LOS DATOS")
    factor = unit_factor(unit.split("(")[0], place)

    first = data + 1
    while first < len(record.lines) and not re.match(r"\s*[-+]?\d*\.\d", record.lines[first]):
        first += 1
    record.line(first, "its values")
    counts = {stated_count(*_of_channel(header, "NUM TOTAL DE MUESTRAS", i)) for i in range(channels)}
    if len(counts) > 1:
        place = header.starting("NUM TOTAL DE MUESTRAS")[1]
        raise ValueError(
            f"{place}: the channels have different numbers of values, {sorted(counts)}, which this reader "
            f"does not support: read the columns one by one with wd.records.read_text"
        )
    (count,) = counts
    text, place = header.starting("FORMATO DATOS")
    layout = Layout.of(text) or layout_of_lines(record, first)
    if layout.per_line != channels:
        raise damaged(f"{place}: {layout.per_line} columns, but the header states {channels} channels")
    values, after = block(record, first, channels * count, layout)
    check_end(record, after)
    start = [header[key][0] for key in header if key.startswith(("FECHA DEL SISMO", "HORA DE LA PRIMERA MUESTRA"))]
    name = " ".join([header.starting("CLAVE DE LA ESTACION")[0], *start])
    motions = []
    for i, column in enumerate(values.reshape(count, channels).T):
        step = stated_step(*_of_channel(header, "INTERVALO DE MUESTREO", i))
        rate, place = _of_channel(header, "VEL DE MUESTREO", i, is_needed=False)
        if rate and abs(stated_step(rate, place, is_rate=True) - step) > 0.01 * step:
            raise damaged(f"{place}: {rate} samples per second, but the step is {step:g} s")
        duration, place = _of_channel(header, "DURACION DEL REGISTRO", i, is_needed=False)
        if duration:
            check_duration(count, step, duration, place, precision=0.01 * step)
        peak, place = _of_channel(header, "ACEL MAX Gal", i, is_needed=False)
        if peak:
            check_printed_peak(100 * factor * column, peak, place, precision=10.0 ** -(layout.decimals or 0))
        component = orientation(_of_channel(header, "ORIENTACION", i)[0].split(";")[0]).known_label
        motions.append(record.motion(factor * column, step, component, name))
    return motions


def _of_channel(header: Header, name: str, i: int, *, is_needed: bool = True) -> tuple[str, str]:
    """Return the value of channel i in header lines such as "/0.005/0.005/0.005", and its place (path and line) for
    messages.

    The values of 12 channels need two lines. If the value is missing and `is_needed` is False, both texts are "".
    """
    lines = [value for key, value in header.items() if key.startswith(name.upper())]
    texts = [(each.strip(), place) for text, place in lines for each in text.split("/")[1:]]
    if i < len(texts) and (texts[i][0] or not is_needed):
        return texts[i]
    if is_needed:
        raise damaged(f"{header.path}: the header of this ASA file states no {name!r} of channel {i + 1}")
    return "", ""
