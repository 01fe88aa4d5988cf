#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Frames, folders and videos as users have them: depth, masks and a surface; damaged clips keep what
# was read.
source "$(dirname "$0")/assert.sh"
DATA=${ORGANBAKE_SHARED_DATA:-$SOURCE/../shared/data}

figure() { python3 -c 'import json, sys; print(json.load(open(sys.argv[2]))["figures"][sys.argv[1]])' "$1" "$2"; }

# A phantom clip with truth, as a folder of frames with its camera.
expect 0 organbake phantom --kind laparoscopy --frames 4 --frame-width-px 320 --frame-height-px 240 -o p
expect 0 organbake shade p/frames p/cameras.json --halvings 0 --range-mm 55 -o s
for file in depth/000003.exr normals/000003.exr mask/000003.png confidence/000003.png strip.png \
  surface.ply report.json; do
  [ -s "s/$file" ] || fail "s/$file is missing"
done
expect_equal "$(figure frames_shaded s/report.json)" 4
expect_equal "$(figure frames_warm s/report.json)" 3
expect_equal "$(figure depth_unit s/report.json)" mm
expect 0 organbake verify s/report.json
expect 0 organbake inspect s/surface.ply --json
python3 -c 'import json; f = json.load(open("out"))["report"]["figures"] if "report" in json.load(open("out")) else json.load(open("out")); assert 30 < f["lowest_corner_mm"][2] < 70, f' \
  || fail "the surface does not lie where the range says"

# The surface has the tissue's own colour, with the light that it is seen in beside it; or the frame's.
[ -s s/albedo.png ] && [ -s s/lighting.json ] && [ -s s/photo/camera.json ] || fail "the light was not divided out"
python3 - <<END || fail "light is left in the albedo"
import json
f = json.load(open("s/report.json"))["figures"]
assert abs(f["falloff_in_albedo"]) < 0.5 * abs(f["falloff_in_frame"]), f
END
expect 0 organbake shade p/frames p/cameras.json --halvings 0 --range-mm 55 --keep-light -o lit
[ ! -e lit/albedo.png ] && [ ! -e lit/lighting.json ] || fail "a light is told that was kept"
cmp -s lit/surface.ply s/surface.ply && fail "--keep-light changes nothing"

# The same bytes for any number of threads.
expect 0 organbake shade p/frames p/cameras.json --halvings 0 --range-mm 55 --threads 1 --force -o t
expect_same s t

# One frame, no intrinsics: a stated field of view and a relative depth.
expect 0 organbake shade p/frames/000000.png -o one
expect_err "70 degrees"
expect_err "relative"
expect_equal "$(figure depth_unit one/report.json)" "relative, median 1"

# The other model; which frames; options that contradict or make no sense.
expect 0 organbake shade p/frames --model tsai-shah --every 2 -o ts
expect_equal "$(figure frames_shaded ts/report.json)" 2
expect 0 organbake shade p/frames --sharpest 4 --halvings 1 -o sharp
expect_equal "$(figure frames_blurred sharp/report.json)" 3
expect 2 organbake shade p/frames --sharpest 2 --every 2 -o x
expect_err "either every or sharpest"
expect 2 organbake shade p/frames --light-offset-mm 3,0,0 -o x
expect_err "--range-mm"

# Damaged clips: what was read is kept, 65 names the frame.
mkdir changed none
cp p/frames/000000.png changed/0.png
cp one/strip.png changed/1.png
expect 65 organbake shade changed -o kept
expect_err "frame 1"
expect_equal "$(figure frames_shaded kept/report.json)" 1
head -c 2000 p/frames/000001.png >changed/1.png
expect 65 organbake shade changed -o cut
expect_err "frame 1"
echo words >none/a.txt
expect 65 organbake shade none -o x
expect_err "no PNG, JPEG or EXR frames"
expect 66 organbake shade missing.mp4 -o x
echo "just words" >text.mp4
expect 65 organbake shade text.mp4 -o x
expect_err "text.mp4"
expect_gone x

# A clip to a bundle.
cat >r.yaml <<END
schema: organbake/recipe/1
name: small clip
inputs: {frames: p/frames, intrinsics: p/cameras.json}
shade: {range_mm: 55, every: 4, halvings: 1, mesh_step_px: 4}
decimate: {faces: 80}
mechanics: {anchor_direction: [0, 0, 1]}
place: {count: 3, size_px: 64, cone_axis: [0, 0, -1], cone_angle_deg: 17.2}
END
expect 0 organbake bake r.yaml -o bundle
expect 0 organbake verify bundle
grep -q '"scope"' bundle/lighting.json || fail "the clip's bundle has no light at the scope"
expect 0 organbake bake r.yaml --set shade.keep_light=true -o kept_bundle
[ ! -e kept_bundle/lighting.json ] || fail "a bundle whose light was kept has one to light it by"
expect 0 "$BIN/organplay" bundle --view-deg 0,0 --size 96x96 -o view.png

