"""Logs of CAN buses and live buses, as `polyest[can]` reads them with python-can and cantools."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterator, Mapping
from typing import Any, Optional, Union

from polyest._table import refuse
from polyest.errors import InvalidInput
from polyest.io._assembler import Assembler
from polyest.io._choices import needed, units_of
from polyest.io._frames import FrameDecoder, load_database
from polyest.io._ordered import ordered
from polyest.io._recording import Batch, Recording
from polyest.io._rows import TimeZero, batches, check_options, nanoseconds

__all__ = ["live", "read", "signals"]

File = Union[str, "os.PathLike[str]"]

# How long a live bus is listened to at a time, s.
_POLL_S = 0.1


def signals(database: Union[File, Any]) -> dict[str, str]:
    """Returns the signals of a database, `Message.Signal`, and their units. Raises InvalidInput."""
    return {f"{message.name}.{signal.name}": signal.unit or ""
            for message in load_database(database).messages for signal in message.signals}


def read(file: File, database: Union[File, Any], channels: Mapping[str, str], *,
         units: Optional[Mapping[str, str]] = None, time_zero: TimeZero = "auto", run: int = 0,
         bus: Optional[Union[int, str]] = None, reorder_window_s: float = 1.0,
         batch_rows: int = 10_000) -> Recording:
    """Returns signals of a log (BLF, ASC, TRC, MF4, candump's .log, CSV, SQLite) as a recording.

    file: the log; its ending tells the format. MF4 needs `polyest[mdf]`, too.
    database: file of the messages (DBC, ARXML, KCD, SYM), or a database of cantools.
    channels: the signal for each output and streamed input of the problem, as in
        {"x": "SUSP.defl"} or, if one message alone has such a signal, {"x": "defl"}.
    units: of channels, as in {"x": "mm"}, instead of the database's; "" means the model's.
    time_zero: "file" keeps the log's times, s; "first" makes the first row t = 0; "auto" is "first"
        for logs whose times are dates, since 1970, and else "file".
    run: of the record, ≥ 0.
    bus: takes only frames of this channel of the log; by default of all.
    reorder_window_s: how much later than others a frame may come in the log, s, ≥ 0.
    batch_rows: the most rows of a batch; memory holds a few of them and the frames of the window.

    Times are whole ns, and dates whole µs. Signals that a frame lacks, because it is short or has
    another multiplexer, have no sample, and so have values whose name in the database says so
    ("SNA", "not available", "invalid", "undefined", "error"). Frames that cannot be decoded are
    left out with a warning. Raises InvalidInput, which is a ValueError, for files that are none and
    names that do not exist (it lists the nearest) or that several messages have; ImportError
    without the extra.
    """
    check_options(time_zero, batch_rows, reorder_window_s)
    loaded = load_database(database)
    name = os.fspath(file)
    chosen = units_of(FrameDecoder(loaded, channels).units, units)
    _open(name).stop()

    def rows() -> Iterator[Batch]:
        decoder = FrameDecoder(loaded, channels)
        samples = _samples(name, decoder, bus)
        yield from batches(name, ordered(name, samples, reorder_window_s, batch_rows), chosen,
                           run=run, time_zero=time_zero, batch_rows=batch_rows)
        if decoder.undecodable:
            warnings.warn(f"{name}: {decoder.undecodable} frames cannot be decoded and are not "
                          "used", stacklevel=3)

    return Recording(name, chosen, rows)


def _open(name: str) -> Any:
    can = needed("can", "can")
    if name.lower().endswith(".mf4"):
        needed("asammdf", "mdf")
    try:
        return can.LogReader(name)
    except OSError as error:
        raise InvalidInput(f"{name}: cannot be opened: {error.strerror}") from error
    except Exception as error:  # each reader of python-can has its own
        raise InvalidInput(f"{name}: is no log of CAN frames: {error}") from error


def _samples(name: str, decoder: FrameDecoder,
             bus: Optional[Union[int, str]]) -> Iterator[tuple[int, dict[str, float]]]:
    frames = iter(_open(name))
    while True:
        try:
            frame = next(frames, None)
        except Exception as error:  # each reader of python-can has its own
            raise InvalidInput(f"{name}: cannot be read on: {error}") from error
        if frame is None:
            return
        if bus is not None and str(frame.channel) != str(bus):
            continue
        values = decoder.decode(frame)
        if values:
            yield nanoseconds(frame.timestamp), values


def live(bus: Any, database: Union[File, Any], channels: Mapping[str, str], *,
         units: Optional[Mapping[str, str]] = None, run: int = 0, reorder_window_s: float = 0.0,
         interval_s: float = 0.1, duration_s: Optional[float] = None) -> Iterator[Batch]:
    """Yields batches of a live bus, without end or for `duration_s`.

    bus: of python-can, as in `can.Bus(interface="socketcan", channel="can0")`; the caller ends it.
    database, channels, units, run: as of `read`. t = 0 is the first frame of these channels.
    reorder_window_s: that of the session; without it, frames older than a row that was yielded are
        left out.
    interval_s: the time from one batch to the next, s, > 0.

    For an unattended rig there is `polyest-bridge`, which connects again by itself. Raises
    InvalidInput as `read`, and what python-can raises when the bus fails.
    """
    if not interval_s > 0:
        raise refuse("interval_s", f"must be > 0; got {interval_s}")
    decoder = FrameDecoder(load_database(database), channels)
    rows = Assembler(units_of(decoder.units, units), reorder_window_s, run=run)
    return _live(bus, decoder, rows, interval_s, duration_s)


def _live(bus: Any, decoder: FrameDecoder, rows: Assembler, interval_s: float,
          duration_s: Optional[float]) -> Iterator[Batch]:
    begun = time.monotonic()
    due = begun + interval_s
    while duration_s is None or time.monotonic() < begun + duration_s:
        frame = bus.recv(min(_POLL_S, interval_s))
        values = decoder.decode(frame) if frame is not None else {}
        if frame is not None and values:
            rows.add(nanoseconds(frame.timestamp), values)
        if time.monotonic() >= due:
            due += interval_s
            yield from rows.take()
    yield from rows.take(last=True)
