#!/bin/sh
# Fuzzes the equations for so many seconds (60 unless given) from the corpus beside this file:
#   tests/fuzz/run.sh [SECONDS] [more options of libFuzzer]
# What makes it fail is written to build/fuzz as crash-…, timeout-… or oom-….
set -eu
cd "$(dirname "$0")/../.."
seconds=${1:-60}
[ $# -eq 0 ] || shift
cmake --preset fuzz > /dev/null
cmake --build --preset fuzz --target polyest_fuzz
mkdir -p build/fuzz/corpus
exec build/fuzz/bin/polyest_fuzz -max_total_time="$seconds" -rss_limit_mb=512 -timeout=5 \
  -max_len=4096 -dict=tests/fuzz/equations.dict -artifact_prefix=build/fuzz/ -print_final_stats=1 \
  "$@" build/fuzz/corpus tests/fuzz/corpus
