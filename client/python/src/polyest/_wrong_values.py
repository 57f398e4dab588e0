"""Finds a value that a message cannot take, and says in plain words what it must be.

The rules and their words are those of the command `polyest`.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Mapping
from typing import Any, Optional

from google.protobuf.descriptor import Descriptor, EnumDescriptor, FieldDescriptor

_WHOLE = {FieldDescriptor.CPPTYPE_INT32: 31, FieldDescriptor.CPPTYPE_INT64: 63}
_TEXT = "a text without halves of characters"
_REAL = (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT)


def find(document: Mapping[str, Any], message: Descriptor,
         prefix: str = "") -> Optional[tuple[str, str]]:
    """Returns the path of the first wrong value and the rule with the value; None: there is none.

    Fields that the message lacks are passed over.
    """
    given: dict[str, str] = {}
    names: dict[str, str] = {}
    for name, value in sorted(document.items()):
        field = field_named(message, name)
        if field is None or (value is None and _may_be_null(field)):
            continue
        same = names.setdefault(field.name, name)
        if same != name:
            return prefix, f"{same} and {name} are both given, which is one field"
        choice = field.containing_oneof
        if choice is not None and len(choice.fields) > 1:
            first = given.setdefault(choice.name, name)
            if first != name:
                those = ", ".join(_name(one) for one in choice.fields)
                return prefix, f"{first} and {name} are both given; only one of {those} may be"
        found = _field(value, field, f"{prefix}.{name}" if prefix else name)
        if found is not None:
            return found
    return None


@functools.lru_cache(maxsize=None)
def _names(message: Descriptor) -> dict[str, FieldDescriptor]:
    """Returns the fields by their names in JSON and in the contract."""
    return {**message.fields_by_name, **{_name(field): field for field in message.fields}}


def field_named(message: Descriptor, name: str) -> Optional[FieldDescriptor]:
    """Returns the field of a message that JSON calls `name`, or that the contract does."""
    return _names(message).get(name)


def names_of(message: Descriptor) -> list[str]:
    """Returns the names of a message's fields in JSON."""
    return [_name(field) for field in message.fields]


def is_map(field: FieldDescriptor) -> bool:
    """Whether a field is a map: an object whose names the user chooses."""
    entry = field.message_type
    return entry is not None and bool(entry.GetOptions().map_entry)


def is_repeated(field: FieldDescriptor) -> bool:
    """Whether a field is a list or a map. Versions of protobuf differ in how they say it."""
    if hasattr(field, "is_repeated"):
        return bool(field.is_repeated)
    return bool(field.label == FieldDescriptor.LABEL_REPEATED)


def _may_be_null(field: FieldDescriptor) -> bool:
    """Whether null stands for a field that is not given. In place of a number it is a lost one."""
    return is_repeated(field) or field.message_type is not None


def _name(field: FieldDescriptor) -> str:
    name: str = field.json_name
    return name


def _field(value: Any, field: FieldDescriptor, path: str) -> Optional[tuple[str, str]]:
    if is_map(field):
        if not isinstance(value, Mapping):
            return path, f"{_shown(value)} must be an object, in braces {{ }}"
        wrong = next((name for name in sorted(value) if not _is_text(name)), None)
        if wrong is not None:
            return path, f"{_shown(wrong)} must be {_TEXT}"
        parts = [(f"{path}.{name}", part) for name, part in sorted(value.items())]
        field = field.message_type.fields_by_name["value"]
    elif is_repeated(field):
        if not isinstance(value, (list, tuple)):
            return path, f"{_shown(value)} must be a list, in brackets [ ]"
        parts = [(f"{path}[{number}]", part) for number, part in enumerate(value)]
    else:
        parts = [(path, value)]
    checked = (_value(part, field, at) for at, part in parts)
    return next((one for one in checked if one is not None), None)


def _value(value: Any, field: FieldDescriptor, path: str) -> Optional[tuple[str, str]]:
    message = field.message_type
    if message is not None:
        if isinstance(value, Mapping):
            return find(value, message, path)
        special = message.full_name.startswith("google.protobuf.")
        return None if special else (path, f"{_shown(value)} must be an object, in braces {{ }}")
    rule = _rule(value, field)
    return (path, f"{_shown(value)} must be {rule}") if rule else None


def _number(value: Any) -> Optional[float]:
    """Returns the number that a value stands for; protobuf also takes "1.5", but not " 1.5"."""
    if isinstance(value, bool):
        return None
    if isinstance(value, str) and (value != value.strip() or "_" in value):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf
    except (TypeError, ValueError):
        return None


def _rule(value: Any, field: FieldDescriptor) -> str:
    """Returns what a value must be; an empty text if it is that."""
    kind = field.cpp_type
    number = _number(value)
    if kind in _WHOLE:
        if number is None or not math.isfinite(number) or number != math.floor(number):
            may_be_found = field.full_name == "polyest.v1.ExpansionOptions.order"
            named = may_be_found and isinstance(value, str)
            return 'a whole number or "AUTO"' if named else "a whole number"
        limit = _WHOLE[kind]
        return "" if -2.0**limit <= number < 2.0**limit else f"a whole number below 2^{limit}"
    if kind in _REAL:
        if number is not None and not isinstance(value, str) and not math.isfinite(number):
            return "a finite number"
        return "" if number is not None else "a number"
    if kind == FieldDescriptor.CPPTYPE_BOOL:
        return "" if isinstance(value, bool) or value in ("true", "false") else "true or false"
    if kind == FieldDescriptor.CPPTYPE_ENUM:
        return _rule_of_enum(value, field.enum_type)
    return "" if _is_text(value) else _TEXT if isinstance(value, str) else "a text in quotes"


def _is_text(value: Any) -> bool:
    """Whether a value is a text of whole characters, as messages have it."""
    return isinstance(value, str) and not any("\ud800" <= sign <= "\udfff" for sign in value)


def _rule_of_enum(value: Any, kind: EnumDescriptor) -> str:
    numbers = isinstance(value, int) and not isinstance(value, bool)
    if numbers or (isinstance(value, str) and value in kind.values_by_name):
        return ""
    return "one of " + ", ".join(name for name in kind.values_by_name
                                 if not name.endswith("UNSPECIFIED"))


def _shown(value: Any) -> str:
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, (list, tuple)):
        return "a list"
    try:
        text = json.dumps(value, ensure_ascii=isinstance(value, str) and not _is_text(value))
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 62 else f"a long {'number' if isinstance(value, int) else 'text'}"
