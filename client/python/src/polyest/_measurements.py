"""Makes measurements for a problem from a DataFrame, a dict of columns or a structured array."""

from __future__ import annotations

import json
import re
import warnings
from bisect import bisect_left
from collections.abc import Collection, Iterator, Mapping
from typing import Optional

import numpy as np

from polyest._proto.v1 import measurements_pb2, problem_pb2, session_service_pb2
from polyest._request import flag, texts
from polyest._table import Array, Clock, Data, Floats, Table, floats, refuse, row_text
from polyest._time_columns import may_be_time, parts_of
from polyest.io._choices import nearest
from polyest.io._recording import Batch, Recording

Measurements = measurements_pb2.Measurements

_LAST_RUN = 2**31 - 1

# A header with its unit: "Disp [mm]", "Disp (mm)", "Disp / mm" or "Disp / (mm)".
_HEADER = re.compile(r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)"
                     r"|/\s\(?(?P<c>[^\s()]\S*?)\)?)$")
# A name in a condition that is no function, as in "abs(v)", and no part of a number, as in "1e5".
_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?!\w*\s*\()")


# Units behind an underscore, as in "x_mm". Not "in" and "min": x_in may be an input.
_ENDINGS = frozenset(
    "m mm cm km um µm nm inch ft s ms us µs deg rad rpm Hz kHz g kg t N kN MN mN Nm kNm "
    "Pa kPa MPa bar mbar psi V mV A mA K degC W kW J kJ kph kmh mph".split())


def _split_header(header: str) -> tuple[str, str]:
    """Returns a header's name and unit; an empty unit if it has none."""
    match = _HEADER.match(header)
    if match is None:
        return header, ""
    return match["name"], match["a"] or match["b"] or match["c"] or ""


def _listed(names: Collection[str]) -> str:
    return ", ".join(f"'{name}'" for name in names) or "none"


def _mapping(quantity: str, unused: Collection[str]) -> str:
    """Returns the end of a message: what maps the unused column whose name is the nearest."""
    if not unused:
        return ""
    headers = {_split_header(header)[0]: header for header in unused}
    header = headers[next(iter((*nearest(quantity, headers, 1), *headers)))]
    line = json.dumps({quantity: {"from": header}}, ensure_ascii=False)
    return f'; map one in the problem: "columns": {line}'


