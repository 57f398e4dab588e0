#!/usr/bin/env bash
# Tries the Debian package under a systemd that really runs: boots this machine's own files in
# user-mode Linux, an ordinary process, installs the package there, and does under_systemd.sh. The
# machine's files stay as they are: all that is written goes to memory.
#
#   tests/package/boot.sh [--packages FOLDER]
#
#   --packages FOLDER  where deploy/package.sh has put the packages; build/package by default
#
# For root, since systemd reads files that only root may. Needs what deploy/install-packages.sh
# --package installs; no network. Takes two to four minutes. Exit status 0 when everything held.
set -euo pipefail

here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
packages="$here/../../build/package"
timeout_s=900

usage() { sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; }
fail() {
  echo "boot.sh: $*" >&2
  exit "${status:-1}"
}

while [[ $# -gt 0 ]]; do
  case "$1" in
    --packages) [[ $# -ge 2 ]] || status=2 fail "$1 needs a value"; packages="$2"; shift 2 ;;
    --help) usage; exit 0 ;;
    *) status=2 fail "unknown argument '$1'; see --help" ;;
  esac
done
[[ $EUID -eq 0 ]] || status=2 fail "run it as root"
for program in linux.uml insmod systemctl; do
  command -v "$program" >/dev/null ||
    status=2 fail "there is no $program: deploy/install-packages.sh --package"
done
package="$(ls -t "$packages"/polyest_*_amd64.deb 2>/dev/null | head -n 1)"
[[ -n "$package" ]] || status=2 fail "no polyest_*_amd64.deb in $packages: deploy/package.sh"

source "$here/../testing/user_mode_linux.sh"
scratch="$(mktemp --directory)"
trap clean_uml EXIT
cp "$package" "$scratch/polyest.deb"
cp "$here/under_systemd.sh" "$scratch/"
cp "$here"/../../client/examples/oscillator.{json,csv} "$scratch/"

# Writes the first process, which makes an overlay of / on memory, mounts this try's folder at
# /try, and starts systemd.
cat >"$scratch/init" <<END
#!/bin/sh
mount -t proc proc /proc
mount -t tmpfs tmpfs /mnt
insmod /usr/lib/uml/modules/\$(uname -r)/kernel/fs/overlayfs/overlay.ko
mkdir /mnt/upper /mnt/work /mnt/root
mount -t overlay -o lowerdir=/,upperdir=/mnt/upper,workdir=/mnt/work overlay /mnt/root
mount -t tmpfs tmpfs /mnt/root/run
mount -t tmpfs tmpfs /mnt/root/tmp
mount -t devtmpfs devtmpfs /mnt/root/dev
mkdir /mnt/root/try
mount -t hostfs -o $scratch none /mnt/root/try
cp /mnt/root/try/polyest-try.* /mnt/root/etc/systemd/system/
# Where services are not to be started by packages, here they are.
rm -f /mnt/root/usr/sbin/policy-rc.d /mnt/root/.dockerenv
umount /proc
# In the place of the root itself: there are no user namespaces in a mere chroot.
cd /mnt/root
mount --move . /
exec chroot . /lib/systemd/systemd --unit=polyest-try.target --show-status=0
END
chmod +x "$scratch/init"

# Starts only the system's own services and polyest's: the machine's other services stay out.
cat >"$scratch/polyest-try.target" <<'END'
[Unit]
Requires=basic.target
Wants=polyest-try.service
END
cat >"$scratch/polyest-try.service" <<'END'
[Unit]
After=basic.target
[Service]
Type=oneshot
ExecStart=/bin/bash /try/under_systemd.sh
ExecStopPost=/bin/systemctl poweroff --force --force
StandardOutput=append:/try/output
StandardError=append:/try/output
END

boot_uml "$timeout_s" mem=1536M rw
if [[ ! -e "$scratch/passed" ]]; then
  echo "--- the end of the console" >&2
  tail -n 30 "$scratch/console" >&2
  fail "the package does not hold under systemd"
fi
