"""The bridge between a CAN bus and a real daemon: estimates come back, restarts lose nothing."""

import json
import socket
import threading

import numpy as np
import pytest

import polyest
from polyest import bridge
from rig import DBC, PROBLEM, TRUTH, record, wait_for

can = pytest.importorskip("can")
cantools = pytest.importorskip("cantools")

START = 1_790_000_000.0
DATABASE = cantools.database.load_string(DBC, "dbc")
CONFIGURATION = {
    "session": {"name": "rig", "problem": "problem.json"},
    "source": {"kind": "can", "interface": "virtual", "channel": "rig", "database": "rig.dbc"},
    "channels": {"x": "SUSP.defl", "force": {"from": "ROAD.force", "unit": "N"}},
    "stream": {"interval_s": 0.02, "end_timeout_s": 10},
    "estimates": {"interval_s": 0.05}, "status": {"interval_s": 0.1},
    "publish": [{"kind": "can", "message": "EST", "signals": {
        "k_mean": "k.mean", "k_sd": "k.std_dev", "k_ok": "k.identified", "small": "samples"}}]}


@pytest.fixture(scope="module")
def data():
    """A record whose values are those that the database's scales give."""
    fine, x, coarse, force = record(2.0)
    return fine, np.rint(x / 0.001) * 0.001, coarse, np.rint(force / 0.0001) * 0.0001


def frame(time_s, name, **signals):
    message = DATABASE.get_message_by_name(name)
    return can.Message(timestamp=float(time_s), arbitration_id=message.frame_id,
                       is_extended_id=message.is_extended_frame, data=message.encode(signals))


def frames(data):
    fine, x, coarse, force = data
    found = [frame(START + t, "SUSP", defl=value, state=0) for t, value in zip(fine, x)]
    found += [frame(START + t, "ROAD", force=value) for t, value in zip(coarse, force)]
    return sorted(found, key=lambda one: one.timestamp)


class Rig:
    """A bus with a bridge on it, which works in threads of its own."""

    def __init__(self, folder, server, **changes):
        self.folder = folder
        (folder / "rig.dbc").write_text(DBC)
        PROBLEM.save(folder / "problem.json")
        self.configuration = json.loads(json.dumps(CONFIGURATION))
        self.configuration["daemon"] = {"server": server}
        for place, values in changes.items():
            if isinstance(values, dict):
                self.configuration.setdefault(place, {}).update(values)
            else:
                self.configuration[place] = values
        self.bus = can.Bus(interface="virtual", channel="rig", preserve_timestamps=True)

    def start(self):
        file = self.folder / "bridge.json"
        file.write_text(json.dumps(self.configuration))
        self.bridge = bridge.Bridge(bridge.read_configuration(file))
        self.stop, self.status = threading.Event(), None
        self.thread = threading.Thread(target=self._run)
        self.thread.start()
        # A virtual bus forgets what is sent before somebody listens.
        ends = 2 + len(self.configuration["publish"])
        wait_for(lambda: len(can.interfaces.virtual.channels["rig"]) == ends)
        return self

    def _run(self):
        self.status = self.bridge.run(self.stop)

    def send(self, messages):
        for message in messages:
            self.bus.send(message)

    def end(self):
        self.stop.set()
        self.thread.join(60)
        return self.status


@pytest.fixture
def rig(tmp_path, client):
    """Makes a rig; what it has begun is ended."""
    made = []

    def make(server=client.server, **changes):
        made.append(Rig(tmp_path, server, **changes))
        return made[-1]

    yield make
    for one in made:
        if hasattr(one, "thread"):
            one.end()
        one.bus.shutdown()
    for session in client.sessions():
        client.delete_session(session.name)


def rows_of(data):
    """Returns the same measurements as a table, with the times that the bridge makes."""
    fine, x, coarse, force = data
    times = np.union1d(fine, coarse)
    found = {"t": times, **{name: np.full(len(times), np.nan) for name in ("x [mm]", "force")}}
    found["x [mm]"][np.isin(times, fine)] = x
    found["force"][np.isin(times, coarse)] = force
    return found


