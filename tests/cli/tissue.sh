#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Tissues by name and by example, and the lights they are drawn in, as users call them.
source "$(dirname "$0")/assert.sh"
organplay() { "$BIN/organplay" "$@"; }
small_phantom p

bake() {  # BUNDLE ARGUMENT…
  local bundle=$1
  shift
  cat >recipe.yaml <<'RECIPE'
schema: organbake/recipe/1
name: organ
isosurface: {iso: -470}
decimate: {faces: 80}
mechanics: {}
place: {count: 4, size_px: 64}
capture: {}
RECIPE
  expect 0 organbake bake recipe.yaml --set ct=p/ct.mha -o "$bundle" --quiet --no-report "$@"
}

# Every tissue bakes to a look of its own, and the plain material to what it was.
bake plain
bake named_plain --set capture.material=plain
expect_equal "$(sha256sum <plain/lighting.json)" "$(sha256sum <named_plain/lighting.json)"
grep -q '"organbake/lighting/1"' plain/lighting.json || fail "the plain material has a newer schema"
for tissue in liver gallbladder spleen kidney stomach fat silicone; do
  bake "$tissue" --set capture.material="$tissue"
  expect 0 organbake verify "$tissue"
  grep -qE '"organbake/lighting/[23]"' "$tissue/lighting.json" || fail "$tissue: no light at the scope"
  cmp -s plain/cam_000/color.exr "$tissue/cam_000/color.exr" && fail "$tissue looks plain"
done
expect 0 organbake schema lighting
refused 78 "one of plain" organbake bake recipe.yaml --set ct=p/ct.mha -o made \
  --set capture.material=granite
expect 2 organbake bake recipe.yaml --set ct=p/ct.mha -o made --quiet \
  --set capture.material=liver --set capture.feature_mm=3
expect_err "of the plain material"
expect_gone made

# Lights: what a bundle is made for, and what was asked for.
frame() { expect 0 organplay "$1" --size 160x120 -o "$2" --quiet "${@:3}"; }
frame liver usual.png
frame liver scope.png --light scope
frame liver world.png --light world
frame liver baked.png --light baked
expect_same usual.png scope.png
cmp -s scope.png world.png && fail "the light at the scope is the world's"
cmp -s scope.png baked.png && fail "the light at the scope is the baked one"
frame plain plain.png
frame plain plain_world.png --light world
expect_same plain.png plain_world.png
expect 2 organplay liver -o made --light sun
expect_gone made
expect 2 organplay liver -o made --light scope --warp paper
expect_err "--warp paper draws the baked light alone"
expect_gone made

# A script may name its light; who asks otherwise is heard.
script() {
  echo "{\"schema\": \"organbake/interaction/1\", \"name\": \"look\", \"time_step_s\": 0.02, \"frames\": 1, \"size\": [160, 120],
    $1 \"camera\": {\"keyframes\": [{\"frame\": 0, \"azimuth_rad\": 0, \"elevation_rad\": 0}]},
    \"instruments\": []}"
}
script '' >silent.json
script '"light": "world",' >world.json
script '"light": "moon",' >moon.json
play() { expect 0 organplay liver --script "$1" --out "$2" --no-instruments --quiet "${@:3}"; }
play silent.json silent
play silent.json silent_world --light world
play world.json by_script
play world.json by_flag --light scope
expect_same by_script/frame_0000.png silent_world/frame_0000.png
expect_same by_flag/frame_0000.png silent/frame_0000.png
cmp -s silent/frame_0000.png silent_world/frame_0000.png && fail "the script's light is not heard"
expect 65 organplay liver --script moon.json --out made --quiet
expect_err "moon.json: /light: is no light"
expect_gone made

# A bundle that does not know its light.
unlit=$WORK/unlit
expect 0 organbake bake recipe.yaml --set ct=p/ct.mha --set photos=p/photos/cameras.json \
  -o "$unlit" --quiet --no-report
frame "$unlit" unlit.png
expect 2 organplay "$unlit" -o made.png --light scope --quiet
expect_err "does not say in what light"
expect_gone made.png

# Colour by example: a photograph of the phantom that is large enough to copy from.
expect 0 organbake phantom -o large --size-voxels 32,32,16 --photos 1 --photo-size-px 400 --quiet
photo=$(ls large/photos/*.png | head -n 1)
bake example --set exemplar="$photo" --set capture.exemplar_mm_per_pixel=0.5
expect 0 organbake verify example
bake example_once_more --set exemplar="$photo" --set capture.exemplar_mm_per_pixel=0.5 --threads 1 \
  --force
expect_same example example_once_more
example() { refused "$1" "$2" organbake bake recipe.yaml --set ct=p/ct.mha -o made "${@:3}"; }
example 2 "needs --set capture.exemplar_mm_per_pixel=" --set exemplar="$photo"
example 2 "has no --set exemplar=… to be of" --set capture.exemplar_mm_per_pixel=0.5
example 66 "missing.png" --set exemplar=missing.png --set capture.exemplar_mm_per_pixel=0.5
example 65 "its exemplar" --set exemplar="$photo" --set exemplar_mask=usual.png \
  --set capture.exemplar_mm_per_pixel=0.5
