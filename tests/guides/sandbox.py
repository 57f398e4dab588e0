"""A copy of the examples in which the commands of a guide are run as a reader would type them."""
import os
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

# Scripts that build everything or run for an hour: that they are there and are bash is checked.
NOT_RUN = ("deploy/quickstart.sh", "deploy/package.sh", "deploy/install-packages.sh",
           "tests/run.sh", "tests/release.sh", "tests/fuzz/run.sh", "tests/threads/run.sh",
           ".ci/run")

# Programs that change the machine: a guide shows them in a block fenced ```console.
REFUSED = ("apt", "apt-get", "cmake", "dpkg", "install", "journalctl", "podman", "sudo", "systemctl",
           "systemd-sysusers", "useradd")

# Serves on free ports of the loopback interface, with sessions in the sandbox unless a guide names
# a folder, in the background, and returns when it is ready. Commands that do not serve are passed
# on.
POLYESTD = r"""#!/usr/bin/env bash
set -euo pipefail
for argument in "$@"; do
  case "$argument" in
    --new-token* | --version | --help | -h) exec "$PROGRAMS/polyestd" "$@" ;;
  esac
done
stop-daemon
arguments=(--listen 127.0.0.1:0 --metrics 127.0.0.1:0 --web 127.0.0.1:0)
[[ " $* " == *" --data-dir "* ]] || arguments+=(--data-dir "$ROOT/sessions")
serves_models=
[[ " $* " != *" --umbridge "* ]] || { serves_models=1; arguments+=(--umbridge 127.0.0.1:0); }
while (($#)); do
  case "$1" in
    --listen | --metrics | --web | --umbridge) shift ;;
    *) arguments+=("$1") ;;
  esac
  shift
done
rm -f "$ROOT/ready" && mkfifo "$ROOT/ready"
"$PROGRAMS/polyestd" "${arguments[@]}" >"$ROOT/ready" 2>>"$ROOT/log" </dev/null &
echo $! >"$ROOT/pid"
exec 3<"$ROOT/ready"
read -r line <&3 || { cat "$ROOT/log" >&2; exit 1; }
echo "${line#listening on }" >"$ROOT/address"
echo "$line"
read -r _ <&3 && read -r page <&3
sed 's|.*//||; s|/$||' <<<"$page" >"$ROOT/page"
[[ ! $serves_models ]] || sed --quiet '1{s|.*//||; s|/$||; p; q}' <&3 >"$ROOT/models"
"""

# Runs a program for which HOST:PORT is the daemon of the test, port 50051 the one that the guide has
# started.
CLIENT = r"""#!/usr/bin/env bash
set -euo pipefail
arguments=()
for argument in "$@"; do
  case "$argument" in
    HOST:PORT) argument=$SERVER ;;
    *:50051) argument=${argument%:*}:$(sed 's/.*://' "$ROOT/address") ;;
  esac
  arguments+=("$argument")
done
exec PROGRAM "${arguments[@]}"
"""

# Runs curl, for which localhost:8080 is the page of the daemon that the guide has started, and
# localhost:4242 its UM-Bridge models.
CURL = r"""#!/usr/bin/env bash
set -- "${@//localhost:8080/$(<"$ROOT/page")}"
[[ ! -e $ROOT/models ]] || set -- "${@//localhost:4242/$(<"$ROOT/models")}"
exec /usr/bin/curl "$@"
"""

STOP_DAEMON = r"""#!/usr/bin/env bash
[[ -e $ROOT/pid ]] || exit 0
kill "$(<"$ROOT/pid")" 2>/dev/null
tail --pid="$(<"$ROOT/pid")" --sleep-interval=0.02 --follow /dev/null
rm "$ROOT/pid"
"""

SCRIPT = r"""set -Eeuo pipefail
trap 'echo "$GUIDE:$LINENO" >"$ROOT/failed_at"' ERR
cd "$(<"$ROOT/folder")"
source "$BLOCK"
pwd >"$ROOT/folder"
"""


