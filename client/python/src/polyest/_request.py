"""Makes requests, and says which argument protobuf cannot take."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import Message

from polyest.errors import WrongType

Request = TypeVar("Request", bound=Message)

# The arguments of studies that fill fields of other names.
_ARGUMENTS = {
    "draw_count": "draws", "max_row_count": "max_rows", "lag_count": "lags",
    "density_bin_count": "density_bins", "joint_bin_count": "joint_bins",
    "sample_count": "samples", "point_count": "points", "history_point_count": "points",
}

_KINDS = {
    FieldDescriptor.CPPTYPE_INT32: "a whole number",
    FieldDescriptor.CPPTYPE_INT64: "a whole number",
    FieldDescriptor.CPPTYPE_DOUBLE: "a number",
    FieldDescriptor.CPPTYPE_BOOL: "True or False",
    FieldDescriptor.CPPTYPE_STRING: "a text",
}


def wrong(argument: str, value: Any, rule: str) -> WrongType:
    """Returns the exception for an argument that breaks a rule."""
    text = repr(value)
    shown = text if len(text) <= 60 else text[:57] + "…"
    rule = f"{shown} of the type {type(value).__name__} must be {rule}"
    return WrongType(f"{argument}: {rule}", field=argument, rule=rule)


def make(kind: type[Request], **fields: Any) -> Request:
    """Returns a request of these fields, of which None leaves one out.

    A single text stands for a list of one. Raises WrongType, which names the argument.
    """
    message: Any = kind()
    for name, value in fields.items():
        field = kind.DESCRIPTOR.fields_by_name[name]
        if isinstance(value, str) and _is_list(field):
            value = [value]
        try:
            _set(message, field, value)
        except (TypeError, ValueError, AttributeError):
            raise wrong(_ARGUMENTS.get(name, name), value, _rule(field)) from None
    made: Request = message
    return made


def _is_list(field: FieldDescriptor) -> bool:
    return field.label == FieldDescriptor.LABEL_REPEATED and field.message_type is None


def _set(message: Message, field: FieldDescriptor, value: Any) -> None:
    if value is None:
        return
    if _is_list(field):
        getattr(message, field.name).extend(value)
    elif isinstance(value, Mapping):
        getattr(message, field.name).update(value)
    elif field.message_type is None:
        setattr(message, field.name, value)
    else:
        getattr(message, field.name).CopyFrom(value)


def _rule(field: FieldDescriptor) -> str:
    if field.message_type is not None:
        return "a dict of numbers"
    kind = _KINDS[field.cpp_type]
    if not _is_list(field):
        bounds = " below 2^31" if field.cpp_type == FieldDescriptor.CPPTYPE_INT32 else ""
        return kind + bounds
    return f"a list, of which each is {kind}"
