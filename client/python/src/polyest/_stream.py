"""Streams batches into a session over a connection that may break."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Optional

import grpc

from polyest import _methods
from polyest._proto.v1 import estimate_pb2, measurements_pb2, session_service_pb2
from polyest._resume import BatchQueue, Request, StreamOptions
from polyest.errors import FailedPrecondition, InternalError, PolyestError, Unavailable

if TYPE_CHECKING:
    from polyest._transport import Transport

Response = session_service_pb2.StreamMeasurementsResponse

# How long one attempt to connect again waits for the connection, s.
_READY_S = 1.0


class _Connection:
    """One call of StreamMeasurements: a thread of gRPC writes, a thread of its own reads."""

    def __init__(self, stream: MeasurementStream) -> None:
        """The caller holds the stream's lock."""
        self.done = False
        self.error: Optional[PolyestError] = None
        self.authorization = stream.transport.options.authorization()
        self._stream = stream
        self._call = stream.transport.open_stream(_methods.STREAM_MEASUREMENTS, self._requests())
        threading.Thread(target=self._read, name="polyest-stream", daemon=True).start()

    def cancel(self) -> None:
        self._call.cancel()

    def _requests(self) -> Iterator[Request]:
        stream = self._stream
        yield stream.queue.hello()
        while True:
            with stream.changed:
                request = None
                while request is None:
                    if self.done or stream.connection is not self:
                        return
                    request = stream.queue.next_to_write()
                    if request is None and stream.finishing:
                        return
                    if request is None:
                        stream.changed.wait()
            yield request

    def _read(self) -> None:
        error: Optional[PolyestError] = None
        try:
            for response in self._call:
                self._stream.take(self, response)
        except grpc.RpcError as failure:
            error = self._stream.transport.options.error_of(failure)
        with self._stream.changed:
            self.error, self.done = error, True
            self._stream.changed.notify_all()


