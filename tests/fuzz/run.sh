#!/usr/bin/env bash
# Runs the fuzzers, each from the corpus beside this file:
#   tests/fuzz/run.sh [SECONDS] [FUZZER]... [-- OPTION-OF-LIBFUZZER...]
# SECONDS: the time for all fuzzers together, by default 60. FUZZER: equation, data_file or rpc, by
# default all.
# Inputs that fail go to build/asan-ubsan/fuzz as FUZZER-crash-…, -timeout-…, -oom-… or -leak-….
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
seconds=${1:-60}
[[ $# -eq 0 ]] || shift
fuzzers=()
while [[ $# -gt 0 && "$1" != -- ]]; do
  fuzzers+=("$1")
  shift
done
[[ $# -eq 0 ]] || shift
[[ ${#fuzzers[@]} -gt 0 ]] || fuzzers=(equation data_file rpc)

deploy/install-packages.sh --tests --sanitizers
cmake --preset asan-ubsan >/dev/null
cmake --build --preset asan-ubsan --parallel "$(nproc)" --target "${fuzzers[@]/%/_fuzzer}"
results=build/asan-ubsan/fuzz
for fuzzer in "${fuzzers[@]}"; do
  case "$fuzzer" in
    equation) options=(-max_len=4096 -rss_limit_mb=512 -timeout=5 -dict=tests/fuzz/equation.dict) ;;
    data_file) options=(-max_len=4096 -rss_limit_mb=512 -timeout=5 -dict=tests/fuzz/data_file.dict) ;;
    # A call is cut off after 0.1 s, and an input has at most 12 calls. The entropic schedule is
    # off: it takes longer than the calls. Leaks are looked for at the end, because a working daemon
    # holds other memory after each input.
    rpc) options=(-max_len=16384 -rss_limit_mb=2048 -timeout=20 -entropic=0 -detect_leaks=0) ;;
  esac
  corpus="$results/${fuzzer}_corpus"
  mkdir -p "$corpus"
  echo "==> $fuzzer fuzzer"
  "build/asan-ubsan/bin/${fuzzer}_fuzzer" -max_total_time=$((seconds / ${#fuzzers[@]})) \
    -artifact_prefix="$results/$fuzzer-" -print_final_stats=1 "${options[@]}" "$@" \
    "$corpus" "tests/fuzz/${fuzzer}_corpus"
done
