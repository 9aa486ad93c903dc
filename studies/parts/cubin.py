"""Registers and local memory of a compiled GPU kernel, read from the section .nv.info of its cubin, an ELF file."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

FRAME_SIZE, REGISTER_COUNT = 0x11, 0x2F  # attributes of .nv.info, each of a symbol and a value
SYMBOL_TABLE = 2  # type of an ELF section
SIZED = 4  # format of an attribute that states the size of its value


@dataclass(frozen=True)
class Usage:
    """Registers and local memory of a kernel.

    Args:
        registers: Registers of a thread.
        local: Local memory of a thread [bytes]: spilled registers, and tables that are indexed.
    """

    registers: int
    local: int


def usage(cubin: Path) -> Usage:
    """Return registers and local memory of the one kernel in a cubin."""
    data = cubin.read_bytes()
    (first,) = struct.unpack_from("<Q", data, 0x28)
    size, count, names_at = struct.unpack_from("<HHH", data, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, first + i * size) for i in range(count)]
    found: dict[str, dict[int, int]] = {}

    def text(table: int, offset: int) -> str:
        begin = sections[table][4] + offset
        return data[begin : data.index(b"\0", begin)].decode()

    symbols = next(section for section in sections if section[1] == SYMBOL_TABLE)
    for section in sections:
        at, end = section[4], section[4] + section[5]
        if text(names_at, section[0]) != ".nv.info":
            continue
        while at < end:
            form, attribute, length = struct.unpack_from("<BBH", data, at)
            if form == SIZED and attribute in (FRAME_SIZE, REGISTER_COUNT):
                symbol, value = struct.unpack_from("<II", data, at + 4)
                (name_at,) = struct.unpack_from("<I", data, symbols[4] + 24 * symbol)
                found.setdefault(text(symbols[6], name_at), {})[attribute] = value
            at += 4 + length if form == SIZED else 4
    [kernel] = [values for name, values in found.items() if name.endswith("_forward")]
    return Usage(kernel[REGISTER_COUNT], kernel[FRAME_SIZE])
