#!/usr/bin/env python3
"""Compares posteriors of a public benchmark with its reference draws.

    run.py POLYEST WORK [--wheel FILE] [OBSERVATION...]

POLYEST is the command, WORK a folder for the problems. The benchmark is the Lotka-Volterra task of the
package sbibm (J.-M. Lueckmann and others, Benchmarking simulation-based inference, AISTATS 2021): ten
observations of predators and prey, each with 10,000 draws from its posterior by other means. The package is
not installed: its wheel is downloaded into WORK unless one is named, and its files are read in place.

Fails unless, for every observation, the means are within 0.05 reference standard deviations of the
reference's and the standard deviations within 5 %, and unless that takes at most 5 s of computing in the mean. (Ten
thousand independent draws would have sampling errors of 0.01 standard deviations and 0.7 %.)
"""
import argparse
import bz2
import csv
import io
import json
import math
import resource
import statistics
import subprocess
import sys
import time
import zipfile
from pathlib import Path

PACKAGE = "sbibm==1.1.0"
WHEEL = "sbibm-1.1.0-*.whl"
FOLDER = "sbibm/tasks/lotka_volterra/files/num_observation_{}/"
OBSERVATIONS = range(1, 11)
MEAN_LIMIT = 0.05  # in reference standard deviations
SD_LIMIT = 0.05
MEAN_CPU_LIMIT_S = 5
WALL_SECONDS = 600

# Log-mean of each lognormal prior; the deviation of the logarithm is LOG_SD for all.
PRIORS = {"alpha": -0.125, "beta": -3.0, "gamma": -0.125, "delta": -3.0}
LOG_SD = 0.5

# An observation has x at ten times, then y at the same times, each with lognormal noise. The first time is
# that of the initial state, which is known.
STEP_S = 2.1
SAMPLES = 10
LOG_NOISE = 0.1


def lognormal(name, log_mean):
    mean = math.exp(log_mean + LOG_SD**2 / 2)
    std_dev = mean * math.sqrt(math.expm1(LOG_SD**2))
    return {"name": name, "lognormal": {"mean": mean, "stdDev": std_dev}}


def problem():
    return {
        "model": {"equations": {
            "states": {"x": "alpha*x - beta*x*y", "y": "-gamma*y + delta*x*y"},
            "outputs": {"log_x": "log(x)", "log_y": "log(y)"},
        }},
        "fixed": {"x_0": 30, "y_0": 1},
        "uncertain": [lognormal(name, log_mean) for name, log_mean in PRIORS.items()],
        "measured": [{"output": name, "noise": {"absolute": LOG_NOISE}} for name in ("log_x", "log_y")],
    }


def read_table(text):
    """Returns the numbers below the header of CSV text."""
    return [[float(cell) for cell in row] for row in list(csv.reader(io.StringIO(text)))[1:]]


def read_observation(wheel, number):
    """Returns the 20 samples and the reference draws of an observation."""
    folder = FOLDER.format(number)
    samples = read_table(wheel.read(folder + "observation.csv").decode())[0]
    draws = read_table(bz2.decompress(wheel.read(folder + "reference_posterior_samples.csv.bz2")).decode())
    return samples, draws


def write_data(path, samples):
    rows = (f"{i * STEP_S:.1f},{math.log(x)!r},{math.log(y)!r}\n"
            for i, (x, y) in enumerate(zip(samples[:SAMPLES], samples[SAMPLES:], strict=True)))
    path.write_text("t,log_x,log_y\n" + "".join(rows))


def compare(parameters, draws):
    """Returns the largest error of a mean, in reference standard deviations, and of a standard deviation."""
    mean_error = sd_error = 0.0
    by_name = {parameter["name"]: parameter for parameter in parameters}
    for name, values in zip(PRIORS, zip(*draws), strict=True):
        mean, sd = statistics.fmean(values), statistics.stdev(values)
        mean_error = max(mean_error, abs(float(by_name[name]["mean"]) - mean) / sd)
        sd_error = max(sd_error, abs(float(by_name[name]["posteriorStdDev"]) / sd - 1))
    return mean_error, sd_error


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def estimate(polyest, problem_file, data_file):
    """Returns the answer and its CPU seconds; exits with the command's message if there is none."""
    before = cpu_seconds()
    run = subprocess.run([polyest, "estimate", str(problem_file), str(data_file), "--local", "--format", "json"],
                         capture_output=True, text=True, timeout=WALL_SECONDS)
    if run.returncode != 0:
        sys.exit(f"{data_file}: {run.stderr.strip() or run.returncode}")
    return json.loads(run.stdout), cpu_seconds() - before


def find_wheel(work):
    """Returns the wheel in the folder, after downloading it if it is not there."""
    if not any(work.glob(WHEEL)):
        subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check",
                        "--no-deps", "--dest", str(work), PACKAGE], check=True)
    return next(work.glob(WHEEL))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("polyest")
    parser.add_argument("work", type=Path)
    parser.add_argument("--wheel", type=Path)
    parser.add_argument("observations", nargs="*", type=int)
    arguments = parser.parse_intermixed_args()
    work = arguments.work
    work.mkdir(parents=True, exist_ok=True)
    (work / "problem.json").write_text(json.dumps(problem(), indent=2))
    failed, computing = [], []
    print("| observation | mean off by (sd) | sd off by | trajectories | CPU s | wall s | diagnostics |")
    print("|---|---|---|---|---|---|---|")
    with zipfile.ZipFile(arguments.wheel or find_wheel(work)) as wheel:
        for number in arguments.observations or OBSERVATIONS:
            samples, draws = read_observation(wheel, number)
            data = work / f"observation_{number}.csv"
            write_data(data, samples)
            began = time.monotonic()
            answer, seconds = estimate(arguments.polyest, work / "problem.json", data)
            mean_error, sd_error = compare(answer["parameters"], draws)
            codes = ", ".join(diagnostic["code"] for diagnostic in answer["diagnostics"])
            print(f"| {number} | {mean_error:.3f} | {100 * sd_error:.1f} % | {answer['expansion']['trajectories']} "
                  f"| {seconds:.1f} | {time.monotonic() - began:.1f} | {codes} |", flush=True)
            computing.append(seconds)
            if not (mean_error <= MEAN_LIMIT and sd_error <= SD_LIMIT):
                failed.append(str(number))
    if failed:
        print("not within the limits: observation " + ", ".join(failed), file=sys.stderr)
    slow = statistics.fmean(computing) > MEAN_CPU_LIMIT_S
    if slow:
        print(f"{statistics.fmean(computing):.1f} s of computing an observation, at most {MEAN_CPU_LIMIT_S} s allowed",
              file=sys.stderr)
    return 1 if failed or slow else 0


if __name__ == "__main__":
    sys.exit(main())
