"""Reads units as the command `polyest` does, as far as a column's role depends on them.

The daemon converts values. Symbols, prefixes and spellings are those of core/model/units.cc and
core/model/unit_conversion.cc; a test compares them.
"""

from __future__ import annotations

import math
import re
from typing import Optional

#: A product of powers of m, kg, s, A, K, mol and cd.
Dimension = tuple[float, ...]

# The powers of each symbol.
SYMBOLS: dict[str, Dimension] = {
    "m": (1, 0, 0, 0, 0, 0, 0), "g": (0, 1, 0, 0, 0, 0, 0), "s": (0, 0, 1, 0, 0, 0, 0),
    "A": (0, 0, 0, 1, 0, 0, 0), "K": (0, 0, 0, 0, 1, 0, 0), "mol": (0, 0, 0, 0, 0, 1, 0),
    "cd": (0, 0, 0, 0, 0, 0, 1), "rad": (0, 0, 0, 0, 0, 0, 0), "sr": (0, 0, 0, 0, 0, 0, 0),
    "Hz": (0, 0, -1, 0, 0, 0, 0), "N": (1, 1, -2, 0, 0, 0, 0), "Pa": (-1, 1, -2, 0, 0, 0, 0),
    "J": (2, 1, -2, 0, 0, 0, 0), "W": (2, 1, -3, 0, 0, 0, 0), "C": (0, 0, 1, 1, 0, 0, 0),
    "V": (2, 1, -3, -1, 0, 0, 0), "F": (-2, -1, 4, 2, 0, 0, 0), "Ohm": (2, 1, -3, -2, 0, 0, 0),
    "Ω": (2, 1, -3, -2, 0, 0, 0), "S": (-2, -1, 3, 2, 0, 0, 0), "Wb": (2, 1, -2, -1, 0, 0, 0),
    "T": (0, 1, -2, -1, 0, 0, 0), "H": (2, 1, -2, -2, 0, 0, 0), "lm": (0, 0, 0, 0, 0, 0, 1),
    "lx": (-2, 0, 0, 0, 0, 0, 1), "deg": (0, 0, 0, 0, 0, 0, 0), "rpm": (0, 0, -1, 0, 0, 0, 0),
    "min": (0, 0, 1, 0, 0, 0, 0), "h": (0, 0, 1, 0, 0, 0, 0), "l": (3, 0, 0, 0, 0, 0, 0),
    "L": (3, 0, 0, 0, 0, 0, 0), "t": (0, 1, 0, 0, 0, 0, 0), "bar": (-1, 1, -2, 0, 0, 0, 0),
    "%": (0, 0, 0, 0, 0, 0, 0), "°": (0, 0, 0, 0, 0, 0, 0), "gn": (1, 0, -2, 0, 0, 0, 0),
    "in": (1, 0, 0, 0, 0, 0, 0), "ft": (1, 0, 0, 0, 0, 0, 0), "mph": (1, 0, -1, 0, 0, 0, 0),
    "lb": (0, 1, 0, 0, 0, 0, 0), "lbf": (1, 1, -2, 0, 0, 0, 0), "kgf": (1, 1, -2, 0, 0, 0, 0),
    "psi": (-1, 1, -2, 0, 0, 0, 0),
}
#: The symbols without prefixes.
WHOLE = frozenset(("sr", "deg", "rpm", "min", "h", "%", "°", "in", "ft", "mph", "lb", "lbf", "kgf",
                   "psi"))
PREFIXES = ("da", "T", "G", "M", "k", "h", "d", "c", "m", "µ", "μ", "u", "n", "p")
#: Spellings in files of measurements that are no units of their own.
SPELLINGS = {
    "-": "1", "sec": "s", "secs": "s", "second": "s", "seconds": "s", "Sekunden": "s",
    "msec": "ms", "milliseconds": "ms", "usec": "us", "degree": "deg", "degrees": "deg",
    "Grad": "deg", "U/min": "1/min", "kph": "km/h", "kmh": "km/h", "deg/sec": "deg/s",
    "Grad/s": "deg/s", "Nm": "N m", "kNm": "kN m", "Nmm": "N mm", "Ns/m": "N s/m", "inch": "in",
    "inches": "in", "feet": "ft", "lbs": "lb",
}
CELSIUS = ("°C", "℃", "deg C", "degC", "° C", "Celsius")

