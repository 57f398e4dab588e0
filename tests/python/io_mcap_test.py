"""MCAP files: topics in JSON and protobuf, times, units, names; against the command's own CSV."""

import json
import sys

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, struct_pb2, wrappers_pb2

import polyest
from polyest.io import mcap
from rig import PROBLEM, estimate_of_csv, record, same, write_csv

writer = pytest.importorskip("mcap.writer")

START = 1_790_000_000 * 10**9  # ns since 1970
CHANNELS = {"x": "/susp.travel.value", "force": "/road[0]"}
SCHEMA = {"type": "object", "properties": {"travel": {"type": "object", "properties": {
    "value": {"type": "number", "unit": "mm"}}}}}


class File:
    """Writes topics into an MCAP file."""

    def __init__(self, path, **options):
        self._file = path.open("wb")
        self._writer = writer.Writer(self._file, **options)
        self._writer.start()
        self.path = path

    def topic(self, name, encoding="json", schema=b"{}", schema_name="any", metadata=None):
        kind = self._writer.register_schema(
            schema_name, "jsonschema" if encoding == "json" else encoding, schema)
        return self._writer.register_channel(name, encoding, kind, metadata or {})

    def add(self, topic, time, data, publish=None):
        data = data if isinstance(data, bytes) else json.dumps(data).encode()
        self._writer.add_message(topic, time, data, time if publish is None else publish)

    def end(self):
        self._writer.finish()
        self._file.close()
        return self.path


def messages(data):
    """Yields time, topic and message in the order of time."""
    fine, x, coarse, force = data
    both = [(round(t * 1e9), "/susp", {"travel": {"value": value}, "note": "fine"})
            for t, value in zip(fine, x)]
    both += [(round(t * 1e9), "/road", [value]) for t, value in zip(coarse, force)]
    return sorted(both, key=lambda one: one[0])


def ride(path, data, order=lambda found: found, **options):
    file = File(path, **options)
    topics = {"/susp": file.topic("/susp", schema=json.dumps(SCHEMA).encode()),
              "/road": file.topic("/road", metadata={"unit": "N"})}
    for time, topic, message in order(messages(data)):
        file.add(topics[topic], START + time, message)
    return file.end()


@pytest.fixture(scope="module")
def data():
    return record(2.0)


def test_a_file_gives_the_estimate_of_the_same_rows_in_csv(client, tmp_path, data):
    write_csv(tmp_path / "ride.csv", *data)
    expected = estimate_of_csv(tmp_path, tmp_path / "ride.csv")
    recording = mcap.read(ride(tmp_path / "ride.mcap", data), CHANNELS)
    assert recording.units == {"x": "mm", "force": "N"}
    # Whole ns divided by 10⁹ are the floats that the decimal numbers of the CSV have.
    assert same(client.estimate(PROBLEM, recording), expected)


