"""Parses JSON objects into messages, and says in plain words which field is wrong."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Optional

from google.protobuf import json_format
from google.protobuf.message import Message

from polyest import _wrong_values
from polyest.errors import InvalidInput

# Where protobuf says that a field is wrong: with quotes or, in older versions, without.
_PLACE = re.compile(r'at "?Problem\.?((?:\w+(?:\[[^\]]*\])?\.?)*)')
_PARENT = re.compile(r"Failed to parse (\w+) field: ")
_UNKNOWN = re.compile(r'no field named "([^"]*)"')


def parse(document: Mapping[str, Any], message: Message, place: str = "",
          prefix: str = "") -> None:
    """Fills a message from a JSON object.

    place: how the sentence of an error begins, as with a file's name. prefix: the path of the
    message itself. Raises InvalidInput for a field that it lacks and a value that it cannot take.
    """
    failure: Optional[json_format.ParseError] = None
    try:
        json_format.ParseDict(document, message)
    except json_format.ParseError as error:
        failure = error
    if failure is None or _UNKNOWN.search(str(failure)) is None:
        # Also where protobuf has taken all of it: for it, true is the number 1.
        wrong_value = _wrong_values.find(document, message.DESCRIPTOR, prefix)
        if wrong_value is not None:
            field, rule = wrong_value
            raise InvalidInput(f"{place}{field}: {rule}", field=field, rule=rule) from failure
    if failure is not None:
        field, rule = _refusal(str(failure))
        raise InvalidInput(f"{place}{failure}", field=field, rule=rule) from failure


def _refusal(sentence: str) -> tuple[str, str]:
    """Returns the field that a sentence of protobuf's is about, and the rule that it breaks."""
    place = _PLACE.search(sentence)
    field = place[1].rstrip(".") if place else ".".join(_PARENT.findall(sentence))
    unknown = _UNKNOWN.search(sentence)
    if unknown:
        return f"{field}.{unknown[1]}".lstrip("."), "is not a field"
    rule = _PARENT.split(sentence)[-1]
    return field, _PLACE.split(rule)[0].rstrip(" .")
