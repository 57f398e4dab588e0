"""A rig that streams 100 rows a second and measures how long each takes to be acknowledged."""

import argparse
import os
import pathlib
import queue
import subprocess
import tempfile
import time

import grpc
from google.protobuf import descriptor_pb2, descriptor_pool, json_format, message_factory

PROTO = pathlib.Path(__file__).resolve().parents[2] / "proto"
PROBLEM = {"model": {"builtin": "mass_spring_damper"}, "fixed": {"m": 1, "x0": 1},
           "uncertain": [{"name": "k", "uniform": {"lower": 31.58, "upper": 47.37}}],
           "measured": [{"output": "x", "noise": {"absolute": 0.01}}]}
INTERVAL_S = 0.01
# From one estimate to the next, s: one after each row would keep a core busy by itself.
ESTIMATE_INTERVAL_S = 1.0


def program(path):
    """Takes an argument of a command line that names a program."""
    if not pathlib.Path(path).is_file() or not os.access(path, os.X_OK):
        raise argparse.ArgumentTypeError(f"{path} is no program that can be run")
    return path


def messages():
    """Returns the classes of the messages of sessions, made from the contract."""
    with tempfile.NamedTemporaryFile() as file:
        subprocess.run(["protoc", f"--proto_path={PROTO}", "--include_imports",
                        f"--descriptor_set_out={file.name}", "polyest/v1/session_service.proto"],
                       check=True)
        files = descriptor_pb2.FileDescriptorSet.FromString(pathlib.Path(file.name).read_bytes())
    pool = descriptor_pool.DescriptorPool()
    for one in files.file:
        pool.Add(one)
    factory = message_factory.MessageFactory(pool)
    return lambda name: factory.GetPrototype(pool.FindMessageTypeByName(f"polyest.v1.{name}"))


def call_credentials(token):
    """Returns the metadata with which a caller shows a token; nothing without one."""
    return (("authorization", f"Bearer {token}"),) if token else ()


class Probe:
    """A session with its open stream."""

    def __init__(self, address, certificate=None, token=None, streams_to=None):
        """`certificate`: PEM file of the one that the server at `address` has; none without TLS.
        `token`: of a writer; none if the server has no tokens. `streams_to`: the address of another
        daemon of the same database, which gets the stream."""
        message = messages()
        self.request = message("StreamMeasurementsRequest")
        create = message("CreateSessionRequest")
        if certificate:
            credentials = grpc.ssl_channel_credentials(pathlib.Path(certificate).read_bytes())
            channel = grpc.secure_channel(address, credentials)
        else:
            channel = grpc.insecure_channel(address)
        self.name = f"sessions/probe-{time.monotonic_ns()}"
        request = json_format.ParseDict({"session": {"problem": PROBLEM}}, create())
        request.session_id = self.name.removeprefix("sessions/")
        channel.unary_unary("/polyest.v1.SessionService/CreateSession",
                            request_serializer=create.SerializeToString,
                            response_deserializer=bytes)(request, timeout=30,
                                                         metadata=call_credentials(token))
        if streams_to:
            channel = grpc.insecure_channel(streams_to)
        self.queue = queue.Queue()
        self.sequence = 0
        self.answers = channel.stream_stream(
            "/polyest.v1.SessionService/StreamMeasurements",
            request_serializer=self.request.SerializeToString,
            response_deserializer=message("StreamMeasurementsResponse").FromString)(
                iter(self.queue.get, None), metadata=call_credentials(token))
        self.channel = channel

    def one(self):
        """Streams one row and returns the time until its acknowledgement, s."""
        self.sequence += 1
        request = self.request(session=self.name, sequence=self.sequence)
        if self.sequence == 1:
            request.estimates.min_interval_s = ESTIMATE_INTERVAL_S
        request.measurements.time_s.append(0.01 * self.sequence)
        channel = request.measurements.channels.add(name="x")
        channel.values.append(0.5)
        begin = time.monotonic()
        self.queue.put(request)
        while not next(self.answers).HasField("acknowledgement"):
            pass
        return time.monotonic() - begin

    def run(self, seconds):
        """Streams for so long and returns the median and the 99th percentile, ms."""
        times = []
        begin = time.monotonic()
        while (now := time.monotonic()) < begin + seconds:
            times.append(1e3 * self.one())
            time.sleep(max(0, INTERVAL_S - (time.monotonic() - now)))
        times.sort()
        return times[len(times) // 2], times[int(0.99 * (len(times) - 1))]

    def close(self):
        self.queue.put(None)
        self.channel.close()
