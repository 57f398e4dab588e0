"""Reads fields of messages as numpy arrays and names."""

from __future__ import annotations

import inspect
from collections.abc import Iterable
from typing import Any

import numpy as np
from google.protobuf import json_format
from google.protobuf.message import Message

from polyest._table import Floats

# Whether fields that are empty or 0 are printed, too; protobuf 5 has given the option a new name.
_ALL_FIELDS = {name: True for name in ("including_default_value_fields",
                                       "always_print_fields_with_no_presence")
               if name in inspect.signature(json_format.MessageToDict).parameters}


def to_dict(message: Message) -> dict[str, Any]:
    """Returns a message as JSON has it, with all of its fields, as the command prints them."""
    result: dict[str, Any] = json_format.MessageToDict(message, **_ALL_FIELDS)
    return result


def array(values: Iterable[float], *shape: int) -> Floats:
    """Returns a repeated field as an array, with a shape if one is given."""
    result: Floats = np.fromiter(values, dtype=np.float64)
    return result.reshape(shape) if shape else result


def enum_name(message: Any, field: str) -> str:
    """Returns the name of an enumerator, such as "IDENTIFIED", or an unknown one's number."""
    return enumerator_name(message, field, getattr(message, field))


def enumerator_name(message: Any, field: str, number: int) -> str:
    """Returns the name of an enumerator of the type that a field has, or an unknown one's number."""
    values = message.DESCRIPTOR.fields_by_name[field].enum_type.values_by_number
    return str(values[number].name) if number in values else str(number)
