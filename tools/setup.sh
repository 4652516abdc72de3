#!/usr/bin/env bash
# Installs missing packages for building, on Debian 12 and 13 and Ubuntu 24.04. Does nothing if none is missing.
#   --tests     also those that the tests and benchmarks need
#   --python    those of the Python module (also with --tests)
#   --packages  those of tools/packages
#   --arm64     those of arm64, with a cross compiler and qemu-user (tools/arm64_test); adds arm64 to the architectures of the system
#   --optional  packages without which some tests are skipped: Chromium, npm and the packages of web/ (the viewer's page), clang-format 14,
#               PostgreSQL and HAProxy (the service; they are installed without being started), abigail-tools and doxygen (the library's interface),
#               zsh (the completions)
set -euo pipefail
cd "$(dirname "$0")/.."

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)

if [ "${1:-}" = --optional ]; then
  # install COMMAND PACKAGE...: installs the packages if the command is missing. False if they are not available.
  install() {
    command -v "$1" >/dev/null && return
    shift
    echo "setup: installing with apt-get: $*"
    { "${as_root[@]}" apt-get -q -y update && "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y install --no-install-recommends "$@"; } >/dev/null 2>&1 ||
      { echo "setup: $* cannot be installed; the tests that need it are skipped" >&2; return 1; }
  }
  install clang-format-14 clang-format-14 || true
  # Tests start servers of their own.
  policy=/usr/sbin/policy-rc.d
  if [ ! -e $policy ] && { [ ${#as_root[@]} -eq 0 ] || command -v sudo >/dev/null; }; then
    trap '"${as_root[@]}" rm -f $policy' EXIT
    { printf '#!/bin/sh\nexit 101\n' | "${as_root[@]}" tee $policy && "${as_root[@]}" chmod 755 $policy; } >/dev/null
  fi
  install /usr/lib/postgresql/*/bin/initdb postgresql || true
  install /usr/sbin/haproxy haproxy || true
  install abidw abigail-tools || true
  install doxygen doxygen || true
  install zsh zsh || true
  command -v chromium-browser >/dev/null || install chromium chromium || exit 0
  install npm nodejs npm || exit 0
  if [ ! -d web/node_modules/playwright-core ] || [ web/package-lock.json -nt web/node_modules/.package-lock.json ]; then
    (cd web && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error >/dev/null 2>&1) ||
      echo "setup: npm ci in web/ failed; the tests of the viewer's page are skipped" >&2
  fi
  exit 0
fi

packages=(
  g++ cmake ninja-build                                                     # build
  libeigen3-dev libopencv-dev libceres-dev libhwy-dev                       # linear algebra, images and networks, least squares, SIMD
  libsqlite3-dev nlohmann-json3-dev libyaml-cpp-dev                         # map file, detections, configuration
  libcli11-dev libspdlog-dev libfmt-dev libboost-dev                        # command line, messages, the viewer's server (Beast)
  pkg-config libavformat-dev libavcodec-dev libavutil-dev libexif-dev       # time stamps of videos, metadata of videos and images
  libassimp-dev                                                             # models of virtual content
  libssl-dev libpq-dev libgeographiclib-dev                                 # the service: digests, maps in PostgreSQL, geographic coordinates
)
if [[ ${1:-} =~ ^--(python|tests|packages)$ ]]; then
  packages+=(python3-dev pybind11-dev python3-numpy)                        # the Python module
fi
if [ "${1:-}" = --packages ]; then
  packages+=(dpkg-dev file)                                                 # what CPack asks
fi
if [ "${1:-}" = --tests ]; then
  packages+=(
    libgtest-dev libgmock-dev libbenchmark-dev python3                      # tests and benchmarks
    assimp-utils colmap ffmpeg                                              # readers of what is exported, writer of videos
    curl                                                                    # requests of docs/service.md
    python3-pytest python3-pip python3-venv python3-opencv python3-matplotlib mypy  # the Python module and its examples
  )
fi

if [ "${1:-}" = --arm64 ]; then
  for i in "${!packages[@]}"; do
    case "${packages[i]}" in
      libeigen3-dev | libcli11-dev) ;;                                      # headers for every processor
      lib*) packages[i]+=:arm64 ;;
      g++) packages[i]=g++-aarch64-linux-gnu ;;
    esac
  done
  packages+=(libgtest-dev:arm64 libgmock-dev:arm64 qemu-user)
  "${as_root[@]}" dpkg --add-architecture arm64
fi

if ! command -v dpkg-query >/dev/null; then
  echo "setup: not a Debian or Ubuntu system; install the equivalents of: ${packages[*]}" >&2
  exit 0
fi

installed() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null || true)" = installed ]; }
log=$(mktemp)
trap 'rm -f "$log"' EXIT
apt() {
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y "$@" >"$log" 2>&1 || {
    tail -n 20 "$log" >&2
    echo "setup: apt-get $1 failed (on Ubuntu, some of these are in 'universe': sudo add-apt-repository universe)" >&2
    return 1
  }
}
# add PACKAGE...
add() {
  [ ${#as_root[@]} -eq 0 ] || command -v sudo >/dev/null || { echo "setup: needs root or sudo to install: $*" >&2; return 1; }
  echo "setup: installing with apt-get${as_root:+ (sudo)}: $*"
  apt update && apt install --no-install-recommends "$@" && echo "setup: done"
}

missing=()
for package in "${packages[@]}"; do
  installed "$package" || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] || add "${missing[@]}"

# Runs networks in less than half the time of OpenCV. Debian 13 has it, Debian 12 and Ubuntu 24.04 do not.
if [ "${1:-}" != --arm64 ] && ! installed libonnxruntime-dev && apt-cache show libonnxruntime-dev >/dev/null 2>&1; then
  add libonnxruntime-dev || echo "setup: without libonnxruntime-dev OpenCV runs the networks" >&2
fi
