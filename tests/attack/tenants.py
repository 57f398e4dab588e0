"""Attacks a daemon as a tenant may, while a rig of another tenant streams 100 rows a second.

    tenants.py POLYESTD [ATTACK]... [--seconds S] [--bound-ms MS]

    memory     creates session after session with a large expansion, to hold more memory than a tenant
               may have
    batches    sends batches of a hundred thousand rows that no model fits, one after the other
    bulk       sends 18 batches at once, each of as many rows as there may be, 46 MiB
    computing  asks for expansions with 1,953 terms and ten points each, which take 20 s to factor

All attacks unless some are named. Prints the rig's p50 and p99, ms, idle and under attack, and the
daemon's memory. Exits with status 1 if the rig's p99 passes the bound, if a call of the attacker fails
in another way than by its deadline, if the daemon's memory passes what a tenant may have and as much
again, or if the rig is not served. Everything happens on loopback, and ends after some seconds.
"""

import argparse
import contextlib
from concurrent import futures
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import grpc
from google.protobuf import json_format

import probe as rig

MAX_TENANT_MB = 150
# About 12 MiB of memory a session.
ORDER = 25
# Enough sessions to pass the limit four times.
LEAST_SESSIONS = 60
BATCH_ROWS = 100_000
# As many rows as a batch may have (--max-batch-rows), of a car at rest.
BULK_BATCHES, BULK_ROWS, BULK_DEADLINE_S = 18, 1_000_000, 300.0
CAR = {"model": {"builtin": "quarter_car"},
       "uncertain": [{"name": "ks", "uniform": {"lower": 15000, "upper": 18000}}],
       "measured": [{"output": output, "noise": {"absolute": 0.01}}
                    for output in ("zs", "zu", "travel", "travel_rate", "zs_accel")]}
# The largest expansion there may be, and how long the attacker waits for it, s.
LARGE_EXPANSION = {"order": 61, "pointsPerTerm": 10}
DEADLINE_S = 1.0
# Longest 99th percentile; the attack takes a processor of the daemon's. On a slow machine, so many
# times what the rig waits idle.
BOUND_MS, TIMES_IDLE = 500, 5


def new_token(polyestd, name, tenant, file):
    """Returns a token and adds it to the file of tokens."""
    made = subprocess.run([polyestd, "--new-token", f"{name}:{tenant}:writer"], check=True,
                          capture_output=True, text=True)
    with open(file, "a", encoding="ascii") as tokens:
        tokens.write(made.stderr)
    return made.stdout.strip()


@contextlib.contextmanager
def daemon(polyestd, folder, *options):
    """Runs a daemon; yields its process and its address."""
    command = [polyestd, "--listen", "127.0.0.1:0", "--data-dir", f"{folder}/data", "--tokens",
               f"{folder}/tokens", *options]
    with open(f"{folder}/log", "w", encoding="utf-8") as log, \
         subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True) as process:
        try:
            line = process.stdout.readline()
            yield process, re.match(r"listening on (.*)", line).group(1)
        finally:
            process.kill()


def memory_mb(process, line):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
    return int(re.search(line + r":\s*(\d+)", status).group(1)) // 1024


class Attacker:
    """Calls the daemon as its tenant may."""

    def __init__(self, address, token):
        self.messages, self.metadata = rig.messages(), rig.call_credentials(token)
        self.channel = grpc.insecure_channel(address)

    def call(self, method, request, timeout=240):
        self.channel.unary_unary(f"/polyest.v1.SessionService/{method}",
                                 request_serializer=type(request).SerializeToString,
                                 response_deserializer=bytes)(request, timeout=timeout,
                                                              metadata=self.metadata)

    def create(self, name, expansion, timeout=60):
        problem = dict(rig.PROBLEM, expansion=expansion)
        problem["uncertain"] = [*problem["uncertain"],
                                {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}}]
        self.call("CreateSession", json_format.ParseDict(
            {"sessionId": name, "session": {"problem": problem}},
            self.messages("CreateSessionRequest")()), timeout)


def hold_memory(attacker, end):
    sessions = 0
    while time.monotonic() < end or sessions < LEAST_SESSIONS:
        attacker.create(f"held-{sessions}", {"order": ORDER})
        sessions += 1
    return f"{sessions} sessions"


def send_batches(attacker, end):
    attacker.create("large", {})
    batches = 0
    while time.monotonic() < end or batches == 0:
        request = attacker.messages("AddMeasurementsRequest")(session="sessions/large",
                                                              sequence=batches + 1)
        first = batches * BATCH_ROWS
        request.measurements.time_s.extend(1e-4 * row for row in range(first, first + BATCH_ROWS))
        request.measurements.channels.add(name="x").values.extend([0.5] * BATCH_ROWS)
        attacker.call("AddMeasurements", request)
        batches += 1
    return f"{batches} batches of {BATCH_ROWS} rows"


