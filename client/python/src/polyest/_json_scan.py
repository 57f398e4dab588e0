"""Finds the first place at which a text is no JSON, in the words of the command `polyest`.

Python's own reader is faster and says the same of good texts. Its words for bad ones differ from
version to version.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Optional

#: How deep objects and arrays may be in one another.
MAX_DEPTH = 100

_SPACE = re.compile(r"[ \t\n\r]*")
_WORD = re.compile(r"[0-9A-Za-z_$+.\-\u0080-\U0010ffff]*")
_NUMBER = re.compile(r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")
_PLAIN = re.compile(r'[^"\\\x00-\x1f]*')
_HEX = re.compile(r"\\u([0-9a-fA-F]{4})")
_MAX_SHOWN = 60


class JsonError(ValueError):
    """A text is no JSON at a place, or an object has a name twice."""

    def __init__(self, text: str, at: int, rule: str, path: str = "") -> None:
        super().__init__(f"{path}: {rule}" if path else rule)
        #: Line and column of the place, in characters, from 1.
        self.line, self.column = text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)
        #: The path of the name that is given twice, as in "uncertain[0].uniform.lower".
        self.field = path
        #: What is wrong there.
        self.rule = rule


@dataclass
class _Open:
    """An object or an array that is open."""

    at: int
    closing: str
    names: set[str] = field(default_factory=set)
    name: str = ""  # of the field whose value is being read
    index: int = 0  # of the element that is being read


def first_error(text: str) -> Optional[JsonError]:
    """Returns the first error of a text; None: it is JSON."""
    try:
        _Scan(text).run()
    except JsonError as error:
        return error
    return None


def _shown(text: str) -> str:
    """Returns a part of the text for a message, the beginning of a long one."""
    beginning = text.encode("utf-8", "replace")[:_MAX_SHOWN].decode("utf-8", "ignore")
    escapes = {"\\": "\\\\", '"': '\\"', "'": "\\'", "\n": "\\n", "\r": "\\r", "\t": "\\t"}
    said = "".join(escapes.get(sign, sign if sign >= " " and sign != "\x7f"
                               else f"\\x{ord(sign):02x}") for sign in beginning)
    return said + "…" * (len(beginning) < len(text))


class _Scan:
    """Reads a text token by token. `_next` is what may come: a value, a name, a colon, …"""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._comma = 0
        self._next = "value"
        self._may_end = False  # whether an object or an array that has just begun may end
        self._open: list[_Open] = []

    def run(self) -> None:
        """Raises JsonError for the first error."""
        while True:
            self._at = self._behind(_SPACE)
            if self._at == len(self._text):
                break
            sign = self._text[self._at]
            if sign in "{[":
                self._begin(sign)
            elif sign in "}]":
                self._end(sign)
            elif sign == ",":
                self._separate()
            elif sign == ":":
                self._expect(self._next == "colon")
                self._next = "value"
                self._at += 1
            elif sign == '"':
                self._take_text()
            else:
                self._take_word()
        if self._next == "nothing":
            return
        if not self._open:
            raise self._error("a JSON object must stand here")
        last = self._open[-1]
        bracket = self._error("", last.at)
        raise self._error(f"the text ends before the {self._text[last.at]} of line {bracket.line}, "
                          f"column {bracket.column} is closed")

    def _behind(self, pattern: re.Pattern[str]) -> int:
        match = pattern.match(self._text, self._at)
        return self._at if match is None else match.end()

    def _error(self, rule: str, at: Optional[int] = None, path: str = "") -> JsonError:
        return JsonError(self._text, self._at if at is None else at, rule, path)

    def _end_value(self) -> None:
        self._next = "comma" if self._open else "nothing"
        self._may_end = bool(self._open)

    def _begin(self, sign: str) -> None:
        self._expect(self._next == "value")
        if len(self._open) == MAX_DEPTH:
            raise self._error(f"brackets are nested more than {MAX_DEPTH} deep")
        self._open.append(_Open(self._at, "}" if sign == "{" else "]"))
        self._next = "name" if sign == "{" else "value"
        self._may_end = True
        self._at += 1

    def _end(self, sign: str) -> None:
        self._expect(self._may_end and self._open[-1].closing == sign)
        self._open.pop()
        self._at += 1
        self._end_value()

    def _separate(self) -> None:
        self._expect(self._next == "comma")
        self._comma = self._at
        self._at += 1
        self._open[-1].index += 1
        self._next = "name" if self._open[-1].closing == "}" else "value"
        self._may_end = False

    def _take_text(self) -> None:
        self._expect(self._next in ("name", "value"))
        begin, end = self._at, self._end_of_text()
        self._at = end
        if self._next == "value":
            self._end_value()
            return
        last = self._open[-1]
        last.name = self._text[begin + 1:end - 1]
        if last.name in last.names:
            raise self._error("given twice", begin, self._path())
        last.names.add(last.name)
        self._next, self._may_end = "colon", False

    def _end_of_text(self) -> int:
        """Returns the place behind the closing quote. Raises JsonError."""
        begin = self._at
        at = begin + 1
        while True:
            plain = _PLAIN.match(self._text, at)
            at = at if plain is None else plain.end()
            sign = self._text[at:at + 1]
            if sign == '"':
                return at + 1
            if sign in ("", "\n", "\r"):
                raise self._error("the text that begins here has no closing quote on its line",
                                  begin)
            if sign != "\\":
                code = ord(sign)
                raise self._error(f"the control character U+{code:04X} must be written "
                                  f"\\u{code:04x}", at)
            at = self._end_of_escape(at)

    def _end_of_escape(self, at: int) -> int:
        sign = self._text[at + 1:at + 2]
        if sign and sign in '"\\/bfnrt':
            return at + 2
        if sign != "u":
            raise self._error(f"\\{_shown(sign)} is no escape of JSON; a backslash is written \\\\",
                              at)
        match = _HEX.match(self._text, at)
        if match is None:
            raise self._error("four hexadecimal digits must follow \\u", at)
        code = int(match[1], 16)
        if not 0xD800 <= code <= 0xDFFF:
            return match.end()
        other = _HEX.match(self._text, match.end())
        if code >= 0xDC00 or other is None or not 0xDC00 <= int(other[1], 16) <= 0xDFFF:
            raise self._error(f"\\u{code:04x} is one half of a character without the other", at)
        return other.end()

    def _take_word(self) -> None:
        word = self._text[self._at:self._behind(_WORD)]
        good = word in ("true", "false", "null") or _NUMBER.fullmatch(word) is not None
        self._expect(self._next == "value" and good)
        if word == "null" and self._open and self._open[-1].closing == "]":
            raise self._error("must be a value, not null", path=self._path())
        if _NUMBER.fullmatch(word) and float(word) in (float("inf"), -float("inf")):
            raise self._error(f"{_shown(word)} is beyond the range of a number")
        self._at += len(word)
        self._end_value()

    def _expect(self, right: bool) -> None:
        """Raises JsonError for the token that stands here unless it is right."""
        if right:
            return
        sign, pair = self._text[self._at], self._text[self._at:self._at + 2]
        if sign == "'":
            raise self._error("names and texts stand in double quotes, not in single ones")
        if sign == "#" or pair in ("//", "/*"):
            raise self._error("JSON has no comments")
        in_array = bool(self._open) and self._open[-1].closing == "]"
        after_comma = not self._may_end and (self._next == "name"
                                             or (self._next == "value" and in_array))
        if after_comma and sign in "}]":
            raise self._error("no comma may follow the last value", self._comma)
        raise self._error(self._rule())

    def _token(self) -> str:
        """Returns the token that stands here for a message, a text with its quotes."""
        word = self._text[self._at:self._behind(_WORD)]
        if word or self._text[self._at] != '"':
            return _shown(word or self._text[self._at])
        try:
            return f'"{_shown(self._text[self._at + 1:self._end_of_text() - 1])}"'
        except JsonError:
            return '"'

    def _rule(self) -> str:
        """Returns what must be here in place of the token."""
        token, is_word = self._token(), self._behind(_WORD) > self._at
        if self._next == "name":
            return (f"the name {token} must stand in double quotes" if is_word
                    else f"a name in double quotes must stand here, not {token}")
        if self._next == "colon":
            return f'a colon must follow the name "{_shown(self._open[-1].name)}", not {token}'
        if self._next == "comma":
            return f"a comma or {self._open[-1].closing} must stand before {token}"
        if self._next == "nothing":
            return f"nothing may follow the end of the JSON text, but {token} does"
        if not is_word:
            return f"a value must stand here, not {token}"
        if token[0] in "+-.0123456789":
            return f"{token} is no number of JSON"
        return (f"{token} is no value of JSON, which has numbers, true, false, null, texts in "
                "double quotes, [ ] and { }")

    def _path(self) -> str:
        """Returns where the scan is: "uncertain[0].uniform.lower"."""
        path = ""
        for one in self._open:
            if one.closing == "]":
                path += f"[{one.index}]"
            else:
                path += ("." if path else "") + _shown(one.name)
        return path
