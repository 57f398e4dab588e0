#!/usr/bin/env bash
# Carries out deploy/cluster/README.md in a folder and at a port of its own: run.sh SOURCE POLYESTD POLYEST.
# After each failure all rigs must go on: what is stored of each grows. Exits with 77 (skipped) where
# PostgreSQL or haproxy is not installed.
set -euo pipefail

source_folder=$1 polyest=$3
export POLYESTD=$2 POLYEST=$3
PORT=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
export PORT
command -v haproxy >/dev/null && ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 || exit 77

root=$(mktemp -d)
chmod 755 "$root"
cluster=$root/cluster
server=127.0.0.1:$PORT
fail() {
  echo "cluster: $*" >&2
  tail -n 5 "$cluster"/*.err >&2 || true
  exit 1
}
trap '"$source_folder/deploy/cluster/down.sh" "$cluster" >/dev/null 2>&1 || true; rm -rf "$root"' EXIT

nodes() { "$polyest" nodes --server "$server" --format json; }
# Prints "NAME SAMPLES" of each session; nothing while an answer fails.
samples() {
  "$polyest" list --server "$server" --format json 2>/dev/null | python3 -c '
import json, sys
for session in json.load(sys.stdin).get("sessions", []):
    print(session["name"], session.get("sampleCount", 0))' 2>/dev/null || true
}
# Waits until each of the ten sessions has more samples than in a list.
grow_beyond() {
  samples_before=$1 timeout 60 bash -c '
    while :; do
      grown=$(join <(sort <<<"$samples_before") <(samples | sort) | awk "\$3 > \$2" | wc -l)
      [[ "$grown" -lt 10 ]] || exit 0
    done' || fail "not all rigs went on after $2"
}
export -f samples
export polyest server

"$source_folder/deploy/cluster/up.sh" "$cluster" >"$root/up" || fail "it did not start"
[[ "$(grep -c serving "$root/up")" == 3 ]] || fail "$(cat "$root/up")"
processes=$(cat "$cluster/processes")

kill -KILL "$(sed -n 2p "$cluster/processes")"
grow_beyond "$(samples)" "a daemon died"

"$polyest" nodes drain 1 --server "$server" >/dev/null
timeout 30 bash -c 'until nodes=$("$polyest" nodes --server "$server" --format json) &&
    python3 -c "
import json, sys
sys.exit(any(n.get(\"draining\") and int(n.get(\"sessionCount\", 0)) for n in json.load(sys.stdin)[\"nodes\"])
         )" <<<"$nodes"; do :; done' || fail "the drained daemon kept sessions"
grow_beyond "$(samples)" "a daemon was drained"

. "$source_folder/deploy/cluster/common.sh" "$cluster"
as_postgres pg_ctl --pgdata "$cluster/database/primary/data" --mode immediate stop >/dev/null
as_postgres pg_ctl --pgdata "$cluster/database/standby/data" promote >/dev/null
stored=""
until [[ "$(wc -l <<<"$stored")" -ge 10 ]]; do stored=$(samples); done
grow_beyond "$stored" "the database failed over"

"$source_folder/deploy/cluster/down.sh" "$cluster" || fail "it did not end"
[[ ! -e "$cluster" ]] || fail "its folder is left"
for process in $processes; do
  ! kill -0 "$process" 2>/dev/null || fail "process $process is left"
done
echo "cluster: ten rigs went on after a kill, a drain and a failover"
