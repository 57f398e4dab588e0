"""Where measurements come from: a CAN bus, MCAP on the standard input, a server of Foxglove's."""

from __future__ import annotations

import errno
import math
import socket
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import IO, Any, Optional, Union

from polyest.bridge._backoff import run_reconnecting
from polyest.bridge._configuration import CanBus, Configuration, FoxgloveServer, McapStream
from polyest.bridge._foxglove_source import FoxgloveSource
from polyest.bridge._topic_values import TopicValues
from polyest.errors import InvalidInput
from polyest.io._choices import needed, unknown
from polyest.io._frames import FrameDecoder, load_database
from polyest.io._rows import nanoseconds
from polyest.io._topics import MessageDecoder

#: Takes a time, ns, and the values that some channels had then.
Put = Callable[[int, Mapping[str, float]], None]

# How long a bus is listened to before the end is looked for, s.
_POLL_S = 0.2

# How long, in the end, frames are read that have arrived, s.
_DRAIN_S = 2.0

# Linux tells the state of a socket's memory in numbers, the last of which counts what was dropped.
_SO_MEMINFO, _MEMINFO = 55, struct.Struct("9I")


class CanSource:
    """A bus of python-can, opened again when it fails."""

    #: Whether samples that find the queue full are dropped: a bus does not wait.
    live = True

    def __init__(self, bus: CanBus, channels: Mapping[str, str],
                 say: Callable[[str], None]) -> None:
        """Raises InvalidInput for a database or a signal that does not exist."""
        self._bus = bus
        self._say = say
        self._decoder = FrameDecoder(load_database(bus.database), channels)
        #: The unit of each channel as the database writes it.
        self.units = self._decoder.units
        self._opened = False
        self._socket: Optional[socket.socket] = None
        self._lost = 0
        #: How often the bus was opened again, or frames came after its interface was down.
        self.reconnects = 0
        #: time.monotonic() of the last frame of these channels.
        self.last: Optional[float] = None

    @property
    def undecodable(self) -> int:
        """Frames of the wanted messages whose data do not fit them."""
        return self._decoder.undecodable

    @property
    def lost(self) -> int:
        """Frames that the kernel dropped, since they were not read in time."""
        return self._lost + _dropped(self._socket)

    def run(self, put: Put, stop: threading.Event) -> None:
        """Puts all samples until `stop` is set."""
        def listen(works: Callable[[], None]) -> None:
            with open_bus(self._bus) as bus:
                self.reconnects += self._opened
                self._opened = True
                if self._bus.interface == "socketcan":
                    bus.set_filters(self._decoder.filters)  # the kernel keeps what is not wanted
                    self._socket = bus.socket
                try:
                    self._listen(bus, put, stop, works)
                finally:
                    lost, self._socket = _dropped(self._socket), None
                    self._lost += lost

        # Each interface of python-can has exceptions of its own.
        run_reconnecting(listen, (Exception,), self._failed, stop)

    def _failed(self, error: Exception, delay_s: float) -> None:
        self._say(f"the bus {self._bus.channel} fails: {error}; it is opened again in "
                  f"{delay_s:.1f} s")

    def _listen(self, bus: Any, put: Put, stop: threading.Event,
                works: Callable[[], None]) -> None:
        last_chance, down = math.inf, False
        while time.monotonic() < last_chance:
            if stop.is_set() and last_chance == math.inf:  # what has arrived is read
                last_chance = time.monotonic() + _DRAIN_S
            try:
                frame = bus.recv(0 if stop.is_set() else _POLL_S)
            except Exception as error:  # each interface of python-can has its own
                if getattr(error, "error_code", None) != errno.ENETDOWN:
                    raise
                # Linux says so once. The same socket has the frames that came before, and those
                # that come as soon as the interface is up again.
                down = True
                self._say(f"the bus {self._bus.channel} is down; it is listened to until it is up")
                continue
            if frame is None and stop.is_set():
                return
            if frame is not None:
                works()
                self.reconnects += down
                down = False
            values = self._decoder.decode(frame) if frame is not None else {}
            if frame is not None and values:
                self.last = time.monotonic()
                put(nanoseconds(frame.timestamp), values)


def _dropped(opened: Optional[socket.socket]) -> int:
    """Returns how many frames a socket of SocketCAN had no room for."""
    if opened is None:
        return 0
    try:
        found = opened.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
    except OSError:  # it is closed, or the kernel older than 4.12
        return 0
    return int(_MEMINFO.unpack(found)[-1])


def open_bus(bus: CanBus) -> Any:
    """Opens a bus. Raises what python-can raises."""
    can = needed("can", "can")
    channel: Union[str, int] = int(bus.channel) if bus.channel.isdigit() else bus.channel
    arguments = {"channel": channel} if bus.channel else {}
    return can.Bus(interface=bus.interface, **arguments, **dict(bus.options))


class McapSource:
    """Messages of an MCAP stream, which ends."""

    #: A file waits for the daemon.
    live = False

    def __init__(self, stream: McapStream, channels: Mapping[str, str]) -> None:
        """Use it from one thread."""
        self._stream = stream
        self._wanted = TopicValues(channels)
        #: Units come with the topics.
        self.units = self._wanted.units
        self.reconnects = self.undecodable = self.lost = 0
        self.last: Optional[float] = None

    def run(self, put: Put, stop: threading.Event) -> None:
        """Puts all samples until the stream ends or `stop` is set. Raises InvalidInput."""
        name = self._stream.file
        if name == "-":
            self._read(sys.stdin.buffer, put, stop)
            return
        try:
            with open(name, "rb") as opened:
                self._read(opened, put, stop)
        except OSError as error:
            raise InvalidInput(f"{name}: cannot be opened: {error.strerror}") from error

    def _read(self, opened: IO[bytes], put: Put, stop: threading.Event) -> None:
        decoder = MessageDecoder()
        for schema, channel, message in _messages(opened, self._stream.file):
            if stop.is_set():
                return
            if self._wanted.find(schema, channel):
                values = self._wanted.values(
                    channel, decoder.decode(schema, channel, message.data))
                if values:
                    self.last = time.monotonic()
                    put(message.log_time, values)
        for quantity, text in self._wanted.missing().items():
            raise unknown(f"channels.{quantity}", "topic", text, ())


def _messages(opened: IO[bytes], name: str) -> Iterator[tuple[Any, Any, Any]]:
    """Yields schema, channel and message of a stream that cannot be searched."""
    needed("mcap", "mcap")
    reader = needed("mcap.stream_reader", "mcap").StreamReader(opened)
    records = needed("mcap.records", "mcap")
    schemas: dict[int, Any] = {}
    channels: dict[int, Any] = {}
    try:
        for record in reader.records:
            if isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel):
                channels[record.id] = record
            elif isinstance(record, records.Message):
                channel = channels[record.channel_id]
                yield schemas.get(channel.schema_id), channel, record
    except InvalidInput:
        raise
    except Exception as error:  # mcap has several, and struct.error
        raise InvalidInput(f"{name}: is no MCAP stream, or is cut short: "
                           f"{error or type(error).__name__}") from error


Source = Union[CanSource, McapSource, FoxgloveSource]


def source_of(configuration: Configuration, say: Callable[[str], None]) -> Source:
    """Returns the source of a configuration. Raises InvalidInput."""
    if isinstance(configuration.source, CanBus):
        return CanSource(configuration.source, configuration.channels, say)
    if isinstance(configuration.source, FoxgloveServer):
        return FoxgloveSource(configuration.source, configuration.channels, say)
    return McapSource(configuration.source, configuration.channels)
