"""Packets of ground motion for live ensembles: from records, sockets, obspy streams and SeedLink servers."""

from warpdyn.campaigns.live.packets.packet import Packet
from warpdyn.campaigns.live.packets.refused import RefusedPacket

__all__ = ["Packet", "RefusedPacket"]
