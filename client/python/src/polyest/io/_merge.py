"""Merges tracks of samples, each with its own times, into pieces that follow each other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Optional

import numpy as np

from polyest._table import Floats, refuse
from polyest.io._rows import Piece

#: Channels that share their times: in turn the next times, s, and the values of each, NaN for none.
Track = Iterator[tuple[Floats, dict[str, Floats]]]


class _Reader:
    """What of a track has been read and is in no piece yet."""

    def __init__(self, file: str, track: Track) -> None:
        self._file = file
        self._track = track
        self._last: Optional[float] = None
        self.times: Floats = np.empty(0)
        self.values: dict[str, Floats] = {}
        self.ended = False

    def fill(self) -> None:
        """Reads on, unless there are samples or none is left."""
        while len(self.times) == 0 and not self.ended:
            read = next(self._track, None)
            if read is None:
                self.ended = True
            else:
                self._check(*read)
                self.times, self.values = read

    def _check(self, times: Floats, values: dict[str, Floats]) -> None:
        names = ", ".join(values)
        if np.isnan(times).any():
            raise refuse(self._file, f"a sample of {names} has no time")
        before = times[:1] if self._last is None else np.array([self._last])
        steps = np.diff(np.concatenate([before, times]))
        backward = np.flatnonzero(steps < 0)
        if backward.size:
            at = times[backward[0]]
            raise refuse(self._file, f"the times of {names} decrease: {at} s follows "
                         f"{at - steps[backward[0]]} s")
        if len(times):
            self._last = float(times[-1])

    def take(self, until: float) -> tuple[Floats, dict[str, Floats]]:
        """Returns and forgets what was sampled until a time."""
        count = int(np.searchsorted(self.times, until, side="right"))
        taken = self.times[:count], {name: one[:count] for name, one in self.values.items()}
        self.times = self.times[count:]
        self.values = {name: one[count:] for name, one in self.values.items()}
        return taken


def merged(file: str, tracks: Sequence[Track]) -> Iterator[Piece]:
    """Yields what all tracks have in one interval of time after the other."""
    readers = [_Reader(file, track) for track in tracks]
    while True:
        for reader in readers:
            reader.fill()
        open_ones = [reader for reader in readers if len(reader.times)]
        if not open_ones:
            return
        # Each track is read at least so far; a later part of one may begin at this very time.
        until = min(float(reader.times[-1]) for reader in open_ones)
        piece = {}
        for reader in open_ones:
            for name, part in _taken(reader, until).items():
                piece[name] = part
        yield piece


def _taken(reader: _Reader, until: float) -> dict[str, tuple[Floats, Floats]]:
    """Returns each channel's samples until a time, also of parts that are not read yet."""
    times, values = reader.take(until)
    parts = [(times, values)]
    reader.fill()
    while len(reader.times) and reader.times[0] <= until:
        parts.append(reader.take(until))
        reader.fill()
    found = {}
    for name in values:
        all_times = np.concatenate([part for part, _ in parts])
        all_values = np.concatenate([part[name] for _, part in parts])
        there = ~np.isnan(all_values)
        found[name] = (all_times[there], all_values[there])
    return found
