"""Packets of ground motion for `Live`: from known motions, sockets, obspy streams and SeedLink servers."""

from warpdyn.campaigns.live.packets.packet import Packet
from warpdyn.campaigns.live.packets.refused import RefusedPacket
from warpdyn.campaigns.live.packets.seedlink import from_seedlink
from warpdyn.campaigns.live.packets.sockets import from_socket, to_line
from warpdyn.campaigns.live.packets.sources import from_motion, from_obspy

__all__ = ["Packet", "RefusedPacket", "from_motion", "from_obspy", "from_seedlink", "from_socket", "to_line"]
