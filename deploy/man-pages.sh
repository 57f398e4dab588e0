#!/usr/bin/env bash
# Writes man pages from the --help of the programs and of each of their commands.
#
#   deploy/man-pages.sh BIN FOLDER    BIN has polyest and polyestd; the pages go to FOLDER
set -euo pipefail

if [[ $# -ne 2 ]]; then
  sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}" >&2
  exit 2
fi
bin="$(realpath "$1")"
folder="$(realpath -m "$2")"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
mkdir -p "$folder"

# Prints the help in GNU's form, which help2man reads: "-h, --help", and the description after the
# usage.
say_help() { # PROGRAM [COMMAND]
  "$bin/$1" "${@:2}" --help | sed 's/^\( *-[a-zA-Z]\),--/\1, --/' | awk '
    NR == 1 { description = $0; next }
    /^Usage: / { print; print ""; print description; next }
    { print }'
}

# Prints the commands that a program lists: "  estimate     Estimate from a data file".
commands() { # PROGRAM
  "$bin/$1" --help | awk '
    /^[A-Z]/ { arguments = tolower($0) ~ /^(positionals|arguments)/ }
    !arguments && /^  [a-z][a-z-]*  / { print $1 }'
}

page() { # PROGRAM [COMMAND]
  local name summary version
  name="$(IFS=-; echo "$*")"
  say_help "$@" >"$scratch/help"
  version="$("$bin/$1" --version)"
  summary="$("$bin/$1" "${@:2}" --help | sed -n 1p)"
  cat >"$scratch/$name" <<END
#!/bin/sh
cat "$scratch/help"
END
  chmod +x "$scratch/$name"
  help2man --section=1 --no-info --name="${summary%.}" --manual="polyest" \
    --source="$version" --version-string="${version##* }" --output="$folder/$name.1" "$scratch/$name"
}

for program in polyest polyestd; do
  page "$program"
  for command in $(commands "$program"); do page "$program" "$command"; done
done
