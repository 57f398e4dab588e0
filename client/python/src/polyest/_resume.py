"""Which batches of a stream are kept, under way or still to be sent, without any transport.

A batch is kept here until the daemon has acknowledged it. After a lost connection all others are
sent again under their numbers, also those that the session seems to have: another client may have
written batches of these numbers, and only the daemon can tell by their content. One that had
arrived is acknowledged and not counted again: nothing is lost, nothing counts twice.
"""

from __future__ import annotations

import secrets
from collections import deque
from dataclasses import dataclass
from typing import Any, Optional

from polyest._proto.v1 import measurements_pb2, session_service_pb2
from polyest._refusals import count_rows_from
from polyest._request import at_least, whole, wrong
from polyest.errors import (
    Aborted,
    AlreadyExists,
    Cancelled,
    DataLoss,
    NotFound,
    PolyestError,
    ResourceExhausted,
    Unauthenticated,
    Unavailable,
)

Request = session_service_pb2.StreamMeasurementsRequest


@dataclass(frozen=True)
class StreamOptions:
    """How a session sends its batches and connects again."""

    #: Rows of a batch at most, ≥ 1; longer data are cut.
    batch_rows: int = 10_000
    #: Batches without acknowledgement at which sending waits, ≥ 1.
    max_unacknowledged: int = 16
    #: The daemon makes an estimate after every so many batches, ≥ 1; None: only when it is
    #: asked.
    estimate_every: Optional[int] = 1
    #: The least time from one estimate to the next, s, ≥ 0; one due earlier waits for a batch.
    estimate_interval_s: float = 0.0
    #: The delay before the first attempt to connect again, s, ≥ 0; it doubles from one to the next.
    first_delay_s: float = 0.1
    #: The longest such delay, s, ≥ 0.
    max_delay_s: float = 2.0
    #: Attempts to reach the daemon without an acknowledgement in between, ≥ 0.
    max_attempts: int = 32

    def __post_init__(self) -> None:
        """Raises InvalidInput for what would lose rows or wait for ever."""
        for name, least in (("batch_rows", 1), ("max_unacknowledged", 1), ("max_attempts", 0)):
            whole(name, getattr(self, name), least)
        if self.estimate_every is not None:
            whole("estimate_every", self.estimate_every, 1)
        for name in ("estimate_interval_s", "first_delay_s", "max_delay_s"):
            at_least(name, getattr(self, name), 0)


def options_of(options: Optional[StreamOptions], on_estimate: Any) -> StreamOptions:
    """Returns the options of a stream. Raises WrongType for what is none, or no function."""
    if options is not None and not isinstance(options, StreamOptions):
        raise wrong("options", options, "a polyest.StreamOptions")
    if on_estimate is not None and not callable(on_estimate):
        raise wrong("on_estimate", on_estimate, "a function that takes an estimate")
    return options or StreamOptions()


@dataclass(frozen=True)
class PendingBatch:
    """A batch without acknowledgement."""

    request: Request
    #: Which row of the data that it was cut from its first row was.
    first_row: int


