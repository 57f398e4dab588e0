"""The configuration of a bridge: a file in TOML or JSON, checked before anything is connected."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Optional, Union

from polyest import _strict_json
from polyest._table import refuse
from polyest.bridge._fields import Fields
from polyest.errors import InvalidInput
from polyest.io._choices import check_channels, needed

File = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class DaemonOptions:
    """How the daemon is reached; as in `polyest.connect`."""

    server: str
    token_file: Optional[str]
    ca: Optional[str]
    certificate: Optional[str]
    key: Optional[str]
    server_name: Optional[str]


@dataclass(frozen=True)
class SessionChoice:
    """The session that takes the measurements."""

    name: str
    problem: str
    reorder_window_s: float
    #: File that keeps what t = 0 is, so that a bridge that is started again goes on with the run.
    state: str
    #: A gap in the data, s, after which a new run begins; 0: none does.
    new_run_after_s: float
    #: Whether the run ends with the bridge.
    end_run: bool


@dataclass(frozen=True)
class CanBus:
    """A bus of python-can and the database of its messages."""

    interface: str
    channel: str
    database: str
    #: Further arguments of `can.Bus`.
    options: Mapping[str, Any]


@dataclass(frozen=True)
class McapStream:
    """An MCAP file, or the standard input if it is "-"."""

    file: str


@dataclass(frozen=True)
class FoxgloveServer:
    """A server of Foxglove's WebSocket protocol."""

    #: Its address, as in "ws://127.0.0.1:8765".
    url: str


#: Where measurements come from.
SourceChoice = Union[CanBus, McapStream, FoxgloveServer]


@dataclass(frozen=True)
class Target:
    """Where estimates go."""

    #: "can", "mqtt", "foxglove" or "jsonl".
    kind: str
    #: The bus, for "can".
    bus: Optional[CanBus] = None
    #: The message, for "can", and what of the estimate its signals have.
    message: str = ""
    signals: Mapping[str, str] = field(default_factory=dict)
    #: The broker, or for "foxglove" the address to listen at, and the topic.
    host: str = ""
    port: int = 1883
    topic: str = ""
    retain: bool = True
    username: str = ""
    password_file: str = ""
    tls: bool = False
    #: The file, for "jsonl"; "-" is the standard output.
    file: str = ""


@dataclass(frozen=True)
class Configuration:
    """What a bridge does; `read_configuration` makes it of a file."""

    daemon: DaemonOptions
    session: SessionChoice
    source: SourceChoice
    #: The signal, or the topic and field, of each output and streamed input of the problem.
    channels: Mapping[str, str]
    #: Units of channels that the source does not name, or names wrong.
    units: Mapping[str, str]
    #: Time from one batch to the next, s.
    interval_s: float
    #: Samples that wait for the daemon at most; of a live bus further ones are dropped.
    queue: int
    #: The least time from one estimate to the next, s.
    estimate_interval_s: float
    #: Time from one line of status to the next, s; 0: none.
    status_interval_s: float
    #: How long the end waits for the daemon, s.
    end_timeout_s: float
    targets: tuple[Target, ...]


def read_configuration(file: File, *, server: str = "") -> Configuration:
    """Reads a configuration; paths in it count from its folder.

    server: instead of the file's. Raises InvalidInput, which names the field and the rule.
    """
    name = os.fspath(file)
    document = _parse(name)
    try:
        return _read(document, pathlib.Path(name).resolve().parent, server)
    except InvalidInput as error:
        raise InvalidInput(f"{name}: {error.message}", field=error.field,
                           rule=error.rule) from None


def _parse(name: str) -> Any:
    try:
        text = pathlib.Path(name).read_bytes()
        if name.endswith(".json"):
            return _strict_json.loads(text)
        return _toml().loads(text.decode())
    except OSError as error:
        raise InvalidInput(f"{name}: cannot be opened: {error.strerror}") from error
    except _strict_json.JsonError as error:
        raise InvalidInput(f"{name}{error.place}: {error}", field=error.field,
                           rule=error.rule) from None
    except ValueError as error:
        raise InvalidInput(f"{name}: {error}") from error


def _toml() -> Any:
    try:
        import tomllib  # since Python 3.11
    except ImportError:
        return needed("tomli", "bridge")
    return tomllib


