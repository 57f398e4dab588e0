"""Takes measurements from a server of Foxglove's WebSocket protocol, such as a ROS bridge."""

from __future__ import annotations

import base64
import json
import math
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional

from polyest._table import refuse
from polyest.bridge._backoff import run_reconnecting
from polyest.bridge._configuration import FoxgloveServer
from polyest.bridge._foxglove import DATA, PROTOCOLS
from polyest.bridge._topic_values import TopicValues
from polyest.errors import InvalidInput
from polyest.io._choices import needed, unknown
from polyest.io._topics import MessageDecoder, fields_of, is_in

if TYPE_CHECKING:
    from polyest.bridge._sources import Put

# How long the server is listened to before the end is looked for, s; and then for what has arrived.
_POLL_S = 0.2
_LAST_POLL_S = 0.02

# How long after the connection it is said that a topic is missing, s.
_PATIENCE_S = 5.0

# The largest message: a server announces all of its topics, with their schemas, in one.
_MAX_BYTES = 1 << 26


@dataclass(frozen=True)
class _Schema:
    """As MCAP has schemas."""

    name: str
    encoding: str
    data: bytes


@dataclass(frozen=True)
class _Channel:
    """As MCAP has channels."""

    id: int
    topic: str
    message_encoding: str
    metadata: Mapping[str, str] = field(default_factory=dict)


class FoxgloveSource:
    """A connection to the server, made again when it fails."""

    #: Whether samples that find the queue full are dropped: a server does not wait.
    live = True

    def __init__(self, server: FoxgloveServer, channels: Mapping[str, str],
                 say: Callable[[str], None]) -> None:
        """Raises ImportError without websockets."""
        self._connect = needed("websockets.sync.client", "bridge").connect
        self._failures = (OSError, needed("websockets.exceptions", "bridge").WebSocketException)
        self._url, self._channels, self._say = server.url, channels, say
        self._said: set[str] = set()
        self._opened = False
        #: Units come with the topics.
        self.units = {name: "" for name in channels}
        #: How often the connection was made again.
        self.reconnects = 0
        #: Messages of the wanted topics that cannot be decoded, or whose field is no number.
        self.undecodable = 0
        #: A server does not tell what it left out.
        self.lost = 0
        #: time.monotonic() of the last message with a value.
        self.last: Optional[float] = None

    def run(self, put: Put, stop: threading.Event) -> None:
        """Puts all samples until `stop` is set. Raises InvalidInput for unknown encodings."""
        def listen(works: Callable[[], None]) -> None:
            with self._connect(self._url, subprotocols=list(PROTOCOLS),
                               max_size=_MAX_BYTES) as connection:
                if connection.subprotocol is None:
                    raise OSError("it does not speak Foxglove's protocol")
                self.reconnects += self._opened
                self._opened = True
                _Listener(self, connection, put, works).listen(stop)

        run_reconnecting(listen, self._failures, self._failed, stop)

    def _failed(self, error: Exception, delay_s: float) -> None:
        self._say(f"the server {self._url} fails: {error}; it is connected again in "
                  f"{delay_s:.1f} s")

    def say_once(self, kind: str, what: str) -> None:
        """Says something that would be true of every message, for the first of its kind."""
        if kind not in self._said:
            self._said.add(kind)
            self._say(what)

    def wanted(self) -> TopicValues:
        """Returns the channels as none of their topics is known yet."""
        found = TopicValues(self._channels)
        found.units = self.units
        return found


