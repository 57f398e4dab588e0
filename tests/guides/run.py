#!/usr/bin/env python3
"""Runs what the guides tell their readers to run: run.py SOURCE BIN [GUIDE...]

SOURCE is the repository, BIN the folder of polyest and polyestd; GUIDE is a path in SOURCE, all
Markdown files if none is given. Fails with "guide:line" when

  - a command of a block fenced ```sh fails (the blocks of a guide run in order, in one copy of the
    examples, from the top of the repository; `cd` holds until the end of the guide),
  - a block fenced ```python whose first line is "# FILE.py" is saved as that file for the blocks
    after it, and one of these fails,
  - a block fenced ```output is not what the ```sh block before it prints (numbers to a unit of their last
    digit),
  - a block is fenced otherwise, so that its commands would not be run,
  - a problem in a block fenced ```json is not one that `polyest check` accepts,
  - a picture of the program's is not what the commands of its guide draw,
  - a link within the repository leads nowhere,
  - the first page has more than 180 lines.

A block that names a measured record (../shared/data/*.csv beside the repository) is not run where the record
is not there, as is said.

Blocks fenced ```console need root, another machine, an hour or the tests' own programs; they are not
run, and are few.
deploy/runbook.md and deploy/cluster/README.md have tests of their own in tests/integration.
"""
import re
import sys
from pathlib import Path

from sandbox import Sandbox

MAX_FIRST_PAGE_LINES = 180
# 5 of them are of tests/README.md: a reader of the other guides does not build the programs of tests.
MAX_CONSOLE_BLOCKS = 12
NOT_COMMANDS = {"cmake", "cpp", "csv", "text", "toml"}
OWN_TEST = {"deploy/runbook.md", "deploy/cluster/README.md"}
SECONDS_PER_BLOCK = 300  # ends a command that hangs

