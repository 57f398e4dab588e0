#!/usr/bin/env bash
# Builds Debian's own Abseil, Protocol Buffers, gRPC and cpp-httplib again, with the thread sanitizer
# in them. Without that, the sanitizer does not see how their threads synchronize, and reports data
# handed from one thread to another as a race; and messages compiled for the sanitizer have members
# that those in Debian's library lack.
#   tests/threads/build-packages.sh FOLDER
# FOLDER/lib then has the libraries, under the names of the installed ones. Takes a quarter of an
# hour on two cores the first time, then nothing.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
if [[ $# -ne 1 || $1 == -* ]]; then
  echo "tests/threads/build-packages.sh: names one folder, for the libraries" >&2
  exit 2
fi
folder="$(realpath -m "$1")"
[[ ! -e "$folder/complete" ]] || exit 0

say() { echo "build-packages: $*" >&2; }

# Fetches the sources of the installed packages with Debian's patches; apt verifies them.
fetch() {
  rm -rf "$folder/sources"
  mkdir -p "$folder/sources/lists/partial" "$folder/lib"
  cd "$folder/sources"
  echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg]" \
    "http://deb.debian.org/debian bookworm main" >sources.list
  local apt_get=(apt-get --quiet --quiet --option Dir::Etc::SourceList="$PWD/sources.list"
    --option Dir::Etc::SourceParts=/dev/null --option Dir::State::Lists="$PWD/lists")
  say "fetching the sources"
  "${apt_get[@]}" update
  "${apt_get[@]}" source abseil protobuf grpc cpp-httplib
}

# The sanitizer does not see fences, of which GCC warns: -Wno-tsan.
flags=(-O1 -fsanitize=thread -fno-omit-frame-pointer -Wno-tsan)

# build PACKAGE TARGET [OPTION-OF-CMAKE]...
build() {
  local package=$1 target=$2
  say "building $package"
  cmake -G Ninja -S "$folder/sources/$package"-*/ -B "$folder/$package" -DCMAKE_BUILD_TYPE=None \
    -DBUILD_SHARED_LIBS=ON -DCMAKE_CXX_STANDARD=17 -DCMAKE_INSTALL_PREFIX="$folder" \
    -DCMAKE_INSTALL_LIBDIR=lib -DCMAKE_C_FLAGS="${flags[*]}" -DCMAKE_CXX_FLAGS="${flags[*]}" \
    -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache "${@:3}"
  cmake --build "$folder/$package" --target "$target"
}

# Debian builds this one by Meson, as one source split off the header.
build_httplib() {
  local name=libcpp-httplib.so.0.11
  say "building cpp-httplib"
  cd "$folder"/sources/cpp-httplib-*/
  python3 ./split.py --out "$folder/httplib"
  c++ "${flags[@]}" $(pkg-config --cflags cpp-httplib) -fPIC -shared -Wl,-soname,"$name" \
    -I"$folder/httplib" "$folder/httplib/httplib.cc" -o "$folder/lib/$name" \
    -lssl -lcrypto -lz -lbrotlidec -lbrotlienc
}

fetch
build abseil install -DBUILD_TESTING=OFF
build protobuf libprotobuf -Dprotobuf_BUILD_TESTS=OFF -Dprotobuf_BUILD_PROTOC_BINARIES=OFF
cp --no-dereference "$folder"/protobuf/lib*.so* "$folder/lib"
providers=()
for provider in ABSL CARES PROTOBUF RE2 SSL ZLIB; do
  providers+=("-DgRPC_${provider}_PROVIDER=package")
done
build grpc grpc++ "${providers[@]}" -DgRPC_BUILD_TESTS=OFF -DgRPC_BUILD_CODEGEN=OFF \
  -DgRPC_INSTALL=OFF -DCMAKE_PREFIX_PATH="$folder" \
  -DCMAKE_PROJECT_INCLUDE="$here/grpc_headers.cmake"
cp --no-dereference "$folder"/grpc/lib*.so* "$folder/lib"
build_httplib
touch "$folder/complete"
