"""Connects to a daemon, or starts one, from a coroutine."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Optional

from polyest import _daemon
from polyest._connection import ConnectionOptions, File
from polyest.aio.client import Client


def connect(server: str, *, token: Optional[str] = None, token_file: Optional[File] = None,
            ca: Optional[File] = None, certificate: Optional[File] = None,
            key: Optional[File] = None, server_name: Optional[str] = None,
            timeout_s: Optional[float] = None) -> Client:
    """Returns a client of the daemon at `server`; as `polyest.connect`. Call it in a coroutine."""
    return Client(ConnectionOptions(server, token, token_file, ca, certificate, key, server_name,
                                    timeout_s))


class LocalClient(Client):
    """A client of a daemon that it has started, and that ends with it."""

    def __init__(self, daemon: _daemon.Daemon, timeout_s: Optional[float]) -> None:
        """Use `polyest.aio.local`."""
        super().__init__(ConnectionOptions(daemon.address, timeout_s=timeout_s))
        #: The daemon: its `address`, `pid`, `log()`.
        self.daemon = daemon

    async def close(self) -> None:
        """Ends the connection and the daemon."""
        await super().close()
        await asyncio.get_running_loop().run_in_executor(None, self.daemon.stop)


def local(daemon: Optional[File] = None, *, data_dir: Optional[File] = None, port: int = 0,
          arguments: Sequence[str] = (), timeout_s: Optional[float] = None) -> LocalClient:
    """Starts `polyestd` and returns a client of it; as `polyest.local`. Call it in a coroutine."""
    return LocalClient(_daemon.start(daemon, data_dir, f"127.0.0.1:{port}", arguments),
                       timeout_s)
