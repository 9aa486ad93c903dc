"""The error for packets that a live ensemble cannot use."""


class RefusedPacket(ValueError):
    """A packet that was refused; the live ensemble is unchanged, so that the next packet can follow.

    Example:
        >>> live = wd.Live(wd.Scene(building, motions[0]))
        >>> try:
        ...     live.push([0.1, float("nan")])
        ... except wd.packets.RefusedPacket as error:
        ...     print(str(error)[:38])
        packet: acceleration[1, 0] is nan (1 o
    """
