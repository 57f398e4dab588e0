"""A rig for tests of files and buses: a driven oscillator, sampled at two rates, and its CSV."""

import json
import os
import pathlib
import subprocess
import time

import numpy as np

import polyest

TRUTH = {"k": 41.3, "c": 0.9}
PROBLEM = (polyest.Problem.builtin("mass_spring_damper").fix(m=1.0, x0=0.0)
           .uncertain("k", polyest.Uniform(35.0, 47.0)).uncertain("c", polyest.Uniform(0.5, 1.5))
           .measure("x", noise=0.001).stream("force"))
DBC = """VERSION ""

NS_ :

BS_:

BU_: RIG

BO_ 256 SUSP: 8 RIG
 SG_ defl : 0|32@1- (0.001,0) [-1000|1000] "mm" RIG
 SG_ state : 32|8@1+ (1,0) [0|255] "" RIG

BO_ 512 ROAD: 8 RIG
 SG_ force : 0|32@1- (0.0001,0) [-1000|1000] "N" RIG

BO_ 768 OTHER: 2 RIG
 SG_ defl : 0|16@1- (1,0) [0|0] "mm" RIG

BO_ 2566834709 EST: 8 RIG
 SG_ k_mean : 0|32@1+ (0.0001,0) [0|400000] "N/m" RIG
 SG_ k_sd : 32|16@1+ (0.0001,0) [0|6] "N/m" RIG
 SG_ k_ok : 48|1@1+ (1,0) [0|1] "" RIG
 SG_ small : 49|4@1+ (1,0) [0|15] "" RIG

VAL_ 256 state 255 "SNA" 0 "off" 1 "on" ;
"""


def record(seconds=4.0):
    """Returns times and values of x, mm, at 1 kHz and of the force, N, at 95 Hz.

    Values are whole multiples of the resolution that DBC gives the signals.
    """
    fine, coarse = np.arange(round(seconds * 1000)) / 1000, np.arange(round(seconds * 95)) / 95
    coarse = np.round(coarse, 6)  # as a log has them, in whole µs
    force = np.round(4 * np.sin(5 * coarse) + 2 * np.sin(11 * coarse), 4)
    x = v = 0.0
    found = []
    for t in fine:
        found.append(x)
        for step in range(4):  # semi-implicit Euler, much finer than the noise
            push = np.interp(t + step * 2.5e-4, coarse, force)
            v += 2.5e-4 * (push - TRUTH["c"] * v - TRUTH["k"] * x)
            x += 2.5e-4 * v
    noise = np.random.default_rng(1).normal(0, 0.001, len(fine))
    return fine, np.round((np.array(found) + noise) * 1000, 3), coarse, force


def write_csv(path, fine, x, coarse, force):
    """Writes what was sampled, with empty cells, every number to its last bit."""
    rows = {float(t): [repr(float(value)), ""] for t, value in zip(fine, x)}
    for t, value in zip(coarse, force):
        rows.setdefault(float(t), ["", ""])[1] = repr(float(value))
    lines = ["t,x [mm],force [N]", *(f"{t!r},{','.join(rows[t])}" for t in sorted(rows))]
    path.write_text("\n".join(lines) + "\n")


def estimate_of_csv(folder, csv, problem=PROBLEM, *options):
    """Returns the parameters that the command `polyest` estimates from a file."""
    problem.save(folder / "problem.json")
    program = pathlib.Path(os.environ["POLYEST_DAEMON"]).with_name("polyest")
    done = subprocess.run([program, "estimate", folder / "problem.json", csv, "--local",
                           "--format", "json", *options], capture_output=True, text=True,
                          check=True)
    return json.loads(done.stdout)["parameters"]


def same(estimate, parameters):
    """Returns whether an estimate has these numbers to the last bit, as the command prints them."""
    return estimate.to_dict()["parameters"] == parameters


class Waits:
    """Stands in for the event that ends a source: it is set once so many delays have been asked."""

    def __init__(self, count):
        self.count, self.delays = count, []

    def is_set(self):
        return len(self.delays) >= self.count

    def wait(self, timeout_s):
        self.delays.append(timeout_s)


def wait_for(condition, timeout_s=60.0):
    """Waits until something has come about."""
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.005)
