#!/usr/bin/env python3
"""Measures how long `polyest estimate` computes, of one build or of several by turns.

    estimates_benchmark.py POLYEST [OTHER_POLYEST]... [--repeats N] [--only NAME]... [--data FOLDER]

Prints for each record the CPU time on one thread, beside that of a start of the program, and the runs of
the model, for each build: the least of N estimates, or of as many as take a second. Then it prints how
many times as fast the first build is as each other one. Records of real hardware that the folder does not
hold are left out.
"""

import argparse
import itertools
import json
import math
import pathlib
import random
import resource
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "client" / "examples"
DATA = ROOT.parent / "shared" / "data"
LEAST_S = 1  # short estimates are repeated for so long
STARTS = 30


def uniform(**bounds):
    return [{"name": name, "uniform": {"lower": lower, "upper": upper}}
            for name, (lower, upper) in bounds.items()]


# Two gliders between three springs on an air track, in pixels; the priors are broad.
TWO_GLIDERS = {
    "model": {"equations": {
        "states": {"x1": "v1", "x2": "v2",
                   "v1": "b*(x2 - o2) - (a + b)*(x1 - o1) - c1*v1",
                   "v2": "g*(x1 - o1) - (g + h)*(x2 - o2) - c2*v2"},
        "outputs": {"x1": "x1", "x2": "x2"}}},
    "uncertain": uniform(a=(2, 15), b=(40, 120), g=(15, 50), h=(1, 6), c1=(0, 0.3), c2=(0, 0.3),
                         o1=(20, 100), o2=(-100, -20), x1_0=(-20, 20), x2_0=(-160, -120),
                         v1_0=(-300, 300), v2_0=(-300, 300)),
    "measured": [{"output": "x1", "noise": {"absolute": 0.62}},
                 {"output": "x2", "noise": {"absolute": 0.62}}],
    "expansion": {"order": 2},
}

# An oscillator whose spring hardens, driven by two tones.
DRIVEN = {
    "model": {"equations": {
        "states": {"x": "v", "v": "-k*x - c*v - d*x^3 + 4*sin(5.1*t) + 3*sin(8.7*t)"},
        "outputs": {"x": "x"}}},
    "fixed": {"x_0": 0, "v_0": 0},
    "uncertain": uniform(k=(30, 50), c=(0.2, 2), d=(0, 50)),
    "measured": [{"output": "x", "noise": {"absolute": 0.01}}],
}


def driven_rows(count):
    """Yields rows of the driven oscillator, a thousand a second, with noise: Runge–Kutta's method."""
    noise, h, t, x, v = random.Random(3), 1e-3, 0.0, 0.0, 0.0

    def force(time):
        return 4 * math.sin(5.1 * time) + 3 * math.sin(8.7 * time)

    def acceleration(force_now, x_now, v_now):
        return force_now - 41.3 * x_now - 0.83 * v_now - 20 * x_now**3

    for row in range(1, count + 1):
        middle, end = force(t + h / 2), force(t + h)
        a1 = acceleration(force(t), x, v)
        v2 = v + h / 2 * a1
        a2 = acceleration(middle, x + h / 2 * v, v2)
        v3 = v + h / 2 * a2
        a3 = acceleration(middle, x + h / 2 * v2, v3)
        v4 = v + h * a3
        a4 = acceleration(end, x + h * v3, v4)
        x += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        t = row * h
        yield f"{t:.3f},{x + noise.gauss(0, 0.01):.5f}\n"


def example(name):
    def files(folder, data):
        return EXAMPLES / f"{name}.json", EXAMPLES / f"{name}.csv"
    return files


def measured(problem, record, rows=None):
    """A record of real hardware, or its first rows; the problem is an example or a dictionary."""
    def files(folder, data):
        if not (data / record).exists():
            return None
        part = folder / record
        with open(data / record, encoding="utf-8") as file:
            part.write_text("".join(itertools.islice(file, rows and rows + 1)), encoding="utf-8")
        if isinstance(problem, dict):
            return written(problem, folder), part
        return EXAMPLES / problem, part
    return files


