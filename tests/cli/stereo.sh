#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The two eyes of a stereo endoscope as users have them: depth, masks and a surface; what cannot be
# meant is refused in words.
source "$(dirname "$0")/assert.sh"

figure() { python3 -c 'import json, sys; print(json.load(open(sys.argv[2]))["figures"][sys.argv[1]])' "$1" "$2"; }

# A phantom's clip with both eyes, and their cameras.
expect 0 organbake phantom --kind laparoscopy --baseline-mm 4.5 --tilt-deg 30 --texture 0.3 --frames 2 \
  --frame-width-px 360 --frame-height-px 288 -o p
expect 0 organbake stereo p/frames p/right --calibration p/stereo.json -o s
for file in depth/000001.exr normals/000001.exr mask/000001.png confidence/000001.png \
  pictures/000001.png strip.png cameras.json surface.ply report.json; do
  [ -s "s/$file" ] || fail "s/$file is missing"
done
expect_equal "$(figure frames_matched s/report.json)" 2
expect_equal "$(figure frames_ok s/report.json)" 2
expect_equal "$(figure depth_unit s/report.json)" mm
expect_equal "$(figure rectified s/report.json)" "as given"
expect 0 organbake verify s/report.json
expect 0 organbake verify s/cameras.json
python3 - <<'END' || fail "the depth is not where the phantom's is (60 mm)"
import json
assert all(50 < z < 70 for z in json.load(open("s/report.json"))["figures"]["frame_median_depth"])
END

# The same bytes for any number of threads.
expect 0 organbake stereo p/frames p/right --calibration p/stereo.json --threads 1 --force -o t
expect_same s t

# The same calibration as OpenCV and as rows of text.
python3 - <<'END'
import json, os
left, right = json.load(open("p/stereo.json"))["cameras"]
def matrix(name, rows, columns, values):
    return (f"{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n"
            f"   data: [ {', '.join(repr(float(v)) for v in values)} ]\n")
def k(c): return [c["fx"], 0, c["cx"] - .5, 0, c["fy"], c["cy"] - .5, 0, 0, 1]
def yaml(t, size=""):
    return ("%YAML:1.0\n---\n" + size + matrix("K1", 3, 3, k(left)) + matrix("D1", 1, 5, [0] * 5) +
            matrix("K2", 3, 3, k(right)) + matrix("D2", 1, 5, [0] * 5) +
            matrix("R", 3, 3, [1, 0, 0, 0, 1, 0, 0, 0, 1]) + matrix("T", 3, 1, t))
open("k.yml", "w").write(yaml([-4.5, 0, 0]))
open("zero.yml", "w").write(yaml([0, 0, 0]))
open("other.yml", "w").write(yaml([-4.5, 0, 0], "image_width: 1920\nimage_height: 1080\n"))
open("metres.yml", "w").write(yaml([-0.0045, 0, 0]))
right["cy"] += 1.6
open("rows_apart.yml", "w").write(yaml([-4.5, 0, 0]))
right["cy"] -= 1.6
bent = yaml([-4.5, 0, 0]).replace(matrix("D2", 1, 5, [0] * 5), matrix("D2", 1, 5, [0.3] + [0] * 4))
open("bent.yml", "w").write(bent)
os.mkdir("rows")
for eye, c in ("left", left), ("right", right):
    v = k(c)
    open(f"rows/calib.{eye}.intrinsics.txt", "w").write(
        "\n".join(" ".join(map(repr, map(float, v[i:i + 3]))) for i in (0, 3, 6)) + "\n")
    open(f"rows/calib.{eye}.distortion.txt", "w").write("0 0 0 0 0\n")
open("rows/calib.l2r.txt", "w").write("1 0 0\n0 1 0\n0 0 1\n-4.5 0 0\n")
END
expect 0 organbake stereo p/frames p/right --calibration k.yml -o by_yaml
expect 0 organbake stereo p/frames p/right --calibration rows -o by_rows
expect 0 organbake stereo p/frames p/right --calibration metres.yml --unit m -o by_metres
expect_same by_yaml/depth by_rows/depth
expect_equal "$(figure baseline_mm by_metres/report.json)" 4.5

# One pair of pictures; what cannot be meant.
expect 0 organbake stereo p/frames/000000.png p/right/000000.png --calibration k.yml -o one
refused 65 "swapped" organbake stereo p/right/000000.png p/frames/000000.png --calibration k.yml -o made
expect 0 organbake stereo p/right/000000.png p/frames/000000.png --calibration k.yml --swap-eyes -o back
expect_same one/depth back/depth
refused 65 "0 mm apart" organbake stereo p/frames p/right --calibration zero.yml -o made
refused 65 "1920x1080" organbake stereo p/frames p/right --calibration other.yml -o made
refused 65 "--unit" organbake stereo p/frames p/right --calibration metres.yml -o made
refused 65 "one picture in a frame" organbake stereo p/frames --calibration k.yml -o made
refused 65 "of one size" organbake stereo p/frames/000000.png one/strip.png --calibration k.yml -o made
echo "a: 1" >words.yml
refused 65 "lacks the matrices" organbake stereo p/frames p/right --calibration words.yml -o made
refused 66 "no such file" organbake stereo p/frames p/right --calibration none.yml -o made
refused 66 "no such file" organbake stereo p/frames none.png --calibration k.yml -o made
refused 2 "lacks its input 'calibration'" organbake stereo p/frames p/right -o made
refused 2 "either every or sharpest" organbake stereo p/frames p/right --calibration k.yml --every 2 \
  --sharpest 2 -o made

