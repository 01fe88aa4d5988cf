#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A bundle for other programs, read back by what reads such files.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o organ --no-report --set bundle.surface=true --set mechanics.fem=false
for format in gltf colmap transforms obj usd sofa; do
  expect 0 organbake export organ --format $format -o $format
done
for format in gltf obj usd; do  # those that threads make textures for
  for threads in 0 1; do
    expect 0 organbake export organ --format $format -o by_$threads --texture-px 256 --threads $threads
  done
  expect_same by_0 by_1
  rm -r by_0 by_1
done
expect 0 organbake inspect obj/organ.obj --unit m
expect 0 organbake inspect gltf/organ.glb
# Once more into the same place, but not over what somebody else put there.
for format in gltf usd; do expect 0 organbake export organ --format $format -o $format; done
touch gltf/scene.blend
expect 73 organbake export organ --format gltf -o gltf
expect_err "holds scene.blend, which organbake did not write"
python3 "$SOURCE/tests/cli/read_exports.py" organ || fail "an export"
python3 "$SOURCE/tests/cli/read_assets.py" organ usd sofa || fail "an asset with springs"
expect 0 organbake bake r.yaml -o solid --no-report
for format in usd sofa; do expect 0 organbake export solid --format $format -o solid_$format --texture-px 256; done
python3 "$SOURCE/tests/cli/read_assets.py" solid solid_usd solid_sofa || fail "an asset with tetrahedra"
for format in mjcf gmsh; do
  expect 2 organbake export organ --format $format -o x
  expect_err "mechanics.fem=false"
  expect 0 organbake export solid --format $format -o solid_$format
done
expect_err "ml are tissue: those at the surface stick out of it"
# MuJoCo's model says how large it is, and how a coarser one is made.
expect 0 organbake export solid --format mjcf -o told_mjcf
expect_err " bodies and a step of "
grep -q '"mjcf_bodies": ' told_mjcf/report.json || fail "the report: $(cat told_mjcf/report.json)"
expect 0 organbake bake r.yaml -o many --no-report --set mechanics.fem_cell_mm=1.2
expect 0 organbake export many --format mjcf -o many_mjcf
expect_err "makes a coarser model"
many=$(grep -c '<body' many_mjcf/organ.xml)
coarse=$(sed -n 's/.*--set \(mechanics.fem_cell_mm=[0-9]*\).*/\1/p' err)
expect 0 organbake bake r.yaml -o fewer --no-report --set "$coarse"
expect 0 organbake export fewer --format mjcf -o fewer_mjcf
[ "$(grep -c '<body' fewer_mjcf/organ.xml)" -lt $((many / 2)) ] || fail "no coarser model"
python3 "$SOURCE/tests/cli/read_solids.py" solid solid_mjcf/organ.xml solid_gmsh/organ.msh || fail "a solid"
if command -v gmsh >/dev/null; then
  expect 0 gmsh -parse_and_exit solid_gmsh/organ.msh
  grep -q "Done reading" out err || fail "gmsh did not read the mesh"
  grep -qiE "warning|error" out err && fail "gmsh complains: $(cat out err)"
else
  echo "SKIPPED in part: there is no gmsh here (Debian: gmsh); the mesh was read by the test alone"
fi

# A recorded interaction as time samples; the other names beside them when they are asked for.
cat >press.json <<END
{"schema": "organbake/interaction/1", "name": "press", "time_step_s": 0.016666666666666666, "frames": 36,
 "solver": "fem", "size": [64, 48], "camera": {"keyframes": [{"frame": 0, "azimuth_rad": 0, "elevation_rad": 0}]},
 "instruments": [{"name": "probe", "mode": "poke", "path": [
   {"time_s": 0, "direction": [0, -1, 0], "depth_mm": -2}, {"time_s": 0.6, "direction": [0, -1, 0], "depth_mm": 9}]}]}
END
expect 0 organbake export solid --format usd -o moving --faces 500 --texture-px 64 --interaction press.json
recording=
if ls "$BIN"/../python/organplay/_organplay*.so >/dev/null 2>&1; then
  PYTHONPATH=$BIN/../python expect 0 /usr/bin/python3 "$SOURCE/tests/cli/record_press.py" solid press.json press.npz
  recording=press.npz
else
  echo "SKIPPED in part: without the Python module there is no recording to hold the samples against"
fi
PYTHONDONTWRITEBYTECODE=1 expect 0 /usr/bin/python3 "$SOURCE/tests/cli/read_assets.py" solid moving solid_sofa $recording
expect 0 organbake export solid --format usd -o vendor --faces 500 --texture-px 64 --vendor-names
for name in OmniPhysicsDeformableBodyAPI OmniPhysicsVolumeDeformableSimAPI omniphysics:restTetVtxIndices \
  PhysicsVolumeDeformableSimAPI; do
  grep -q "$name" vendor/organ.usda || fail "$name is not among the vendor's names"
done
expect 2 organbake export solid --format gltf -o x --interaction press.json
expect_err "--format usd"
expect 66 organbake export solid --format usd -o x --texture-px 64 --interaction nowhere.json
sed 's/"poke"/"cut", "axis_mm": [0, -20, 0]/' press.json >cut.json
expect 2 organbake export solid --format usd -o x --texture-px 64 --interaction cut.json
expect_err "cuts"
python3 -c 'import json; s = json.load(open("press.json")); s.update(instruments=[], vertices_mm=[[0, 0, 0]]); print(json.dumps(s))' >states.json
expect 2 organbake export solid --format usd -o x --texture-px 64 --interaction states.json
expect_err "vertices_mm"
expect_gone x
expect 0 organbake export organ --format gltf -o few --faces 100 --texture-px 512
expect_err "a texture of 512 × 512 texels"
expect 0 organbake export organ --format obj -o albedo --albedo
if cmp -s albedo/organ.png obj/organ.png; then fail "--albedo changed nothing"; fi
expect 2 organbake export organ --format gltf -o x --texture-px 10
expect 2 organbake export organ --format gltf -o x --faces 3
expect_err "at least 20"
expect_gone x
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
