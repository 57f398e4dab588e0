#!/usr/bin/env python3
"""Serves two models of the examples by the UM-Bridge protocol: the oscillator and a corner of a car.

    serve.py FOLDER [COMMAND…]

Listens on a free port of this machine and writes FOLDER/oscillator.umbridge.json and
FOLDER/corner.umbridge.json, which tell polyest where the models are and what their numbers mean.
Ends with the command, or on Ctrl+C without one. Nothing but Python itself is needed; the package
`umbridge` of PyPI does the same in a few lines.
"""

import bisect
import http.server
import json
import math
import os
import pathlib
import subprocess
import sys
import threading

MASS, START = 1.0, 1.0  # kg; m, the oscillator is released from rest
BODY, WHEEL = 290.0, 59.0  # kg, of the corner of a car
STEP_S = 0.005  # longest step of the integration of the corner


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


def oscillator(parameters, config):
    return [displacements(*parameters, config["times"])]


def along(lines):
    """Returns the function of time that an input's straight lines are."""
    times, values = lines["times"], lines["values"]

    def value(t):
        right = bisect.bisect_right(times, t)
        if right == 0 or right == len(times):
            return values[max(right - 1, 0)]
        left = right - 1
        fraction = (t - times[left]) / (times[right] - times[left])
        return values[left] + fraction * (values[right] - values[left])

    return value


def corner(parameters, config):
    """Integrates body and wheel over the road by the classical Runge-Kutta method."""
    spring, damper, tyre = parameters
    road = along(config["inputs"]["road"])

    def rates(state, height):
        zs, zu, vs, vu = state
        force = spring * (zs - zu) + damper * (vs - vu)
        return vs, vu, -force / BODY, (force + tyre * (height - zu)) / WHEEL

    def ahead(state, rate, h):
        return [x + h * dx for x, dx in zip(state, rate)]

    t, state = 0.0, [0.0, 0.0, 0.0, 0.0]
    travel, acceleration = [], []
    for end in config["times"]:
        steps = math.ceil((end - t) / STEP_S - 1e-6)
        h = (end - t) / max(steps, 1)
        for _ in range(steps):
            before, halfway, after = road(t), road(t + h / 2), road(t + h)
            k1 = rates(state, before)
            k2 = rates(ahead(state, k1, h / 2), halfway)
            k3 = rates(ahead(state, k2, h / 2), halfway)
            k4 = rates(ahead(state, k3, h), after)
            state = [x + h / 6 * (a + 2 * b + 2 * c + d)
                     for x, a, b, c, d in zip(state, k1, k2, k3, k4)]
            t += h
        t = end
        travel.append(state[0] - state[1])
        acceleration.append(rates(state, road(t))[2])
    return [travel, acceleration]


MODELS = {"oscillator": oscillator, "corner": corner}
DESCRIPTIONS = {
    "oscillator": {
        "summary": "a mass on a spring and damper, released from rest",
        "parameters": [
            {"name": "k", "unit": "N/m", "meaning": "stiffness"},
            {"name": "c", "unit": "N s/m", "meaning": "damping"},
        ],
        "outputs": [{"name": "x", "unit": "m", "meaning": "displacement"}],
    },
    "corner": {
        "summary": "one corner of a vehicle over a road",
        "parameters": [
            {"name": "ks", "unit": "N/m", "meaning": "stiffness of the suspension"},
            {"name": "cs", "unit": "N s/m", "meaning": "damping of the suspension"},
            {"name": "kt", "unit": "N/m", "meaning": "stiffness of the tyre"},
        ],
        "inputs": [{"name": "road", "unit": "m", "meaning": "height of the road"}],
        "outputs": [
            {"name": "travel", "unit": "m", "meaning": "travel of the suspension"},
            {"name": "zs_accel", "unit": "m/s^2", "meaning": "acceleration of the body"},
        ],
    },
}


class Handler(http.server.BaseHTTPRequestHandler):
    """Answers the calls of the protocol: one input vector, an output vector for each output."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def do_GET(self):
        self.answer(200, {"protocolVersion": 1.0, "models": list(MODELS)})

    def do_POST(self):
        request = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        config = request.get("config", {})
        name = request.get("name")
        if name not in MODELS:
            return self.refuse("ModelNotFound", f"there are {', '.join(MODELS)}")
        if self.path == "/ModelInfo":
            self.answer(200, {"support": {"Evaluate": True}})
        elif self.path == "/InputSizes":
            self.answer(200, {"inputSizes": [len(DESCRIPTIONS[name]["parameters"])]})
        elif self.path == "/OutputSizes":
            outputs = DESCRIPTIONS[name]["outputs"]
            self.answer(200, {"outputSizes": [len(config["times"])] * len(outputs)})
        elif self.path == "/Evaluate":
            try:
                self.answer(200, {"output": MODELS[name](request["input"][0], config)})
            except ValueError as error:
                self.refuse("InvalidInput", str(error))
        else:
            self.refuse("UnsupportedFeature", self.path)

    def refuse(self, kind, message):
        self.answer(400, {"error": {"type": kind, "message": message}})

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


def describe(name, urls):
    """Returns what polyest must know of a model at these servers."""
    return {"urls": urls, "requestsPerServer": 2, **DESCRIPTIONS[name]}


def main(folder, *command):
    if not os.path.isdir(folder):
        sys.exit(f"serve.py: {folder} is not a folder; make it first, or name another")
    server = Server(("127.0.0.1", 0), Handler)
    for name in MODELS:
        file = pathlib.Path(folder, f"{name}.umbridge.json")
        draft = file.with_suffix(".new")
        description = describe(name, [f"http://127.0.0.1:{server.server_port}"])
        draft.write_text(json.dumps(description, indent=2))
        os.replace(draft, file)
    if not command:
        print(f"serving {', '.join(MODELS)} at port {server.server_port}; see {folder}", flush=True)
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
