#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Finite elements in the springs' place: baked unless refused, played by either solver.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o springs --set mechanics.fem=false
expect 0 organbake bake r.yaml -o b --set mechanics.poisson_ratio=0.4
expect 0 organbake verify b
grep -q '"tetrahedra"' b/mechanics.json || fail "no tetrahedra were baked"
grep -q '"tetrahedra"' springs/mechanics.json && fail "tetrahedra were baked and not asked for"
expect 0 organbake bake r.yaml -o again --set mechanics.poisson_ratio=0.4
cmp -s b/mechanics.json again/mechanics.json || fail "another bake has other tetrahedra"

expect 2 organbake mechanics b/proxy.ply -o made.json --fem --poisson-ratio 0.5
expect_err "--poisson-ratio: '0.5' is not possible"
expect_gone made.json

if [ -x "$BIN/organplay" ]; then
  cat >poke.json <<END
{"schema": "organbake/interaction/1", "name": "poke", "time_step_s": 0.02, "frames": 12,
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]},
 "instruments": [{"name": "probe", "mode": "poke",
   "path": [{"time_s": 0, "direction": [0, -1, 0], "depth_mm": -1},
            {"time_s": 0.2, "direction": [0, -1, 0], "depth_mm": 12}]}]}
END
  play() { "$BIN/organplay" "$1" --script poke.json --report "$3.json" --out "$3" --size 64x48 --solver "$2" "${@:4}"; }
  expect 0 organbake verify poke.json
  expect 0 play b fem one
  expect 0 play b fem two --threads 1
  expect_same one two
  expect 0 play b springs other
  cmp -s one/frame_0011.png other/frame_0011.png && fail "both solvers draw the same frame"
  grep -q '"solver": "fem"' one.json || fail "the report does not say fem"
  grep -q '"solver": "springs"' other.json || fail "the report does not say springs"
  grep -q '"recovered": true' one.json && fail "the tissue was lost"
  # Of whatever solver nobody names, finite elements where there are tetrahedra.
  expect 0 "$BIN/organplay" b --script poke.json --out usual --report usual.json --size 64x48
  expect_err "solver: finite elements ("
  expect_same one usual
  expect 0 "$BIN/organplay" springs --script poke.json --out plain --report plain.json --size 64x48
  expect_err "solver: springs"
  grep -q '"solver": "springs"' plain.json || fail "without tetrahedra the report does not say springs"
  expect 2 play springs fem none
  expect_err "mechanics.fem=false"
  expect_gone none
  expect 2 play b cloth none
fi
