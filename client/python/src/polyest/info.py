"""Models, sessions and the daemon, as the daemon describes them."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from typing import Any, Optional

from polyest import _html
from polyest._proto.v1 import model_service_pb2, session_service_pb2, status_service_pb2


@dataclass(frozen=True)
class Quantity:
    """A state, parameter, input or output of a model."""

    #: The name that problems and data use.
    name: str
    #: The unit, such as "N/m"; "1" for a pure number.
    unit: str
    #: What it is, in words.
    meaning: str
    #: The value that a parameter has where a problem does not name it; None: it must be given.
    default: Optional[float]


@dataclass(frozen=True)
class Model:
    """A model that a problem can name."""

    #: The name by which a problem names it.
    name: str
    #: What is modelled, in one sentence.
    summary: str
    #: The equations of motion; empty for an FMU.
    equations: str
    #: Where the equations come from; may be empty.
    source: str
    #: "built-in", or the kind of an FMU.
    kind: str
    #: The states by name.
    states: dict[str, Quantity]
    #: What `fix`, `uncertain` and `derive` may name, initial states among them.
    parameters: dict[str, Quantity]
    #: What drives the model.
    inputs: dict[str, Quantity]
    #: What can be measured.
    outputs: dict[str, Quantity]

    def _repr_html_(self) -> str:
        rows = [(kind, one.name, one.unit, one.meaning,
                 "" if one.default is None else _html.number(one.default))
                for kind, quantities in (("state", self.states), ("parameter", self.parameters),
                                         ("input", self.inputs), ("output", self.outputs))
                for one in quantities.values()]
        return _html.page(_html.paragraph(f"{self.name}: {self.summary}"),
                          _html.table(("", "name", "unit", "meaning", "default"), rows))


def model_of(message: model_service_pb2.Model) -> Model:
    """Returns a model as the daemon has sent it."""
    def quantities(field: Any) -> dict[str, Quantity]:
        return {one.name: Quantity(one.name, one.unit, one.meaning,
                                   one.default_value if one.HasField("default_value") else None)
                for one in field}

    return Model(message.name.rpartition("/")[2], message.summary, message.equations,
                 message.source, message.kind, quantities(message.states),
                 quantities(message.parameters), quantities(message.inputs),
                 quantities(message.outputs))


@dataclass(frozen=True)
class SessionInfo:
    """A session as the daemon keeps it."""

    #: The session's name, without "sessions/".
    name: str
    #: When it was created.
    create_time: datetime.datetime
    #: Number of the last acknowledged batch; 0 before the first.
    last_sequence: int
    #: Number of acknowledged values, over all channels and runs.
    sample_count: int
    #: Time of the last acknowledged row, s; 0 before the first.
    last_time_s: float
    #: Run of the last acknowledged row; 0 before the first.
    last_run: int
    #: Whether its estimator is in memory.
    loaded: bool
    #: Whether a client streams measurements to it.
    has_writer: bool
    #: Number of open watches.
    watcher_count: int
    #: Number of estimates made since the daemon started.
    estimate_count: int
    #: Time spent on its numerics since the daemon started, s.
    compute_time_s: float
    #: Seconds of measurements ÷ seconds computed for them; 0 while there are none.
    real_time_factor: float
    #: Acknowledged batches that the estimator has not processed yet.
    unprocessed_batch_count: int


def session_of(message: session_service_pb2.Session) -> SessionInfo:
    """Returns a session as the daemon has sent it."""
    use = message.activity
    return SessionInfo(
        message.name.rpartition("/")[2],
        message.create_time.ToDatetime().replace(tzinfo=datetime.timezone.utc),
        message.last_sequence, message.sample_count, message.last_time_s, message.last_run,
        use.loaded, use.has_writer, use.watcher_count, use.estimate_count, use.compute_time_s,
        use.real_time_factor, use.unprocessed_batch_count)


@dataclass(frozen=True)
class DaemonStatus:
    """The daemon's version, load and memory."""

    #: The daemon's version, such as "1.4.0".
    version: str
    #: Whether acknowledged batches are on disk and survive a restart.
    durable: bool
    #: Number of sessions of the caller's tenant.
    session_count: int
    #: Number of those sessions whose estimator is in memory.
    loaded_session_count: int
    #: Number of open streams of measurements, of all tenants.
    writer_count: int
    #: Number of open watches, of all tenants.
    watcher_count: int
    #: Number of tasks that wait for a thread, of all tenants.
    waiting_task_count: int
    #: Time since the daemon started, s.
    uptime_s: float
    #: Resident memory, bytes.
    memory_bytes: int
    #: Bytes of the problems, measurements and snapshots that the caller's tenant has stored.
    stored_bytes: int
    #: The most that it may have stored, bytes; 0: there is no limit.
    max_stored_bytes: int


def status_of(message: status_service_pb2.DaemonStatus) -> DaemonStatus:
    """Returns the status as the daemon has sent it."""
    return DaemonStatus(message.version, message.durable, message.session_count,
                        message.loaded_session_count, message.writer_count, message.watcher_count,
                        message.waiting_task_count, message.uptime_s, message.memory_bytes,
                        message.stored_bytes, message.max_stored_bytes)
