#!/usr/bin/env bash
# Does the work of boot.sh inside: the package is installed, ready, watched, upgraded, stopped and
# purged by the service manager. Leaves the file /try/passed if everything held.
set -euo pipefail

say() { echo "==> $*"; }
fail() {
  echo "FAILED: $*"
  [[ ! -e /tmp/dpkg.log ]] || tail -n 20 /tmp/dpkg.log
  systemctl status --no-pager polyestd || true
  journalctl --no-pager --unit polyestd --lines 40 || true
  exit 1
}
expect() { # WHAT TEXT PATTERN
  [[ "$2" == *"$3"* ]] || fail "$1: \"$2\" has no \"$3\""
}
show() { systemctl show --property "$1" --value polyestd; }
logged() { journalctl --no-pager --output cat --unit polyestd | grep --fixed-strings --quiet -- "$1"; }
# Waits until a command succeeds.
until_true() { # WHAT COMMAND...
  local what="$1"
  shift
  for _ in {1..600}; do
    if "$@"; then return; fi
    sleep 0.1
  done
  fail "$what: not within a minute"
}
stream() { # ROWS [SERVER]
  head -n $(($1 + 1)) /try/oscillator.csv |
    polyest stream /try/oscillator.json - --server "${2:-127.0.0.1:50051}" --session rig \
      --format jsonl 2>&1
}
# Skips the triggers of other packages, such as the index of manual pages, which take a minute here.
install_package() { dpkg --no-triggers --install "$1" >/tmp/dpkg.log 2>&1; }
is_active() { [[ "$(show ActiveState)" == active ]]; }
configuration=/etc/polyest/polyestd.toml

say "installing: the service starts and is ready"
install_package /try/polyest.deb || fail "dpkg --install"
[[ "$(systemctl is-active polyestd)" == active ]] || fail "not active after its installation"
[[ "$(systemctl is-enabled polyestd)" == enabled ]] || fail "not enabled"
[[ "$(show Type)" == notify ]] || fail "not of Type=notify"
[[ "$(show WatchdogUSec)" == 30s ]] || fail "the watchdog's time is $(show WatchdogUSec)"
[[ "$(show StatusText)" == "listening on 127.0.0.1:50051" ]] || fail "status \"$(show StatusText)\""
pid=$(show MainPID)
[[ "$(tr '\0' ' ' <"/proc/$pid/cmdline")" == "/usr/bin/polyestd --config $configuration " ]] ||
  fail "its command line is $(tr '\0' ' ' <"/proc/$pid/cmdline")"
! tr '\0' '\n' <"/proc/$pid/environ" | grep -q ^POLYESTD_ || fail "it reads its environment"
[[ "$(stat -c %U "/proc/$pid")" == polyest ]] || fail "it runs as $(stat -c %U "/proc/$pid")"
[[ "$(stat -c '%U %a' /var/lib/polyest)" == "polyest 700" ]] || fail "others see the data folder"

say "streaming the demo record to it"
expect "the estimate" "$(stream 60 | tail -n 1)" '"samples":"60"'

say "listening on two addresses of the configuration file"
echo 'listen = ["127.0.0.1:50051", "127.0.0.1:50052"]' >>"$configuration"
systemctl restart polyestd || fail "the restart"
[[ "$(show StatusText)" == "listening on 127.0.0.1:50051, 127.0.0.1:50052" ]] ||
  fail "status \"$(show StatusText)\""
expect "the second address" "$(stream 70 127.0.0.1:50052)" "60 rows are not later than t = "

say "being let alone by its watchdog while it answers"
mkdir -p /etc/systemd/system/polyestd.service.d
printf '[Service]\nWatchdogSec=3\n' >/etc/systemd/system/polyestd.service.d/watchdog.conf
systemctl daemon-reload
systemctl restart polyestd
[[ "$(show WatchdogUSec)" == 3s ]] || fail "the watchdog's time is $(show WatchdogUSec)"
pid=$(show MainPID)
sleep 10
[[ "$(show MainPID)" == "$pid" && "$(show NRestarts)" == 0 ]] || fail "it was restarted"

say "being started again by its watchdog when it hangs"
kill -STOP "$pid"
restarted() { [[ "$(show NRestarts)" == 1 ]] && is_active; }
until_true "the restart by the watchdog" restarted
[[ "$(show MainPID)" != "$pid" ]] || fail "it is the same process"
logged "Watchdog timeout" || fail "systemd did not speak of the watchdog"
expect "after the restart" "$(stream 80)" "70 rows are not later than t = "

say "being started again when it crashes"
kill -SEGV "$(show MainPID)"
crashed() { [[ "$(show NRestarts)" == 2 ]] && is_active; }
until_true "the restart after a crash" crashed
rm -r /etc/systemd/system/polyestd.service.d
systemctl daemon-reload

say "being upgraded with its data"
dpkg-deb --raw-extract /try/polyest.deb /tmp/next
sed -i 's/^Version: .*/&+next/' /tmp/next/DEBIAN/control
dpkg-deb --build /tmp/next /tmp/next.deb >/dev/null
pid=$(show MainPID)
install_package /tmp/next.deb || fail "dpkg --install of the next version"
is_active || fail "not active after its upgrade"
[[ "$(show MainPID)" != "$pid" ]] || fail "the old version still runs"
[[ "$(show StatusText)" == *50052 ]] || fail "the upgrade did not keep the configuration"
expect "after the upgrade" "$(stream 90)" "80 rows are not later than t = "

say "stopping in order, with a stream open"
mkfifo /tmp/rows
polyest stream /try/oscillator.json /dev/stdin --server 127.0.0.1:50051 --session open \
  --batch 1 --format jsonl </tmp/rows >/tmp/estimates 2>&1 &
client=$!
exec {rows}>/tmp/rows
head -n 30 /try/oscillator.csv >&"$rows"
until_true "the first estimate" test -s /tmp/estimates
systemctl stop polyestd || fail "systemctl stop"
exec {rows}>&-
kill "$client" 2>/dev/null || true
[[ "$(show ActiveState) $(show Result) $(show ExecMainStatus)" == "inactive success 0" ]] ||
  fail "it ended as $(show ActiveState), $(show Result), $(show ExecMainStatus)"
logged draining && logged '"stopped"' || fail "the log has no draining, or no end"

say "refusing a configuration that is wrong, once, by its line"
cp "$configuration" /tmp/kept.toml
echo 'max-sesions = 1' >>"$configuration"
! systemctl start polyestd 2>/dev/null || fail "it starts all the same"
[[ "$(show ActiveState) $(show NRestarts)" == "failed 0" ]] ||
  fail "it is $(show ActiveState) after $(show NRestarts) restarts"
logged 'there is no key "max-sesions"' || fail "the log does not name the key"
cp /tmp/kept.toml "$configuration"
systemctl start polyestd || fail "it does not start again"

say "purging"
dpkg --purge polyest >/dev/null 2>&1 || fail "dpkg --purge"
[[ "$(systemctl is-active polyestd)" != active ]] || fail "it still runs"
[[ ! -e /var/lib/polyest && ! -e /etc/polyest ]] || fail "it left data or configuration"
touch /try/passed
say "all of it holds"
