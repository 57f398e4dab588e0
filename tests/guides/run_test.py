#!/usr/bin/env python3
"""Gives run.py guides with one mistake each, which it must name: run_test.py SOURCE BIN"""
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

OSCILLATOR = "polyest estimate client/examples/oscillator.json client/examples/oscillator.csv"
PICTURE = "polyest regularization client/examples/oscillator.json client/examples/oscillator.csv"

# What a README.md says, and what must be said against it.
GUIDES = {
    "a command fails":
        ("# Title\n\n```sh\ntrue\nfalse\ntrue\n```\n", "README.md:5: exit status 1"),
    "a command is bad usage":
        ("```sh\npolyest estimat\n```\n", "README.md:2: exit status 2"),
    "a part of a pipeline fails":
        ("```sh\nfalse | cat\n```\n", "README.md:2: exit status 1"),
    "a command would change the machine":
        ("```sh\nsystemctl restart polyestd\n```\n",
         "README.md:2: exit status 126: systemctl is not for a test; fence the block ```console"),
    "a command prints something else":
        (f"```sh\n{OSCILLATOR} --format json | head -c 13\n```\n\n```output\n{{\"directions\n```\n",
         "README.md:6: the command printed instead"),
    "a command prints another number":
        ("```sh\necho k = 39.5\n```\n\n```output\nk = 39.8\n```\n",
         "README.md:6: the command printed instead"),
    "a program fails":
        ("```python\n# a.py\nraise SystemExit(3)\n```\n\n```sh\npython3 a.py\n```\n",
         "README.md:7: exit status 3"),
    "a block has no language":
        ("```\nfalse\n```\n", "README.md:2: fence the block ```sh or ```text"),
    "a problem is not valid":
        ('```json\n{"model": {"builtin": "none"}, "uncertain": []}\n```\n', "README.md:2: "),
    "a link leads nowhere":
        ("[a guide](none.md)\n", "README.md:1: none.md does not exist"),
    "a heading does not exist":
        ("# Title\n[here](#tittle)\n", "README.md:2: README.md has no heading #tittle"),
    "a picture is not drawn":
        ("![a picture](p.svg)\n", "README.md:1: no command of this guide draws p.svg"),
    "a picture is another one":
        (f"![a picture](p.svg)\n\n```sh\n{PICTURE} --plot p.svg\n```\n",
         "README.md:1: p.svg is not what the command draws"),
    "the first page is long":
        ("\n" * 181, "README.md: 181 lines; at most 180"),
}


def run(source, programs):
    return subprocess.run(
        [sys.executable, "-B", Path(__file__).with_name("run.py"), source, programs, "README.md"],
        text=True, capture_output=True, check=False)


def main():
    source, programs = sys.argv[1:3]
    failures = []
    for mistake, (guide, message) in GUIDES.items():
        with tempfile.TemporaryDirectory(prefix="polyest-guides-test-") as folder:
            shutil.copytree(Path(source) / "client/examples", Path(folder) / "client/examples")
            (Path(folder) / "proto/polyest").mkdir(parents=True)
            (Path(folder) / "deploy").mkdir()
            shutil.copy(Path(source) / "deploy/polyestd.toml", Path(folder) / "deploy")
            (Path(folder) / "p.svg").write_text("<svg></svg>\n")
            (Path(folder) / "README.md").write_text(guide)
            done = run(folder, programs)
            if done.returncode != 1 or message not in done.stderr:
                failures.append(f"{mistake}: exit status {done.returncode}; {done.stderr}")
    print("\n".join(failures) or "every mistake was named")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
