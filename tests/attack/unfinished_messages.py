"""Opens many calls on one connection and sends all but the end of a large message in each, so that
the daemon holds every message before it can ask who is calling.

Usage: unfinished_messages.py POLYESTD. Exits with status 1 if the daemon's memory passes the bound.
"""

import re
import struct
import subprocess
import sys
import tempfile

from http2 import CALL, Connection, END_HEADERS, HEADERS, PING, frame

CALLS, MESSAGE_MB, MAX_MEMORY_MB = 24, 15, 128
# gRPC may hold half of the memory; as much again for everything else.
BOUND_MB = MAX_MEMORY_MB

def attack(connection):
    """Sends all but the last byte of every message, as far as the daemon lets it."""
    left = {}
    for call in range(CALLS):
        stream = 2 * call + 1
        with connection.changed:
            connection.windows[stream] = connection.initial_window
        connection.socket.sendall(frame(HEADERS, END_HEADERS, stream, CALL))
        size = MESSAGE_MB << 20
        connection.send(stream, b"\0" + struct.pack(">I", size))
        left[stream] = size - 1
    zeros = bytes(16384)
    while left and not connection.ended:
        sent = 0
        for stream in list(left):
            count = connection.send(stream, zeros[:min(16384, left[stream])])
            sent += count
            left[stream] -= count
            if left[stream] == 0 or stream not in connection.windows:
                del left[stream]
        if not sent:
            with connection.changed:
                if not connection.changed.wait(1):
                    return


def memory_mb(process):
    with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
        return int(re.search(r"VmHWM:\s*(\d+)", status.read()).group(1)) // 1024


def main():
    with tempfile.TemporaryDirectory() as folder:
        with subprocess.Popen(
                [sys.argv[1], "--listen", "127.0.0.1:0", "--data-dir", folder + "/data",
                 "--max-message-mb", "16", "--max-memory-mb", str(MAX_MEMORY_MB)],
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as daemon:
            host, port = daemon.stdout.readline().removeprefix("listening on ").strip().split(":")
            before = memory_mb(daemon)
            try:
                attack(Connection(host, int(port)))
            except OSError:
                pass  # the daemon has closed the connection
            peak = memory_mb(daemon)
            # Others are still served.
            probe = Connection(host, int(port))
            probe.socket.sendall(frame(PING, 0, 0, bytes(8)))
            with probe.changed:
                probe.changed.wait_for(lambda: probe.answers_pings or probe.ended, 10)
            alive = probe.answers_pings
            daemon.terminate()
    print(f"memory: {before} MB before, at most {peak} MB; {CALLS} messages of {MESSAGE_MB} MB")
    return 0 if alive and peak < before + BOUND_MB else 1


if __name__ == "__main__":
    sys.exit(main())
