#!/usr/bin/env python3
"""Runs polyest on problems made to mislead it, and judges its answers by exact posteriors.

    run.py POLYEST WORK [--maker FOLDER] [--quick] [--list] [CASE...]

POLYEST is the command, WORK a folder for the cases, which is emptied before: a new one, an empty one, or one
that this script has made. The cases are made by make_cases.py of FOLDER, by default shared/adversary beside the
repository; without that folder nothing is run, and the exit status is 77.
--quick takes the cases that need seconds, --list prints the rows for the table of tests/README.md.

An answer is judged by the mean m and the standard deviation s of each parameter in the exact posterior:

    RIGHT   every mean is within 0.25 s of m and every standard deviation between 0.8 and 1.25 s
    HONEST  not right, but every 95 % interval reaches to within s of m and no standard deviation is below
            s/4; or a diagnostic says that the numbers are not to be believed
    SILENT  neither: wrong, and believed
    CRASH   no answer, an error of more than one line, or more than two minutes of computing

An answer of c08, whose model is wrong, without any diagnostic is SILENT as well.

Fails unless every case is RIGHT or HONEST, but for those in the table of tests/README.md, whose verdict
must be the one listed there: one that has become worse is a fault, and one that has become better is to be
struck off.
"""
import argparse
import json
import re
import resource
import shutil
import subprocess
import sys
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
MAKER = SOURCE.parent / "shared" / "adversary"
# Debian's numpy and scipy belong to Debian's Python, which need not be the first one.
DEBIAN_PYTHON = Path("/usr/bin/python3")
PYTHON = str(DEBIAN_PYTHON) if DEBIAN_PYTHON.exists() else sys.executable
SKIPPED = 77
MARK = ".made-by-run.py"  # a file in folders that may be emptied
CPU_SECONDS = 120
WALL_SECONDS = 1200  # of a machine that is busy with something else
GOOD = ("RIGHT", "HONEST")
ADMISSIONS = {"EXPANSION_INACCURATE", "NOT_CONVERGED", "POINTS_FAILED"}
WRONG_MODEL = {"c08_slow_drift"}
ROW = re.compile(r"^\| `(\w+)` \| (SILENT|CRASH) \|", re.M)

# The functions of make_cases.py whose cases take seconds, in which no two of a kind are alike.
QUICK = ("c07_relative_noise", "c09_picofarad", "c10_nanometres", "c11_burst_ar1", "c13_few_correlated",
         "c21_corr_prior", "c31_normal_tail")


def judge(case, answer, oracle):
    """Returns the verdict on an answer and a line that explains it."""
    off, ratios, missed = 0.0, [], []
    for parameter in answer["parameters"]:
        exact = oracle.get(parameter["name"])
        if exact is None:
            continue
        m, s = exact["mean"], exact["sd"]
        ratio = float(parameter["posteriorStdDev"]) / s
        gap = max(float(parameter["lower95"]) - m, m - float(parameter["upper95"])) / s
        off = max(off, abs(float(parameter["mean"]) - m) / s)
        ratios.append(ratio)
        if gap > 1 or ratio < 0.25:
            missed.append(parameter["name"])
    codes = {diagnostic["code"] for diagnostic in answer.get("diagnostics", [])}
    note = f"off {off:.3g} sd, sd ratio {min(ratios):.3g} to {max(ratios):.3g}; {', '.join(sorted(codes)) or 'no diagnostic'}"
    if case in WRONG_MODEL and not codes:
        return "SILENT", note
    if off < 0.25 and min(ratios) > 0.8 and max(ratios) < 1.25:
        return "RIGHT", note
    if not missed or codes & ADMISSIONS:
        return "HONEST", note
    return "SILENT", note + "; missed " + ", ".join(missed[:4])


def complaint(case, verdict, known):
    """Returns what is wrong with a verdict, or nothing. `known` has the verdicts of the table."""
    listed = known.get(case)
    if listed == verdict or (listed is None and verdict in GOOD):
        return None
    if listed is None:
        return f"{case} is {verdict}"
    if verdict == "CRASH":
        return f"{case} is CRASH; it was {listed}"
    return f"{case} is {verdict} and no longer {listed}: bring the table of tests/README.md up to date"


def limit_time():
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 5))


def estimate(polyest, folder):
    """Returns the answer, or None and why there is none."""
    command = [polyest, "estimate", str(folder / "problem.json"), str(folder / "data.csv"), "--local",
               "--format", "json"]
    try:
        run = subprocess.run(command, capture_output=True, text=True, preexec_fn=limit_time,
                             timeout=WALL_SECONDS)
    except subprocess.TimeoutExpired:
        return None, f"no answer in {WALL_SECONDS} s"
    if run.returncode < 0:
        return None, f"ended by signal {-run.returncode}"
    if run.returncode > 0:
        return None, (run.stderr.strip().splitlines() or ["no message"])[-1][:160]
    return json.loads(run.stdout), ""


def make_cases(maker, work, makers):
    """Makes the cases of these functions of make_cases.py, or all; returns their folders."""
    mark = work / MARK
    if work.is_dir() and any(work.iterdir()) and not mark.exists():
        sys.exit(f"{work}: must be new, empty, or a folder that this script has made; it is left as it is")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    mark.touch()
    # The cases are written beside the script.
    for name in ("make_cases.py", "lib.py"):
        shutil.copy(maker / name, work)
    subprocess.run([PYTHON, "make_cases.py", *makers], cwd=work, check=True,
                   stdout=subprocess.DEVNULL)
    if not makers:
        for ready in maker.glob("*/oracle.json"):
            shutil.copytree(ready.parent, work / ready.parent.name, dirs_exist_ok=True)
    return sorted(path.parent for path in work.glob("*/oracle.json"))


def known_verdicts():
    return dict(ROW.findall((SOURCE / "tests" / "README.md").read_text()))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("polyest")
    parser.add_argument("work", type=Path)
    parser.add_argument("--maker", type=Path, default=MAKER)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("cases", nargs="*")
    arguments = parser.parse_args()
    if not arguments.maker.is_dir():
        print(f"skipped: there is no {arguments.maker}")
        return SKIPPED
    known, complaints, count = known_verdicts(), [], {}
    makers = arguments.cases or (QUICK if arguments.quick else ())
    for folder in make_cases(arguments.maker, arguments.work, makers):
        oracle = json.loads((folder / "oracle.json").read_text())["oracle"]
        answer, reason = estimate(arguments.polyest, folder)
        verdict, note = judge(folder.name, answer, oracle) if answer else ("CRASH", reason)
        count[verdict] = count.get(verdict, 0) + 1
        if not arguments.list:
            print(f"{folder.name:24} {verdict:7} {note}", flush=True)
        elif verdict not in GOOD:
            print(f"| `{folder.name}` | {verdict} | {note} |", flush=True)
        if wrong := complaint(folder.name, verdict, known):
            complaints.append(wrong)
    print(", ".join(f"{name} {count.get(name, 0)}" for name in ("RIGHT", "HONEST", "SILENT", "CRASH")))
    for wrong in complaints:
        print(wrong, file=sys.stderr)
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
