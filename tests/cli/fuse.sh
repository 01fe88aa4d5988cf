#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Depth maps with poses to one surface: from files and folders, coloured, refined; what does not
# belong together is refused in words.
source "$(dirname "$0")/assert.sh"

figure() { python3 -c 'import json, sys; print(json.load(open(sys.argv[2]))["report"]["figures"][sys.argv[1]])' "$1" "$2"; }

# The phantom's laparoscopy as it truly is: depth maps and the cameras of the same clip.
expect 0 organbake phantom --kind laparoscopy --frames 6 --frame-width 240 --frame-height 180 \
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
place: {count: 3, size: 64, cone_axis: [0, 0, -1], cone_angle: 0.3}
END
expect 0 organbake bake r.yaml -o bundle

# What does not belong together.
rm -f made.ply
refuse() { refused "$1" "$2" organbake fuse "${@:3}" -o made; }
expect 0 organbake phantom --kind laparoscopy --frames 1 --frame-width 120 --frame-height 90 -o small
refuse 65 "120x90, its camera 240x180" small/truth/000000.exr p/truth/000001.exr p/truth/000002.exr \
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
refuse 2 "voxels; at most" p/truth --poses p/cameras.json --voxel 0.03
expect_equal "$(leftovers "$WORK")" ""
