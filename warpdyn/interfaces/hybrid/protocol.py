"""Messages of hybrid tests over TCP: the layout of the generic elements of OpenFresco.

The client first sends 11 integers (32 bits): the numbers of controlled displacements, velocities, accelerations,
forces and times, the numbers of measured ones, and the number of values in a message. Each message is an array of
exactly this number of floats (64 bits). A request contains an action, displacements, velocities, accelerations and the
time; an answer contains displacements, velocities, accelerations, forces and the time, or only the values asked for.
"""

from __future__ import annotations

import enum
import socket

import numpy as np

KINDS = 5  # displacement, velocity, acceleration, force, time
SIZES = 2 * KINDS + 1
DATA_SIZE = 256  # default number of values in a message
HEADER, VALUES = np.dtype("<i4"), np.dtype("<f8")


class Action(enum.IntEnum):
    """The first value of a request; the actions from GET_RESPONSE to GET_MASS have an answer."""

    SET_TRIAL = 3
    EXECUTE = 4
    COMMIT = 5
    GET_RESPONSE = 6
    GET_DISPLACEMENT = 7
    GET_VELOCITY = 8
    GET_ACCELERATION = 9
    GET_FORCE = 10
    GET_TIME = 11
    GET_INITIAL_STIFFNESS = 12
    GET_TANGENT_STIFFNESS = 13
    GET_DAMPING = 14
    GET_MASS = 15
    SHUT_DOWN = 98
    END = 99


def least_data_size(dofs: int) -> int:
    """Return the least number of values in a message for a number of degrees of freedom; matrices must fit, too."""
    return max(4 * dofs + 1, dofs * dofs)


def received(link: socket.socket, size: int) -> bytes:
    """Return exactly `size` bytes from a socket.

    Raises:
        ConnectionError: If the other side closes the connection before.
        TimeoutError: If the bytes do not arrive within the timeout of the socket.
    """
    data = bytearray(size)
    view, count = memoryview(data), 0
    while count < size:
        got = link.recv_into(view[count:])
        if not got:
            raise ConnectionError(f"the other side closed the connection after {count} of {size} bytes of a message")
        count += got
    return bytes(data)


def send_header(link: socket.socket, dofs: int, data_size: int) -> None:
    """Send the 11 integers with which a client starts."""
    sizes = [dofs, dofs, dofs, 0, 1, dofs, dofs, dofs, dofs, 1, data_size]
    link.sendall(np.array(sizes, HEADER).tobytes())


def receive_header(link: socket.socket) -> np.ndarray:
    """Return the 11 integers of a client, shape [11]."""
    return np.frombuffer(received(link, SIZES * HEADER.itemsize), HEADER)


def send_values(link: socket.socket, values: np.ndarray, data_size: int) -> None:
    """Send a message: the values, and zeros up to the size of a message."""
    message = np.zeros(data_size, VALUES)
    message[: values.size] = values
    link.sendall(message.tobytes())


def receive_values(link: socket.socket, data_size: int) -> np.ndarray:
    """Return the values of a message, shape [data_size]."""
    return np.frombuffer(received(link, data_size * VALUES.itemsize), VALUES)
