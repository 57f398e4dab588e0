"""Decodes the frames of a CAN bus by its database (DBC, ARXML, KCD, SYM)."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from typing import Any, Union

from polyest._table import refuse
from polyest.errors import InvalidInput
from polyest.io._choices import check_channels, needed, unknown

File = Union[str, "os.PathLike[str]"]

# What databases name the values by which a device says that it has none.
_NONE = re.compile(r"sna|n/?a|.*not[ _]?avail.*|invalid.*|(?!not?[ _]).*[ _]invalid|undefined.*|"
                   r"error|error[ _]indicator", re.IGNORECASE)


def load_database(database: Union[File, Any]) -> Any:
    """Returns a database of cantools from its file. Raises InvalidInput for one that is none."""
    cantools = needed("cantools", "can")
    if not isinstance(database, (str, os.PathLike)):
        return database
    name = os.fspath(database)
    try:
        found = cantools.database.load_file(name)
    except OSError as error:
        raise InvalidInput(f"{name}: cannot be opened: {error.strerror}") from error
    except (cantools.database.Error, UnicodeDecodeError, ValueError) as error:
        raise InvalidInput(f"{name}: is no CAN database: {error}") from error
    if not hasattr(found, "messages"):
        raise refuse(name, "is no CAN database")
    return found


def find_message(database: Any, field: str, name: str) -> Any:
    """Returns a message of a database. Raises InvalidInput, which lists the nearest names."""
    for message in database.messages:
        if message.name == name:
            return message
    raise unknown(field, "message", name, (one.name for one in database.messages))


def find_signal(database: Any, field: str, name: str) -> tuple[Any, Any]:
    """Returns a signal, `Message.Signal` or `Signal`, and its message. Raises InvalidInput."""
    pairs = [(message, signal) for message in database.messages for signal in message.signals]
    found = [(message, signal) for message, signal in pairs
             if name in (signal.name, f"{message.name}.{signal.name}")]
    if not found:
        raise unknown(field, "signal", name,
                      (f"{message.name}.{signal.name}" for message, signal in pairs))
    if len(found) > 1:
        raise refuse(field, f"{len(found)} messages have a signal '{name}': " + ", ".join(
            f"'{message.name}.{signal.name}'" for message, signal in found))
    return found[0]


class FrameDecoder:
    """Finds the values of some signals in frames. It counts frames that cannot be decoded."""

    def __init__(self, database: Any, channels: Mapping[str, str]) -> None:
        """`channels` has a signal for each of the problem's names. Raises InvalidInput."""
        check_channels(channels)
        #: The unit of each channel as the database writes it.
        self.units: dict[str, str] = {}
        #: Frames of the wanted messages whose data do not fit them.
        self.undecodable = 0
        self._wanted: dict[tuple[int, bool], tuple[Any, dict[str, Any]]] = {}
        for quantity, name in channels.items():
            message, signal = find_signal(database, f"channels.{quantity}", name)
            self.units[quantity] = signal.unit or ""
            key = message.frame_id, message.is_extended_frame
            self._wanted.setdefault(key, (message, {}))[1][quantity] = signal

    @property
    def filters(self) -> list[dict[str, Any]]:
        """The filters of python-can that let only frames of the wanted messages pass."""
        return [{"can_id": number, "can_mask": 0x1FFFFFFF if extended else 0x7FF,
                 "extended": extended} for number, extended in self._wanted]

    def decode(self, frame: Any) -> dict[str, float]:
        """Returns the values in a frame; those that it lacks or that mean none are left out."""
        found = self._wanted.get((frame.arbitration_id, frame.is_extended_id))
        if found is None or frame.is_error_frame or frame.is_remote_frame:
            return {}
        message, signals = found
        try:
            decoded = message.decode(bytes(frame.data), decode_choices=False, allow_truncated=True)
        except Exception:  # what cantools and bitstruct raise for bad data has no common class
            self.undecodable += 1
            return {}
        values: dict[str, float] = {}
        for quantity, signal in signals.items():
            value = decoded.get(signal.name)
            number = isinstance(value, (int, float)) and math.isfinite(value)
            if number and not _none(signal, value):
                values[quantity] = float(value)
        if not values and not message.is_multiplexed() and not signals.keys() & decoded.keys():
            self.undecodable += len(frame.data) < message.length
        return values


def _none(signal: Any, value: float) -> bool:
    """Returns whether the name of a value says that there is none."""
    if not signal.choices:
        return False
    name = signal.choices.get(signal.scaled_to_raw(value))
    return name is not None and _NONE.fullmatch(str(name)) is not None
