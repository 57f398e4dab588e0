"""Feeds samples from a queue into a session, for as long as the daemon can be reached at times."""

from __future__ import annotations

import math
import queue
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Optional, TypeVar

from polyest._measurements import Measurements
from polyest._refusals import refused_row, without_row
from polyest._resume import StreamOptions
from polyest._stream import MeasurementStream
from polyest.bridge._backoff import Backoff
from polyest.bridge._configuration import Configuration
from polyest.bridge._sources import Source
from polyest.bridge._state import RunState, StateFile
from polyest.client import Client
from polyest.errors import DeadlineExceeded, InvalidInput, Unavailable
from polyest.estimates import Estimate
from polyest.io._assembler import Assembler
from polyest.io._choices import units_of
from polyest.io._recording import Batch
from polyest.problem import Problem
from polyest.session import Session

Result = TypeVar("Result")

#: How long all samples of a live source come too late before a new run begins, s.
PATIENCE_S = 5.0

# How many attempts a call makes before the end of the bridge is looked for.
_ATTEMPTS = 3

# How often it is said what may go on for days, such as that the daemon is away, s.
_SAID_EVERY_S = 30.0


class Feeder(threading.Thread):
    """Sends batches; connects again without end, until it is told to end."""

    def __init__(self, client: Client, configuration: Configuration, problem: Problem,
                 source: Source, on_estimate: Callable[[Estimate], None],
                 say: Callable[[str], None]) -> None:
        """`on_estimate` is called from a thread of its own."""
        super().__init__(name="polyest-feeder", daemon=True)
        self._client, self._configuration, self._problem = client, configuration, problem
        self._source, self._on_estimate, self._say = source, on_estimate, say
        self._queue: queue.Queue[tuple[int, Mapping[str, float]]] = queue.Queue(configuration.queue)
        self._state = StateFile(configuration.session.state)
        self._rows: Optional[Assembler] = None
        self._stream: Optional[MeasurementStream] = None
        self._last_chance = math.inf
        self._say_next: dict[str, float] = {}
        #: Set to end: what is queued is sent first.
        self.ending = threading.Event()
        #: What ended it, if that was a failure.
        self.error: Optional[BaseException] = None
        #: Whether the daemon has acknowledged all rows but those that it refused, in the end.
        self.all_kept = False
        self._handed_rows = 0
        self._first_kept = False
        self.refused_rows = 0
        self.dropped = 0

    def put(self, time_ns: int, values: Mapping[str, float]) -> None:
        """Takes samples: of a live source they are dropped if the queue is full, else it waits."""
        while True:
            try:
                self._queue.put((time_ns, values), timeout=0 if self._source.live else 0.2)
                return
            except queue.Full:
                if self._source.live or not self.is_alive():
                    self.dropped += len(values)
                    return

    def end(self) -> None:
        """Asks it to send what is queued and to end within the configured time."""
        self._last_chance = time.monotonic() + self._configuration.end_timeout_s
        self.ending.set()

    @property
    def sent_rows(self) -> int:
        """Rows handed to the session, without those that were refused."""
        return self._handed_rows - self.refused_rows

    @property
    def queued(self) -> int:
        """Samples that wait."""
        return self._queue.qsize()

    @property
    def unacknowledged(self) -> int:
        """Batches that the daemon has not acknowledged."""
        return len(self._stream.queue) if self._stream is not None else 0

    @property
    def reconnects(self) -> int:
        """How often the stream to the daemon was made again."""
        return max(0, self._stream.queue.connections - 1) if self._stream is not None else 0

    @property
    def rows(self) -> Optional[Assembler]:
        """The rows under way, with counts of what was left out; None before the session is open."""
        return self._rows

    def run(self) -> None:
        """Sends until the end."""
        try:
            session = self._open()
            while not self.ending.is_set():
                self.ending.wait(self._configuration.interval_s)
                self._feed(session)
            self._feed(session, last=True)
            self._close(session)
        except BaseException as error:  # main thread says it
            self.error = error

    def _open(self) -> Session:
        wanted = self._configuration.session
        # One estimate more often than it is wanted is held back by its interval.
        options = StreamOptions(max_attempts=_ATTEMPTS, max_unacknowledged=64,
                                estimate_interval_s=self._configuration.estimate_interval_s)
        session = self._again(lambda: self._client.session(
            wanted.name, self._problem, on_estimate=self._on_estimate, options=options,
            reorder_window_s=wanted.reorder_window_s))
        info = self._again(session.info)
        fresh = info.last_sequence == 0
        state = None if fresh else self._state.read(wanted.name)
        if state is not None and state.run < info.last_run:
            state = None  # another bridge has begun runs since
        run = state.run if state is not None else 0 if fresh else info.last_run + 1
        after = info.last_time_s if state is not None and run == info.last_run else -1.0
        self._rows = Assembler(self._source.units, wanted.reorder_window_s, run=run,
                               origin_ns=state.origin_ns if state is not None else None,
                               after_s=after, new_run_after_s=wanted.new_run_after_s,
                               patience_s=PATIENCE_S if self._source.live else math.inf)
        if not fresh:
            self._say(f"session {wanted.name} has {info.last_sequence} batches; "
                      + (f"run {run} goes on after t = {info.last_time_s:g} s" if after >= 0
                         else f"run {run} begins"))
        return session

    def _again(self, call: Callable[[], Result]) -> Result:
        """Calls until the daemon can be reached."""
        backoff = Backoff()
        while True:
            try:
                return call()
            except (Unavailable, DeadlineExceeded) as error:
                if time.monotonic() > self._last_chance:
                    raise
                self._say(f"{error}; next attempt in {backoff.next_s:.1f} s")
                delay_s = backoff.delay_s()
                if self.ending.wait(delay_s):  # which returns at once from then on
                    left_s = self._last_chance - time.monotonic()
                    time.sleep(max(0.0, min(delay_s, left_s)))

    def _feed(self, session: Session, *, last: bool = False) -> None:
        """Sends what is queued at this moment."""
        rows = self._rows
        assert rows is not None
        for _ in range(self._queue.qsize()):
            time_ns, values = self._queue.get_nowait()
            rows.add(time_ns, values)
        units = units_of(self._source.units, self._configuration.units)
        for batch in rows.take(last=last):
            self._append(session, replace(batch, units=units))

    def _append(self, session: Session, batch: Batch) -> None:
        self._keep_state(session, batch.run)
        self._handed_rows += len(batch)
        # The first batch is waited for: what is wrong with it, such as a unit, is so with all.
        # Nothing waits behind a sample that may be kept already, and would be sent again, too.
        wait = not self._first_kept or self._may_be_kept(batch.run, batch.time_s[0])
        self._send(session, lambda: session.append(batch, wait=wait))
        self._first_kept = self._first_kept or self.sent_rows > 0

    def _may_be_kept(self, run: int, time_s: float) -> bool:
        return self._rows is not None and self._rows.may_be_kept(run, time_s)

    def _keep_state(self, session: Session, run: int) -> None:
        rows = self._rows
        if rows is None or rows.origin_ns is None or run != rows.run:
            return
        try:
            self._state.write(RunState(session.name, rows.run, rows.origin_ns))
        except OSError as error:
            self._say_at_times("state", f"session.state cannot be written: {error}; a bridge that "
                               "is started again begins a new run")

    def _send(self, session: Session, send: Callable[[], object]) -> None:
        """Sends, and while the daemon is away waits until what is pending has been sent.

        Rows that the daemon refuses are left out.
        """
        while True:
            try:
                send()
                return
            except Unavailable as error:
                self._stream = session._stream
                self._say_at_times("away", f"{error}; {self.unacknowledged} batches wait")
                if time.monotonic() > self._last_chance:
                    raise
            except InvalidInput as error:
                self._leave_out_refused(session, error)
            finally:
                self._stream = session._stream
            send = session.flush  # the rows themselves are pending already

    def _leave_out_refused(self, session: Session, error: InvalidInput) -> None:
        """Puts back what the stream has given up, but for the row or batch that is refused."""
        stream, rows = session._stream, self._rows
        given_up = stream.queue.take_back() if stream is not None else []
        if not given_up or not error.field.startswith("measurements"):
            raise error
        assert stream is not None and rows is not None
        refused, row = given_up[0].request.measurements, refused_row(error)
        if self._is_kept(refused, error):
            self._handed_rows -= 1
            rows.late += 1
        else:
            self._count_refused(len(refused.time_s) if row is None else 1, error)
        others = [one.request.measurements for one in given_up[1:]]
        if row is not None and len(refused.time_s) > 1:
            others.insert(0, without_row(refused, row - given_up[0].first_row))
        for batch in others:
            stream.queue.add(batch)

    def _is_kept(self, refused: Measurements, error: InvalidInput) -> bool:
        """Whether a sample is refused because the session has it from an earlier bridge."""
        return (error.field == "measurements.timeS[0]" and len(refused.time_s) == 1
                and self._may_be_kept(refused.run[0] if refused.run else 0, refused.time_s[0]))

    def _count_refused(self, rows: int, error: InvalidInput) -> None:
        self.refused_rows += rows
        if not self._first_kept:
            raise error
        self._say_at_times("refused", f"rows are refused: {error.rule}")

    def _say_at_times(self, what: str, said: str) -> None:
        """Says what may go on for days, now and then."""
        now = time.monotonic()
        if now >= self._say_next.get(what, 0.0):
            self._say_next[what] = now + _SAID_EVERY_S
            self._say(said)

    def _close(self, session: Session) -> None:
        """Ends the stream once all is acknowledged."""
        self._send(session, session.flush)
        if self._configuration.session.end_run and self.sent_rows:
            self._send(session, session.end_run)
            self._state.forget()
        self.all_kept = True
        try:
            session.close()
        except Unavailable as error:
            self._say(f"all rows are kept, but there is no last estimate: {error}")
