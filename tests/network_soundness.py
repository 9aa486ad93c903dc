"""Whether a damaged file of a strong-motion network is still a sound file, so that nothing in it shows the damage.

The checks use no reader: a file is sound if its numbers are in columns of the format's width and have its number of
digits, and what the header states twice, or states and the values show, agrees within the printed digits.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np


def numbers(lines: list[str], width: int, per_line: int, pattern: str, indent: int = 0) -> np.ndarray | None:
    """Return the numbers of lines in columns of one width, or None if a line has another layout."""
    found: list[float] = []
    for i, line in enumerate(lines):
        row = line.rstrip()[indent:]
        cells = [row[j : j + width] for j in range(0, len(row), width)]
        is_last = i == len(lines) - 1
        if not all(re.fullmatch(pattern, cell) and len(cell) == width for cell in cells):
            return None
        if len(cells) != per_line and not (is_last and 0 < len(cells) < per_line):
            return None
        found += [float(cell) for cell in cells]
    return np.array(found)


def has_peak(values: np.ndarray, told: float, step: float, time: float | None, digits: float, of_time: float) -> bool:
    """Return whether the largest value is as large as a header states, and where the header states it."""
    sizes = np.abs(values)
    if abs(sizes.max() - abs(told)) > digits * 1.000001:
        return False
    at = np.flatnonzero(sizes >= sizes.max() - digits)
    return time is None or time == 0 or bool(np.any(np.abs((at + 0.5) * step - time) <= 1.01 * step + 0.51 * of_time))


def lasts(count: int, step: float, told: float, digits: float) -> bool:
    """Return whether values last as long as a header states, to the last value or a step more."""
    return told == 0 or abs((count - 0.5) * step - told) <= 0.51 * step + digits


def knet(text: str) -> bool:
    lines = text.rstrip().split("\n")
    header = {line[:18].strip(): line[18:].strip() for line in lines[:17]}
    scale = re.fullmatch(r"(\d+\.?\d*)\s*\(gal\)\s*/\s*(\d+\.?\d*)", header.get("Scale Factor", ""))
    rate = re.fullmatch(r"(\d+\.?\d*)\s*(Hz)?", header.get("Sampling Freq(Hz)", ""), re.I)
    counts = numbers([f" {line}" for line in lines[17:]], 9, 8, r" +-?\d+")
    if scale is None or rate is None or counts is None:
        return False
    factor = float(scale[1]) / float(scale[2])
    is_long = round(float(header["Duration Time(s)"]) * float(rate[1])) == counts.size
    gal = factor * (counts - counts.mean())
    return is_long and has_peak(gal, float(header["Max. Acc. (gal)"]), 1.0, None, 1e-3 + factor, 0)


def csmip_v1(text: str) -> bool:
    lines = text.rstrip().split("\n")
    points = re.match(
        r"\s*(\d+)\s+Accelerogram\s+points\s+at\s+(\d*\.?\d+)\s*pts/sec\s+in\s+units\s+of\s+g\b.*\(8f9\.6\)",
        lines[27],
        re.I,
    )
    sizes = re.search(r"No\. of Points\s*=\s*(\d+)\s+Record Length\s*=\s*(\d*\.?\d+)\s*sec", lines[10], re.I)
    peak = re.search(r"max\s*=\s*([-+]?\d*\.\d+)\s*g\s*,?\s*at\s+(\d*\.\d+)\s*sec", lines[11], re.I)
    values = numbers(lines[28:-1], 9, 8, r" *[-+]?\d*\.\d{6}")
    if points is None or sizes is None or peak is None or values is None or not lines[-1].lstrip().startswith("/&"):
        return False
    step = 1 / float(points[2])
    is_counted = int(points[1]) == int(sizes[1]) == values.size
    digits = 10.0 ** -len(peak[1].partition(".")[2]) + 1e-4 * np.abs(values).max()
    is_peak = has_peak(values, float(peak[1]), step, float(peak[2]), digits, 1e-3)
    return is_counted and lasts(values.size, step, float(sizes[2]), 1e-3) and is_peak


def bhrc(text: str) -> bool:
    """The number and the duration alone state the step."""
    lines, at = text.rstrip().split("\n"), 0
    while at < len(lines):
        sizes = re.search(r"NO\. OF POINTS\s*=\s*(\d+)\s+DURATION\s*=\s*(\d*\.?\d+)", lines[at + 10], re.I)
        if sizes is None or not re.search(r"SECONDS AND G/10", lines[at + 11], re.I):
            return False
        end = at + 27 + -(-int(sizes[1]) // 10)
        values = numbers(lines[at + 27 : end], 13, 10, r" *-?\d*\.\d+E[-+]\d\d")
        if values is None or values.size != int(sizes[1]) or not lines[end].lstrip().startswith("/&"):
            return False
        at = end + 1
    return True


def csmip_v2(text: str) -> bool:
    lines = text.rstrip().split("\n")
    points = re.match(
        r"\s*(\d+)\s+points of accel\w* data equally spaced at\s+(\d*\.?\d+)\s*sec,\s*in\s+cm/sec2\.", lines[45], re.I
    )
    length = re.search(r"Record length\s*=\s*(\d*\.?\d+)\s*sec", lines[11], re.I)
    peak = re.search(r"Peak acceleration\s*=\s*([-+]?\d*\.\d+)\s+cm/sec/sec\s+at\s+(\d*\.\d+)\s*sec", lines[17], re.I)
    if points is None or length is None or peak is None:
        return False
    end = 46 + -(-int(points[1]) // 8)
    values = numbers(lines[46:end], 10, 8, r" *[-+]?\d*\.\d{5}")
    if values is None or values.size != int(points[1]) or end >= len(lines) or "veloc" not in lines[end]:
        return False
    digits = 10.0 ** -len(peak[1].partition(".")[2]) + 1e-4 * np.abs(values).max()
    step, of_step = float(points[2]), 0.5 * 10.0 ** -len(points[2].partition(".")[2])
    is_long = lasts(values.size, step, float(length[1]), 1e-3 + values.size * of_step)
    return is_long and has_peak(values, float(peak[1]), step, float(peak[2]), digits, 1e-3)


def smc(text: str) -> bool:
    lines = text.rstrip().split("\n")
    whole = numbers(lines[11:17], 10, 8, r" *-?\d+")
    reals = numbers(lines[17:27], 15, 5, r" *[-+]?\d*\.\d+E[-+]\d+")
    values = numbers(lines[29:], 10, 8, r" *-?\d\.\d{4}E[-+]\d")
    if whole is None or reals is None or values is None or whole.size != 48 or reals.size != 50:
        return False
    if whole[16] != values.size or whole[15] != 2 or reals[1] <= 0:
        return False
    times, digits = np.arange(values.size) / reals[1], 1e-4 * np.abs(values).max()
    for at, found in ((29, values.max()), (31, values.min())):
        near = times[np.abs(values - found) <= digits]
        is_known, has_time = abs(reals[at]) < 1e30, abs(reals[at - 1]) < 1e30
        if is_known and abs(reals[at] - found) > digits:
            return False
        if is_known and has_time and np.abs(near - reals[at - 1]).min() > 1.01 / reals[1]:
            return False
    return True


def geonet(text: str) -> bool:
    lines = text.rstrip().split("\n")
    at = 0
    while at < len(lines):
        sizes = re.search(
            r"Number of points\s+(\d+)\s+Duration\s+(\d*\.?\d+)\s*s", "\n".join(lines[at + 9 : at + 10]), re.I
        )
        raw = re.search(
            r"in units of (\d*\.?\d+)?\s*mm/s/s\s+at intervals of\s+(\d*\.?\d+)\s*s",
            "\n".join(lines[at + 10 : at + 11]),
            re.I,
        )
        peak = re.search(
            r"Peak\s+([-+]?\d*\.?\d+)\s*mm/s/s\s+at\s+(\d*\.?\d+)\s*s", "\n".join(lines[at + 13 : at + 14]), re.I
        )
        if sizes is None or raw is None or peak is None:
            return False
        end = at + 26 + -(-int(sizes[1]) // 10)
        values = numbers(lines[at + 26 : end], 8, 10, r" *[-+]?\d*\.\d")
        step, scale = float(raw[2]), float(raw[1] or 1)
        if values is None or values.size != int(sizes[1]) or step <= 0:
            return False
        digits = 10.0 ** -len(sizes[2].partition(".")[2])
        of_step = 0.5 * values.size * 10.0 ** -len(raw[2].partition(".")[2])
        of_peak = 10.0 ** -len(peak[1].partition(".")[2]) + 0.1 * scale
        if not lasts(values.size, step, float(sizes[2]), digits + of_step):
            return False
        if not has_peak(
            scale * values, float(peak[1]), step, float(peak[2]), of_peak, 10.0 ** -len(peak[2].partition(".")[2])
        ):
            return False
        at = end
    return True


def asa(text: str) -> bool:
    lines = text.rstrip().split("\n")
    header = dict(re.findall(r"^(.{39}): (.*)$", text, re.M))
    told = {key.strip(): value.strip() for key, value in header.items()}
    first = (
        next((i for i, line in enumerate(lines) if re.match(r"\s*DATOS DE ACELERACION", line, re.I)), len(lines)) + 5
    )
    values = numbers(lines[first:], 10, 3, r" *[-+]?\d*\.\d{4}")
    if values is None or values.size % 3:
        return False
    try:
        table = values.reshape(-1, 3)
        steps = [float(each) for each in told["INTERVALO DE MUESTREO, C1-C6 (s)"].split("/")[1:4]]
        rates = [float(each) for each in told["VEL. DE MUESTREO, C1-C6 (muestras/s)"].split("/")[1:4]]
        counts = [int(each) for each in told["NUM. TOTAL DE MUESTRAS, C1-C6"].split("/")[1:4]]
        lengths = [float(each) for each in told["DURACION DEL REGISTRO (s), C1-C6"].split("/")[1:4]]
        peaks = told["ACEL. MAX.(Gal), C1-C6"].split("/")[1:4]
        return all(
            abs(1 / rates[i] - steps[i]) <= 0.01 * steps[i]
            and counts[i] == len(table)
            and lasts(len(table), steps[i], lengths[i], 0.01 + 0.005 * len(table) * steps[i])
            and abs(np.abs(table[:, i]).max() - abs(float(peaks[i])))
            <= 1.000001 * (10.0 ** -len(peaks[i].partition(".")[2]) + 1e-4)
            for i in range(3)
        )
    except (KeyError, ValueError, IndexError, ZeroDivisionError):
        return False


def afad(text: str) -> bool:
    lines = text.rstrip().split("\n")
    count = re.search(r"^NUMBER OF DATA\s*:\s*(\d+)\s*$", text, re.M | re.I)
    step = re.search(
        r"^SAMPLING INTERVAL \(sec\)\s*:\s*(\d*\.?\d+)\s*$", text, re.M | re.I
    )  # which nothing else states
    peaks = re.search(r"\(N-S\)\s*(\d*\.?\d+)\s*\(E-W\)\s*(\d*\.?\d+)\s*\(U-D\)\s*(\d*\.?\d+)", text)
    first = next((i for i, line in enumerate(lines) if re.fullmatch(r"\s*N-S\s+E-W\s+U-D\s*", line)), None)
    if count is None or step is None or peaks is None or first is None:
        return False
    values = numbers(lines[first + 1 :], 14, 3, r" *[-+]?\d+\.\d{6}")
    if values is None or values.size != 3 * int(count[1]):
        return False
    largest = np.abs(values.reshape(-1, 3)).max(axis=0)
    return all(
        abs(largest[i] - float(peaks[i + 1])) <= 10.0 ** -len(peaks[i + 1].partition(".")[2]) + 1.1e-6 for i in range(3)
    )


def cwa(text: str) -> bool:
    lines = text.rstrip().split("\n")
    header = dict(re.findall(r"^#([^:\n]*):[ \t]*(.*)$", text, re.M))
    first = next((i for i, line in enumerate(lines) if line.strip() and not line.startswith("#")), len(lines))
    values = numbers(lines[first:], 10, 4, r" *-?\d*\.\d{3}")
    if values is None or values.size % 4 or not re.search(r"4F10\.3", header.get("Data", ""), re.I):
        return False
    table, step = values.reshape(-1, 4), 1 / float(header["SampleRate(Hz)"])
    if np.abs(table[:, 0] - table[0, 0] - step * np.arange(len(table))).max() > 0.02 * step:
        return False
    for i, component in enumerate("UNE", start=1):
        peaks = re.findall(r"-?\d+\.\d+", header.get(f"AmplitudeMAX. {component}", ""))
        if peaks and abs(max(abs(float(peak)) for peak in peaks) - np.abs(table[:, i]).max()) > 2.001e-3:
            return False
    length = header["RecordLength(sec)"]
    return lasts(len(table), step, float(length), 10.0 ** -len(length.partition(".")[2]))


def running(text: str) -> bool:
    lines = text.rstrip().split("\n")
    stated = re.search(r"NPTS\s*=?\s*(\d+)", lines[1]) if len(lines) > 1 else None
    values = numbers(lines[2:], 10, 8, r" *[-+]?\d*\.\d{4}")
    return values is not None and (stated is None or int(stated[1]) == values.size)


SOUND: dict[str, Callable[[str], bool]] = {
    "knet": knet,
    "csmip_v1": csmip_v1,
    "csmip_v2": csmip_v2,
    "bhrc": bhrc,
    "smc": smc,
    "geonet": geonet,
    "asa": asa,
    "afad": afad,
    "cwa": cwa,
    "running": running,
}
