#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The player that was built for 64-bit Arm (scripts/test_arm64) draws, under qemu, the pictures of
# this processor's: at rest and poked, by every light, from several views, by both solvers. Without
# that player or qemu it says what was left out.
source "$(dirname "$0")/assert.sh"
arm=$SOURCE/build/player-arm64/bin/organplay sysroot=$SOURCE/build/arm64-sysroot
if [ ! -x "$arm" ] || ! command -v qemu-aarch64 >/dev/null; then
  echo "SKIPPED: the player for Arm is not built (scripts/test_arm64)"
  exit 0
fi
organplay() { "$BIN/organplay" "$@"; }
arm() { qemu-aarch64 -L "$sysroot" "$arm" "$@"; }

{ quick_recipe; echo 'mechanics: {fem: true}'; } >r.yaml
expect 0 organbake bake r.yaml -o organ --no-report

script() {  # LIGHT SOLVER
  cat <<END
{"schema": "organbake/interaction/1", "name": "arm", "time_step_s": 0.016666666666666666, "frames": 12,
 "size": [320, 240], "light": "$1", "solver": "$2",
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": -0.5, "elevation_rad": 0},
                          {"frame": 11, "azimuth_rad": 3, "elevation_rad": 0.5}]},
 "instruments": [
  {"name": "probe", "mode": "poke", "path": [
   {"time_s": 0, "direction": [0, -1, 0], "depth_mm": -2}, {"time_s": 0.1, "direction": [0, -1, 0], "depth_mm": 8},
   {"time_s": 9, "direction": [0, -1, 0], "depth_mm": 8}]}]}
END
}
for light in baked world scope; do
  for solver in springs fem; do
    script $light $solver >script.json
    rm -rf here there
    expect 0 arm organ --script script.json --out there --threads 1
    # One level of 255 in one channel of thirty pixels; most frames are the same bytes.
    expect 0 organplay organ --script script.json --out here --reference there --threshold-db 80
  done
done
if cmp -s here/frame_0000.png here/frame_0011.png; then fail "nothing moved"; fi
