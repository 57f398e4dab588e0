"""Makes asynchronous calls over a channel, and turns their failures into exceptions."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from typing import TYPE_CHECKING, Any

import grpc

from polyest._calls import Call, Result
from polyest._connection import ConnectionOptions
from polyest._methods import Method, Request, Response
from polyest.errors import FailedPrecondition

if TYPE_CHECKING:
    from polyest.aio.stream import MeasurementStream


class Transport:
    """A channel to one daemon, for the coroutines of one event loop."""

    def __init__(self, options: ConnectionOptions) -> None:
        self.options = options
        self._closed = False
        #: Streams that were left or cancelled, by session: the next one takes over.
        self.left_streams: dict[str, MeasurementStream] = {}
        credentials, arguments = options.credentials(), options.channel_arguments()
        if credentials is None:
            self._channel = grpc.aio.insecure_channel(options.server, options=arguments)
        else:
            self._channel = grpc.aio.secure_channel(options.server, credentials, options=arguments)

    async def close(self) -> None:
        """Ends all calls."""
        self._closed = True
        await self._channel.close()

    @property
    def _open(self) -> grpc.aio.Channel:
        """The channel. Raises FailedPrecondition after the client's end."""
        if self._closed:
            raise FailedPrecondition("the client is closed")
        return self._channel

    async def unary(self, method: Method[Request, Response], request: Request) -> Response:
        """Makes a call. Raises PolyestError."""
        encode: Any = method.request
        decode: Any = method.response
        call = self._open.unary_unary(method.path, encode.SerializeToString, decode.FromString)
        try:
            response: Response = await call(request, metadata=self.options.metadata(),
                                            timeout=self.options.timeout_s)
        except grpc.RpcError as error:
            raise self.options.error_of(error, method.request) from None
        return response

    async def run(self, call: Call[Result]) -> Result:
        """Makes a call and reads its answer. Raises PolyestError."""
        return call.read(await self.unary(call.method, call.request))

    async def server_stream(self, method: Method[Request, Response],
                            request: Request) -> AsyncIterator[Response]:
        """Yields the answers of a call, which ends when the iterator is closed."""
        encode: Any = method.request
        decode: Any = method.response
        call = self._open.unary_stream(method.path, encode.SerializeToString, decode.FromString)(
            request, metadata=self.options.metadata())
        try:
            async for response in call:
                yield response
        except grpc.RpcError as error:
            raise self.options.error_of(error, method.request) from None
        finally:
            call.cancel()

    async def client_stream(self, method: Method[Request, Response],
                            requests: Iterator[Request]) -> Response:
        """Sends requests and returns the one answer. Raises PolyestError."""
        encode: Any = method.request
        decode: Any = method.response
        call = self._open.stream_unary(method.path, encode.SerializeToString, decode.FromString)(
            metadata=self.options.metadata())
        try:
            for request in requests:
                await call.write(request)
            await call.done_writing()
            response: Response = await call
        except grpc.RpcError as error:
            raise self.options.error_of(error, method.request) from None
        finally:
            call.cancel()
        return response

    def open_stream(self, method: Method[Any, Any]) -> Any:
        """Begins a call in both directions and returns it."""
        return self._open.stream_stream(
            method.path, method.request.SerializeToString, method.response.FromString)(
            metadata=self.options.metadata())
