"""Connects to a daemon, or starts one."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Optional, Union

from polyest import _daemon
from polyest._connection import ConnectionOptions, File
from polyest._table import Data
from polyest.client import Client
from polyest.estimates import Estimate
from polyest.problem import ProblemLike


def connect(server: str, *, token: Optional[str] = None, token_file: Optional[File] = None,
            ca: Optional[File] = None, certificate: Optional[File] = None,
            key: Optional[File] = None, server_name: Optional[str] = None,
            timeout_s: Optional[float] = None) -> Client:
    """Returns a client of the daemon at `server`, HOST:PORT. It connects at the first call.

    token: by which the daemon knows the caller; sent only over TLS or to this machine.
    token_file: holds the token instead, and is read for each call, so that a new one takes effect.
    ca: file with the CA that signed the daemon's certificate (PEM); asks for TLS.
    certificate, key: files with the client's own certificate and its key (PEM).
    server_name: the name in the daemon's certificate, if it is not the host's.
    timeout_s: how long each call may take, s; None: without limit. Streams may take longer.

    Raises InvalidInput if the server is not HOST:PORT with a port from 1 to 65535, a file cannot be
    used, or a token would go unencrypted over a network.
    """
    return Client(ConnectionOptions(server, token, token_file, ca, certificate, key, server_name,
                                    timeout_s))


class LocalClient(Client):
    """A client of a daemon that it has started, and that ends with it."""

    def __init__(self, daemon: _daemon.Daemon, timeout_s: Optional[float]) -> None:
        """Use `polyest.local`."""
        super().__init__(ConnectionOptions(daemon.address, timeout_s=timeout_s))
        #: The daemon: its `address`, `pid`, `log()`.
        self.daemon = daemon

    def close(self) -> None:
        """Ends the connection and the daemon."""
        super().close()
        self.daemon.stop()


def local(daemon: Optional[File] = None, *, data_dir: Optional[File] = None, port: int = 0,
          arguments: Sequence[str] = (), timeout_s: Optional[float] = None) -> LocalClient:
    """Starts `polyestd` on this machine and returns a client of it.

    The daemon ends with the client (`close`, the end of a `with` block) or with the program.

    daemon: the program; by default that of the environment variable POLYEST_DAEMON, an installed
        one, or the newest one built in the checkout around the package or the working folder.
    data_dir: folder in which sessions are kept; by default they end with the daemon.
    port: at which it listens; by default a free one.
    arguments: further options of `polyestd`.
    timeout_s: as in `polyest.connect`.

    Raises Unavailable if there is no such program or it does not start.
    """
    return LocalClient(_daemon.start(daemon, data_dir, f"127.0.0.1:{port}", arguments),
                       timeout_s)


def estimate(problem: ProblemLike, data: Union[Data, os.PathLike[str]], *,
             units: Optional[Mapping[str, str]] = None,
             client: Optional[Client] = None) -> Estimate:
    """Returns an estimate from measurements; see `Client.estimate`.

    client: of the daemon that computes it; by default one on this machine, which is started at the
        first call and ends with the program.
    """
    from polyest._default import default_client

    return (client or default_client()).estimate(problem, data, units=units)
