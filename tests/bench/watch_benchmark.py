#!/usr/bin/env python3
"""Measures how fast estimates reach those who watch a session over HTTP, as the live page does.

    watch_benchmark.py POLYESTD [--watchers N] [--estimates N]

Streams the oscillator's example to a daemon, two rows at a time, and waits after each batch until all
watchers have its estimate: first with one watcher, then with N. Prints the daemon's CPU time an
estimate, the time from the call that adds the rows to the first watcher's event, most of which is the
estimate's own, and the time from that event to each other watcher's.
"""

import argparse
import contextlib
import csv
import http.client
import json
import os
import pathlib
import re
import selectors
import socket
import subprocess
import sys
import tempfile
import time

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "client" / "examples"
ROWS = 2
PATIENCE_S = 30


@contextlib.contextmanager
def daemon(polyestd):
    """Starts a daemon; gives its process and the port of its calls over HTTP."""
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [polyestd, "--listen", "127.0.0.1:0", "--web", "127.0.0.1:0", "--data-dir", folder,
             "--durability", "memory"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            port = None
            while port is None:
                line = process.stdout.readline()
                if not line:
                    sys.exit(f"watch_benchmark: {polyestd} has ended")
                if found := re.search(r"web page on http://127\.0\.0\.1:(\d+)", line):
                    port = int(found[1])
            yield process, port
        finally:
            process.terminate()
            process.wait()


def call(port, method, request):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    with contextlib.closing(connection):
        connection.request("POST", f"/v1/SessionService/{method}", json.dumps(request),
                           {"Content-Type": "application/json"})
        answer = connection.getresponse()
        text = answer.read()
        if answer.status != 200:
            sys.exit(f"watch_benchmark: {method}: {text.decode()}")


class Watchers:
    """So many connections that watch one session."""

    def __init__(self, port, session, count):
        body = json.dumps({"session": session})
        head = (f"POST /v1/SessionService/WatchSession HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n")
        self.selector = selectors.DefaultSelector()
        for _ in range(count):
            connection = socket.create_connection(("127.0.0.1", port))
            connection.sendall((head + body).encode())
            connection.setblocking(False)
            self.selector.register(connection, selectors.EVENT_READ)
        self.count = count

    def times(self):
        """Waits until each has one event more; returns when, in order."""
        times = []
        while len(times) < self.count:
            ready = self.selector.select(PATIENCE_S)
            if not ready:
                sys.exit("watch_benchmark: an estimate has not come")
            for key, _ in ready:
                received = key.fileobj.recv(1 << 20)
                if not received:
                    sys.exit("watch_benchmark: the daemon has ended a watch")
                times += [time.perf_counter()] * received.count(b"data: {")
        return times

    def close(self):
        for key in list(self.selector.get_map().values()):
            key.fileobj.close()
        self.selector.close()


def cpu_s(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def batches(count):
    """Returns batches of the example's rows, as JSON has them."""
    with open(EXAMPLES / "oscillator.csv", encoding="utf-8") as file:
        header, *lines = csv.reader(file)
    columns = {name: [float(line[i]) for line in lines] for i, name in enumerate(header)}
    found = []
    for first in range(0, ROWS * count, ROWS):
        part = {name: values[first:first + ROWS] for name, values in columns.items()}
        if len(part["t"]) < ROWS:
            break
        found.append({"timeS": part.pop("t"),
                      "channels": [{"name": name, "values": values}
                                   for name, values in part.items()]})
    return found


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]


def measure(process, port, watchers, estimates):
    session = f"watched-by-{watchers}"
    problem = json.loads((EXAMPLES / "oscillator.json").read_text(encoding="utf-8"))
    call(port, "CreateSession", {"sessionId": session, "session": {"problem": problem}})
    name = f"sessions/{session}"
    rows = batches(estimates + 1)
    call(port, "AddMeasurements", {"session": name, "sequence": 1, "measurements": rows[0]})
    group = Watchers(port, name, watchers)
    group.times()
    first, after = [], []
    before = cpu_s(process)
    for sequence, batch in enumerate(rows[1:], 2):
        begin = time.perf_counter()
        call(port, "AddMeasurements", {"session": name, "sequence": sequence, "measurements": batch})
        times = group.times()
        first.append(times[0] - begin)
        after += [t - times[0] for t in times]
    spent = (cpu_s(process) - before) / len(first)
    group.close()
    print(f"{watchers:9d} {len(first):9d} {1e3 * spent:10.1f}   "
          f"{1e3 * percentile(first, 0.5):6.1f} {1e3 * percentile(first, 0.99):6.1f}   "
          f"{1e3 * percentile(after, 0.5):6.1f} {1e3 * percentile(after, 0.99):6.1f}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("polyestd")
    parser.add_argument("--watchers", type=int, default=200)
    parser.add_argument("--estimates", type=int, default=100)
    arguments = parser.parse_args()
    print("                    CPU time   first event, ms  to the others, ms")
    print(" watchers estimates  each, ms      p50    p99      p50    p99")
    with daemon(arguments.polyestd) as (process, port):
        for watchers in (1, arguments.watchers):
            measure(process, port, watchers, arguments.estimates)


if __name__ == "__main__":
    main()
