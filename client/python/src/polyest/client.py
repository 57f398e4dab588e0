"""A connection to a daemon."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from types import TracebackType
from typing import Any, Optional, TypeVar, Union

from polyest import _calls, _methods, check, info, results
from polyest._calls import Call, Subject
from polyest._connection import ConnectionOptions
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
from polyest._transport import Transport
from polyest.errors import AlreadyExists
from polyest.estimates import Estimate
from polyest.problem import ProblemLike, to_message
from polyest.session import Session
from polyest.studies import Studies

Result = TypeVar("Result")


def created_or_same(name: str, wanted: problem_pb2.Problem, window_s: Optional[float],
                    found: session_service_pb2.Session) -> session_service_pb2.Session:
    """Returns an existing session. Raises AlreadyExists if its problem or window is another one."""
    stored = problem_pb2.Problem()
    stored.CopyFrom(wanted)
    stored.ClearField("schema")  # it is for editors, and the daemon does not keep it
    if found.problem != stored:
        raise AlreadyExists(f"session '{name}' exists with another problem; choose another name, "
                            "or open it without a problem")
    if window_s is not None and found.reorder_window_s != window_s:
        raise AlreadyExists(f"session '{name}' exists with reorder_window_s = "
                            f"{found.reorder_window_s}, not {window_s}; choose another name, or "
                            "open it without a problem")
    return found


class Experiment(Studies):
    """A problem and its measurements, which go to the daemon with each question.

    Nothing is kept by the daemon. Make it with `Client.experiment`.
    """

    def __init__(self, transport: Transport, message: problem_pb2.Problem,
                 measurements: Optional[Measurements],
                 units: Optional[Mapping[str, str]]) -> None:
        """Use `Client.experiment`."""
        self._transport = transport
        self._message = message
        self._measurements = measurements
        self._units = units or {}

    def estimate(self) -> Estimate:
        """Returns the estimate from all measurements."""
        return self._run(_calls.compute_estimate(self._subject(), self))

    def history(self, points: int = 30) -> results.History:
        """Returns how the estimate comes about: estimates from the first rows alone.

        points: how many, 1 … 1000; each takes the time of an estimate.
        """
        return self._run(_calls.compute_history(self._subject(), points))

    def _with(self, problem: problem_pb2.Problem) -> Experiment:
        """Returns another problem with the same measurements."""
        return Experiment(self._transport, problem, self._measurements, self._units)

    def _subject(self) -> Subject:
        return _calls.subject_of_experiment(self._message, self._measurements)

    def _problem(self) -> problem_pb2.Problem:
        return self._message

    def _run(self, call: Call[Result]) -> Result:
        return self._transport.run(call)


class Client:
    """A connection to a daemon; make it with `polyest.connect` or `polyest.local`.

    It connects at the first call. Any thread may use it. As a context manager it closes itself.
    """

    def __init__(self, options: ConnectionOptions) -> None:
        """Use `polyest.connect`."""
        self._transport = Transport(options)

    @property
    def server(self) -> str:
        """HOST:PORT of the daemon."""
        return self._transport.options.server

    def close(self) -> None:
        """Ends the connection and all calls."""
        self._transport.close()

    def __enter__(self: Self) -> Self:
        """Returns the client."""
        return self

    def __exit__(self, kind: Optional[type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        """Closes the client."""
        self.close()

    def estimate(self, problem: ProblemLike, data: Data, *,
                 units: Optional[Mapping[str, str]] = None) -> Estimate:
        """Returns the estimate of a problem's uncertain parameters from measurements.

        problem: a `Problem`, a problem file's JSON object (a dict), or the path of a problem file.
        data: a pandas DataFrame, a dict of columns or a structured numpy array. It has the time `t`
            in s (a column, or the index), the measured outputs and all streamed inputs by name, and
            may have `run`. NaN is a missing sample.
        units: of columns by the problem's names, as in {"x": "mm", "t": "ms"}; by default those in
            the headers ("x [mm]") or the problem's `columns`, else the model's.

        Raises InvalidInput, with the field and the rule, and any other `PolyestError`;
        WrongType for what is no problem.
        """
        return self.experiment(problem, data, units=units).estimate()

    def experiment(self, problem: ProblemLike, data: Optional[Data] = None, *,
                   units: Optional[Mapping[str, str]] = None) -> Experiment:
        """Returns a problem with its measurements, of which all studies can be asked.

        Without data, studies of the prior remain: propagate, sensitivity, design.
        """
        message = to_message(problem)
        converter = MeasurementConverter(message, units)
        return Experiment(self._transport, message,
                          None if data is None else converter.convert(data), units)

    def check(self, problem: ProblemLike, data: Optional[Data] = None, *,
              units: Optional[Mapping[str, str]] = None) -> check.Check:
        """Returns all errors and warnings of a problem, and of data up to the first error.

        A value of a wrong form in the problem is the only error then. Raises WrongType for what is
        no problem, and InvalidInput for a file that cannot be read and for wrong `units`.
        """
        found = _calls.check_problem(problem, data, units)
        return found if isinstance(found, check.Check) else self._transport.run(found)

    def session(self, name: str, problem: Optional[ProblemLike] = None, *,
                units: Optional[Mapping[str, str]] = None,
                on_estimate: Optional[Callable[[Estimate], None]] = None,
                options: Optional[StreamOptions] = None,
                reorder_window_s: Optional[float] = None) -> Session:
        """Opens a session; creates it if it does not exist and a problem is given.

        name: 1 … 63 of [a-z0-9-], first a letter.
        units: of columns, for all rows that are appended.
        on_estimate: called with each estimate of the stream, from a thread of its own. It may ask
            the session: an estimate or a study takes the rows that the daemon keeps by then. It
            must not write to it or close it, which raises FailedPrecondition. What it raises, the
            program's next `append`, `flush` or `close` raises.
        options: how batches are sent and connections made again.
        reorder_window_s: of a new session, how much later than rows of other channels a row may
            arrive, s, in [0, 3600]; so long rows are held back. 0, the default: rows come in the
            order of time.

        Raises NotFound without a problem, AlreadyExists if the session has another one, or
        another window than a given one.
        """
        options = options_of(options, on_estimate)
        if problem is None:
            created = self._get_session(name)
        else:
            message = to_message(problem)
            MeasurementConverter(message, units)  # refuses wrong units before there is a session
            try:
                created = self._transport.unary(
                    _methods.CREATE_SESSION,
                    _calls.create_session(name, message, reorder_window_s))
            except AlreadyExists:
                created = created_or_same(name, message, reorder_window_s,
                                          self._get_session(name))
        return Session(self._transport, created, units, options, on_estimate)

    def _get_session(self, name: str) -> session_service_pb2.Session:
        return self._transport.unary(_methods.GET_SESSION, session_service_pb2.GetSessionRequest(
            name=f"sessions/{name}"))

    def sessions(self) -> list[info.SessionInfo]:
        """Returns the sessions of the caller's tenant, in the order of their names."""
        return [info.session_of(one) for one in self._pages(
            _methods.LIST_SESSIONS, session_service_pb2.ListSessionsRequest, "sessions")]

    def delete_session(self, name: str) -> None:
        """Deletes a session with its measurements. Raises NotFound."""
        self._transport.unary(_methods.DELETE_SESSION, session_service_pb2.DeleteSessionRequest(
            name=f"sessions/{name}"))

    def import_session(self, file: Union[str, os.PathLike[str]], name: str = "") -> Session:
        """Creates a session from a file of `Session.export` or `polyest export`.

        name: of the new session; by default the one that it had.
        """
        created = self._transport.client_stream(_methods.IMPORT_SESSION,
                                                _calls.import_session(name, file))
        return self.session(created.name.rpartition("/")[2])

    def models(self) -> dict[str, info.Model]:
        """Returns the models that problems can name: the built-in ones, then FMUs."""
        found = map(info.model_of, self._pages(
            _methods.LIST_MODELS, model_service_pb2.ListModelsRequest, "models"))
        return {one.name: one for one in found}

    def model(self, name: str) -> info.Model:
        """Returns one model. Raises NotFound."""
        return info.model_of(self._transport.unary(
            _methods.GET_MODEL, model_service_pb2.GetModelRequest(name=f"models/{name}")))

    def problem_schema(self) -> str:
        """Returns the JSON Schema of problem files, as text, for editors."""
        return self._transport.unary(_methods.GET_PROBLEM_SCHEMA,
                                     problem_service_pb2.GetProblemSchemaRequest()).json_schema

    def status(self) -> info.DaemonStatus:
        """Returns the daemon's version, load and memory."""
        return info.status_of(self._transport.unary(_methods.GET_STATUS,
                                                    status_service_pb2.GetStatusRequest()))

    def _pages(self, method: _methods.Method[Any, Any], request: Any, field: str) -> Iterator[Any]:
        token = ""
        while True:
            page = self._transport.unary(method, request(page_size=200, page_token=token))
            yield from getattr(page, field)
            token = page.next_page_token
            if not token:
                return

    def __repr__(self) -> str:
        return f"<polyest.Client of {self.server}>"


Self = TypeVar("Self", bound=Client)
