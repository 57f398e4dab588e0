"""Puts samples of several channels, each with its own times, into rows and batches.

Pieces of a record follow each other: each holds the samples of all channels in an interval of time,
and the next one begins later. Times are integers, ns, where the file has such, and else floats, s.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from typing import Literal, Optional

import numpy as np

from polyest._request import at_least, whole
from polyest._table import Array, Floats, refuse
from polyest.io._recording import Batch

#: What t = 0 is: the file's own zero, the first row, or ("auto") the first row if times are dates.
TimeZero = Literal["auto", "file", "first"]

#: The samples of each channel in an interval: its times and its values, of equal lengths.
Piece = Mapping[str, tuple[Array, Floats]]

# Times beyond this count from 1970 and not from the start of a measurement: 3 March 1973, ns.
_DATE_NS = 100_000_000 * 10**9


def check_options(time_zero: TimeZero, batch_rows: int, reorder_window_s: float = 0.0) -> None:
    """Raises InvalidInput for options of `read` that are out of their range."""
    if time_zero not in ("auto", "file", "first"):
        raise refuse("time_zero", f"must be one of auto, file, first; got '{time_zero}'")
    whole("batch_rows", batch_rows, 1)
    at_least("reorder_window_s", reorder_window_s, 0)


def nanoseconds(time_s: float) -> int:
    """Returns a time as whole ns, dates as whole µs: floats hold those since 1970 no finer."""
    microseconds = time_s * 1e6
    return round(microseconds) * 1000 if microseconds * 1000 >= _DATE_NS else round(time_s * 1e9)


def seconds(time_ns: Array) -> Floats:
    """Returns whole ns in s, rounded once: the floats that the decimal numbers have."""
    if len(time_ns) and abs(time_ns[-1]) >= 2**53:  # which a float does not hold
        result: Floats = time_ns // 10**9 + time_ns % 10**9 / 1e9
    else:
        result = time_ns / 1e9
    return result


class RowMaker:
    """Makes rows of pieces. It counts samples that share their time with an earlier one."""

    def __init__(self, file: str, names: Iterable[str], time_zero: TimeZero) -> None:
        """`names` are the channels of all rows."""
        self._file = file
        self._names = list(names)
        self._time_zero = time_zero
        self._zero: Optional[float] = None
        #: Samples left out, since their channel has another one at the same time.
        self.repeated = 0

    def rows(self, piece: Piece) -> tuple[Floats, dict[str, Floats]]:
        """Returns the times of all samples, s, and each channel's values, NaN for none."""
        times = np.unique(np.concatenate([taken for taken, _ in piece.values()]))
        columns: dict[str, Floats] = {}
        for name in self._names:
            columns[name] = column = np.full(len(times), np.nan)
            if name in piece:
                taken, values = piece[name]
                # The first of several samples at one time counts: it is written last.
                column[np.searchsorted(times, taken)[::-1]] = values[::-1]
                self.repeated += len(taken) - len(np.unique(taken))
        return self._seconds(times), columns

    def _seconds(self, times: Array) -> Floats:
        integers = times.dtype.kind == "i"
        if len(times) == 0:
            return np.empty(0)
        if self._zero is None:
            dates = integers and times[0] >= _DATE_NS
            first = self._time_zero == "first" or (self._time_zero == "auto" and dates)
            self._zero = times[0] if first else times.dtype.type(0)
        result: Floats = times - self._zero
        if integers:
            result = seconds(result)
        if result[0] < 0:
            raise refuse(self._file, f"t = {result[0]} s must be ≥ 0; time_zero='first' lets the "
                         "time begin at the first row")
        return result

    def warn(self) -> None:
        """Warns of samples that were left out."""
        if self.repeated:
            warnings.warn(f"{self._file}: {self.repeated} samples are not used: their channel has "
                          "an earlier one at the same time", stacklevel=5)


def batches(file: str, pieces: Iterable[Piece], units: Mapping[str, str], *, run: int,
            time_zero: TimeZero, batch_rows: int) -> Iterator[Batch]:
    """Yields the rows of pieces in batches of at most `batch_rows`."""
    maker = RowMaker(file, units, time_zero)
    rows = 0
    for piece in pieces:
        if not any(len(times) for times, _ in piece.values()):
            continue
        times, columns = maker.rows(piece)
        rows += len(times)
        for first in range(0, len(times), batch_rows):
            part = slice(first, first + batch_rows)
            yield Batch(times[part], {name: column[part] for name, column in columns.items()},
                        dict(units), run)
    if rows == 0:
        raise refuse(file, f"has no sample of {', '.join(units)}")
    maker.warn()
