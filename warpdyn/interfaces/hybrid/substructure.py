"""An emulated external substructure: a server that answers a hybrid test with computed forces."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

import numpy as np

from warpdyn.foundations.core.checks import whole_number
from warpdyn.foundations.core.near_misses import with_suggestions
from warpdyn.interfaces.hybrid.protocol import (
    KINDS,
    Action,
    receive_header,
    receive_values,
    send_values,
)

Forces = Callable[[np.ndarray, np.ndarray, np.ndarray, float], np.ndarray | float]


@with_suggestions
class Substructure:
    """A server on this machine that computes the forces of a substructure, to rehearse a hybrid test.

    The server answers one connection at a time in its own thread, until the `with` block ends.

    Args:
        force: Function of displacements [m], velocities [m/s] and accelerations [m/s2] (each of shape [dof]) and of the
            time [s]; it returns the forces [N], shape [dof]. It is called once for each trial response.
        dofs: Number of degrees of freedom.
        port: Port on the loopback interface; 0: a free port, which the attribute `address` contains.

    Raises:
        ValueError: If `dofs` is not a whole number of at least 1, or the port is not free.

    Example:
        >>> frame = wd.ShearBuilding(1e5, 4e7, 3.0, damping="rayleigh", damping_ratio=0.05)
        >>> with wd.hybrid.Substructure(lambda u, v, a, t: 4e5 * u) as specimen:
        ...     test = wd.hybrid.HybridTest(frame, 1, specimen.address, step=0.005)
        ...     result = test.run(motions[0], duration=0.5)
        >>> result.attrs["missed_deadlines"]
        0
    """

    def __init__(self, force: Forces, dofs: int = 1, *, port: int = 0) -> None:
        self.force, self.dofs = force, whole_number("dofs", dofs, 1)
        self.commits = 0  # number of committed steps
        self.error: BaseException | None = None  # the last error of the function or the connection
        self._server = socket.socket()
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            self._server.bind(("127.0.0.1", whole_number("port", port, 0, 65535)))
        except OSError as error:
            self._server.close()
            raise ValueError(f"port {port} is not free ({error.strerror}): give another port, or port=0") from None
        self._server.listen(1)
        self.address: tuple[str, int] = self._server.getsockname()
        self._is_open = True
        self._link: socket.socket | None = None
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection and the server."""
        self._is_open = False
        ends = [each for each in (self._link, self._server) if each is not None]
        for each in ends:
            with contextlib.suppress(OSError):  # not connected
                each.shutdown(socket.SHUT_RDWR)
        self._thread.join(timeout=5)  # it reads the messages that have arrived
        for each in ends:
            each.close()

    def _serve(self) -> None:
        while self._is_open:
            try:
                link, _ = self._server.accept()
            except OSError:
                return
            self._link = link
            with link:
                link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                try:
                    self._answer(link)
                except Exception as error:  # the client reads the closed connection
                    self.error = error if self._is_open else self.error
            self._link = None

    def _answer(self, link: socket.socket) -> None:
        header = receive_header(link)
        dofs, data_size = int(header[0]), int(header[-1])
        if dofs != self.dofs:
            raise ConnectionError(
                f"the client controls {dofs} degrees of freedom, but the substructure has {self.dofs}"
            )
        trial = np.zeros(3 * dofs + 1)
        forces = np.zeros(dofs)
        while True:
            message = receive_values(link, data_size)
            action = int(message[0])
            if action in (Action.SHUT_DOWN, Action.END):
                return
            if action == Action.SET_TRIAL:
                trial = message[1 : 3 * dofs + 2].copy()
                parts = trial[:dofs], trial[dofs : 2 * dofs], trial[2 * dofs : 3 * dofs]
                forces = np.broadcast_to(np.asarray(self.force(*parts, float(trial[-1])), float), (dofs,))
            elif action == Action.COMMIT:
                self.commits += 1
            elif action == Action.GET_RESPONSE:
                send_values(link, np.concatenate([trial[:-1], forces, trial[-1:]]), data_size)
            elif action == Action.GET_FORCE:
                send_values(link, forces, data_size)
            elif Action.GET_DISPLACEMENT <= action <= Action.GET_TIME:
                place = (action - Action.GET_DISPLACEMENT) % KINDS
                place = 3 if action == Action.GET_TIME else place
                send_values(link, trial[place * dofs : (place + 1) * dofs], data_size)
            elif action != Action.EXECUTE:
                raise ConnectionError(f"the client asks for action {action}, which this substructure does not support")
