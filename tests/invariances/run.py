#!/usr/bin/env python3
"""Checks on measured records and on the examples that estimates do not depend on what must not matter.

    run.py POLYEST WORK [--data FOLDER] [RECORD...]

POLYEST is the command, WORK a folder for problems, data and answers. The measured records are in FOLDER, by
default shared/data beside the repository; without that folder nothing is run, and the exit status is 77.
Every prior is made uniform over the range of its own, and every noise absolute. The checks:

    noise F       The assumed noise is F times the residual. With flat priors the minimum of the cost stays
                  where it is, so `map` must be within 0.1 standard deviations of that of factor 1. So must
                  the mean for factors up to 1, where the posterior is that of the residuals. For larger
                  ones it is not compared: a wider posterior is more skewed, and its mean moves. An answer
                  that carries EXPANSION_INACCURATE or NOT_CONVERGED says so itself and passes.
    thinned by K  Only every K-th row has samples; streamed inputs keep all rows. Every mean of the whole
                  record must be within the thinned record's interval in which all n parameters together
                  would be with a probability of 95 %: the 95 % interval of each, widened by Bonferroni's
                  factor z(0.025/n)/z(0.025).
    halves        The second half of the record has its own time 0 and its own initial state. The 95 %
                  intervals of both halves must overlap for every parameter that they share, or the whole
                  record's estimate must carry WINDOWS_DISAGREE or INCONSISTENT_OVER_TIME. Left out where
                  an input is a function of time.

The deviation in the table is the largest of all parameters, with its limit: for `noise` in standard
deviations, the robust one of factor 1 or the answer's own if that is larger; for `thinned` in half widths
of its 95 % interval; for `halves` in the sum of both half widths.

Fails if any check is missed, or if there is no answer.
"""
import argparse
import copy
import csv
import json
import resource
import statistics
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PROBLEMS = Path(__file__).resolve().parent / "problems"
EXAMPLES = SOURCE / "client" / "examples"
DATA = SOURCE.parent / "shared" / "data"
SKIPPED = 77
FACTORS = (0.03, 0.1, 0.3, 1, 3, 10)
THINNINGS = (2, 5)
MISSED = "MISSED"
NOISE_LIMIT = 0.1  # standard deviations
ADMITTED = {"WINDOWS_DISAGREE", "INCONSISTENT_OVER_TIME"}
# With these an answer says itself that its numbers are off.
NOT_TO_BE_BELIEVED = {"EXPANSION_INACCURATE", "NOT_CONVERGED"}
WALL_SECONDS = 1200


@dataclass
class Record:
    problem: Path
    data: str  # of EXAMPLES, or of the folder of measured records
    residuals: dict  # root mean square of sample - model, by output
    second: dict = field(default_factory=dict)  # ranges of the second half's initial state; none: no halves

    @property
    def name(self):
        return Path(self.data).stem


