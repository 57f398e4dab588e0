#!/usr/bin/env bash
# Compares polyest with what its users would use else, on the same records, side by side: see peers.py.
#
#   tests/bench/peers/run.sh POLYEST FOLDER [ARGUMENT OF peers.py]...
#
# Makes an environment with the peers, packages of PyPI, in FOLDER. Exit status 77: they cannot be fetched.
set -euo pipefail
if [[ $# -lt 2 ]]; then
  sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
  [[ ${1:-} == --help ]] && exit 0 || exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
polyest=$(realpath "$1") folder=$2
shift 2

if [[ ! -e "$folder/made" ]]; then
  python3 -m venv "$folder"
  if ! "$folder/bin/pip" --quiet --disable-pip-version-check install --only-binary numba,numpy,scipy \
    emcee==3.1.6 filterpy numba numpy scipy; then
    echo "run.sh: the packages could not be fetched" >&2
    exit 77
  fi
  touch "$folder/made"
fi
exec "$folder/bin/python" -B "$here/peers.py" "$polyest" "$@"
