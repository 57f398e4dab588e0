"""A cluster to be tried: PostgreSQL in a folder, and daemons that share it, behind proxies."""

import contextlib
import os
import pathlib
import re
import shutil
import subprocess
import sys

from proxy import Proxy


class Database:
    """A PostgreSQL server that listens at a socket in a folder of its own."""

    def __init__(self, folder):
        found = sorted(pathlib.Path("/usr/lib/postgresql").glob("*/bin"))
        if not found:
            print("skipped: PostgreSQL is not installed")
            sys.exit(77)
        self.bin, self.folder = found[-1], folder / "database"
        self.folder.mkdir()
        if os.getuid() == 0:
            folder.chmod(0o755)
        self.give(self.folder)
        self.socket = str(self.folder / ".s.PGSQL.5432")
        self._run("initdb", "--pgdata", self.folder / "data", "--auth", "trust", "--username", "polyest",
                  "--encoding", "UTF8")
        self.start()
        self._run("createdb", "--host", self.folder, "--username", "polyest", "polyest")

    def _run(self, program, *arguments):
        self.run_as_server([self.bin / program, *arguments])

    @staticmethod
    def run_as_server(command):
        """Runs a command as the user that the server runs as, which is not root."""
        command = [str(part) for part in command]
        if os.getuid() == 0:
            command = ["runuser", "-u", "postgres", "--", *command]
        subprocess.run(command, check=True, cwd="/", stdout=subprocess.DEVNULL)

    @staticmethod
    def give(path):
        """Makes the user that the server runs as the owner of a folder."""
        if os.getuid() == 0:
            shutil.chown(path, "postgres")

    def options(self):
        return f"-c listen_addresses= -c unix_socket_directories={self.folder}"

    def start(self):
        self._run("pg_ctl", "--pgdata", self.folder / "data", "--log", self.folder / "log", "--wait",
                  "--options", self.options(), "start")

    def ask(self, query):
        """Returns the only value that a query gives, as text."""
        answer = subprocess.run(
            [str(self.bin / "psql"), "--host", str(self.folder), "--username", "polyest", "--tuples-only",
             "--no-align", "--command", query, "polyest"], check=True, capture_output=True, text=True)
        return answer.stdout.strip()

    def stop(self):
        self._run("pg_ctl", "--pgdata", self.folder / "data", "--mode", "immediate", "stop")

    def close(self):
        """Stops the server if it runs."""
        with contextlib.suppress(subprocess.CalledProcessError):
            self.stop()

    def processes(self):
        """Returns the ids of the server's processes, the main one first."""
        main = int((self.folder / "data" / "postmaster.pid").read_text().split()[0])
        children = []
        for status in pathlib.Path("/proc").glob("[0-9]*/stat"):
            with contextlib.suppress(OSError):
                parent = status.read_text().rpartition(")")[2].split()[1]
                if int(parent) == main:
                    children.append(int(status.parent.name))
        return [main, *children]


class Node:
    """A daemon, which reaches the database at its socket, and others directly."""

    def __init__(self, number, polyestd, folder, database):
        self.number, self.polyestd, self.folder, self.database = number, polyestd, folder, database
        self.port = None
        self.start()

    def places(self):
        """Returns the options that say where the database and this daemon are."""
        return ["--journal", f"postgresql:///polyest?host={self.database.folder}&user=polyest"]

    def start(self):
        with open(self.folder / f"node{self.number}.log", "ab") as log:
            self.process = subprocess.Popen(
                [self.polyestd, "--listen", "127.0.0.1:0", *self.places(), "--node-secret",
                 str(self.folder / "secret")], stdout=subprocess.PIPE, stderr=log, text=True)
        line = self.process.stdout.readline()
        found = re.match(r"listening on 127\.0\.0\.1:(\d+)", line)
        if not found:
            log = (self.folder / f"node{self.number}.log").read_text(encoding="utf-8")
            raise RuntimeError(f"daemon {self.number} does not start: {log.splitlines()[-1:]}")
        self.port = int(found[1])

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


class ProxiedNode(Node):
    """A daemon that reaches the database, and that others reach, through proxies."""

    def __init__(self, number, polyestd, folder, database):
        self.to_database = Proxy(lambda: database.socket)
        self.from_nodes = Proxy(lambda: self.port)
        super().__init__(number, polyestd, folder, database)

    def places(self):
        return ["--journal", f"postgresql://polyest@127.0.0.1:{self.to_database.port}/polyest",
                "--advertise", f"127.0.0.1:{self.from_nodes.port}"]


def write_secret(folder):
    """Writes what the daemons of a folder believe each other by."""
    (folder / "secret").write_text("the-secret-of-these-daemons-and-of-no-others\n", encoding="ascii")
    (folder / "secret").chmod(0o600)
