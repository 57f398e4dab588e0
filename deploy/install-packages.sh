#!/usr/bin/env bash
# Installs the packages of Debian 12 that polyest is built from, those that are missing.
#
#   deploy/install-packages.sh            to build and run
#   deploy/install-packages.sh --tests    to test, benchmark and check the formatting as well
#   deploy/install-packages.sh --sanitizers  for the fuzzers as well: Clang
#   deploy/install-packages.sh --threads  to look for races as well
#   deploy/install-packages.sh --package  to make Debian packages, and to try them
set -euo pipefail

packages=(
  build-essential cmake ninja-build ccache pkg-config
  libeigen3-dev libsundials-dev libnlopt-dev libnlopt-cxx-dev libabsl-dev libcereal-dev zlib1g-dev
  libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
  libsystemd-dev libspdlog-dev prometheus-cpp-dev libcpp-httplib-dev nlohmann-json3-dev libcli11-dev libzip-dev libpugixml-dev libsqlite3-dev libpq-dev libssl-dev
)
test_packages=(
  libgtest-dev libgmock-dev libbenchmark-dev clang-format curl openssl sqlite3 postgresql libfaketime haproxy
  python3-yaml python3-grpcio python3-protobuf python3-numpy python3-scipy
  python3-pytest python3-pandas python3-matplotlib python3-xarray python3-emcee
  mypy python3-pip python3-setuptools python3-wheel
  nodejs chromium fonts-dejavu-core
)
# Node.js of another source than Debian brings npm along, and excludes Debian's.
command -v npm >/dev/null || test_packages+=(npm)
# SUNDIALS' CMake configuration needs OpenMP of every compiler.
sanitizer_packages=(
  clang-14 libclang-rt-14-dev libomp-14-dev
)

# gRPC's CMake project requires libprotoc, whether or not it is used.
thread_packages=(
  libprotoc-dev
)
# The packages are tried in a clean root, and under systemd in a virtual machine.
packaging_packages=(
  debhelper dpkg-dev help2man lintian
  bash-completion debootstrap iproute2 kmod systemd user-mode-linux
)

say() { echo "install-packages: $*" >&2; }

is_debian_12() {
  [[ -r /etc/os-release ]] || return 1
  # shellcheck source=/dev/null
  (. /etc/os-release && [[ "${ID:-}" == debian && "${VERSION_ID:-}" == 12 ]])
}

is_installed() {
  [[ "$(dpkg-query --show --showformat='${db:Status-Status}' "$1" 2>/dev/null)" == installed ]]
}

install_missing() {
  local missing=() as_root=() package
  for package in "${packages[@]}"; do
    is_installed "$package" || missing+=("$package")
  done
  [[ ${#missing[@]} -gt 0 ]] || return 0

  if [[ $EUID -ne 0 ]]; then
    if ! command -v sudo >/dev/null; then
      say "missing packages, and neither root nor sudo to install them; as root run:"
      say "  apt-get install --no-install-recommends ${missing[*]}"
      return 1
    fi
    as_root=(sudo)
  fi
  say "installing ${missing[*]}"
  local apt_get=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive
    apt-get --quiet --quiet --option DPkg::Lock::Timeout=300)
  # apt's messages go to stderr: stdout belongs to the caller.
  "${apt_get[@]}" update </dev/null >&2 || return
  # The tests start servers of their own. The package would make one and leave it running.
  if [[ " ${missing[*]} " == *" postgresql "* ]] && ! is_installed postgresql-common; then
    "${apt_get[@]}" install --yes --no-install-recommends postgresql-common </dev/null >&2 &&
      "${as_root[@]}" sed -i 's/^#\?create_main_cluster.*/create_main_cluster = false/' \
        /etc/postgresql-common/createcluster.conf || return
  fi
  "${apt_get[@]}" install --yes --no-install-recommends "${missing[@]}" </dev/null >&2
}

for argument in "$@"; do
  case "$argument" in
    --tests) packages+=("${test_packages[@]}") ;;
    --sanitizers) packages+=("${sanitizer_packages[@]}") ;;
    --threads) packages+=("${thread_packages[@]}") ;;
    --package) packages+=("${packaging_packages[@]}") ;;
    *)
      say "unknown argument '$argument'; there are --tests, --sanitizers, --threads and --package"
      exit 2
      ;;
  esac
done

if is_debian_12; then
  install_missing
elif command -v apt-get >/dev/null && command -v dpkg-query >/dev/null; then
  say "warning: this is not Debian 12; trying packages of the same names"
  install_missing || say "warning: could not install them all; going on with what is there"
else
  say "warning: this is not Debian 12; please see that the equivalents of these are installed:"
  say "  ${packages[*]}"
fi
