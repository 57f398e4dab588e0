"""Streams a rig over a SocketCAN interface into a session, and reads the estimates from the bus.

    rig_on_vcan.py POLYESTD POLYEST CHANNEL

As root, for the interface goes down and up in the middle; writes into the working folder. The
bridge is that of the guide's example, on another bus. Asks that every frame that was sent has
arrived once, that the estimate is that of `polyest estimate` from the same rows and agrees with the
truth, and that estimates have come back on the bus; then, that the bridge says how many frames it
has missed after it was stopped for a moment.
"""

import contextlib
import json
import math
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import time

import can
import cantools

import polyest

EXAMPLE = pathlib.Path(__file__).parents[2] / "client" / "python" / "examples" / "bridge"
TRUTH = {"k": 41.3, "c": 0.9}
NOISE_M, PERIOD_S, STEP_S, END_S = 0.003, 0.01, 0.001, 20.0
REST_S, DOWN_S, UP_S = 0.5, 9.0, 12.0
# The shaker holds its force meanwhile: what it is between two of its samples is interpolated.
HELD_S = (DOWN_S - 1, UP_S + 1)


def force(time_s):
    """The shaker's force, N.

    A busy machine may send a value some milliseconds late. The force is so weak that the motion
    meanwhile is small against the noise, and none at first: so the first frame may be late, too.
    """
    t = max(0.0, min(time_s, HELD_S[0]) - REST_S) + max(0.0, time_s - HELD_S[1])
    return 0.4 * math.sin(5 * t) + 0.2 * math.sin(11 * t)


class Mass:
    """A mass on a spring on the shaker, which goes with the clock."""

    def __init__(self):
        self.begun, self.now, self.x, self.v = time.monotonic(), 0.0, 0.0, 0.0

    def go_on(self):
        """Goes on to this moment, and returns it."""
        later = time.monotonic() - self.begun
        steps = math.ceil((later - self.now) / STEP_S)
        h = (later - self.now) / max(1, steps)
        for number in range(steps):  # the midpoint rule
            x = self.x + h / 2 * self.v
            v = self.v + h / 2 * self.acceleration(self.now + number * h, self.x, self.v)
            self.v += h * self.acceleration(self.now + (number + 0.5) * h, x, v)
            self.x += h * v
        self.now = later
        return later

    def acceleration(self, time_s, x, v):
        return force(time_s) - TRUTH["c"] * v - TRUTH["k"] * x


class Rig:
    """What sends, on one bus, and what listens, on another."""

    def __init__(self, channel, database, bus, listener):
        self.channel, self.bus, self.listener = channel, bus, listener
        self.travel, self.force, self.estimate = map(
            database.get_message_by_name, ("Suspension", "Shaker", "Estimate"))
        #: Ids and data of the frames that the interface took, and the number of the others.
        self.sent, self.refused = [], 0
        self.heard = []

    def send(self, message, **signals):
        frame = can.Message(arbitration_id=message.frame_id, is_extended_id=False,
                            data=message.encode(signals))
        try:
            self.bus.send(frame)
        except can.CanOperationError:  # the interface is down
            self.refused += 1
        else:
            self.sent.append((frame.arbitration_id, bytes(frame.data)))

    def listen(self):
        """Hears what has come."""
        while True:
            try:
                frame = self.listener.recv(0)
            except can.CanOperationError:  # the interface went down, as is said once
                continue
            if frame is None:
                return
            self.heard.append(frame)

    def run(self):
        """Sends both messages every 10 ms, each with the value of the moment of its sending."""
        mass = Mass()
        noise = random.Random(3)  # the same each time: of others, one in twenty misses the truth
        states = [(DOWN_S, "down"), (UP_S, "up")]
        for tick in range(round(END_S / PERIOD_S)):
            if states and mass.now >= states[0][0]:
                subprocess.run(["ip", "link", "set", self.channel, states.pop(0)[1]], check=True)
            mass.go_on()
            self.send(self.travel, Travel=1000 * (mass.x + noise.gauss(0, NOISE_M)))
            self.send(self.force, Force=force(mass.go_on()))
            self.listen()
            time.sleep(max(0.0, tick * PERIOD_S - mass.go_on()))

    def heard_of(self, *messages):
        """Returns the frames of some messages that were heard."""
        wanted = [message.frame_id for message in messages]
        return [frame for frame in self.heard if frame.arbitration_id in wanted]

    def write_csv(self, path):
        """Writes a row for each of the rig's frames that was heard, at the kernel's time."""
        lines, first_us = ["t,x [mm],force [N]"], None
        for frame in self.heard_of(self.travel, self.force):
            time_us = round(frame.timestamp * 1e6)
            first_us = time_us if first_us is None else first_us
            which = frame.arbitration_id == self.force.frame_id
            value, = (self.travel, self.force)[which].decode(frame.data).values()
            cells = f",{value!r}" if which else f"{value!r},"
            lines.append(f"{(time_us - first_us) / 1e6!r},{cells}")
        path.write_text("\n".join(lines) + "\n")


