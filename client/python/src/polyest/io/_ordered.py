"""Puts samples that arrive one by one, nearly in order, into pieces that follow each other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from polyest._table import refuse
from polyest.io._rows import Piece

#: A time, ns, and the values that some channels had then.
Sample = tuple[int, Mapping[str, float]]


def ordered(file: str, samples: Iterable[Sample], window_s: float, count: int) -> Iterator[Piece]:
    """Yields samples in the order of time.

    A sample may come up to `window_s` later than others of later times: so long each is held.
    `count` is how many are read at a time. Raises InvalidInput for one that comes later.
    """
    window = round(window_s * 1e9)
    held: list[Sample] = []
    newest = released = -(2**62)
    wanted = count
    for sample in samples:
        if sample[0] < released:
            raise refuse(file, f"a sample comes {(newest - sample[0]) / 1e9} s later than one "
                         f"after it, which is more than reorder_window_s = {window_s}")
        newest = max(newest, sample[0])
        held.append(sample)
        if len(held) >= wanted:
            released = newest - window
            held.sort(key=lambda one: one[0])
            before = [one for one in held if one[0] < released]
            held = held[len(before):]
            wanted = len(held) + count
            yield _piece(before)
    yield _piece(sorted(held, key=lambda one: one[0]))


def _piece(samples: list[Sample]) -> Piece:
    times: dict[str, list[int]] = {}
    values: dict[str, list[float]] = {}
    for time, sample in samples:
        for name, value in sample.items():
            times.setdefault(name, []).append(time)
            values.setdefault(name, []).append(value)
    return {name: (np.array(times[name], dtype=np.int64), np.array(values[name]))
            for name in times}
