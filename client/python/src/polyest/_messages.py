"""Reads fields of messages as numpy arrays and names."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from polyest._table import Floats


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
