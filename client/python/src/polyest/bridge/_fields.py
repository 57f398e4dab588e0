"""Takes a configuration apart, field by field, with messages that name the field."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Optional

from polyest._table import refuse
from polyest.io._choices import nearest

_KINDS = {str: "text", float: "a number", bool: "true or false", dict: "a table", list: "a list"}


class Fields:
    """The fields of a table. Each is taken once; `end` refuses those that are left."""

    def __init__(self, place: str, values: Any) -> None:
        """`place` is the table's own name; empty for the whole."""
        if not isinstance(values, Mapping):
            raise refuse(place or "configuration", "must be a table")
        self._place = place
        self._left = dict(values)
        self._known: list[str] = []

    def place(self, name: str) -> str:
        """Returns the full name of a field."""
        return f"{self._place}.{name}" if self._place else name

    def _take(self, name: str, kind: type, default: Any) -> Any:
        self._known.append(name)
        if name not in self._left:
            if default is None:
                raise refuse(self.place(name), "is required")
            return default
        value = self._left.pop(name)
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if not isinstance(value, kind):
            raise refuse(self.place(name), f"must be {_KINDS[kind]}; got {value!r}")
        return value

    def text(self, name: str, default: Optional[str] = None) -> str:
        """Takes a text. Without a default it is required, and not empty."""
        value: str = self._take(name, str, default)
        if default is None and not value:
            raise refuse(self.place(name), "must not be empty")
        return value

    def choice(self, name: str, words: Sequence[str]) -> str:
        """Takes one of some words. Required."""
        value = self.text(name)
        if value not in words:
            raise refuse(self.place(name), f"must be one of {', '.join(words)}; got '{value}'")
        return value

    def number(self, name: str, default: float, *, lowest: float, above: bool = False) -> float:
        """Takes a number, at or (`above`) above the lowest."""
        value: float = self._take(name, float, default)
        if not math.isfinite(value) or value < lowest or (above and value == lowest):
            raise refuse(self.place(name), f"must be {'>' if above else '≥'} {lowest:g}; "
                         f"got {value:g}")
        return value

    def whole(self, name: str, default: int, lowest: int) -> int:
        """Takes a whole number."""
        value = self.number(name, float(default), lowest=lowest)
        if value != int(value):
            raise refuse(self.place(name), f"must be a whole number; got {value:g}")
        return int(value)

    def flag(self, name: str, default: bool) -> bool:
        """Takes true or false."""
        value: bool = self._take(name, bool, default)
        return value

    def table(self, name: str, *, required: bool = False) -> dict[str, Any]:
        """Takes a table; an empty one by default."""
        value: dict[str, Any] = self._take(name, dict, None if required else {})
        return value

    def tables(self, name: str) -> list[Any]:
        """Takes a list of tables; an empty one by default."""
        value: list[Any] = self._take(name, list, [])
        return value

    def end(self) -> None:
        """Raises InvalidInput if a field is left, with the names that may be meant."""
        for name in self._left:
            near = nearest(name, self._known)
            raise refuse(self.place(name), "is not known; "
                         + (f"do you mean {' or '.join(near)}?" if near
                            else f"known are {', '.join(sorted(self._known))}"))
