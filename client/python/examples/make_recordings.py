"""Writes what a rig records, a driven oscillator: ride.mf4, ride.blf with rig.dbc, and ride.mcap.

The travel is sampled at 1 kHz, the force at 95 Hz; the files of the guide's examples.

Usage: make_recordings.py [FOLDER]
"""

import json
import pathlib
import shutil
import sys

import asammdf
import can
import cantools
import mcap.writer
import numpy as np

STIFFNESS, DAMPING, STEPS = 41.3, 0.9, 4
START_NS = 1_790_000_000 * 10**9  # since 1970: 21 September 2026


def simulate(seconds=4.0):
    """Returns the times and values of the travel, mm, and of the force, N."""
    fine, coarse = np.arange(seconds * 1000) / 1000, np.arange(seconds * 95) / 95
    force = 4 * np.sin(5 * coarse) + 2 * np.sin(11 * coarse)
    x = v = 0.0
    travel = np.empty(len(fine))
    for row, time in enumerate(fine):
        travel[row] = x
        for step in range(STEPS):
            push = np.interp(time + step * 0.001 / STEPS, coarse, force)
            v += 0.001 / STEPS * (push - DAMPING * v - STIFFNESS * x)
            x += 0.001 / STEPS * v
    noise = np.random.default_rng(1).normal(0, 0.003, len(fine))
    return fine, 1000 * (travel + noise), coarse, force


def write_mdf(path, fine, travel, coarse, force):
    """Writes two groups, each with a time of its own."""
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(travel, fine, name="SUSP.Travel", unit="mm")],
                    acq_name="suspension")
        file.append([asammdf.Signal(force, coarse, name="SHAKER.Force", unit="N")],
                    acq_name="shaker")
        file.save(path, overwrite=True)


def merged(fine, travel, coarse, force):
    """Returns time, ns, name and value of all samples in order."""
    found = [(round(time * 1e9), "Travel", value) for time, value in zip(fine, travel)]
    found += [(round(time * 1e9), "Force", value) for time, value in zip(coarse, force)]
    return sorted(found)


def write_blf(path, database, samples):
    """Writes a frame for each sample."""
    messages = {signal.name: message for message in database.messages
                for signal in message.signals}
    with can.BLFWriter(path) as log:
        for time_ns, name, value in samples:
            message = messages[name]
            log.on_message_received(can.Message(
                timestamp=(START_NS + time_ns) / 1e9, arbitration_id=message.frame_id,
                is_extended_id=False, data=message.encode({name: float(value)})))


def write_mcap(path, samples):
    """Writes a JSON message for each sample, in two topics."""
    units = {"Travel": "mm", "Force": "N"}
    with open(path, "wb") as file:
        out = mcap.writer.Writer(file)
        out.start()
        topics = {}
        for name, unit in units.items():
            schema = {"type": "object", "properties": {"value": {"type": "number", "unit": unit}}}
            kind = out.register_schema(name, "jsonschema", json.dumps(schema).encode())
            topics[name] = out.register_channel(f"/rig/{name.lower()}", "json", kind)
        for time_ns, name, value in samples:
            out.add_message(topics[name], START_NS + time_ns,
                            json.dumps({"value": float(value)}).encode(), START_NS + time_ns)
        out.finish()


def main():
    """Writes the files into the given folder, or this one."""
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    dbc = pathlib.Path(__file__).parent / "bridge" / "rig.dbc"
    shutil.copy(dbc, folder / "rig.dbc")
    data = simulate()
    write_mdf(folder / "ride.mf4", *data)
    write_blf(folder / "ride.blf", cantools.database.load_file(dbc), merged(*data))
    write_mcap(folder / "ride.mcap", merged(*data))


if __name__ == "__main__":
    main()