# Videos that ffmpeg makes: whole, cut, empty, of changing size.
if command -v ffmpeg >/dev/null; then
  ffmpeg -v error -framerate 5 -i p/frames/%06d.png -c:v mpeg4 -q:v 2 clip.avi
  expect 0 organbake shade clip.avi --halvings 1 -o v
  expect_equal "$(figure frames_read v/report.json)" 4
  head -c $(($(stat -c %s clip.avi) * 6 / 10)) clip.avi >half.avi
  expect 65 organbake shade half.avi --halvings 1 -o h
  expect_err "frame "
  ffmpeg -v error -f lavfi -i testsrc=s=64x48:d=1:r=5 -frames:v 0 -c:v mpeg4 empty.avi 2>/dev/null || true
  [ -e empty.avi ] && { expect 65 organbake shade empty.avi -o x; }
  ffmpeg -v error -framerate 5 -i p/frames/%06d.png -c:v mpeg2video -q:v 3 -f mpeg2video a.m2v
  ffmpeg -v error -framerate 5 -i p/frames/%06d.png -vf scale=160:120 -c:v mpeg2video -q:v 3 -f mpeg2video b.m2v
  cat a.m2v b.m2v >grown.m2v
  expect 65 organbake shade grown.m2v --halvings 1 -o g
  expect_err "160x120"
  [ "$(figure frames_shaded g/report.json)" -ge 2 ] || fail "the frames before the change are not kept"

  # A playlist under a video's name leads to other files, which no cache would look at.
  printf '#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:1,\n%s/a.m2v\n#EXT-X-ENDLIST\n' "$PWD" >playlist.mp4
  printf 'ffconcat version 1.0\nfile a.m2v\n' >concat.mp4
  for list in playlist concat; do
    expect 65 organbake shade $list.mp4 --halvings 1 -o x
    expect_err "not a file that holds its own pictures"
  done

  # What is transparent is as black in a video as in a picture.
  ffmpeg -v error -i p/frames/000000.png -vf "format=rgba,geq=r='r(X,Y)':g='g(X,Y)':b='b(X,Y)':a='255*gte(X,W/2)'" half.png
  ffmpeg -v error -loop 1 -i half.png -frames:v 2 -c:v png -pix_fmt rgba half.mov
  expect 0 organbake shade half.png --halvings 0 -o picture
  expect 0 organbake shade half.mov --halvings 0 -o video
  cmp -s picture/mask/half.png video/mask/000000.png || fail "alpha counts in a PNG and not in a MOV"

  # A palette's dither is no comb of two fields.
  ffmpeg -v error -framerate 5 -i p/frames/%06d.png -vf "split[a][b];[a]palettegen[p];[b][p]paletteuse" dithered.gif
  expect 0 organbake shade dithered.gif --halvings 1 -o gif
  grep -q interlaced err && fail "dither is taken for interlaced video"

  # A logo that stands in a clip that moves is no tissue, which is said; nothing else changes.
  expect 0 organbake phantom --kind laparoscopy --path slide --frames 12 --frame-width-px 320 --frame-height-px 240 --no-instrument -o m
  mkdir logo
  ffmpeg -v error -framerate 5 -i m/frames/%06d.png -vf "drawbox=120:100:60:40:color=white:t=fill,drawbox=130:110:20:20:color=blue:t=fill" logo/%06d.png
  expect 0 organbake shade logo --every 6 --halvings 0 --range-mm 60 -o laid
  expect_err "a recorder has laid"
  python3 - <<END || fail "the logo is not what is left out"
import json
share = json.load(open("laid/report.json"))["figures"]["inset_share"]
assert 0.98 * 2400 / 76800 <= share <= 1.2 * 2400 / 76800, share
END
  expect 0 organbake shade m/frames --every 6 --halvings 0 --range-mm 60 -o not_laid
  expect_equal "$(figure inset_share not_laid/report.json)" 0
  grep -q "a recorder has laid" err && fail "an inset is seen where there is none"
else
  echo "SKIPPED: no ffmpeg to make videos with"
fi

# The real clip.
clip=$DATA/video/laparoscopy_720p_25fps.mp4
if [ -e "$clip" ]; then
  expect 0 organbake shade "$clip" --every 50 --halvings 2 --range-mm 60 -o real
  expect_equal "$(figure frames_read real/report.json)" 250
  expect_equal "$(figure frames_shaded real/report.json)" 5
else
  echo "SKIPPED: $clip is missing"
fi
expect_equal "$(leftovers "$WORK")" ""