class MeasurementConverter:
    """Converts data to measurements of one problem.

    Columns are found by the problem's names, by its `columns`, and with or without a unit in their
    header. Batches of one record share a converter, so that dates count from the first of all rows.
    """

    def __init__(self, problem: problem_pb2.Problem,
                 units: Optional[Mapping[str, str]] = None, *, apart: bool = False,
                 resumed: Optional[session_service_pb2.Session] = None) -> None:
        """`units` names the unit of columns by quantity, as in {"x": "mm", "t": "ms"}.

        apart: channels may come in batches of their own. resumed: a session that has rows of other
        data already. Raises InvalidInput for a name in `units` that the problem does not have.
        """
        # The field's name is a word of Python.
        self._sources = {name: (getattr(column, "from"), column.unit)
                         for name, column in problem.columns.items()}
        self._units = texts("units", units)
        self._measured = [measured.output for measured in problem.measured]
        self._streamed = [signal.name for signal in problem.inputs if signal.HasField("streamed")]
        known = {"t", "pi", *self._measured, *self._streamed}
        self._conditions = [name for name in dict.fromkeys(_NAME.findall(problem.use_when))
                            if name not in known]
        self._apart = apart
        self._resumed = resumed
        self._clock = Clock()
        self._noted: set[str] = set()
        self._given: set[str] = set()  # the channels of all batches so far
        self._check_units()

    def begin_anew(self) -> None:
        """Forgets all batches so far, since none of them was kept."""
        self._clock = Clock()
        self._given.clear()

    @property
    def names(self) -> list[str]:
        """What the problem takes from data: outputs, inputs, and names in its condition."""
        return list(dict.fromkeys((*self._measured, *self._streamed, *self._conditions)))

    @property
    def inputs(self) -> list[str]:
        """The streamed inputs."""
        return list(self._streamed)

    def convert(self, data: Data, *, end_of_run: bool = False) -> Measurements:
        """Returns all rows as one message; NaN is a missing sample. Raises InvalidInput."""
        if isinstance(data, Measurements):
            return data
        if isinstance(data, (Batch, Recording)):
            rows = data.all() if isinstance(data, Recording) else data
            message = rows.measurements(self._units, end_of_run=end_of_run)
            self._check_channels(message, rows.values, ())
            return message
        table = Table(data)
        used: list[str] = []
        message = Measurements(end_of_run=end_of_run)
        counted = self._clock.counts_dates
        message.time_s.extend(self._times(table, used))
        self._add_run(table, message, used)
        if self._clock.counts_dates and not counted:
            self._check_first_date(message)
        for quantity in self.names:
            self._add_channel(table, quantity, message, used)
        self._check_channels(message, table.columns,
                             [name for name in table.columns if name not in used])
        self._note_unused(table, used)
        return message

    def convert_each(self, data: Data, *, end_of_run: bool = False) -> Iterator[Measurements]:
        """Yields the rows of a recording batch by batch, those of other data as one message.

        Raises InvalidInput for none: the daemon would refuse it with what is sent behind it.
        """
        end_of_run = flag("end_of_run", end_of_run)
        if not isinstance(data, Recording):
            yield _with_rows(self.convert(data, end_of_run=end_of_run))
            return
        for batch in data:
            yield _with_rows(self.convert(batch))
        if end_of_run:
            yield Measurements(end_of_run=True)

    def _times(self, table: Table, used: list[str]) -> Floats:
        header, unit, column = self._find_time(table)
        used.append(header)
        return self._clock.seconds(header, column, unit)

    def _find_time(self, table: Table) -> tuple[str, str, Array]:
        """Returns header, unit and values of the time."""
        source, unit = self._sources.get("t", ("", ""))
        found = self._find(table, "t") if source else None
        if found is not None:
            return found
        given = self._units.get("t", unit)
        taken = {*self.names, "run", *(header for header, _ in self._sources.values())}
        parts = {header: parts_of(header) for header in table.columns}
        may_be = [] if source else [header for header, (name, _) in parts.items()
                                    if not taken & {header, name} and may_be_time(header)]
        exact = [header for header in may_be if header == "t"] or [
            header for header in may_be if parts[header][0] == "t"]
        index = None if exact else table.index_of_times(source)
        if index is not None:
            return index[0], given or parts_of(index[0])[1], index[1]
        one = _only_one(table, "t", given,
                        [(header, parts[header][1]) for header in exact or may_be])
        if one is not None:
            return one
        if source:
            raise refuse("columns.t", f"there is no column '{source}'; the columns are "
                         f"{_listed(table.columns)}")
        raise refuse("t", f"no column of the time; the columns are {_listed(table.columns)}")

    def _check_first_date(self, message: Measurements) -> None:
        """Refuses dates that count from a row in the middle of a run of the session."""
        session = self._resumed
        if session is None or (message.run and message.run[0] > session.last_run):
            return
        self.begin_anew()
        raise refuse("t", "dates count from the first row of the data, but "
                     f"{session.name} has rows up to t = {session.last_time_s:g} s of run "
                     f"{session.last_run} already; give times in s since the run's first row, or "
                     f"begin the next run, {session.last_run + 1}, in a column run")

    def _add_run(self, table: Table, message: Measurements, used: list[str]) -> None:
        found = self._find(table, "run")
        if found is None:
            return
        header, _, column = found
        numbers = floats(header, column)
        wrong = np.flatnonzero(~((numbers == np.floor(numbers)) & (0 <= numbers)
                                 & (numbers <= _LAST_RUN)))
        if wrong.size:
            at = int(wrong[0])
            raise refuse(header, f"{row_text(at)}: {numbers[at]:.15g} must be a whole number from "
                         f"0 to {_LAST_RUN}")
        message.run.extend(int(number) for number in numbers)
        used.append(header)

    def _add_channel(self, table: Table, quantity: str, message: Measurements,
                     used: list[str]) -> None:
        found = self._find(table, quantity)
        if found is None:
            if quantity in self._sources and self._sources[quantity][0]:
                raise refuse(f"columns.{quantity}", f"there is no column "
                             f"'{self._sources[quantity][0]}'; the columns are "
                             f"{_listed(table.columns)}")
            return
        header, unit, column = found
        values = floats(header, column)
        missing = np.flatnonzero(np.isnan(values))
        channel = message.channels.add(name=quantity, unit=unit)
        channel.values.extend(np.nan_to_num(values, nan=0.0))
        channel.missing.extend(int(row) for row in missing)
        used.append(header)

    def _find(self, table: Table, quantity: str) -> Optional[tuple[str, str, Array]]:
        """Returns header, unit and values of a quantity's column; None if there is none."""
        source, unit = self._sources.get(quantity, ("", ""))
        wanted = source or quantity
        unit = self._units.get(quantity, self._units.get(wanted, unit))
        if wanted in table.columns:
            in_header = _split_header(wanted)[1] if source else ""
            return wanted, unit or in_header, table.columns[wanted]
        parts = {header: _split_header(header) for header in table.columns}
        found = [(header, in_header) for header, (name, in_header) in parts.items()
                 if name == wanted and in_header]
        if not found and not source:
            found = self._with_endings(table, quantity)
        return _only_one(table, quantity, unit, found)

    def _with_endings(self, table: Table, quantity: str) -> list[tuple[str, str]]:
        """Returns the columns of a quantity with its unit behind an underscore, as in "x_mm"."""
        taken = {*self.names, *(header for header, _ in self._sources.values())}
        return [(header, header[len(quantity) + 1:]) for header in table.columns
                if header.startswith(f"{quantity}_") and header not in taken
                and header[len(quantity) + 1:] in _ENDINGS]

    def _check_units(self) -> None:
        headers = [header for quantity, (header, _) in self._sources.items()
                   if header and quantity != "run"]
        known = list(dict.fromkeys(("t", *self.names, *headers)))
        for name in self._units:
            if name not in known:
                near = nearest(name, known, 1)
                raise refuse("units", f"there is no quantity '{name}' in the problem; there are "
                             f"{_listed(known)}"
                             + (f"; the nearest is '{near[0]}'" if near else ""))

    def _check_channels(self, message: Measurements, columns: Collection[str],
                        unused: Collection[str]) -> None:
        """Refuses rows that lack what the problem takes from them.

        The daemon takes an input without samples as 0, and says so in its estimate only. Batches
        after the first may lack one, since a slow sensor has no sample in each of them.
        """
        present = {channel.name for channel in message.channels}
        self._given.update(present)
        if not message.time_s:
            return
        wanted = self.names if self._apart else self._measured
        if wanted and not present.intersection(wanted):
            what = "the problem" if self._apart else "a measured output"
            raise refuse("measurements", f"no column of {what} ({', '.join(wanted)}); the columns "
                         f"are {_listed(columns)}")
        if self._apart:
            return
        for name in (*self._streamed, *self._conditions):
            if name not in self._given:
                why = (" for the streamed input of that name" if name in self._streamed
                       else ", which useWhen names,")
                raise refuse("measurements", f"the column '{name}'{why} is missing; the columns "
                             f"are {_listed(columns)}{_mapping(name, unused)}")

    def _note_unused(self, table: Table, used: list[str]) -> None:
        unused = [name for name in table.columns if name not in used and name not in self._noted]
        self._noted.update(unused)
        if unused:
            warnings.warn(f"columns that the problem does not name are not used: "
                          f"{', '.join(unused)}", stacklevel=6)


