"""A session of the daemon, for asyncio; see `polyest.Session`."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from types import TracebackType
from typing import Optional, TypeVar

from polyest import _calls, _methods, estimates, info, results
from polyest._calls import Call, Subject
from polyest._connection import File
from polyest._measurements import MeasurementConverter, Measurements, split
from polyest._proto.v1 import estimate_pb2, problem_pb2, session_service_pb2
from polyest._resume import StreamOptions
from polyest._session_file import SessionFileWriter
from polyest._table import Data
from polyest.aio.stream import MeasurementStream
from polyest.aio.studies import Studies
from polyest.aio.transport import Transport
from polyest.estimates import Estimate
from polyest.problem import Problem, from_message
from polyest.results import prediction

Result = TypeVar("Result")


def _teller(on_estimate: Callable[[Estimate], None]) -> Callable[[estimate_pb2.Estimate], None]:
    """Returns what a stream calls; it does not keep the session, which may be dropped."""
    return lambda message: on_estimate(estimates.of_message(message))


class Session(Studies):
    """A session, and the stream that this program writes to it; as `polyest.Session`."""

    def __init__(self, transport: Transport, created: session_service_pb2.Session,
                 units: Optional[Mapping[str, str]], options: StreamOptions,
                 on_estimate: Optional[Callable[[Estimate], None]]) -> None:
        """Use `Client.session`."""
        self._stream: Optional[MeasurementStream] = None
        self._transport = transport
        self._resource = created.name
        self._problem_message = created.problem
        self._units = units or {}
        self._options = options
        self._on_estimate = on_estimate
        self._converter = MeasurementConverter(created.problem, units,
                                               apart=created.reorder_window_s > 0,
                                               resumed=created if created.sample_count else None)
        self._any_kept = False  # of the rows before the present stream
        # Tasks may share a session; its stream is one task's at a time.
        self._turn = asyncio.Lock()

    @property
    def name(self) -> str:
        """The session's name."""
        return self._resource.rpartition("/")[2]

    @property
    def problem(self) -> Problem:
        """The session's problem, as a copy: a session's problem never changes."""
        return from_message(self._problem_message)

    async def info(self) -> info.SessionInfo:
        """Returns what the daemon says of the session: its batches, its load."""
        return info.session_of(await self._transport.unary(
            _methods.GET_SESSION, session_service_pb2.GetSessionRequest(name=self._resource)))

    async def append(self, data: Data, *, end_of_run: bool = False, wait: bool = True) -> int:
        """Adds rows and returns the number of the last batch; as `polyest.Session.append`."""
        if not self._has_rows():
            self._converter.begin_anew()
        sequence = rows = 0
        for part in self._converter.convert_each(data, end_of_run=end_of_run):
            sequence = await self._send(part, False, rows)
            rows += len(part.time_s)
        if wait:
            await self.flush()
        elif self._stream is not None:
            self._stream.check()
        return sequence

    async def end_run(self) -> None:
        """Says that the last row's run has no further rows."""
        await self._send(Measurements(end_of_run=True), True)

    async def _send(self, measurements: Measurements, wait: bool, first_row: int = 0) -> int:
        async with self._turn:
            if self._stream is None:
                tell = self._on_estimate and _teller(self._on_estimate)
                self._stream = MeasurementStream(self._transport, self._resource, self._options,
                                                 tell)
            await self._stream.send(split(measurements, self._options.batch_rows), first_row)
            if wait:
                await self._stream.flush()
            return self._stream.queue.last_sequence

    def __del__(self) -> None:
        """Leaves the session to the next writer. Rows on their way are still sent."""
        if self._stream is not None:
            self._stream.leave()

    def _has_rows(self) -> bool:
        """Whether rows that were appended to this object are kept, or on their way."""
        queue = self._stream.queue if self._stream is not None else None
        return self._any_kept or (queue is not None and (queue.any_kept or len(queue) > 0))

    async def flush(self) -> None:
        """Waits until the daemon keeps all rows."""
        async with self._turn:
            if self._stream is not None:
                await self._stream.flush()

    async def close(self) -> None:
        """Ends the stream once all rows are kept. The session stays."""
        async with self._turn:
            stream = self._stream
            if stream is not None:
                await stream.finish()
                self._any_kept = self._has_rows()
                self._stream = None
                stream.check()

    async def __aenter__(self) -> Session:
        """Returns the session."""
        return self

    async def __aexit__(self, kind: Optional[type[BaseException]],
                        error: Optional[BaseException],
                        traceback: Optional[TracebackType]) -> None:
        """Ends the stream; after an exception without waiting for what is not kept yet."""
        if kind is None:
            await self.close()
        elif self._stream is not None:
            self._any_kept = self._has_rows()
            stream, self._stream = self._stream, None
            await stream.cancel()

    async def estimate(self) -> Estimate:
        """Returns the estimate from all rows so far."""
        return await self._run(_calls.get_estimate(self._resource, None))

    async def estimates(self, *, follow: bool = False) -> AsyncIterator[Estimate]:
        """Yields the present estimate and then new ones; as `polyest.Session.estimates`."""
        await self.flush()
        last = (await self.info()).last_sequence
        if last == 0 and not follow:
            return
        request = session_service_pb2.WatchSessionRequest(session=self._resource)
        responses = self._transport.server_stream(_methods.WATCH_SESSION, request)
        async for response in responses:
            if not response.HasField("estimate"):
                continue
            yield estimates.of_message(response.estimate)
            if not follow and response.estimate.sequence >= last:
                return

    async def predictions(self, outputs: Sequence[str] = (), *, draws: int = 0, max_rows: int = 0,
                          min_interval_s: float = 0) -> AsyncIterator[results.Prediction]:
        """Yields predictions as estimates come; as `polyest.Session.predictions`."""
        await self.flush()
        request = _calls.watch_predictions(self._resource, outputs, draws, max_rows,
                                           min_interval_s)
        async for response in self._transport.server_stream(_methods.WATCH_SESSION, request):
            if response.HasField("prediction"):
                yield prediction.of_message(response.prediction)

    async def history(self) -> results.History:
        """Returns how the session's estimates came about: at most 512 of them and the newest."""
        return await self._run(_calls.get_history(self._resource))

    async def export(self, file: File) -> None:
        """Writes the session to a file, as `polyest export`."""
        await self.flush()
        request = session_service_pb2.ExportSessionRequest(name=self._resource)
        with SessionFileWriter(file) as writer:
            async for record in self._transport.server_stream(_methods.EXPORT_SESSION, request):
                writer.write(record)

    async def delete(self) -> None:
        """Deletes the session with its measurements."""
        if self._stream is not None:
            await self._stream.cancel()
            self._stream = None
        await self._transport.unary(_methods.DELETE_SESSION,
                                    session_service_pb2.DeleteSessionRequest(name=self._resource))

    def _subject(self) -> Subject:
        return _calls.subject_of_session(self._resource)

    def _problem(self) -> problem_pb2.Problem:
        return self._problem_message

    async def _run(self, call: Call[Result]) -> Result:
        await self.flush()
        return await self._transport.run(call)

    def __repr__(self) -> str:
        return f"<polyest.aio.Session '{self.name}' of {self._transport.options.server}>"
