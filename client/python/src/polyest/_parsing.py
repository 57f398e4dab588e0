"""Parses JSON objects into messages, and says in plain words which field is wrong."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Optional

from google.protobuf import json_format
from google.protobuf.message import Message

from polyest import _unknown_fields, _wrong_values
from polyest.errors import InvalidInput

# Where protobuf says that a field is wrong: with quotes or, in older versions, without.
_PLACE = re.compile(r'at "?Problem\.?((?:\w+(?:\[[^\]]*\])?\.?)*)')
_PARENT = re.compile(r"Failed to parse (\w+) field: ")


def parse(document: Mapping[str, Any], message: Message, place: str = "",
          prefix: str = "") -> None:
    """Fills a message from a JSON object.

    place: how the sentence of an error begins, as with a file's name. prefix: the path of the
    message itself. Raises InvalidInput for a field that it lacks and a value that it cannot take.
    """
    failure: Optional[Exception] = None
    try:
        json_format.ParseDict(document, message)
    except (json_format.ParseError, ArithmeticError, TypeError, ValueError) as error:
        failure = error
    if failure is not None:
        _refuse_unknown(document, message, place, prefix)
    # Also where protobuf has taken all of it: for it, true is the number 1.
    wrong_value = _wrong_values.find(document, message.DESCRIPTOR, prefix)
    if wrong_value is None and failure is not None:
        wrong_value = _refusal(str(failure))
    if wrong_value is not None:
        field, rule = wrong_value
        sentence = f"{field}: {rule}" if field else rule
        raise InvalidInput(place + sentence, field=field, rule=rule) from failure


def _refuse_unknown(document: Mapping[str, Any], message: Message, place: str,
                    prefix: str) -> None:
    """Raises InvalidInput if the message lacks fields of the document; names all of them."""
    found = list(_unknown_fields.find(document, message.DESCRIPTOR, prefix))
    if not found:
        return
    field, meant = found[0]
    rule = "unknown field" + (f"; {meant}" if meant else "")
    sentence = f"{field}: {rule}"
    if len(found) > 1:
        named = ", ".join(path + (f" ({one})" if one else "") for path, one in found)
        sentence = f"{len(found)} unknown fields: {named}"
    raise InvalidInput(place + sentence, field=field, rule=rule)


def _refusal(sentence: str) -> tuple[str, str]:
    """Returns the field that a sentence of protobuf's is about, and the rule that it breaks."""
    place = _PLACE.search(sentence)
    field = place[1].rstrip(".") if place else ".".join(_PARENT.findall(sentence))
    rule = _PARENT.split(sentence)[-1]
    return field, _PLACE.split(rule)[0].rstrip(" .")
