"""The bridge as a client of Foxglove's WebSocket protocol, against a server and a real daemon."""

import base64
import json
import re
import struct
import threading
from types import SimpleNamespace

import pytest

import polyest
from polyest import bridge
from rig import PROBLEM, Waits, record, wait_for

pytest.importorskip("websockets")

from google.protobuf import wrappers_pb2

from foxglove_server import FoxgloveServer
from polyest.bridge._foxglove_source import FoxgloveSource

START_NS = 1_790_000_000 * 10**9
UNITS = json.dumps({"type": "object", "properties": {"defl": {"type": "number", "unit": "mm"}}})
SUSPENSION = {"topic": "/susp", "encoding": "json", "schema": UNITS, "schemaEncoding": "jsonschema"}
ROAD = {"topic": "/road", "encoding": "json"}
OTHER = {"topic": "/camera", "encoding": "cdr"}  # nobody asks for these
BROKEN = {"topic": "/lidar", "encoding": "protobuf", "schema": "no Base64!"}


@pytest.fixture
def serve():
    """Starts servers, which end with the test."""
    started = []

    def start(*channels, port=0):
        started.append(FoxgloveServer(channels, port))
        return started[-1]

    yield start
    for server in started:
        server.close()


class Bridged:
    """A bridge that works in threads of its own."""

    def __init__(self, folder, client, url, name, channels=None):
        PROBLEM.save(folder / "problem.json")
        (folder / "bridge.json").write_text(json.dumps({
            "daemon": {"server": client.server},
            "session": {"name": name, "problem": "problem.json", "reorder_window_s": 0.5},
            "source": {"kind": "foxglove", "url": url},
            "channels": channels or {"x": "/susp.defl",
                                     "force": {"from": "/road.force", "unit": "N"}},
            "stream": {"interval_s": 0.02}, "estimates": {"interval_s": 0.05},
            "status": {"interval_s": 0.2}}))
        self.said = []
        self.bridge = bridge.Bridge(bridge.read_configuration(folder / "bridge.json"))
        self.bridge.say = self.said.append
        self.bridge._source._say = self.said.append
        self.taken = 0
        put = self.bridge._feeder.put

        def counted(time_ns, values):
            put(time_ns, values)
            self.taken += 1

        self.bridge._feeder.put = counted
        self.stop = threading.Event()
        self.status = None
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self):
        self.status = self.bridge.run(self.stop)

    def end(self, taken=0):
        """Ends the bridge once it has taken so many messages; returns its exit status."""
        wait_for(lambda: self.taken >= taken)
        self.stop.set()
        self.thread.join(30)
        assert not self.thread.is_alive()
        return self.status

    def says(self, pattern):
        wait_for(lambda: any(re.search(pattern, line) for line in self.said))


def messages(seconds=2.0):
    """The rig's record as messages, in the order of their times."""
    fine, x, coarse, force = record(seconds)
    both = [(round(t * 1e9), "/susp", {"defl": value}) for t, value in zip(fine, x)]
    both += [(round(t * 1e9), "/road", {"force": value}) for t, value in zip(coarse, force)]
    return sorted(both, key=lambda one: one[0])


def send(server, rows):
    for time_ns, topic, message in rows:
        server.send(topic, START_NS + time_ns, message)


def test_the_estimate_is_that_of_the_same_rows(tmp_path, client, serve):
    server = serve(SUSPENSION, OTHER, BROKEN, ROAD)
    bridged = Bridged(tmp_path, client, server.url, "foxglove")
    server.wait_for_subscriptions(wait_for, {"/susp", "/road"})
    rows = messages()
    send(server, rows)
    assert bridged.end(len(rows)) == 0, bridged.said
    counts = bridged.bridge.counts()
    assert (counts.dropped, counts.late, counts.undecodable, counts.refused) == (0, 0, 0, 0)
    session = client.session("foxglove")
    assert session.info().sample_count == sum(topic == "/susp" for _, topic, _ in rows)
    found = bridged.bridge.latest
    assert abs(found["k"].mean - 41.3) < 4 * found["k"].std_dev


