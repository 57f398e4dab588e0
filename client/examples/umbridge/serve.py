#!/usr/bin/env python3
"""Serves the oscillator of the examples as a model by the UM-Bridge protocol.

    serve.py FOLDER [COMMAND…]

Listens on a free port of this machine and writes FOLDER/oscillator.umbridge.json, which tells polyest
where the model is and what its numbers mean. Ends with the command, or on Ctrl+C without one. Nothing
but Python itself is needed; the package `umbridge` of PyPI does the same in a few lines.
"""

import http.server
import json
import math
import os
import pathlib
import subprocess
import sys
import threading

NAME = "oscillator"
MASS, START = 1.0, 1.0  # kg; m, released from rest


def displacements(stiffness, damping, times):
    """Returns x(t) of m x'' + c x' + k x = 0, x(0) = START, x'(0) = 0, below critical damping."""
    decay = damping / (2 * MASS)
    square = stiffness / MASS - decay**2
    if square <= 0:
        raise ValueError(f"k = {stiffness} and c = {damping} do not oscillate")
    frequency = math.sqrt(square)
    return [START * math.exp(-decay * t)
            * (math.cos(frequency * t) + decay / frequency * math.sin(frequency * t))
            for t in times]


class Handler(http.server.BaseHTTPRequestHandler):
    """Answers the calls of the protocol: one input vector (k, c), one output vector x."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def do_GET(self):
        self.answer(200, {"protocolVersion": 1.0, "models": [NAME]})

    def do_POST(self):
        request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        config = request.get("config", {})
        if self.path == "/ModelInfo":
            self.answer(200, {"support": {"Evaluate": True}})
        elif self.path == "/InputSizes":
            self.answer(200, {"inputSizes": [2]})
        elif self.path == "/OutputSizes":
            self.answer(200, {"outputSizes": [len(config["times"])]})
        elif self.path == "/Evaluate":
            try:
                self.answer(200, {"output": [displacements(*request["input"][0], config["times"])]})
            except ValueError as error:
                self.answer(400, {"error": {"type": "InvalidInput", "message": str(error)}})
        else:
            self.answer(404, {"error": {"type": "UnsupportedFeature", "message": self.path}})

    def answer(self, status, message):
        body = json.dumps(message).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_):
        """Keeps the terminal free."""


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 64


def describe(urls):
    """Returns what polyest must know of the model at these servers."""
    return {
        "summary": "a mass on a spring and damper, released from rest",
        "urls": urls,
        "requestsPerServer": 2,
        "parameters": [
            {"name": "k", "unit": "N/m", "meaning": "stiffness"},
            {"name": "c", "unit": "N s/m", "meaning": "damping"},
        ],
        "outputs": [{"name": "x", "unit": "m", "meaning": "displacement"}],
    }


def main(folder, *command):
    if not os.path.isdir(folder):
        sys.exit(f"serve.py: {folder} is not a folder; make it first, or name another")
    server = Server(("127.0.0.1", 0), Handler)
    file = pathlib.Path(folder, f"{NAME}.umbridge.json")
    draft = file.with_suffix(".new")
    draft.write_text(json.dumps(describe([f"http://127.0.0.1:{server.server_port}"]), indent=2))
    os.replace(draft, file)
    if not command:
        print(f"serving at port {server.server_port}; see {file}", flush=True)
        server.serve_forever()
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return subprocess.run(command, check=False).returncode


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    try:
        sys.exit(main(*sys.argv[1:]))
    except KeyboardInterrupt:
        pass