class BatchQueue:
    """The batches of one writer. Not safe for threads: its owner has the lock."""

    def __init__(self, session: str, options: StreamOptions, writer: Optional[str] = None) -> None:
        """`writer` takes over from a connection of that name; by default it has a new one."""
        self.session = session
        self.options = options
        self.last_sequence = 0
        #: The name by which the daemon knows the connections of this writer.
        self.writer = writer or secrets.token_hex(16)
        self._pending: deque[PendingBatch] = deque()
        self._given_up: list[PendingBatch] = []
        self._written = 0  # how many of them the present connection has been given
        self._attempts = 0  # to reach the daemon, since the last acknowledgement or refusal
        self._refusals = 0  # for lack of room, since the last acknowledgement
        self._begun = False
        self._overtaken = False  # by another client, whose batches follow those of this one
        #: Whether the daemon has acknowledged a batch of this queue.
        self.any_kept = False
        #: Connections made so far.
        self.connections = 0

    def __len__(self) -> int:
        """Returns the number of batches without acknowledgement."""
        return len(self._pending)

    @property
    def full(self) -> bool:
        """Whether sending must wait for acknowledgements."""
        return len(self._pending) >= self.options.max_unacknowledged

    def hello(self) -> Request:
        """Returns the first message of a connection: session, writer and policy for estimates."""
        request = Request(session=self.session, writer=self.writer)
        if self.options.estimate_every is None:
            request.estimates.only_last = True
        else:
            request.estimates.batch_count = self.options.estimate_every
            request.estimates.min_interval_s = self.options.estimate_interval_s
        return request

    def connected(self, last_sequence: int) -> None:
        """Begins a connection to a session whose last batch is given.

        Raises Aborted if another client has written to the session, DataLoss if acknowledged
        batches are gone.
        """
        if not self._begun:
            self._begin(last_sequence)
        first = self.last_sequence - len(self._pending) + 1
        self._overtaken = last_sequence > self.last_sequence
        if self._overtaken:
            raise Aborted(f"{self.session} has batch {last_sequence}, the last one sent is "
                          f"{self.last_sequence}: another client writes to it")
        if last_sequence < first - 1:
            raise DataLoss(f"{self.session} has batches up to {last_sequence}, but acknowledged "
                           f"them up to {first - 1}")
        self._written = 0
        self._given_up = []
        self.connections += 1

    def _begin(self, last_sequence: int) -> None:
        """Numbers the batches that were added before the first connection."""
        self._begun = True
        for number, batch in enumerate(self._pending, last_sequence + 1):
            batch.request.sequence = number
        self.last_sequence = last_sequence + len(self._pending)

    def add(self, batch: measurements_pb2.Measurements, first_row: int = 0) -> None:
        """Appends a batch, cut from data at `first_row`, under the next number."""
        self.last_sequence += 1
        self._pending.append(PendingBatch(Request(
            session=self.session, sequence=self.last_sequence, measurements=batch), first_row))

    @property
    def first(self) -> Optional[Request]:
        """The first batch without acknowledgement; None if there is none."""
        return self._pending[0].request if self._pending else None

    @property
    def has_unwritten(self) -> bool:
        """Whether the present connection lacks a batch."""
        return self._written < len(self._pending)

    def next_to_write(self) -> Optional[Request]:
        """Returns the next batch for the present connection; None if there is none."""
        if not self.has_unwritten:
            return None
        self._written += 1
        return self._pending[self._written - 1].request

    def acknowledge(self, sequence: int) -> None:
        """Forgets the batches up to a number: the daemon keeps them."""
        self._attempts = self._refusals = 0
        self.any_kept = True
        while self._pending and self._pending[0].request.sequence <= sequence:
            self._pending.popleft()
            self._written = max(self._written - 1, 0)

    def give_up(self, error: PolyestError) -> None:
        """Forgets the batches without acknowledgement and says in `error` how many there were.

        The daemon acknowledges all batches before the one that it refuses: that is the first here.
        """
        if self._pending:
            count_rows_from(error, self._pending[0].first_row)
        if len(self._pending) > 1:
            error.args = (f"{error.message} ({len(self._pending)} batches were not kept)",)
        self._given_up = list(self._pending)
        self._pending.clear()
        self._written, self._begun = 0, False

    def take_back(self) -> list[PendingBatch]:
        """Returns the batches that were given up at last, once, for those who send them again."""
        found, self._given_up = self._given_up, []
        return found

    def start_over(self) -> None:
        """Counts attempts anew, after a failure was reported."""
        self._attempts = 0

    def delay_s(self, error: PolyestError, *, new_token: bool) -> Optional[float]:
        """Counts an attempt and returns the delay before it; None if it cannot help.

        new_token: whether the token has changed since the connection was made.
        """
        refused = isinstance(error, ResourceExhausted) and error.retry_after_s is not None
        if not refused and not self._may_recover(error, new_token):
            return None
        before = min(self._attempts + self._refusals, 20)
        delay = min(self.options.max_delay_s, self.options.first_delay_s * 2.0**before)
        if refused:
            self._refusals += 1
            self._attempts = 0
        else:
            self._attempts += 1
        wanted: float = error.retry_after_s or 0.0
        return max(delay, wanted)

    def _may_recover(self, error: PolyestError, new_token: bool) -> bool:
        if self._attempts >= self.options.max_attempts:
            return False
        if isinstance(error, (Unavailable, Cancelled)):
            return True
        if isinstance(error, Unauthenticated):
            return new_token
        # A daemon that does not know writers by their names may, after a break, still hold the old
        # connection as the session's writer; one that does gives a reason.
        return (isinstance(error, Aborted) and not error.reason and self._attempts > 0
                and not self._overtaken)

    def final(self, error: PolyestError) -> PolyestError:
        """Returns what to raise after `error`, which no attempt can mend."""
        if isinstance(error, NotFound) and self._begun and self.last_sequence > 0:
            kept = self.last_sequence - len(self._pending)
            return DataLoss(f"the daemon has lost {self.session} and the batches it had "
                            f"acknowledged, up to number {kept} (it was restarted without a data "
                            "directory, or the session was deleted)")
        if isinstance(error, AlreadyExists):
            return Aborted(f"another client writes to {self.session}: {error.message}")
        return error
