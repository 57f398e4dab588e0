"""MCAP files, as `polyest[mcap]` reads them: messages in JSON or protobuf, without ROS."""

from __future__ import annotations

import contextlib
import math
import os
import struct
from collections.abc import Iterator, Mapping
from typing import IO, Any, Literal, Optional, Union

from polyest._table import refuse
from polyest.errors import InvalidInput
from polyest.io._choices import check_channels, needed, units_of, unknown
from polyest.io._ordered import ordered
from polyest.io._recording import Batch, Recording
from polyest.io._rows import TimeZero, batches, check_options
from polyest.io._topics import MessageDecoder, Path, check_encoding, fields_of, unit_of

__all__ = ["read", "topics"]

File = Union[str, "os.PathLike[str]"]


def topics(file: File) -> dict[str, list[str]]:
    """Returns the topics of a file, and the paths of the numbers in the first message of each."""
    found: dict[str, list[str]] = {}
    with _open(file) as opened, _damage_refused(file):
        reader = _reader(file, opened)
        known = _summary(reader)
        decoder = MessageDecoder()
        for topic, (_, channel) in known.items():
            found[topic] = []
            if channel.message_encoding in ("json", "protobuf"):
                for schema, _, message in reader.iter_messages(topics=[topic]):
                    found[topic] = fields_of(decoder.decode(schema, channel, message.data), topic)
                    break
    return found


def read(file: File, channels: Mapping[str, str], *,
         units: Optional[Mapping[str, str]] = None, time_zero: TimeZero = "auto", run: int = 0,
         time: Literal["log", "publish"] = "log", reorder_window_s: float = 1.0,
         batch_rows: int = 10_000) -> Recording:
    """Returns fields of the messages of an MCAP file as a recording.

    channels: topic and field for each output and streamed input of the problem, as in
        {"x": "/suspension.travel", "u": "/road.wheels[0].height"}.
    units: of channels, as in {"x": "mm"}. By default that which the JSON Schema of the messages
        names ("unit" beside "type"), or the metadata "unit" of the topic, else the model's.
    time_zero: "file" keeps the file's times, s; "first" makes the first row t = 0; "auto" is
        "first" where times are dates, since 1970, as they mostly are here, and else "file".
    run: of the record, ≥ 0.
    time: "log", when a message was recorded, or "publish", when it was published.
    reorder_window_s: how much later than others a message may come, s, ≥ 0.
    batch_rows: the most rows of a batch; memory holds a few, the messages of the window and a chunk
        of the file.

    Times are whole ns. A message without the field, or with null, NaN or ∞ there, has no sample.
    Raises InvalidInput, which is a ValueError, for a file that is none or cut short, topics and
    fields that do not exist (it lists the nearest), fields that are no numbers and other encodings;
    ImportError without mcap.
    """
    check_channels(channels)
    check_options(time_zero, batch_rows, reorder_window_s)
    if time not in ("log", "publish"):
        raise refuse("time", f"must be log or publish; got '{time}'")
    name = os.fspath(file)
    with _open(file) as opened, _damage_refused(file):
        known = _summary(_reader(file, opened))
    paths = {quantity: Path(f"channels.{quantity}", text, known)
             for quantity, text in channels.items()}
    chosen = units_of({quantity: _unit(quantity, path, *known[path.topic])
                       for quantity, path in paths.items()}, units)

    def rows() -> Iterator[Batch]:
        pieces = ordered(name, _samples(file, paths, time), reorder_window_s, batch_rows)
        return batches(name, pieces, chosen, run=run, time_zero=time_zero, batch_rows=batch_rows)

    return Recording(name, chosen, rows)


def _unit(quantity: str, path: Path, schema: Any, channel: Any) -> str:
    check_encoding(f"channels.{quantity}", channel)
    return unit_of(schema, channel, path.steps)


def _open(file: File) -> IO[bytes]:
    try:
        return open(os.fspath(file), "rb")
    except OSError as error:
        raise InvalidInput(f"{os.fspath(file)}: cannot be opened: {error.strerror}") from error


@contextlib.contextmanager
def _damage_refused(file: File) -> Iterator[None]:
    """Raises InvalidInput for what mcap raises if a file is damaged."""
    exceptions = needed("mcap.exceptions", "mcap")
    try:
        yield
    except (exceptions.McapError, EOFError, struct.error, UnicodeDecodeError) as error:
        raise InvalidInput(f"{os.fspath(file)}: is no MCAP file, is damaged or cut short: "
                           f"{error or type(error).__name__}") from error


def _reader(file: File, opened: IO[bytes]) -> Any:
    make_reader = needed("mcap.reader", "mcap").make_reader
    with _damage_refused(file):
        return make_reader(opened)


def _summary(reader: Any) -> dict[str, tuple[Any, Any]]:
    """Returns schema and channel of each topic."""
    summary = reader.get_summary()
    if summary is None or not summary.channels:  # written without one
        return {channel.topic: (schema, channel)
                for schema, channel, _ in reader.iter_messages(log_time_order=False)}
    return {channel.topic: (summary.schemas.get(channel.schema_id), channel)
            for channel in summary.channels.values()}


def _samples(file: File, paths: Mapping[str, Path],
             time: str) -> Iterator[tuple[int, dict[str, float]]]:
    decoder = MessageDecoder()
    found: set[str] = set()
    last: dict[str, Any] = {}
    wanted = sorted({path.topic for path in paths.values()})
    with _open(file) as opened, _damage_refused(file):
        for schema, channel, message in _reader(file, opened).iter_messages(
                topics=wanted, log_time_order=False):
            decoded = decoder.decode(schema, channel, message.data)
            values = values_of(paths, channel.topic, decoded)
            found.update(values)
            last[channel.topic] = decoded
            if values:
                yield message.log_time if time == "log" else message.publish_time, values
    for quantity, path in paths.items():
        if quantity not in found and path.topic in last:
            raise unknown(f"channels.{quantity}", "field with numbers", path.text,
                          fields_of(last[path.topic], path.topic))


def values_of(paths: Mapping[str, Path], topic: str, message: Any) -> dict[str, float]:
    """Returns the values in a message of a topic; those that it lacks are left out."""
    values = {}
    for quantity, path in paths.items():
        value = path.value(message) if path.topic == topic else None
        if value is not None and math.isfinite(value):
            values[quantity] = value
    return values
