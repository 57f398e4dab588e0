"""The bridge: a source, a session that it feeds, and where the estimates go."""

from __future__ import annotations

import datetime
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Optional

from polyest._measurements import MeasurementConverter
from polyest._parameters import ParameterNames
from polyest._table import refuse
from polyest.bridge._configuration import Configuration
from polyest.bridge._feeder import Feeder
from polyest.bridge._publishers import CanOutlet, publisher_of
from polyest.bridge._sources import source_of
from polyest.bridge._values import in_words
from polyest.client import Client
from polyest.connecting import connect
from polyest.estimates import Estimate
from polyest.io._choices import unknown
from polyest.problem import Problem, to_message

# How often the main thread looks for the end, s.
_POLL_S = 0.1

# How long the end may take beyond the configured time, s: for attempts that have begun.
_GRACE_S = 10.0


@dataclass(frozen=True)
class Counts:
    """What a bridge has done so far."""

    #: Rows handed to the session, without those that the daemon refused.
    rows: int
    #: Samples in the queue.
    queued: int
    #: Batches that the daemon has not acknowledged yet.
    unacknowledged: int
    #: Frames that the kernel dropped, since they were not read in time.
    lost: int
    #: Samples left out because the queue was full.
    dropped: int
    #: Samples left out because they came too late.
    late: int
    #: Samples left out because their channel has another one at the same time.
    repeated: int
    #: Frames left out because they cannot be decoded.
    undecodable: int
    #: Rows that the daemon refused.
    refused: int
    #: Values sent as the limit of their CAN signal.
    saturated: int
    #: How often the stream to the daemon was made again.
    daemon_reconnects: int
    #: How often the source was opened again.
    source_reconnects: int
    #: How often publishers were opened again.
    publisher_reconnects: int
    #: Estimates sent by publishers.
    published: int
    #: Runs begun because the clock was set back, or after a gap.
    new_runs: int


