"""Which columns may be the time, as for the command `polyest`, and the units of times."""

from __future__ import annotations

import re
from typing import Optional

#: The usual names of a time, in any case, but for T, which is a temperature.
NAMES = (
    "t", "time", "timestamp", "time stamp", "datetime", "date/time", "date time", "zeit",
    "zeitstempel", "zeitpunkt", "uhrzeit", "datum/zeit", "datum zeit", "messzeit", "temps",
    "horodatage", "tiempo", "tempo", "tid", "tijd", "czas", "elapsed", "elapsed time",
    "elapsed_time", "time_stamp", "date_time")
#: Units of a time behind its name, as in "t_ms".
ENDINGS = ("_s", "_ms", "_us", "_ns", "_min")

# Seconds in each unit of time, and how measuring systems spell the units.
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9, "min": 60.0,
           "h": 3600.0}
_SPELLINGS = {
    "s": ("sec", "secs", "second", "seconds", "sekunde", "sekunden"),
    "ms": ("msec", "msecs", "millisecond", "milliseconds", "millisekunden"),
    "us": ("usec", "usecs", "µsec", "μsec", "microsecond", "microseconds", "mikrosekunden"),
    "ns": ("nsec", "nsecs", "nanosecond", "nanoseconds", "nanosekunden"),
    "min": ("min", "mins", "minute", "minutes", "minuten"),
    "h": ("hr", "hrs", "hour", "hours", "std", "stunde", "stunden"),
}
# A name with its unit in brackets or, if it can be read as one, in parentheses, behind a slash or
# behind "in".
_UNIT = re.compile(r"(?P<name>.*?)\s*(?:/?\s*\[(?P<bracketed>[^\]]*)\]|/?\s*\((?P<a>[^)]*)\)"
                   r"|/\s*(?P<b>\S+)|\sin\s+(?P<c>\S+))")
# What stands in brackets in place of a unit: how a time of day is written, or its zone.
_CLOCK = re.compile(r"|.*:.*|utc|gmt", re.IGNORECASE)


def seconds_of(unit: str) -> Optional[float]:
    """Returns the length of a unit of time, s; "" is the second; None: it is no unit of time.

    Words may have any case, and symbols capitals throughout: "Ms" is no ms.
    """
    given = unit.strip() or "s"
    symbol = given.lower() if given.isupper() else given
    known = next((one for one, words in _SPELLINGS.items() if given.lower() in words), symbol)
    return SECONDS.get(known)


def may_be_time(header: str) -> bool:
    """Whether a column may be the time: it has a usual name, and no unit of another quantity."""
    name, unit = parts_of(header)
    return _is_usual(name) and (_CLOCK.fullmatch(unit) or seconds_of(unit)) is not None


def parts_of(header: str) -> tuple[str, str]:
    """Returns the name and the unit of a column that may be the time; "" is no unit."""
    whole = header.strip()
    if _is_usual(whole):
        return whole, ""  # as "date/time"
    for ending in ENDINGS:
        if whole.endswith(ending) and _is_usual(whole[:-len(ending)]):
            return whole[:-len(ending)], ending[1:]
    match = _UNIT.fullmatch(whole)
    if match is None:
        return whole, ""
    if match["bracketed"] is not None:
        return match["name"], match["bracketed"].strip()
    unit = (match["a"] or match["b"] or match["c"] or "").strip()
    return (whole, "") if seconds_of(unit) is None else (match["name"], unit)


def _is_usual(name: str) -> bool:
    return name != "T" and name.isascii() and name.lower() in NAMES
