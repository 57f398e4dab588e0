"""Tests what passes the edge, and what does not.

Usage: edge_test.py POLYESTD POLYEST CONFIGURATION
"""

import contextlib
import json
import os
import pathlib
import re
import socket
import ssl
import subprocess
import sys
import tempfile
import time
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
POLYESTD, POLYEST, CONFIGURATION = sys.argv[1:4]
EC = ["-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-noenc", "-days", "2"]


def openssl(*arguments):
    subprocess.run(["openssl", "req", "-x509", *EC, *arguments], check=True,
                   stderr=subprocess.DEVNULL)


class Edge(unittest.TestCase):
    client_ca = False

    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory()))
        self.make_certificates()
        daemon = self.start([POLYESTD, "--listen", "127.0.0.1:0", "--data-dir",
                             f"{self.folder}/data", "--behind-edge", "--insecure", "--audit-log",
                             f"{self.folder}/audit.log"], stdout=subprocess.PIPE, text=True)
        port = re.match(r"listening on .*:(\d+)", daemon.stdout.readline()).group(1)
        self.addCleanup(daemon.stdout.close)
        # haproxy cannot choose a port itself, and another program may take the one that was free.
        while not self.start_edge(port):
            pass

    def start_edge(self, daemon_port):
        """Returns whether haproxy listens. It ends if its port has been taken."""
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        environment = dict(os.environ, EDGE_LISTEN=f"127.0.0.1:{self.port}",
                           EDGE_DAEMON=f"127.0.0.1:{daemon_port}",
                           EDGE_CERTIFICATE=f"{self.folder}/edge.pem")
        if self.client_ca:
            environment["EDGE_CLIENT_CA"] = f"{self.folder}/ca"
        log = self.folder / "haproxy.log"
        with log.open("w") as errors:
            haproxy = self.start(["/usr/sbin/haproxy", "-db", "-f", CONFIGURATION],
                                 env=environment, stdout=subprocess.DEVNULL, stderr=errors)
        context = ssl.create_default_context(cafile=self.folder / "certificate")
        while haproxy.poll() is None:
            # The handshake tells whether it is this edge that listens.
            with contextlib.suppress(OSError), context.wrap_socket(
                    socket.create_connection(("127.0.0.1", self.port), timeout=1),
                    server_hostname="localhost"):
                return True
        self.assertIn("Address already in use", log.read_text())
        return False

    def make_certificates(self):
        file = self.folder.joinpath
        openssl("-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost", "-keyout",
                file("key"), "-out", file("certificate"))
        file("edge.pem").write_text(file("certificate").read_text() + file("key").read_text())
        openssl("-subj", "/CN=clients", "-keyout", file("ca.key"), "-out", file("ca"))
        openssl("-subj", "/CN=rig 7", "-CA", file("ca"), "-CAkey", file("ca.key"), "-keyout",
                file("client.key"), "-out", file("client"), "-addext",
                "basicConstraints=critical,CA:FALSE")

    def start(self, command, **options):
        process = self.stack.enter_context(subprocess.Popen(command, **options))
        self.stack.callback(process.kill)
        return process

    def polyest(self, *arguments):
        return subprocess.run(
            [POLYEST, *arguments, "--server", f"localhost:{self.port}", "--tls-ca",
             self.folder / "certificate"], capture_output=True, text=True, check=False, timeout=60)

    def stream(self, *arguments):
        examples = SOURCE / "client/examples"
        return self.polyest("stream", examples / "oscillator.json", examples / "oscillator.csv",
                            "--session", "rig", "--format", "jsonl", *arguments)

    def audited(self, method):
        """Returns the line of the audit log about a method, as soon as it is there."""
        end = time.monotonic() + 30
        while time.monotonic() < end:
            for line in (self.folder / "audit.log").read_text().splitlines():
                with contextlib.suppress(json.JSONDecodeError):
                    if json.loads(line).get("method") == method:
                        return json.loads(line)
        raise AssertionError(f"{method} is not in the audit log")


class WithoutClientCertificates(Edge):
    def test_sessions_stream_through(self):
        run = self.stream()
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(self.polyest("backup", "-o", self.folder / "backup.db").returncode, 0)
        line = self.audited("CreateSession")
        self.assertEqual(line["peer"], "edge:127.0.0.1")
        self.assertEqual(line["caller"], "anonymous")

    def test_other_requests_end_here(self):
        context = ssl.create_default_context(cafile=self.folder / "certificate")
        with context.wrap_socket(socket.create_connection(("127.0.0.1", self.port)),
                                 server_hostname="localhost") as one:
            one.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.assertIn(b" 405 ", one.recv(1000))

    def test_nobody_can_say_who_they_are(self):
        import grpc  # pylint: disable=import-outside-toplevel
        channel = grpc.secure_channel(
            f"localhost:{self.port}",
            grpc.ssl_channel_credentials((self.folder / "certificate").read_bytes()))
        with self.assertRaises(grpc.RpcError), channel:
            channel.unary_unary("/polyest.v1.SessionService/DeleteSession")(
                b"", timeout=30, metadata=(("x-forwarded-for", "192.0.2.1"),
                                           ("x-client-certificate-name", "the boss")))
        line = self.audited("DeleteSession")
        self.assertEqual((line["peer"], line["caller"]), ("edge:127.0.0.1", "anonymous"))


class WithClientCertificates(Edge):
    client_ca = True

    def test_their_names_are_passed_on(self):
        own = ("--tls-certificate", self.folder / "client", "--tls-key", self.folder / "client.key")
        run = self.stream(*own)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(self.audited("CreateSession")["caller"], "rig 7")

    def test_nobody_comes_in_without_one(self):
        run = self.polyest("list")
        self.assertEqual(run.returncode, 3)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
