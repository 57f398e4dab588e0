"""Finds all fields of a JSON object that its message lacks. Protobuf's parser stops at the first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor

from polyest._wrong_values import field_named, is_map, names_of
from polyest.io._choices import nearest


def find(document: Mapping[str, Any], message: Descriptor,
         prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yields the path of each unknown field, in the order of the paths, and what may be meant.

    Values of the wrong type are passed over.
    """
    if message.full_name.startswith("google.protobuf."):
        return  # messages such as Duration have a special form in JSON
    for name, value in sorted(document.items()):
        path = f"{prefix}.{name}" if prefix else name
        field = field_named(message, name)
        if field is None:
            yield path, _suggested(name, message)
        elif field.message_type is not None:
            yield from _within(value, field, path)


def _within(value: Any, field: FieldDescriptor, path: str) -> Iterator[tuple[str, str]]:
    message = field.message_type
    parts: Iterator[tuple[str, Any]] = iter([(path, value)])
    if is_map(field):
        message = message.fields_by_name["value"].message_type
        parts = ((f"{path}.{name}", part) for name, part in sorted(value.items())
                 ) if message is not None and isinstance(value, Mapping) else iter(())
    elif isinstance(value, list):
        parts = ((f"{path}[{number}]", part) for number, part in enumerate(value))
    for at, part in parts:
        if isinstance(part, Mapping):
            yield from find(part, message, at)


def _suggested(name: str, message: Descriptor) -> str:
    known = names_of(message)
    near = nearest(name, known, 1)
    if near:
        return f'did you mean "{near[0]}"?'
    return f"known names: {', '.join(known)}" if known else ""
