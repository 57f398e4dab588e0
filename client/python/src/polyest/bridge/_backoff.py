"""Delays between attempts to connect again."""

from __future__ import annotations


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