RECORDS = [
    Record(EXAMPLES / "air_track.json", "air_track_1mass.csv", {"x": 0.41},
           {"x0": (-140, 140), "v0": (-350, 350)}),
    Record(PROBLEMS / "air_track_2mass.json", "air_track_2mass.csv", {"x1": 0.62, "x2": 0.59},
           {"x1_0": (-20, 150), "x2_0": (-160, 20), "v1_0": (-300, 300), "v2_0": (-300, 300)}),
    Record(PROBLEMS / "pendulum.json", "pendulum.csv", {"theta": 0.0106},
           {"theta0": (-1.4, 1.4), "omega0": (-2, 2)}),
    Record(EXAMPLES / "silverbox.json", "silverbox_multisine.csv", {"y": 0.0003},
           {"x_0": (-0.3, 0.3), "v_0": (-150, 150)}),
    Record(EXAMPLES / "mr_damper.json", "mr_damper_0V.csv", {"F": 11}, {"w_0": (-1, 1)}),
    Record(EXAMPLES / "mr_damper.json", "mr_damper_4_4.csv", {"F": 21}, {"w_0": (-1, 1)}),
    Record(EXAMPLES / "oscillator.json", "oscillator.csv", {"x": 0.01}, {"x0": (-1, 1), "v0": (-7, 7)}),
    Record(EXAMPLES / "releases.json", "releases.csv", {"x": 0.0094}, {"x0": (-1.5, 1.5), "v0": (-10, 10)}),
    Record(EXAMPLES / "rough_sensor.json", "rough_sensor.csv", {"x": 0.103}, {"x0": (-1, 1), "v0": (-7, 7)}),
    Record(EXAMPLES / "roll_plane.json", "roll_plane.csv", {"x1": 0.0005, "x2": 0.0005},
           {"x1_0": (-0.1, 0.1), "x2_0": (-0.1, 0.1), "v1_0": (-1, 1), "v2_0": (-1, 1)}),
    Record(EXAMPLES / "roll_plane_4dof.json", "roll_plane_4dof.csv",
           {"d1": 1.5e-4, "d2": 1.6e-4, "d1_rate": 3.2e-3, "d2_rate": 3.4e-3}),
    Record(EXAMPLES / "quarter_car.json", "quarter_car.csv", {"travel": 0.0005, "zs_accel": 0.05},
           {"zs_0": (-0.1, 0.1), "zu_0": (-0.1, 0.1), "vs_0": (-1, 1), "vu_0": (-2, 2)}),
    Record(EXAMPLES / "bicycle.json", "bicycle.csv", {"r": 0.005, "ay": 0.1},
           {"vy_0": (-2, 2), "r_0": (-1, 1)}),
    Record(EXAMPLES / "damper_rig.json", "damper_rig.csv", {"accel": 0.1, "force": 5},
           {"x_0": (-0.1, 0.1), "v_0": (-2, 2)}),
    Record(EXAMPLES / "chain.json", "chain.csv", {"x1": 0.002, "x2": 0.002, "x3": 0.002, "x4": 0.002}),
]


def flat_range(prior):
    """Returns the range of a prior, or three standard deviations about its mean where that has no end."""
    (kind, numbers), = prior.items()
    low, high = float("-inf"), float("inf")
    if "mean" in numbers:
        low, high = (numbers["mean"] + side * 3 * numbers["stdDev"] for side in (-1, 1))
    if kind == "lognormal":
        low = max(low, numbers["mean"] / 10)
    return {"lower": numbers.get("lower", low), "upper": numbers.get("upper", high)}


def flatten(problem, residuals):
    """Makes all priors uniform and independent, and the noise of each output absolute."""
    problem = copy.deepcopy(problem)
    problem.pop("correlations", None)
    for parameter in problem["uncertain"]:
        kind = next(key for key in parameter if key not in ("name", "perRun"))
        parameter["uniform"] = flat_range({kind: parameter.pop(kind)})
    for measured in problem["measured"]:
        measured["noise"] = {"absolute": residuals[measured["output"]]}
    return problem


def scale_noise(problem, factor):
    problem = copy.deepcopy(problem)
    for measured in problem["measured"]:
        measured["noise"]["absolute"] *= factor
    return problem


def free_initial_state(problem, ranges):
    """Makes the initial state uncertain, over these ranges, whatever it was before."""
    problem = copy.deepcopy(problem)
    for name, (lower, upper) in ranges.items():
        problem.get("fixed", {}).pop(name, None)
        known = [parameter for parameter in problem["uncertain"] if parameter["name"] == name]
        if not known:
            problem["uncertain"].append({"name": name})
            known = problem["uncertain"][-1:]
        known[0]["uniform"] = {"lower": lower, "upper": upper}
    return problem


def read_rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write_rows(path, rows):
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def is_streamed(problem):
    return any("streamed" in signal for signal in problem.get("inputs", []))


def thin(rows, step, problem):
    """Returns the rows with samples in every step-th only, and streamed inputs in all."""
    if not is_streamed(problem):
        return rows[::step]
    without = {measured["output"]: "" for measured in problem["measured"]}
    return [row if i % step == 0 else row | without for i, row in enumerate(rows)]