def _only_one(table: Table, quantity: str, unit: str,
              found: list[tuple[str, str]]) -> Optional[tuple[str, str, Array]]:
    """Returns header, unit and values of the one column that is found; None if there is none.

    found: the headers and their units. unit: goes before these. Raises InvalidInput for several.
    """
    if len(found) > 1:
        raise refuse(quantity, f"may be the column {_listed([header for header, _ in found])}; "
                     f"columns.{quantity}.from of the problem decides")
    return next(((header, unit or in_header, table.columns[header])
                 for header, in_header in found), None)


def _with_rows(measurements: Measurements) -> Measurements:
    if not measurements.time_s and not measurements.end_of_run:
        raise refuse("measurements", "there are no rows")
    return measurements


def split(measurements: Measurements, max_rows: int) -> Iterator[Measurements]:
    """Yields the rows in batches of at most `max_rows`, the end of a run in the last one."""
    rows = len(measurements.time_s)
    if rows <= max_rows:
        yield measurements
        return
    missing = [list(channel.missing) for channel in measurements.channels]
    for first in range(0, rows, max_rows):
        last = min(first + max_rows, rows)
        batch = Measurements(time_s=measurements.time_s[first:last],
                             run=measurements.run[first:last] if measurements.run else (),
                             end_of_run=measurements.end_of_run and last == rows)
        for channel, without in zip(measurements.channels, missing):
            here = without[bisect_left(without, first):bisect_left(without, last)]
            batch.channels.add(name=channel.name, unit=channel.unit,
                               values=channel.values[first:last],
                               missing=[row - first for row in here])
        yield batch
