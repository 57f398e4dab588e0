"""A connection to a daemon, for asyncio; see `polyest.Client`."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping
from types import TracebackType
from typing import Any, Optional, TypeVar

from polyest import _calls, _methods, check, info, results
from polyest._calls import Call, Subject
from polyest._connection import ConnectionOptions, File
from polyest._measurements import MeasurementConverter, Measurements
from polyest._proto.v1 import (
    model_service_pb2,
    problem_pb2,
    problem_service_pb2,
    session_service_pb2,
    status_service_pb2,
)
from polyest._resume import StreamOptions, options_of
from polyest._table import Data
from polyest.aio.session import Session
from polyest.aio.studies import Studies
from polyest.aio.transport import Transport
from polyest.client import created_or_same
from polyest.errors import AlreadyExists
from polyest.estimates import Estimate
from polyest.problem import ProblemLike, to_message

Result = TypeVar("Result")


class Experiment(Studies):
    """A problem and its measurements, which go to the daemon with each question."""

    def __init__(self, transport: Transport, message: problem_pb2.Problem,
                 measurements: Optional[Measurements],
                 units: Optional[Mapping[str, str]]) -> None:
        """Use `Client.experiment`."""
        self._transport = transport
        self._message = message
        self._measurements = measurements
        self._units = units or {}

    async def estimate(self) -> Estimate:
        """Returns the estimate from all measurements."""
        return await self._run(_calls.compute_estimate(self._subject(), None))

    async def history(self, points: int = 30) -> results.History:
        """Returns how the estimate comes about: estimates from the first rows alone."""
        return await self._run(_calls.compute_history(self._subject(), points))

    def _subject(self) -> Subject:
        return _calls.subject_of_experiment(self._message, self._measurements)

    def _problem(self) -> problem_pb2.Problem:
        return self._message

    async def _run(self, call: Call[Result]) -> Result:
        return await self._transport.run(call)


class Client:
    """A connection to a daemon; make it with `polyest.aio.connect` or `polyest.aio.local`.

    Arguments, results and errors are those of `polyest.Client`.
    """

    def __init__(self, options: ConnectionOptions) -> None:
        """Use `polyest.aio.connect`."""
        self._transport = Transport(options)

    @property
    def server(self) -> str:
        """HOST:PORT of the daemon."""
        return self._transport.options.server

    async def close(self) -> None:
        """Ends the connection and all calls."""
        await self._transport.close()

    async def __aenter__(self: Self) -> Self:
        """Returns the client."""
        return self

    async def __aexit__(self, kind: Optional[type[BaseException]],
                        error: Optional[BaseException],
                        traceback: Optional[TracebackType]) -> None:
        """Closes the client."""
        await self.close()

    async def estimate(self, problem: ProblemLike, data: Data, *,
                       units: Optional[Mapping[str, str]] = None) -> Estimate:
        """Returns the estimate of a problem's uncertain parameters from measurements."""
        return await self.experiment(problem, data, units=units).estimate()

    def experiment(self, problem: ProblemLike, data: Optional[Data] = None, *,
                   units: Optional[Mapping[str, str]] = None) -> Experiment:
        """Returns a problem with its measurements, of which all studies can be asked."""
        message = to_message(problem)
        converter = MeasurementConverter(message, units)
        return Experiment(self._transport, message,
                          None if data is None else converter.convert(data), units)

    async def check(self, problem: ProblemLike, data: Optional[Data] = None, *,
                    units: Optional[Mapping[str, str]] = None) -> check.Check:
        """Returns all errors and warnings of a problem, and of data up to the first error."""
        found = _calls.check_problem(problem, data, units)
        return found if isinstance(found, check.Check) else await self._transport.run(found)

    async def session(self, name: str, problem: Optional[ProblemLike] = None, *,
                      units: Optional[Mapping[str, str]] = None,
                      on_estimate: Optional[Callable[[Estimate], None]] = None,
                      options: Optional[StreamOptions] = None,
                      reorder_window_s: Optional[float] = None) -> Session:
        """Opens a session; creates it if it does not exist and a problem is given.

        on_estimate: called in the event loop with each estimate of the stream. What it raises, the
            next `append`, `flush` or `close` raises.
        """
        options = options_of(options, on_estimate)
        if problem is None:
            created = await self._get_session(name)
        else:
            message = to_message(problem)
            MeasurementConverter(message, units)  # refuses wrong units before there is a session
            try:
                created = await self._transport.unary(
                    _methods.CREATE_SESSION,
                    _calls.create_session(name, message, reorder_window_s))
            except AlreadyExists:
                created = created_or_same(name, message, reorder_window_s,
                                          await self._get_session(name))
        return Session(self._transport, created, units, options, on_estimate)

    async def _get_session(self, name: str) -> session_service_pb2.Session:
        return await self._transport.unary(
            _methods.GET_SESSION, session_service_pb2.GetSessionRequest(name=f"sessions/{name}"))

    async def sessions(self) -> list[info.SessionInfo]:
        """Returns the sessions of the caller's tenant, in the order of their names."""
        return [info.session_of(one) async for one in self._pages(
            _methods.LIST_SESSIONS, session_service_pb2.ListSessionsRequest, "sessions")]

    async def delete_session(self, name: str) -> None:
        """Deletes a session with its measurements. Raises NotFound."""
        await self._transport.unary(
            _methods.DELETE_SESSION,
            session_service_pb2.DeleteSessionRequest(name=f"sessions/{name}"))

    async def import_session(self, file: File, name: str = "") -> Session:
        """Creates a session from a file of `Session.export` or `polyest export`."""
        created = await self._transport.client_stream(_methods.IMPORT_SESSION,
                                                _calls.import_session(name, file))
        return await self.session(created.name.rpartition("/")[2])

    async def models(self) -> dict[str, info.Model]:
        """Returns the models that problems can name: the built-in ones, then FMUs."""
        found = [info.model_of(one) async for one in self._pages(
            _methods.LIST_MODELS, model_service_pb2.ListModelsRequest, "models")]
        return {one.name: one for one in found}

    async def model(self, name: str) -> info.Model:
        """Returns one model. Raises NotFound."""
        return info.model_of(await self._transport.unary(
            _methods.GET_MODEL, model_service_pb2.GetModelRequest(name=f"models/{name}")))

    async def problem_schema(self) -> str:
        """Returns the JSON Schema of problem files, as text, for editors."""
        answer = await self._transport.unary(_methods.GET_PROBLEM_SCHEMA,
                                             problem_service_pb2.GetProblemSchemaRequest())
        return answer.json_schema

    async def status(self) -> info.DaemonStatus:
        """Returns the daemon's version, load and memory."""
        return info.status_of(await self._transport.unary(_methods.GET_STATUS,
                                                          status_service_pb2.GetStatusRequest()))

    async def _pages(self, method: _methods.Method[Any, Any], request: Any,
                     field: str) -> AsyncIterator[Any]:
        token = ""
        while True:
            page = await self._transport.unary(method, request(page_size=200, page_token=token))
            for one in getattr(page, field):
                yield one
            token = page.next_page_token
            if not token:
                return

    def __repr__(self) -> str:
        return f"<polyest.aio.Client of {self.server}>"


Self = TypeVar("Self", bound=Client)
