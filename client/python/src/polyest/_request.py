"""Makes requests, and says which argument protobuf cannot take."""

from __future__ import annotations

import contextlib
import math
import operator
import re
from collections.abc import Iterator, Mapping
from re import Pattern
from typing import Any, TypeVar

import numpy as np
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.message import Message

from polyest._table import refuse
from polyest._wrong_values import is_repeated
from polyest.errors import PolyestError, WrongType

Request = TypeVar("Request", bound=Message)

# The arguments that fill fields of other names.
_ARGUMENTS = {
    "session_id": "name", "possible": "outputs",
    "draw_count": "draws", "max_row_count": "max_rows", "lag_count": "lags",
    "density_bin_count": "density_bins", "joint_bin_count": "joint_bins",
    "sample_count": "samples", "point_count": "points", "history_point_count": "points",
}

# The messages within requests whose fields are arguments, too.
_OF_ARGUMENTS = frozenset(("Session", "PredictionPolicy"))

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


def number(argument: str, value: Any, what: str = "a number") -> float:
    """Returns a number; True and False are none. Raises WrongType, which names the argument."""
    if not isinstance(value, (bool, np.bool_)):
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            return float(value)
    raise wrong(argument, value, what)


def at_least(argument: str, value: Any, least: float) -> float:
    """Returns a finite number that is not below a limit. Raises InvalidInput for another."""
    found = number(argument, value)
    if not (math.isfinite(found) and found >= least):
        raise refuse(argument, f"{value} must be a finite number ≥ {least:g}")
    return found


def whole(argument: str, value: Any, least: int) -> int:
    """Returns a whole number that is not below a limit. Raises InvalidInput for another."""
    if isinstance(value, (bool, np.bool_)) or not hasattr(value, "__index__"):
        raise wrong(argument, value, "a whole number")
    found = operator.index(value)
    if found < least:
        raise refuse(argument, f"{value} must be a whole number ≥ {least}")
    return found


def flag(argument: str, value: Any) -> bool:
    """Returns a truth value. Raises WrongType, which names the argument, for another."""
    if not isinstance(value, (bool, np.bool_)):
        raise wrong(argument, value, "True or False")
    return bool(value)


def numbers(argument: str, values: Any) -> Any:
    """Returns an array of numbers of any shape. Raises WrongType, which names the argument."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise wrong(argument, values, "numbers") from None


def pair(argument: str, values: tuple[Any, ...]) -> tuple[float, float]:
    """Returns two numbers, the bounds of something. Raises WrongType."""
    if len(values) != 2:
        raise wrong(argument, values, "a number, or two: the bounds of an unknown one")
    return number(argument, values[0]), number(argument, values[1])


def json_of(argument: str, value: Any, what: str) -> dict[str, Any]:
    """Returns the JSON object of a prior or a signal. Raises WrongType for anything else."""
    if isinstance(value, type) or not hasattr(value, "as_json"):
        raise wrong(argument, value, what)
    found: dict[str, Any] = value.as_json()
    return found


def mapping(argument: str, value: Any, what: str = "") -> dict[str, Any]:
    """Returns a mapping as a dict. Raises WrongType, which names the argument, for another."""
    if not isinstance(value, Mapping):
        raise wrong(argument, value, f"a dict{', ' * bool(what)}{what}")
    return dict(value)


def texts(argument: str, values: Any) -> dict[str, str]:
    """Returns a mapping from names to texts, as of units; None is empty. Raises WrongType."""
    found = {} if values is None else mapping(argument, values, "texts by name")
    for name, value in found.items():
        if not isinstance(value, str):
            raise wrong(f"{argument}.{name}", value, "a text")
    return found


def with_arguments(error: PolyestError, request: Descriptor) -> PolyestError:
    """Returns an error of the daemon that names fields of the request as its caller does.

    The daemon writes them as JSON has them, such as "drawCount" for the argument `draws`.
    """
    for pattern, argument in _named_otherwise(request):
        error.args = (pattern.sub(argument, error.message),)
        error.field, error.rule = (pattern.sub(argument, text)
                                   for text in (error.field, error.rule))
    return error


def _named_otherwise(request: Descriptor, parent: str = "") -> Iterator[tuple[Pattern[str], str]]:
    """Yields how the daemon names the fields whose arguments have other names, and these."""
    for field in request.fields:
        json_name = field.camelcase_name
        argument = _ARGUMENTS.get(field.name, field.name)
        if json_name == field.name != argument:  # a word that sentences may have, too
            yield re.compile(rf"^{json_name}\b"), argument
        elif json_name != argument:
            yield re.compile(rf"\b{parent}{json_name}\b"), argument
        inner = field.message_type
        if not parent and inner is not None and inner.name in _OF_ARGUMENTS:
            yield from _named_otherwise(inner, rf"(?:{json_name}\.)?")


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
    return is_repeated(field) and field.message_type is None


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