def swapped(found):
    """Returns messages each of which changes places with its neighbour."""
    return [found[number ^ 1] for number in range(len(found) // 2 * 2)]


@pytest.mark.parametrize("options", [{}, {"use_chunking": False}, {"chunk_size": 500}])
def test_the_order_and_the_chunks_of_the_file_do_not_matter(tmp_path, data, options):
    expected = mcap.read(ride(tmp_path / "a.mcap", data), CHANNELS).to_dict()
    found = mcap.read(ride(tmp_path / "b.mcap", data, swapped, **options), CHANNELS,
                      batch_rows=50)
    assert max(map(len, found)) <= 50
    for name, column in found.to_dict().items():
        np.testing.assert_array_equal(column, expected[name][:len(column)])


def test_a_message_later_than_the_window_is_refused(tmp_path, data):
    path = ride(tmp_path / "a.mcap", data, lambda found: [*found[1000:], *found[:1000]])
    with pytest.raises(polyest.InvalidInput, match="more than reorder_window_s = 0.01"):
        mcap.read(path, CHANNELS, reorder_window_s=0.01, batch_rows=100).all()


def small(path, values, **described):
    file = File(path)
    topic = file.topic("/susp", **described)
    for number, value in enumerate(values):
        file.add(topic, START + number * 250_000_000, value,
                 publish=START + number * 500_000_000)
    return file.end()


def test_messages_without_the_field_have_no_sample(tmp_path):
    path = small(tmp_path / "a.mcap", [{"v": 1}, {}, {"v": None}, {"v": 2.5}, {"v": float("nan")},
                                      {"v": float("-inf")}])
    found = mcap.read(path, {"x": "/susp.v"}).to_dict()
    assert list(found["t"]) == [0, 0.75]
    assert list(found["x"]) == [1, 2.5]


def test_times_are_those_of_the_log_or_of_the_publisher(tmp_path):
    path = small(tmp_path / "a.mcap", [{"v": 1}, {"v": 2}])
    channels = {"x": "/susp.v"}
    assert list(mcap.read(path, channels).to_dict()["t"]) == [0, 0.25]
    assert list(mcap.read(path, channels, time="publish").to_dict()["t"]) == [0, 0.5]
    kept = mcap.read(path, channels, time_zero="file").to_dict()["t"]
    assert list(kept) == [1_790_000_000, 1_790_000_000.25]


def test_protobuf_messages_are_decoded_by_the_schema_of_the_file(tmp_path):
    described = descriptor_pb2.FileDescriptorSet()
    for file in (struct_pb2.DESCRIPTOR, wrappers_pb2.DESCRIPTOR):
        file.CopyToProto(described.file.add())
    path = small(tmp_path / "a.mcap",
                 [wrappers_pb2.DoubleValue(value=value).SerializeToString() for value in (1.5, 2)],
                 encoding="protobuf", schema=described.SerializeToString(),
                 schema_name="google.protobuf.DoubleValue")
    assert list(mcap.read(path, {"x": "/susp.value"}).to_dict()["x"]) == [1.5, 2]
    with pytest.raises(polyest.InvalidInput, match=r"'/susp.valu'; the nearest are '/susp.value'"):
        mcap.read(path, {"x": "/susp.valu"}).all()
    assert mcap.topics(path) == {"/susp": ["/susp.value"]}


@pytest.mark.parametrize(("values", "path", "said"), [
    ([{"v": 1}], "/sus.v", r"channels.x: there is no topic '/sus.v'; "),
    ([{"v": 1}], "/susp.w", r"there is no field with numbers '/susp.w'; the nearest are '/susp.v'"),
    ([{"v": "fast"}], "/susp.v", "/susp.v: is no number but str"),
    ([{"v": {"a": 1}}], "/susp.v", "/susp.v: is no number but dict; its fields are a"),
    ([{"v": 1}], "/susp.v[", "is no path such as"),
    ([b"{"], "/susp.v", "/susp: has a message that cannot be decoded"),
])
def test_what_cannot_be_read_is_refused_by_name(tmp_path, values, path, said):
    with pytest.raises(polyest.InvalidInput, match=said):
        mcap.read(small(tmp_path / "a.mcap", values), {"x": path}).all()


def test_other_encodings_are_refused(tmp_path):
    path = small(tmp_path / "a.mcap", [b"x"], encoding="cdr")
    with pytest.raises(polyest.InvalidInput, match="has messages in 'cdr'; those in json and"):
        mcap.read(path, {"x": "/susp.v"})


@pytest.mark.parametrize("length", [0, 4, 100, 400])
def test_files_that_are_cut_short_are_refused(tmp_path, data, length):
    whole = ride(tmp_path / "a.mcap", data).read_bytes()
    (tmp_path / "b.mcap").write_bytes(whole[:length])
    with pytest.raises(polyest.InvalidInput, match=r"b\.mcap: "):
        mcap.read(tmp_path / "b.mcap", CHANNELS)


def test_without_the_extra_pip_s_command_is_named(monkeypatch, tmp_path, data):
    path = ride(tmp_path / "a.mcap", data)
    for module in ("mcap", "mcap.reader", "mcap.exceptions"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ImportError, match=r"pip install 'polyest\[mcap\]'"):
        mcap.read(path, CHANNELS)
