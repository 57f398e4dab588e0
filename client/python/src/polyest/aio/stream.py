"""Streams batches into a session over a connection that may break, for asyncio."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import Optional

import grpc

from polyest import _methods
from polyest._proto.v1 import estimate_pb2, measurements_pb2, session_service_pb2
from polyest._resume import BatchQueue, Request, StreamOptions
from polyest.aio.transport import Transport
from polyest.errors import Aborted, Cancelled, InternalError, PolyestError, Unavailable

# What gRPC says if a call ends while it writes, whatever the reason of the daemon was.
_HIDDEN = "Internal error from Core"


class _Connection:
    """One call of StreamMeasurements: a task writes, a task reads."""

    def __init__(self, stream: MeasurementStream) -> None:
        self.done = False
        self.error: Optional[PolyestError] = None
        self.authorization = stream.transport.options.authorization()
        self._stream = stream
        self._call = stream.transport.open_stream(_methods.STREAM_MEASUREMENTS)
        self.reading = asyncio.ensure_future(self._read())
        self.writing = asyncio.ensure_future(self._write())

    def cancel(self) -> None:
        self._call.cancel()

    async def _write(self) -> None:
        stream = self._stream
        try:
            request: Optional[Request] = stream.queue.hello()
            while request is not None:
                await self._call.write(request)
                await stream.wait_for(lambda: self.done or stream.finishing
                                      or stream.queue.has_unwritten)
                request = None if self.done else stream.queue.next_to_write()
            if not self.done:
                await self._call.done_writing()
        except (grpc.RpcError, asyncio.InvalidStateError, asyncio.CancelledError):
            pass  # the reader learns why

    async def _read(self) -> None:
        try:
            async for response in self._call:
                await self._stream.take(response)
        except grpc.RpcError as failure:
            self.error = self._stream.transport.options.error_of(failure)
            if isinstance(self.error, InternalError) and self.error.message == _HIDDEN:
                self.error = Unavailable("the connection broke")
                self._stream.reason_is_hidden = True
        except asyncio.CancelledError:
            self.error = Cancelled("the stream was cancelled")
        self.done = True
        await self._stream.notify()


class MeasurementStream:
    """Sends batches and keeps them until they are acknowledged. Use it from one task at a time."""

    def __init__(self, transport: Transport, session: str, options: StreamOptions,
                 on_estimate: Optional[Callable[[estimate_pb2.Estimate], None]] = None) -> None:
        self.transport = transport
        before = transport.left_streams.pop(session, None)
        self._before: Optional[MeasurementStream] = before
        writer = before.queue.writer if before is not None else None
        self.queue: BatchQueue = BatchQueue(session, options, writer)
        self.finishing = False
        #: Whether gRPC has hidden why the daemon ended the last connection.
        self.reason_is_hidden = False
        self._connection: Optional[_Connection] = None
        self._on_estimate = on_estimate
        self._raised: Optional[Exception] = None  # by `on_estimate`
        self._changed = asyncio.Condition()
        self._loop = asyncio.get_running_loop()

    async def wait_for(self, condition: Callable[[], bool]) -> None:
        """Waits until a condition holds."""
        async with self._changed:
            await self._changed.wait_for(condition)

    async def notify(self) -> None:
        """Says that something has changed."""
        async with self._changed:
            self._changed.notify_all()

    async def take(self, response: session_service_pb2.StreamMeasurementsResponse) -> None:
        """Takes a message of the daemon; called by a connection."""
        if response.HasField("acknowledgement"):
            self.queue.acknowledge(response.acknowledgement.sequence)
            await self.notify()
        elif response.HasField("estimate") and self._on_estimate is not None:
            self._tell(self._on_estimate, response.estimate)

    def _tell(self, on_estimate: Callable[[estimate_pb2.Estimate], None],
              estimate: estimate_pb2.Estimate) -> None:
        """Calls `on_estimate`. What it raises must not end the reader, for which others wait."""
        try:
            on_estimate(estimate)
        except Exception as error:
            self._raised = self._raised or error

    def check(self) -> None:
        """Raises what `on_estimate` has raised, once."""
        error, self._raised = self._raised, None
        if error is not None:
            raise error

    async def send(self, batches: Iterable[measurements_pb2.Measurements],
                   first_row: int = 0) -> None:
        """Hands over batches, all of them; waits while too many are not acknowledged.

        first_row: of the batches, which follow each other, in the data that they were cut from.
        """
        for batch in batches:
            self.queue.add(batch, first_row)
            first_row += len(batch.time_s)
        await self.notify()
        await self._wait_until(lambda: not self.queue.full)

    async def flush(self) -> None:
        """Waits until all batches are acknowledged. Raises what `on_estimate` has raised, too."""
        await self._wait_until(lambda: len(self.queue) == 0)
        self.check()

    async def finish(self) -> None:
        """Ends the stream once all batches are acknowledged and the last estimate is made.

        After a failure the stream goes on: what is pending can be tried again.
        """
        self.finishing = True
        await self.notify()
        try:
            await self._wait_until_ended()
        except PolyestError:
            self.finishing = False
            raise

    async def _wait_until_ended(self) -> None:
        """Connects again until the daemon has ended the stream."""
        while True:
            connection = self._connection
            if connection is None:
                await self._connect_again(None)
            elif not connection.done:
                await self._wait_for_end(connection)
            elif connection.error is None and len(self.queue) == 0:
                await connection.writing
                return
            else:
                await self._connect_again(self._failure(connection))

    def leave(self) -> None:
        """Ends the stream without waiting.

        The next one of this program takes over from it, once all batches are acknowledged. Any
        thread may call it, since objects may be dropped in any.
        """
        connection = self._connection
        if connection is None or connection.done or self._loop.is_closed():
            return
        self.transport.left_streams[self.queue.session] = self
        self.finishing = True
        self._loop.call_soon_threadsafe(lambda: self._loop.create_task(self.notify()))

    async def _wait_until_sent(self) -> None:
        """Waits until all batches of a stream that was left are acknowledged, or it has ended."""
        connection = self._connection
        await self.wait_for(lambda: connection is None or connection.done or not len(self.queue))

    async def cancel(self) -> None:
        """Ends the stream at once; batches without acknowledgement may be lost."""
        connection, self.finishing = self._connection, True
        if connection is not None:
            # The daemon may hold the connection for a while: the next stream takes over from it.
            self.transport.left_streams[self.queue.session] = self
            connection.cancel()
            await asyncio.gather(connection.reading, connection.writing)

    async def _wait_until(self, ready: Callable[[], bool]) -> None:
        """Keeps the connection up until a condition holds."""
        while True:
            connection = self._connection
            if connection is None:
                await self._connect_again(None)
            elif connection.done:
                await self._connect_again(self._failure(connection))
            elif ready():
                return
            else:
                await self._wait_for_end(connection, ready)

    async def _wait_for_end(self, connection: _Connection,
                            ready: Callable[[], bool] = lambda: False) -> None:
        """Waits until the connection is done or a condition holds."""
        await self.wait_for(lambda: connection.done or ready())

    @staticmethod
    def _failure(connection: _Connection) -> PolyestError:
        return connection.error or InternalError(
            "the daemon closed the stream before all batches were sent")

    async def _connect_again(self, error: Optional[PolyestError]) -> None:
        while True:
            if error is not None:
                await self._wait_after(error)
            try:
                await self._connect()
                return
            except PolyestError as failure:
                error = failure

    async def _wait_after(self, error: PolyestError) -> None:
        changed = (self._connection is not None and
                   self._connection.authorization != self.transport.options.authorization())
        delay = self.queue.delay_s(error, new_token=changed)
        if delay is None:
            self._give_up(error)
        else:
            await asyncio.sleep(delay)

    def _give_up(self, error: PolyestError) -> None:
        """Raises `error`. Batches stay pending only where waiting longer may help."""
        final = self.queue.final(error)
        if isinstance(final, Unavailable):
            self.queue.start_over()
        else:
            self.queue.give_up(final)
            self._connection = None
        raise final

    async def _connect(self) -> None:
        if self._before is not None:
            await self._before._wait_until_sent()
            self._before = None
        found = await self.transport.unary(
            _methods.GET_SESSION, session_service_pb2.GetSessionRequest(
                name=self.queue.session, omit_problem=True))
        self.queue.connected(found.last_sequence)
        if self.reason_is_hidden:
            if found.activity.has_writer:
                raise Aborted(f"{self.queue.session} has a writer already")
            await self._add_first()
        self._connection = _Connection(self)

    async def _add_first(self) -> None:
        """Adds the first batch by a call of its own, which tells if the daemon refuses it."""
        first = self.queue.first
        if first is not None:
            await self.transport.unary(
                _methods.ADD_MEASUREMENTS, session_service_pb2.AddMeasurementsRequest(
                    session=first.session, sequence=first.sequence,
                    measurements=first.measurements))
            self.queue.acknowledge(first.sequence)
        self.reason_is_hidden = False