def test_estimates_come_back_on_the_bus_and_are_those_of_the_table(rig, client, data, capfd):
    one = rig().start()
    one.send(frames(data))
    said = []
    wait_for(lambda: said.append(capfd.readouterr().err) or "published" in "".join(said))
    assert one.end() == 0
    heard = []
    while (message := one.bus.recv(0)) is not None:
        heard.append(DATABASE.decode_message(message.arbitration_id, message.data))
    last, expected = heard[-1], client.estimate(PROBLEM, rows_of(data))
    assert one.bridge.latest.to_dict()["parameters"] == expected.to_dict()["parameters"]
    # The signals have the resolution 0.0001.
    assert abs(last["k_mean"] - expected["k"].mean) <= 0.00005 + 1e-9
    assert abs(last["k_sd"] - expected["k"].std_dev) <= 0.00005 + 1e-9
    assert last["k_ok"] == 1
    assert last["small"] == 15  # the number of samples is more than four bits hold
    counts = one.bridge.counts()
    assert counts.rows == len(rows_of(data)["t"])
    assert 1 <= counts.saturated <= counts.published == len(heard)  # at first few samples
    assert counts.dropped == counts.late == counts.repeated == counts.undecodable == 0
    assert "rows (" in "".join(said)
    assert "estimate at t = 2.00 s: k = 41.3" in capfd.readouterr().err


def test_a_daemon_that_is_killed_loses_nothing_and_counts_nothing_twice(
        restartable, rig, client, data):
    daemon = restartable()
    one = rig(daemon.address).start()
    parts = np.array_split(np.arange(len(frames(data))), 4)
    all_frames = frames(data)
    for part in parts[:-1]:
        one.send([all_frames[number] for number in part])
        before = one.bridge.counts()
        wait_for(lambda sent=before.rows: one.bridge.counts().rows > sent)
        daemon.kill()
        daemon = restartable()
    one.send([all_frames[number] for number in parts[-1]])
    assert one.end() == 0
    with polyest.connect(daemon.address) as after:
        found = after.session("rig").info()
    table = rows_of(data)
    assert found.sample_count == len(data[0])  # the values of inputs are no samples
    assert found.last_time_s == table["t"][-1]
    assert one.bridge.counts().daemon_reconnects >= 1
    assert one.bridge.latest.to_dict()["parameters"] == (
        client.estimate(PROBLEM, table).to_dict()["parameters"])


def test_a_bridge_that_is_started_again_goes_on_with_the_run(rig, client, data):
    half = len(frames(data)) // 2
    expected = client.estimate(PROBLEM, rows_of(data)).to_dict()["parameters"]
    for part in (frames(data)[:half], frames(data)[half - 100:]):  # some come twice
        one = rig(session={"state": "rig.state"}).start()
        one.send(part)
        wait_for(lambda sent=one: sent.bridge.counts().rows >= 1085)
        assert one.end() == 0
        one.bus.shutdown()
    assert one.bridge.counts().late == 100
    session = client.session("rig")
    session.end_run()
    assert session.info().last_run == 0
    assert session.estimate().to_dict()["parameters"] == expected
    session.close()


def test_a_stream_that_is_played_once_more_has_its_slow_channel(rig, client, data):
    # The force arrives 50 ms after the travel of its time.
    arriving = sorted(frames(data), key=lambda one: one.timestamp
                      + 0.05 * (one.arbitration_id == 512))
    for part in (arriving[:1500], arriving):
        one = rig(session={"state": "rig.state", "reorder_window_s": 0.1}).start()
        one.send(part)
        wait_for(lambda sent=one: sent.bridge.latest is not None)
        assert one.end() == 0
        one.bus.shutdown()
    assert one.bridge.counts().late == 1500
    session = client.session("rig")
    session.end_run()
    expected = client.estimate(PROBLEM, rows_of(data)).to_dict()["parameters"]
    assert session.estimate().to_dict()["parameters"] == expected
    session.close()


def test_a_bridge_without_a_state_begins_a_new_run(rig, client, data):
    for run in range(2):
        one = rig().start()
        one.send(frames(data)[:500])
        wait_for(lambda sent=one: sent.bridge.counts().rows >= 490)
        assert one.end() == 0
        assert client.session("rig").info().last_run == run
        one.bus.shutdown()