def test_a_server_that_goes_is_connected_again(tmp_path, client, serve):
    server = serve(SUSPENSION, ROAD)
    bridged = Bridged(tmp_path, client, server.url, "foxglove-again")
    server.wait_for_subscriptions(wait_for, {"/susp", "/road"})
    rows = messages()
    send(server, rows[:1000])
    wait_for(lambda: bridged.taken == 1000)
    port = server.port
    server.close()
    bridged.says("the server ws://127.0.0.1:[0-9]+ fails: .*; it is connected again in")
    again = serve(ROAD, SUSPENSION, port=port)  # with other numbers
    again.wait_for_subscriptions(wait_for, {"/susp", "/road"})
    send(again, rows[1000:])
    bridged.says("reconnects: source 1")
    assert bridged.end(len(rows)) == 0, bridged.said
    assert bridged.bridge.counts().source_reconnects == 1
    assert client.session("foxglove-again").info().last_time_s == pytest.approx(1.999, abs=0.02)


def test_topics_of_protobuf_are_decoded_by_their_schema(tmp_path, client, serve):
    from google.protobuf import descriptor_pb2

    files = descriptor_pb2.FileDescriptorSet()
    wrappers_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    kind = {"encoding": "protobuf", "schemaName": "google.protobuf.DoubleValue",
            "schema": base64.b64encode(files.SerializeToString()).decode()}
    server = serve({"topic": "/susp", **kind}, {"topic": "/road", **kind})
    bridged = Bridged(tmp_path, client, server.url, "foxglove-protobuf", {
        "x": {"from": "/susp.value", "unit": "mm"}, "force": "/road.value"})
    server.wait_for_subscriptions(wait_for, {"/susp", "/road"})
    send(server, [(time_ns, topic, wrappers_pb2.DoubleValue(value=value).SerializeToString())
                  for time_ns, topic, message in messages() for value in message.values()])
    wait_for(lambda: bridged.bridge.latest is not None)
    assert bridged.end() == 0, bridged.said
    found = bridged.bridge.latest
    assert abs(found["k"].mean - 41.3) < 4 * found["k"].std_dev


def test_foxglove_s_own_server_is_understood(tmp_path, client):
    foxglove = pytest.importorskip("foxglove", reason="foxglove-sdk is missing: pip install it")

    class Subscriptions(foxglove.websocket.ServerListener):
        topics = frozenset()

        def on_subscribe(self, client, channel):
            self.topics |= {channel.topic}

    heard = Subscriptions()
    server = foxglove.start_server(port=0, server_listener=heard)
    kinds = {"/susp": UNITS, "/road": "{}"}
    channels = {topic: foxglove.Channel(topic, message_encoding="json", schema=json.loads(kind))
                for topic, kind in kinds.items()}
    bridged = Bridged(tmp_path, client, f"ws://127.0.0.1:{server.port}", "foxglove-sdk")
    wait_for(lambda: heard.topics == set(channels))
    rows = messages()
    for number, (time_ns, topic, message) in enumerate(rows):
        channels[topic].log(json.dumps(message).encode(), log_time=START_NS + time_ns)
        # It drops messages of which more than 1024 wait.
        wait_for(lambda sent=number: bridged.taken > sent - 500)
    assert bridged.end(len(rows)) == 0, bridged.said
    server.stop()
    found = bridged.bridge.latest
    assert abs(found["k"].mean - 41.3) < 4 * found["k"].std_dev


def test_an_encoding_that_is_not_read_ends_the_bridge_with_topic_and_encoding(
        tmp_path, client, serve):
    server = serve(ROAD, {"topic": "/susp", "encoding": "cdr"})
    bridged = Bridged(tmp_path, client, server.url, "foxglove-cdr")
    bridged.says("ended by a failure: channels.x: topic /susp has messages in 'cdr'; those in "
                 "json and protobuf are read")
    bridged.thread.join(30)
    assert bridged.status == 1


def test_messages_that_cannot_be_read_are_counted_and_the_first_is_said(tmp_path, client, serve):
    server = serve(SUSPENSION, ROAD)
    bridged = Bridged(tmp_path, client, server.url, "foxglove-bad")
    server.wait_for_subscriptions(wait_for, {"/susp", "/road"})
    for bad in (b"{", b"[1", {"defl": "none"}, {"defl": [1]}, {"deflection": 1.0}, {"defle": 1.0}):
        server.send("/susp", START_NS, bad)
    server.tell(op="status", level=1, message="the sensor is warm")
    server.connection.send("[]")
    server.connection.send(b"\x02" + bytes(8))  # the time of a simulation
    rows = messages()
    send(server, rows)
    bridged.says("left out: undecodable 4")
    assert bridged.end(len(rows)) == 0, bridged.said
    for pattern in ("/susp: has a message that cannot be decoded",
                    "/susp.defl: is no number but str", "a message has no number at its field",
                    "the server says: the sensor is warm", "a message that the protocol does not"):
        assert sum(pattern in line for line in bridged.said) == 1, (pattern, bridged.said)
    assert client.session("foxglove-bad").info().sample_count == sum(
        topic == "/susp" for _, topic, _ in rows)


