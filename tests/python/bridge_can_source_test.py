"""The bridge's source of frames, on buses that fail."""

import contextlib
import errno
import struct
import threading
from types import SimpleNamespace

import pytest

from polyest.bridge._sources import CanSource
from rig import DBC, Waits

can = pytest.importorskip("can")
cantools = pytest.importorskip("cantools")

ROAD = cantools.database.load_string(DBC, "dbc").get_message_by_name("ROAD")


def frame(time_s, force):
    return can.Message(timestamp=time_s, arbitration_id=ROAD.frame_id, is_extended_id=False,
                       data=ROAD.encode({"force": force}))


@pytest.fixture
def source(tmp_path, monkeypatch):
    """Makes a source on a bus that is opened by a function; what it says comes into a list."""
    def make(interface, open_bus):
        (tmp_path / "rig.dbc").write_text(DBC)
        monkeypatch.setattr("polyest.bridge._sources.open_bus", open_bus)
        bus = SimpleNamespace(interface=interface, channel="rig", database=tmp_path / "rig.dbc")
        said = []
        return CanSource(bus, {"force": "ROAD.force"}, said.append), said

    return make


def test_a_bus_that_fails_at_once_is_opened_less_and_less(source):
    brought = [[], [], [], [frame(0.0, 2.0)]]
    taken, stop = [], Waits(len(brought))

    @contextlib.contextmanager
    def open_bus(_):
        left = brought[len(stop.delays)]
        yield SimpleNamespace(recv=lambda timeout: left.pop(0))  # IndexError at the end

    failing, said = source("virtual", open_bus)
    failing.run(lambda time_ns, values: taken.append(values), stop)
    assert stop.delays == [0.2, 0.4, 0.8, 1.6]  # a single frame does not shorten them
    assert len(said) == 4 and "the bus rig fails" in said[2] and "again in 0.8 s" in said[2]
    assert taken == [{"force": pytest.approx(2.0)}]


def test_an_interface_that_is_down_is_listened_to_until_it_is_up(source):
    """As SocketCAN does: frames that came before wait, and are lost with the socket."""
    brought = [frame(0.0, 1.0), can.CanOperationError("down", errno.ENETDOWN), frame(1.0, 2.0),
               None, frame(9.0, 3.0)]
    taken, filters, stop = [], [], threading.Event()

    def recv(_):
        came = brought.pop(0) if brought else stop.set()
        if isinstance(came, Exception):
            raise came
        return came

    @contextlib.contextmanager
    def open_bus(_):
        numbers = SimpleNamespace(getsockopt=lambda *_: struct.pack("9I", *range(9)))
        yield SimpleNamespace(recv=recv, set_filters=filters.extend, socket=numbers)

    listening, said = source("socketcan", open_bus)
    listening.run(lambda time_ns, values: taken.append(values["force"]), stop)
    assert taken == pytest.approx([1.0, 2.0, 3.0])
    assert (listening.reconnects, listening.lost) == (1, 8)
    assert filters == [{"can_id": ROAD.frame_id, "can_mask": 0x7FF, "extended": False}]
    assert said == ["the bus rig is down; it is listened to until it is up"]
