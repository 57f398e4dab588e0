#!/usr/bin/env bash
# Does the steps of run.sh inside the clean system: in_clean_root.sh STEP [ARGUMENT...]
set -euo pipefail

daemon_pid=""
configuration=/etc/polyest/polyestd.toml
server=127.0.0.1:50051
problem=/try/examples/oscillator.json
data=/try/examples/oscillator.csv

fail() {
  echo "FAILED: $*" >&2
  [[ ! -e /tmp/daemon.log ]] || tail -n 20 /tmp/daemon.log >&2
  exit 1
}
expect() { # WHAT TEXT PATTERN
  [[ "$2" == *"$3"* ]] || fail "$1: \"$2\" has no \"$3\""
}
apt() {
  apt-get --quiet --quiet --yes --no-install-recommends --option Dpkg::Use-Pty=0 \
    --option Dpkg::Options::=--force-confold "$@" >/tmp/apt.log 2>&1 ||
    fail "apt-get $*: $(tail -n 20 /tmp/apt.log)"
}
version() { dpkg-query --show --showformat='${Version}' polyest; }
as_polyest=(setpriv --reuid=polyest --regid=polyest --init-groups)

check_files() {
  [[ "$(stat -c '%U:%G %a' /var/lib/polyest)" == "polyest:polyest 700" ]] ||
    fail "the data folder is $(stat -c '%U:%G %a' /var/lib/polyest)"
  [[ "$(getent passwd polyest)" == *:/var/lib/polyest:*nologin ]] || fail "the user is not a system's"
  expect "conffiles" "$(dpkg-query --show --showformat='${Conffiles}' polyest)" "$configuration"
  local file
  for file in /usr/bin/polyest /usr/bin/polyestd /usr/libexec/polyest/polyest-fmu-worker \
    /lib/systemd/system/polyestd.service /usr/share/bash-completion/completions/polyestd; do
    [[ -e "$file" ]] || fail "there is no $file"
  done
  dpkg --verify polyest >/tmp/verify || fail "files differ: $(</tmp/verify)"
}

