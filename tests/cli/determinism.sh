#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The same bytes for any number of threads, on a second run, from another folder, in another locale
# and time zone; and nothing of this machine in them.
source "$(dirname "$0")/assert.sh"
small_recipe >r.yaml

expect 0 organbake bake r.yaml -o one --threads 1 --cache c1
expect 0 organbake bake r.yaml -o two --threads 2 --cache c2
expect_same one two
mkdir elsewhere && cp r.yaml elsewhere/recipe.yaml
expect 0 env -C elsewhere LC_ALL=C.UTF-8 TZ=Asia/Tokyo "$BIN/organbake" bake recipe.yaml -o b --cache c
expect_same one elsewhere/b
grep -rlF "$WORK" one && fail "a path of this machine is in the bundle"

# And the stages on their own give the bytes of the recipe.
small_phantom p
expect 0 organbake isosurface p/ct.mha -o surface.ply
expect 0 organbake decimate surface.ply --faces 60 -o proxy.ply
expect 0 organbake mechanics proxy.ply -o mechanics.json
expect 0 organbake place surface.ply --count 4 --size-px 48 -o cams
expect 0 organbake capture surface.ply proxy.ply cams/cameras.json --photos p/photos/cameras.json -o maps
for file in proxy.ply mechanics.json; do expect_same $file one/$file; done
expect_same cams/cameras.json one/cameras.json
for file in base.exr cam_000/depth.exr cam_001/color.exr cam_002/micro.exr cam_003/color.exr; do
  expect_same maps/$file one/$file
done
# Through a cache of their own as well as through the bake's.
expect 0 organbake decimate surface.ply --faces 60 -o cached.ply --cache c1 --json
expect_out '"state": "cached"'
expect_same cached.ply proxy.ply