class Bridge:
    """Streams measurements into a session and publishes its estimates, until it is stopped."""

    def __init__(self, configuration: Configuration) -> None:
        """Checks everything that needs no connection.

        Raises InvalidInput, which names the field of the configuration, and ImportError without
        the packages for it.
        """
        self._configuration = configuration
        self._problem = Problem.read(configuration.session.problem)
        message = to_message(self._problem)
        _check_channels(configuration.channels, MeasurementConverter(message))
        self._source = source_of(configuration, self.say)
        names = ParameterNames(message)
        self._publishers = [
            publisher_of(number, target, configuration.session.name, names, self.say)
            for number, target in enumerate(configuration.targets)]
        self._client = _connect(configuration)
        self._feeder = Feeder(self._client, configuration, self._problem, self._source,
                              self._take, self.say)
        self._latest: Optional[Estimate] = None
        self._failure: Optional[BaseException] = None

    def say(self, what: str) -> None:
        """Writes a line on the standard error output."""
        now = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
        print(f"{now} polyest-bridge: {what}", file=sys.stderr, flush=True)

    @property
    def latest(self) -> Optional[Estimate]:
        """The newest estimate; None before the first."""
        return self._latest

    def counts(self) -> Counts:
        """Returns what it has done so far."""
        rows = self._feeder.rows
        return Counts(
            rows=self._feeder.sent_rows, queued=self._feeder.queued,
            unacknowledged=self._feeder.unacknowledged,
            lost=self._source.lost, dropped=self._feeder.dropped,
            late=rows.late if rows is not None else 0,
            repeated=rows.repeated if rows is not None else 0,
            undecodable=self._source.undecodable, refused=self._feeder.refused_rows,
            saturated=sum(one.outlet.saturated for one in self._publishers
                          if isinstance(one.outlet, CanOutlet)),
            daemon_reconnects=self._feeder.reconnects, source_reconnects=self._source.reconnects,
            publisher_reconnects=sum(one.reconnects for one in self._publishers),
            published=sum(one.sent for one in self._publishers),
            new_runs=rows.new_runs if rows is not None else 0)

    def run(self, stop: threading.Event) -> int:
        """Works until `stop` is set or the source ends.

        Returns 0, or 1 after a failure or if rows were refused or not acknowledged in the end.
        """
        for publisher in self._publishers:
            publisher.start()
        self._feeder.start()
        ending = threading.Event()
        reader = threading.Thread(target=self._read, args=(ending,), name="polyest-source",
                                  daemon=True)
        reader.start()
        self._watch(stop, reader)
        ending.set()
        reader.join(5.0)
        self._feeder.end()
        self._feeder.join(self._configuration.end_timeout_s + _GRACE_S)
        for publisher in self._publishers:
            publisher.end()
        return self._finish()

    def _read(self, ending: threading.Event) -> None:
        try:
            self._source.run(self._feeder.put, ending)
        except BaseException as error:  # the main thread says it
            self._failure = error

    def _watch(self, stop: threading.Event, reader: threading.Thread) -> None:
        """Writes lines of status until the end."""
        interval = self._configuration.status_interval_s
        due, rows = time.monotonic() + interval, 0
        while reader.is_alive() and self._feeder.is_alive() and not stop.wait(_POLL_S):
            if interval and time.monotonic() >= due:
                due += interval
                now = self.counts()
                self.say(self.status(now, (now.rows - rows) / interval))
                rows = now.rows

    def status(self, counts: Counts, rate: Optional[float] = None) -> str:
        """Returns the line of status."""
        parts = [f"{counts.rows} rows" + (f" ({rate:.0f}/s)" if rate is not None else ""),
                 f"queue {counts.queued}/{self._configuration.queue}",
                 f"{counts.unacknowledged} batches unacknowledged"]
        last = self._source.last
        if last is not None and time.monotonic() - last > 2.0:
            parts.append(f"no sample for {time.monotonic() - last:.0f} s")
        latest = self._latest
        if latest is not None:
            parts.append(f"estimate at t = {latest.time:.2f} s: {in_words(latest)}")
        parts.append(f"{counts.published} published")
        for what, found in (
                ("reconnects", {"daemon": counts.daemon_reconnects,
                                "source": counts.source_reconnects,
                                "publishers": counts.publisher_reconnects}),
                ("left out", {"lost": counts.lost, "dropped": counts.dropped, "late": counts.late,
                              "repeated": counts.repeated, "undecodable": counts.undecodable,
                              "refused": counts.refused}),
                ("", {"saturated": counts.saturated, "new runs": counts.new_runs})):
            said = ", ".join(f"{name} {number}" for name, number in found.items() if number)
            if said:
                parts.append(f"{what}: {said}" if what else said)
        return "; ".join(parts)

    def _take(self, estimate: Estimate) -> None:
        self._latest = estimate
        for publisher in self._publishers:
            publisher.offer(estimate)

    def _finish(self) -> int:
        counts = self.counts()
        self.say(self.status(counts))
        failure = self._failure or self._feeder.error
        if failure is not None:
            self.say(f"ended by a failure: {failure}")
        if counts.refused:
            self.say(f"{counts.refused} rows were refused and are not kept")
        if counts.unacknowledged:
            self.say(f"{counts.unacknowledged} batches were not acknowledged and are lost")
        if self._feeder.is_alive():
            self.say("no rows wait any more, but the last estimate is not computed in time"
                     if self._feeder.all_kept else "the daemon does not answer")
        self._client.close()
        return 0 if failure is None and self._feeder.all_kept and not counts.refused else 1


def _check_channels(channels: Mapping[str, Any], converter: MeasurementConverter) -> None:
    """Raises InvalidInput unless the channels are those of the problem."""
    for name in channels:
        if name not in converter.names:
            raise unknown("channels", "output, input or condition of the problem", name,
                          converter.names)
    for name in converter.inputs:
        if name not in channels:
            raise refuse("channels", f"the problem's input '{name}' is streamed and has no channel")
    if not set(channels) - set(converter.inputs):
        raise refuse("channels", "none is a measured output")


def _connect(configuration: Configuration) -> Client:
    daemon = configuration.daemon
    return connect(daemon.server, token_file=daemon.token_file, ca=daemon.ca,
                   certificate=daemon.certificate, key=daemon.key, server_name=daemon.server_name)
