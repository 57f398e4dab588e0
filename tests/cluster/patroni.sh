#!/usr/bin/env bash
# Tries deploy/cluster/patroni.yml on this machine: etcd, three Patroni nodes, one of them a synchronous
# standby, and a daemon to which a rig streams while the primary is killed. Asks that Patroni promotes the standby,
# that the rig goes on by itself, and that its last estimate has all samples. Everything listens on
# loopback. Needs root, and the packages patroni, etcd-server and postgresql.
#
#   tests/cluster/patroni.sh POLYESTD POLYEST
#
# Exit status 77: a program is missing.
set -euo pipefail
polyestd=$(realpath "$1") polyest=$(realpath "$2")
source=$(cd "$(dirname "$0")/../.." && pwd)
bin=$(find /usr/lib/postgresql -maxdepth 2 -name bin 2>/dev/null | sort -V | tail -1)

for program in etcd patroni patronictl runuser openssl "$bin/postgres"; do
  if ! command -v "$program" >/dev/null; then
    echo "skipped: there is no $program"
    exit 77
  fi
done

folder=$(mktemp -d)
processes=()
cleanup() {
  local status=$?
  for process in "${processes[@]}"; do kill "$process" 2>/dev/null || true; done
  wait
  if [[ $status -ne 0 ]]; then tail -n 20 "$folder"/*.log >&2; fi
  rm -rf "$folder"
}
trap cleanup EXIT

start() {  # NAME COMMAND …
  local name=$1
  shift
  "$@" >"$folder/$name.out" 2>"$folder/$name.log" &
  processes+=("$!")
}
wait_for() {  # SECONDS COMMAND …
  local end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    if [[ $SECONDS -ge $end ]]; then
      echo "failed: waited in vain for: $*"
      return 1
    fi
    sleep 0.2
  done
}
free_port() {
  python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'
}

chmod 755 "$folder"
client=$(free_port) peer=$(free_port)
start etcd etcd --data-dir "$folder/etcd" --listen-client-urls "http://127.0.0.1:$client" \
  --advertise-client-urls "http://127.0.0.1:$client" --listen-peer-urls "http://127.0.0.1:$peer"

openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -noenc -days 2 -subj /CN=localhost \
  -addext subjectAltName=DNS:localhost -keyout "$folder/key.pem" -out "$folder/certificate.pem" 2>/dev/null
chown postgres "$folder/key.pem"

# The configuration as it is shipped, with this machine's addresses, folders and ports in place of the
# example's, and short times.
ports=()
for node in 1 2 3; do
  port=$(free_port)
  ports+=("$port")
  mkdir "$folder/node$node"
  chown postgres: "$folder/node$node"
  rest=$(free_port)
  sed -e "s/^name: .*/name: database$node/" \
    -e "s/192\.0\.2\.11:8008/127.0.0.1:$rest/; s/hosts: .*/hosts: 127.0.0.1:$client/" \
    -e "s/192\.0\.2\.11:5432/127.0.0.1:$port/; s|192\.0\.2\.0/24|127.0.0.1/32|" \
    -e "s|data_dir: .*|data_dir: $folder/node$node/data|; s|bin_dir: .*|bin_dir: $bin|" \
    -e "s|/var/run/postgresql|$folder/node$node|" \
    -e "s|/etc/patroni/database.pem|$folder/certificate.pem|; s|/etc/patroni/database.key|$folder/key.pem|" \
    -e "s/loop_wait: 5/loop_wait: 1/; s/retry_timeout: 5/retry_timeout: 3/; s/ttl: 20/ttl: 8/" \
    -e "s/mode: automatic/mode: 'off'/" "$source/deploy/cluster/patroni.yml" >"$folder/node$node.yml"
done

member() {  # Prints the number of the node with a role.
  patronictl --config-file "$folder/node1.yml" list --format json |
    python3 -c 'import json, sys
print(next(m["Member"][-1] for m in json.load(sys.stdin)
           if m["Role"] == sys.argv[1] and m["State"] in ("running", "streaming")))' "$1"
}

patroni_pids=()
for node in 1 2 3; do
  start "patroni$node" runuser -u postgres -- patroni "$folder/node$node.yml"
  patroni_pids+=("${processes[-1]}")
  if [[ $node -eq 1 ]]; then wait_for 60 member Leader; fi
done
wait_for 60 member "Sync Standby"
leader=$(member Leader)
export PGPASSWORD=CHANGE-THIS-1
psql="psql --quiet --host 127.0.0.1 --port ${ports[leader - 1]} --username postgres"
$psql --command "CREATE USER polyest PASSWORD 'rig'" --command "CREATE DATABASE polyest OWNER polyest" postgres

printf '127.0.0.1:*:polyest:polyest:rig\n' >"$folder/passwords"
chmod 600 "$folder/passwords"
hosts=$(printf ',127.0.0.1:%s' "${ports[@]}")
database="postgresql://polyest@${hosts:1}/polyest"
start polyestd "$polyestd" --listen 127.0.0.1:0 \
  --journal "$database?passfile=$folder/passwords&sslmode=require"
wait_for 30 grep -q "listening on" "$folder/polyestd.out"
address=$(sed -n 's/^listening on //p' "$folder/polyestd.out")

examples=$source/client/examples
start rig "$polyest" stream "$examples/oscillator.json" "$examples/oscillator.csv" --server "$address" \
  --session rig --rate 2 --batch 10 --format jsonl
rig=${processes[-1]}
wait_for 30 grep -q parameters "$folder/rig.out"

killed=$SECONDS
pkill -KILL -P "${patroni_pids[leader - 1]}" || true
kill -KILL "$(head -1 "$folder/node$leader/data/postmaster.pid")" 2>/dev/null || true
promoted() { [[ "$(member Leader)" != "$leader" ]]; }
wait_for 60 promoted
echo "the standby took over after $((SECONDS - killed)) s"
wait "$rig"
samples=$(python3 -c 'import json, sys
print(json.loads(open(sys.argv[1]).readlines()[-1])["samples"])' "$folder/rig.out")
rows=$(($(wc -l <"$examples/oscillator.csv") - 1))
if [[ "$samples" -ne "$rows" ]]; then
  echo "failed: the last estimate has $samples samples, the record $rows"
  exit 1
fi
grep -q "connected again" "$folder/rig.log" || { echo "failed: the rig noticed nothing"; exit 1; }
echo "the rig went on, and its last estimate has all $samples samples"
