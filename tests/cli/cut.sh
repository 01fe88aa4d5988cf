#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A blade in a script: the organ comes apart, the same for any number of threads, and only where it
# can. What the cut is to look like is held by the unit tests.
source "$(dirname "$0")/assert.sh"
[ -x "$BIN/organplay" ] || { echo "SKIPPED: organplay was not built"; exit 0; }
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o springs --set mechanics.fem=false
# A cut opens from one tetrahedron to the next, and from one face of the skin to the next.
expect 0 organbake bake r.yaml -o b --set mechanics.fem_cell_mm=8 \
  --set decimate.faces=300

script() {  # MODE AXIS
  cat <<END
{"schema": "organbake/interaction/1", "name": "a cut", "time_step_s": 0.02, "frames": 20,
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0.1, "distance": 0.6}]},
 "instruments": [
   {"name": "scalpel", "mode": "$1", "radius_mm": 0.4, $2 "path": [
     {"time_s": 0.02, "direction": [-0.3, -1, 0.05], "depth_mm": 14},
     {"time_s": 0.2, "direction": [0.3, -1, 0.05], "depth_mm": 14}]},
   {"name": "forceps", "mode": "grab", "radius_mm": 4, "path": [
     {"time_s": 0.24, "direction": [0, -1, 0.2], "depth_mm": 2},
     {"time_s": 0.38, "direction": [0, -1, 0.4], "depth_mm": -3}]}]}
END
}
script cut '"axis_mm": [0, -28, 0],' >cut.json
script poke '"axis_mm": [0, -28, 0],' >poke.json
play() { "$BIN/organplay" "$1" --script "$2" --out "$3" --report "$3.json" --size 320x240 "${@:4}"; }
expect 0 organbake verify cut.json
expect 0 play b cut.json one
expect 0 play b cut.json two --solver fem --threads 1
expect_same one two
# A blade that pushes instead leaves another picture, and nothing is lost on either way.
expect 0 play b poke.json pushed --solver fem
cmp -s one/frame_0019.png pushed/frame_0019.png && fail "the blade leaves no trace"
grep -q '"recovered": true' one.json && fail "the tissue was lost"

refuse() {  # CODE TEXT ARGUMENTS…
  expect "$1" play "${@:3}" --quiet
  expect_err "$2"
  expect_sentence
  expect_gone none
}
refuse 2 "springs cannot follow" b cut.json none --solver springs
refuse 2 "mechanics.fem=false" springs cut.json none --solver fem
refuse 2 "has been cut" b cut.json none --solver fem --layers depth
script cut '' >blunt.json
refuse 65 "needs axis_mm" b blunt.json none --solver fem
script slice '"axis_mm": [0, -28, 0],' >slice.json
refuse 65 "must be 'poke', 'grab', 'cut', 'snip' or 'pierce'" b slice.json none --solver fem