def test_a_bus_that_disappears_is_opened_again(rig, data, monkeypatch):
    one = rig()
    opened, fails, bus = [], [2], can.Bus

    def open_bus(*arguments, **options):
        if options.get("preserve_timestamps"):
            return bus(*arguments, **options)
        if fails[0]:
            fails[0] -= 1
            raise can.CanInitializationError("no such device")
        opened.append(bus(*arguments, **options))
        return opened[-1]

    monkeypatch.setattr(can, "Bus", open_bus)
    one.configuration["publish"] = []
    one.start()
    one.send(frames(data)[:1000])
    wait_for(lambda: one.bridge.counts().rows >= 990)
    fails[0] = 1
    opened[-1].shutdown()  # what reads from it fails
    wait_for(lambda: len(opened) == 2)
    one.send(frames(data)[1000:])
    wait_for(lambda: one.bridge.counts().rows >= len(rows_of(data)["t"]) - 1)
    assert one.end() == 0
    assert one.bridge.counts().source_reconnects == 1


def test_frames_out_of_order_are_put_in_order_within_the_window(rig, client, data):
    one = rig(session={"reorder_window_s": 0.1}).start()
    shuffled = frames(data)
    for first in range(1, len(shuffled), 40):
        shuffled[first:first + 40] = shuffled[first:first + 40][::-1]
    one.send(shuffled)
    wait_for(lambda: one.bridge.counts().rows >= len(rows_of(data)["t"]))
    assert one.end() == 0
    assert one.bridge.counts().late == 0
    assert one.bridge.latest.to_dict()["parameters"] == (
        client.estimate(PROBLEM, rows_of(data)).to_dict()["parameters"])


def test_frames_that_find_the_queue_full_are_counted(rig, restartable, data, capfd):
    daemon = restartable()
    one = rig(daemon.address, stream={"queue": 50, "interval_s": 0.2}).start()
    measured = [message for message in frames(data) if message.arbitration_id == 256]
    one.send(measured)
    wait_for(lambda: one.bridge.counts().dropped > 0)
    assert one.end() == 0
    with polyest.connect(daemon.address) as after:
        kept = after.session("rig").info().sample_count
    assert one.bridge.counts().dropped + kept == len(measured)
    assert "left out: dropped" in capfd.readouterr().err


def test_a_wrong_unit_ends_the_bridge_with_the_daemon_s_words(rig, data, capfd):
    one = rig(channels={"x": {"from": "SUSP.defl", "unit": "kg"}}).start()
    one.send(frames(data)[:100])
    one.thread.join(60)  # by itself
    assert one.status == 1
    assert "ended by a failure" in (said := capfd.readouterr().err) and "kg" in said


def test_a_state_that_cannot_be_written_is_said(rig, data, capfd):
    one = rig(session={"state": "no/such/folder.state"}).start()
    one.send(frames(data)[:100])
    assert one.end() == 0
    assert "session.state cannot be written" in capfd.readouterr().err


def test_a_state_of_another_form_is_refused(rig, data, capfd):
    one = rig(session={"state": "rig.state"}).start()
    one.send(frames(data)[:100])
    assert one.end() == 0
    one.bus.shutdown()
    state = one.folder / "rig.state"
    kept = json.loads(state.read_text())
    state.write_text(json.dumps({**kept, "run": str(kept["run"])}))
    two = rig(session={"state": "rig.state"}).start()
    assert two.end() == 1
    assert "rig.state cannot be read" in capfd.readouterr().err


def test_a_daemon_that_never_comes_ends_with_a_failure(rig, data, capfd):
    said = ""

    def has_tried():
        nonlocal said
        said += capfd.readouterr().err
        return "next attempt" in said

    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        one = rig(f"127.0.0.1:{nobody.getsockname()[1]}", stream={"end_timeout_s": 0.2}).start()
        one.send(frames(data)[:100])
        wait_for(has_tried)
        assert one.end() == 1
    said += capfd.readouterr().err
    assert "ended by a failure" in said and said.count("next attempt") < 10


def test_a_last_estimate_that_takes_too_long_is_not_waited_for(rig, data, monkeypatch, capfd):
    computed = threading.Event()
    monkeypatch.setattr("polyest.session.Session.close", lambda session: computed.wait())
    monkeypatch.setattr("polyest.bridge._bridge._GRACE_S", 0.0)
    one = rig(stream={"end_timeout_s": 1.0}).start()
    one.send(frames(data)[:100])
    assert one.end() == 0
    computed.set()
    assert "no rows wait any more, but the last estimate is not" in capfd.readouterr().err


