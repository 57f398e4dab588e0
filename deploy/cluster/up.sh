#!/usr/bin/env bash
# Starts a cluster on this machine, to be tried: a PostgreSQL database with a synchronous standby, three
# daemons that share it, haproxy in front of them, and ten rigs that stream through it. Nothing listens
# beyond loopback.
#
#   deploy/cluster/up.sh [FOLDER]        FOLDER is new; by default /tmp/polyest-cluster
#
# POLYESTD and POLYEST name the programs (by default those in the PATH), PORT haproxy's port (50050).
set -Eeuo pipefail

here=$(cd "$(dirname "$0")" && pwd)
. "$here/common.sh"
examples=$here/../../client/examples
polyestd=${POLYESTD:-polyestd}
polyest=${POLYEST:-polyest}
port=${PORT:-50050}

for program in "$polyestd" "$polyest" haproxy "$postgresql/initdb"; do
  command -v "$program" >/dev/null || { echo "up.sh: there is no program $program" >&2; exit 1; }
done
if ! mkdir "$cluster" 2>/dev/null; then
  echo "up.sh: $cluster cannot be made; if a cluster is there, deploy/cluster/down.sh ends it" >&2
  exit 1
fi
trap 'echo "up.sh: not all has started; deploy/cluster/down.sh $cluster ends what has" >&2' ERR

# Starts a program whose process down.sh ends: start NAME COMMAND …
start() {
  local name=$1
  shift
  "$@" >"$cluster/$name.out" 2>"$cluster/$name.err" &
  echo $! >>"$cluster/processes"
}

# Waits until a command succeeds, at most 30 s: await COMMAND …
await() {
  timeout 30 sh -c 'until "$@" >/dev/null 2>&1; do sleep 0.1; done' await "$@"
}

# The servers of PostgreSQL, each in a folder with its socket.
run_server() {
  as_postgres pg_ctl --pgdata "$cluster/database/$1/data" --log "$cluster/database/$1/log" --wait \
    --options "-c listen_addresses= -c unix_socket_directories=$cluster/database/$1 -c cluster_name=$1" \
    start >/dev/null
}
mkdir -p "$cluster/database/primary" "$cluster/database/standby"
if [ "$(id -u)" = 0 ]; then chown -R postgres: "$cluster/database"; fi
as_postgres initdb --pgdata "$cluster/database/primary/data" --auth trust --username polyest \
  --encoding UTF8 --data-checksums >/dev/null
run_server primary
as_postgres createdb --host "$cluster/database/primary" --username polyest polyest
as_postgres pg_basebackup --host "$cluster/database/primary" --username polyest --checkpoint fast \
  --pgdata "$cluster/database/standby/data" --write-recovery-conf
run_server standby
as_postgres psql --quiet --host "$cluster/database/primary" --username polyest polyest \
  --command "ALTER SYSTEM SET synchronous_standby_names = 'standby'" \
  --command "SELECT pg_reload_conf()" >/dev/null
database="postgresql:///polyest?host=$cluster/database/primary,$cluster/database/standby&user=polyest"

# The daemons, and haproxy, which knows nothing of sessions.
umask 077
openssl rand -hex 32 >"$cluster/node.secret"
cat >"$cluster/haproxy.cfg" <<END
defaults
  mode tcp
  timeout connect 5s
  timeout client 1h
  timeout server 1h
listen polyest
  bind 127.0.0.1:$port
  balance roundrobin
END
for node in 1 2 3; do
  start "node$node" "$polyestd" --listen 127.0.0.1:0 --journal "$database" \
    --node-secret "$cluster/node.secret"
  await grep -q "listening on" "$cluster/node$node.out"
  address=$(sed -n 's/^listening on //p' "$cluster/node$node.out")
  echo "  server node$node $address check inter 500ms" >>"$cluster/haproxy.cfg"
done
start haproxy haproxy -db -f "$cluster/haproxy.cfg"
await "$polyest" nodes --server "127.0.0.1:$port"

# The rigs, whose recording of 50 s takes five minutes.
for rig in 1 2 3 4 5 6 7 8 9 10; do
  start "rig$rig" "$polyest" stream "$examples/oscillator.json" "$examples/oscillator.csv" \
    --server "127.0.0.1:$port" --session "rig-$rig" --rate 0.16 --batch 5 --format jsonl
done
for rig in 1 2 3 4 5 6 7 8 9 10; do await grep -q parameters "$cluster/rig$rig.out"; done

"$polyest" nodes --server "127.0.0.1:$port"
