"""Opens many calls on one connection and sends all but the end of a large message in each, so that
the daemon holds every message before it can ask who is calling.

Usage: unfinished_messages.py POLYESTD. Exits with status 1 if the daemon's memory passes the bound.
"""

import re
import socket
import struct
import subprocess
import sys
import tempfile
import threading

CALLS, MESSAGE_MB, MAX_MEMORY_MB = 24, 15, 128
# gRPC may hold half of the memory; as much again for everything else.
BOUND_MB = MAX_MEMORY_MB
DATA, HEADERS, RESET, SETTINGS, PING, GOAWAY, WINDOW = 0, 1, 3, 4, 6, 7, 8
END_HEADERS = ACK = 4


def frame(kind, flags, stream, payload=b""):
    return struct.pack(">I", len(payload))[1:] + struct.pack(">BBI", kind, flags, stream) + payload


def header(name, value):
    """A literal header field without indexing (RFC 7541, 6.2.2); lengths below 127."""
    return b"\0" + bytes([len(name)]) + name + bytes([len(value)]) + value


CALL = b"".join(header(*one) for one in (
    (b":method", b"POST"), (b":scheme", b"http"), (b":authority", b"localhost"),
    (b":path", b"/polyest.v1.ProblemService/CheckProblem"), (b"te", b"trailers"),
    (b"content-type", b"application/grpc")))


class Connection:
    """Speaks as much HTTP/2 as the attack needs: windows, pings and settings."""

    def __init__(self, host, port):
        self.socket = socket.create_connection((host, port))
        self.changed = threading.Condition()
        self.connection_window = self.initial_window = 65535
        self.windows = {}
        self.answers_pings = False
        self.ended = False
        self.socket.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(SETTINGS, 0, 0))
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        file = self.socket.makefile("rb")
        try:
            while len(head := file.read(9)) == 9:
                length = int.from_bytes(head[:3], "big")
                stream = int.from_bytes(head[5:], "big") & 0x7FFFFFFF
                self.take(head[3], head[4], stream, file.read(length))
        except OSError:
            pass
        with self.changed:
            self.ended = True
            self.changed.notify_all()

    def take(self, kind, flags, stream, payload):
        with self.changed:
            if kind == WINDOW:
                more = int.from_bytes(payload, "big")
                if stream == 0:
                    self.connection_window += more
                elif stream in self.windows:
                    self.windows[stream] += more
            elif kind == SETTINGS and not flags & 1:
                for name, value in struct.iter_unpack(">HI", payload):
                    if name == 4:
                        self.windows = {s: w + value - self.initial_window
                                        for s, w in self.windows.items()}
                        self.initial_window = value
                self.socket.sendall(frame(SETTINGS, 1, 0))
            elif kind == PING:
                self.answers_pings = True
                if not flags & 1:
                    self.socket.sendall(frame(PING, 1, 0, payload))
            elif kind in (RESET, HEADERS):
                self.windows.pop(stream, None)
            self.changed.notify_all()

    def send(self, stream, data):
        """Sends as much as the windows let through at once; returns how much that was."""
        with self.changed:
            room = min(self.windows.get(stream, 0), self.connection_window, 16384, len(data))
            if room <= 0:
                return 0
            self.windows[stream] -= room
            self.connection_window -= room
        self.socket.sendall(frame(DATA, 0, stream, data[:room]))
        return room


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
