"""As much of HTTP/2 as attacks need: frames, headers, windows, pings and settings."""

import socket
import ssl
import struct
import threading

DATA, HEADERS, RESET, SETTINGS, PING, GOAWAY, WINDOW, CONTINUATION = 0, 1, 3, 4, 6, 7, 8, 9
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


def connect(host, port, tls, source=None):
    """Returns a connected socket; with TLS, whoever answers."""
    raw = socket.create_connection((host, port), timeout=10,
                                   source_address=(source, 0) if source else None)
    raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    if not tls:
        return raw
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    context.set_alpn_protocols(["h2"])
    return context.wrap_socket(raw)


PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(SETTINGS, 0, 0)


class Connection:
    """A connection that answers settings and pings and keeps count of the windows."""

    def __init__(self, host, port, tls=False):
        self.socket = connect(host, port, tls)
        self.socket.settimeout(None)
        self.changed = threading.Condition()
        self.connection_window = self.initial_window = 65535
        self.windows = {}
        self.answers_pings = False
        self.ended = False
        self.socket.sendall(PREFACE)
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
