"""A session of the daemon: a problem whose measurements arrive batch by batch."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Optional, TypeVar, Union

from polyest import _calls, _methods, estimates, info, results
from polyest._calls import Call
from polyest._measurements import MeasurementConverter, Measurements, split
from polyest._proto.v1 import estimate_pb2, session_service_pb2
from polyest._resume import StreamOptions
from polyest._session_file import SessionFileWriter
from polyest._stream import MeasurementStream
from polyest._table import Data
from polyest.estimates import Estimate
from polyest.problem import Problem, from_message
from polyest.results import prediction
from polyest.session_studies import SessionStudies

if TYPE_CHECKING:
    from polyest._transport import Transport

Result = TypeVar("Result")


class Session(SessionStudies):
    """A session, and the stream that this program writes to it.

    As a context manager it ends the stream, not the session: the daemon keeps a session until it is
    deleted, and `Client.session` goes on with it. One program writes to a session at a time. Use it
    from one thread.
    """

    def __init__(self, transport: Transport, created: session_service_pb2.Session,
                 units: Optional[Mapping[str, str]], options: StreamOptions,
                 on_estimate: Optional[Callable[[Estimate], None]]) -> None:
        """Use `Client.session`."""
        self._stream: Optional[MeasurementStream] = None
        super().__init__(transport, created, units or {})
        self._studies = SessionStudies(transport, created, self._units)
        self._options = options
        self._on_estimate = on_estimate
        self._converter = MeasurementConverter(created.problem, units,
                                               apart=created.reorder_window_s > 0,
                                               resumed=created if created.sample_count else None)
        self._any_kept = False  # of the rows before the present stream

    @property
    def name(self) -> str:
        """The session's name."""
        return self._resource.rpartition("/")[2]

    @property
    def problem(self) -> Problem:
        """The session's problem, as a copy: a session's problem never changes."""
        return from_message(self._problem_message)

    def info(self) -> info.SessionInfo:
        """Returns what the daemon says of the session: its batches, its load."""
        return info.session_of(self._transport.unary(
            _methods.GET_SESSION, session_service_pb2.GetSessionRequest(name=self._resource)))

    def append(self, data: Data, *, end_of_run: bool = False, wait: bool = True) -> int:
        """Adds rows, later than those before, and returns the number of the last batch.

        data: columns as in `Client.estimate`, or a `polyest.io.Recording`, which is read and sent
            batch by batch. Only the first data need the columns of all streamed inputs, and with a
            `reorder_window_s` none do. end_of_run: these are the last rows of their run.
        wait: return when the daemon keeps the rows. Otherwise return as soon as they are on their
            way, and wait for room only; then the next `append`, `flush`, `estimate` or the end of
            the `with` block reports what goes wrong. Rows that wait behind refused ones are not
            kept either; the message counts their batches.

        A lost connection is made again, and rows without acknowledgement are sent again: none is
        lost or counted twice. Raises Unavailable if all attempts fail; the rows are still pending
        then, and `flush` tries again. Any other PolyestError means that the rows were refused, and
        that those before them are kept. What `on_estimate` has raised is raised here, too, or by
        the next `flush`, `estimate`, study or `close`; it refuses no rows.
        """
        if not self._has_rows():
            self._converter.begin_anew()
        sequence = rows = 0
        for part in self._converter.convert_each(data, end_of_run=end_of_run):
            sequence = self._send(part, False, rows)
            rows += len(part.time_s)
        if wait:
            self.flush()
        elif self._stream is not None:
            self._stream.check()
        return sequence

    def end_run(self) -> None:
        """Says that the last row's run has no further rows.

        Until then, an estimate leaves out the last rows of a problem with interpolated streamed
        inputs: later samples shape the input there.
        """
        self._send(Measurements(end_of_run=True), True)

    def _send(self, measurements: Measurements, wait: bool, first_row: int = 0) -> int:
        if self._stream is None:
            tell = self._on_estimate and self._teller(self._on_estimate)
            self._stream = MeasurementStream(self._transport, self._resource, self._options, tell)
        self._stream.send(split(measurements, self._options.batch_rows), first_row)
        if wait:
            self._stream.flush()
        return self._stream.queue.last_sequence

    def _teller(self, on_estimate: Callable[[Estimate], None]
                ) -> Callable[[estimate_pb2.Estimate], None]:
        """Returns what the stream calls; it does not keep this object, which may be dropped."""
        studies = self._studies
        return lambda message: on_estimate(estimates.of_message(message, studies))

    def __del__(self) -> None:
        """Leaves the session to the next writer. Rows on their way are still sent."""
        if self._stream is not None and not sys.is_finalizing():
            self._stream.leave()

    def _has_rows(self) -> bool:
        """Whether rows that were appended to this object are kept, or on their way."""
        queue = self._stream.queue if self._stream is not None else None
        return self._any_kept or (queue is not None and (queue.any_kept or len(queue) > 0))

    def flush(self) -> None:
        """Waits until the daemon keeps all rows. Raises as `append`."""
        if self._stream is not None:
            self._stream.flush()

    def _settle(self) -> None:
        """Flushes before a question; to one of `on_estimate` the rows that are kept must do."""
        if self._stream is None or not self._stream.is_telling:
            self.flush()

    def close(self) -> None:
        """Ends the stream once all rows are kept. The session stays. Raises as `append`.

        If it raises Unavailable, rows are still pending, and `flush` or `close` tries again.
        """
        stream = self._stream
        if stream is not None:
            stream.finish()
            self._any_kept = self._has_rows()
            self._stream = None
            stream.check()

    def __enter__(self) -> Session:
        """Returns the session."""
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        """Ends the stream; after an exception without waiting for what is not kept yet."""
        if kind is None:
            self.close()
        elif self._stream is not None:
            self._any_kept = self._has_rows()
            stream, self._stream = self._stream, None
            stream.cancel()

    def estimate(self) -> Estimate:
        """Returns the estimate from all rows so far."""
        self._settle()
        return self._studies.estimate()

    def estimates(self, *, follow: bool = False) -> Iterator[Estimate]:
        """Yields the present estimate and then new ones, of which a slow loop gets the newest.

        Ends with the estimate that takes in the last batch of this moment; `follow` goes on until
        the loop is left or the session is deleted (NotFound).
        """
        self._settle()
        last = self.info().last_sequence
        if last == 0 and not follow:
            return
        request = session_service_pb2.WatchSessionRequest(session=self._resource)
        for response in self._transport.server_stream(_methods.WATCH_SESSION, request):
            if not response.HasField("estimate"):
                continue
            yield estimates.of_message(response.estimate, self._studies)
            if not follow and response.estimate.sequence >= last:
                return

    def predictions(self, outputs: Sequence[str] = (), *, draws: int = 0, max_rows: int = 0,
                    min_interval_s: float = 0) -> Iterator[results.Prediction]:
        """Yields predictions of the session's own record as estimates come, for a live picture.

        outputs: names of outputs and of parameters that drift; by default the measured outputs and
                what drifts. draws: trajectories, 2 … 10000
        (50). max_rows: evenly spaced ones of a longer record (200). min_interval_s: the least time
        from one to the next, s (1). The daemon spends at most a tenth of its time on them. Goes on
        until the loop is left or the session is deleted (NotFound).
        """
        self._settle()
        request = _calls.watch_predictions(self._resource, outputs, draws, max_rows,
                                           min_interval_s)
        for response in self._transport.server_stream(_methods.WATCH_SESSION, request):
            if response.HasField("prediction"):
                yield prediction.of_message(response.prediction)

    def export(self, file: Union[str, os.PathLike[str]]) -> None:
        """Writes the session to a file, as `polyest export`; `Client.import_session` reads it.

        Raises InvalidInput if the file cannot be written; one that was there is then as it was.
        """
        self._settle()
        request = session_service_pb2.ExportSessionRequest(name=self._resource)
        with SessionFileWriter(file) as writer:
            for record in self._transport.server_stream(_methods.EXPORT_SESSION, request):
                writer.write(record)

    def delete(self) -> None:
        """Deletes the session with its measurements."""
        if self._stream is not None:
            self._stream.cancel()
            self._stream = None
        self._transport.unary(_methods.DELETE_SESSION,
                              session_service_pb2.DeleteSessionRequest(name=self._resource))

    def _run(self, call: Call[Result]) -> Result:
        self._settle()
        return super()._run(call)

    def __repr__(self) -> str:
        return f"<polyest.Session '{self.name}' of {self._transport.options.server}>"
