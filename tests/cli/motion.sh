#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A moving scope's clip becomes one surface: poses and depth against the phantom's truth; clips that
# tell no shape are declined in words, and a bake of theirs goes on with shading.
source "$(dirname "$0")/assert.sh"

# 640 × 360: 24 frames of a slide, and every second of them; smaller, a scope that stands still, and
# a pure turn.
clip() {
  expect 0 organbake phantom --kind laparoscopy --frame-width-px "$1" --frame-height-px "$2" "${@:3}"
}
clip 640 360 --path slide --frames 24 -o slide
clip 480 270 --path still --frames 10 -o still
clip 480 270 --path turn --frames 14 -o turn
mkdir few
cp slide/frames/*[02468].png few

expect 0 organbake motion slide/frames --intrinsics slide/cameras.json --halvings 0 --key-frames 6 \
  --range-mm 60 -o moved
for file in surface.ply lighting.json cameras.json points.ply motion.png colmap/images.txt; do
  [ -s "moved/$file" ] || fail "moved/$file is missing"
done
/usr/bin/python3 - <<'END' || fail "the scope's way is not the phantom's"
import json
import numpy as np
def centers(path):
    cameras = json.load(open(path))["cameras"]
    places = []
    for camera in cameras:
        pose = camera["camera_from_world"]
        turn = np.array(pose["rotation"], float).reshape(3, 3)
        places.append(-turn.T @ np.array(pose["translation_mm"], float))
    return np.array(places)
truth, found = centers("slide/cameras.json"), centers("moved/cameras.json")
assert len(found) == len(truth), (len(found), len(truth))
a, b = found - found.mean(0), truth - truth.mean(0)
u, s, vt = np.linalg.svd(b.T @ a)
d = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
scale = (s * np.diag(d)).sum() / (a ** 2).sum()
error = np.sqrt((((scale * (u @ d @ vt @ a.T)).T - b) ** 2).sum(1).mean())
extent = np.linalg.norm(truth.max(0) - truth.min(0))
# Features are followed to a third of a pixel; the issue asks for half a percent at twice the size.
assert error < 0.01 * extent, (error, extent)
END
expect 0 organbake motion slide/frames --intrinsics slide/cameras.json --halvings 0 --key-frames 6 \
  --range-mm 60 --threads 1 -o again
expect_same moved again

# The lens of a clip's first frame, by itself: CLIP/lens.json.
lens_of() {
  python3 - "$1" <<'END'
import json, sys
camera = json.load(open(sys.argv[1] + "/cameras.json"))["cameras"][0]
json.dump({k: camera[k] for k in ("width", "height", "fx", "fy", "cx", "cy")}, open(sys.argv[1] + "/lens.json", "w"))
END
}
lens_of slide

# A length that is known makes the scene that large, and it is said how sure that is.
for mm in 10 20; do
  expect 0 organbake motion few --intrinsics slide/lens.json --halvings 2 --key-frames 3 \
    --known-distance 0,240,150,420,210,$mm -o known_$mm
  expect_err "by known_distance to"
done
/usr/bin/python3 - <<'END' || fail "twice the distance is not twice the path"
import json
import numpy as np
def extent(path):
    places = []
    for camera in json.load(open(path))["cameras"]:
        pose = camera["camera_from_world"]
        places.append(-np.array(pose["rotation"], float).reshape(3, 3).T @ np.array(pose["translation_mm"], float))
    return np.linalg.norm(np.ptp(places, axis=0))
ratio = extent("known_20/cameras.json") / extent("known_10/cameras.json")
assert abs(ratio - 2) < 1e-6, ratio
END
refused 2 "FRAME,X1,Y1,X2,Y2,MM" organbake motion slide/frames --known-distance 1,2 -o made
refused 2 "no pose" organbake motion few --intrinsics slide/lens.json --halvings 2 \
  --key-frames 3 --known-distance 900,240,150,420,210,10 -o made
# Every other frame of a clip without an instrument. The gallbladder is pale and straight.
clip 640 360 --path slide --frames 24 --no-instrument -o bare
rm bare/frames/*[13579].png
refused 65 "no key frame shows a straight shaft" organbake motion bare/frames \
  --intrinsics slide/lens.json --halvings 2 --key-frames 3 --shaft-mm 5 -o made

# The maps go on to fuse.
expect 0 organbake fuse moved --poses moved/cameras.json --light camera -o fused.ply

# A surface is registered to a video by its motion: one pose for all of it, and what it drifts.
if command -v ffmpeg >/dev/null; then
  clip 480 270 --path slide --frames 14 --bit-rate-mbit-per-s 8 -o film
  lens_of film
  python3 - <<'END'
import json
document = json.load(open("film/cameras.json"))
camera = document["cameras"][0]
camera["camera_from_world"]["translation_mm"][0] += 4
camera["camera_from_world"]["translation_mm"][2] -= 3
document["cameras"] = [camera]
json.dump(document, open("film/start.json", "w"))
END
  code=0
  organbake register film/truth/surface.ply film/clip.mp4 --intrinsics film/lens.json \
    --init film/start.json -o span/pose.json --json >out 2>err || code=$?
  [ $code -eq 0 ] || [ $code -eq 3 ] || fail "exit code $code: $(cat err)"
  /usr/bin/python3 - <<'END' || fail "the video's span is not where the phantom has it"
import json
import numpy as np
report = json.load(open("out"))
text = json.dumps(report)
for figure in ("scene_frame", "drift_mm", "jitter_mm"):
    assert '"%s"' % figure in text, figure
def poses(cameras):
    return [(np.array(c["camera_from_world"]["rotation"], float).reshape(3, 3),
             np.array(c["camera_from_world"]["translation_mm"], float)) for c in cameras]
found = json.load(open("span/pose.json"))
found = found["cameras"] + found.get("left_out", [])
truth = poses(json.load(open("film/cameras.json"))["cameras"])
assert len(found) == len(truth), (len(found), len(truth))
sds = {c["registration"]["surface_sd_mm"] for c in found}
assert len(sds) == 1, sds  # one pose, moved with the scope
# Where the tissue's middle is seen; the issue asks for 2 mm of a real clip.
middle = np.array([0, 0, 60.0])
off = [np.linalg.norm((r @ middle + t) - (s @ middle + u))
       for (r, t), (s, u) in zip(poses(sorted(found, key=lambda c: c["image"])), truth)]
print("off", np.round(off, 2), "sd", sds)
assert max(off) < 2, off
assert max(off) < 3 * sds.pop(), off
END
else
  echo "SKIPPED: no ffmpeg to make videos with"
fi

mkdir mixed
cp still/frames/00000[0-5].png mixed
expect 0 organbake phantom --kind laparoscopy --frames 1 --frame-width-px 160 --frame-height-px 120 -o small
cp small/frames/000000.png mixed/000003.png
refused 65 "frame 3: is 160x120" organbake motion mixed -o made
refused 65 "160x120" organbake motion still/frames --intrinsics small/cameras.json -o made
refused 65 "stands still" organbake motion still/frames -o made
refused 65 "motion" organbake motion turn/frames -o made
refused 65 "too short" organbake motion still/frames/000000.png -o made
if command -v ffmpeg >/dev/null; then
  mkdir strobe  # every second frame of the slide is nearly dark
  ffmpeg -v error -i slide/frames/%06d.png -vf "lutrgb=r=val/8:g=val/8:b=val/8:enable='mod(n,2)'" -start_number 0 strobe/%06d.png
  refused 65 "brightness jumps" organbake motion strobe -o made
fi
refused 66 "none.mp4" organbake motion none.mp4 -o made
refused 2 "intrinsics" organbake motion slide/frames --poses slide/cameras.json -o made

# The recipe takes what the clip tells by, and says so.
recipe=$SOURCE/pipelines/recipes/laparoscopy.yaml
expect 0 organbake bake "$recipe" --quality draft --set frames=slide/frames \
  --set intrinsics=slide/cameras.json --set motion.key_frames=4 -o tissue
grep -q '"stage": "motion"' tissue/report.json || fail "a moving clip was not taken by motion"
# A surface that is open and hollow can be poked, too.
expect 0 "$BIN/organplay" tissue --size 320x240 --sheet sheet.png
[ ! -e tissue/breath.json ] || fail "tissue at rest breathes"

expect 0 organbake bake "$recipe" --quality draft --set frames=still/frames \
  --set intrinsics=still/cameras.json -o flat
expect_err "the scope stands still"
grep -q '"stage": "shade"' flat/report.json || fail "a still clip was not shaded"
