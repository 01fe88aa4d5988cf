#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A bundle for other programs, read back by what reads such files.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o organ --no-report
for format in gltf colmap transforms obj; do
  expect 0 organbake export organ --format $format -o $format
  expect 0 organbake export organ --format $format -o again_$format --threads 1
  expect_same $format again_$format
done
expect 0 organbake inspect obj/organ.obj
python3 - <<'PY' || fail "an export"
import json, struct, pathlib
data = pathlib.Path("gltf/organ.glb").read_bytes()
length = struct.unpack_from("<I", data, 12)[0]
scene = json.loads(data[20:20 + length])
cameras = json.loads(pathlib.Path("organ/cameras.json").read_text())["cameras"]
assert len(scene["cameras"]) == len(cameras) == 4 and scene["nodes"][0]["scale"] == [0.001] * 3
frames = json.loads(pathlib.Path("transforms/transforms.json").read_text())["frames"]
assert [f["file_path"] for f in frames] == [f"images/cam_00{i}.png" for i in range(4)]
for frame in frames:
    assert pathlib.Path("transforms", frame["file_path"]).read_bytes().startswith(b"\x89PNG")
lines = [l for l in pathlib.Path("colmap/images.txt").read_text().splitlines() if l and l[0] != "#"]
assert [l.split()[-1] for l in lines] == [f"cam_00{i}.png" for i in range(4)]
assert all(pathlib.Path("colmap/images", l.split()[-1]).exists() for l in lines)
PY
expect 2 organbake export organ
expect_err "-o is missing"
expect 2 organbake export organ --format stl -o x
expect_err "gltf"
expect 66 organbake export nothing -o x
mkdir kept && echo mine >kept/file
expect 73 organbake export organ -o kept
grep -q mine kept/file || fail "a file was lost"
printf x | dd of=organ/cam_001/color.exr bs=1 seek=2000 conv=notrunc 2>/dev/null
expect 65 organbake export organ --format colmap -o x
expect_err "color.exr"
expect_gone x
expect_equal "" "$(leftovers .)"