class _Listener:
    """What one connection has announced, and what is subscribed to."""

    def __init__(self, source: FoxgloveSource, connection: Any, put: Put,
                 works: Callable[[], None]) -> None:
        """`works` is called for each message of a subscribed topic."""
        self._source, self._connection, self._put = source, connection, put
        self._works = works
        self._wanted = source.wanted()
        self._known: dict[int, str] = {}  # topics of all channels
        self._left_out: set[str] = set()  # wanted topics whose schemas cannot be used
        #: Subscriptions by number, which is that of the channel.
        self._subscribed: dict[int, tuple[_Schema, _Channel, MessageDecoder]] = {}

    def listen(self, stop: threading.Event) -> None:
        """Takes messages until `stop` is set; what has arrived by then is taken, too."""
        last_chance, patience = math.inf, time.monotonic() + _PATIENCE_S
        while time.monotonic() < last_chance:
            if stop.is_set() and last_chance == math.inf:
                last_chance = time.monotonic() + _POLL_S
            try:
                message = self._connection.recv(timeout=_LAST_POLL_S if stop.is_set() else _POLL_S)
            except TimeoutError:
                if stop.is_set():
                    return
            else:
                self._take(message)
            if time.monotonic() > patience:
                patience = math.inf
                self._say_missing()

    def _say_missing(self) -> None:
        for quantity, text in self._wanted.missing().items():
            if not any(is_in(text, topic) for topic in self._left_out):
                self._source.say_once(f"missing {quantity}", unknown(
                    f"channels.{quantity}", "topic", text, self._known.values()).message)

    def _take(self, message: Any) -> None:
        if isinstance(message, bytes):
            self._take_data(message)
            return
        try:
            self._take_told(json.loads(message))
        except InvalidInput:  # is a ValueError, too
            raise
        except (ValueError, KeyError, TypeError, AttributeError):
            self._source.say_once(
                "unknown message", "the server sends a message that the protocol does not have")

    def _take_told(self, told: Any) -> None:
        if told.get("op") == "advertise":
            for one in told["channels"]:
                self._advertised(one)
        elif told.get("op") == "unadvertise":
            for number in told["channelIds"]:
                self._known.pop(number, None)
                self._subscribed.pop(number, None)
        elif told.get("op") == "status" and told.get("level", 0) > 0:
            self._source.say_once(f"status {told['level']}",
                                  f"the server says: {told.get('message')}")

    def _advertised(self, told: Mapping[str, Any]) -> None:
        number = int(told["id"])
        channel = _Channel(number, str(told["topic"]), str(told["encoding"]))
        self._known[number] = channel.topic
        if not self._wanted.wants(channel.topic):
            return
        try:
            schema = _schema(told)
        except InvalidInput as error:
            self._left_out.add(channel.topic)
            self._source.say_once(f"schema {channel.topic}",
                                  f"{error.message}; the topic is left out")
            return
        if self._wanted.find(schema, channel):
            self._subscribed[number] = schema, channel, MessageDecoder()
            self._connection.send(json.dumps({"op": "subscribe", "subscriptions": [
                {"id": number, "channelId": number}]}))

    def _take_data(self, message: bytes) -> None:
        if len(message) < DATA.size or message[0] != 1:
            return  # the time of a simulation, or an answer of a service
        _, number, time_ns = DATA.unpack_from(message)
        if number not in self._subscribed:
            return
        self._works()
        schema, channel, decoder = self._subscribed[number]
        kind = "undecodable"
        try:
            decoded = decoder.decode(schema, channel, message[DATA.size:])
            kind = "no number"
            values = self._wanted.values(channel, decoded)
        except InvalidInput as error:
            self._source.undecodable += 1
            self._source.say_once(f"{kind} {channel.topic}",
                                  f"{error.message}; such messages are counted as undecodable")
            return
        for quantity, text in self._wanted.lacking(channel, values).items():
            self._source.say_once(f"lacking {quantity}", (
                "a message has no number at its field: " + unknown(
                    f"channels.{quantity}", "field with numbers", text,
                    fields_of(decoded, channel.topic)).message))
        if values:
            self._source.last = time.monotonic()
            self._put(time_ns, values)


def _schema(told: Mapping[str, Any]) -> _Schema:
    """Returns the schema of a channel that is announced; that of protobuf is sent as Base64."""
    text, encoding = str(told.get("schema", "")), str(told["encoding"])
    implied = {"json": "jsonschema"}.get(encoding, encoding)
    data = text.encode()
    if encoding == "protobuf":
        try:
            data = base64.b64decode(text, validate=True)
        except ValueError as error:
            raise refuse(str(told["topic"]), f"has a schema that is no Base64: {error}") from None
    name = str(told.get("schemaName", ""))
    return _Schema(name, str(told.get("schemaEncoding") or implied), data)
