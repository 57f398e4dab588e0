#!/usr/bin/env python3
"""Draws where `polyest estimate` spends its time: flame graphs, in SVG.

    flame_graphs.py POLYEST FOLDER [--only NAME]... [--data FOLDER]

Draws the three slowest records of estimates_benchmark.py, or those that --only names. Needs Debian's
linux-perf and libdevel-nytprof-perl, and the kernel's leave (kernel.perf_event_paranoid ≤ 2).
"""

import argparse
import collections
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from estimates_benchmark import DATA, RECORDS, cpu_seconds, estimate

DRAW = "/usr/share/perl5/Devel/NYTProf/flamegraph.pl"
SLOWEST = 3
FREQUENCY_HZ = 297
STACK_BYTES = 65528  # of each sample, the most that perf takes: matrix products work on the stack


def run(command, text=None):
    try:
        done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        sys.exit(f"flame_graphs: {command[0]} is missing: install linux-perf and libdevel-nytprof-perl")
    if done.returncode != 0:
        sys.exit(f"flame_graphs: {command[0]}: {done.stderr.strip()}")
    return done.stdout


def name_of(symbol):
    """Leaves out namespaces of polyest, the arguments of functions and templates, and what follows."""
    name = symbol.replace("(anonymous namespace)::", "").replace("polyest::internal::", "")
    before = None
    while name != before:
        before, name = name, re.sub(r"<[^<>]*>|\([^()]*\)", "", name)
    name = re.sub(r"(\+0x[0-9a-f]+| const| \[clone .*\]|\.cold|\.part.*|\.isra.*)+$", "", name)
    return name.rsplit(" ", 1)[-1].replace("polyest::", "").replace(";", ":") or symbol


def folded(script):
    """Counts the stacks of `perf script`, which prints the innermost function first."""
    stacks, stack = collections.Counter(), []
    for line in script.splitlines() + [""]:
        words = line.split(None, 1)
        if len(words) == 2:
            end_is_cut = words[0] == "ffffffffffffffff"
            stack.append("deeper than 64 kB" if end_is_cut else name_of(words[1].rsplit(" (", 1)[0]))
        elif stack:
            stacks[";".join(reversed(stack))] += 1
            stack = []
    return "".join(f"{stack} {count}\n" for stack, count in sorted(stacks.items()))


def draw(polyest, name, data, folder):
    """Writes NAME.svg into the folder; does nothing without the record."""
    size, files = RECORDS[name]
    with tempfile.TemporaryDirectory() as work:
        found = files(pathlib.Path(work), data)
        if found is None:
            print(f"{name}: left out: {data} does not hold its record")
            return
        profile = str(pathlib.Path(work, "perf.data"))
        run(["perf", "record", "--freq", str(FREQUENCY_HZ), "--call-graph", f"dwarf,{STACK_BYTES}",
             "--output", profile, "--", *estimate(polyest, *found)])
        script = run(["perf", "script", "--no-inline", "--fields", "ip,sym,dso", "--input", profile])
    picture = run([DRAW, "--title", f"polyest estimate, {name}: {size}", "--width", "1400", "--minwidth",
                   "4", "--hash"], folded(script))
    path = folder / f"{name}.svg"
    path.write_text(picture, encoding="utf-8")
    print(path, flush=True)


def slowest(polyest, data):
    """Returns the names of the records whose estimates take longest."""
    seconds = {}
    for name, (_, files) in RECORDS.items():
        with tempfile.TemporaryDirectory() as work:
            found = files(pathlib.Path(work), data)
            if found is not None:
                seconds[name] = cpu_seconds(estimate(polyest, *found))[0]
    return sorted(seconds, key=seconds.get)[-SLOWEST:]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("polyest", metavar="POLYEST")
    parser.add_argument("folder", type=pathlib.Path, metavar="FOLDER", help="is made if it is missing")
    parser.add_argument("--only", action="append", choices=RECORDS, help="this record; may be repeated")
    parser.add_argument("--data", type=pathlib.Path, default=DATA,
                        help="the folder of measured records (../shared/data)")
    arguments = parser.parse_args()
    if shutil.which(arguments.polyest) is None:
        parser.error(f"{arguments.polyest} is no program")
    arguments.folder.mkdir(parents=True, exist_ok=True)
    for name in arguments.only or slowest(arguments.polyest, arguments.data):
        draw(arguments.polyest, name, arguments.data, arguments.folder)


if __name__ == "__main__":
    main()
