"""Finds what a caller names, proposes what may have been meant, and asks for missing packages."""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Iterable, Mapping
from typing import Any, Optional

from polyest._request import texts
from polyest._table import refuse
from polyest.errors import InvalidInput


def needed(module: str, extra: str) -> Any:
    """Imports a package of an extra. Raises ImportError that names pip's command."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise ImportError(f"polyest[{extra}] needs the package {package} ({error}); "
                          f"install it with: python3 -m pip install 'polyest[{extra}]'",
                          name=module) from error


def unknown(field: str, what: str, name: str, known: Iterable[str]) -> InvalidInput:
    """Returns the exception for a name that does not exist, with the nearest that do."""
    names = list(dict.fromkeys(known))
    near = nearest(name, names)
    if near:
        hint = f"the nearest are {', '.join(map(repr, near))}"
    elif names:
        shown = ", ".join(map(repr, names[:10]))
        hint = f"there are {shown}" + (f" and {len(names) - 10} more" if len(names) > 10 else "")
    else:
        hint = "there are none"
    return refuse(field, f"there is no {what} '{name}'; {hint}")


def nearest(name: str, names: Iterable[str], count: int = 5) -> list[str]:
    """Returns the names that are most alike, whole or in their last part, whatever their case."""
    last = _last(name)

    def likeness(other: str) -> float:
        whole = difflib.SequenceMatcher(None, name.lower(), other.lower()).ratio()
        part = difflib.SequenceMatcher(None, last, _last(other)).ratio()
        return max(whole, part)

    rated = sorted(((likeness(other), other) for other in names), key=lambda one: -one[0])
    return [other for rating, other in rated if rating >= 0.6][:count]


def _last(name: str) -> str:
    return name.lower().replace("/", ".").rpartition(".")[2]


def check_channels(channels: Mapping[str, Any]) -> None:
    """Raises InvalidInput unless there is a mapping from the problem's names."""
    if not isinstance(channels, Mapping) or not channels:
        raise refuse("channels", "must map the problem's names to the file's, as in "
                     "{'x': 'SUSP.defl'}")
    for name in channels:
        if name in ("t", "run") or not isinstance(name, str) or not name:
            raise refuse(f"channels.{name}", "is no output and no input; times are the file's own")


def units_of(found: Mapping[str, str], given: Optional[Mapping[str, str]]) -> dict[str, str]:
    """Returns each channel's unit: the given one, else the file's in the daemon's spelling."""
    own = texts("units", given)
    for name in own:
        if name not in found:
            raise unknown("units", "channel", name, found)
    return {name: own.get(name, spelled(unit)) for name, unit in found.items()}


# How measuring systems write units, and how the daemon does.
_SPELLINGS = {"-": "1", "[-]": "1", "none": "1", "1/min": "rpm", "U/min": "rpm", "Nm": "N m",
              "kNm": "kN m", "Ns/m": "N s/m", "kph": "km/h", "kmh": "km/h", "deg/sec": "deg/s",
              "sec": "s", "m/s2": "m/s^2", "m/s**2": "m/s^2", "rad/s2": "rad/s^2"}


def spelled(unit: str) -> str:
    """Returns a file's unit as the daemon writes it; one that is not known here stays."""
    stripped = unit.strip()
    return _SPELLINGS.get(stripped, stripped)
