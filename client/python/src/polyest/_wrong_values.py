"""Finds a value that a message cannot take, and says in plain words what it must be.

The rules and their words are those of the command `polyest`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any, Optional

from google.protobuf.descriptor import Descriptor, EnumDescriptor, FieldDescriptor

_WHOLE = {FieldDescriptor.CPPTYPE_INT32: 31, FieldDescriptor.CPPTYPE_INT64: 63}
_REAL = (FieldDescriptor.CPPTYPE_DOUBLE, FieldDescriptor.CPPTYPE_FLOAT)


def find(document: Mapping[str, Any], message: Descriptor,
         prefix: str = "") -> Optional[tuple[str, str]]:
    """Returns the path of the first wrong value and the rule with the value; None: there is none.

    Fields that the message lacks are passed over.
    """
    given: dict[str, str] = {}
    for name, value in sorted(document.items()):
        field = message.fields_by_camelcase_name.get(name) or message.fields_by_name.get(name)
        if field is None or (value is None and _may_be_null(field)):
            continue
        choice = field.containing_oneof
        if choice is not None and len(choice.fields) > 1:
            first = given.setdefault(choice.name, name)
            if first != name:
                names = ", ".join(_name(one) for one in choice.fields)
                return prefix, f"{first} and {name} are both given; only one of {names} may be"
        found = _field(value, field, f"{prefix}.{name}" if prefix else name)
        if found is not None:
            return found
    return None


def is_repeated(field: FieldDescriptor) -> bool:
    """Whether a field is a list or a map. Versions of protobuf differ in how they say it."""
    if hasattr(field, "is_repeated"):
        return bool(field.is_repeated)
    return bool(field.label == FieldDescriptor.LABEL_REPEATED)


def _may_be_null(field: FieldDescriptor) -> bool:
    """Whether null stands for a field that is not given. In place of a number it is a lost one."""
    return is_repeated(field) or field.message_type is not None


def _name(field: FieldDescriptor) -> str:
    name: str = field.camelcase_name
    return name


def _field(value: Any, field: FieldDescriptor, path: str) -> Optional[tuple[str, str]]:
    entry = field.message_type
    if entry is not None and entry.GetOptions().map_entry:
        if not isinstance(value, Mapping):
            return path, f"{_shown(value)} must be an object, in braces {{ }}"
        parts = [(f"{path}.{name}", part) for name, part in sorted(value.items())]
        field = entry.fields_by_name["value"]
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
        if isinstance(value, float) and not math.isfinite(value):
            return "a finite number"
        return "" if number is not None else "a number"
    if kind == FieldDescriptor.CPPTYPE_BOOL:
        return "" if isinstance(value, bool) or value in ("true", "false") else "true or false"
    if kind == FieldDescriptor.CPPTYPE_ENUM:
        return _rule_of_enum(value, field.enum_type)
    return "" if isinstance(value, str) else "a text in quotes"


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
        text = json.dumps(value, ensure_ascii=False)
    except (TypeError, ValueError):
        text = repr(value)
    return text if len(text) <= 62 else "a long text"