def _read(document: Any, folder: pathlib.Path, server: str) -> Configuration:
    fields = Fields("", document)
    daemon = _daemon(Fields("daemon", fields.table("daemon")), folder, server)
    session = _session(Fields("session", fields.table("session", required=True)), folder)
    source = _source(Fields("source", fields.table("source", required=True)), folder)
    channels, units = _channels(fields.table("channels", required=True))
    stream = Fields("stream", fields.table("stream"))
    estimates = Fields("estimates", fields.table("estimates"))
    status = Fields("status", fields.table("status"))
    found = Configuration(
        daemon, session, source, channels, units,
        interval_s=stream.number("interval_s", 0.1, lowest=0, above=True),
        queue=stream.whole("queue", 100_000, 1),
        end_timeout_s=stream.number("end_timeout_s", 10.0, lowest=0),
        estimate_interval_s=estimates.number("interval_s", 1.0, lowest=0),
        status_interval_s=status.number("interval_s", 10.0, lowest=0),
        targets=tuple(_target(Fields(f"publish[{number}]", one), source, folder)
                      for number, one in enumerate(fields.tables("publish"))))
    for one in (stream, estimates, status, fields):
        one.end()
    return found


def _path(folder: pathlib.Path, text: str) -> str:
    return text if text in ("", "-") else str(folder / text)


def _daemon(fields: Fields, folder: pathlib.Path, server: str) -> DaemonOptions:
    files = {name: _path(folder, fields.text(name, "")) or None
             for name in ("token_file", "ca", "certificate", "key")}
    given = fields.text("server", server or None)
    found = DaemonOptions(server=server or given,
                          server_name=fields.text("server_name", "") or None, **files)
    fields.end()
    return found


def _session(fields: Fields, folder: pathlib.Path) -> SessionChoice:
    state = _path(folder, fields.text("state", ""))
    found = SessionChoice(
        name=fields.text("name"), problem=_path(folder, fields.text("problem")),
        reorder_window_s=fields.number("reorder_window_s", 0.0, lowest=0),
        state=state, new_run_after_s=fields.number("new_run_after_s", 0.0, lowest=0),
        end_run=fields.flag("end_run", not state))
    fields.end()
    return found


def _bus(fields: Fields, folder: pathlib.Path, default: Optional[CanBus]) -> CanBus:
    options = fields.table("options") or (dict(default.options) if default else {})
    return CanBus(
        interface=fields.text("interface", default.interface if default else None),
        channel=fields.text("channel", default.channel if default else ""),
        database=_path(folder, fields.text("database", "")) or (
            default.database if default else ""),
        options=options)


def _source(fields: Fields, folder: pathlib.Path) -> SourceChoice:
    kind = fields.choice("kind", ("can", "mcap", "foxglove"))
    found: SourceChoice
    if kind == "can":
        found = _bus(fields, folder, None)
        if not found.database:
            raise refuse(fields.place("database"), "is required")
    elif kind == "foxglove":
        found = FoxgloveServer(fields.text("url"))
        if not found.url.startswith(("ws://", "wss://")):
            raise refuse(fields.place("url"), f"must begin with ws:// or wss://; got '{found.url}'")
    else:
        found = McapStream(_path(folder, fields.text("file", "-")))
    fields.end()
    return found


def _channels(table: Mapping[str, Any]) -> tuple[dict[str, str], dict[str, str]]:
    check_channels(table)
    channels, units = {}, {}
    for name, value in table.items():
        if isinstance(value, str):
            channels[name] = value
        else:
            fields = Fields(f"channels.{name}", value)
            channels[name] = fields.text("from")
            if "unit" in value:
                units[name] = fields.text("unit", "")
            fields.end()
    return channels, units


def _target(fields: Fields, source: SourceChoice, folder: pathlib.Path) -> Target:
    kind = fields.choice("kind", ("can", "mqtt", "foxglove", "jsonl"))
    if kind == "can":
        bus = _bus(fields, folder, source if isinstance(source, CanBus) else None)
        if not bus.database:
            raise refuse(fields.place("database"), "is required")
        found = Target(kind, bus=bus, message=fields.text("message"),
                       signals=_texts(fields, "signals"))
    elif kind == "mqtt":
        found = Target(kind, host=fields.text("host"), topic=fields.text("topic"),
                       port=fields.whole("port", 1883, 1), retain=fields.flag("retain", True),
                       username=fields.text("username", ""), tls=fields.flag("tls", False),
                       password_file=_path(folder, fields.text("password_file", "")))
    elif kind == "foxglove":
        found = Target(kind, host=fields.text("host", "127.0.0.1"),
                       port=fields.whole("port", 8765, 0), topic=fields.text("topic", "/estimate"))
    else:
        found = Target(kind, file=_path(folder, fields.text("file", "-")))
    fields.end()
    return found


def _texts(fields: Fields, name: str) -> dict[str, str]:
    table = fields.table(name, required=True)
    inner = Fields(fields.place(name), table)
    if not table:
        raise refuse(fields.place(name), "must map signals to values, as in K_MEAN = \"k.mean\"")
    return {key: inner.text(key) for key in table}
