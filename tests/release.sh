#!/usr/bin/env bash
# Runs what a release must pass beside .ci/run, and what takes too long for it, and says how long each
# step took. Needs a Debian 12 machine, and root to install packages and boot one.
#
#   tests/release.sh [--minutes M] [STEP]...    all steps, in this order, unless some are named
#
#   crashes      kills the daemon 200 times while rigs stream to it (a minute on two cores)
#   damages      damages 200 journals at random and asks for their estimates (a minute)
#   attacks      attacks the daemon, also through the edge, for longer than .ci/run does (5 minutes)
#   soak         asks for an hour of streams and of sessions that come and go whether the daemon's
#                memory stays within 5 %; --minutes M makes it shorter
#   sanitized    the long unit tests under the address and undefined-behaviour sanitizers
#   fuzz         fuzzes equations and calls for half an hour
#   threads      looks for races in the tests in which threads meet (90 minutes)
#   calibration  asks of 1,768 campaigns, and of held-out halves of measured records, if they are there,
#                whether the uncertainty is true (25 minutes)
#   properties   compares estimates of 2,000 random small problems with exact posteriors, and stops the
#                numerics at many moments of 40
#   adversary    asks for estimates of all problems made to mislead it, if their maker is there
#   invariances  asks whether estimates depend on the assumed noise, the sampling rate or the half of a
#                record, for measured records, if they are there, and the examples (10 minutes)
#   python       tests the package for Python with protobuf 5, 6, 7, and with the newest packages of PyPI
#   sbibm        compares posteriors with the reference draws of a public benchmark, which it downloads
#   can          streams through a real SocketCAN interface, in user-mode Linux (a minute)
#   cluster      lets daemons that share a database, and their connections, fail 100 times while rigs
#                stream; lies to a daemon 3,000 times as another one; lets Patroni replace a database's
#                primary, and brings one back from an archive by pgBackRest (20 minutes)
#   package      builds the packages, installs, uses, upgrades and removes them, boots a machine with
#                them, and compares their speed with a native build
#
# Stops at the first step that fails; its exit status is that step's.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"
python=/usr/bin/python3  # Debian's, which finds the packages that scripts import
all_steps=(crashes damages attacks soak sanitized fuzz threads calibration properties adversary invariances
  python sbibm can cluster package)

crashes() {
  deploy/install-packages.sh --tests
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target durability_test
  POLYEST_TEST_CRASHES=200 ctest --preset release --tests-regex 'integration/durability_test'
}

damages() {
  deploy/install-packages.sh --tests
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target durability_test
  POLYEST_TEST_DAMAGES=200 build/release/bin/durability_test --gtest_filter='DamagedFilesTest.*'
}

attacks() {
  deploy/install-packages.sh --tests
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyestd
  local attack
  for attack in connections descriptors continuation; do
    "$python" -B tests/attack/strangers.py build/release/bin/polyestd "$attack" --seconds 20
  done
  "$python" -B tests/attack/tenants.py build/release/bin/polyestd --seconds 20
  for attack in connections resets continuation; do
    "$python" -B tests/attack/strangers.py build/release/bin/polyestd "$attack" --seconds 20 \
      --edge deploy/edge/edge.cfg
  done
}

soak() {
  deploy/install-packages.sh --tests
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyestd
  "$python" -B tests/soak/soak.py build/release/bin/polyestd --minutes "$soak_minutes"
}

sanitized() { tests/run.sh --preset asan-ubsan --target polyest_long_tests --label long; }

fuzz() { tests/fuzz/run.sh 1800; }

threads() { tests/threads/run.sh; }

calibration() {
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target calibration bands tracking unstable held_out
  build/release/bin/calibration 1008
  build/release/bin/bands 200
  build/release/bin/tracking 100
  build/release/bin/unstable 30
  # 77: the measured records are not there, as the program has said.
  build/release/bin/held_out || [[ $? -eq 77 ]]
}

properties() {
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target properties stops
  build/release/bin/properties 2000
  build/release/bin/stops 40
}

adversary() {
  deploy/install-packages.sh --tests
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyest
  # 77: the cases' maker is not there, as the step has said.
  "$python" -B tests/adversary/run.py build/release/bin/polyest build/release/adversary ||
    [[ $? -eq 77 ]]
}

invariances() {
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyest
  # 77: the measured records are not there, as the step has said.
  "$python" -B tests/invariances/run.py build/release/bin/polyest build/release/invariances ||
    [[ $? -eq 77 ]]
}

python() {
  deploy/install-packages.sh --tests
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyestd polyest polyest_python
  tests/python/versions.sh "$python" build/release
}

sbibm() {
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyest
  python3 -B tests/sbibm/run.py build/release/bin/polyest build/release/sbibm
}

can() {
  deploy/install-packages.sh --tests --package
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyestd polyest polyest_python
  # 77: a program or a module of the kernel is missing, as the step has said.
  tests/can/vcan.sh build/release/bin/polyestd build/release/bin/polyest || [[ $? -eq 77 ]]
}

cluster() {
  deploy/install-packages.sh --tests
  apt-get install --yes --no-install-recommends patroni etcd-server pgbackrest
  cmake --preset release -DPOLYEST_BUILD_TESTS=ON
  cmake --build --preset release --parallel "$(nproc)" --target polyestd polyest postgres_test
  POLYEST_TEST_ROUNDS=3000 build/release/bin/postgres_test --gtest_filter='FalseNodeTest.*'
  "$python" -B tests/cluster/faults.py build/release/bin/polyestd build/release/bin/polyest --faults 100 \
    --bound
  # 77: a program is missing, as the step has said.
  tests/cluster/patroni.sh build/release/bin/polyestd build/release/bin/polyest || [[ $? -eq 77 ]]
  "$python" -B tests/cluster/archive.py build/release/bin/polyestd build/release/bin/polyest ||
    [[ $? -eq 77 ]]
}

package() {
  deploy/package.sh
  tests/package/run.sh
  tests/package/boot.sh
  tests/bench/packaged.sh
}

soak_minutes=60
steps=()
while [[ $# -gt 0 ]]; do
  step="$1"
  shift
  if [[ "$step" == --help ]]; then
    sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"
    exit 0
  fi
  if [[ "$step" == --minutes && "${1-}" =~ ^[1-9][0-9]*$ ]]; then
    soak_minutes="$1"
    shift
    continue
  fi
  if [[ " ${all_steps[*]} " != *" $step "* ]]; then
    echo "tests/release.sh: unknown step '$step'; there are ${all_steps[*]}" >&2
    exit 2
  fi
  steps+=("$step")
done
[[ ${#steps[@]} -gt 0 ]] || steps=("${all_steps[@]}")

summary=()
for step in "${steps[@]}"; do
  printf '\n==> %s\n' "$step"
  began=$SECONDS
  "$step"
  summary+=("$(printf '%-12s %5d s' "$step" $((SECONDS - began)))")
done
printf '\n==> all passed\n'
printf '%s\n' "${summary[@]}" "$(printf '%-12s %5d s' total "$SECONDS")"
