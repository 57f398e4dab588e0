"""Which row of a batch the daemon refuses, counted as the one who gave the rows counts them."""

from __future__ import annotations

import re
from typing import Optional

import numpy as np

from polyest._proto.v1 import measurements_pb2
from polyest.errors import PolyestError

Measurements = measurements_pb2.Measurements

# The field of a row's time, run or value; and how a message begins that does not begin with it.
_FIELD = re.compile(r"(measurements\.(?:timeS|run|channels\[\d+\]\.values)\[)(\d+)(\])")
_TEXT = re.compile(r"^(row )(\d+)( \(counted from 0\))")


def refused_row(error: PolyestError) -> Optional[int]:
    """Returns the row that the daemon refuses; None if it names none."""
    found = _FIELD.fullmatch(error.field)
    return int(found[2]) if found else None


def count_rows_from(error: PolyestError, first_row: int) -> None:
    """Says in `error` which row it was of data whose row `first_row` was the first of the batch."""
    if refused_row(error) is None:
        return

    def moved(text: str) -> str:
        for where in (_FIELD, _TEXT):
            text = where.sub(lambda found: f"{found[1]}{int(found[2]) + first_row}{found[3]}", text)
        return text

    error.args = (moved(error.message),)
    error.field, error.rule = moved(error.field), moved(error.rule)


def without_row(batch: Measurements, row: int) -> Measurements:
    """Returns the other rows of a batch."""
    others = np.delete(np.arange(len(batch.time_s)), row)
    found = Measurements(end_of_run=batch.end_of_run, time_s=np.array(batch.time_s)[others])
    if batch.run:
        found.run.extend(np.array(batch.run)[others])
    for channel in batch.channels:
        found.channels.add(name=channel.name, unit=channel.unit,
                           values=np.array(channel.values)[others],
                           missing=[at - (at > row) for at in channel.missing if at != row])
    return found
