"""Starts a daemon on this machine and ends it."""

from __future__ import annotations

import os
import shutil
import signal
import stat
import subprocess
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Optional, Union

from polyest.errors import Unavailable

_READY = "listening on "


def find_program(given: Union[str, os.PathLike[str], None]) -> str:
    """Returns the path of `polyestd`.

    It is the given one, else that of the environment variable POLYEST_DAEMON, else the one in PATH,
    else the newest one that was built in the checkout around the package or the working folder, if
    that is the user's own.
    Raises Unavailable.
    """
    named = given or os.environ.get("POLYEST_DAEMON")
    if named:
        found = shutil.which(os.fspath(named))
        if found is None:
            raise Unavailable(f"{os.fspath(named)} is no program")
        return found
    found = shutil.which("polyestd")
    if found is not None:
        return found
    built = [program for place in (Path(__file__).resolve(), Path.cwd() / "here")
             for folder in place.parents if _is_own_checkout(folder)
             for program in folder.glob("build/*/bin/polyestd")
             if os.access(program, os.X_OK)]
    if not built:
        raise Unavailable("polyestd is not installed: it is in the package polyest; or give its "
                          "path with daemon=… or in the environment variable POLYEST_DAEMON")
    return str(max(built, key=lambda program: program.stat().st_mtime))


def _is_own_checkout(folder: Path) -> bool:
    """Whether it is a checkout of polyest in which nobody else may have put a program."""
    if not (folder / "proto" / "polyest").is_dir():
        return False
    status = folder.stat()
    return status.st_uid in (0, os.getuid()) and not status.st_mode & stat.S_IWOTH


class Daemon:
    """A `polyestd` that this program has started.

    A shell between the two ends it when this program ends, even if that is killed: the shell then
    reads the end of its input.
    """

    def __init__(self, program: str, data_dir: Union[str, os.PathLike[str], None],
                 listen: str, arguments: Sequence[str]) -> None:
        """Starts it and waits until it is ready. Raises Unavailable with its last words."""
        self._log: IO[bytes] = tempfile.TemporaryFile(prefix="polyestd-")  # noqa: SIM115
        where = (["--durability", "memory"] if data_dir is None
                 else ["--data-dir", os.fspath(data_dir)])
        self._shell = subprocess.Popen(
            ["/bin/sh", "-c", _GUARD, "sh", program, "--listen", listen, *where, *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log,
            start_new_session=True)
        self._end = weakref.finalize(self, _stop, self._shell, self._log)
        assert self._shell.stdout is not None
        #: The number of its process.
        self.pid = int(self._shell.stdout.readline())
        line = self._shell.stdout.readline().decode()
        if not line.startswith(_READY):
            said = self.log().strip().splitlines()
            self._end()
            raise Unavailable(f"{program} did not start: {said[-1] if said else 'it said nothing'}")
        #: HOST:PORT at which it listens.
        self.address: str = line[len(_READY):].strip()

    def log(self) -> str:
        """Returns what it has logged so far."""
        # The daemon writes at the position that it shares with this program, which must stay.
        log = self._log.fileno()
        return os.pread(log, os.fstat(log).st_size, 0).decode(errors="replace")

    def stop(self) -> None:
        """Ends it in order: open calls may finish."""
        self._end()

    def kill(self) -> None:
        """Ends it at once, as a power cut would."""
        if self._end.alive:
            os.kill(self.pid, signal.SIGKILL)
        self._end()


# Prints the daemon's number and starts it; at the end of the input, ends it and waits.
_GUARD = """sh -c 'echo $$; exec "$@"' sh "$@" </dev/null &
exec >&-
read -r _
kill $! 2>/dev/null
wait $!"""


def _stop(shell: subprocess.Popen[bytes], log: IO[bytes]) -> None:
    assert shell.stdin is not None and shell.stdout is not None
    shell.stdin.close()
    try:
        shell.wait(timeout=20)
    except subprocess.TimeoutExpired:
        os.killpg(shell.pid, signal.SIGKILL)
        shell.wait()
    shell.stdout.close()
    log.close()


def start(daemon: Union[str, os.PathLike[str], None] = None,
          data_dir: Optional[Union[str, os.PathLike[str]]] = None, listen: str = "127.0.0.1:0",
          arguments: Sequence[str] = ()) -> Daemon:
    """Starts a daemon; see `polyest.local`."""
    return Daemon(find_program(daemon), data_dir, listen, arguments)
