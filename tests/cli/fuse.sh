#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Depth maps with poses to one surface: from files and folders, coloured, refined; what does not
# belong together is refused in words.
source "$(dirname "$0")/assert.sh"

refuse() { refused "$1" "$2" organbake fuse "${@:3}" -o made; }
figure() { python3 -c 'import json, sys; print(json.load(open(sys.argv[2]))["report"]["figures"][sys.argv[1]])' "$1" "$2"; }

# The phantom's laparoscopy as it truly is: depth maps and the cameras of the same clip.
expect 0 organbake phantom --kind laparoscopy --frames 6 --frame-width-px 240 --frame-height-px 180 \
  --no-instrument -o p
expect 0 organbake fuse p/truth --poses p/cameras.json --pictures p/frames --light camera \
  -o made.ply --json
cp out fused.json
[ -s made.ply ] || fail "made.ply is missing"
expect_equal "$(figure depth_maps fused.json)" 6
expect_equal "$(figure pictures fused.json)" 6
expect_equal "$(figure closed_manifold fused.json)" False
python3 - <<'END' || fail "the maps of one scene lie apart, or most of it has no colour"
import json
f = json.load(open("fused.json"))["report"]["figures"]
assert f["apart_mm"] < 0.2 and f["colored_share"] > 0.9 and f["faces"] > 2000, f
END
expect 0 organbake inspect made.ply

