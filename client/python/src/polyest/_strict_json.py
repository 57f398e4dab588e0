"""Reads JSON as the standard (RFC 8259) has it, and says where and why a text is none."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any, NoReturn, Optional, Union

#: How deep objects and arrays may be in one another.
MAX_DEPTH = 100
_TOO_DEEP = f"brackets are nested more than {MAX_DEPTH} deep"


class JsonError(ValueError):
    """A text is no JSON, or one of its objects has a name twice."""

    def __init__(self, rule: str, *, field: str = "", place: str = "") -> None:
        super().__init__(f"{field}: {rule}" if field else rule)
        #: The path of the name that is given twice, as in "uncertain[0].uniform.lower".
        self.field = field
        #: What is wrong.
        self.rule = rule
        #: Line and column of the place, ":3:14"; empty if they are not known.
        self.place = place


def loads(data: Union[str, bytes]) -> Any:
    """Returns what a text holds. Raises JsonError if it is not JSON or has a name twice."""
    text = _decoded(data) if isinstance(data, bytes) else data
    repeated: list[tuple[dict[str, Any], str]] = []

    def made(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            repeated.append((found, next(name for name in names if names.count(name) > 1)))
        return found

    def refuse(name: str) -> NoReturn:
        match = re.search(rf"[:\[,]\s*({name})", text)
        raise JsonError(f"{name} is no number of JSON", place=_place(text, match.start(1))
                        if match else "")

    try:
        document = json.loads(text, object_pairs_hook=made, parse_constant=refuse)
    except json.JSONDecodeError as error:
        raise JsonError(error.msg, place=_place(text, error.pos)) from None
    except RecursionError:
        raise JsonError(_TOO_DEEP) from None
    if _is_deeper(document, MAX_DEPTH):
        raise JsonError(_TOO_DEEP)
    if repeated:
        # Objects end from the inside out, so that the last of these is in no value that was lost.
        place, name = repeated[-1]
        raise JsonError("given twice", field=f"{_path(document, place) or ''}.{name}".lstrip("."))
    return document


def _place(text: str, at: int) -> str:
    return f":{text.count(chr(10), 0, at) + 1}:{at - text.rfind(chr(10), 0, at)}"


def _is_deeper(document: Any, depth: int) -> bool:
    level = [document]
    for _ in range(depth + 1):
        level = [part for one in level if isinstance(one, (dict, list))
                 for part in ((one.values() if isinstance(one, dict) else one) or (None,))]
    return bool(level)


def _path(document: Any, wanted: dict[str, Any], path: str = "") -> Optional[str]:
    """Returns the path of an object in a document; None if it is not there."""
    if document is wanted:
        return path
    found = (_path(part, wanted, at) for at, part in _parts(document, path))
    return next((one for one in found if one is not None), None)


def _parts(document: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(document, dict):
        for name, part in document.items():
            yield f"{path}.{name}".lstrip("."), part
    elif isinstance(document, list):
        for number, part in enumerate(document):
            yield f"{path}[{number}]", part


def _decoded(data: bytes) -> str:
    """Returns a text without the mark of UTF-8 that some editors write."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[:error.start].decode()
        raise JsonError(f"the byte 0x{data[error.start]:02X} is no UTF-8, in which JSON is written",
                        place=_place(before, len(before))) from None
