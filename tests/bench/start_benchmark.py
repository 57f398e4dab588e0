#!/usr/bin/env python3
"""Measures how long the programs take to start, in turns with /bin/true.

    start_benchmark.py POLYESTD POLYEST [--starts N]

Prints the shortest and the median time of N starts, ms: of the command until it has said its version and
ended, and of the daemon until it says where it listens.
"""

import argparse
import statistics
import subprocess
import sys
import time


def until_end(*command):
    begin = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - begin


def until_listening(polyestd):
    begin = time.perf_counter()
    with subprocess.Popen([polyestd, "--listen", "127.0.0.1:0", "--durability", "memory"],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as daemon:
        line = daemon.stdout.readline()
        taken = time.perf_counter() - begin
        daemon.terminate()
    if not line.startswith(b"listening on"):
        sys.exit(f"start_benchmark: {polyestd} does not listen")
    return taken


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("polyestd")
    parser.add_argument("polyest")
    parser.add_argument("--starts", type=int, default=50, help="of each, ≥ 1 (50)")
    arguments = parser.parse_args()
    if arguments.starts < 1:
        parser.error(f"--starts is {arguments.starts}, but must be at least 1")
    starts = {
        "/bin/true": lambda: until_end("/bin/true"),
        "polyest --version": lambda: until_end(arguments.polyest, "--version"),
        "polyestd, until it listens": lambda: until_listening(arguments.polyestd),
    }
    taken = {name: [] for name in starts}
    for _ in range(arguments.starts):
        for name, start in starts.items():
            taken[name].append(1e3 * start())
    print(f"{'':28}{'shortest, ms':>14}{'median, ms':>14}")
    for name, times in taken.items():
        print(f"{name:28}{min(times):14.1f}{statistics.median(times):14.1f}")


if __name__ == "__main__":
    main()
