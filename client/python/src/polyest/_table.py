"""Looks at data of several kinds as columns by name."""

from __future__ import annotations

import contextlib
import datetime
import re
from collections.abc import Mapping
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from polyest._time_columns import SECONDS, may_be_time, seconds_of
from polyest.errors import InvalidInput

Array = npt.NDArray[Any]
Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]

#: Data as the package takes them: a pandas DataFrame, a mapping from names to columns, or a
#: structured numpy array.
Data = Union[Mapping[str, npt.ArrayLike], Array, Any]

_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


def refuse(field: str, rule: str) -> InvalidInput:
    """Returns the exception for data that break a rule."""
    return InvalidInput(f"{field}: {rule}", field=field, rule=rule)


def seconds_in(field: str, unit: str) -> float:
    """Returns the length of a unit of time, s; "" is the second. Raises InvalidInput."""
    found = seconds_of(unit)
    if found is None:
        raise refuse(field, f"'{unit}' is no unit of time; known are {', '.join(SECONDS)}")
    return found


def row_text(row: int) -> str:
    """Returns how messages name a row, as those of the daemon do."""
    return f"row {row} (counted from 0)"


class Table:
    """Columns by name, of equal length."""

    def __init__(self, data: Data) -> None:
        self._index: Optional[Array] = None
        self._index_name = ""
        self.columns: dict[str, Array] = {}
        names = getattr(getattr(data, "dtype", None), "names", None)
        if isinstance(data, Mapping):
            self.columns = {str(name): _array(str(name), values)
                            for name, values in data.items()}
        elif names:
            self.columns = {name: _array(name, data[name]) for name in names}
        elif hasattr(data, "columns") and hasattr(data, "__getitem__"):
            self._take_frame(data)
        else:
            raise refuse("measurements", f"a {type(data).__name__} has no columns; give a pandas "
                         "DataFrame, a dict of columns or a structured numpy array")
        self.rows = self._common_length()

    def _take_frame(self, frame: Any) -> None:
        for name in frame.columns:
            if str(name) in self.columns:
                raise refuse(str(name), "is the name of two columns")
            self.columns[str(name)] = _values_of(frame[name])
        index = getattr(frame, "index", None)
        if index is not None and hasattr(index, "name"):
            self._index, self._index_name = np.asarray(index), str(index.name or "")

    def _common_length(self) -> int:
        lengths = {}
        for name, values in self.columns.items():
            if values.ndim != 1:
                raise refuse(name, f"has the shape {values.shape}; a column has one dimension")
            lengths[name] = len(values)
        if len(set(lengths.values())) > 1:
            said = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise refuse("measurements", f"columns differ in length: {said}")
        return next(iter(lengths.values()), 0)

    def index_of_times(self, name: str = "") -> Optional[tuple[str, Array]]:
        """Returns the name and the values of the index if it is one of times; else None.

        It is if it has dates or time differences, the name of a time, or else `name`.
        """
        if self._index is None:
            return None
        dates = self._index.dtype.kind in "mM" or _has_zone(self._index)
        named = bool(self._index_name) and (self._index_name == name
                                            or may_be_time(self._index_name))
        return (self._index_name or "t", self._index) if dates or named else None


def _array(name: str, values: Any) -> Array:
    """Returns a column as an array; what a masked array hides is missing."""
    if not isinstance(values, np.ma.MaskedArray):
        try:
            return np.asarray(values)
        except ValueError as error:
            raise refuse(name, f"is no column of numbers: {error}") from error
    kind = values.dtype.kind
    nothing: Any = None
    if kind in "mM":
        nothing = np.array("NaT", values.dtype)
    elif kind in "fiub":
        nothing = np.nan
    return np.where(values.mask, nothing, values.data)