# A program that the reader saves: its first line names the file.
PROGRAM = re.compile(r"# (\S+\.py)\n")
# Measured records that the repository does not have; a guide's reader downloads them.
RECORDS = re.compile(r"\b(?:air_track_[12]mass|mr_damper_0V|mr_damper_4_4|pendulum|silverbox_multisine)\.csv\b")
NUMBER = re.compile(r"[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
COLOR = re.compile(r"#[0-9a-f]{6}")
LETTERS = str.maketrans("0123456789", "ghijklmnop")
FENCE = re.compile(r"^\s*```(\w*)\s*$")
LINK = re.compile(r"(!?)\[[^\]]*\]\(([^)\s]+)\)")


class Failures(list):
    def add(self, place, what):
        self.append(f"{place}: {what}")
        print(self[-1], file=sys.stderr)


def blocks_of(text):
    """Yields (language, number of the first line, text) of each fenced block."""
    language, first, lines = None, 0, []
    for number, line in enumerate(text.splitlines(), 1):
        fence = FENCE.match(line)
        if language is None and fence:
            language, first, lines = fence[1], number + 1, []
        elif language is not None and fence:
            yield language, first, "\n".join(lines) + "\n"
            language = None
        elif language is not None:
            lines.append(line)


def without_blocks(text):
    """The text with the lines of fenced blocks and inline code made empty."""
    inside, kept = False, []
    for line in text.splitlines():
        fence = FENCE.match(line)
        kept.append("" if inside or fence else re.sub(r"`[^`]*`", "", line))
        inside = inside != bool(fence)
    return kept


def anchors_of(text):
    """GitHub's anchors of the headings."""
    headings = (line for line in text.splitlines() if line.startswith("#"))
    return {re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-")
            for line in headings}


# Processors round differently. From one kind to another that moved the estimates of filters, which
# searches and draws decide, by up to 0.43 %.
BETWEEN_PROCESSORS = 0.005


def same_number(expected, printed):
    """Whether two numbers differ by at most one unit of the last digit that the guide has, or by what
    processors differ by."""
    mantissa, _, exponent = expected.partition("e")
    last_digit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    expected, printed = (float(value.replace("−", "-")) for value in (expected, printed))
    return abs(expected - printed) <= max(1.01 * last_digit, BETWEEN_PROCESSORS * abs(expected))


def same_output(expected, printed):
    """Whether both have the same words; rounding differs with the processor."""
    texts = (expected, printed)
    words = [NUMBER.sub("#", text).split() for text in texts]
    return words[0] == words[1] and all(map(same_number, *map(NUMBER.findall, texts)))


def same_picture(committed, drawn):
    """Whether two SVGs have the same marks, to a tenth of a pixel or 0.01 % of a number."""
    def near(a, b):
        a, b = (float(value.replace("−", "-")) for value in (a, b))
        return abs(a - b) <= max(0.1, 1e-4 * abs(a))
    # A color such as #3e4989 is no number.
    pictures = [COLOR.sub(lambda color: color[0].translate(LETTERS), text)
                for text in (committed, drawn)]
    shapes = [NUMBER.sub("", text) for text in pictures]
    return shapes[0] == shapes[1] and all(map(near, *map(NUMBER.findall, pictures)))


def check_links(source, guide, failures):
    folder = (source / guide).parent
    for number, line in enumerate(without_blocks((source / guide).read_text()), 1):
        for _, target in LINK.findall(line):
            if "://" in target or target.startswith("mailto:"):
                continue
            path, _, anchor = target.partition("#")
            file = (folder / path) if path else source / guide
            if not file.exists():
                failures.add(f"{guide}:{number}", f"{target} does not exist")
            elif anchor and anchor not in anchors_of(file.read_text()):
                failures.add(f"{guide}:{number}", f"{path or guide} has no heading #{anchor}")


def check_pictures(source, guide, sandbox, failures):
    folder = (source / guide).parent
    for number, line in enumerate(without_blocks((source / guide).read_text()), 1):
        for picture, target in LINK.findall(line):
            if not picture or not target.endswith(".svg") or "://" in target:
                continue
            drawn = list(sandbox.root.rglob(Path(target).name))
            if not drawn:
                failures.add(f"{guide}:{number}", f"no command of this guide draws {target}")
            elif not same_picture((folder / target).read_text(), drawn[0].read_text()):
                failures.add(f"{guide}:{number}", f"{target} is not what the command draws")


def missing_records(source, block):
    """Returns the measured records that the block names and that are not there."""
    return [name for name in RECORDS.findall(block)
            if not (source.parent / "shared/data" / name).exists()]


def run_guide(source, programs, guide, failures):
    """Returns the number of blocks run and of those that are not."""
    text = (source / guide).read_text()
    run, console, printed = 0, 0, ""
    with Sandbox(source, programs) as sandbox:
        for language, line, block in blocks_of(text):
            if language == "console":
                console += 1
            elif language == "sh" and (missing := missing_records(source, block)):
                print(f"{guide}:{line}: not run: {', '.join(missing)} not in ../shared/data")
                printed = None
            elif language == "sh":
                status, printed, error = sandbox.run(guide, line, block, SECONDS_PER_BLOCK)
                run += 1
                if status != 0:
                    failures.add(sandbox.failed_at or f"{guide}:{line}",
                                 f"exit status {status}: {error.strip()[-600:]}")
            elif language == "python" and (program := PROGRAM.match(block)):
                sandbox.save(program[1], block)
            elif language == "output" and printed is not None and not same_output(block, printed):
                failures.add(f"{guide}:{line}", f"the command printed instead:\n{printed}")
            elif language == "json" and '"model"' in block and '"uncertain"' in block:
                error = sandbox.check_problem(block)
                if error:
                    failures.add(f"{guide}:{line}", error)
            elif language not in NOT_COMMANDS | {"json", "output", "python"}:
                failures.add(f"{guide}:{line}", f'fence the block ```sh or ```text, not "{language}"')
        check_pictures(source, guide, sandbox, failures)
    return run, console


def main():
    source, programs = (Path(argument).resolve() for argument in sys.argv[1:3])
    guides = sys.argv[3:] or sorted(
        str(file.relative_to(source)) for file in source.rglob("*.md")
        if not any(part in ("build", "node_modules") or part.startswith(".")
                   for part in file.relative_to(source).parts))
    failures, run, console = Failures(), 0, 0
    for guide in guides:
        check_links(source, guide, failures)
        if guide not in OWN_TEST:
            counts = run_guide(source, programs, guide, failures)
            run, console = run + counts[0], console + counts[1]
    lines = len((source / "README.md").read_text().splitlines())
    if lines > MAX_FIRST_PAGE_LINES:
        failures.add("README.md", f"{lines} lines; at most {MAX_FIRST_PAGE_LINES}")
    if console > MAX_CONSOLE_BLOCKS:
        failures.add("guides", f"{console} blocks are not run; at most {MAX_CONSOLE_BLOCKS}")
    if not sys.argv[3:] and run < 20:
        failures.add("guides", f"only {run} blocks to run: are they fenced ```sh?")
    print(f"guides: {len(guides)} files, {run} blocks run, {console} not run, "
          f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
