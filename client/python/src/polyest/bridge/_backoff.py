"""Delays between attempts to connect again."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Optional


class Backoff:
    """Delays that double from one attempt to the next, up to the longest."""

    def __init__(self, first_s: float = 0.2, longest_s: float = 30.0) -> None:
        self._first, self._longest = first_s, longest_s
        #: The next delay, s.
        self.next_s = first_s

    def delay_s(self) -> float:
        """Returns the delay before the next attempt."""
        delay, self.next_s = self.next_s, min(self._longest, 2 * self.next_s)
        return delay

    def reset(self) -> None:
        """Begins anew, after a success."""
        self.next_s = self._first


def run_reconnecting(listen: Callable[[Callable[[], None]], None],
                     failures: tuple[type[Exception], ...],
                     failed: Callable[[Exception, float], None], stop: threading.Event,
                     clock: Callable[[], float] = time.monotonic) -> None:
    """Calls `listen` until `stop` is set, and again after each failure, with delays that double.

    listen: connects and takes messages. Its argument is a function to call when it takes one.
        Delays begin anew if it has gone on from its first message for at least the next delay: a
        source may accept connections and close each at once, or after a message.
    failures: exceptions after which it is called again.
    failed: is given the exception and the delay before the next attempt, s.
    clock: tells the time in s.
    """
    backoff = Backoff()
    while not stop.is_set():
        first_s: Optional[float] = None

        def works() -> None:
            nonlocal first_s
            if first_s is None:
                first_s = clock()

        try:
            listen(works)
        except failures as error:
            if first_s is not None and clock() - first_s >= backoff.next_s:
                backoff.reset()
            failed(error, backoff.next_s)
            stop.wait(backoff.delay_s())
