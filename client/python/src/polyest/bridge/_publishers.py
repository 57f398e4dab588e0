"""Where estimates go: a message on a CAN bus, an MQTT broker, viewers of Foxglove, JSON lines."""

from __future__ import annotations

import json
import math
import pathlib
import sys
import threading
from collections.abc import Callable
from typing import Any, Optional, Protocol

from polyest._parameters import ParameterNames
from polyest._table import refuse
from polyest.bridge._backoff import Backoff
from polyest.bridge._configuration import Target
from polyest.bridge._foxglove import FoxgloveOutlet
from polyest.bridge._sources import open_bus
from polyest.bridge._values import as_json, check_path, value_of
from polyest.estimates import Estimate
from polyest.io._choices import needed, unknown
from polyest.io._frames import find_message, load_database

# How long a broker may take to answer, and the end waits for a publisher, s.
_TIMEOUT_S = 5.0

# Frames of others that are dropped before one is sent, at most.
_MOST_RECEIVED = 100_000


class Outlet(Protocol):
    """A connection that estimates go out by. Any exception means that it is lost."""

    def open(self) -> None:
        """Connects."""

    def send(self, estimate: Estimate) -> None:
        """Sends one estimate."""

    def close(self) -> None:
        """Disconnects; may be called again."""


class CanOutlet:
    """Sends a message of a CAN database."""

    def __init__(self, field: str, target: Target, names: ParameterNames) -> None:
        """Raises InvalidInput for a message, signal or value that does not exist."""
        assert target.bus is not None
        self._bus_options = target.bus
        database = load_database(target.bus.database)
        self._message = find_message(database, f"{field}.message", target.message)
        if self._message.is_multiplexed():
            raise refuse(f"{field}.message", f"'{target.message}' is multiplexed; it must not be")
        self._signals = {one.name: one for one in self._message.signals}
        for name, path in target.signals.items():
            if name not in self._signals:
                raise unknown(f"{field}.signals", "signal", name, self._signals)
            check_path(f"{field}.signals.{name}", path, names)
        self._paths = dict(target.signals)
        self._bus: Any = None
        #: Values beyond what their signal can hold, which were sent as its limit.
        self.saturated = 0

    def open(self) -> None:
        """Opens the bus, whose frames are not wanted here: where the kernel can, it keeps them."""
        self._bus = open_bus(self._bus_options)
        if self._bus_options.interface == "socketcan":
            self._bus.set_filters([{"can_id": 0, "can_mask": 0x1FFFFFFF, "extended": True}])

    def send(self, estimate: Estimate) -> None:
        """Sends the message; signals that no value is given for have their initial one."""
        can = needed("can", "can")
        self._forget_received()
        values = {name: self._within(signal, value_of(estimate, self._paths[name]))
                  if name in self._paths else signal.raw_to_scaled(signal.raw_initial or 0)
                  for name, signal in self._signals.items()}
        data = self._message.encode(values, scaling=True, strict=False)
        self._bus.send(can.Message(arbitration_id=self._message.frame_id, data=data,
                                   is_extended_id=self._message.is_extended_frame,
                                   is_fd=len(data) > 8), timeout=_TIMEOUT_S)

    def _forget_received(self) -> None:
        """Drops what others have sent, which would pile up."""
        for _ in range(_MOST_RECEIVED):
            if self._bus.recv(0) is None:
                return

    def _within(self, signal: Any, value: float) -> float:
        """Returns a value that the signal can hold: beyond its limits, the limit."""
        if signal.is_float:
            return value
        bits = signal.length - 1 if signal.is_signed else signal.length
        raw = (-(2**bits) if signal.is_signed else 0), 2**bits - 1
        ends = sorted(float(signal.raw_to_scaled(one)) for one in raw)
        low = max(ends[0], ends[0] if signal.minimum is None else float(signal.minimum))
        high = min(ends[1], ends[1] if signal.maximum is None else float(signal.maximum))
        if not math.isfinite(value):
            raise ValueError(f"a value of {signal.name} is {value}")
        if low <= value <= high:
            return value
        self.saturated += 1
        return min(max(value, low), high)

    def close(self) -> None:
        """Closes the bus."""
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.shutdown()