class MeasurementStream:
    """Sends batches and keeps them until they are acknowledged. Use it from one thread."""

    def __init__(self, transport: Transport, session: str, options: StreamOptions,
                 on_estimate: Optional[Callable[[estimate_pb2.Estimate], None]] = None) -> None:
        """`on_estimate` is called from a thread of its own, one estimate at a time.

        This thread takes acknowledgements, too, so that `on_estimate` must not wait for them.
        """
        self.transport = transport
        before = transport.left_streams.pop(session, None)
        self._before: Optional[MeasurementStream] = before
        writer = before.queue.writer if before is not None else None
        self.queue: BatchQueue = BatchQueue(session, options, writer)
        self.changed = threading.Condition()
        self.connection: Optional[_Connection] = None
        self.finishing = False
        self._on_estimate = on_estimate
        self._telling: Optional[int] = None  # the thread that calls `on_estimate` at the moment
        self._raised: Optional[BaseException] = None  # by `on_estimate`

    @property
    def is_telling(self) -> bool:
        """Whether the caller has been called by `on_estimate`."""
        return self._telling == threading.get_ident()

    def take(self, connection: _Connection, response: Response) -> None:
        """Takes a message of the daemon; called by a connection."""
        if response.HasField("acknowledgement"):
            with self.changed:
                if connection is self.connection:
                    self.queue.acknowledge(response.acknowledgement.sequence)
                self.changed.notify_all()
        elif response.HasField("estimate") and self._on_estimate is not None:
            self._tell(self._on_estimate, response.estimate)

    def _tell(self, on_estimate: Callable[[estimate_pb2.Estimate], None],
              estimate: estimate_pb2.Estimate) -> None:
        """Calls `on_estimate`. What it raises must not end this thread, for which others wait."""
        self._telling = threading.get_ident()
        try:
            on_estimate(estimate)
        except BaseException as error:
            with self.changed:
                self._raised = self._raised or error
        finally:
            self._telling = None

    def check(self) -> None:
        """Raises what `on_estimate` has raised, once."""
        with self.changed:
            error, self._raised = self._raised, None
        if error is not None:
            raise error

    def _refuse_to_wait(self) -> None:
        if self.is_telling:
            raise FailedPrecondition(f"on_estimate must not write to {self.queue.session} or end "
                                     "its stream, which waits until it returns")

    def send(self, batches: Iterable[measurements_pb2.Measurements], first_row: int = 0) -> None:
        """Hands over batches, all of them; waits while too many are not acknowledged.

        first_row: of the batches, which follow each other, in the data that they were cut from.
        """
        self._refuse_to_wait()
        with self.changed:
            for batch in batches:
                self.queue.add(batch, first_row)
                first_row += len(batch.time_s)
            self.changed.notify_all()
            self._wait_until(lambda: not self.queue.full)

    def flush(self) -> None:
        """Waits until all batches are acknowledged. Raises what `on_estimate` has raised, too."""
        self._refuse_to_wait()
        with self.changed:
            self._wait_until(lambda: len(self.queue) == 0)
        self.check()

    def finish(self) -> None:
        """Ends the stream once all batches are acknowledged and the last estimate is made.

        After a failure the stream goes on: what is pending can be tried again.
        """
        self._refuse_to_wait()
        with self.changed:
            self.finishing = True
            self.changed.notify_all()
            try:
                self._wait_until_ended()
            except PolyestError:
                self.finishing = False
                raise

    def leave(self) -> None:
        """Ends the stream without waiting.

        The next one of this program takes over from it, once all batches are acknowledged.
        """
        with self.changed:
            if self.connection is not None and not self.connection.done:
                self.transport.left_streams[self.queue.session] = self
                self.finishing = True
                self.changed.notify_all()

    def _wait_until_sent(self) -> None:
        """Waits until all batches of a stream that was left are acknowledged, or it has ended."""
        with self.changed:
            while self.connection is not None and not self.connection.done and len(self.queue):
                self.changed.wait()

    def cancel(self) -> None:
        """Ends the stream at once; batches without acknowledgement may be lost."""
        self._refuse_to_wait()
        with self.changed:
            connection, self.finishing = self.connection, True
            if connection is not None:
                # The daemon may hold the connection for a while: the next stream takes over.
                self.transport.left_streams[self.queue.session] = self
                connection.cancel()
                while not connection.done:
                    self.changed.wait()

    def _wait_until(self, ready: Callable[[], bool]) -> None:
        """Keeps the connection up until a condition holds. The caller has the lock."""
        while True:
            if self.connection is None:
                self._connect_again(None)
            elif self.connection.done:
                self._connect_again(self._failure())
            elif ready():
                return
            else:
                self.changed.wait()

    def _wait_until_ended(self) -> None:
        """Connects again until the daemon has ended the stream. The caller has the lock."""
        while True:
            if self.connection is None:
                self._connect_again(None)
            elif not self.connection.done:
                self.changed.wait()
            elif self.connection.error is None and len(self.queue) == 0:
                return
            else:
                self._connect_again(self._failure())

    def _failure(self) -> PolyestError:
        assert self.connection is not None
        return self.connection.error or InternalError(
            "the daemon closed the stream before all batches were sent")

    def _connect_again(self, error: Optional[PolyestError]) -> None:
        """Connects, again after `error`. The caller has the lock, which is released to wait."""
        while True:
            if error is not None:
                self._wait_after(error)
            try:
                self._connect(again=error is not None)
                return
            except PolyestError as failure:
                error = failure

    def _wait_after(self, error: PolyestError) -> None:
        changed = (self.connection is not None and
                   self.connection.authorization != self.transport.options.authorization())
        delay = self.queue.delay_s(error, new_token=changed)
        if delay is None:
            self._give_up(error)
        self.changed.wait(delay)

    def _give_up(self, error: PolyestError) -> None:
        """Raises `error`. Batches stay pending only where waiting longer may help."""
        final = self.queue.final(error)
        if isinstance(final, Unavailable):
            self.queue.start_over()
        else:
            self.queue.give_up(final)
            self.connection = None
        raise final

    def _connect(self, *, again: bool) -> None:
        self.changed.release()
        try:
            if self._before is not None:
                self._before._wait_until_sent()
                self._before = None
            if again:
                self.transport.wait_until_connected(_READY_S)
            found = self.transport.unary(_methods.GET_SESSION,
                                         session_service_pb2.GetSessionRequest(
                                             name=self.queue.session, omit_problem=True))
        finally:
            self.changed.acquire()
        self.queue.connected(found.last_sequence)
        self.connection = _Connection(self)
