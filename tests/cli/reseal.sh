#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Maps edited by hand: taken over by reseal after every check, refused in one sentence otherwise.
source "$(dirname "$0")/assert.sh"
quick_recipe >r.yaml
expect 0 organbake bake r.yaml -o organ --no-report
expect 0 organbake bake r.yaml -o painted --no-report --set capture.rays_per_texel_side=3
expect 0 organbake bake r.yaml -o small --no-report --set place.size_px=32
cp -r organ good
expect 0 organbake reseal organ
expect_out "nothing was changed"
expect_same organ good

# A map with other colours of the same size stands for a painted one.
cp painted/cam_002/color.exr organ/cam_002/
expect 65 organbake verify organ
expect_err "organbake reseal"
expect 0 organbake reseal organ --json
expect_out '"cam_002/color.exr"'
expect 0 organbake verify organ
expect 0 organbake verify organ/manifest.json
expect 0 organbake inspect organ
expect_out "cam_002/color.exr"
expect_equal "$(cd good && sha256sum cam_000/color.exr proxy.ply)" \
  "$(cd organ && sha256sum cam_000/color.exr proxy.ply)"
if [ -x "$BIN/organplay" ]; then expect 0 "$BIN/organplay" organ --view-deg 0,0 -o frame.png --size 64x48; fi
expect 0 organbake reseal organ
expect_out "nothing was changed"

before=$(sha256sum <organ/manifest.json)
refused_reseal() {  # TEXT: and the manifest stays
  refused 65 "$1" organbake reseal organ
  expect_equal "$before" "$(sha256sum <organ/manifest.json)"
}
cp small/cam_001/color.exr organ/cam_001/
refused_reseal "its camera 48 × 48 pixels"
cp good/cam_001/depth.exr organ/cam_001/color.exr
refused_reseal "cam_001/color.exr"
cp good/cam_001/color.exr organ/cam_001/
echo "comment x" >>organ/proxy.ply
refused_reseal "proxy.ply: was changed"
cp good/proxy.ply organ/
cp good/cam_000/color.exr organ/cam_000/color.exr.bak
refused_reseal "color.exr.bak"
rm organ/cam_000/color.exr.bak
expect 0 organbake reseal organ
expect 2 organbake reseal
expect 66 organbake reseal nothing
expect_equal "" "$(leftovers .)"
