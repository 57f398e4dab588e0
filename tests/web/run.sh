#!/usr/bin/env bash
# Runs a command in WORK, which prepare.sh has made. Exit status 77: something is missing.
#
#   tests/web/run.sh WORK COMMAND...
set -euo pipefail
work=$1
shift

if [[ ! -e "$work/node_modules/.installed" ]]; then
  echo "skipped: $work has no packages; see the output of web/prepare"
  exit 77
fi
if [[ "$*" == *browser* && ! -x "${POLYEST_CHROMIUM:-/usr/bin/chromium}" ]]; then
  echo "skipped: there is no chromium; deploy/install-packages.sh --tests installs it"
  exit 77
fi
cd "$work"
exec "$@"
