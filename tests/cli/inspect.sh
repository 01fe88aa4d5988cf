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
python3 -c 'import json; assert all(c["ok"] for c in json.load(open("out")).values())' || fail doctor