_MAX_TEXT = 200  # bytes
_MAX_GROUPS = 10
_NONE: Dimension = (0, 0, 0, 0, 0, 0, 0)
_EXPONENTS: dict[str, float] = {"²": 2, "³": 3, "⁻¹": -1, "⁻²": -2, "⁻³": -3}
_NUMBER = re.compile(r"-?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_SPACE = re.compile(r"[ \t]*")
# One digit behind a symbol or a group, as in m/s2 or s-1.
_PLAIN = re.compile(r"(?<!\d)(?:[2-9]|-[1-9])(?=\Z|[ \t*/)·])", re.ASCII)
_END = re.compile(r"[ \t*/^()·²³⁻]")


def dimension(unit: str) -> Optional[Dimension]:
    """Returns the dimension of a unit as files of measurements write it; None: it is no unit."""
    unit = "K" if unit in CELSIUS else SPELLINGS.get(unit, unit)
    if len(unit.encode("utf-8", "replace")) > _MAX_TEXT:
        return None
    try:
        return _Reader(unit).read()
    except ValueError:
        return None


class _Reader:
    """Reads products, powers and groups. Raises ValueError for what is no unit."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0

    def read(self) -> Dimension:
        found = self._product(0)
        if self._at < len(self._text):
            raise ValueError
        return found

    def _take(self, *words: str) -> bool:
        word = next((one for one in words if self._text.startswith(one, self._at)), "")
        self._at += len(word)
        return bool(word)

    def _skip(self) -> None:
        match = _SPACE.match(self._text, self._at)
        self._at = self._at if match is None else match.end()

    def _product(self, groups: int) -> Dimension:
        self._skip()
        found = self._factor(groups)
        while True:
            self._skip()
            if self._at == len(self._text) or self._text[self._at] == ")":
                return found
            sign = -1 if self._take("/") else 1
            if sign > 0:
                self._take("*", "·")
            self._skip()
            found = tuple(a + sign * b for a, b in zip(found, self._factor(groups)))

    def _factor(self, groups: int) -> Dimension:
        if self._take("("):
            if groups == _MAX_GROUPS:
                raise ValueError
            found = self._product(groups + 1)
            if not self._take(")"):
                raise ValueError
        else:
            found = self._symbol()
        exponent = self._exponent()
        return tuple(power * exponent for power in found)

    def _exponent(self) -> float:
        for word, exponent in _EXPONENTS.items():
            if self._take(word):
                return exponent
        plain = _PLAIN.match(self._text, self._at) if self._at > 0 else None
        if plain is not None:
            self._at = plain.end()
            return int(plain[0])
        if not self._take("^", "**"):
            return 1
        exponent = self._number()
        if abs(exponent) > 100:
            raise ValueError
        return exponent

    def _number(self) -> float:
        match = _NUMBER.match(self._text, self._at)
        if match is None:
            raise ValueError
        self._at = match.end()
        number = float(match[0])
        if not math.isfinite(number):
            raise ValueError
        return number

    def _symbol(self) -> Dimension:
        if self._text[self._at:self._at + 1] in tuple("0123456789"):
            if self._number() <= 0:
                raise ValueError
            return _NONE
        end = self._at
        while end < len(self._text) and not _END.match(self._text, end) and not (
                end > 0 and _PLAIN.match(self._text, end)):
            end += 1
        name = self._text[self._at:end]
        self._at = end
        for prefix in ("", *PREFIXES):
            symbol = name[len(prefix):]
            if name.startswith(prefix) and symbol in SYMBOLS and not (prefix and symbol in WHOLE):
                return SYMBOLS[symbol]
        raise ValueError
