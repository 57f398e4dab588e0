#!/usr/bin/env python3
"""Compares polyest with what its users would use else, on the same records, side by side.

    emcee     the Markov chains of 32 or more walkers, from the least-squares fit, until they are 50
              autocorrelation times long, or for M minutes
    UKF       the unscented Kalman filter of filterpy with the unknowns as states
    scipy     least squares and its covariance

All get the model in compiled code. Prints the CPU time, the number of model runs over the whole record,
and how far means and standard deviations are from those of emcee, which samples the exact posterior: the
largest of all unknowns, in standard deviations and as a ratio.

Then all but emcee estimate records of truths drawn from the prior. Coverage is the part of the unknowns,
over all records, whose truth lies in its interval of 95 %: polyest's, and mean ± 1.96 standard deviations
of the others. Of an exact posterior it is 95 %.
"""

import argparse
import json
import math
import resource
import subprocess
import tempfile
import time

import emcee
import numpy
import scipy.optimize
from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

from models import MODELS


class Found:
    """What a method says of the unknowns, and what it took. `interval` is of 95 %, 2 × unknowns."""

    def __init__(self, method, mean, deviation, cpu_s, runs, note="", interval=None):
        self.method, self.mean, self.deviation = method, numpy.array(mean), numpy.array(deviation)
        self.cpu_s, self.runs, self.note = cpu_s, runs, note
        self.interval = self.mean + numpy.outer([-1.96, 1.96], self.deviation)
        if interval is not None:
            self.interval = numpy.array(interval)