class MqttOutlet:
    """Publishes a JSON object at a topic of an MQTT broker, with quality of service 1."""

    def __init__(self, target: Target, session: str) -> None:
        """Use `open`."""
        self._target = target
        self._session = session
        self._client: Any = None

    def open(self) -> None:
        """Connects and waits for the broker."""
        mqtt = needed("paho.mqtt.client", "bridge")
        versions = getattr(mqtt, "CallbackAPIVersion", None)  # since paho-mqtt 2
        client = mqtt.Client(versions.VERSION2) if versions else mqtt.Client()
        target = self._target
        if target.tls:
            client.tls_set()
        if target.username:
            client.username_pw_set(target.username, _secret(target.password_file))
        connected = threading.Event()
        client.on_connect = lambda *arguments: connected.set()
        client.connect(target.host, target.port)
        client.loop_start()
        self._client = client
        if not connected.wait(_TIMEOUT_S) or not client.is_connected():
            raise ConnectionError(f"{target.host}:{target.port} does not take the connection")

    def send(self, estimate: Estimate) -> None:
        """Publishes and waits for the broker's acknowledgement."""
        told = json.dumps(as_json(self._session, estimate))
        sent = self._client.publish(self._target.topic, told, qos=1, retain=self._target.retain)
        sent.wait_for_publish(_TIMEOUT_S)
        if not sent.is_published():
            raise ConnectionError(f"{self._target.host} does not acknowledge")

    def close(self) -> None:
        """Disconnects."""
        client, self._client = self._client, None
        if client is not None:
            client.disconnect()
            client.loop_stop()


def _secret(file: str) -> Optional[str]:
    return pathlib.Path(file).read_text(encoding="utf-8").strip() if file else None


class JsonOutlet:
    """Writes a line of JSON for each estimate."""

    def __init__(self, file: str, session: str) -> None:
        """`file` is appended to; "-" is the standard output."""
        self._file, self._session = file, session

    def open(self) -> None:
        """Finds out whether the file can be written."""
        if self._file != "-":
            pathlib.Path(self._file).open("a", encoding="utf-8").close()

    def send(self, estimate: Estimate) -> None:
        """Writes a line."""
        line = json.dumps(as_json(self._session, estimate)) + "\n"
        if self._file == "-":
            sys.stdout.write(line)
            sys.stdout.flush()
        else:  # opened for each line, so that the file may be moved away
            with pathlib.Path(self._file).open("a", encoding="utf-8") as file:
                file.write(line)

    def close(self) -> None:
        """Does nothing: the file is closed after each line."""


class Publisher(threading.Thread):
    """Sends the newest estimate by an outlet, which is opened again when it fails."""

    def __init__(self, name: str, outlet: Outlet, say: Callable[[str], None]) -> None:
        """`name` is for what is said."""
        super().__init__(name=f"polyest-{name}", daemon=True)
        #: The connection.
        self.outlet = outlet
        self._what, self._say = name, say
        self._changed = threading.Condition()
        self._newest: Optional[Estimate] = None
        self._ending = False
        #: Estimates sent.
        self.sent = 0
        #: How often the outlet was opened again.
        self.reconnects = 0

    def offer(self, estimate: Estimate) -> None:
        """Hands over an estimate; one that is not sent yet is replaced."""
        with self._changed:
            self._newest = estimate
            self._changed.notify()

    def end(self) -> None:
        """Sends what is left and ends, or gives up after a while."""
        with self._changed:
            self._ending = True
            self._changed.notify()
        self.join(_TIMEOUT_S)

    def run(self) -> None:
        """Sends until the end."""
        backoff = Backoff()
        opened = False
        while True:
            try:
                self.outlet.open()
                self.reconnects += opened
                opened = True
                self._send_all(backoff)
                self.outlet.close()
                return
            except Exception as error:  # each outlet has its own
                self._say(f"{self._what} fails: {error}; it is opened again in "
                          f"{backoff.next_s:.1f} s")
                self._close()
            with self._changed:
                if self._changed.wait_for(lambda: self._ending, backoff.delay_s()):
                    return

    def _close(self) -> None:
        try:
            self.outlet.close()
        except Exception as error:
            self._say(f"{self._what}: {error}")

    def _send_all(self, backoff: Backoff) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None or self._ending)
                estimate, self._newest = self._newest, None
            if estimate is None:
                return
            try:
                self.outlet.send(estimate)
            except Exception:
                with self._changed:
                    self._newest = self._newest or estimate
                raise
            backoff.reset()
            self.sent += 1


def publisher_of(number: int, target: Target, session: str, names: ParameterNames,
                 say: Callable[[str], None]) -> Publisher:
    """Returns the publisher of a target. Raises InvalidInput and ImportError."""
    field = f"publish[{number}]"
    outlet: Outlet
    if target.kind == "can":
        outlet = CanOutlet(field, target, names)
    elif target.kind == "mqtt":
        needed("paho.mqtt.client", "bridge")
        outlet = MqttOutlet(target, session)
    elif target.kind == "foxglove":
        outlet = FoxgloveOutlet(target, session)
    else:
        outlet = JsonOutlet(target.file, session)
    return Publisher(f"{field} ({target.kind})", outlet, say)
