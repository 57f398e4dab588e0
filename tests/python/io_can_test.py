"""Logs of CAN frames with a DBC, and live buses; against the command's own CSV."""

import sys
import threading

import numpy as np
import pytest

import polyest
from polyest.io import can as logs
from rig import DBC, PROBLEM, estimate_of_csv, record, same, write_csv

can = pytest.importorskip("can")
cantools = pytest.importorskip("cantools")

START = 1_790_000_000.0
CHANNELS = {"x": "SUSP.defl", "force": "ROAD.force"}
DATABASE = cantools.database.load_string(DBC, "dbc")


@pytest.fixture(scope="module")
def data():
    """A record whose values are those that the database's scales give."""
    fine, x, coarse, force = record(2.0)
    return fine, np.rint(x / 0.001) * 0.001, coarse, np.rint(force / 0.0001) * 0.0001


@pytest.fixture
def dbc(tmp_path):
    path = tmp_path / "rig.dbc"
    path.write_text(DBC)
    return path


def frame(time, name, **signals):
    message = DATABASE.get_message_by_name(name)
    return can.Message(timestamp=float(time), arbitration_id=message.frame_id,
                       is_extended_id=message.is_extended_frame,
                       data=message.encode(signals, strict=False))


def frames(data, start=START):
    fine, x, coarse, force = data
    found = [frame(start + t, "SUSP", defl=value, state=0) for t, value in zip(fine, x)]
    found += [frame(start + t, "ROAD", force=value) for t, value in zip(coarse, force)]
    return sorted(found, key=lambda one: one.timestamp)


def write(path, messages):
    with can.Logger(path) as log:
        for message in messages:
            log(message)
    return path


# BLF has ns and candump's log µs; ASC has 0.1 ms … 1 µs, which python-can writes.
@pytest.mark.parametrize("ending", [".blf", ".log", ".asc", ".trc", ".csv"])
def test_a_log_gives_the_estimate_of_the_same_rows_in_csv(client, tmp_path, data, dbc, ending):
    write_csv(tmp_path / "ride.csv", *data)
    expected = estimate_of_csv(tmp_path, tmp_path / "ride.csv")
    log = write(tmp_path / f"can{ending}", frames(data))
    recording = logs.read(log, dbc, CHANNELS, time_zero="first")
    assert recording.units == {"x": "mm", "force": "N"}
    found = client.estimate(PROBLEM, recording)
    if ending == ".trc":  # has 0.1 ms, too coarse for the 95 Hz
        for one in expected:
            assert abs(found[one["name"]].map - one["map"]) < 0.1 * one["stdDev"]
    else:
        assert same(found, expected)


def test_frames_may_be_out_of_order_within_the_window(tmp_path, data, dbc):
    expected = logs.read(write(tmp_path / "a.blf", frames(data)), dbc, CHANNELS).to_dict()
    shuffled = frames(data)
    for first in range(1, len(shuffled), 50):
        shuffled[first:first + 50] = shuffled[first:first + 50][::-1]
    path = write(tmp_path / "b.blf", shuffled)
    for name, column in logs.read(path, dbc, CHANNELS, batch_rows=100).to_dict().items():
        np.testing.assert_array_equal(column, expected[name])
    with pytest.raises(polyest.InvalidInput, match="more than reorder_window_s = 0"):
        logs.read(path, dbc, CHANNELS, batch_rows=25, reorder_window_s=0.0).all()


@pytest.mark.parametrize(("name", "said"), [
    ("defl", "2 messages have a signal 'defl': 'SUSP.defl', 'OTHER.defl'"),
    ("SUSP.Deflection", r"channels.x: there is no signal 'SUSP.Deflection'; the nearest are "
     "'SUSP.defl'"),
])
def test_a_signal_must_be_one(tmp_path, dbc, name, said):
    log = write(tmp_path / "a.blf", [frame(START, "SUSP", defl=1, state=0)])
    with pytest.raises(polyest.InvalidInput, match=said):
        logs.read(log, dbc, {"x": name})


def test_a_signal_that_one_message_has_needs_no_message(tmp_path, dbc):
    log = write(tmp_path / "a.blf", [frame(START, "ROAD", force=1.5)])
    assert list(logs.read(log, dbc, {"u": "force"}).to_dict()["u"]) == [1.5]
    assert logs.signals(dbc)["EST.k_mean"] == "N/m"


def test_values_that_mean_none_are_missing_and_short_frames_counted(tmp_path, dbc):
    short = frame(START + 2, "SUSP", defl=3, state=0)
    short = can.Message(timestamp=short.timestamp, arbitration_id=256, is_extended_id=False,
                        data=short.data[:2])
    other = can.Message(timestamp=START + 3, arbitration_id=256, is_extended_id=True,
                        data=bytes(8))
    log = write(tmp_path / "a.blf", [
        frame(START, "SUSP", defl=1, state=1), frame(START + 1, "SUSP", defl=2, state=255),
        short, other, can.Message(timestamp=START + 4, is_error_frame=True),
        can.Message(timestamp=START + 5, arbitration_id=256, is_extended_id=False,
                    is_remote_frame=True, dlc=8)])
    with pytest.warns(UserWarning, match="1 frames cannot be decoded"):
        found = logs.read(log, dbc, {"x": "SUSP.defl", "s": "SUSP.state"}).to_dict()
    np.testing.assert_array_equal(found["t"], [0, 1])
    np.testing.assert_array_equal(found["s"], [1, np.nan])


