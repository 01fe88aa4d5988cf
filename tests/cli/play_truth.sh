#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The truth beside the frames of a script and of one view, two eyes, and cameras that were recorded.
source "$(dirname "$0")/assert.sh"
[ -x "$BIN/organplay" ] || { echo "SKIPPED: organplay was not built"; exit 0; }
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o b --quiet
# The trocar is told: one that is chosen hangs on the views, which the right eye has others of.
cat >s.json <<'END'
{"schema": "organbake/interaction/1", "name": "s", "time_step_s": 0.02, "frames": 3, "size": [96, 64],
 "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0},
                          {"frame": 2, "azimuth_rad": 0.2, "elevation_rad": 0}]},
 "instruments": [{"name": "probe", "mode": "poke", "trocar_mm": [60, -200, 300],
   "path": [{"time_s": 0, "direction": [0, -1, 0], "depth_mm": -1},
            {"time_s": 0.2, "direction": [0, -1, 0], "depth_mm": 12}]}]}
END
play() { "$BIN/organplay" "$@" --quiet; }

expect 0 play b --script s.json --out plain
expect 0 play b --script s.json --out all --layers all --stereo-mm 5
for f in 0 1 2; do
  cmp -s plain/frame_000$f.png all/frame_000$f.png || fail "frame $f is another with its truth"
  for layer in depth.exr flow.exr normals.exr mask.png id.exr weight.exr; do
    for eye in . right; do
      [ -s "all/$eye/${layer%.*}_000$f.${layer#*.}" ] || fail "$eye lacks $layer of frame $f"
    done
  done
done
expect_equal "$(wc -l <all/scenes.jsonl)" 3
expect 0 organbake verify all/cameras.json
expect 0 organbake verify s.json
# Again, with one thread, and over what is there.
cp -r all first
expect 0 play b --script s.json --out all --layers all --stereo-mm 5 --threads 1
expect_same first all

# What was recorded plays back, named by the script or on the command line.
expect 0 play b --script s.json --out again --cameras all/cameras.json
for f in 0 1 2; do cmp -s plain/frame_000$f.png again/frame_000$f.png || fail "frame $f played back differs"; done
sed 's|"camera": {.*|"camera": {"recorded": "all/right/cameras.json"},|; /"frame": 2, "azimuth/d' s.json >right.json
expect 0 organbake verify right.json
expect 0 play b --script right.json --out eye
for f in 0 1 2; do cmp -s all/right/frame_000$f.png eye/frame_000$f.png || fail "the right eye's frame $f differs"; done
sed -i 's/"frames": 3/"frames": 4/' right.json
refuse() {  # CODE TEXT ARGUMENTS…
  local code=$1 text=$2
  shift 2
  expect "$code" play "$@"
  expect_err "$text"
  expect_sentence
}
refuse 2 "holds 3 cameras for 4 frames" b --script right.json --out made

# One view.
expect 0 play b -o v.png --size 80x60 --layers depth,mask --stereo-mm 4
for file in v.png v_depth.exr v_mask.png v_right.png v_right_depth.exr v_right_mask.png v_cameras.json; do
  [ -s $file ] || fail "$file is missing"
done
expect 0 play b -o w.png --cameras v_cameras.json
cmp -s v.png w.png || fail "the view played back differs"

# From so many millimetres before the tissue in the middle of the view.
for mm in 40 120; do
  expect 0 play b -o near_$mm.png --size 81x61 --view-deg 20,10 --distance-mm $mm --layers depth
done
python3 - <<'END' || fail "the eyes are not 80 mm apart along the view"
import json
def translation(mm):
    return json.load(open(f"near_{mm}_cameras.json"))["cameras"][0]["camera_from_world"]["translation_mm"]
apart = [far - near for near, far in zip(translation(40), translation(120))]
assert abs(apart[2] - 80) < 0.1 and abs(apart[0]) < 0.01 and abs(apart[1]) < 0.01, apart
END

