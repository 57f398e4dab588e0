#!/usr/bin/env bash
# Compares the command of the Debian package, which must run anywhere, with one that is built for
# this machine: the same estimates by both, turn by turn, and the ratio of their CPU times.
#
#   tests/bench/packaged.sh [--packages FOLDER] [--native PROGRAM] [--runs COUNT] [--levels]
#
#   --packages FOLDER  where deploy/package.sh has put the packages; build/package by default
#   --native PROGRAM   the native build's command; build/release/bin/polyest by default, built first
#   --runs COUNT       of each work by each program, of which the quickest counts; 7 by default
#   --levels           also with the builds of the core for lesser processors
#
# Takes about two minutes. Exit status 1 when the package takes more than 1.3 times as long in all.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)"
packages="$root/build/package"
native=""
runs=7
levels=(best)
allowed=1.3

usage() { sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; }
fail() {
  echo "packaged.sh: $*" >&2
  exit 2
}
need_value() { [[ $# -ge 2 ]] || fail "$1 needs a value"; }

while [[ $# -gt 0 ]]; do
  case "$1" in
    --packages) need_value "$@"; packages="$2"; shift 2 ;;
    --native) need_value "$@"; native="$2"; shift 2 ;;
    --runs) need_value "$@"; runs="$2"; shift 2 ;;
    --levels) levels=(best x86-64-v3 x86-64-v2); shift ;;
    --help) usage; exit 0 ;;
    *) fail "unknown argument '$1'; see --help" ;;
  esac
done
[[ "$runs" =~ ^[1-9][0-9]*$ ]] || fail "--runs: \"$runs\" is not a count"
package="$(ls -t "$packages"/polyest_*_amd64.deb 2>/dev/null | head -n 1)"
[[ -n "$package" ]] || fail "no polyest_*_amd64.deb in $packages: deploy/package.sh"
if [[ -z "$native" ]]; then
  native="$root/build/release/bin/polyest"
  (cd "$root" && cmake --preset release && cmake --build --preset release --target polyest) >&2
fi

scratch="$(mktemp --directory)"
trap 'rm -rf "$scratch"' EXIT
dpkg-deb --extract "$package" "$scratch/package"
examples="$root/client/examples"

# What each work is: its name, then the command's arguments.
works=(
  "two parameters|estimate $examples/quarter_car.json $examples/quarter_car.csv --threads 1"
  "bicycle|estimate $examples/bicycle.json $examples/bicycle.csv --threads 1"
  "roll plane|estimate $examples/roll_plane.json $examples/roll_plane.csv --threads 1"
  "roll plane, 4 DOF|estimate $examples/roll_plane_4dof.json $examples/roll_plane_4dof.csv --threads 1"
  "chain|estimate $examples/chain.json $examples/chain.csv --threads 1"
  "damper|estimate $examples/damper_rig.json $examples/damper_rig.csv --threads 1"
  "the paper's reference|paper reference --threads 1"
)

# The CPU seconds of one run.
cpu_s() { # LEVEL|native ARGUMENT...
  local level="$1" program=("$native") TIMEFORMAT='%U %S'
  shift
  case "$level" in
    native) ;;
    best) program=("$scratch/package/usr/bin/polyest") ;;
    *) program=(/lib64/ld-linux-x86-64.so.2 --glibc-hwcaps-mask "$level" "$scratch/package/usr/bin/polyest") ;;
  esac
  { time "${program[@]}" "$@" >"$scratch/answer" 2>"$scratch/errors"; } 2>"$scratch/time" || {
    cat "$scratch/errors" >&2
    fail "${program[*]} $* failed"
  }
  awk '{ print $1 + $2 }' "$scratch/time"
}
smaller() { awk -v a="$1" -v b="$2" 'BEGIN { print (a == "" || b < a) ? b : a }'; }

status=0
for level in "${levels[@]}"; do
  printf '%-24s %12s %12s %8s\n' "level: $level" "native, s" "package, s" ratio
  total_native=0 total_package=0
  for work in "${works[@]}"; do
    read -ra arguments <<<"${work#*|}"
    best_native="" best_package=""
    for ((run = 0; run < runs; ++run)); do
      best_native=$(smaller "$best_native" "$(cpu_s native "${arguments[@]}")")
      best_package=$(smaller "$best_package" "$(cpu_s "$level" "${arguments[@]}")")
    done
    awk -v name="${work%%|*}" -v n="$best_native" -v p="$best_package" \
      'BEGIN { printf "%-24s %12.3f %12.3f %8.2f\n", name, n, p, p / n }'
    total_native=$(awk "BEGIN { print $total_native + $best_native }")
    total_package=$(awk "BEGIN { print $total_package + $best_package }")
  done
  awk -v n="$total_native" -v p="$total_package" \
    'BEGIN { printf "%-24s %12.3f %12.3f %8.2f\n\n", "all together", n, p, p / n }'
  # Lesser levels are for information: they are not what this machine runs.
  if [[ "$level" == best ]]; then
    awk "BEGIN { exit !($total_package <= $allowed * $total_native) }" || status=1
  fi
done
((status == 0)) || echo "packaged.sh: the package takes more than $allowed times as long" >&2
exit "$status"
