"""Problems, and their models in compiled code, as a user of the peers would write them, with numba.

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


@njit(cache=True)
def spring_rate(state, unknowns, time, rate):
    # A spring that hardens, let go: k, k3, c.
    rate[0] = state[1]
    rate[1] = (-unknowns[0] * state[0] - unknowns[1] * state[0] ** 3 - unknowns[2] * state[1])


@njit(cache=True)
def buoy_rate(state, unknowns, time, rate):
    # A buoy that heaves in a swell of two periods, with quadratic drag: w2, c, d, a.
    swell = math.sin(0.45 * time) + 0.5 * math.sin(0.62 * time)
    rate[0] = state[1]
    rate[1] = (-unknowns[0] * state[0] - unknowns[1] * state[1]
               - unknowns[2] * abs(state[1]) * state[1] + unknowns[3] * swell)


def uniform(name, lower, upper):
    return {"name": name, "uniform": {"lower": lower, "upper": upper}}


# The posterior is bent, and cut off by its prior.
SPRING = {
    "model": {"equations": {"states": {"x": "v", "v": "-k*x - k3*x^3 - c*v"}, "outputs": {"x": "x"}}},
    "fixed": {"x_0": 1},
    "uncertain": [uniform("k", 10, 40), uniform("k3", 0, 40), uniform("c", 0, 3)],
    "measured": [{"output": "x", "noise": {"absolute": 0.05}}],
}
BUOY = {
    "model": {"equations": {
        "states": {"z": "v", "v": "-w2*z - c*v - d*abs(v)*v + a*(sin(0.45*t) + 0.5*sin(0.62*t))"},
        "outputs": {"z": "z"}}},
    "uncertain": [uniform("w2", 0.5, 1.5), uniform("c", 0.02, 0.3), uniform("d", 0, 0.5),
                  uniform("a", 0.2, 1)],
    "measured": [{"output": "z", "noise": {"absolute": 0.05}}],
}


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
    """A problem, its model, and one record of it: `times` and `samples`, an output a column."""

    def __init__(self, name, problem, rate_of, start, measured, substeps):
        self.name, self.problem = name, problem
        self.names = [unknown["name"] for unknown in problem["uncertain"]]
        bounds = [unknown["uniform"] for unknown in problem["uncertain"]]
        self.lower = numpy.array([bound["lower"] for bound in bounds])
        self.upper = numpy.array([bound["upper"] for bound in bounds])
        self.outputs_measured = [channel["output"] for channel in problem["measured"]]
        self.noise = problem["measured"][0]["noise"]["absolute"]
        self.start, self.states = numpy.array(start), len(start)
        self.step, self.outputs = integrator(rate_of, self.states, self.start, measured, substeps)
        self.outputs(self.middle(), numpy.array([0.0, 1e-3]))  # compiles

    def read(self, path):
        with open(path, encoding="utf-8") as file:
            record = numpy.array(list(csv.reader(file))[1:], dtype=float)
        self.times, self.samples = record[:, 0].copy(), record[:, 1:].copy()
        return self

    def simulate(self, seed, times=None):
        """Replaces the record by one of a truth drawn from the prior, and returns the truth."""
        if times is not None:
            self.times = times
        random = numpy.random.default_rng(seed)
        truth = random.uniform(self.lower, self.upper)
        outputs = self.outputs(truth, self.times)
        self.samples = outputs + self.noise * random.standard_normal(outputs.shape)
        return truth

    def write(self, folder):
        """Writes the problem and the record as files of polyest; returns their paths."""
        problem, record = pathlib.Path(folder, "problem.json"), pathlib.Path(folder, "record.csv")
        problem.write_text(json.dumps(self.problem), encoding="utf-8")
        with open(record, "w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(["t", *self.outputs_measured])
            writer.writerows([time, *row] for time, row in zip(self.times, self.samples))
        return problem, record

    def middle(self):
        return (self.lower + self.upper) / 2

    def residuals(self, unknowns):
        return ((self.outputs(unknowns, self.times) - self.samples) / self.noise).ravel()


def of_example(name, rate_of, start, measured, substeps):
    problem = json.loads((EXAMPLES / f"{name}.json").read_text(encoding="utf-8"))
    return Model(name, problem, rate_of, start, measured, substeps).read(EXAMPLES / f"{name}.csv")


def simulated(name, problem, rate_of, start, times, substeps):
    model = Model(name, problem, rate_of, start, 1, substeps)
    model.simulate(1, times)
    return model


# Each makes a model when it is called, which compiles it.
MODELS = {
    "spring": lambda: simulated("spring", SPRING, spring_rate, [1.0, 0.0],
                                numpy.arange(1, 21) / 20, 8),
    "oscillator": lambda: of_example("oscillator", oscillator_rate, [1.0, 0.0], 1, 8),
    "buoy": lambda: simulated("buoy", BUOY, buoy_rate, [0.0, 0.0], numpy.arange(1.0, 3601.0), 16),
    "chain": lambda: of_example("chain", chain_rate, [0.0] * 8, 4, 16),
}
