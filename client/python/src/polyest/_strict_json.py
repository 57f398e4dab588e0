"""Reads JSON as the standard (RFC 8259) has it, and says where and why a text is none."""

from __future__ import annotations

import json
import math
import re
from typing import Any, NoReturn, Union

from polyest._json_scan import MAX_DEPTH, JsonError, first_error

__all__ = ["MAX_DEPTH", "JsonError", "loads"]

# An escape that is a half of a character: Python reads one without the other, too.
_HALF = re.compile(r"\\u[dD][89a-fA-F]")


def loads(text: Union[str, bytes]) -> Any:
    """Returns what a text holds. Raises JsonError if it is not JSON or has a name twice."""
    if isinstance(text, bytes):
        text = _decoded(text)
    try:
        document = json.loads(text, object_pairs_hook=_once, parse_constant=_refuse)
        good = not _needs_scan(document) and _HALF.search(text) is None
    except (ValueError, RecursionError):
        good = False
    if good:
        return document
    error = first_error(text)
    if error is not None:
        raise error
    return document


def _needs_scan(document: Any) -> bool:
    """Whether a document has what Python's reader takes: deep nests, lost and too large numbers."""
    level = [document]
    for _ in range(MAX_DEPTH + 1):
        level = [part for part in level if isinstance(part, (dict, list))]
        if not level:
            return False
        if any(None in part for part in level if isinstance(part, list)):
            return True
        level = [part for one in level for part in (one.values() if isinstance(one, dict) else one)]
        if math.inf in level or -math.inf in level:
            return True
    return True


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError
    return found


def _refuse(_: str) -> NoReturn:
    raise ValueError


def _decoded(data: bytes) -> str:
    """Returns a text without the mark of UTF-8 that some editors write."""
    data = data[3:] if data.startswith(b"\xef\xbb\xbf") else data
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        before = data[:error.start].decode()
        raise JsonError(before, len(before), f"the byte 0x{data[error.start]:02X} is no UTF-8, in "
                        "which JSON is written") from None
