#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A moving scope's clip becomes one surface: poses and depth against the phantom's truth; clips that
# tell no shape are declined in words, and a bake of theirs goes on with shading.
source "$(dirname "$0")/assert.sh"

# 640 × 360: 36 frames of a slide, a scope that stands still, a pure turn.
clip() {
  expect 0 organbake phantom --kind laparoscopy --frame-width-px 640 --frame-height-px 360 "$@"
}
clip --path slide --frames 36 -o slide
clip --path still --frames 12 -o still
clip --path turn --frames 24 -o turn

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

# A length that is known makes the scene that large, and it is said how sure that is.
for mm in 10 20; do
  expect 0 organbake motion slide/frames --intrinsics slide/cameras.json --halvings 2 --key-frames 3 \
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
refused 2 "no pose" organbake motion slide/frames --intrinsics slide/cameras.json --halvings 2 \
  --key-frames 3 --known-distance 900,240,150,420,210,10 -o made
refused 65 "no key frame shows a straight shaft" organbake motion slide/frames \
  --intrinsics slide/cameras.json --halvings 2 --key-frames 3 --shaft-mm 5 -o made

# The maps go on to fuse.
expect 0 organbake fuse moved --poses moved/cameras.json --light camera -o fused.ply

mkdir mixed
cp still/frames/00000[0-5].png mixed
expect 0 organbake phantom --kind laparoscopy --frames 1 --frame-width 160 --frame-height 120 -o small
cp small/frames/000000.png mixed/000003.png
refused 65 "frame 3: is 160x120" organbake motion mixed -o made
refused 65 "160x120" organbake motion still/frames --intrinsics small/cameras.json -o made
refused 65 "stands still" organbake motion still/frames -o made
refused 65 "motion" organbake motion turn/frames -o made
refused 65 "too short" organbake motion still/frames/000000.png -o made
refused 66 "none.mp4" organbake motion none.mp4 -o made
refused 2 "intrinsics" organbake motion slide/frames --poses slide/cameras.json -o made

# The recipe takes what the clip tells by, and says so.
recipe=$SOURCE/pipelines/recipes/laparoscopy.yaml
expect 0 organbake bake "$recipe" --quality draft --set frames=slide/frames \
  --set intrinsics=slide/cameras.json --set motion.key_frames=4 -o tissue
grep -q '"stage": "motion"' tissue/report.json || fail "a moving clip was not taken by motion"
# A surface that is open and hollow can be poked, too.
expect 0 "$BIN/organplay" tissue --size 320x240 --sheet sheet.png
expect 0 organbake bake "$recipe" --quality draft --set frames=still/frames \
  --set intrinsics=still/cameras.json -o flat
expect_err "the scope stands still"
grep -q '"stage": "shade"' flat/report.json || fail "a still clip was not shaded"
