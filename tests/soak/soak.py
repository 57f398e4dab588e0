"""Asks whether the daemon's memory stays flat under load that goes on and on.

    soak.py POLYESTD [--minutes M] [--streams N] [--sessions-per-s R]

N rigs stream to their sessions all the time; beside them, R sessions a second are created, streamed
to, asked for their estimate and their history, left alone and, two hundred sessions later, deleted.
Prints the daemon's resident memory each minute: the median of that minute. Exits with status 1 if
the memory is not flat within 5 % after the first sixth of the time (ten minutes of an hour), that
is, if its highest minute has more than 5 % above its lowest, or if a call fails.
"""

import argparse
import contextlib
import math
import pathlib
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time

import grpc
from google.protobuf import json_format

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "attack"))
import probe  # noqa: E402  (the messages and the problem are the probe's)

FLAT = 0.05
BATCH_ROWS = 10
STEP_S = 0.01
BATCHES_PER_S = 20
# Batches of a session that is deleted again.
SHORT_BATCHES = 20
LEFT_ALONE = 200
# Batches from one estimate to the next.
BATCHES_PER_ESTIMATE = 10
STIFFNESS = 40.0
NOISE = 0.01


class Client:
    """Calls the daemon; safe for threads."""

    def __init__(self, address):
        self.message = probe.messages()
        self.channel = grpc.insecure_channel(address)

    def call(self, method, request, answer, **fields):
        request = json_format.ParseDict(fields, self.message(request)())
        return self.channel.unary_unary(
            f"/polyest.v1.SessionService/{method}",
            request_serializer=type(request).SerializeToString,
            response_deserializer=answer and self.message(answer).FromString)(request, timeout=60)

    def create(self, name):
        self.call("CreateSession", "CreateSessionRequest", None, sessionId=name,
                  session={"problem": probe.PROBLEM})

    def batch(self, name, sequence, seed):
        """Returns what an oscillator measures, with noise that is always the same."""
        request = self.message("StreamMeasurementsRequest")(session=name, sequence=sequence)
        request.estimates.batch_count = BATCHES_PER_ESTIMATE
        channel = request.measurements.channels.add(name="x")
        for row in range((sequence - 1) * BATCH_ROWS, sequence * BATCH_ROWS):
            time_s = STEP_S * (row + 1)
            noise = NOISE * math.sqrt(2) * math.sin(12.9898 * row * row + seed)
            request.measurements.time_s.append(time_s)
            channel.values.append(math.cos(math.sqrt(STIFFNESS) * time_s) + noise)
        return request

    def stream(self, name, batches, pause_s, stop):
        """Streams batches at a steady pace until there were enough or `stop` is set."""
        def requests():
            begin = time.monotonic()
            for sequence in range(1, batches + 1):
                if stop.wait(max(0, begin + sequence * pause_s - time.monotonic())):
                    return
                yield self.batch(name, sequence, hash(name) % 97)

        answers = self.channel.stream_stream(
            "/polyest.v1.SessionService/StreamMeasurements",
            request_serializer=self.message("StreamMeasurementsRequest").SerializeToString,
            response_deserializer=self.message("StreamMeasurementsResponse").FromString)(requests())
        for _ in answers:
            pass


class Load:
    """Threads that use the daemon until they are stopped; the first failure is kept."""

    def __init__(self, client):
        self.client, self.stop, self.failure, self.sessions = client, threading.Event(), None, 0
        self.threads = []

    def start(self, work, *arguments):
        def run():
            try:
                work(*arguments)
            except grpc.RpcError as error:
                if not self.stop.is_set():
                    self.failure = error
                    self.stop.set()

        self.threads.append(threading.Thread(target=run, daemon=True))
        self.threads[-1].start()

    def keep_streaming(self, number):
        self.client.create(f"fixed-{number}")
        self.client.stream(f"sessions/fixed-{number}", sys.maxsize, 1 / BATCHES_PER_S, self.stop)

    def use_new_sessions(self, pause_s):
        begin = time.monotonic()
        while not self.stop.wait(max(0, begin + self.sessions * pause_s - time.monotonic())):
            name = f"short-{self.sessions}"
            self.client.create(name)
            self.client.stream(f"sessions/{name}", SHORT_BATCHES, 0, self.stop)
            for method in ("GetEstimate", "GetHistory"):
                self.client.call(method, f"{method}Request", None, session=f"sessions/{name}")
            if self.sessions >= LEFT_ALONE:
                self.client.call("DeleteSession", "DeleteSessionRequest", None,
                                 name=f"sessions/short-{self.sessions - LEFT_ALONE}")
            self.sessions += 1

    def end(self):
        self.stop.set()
        for thread in self.threads:
            thread.join()


@contextlib.contextmanager
def daemon(polyestd, folder):
    """Runs a daemon; yields its process and its address."""
    command = [polyestd, "--listen", "127.0.0.1:0", "--data-dir", f"{folder}/data"]
    with open(f"{folder}/log", "w", encoding="utf-8") as log, \
         subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True) as process:
        try:
            for line in process.stdout:
                if match := re.match(r"listening on (.*)", line):
                    break
            else:
                raise SystemExit("the daemon does not start")
            yield process, match.group(1)
        finally:
            process.kill()


def resident_mib(process):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
    return int(re.search(r"VmRSS:\s*(\d+)", status).group(1)) / 1024


def watch(process, load, minutes):
    """Prints the memory each minute and returns the medians, MiB; ends when a call fails."""
    medians = []
    for minute in range(1, minutes + 1):
        samples, end = [], time.monotonic() + 60
        while time.monotonic() < end and not load.stop.wait(1):
            samples.append(resident_mib(process))
        if load.failure:
            break
        medians.append(statistics.median(samples))
        print(f"minute {minute:3}: {medians[-1]:7.1f} MiB, {load.sessions} sessions", flush=True)
    return medians


def is_flat(medians):
    """Says, and returns, whether the memory has been flat after the first sixth of the minutes."""
    sixth = max(1, len(medians) // 6)
    lowest, highest = min(medians[sixth:]), max(medians[sixth:])
    print(f"{lowest:.1f} to {highest:.1f} MiB after the first {sixth} minutes "
          f"({100 * (highest / lowest - 1):.1f} % apart)")
    return highest <= (1 + FLAT) * lowest


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("polyestd", type=probe.program)
    parser.add_argument("--minutes", type=int, default=60, help="≥ 2")
    parser.add_argument("--streams", type=int, default=3)
    parser.add_argument("--sessions-per-s", type=float, default=5)
    arguments = parser.parse_args()
    if arguments.minutes < 2:
        parser.error(f"--minutes {arguments.minutes} must be at least 2")
    with tempfile.TemporaryDirectory() as folder, \
         daemon(arguments.polyestd, folder) as (process, address):
        load = Load(Client(address))
        for number in range(arguments.streams):
            load.start(load.keep_streaming, number)
        if arguments.sessions_per_s > 0:
            load.start(load.use_new_sessions, 1 / arguments.sessions_per_s)
        medians = watch(process, load, arguments.minutes)
        load.end()
        if load.failure:
            print(f"a call has failed: {load.failure}")
            print(pathlib.Path(f"{folder}/log").read_text(encoding="utf-8")[-2000:])
            return 1
    return 0 if is_flat(medians) else 1


if __name__ == "__main__":
    sys.exit(main())
