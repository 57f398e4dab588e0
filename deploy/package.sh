#!/usr/bin/env bash
# Makes the Debian packages polyest (daemon, command, systemd unit, man pages, shell completion) and
# libpolyest-dev (headers, libraries, CMake configuration, protocol files) for amd64.
#
#   deploy/package.sh [--output FOLDER] [--version VERSION]
#
#   --output FOLDER    where the packages go; build/package by default
#   --version VERSION  of the packages; by default CMake's, with Debian's revision 1
#
# The programs run on every x86-64-v2 processor (2009 and later). The core, where the time goes, is
# built for v2, v3 (AVX2) and v4 (AVX-512), and the dynamic loader takes the best that the processor
# has. $DEBFULLNAME and $DEBEMAIL name the maintainer. Ends with lintian, whose errors are failures.
set -euo pipefail

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
work="$root/build/package"
output="$work"
version=""
levels=(x86-64-v2 x86-64-v3 x86-64-v4)

say() { echo "==> $*" >&2; }

usage() { sed -n '2,/^set /{/^#/s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; }

need_value() {
  if [[ $# -lt 2 ]]; then
    echo "package.sh: $1 needs a value" >&2
    exit 2
  fi
}

while [[ $# -gt 0 ]]; do
  case "$1" in
    --output) need_value "$@"; output="$(realpath -m "$2")"; shift 2 ;;
    --version) need_value "$@"; version="$2"; shift 2 ;;
    --help) usage; exit 0 ;;
    *)
      echo "package.sh: unknown argument '$1'" >&2
      usage >&2
      exit 2
      ;;
  esac
done

# Builds with Debian's own flags, so that the packages are hardened, but without debug information.
build() { # LEVEL TARGET...
  local level="$1"
  shift
  say "building for $level"
  (
    export DEB_CXXFLAGS_MAINT_STRIP=-g DEB_CXXFLAGS_MAINT_APPEND="-ffile-prefix-map=$root=."
    export DEB_BUILD_MAINT_OPTIONS="hardening=+all" DEB_LDFLAGS_MAINT_APPEND=-Wl,-z,defs
    cmake -S "$root" -B "$work/$level" -G Ninja \
      -D CMAKE_BUILD_TYPE=Release \
      -D CMAKE_UNITY_BUILD=ON -D CMAKE_UNITY_BUILD_BATCH_SIZE=16 \
      -D CMAKE_CXX_FLAGS="$(dpkg-buildflags --get CXXFLAGS) $(dpkg-buildflags --get CPPFLAGS)" \
      -D CMAKE_EXE_LINKER_FLAGS="$(dpkg-buildflags --get LDFLAGS)" \
      -D CMAKE_SHARED_LINKER_FLAGS="$(dpkg-buildflags --get LDFLAGS)" \
      -D CMAKE_INSTALL_PREFIX=/usr \
      -D CMAKE_INSTALL_LIBDIR="lib/$(dpkg-architecture --query DEB_HOST_MULTIARCH)" \
      -D CMAKE_INSTALL_LIBEXECDIR=libexec \
      -D POLYEST_ARCHITECTURE="$level" \
      -D POLYEST_BUILD_TESTS=OFF \
      -D POLYEST_SHARED_CORE=ON >&2
  )
  cmake --build "$work/$level" --parallel "$(nproc)" --target "$@" >&2
}

# Makes Debian's folder in a tree of its own: the sources were built elsewhere.
make_debian_folder() {
  local maintainer="${DEBFULLNAME:-polyest developers} <${DEBEMAIL:-polyest@users.noreply.github.com}>"
  local changed
  changed="$(git -C "$root" log -1 --format=%cD 2>/dev/null || date --rfc-email)"
  rm -rf "$work/tree"
  mkdir -p "$work/tree"
  cp -r "$root/deploy/debian" "$work/tree/debian"
  cd "$work/tree"
  cp "$root/deploy/systemd/polyestd.service" debian/polyest.polyestd.service
  cp "$root/deploy/edge/polyest-edge.service" debian/polyest.polyest-edge.service
  cp "$root/deploy/systemd/polyest.sysusers" debian/polyest.sysusers
  cp "$root/deploy/systemd/polyest.logrotate" debian/polyest.logrotate
  sed -i "s|@MAINTAINER@|$maintainer|" debian/control
  mkdir examples
  cp -r "$root"/client/examples/{*.{json,csv,md},umbridge} examples
  cat >debian/changelog <<END
polyest ($version) bookworm; urgency=medium

  * Package what CHANGELOG.md describes.

 -- $maintainer  $changed
END
}

make_packages() {
  say "making the packages"
  LEVELS="${levels[*]}" SOURCE="$root" BUILD="$work" \
    dpkg-buildpackage --build=binary --no-sign --no-check-builddeps --no-pre-clean >&2
  mkdir -p "$output"
  for package in polyest libpolyest-dev; do
    [[ "$output" == "$work" ]] || mv -f "$work/${package}_${version}_amd64.deb" "$output"
    packages+=("$output/${package}_${version}_amd64.deb")
  done
}

"$root/deploy/install-packages.sh" --package
build x86-64-v2 all
for level in "${levels[@]:1}"; do build "$level" polyest_shared_core; done
if [[ -z "$version" ]]; then
  version="$(sed -n 's/^CMAKE_PROJECT_VERSION:STATIC=//p' "$work/x86-64-v2/CMakeCache.txt")-1"
fi
make_debian_folder
packages=()
make_packages
say "checking them with lintian"
lintian --fail-on error --allow-root --suppress-tags initial-upload-closes-no-bugs "${packages[@]}" >&2
# Prints only the paths on stdout, for the caller.
printf '%s\n' "${packages[@]}"
