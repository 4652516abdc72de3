#!/usr/bin/env bash
# Installs missing packages for building, on Debian 12 and 13 and Ubuntu 24.04. Does nothing if none is missing.
#   --tests     also those that ./test needs
#   --python    those of the Python module (also with --tests)
#   --packages  those of tools/packages
#   --arm64     those of arm64, with a cross compiler and qemu-user (tools/arm64_test); adds arm64 to the architectures of the system
#   --optional  those of ./test --all, without which some tests are skipped: Chromium, npm and the packages of web/ (the pages),
#               clang-format 14, PostgreSQL and HAProxy (the service; they are installed without being started), doxygen (the
#               interface), zsh (the completions), COLMAP and Assimp (readers of what is exported), OpenCV, Matplotlib and mypy
#               (examples in Python), pip and venv (the wheel), Google Benchmark and OpenCV's features2d (benchmarks),
#               clang 16 or later (tools/fuzz), CycloneDDS and Fast DDS (the program oaslam-ros2, and its tests)
set -euo pipefail
cd "$(dirname "$0")/.."
mode=${1:-}

as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)

packages=(
  g++ cmake ninja-build                                                     # build
  libeigen3-dev libceres-dev libhwy-dev                                     # linear algebra, least squares, SIMD
  libopencv-{core,imgproc,imgcodecs,videoio,dnn}-dev                        # images, videos, networks; libopencv-dev brings VTK, Qt and GDAL
  libsqlitecpp-dev nlohmann-json3-dev libyaml-cpp-dev libprotozero-dev      # map file, detections, configuration, ONNX files
  libcli11-dev libspdlog-dev libfmt-dev libboost-dev                        # command line, messages, the viewer's server (Beast)
  pkg-config libavdevice-dev libavformat-dev libavcodec-dev libswscale-dev libavutil-dev libexif-dev  # cameras, time stamps of videos, metadata of videos and images
  libheif-dev                                                               # HEIC and AVIF photos
  libutf8proc-dev                                                           # normal forms of names
  liblz4-dev libzstd-dev libbz2-dev                                         # chunks of recordings of ROS
  libssl-dev libpq-dev                                                      # the service: digests, maps in PostgreSQL
  libcurl4-openssl-dev                                                      # oaslam models get
)
if [[ $mode =~ ^--(python|tests|packages)$ ]]; then
  packages+=(python3-dev pybind11-dev python3-numpy)                        # the Python module
fi
if [ "$mode" = --packages ]; then
  packages+=(cyclonedds-dev dpkg-dev file)  # what CPack asks
fi
if [ "$mode" = --tests ]; then
  packages+=(libgtest-dev libgmock-dev python3 python3-pytest ffmpeg curl)  # ffmpeg writes videos, curl the requests of docs/service.md
fi
if [ "$mode" = --optional ]; then
  packages=(
    libbenchmark-dev libopencv-features2d-dev
    cyclonedds-dev libfastrtps-dev
    assimp-utils colmap python3-opencv python3-matplotlib mypy python3-pip python3-venv
    clang-format-14 postgresql haproxy doxygen zsh
  )
  command -v chromium-browser >/dev/null || packages+=(chromium)
  command -v npm >/dev/null || packages+=(nodejs npm)
fi

if [ "$mode" = --arm64 ]; then
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
available() { apt-cache show "$1" >/dev/null 2>&1; }
log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Without fsync after each file: what a power cut leaves half unpacked can be installed again.
apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o Dpkg::Options::=--force-unsafe-io "$@" >"$log" 2>&1; }
update() {
  [ ${#as_root[@]} -eq 0 ] || command -v sudo >/dev/null || { echo "setup: needs root or sudo to install: $*" >&2; return 1; }
  apt update || { tail -n 20 "$log" >&2; echo "setup: apt-get update failed" >&2; return 1; }
}
install() {
  echo "setup: installing with apt-get${as_root:+ (sudo)}: $*"
  apt install --no-install-recommends "$@" && echo "setup: done"
}

missing=()
for package in "${packages[@]}"; do
  installed "$package" || missing+=("$package")
done

if [ "$mode" = --optional ]; then
  here=()
  # Packages that the suite does not have are left out, so that their lists are not fetched at each call.
  for package in "${missing[@]}"; do
    ! available "$package" && compgen -G '/var/lib/apt/lists/*Packages*' >/dev/null || here+=("$package")
  done
  if [ ${#here[@]} -gt 0 ] && update "${here[@]}"; then
    for version in 16 17 18 19; do
      if available libclang-rt-$version-dev; then here+=(clang-$version libclang-rt-$version-dev); break; fi
    done
    # Servers are installed without being started: tests start their own.
    policy=/usr/sbin/policy-rc.d
    if [ ! -e $policy ]; then
      trap '"${as_root[@]}" rm -f $policy; rm -f "$log"' EXIT
      { printf '#!/bin/sh\nexit 101\n' | "${as_root[@]}" tee $policy && "${as_root[@]}" chmod 755 $policy; } >/dev/null
    fi
    # If this fails, one at a time, so that one package does not prevent the others.
    install "${here[@]}" || for package in "${here[@]}"; do apt install --no-install-recommends "$package" || true; done
  fi
  absent=()
  for package in "${missing[@]}"; do installed "$package" || absent+=("$package"); done
  [ ${#absent[@]} -eq 0 ] || echo "setup: not installed: ${absent[*]}; the tests that need them are skipped" >&2
  if command -v npm >/dev/null && [ ! -d web/node_modules/playwright-core -o web/package-lock.json -nt web/node_modules/.package-lock.json ]; then
    (cd web && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error >/dev/null 2>&1) ||
      echo "setup: npm ci in web/ failed; the tests of the pages are skipped" >&2
  fi
  exit 0
fi

# libheif's decoders, and the encoders of the tests, are packages of their own in Debian 13 and Ubuntu 24.04.
plugins=(libde265 dav1d)
[ "$mode" != --tests ] || plugins+=(x265 aomenc)
missing_plugins() {
  [ "$mode" != --arm64 ] || return 0
  for plugin in "${plugins[@]/#/libheif-plugin-}"; do
    installed "$plugin" || ! available "$plugin" || echo "$plugin"
  done
}

# Runs networks in less than half the time of OpenCV. Debian 13 has it, Debian 12 and Ubuntu 24.04 do not.
want_onnxruntime() { [ "$mode" != --arm64 ] && ! installed libonnxruntime-dev && available libonnxruntime-dev; }
if [ ${#missing[@]} -gt 0 ] || want_onnxruntime || [ -n "$(missing_plugins)" ]; then
  update "${missing[@]}"
  ! want_onnxruntime || missing+=(libonnxruntime-dev)
  mapfile -t -O ${#missing[@]} missing < <(missing_plugins)
  install "${missing[@]}" || {
    tail -n 20 "$log" >&2
    echo "setup: apt-get install failed (on Ubuntu, some of these are in 'universe': sudo add-apt-repository universe)" >&2
    exit 1
  }
fi
