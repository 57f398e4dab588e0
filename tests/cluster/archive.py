#!/usr/bin/env python3
"""Brings a database back to a point in time from an archive by pgBackRest, as deploy/cluster/README.md says.

    archive.py POLYESTD POLYEST

A rig streams to a daemon, and the time is noted. Then its session is deleted, and another rig streams. The
database is lost and restored to that time. Asks that the first session is back with its estimate to the
last bit, that the second one is gone, and that a daemon takes new ones.

Exit status 77: PostgreSQL or pgBackRest is not installed.
"""

import argparse
import contextlib
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from cluster import Database, Node, write_secret

EXAMPLE = pathlib.Path(__file__).resolve().parents[2] / "client" / "examples" / "oscillator"
PATIENCE_S = 120.0


class ArchivedDatabase(Database):
    """A server whose log goes to an archive in the same folder."""

    def __init__(self, folder):
        self.configuration = folder / "pgbackrest.conf"
        repository, spool = folder / "repository", folder / "spool"
        for own in (repository, spool):
            own.mkdir()
            self.give(own)
        self.configuration.write_text(
            f"[global]\nrepo1-path={repository}\nrepo1-retention-full=2\nlog-level-file=off\n"
            f"log-level-console=off\nlog-level-stderr=warn\nlock-path={spool}\nstart-fast=y\n"
            f"spool-path={spool}\n"
            f"[polyest]\npg1-path={folder / 'database' / 'data'}\npg1-socket-path={folder / 'database'}\n"
            "pg1-user=polyest\npg1-database=polyest\n", encoding="ascii")
        super().__init__(folder)
        self.back_up("stanza-create")
        self.back_up("backup")

    def options(self):
        return (super().options() + " -c archive_mode=on -c 'archive_command=pgbackrest --config "
                f"{self.configuration} --stanza polyest archive-push %p'")

    def back_up(self, *arguments):
        self.run_as_server(["pgbackrest", "--config", self.configuration, "--stanza", "polyest",
                            *arguments])

    def restore(self, moment):
        """Loses the data, and restores them as they were at a time."""
        shutil.rmtree(self.folder / "data")
        (self.folder / "data").mkdir(mode=0o700)
        self.give(self.folder / "data")
        self.back_up("--type=time", f"--target={moment}", "--target-action=promote", "restore")
        self.start()
        # The server answers queries before it has come to that time, and takes no writes until then.
        end = time.monotonic() + PATIENCE_S
        while self.ask("SELECT pg_is_in_recovery()") == "t":
            if time.monotonic() > end:
                raise RuntimeError("the database does not come to the time")
            time.sleep(0.1)


class Client:
    """Calls a daemon as an engineer does."""

    def __init__(self, polyest, node):
        self.polyest, self.server = polyest, f"127.0.0.1:{node.port}"

    def run(self, *arguments):
        done = subprocess.run([self.polyest, *arguments, "--server", self.server], text=True,
                              capture_output=True, check=False)
        if done.returncode != 0:
            raise RuntimeError(f"polyest {' '.join(arguments)}: {done.stderr}")
        return done.stdout

    def stream(self, session):
        self.run("stream", f"{EXAMPLE}.json", f"{EXAMPLE}.csv", "--session", session)

    def estimate(self, session):
        return self.run("watch", session, "--once", "--format", "jsonl")


def run(arguments, folder, stack):
    database = ArchivedDatabase(folder)
    stack.callback(database.close)
    write_secret(folder)
    node = Node(1, arguments.polyestd, folder, database)
    stack.callback(node.kill)
    before = Client(arguments.polyest, node)
    before.stream("first")
    estimate = before.estimate("first")
    target = database.ask("SELECT now()")
    before.run("delete", "first")
    before.stream("second")
    node.kill()
    database.back_up("check")  # that the log is in the archive
    database.stop()
    database.restore(target)
    node.start()
    after = Client(arguments.polyest, node)
    problems = []
    if "second" in after.run("list"):
        problems.append("the session that is younger than the time is there")
    if after.estimate("first") != estimate:
        problems.append("the estimate is another one")
    after.stream("second")
    return problems


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("polyestd")
    parser.add_argument("polyest")
    arguments = parser.parse_args()
    if shutil.which("pgbackrest") is None:
        print("skipped: pgBackRest is not installed")
        sys.exit(77)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        folder = pathlib.Path(name)
        try:
            problems = run(arguments, folder, stack)
        except subprocess.CalledProcessError:
            if (log := folder / "database" / "log").exists():
                print(log.read_text(encoding="utf-8")[-2000:], file=sys.stderr)
            raise
    for problem in problems:
        print(f"failed: {problem}")
    if problems:
        sys.exit(1)
    print(f"the database is back at the time asked for, after {time.monotonic() - began:.0f} s in all: the "
          "deleted session has its estimate bit for bit, and the later one is gone")


if __name__ == "__main__":
    main()
