"""Serves estimates over WebSocket by Foxglove's protocol, to Foxglove, Lichtblick and the like."""

from __future__ import annotations

import contextlib
import json
import struct
import threading
import time
from typing import Any, Optional

from polyest.bridge._configuration import Target
from polyest.bridge._values import as_json
from polyest.estimates import Estimate
from polyest.io._choices import needed

#: Names of the protocol, the newest first.
PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
_CHANNEL = 1
#: Head of a message: opcode, number of the subscription, time of the message, ns.
DATA = struct.Struct("<BIQ")
_NUMBER = {"type": "number"}
_SCHEMA = {"type": "object", "title": "polyest.Estimate", "properties": {
    "session": {"type": "string"}, "time": _NUMBER, "samples": {"type": "integer"},
    "sequence": {"type": "integer"},
    "parameters": {"type": "object", "additionalProperties": {"type": "object", "properties": {
        "mean": _NUMBER, "stdDev": _NUMBER, "lower95": _NUMBER, "upper95": _NUMBER,
        "unit": {"type": "string"}, "verdict": {"type": "string"}}}},
    "diagnostics": {"type": "array", "items": {"type": "string"}}}}


class _Viewer:
    """A connection: one thread reads its subscriptions, another sends it the newest estimate."""

    def __init__(self, connection: Any, newest: Optional[bytes]) -> None:
        self.connection = connection
        self._newest = newest
        self._subscriptions: list[int] = []
        self._changed = threading.Condition()
        self._ended = False

    def offer(self, payload: bytes) -> None:
        """Hands over an estimate; one that is not sent yet is replaced."""
        with self._changed:
            self._newest = payload
            self._changed.notify()

    def read(self) -> None:
        """Takes subscriptions until the viewer goes."""
        for message in self.connection:
            if isinstance(message, str):
                with self._changed:
                    self._take(json.loads(message))
                    self._changed.notify()

    def _take(self, asked: Any) -> None:
        if asked.get("op") == "subscribe":
            self._subscriptions += [int(one["id"]) for one in asked["subscriptions"]
                                    if one["channelId"] == _CHANNEL]
        elif asked.get("op") == "unsubscribe":
            self._subscriptions = [number for number in self._subscriptions
                                   if number not in asked["subscriptionIds"]]

    def write(self) -> None:
        """Sends estimates until the end; whoever subscribes late gets the newest one."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ended or (
                    self._newest is not None and bool(self._subscriptions)))
                if self._ended:
                    return
                payload, self._newest = self._newest, None
                wanted = list(self._subscriptions)
            for number in wanted:
                self.connection.send(DATA.pack(1, number, time.time_ns()) + (payload or b""))

    def end(self) -> None:
        """Ends the thread that writes."""
        with self._changed:
            self._ended = True
            self._changed.notify()


class FoxgloveOutlet:
    """A server at which viewers subscribe to the estimates."""

    def __init__(self, target: Target, session: str) -> None:
        """Raises ImportError without websockets."""
        self._serve = needed("websockets.sync.server", "bridge").serve
        self._closed = needed("websockets.exceptions", "bridge").ConnectionClosed
        self._target, self._session = target, session
        self._server: Any = None
        self._viewers: list[_Viewer] = []
        self._lock = threading.Lock()
        self._newest: Optional[bytes] = None

    def open(self) -> None:
        """Listens."""
        self._server = self._serve(self._view, self._target.host, self._target.port,
                                   subprotocols=list(PROTOCOLS), max_size=1 << 20)
        threading.Thread(target=self._server.serve_forever, name="polyest-foxglove",
                         daemon=True).start()

    def _view(self, connection: Any) -> None:
        connection.send(json.dumps({"op": "serverInfo", "name": "polyest-bridge",
                                    "capabilities": [], "metadata": {}}))
        connection.send(json.dumps({"op": "advertise", "channels": [{
            "id": _CHANNEL, "topic": self._target.topic, "encoding": "json",
            "schemaName": "polyest.Estimate", "schemaEncoding": "jsonschema",
            "schema": json.dumps(_SCHEMA)}]}))
        with self._lock:
            viewer = _Viewer(connection, self._newest)
            self._viewers.append(viewer)
        writer = threading.Thread(target=self._write, args=(viewer,), daemon=True)
        writer.start()
        try:
            viewer.read()
        except (ValueError, KeyError, TypeError, AttributeError):
            connection.close(1002, "a message that the protocol does not have")
        except self._closed:
            pass
        finally:
            viewer.end()
            with self._lock:
                self._viewers.remove(viewer)

    def _write(self, viewer: _Viewer) -> None:
        with contextlib.suppress(self._closed):
            viewer.write()

    def send(self, estimate: Estimate) -> None:
        """Hands the estimate to all viewers."""
        payload = json.dumps(as_json(self._session, estimate)).encode()
        with self._lock:
            self._newest = payload
            viewers = list(self._viewers)
        for viewer in viewers:
            viewer.offer(payload)

    def close(self) -> None:
        """Ends the server; viewers get what is on its way."""
        server, self._server = self._server, None
        if server is None:
            return
        server.shutdown()
        with self._lock:
            viewers = list(self._viewers)
        for viewer in viewers:
            viewer.connection.close()
