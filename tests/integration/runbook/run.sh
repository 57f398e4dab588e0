#!/usr/bin/env bash
# Carries out deploy/runbook.md, command by command, with its own folders in place of the system's:
# run.sh SOURCE POLYESTD POLYEST. Leaves out only "Install", which needs root.
set -euo pipefail

source_folder=$1 polyestd=$2 polyest=$3
runbook=$source_folder/deploy/runbook.md
root=$(mktemp -d)
export root polyestd source_folder

say() { echo "runbook: $*" >&2; }
fail() {
  say "$*"
  tail -n 20 "$root"/log >&2 || true
  exit 1
}
expect() { # TEXT PATTERN
  [[ "$1" == *"$2"* ]] || fail "\"$1\" has no \"$2\""
}

# Replaces the system's parts: users, and services. The daemon runs as its unit says.
mkdir -p "$root"/{bin,work,etc/polyest,var/lib,backup}
cat >"$root/bin/install" <<'END'
#!/bin/bash
arguments=()
while (($#)); do
  case "$1" in
    -o | -g) shift 2 ;;
    *) arguments+=("$1") && shift ;;
  esac
done
exec /usr/bin/install "${arguments[@]}"
END
cat >"$root/bin/chown" <<'END'
#!/bin/bash
END
cat >"$root/bin/journalctl" <<'END'
#!/bin/bash
grep 'read again' "$root/log" | tail -n 5
END
cat >"$root/bin/systemctl" <<'END'
#!/bin/bash
set -euo pipefail
case "$1" in
  start)
    address=localhost:0
    [[ ! -e $root/address ]] || address=$(<"$root/address")
    sed "s|/etc/polyest|$root/etc/polyest|g; s|^listen .*|listen = \"$address\"|; s|^metrics .*||" "$root/etc/polyest/polyestd.toml" >"$root/polyestd.toml"
    command=$(sed -n 's/^ExecStart=//p' "$source_folder/deploy/systemd/polyestd.service")
    command="$polyestd${command#/usr/bin/polyestd}"
    command=${command/"/etc/polyest/polyestd.toml"/"$root/polyestd.toml"}
    rm -f "$root/ready" && mkfifo "$root/ready"
    STATE_DIRECTORY=$root/var/lib/polyest nohup $command >"$root/ready" 2>>"$root/log" </dev/null &
    echo $! >"$root/pid"
    read -r line <"$root/ready" || exit 1
    echo "${line#listening on }" >"$root/address"
    ;;
  stop)
    kill "$(<"$root/pid")"
    tail --pid="$(<"$root/pid")" --sleep-interval=0.05 --follow /dev/null
    ;;
  reload) kill -HUP "$(<"$root/pid")" ;;
