"""Reads JSON, and refuses an object that has a name twice: Python would keep the last value."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Optional


class GivenTwice(ValueError):
    """An object has a name twice."""

    def __init__(self, field: str) -> None:
        super().__init__(f"{field}: given twice")
        #: The path of the name, as in "uncertain[0].uniform.lower".
        self.field = field


def loads(text: str) -> Any:
    """Returns what a text holds. Raises ValueError if it is not JSON, GivenTwice for a name."""
    repeated: list[tuple[dict[str, Any], str]] = []

    def made(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            repeated.append((found, next(name for name in names if names.count(name) > 1)))
        return found

    document = json.loads(text, object_pairs_hook=made)
    if repeated:
        # Objects end from the inside out, so that the last of these is in no value that was lost.
        place, name = repeated[-1]
        raise GivenTwice(f"{_path(document, place) or ''}.{name}".lstrip("."))
    return document


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
