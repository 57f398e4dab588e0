"""The models of the examples in compiled code, as a user of the peers would write them, with numba.

Each model has the names of its unknowns, the bounds of their uniform priors, the noise of a sample, and
`outputs(unknowns, times)`, which integrates by the classical Runge–Kutta method in steps so short that
their error is far below the noise.
"""

import csv
import json
import math
import pathlib

import numpy
from numba import njit

EXAMPLES = pathlib.Path(__file__).resolve().parents[3] / "client" / "examples"


@njit(cache=True)
def oscillator_rate(state, unknowns, time, rate):
    rate[0] = state[1]
    rate[1] = -unknowns[0] * state[0] - unknowns[1] * state[1]


@njit(cache=True)
def chain_rate(state, unknowns, time, rate):
    # Four masses; x1 … x4, v1 … v4. The force is a chirp from 0.3 to 5 Hz in 20 s.
    force = 5.0 * math.sin(2 * math.pi * (0.3 + 4.7 / 40.0 * time) * time)
    below = unknowns[4] * state[0] + unknowns[8] * state[4]
    for i in range(4):
        above = force
        if i < 3:
            above = (unknowns[5 + i] * (state[i + 1] - state[i])
                     + unknowns[9 + i] * (state[5 + i] - state[4 + i]))
        rate[i] = state[4 + i]
        rate[4 + i] = (above - below) / unknowns[i]
        below = above


def integrator(rate_of, states, start, measured, substeps):
    """Compiles the integration of a model whose first outputs are its first states."""

    @njit
    def move(state, by, slope, moved):
        for i in range(states):
            moved[i] = state[i] + by * slope[i]

    @njit
    def step(state, unknowns, time, dt, work):
        # One sample's interval. `work`: five vectors of states.
        h = dt / substeps
        for k in range(substeps):
            t = time + k * h
            rate_of(state, unknowns, t, work[0])
            move(state, h / 2, work[0], work[4])
            rate_of(work[4], unknowns, t + h / 2, work[1])
            move(state, h / 2, work[1], work[4])
            rate_of(work[4], unknowns, t + h / 2, work[2])
            move(state, h, work[2], work[4])
            rate_of(work[4], unknowns, t + h, work[3])
            for i in range(states):
                state[i] += h / 6 * (work[0, i] + 2 * work[1, i] + 2 * work[2, i] + work[3, i])

    @njit
    def outputs(unknowns, times):
        state, work = start.copy(), numpy.zeros((5, states))
        found, now = numpy.empty((times.size, measured)), 0.0
        for i in range(times.size):
            step(state, unknowns, now, times[i] - now, work)
            now = times[i]
            found[i] = state[:measured]
        return found

    return step, outputs


class Model:
    def __init__(self, example, rate_of, states, start, measured, substeps):
        problem = json.loads((EXAMPLES / f"{example}.json").read_text(encoding="utf-8"))
        with open(EXAMPLES / f"{example}.csv", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        record = numpy.array(rows[1:], dtype=float)
        self.example = example
        self.names = [unknown["name"] for unknown in problem["uncertain"]]
        bounds = [unknown["uniform"] for unknown in problem["uncertain"]]
        self.lower = numpy.array([bound["lower"] for bound in bounds])
        self.upper = numpy.array([bound["upper"] for bound in bounds])
        self.noise = problem["measured"][0]["noise"]["absolute"]
        self.times, self.samples = record[:, 0].copy(), record[:, 1:].copy()
        self.start, self.states = numpy.array(start), states
        self.step, self.outputs = integrator(rate_of, states, self.start, measured, substeps)
        self.outputs(self.middle(), self.times[:2])  # compiles

    def middle(self):
        return (self.lower + self.upper) / 2

    def residuals(self, unknowns):
        return ((self.outputs(unknowns, self.times) - self.samples) / self.noise).ravel()


def models():
    yield Model("oscillator", oscillator_rate, 2, [1.0, 0.0], 1, 8)
    yield Model("chain", chain_rate, 8, [0.0] * 8, 4, 16)