def test_a_clock_that_is_set_back_begins_a_new_run(rig, client, data, monkeypatch):
    now_s = 0.0
    monkeypatch.setattr("polyest.io._assembler.monotonic", lambda: now_s)
    one = rig().start()
    one.send(frames(data)[:1000])
    wait_for(lambda: one.bridge.counts().rows >= 990)
    early = frames(data)[:1000]
    for message in early:
        message.timestamp -= 3600
    one.send(early[:10])
    wait_for(lambda: one.bridge.counts().late == 10)
    now_s = 5.1  # longer than the bridge has patience with a clock that is set back
    one.send(early[10:])
    wait_for(lambda: one.bridge.counts().new_runs == 1)
    assert one.end() == 0
    assert one.bridge.counts().late == 10
    assert client.session("rig").info().last_run == 1


@pytest.mark.parametrize(("change", "said"), [
    ({"session": {"nane": "rig"}}, "session.nane: is not known; do you mean name"),
    ({"session": {"name": 7}}, "session.name: must be text; got 7"),
    ({"session": {"problem": "none.json"}}, "none.json: cannot be opened"),
    ({"session": {"reorder_window_s": -1}}, "session.reorder_window_s: must be ≥ 0; got -1"),
    ({"source": {"kind": "lin"}}, "source.kind: must be one of can, mcap, foxglove; got 'lin'"),
    ({"source": {"database": "none.dbc"}}, "none.dbc: cannot be opened"),
    ({"source": {"database": "problem.json"}}, "problem.json: is no CAN database"),
    ({"channels": {"x": "SUSP.deflection"}}, "channels.x: there is no signal 'SUSP.deflection'; "
     "the nearest are 'SUSP.defl'"),
    ({"channels": {"y": "SUSP.defl"}}, "channels: there is no output, input or condition of the "
     "problem 'y'"),
    ({"channels": {"x": {"from": "SUSP.defl", "scale": 2}}}, "channels.x.scale: is not known"),
    ({"stream": {"queue": 0}}, "stream.queue: must be ≥ 1; got 0"),
    ({"stream": {"interval_s": 0}}, "stream.interval_s: must be > 0; got 0"),
    ({"publish": [{"kind": "can", "message": "ETS", "signals": {"k_mean": "k.mean"}}]},
     r"publish\[0\].message: there is no message 'ETS'; the nearest are 'EST'"),
    ({"publish": [{"kind": "can", "message": "EST", "signals": {"k": "k.mean"}}]},
     r"publish\[0\].signals: there is no signal 'k'; "),
    ({"publish": [{"kind": "can", "message": "EST", "signals": {"k_mean": "m.mean"}}]},
     r"publish\[0\].signals.k_mean: there is no uncertain parameter 'm'; there are 'k', 'c'"),
    ({"publish": [{"kind": "can", "message": "EST", "signals": {"k_mean": "k.value"}}]},
     "'k.value' is no value of an estimate: those are PARAMETER.mean|"),
    ({"publish": [{"kind": "fax"}]},
     r"publish\[0\].kind: must be one of can, mqtt, foxglove, jsonl"),
    ({"surprise": {}}, "surprise: is not known; known are channels, daemon"),
])
def test_a_wrong_configuration_names_the_field(tmp_path, change, said):
    one = Rig(tmp_path, "127.0.0.1:1", **change)
    one.bus.shutdown()
    (tmp_path / "bridge.json").write_text(json.dumps(one.configuration))
    with pytest.raises(polyest.InvalidInput, match=said):
        bridge.Bridge(bridge.read_configuration(tmp_path / "bridge.json"))


def test_a_configuration_that_gives_a_field_twice_is_refused(tmp_path):
    (tmp_path / "bridge.json").write_text('{"session": {"name": "a", "name": "b"}}')
    with pytest.raises(polyest.InvalidInput, match=r"bridge\.json: session\.name: given twice$"):
        bridge.read_configuration(tmp_path / "bridge.json")


def test_an_input_without_a_channel_is_refused(tmp_path):
    one = Rig(tmp_path, "127.0.0.1:1")
    one.bus.shutdown()
    del one.configuration["channels"]["force"]
    (tmp_path / "bridge.json").write_text(json.dumps(one.configuration))
    with pytest.raises(polyest.InvalidInput, match="input 'force' is streamed and has no channel"):
        bridge.Bridge(bridge.read_configuration(tmp_path / "bridge.json"))


def test_the_truth_is_found(client, data):
    found = client.estimate(PROBLEM, rows_of(data))
    for name, value in TRUTH.items():
        assert abs(found[name].mean - value) < 5 * found[name].std_dev + 0.01 * value
