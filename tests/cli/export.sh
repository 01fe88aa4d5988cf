#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A bundle for other programs, read back by what reads such files.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o organ --no-report --set bundle.surface=true
for format in gltf colmap transforms obj usd sofa; do
  expect 0 organbake export organ --format $format -o $format
  expect 0 organbake export organ --format $format -o again_$format --threads 1
  expect_same $format again_$format
done
expect 0 organbake inspect obj/organ.obj --unit m
expect 0 organbake inspect gltf/organ.glb
python3 "$SOURCE/tests/cli/read_exports.py" organ || fail "an export"
python3 "$SOURCE/tests/cli/read_assets.py" organ usd sofa || fail "an asset with springs"
expect 0 organbake bake r.yaml -o solid --no-report --set mechanics.fem=true
for format in usd sofa; do expect 0 organbake export solid --format $format -o solid_$format; done
python3 "$SOURCE/tests/cli/read_assets.py" solid solid_usd solid_sofa || fail "an asset with tetrahedra"
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
