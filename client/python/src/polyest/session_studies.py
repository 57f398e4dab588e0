"""The studies of a session as the daemon keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, TypeVar

from polyest import _calls, results
from polyest._calls import Call, Subject
from polyest._proto.v1 import problem_pb2, session_service_pb2
from polyest.estimates import Estimate
from polyest.studies import Studies

if TYPE_CHECKING:
    from polyest._transport import Transport

Result = TypeVar("Result")


class SessionStudies(Studies):
    """Asks about a session and never writes to it.

    Estimates keep one to plot with. They must not keep the `Session` itself: its stream holds the
    session until nobody has the object any more.
    """

    def __init__(self, transport: Transport, created: session_service_pb2.Session,
                 units: Mapping[str, str]) -> None:
        """Use `Client.session`."""
        self._transport = transport
        self._resource = created.name
        self._problem_message = created.problem
        self._units = units

    def estimate(self) -> Estimate:
        """Returns the estimate from all rows so far."""
        return self._run(_calls.get_estimate(self._resource, self))

    def history(self) -> results.History:
        """Returns how the session's estimates came about: at most 512 of them and the newest."""
        return self._run(_calls.get_history(self._resource))

    def _subject(self) -> Subject:
        return _calls.subject_of_session(self._resource)

    def _problem(self) -> problem_pb2.Problem:
        return self._problem_message

    def _run(self, call: Call[Result]) -> Result:
        return self._transport.run(call)