def send_bulk(attacker, end):
    """Sends all batches, however long it takes: the daemon must take or refuse each of them."""
    request = attacker.messages("AddMeasurementsRequest")(sequence=1)
    request.measurements.time_s.extend(1e-3 * row for row in range(1, BULK_ROWS + 1))
    for measured in CAR["measured"]:
        request.measurements.channels.add(name=measured["output"]).values.extend([0.0] * BULK_ROWS)

    def send(number):
        own = type(request)(session=f"sessions/bulk-{number}")
        own.MergeFrom(request)
        try:
            attacker.call("AddMeasurements", own, BULK_DEADLINE_S)
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.RESOURCE_EXHAUSTED:
                raise
            return False
        return True

    for number in range(BULK_BATCHES):
        attacker.call("CreateSession", json_format.ParseDict(
            {"sessionId": f"bulk-{number}", "session": {"problem": CAR}},
            attacker.messages("CreateSessionRequest")()))
    with futures.ThreadPoolExecutor(BULK_BATCHES) as threads:
        taken = sum(threads.map(send, range(BULK_BATCHES)))
    return f"{taken} of {BULK_BATCHES} batches of {request.ByteSize() / 2**20:.0f} MiB were taken"


def compute(attacker, end):
    calls = 0
    while time.monotonic() < end:
        try:
            attacker.create(f"computed-{calls}", LARGE_EXPANSION, DEADLINE_S)
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.DEADLINE_EXCEEDED:
                raise
        calls += 1
    return f"{calls} large expansions"


ATTACKS = {"memory": hold_memory, "batches": send_batches, "bulk": send_bulk, "computing": compute}


def measure(attack, arguments, process, address, tokens):
    """Returns what is wrong; an empty text if the daemon stands."""
    rest = rig.Probe(address, token=tokens["rig"])
    rest.run(1)
    idle = rest.run(arguments.seconds)
    before = memory_mb(process, "VmRSS")
    with subprocess.Popen([sys.executable, "-B", __file__, "--attacker", attack, address,
                           tokens["attacker"], str(arguments.seconds + 1)]) as attacker:
        attacked = rest.run(arguments.seconds)
        refused = attacker.wait() != 0
    peak = memory_mb(process, "VmHWM")
    rest.one()
    rest.close()
    print(f"{attack} of a tenant: the rig's p50 and p99 {idle[0]:.1f} and {idle[1]:.1f} ms idle, "
          f"{attacked[0]:.1f} and {attacked[1]:.1f} ms under attack; {before} MB before, at most "
          f"{peak} MB")
    if refused:
        return "a call of the attacker has failed"
    if attack == "memory" and peak > before + 2 * MAX_TENANT_MB:
        return "the tenant holds more memory than it may have"
    if attacked[1] > max(arguments.bound_ms, TIMES_IDLE * idle[1]):
        return "the rig has waited too long"
    return ""


def run(attack, arguments):
    """Returns whether the daemon stands."""
    with tempfile.TemporaryDirectory() as folder:
        tokens = {name: new_token(arguments.polyestd, name, f"of-{name}", f"{folder}/tokens")
                  for name in ("rig", "attacker")}
        pathlib.Path(folder, "tokens").chmod(0o600)
        limit = ["--max-tenant-memory-mb", str(MAX_TENANT_MB)] if attack == "memory" else []
        with daemon(arguments.polyestd, folder, *limit) as (process, address):
            try:
                wrong = measure(attack, arguments, process, address, tokens)
            except grpc.RpcError as error:  # whatever the rig meets, the daemon does not stand
                wrong = f"the rig is not served: {error}"
        if wrong:
            print(wrong)
            print(pathlib.Path(f"{folder}/log").read_text(encoding="utf-8")[-2000:])
    return not wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("polyestd", type=rig.program)
    parser.add_argument("attacks", nargs="*", metavar="ATTACK", help=", ".join(ATTACKS))
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--bound-ms", type=float, default=BOUND_MS, help="of the rig's p99")
    arguments = parser.parse_args()
    if unknown := set(arguments.attacks) - set(ATTACKS):
        parser.error(f"there is no attack {', '.join(unknown)}; there are {', '.join(ATTACKS)}")
    stands = [run(attack, arguments) for attack in arguments.attacks or ATTACKS]
    return 0 if all(stands) else 1


if __name__ == "__main__":
    if sys.argv[1:2] == ["--attacker"]:
        attack, address, token, seconds = sys.argv[2:]
        done = ATTACKS[attack](Attacker(address, token), time.monotonic() + float(seconds))
        print(f"  attacker: {done}", flush=True)
        sys.exit(0)
    sys.exit(main())
