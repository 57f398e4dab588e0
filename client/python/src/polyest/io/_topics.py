"""Finds values in the messages of MCAP topics: JSON objects and protobuf messages."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from typing import Any, Optional, Union

from google.protobuf import descriptor_pb2, descriptor_pool, message, message_factory

from polyest._table import refuse
from polyest.errors import InvalidInput
from polyest.io._choices import unknown

# A step into a message: the name of a field, or the number of an element.
_Step = Union[str, int]
_STEP = re.compile(r"\.?([^.\[\]]+)|\[(\d+)\]")

#: Encodings of messages that are read.
ENCODINGS = ("json", "protobuf")


def is_in(text: str, topic: str) -> bool:
    """Returns whether a path leads to a topic or into its messages."""
    return text == topic or text.startswith((f"{topic}.", f"{topic}["))


class Path:
    """Where a value is: a topic and the steps into its messages, as in "/susp.travel[0].value"."""

    def __init__(self, field: str, text: str, topics: Mapping[str, Any]) -> None:
        """Finds the topic, the longest of those with which `text` begins. Raises InvalidInput."""
        self.text = text
        fitting = [topic for topic in topics if is_in(text, topic)]
        if not fitting:
            raise unknown(field, "topic", text, topics)
        #: The topic.
        self.topic = max(fitting, key=len)
        rest = text[len(self.topic):]
        self.steps: list[_Step] = []
        at = 0
        while at < len(rest):
            match = _STEP.match(rest, at)
            if match is None:
                raise refuse(field, f"'{text}' is no path such as '/topic.field[0].value'")
            self.steps.append(match[1] if match[1] is not None else int(match[2]))
            at = match.end()

    def value(self, message: Any) -> Optional[float]:
        """Returns the number in a message; None if it lacks the field. Raises InvalidInput."""
        found = message
        for step in self.steps:
            found = _enter(found, step)
            if found is None:
                return None
        if isinstance(found, (int, float)):
            return float(found)
        fields = f"; its fields are {', '.join(_fields(found))}" if _fields(found) else ""
        raise refuse(self.text, f"is no number but {type(found).__name__}{fields}")


def _enter(message: Any, step: _Step) -> Any:
    if isinstance(step, int):
        indexed = hasattr(message, "__getitem__") and not isinstance(message, (str, bytes, Mapping))
        return message[step] if indexed and step < len(message) else None
    if isinstance(message, Mapping):
        return message.get(step)
    fields = getattr(getattr(message, "DESCRIPTOR", None), "fields_by_name", {})
    if step not in fields or (fields[step].has_presence and not message.HasField(step)):
        return None
    return getattr(message, step)


def _fields(message: Any) -> list[str]:
    if isinstance(message, Mapping):
        return [str(name) for name in message]
    return list(getattr(getattr(message, "DESCRIPTOR", None), "fields_by_name", ()))


def fields_of(message: Any, prefix: str = "") -> list[str]:
    """Returns the paths of all numbers in a message, for those who look for one."""
    if isinstance(message, (int, float)):
        return [prefix]
    found: list[str] = []
    for name in _fields(message):
        found += fields_of(_enter(message, name), f"{prefix}.{name}")
    return found


class MessageDecoder:
    """Decodes the messages of a file, whose schemas it has."""

    def __init__(self) -> None:
        self._parsers: dict[int, Callable[[bytes], Any]] = {}

    def decode(self, schema: Any, channel: Any, data: bytes) -> Any:
        """Returns a message. Raises InvalidInput for another encoding and for bad data."""
        try:
            if channel.message_encoding == "json":
                return json.loads(data)
            if channel.id not in self._parsers:
                self._parsers[channel.id] = _parser(schema, channel.topic)
            return self._parsers[channel.id](data)
        except InvalidInput:  # is a ValueError, too
            raise
        except ValueError as error:
            raise refuse(channel.topic, f"has a message that cannot be decoded: {error}") from error
        except message.DecodeError as error:
            raise refuse(channel.topic, f"has a message that cannot be decoded: {error}") from error


def check_encoding(field: str, channel: Any) -> None:
    """Raises InvalidInput for messages that cannot be read."""
    if channel.message_encoding not in ENCODINGS:
        raise refuse(field, f"topic {channel.topic} has messages in "
                     f"'{channel.message_encoding}'; those in {' and '.join(ENCODINGS)} are read")


def _parser(schema: Any, topic: str) -> Callable[[bytes], Any]:
    if schema is None:
        raise refuse(topic, "has no schema, which protobuf messages need")
    pool = descriptor_pool.DescriptorPool()
    try:
        for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
            pool.Add(file)
        described = pool.FindMessageTypeByName(schema.name)
    except (KeyError, TypeError, message.DecodeError) as error:
        raise refuse(topic, f"has a schema that cannot be used: {error}") from error
    if hasattr(message_factory, "GetMessageClass"):
        kind: Any = message_factory.GetMessageClass(described)
    else:  # protobuf 4.21
        kind = message_factory.MessageFactory(pool).GetPrototype(described)
    parse: Callable[[bytes], Any] = kind.FromString
    return parse


def unit_of(schema: Any, channel: Any, steps: list[_Step]) -> str:
    """Returns the unit that a JSON Schema's property names, or the channel's metadata; or ""."""
    if schema is not None and schema.encoding == "jsonschema":
        try:
            described = json.loads(schema.data)
        except ValueError:
            described = None
        for step in steps:
            described = _property(described, "items" if isinstance(step, int) else "properties")
            described = described if isinstance(step, int) else _property(described, step)
        unit = _property(described, "unit")
        if isinstance(unit, str):
            return unit
    return str(channel.metadata.get("unit", ""))


def _property(described: Any, name: str) -> Any:
    """Returns a property; None where a schema has another form, since any JSON may stand there."""
    return described.get(name) if isinstance(described, Mapping) else None
