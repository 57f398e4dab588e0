"""Topics whose schemas are unusual or broken, as files and servers may have them."""

import json
from types import SimpleNamespace

import pytest
from google.protobuf import descriptor_pb2, wrappers_pb2

from polyest.bridge._topic_values import TopicValues
from polyest.errors import InvalidInput
from polyest.io._topics import MessageDecoder, unit_of


def topic(name="/susp", encoding="json", **metadata):
    return SimpleNamespace(id=1, topic=name, message_encoding=encoding, metadata=metadata)


def json_schema(described):
    return SimpleNamespace(name="any", encoding="jsonschema", data=json.dumps(described).encode())


@pytest.mark.parametrize("described", [
    [], True, 7, {"properties": True}, {"properties": {"defl": [1]}}, {"items": [{"unit": "m"}]},
    {"properties": {"defl": {"unit": 3}}}])
def test_an_unusual_schema_leaves_the_unit_to_the_metadata(described):
    assert unit_of(json_schema(described), topic(unit="mm"), ["defl"]) == "mm"
    assert unit_of(json_schema(described), topic(), [0, "defl"]) == ""


def test_a_topic_with_an_unusual_schema_is_found():
    values = TopicValues({"x": "/susp.defl"})
    assert values.find(json_schema([]), topic())
    assert values.missing() == {}


def wrappers(**changes):
    files = descriptor_pb2.FileDescriptorSet()
    wrappers_pb2.DESCRIPTOR.CopyToProto(files.file.add())
    return SimpleNamespace(**{"name": "google.protobuf.DoubleValue", "encoding": "protobuf",
                              "data": files.SerializeToString(), **changes})


# A file that imports another, which is not there.
LACKING = descriptor_pb2.FileDescriptorSet(file=[
    descriptor_pb2.FileDescriptorProto(name="a.proto", dependency=["b.proto"])])


@pytest.mark.parametrize("schema, said", [
    (None, "has no schema"),
    (wrappers(name="google.protobuf.Nothing"), "cannot be used"),
    (wrappers(data=b"\xff\xff"), "cannot be used"),
    (wrappers(data=b""), "cannot be used"),
    (wrappers(data=LACKING.SerializeToString()), "cannot be used")])
def test_a_schema_of_protobuf_that_cannot_be_used_is_refused_by_topic(schema, said):
    with pytest.raises(InvalidInput, match=f"/susp.*{said}"):
        MessageDecoder().decode(schema, topic(encoding="protobuf"), b"")


def test_the_longer_topic_fits_whatever_comes_first():
    for order in (("/a", "/a.b"), ("/a.b", "/a")):
        values = TopicValues({"x": "/a.b.c"})
        for name in order:
            values.find(json_schema({}), topic(name))
        assert values.values(topic("/a.b"), {"c": 2.0}) == {"x": 2.0}
        assert values.values(topic("/a"), {"b": {"c": 1.0}}) == {}
