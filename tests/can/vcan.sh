#!/usr/bin/env bash
# Streams a rig through a real SocketCAN interface: boots this machine's own files in user-mode Linux, an
# ordinary process, whose kernel has CAN whether or not this machine's has, and does rig_on_vcan.py there.
# The machine's files stay as they are. Needs neither root nor a port, and takes a minute.
#
#   tests/can/vcan.sh POLYESTD POLYEST
#
# The programs are those of a build that has the target polyest_python, too. Into that build's folder
# tests/python/extras.sh puts python-can and cantools. Needs the packages user-mode-linux, kmod and iproute2.
#
# Exit status 77: a program or a module of the kernel is missing.
set -euo pipefail

here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
[[ $# -eq 2 && -x "$1" && -x "$2" ]] || {
  echo "vcan.sh: give two programs: tests/can/vcan.sh POLYESTD POLYEST" >&2
  exit 2
}
polyestd="$(realpath "$1")" polyest="$(realpath "$2")"
build="$(dirname "$(dirname "$polyestd")")"
timeout_s=180

skip() {
  echo "skipped: there is no $1"
  exit 77
}
for program in linux.uml insmod ip; do
  command -v "$program" >/dev/null || skip "$program"
done
# In the order in which they need each other.
modules=()
for name in can can-raw can-dev vcan; do
  module="$(find /usr/lib/uml/modules -name "$name.ko" 2>/dev/null | tail -n 1)"
  [[ -n "$module" ]] || skip "module $name of user-mode Linux"
  modules+=("$module")
done
[[ -d "$build/python/polyest" ]] || skip "$build/python/polyest"
"$here/../python/extras.sh" /usr/bin/python3 "$build/python-extras"

source "$here/../testing/user_mode_linux.sh"
scratch="$(mktemp --directory)"
trap clean_uml EXIT

# Writes the first process. It can read all of this machine's files, and write those of this try alone.
cat >"$scratch/init" <<END
#!/bin/bash
mount -t proc proc /proc
mount -t tmpfs tmpfs /run
mount -t hostfs -o "$scratch" none "$scratch"
cd "$scratch"
exec >output 2>&1
for module in ${modules[*]}; do insmod "\$module"; done
ip link set lo up
ip link add vcan0 type vcan
ip link set vcan0 up
export PYTHONPATH="$build/python" TMPDIR=/run
"$build/python-extras/bin/python" -B "$here/rig_on_vcan.py" "$polyestd" "$polyest" vcan0 && touch passed
echo o >/proc/sysrq-trigger
sleep 60
END
chmod +x "$scratch/init"

boot_uml "$timeout_s" mem=1024M ro
if [[ ! -e "$scratch/passed" ]]; then
  tail -n 40 "$scratch/console" "$scratch"/*.log >&2 || true
  echo "vcan.sh: the bridge does not hold on a real bus" >&2
  exit 1
fi