@pytest.mark.parametrize(("name", "means_none"), [
    ("SNA", True), ("Not available", True), ("Signal_Invalid", True), ("Error indicator", True),
    ("n/a", True), ("on", False), ("No error", False), ("not_invalid", False), ("Fault", False),
    ("valid", False), ("nano", False)])
def test_names_that_mean_no_value(tmp_path, name, means_none):
    (tmp_path / "rig.dbc").write_text(DBC.replace('255 "SNA"', f'255 "{name}"'))
    log = write(tmp_path / "a.blf", [frame(START, "SUSP", defl=1, state=255)])
    found = logs.read(log, tmp_path / "rig.dbc", {"x": "SUSP.defl", "s": "state"}).to_dict()
    assert np.isnan(found["s"][0]) == means_none


def test_the_buses_of_a_log_are_told_apart(tmp_path, dbc):
    messages = [frame(START + number, "ROAD", force=number) for number in range(4)]
    for number, message in enumerate(messages):
        message.channel = number % 2
    log = write(tmp_path / "a.blf", messages)
    assert list(logs.read(log, dbc, {"u": "force"}, bus=1).to_dict()["u"]) == [1, 3]


def test_frames_at_one_time_count_once_and_are_counted(tmp_path, dbc):
    log = write(tmp_path / "a.blf", [frame(START, "ROAD", force=1), frame(START, "ROAD", force=2)])
    with pytest.warns(UserWarning, match="1 samples are not used"):
        assert list(logs.read(log, dbc, {"u": "force"}).to_dict()["u"]) == [1]


def test_an_mf4_log_is_read(tmp_path, dbc):
    pytest.importorskip("asammdf")
    log = write(tmp_path / "a.mf4", [frame(START + t, "ROAD", force=t) for t in (0, 0.25, 0.5)])
    found = logs.read(log, dbc, {"u": "force"}, time_zero="first").to_dict()
    assert list(found["t"]) == [0, 0.25, 0.5]
    assert list(found["u"]) == [0, 0.25, 0.5]


def test_a_log_without_these_signals_is_refused(tmp_path, dbc):
    log = write(tmp_path / "a.blf", [frame(START, "ROAD", force=1)])
    with pytest.raises(polyest.InvalidInput, match="has no sample of x"):
        logs.read(log, dbc, {"x": "SUSP.defl"}).all()


@pytest.mark.parametrize(("name", "content", "said"), [
    ("a.blf", b"no log", "a.blf: is no log of CAN frames"),
    ("a.xyz", b"no log", "a.xyz: is no log of CAN frames"),
])
def test_logs_that_are_none_are_refused(tmp_path, dbc, name, content, said):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(polyest.InvalidInput, match=said):
        logs.read(tmp_path / name, dbc, CHANNELS)


@pytest.mark.parametrize("content", ["", "BO_ 256 SUSP 8 RIG", "{}"])
def test_databases_that_are_none_are_refused(tmp_path, content):
    (tmp_path / "bad.dbc").write_text(content)
    with pytest.raises(polyest.InvalidInput, match=r"bad\.dbc: |channels.x"):
        logs.read(tmp_path / "a.blf", tmp_path / "bad.dbc", CHANNELS)


def test_a_live_bus_is_read_in_batches(client, dbc, data):
    few = [column[:200] for column in data[:2]] + [column[:19] for column in data[2:]]
    with can.Bus(interface="virtual", channel="live", preserve_timestamps=True) as sender, \
            can.Bus(interface="virtual", channel="live") as bus:
        writer = threading.Thread(target=lambda: [sender.send(one) for one in frames(few)])
        writer.start()
        batches = list(logs.live(bus, dbc, CHANNELS, interval_s=0.05, duration_s=0.5))
        writer.join()
    assert sum(map(len, batches)) == len(np.union1d(few[0], few[2]))
    with client.session("live", PROBLEM) as session:
        for batch in batches:
            session.append(batch, wait=False)
        session.end_run()
        assert session.estimate().samples == 200
    client.delete_session("live")


@pytest.mark.parametrize("module", ["can", "cantools"])
def test_without_the_extra_pip_s_command_is_named(monkeypatch, tmp_path, dbc, module):
    log = write(tmp_path / "a.blf", [frame(START, "ROAD", force=1)])
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=r"pip install 'polyest\[can\]'"):
        logs.read(log, dbc, CHANNELS)