# An eye whose clip is shorter: what there is of both is kept.
mkdir shorter && cp p/right/000000.png shorter/
expect 65 organbake stereo p/frames shorter --calibration k.yml -o kept
expect_err "has ended"
expect_equal "$(figure frames_matched kept/report.json)" 1

# Pictures that do not belong together are not ok, nor is a lens that is another, and --strict says
# so. Rows that are apart are brought together, and that is said.
expect 3 organbake stereo p/frames/000000.png p/frames/000000.png --calibration k.yml --strict -o odd
expect_err "found again by the other eye"
expect 3 organbake stereo p/frames/000000.png p/right/000000.png --calibration bent.yml --strict -o bent
expect_err "the frame's depth is judged"
expect 0 organbake stereo p/frames/000000.png p/right/000000.png --calibration rows_apart.yml --strict \
  -o apart
expect_err "px apart"
awk "BEGIN { exit !($(figure frame_rows_corrected_px apart/report.json | tr -d '[]') < -1.4) }" ||
  fail "the rows are not brought together"

# A wider --reach fills more.
share() { figure frame_filled_share "$1/report.json" | tr -d '[]'; }
for reach in 0 0.02 0.1; do
  expect 0 organbake stereo p/frames/000000.png p/right/000000.png --calibration k.yml --reach $reach \
    -o reach_$reach
done
awk "BEGIN { exit !($(share reach_0) == 0 && $(share reach_0.02) > 0 && $(share reach_0.1) > $(share reach_0.02)) }" ||
  fail "a wider reach does not fill more"

# A pair to a bundle.
cat >r.yaml <<END
schema: organbake/recipe/1
name: small pair
inputs: {left: p/frames, right: p/right, calibration: p/stereo.json}
stereo: {mesh_step_px: 4, every: 2}
decimate: {faces: 80}
mechanics: {anchor_direction: [0, 0, 1]}
place: {count: 3, size_px: 64, cone_axis: [0, 0, -1], cone_angle_deg: 17.2}
END
expect 0 organbake bake r.yaml -o bundle
expect 0 organbake verify bundle

# The lamp's beam is learned from the clip, and one eye of the same endoscope is shaded by it.
expect 0 organbake phantom --kind laparoscopy --baseline-mm 4.5 --tilt-deg 28.6 --beam 5 --frames 2 -o beamed
expect 0 organbake stereo beamed/frames beamed/right --calibration beamed/stereo.json -o with_beam
awk "BEGIN { exit !($(figure beam_exponent with_beam/report.json) > 4) }" || fail "no beam is learned"
expect 0 organbake shade beamed/frames/000000.png --lamp with_beam/lighting.json -o by_lamp
expect 2 organbake shade beamed/frames/000000.png --lamp with_beam/lighting.json --beam 3 -o twice
expect_err "told twice"

# Both eyes in one file, and as videos.
if command -v ffmpeg >/dev/null; then
  ffmpeg -v error -i p/frames/000000.png -i p/right/000000.png -filter_complex hstack beside.png
  ffmpeg -v error -i p/frames/000000.png -i p/right/000000.png -filter_complex vstack above.png
  expect 0 organbake stereo beside.png --calibration k.yml -o beside
  expect_same one/depth/000000.exr beside/depth/beside.exr
  expect 0 organbake stereo above.png --calibration k.yml --layout top-bottom -o above
  expect_same one/depth/000000.exr above/depth/above.exr
  for eye in frames right; do
    ffmpeg -v error -framerate 5 -i p/$eye/%06d.png -c:v ffv1 $eye.mkv
  done
  expect 0 organbake stereo frames.mkv right.mkv --calibration k.yml --every 2 -o videos
  expect_equal "$(figure frames_read videos/report.json)" 2
  expect_equal "$(figure frames_matched videos/report.json)" 1
  ffmpeg -v error -framerate 5 -i p/frames/%06d.png -framerate 5 -i p/right/%06d.png \
    -filter_complex hstack -c:v ffv1 both.mkv
  refused 65 "two like pictures" organbake motion both.mkv -o made
  expect 0 organbake stereo both.mkv --calibration k.yml -o both
  expect_same videos/depth/000000.exr both/depth/000000.exr
  ffmpeg -v error -framerate 2 -i p/right/%06d.png -c:v ffv1 slower.mkv
  expect 65 organbake stereo frames.mkv slower.mkv --calibration k.yml -o drifting
  expect_err "drift apart in time"
else
  echo "SKIPPED: no ffmpeg to make videos with"
fi
expect_equal "$(leftovers "$WORK")" ""