def second_half(rows):
    """Returns the second half of the rows, its time and its runs counted from its first row."""
    rows = rows[len(rows) // 2:]
    start, run = float(rows[0]["t"]), rows[0].get("run")
    shifted = []
    for row in rows:
        row = dict(row)
        if row.get("run") == run:
            row["t"] = repr(float(row["t"]) - start)
        if run is not None:
            row["run"] = int(row["run"]) - int(run)
        shifted.append(row)
    return shifted


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Estimator:
    """Asks the command, and keeps problems, data and answers in a folder."""

    def __init__(self, polyest, work):
        self.polyest, self.work = polyest, work

    def __call__(self, name, problem, rows):
        """Returns the answer and its CPU seconds; without an answer, the reason and the seconds."""
        files = [self.work / f"{name}.json", self.work / f"{name}.csv"]
        files[0].write_text(json.dumps(problem, indent=1))
        write_rows(files[1], rows)
        before = cpu_seconds()
        command = [self.polyest, "estimate", *map(str, files), "--local", "--format", "json"]
        try:
            run = subprocess.run(command, capture_output=True, text=True, timeout=WALL_SECONDS)
        except subprocess.TimeoutExpired:
            return f"no answer in {WALL_SECONDS} s", cpu_seconds() - before
        if run.returncode != 0:
            return (run.stderr.strip().splitlines() or [f"exit status {run.returncode}"])[-1], cpu_seconds() - before
        (self.work / f"{name}.answer.json").write_text(run.stdout)
        return json.loads(run.stdout), cpu_seconds() - before


def codes(answer):
    return {diagnostic["code"] for diagnostic in answer["diagnostics"]}


def by_name(answer):
    return {parameter["name"]: parameter for parameter in answer["parameters"]}


def middle(parameter):
    return (float(parameter["upper95"]) + float(parameter["lower95"])) / 2


def half_width(parameter):
    return (float(parameter["upper95"]) - float(parameter["lower95"])) / 2


def ratio(distance, scale):
    """Returns the distance in units of the scale; infinity, which no check passes, if either is no number."""
    return distance / scale if scale > 0 and distance < float("inf") else float("inf")


def worst(deviations):
    """Returns the largest of deviations by name, with its name."""
    name = max(deviations, key=lambda key: deviations[key])
    return deviations[name], name


def judge_noise(reference, answer, factor):
    """Returns the largest shift of an estimate with the noise, its parameter, the limit, and an excuse."""
    shifts = {}
    for name, parameter in by_name(answer).items():
        known = by_name(reference)[name]
        sd = float(known["robustStdDev"]) or float(known["stdDev"])
        if factor > 1:
            sd = max(sd, float(parameter["stdDev"]))
        for key in ("map", "mean") if factor <= 1 else ("map",):
            shifts[f"{name}.{key}"] = ratio(abs(float(parameter[key]) - float(known[key])), sd)
    return *worst(shifts), NOISE_LIMIT, ", ".join(sorted(codes(answer) & NOT_TO_BE_BELIEVED))


def judge_thinned(whole, thinned):
    """Returns how far from the middle of the thinned record's interval a mean is, of which parameter, the
    limit, and an excuse."""
    shifts = {}
    for name, parameter in by_name(thinned).items():
        distance = abs(float(by_name(whole)[name]["mean"]) - middle(parameter))
        shifts[name] = ratio(distance, half_width(parameter))
    normal = statistics.NormalDist()
    return *worst(shifts), normal.inv_cdf(1 - 0.025 / len(shifts)) / normal.inv_cdf(0.975), None


def judge_halves(whole, first, second, initial):
    """Returns the largest distance of the halves' intervals, its parameter, the limit, and an excuse.
    `initial` has the names that the halves do not share."""
    shifts = {}
    for name, parameter in by_name(second).items():
        if name.partition("[")[0] not in initial:
            other = by_name(first)[name]
            shifts[name] = ratio(abs(middle(parameter) - middle(other)), half_width(parameter) + half_width(other))
    return *worst(shifts), 1, ", ".join(sorted(codes(whole) & ADMITTED))


def verdict(deviation, limit, excuse):
    if deviation <= limit:
        return "passed"
    return "passed: " + excuse if excuse else MISSED


class Table:
    """Prints a row for each check and collects what is missed."""

    def __init__(self):
        self.missed = []
        print("| record | check | worst deviation | limit | trajectories | CPU s | verdict | diagnostics |")
        print("|---|---|---|---|---|---|---|---|")

    def add(self, record, check, answers, judge):
        """Adds a row. `answers` are pairs of an answer, or the reason why there is none, and CPU seconds."""
        seconds = sum(pair[1] for pair in answers)
        reasons = [answer for answer, _ in answers if isinstance(answer, str)]
        if reasons:
            self.add_row(record, check, ["", "", "", f"{seconds:.1f}", MISSED, reasons[0][:200]])
            return
        deviation, name, limit, excuse = judge(*(answer for answer, _ in answers))
        trajectories = sum(int(answer["expansion"]["trajectories"]) for answer, _ in answers)
        found = ", ".join(sorted(set().union(*(codes(answer) for answer, _ in answers))))
        self.add_row(record, check, [f"{deviation:.3g} of `{name}`", f"{limit:.3g}", str(trajectories),
                                     f"{seconds:.1f}", verdict(deviation, limit, excuse), found])

    def add_row(self, record, check, cells):
        print("| " + " | ".join([f"`{record}`", check, *cells]) + " |", flush=True)
        if MISSED in cells:
            self.missed.append(f"{record}, {check}")


def check_record(record, data, estimate, table):
    folder = EXAMPLES if (EXAMPLES / record.data).exists() else data
    rows = read_rows(folder / record.data)
    problem = flatten(json.loads(record.problem.read_text()), record.residuals)
    whole = estimate(f"{record.name}.whole", problem, rows)
    if isinstance(whole[0], str):
        table.add(record.name, "whole", [whole], None)
        return
    for factor in FACTORS:
        name = f"{record.name}.noise_{factor}"
        scaled = whole if factor == 1 else estimate(name, scale_noise(problem, factor), rows)
        table.add(record.name, f"noise {factor}", [scaled],
                  lambda answer: judge_noise(whole[0], answer, factor))
    for step in THINNINGS:
        thinned = estimate(f"{record.name}.thinned_{step}", problem, thin(rows, step, problem))
        table.add(record.name, f"thinned by {step}", [thinned],
                  lambda answer: judge_thinned(whole[0], answer))
    if record.second:
        first = estimate(f"{record.name}.first", problem, rows[:len(rows) // 2])
        second = estimate(f"{record.name}.second", free_initial_state(problem, record.second),
                          second_half(rows))
        table.add(record.name, "halves", [first, second],
                  lambda one, other: judge_halves(whole[0], one, other, record.second))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("polyest")
    parser.add_argument("work", type=Path)
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("records", nargs="*")
    arguments = parser.parse_intermixed_args()
    if not arguments.data.is_dir():
        print(f"skipped: there is no {arguments.data}")
        return SKIPPED
    unknown = set(arguments.records) - {record.name for record in RECORDS}
    if unknown:
        parser.error(f"unknown record {', '.join(sorted(unknown))}; there are "
                     + ", ".join(record.name for record in RECORDS))
    arguments.work.mkdir(parents=True, exist_ok=True)
    table = Table()
    for record in RECORDS:
        if not arguments.records or record.name in arguments.records:
            check_record(record, arguments.data, Estimator(arguments.polyest, arguments.work), table)
    for missed in table.missed:
        print("missed: " + missed, file=sys.stderr)
    return 1 if table.missed else 0


if __name__ == "__main__":
    sys.exit(main())
