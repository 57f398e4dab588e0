#!/usr/bin/env python3
"""Measures what it costs that several daemons share a database.

    nodes_benchmark.py POLYESTD [--batches N] [--sessions N]

Twelve rigs stream one row after another through one, two and three daemons, each rig to the daemon that
owns its session: the CPU time of the daemons and of the database a batch, and how long an
acknowledgement takes. Then one rig streams through its session's owner, and through another daemon,
which passes its stream on. Last, 10,000 sessions are made, and three daemons start with them.

Exit status 77: PostgreSQL is not installed.
"""

import argparse
import concurrent.futures
import contextlib
import os
import pathlib
import sys
import tempfile
import threading
import time

import grpc
from google.protobuf import json_format

TESTS = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS / "attack"), str(TESTS / "cluster")]
import probe  # noqa: E402
from cluster import Database, Node, write_secret  # noqa: E402

RIGS = 12


def cpu_s(processes):
    """Returns the CPU time of processes and of their children so far, s."""
    ticks = 0
    for process in processes:
        with contextlib.suppress(FileNotFoundError):
            fields = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
            ticks += sum(int(field) for field in fields[11:15])
    return ticks / os.sysconf("SC_CLK_TCK")


def stream(rigs, batches):
    """Streams from all rigs at once; returns the times until each acknowledgement, s."""
    times = []

    def run(rig):
        own = [rig.one() for _ in range(batches)]
        times.extend(own)

    threads = [threading.Thread(target=run, args=(rig,)) for rig in rigs]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return sorted(times)


def measure(what, rigs, batches, nodes, database):
    daemons = [node.process.pid for node in nodes]
    before = cpu_s(daemons), cpu_s(database.processes())
    times = stream(rigs, batches)
    after = cpu_s(daemons), cpu_s(database.processes())
    own, base = (1e3 * (b - a) / len(times) for a, b in zip(before, after))
    print(f"{what:44s} {own:8.2f} {base:8.2f} {1e3 * times[len(times) // 2]:8.1f} "
          f"{1e3 * times[int(0.99 * (len(times) - 1))]:8.1f}", flush=True)


def address(node):
    return f"127.0.0.1:{node.port}"


def create(node, count):
    """Creates so many sessions at a daemon."""
    message = probe.messages()
    request_type = message("CreateSessionRequest")
    with grpc.insecure_channel(address(node)) as channel:
        call = channel.unary_unary("/polyest.v1.SessionService/CreateSession",
                                   request_serializer=request_type.SerializeToString,
                                   response_deserializer=bytes)

        def one(_):
            call(json_format.ParseDict({"session": {"problem": probe.PROBLEM}}, request_type()), timeout=60)

        with concurrent.futures.ThreadPoolExecutor(16) as pool:
            list(pool.map(one, range(count)))


def start_with_sessions(nodes, sessions):
    for node in nodes:
        create(node, sessions // len(nodes))
    for node in nodes:
        node.kill()
    print(f"\n{sessions} sessions: start, s; memory, MB")
    for node in nodes:
        begin = time.monotonic()
        node.start()
        spent = time.monotonic() - begin
        with grpc.insecure_channel(address(node)) as channel:
            grpc.channel_ready_future(channel).result(30)
        status = pathlib.Path(f"/proc/{node.process.pid}/status").read_text()
        resident = next(int(line.split()[1]) for line in status.splitlines() if "VmRSS" in line)
        print(f"  daemon {node.number + 1}: {spent:.2f} s, {resident / 1024:.0f} MB", flush=True)


def run(arguments, folder, stack):
    database = Database(folder)
    stack.callback(database.close)
    write_secret(folder)
    nodes = []
    print(f"{'':44s}  CPU time a batch, ms    acknowledgement, ms")
    print(f"{'':44s}  daemons database       p50      p99")
    for count in (1, 2, 3):
        nodes.append(Node(count - 1, arguments.polyestd, folder, database))
        stack.callback(nodes[-1].kill)
        rigs = [probe.Probe(address(nodes[i % count])) for i in range(RIGS)]
        measure(f"{RIGS} rigs, {count} daemon{'s' if count > 1 else ''}", rigs, arguments.batches, nodes,
                database)
        for rig in rigs:
            rig.close()
    owner = probe.Probe(address(nodes[0]))
    measure("one rig, at the owner", [owner], arguments.batches, nodes, database)
    passed_on = probe.Probe(address(nodes[0]), streams_to=address(nodes[1]))
    measure("one rig, passed on by another daemon", [passed_on], arguments.batches, nodes, database)
    start_with_sessions(nodes, arguments.sessions)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("polyestd")
    parser.add_argument("--batches", type=int, default=300, help="of each rig")
    parser.add_argument("--sessions", type=int, default=10_000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        run(arguments, pathlib.Path(name), stack)


if __name__ == "__main__":
    main()
