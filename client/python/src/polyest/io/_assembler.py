"""Puts live samples into batches that a session takes, for as long as a bus runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from time import monotonic
from typing import Optional

import numpy as np

from polyest.io._recording import Batch
from polyest.io._rows import seconds


class Assembler:
    """Rows of live samples. What the session would refuse is left out and counted.

    Without a reorder window a row is later than all rows of earlier batches; with one, it may come
    so much later than others, but a channel has one sample at a time. A new run begins after a gap
    of `new_run_after_s`, and when all samples come too late for `patience_s`, since the clock was
    set back then.
    """

    def __init__(self, units: Mapping[str, str], window_s: float, *, run: int = 0,
                 origin_ns: Optional[int] = None, after_s: float = -1.0,
                 new_run_after_s: float = 0.0, patience_s: float = math.inf) -> None:
        """`origin_ns` is the time of t = 0 of the run, None for the first sample's.

        after_s: the last time in the session, s. Samples up to it are there already; with a window
            those are that cannot come any more, and the later ones may be: they make batches of
            one sample each, so that the daemon can tell.
        """
        self._units = dict(units)
        self._window = round(window_s * 1e9)
        self._gap = round(new_run_after_s * 1e9)
        self._rows: dict[int, dict[str, float]] = {}
        self._ended: list[Batch] = []
        self._seen: dict[str, set[int]] = {}
        self._patience_s = patience_s
        self._late_since: Optional[float] = None
        #: The run of the rows that come.
        self.run = run
        #: The time of t = 0 of the run, ns; None before its first sample.
        self.origin_ns = origin_ns
        after = round(after_s * 1e9)
        self._resumed = run, after
        self._newest = after  # of all samples of the run, ns since its beginning
        self._floor = max(after - self._window, -1)  # samples up to it come too late
        #: Samples that came too late.
        self.late = 0
        #: Samples of a channel that has another one at the same time.
        self.repeated = 0
        #: Runs begun because the clock was set back, or after a gap.
        self.new_runs = 0

    def __len__(self) -> int:
        """Returns the number of rows that are not taken."""
        return len(self._rows) + sum(len(batch) for batch in self._ended)

    def add(self, time_ns: int, values: Mapping[str, float]) -> None:
        """Adds the samples of a time."""
        if self.origin_ns is None:
            self.origin_ns = time_ns
        time = time_ns - self.origin_ns
        if self._gap and self._newest >= 0 and time - self._newest > self._gap:
            time = self._begin_run(time_ns)
        elif time <= self._floor or time < 0:
            if not self._out_of_patience():
                self.late += len(values)
                return
            time = self._begin_run(time_ns)
        self._late_since = None
        self._newest = max(self._newest, time)
        row = self._rows.setdefault(time, {})
        for name, value in values.items():
            if name in row or time in self._seen.get(name, ()):
                self.repeated += 1
            else:
                row[name] = value
        if not row:
            del self._rows[time]

    def may_be_kept(self, run: int, time_s: float) -> bool:
        """Whether the session may have the samples of a time from an earlier program."""
        return self._window > 0 and run == self._resumed[0] and (
            round(time_s * 1e9) <= self._resumed[1])

    def _out_of_patience(self) -> bool:
        now = monotonic()
        if self._late_since is None:
            self._late_since = now
        return now - self._late_since > self._patience_s

    def _begin_run(self, time_ns: int) -> int:
        self._ended += self._batches()
        self._seen.clear()
        self.run += 1
        self.new_runs += 1
        self.origin_ns = time_ns
        self._newest = self._floor = -1
        return 0

    def take(self, *, last: bool = False) -> list[Batch]:
        """Returns the rows so far, a batch for each run; the caller sends them.

        Without a reorder window the newest row stays, unless it is the `last` one: another channel
        may have a sample at its time.
        """
        newest = self._rows.pop(self._newest, None) if not (last or self._window) else None
        taken = self._ended + self._batches()
        self._ended = []
        if newest is not None:
            self._rows[self._newest] = newest
        return taken

    def _batches(self) -> list[Batch]:
        times = sorted(self._rows)
        if not times:
            return []
        after = self._resumed[1] if self._window and self.run == self._resumed[0] else -1
        single = [{time: {name: value}} for time in times if time <= after
                  for name, value in self._rows[time].items()]
        others = {time: self._rows[time] for time in times if time > after}
        if self._window:
            for time in times:
                for name in self._rows[time]:
                    self._seen.setdefault(name, set()).add(time)
        self._rows.clear()
        self._floor = max(self._floor, times[-1] if not self._window
                          else self._newest - self._window)
        for name, seen in self._seen.items():
            self._seen[name] = {time for time in seen if time > self._floor}
        return [self._batch(rows) for rows in (*single, others) if rows]

    def _batch(self, rows: Mapping[int, Mapping[str, float]]) -> Batch:
        columns = {name: np.full(len(rows), np.nan) for name in self._units}
        for number, row in enumerate(rows.values()):
            for name, value in row.items():
                columns[name][number] = value
        return Batch(seconds(np.array(list(rows), dtype=np.int64)), columns, dict(self._units),
                     self.run)