def driven(count):
    def files(folder, data):
        record = folder / "driven.csv"
        with open(record, "w", encoding="utf-8") as file:
            file.write("t,x\n")
            file.writelines(driven_rows(count))
        return written(DRIVEN, folder), record
    return files


def written(problem, folder):
    path = folder / "problem.json"
    path.write_text(json.dumps(problem), encoding="utf-8")
    return path


RECORDS = {
    "oscillator": ("2 unknowns, 50 s", example("oscillator")),
    "quarter_car": ("3 unknowns, 4 s", example("quarter_car")),
    "chain": ("12 unknowns, 20 s", example("chain")),
    "silverbox": ("8 unknowns, 6,000 rows", measured("silverbox.json", "silverbox_multisine.csv", 6000)),
    "air_track": ("5 unknowns, 29 s", measured("air_track.json", "air_track_1mass.csv")),
    "two_gliders": ("12 unknowns, 16.5 s", measured(TWO_GLIDERS, "air_track_2mass.csv")),
    "driven": ("3 unknowns, 1,000,000 rows", driven(1_000_000)),
    "pendulum": ("6 unknowns, 92 s", measured("pendulum.json", "pendulum.csv")),
    "damper": ("5 unknowns, 15 s", measured("mr_damper.json", "mr_damper_4_4.csv")),
    "specimens": ("20 runs, a population", example("specimens")),
    "warming": ("2 unknowns, one drifts, 60 s", example("warming")),
}


def estimate(build, problem, record):
    return [build, "estimate", problem, record, "--threads", "1", "--format", "json"]


def cpu_seconds(command):
    """Runs a command and returns its CPU time and what it printed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"estimates_benchmark: {' '.join(map(str, command))}: {done.stderr.decode().strip()}")
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, done.stdout


def measure(builds, problem, record, repeats):
    """Returns for each build the least CPU time beside that of its start, s, and the model runs."""
    seconds, runs = [math.inf] * len(builds), [0] * len(builds)
    first, _ = cpu_seconds(estimate(builds[0], problem, record))
    repeats = max(repeats, math.ceil(LEAST_S / first))
    for _, (k, build) in itertools.product(range(repeats), enumerate(builds)):
        taken, answer = cpu_seconds(estimate(build, problem, record))
        seconds[k] = min(seconds[k], taken)
        runs[k] = int(json.loads(answer)["expansion"]["trajectories"])
    starts = [min(cpu_seconds([build, "--version"])[0] for _ in range(STARTS)) for build in builds]
    return [taken - start for taken, start in zip(seconds, starts)], runs


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("builds", nargs="+", metavar="POLYEST")
    parser.add_argument("--repeats", type=int, default=5, help="estimates of each record, ≥ 1 (5)")
    parser.add_argument("--only", action="append", choices=RECORDS, help="this record; may be repeated")
    parser.add_argument("--data", type=pathlib.Path, default=DATA,
                        help="the folder of measured records (../shared/data)")
    arguments = parser.parse_args()
    if arguments.repeats < 1:
        parser.error(f"--repeats is {arguments.repeats}, but must be at least 1")
    for build in arguments.builds:
        if shutil.which(build) is None:
            parser.error(f"{build} is no program")
    print(f"{'record':40}{'CPU s, and model runs, of each build':>38}")
    for name in arguments.only or RECORDS:
        size, files = RECORDS[name]
        with tempfile.TemporaryDirectory() as folder:
            found = files(pathlib.Path(folder), arguments.data)
            if found is None:
                print(f"{name + ', ' + size:40}left out: {arguments.data} does not hold it")
                continue
            seconds, runs = measure(arguments.builds, *found, arguments.repeats)
        columns = "".join(f"{taken:10.4f} {count:6}" for taken, count in zip(seconds, runs))
        ratios = "".join(f"{other / seconds[0]:8.2f}×" for other in seconds[1:])
        print(f"{name + ', ' + size:40}{columns}{ratios}", flush=True)


if __name__ == "__main__":
    main()
