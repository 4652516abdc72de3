#!/bin/bash
# Renders the training scenes and writes their caches:  WORK=FOLDER RENDERER=FOLDER train/render.sh [SCENE...]
# A scene is desk101, bench102, flat113...: a layout and its seed, which is at least 100 (those below
# are tests). What exists is not made again. One process with THREADS threads at a time.
set -e
here=$(cd "$(dirname "$0")" && pwd)
WORK=$(realpath -m "${WORK:?a folder for renders, caches and checkpoints}")
RENDERER=$(realpath "${RENDERER:?the folder of build_scene.py and raster.cpp}")
THREADS=${THREADS:-2} PYTHON=${PYTHON:-/usr/bin/python3} B=$WORK/build RAW=$WORK/raw
[ $# -gt 0 ] || set -- flat113 desk101 flat130 desk103 bench102 flat131 bench104 desk105
mkdir -p "$B" "$RAW" "$WORK/cache"
cd "$RENDERER"
[ -x "$B/raster" ] || g++ -O3 -march=native -ffast-math -std=c++17 -pthread raster.cpp -o "$B/raster"

note() { echo "$(date +%T) $*"; }

bake() { # folder seed layout samples [--moved]
  [ -f "$B/$1/scene.bin" ] && return
  mkdir -p "$B/$1"
  nice -n 19 blender -b -t "$THREADS" -P build_scene.py -- --seed "$2" --layout "$3" --build "$B/$1" \
    --bake-samples "$4" $5 > "$B/$1/build.log" 2>&1
  note "baked $1"
}

frames() { # folder of the build, sequence, every how many frames
  mkdir -p "$RAW/$1_$2"
  nice -n 19 "$B/raster" "$B/$1/scene.bin" "$B/$1/poses_$2.txt" "$RAW/$1_$2" 0 1000000 "$3" "$THREADS"
  rm -f "$RAW/$1_$2"/*.pgm
}

for scene; do
  layout=${scene%%[0-9]*} seed=${scene##*[a-z]}
  [ "$seed" -ge 100 ] || { echo "$scene: seeds below 100 are tests" >&2; exit 1; }
  [ -f "$WORK/cache/$scene.npz" ] && continue
  if [ "$layout" = flat ]; then      # two days of one flat are one world
    bake "$scene" "$seed" flat 16
    "$PYTHON" flat_paths.py walk_a "$seed" "$B/$scene/poses_walk_a.txt"
    frames "$scene" walk_a 7
    mkdir -p "$B/${scene}_moved"
    [ -d "$B/${scene}_moved/tex" ] || cp -r "$B/$scene/tex" "$B/${scene}_moved/"
    bake "${scene}_moved" "$seed" flat 16 --moved
    "$PYTHON" flat_paths.py walk_b "$seed" "$B/${scene}_moved/poses_walk_b.txt"
    frames "${scene}_moved" walk_b 5
    parts="${scene}:walk_a ${scene}_moved:walk_b"
  else
    bake "$scene" "$seed" "$layout" 24
    parts=
    for s in query_around:3 map_front:6 query_nearfar:3; do
      "$PYTHON" trajectories.py "${s%:*}" "$seed" "$B/$scene/poses_${s%:*}.txt"
      frames "$scene" "${s%:*}" "${s#*:}"
      parts="$parts $scene:${s%:*}"
    done
  fi
  note "rendered $scene"
  nice -n 19 "$PYTHON" "$here/data.py" "$WORK" "$scene" $parts
  for p in $parts; do rm -r "$RAW/${p/:/_}"; done
  note "cached $scene"
done
