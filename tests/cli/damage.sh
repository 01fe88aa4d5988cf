#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A byte flipped in any file of a bundle: verify (and the player) exit 65 and name the file.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --set bundle.surface=true --set place.count=2
expect 0 organbake verify b
cat >script.json <<END
{"schema": "organbake/interaction/1", "name": "rest", "time_step_s": 0.02, "frames": 1,
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]}, "instruments": []}
END
play() { "$BIN/organplay" b --script script.json --out frames --size 64x48; }
expect 0 organbake verify script.json
if [ -x "$BIN/organplay" ]; then expect 0 play; fi

flip() {  # FILE OFFSET: the lowest bit of one byte
  local byte
  byte=$(od -An -tu1 -j "$2" -N1 "$1")
  printf "\\$(printf %03o $((byte ^ 1)))" | dd of="$1" bs=1 seek="$2" conv=notrunc status=none
}
RANDOM=11
cp -r b good
for file in $(cd good && find . -type f | sort); do
  size=$(stat -c %s "good/$file")
  for offset in 0 $((size / 2)) $((RANDOM * 32768 % size + RANDOM % 7)) $((size - 1)); do
    [ $offset -ge "$size" ] && offset=$((size - 1))
    cp "good/$file" "b/$file"
    flip "b/$file" "$offset"
    expect 65 organbake verify b
    expect_err "${file#./}"
    # The player reads neither the report nor, without --compare, the surface.
    if [ -x "$BIN/organplay" ] && [ "$file" != ./report.json ] && [ "$file" != ./surface.ply ]; then
      expect 65 play
      expect_err "${file#./}"
    fi
  done
  cp "good/$file" "b/$file"
done
expect 0 organbake verify b

rm b/cam_000/depth.exr
expect 65 organbake verify b
expect_err "cam_000/depth.exr"
cp good/cam_000/depth.exr b/cam_000/
echo stray >b/stray.txt
expect 65 organbake verify b
expect_err "stray.txt"