# Presses the tab key after these words; the last one may be empty.
complete_words() { # WORD...
  # shellcheck source=/dev/null
  source /usr/share/bash-completion/completions/polyest
  COMP_WORDS=("$@")
  COMP_CWORD=$(($# - 1))
  COMPREPLY=()
  _polyest
  echo "${COMPREPLY[*]}"
}

check_completion() {
  expect "completion of commands" " $(complete_words polyest es) " " estimate "
  expect "completion of options" " $(complete_words polyest estimate --fo) " " --format "
  expect "completion of an option's words" " $(complete_words polyest estimate --format j) " " json "
  expect "completion of a data file's words" " $(complete_words polyest estimate --decimal p) " " point "
  expect "completion of the daemon" " $(complete_words polyestd --lis) " " --listen "
}

check_man_pages() {
  local page text
  # A minimal system discards manual pages, so they come from the package itself.
  rm -rf /tmp/unpacked
  dpkg-deb --extract "$1" /tmp/unpacked
  for page in polyest polyest-estimate polyest-stream polyestd; do
    text=$(zcat "/tmp/unpacked/usr/share/man/man1/$page.1.gz") || fail "there is no page $page(1)"
    expect "$page(1)" "$text" ".SH OPTIONS"
  done
}

start_daemon() { # PROGRAM ARGUMENT...
  : >/tmp/daemon.out
  # The variable is the one that the unit and the container set.
  STATE_DIRECTORY=/var/lib/polyest "${as_polyest[@]}" "$@" >/tmp/daemon.out 2>/tmp/daemon.log &
  daemon_pid=$!
  for _ in {1..300}; do
    if grep -q "^listening on " /tmp/daemon.out; then return; fi
    kill -0 "$daemon_pid" 2>/dev/null || break
    sleep 0.1
  done
  fail "the daemon does not listen"
}
stop_daemon() {
  kill -TERM "$daemon_pid"
  wait "$daemon_pid" || fail "the daemon ends with $?"
}
# Prints the parameters of an estimate in JSON, with their uncertainty.
parameters() { tr -d ' \n' | sed 's/.*"parameters":\(\[[^]]*\]\).*/\1/'; }

step_install() { # PACKAGE
  [[ "$1" == polyest ]] || apt update
  apt install "/try/$1.deb"
  check_files
  if [[ "$1" == older ]]; then
    version >/tmp/version-before
    # An upgrade must keep this change, made by an administrator.
    sed -i 's/^max-sessions = .*/max-sessions = 77/' "$configuration"
  fi
}

# Streams rows BEFORE to AFTER; the first BEFORE rows are in the session already. The daemon's
# estimate must be that of the command for the same rows without a daemon.
step_stream() { # BEFORE AFTER
  start_daemon /usr/bin/polyestd --config "$configuration"
  local answer
  answer=$(head -n $(($2 + 1)) "$data" | "${as_polyest[@]}" polyest stream "$problem" - --server "$server" \
    --session rig --batch 20 --format jsonl 2>&1) || fail "polyest stream: $answer"
  expect "the estimate" "$answer" "\"samples\":\"$2\""
  [[ "$1" == 0 ]] || expect "the session" "$answer" "$1 rows are not later than t = "
  head -n $(($2 + 1)) "$data" >/tmp/rows.csv
  [[ "$(tail -n 1 <<<"$answer" | parameters)" == \
    "$(polyest estimate "$problem" /tmp/rows.csv --format json | parameters)" ]] ||
    fail "the daemon's estimate is not the command's"
  stop_daemon
}

step_upgrade() {
  apt install /try/polyest.deb
  [[ "$(version)" != "$(</tmp/version-before)" ]] || fail "the version is still $(version)"
  check_files
  check_completion
  check_man_pages /try/polyest.deb
  grep -q '^max-sessions = 77$' "$configuration" || fail "the upgrade changed the configuration"
}

# Checks that the loader takes the best build of the core for the processor, and any lesser one if
# told so.
step_levels() {
  local loader=/lib64/ld-linux-x86-64.so.2 level listed supported best="" k=""
  supported=$("$loader" --help | sed -n 's/^ *\(x86-64-v[0-9]\) (supported.*/\1/p')
  for level in x86-64-v2 x86-64-v3 x86-64-v4; do
    grep -qx "$level" <<<"$supported" || continue
    listed=$("$loader" --glibc-hwcaps-mask "$level" --list /usr/bin/polyest | grep libpolyest-core) ||
      fail "polyest does not use the shared core: $("$loader" --list /usr/bin/polyest)"
    case "$level" in
      x86-64-v2) [[ "$listed" != *glibc-hwcaps* ]] || fail "for $level the loader takes $listed" ;;
      *) expect "for $level the loader" "$listed" "glibc-hwcaps/$level/" ;;
    esac
    k=$("$loader" --glibc-hwcaps-mask "$level" /usr/bin/polyest estimate "$problem" "$data" \
      --format json | tr -d ' \n' | sed 's/.*"name":"k"[^}]*"map":\([0-9.]\{6\}\).*/\1/')
    [[ "$k" =~ ^[0-9.]{6}$ && "$k" == "${first:=$k}" ]] ||
      fail "with the core for $level, k is $k, and $first with the first one"
    best=$level
    echo "    $level: k = $k" >&2
  done
  # The library must use its own code, and none of the program's copies, which are made for
  # x86-64-v2.
  ! LD_DEBUG=bindings /usr/bin/polyest estimate "$problem" "$data" 2>&1 >/dev/null |
    grep 'libpolyest-core[^ ]* \[0\] to /usr/bin/polyest ' |
    grep --extended-regexp '`_ZN?K?(5Eigen|7polyest)' ||
    fail "the core calls the program's copies of these functions"
  [[ -n "$best" ]] || fail "this processor is not even x86-64-v2"
  [[ "$best" == x86-64-v2 ]] ||
    expect "by itself the loader" "$("$loader" --list /usr/bin/polyest)" "glibc-hwcaps/$best/"
}

# Runs the container's command, as its user.
step_container() { # PROGRAM ARGUMENT...
  [[ ! -e /lib/systemd/systemd ]] || fail "the container has systemd in it"
  start_daemon "$@"
  expect "the models" "$(polyest models --server "$server")" mass_spring_damper
  stop_daemon
}

step_remove() {
  apt remove polyest
  [[ ! -e /usr/bin/polyestd && ! -e /usr/libexec/polyest ]] || fail "programs are left"
  [[ -e /var/lib/polyest/journal.db && -e $configuration ]] || fail "data or configuration are gone"
}

step_purge() {
  apt purge polyest
  [[ ! -e /var/lib/polyest && ! -e /etc/polyest ]] || fail "data or configuration are left"
  [[ -z "$(find / -xdev -name '*polyest*' -not -path '/try*' -not -path '/tmp/*' \
    -not -path '/var/log/*' -not -path '/var/cache/*' -not -path '/proc/*')" ]] ||
    fail "files are left: $(find / -xdev -name '*polyest*' -not -path '/try*' -not -path '/tmp/*')"
}

step_build() {
  apt install g++ cmake ninja-build /try/libpolyest-dev.deb
  cmake -S /try/project -B /tmp/consumer -G Ninja -D CMAKE_BUILD_TYPE=Release >/tmp/cmake.log 2>&1 &&
    cmake --build /tmp/consumer >>/tmp/cmake.log 2>&1 || fail "$(tail -n 20 /tmp/cmake.log)"
  /tmp/consumer/consumer >/tmp/consumer.log || fail "the program fails: $(</tmp/consumer.log)"
  expect "the program" "$(</tmp/consumer.log)" "k = "
}

step="$1"
shift
"step_$step" "$@"
