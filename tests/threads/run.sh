#!/usr/bin/env bash
# Looks for races: runs the tests in which threads meet (label threads) under the thread sanitizer,
# with the libraries between them built for it as well.
#   tests/threads/run.sh [CTEST-ARGUMENT...]
# Fails on a race in any process; the reports stay in build/tsan/reports.
set -euo pipefail
if [[ "${1:-}" == --help ]]; then
  sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
  exit 0
fi
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

deploy/install-packages.sh --tests --threads
tests/threads/build-packages.sh build/tsan-packages
cmake --preset tsan
cmake --build --preset tsan --parallel "$(nproc)" --target polyest_threads_tests

reports="$PWD/build/tsan/reports"
rm -rf "$reports"
mkdir -p "$reports"
options="log_path=$reports/race second_deadlock_stack=1"
options+=" suppressions=$PWD/tests/threads/suppressions.txt print_suppressions=0"
options+=" handle_segv=0"  # an FMU of the tests crashes its worker on purpose
status=0
# The daemon is killed less often, because everything is tens of times slower.
TSAN_OPTIONS="$options" POLYEST_TEST_CRASHES="${POLYEST_TEST_CRASHES:-5}" \
  ctest --preset tsan --label-regex '^threads$' "$@" || status=$?
found="$(find "$reports" -type f | wc -l)"
if [[ $found -gt 0 ]]; then
  cat "$reports"/* >&2
  echo "tests/threads/run.sh: reports of $found processes, see $reports" >&2
  exit 1
fi
exit "$status"
