#!/usr/bin/env bash
# Tests the package for Python with protobuf 5, 6 and 7 (Debian 12 has 4.21), and with the newest
# packages that PyPI has, where ArviZ reads DataTrees: versions.sh PYTHON BUILD, the folder of a build.
set -euo pipefail

python="$1" build="$(realpath "$2")"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
export POLYEST_DAEMON="$build/bin/polyestd" MPLBACKEND=Agg
pip=(-m pip --quiet --disable-pip-version-check install)

run_with() {
  local interpreter="$1" path="$2"
  (cd "$here" && PYTHONPATH="$path" "$interpreter" -B -m pytest -q -rs -p no:cacheprovider \
    --deselect house_test.py::test_types_are_strict .)
}

"$here/extras.sh" "$python" "$build/python-extras"
for version in 5.29 6.33 7; do
  echo "==> protobuf $version"
  "$python" "${pip[@]}" --upgrade --target "$build/python-protobuf-$version" "protobuf==$version.*"
  run_with "$build/python-extras/bin/python" "$build/python-protobuf-$version:$build/python"
done

echo "==> the newest packages"
newest="$build/python-newest"
rm -rf "$newest"
# Debian's pip is seen, and everything else is installed in front of Debian's.
"$python" -m venv --system-site-packages --without-pip "$newest"
"$newest/bin/python" "${pip[@]}" --ignore-installed arviz emcee msgpack pytest scipy \
  setuptools wheel "$here/../../client/python[all,mdf,mcap,can,bridge]"
run_with "$newest/bin/python" ""
