#!/usr/bin/env bash
# Builds polyest and runs its tests. The last lines and the exit status are ctest's.
#
#   tests/run.sh [--preset NAME] [--werror] [--target TARGET]... [--label LABEL] [-- CTEST-ARGUMENT...]
#
#   --preset NAME      of CMakePresets.json; release by default
#   --werror           compiler warnings are errors
#   --target TARGET    build no more than this, such as polyest_unit_tests; everything by default
#   --label LABEL      run only the tests with this label: unit, paper, integration, long
#
# tests/threads/run.sh runs those in which threads meet under the thread sanitizer.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
preset=release
werror=OFF
targets=()
ctest_arguments=()

usage() {
  sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
}

need_value() {
  if [[ $# -lt 2 ]]; then
    echo "tests/run.sh: $1 needs a value" >&2
    exit 2
  fi
}

while [[ $# -gt 0 ]]; do
  case "$1" in
    --preset) need_value "$@"; preset="$2"; shift 2 ;;
    --werror) werror=ON; shift ;;
    --target) need_value "$@"; targets+=(--target "$2"); shift 2 ;;
    --label) need_value "$@"; ctest_arguments+=(--label-regex "^$2\$"); shift 2 ;;
    --help) usage; exit 0 ;;
    --) shift; ctest_arguments+=("$@"); break ;;
    *)
      echo "tests/run.sh: unknown argument '$1'" >&2
      usage >&2
      exit 2
      ;;
  esac
done

packages=(--tests)
[[ "$preset" != asan-ubsan ]] || packages+=(--sanitizers)
"$root/deploy/install-packages.sh" "${packages[@]}"
cd "$root"
# Said outright, since a build folder remembers what it was last configured with.
cmake --preset "$preset" -DPOLYEST_BUILD_TESTS=ON -DPOLYEST_WARNINGS_AS_ERRORS="$werror"
cmake --build --preset "$preset" --parallel "$(nproc)" "${targets[@]}"
# The preset runs three or four at a time, since many wait for daemons, databases and browsers.
exec ctest --preset "$preset" "${ctest_arguments[@]}"
