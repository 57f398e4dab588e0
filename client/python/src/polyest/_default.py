"""The daemon on this machine that serves calls which name none."""

from __future__ import annotations

import threading
from typing import Optional

from polyest.client import Client
from polyest.connecting import local

_lock = threading.Lock()
_client: Optional[Client] = None


def default_client() -> Client:
    """Returns a client of a daemon that is started at the first call and ends with the program."""
    global _client
    with _lock:
        if _client is None:
            _client = local()
        return _client
