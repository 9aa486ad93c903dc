"""Packets from a SeedLink server, by obspy's client."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from warpdyn.campaigns.live.packets.packet import Packet
from warpdyn.campaigns.live.packets.sources import packets_of_trace
from warpdyn.foundations.core.checks import real_number

ENDED = object()  # the client has ended


def from_seedlink(
    server: str,
    network: str,
    station: str,
    channels: str,
    *,
    components: Sequence[str] = ("",),
    sensitivity: float | Mapping[str, float] | None = None,
    timeout: float = 60.0,
) -> Iterator[Packet]:
    """Yield the packets of a station of a SeedLink server while they arrive (pip install "obspy>=1.4").

    obspy's client does not detect gaps. The packets have time stamps, by which `Live` finds gaps and repeated packets.

    Args:
        server: Address of the server, such as "geofon.gfz-potsdam.de:18000".
        network, station: Codes of the station.
        channels: Selector of the channels, such as "HN?".
        components: End of the channel name of each component of the scene's motion, such as ("E", "N").
        sensitivity: Counts of the digitizer per unit of acceleration, one number or one for each trace id; miniSEED
            data are counts.
        timeout: Longest time without data [s].

    Raises:
        RefusedPacket: If a trace contains counts and `sensitivity` is missing, or belongs to no component.
        TimeoutError: If no data have arrived for `timeout` seconds.
        ImportError: If obspy is not installed.

    Example:
        >>> packets = wd.packets.from_seedlink("localhost:18000", "CH", "SMZW", "HN?", sensitivity=4.0e5)
        >>> for answer in live.follow(packets, on_refused="warn"):  # doctest: +SKIP
        ...     print(float(answer["time"]), answer.attrs["gap"])
    """
    timeout = real_number("timeout [s]", timeout, above=0)

    def traces() -> Iterator[Packet]:
        for trace in _traces(server, network, station, channels, timeout):
            yield from packets_of_trace(trace, components, sensitivity)

    return traces()


def _traces(server: str, network: str, station: str, channels: str, timeout: float) -> Iterator[Any]:
    """Yield the traces that obspy's client receives in another thread."""
    try:
        from obspy.clients.seedlink.easyseedlink import EasySeedLinkClient
    except ImportError as error:
        raise ImportError('from_seedlink needs obspy, which is not installed: pip install "obspy>=1.4"') from error

    arrived: queue.Queue[Any] = queue.Queue()
    client = EasySeedLinkClient(server, autoconnect=False)
    client.conn.timeout, client.on_data = timeout, arrived.put  # without a timeout, obspy may fail to connect
    client.connect()
    client.select_stream(network, station, channels)
    threading.Thread(target=_run, args=(client.run, arrived), daemon=True).start()
    try:
        while True:
            try:
                found = arrived.get(timeout=timeout)
            except queue.Empty:
                raise TimeoutError(f"no data of {network}.{station} have arrived for {timeout:g} s") from None
            if found is ENDED:
                return
            if isinstance(found, BaseException):
                raise found
            yield found
    finally:
        client.conn.terminate()


def _run(run: Callable[[], object], arrived: queue.Queue[Any]) -> None:
    """Run the client, and put its end or its error into the queue."""
    try:
        run()
    except BaseException as error:
        arrived.put(error)
    arrived.put(ENDED)
