#!/usr/bin/env bash
# Goes from a fresh checkout to an estimate: installs the packages, builds, starts the daemon on a
# free port of this machine, streams the demo record to it in batches, and stops the daemon again.
# Its exit status is that of the stream.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
bin="$root/build/release/bin"
examples="$root/client/examples"
daemon_pid=""
data=""

say() { echo "==> $*" >&2; }

stop_daemon() {
  local status=$?
  trap - EXIT
  if [[ -n "$daemon_pid" ]] && kill -TERM "$daemon_pid" 2>/dev/null; then
    say "stopping the daemon"
    for _ in {1..100}; do
      kill -0 "$daemon_pid" 2>/dev/null || break
      sleep 0.1
    done
    kill -KILL "$daemon_pid" 2>/dev/null || true
  fi
  [[ -z "$data" ]] || rm -rf "$data"
  exit "$status"
}

build() {
  say "installing packages that are missing"
  "$root/deploy/install-packages.sh"
  say "building into build/release (the first time takes some minutes)"
  cd "$root"
  cmake --preset release -DPOLYEST_BUILD_TESTS=OFF >&2
  cmake --build --preset release --parallel "$(nproc)" --target polyestd polyest >&2
}

# Sets daemon_pid and server.
start_daemon() {
  local line
  say "starting the daemon"
  data="$(mktemp --directory)"
  exec {daemon_output}< <(exec "$bin/polyestd" --listen 127.0.0.1:0 --data-dir "$data")
  daemon_pid=$!
  while read -r -t 30 -u "$daemon_output" line; do
    if [[ "$line" =~ listening\ on\ ([^[:space:]]+:[0-9]+) ]]; then
      server="${BASH_REMATCH[1]}"
      say "the daemon listens on $server"
      return
    fi
  done
  say "the daemon did not start"
  return 1
}

trap stop_daemon EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM

build
start_daemon
say "streaming the demo record, 50 rows a batch: see the estimate tighten"
"$bin/polyest" stream "$examples/oscillator.json" "$examples/oscillator.csv" \
  --server "$server" --batch 50
