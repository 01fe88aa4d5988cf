#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Surfaces as people have them, in their units and axes, wound inward or overlapping, lie where they
# should and bake as others do; what export writes comes back where it was.
source "$(dirname "$0")/assert.sh"
python3 "$SOURCE/tests/cli/write_surfaces.py" . || fail "the surfaces"
cat >r.yaml <<END
schema: organbake/recipe/1
name: small
decimate: {faces: 60, method: quadric}
place: {count: 4, size_px: 48}
bundle: {surface: true}
END
export ORGANBAKE=$BIN/organbake
bake() { expect "$1" organbake bake r.yaml -o "$2" --no-report --set surface="$3" "${@:4}"; }
# in_place FILE MORE…: its volume is the organ's within 1e-5, its box within 0.001 mm.
in_place() {
  expect 0 organbake inspect "$@" --json
  python3 - "$@" <<'PY' || fail "not in its place: $*"
import json
told, right = json.load(open("out")), json.load(open("organ.json"))
assert abs(told["volume_ml"] / right["volume_ml"] - 1) < 1e-5, told["volume_ml"]
for corner in ("lowest_corner_mm", "highest_corner_mm"):
    off = max(abs(a - b) for a, b in zip(told[corner], right[corner]))
    assert off < 1e-3, (corner, told[corner], right[corner])
PY
}

expect 0 organbake inspect organ.ply --json
cp out organ.json
for file in organ_ras.{obj,ply,stl,vtk,vtp} organ_lps.obj organ_m.glb organ_cm_said.obj; do in_place $file; done
in_place organ_cm.obj --unit cm
in_place organ_mm.glb --unit mm
in_place organ_plain_ras.obj --space RAS
in_place organ_plain_ras.obj --space ras
in_place organ_y_up.obj --space y-up --unit in
expect 0 organbake inspect organ_mm.glb
expect_err "--unit mm;"
expect 65 organbake inspect organ_las.obj
expect_err "SPACE=LAS"
expect 2 organbake decimate organ.ply --unit km -o made
expect_err "one of auto, mm, cm, in, m"

# Whichever stage reads it.
in_place organ_inward.ply
expect_err "1 piece that was wound inside out turned outward"
bake 0 right organ.ply
bake 0 inward organ_inward.ply
expect_err "decimate: organ_inward.ply: 1 piece that was wound inside out turned outward"
in_place inward/surface.ply
# A sheet is shown by the side that its faces look from; the other one has nothing to show.
bake 0 front sheet.ply --set place.cone_axis=0,0,1 --set place.cone_angle_deg=17
bake 65 back sheet.ply --set place.cone_axis=0,0,-1 --set place.cone_angle_deg=17
expect_err "see it from behind"
expect_gone back

# One unit for the input, wherever it is read.
for setting in unit=cm capture.unit=cm decimate.unit=cm; do
  bake 0 "by_$setting" organ_cm.obj --set $setting
  ! grep "says itself that it is in" err || fail "a file of our own is told to say its unit"
  in_place "by_$setting/surface.ply"
  python3 - "by_$setting" <<'PY' || fail "$setting: the maps"
import json, sys
bound = [{s["stage"]: s["figures"] for s in json.load(open(f"{b}/report.json"))["stages"]}["capture"]["bound_in_prism"]
         for b in ("right", sys.argv[1])]
assert abs(bound[1] / bound[0] - 1) < 0.02, bound
PY
done
bake 0 by_flag organ_cm.obj --unit cm
expect_same by_flag by_unit=cm
bake 0 repaired organ_cm.obj --unit cm --repair auto
in_place repaired/surface.ply
bake 0 by_space organ_plain_ras.obj --space RAS
in_place by_space/surface.ply
bake 78 made organ_cm.obj --set unit=cm --set capture.unit=m
expect_err 'capture.unit is "m", but inputs.unit is "cm"'
printf 'case,surface,unit\na,organ_cm.obj,cm\n' >cases.csv
expect 0 organbake batch cases.csv --recipe r.yaml -o cases --set decimate.faces=60
in_place cases/a/surface.ply

# There and back; --faces 0 writes the base layer's surface whole.
expect 0 organbake export right --format gltf -o gltf --faces 0
expect 0 organbake export right --format obj -o obj --faces 0
expect 0 organbake inspect gltf/organ.glb --json
cp out organ.json
in_place obj/organ.obj
in_place obj/organ.obj --unit mm --space LPS
python3 - <<'PY' || fail "the export lies elsewhere than its organ"
import json, subprocess, os
box = lambda t: [(a + b) / 2 for a, b in zip(t["lowest_corner_mm"], t["highest_corner_mm"])]
export = json.load(open("organ.json"))
program = os.environ["ORGANBAKE"]
organ = json.loads(subprocess.check_output([program, "inspect", "organ.ply", "--json", "--quiet"]))
assert max(abs(a - b) for a, b in zip(box(export), box(organ))) < 2, (box(export), box(organ))
PY

# What overlaps counts once.
expect 0 organbake repair two_balls.ply -o united.ply
expect_err "2 overlapping pieces united"
expect 0 organbake inspect united.ply --json
python3 -c 'import json; v = json.load(open("out"))["volume_ml"]; assert abs(v / 190.85 - 1) < 0.01, v' || fail "the union: $(cat out)"
expect 65 organbake repair two_sizes.ply --island-share 0.5 -o made
expect_err "the volume changes by"
expect_gone made
expect 0 organbake repair two_sizes.ply --island-share 0.5 --volume-change 0.2 -o one.ply
