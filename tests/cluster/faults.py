#!/usr/bin/env python3
"""Streams rigs to three daemons of one database while these fail, again and again.

    faults.py POLYESTD POLYEST [--faults N] [--kind KIND]... [--rigs N] [--seed N] [--bound]

The faults come in random order: a daemon is killed, or stopped for longer than its lease; its
connections to the database, to the other daemons or to the rigs are cut, or silent; the database crashes,
or stands still. Every rig must go on by itself, and its last estimate must have the bits of an undisturbed
run over the same record: no acknowledged batch is lost, and none is taken twice. Option --kind may be given
several times; by default all kinds come.
Prints the longest silence of a rig's estimates that began with each kind of fault. Exits with status 1
if a rig has not gone on to that estimate. With --bound, which asks for a machine that is not busy, a fault
comes only when all rigs have gone on after the one before, so that each silence is that of one fault; the
exit status is then also 1 if a silence is longer than 10 s or, after a fault of the database, than the
fault and 5 s more.

Exit status 77: PostgreSQL is not installed.
"""

import argparse
import collections
import contextlib
import os
import pathlib
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

from cluster import Database, ProxiedNode, write_secret
from proxy import Proxy

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "client" / "examples" / "oscillator"
RECORD_S, RECORD_ROWS = 50.0, 1000  # of the example
# Batches of a rig, 1/s, so that a rig that goes on shows it between two faults.
BATCH_RATE = 1.0
NODES = 3
# How long a fault lasts, and from its end to the next one, s; a lease lasts 3 s.
FAULT_S, REST_S = (3.5, 6.0), (2.0, 4.0)
# Usual and longest wait for the rigs to go on after that, and the pause between two looks, s.
SETTLED_S, SETTLE_S, LOOK_S = 1.0, 30.0, 0.1
# A silence of the rigs, s: after a fault of a daemon, and beyond one of the database; and, after the
# last fault, one that is taken for the end of a rig.
DAEMON_SILENCE_S, DATABASE_SILENCE_S = 10.0, 5.0
PATIENCE_S = 30.0
KINDS = ["daemon killed", "daemon stopped", "database cut from a daemon", "database silent to a daemon",
         "daemon cut from the others", "daemon silent to the others", "daemon cut from the rigs",
         "daemon silent to the rigs", "database crashed", "database stopped"]


class Rig:
    """A recording that is streamed; notes when its estimates come."""

    def __init__(self, number, polyest, port, rate, batch_rows, folder):
        self.number = number
        self.times, self.last = [time.monotonic()], None
        self._log = open(folder / f"rig{number}.log", "wb")
        self.process = subprocess.Popen(
            [polyest, "stream", f"{EXAMPLE}.json", f"{EXAMPLE}.csv", "--server", f"127.0.0.1:{port}",
             "--session", f"rig-{number}", "--batch", str(batch_rows), "--rate", str(rate),
             "--format", "jsonl"], stdout=subprocess.PIPE, stderr=self._log, text=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.last = line
            self.times.append(time.monotonic())

    def has_gone_on(self, since):
        """Returns whether there was an estimate since then, or there will be none."""
        return self.times[-1] > since or self.process.poll() is not None

    def silences(self, spans):
        """Returns the number of the fault with which each silence began, and how long it was."""
        times = self.times if self.process.poll() is not None else [*self.times, time.monotonic()]
        for begin, end in zip(times, times[1:]):
            touched = (i for i, span in enumerate(spans) if span.begin < end and span.end > begin)
            if (first := next(touched, None)) is not None:
                yield first, end - begin

    def wait(self):
        """Waits for the end of the recording while estimates come; returns what is wrong."""
        ended = False
        while not ended:
            try:
                self.process.wait(PATIENCE_S)
                ended = True
            except subprocess.TimeoutExpired:
                if not self.has_gone_on(time.monotonic() - PATIENCE_S):
                    return f"had no estimate for {PATIENCE_S:g} s"
        self._reader.join()
        return None if self.process.returncode == 0 else f"has failed: {self.process.returncode}"

    def close(self):
        self.process.kill()
        self.process.wait()
        self._log.close()


Span = collections.namedtuple("Span", "kind begin end")


class Faults:
    """The faults by name; each lasts some seconds and is mended then."""

    def __init__(self, database, nodes, to_rigs):
        self.database, self.nodes, self.to_rigs = database, nodes, to_rigs

    @contextlib.contextmanager
    def one(self, kind, node):
        if kind == "daemon killed":
            node.kill()
            yield
            node.start()
        elif kind == "daemon stopped":
            with stopped([node.process.pid]):
                yield
        elif kind == "database crashed":
            self.database.stop()
            yield
            self.database.start()
        elif kind == "database stopped":
            with stopped(self.database.processes()):
                yield
        else:
            proxy, number = ((node.to_database, 0) if kind.startswith("database") else
                             (node.from_nodes, 0) if kind.endswith("others") else
                             (self.to_rigs, node.number))
            places = proxy.cut if " cut " in kind else proxy.held
            places.add(number)
            yield
            places.discard(number)


@contextlib.contextmanager
def stopped(processes):
    try:
        for process in processes:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGSTOP)
        yield
    finally:
        for process in processes:
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGCONT)


