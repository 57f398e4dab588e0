"""Which columns may be the time: the rule of the command `polyest` (client/cpp/data).

A test compares both.
"""

from __future__ import annotations

from typing import Optional

from polyest._units import SYMBOLS, dimension

#: The usual names of a time, in any case, but for T, which is a temperature.
NAMES = (
    "t", "time", "timestamp", "time stamp", "datetime", "date/time", "date time", "zeit",
    "zeitstempel", "zeitpunkt", "uhrzeit", "datum/zeit", "datum zeit", "messzeit", "temps",
    "horodatage", "tiempo", "tempo", "tid", "tijd", "czas", "elapsed", "elapsed time",
    "elapsed_time", "time_stamp", "date_time")
#: Units of a time behind its name, as in "t_ms".
ENDINGS = ("_s", "_ms", "_us", "_ns", "_min")


def may_be_time(header: str) -> bool:
    """Whether a column may be the time: it has a usual name, and no unit of another quantity."""
    name, unit = parts_of(header)
    return _is_usual(name) and not _is_unit_of_another(unit)


def parts_of(header: str) -> tuple[str, str]:
    """Returns a header's name and unit; an empty unit if it has none.

    A unit is in square brackets at its end; in parentheses, after "/" or after " in " if it can be
    read as one. The unit of a time may also be an ending: "t_ms", "time_s".
    """
    whole = header.strip()
    parts = _bracketed(whole, "[", "]") or _bracketed(whole, "(", ")")
    if parts is not None and (whole[-1] == "]" or dimension(parts[1]) is not None):
        return parts
    return _separated(whole) or _ended(whole) or (whole, "")


def _is_usual(name: str) -> bool:
    return name != "T" and name.isascii() and name.lower() in NAMES


def _is_unit_of_another(unit: str) -> bool:
    """Whether a text is a unit, but not of a time. "hh:mm:ss" and "UTC" are no units."""
    found = dimension(unit)
    return found is not None and any(abs(a - b) > 1e-9 for a, b in zip(found, SYMBOLS["s"]))


def _bracketed(header: str, opening: str, closing: str) -> Optional[tuple[str, str]]:
    """Parts "name [unit]", and "v / (m/s)" as ISO 80000 writes a unit that is a fraction."""
    begin = header.rfind(opening)
    if not header.endswith(closing) or begin < 0:
        return None
    name, unit = header[:begin].strip(), header[begin + 1:-1].strip()
    name = name[:-1].strip() if name.endswith("/") else name
    return (name, unit) if name else None


def _separated(header: str) -> Optional[tuple[str, str]]:
    """Parts "name / unit" and "name/unit", as standards write axes and tables, and "name in unit"."""
    for separator in (" / ", "/", " in "):
        name, found, unit = header.partition(separator)
        if found and name.strip() and dimension(unit.strip()) is not None:
            return name.strip(), unit.strip()
    return None


def _ended(header: str) -> Optional[tuple[str, str]]:
    for ending in ENDINGS:
        if header.endswith(ending) and _is_usual(header[:-len(ending)]):
            return header[:-len(ending)], ending[1:]
    return None