# The same bytes for any number of threads, and whether files or their folder are given.
expect 0 organbake fuse p/truth/*.exr --poses p/cameras.json --pictures p/frames --light camera \
  --threads 1 --force -o again.ply
cmp -s made.ply again.ply || fail "files, or one thread, give another surface than their folder"

# Poses of other programs; poses that are off.
python3 - <<'END'
import json
document = json.load(open("p/cameras.json"))
turned = json.loads(json.dumps(document))
for i, c in enumerate(turned["cameras"]):
    c["camera_from_world"]["translation_mm"][i % 3] += 0.6 if i % 2 else -0.6
json.dump(turned, open("off.json", "w"))
far = json.loads(json.dumps(document))
far["cameras"][1]["camera_from_world"]["translation_mm"][0] += 900
json.dump(far, open("far.json", "w"))
few = json.loads(json.dumps(document))
few["cameras"].pop()
for c, name in zip(few["cameras"], "abcde"): c["name"] = name
json.dump(few, open("few.json", "w"))
frames = []
for i, c in enumerate(document["cameras"]):
    r, t = c["camera_from_world"]["rotation"], c["camera_from_world"]["translation_mm"]
    m = [[r[k][j] * (1 if k == 0 else -1) for k in range(3)] +
         [-sum(r[k][j] * t[k] for k in range(3))] for j in range(3)] + [[0, 0, 0, 1]]
    frames.append({"file_path": f"frames/{i:06d}.png", "w": c["width"], "h": c["height"],
                   "fl_x": c["fx"], "fl_y": c["fy"], "cx": c["cx"], "cy": c["cy"],
                   "transform_matrix": m})
json.dump({"frames": frames}, open("p/transforms.json", "w"))
END
expect 0 organbake fuse p/truth --poses p/transforms.json --light camera -o nerf.ply --json
expect_equal "$(figure pictures out)" 6
expect 0 organbake fuse p/truth --poses off.json --refine -o refined.ply --json
python3 - <<'END' || fail "refine does not bring the depth maps together"
import json
f = json.load(open("out"))["report"]["figures"]
assert f["apart_mm"] < 0.5 * f["apart_before_mm"], f
END
[ -s refined_cameras.json ] || fail "the refined cameras are not written"
expect 0 organbake verify refined_cameras.json
expect 0 organbake fuse p/truth --poses p/cameras.json --holes closed -o closed.ply --json
expect_equal "$(figure closed_manifold out)" True

# What shade writes, metric, with its confidence; a bundle takes the surface.
expect 0 organbake shade p/frames p/cameras.json --halvings 0 --range-mm 55 -o s
expect 0 organbake fuse s --poses p/cameras.json -o shaded.ply
cat >r.yaml <<END
schema: organbake/recipe/1
name: fused
inputs: {surface: made.ply}
decimate: {faces: 80}
mechanics: {anchor_direction: [0, 0, 1]}
place: {count: 3, size_px: 64, cone_axis: [0, 0, -1], cone_angle_deg: 17.2}
END
expect 0 organbake bake r.yaml -o bundle
mv made.ply first.ply

# Maps are named as their frames, at half the size of the lens, with their own pictures; a frame
# without a pose is left out, and said.
mkdir named
for i in 0 1 2 3 4 5; do cp p/frames/00000$i.png named/scope_$((7 + i)).png; done
python3 - <<'END'
import json
document = json.load(open("p/cameras.json"))
for i, c in enumerate(document["cameras"]):
    c["name"] = c["image"] = f"scope_{7 + i}.png"
document["cameras"].reverse()
json.dump(document, open("by_image.json", "w"))
document["cameras"].pop()
json.dump(document, open("few_images.json", "w"))
for c in document["cameras"]:
    c["name"] = c["image"] = f"{c['image'][6:-4].zfill(6)}.png"
json.dump(document, open("by_number.json", "w"))
END
expect 0 organbake shade named p/cameras.json --halvings 1 --range-mm 55 -o half
[ -s half/depth/scope_9.exr ] && [ -s half/pictures/scope_9.png ] || fail "maps lack their frames' names"
expect 0 organbake fuse half --poses by_image.json -o half.ply --json
expect_equal "$(figure pictures out)" 6
expect_equal "$(figure depth_maps out)" 6
expect 0 organbake fuse half --poses few_images.json -o without.ply --json
expect_err "1 depth maps without a pose were left out; the first is scope_7.exr"
expect_equal "$(figure depth_maps out)" 5
expect 0 organbake fuse half --poses by_number.json -o numbered.ply
expect_err "by the numbers in their names: scope_8 is"
cmp -s without.ply numbered.ply || fail "numbers find other poses than names"

# Poses of no unit, as COLMAP has them, with metric and with relative depth: the same surface.
python3 - <<'END'
import json
document = json.load(open("p/cameras.json"))
for c in document["cameras"]:
    t = c["camera_from_world"]["translation_mm"]
    c["camera_from_world"]["translation_mm"] = [v / 7.3 for v in t]
json.dump(document, open("p/unitless.json", "w"))
END
expect 0 organbake fuse p/truth --poses p/cameras.json -o as_given.ply --json
python3 -c 'import json; assert "scale_of_places" not in json.load(open("out"))["report"]["figures"]' \
  || fail "a scale is sought where one unit is given"
area=$(figure area_mm2 out)
expect 0 organbake fuse p/truth --poses p/unitless.json -o scaled.ply --json
expect_err "the poses are in another unit"
python3 - "$area" <<'END' || fail "poses of no unit give another surface"
import json, sys
f = json.load(open("out"))["report"]["figures"]
assert abs(f["scale_of_places"] / 7.3 - 1) < 0.02, f
assert abs(f["area_mm2"] / float(sys.argv[1]) - 1) < 0.03, f
END
[ -s scaled_cameras.json ] || fail "the scaled cameras are not written"
expect 0 organbake shade p/frames p/cameras.json --halvings 1 -o relative
for scale in auto one each; do
  expect 0 organbake fuse relative --poses p/cameras.json --scale $scale -o relative.ply
  expect_err "the depth maps are relative"
done
refuse 65 "another unit" relative --poses p/cameras.json --scale given

# Both eyes, rectified: stereo's maps are of its own camera, the poses of the left eye as it is.
expect 0 organbake phantom --kind laparoscopy --frames 4 --baseline-mm 4.5 --tilt-deg 22.9 --texture 0.3 \
  --frame-width-px 360 --frame-height-px 288 --no-instrument -o both
python3 - <<'END'
import json
rig = json.load(open("both/stereo.json"))
for c in rig["cameras"]:  # so little that it moves no pixel, but the pictures are rectified
    c["distortion_k1_k2_p1_p2_k3"] = [1e-6, 0, 0, 0, 0]
json.dump(rig, open("bent.json", "w"))
END
expect 0 organbake stereo both/frames both/right --calibration bent.json -o rectified
expect 0 organbake fuse rectified --poses both/cameras.json -o stereo.ply --json
expect_equal "$(figure pictures out)" 4
python3 - <<'END' || fail "stereo's maps do not lie on each other"
import json
f = json.load(open("out"))["report"]["figures"]
assert f["apart_mm"] < 0.6 and f["colored_share"] > 0.9, f
END

# COLMAP's poses of the shared clip with what shade makes of its frames.
DATA=${ORGANBAKE_SHARED_DATA:-$SOURCE/../shared/data}
if [ -d "$DATA/video/colmap_model" ]; then
  expect 0 organbake shade "$DATA/video/laparoscopy_720p_25fps.mp4" "$DATA/video/colmap_model" \
    --every 50 --halvings 2 -o clip
  expect 0 organbake fuse clip --poses "$DATA/video/colmap_model" -o clip.ply --json
  expect_err "000000 is frame_0000"
  expect_equal "$(figure depth_maps out)" 5
  expect_equal "$(figure pictures out)" 5
else
  echo "SKIPPED: $DATA/video/colmap_model is missing"
fi

# What does not belong together.
expect 0 organbake phantom --kind laparoscopy --frames 1 --frame-width-px 120 --frame-height-px 120 -o small
refuse 65 "120x120, its camera 240x180" small/truth/000000.exr p/truth/000001.exr p/truth/000002.exr \
  p/truth/000003.exr p/truth/000004.exr p/truth/000005.exr --poses p/cameras.json
refuse 65 "another unit" p/truth --poses p/cameras.json --unit m
refuse 65 "sees nothing that another depth map sees" p/truth --poses far.json
refuse 65 "holds 5 cameras" p/truth --poses few.json
refuse 65 "is no depth map" p/frames/*.png --poses p/cameras.json
refuse 65 "holds no depth map" p/frames --poses p/cameras.json
refuse 66 "no such file" none.exr --poses p/cameras.json
refuse 66 "no such file" p/truth --poses none.json
refuse 2 "lacks its input 'poses'" p/truth
refuse 2 "lacks its input 'depth'" --poses p/cameras.json
refuse 2 "voxels; at most" p/truth --poses p/cameras.json --voxel-mm 0.03
expect_equal "$(leftovers "$WORK")" ""
