#!/usr/bin/env bash
# extras.sh PYTHON FOLDER makes an environment with the packages of the extras mdf, mcap, can and bridge,
# and with servers of UM-Bridge models and of Foxglove's protocol.
# Debian's packages stay visible in it, and keep their versions. Exits with 77 (skipped) where packages
# cannot be fetched, with 1 there in CI; the environment then has Debian's packages alone.
set -euo pipefail

python="$1" folder="$2"
# The newest asammdf for Debian's numpy 1.24 and pandas 1.5 is 8.1.2.
wanted=(asammdf==8.1.2 cantools==45.1.0 foxglove-sdk==0.30.3 mcap==1.6.0 msgpack==1.1.0 paho-mqtt==2.1.0
  python-can==4.6.1 umbridge==1.2.10 websockets==15.0.1)
stamp="$folder/made-of"

[[ "$(cat "$stamp" 2>/dev/null)" != "${wanted[*]}" ]] || exit 0
rm -rf "$folder"
"$python" -m venv --system-site-packages --without-pip "$folder"
pip=("$folder/bin/python" -m pip --quiet --disable-pip-version-check)
printf '%s\n' 'numpy<1.25' 'pandas<2' 'protobuf<5' >"$folder/constraints.txt"
if "${pip[@]}" install --only-binary :all: --constraint "$folder/constraints.txt" "${wanted[@]}"; then
  echo "${wanted[*]}" >"$stamp"
else
  echo "extras.sh: the packages could not be fetched; their tests are skipped" >&2
  [[ "${CI:-}" != true ]] || exit 1
  exit 77
fi
