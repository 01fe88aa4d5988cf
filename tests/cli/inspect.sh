#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# inspect tells what every kind of file holds, to people and to programs.
source "$(dirname "$0")/assert.sh"
small_phantom p
small_recipe >r.yaml
expect 0 organbake bake r.yaml -o b

expect 0 organbake inspect p/ct.mha
expect_out "size_voxels             40,40,16"
expect_out "spacing_mm              1,1,3"
expect_out "orientation"
expect 0 organbake inspect p/truth.ply
expect_out "faces                   1280"
expect_out "closed_manifold         true"
expect_out "holes                   0"
expect_out "self_intersecting_faces 0"
expect_out "suspected_unit          mm"
# Two boxes that run into each other, one of them without a lid, in metres.
python3 - <<'PY'
def box(low, high, faces):
    corners = [[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)]
    return corners, faces
all_faces = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
             (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]
with open("two.obj", "w") as obj:
    first = 1
    for low, high, faces in (((0, 0, 0), (.1, .1, .1), all_faces), ((.05, .02, .03), (.2, .08, .07), all_faces[2:])):
        for i in range(8):
            print("v", *((low, high)[i >> k & 1][k] for k in range(3)), file=obj)
        for f in faces:
            print("f", *(first + v for v in f), file=obj)
        first += 8
PY
expect 0 organbake inspect two.obj
expect_out "suspected_unit          m"
expect_out "components              2"
expect_out "holes                   1"
grep -q "self_intersecting_faces [1-9]" out || fail "boxes that meet: $(cat out)"
expect_err "--unit m"
expect 0 organbake inspect two.obj --unit m
expect_out "suspected_unit          m"
expect_out "highest_corner_mm       200,100,100"
expect 0 organbake inspect b
expect_out "cameras                 4"
expect_out "map_size                48,48"
expect_out "skin                    smooth, carried by the proxy"
expect_out "light                   fixed in the world"
expect 0 organbake inspect b/cam_000/depth.exr
expect_out "channels                Y,Z"
expect 0 organbake inspect b/cameras.json
expect_out "schema                  cameras"
expect 0 organbake inspect r.yaml
expect_out "name                    small"
for thing in p/ct.mha p/truth.ply b b/base.exr b/mechanics.json r.yaml; do
  expect 0 organbake inspect $thing --json
  python3 -c 'import json; json.load(open("out"))["kind"]' || fail "$thing: no JSON with a kind"
done
expect 73 organbake doctor --cache /proc/none
expect_out "name another by --cache or ORGANBAKE_CACHE"
expect 0 organbake doctor --json
python3 -c 'import json; checks = json.load(open("out"))
assert all(c["ok"] for c in checks.values()) and checks["system"]["finding"]' || fail doctor

# Versions, of the libraries too; and an installation that lacks a stage's module.
expect 0 organbake --version --json
python3 - <<'PY' || fail "the versions: $(cat out)"
import json, re
told = json.load(open("out"))
assert {"VTK", "OpenCV", "CGAL", "Embree", "GDCM", "OpenEXR"} <= told["libraries"].keys(), told
for name in ("organbake", "VTK", "CGAL"):
    assert re.match(r"\d+\.\d+(\.\d+)?$", told.get(name) or told["libraries"][name]), name
PY
mkdir -p broken/bin broken/lib/organbake
cp "$BIN/organbake" broken/bin/
ln -s "$BIN"/../lib/organbake/{stage_,organbake_}*.so broken/lib/organbake/
expect 0 broken/bin/organbake doctor
rm broken/lib/organbake/stage_place.so
expect 70 broken/bin/organbake doctor
expect_out "BAD  modules"
expect_out "stage_place.so"
expect_out "'scripts/setup --programs'"
PATH=$WORK/nowhere expect 70 "$WORK/broken/bin/organbake" doctor
expect_out "--   ffmpeg: missing: organplay --video needs it; 'apt-get install ffmpeg'"