def _values_of(series: Any) -> Array:
    """Returns the values of a pandas column; missing numbers of nullable types become NaN.

    Texts stay what they are, also those of numbers: `floats` refuses them where they are used.
    """
    values = np.asarray(series)
    nullable = values.dtype == object and str(getattr(series, "dtype", "object")) != "object"
    texts = any(isinstance(value, str) for value in values) if nullable else False
    if nullable and not texts and not _has_zone(values):
        with contextlib.suppress(TypeError, ValueError):
            values = series.to_numpy(dtype=float, na_value=np.nan)
    return values


def _has_zone(values: Array) -> bool:
    """Returns whether values are dates as objects, which those with a time zone are."""
    return values.dtype == object and len(values) > 0 and hasattr(values[0], "tzinfo")


def _has_texts(values: Array) -> bool:
    return values.dtype.kind in "US" or (values.dtype == object and any(
        isinstance(value, str) for value in values))


def _nanoseconds(date: Any) -> np.datetime64:
    """Returns a date; one without a time zone counts as numpy and pandas have it, in no zone."""
    value = getattr(date, "value", None)  # what pandas has in nanoseconds
    if value is None and getattr(date, "tzinfo", None) is not None:
        date = date.astimezone(datetime.timezone.utc).replace(tzinfo=None)
    return np.datetime64(date if value is None else value, "ns")


def _dates(name: str, values: Array) -> Array:
    """Returns dates that are objects as numpy has them. Raises InvalidInput for other objects."""
    for row, value in enumerate(values):
        if not isinstance(value, (datetime.datetime, np.datetime64)) and value is not None:
            raise refuse(name, f"{row_text(row)}: {value!r} of the type {type(value).__name__} "
                         "must be a date with its time, as others are")
    return np.array([_nanoseconds(value) for value in values])


def floats(name: str, values: Array) -> Floats:
    """Returns a column as numbers; NaN is a missing sample. Raises InvalidInput for others."""
    if values.dtype.kind == "O":
        values = _array(name, [np.nan if value is None else value for value in values])
    if values.dtype.kind not in "fiub":
        _refuse_decimal_comma(name, values)
        raise refuse(name, f"has values of type {values.dtype}; it must have numbers")
    numbers: Floats = values.astype(np.float64)
    infinite = np.flatnonzero(np.isinf(numbers))
    if infinite.size:
        raise refuse(name, f"{row_text(int(infinite[0]))}: {numbers[infinite[0]]} is not finite")
    return numbers


def _refuse_decimal_comma(name: str, values: Array) -> None:
    """Raises InvalidInput for texts such as "1,5", which pandas leaves where it is not told."""
    for row, value in enumerate(values):
        if isinstance(value, str) and _DECIMAL_COMMA.fullmatch(value.strip()):
            raise refuse(name, f"{row_text(row)}: '{value}' is a text with a decimal comma; "
                         "pandas.read_csv(…, sep=\";\", decimal=\",\") reads such files")


class Clock:
    """Turns times into seconds. Dates count from the first one that it turns."""

    def __init__(self) -> None:
        self._origin: Optional[np.datetime64] = None

    @property
    def counts_dates(self) -> bool:
        """Whether there has been a date, from which others count."""
        return self._origin is not None

    def seconds(self, name: str, values: Array, unit: str) -> Floats:
        """Returns times in s. `values` are numbers in `unit`, time differences or dates."""
        if _has_zone(values):
            values = _dates(name, values)
        elif _has_texts(values):
            _refuse_decimal_comma(name, values)
            raise refuse(name, "has texts; times are numbers, dates or time differences, and "
                         "pandas.to_datetime reads the texts of dates")
        if values.dtype.kind == "M":
            _check_present(name, np.isnat(values))
            if self._origin is None and len(values):
                self._origin = values[0]
            values = values - self._origin
        if values.dtype.kind == "m":
            result: Floats = values / np.timedelta64(1, "ns") * 1e-9
        else:
            result = floats(name, values) * seconds_in(name, unit)
        _check_present(name, np.isnan(result))
        return result


def _check_present(name: str, missing: npt.NDArray[np.bool_]) -> None:
    if missing.any():
        raise refuse(name, f"{row_text(int(np.argmax(missing)))} has no time")
