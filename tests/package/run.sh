#!/usr/bin/env bash
# Tries the Debian packages in a clean Debian 12: installs an older version, starts the daemon as its
# user, streams the demo record to it, upgrades, goes on with the same session, removes, installs
# again, purges, and builds a program with libpolyest-dev.
#
#   tests/package/run.sh [--packages FOLDER] [--older FOLDER] [--without-dev]
#
#   --packages FOLDER  where deploy/package.sh has put the packages; build/package by default
#   --older FOLDER     where the packages of the last release are; without it, the older version is
#                      the same program under a smaller version number
#   --without-dev      leave libpolyest-dev out, whose dependencies are 400 MB
#
# For root; needs what deploy/install-packages.sh --package installs, and Debian's registry. The clean
# system is made once, in build/package/bookworm. Takes about three minutes, the first time five.
# Everything it starts, and all its mounts, end with it. Exit status 0 when everything held.
set -euo pipefail

here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
source_folder="$(cd "$here/../.." && pwd)"
packages="$source_folder/build/package"
older=""
with_dev=1

usage() { sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; }
say() { echo "==> $*" >&2; }
fail() {
  echo "run.sh: $*" >&2
  exit "${status:-1}"
}
need_value() { [[ $# -ge 2 ]] || status=2 fail "$1 needs a value"; }

arguments=("$@")
while [[ $# -gt 0 ]]; do
  case "$1" in
    --packages) need_value "$@"; packages="$2"; shift 2 ;;
    --older) need_value "$@"; older="$2"; shift 2 ;;
    --without-dev) with_dev=0; shift ;;
    --help) usage; exit 0 ;;
    *) status=2 fail "unknown argument '$1'; see --help" ;;
  esac
done
[[ $EUID -eq 0 ]] || status=2 fail "run it as root"
command -v debootstrap >/dev/null ||
  status=2 fail "there is no debootstrap: deploy/install-packages.sh --package"
newest() { ls -t "$1/$2"_*_amd64.deb 2>/dev/null | head -n 1; }
package="$(newest "$packages" polyest)"
dev_package="$(newest "$packages" libpolyest-dev)"
[[ -n "$package" && -n "$dev_package" ]] || status=2 fail "no packages in $packages: deploy/package.sh"

# Runs in its own mount namespace, so that nothing stays mounted whatever happens.
if [[ -z "${POLYEST_OWN_MOUNTS:-}" ]]; then
  POLYEST_OWN_MOUNTS=1 exec unshare --mount --propagation private "${BASH_SOURCE[0]}" "${arguments[@]}"
fi

clean="$source_folder/build/package/bookworm"
tree="$(mktemp --directory --tmpdir="$(dirname "$clean")" 2>/dev/null || mktemp --directory)"
finish() {
  umount "$tree/proc" "$tree/var/cache/apt/archives" 2>/dev/null || true
  rm -rf --one-file-system "$tree"
}
trap finish EXIT

if [[ ! -e "$clean/.complete" ]]; then
  say "making a clean Debian 12 (once)"
  rm -rf "$clean"
  mkdir -p "$clean"
  debootstrap --variant=minbase bookworm "$clean" http://deb.debian.org/debian >"$clean.log" ||
    fail "debootstrap failed: $clean.log"
  touch "$clean/.complete"
fi
# Makes a clean system in $tree.
begin() {
  cp --archive --reflink=auto "$clean/." "$tree"
  mount -t proc proc "$tree/proc"
  mkdir -p "$clean.downloads"
  mount --bind "$clean.downloads" "$tree/var/cache/apt/archives"
}
end() {
  umount "$tree/proc" "$tree/var/cache/apt/archives"
  rm -rf --one-file-system "$tree"
  mkdir "$tree"
}

begin
# Packages must not start services here: the script does it.
printf '#!/bin/sh\nexit 101\n' >"$tree/usr/sbin/policy-rc.d"
chmod +x "$tree/usr/sbin/policy-rc.d"
mkdir "$tree/try"
cp "$package" "$tree/try/polyest.deb"
cp "$dev_package" "$tree/try/libpolyest-dev.deb"
cp "$here/in_clean_root.sh" "$tree/try/"
cp -r "$source_folder/client/examples" "$source_folder/tests/integration/consumer/project" "$tree/try/"
if [[ -n "$older" ]]; then
  older_package="$(newest "$older" polyest)"
  [[ -n "$older_package" ]] || status=2 fail "no polyest_*_amd64.deb in $older"
  cp "$older_package" "$tree/try/older.deb"
else
  dpkg-deb --raw-extract "$package" "$tree/try/older"
  sed -i 's/^Version: .*/Version: 0.0.1-1/' "$tree/try/older/DEBIAN/control"
  dpkg-deb --build "$tree/try/older" "$tree/try/older.deb" >/dev/null
fi

inside() {
  chroot "$tree" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
    DEBIAN_FRONTEND=noninteractive bash /try/in_clean_root.sh "$@"
}
# Gives the daemon and its clients their own network, so that no port can be in use.
offline() {
  unshare --net --pid --fork --kill-child bash -c 'ip link set lo up && "$@"' offline \
    chroot "$tree" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
    bash /try/in_clean_root.sh "$@"
}

say "installing the older version"
inside install older
say "streaming the demo record to it"
offline stream 0 60
say "upgrading it, with its data and its configuration"
inside upgrade
offline stream 60 100
say "estimating with each build of the core that this processor can run"
offline levels
say "removing it, which keeps data and configuration"
inside remove
say "installing it again: the session is there"
inside install polyest
offline stream 100 150
say "purging it"
inside purge
if ((with_dev)); then
  say "building a program with libpolyest-dev"
  inside build
fi

# There is no container engine: carries out the file's instructions one after the other, in another
# clean system.
containerfile="$source_folder/deploy/container/Containerfile"
instruction() { # NAME
  awk -v name="$1" '
    $1 == name { inside = 1; sub("^" name " *", "") }
    inside { more = sub(/\\$/, ""); sub(/--mount=[^ ]*/, ""); print; inside = more }' "$containerfile" |
    tr '\n' ' '
}
say "carrying out the Containerfile"
end
begin
mkdir "$tree/packages" "$tree/try"
cp "$package" "$tree/packages/"
cp "$here/in_clean_root.sh" "$tree/try/"
chroot "$tree" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin sh -ec "$(instruction RUN)" \
  >"$tree/try/log" 2>&1 || fail "RUN fails: $(tail -n 20 "$tree/try/log")"
[[ "$(instruction ENV)" == "STATE_DIRECTORY=/var/lib/polyest " ]] || fail "sessions are not in the volume"
[[ "$(instruction USER)" == "polyest " ]] || fail "the container does not run as polyest"
read -ra command <<<"$(tr -d '[],"' <<<"$(instruction ENTRYPOINT) $(instruction CMD)")"
offline container "${command[@]}"
say "all of it holds"