class Sandbox:
    def __init__(self, source, programs):
        self.root = Path(tempfile.mkdtemp(prefix="polyest-guides-"))
        self.source, self.programs = source, programs
        self.failed_at = ""
        checkout = self.root / "checkout"
        shutil.copytree(source / "client/examples", checkout / "client/examples")
        for record in (source.parent / "shared/data").glob("*.csv"):
            shutil.copy(record, checkout / "client/examples")
        shutil.copytree(source / "proto/polyest", checkout / "proto/polyest")
        (checkout / "deploy").mkdir()
        shutil.copy(source / "deploy/polyestd.toml", checkout / "deploy")
        self._programs(checkout / "build/release/bin")
        for name in NOT_RUN:
            self._write(checkout / name, f'#!/bin/bash\n[[ -x "{source}/{name}" ]] && '
                        f'bash -n "{source}/{name}"\n')
        (self.root / "folder").write_text(str(checkout))
        self.environment = dict(
            os.environ, ROOT=str(self.root), PROGRAMS=str(programs), HOME=str(self.root / "home"),
            PATH=f"{checkout}/build/release/bin:{os.environ['PATH']}", COLUMNS="120",
            BLOCK=str(self.root / "block"))
        for name in ("STATE_DIRECTORY", "XDG_STATE_HOME", "POLYEST_TOKEN"):
            self.environment.pop(name, None)

    def _write(self, file, text):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        file.chmod(0o755)

    def _programs(self, folder):
        self._write(folder / "polyestd", POLYESTD)
        self._write(folder / "polyest", CLIENT.replace("PROGRAM", '"$PROGRAMS/polyest"'))
        # The one that Debian's packages are for.
        self._write(folder / "python3", CLIENT.replace("PROGRAM", "/usr/bin/python3 -B"))
        self._write(folder / "curl", CURL)
        self._write(folder / "stop-daemon", STOP_DAEMON)
        for name in REFUSED:
            self._write(folder / name, f'#!/bin/bash\necho "{name} is not for a test; fence the block '
                        '\\`\\`\\`console" >&2\nexit 126\n')

    def __enter__(self):
        self.daemon = subprocess.Popen(
            [self.programs / "polyestd", "--listen", "127.0.0.1:0", "--data-dir",
             self.root / "shared"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            stdin=subprocess.DEVNULL, text=True)
        line = self.daemon.stdout.readline()
        self.environment["SERVER"] = line.removeprefix("listening on ").strip()
        return self

    def __exit__(self, *_):
        self.daemon.terminate()
        subprocess.run([self.root / "checkout/build/release/bin/stop-daemon"],
                       env=self.environment, check=False)
        self.daemon.wait()
        self.daemon.stdout.close()
        shutil.rmtree(self.root)

    def save(self, file, text):
        """Writes a file whose path is as seen from the folder that the commands run in."""
        self._write(Path((self.root / "folder").read_text().strip()) / file, text)

    def run(self, guide, line, block, seconds):
        """Returns the exit status and what is printed; failed_at is the guide and line."""
        # Lines of the file are those of the guide, so that bash's line numbers are.
        commands = block.replace(" &\n", "\n")
        (self.root / "block").write_text("\n" * (line - 1) + commands)
        failed_at = self.root / "failed_at"
        failed_at.unlink(missing_ok=True)
        process = subprocess.Popen(
            ["bash", "-c", SCRIPT], env=dict(self.environment, GUIDE=guide), text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            start_new_session=True)
        try:
            printed, error = process.communicate(timeout=seconds)
            status = process.returncode
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            printed, error = process.communicate()
            status, error = "none", f"not done in {seconds} s; {error}"
        self.failed_at = failed_at.read_text().strip() if failed_at.exists() else ""
        return status, printed, error

    def check_problem(self, text):
        """Returns what `polyest check` says against a problem, or nothing."""
        file = self.root / "problem.json"
        file.write_text(text)
        done = subprocess.run([self.programs / "polyest", "check", file], text=True,
                              capture_output=True, check=False)
        return done.stderr if done.returncode else ""
