"""Simulates a suspension on a shaker: sends CAN frames by multicast, prints what comes back.

To try the bridge without hardware, run in three terminals:

    polyestd --durability memory
    polyest-bridge bridge.toml
    python3 rig.py

It needs `pip install 'polyest[bridge]' msgpack`.
"""

import argparse
import math
import random
import time

import can
import cantools

STIFFNESS, DAMPING = 41.3, 0.9
PERIOD_S, MAX_STEP_S = 0.005, 0.0006


def force(time_s):
    """The shaker's force, N."""
    return 4 * math.sin(5 * time_s) + 2 * math.sin(11 * time_s)


def main():
    """Sends both messages every 5 ms until the end, and prints estimates as they come."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--group", default="239.74.163.2", help="address of the multicast")
    parser.add_argument("--port", type=int, default=43113)
    parser.add_argument("--duration", type=float, default=60.0, help="s")
    options = parser.parse_args()
    database = cantools.database.load_file(__file__.replace("rig.py", "rig.dbc"))
    suspension, shaker, estimate = map(database.get_message_by_name,
                                       ("Suspension", "Shaker", "Estimate"))
    noise = random.Random(1)
    with can.Bus(interface="udp_multicast", channel=options.group, port=options.port) as bus:
        begun, now, x, v = time.monotonic(), 0.0, 0.0, 0.0
        while now < options.duration:
            for message, values in (
                    (suspension, {"Travel": 1000 * (x + noise.gauss(0, 0.003))}),
                    (shaker, {"Force": force(now)})):
                bus.send(can.Message(arbitration_id=message.frame_id, is_extended_id=False,
                                     data=message.encode(values)))
            while (heard := bus.recv(0)) is not None:
                if heard.arbitration_id == estimate.frame_id:
                    print({name: round(value, 4) for name, value in
                           estimate.decode(heard.data).items()}, flush=True)
            time.sleep(max(0.0, begun + now + PERIOD_S - time.monotonic()))
            later = time.monotonic() - begun
            steps = 1 + int((later - now) / MAX_STEP_S)  # many when the machine is busy
            step = (later - now) / steps
            for number in range(steps):
                push = force(now + (number + 0.5) * step)
                v += step * (push - DAMPING * v - STIFFNESS * x)
                x += step * v
            now = later


if __name__ == "__main__":
    main()
