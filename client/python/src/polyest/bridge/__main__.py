"""The command `polyest-bridge`."""

from __future__ import annotations

import argparse
import os
import queue
import signal
import sys
import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Optional

from polyest.bridge._bridge import Bridge
from polyest.bridge._configuration import Configuration, read_configuration
from polyest.errors import InvalidInput


def _arguments(given: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="polyest-bridge",
        description="Streams a live CAN bus, a server of Foxglove's protocol, or MCAP into a "
        "session of polyestd, and publishes its estimates. Ends at SIGINT and SIGTERM, once the "
        "daemon has all rows.",
        epilog="Exit status: 0 if all rows are kept, 1 after a failure or if the daemon refused "
        "rows, 2 for a wrong configuration.")
    parser.add_argument("configuration", help="file in TOML, or in JSON if it ends in .json")
    parser.add_argument("--server", default="", help="HOST:PORT of the daemon, instead of the "
                        "configuration's")
    parser.add_argument("--check", action="store_true", help="check the configuration and the "
                        "files that it names, connect to nothing, and end")
    parser.add_argument("--status-interval", type=float, metavar="S",
                        help="time from one line of status to the next, s; 0: none")
    parser.add_argument("--duration", type=float, metavar="S", help="end after so many seconds")
    return parser.parse_args(given)


def _read(options: argparse.Namespace) -> Configuration:
    found = read_configuration(options.configuration, server=options.server)
    if options.status_interval is not None:
        found = replace(found, status_interval_s=max(0.0, options.status_interval))
    return found


def main(given: Optional[Sequence[str]] = None) -> int:
    """Runs the command. Returns its exit status."""
    options = _arguments(given)
    try:
        bridge = Bridge(_read(options))
    except (InvalidInput, ImportError) as error:
        print(f"polyest-bridge: {error}", file=sys.stderr)
        return 2
    if options.check:
        print(f"{options.configuration} is right")
        return 0
    stop = _ended_by_signals()
    if options.duration is not None:
        timer = threading.Timer(options.duration, stop.set)
        timer.daemon = True
        timer.start()
    status = bridge.run(stop)
    if bridge.latest is not None:
        print(bridge.latest, flush=True)
    return status


def _ended_by_signals() -> threading.Event:
    """Returns an event that SIGINT and SIGTERM set.

    Not in their handler: it interrupts the main thread, which may hold the event's lock just then.
    """
    stop = threading.Event()
    signals: queue.SimpleQueue[int] = queue.SimpleQueue()  # the handler may put into it

    def wait() -> None:
        signals.get()
        stop.set()

    threading.Thread(target=wait, name="polyest-signals", daemon=True).start()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: signals.put(number))
    return stop


def _command() -> None:
    """Ends the program, also if a thread of a bus or of a broker does not."""
    status = main()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(status)


if __name__ == "__main__":
    _command()
