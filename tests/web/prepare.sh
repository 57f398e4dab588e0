#!/usr/bin/env bash
# Copies client/web, SOURCE, to WORK and installs the packages of package-lock.json there, unless
# they are there already. Exit status 77: Node.js or npm is missing.
#
#   tests/web/prepare.sh SOURCE WORK
set -euo pipefail
source=$1 work=$2

for program in node npm; do
  if ! command -v "$program" >/dev/null; then
    echo "skipped: there is no $program; deploy/install-packages.sh --tests installs it"
    exit 77
  fi
done
if [[ "$(node --print 'Number(process.versions.node.split(".")[0]) >= 18')" != true ]]; then
  echo "skipped: Node.js is $(node --version), and 18 is needed"
  exit 77
fi

mkdir -p "$work"
find "$work" -mindepth 1 -maxdepth 1 ! -name node_modules -exec rm -rf {} +
tar --directory="$source" --exclude=./node_modules --create . | tar --directory="$work" --extract
if ! cmp --quiet "$work/package-lock.json" "$work/node_modules/.installed"; then
  cd "$work"
  npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
  cp package-lock.json node_modules/.installed
fi