def test_a_topic_that_is_withdrawn_comes_back_under_another_number(tmp_path, client, serve):
    server = serve(SUSPENSION, ROAD)
    bridged = Bridged(tmp_path, client, server.url, "foxglove-back")
    server.wait_for_subscriptions(wait_for, {"/susp", "/road"})
    rows = messages()
    send(server, rows[:1000])
    wait_for(lambda: bridged.taken == 1000)
    first = server.channels[0]
    server.tell(op="unadvertise", channelIds=[first["id"]])
    del server.subscribed[first["id"]]
    server.channels[0] = {**first, "id": 99}
    server.tell(op="advertise", channels=[server.channels[0]])
    server.wait_for_subscriptions(wait_for, {"/susp", "/road"})
    send(server, rows[1000:])
    assert bridged.end(len(rows)) == 0, bridged.said
    assert client.session("foxglove-back").info().sample_count == sum(
        topic == "/susp" for _, topic, _ in rows)


def test_a_topic_that_is_not_there_is_named_with_the_nearest(tmp_path, client, serve, monkeypatch):
    monkeypatch.setattr("polyest.bridge._foxglove_source._PATIENCE_S", 0.1)
    server = serve({**SUSPENSION, "topic": "/suspension"}, ROAD)
    bridged = Bridged(tmp_path, client, server.url, "foxglove-missing")
    bridged.says("channels.x: there is no topic '/susp.defl'.*'/suspension'")
    assert bridged.end() == 0


class Closing:
    """A connection that brings some messages and is closed by the server then."""

    subprotocol = "foxglove.websocket.v1"

    def __init__(self, *brought):
        self.brought = list(brought)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def send(self, message):
        pass

    def recv(self, timeout):
        if not self.brought:
            raise OSError("closed")
        return self.brought.pop(0)


def sourced(connections, **channels):
    """Runs a source on these connections; returns it, its lines, samples and delays."""
    said, taken, stop = [], [], Waits(len(connections))
    source = FoxgloveSource(SimpleNamespace(url="ws://rig"), channels, said.append)
    source._connect = lambda *_, **__: connections[len(stop.delays)]
    source.run(lambda time_ns, values: taken.append((time_ns, values)), stop)
    return source, said, taken, stop.delays


def advertised(*channels):
    return json.dumps({"op": "advertise", "channels": channels})


DATA = struct.pack("<BIQ", 1, 3, START_NS) + b'{"force": 2.0}'


def test_a_server_that_closes_each_connection_is_asked_less_and_less():
    greeting = [json.dumps({"op": "serverInfo", "name": "rig"}), advertised({**ROAD, "id": 3})]
    source, said, taken, delays = sourced(
        [Closing(), Closing(*greeting), Closing(*greeting), Closing(*greeting, DATA)],
        force="/road.force")
    assert delays == [0.2, 0.4, 0.8, 1.6]
    assert said[2] == "the server ws://rig fails: closed; it is connected again in 0.8 s"
    assert taken == [(START_NS, {"force": 2.0})]
    assert source.reconnects == 3


def test_a_wanted_topic_with_a_broken_schema_is_said_once_and_left_out(monkeypatch):
    # That a topic is missing would be said at once.
    monkeypatch.setattr("polyest.bridge._foxglove_source._PATIENCE_S", -1.0)
    announced = advertised({**BROKEN, "id": 2}, {**ROAD, "id": 3})
    _, said, taken, _ = sourced([Closing(announced, DATA), Closing(announced, DATA)],
                                x="/lidar.range", force="/road.force")
    about, = (line for line in said if "/lidar" in line)
    assert about.startswith("/lidar: has a schema that is no Base64")
    assert about.endswith("; the topic is left out")
    assert taken == [(START_NS, {"force": 2.0})] * 2


def test_an_address_of_another_kind_is_refused(tmp_path):
    PROBLEM.save(tmp_path / "problem.json")
    (tmp_path / "bridge.json").write_text(json.dumps({
        "daemon": {"server": "127.0.0.1:1"}, "session": {"name": "a", "problem": "problem.json"},
        "source": {"kind": "foxglove", "url": "http://127.0.0.1:8765"}, "channels": {"x": "/a.b"}}))
    with pytest.raises(polyest.InvalidInput, match=r"source.url: must begin with ws:// or wss://"):
        bridge.read_configuration(tmp_path / "bridge.json")