esac
END
chmod +x "$root"/bin/*
ln -s "$polyestd" "$root/bin/polyestd"
ln -s "$polyest" "$root/bin/polyest"
export PATH=$root/bin:$PATH
clean() {
  [[ ! -e $root/pid ]] || kill -9 "$(<"$root/pid")" 2>/dev/null || true
  rm -rf "$root"
}
trap clean EXIT
cd "$root/work"

# Makes the unit's configuration file: the installed one and the runbook's additions.
cp "$source_folder/deploy/polyestd.toml" "$root/etc/polyest/polyestd.toml"
sed -n '/^```toml$/,/^```$/{/^```/!p}' "$runbook" >>"$root/etc/polyest/polyestd.toml"

# Prints the commands of a section, all of them or those of the one block of that number.
commands() { # SECTION [BLOCK]
  awk -v section="$1" -v wanted="${2:-0}" '
    /^##/ { inside = $0 ~ "^##+ " section "$" }
    inside && /^```sh$/ { code = 1; ++block; next }
    /^```$/ { code = 0 }
    inside && code && (!wanted || wanted == block)' "$runbook" |
    sed "s|/etc/polyest|$root/etc/polyest|g; s|/var/lib/polyest|$root/var/lib/polyest|g
         s|/backup|$root/backup|g; s|rig-server.example.org|localhost|g"
}
done_sections=()
run() { # SECTION [BLOCK]
  local text
  text=$(commands "$@")
  [[ -n $text ]] || fail "there are no commands in $*"
  done_sections+=("$1")
  text=${text//OTHER:PORT/$address}
  bash -euo pipefail -c "${text//HOST:PORT/$address}" >"$root/output" 2>&1 ||
    fail "$* does not work: $text: $(<"$root/output")"
}
address=none

run "Make certificates"
run "Make a token"
[[ $(stat -c %a rig1.token) == 600 ]] || fail "others may read the token"
polyestd --new-token bert:chassis:admin >admin.token 2>>"$root/etc/polyest/tokens"
polyestd --new-token olga:chassis:operator >operator.token 2>>"$root/etc/polyest/tokens"
systemctl start polyestd
address=localhost:$(sed 's/.*://' "$root/address")
export POLYEST_TLS_CA=$root/work/ca.pem
export POLYEST_TOKEN_FILE=$root/work/rig1.token

problem=$source_folder/client/examples/oscillator.json
data=$source_folder/client/examples/oscillator.csv
stream() { # ROWS
  head -n $(($1 + 1)) "$data" |
    polyest stream "$problem" - --server "$address" --session rig1-monday --format jsonl 2>&1
}
estimate=$(stream 60 | tail -n 1)
expect "$estimate" '"samples":"60"'

say "backing up, going on, and restoring"
(
  export POLYEST_TOKEN_FILE=$root/work/admin.token
  ! commands "Back up" 1 | sed "s|HOST:PORT|$address|" | bash -eu 2>"$root/output" ||
    fail "an admin of one tenant has the sessions of all"
)
expect "$(<"$root/output")" "needs the role operator"
(
  export POLYEST_TOKEN_FILE=$root/work/operator.token
  run "Back up" 1
)
done_sections+=("Back up")
expect "$(<"$root/output")" "1 sessions, 2 batches"
(
  export POLYEST_TOKEN_FILE=$root/work/admin.token
  polyest export rig1-monday before.session --server "$address" >/dev/null
  commands "Back up" 2 | grep export | sed "s|HOST:PORT|$address|" | bash -eu
  polyest delete rig1-monday --server "$address"
  commands "Back up" 2 | grep import | sed "s|OTHER:PORT|$address|" | bash -eu
) >/dev/null || fail "export and import do not work"
expect "$(stream 90)" "60 rows are not later than t = 3 s of run 0"
run "Restore"
expect "$(stream 60)" "60 rows are not later than t = 3 s of run 0"

say "looking into a damaged file"
mkdir "$root/damaged"
sqlite3 "$root/var/lib/polyest/journal.db" ".backup '$root/damaged/journal.db'"
cd "$root/damaged"
run "Damaged journal"
cd "$root/work"
expect "$(<"$root/output")" ok
systemctl stop polyestd
mv "$root/var/lib/polyest" "$root/kept"
mkdir -m 0700 "$root/var/lib/polyest"
mv "$root/damaged/recovered.db" "$root/var/lib/polyest/journal.db"
systemctl start polyestd || fail "what was recovered is refused"
expect "$(stream 60)" "60 rows are not later than t = 3 s of run 0"
systemctl stop polyestd
rm -r "$root/var/lib/polyest" && mv "$root/kept" "$root/var/lib/polyest"
systemctl start polyestd

say "making room"
run "Disk full"
expect "$(stream 60)" "60 rows are not later than t = 3 s of run 0"

say "rotating and revoking"
cp rig1.token old.token
old_line=$(grep '^rig1 ' "$root/etc/polyest/tokens")
run "Make a token"
cp daemon.pem old.pem
run "Make certificates" 2
run "Make certificates" 3
systemctl reload polyestd
served() { openssl s_client -connect "$address" -CAfile ca.pem -alpn h2 </dev/null 2>/dev/null | openssl x509; }
until [[ $(served) == "$(openssl x509 -in daemon.pem)" ]]; do :; done
[[ $(served) != "$(openssl x509 -in old.pem)" ]] || fail "the certificate is the old one"
run "Keys and tokens"
expect "$(<"$root/output")" "read again"
models() { polyest models --server "$address" --token-file "$1" 2>&1; }
expect "$(models old.token)" mass_spring_damper
expect "$(models rig1.token)" mass_spring_damper
grep -vF "$old_line" "$root/etc/polyest/tokens" >tokens.new
cat tokens.new >"$root/etc/polyest/tokens"
systemctl reload polyestd
while models old.token >/dev/null; do :; done
expect "$(models rig1.token)" mass_spring_damper

# Checks that every section with commands has been carried out.
while read -r section; do
  [[ $section == Install || " ${done_sections[*]/%/ |}" == *"$section"* ]] ||
    fail "nothing tests the commands of \"$section\""
done < <(awk '/^##/ { sub("^#+ ", ""); section = $0 } /^```sh$/ { print section }' "$runbook" | uniq)
say "all of it works"