# Both eyes in one picture are the two single ones side by side, of a view, of a script with its
# tools, and through a lens.
halves() {  # BOTH LEFT RIGHT
  PYTHONPATH=$SOURCE/tests/cli python3 - "$@" <<'END' || fail "$1 is not $2 beside $3"
import sys
from read_png import png
both, left, right = (png(file)[4] for file in sys.argv[1:])
sys.exit(both != [a + b for a, b in zip(left, right, strict=True)])
END
}
expect 0 play b -o both.png --size 80x60 --stereo-mm 4 --side-by-side
halves both.png v.png v_right.png
expect 0 play b --script s.json --out eyes --side-by-side --threads 1
for f in 0 1 2; do halves eyes/frame_000$f.png all/frame_000$f.png all/right/frame_000$f.png; done

# Through the lens of a scope: its size, its cameras, the same bytes for any number of threads.
cat >lens.json <<'END'
{"width": 80, "height": 60, "fx": 70, "fy": 70, "cx": 41, "cy": 29,
 "distortion_k1_k2_p1_p2_k3": [-0.2, 0.03, 0.001, 0.001, 0], "vignette_exponent": 3}
END
expect 0 play b -o l.png --scope lens.json --layers depth,normals,mask,id,weight --stereo-mm 4
for file in l.png l_depth.exr l_normals.exr l_mask.png l_right.png; do [ -s $file ] || fail "$file is missing"; done
grep -q '"distortion_k1_k2_p1_p2_k3"' l_cameras.json || fail "the cameras lack the distortion"
expect 0 organbake verify l_cameras.json
expect 0 play b -o both.png --scope lens.json --stereo-mm 4 --side-by-side
halves both.png l.png l_right.png
expect 0 play b --script s.json --out lens --scope lens.json --layers all --stereo-mm 5
cp -r lens first_lens
expect 0 play b --script s.json --out lens --scope lens.json --layers all --stereo-mm 5 --threads 1
expect_same first_lens lens
cmp -s all/frame_0000.png lens/frame_0000.png && fail "the lens does nothing"
# What was seen through the lens plays back through it.
expect 0 play b --script s.json --out again --cameras lens/cameras.json --scope lens.json
for f in 0 1 2; do cmp -s lens/frame_000$f.png again/frame_000$f.png || fail "frame $f through the lens differs"; done
refuse 2 "has lens distortion" b --script s.json --out made --cameras lens/cameras.json
# A cavity's wall lies behind what is lit at the scope, on pictures alone.
expect 0 play b -o wall.png --scope lens.json --light scope --layers depth
expect 0 play b -o alone.png --scope lens.json --light scope --layers depth --background plain
cmp -s wall.png alone.png && fail "no wall behind the organ"
cmp -s wall_depth.exr alone_depth.exr || fail "the wall is in the truth"
expect 0 play b -o baked.png --scope lens.json --light baked
expect 0 play b -o baked_alone.png --scope lens.json --light baked --background plain
cmp -s baked.png baked_alone.png || fail "a wall behind the baked light"
sed 's/-0.2/-9/' lens.json >folded.json
refuse 65 "folds the picture" b -o m.png --scope folded.json
sed 's/"fx"/"focal"/' lens.json >odd.json
refuse 65 "focal" b -o m.png --scope odd.json
refuse 66 "no-lens.json" b -o m.png --scope no-lens.json
refuse 2 "scope needs" b --scope lens.json --sheet m.png

refuse 2 "'deep' is no layer" b -o x.png --layers deep
refuse 2 "one picture does not move" b -o x.png --layers flow
refuse 2 "need --script with --out DIR, or -o FILE" b --script s.json --report x.json --layers depth
refuse 2 "makes no stereo" b --script s.json --out made --stereo-mm 0
for mm in 0 -5 0.005 2000; do refuse 2 "$mm mm makes no stereo; endoscopes have 4 to 6" b -o x.png --stereo-mm $mm --side-by-side; done
refuse 2 "--side-by-side is for pictures alone" b -o x.png --side-by-side --layers depth
refuse 2 "--side-by-side needs --script with --out DIR" b --sheet x.png --side-by-side
refuse 2 "draws one eye alone" b --bench 2 --side-by-side
refuse 2 "do not go with --warp paper" b -o x.png --layers depth --warp paper
expect_gone made
expect_gone x.png
