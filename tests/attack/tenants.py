"""Attacks a daemon as a tenant may, while a rig of another tenant streams 100 rows a second.

    tenants.py POLYESTD [--seconds S] [--bound-ms MS]

The attacker creates session after session with a large expansion, to hold more memory than it may
have. Prints the rig's p50 and p99, ms, idle and under attack, and the daemon's memory. Exits with
status 1 if the rig's p99 passes the bound, if a session of the attacker is refused although it uses
none of the others, if the daemon's memory passes what a tenant may have and as much again, or if
the rig is not served. Everything happens on loopback, and ends after some seconds.
"""

import argparse
import contextlib
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
def daemon(polyestd, folder):
    """Runs a daemon; yields its process and its address."""
    command = [polyestd, "--listen", "127.0.0.1:0", "--data-dir", f"{folder}/data", "--tokens",
               f"{folder}/tokens", "--max-tenant-memory-mb", str(MAX_TENANT_MB)]
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


def hold_memory(address, token, seconds):
    """Creates sessions for so long, and until there are enough; returns how many."""
    message = rig.messages()
    create = message("CreateSessionRequest")
    problem = dict(rig.PROBLEM, expansion={"order": ORDER})
    problem["uncertain"] = [*problem["uncertain"],
                            {"name": "c", "uniform": {"lower": 0.1, "upper": 0.3}}]
    call = grpc.insecure_channel(address).unary_unary(
        "/polyest.v1.SessionService/CreateSession", request_serializer=create.SerializeToString,
        response_deserializer=bytes)
    sessions, end = 0, time.monotonic() + seconds
    while time.monotonic() < end or sessions < LEAST_SESSIONS:
        request = json_format.ParseDict(
            {"sessionId": f"held-{sessions}", "session": {"problem": problem}}, create())
        call(request, timeout=60, metadata=rig.call_credentials(token))
        sessions += 1
    return sessions


def measure(arguments, process, address, tokens):
    """Returns what is wrong; an empty text if the daemon stands."""
    rest = rig.Probe(address, token=tokens["rig"])
    rest.run(1)
    idle = rest.run(arguments.seconds)
    before = memory_mb(process, "VmRSS")
    with subprocess.Popen([sys.executable, "-B", __file__, "--attacker", address,
                           tokens["attacker"], str(arguments.seconds + 1)]) as attacker:
        attacked = rest.run(arguments.seconds)
        refused = attacker.wait() != 0
    peak = memory_mb(process, "VmHWM")
    rest.one()
    rest.close()
    print(f"memory of a tenant: the rig's p50 and p99 {idle[0]:.1f} and {idle[1]:.1f} ms idle, "
          f"{attacked[0]:.1f} and {attacked[1]:.1f} ms under attack; {before} MB before, at most "
          f"{peak} MB")
    if refused:
        return "a session has been refused, though others are idle"
    if peak > before + 2 * MAX_TENANT_MB:
        return "the tenant holds more memory than it may have"
    if attacked[1] > max(arguments.bound_ms, TIMES_IDLE * idle[1]):
        return "the rig has waited too long"
    return ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("polyestd")
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--bound-ms", type=float, default=BOUND_MS, help="of the rig's p99")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tokens = {name: new_token(arguments.polyestd, name, f"of-{name}", f"{folder}/tokens")
                  for name in ("rig", "attacker")}
        pathlib.Path(folder, "tokens").chmod(0o600)
        with daemon(arguments.polyestd, folder) as (process, address):
            try:
                wrong = measure(arguments, process, address, tokens)
            except grpc.RpcError as error:  # whatever the rig meets, the daemon does not stand
                wrong = f"the rig is not served: {error}"
        if wrong:
            print(wrong)
            print(pathlib.Path(f"{folder}/log").read_text(encoding="utf-8")[-2000:])
    return 1 if wrong else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["--attacker"]:
        count = hold_memory(sys.argv[2], sys.argv[3], float(sys.argv[4]))
        print(f"  attacker: {count} sessions", flush=True)
        sys.exit(0)
    sys.exit(main())
