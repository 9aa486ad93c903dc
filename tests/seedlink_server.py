"""A SeedLink server on this machine that sends given traces to one client, as the protocol describes it."""

from __future__ import annotations

import io
import socket
import threading

import numpy as np
import obspy

CAPABILITIES = (
    b'<?xml version="1.0"?><seedlink software="SeedLink v3.1" organization="test" started="2026/01/01 00:00:00.0000">'
    b'<capability name="multistation"/><capability name="info:capabilities"/></seedlink>'
)
RECORD = 512  # bytes of a miniSEED record


def records(trace: obspy.Trace) -> list[bytes]:
    buffer = io.BytesIO()
    obspy.Stream([trace]).write(buffer, format="MSEED", reclen=RECORD)
    return [buffer.getvalue()[at : at + RECORD] for at in range(0, buffer.tell(), RECORD)]


def serve(traces: list[obspy.Trace]) -> int:
    """Serve the traces to the first client in another thread; return the port."""
    server = socket.create_server(("localhost", 0))
    text = obspy.Trace(np.frombuffer(CAPABILITIES, dtype="|S1"), {"network": "SL", "station": "INFO"})

    def run() -> None:
        connection, _ = server.accept()
        with server, connection:
            pending = b""
            while True:
                pending += connection.recv(1000)
                while b"\r" in pending:
                    command, _, pending = pending.partition(b"\r")
                    word = command.strip().split()[0]
                    if word == b"HELLO":
                        connection.sendall(b"SeedLink v3.1 (test)\r\ntest\r\n")
                    elif word == b"INFO":
                        *first, last = records(text)
                        connection.sendall(b"".join(b"SLINFO *" + each for each in first) + b"SLINFO  " + last)
                    elif word == b"END":
                        sent = [record for trace in traces for record in records(trace)]
                        connection.sendall(b"".join(b"SL%06X" % i + each for i, each in enumerate(sent)) + b"END")
                        return
                    else:
                        connection.sendall(b"OK\r\n")

    threading.Thread(target=run, daemon=True).start()
    return server.getsockname()[1]