def undisturbed(polyestd, polyest, batch_rows):
    """Returns the last estimate of the record by a daemon without a fault."""
    with subprocess.Popen([polyestd, "--listen", "127.0.0.1:0", "--durability", "memory"],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as daemon:
        try:
            address = daemon.stdout.readline().split()[-1]
            answer = subprocess.run(
                [polyest, "stream", f"{EXAMPLE}.json", f"{EXAMPLE}.csv", "--server", address, "--session",
                 "rig", "--batch", str(batch_rows), "--format", "jsonl"], check=True,
                capture_output=True, text=True)
        finally:
            daemon.terminate()
    return answer.stdout.splitlines()[-1]


def run(arguments, folder, stack):
    of_a_fault = (sum(FAULT_S) + sum(REST_S)) / 2 + (SETTLED_S if arguments.bound else 0)
    seconds = 1.1 * arguments.faults * of_a_fault + 30
    rate, batch_rows = RECORD_S / seconds, max(1, round(RECORD_ROWS / seconds / BATCH_RATE))
    expected = undisturbed(arguments.polyestd, arguments.polyest, batch_rows)
    database = Database(folder)
    stack.callback(database.close)
    write_secret(folder)
    nodes = []
    for number in range(NODES):
        nodes.append(ProxiedNode(number, arguments.polyestd, folder, database))
        stack.callback(nodes[-1].kill)
    to_rigs = Proxy(*[lambda node=node: node.port for node in nodes])
    rigs = []
    for number in range(arguments.rigs):
        rigs.append(Rig(number, arguments.polyest, to_rigs.port, rate, batch_rows, folder))
        stack.callback(rigs[-1].close)
    spans = disturb(arguments, Faults(database, nodes, to_rigs), rigs)
    problems = []
    for rig in rigs:
        problem = rig.wait()
        if problem is None and rig.last.strip() != expected.strip():
            problem = "has another last estimate than the undisturbed run"
        if problem is not None:
            problems.append(f"rig {rig.number} {problem}")
    beyond_bound = report(spans, rigs)
    if len(spans) < arguments.faults:
        print(f"the rigs ended before {arguments.faults - len(spans)} of {arguments.faults} faults came")
        beyond_bound.append("the rigs ended too early: the machine is too busy")
    return problems + (beyond_bound if arguments.bound else [])


def disturb(arguments, faults, rigs):
    """Causes the faults one after the other while a rig streams. Returns their spans."""
    chance, kinds = random.Random(arguments.seed), arguments.kind or KINDS
    order = [kind for _ in range(arguments.faults // len(kinds) + 1)
             for kind in chance.sample(kinds, len(kinds))][:arguments.faults]
    spans = []
    for i, kind in enumerate(order, 1):
        time.sleep(chance.uniform(*REST_S))
        if arguments.bound:
            settle(rigs, spans)
        if all(rig.process.poll() is not None for rig in rigs):
            break
        node = chance.choice(faults.nodes)
        begin = time.monotonic()
        with faults.one(kind, node):
            time.sleep(chance.uniform(*FAULT_S))
        spans.append(Span(kind, begin, time.monotonic()))
        if sys.stderr.isatty():
            print(f"\r{i} of {arguments.faults} faults", end="", file=sys.stderr, flush=True)
    return spans


def settle(rigs, spans):
    """Waits until all rigs have gone on after the last fault."""
    deadline = time.monotonic() + SETTLE_S
    while spans and time.monotonic() < deadline and not all(
            rig.has_gone_on(spans[-1].end) for rig in rigs):
        time.sleep(LOOK_S)


def report(spans, rigs):
    """Prints a line for each kind of fault; returns what is too long."""
    longest = collections.Counter()
    for rig in rigs:
        for fault, silence in rig.silences(spans):
            longest[fault] = max(longest[fault], silence)
    print("number  longest, s  longest silence, s  fault")
    problems = []
    for kind in KINDS:
        those = {i: span.end - span.begin for i, span in enumerate(spans) if span.kind == kind}
        if not those:
            continue
        print(f"{len(those):6d}  {max(those.values()):10.1f}  {max(longest[i] for i in those):18.1f}  "
              f"{kind}")
        of_database = kind in ("database crashed", "database stopped")
        for i, lasted in those.items():
            if longest[i] > (lasted + DATABASE_SILENCE_S if of_database else DAEMON_SILENCE_S):
                problems.append(f"{kind} for {lasted:.1f} s: a rig had no estimate for {longest[i]:.1f} s")
    return problems


def count(text):
    """Converts an argument that must be at least 1."""
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number} must be at least 1")
    return number


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("polyestd")
    parser.add_argument("polyest")
    parser.add_argument("--faults", type=count, default=20)
    parser.add_argument("--kind", action="append", choices=KINDS)
    parser.add_argument("--rigs", type=count, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--bound", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        folder = pathlib.Path(name)
        problems = run(arguments, folder, stack)
        if problems and (kept := os.environ.get("POLYEST_TEST_LOGS")):
            shutil.copytree(folder, kept, ignore=shutil.ignore_patterns("database"), dirs_exist_ok=True)
    for problem in problems:
        print(f"failed: {problem}")
    if problems:
        sys.exit(1)
    print(f"{arguments.faults} faults: all {arguments.rigs} rigs went on to the estimate of an undisturbed "
          "run, bit for bit")


if __name__ == "__main__":
    main()
