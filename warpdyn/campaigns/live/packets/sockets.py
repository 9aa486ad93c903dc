"""Packets over a local socket: one line of JSON for each packet."""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator

import numpy as np

from warpdyn.campaigns.live.packets.packet import Packet
from warpdyn.campaigns.live.packets.refused import RefusedPacket
from warpdyn.foundations.core.checks import check_kind, real_number, whole_number

LONGEST_LINE = 2**24  # bytes; a packet of 1 million samples has about this size


def to_line(packet: Packet) -> bytes:
    """Return a packet as one line of JSON, which `from_socket` reads, with all digits of its values.

    Args:
        packet: The packet.

    Raises:
        TypeError: If `packet` is not a Packet.

    Example:
        >>> wd.packets.to_line(wd.packets.Packet([0.1, 0.2], start=12.0))
        b'{"acceleration": [0.1, 0.2], "start": 12.0}\\n'
    """
    check_kind("to_line", "a Packet", packet, Packet)
    described = {"acceleration": np.asarray(packet.acceleration, dtype=np.float64).tolist()}
    described |= {name: getattr(packet, name) for name in ("start", "step", "component")}
    return (json.dumps({name: value for name, value in described.items() if value is not None}) + "\n").encode()


def from_socket(host: str, port: int, timeout: float = 60.0) -> Iterator[Packet]:
    """Connect to a server by TCP, and yield the packets that it sends until it closes the connection.

    Each packet is a line of JSON with "acceleration", and optionally "start" and "step" [s] and "component", as
    `to_line` writes it.

    Args:
        host: Name or address of the server, such as "localhost".
        port: Port of the server.
        timeout: Longest time without data [s].

    Raises:
        RefusedPacket: If a line is not a packet.
        TimeoutError: If no data have arrived for `timeout` seconds.
        OSError: If the server cannot be reached.

    Example:
        >>> import socket, threading
        >>> with socket.create_server(("localhost", 0)) as server:
        ...     port = server.getsockname()[1]
        ...     def serve() -> None:
        ...         connection, _ = server.accept()
        ...         with connection:
        ...             connection.sendall(wd.packets.to_line(wd.packets.Packet([0.1, 0.2], start=12.0)))
        ...     threading.Thread(target=serve).start()
        ...     [packet.start for packet in wd.packets.from_socket("localhost", port)]
        [12.0]
    """
    timeout = real_number("timeout [s]", timeout, above=0)
    if not isinstance(host, str):
        raise TypeError(
            f"from_socket: host must be a name or an address as text, got {host!r}: give the host first, then the "
            'port, such as from_socket("localhost", 5000)'
        )
    port = whole_number("port", port, 1, 65535)
    with _connected(host, port, timeout) as connection, connection.makefile("rb") as file:
        while line := file.readline(LONGEST_LINE + 1):
            if len(line) > LONGEST_LINE:
                raise RefusedPacket(f"a line has more than {LONGEST_LINE} bytes: send packets with fewer samples")
            yield _packet_of(line)


def _connected(host: str, port: int, timeout: float) -> socket.socket:
    """Return a connection to a server; raise the OSError with its host and port if it cannot be reached."""
    try:
        return socket.create_connection((host, port), timeout=timeout)
    except OSError as error:
        told = f"cannot connect to {host}:{port} ({error}): start the server first, or correct the host and the port"
        raise (OSError(error.errno, told) if error.errno else type(error)(told)) from error


def _packet_of(line: bytes) -> Packet:
    """Return the packet in a line of JSON."""
    try:
        described = json.loads(line)
        return Packet(**described)
    except (ValueError, TypeError) as error:
        raise RefusedPacket(
            f"the line {line[:60]!r} is not a packet ({error}): send one line of JSON for each packet, such as "
            '{"acceleration": [0.1, 0.2], "start": 12.0}'
        ) from error