def by_polyest(model, polyest):
    with tempfile.TemporaryDirectory() as folder:
        problem, record = model.write(folder)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        answer = subprocess.run([polyest, "estimate", problem, record, "--format", "json"], check=True,
                                capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    estimate = json.loads(answer.stdout)
    parameters = estimate["parameters"]
    runs = float(estimate["expansion"]["trajectories"])
    cpu_s = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return Found("polyest", [parameter["mean"] for parameter in parameters],
                 [parameter["posteriorStdDev"] for parameter in parameters], cpu_s, runs,
                 interval=[[parameter["lower95"] for parameter in parameters],
                           [parameter["upper95"] for parameter in parameters]])


def by_least_squares(model):
    begin, runs = time.process_time(), 0

    def residuals(unknowns):
        nonlocal runs
        runs += 1
        return model.residuals(unknowns)

    fit = scipy.optimize.least_squares(residuals, model.middle(), bounds=(model.lower, model.upper),
                                       x_scale=model.upper - model.lower)
    deviation = numpy.sqrt(numpy.diag(numpy.linalg.inv(fit.jac.T @ fit.jac)))
    return Found("scipy", fit.x, deviation, time.process_time() - begin, runs)


def by_emcee(model, fit, minutes, seed=1):
    begin, runs = time.process_time(), 0

    def log_posterior(unknowns):
        nonlocal runs
        if numpy.any(unknowns < model.lower) or numpy.any(unknowns > model.upper):
            return -numpy.inf
        runs += 1
        residuals = model.residuals(unknowns)
        return -0.5 * residuals @ residuals

    walkers = max(32, 4 * len(model.names))
    random = numpy.random.default_rng(seed)
    start = fit.mean + fit.deviation * random.standard_normal((walkers, len(model.names)))
    start = numpy.clip(start, model.lower, model.upper)
    sampler = emcee.EnsembleSampler(walkers, len(model.names), log_posterior)
    sampler.random_state = numpy.random.RandomState(seed).get_state()
    note = f"stopped after {minutes:g} minutes"
    state, time_constant = start, numpy.inf
    while time.process_time() - begin < 60 * minutes:
        state = sampler.run_mcmc(state, 250)
        time_constant = numpy.max(sampler.get_autocorr_time(tol=0))
        if sampler.iteration > 50 * time_constant:
            note = ""
            break
    draws = sampler.get_chain(discard=int(5 * min(time_constant, sampler.iteration / 10)), flat=True)
    return Found("emcee", draws.mean(0), draws.std(0), time.process_time() - begin, runs, note)


def by_filter(model):
    begin = time.process_time()
    n, unknowns = model.states, len(model.names)
    work = numpy.zeros((5, n))
    now = 0.0

    def advance(point, dt):
        state = point[:n].copy()
        # Within its prior: the model is not defined elsewhere.
        model.step(state, numpy.clip(point[n:], model.lower, model.upper), now, dt, work)
        return numpy.concatenate([state, point[n:]])

    measured = model.samples.shape[1]
    points = MerweScaledSigmaPoints(n + unknowns, alpha=0.1, beta=2.0, kappa=3.0 - n - unknowns)
    ukf = UnscentedKalmanFilter(n + unknowns, measured, None, lambda point: point[:measured], advance,
                                points)
    scale = (model.upper - model.lower) / numpy.sqrt(12)
    ukf.x = numpy.concatenate([model.start, model.middle()])
    ukf.P = numpy.diag(numpy.concatenate([numpy.full(n, 1e-10), scale**2]))
    ukf.R, ukf.Q = model.noise**2 * numpy.eye(measured), 1e-14 * numpy.eye(n + unknowns)
    note = ""
    try:
        for at, sample in zip(model.times, model.samples):
            ukf.predict(dt=at - now)
            now = at
            ukf.update(sample)
    except numpy.linalg.LinAlgError:
        note = "its covariance is not positive definite any more"
    return Found("UKF", ukf.x[n:], numpy.sqrt(numpy.abs(numpy.diag(ukf.P)[n:])),
                 time.process_time() - begin, 2 * (n + unknowns) + 1, note)


def report(model, exact, all_found):
    print(f"\n{model.name}: {len(model.names)} unknowns, {model.samples.size} samples in "
          f"{model.times[-1]:g} s")
    print("  method    CPU time, s  model runs  mean, sd off  sd, ratio")
    for found in all_found:
        shift = numpy.max(numpy.abs(found.mean - exact.mean) / exact.deviation)
        ratios = found.deviation / exact.deviation
        ratio = ratios[numpy.argmax(numpy.abs(numpy.log(ratios)))]
        numbers = f"{shift:12.2f} {ratio:10.2f}" if found is not exact else f"{'exact':>12s} {'exact':>10s}"
        print(f"  {found.method:8s} {found.cpu_s:12.2f} {found.runs:11.0f}  {numbers}"
              + (f"  {found.note}" if found.note else ""), flush=True)


def report_coverage(model, methods, records):
    """Estimates simulated records by each method and prints how often its intervals hold the truth."""
    held, cpu_s = {}, {}
    for seed in range(1000, 1000 + records):
        truth = model.simulate(seed)
        for method in methods:
            found = method(model)
            inside = (found.interval[0] <= truth) & (truth <= found.interval[1])
            held.setdefault(found.method, []).append(inside)
            cpu_s[found.method] = cpu_s.get(found.method, 0) + found.cpu_s
    print(f"  {records} simulated records: coverage of 95 % intervals, CPU time of a record")
    for method, inside in held.items():
        print(f"  {method:8s} {100 * numpy.mean(inside):11.1f} % {cpu_s[method] / records:9.2f} s",
              flush=True)


def number(kind, least):
    """Returns what converts an argument that must be at least `least`."""
    def convert(text):
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not value >= least:
            raise argparse.ArgumentTypeError(f"'{text}' must be a number of at least {least}")
        return value

    return convert


def main():
    parser = argparse.ArgumentParser(description=__doc__, usage="run.sh POLYEST FOLDER [OPTION]...",
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("polyest", help=argparse.SUPPRESS)
    parser.add_argument("--minutes", type=number(float, 0.01), default=10.0, metavar="M",
                        help="longest time of emcee (default: 10)")
    parser.add_argument("--records", type=number(int, 0), default=40, metavar="N",
                        help="simulated records of each problem; 0: none (default: 40)")
    parser.add_argument("--problem", action="append", choices=MODELS,
                        help="this problem; may be given several times (default: all)")
    arguments = parser.parse_args()

    def polyest(model):
        return by_polyest(model, arguments.polyest)

    for name in arguments.problem or MODELS:
        model = MODELS[name]()
        fit = by_least_squares(model)
        exact = by_emcee(model, fit, arguments.minutes)
        report(model, exact, [polyest(model), exact, by_filter(model), fit])
        if arguments.records > 0:
            report_coverage(model, [polyest, by_filter, by_least_squares], arguments.records)


if __name__ == "__main__":
    main()
