"""What goes wrong with a call, as exceptions.

Every exception is a `PolyestError`. It says what the daemon says: a sentence that names the field,
the value and the rule, and for programs the field, the reason, the limit and whether waiting helps.
A result that is only less accurate is no exception but a diagnostic of the estimate.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Optional, Union

import grpc

from polyest._proto.rpc import error_details_pb2 as rpc

__all__ = [
    "Aborted", "AlreadyExists", "Cancelled", "DataLoss", "DeadlineExceeded", "FailedPrecondition",
    "InternalError", "InvalidInput", "NotFound", "PermissionDenied", "PolyestError",
    "ResourceExhausted", "Unauthenticated", "Unavailable", "Unimplemented", "WrongType",
]

_DETAILS = "grpc-status-details-bin"


class PolyestError(Exception):
    """A call failed.

    `str(error)` is one sentence that names field, value and rule.
    """

    #: The status code of gRPC, such as "INVALID_ARGUMENT".
    code: str = "UNKNOWN"
    #: The field that is wrong, in JSON's names, such as "uncertain[0].uniform"; empty if none is.
    field: str
    #: The rule that the field breaks, in one sentence without the field; empty if none is.
    rule: str
    #: LIMIT_EXCEEDED, DISK_FULL, BUSY, OUT_OF_MEMORY, SHUTTING_DOWN, DATABASE_AWAY,
    #: OWNED_ELSEWHERE or ANOTHER_WRITER; empty if none applies.
    reason: str
    #: The daemon's option that sets the limit, such as "--max-sessions"; empty if none does.
    limit: str
    #: After how many seconds the same call may be sent again; None: waiting does not help.
    retry_after_s: Optional[float]

    def __init__(self, message: str, *, field: str = "", rule: str = "", reason: str = "",
                 limit: str = "", retry_after_s: Optional[float] = None) -> None:
        super().__init__(message)
        self.field, self.rule = field, rule
        self.reason, self.limit = reason, limit
        self.retry_after_s = retry_after_s

    @property
    def message(self) -> str:
        """The sentence that says what is wrong."""
        return str(self.args[0])

    @property
    def retry(self) -> bool:
        """Whether the same call may succeed later without a change."""
        return self.retry_after_s is not None


class InvalidInput(PolyestError, ValueError):
    """A field of a problem, of measurements or of an option is wrong: `field` and `rule`."""

    code = "INVALID_ARGUMENT"


class WrongType(InvalidInput, TypeError):
    """An argument is of a type that it cannot have: `field` is its name."""


class NotFound(PolyestError, LookupError):
    """The session, model or operation does not exist, or is another tenant's."""

    code = "NOT_FOUND"


class AlreadyExists(PolyestError):
    """The name of the session is taken, by one with another problem or window."""

    code = "ALREADY_EXISTS"


class FailedPrecondition(PolyestError):
    """The state does not allow the call: too few trajectories succeed, or the client is closed."""

    code = "FAILED_PRECONDITION"


class Aborted(PolyestError):
    """Another program writes to the session, or has written the batches whose numbers come next."""

    code = "ABORTED"


class ResourceExhausted(PolyestError):
    """A limit is passed: `limit` names the daemon's option, `retry` whether waiting helps."""

    code = "RESOURCE_EXHAUSTED"


class DeadlineExceeded(PolyestError, TimeoutError):
    """The call took longer than its timeout; the computation stops."""

    code = "DEADLINE_EXCEEDED"


class Cancelled(PolyestError):
    """The call was cancelled."""

    code = "CANCELLED"


class Unavailable(PolyestError, ConnectionError):
    """The daemon cannot be reached, shuts down, or cannot reach its disk: try again later."""

    code = "UNAVAILABLE"

    @property
    def retry(self) -> bool:
        """Always true."""
        return True


class DataLoss(PolyestError):
    """Batches that were acknowledged are lost, or the journal is damaged."""

    code = "DATA_LOSS"


class InternalError(PolyestError):
    """An unexpected error of the daemon or of gRPC; the daemon's log says more."""

    code = "INTERNAL"


class Unauthenticated(PolyestError):
    """The token is missing or unknown."""

    code = "UNAUTHENTICATED"


class PermissionDenied(PolyestError, PermissionError):
    """The token's role does not allow the call."""

    code = "PERMISSION_DENIED"


class Unimplemented(PolyestError):
    """The daemon does not know the call: it is of another version."""

    code = "UNIMPLEMENTED"


_BY_CODE: dict[str, type[PolyestError]] = {
    kind.code: kind
    for kind in (InvalidInput, NotFound, AlreadyExists, FailedPrecondition, Aborted,
                 ResourceExhausted, DeadlineExceeded, Cancelled, Unavailable, DataLoss,
                 InternalError, Unauthenticated, PermissionDenied, Unimplemented)
}


def _unpacked(status: rpc.Status, kind: Any) -> Iterator[Any]:
    """Yields the details of one kind; the daemon sends them under the names of google.rpc."""
    for detail in status.details:
        if detail.type_url == f"type.googleapis.com/google.rpc.{kind.DESCRIPTOR.name}":
            yield kind.FromString(detail.value)


def _details(metadata: Optional[Iterable[tuple[str, Union[str, bytes]]]]) -> dict[str, Any]:
    """Returns what the trailers of a call say beside the message."""
    said: dict[str, Any] = {}
    for key, value in metadata or ():
        if key != _DETAILS or not isinstance(value, bytes):
            continue
        status = rpc.Status.FromString(value)
        for bad in _unpacked(status, rpc.BadRequest):
            for violation in bad.field_violations:
                said["field"], said["rule"] = violation.field, violation.description
        for quota in _unpacked(status, rpc.QuotaFailure):
            for violation in quota.violations:
                said["rule"] = violation.description
                said["limit" if violation.subject.startswith("--") else "field"] = violation.subject
        for info in _unpacked(status, rpc.ErrorInfo):
            said["reason"] = info.reason
            said["limit"] = info.metadata.get("limit", said.get("limit", ""))
        for retry in _unpacked(status, rpc.RetryInfo):
            said["retry_after_s"] = retry.retry_delay.ToTimedelta().total_seconds()
    return said


def of_status(code: str, message: str, **said: Any) -> PolyestError:
    """Returns the exception of a status code by its name."""
    kind = _BY_CODE.get(code)
    if kind is not None:
        return kind(message, **said)
    error = PolyestError(message, **said)
    error.code = code
    return error


def of_rpc(error: grpc.RpcError) -> PolyestError:
    """Returns the exception of a call that failed, synchronous or not."""
    status: Any = error
    return of_status(status.code().name, status.details() or status.code().name,
                     **_details(status.trailing_metadata()))
