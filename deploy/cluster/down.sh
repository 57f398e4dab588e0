#!/usr/bin/env bash
# Ends the cluster that up.sh has started, and removes its folder.
#
#   deploy/cluster/down.sh [FOLDER]
set -euo pipefail

. "$(cd "$(dirname "$0")" && pwd)/common.sh"
if [ ! -d "$cluster/database" ]; then
  echo "down.sh: there is no cluster in $cluster" >&2
  exit 1
fi
# The rigs first, then haproxy, then the daemons. Some may have ended by themselves.
if [ -f "$cluster/processes" ]; then
  for process in $(tac "$cluster/processes"); do kill "$process" 2>/dev/null || true; done
  for process in $(cat "$cluster/processes"); do
    timeout 20 tail --pid "$process" -f /dev/null || true
  done
fi
for server in standby primary; do
  as_postgres pg_ctl --pgdata "$cluster/database/$server/data" --mode fast --wait stop >/dev/null 2>&1 || true
done
rm -r "$cluster"