class Bridge:
    """The command polyest-bridge with the example's configuration."""

    def __init__(self, channel, server, session):
        text = (EXAMPLE / "bridge.toml").read_text()
        for old, new in (('"suspension"', f'"{session}"'), ('"udp_multicast"', '"socketcan"'),
                         ('"239.74.163.2"', f'"{channel}"'), ("options = ", "# options = ")):
            assert old in text, f"{old} is not in the example"
            text = text.replace(old, new)
        pathlib.Path(f"{session}.toml").write_text(text)
        self.log = pathlib.Path(f"{session}.log")
        with self.log.open("w") as errors:
            self.process = subprocess.Popen(
                [sys.executable, "-B", "-X", "faulthandler", "-m", "polyest.bridge",
                 f"{session}.toml", "--server", server, "--status-interval", "1"], stderr=errors)
        self.wait_for(f"listen to {channel}", lambda: wanted(channel))

    def status(self):
        """Returns the last line of its log."""
        return (self.log.read_text().splitlines() or [""])[-1]

    def end(self):
        """Ends it when it has read all that came, and returns its last line of status."""
        self.wait_for("come to rest", lambda: "no sample for" in self.status())
        self.process.send_signal(signal.SIGTERM)
        self.wait_for("end", lambda: self.process.poll() is not None)
        print(self.status())
        check("status of the bridge", self.process.returncode, 0)
        return self.status()

    def wait_for(self, what, condition):
        """Waits until a condition holds; without success, the log gets the stack of each thread."""
        end = time.monotonic() + 30
        while not condition():
            if time.monotonic() > end:
                print("\n".join(self.log.read_text().splitlines()[-10:]))
                self.process.send_signal(signal.SIGABRT)
                self.process.wait()
                sys.exit(f"failed: the bridge does not {what}")
            time.sleep(0.1)


def wanted(channel):
    """Returns whether the kernel has somebody who listens to Shaker, the last of the messages."""
    text = pathlib.Path("/proc/net/can/rcvlist_fil").read_text()
    return re.search(rf"^ *{channel} +0*200 ", text, re.MULTILINE) is not None


def check(what, found, expected):
    if found != expected:
        sys.exit(f"failed: {what}: {found}, and not {expected}")
    print(f"{what}: {found}", flush=True)


def number(pattern, text):
    """Returns the number that a pattern finds; 0 if it finds none."""
    found = re.search(pattern, text)
    return int(found[1]) if found else 0


def ask(*command):
    """Returns what a command says in JSON."""
    return json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout)


def stream(rig, polyest_command, server):
    """Sends all frames of the rig, and compares what has arrived."""
    bridge = Bridge(rig.channel, server, "suspension")
    rig.run()
    status = bridge.end()
    rig.listen()
    own = rig.heard_of(rig.travel, rig.force)
    check("the bus has carried every frame",
          [(frame.arbitration_id, bytes(frame.data)) for frame in own] == rig.sent, True)
    check("and none while it was down", rig.refused > 0, True)
    check("rows of the bridge", number(r" (\d+) rows", status), len(rig.sent))
    check("times that it noticed that the bus was up again", number(r"source (\d+)", status), 1)
    check("it left something out", "left out" in bridge.log.read_text(), False)
    session, = ask(polyest_command, "list", "--server", server, "--format", "json")["sessions"]
    check("samples of the session", int(session["sampleCount"]), len(rig.heard_of(rig.travel)))
    check("its last run", session["lastRun"], 0)

    rig.write_csv(pathlib.Path("rows.csv"))
    expected = ask(polyest_command, "estimate", "problem.json", "rows.csv", "--format", "json")
    found = ask(polyest_command, "watch", "suspension", "--server", server, "--once",
                "--format", "jsonl")
    check("its estimate is that of the same rows in CSV",
          found["parameters"] == expected["parameters"], True)
    for one in found["parameters"]:
        truth = TRUTH[one["name"]]
        print(f"{one['name']}: {one['mean']:.5g} ± {one['stdDev']:.2g}, "
              f"{(one['mean'] - truth) / one['stdDev']:+.2f} standard deviations off")
        check("its 95 % interval holds the truth", one["lower95"] <= truth <= one["upper95"], True)

    came = [rig.estimate.decode(frame.data) for frame in rig.heard_of(rig.estimate)]
    check("estimates on the bus", len(came), number(r"(\d+) published", status))
    means = {one["name"]: one["mean"] for one in found["parameters"]}
    check("the last of them is the session's",  # to the resolution of the signals
          [abs(came[-1][signal] - means[name]) < 0.000051
           for signal, name in (("Stiffness", "k"), ("Damping", "c"))], [True, True])


def flood(rig, server):
    """Sends more than the kernel keeps for a bridge that stands still."""
    bridge, before = Bridge(rig.channel, server, "flood"), len(rig.sent)
    bridge.process.send_signal(signal.SIGSTOP)
    for count in range(1000):
        rig.send(rig.force, Force=count / 1000)
    bridge.process.send_signal(signal.SIGCONT)
    status = bridge.end()
    lost = number(r"left out: lost (\d+)", status)
    check("frames were lost while the bridge stood still", lost > 0, True)
    check("rows of the bridge and frames lost", number(r" (\d+) rows", status) + lost,
          len(rig.sent) - before)


def main():
    polyestd, polyest_command, channel = sys.argv[1:]
    for name in ("problem.json", "rig.dbc"):
        shutil.copy(EXAMPLE / name, ".")
    with contextlib.ExitStack() as stack:
        bus, listener = (stack.enter_context(can.Bus(interface="socketcan", channel=channel))
                         for _ in range(2))
        client = stack.enter_context(polyest.local(polyestd))
        rig = Rig(channel, cantools.database.load_file("rig.dbc"), bus, listener)
        stream(rig, polyest_command, client.server)
        flood(rig, client.server)


if __name__ == "__main__":
    main()
