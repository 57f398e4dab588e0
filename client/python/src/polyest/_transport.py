"""Makes synchronous calls over a channel, and turns their failures into exceptions."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Optional

import grpc

from polyest._calls import Call, Result
from polyest._connection import ConnectionOptions, open_channel
from polyest._methods import Method, Request, Response
from polyest.errors import FailedPrecondition

if TYPE_CHECKING:
    from polyest._stream import MeasurementStream


class Transport:
    """A channel to one daemon. Any thread may use it."""

    def __init__(self, options: ConnectionOptions) -> None:
        self.options = options
        self._closed = False
        #: Streams that were left or cancelled, by session: the next one takes over.
        self.left_streams: dict[str, MeasurementStream] = {}
        self._channel = open_channel(options)

    def close(self) -> None:
        """Ends all calls."""
        self._closed = True
        self._channel.close()

    def wait_until_connected(self, timeout_s: float) -> None:
        """Waits for a connection, for a while: without a call gRPC seldom looks after its own."""
        connected = grpc.channel_ready_future(self._open)
        with contextlib.suppress(grpc.FutureTimeoutError):
            connected.result(timeout=timeout_s)
        connected.cancel()

    @property
    def _open(self) -> grpc.Channel:
        """The channel. Raises FailedPrecondition after the client's end."""
        if self._closed:
            raise FailedPrecondition("the client is closed")
        return self._channel

    def unary(self, method: Method[Request, Response], request: Request,
              timeout_s: Optional[float] = None) -> Response:
        """Makes a call. Raises PolyestError."""
        encode: Any = method.request
        decode: Any = method.response
        call = self._open.unary_unary(method.path, encode.SerializeToString, decode.FromString)
        try:
            response: Response = call(request, metadata=self.options.metadata(),
                                      timeout=timeout_s or self.options.timeout_s)
        except grpc.RpcError as error:
            raise self.options.error_of(error, method.request) from None
        return response

    def run(self, call: Call[Result]) -> Result:
        """Makes a call and reads its answer. Raises PolyestError."""
        return call.read(self.unary(call.method, call.request))

    def server_stream(self, method: Method[Request, Response],
                      request: Request) -> Iterator[Response]:
        """Yields the answers of a call, which ends when the iterator is closed."""
        encode: Any = method.request
        decode: Any = method.response
        call = self._open.unary_stream(method.path, encode.SerializeToString, decode.FromString)(
            request, metadata=self.options.metadata())
        try:
            yield from call
        except grpc.RpcError as error:
            raise self.options.error_of(error, method.request) from None
        finally:
            call.cancel()

    def client_stream(self, method: Method[Request, Response],
                      requests: Iterator[Request]) -> Response:
        """Sends requests and returns the one answer.

        Raises PolyestError. If the iterator of the requests fails, the call is cancelled and its
        exception raised: requests that merely ended early might be accepted.
        """
        failures: list[Exception] = []
        begun = threading.Event()

        def until_failure() -> Iterator[Request]:
            try:
                yield from requests
            except Exception as failure:
                failures.append(failure)
                begun.wait()
                call.cancel()

        encode: Any = method.request
        decode: Any = method.response
        call = self._open.stream_unary(
            method.path, encode.SerializeToString, decode.FromString).future(
                until_failure(), metadata=self.options.metadata())
        begun.set()
        try:
            response: Response = call.result()
        except grpc.FutureCancelledError:
            raise failures[0] from None
        except grpc.RpcError as error:
            raise (failures[0] if failures
                   else self.options.error_of(error, method.request)) from None
        finally:
            call.cancel()  # has no effect on a call that has ended
        return response

    def open_stream(self, method: Method[Request, Response], requests: Iterator[Request]) -> Any:
        """Begins a call in both directions and returns it, an iterator over the answers."""
        encode: Any = method.request
        decode: Any = method.response
        return self._open.stream_stream(method.path, encode.SerializeToString, decode.FromString)(
            requests, metadata=self.options.metadata())
